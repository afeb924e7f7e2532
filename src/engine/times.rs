//! How often stages ran, and how long it took.

use crate::stage::Stage;

/// What an engine gathers while it times stages.
#[derive(Clone, Debug, Default)]
pub struct Times(pub Vec<Time>);

/// Of one stage.
#[derive(Clone, Copy, Debug)]
pub struct Time {
    pub stage: &'static Stage,
    pub calls: u64,
    /// Of all calls, s.
    pub seconds: f64,
}

impl Times {
    /// One more call of a stage.
    pub fn add(&mut self, stage: &'static Stage, seconds: f64) {
        match self.0.iter_mut().find(|t| t.stage == stage) {
            Some(time) => {
                time.calls += 1;
                time.seconds += seconds;
            }
            None => self.0.push(Time { stage, calls: 1, seconds }),
        }
    }
}
