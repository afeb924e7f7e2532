//! Where the time of a simulation goes, stage by stage, beside the bytes that each stage has to move.

use super::Simulation;
use crate::{
    engine::{Times, times::Time, traffic},
    error::Result,
    plan::Loop,
    state::{Sizes, array::LIST_START},
};
use std::time::Instant;

/// What some steps cost, stage by stage.
#[derive(Clone, Debug)]
pub struct Profile {
    /// In the order of their first call.
    pub stages: Vec<StageCost>,
    pub grains: usize,
    pub steps: u64,
    /// Wall time of the steps, s: the stages, what is between them, and the timing itself.
    pub wall_seconds: f64,
    /// What told the times of the stages.
    pub clock: &'static str,
}

/// What a stage costs.
#[derive(Clone, Copy, Debug)]
pub struct StageCost {
    pub name: &'static str,
    /// Of stages of a step, those that were not halted.
    pub calls: u64,
    /// Of all calls, s.
    pub seconds: f64,
    /// That a call has to move, see [`traffic::bytes`].
    pub bytes: u64,
}

impl Profile {
    /// Bytes that a grain has to have moved in a step.
    pub fn bytes_per_particle_step(&self) -> f64 {
        let total: f64 = self.stages.iter().map(|s| s.calls as f64 * s.bytes as f64).sum();
        total / (self.grains as f64 * self.steps as f64)
    }
}

impl Simulation {
    /// Advance by this many steps while each stage is timed, which takes longer than [`Simulation::advance`].
    ///
    /// # Errors
    /// As [`Simulation::advance`].
    pub fn profile(&mut self, steps: u64) -> Result<Profile> {
        *self.runner.engine.times() = Some(Times::default());
        let start = Instant::now();
        let advanced = self.advance(steps);
        let wall_seconds = start.elapsed().as_secs_f64();
        let times = self.runner.engine.times().take().unwrap_or_default();
        advanced?;
        let sizes = self.sizes_in_use()?;
        let stages = times.0.iter().map(|time| self.stage_cost(time, steps, &sizes)).collect::<Result<_>>()?;
        Ok(Profile { stages, grains: sizes.bodies, steps, wall_seconds, clock: self.runner.engine.clock() })
    }

    /// Sizes with only as many entries of lists of the history as there is something in.
    fn sizes_in_use(&mut self) -> Result<Sizes> {
        let s = self.runner.read(&[&LIST_START])?;
        let entries = s.all_entries();
        Ok(Sizes { entries, history: self.lists.history().1, ..self.runner.state.sizes })
    }

    fn stage_cost(&self, time: &Time, steps: u64, sizes: &Sizes) -> Result<StageCost> {
        let Time { stage, calls, seconds } = *time;
        // Steps that are halted are dispatched, but move nothing.
        let of_step = self.plans.motion.runs(stage);
        let bytes = traffic::bytes(&self.runner.state.model, stage, sizes, |array| self.runner.engine.stride(array))?;
        // A call in the loop over the colours is over one of them.
        let colors = || u64::from(self.runner.state.coloring_state[0].colors.max(1));
        let bytes = if self.plans.chunk.within(Loop::ForEachColor).runs(stage) { bytes / colors() } else { bytes };
        Ok(StageCost { name: stage.name, calls: if of_step { steps } else { calls }, seconds, bytes })
    }
}
