//! How grains come in over time, and where they leave.

use super::keys::{PerAxis, per_axis};
use crate::scene::schema;
use crate::scene::setters::setters;

/// How the grains of a population come in over time.
#[derive(Clone, Debug)]
pub struct InsertionBuilder(pub(super) schema::Insertion);

impl InsertionBuilder {
    /// So many grains (clumps) per second.
    pub fn rate(rate: f64) -> InsertionBuilder {
        InsertionBuilder(schema::Insertion { rate: Some(rate), ..Default::default() })
    }

    /// So much mass per time, kg/s.
    pub fn mass_rate(rate: f64) -> InsertionBuilder {
        InsertionBuilder(schema::Insertion { mass_rate: Some(rate), ..Default::default() })
    }

    /// Of the region of the population, m/s. Default: it stays where it is.
    #[must_use]
    pub fn region_velocity(mut self, velocity: impl Into<PerAxis>) -> Self {
        self.0.region_velocity = Some(per_axis(velocity));
        self
    }

    setters! {
        /// No more than that comes in, kg. Default: all grains.
        mass: f64;
        /// s. Default: 0.
        start: f64;
        /// s. Default: never.
        stop: f64;
        /// From one batch to the next, s. Default: as `docs/scene.md` says.
        interval: f64;
    }
}

/// What takes grains away.
#[derive(Clone, Debug)]
pub struct OutletBuilder(pub(super) schema::Outlet);

impl OutletBuilder {
    /// In a box, m.
    pub fn inside(lower: impl Into<PerAxis>, upper: impl Into<PerAxis>) -> OutletBuilder {
        let (lower, upper) = (per_axis(lower), per_axis(upper));
        let region = Some(schema::Region { lower, upper, center: None, radius: None });
        OutletBuilder(schema::Outlet { region, ..Default::default() })
    }

    /// Behind a plane through a point, m, whose normal points to where grains stay.
    pub fn behind(point: impl Into<PerAxis>, normal: impl Into<PerAxis>) -> OutletBuilder {
        let (point, normal) = (Some(per_axis(point)), Some(per_axis(normal)));
        OutletBuilder(schema::Outlet { point, normal, ..Default::default() })
    }

    /// Name in results. Default: `outlet` and its number.
    #[must_use]
    pub fn name(mut self, name: &str) -> Self {
        self.0.name = Some(name.to_owned());
        self
    }

    setters! {
        /// s. Default: 0.
        start: f64;
        /// s. Default: never.
        stop: f64;
        /// From one look to the next, s. Default: 1,000 steps.
        interval: f64;
    }
}
