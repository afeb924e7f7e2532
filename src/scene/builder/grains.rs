//! Single grains and populations.

use glam::DVec3;

use super::keys::{PerAxis, per_axis};
use super::openings::InsertionBuilder;
use super::shapes::Orientation;
use crate::scene::schema::{self, Placement};
use crate::scene::setters::setters;

/// Spin, rad/s: from three numbers in three dimensions, from one in two.
#[derive(Clone, Debug)]
pub struct Spin(pub(super) schema::Spin);

impl From<f64> for Spin {
    fn from(spin: f64) -> Spin {
        Spin(schema::Spin::Plane(spin))
    }
}

impl From<[f64; 3]> for Spin {
    fn from(spin: [f64; 3]) -> Spin {
        Spin(schema::Spin::Space(spin))
    }
}

impl From<DVec3> for Spin {
    fn from(spin: DVec3) -> Spin {
        spin.to_array().into()
    }
}

/// A single grain.
#[derive(Clone, Debug)]
pub struct GrainBuilder(pub(super) schema::Grain);

impl GrainBuilder {
    /// At this position, m, with this radius, m. Of a clump: its centre of mass, and the radius of the sphere (disk) of
    /// the same volume (area).
    pub fn new(material: &str, position: impl Into<PerAxis>, radius: f64) -> GrainBuilder {
        GrainBuilder(schema::Grain {
            position: per_axis(position),
            radius,
            shape: None,
            orientation: None,
            material: material.to_owned(),
            velocity: None,
            spin: None,
            fixed: false,
        })
    }

    /// Makes it a clump of this shape. Default: a sphere (disk).
    #[must_use]
    pub fn shape(mut self, name: &str) -> Self {
        self.0.shape = Some(name.to_owned());
        self
    }

    /// How the clump is turned. Default: along the axes of its shape.
    #[must_use]
    pub fn orientation(mut self, orientation: Orientation) -> Self {
        self.0.orientation = Some(orientation.key());
        self
    }

    /// m/s. Default: 0.
    #[must_use]
    pub fn velocity(mut self, velocity: impl Into<PerAxis>) -> Self {
        self.0.velocity = Some(per_axis(velocity));
        self
    }

    /// rad/s: an array of three, in two dimensions one number. Default: 0.
    #[must_use]
    pub fn spin(mut self, spin: impl Into<Spin>) -> Self {
        self.0.spin = Some(spin.into().0);
        self
    }

    setters! {
        /// Whether it keeps its velocity and spin, whatever pushes it. Default: false.
        fixed: bool;
    }
}

/// A distribution of radii, m. A number stands for one radius.
#[derive(Clone, Debug)]
pub struct Radii(pub(super) schema::Radius);

impl Radii {
    fn of(law: schema::Distribution) -> Radii {
        Radii(schema::Radius::Distribution(Box::new(law)))
    }

    /// Uniform between two radii.
    pub fn uniform(min: f64, max: f64) -> Radii {
        Radii::of(schema::Distribution { uniform: Some([min, max]), ..Default::default() })
    }

    /// Normal distribution, cut three standard deviations from the mean, below no lower than a tenth of the mean. Mean
    /// and standard deviation are those of what is left.
    pub fn normal(mean: f64, std: f64) -> Radii {
        Radii::of_normal(schema::Moments { mean, std, min: None, max: None })
    }

    /// Normal distribution, cut at these radii.
    pub fn truncated_normal(mean: f64, std: f64, min: f64, max: f64) -> Radii {
        Radii::of_normal(schema::Moments { mean, std, min: Some(min), max: Some(max) })
    }

    /// Log-normal distribution; mean and standard deviation are those of the radius, not of its logarithm.
    pub fn log_normal(mean: f64, std: f64) -> Radii {
        Radii::of_log_normal(schema::Moments { mean, std, min: None, max: None })
    }

    /// Log-normal distribution, cut at these radii; mean and standard deviation are those of what is left.
    pub fn truncated_log_normal(mean: f64, std: f64, min: f64, max: f64) -> Radii {
        Radii::of_log_normal(schema::Moments { mean, std, min: Some(min), max: Some(max) })
    }

    /// As many of each of these.
    pub fn list(radii: impl IntoIterator<Item = f64>) -> Radii {
        Radii::of(schema::Distribution { list: Some(radii.into_iter().collect()), ..Default::default() })
    }

    /// These radii with their shares.
    pub fn shares(radii: impl IntoIterator<Item = (f64, f64)>) -> Radii {
        let (list, shares) = radii.into_iter().unzip();
        Radii::of(schema::Distribution { list: Some(list), shares: Some(shares), ..Default::default() })
    }

    /// From a sieve curve: radii and what passes them, ascending from 0.
    pub fn sieve(curve: impl IntoIterator<Item = (f64, f64)>) -> Radii {
        let (radius, passing) = curve.into_iter().unzip();
        let sieve = Some(schema::Sieve::Curve(schema::Curve { radius, passing }));
        Radii::of(schema::Distribution { sieve, ..Default::default() })
    }

    /// The same from a CSV file with the columns `radius` and `passing`.
    pub fn sieve_file(path: &str) -> Radii {
        Radii::of(schema::Distribution { sieve: Some(schema::Sieve::File(path.to_owned())), ..Default::default() })
    }

    /// Shares are those of the volume (in two dimensions the area) of the grains, not of their number.
    #[must_use]
    pub fn by_volume(mut self) -> Radii {
        if let schema::Radius::Distribution(law) = &mut self.0 {
            law.by = schema::Weighting::Volume;
        }
        self
    }

    fn of_normal(moments: schema::Moments) -> Radii {
        Radii::of(schema::Distribution { normal: Some(moments), ..Default::default() })
    }

    fn of_log_normal(moments: schema::Moments) -> Radii {
        Radii::of(schema::Distribution { log_normal: Some(moments), ..Default::default() })
    }
}

impl From<f64> for Radii {
    fn from(radius: f64) -> Radii {
        Radii(schema::Radius::Constant(radius))
    }
}

/// Many grains at once.
#[derive(Clone, Debug)]
pub struct PopulationBuilder(pub(super) schema::Population);

impl PopulationBuilder {
    fn empty() -> schema::Population {
        schema::Population {
            material: None,
            file: None,
            scale: None,
            count: None,
            radius: None,
            shape: None,
            orientation: None,
            placement: None,
            gap: None,
            region: None,
            velocity: None,
            velocity_spread: 0.0,
            fixed: false,
            insertion: None,
        }
    }

    /// Grains that packstone places.
    pub fn new(material: &str, count: usize, radius: impl Into<Radii>) -> PopulationBuilder {
        PopulationBuilder(schema::Population {
            material: Some(schema::Materials::All(material.to_owned())),
            count: Some(count),
            radius: Some(radius.into().0),
            ..PopulationBuilder::empty()
        })
    }

    /// Grains of a file; its columns and the formats that are read are listed in `docs/scene.md`.
    pub fn from_file(path: &str) -> PopulationBuilder {
        PopulationBuilder(schema::Population { file: Some(path.to_owned()), ..PopulationBuilder::empty() })
    }

    /// Of the rows of a table that name none.
    #[must_use]
    pub fn material(mut self, name: &str) -> Self {
        self.0.material = Some(schema::Materials::All(name.to_owned()));
        self
    }

    /// What the types in a file are made of.
    #[must_use]
    pub fn types<'a>(mut self, materials: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let materials = materials.into_iter().map(|(kind, name)| (kind.to_owned(), name.to_owned())).collect();
        self.0.material = Some(schema::Materials::Types(materials));
        self
    }

    /// Of all grains of a file that has no radii, m.
    #[must_use]
    pub fn radius(mut self, radius: f64) -> Self {
        self.0.radius = Some(schema::Radius::Constant(radius));
        self
    }

    /// Makes them clumps of this shape. Default: spheres (disks).
    #[must_use]
    pub fn shape(mut self, name: &str) -> Self {
        self.0.shape = Some(schema::Mixture::All(name.to_owned()));
        self
    }

    /// Makes them clumps of these shapes, each with its share of the number of grains.
    #[must_use]
    pub fn shapes<'a>(mut self, shares: impl IntoIterator<Item = (&'a str, f64)>) -> Self {
        let shares = shares.into_iter().map(|(name, share)| (name.to_owned(), share)).collect();
        self.0.shape = Some(schema::Mixture::Shares(shares));
        self
    }

    /// How the clumps are turned: all the same, or at random, which is the default.
    #[must_use]
    pub fn orientation(mut self, orientation: Orientation) -> Self {
        self.0.orientation = Some(orientation.key());
        self
    }

    /// Corners of a region inside of which the grains lie as a whole, m. Default: domain and walls are the only bounds.
    #[must_use]
    pub fn region(mut self, lower: impl Into<PerAxis>, upper: impl Into<PerAxis>) -> Self {
        self.0.region =
            Some(schema::Region { lower: per_axis(lower), upper: per_axis(upper), center: None, radius: None });
        self
    }

    /// m/s; added to the velocities of a table. Default: 0.
    #[must_use]
    pub fn velocity(mut self, velocity: impl Into<PerAxis>) -> Self {
        self.0.velocity = Some(per_axis(velocity));
        self
    }

    /// Lets them come in over time, wherever there is room for them in the region. Default: all are there at the start.
    #[must_use]
    pub fn insertion(mut self, insertion: InsertionBuilder) -> Self {
        self.0.insertion = Some(insertion.0);
        self
    }

    setters! {
        /// Factor on positions and radii of a table. Default: 1.
        scale: f64;
        /// Of a table: how many of its rows. Default: all.
        count: usize;
        /// How they are placed. Default: on a lattice.
        placement: Placement;
        /// On a lattice: room between neighbours, in diameters, used up by the jitter. Default: 0.05.
        gap: f64;
        /// Standard deviation of a normal distribution added to each component of the velocities, m/s. Default: 0.
        velocity_spread: f64;
        /// Whether they keep their velocities and spins, whatever pushes them. Default: false.
        fixed: bool;
    }
}
