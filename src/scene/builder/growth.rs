//! Radii that change over time.

use crate::scene::schema;

/// How the radii of one material, or of all, change: R (1 + rate t) with the radius R at the start of the run.
#[derive(Clone, Debug)]
pub struct GrowthBuilder(pub(super) schema::Growth);

impl GrowthBuilder {
    /// At this rate, 1/s; below 0 grains shrink.
    pub fn new(rate: f64) -> GrowthBuilder {
        GrowthBuilder(schema::Growth { rate, ..schema::Growth::default() })
    }

    /// Of the grains of this material alone. Default: of all.
    #[must_use]
    pub fn material(mut self, name: &str) -> Self {
        self.0.material = Some(name.to_owned());
        self
    }

    /// Radii at time 0 over those that grains are given. Default: 1.
    #[must_use]
    pub fn initial(mut self, factor: f64) -> Self {
        self.0.initial = Some(factor);
        self
    }

    /// Radii over those that grains are given at which they cease to change. Default: none, until the grains fill the cell.
    #[must_use]
    pub fn last(mut self, factor: f64) -> Self {
        self.0.last = Some(factor);
        self
    }
}
