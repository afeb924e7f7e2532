//! Scenes in code. Every builder fills the structure that a table of a scene file is read into, and the scene then passes the same
//! checks: keys, defaults and messages are those of `docs/scene.md`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use glam::{DQuat, DVec2, DVec3};

pub use super::law::{MaterialBuilder, PairBuilder};
use super::schema::{self, Face, Format, Placement};
use super::setters::setters;
use super::shape::Kind;
use super::{Assembly, Origin, Scene, overrides};
use crate::{Error, Result, solve};

/// Numbers, one per axis of the scene: from `[x, y]`, `[x, y, z]`, [`DVec2`] or [`DVec3`].
#[derive(Clone, Debug)]
pub struct PerAxis(Vec<f64>);

impl<const N: usize> From<[f64; N]> for PerAxis {
    fn from(numbers: [f64; N]) -> PerAxis {
        PerAxis(numbers.to_vec())
    }
}

impl From<DVec2> for PerAxis {
    fn from(vector: DVec2) -> PerAxis {
        PerAxis(vector.to_array().to_vec())
    }
}

impl From<DVec3> for PerAxis {
    fn from(vector: DVec3) -> PerAxis {
        PerAxis(vector.to_array().to_vec())
    }
}

fn per_axis(vector: impl Into<PerAxis>) -> Vec<f64> {
    vector.into().0
}

/// A whole scene; see [`Scene::builder`].
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    file: schema::File,
    directory: PathBuf,
    /// A material that was given twice.
    twice: Option<String>,
}

impl SceneBuilder {
    /// A scene of disks (2) or spheres (3) with nothing in it.
    pub fn new(dimension: usize) -> SceneBuilder {
        let file = schema::File {
            title: None,
            dimension,
            gravity: None,
            seed: 1,
            domain: None,
            material: BTreeMap::new(),
            pair: Vec::new(),
            wall: Vec::new(),
            shape: Vec::new(),
            grain: Vec::new(),
            population: Vec::new(),
            solver: schema::Solver::default(),
            stop: schema::Stop::default(),
            output: schema::Output::default(),
        };
        SceneBuilder { file, directory: PathBuf::new(), twice: None }
    }

    /// Name of the scene, with which messages begin. Default: `scene`.
    #[must_use]
    pub fn title(mut self, title: &str) -> Self {
        self.file.title = Some(title.to_owned());
        self
    }

    /// m/s². Default: 9.81 against the last axis.
    #[must_use]
    pub fn gravity(mut self, gravity: impl Into<PerAxis>) -> Self {
        self.file.gravity = Some(per_axis(gravity));
        self
    }

    /// The same seed gives the same grains. Default: 1.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.file.seed = seed;
        self
    }

    /// Where grains may be, m, and what happens at the faces: one [`Face`] for all axes, or an array of one per axis.
    /// Default: space without bounds.
    #[must_use]
    pub fn domain(
        mut self,
        lower: impl Into<PerAxis>,
        upper: impl Into<PerAxis>,
        boundary: impl Into<Boundary>,
    ) -> Self {
        let (lower, upper) = (per_axis(lower), per_axis(upper));
        self.file.domain = Some(schema::Domain { lower, upper, boundary: Some(boundary.into().0) });
        self
    }

    /// A material that grains and walls call by this name.
    #[must_use]
    pub fn material(mut self, name: &str, material: MaterialBuilder) -> Self {
        if self.file.material.insert(name.to_owned(), material.0).is_some() {
            self.twice = Some(name.to_owned());
        }
        self
    }

    /// What replaces the mixing rule for a pair of materials.
    #[must_use]
    pub fn pair(mut self, pair: PairBuilder) -> Self {
        self.file.pair.push(pair.0);
        self
    }

    /// A wall.
    #[must_use]
    pub fn wall(mut self, wall: WallBuilder) -> Self {
        self.file.wall.push(wall.0);
        self
    }

    /// A shape that clumps can have.
    #[must_use]
    pub fn shape(mut self, shape: ShapeBuilder) -> Self {
        self.file.shape.push(shape.0);
        self
    }

    /// A single grain.
    #[must_use]
    pub fn grain(mut self, grain: GrainBuilder) -> Self {
        self.file.grain.push(grain.0);
        self
    }

    /// Single grains, in this order.
    #[must_use]
    pub fn grains(mut self, grains: impl IntoIterator<Item = GrainBuilder>) -> Self {
        self.file.grain.extend(grains.into_iter().map(|grain| grain.0));
        self
    }

    /// Many grains at once. Populations come after all single grains.
    #[must_use]
    pub fn population(mut self, population: PopulationBuilder) -> Self {
        self.file.population.push(population.0);
        self
    }

    /// Method and its numbers. Default: the discrete element method.
    #[must_use]
    pub fn solver(mut self, solver: SolverBuilder) -> Self {
        self.file.solver = solver.0;
        self
    }

    /// Simulated time after which a run ends, s. A scene needs at least one of the three conditions.
    #[must_use]
    pub fn stop_time(mut self, time: f64) -> Self {
        self.file.stop.time = Some(time);
        self
    }

    /// Time steps after which a run ends.
    #[must_use]
    pub fn stop_steps(mut self, steps: u64) -> Self {
        self.file.stop.steps = Some(steps);
        self
    }

    /// Ratio of unbalanced to contact forces below which the scene is at rest, which ends a run.
    #[must_use]
    pub fn stop_equilibrium(mut self, ratio: f64) -> Self {
        self.file.stop.equilibrium = Some(ratio);
        self
    }

    /// Simulated time between rows of `history.csv`, s. Default: 100 rows over the run, or one every 1,000 steps.
    #[must_use]
    pub fn output_history(mut self, interval: f64) -> Self {
        self.file.output.history = Some(interval);
        self
    }

    /// Simulated time between snapshots, s. Default: the last state only.
    #[must_use]
    pub fn output_snapshots(mut self, interval: f64) -> Self {
        self.file.output.snapshots = Some(interval);
        self
    }

    /// Files that a run writes. Default: both formats.
    #[must_use]
    pub fn output_formats(mut self, formats: impl IntoIterator<Item = Format>) -> Self {
        self.file.output.formats = formats.into_iter().collect();
        self
    }

    /// Folder in which relative paths of tables and meshes are looked up. Default: the current one.
    #[must_use]
    pub fn directory(mut self, directory: impl Into<PathBuf>) -> Self {
        self.directory = directory.into();
        self
    }

    /// The scene, as if it had been read from a file.
    ///
    /// # Errors
    /// [`Error::Scene`] for what no scene file can hold: numbers that are not finite, two materials of one name.
    pub fn build(self) -> Result<Scene> {
        let name = self.file.title.clone().unwrap_or_else(|| "scene".to_owned());
        let origin = Origin { name, directory: self.directory, set: Vec::new() };
        if let Some(material) = self.twice {
            return Err(origin.wrong(&format!("material.{material}"), schema::duplicate(&material)));
        }
        let table = toml::Table::try_from(&self.file).map_err(|_| {
            let message = format!("a whole number is above {}, the largest that a scene can hold", i64::MAX);
            Error::Scene(format!("{}: {message}", origin.name))
        })?;
        overrides::refuse_infinite_in(table, &origin)?;
        Ok(Scene { file: self.file, origin })
    }

    /// [`SceneBuilder::build`], then [`Scene::assemble`].
    ///
    /// # Errors
    /// [`Error::Scene`] with the key, its value, and what is allowed.
    pub fn assemble(self) -> Result<Assembly> {
        self.build()?.assemble()
    }
}

/// What happens at the faces of the domain: from one [`Face`], or an array of one per axis.
#[derive(Clone, Debug)]
pub struct Boundary(schema::Boundary);

impl From<Face> for Boundary {
    fn from(face: Face) -> Boundary {
        Boundary(schema::Boundary::Same(face))
    }
}

impl<const N: usize> From<[Face; N]> for Boundary {
    fn from(faces: [Face; N]) -> Boundary {
        Boundary(schema::Boundary::Each(faces.to_vec()))
    }
}

/// A face of a box of walls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The face at the lower x.
    XLower,
    /// The face at the upper x.
    XUpper,
    /// The face at the lower y.
    YLower,
    /// The face at the upper y.
    YUpper,
    /// The face at the lower z.
    ZLower,
    /// The face at the upper z.
    ZUpper,
}

impl Side {
    /// The word for it in scene files and in the names of walls.
    pub fn label(self) -> &'static str {
        match self {
            Side::XLower => "x-",
            Side::XUpper => "x+",
            Side::YLower => "y-",
            Side::YUpper => "y+",
            Side::ZLower => "z-",
            Side::ZUpper => "z+",
        }
    }
}

/// A wall.
#[derive(Clone, Debug)]
pub struct WallBuilder(schema::Wall);

impl WallBuilder {
    fn empty(kind: schema::WallKind, material: &str) -> schema::Wall {
        schema::Wall {
            kind,
            name: None,
            material: material.to_owned(),
            velocity: None,
            point: None,
            normal: None,
            lower: None,
            upper: None,
            faces: None,
            center: None,
            radius: None,
            spin: None,
        }
    }

    /// A half-space: any point of the plane, m, and a normal of any length but 0 that points to the side where the grains are.
    pub fn plane(material: &str, point: impl Into<PerAxis>, normal: impl Into<PerAxis>) -> WallBuilder {
        WallBuilder(schema::Wall {
            point: Some(per_axis(point)),
            normal: Some(per_axis(normal)),
            ..WallBuilder::empty(schema::WallKind::Plane, material)
        })
    }

    /// A box between two corners, m, with the grains inside. It is split into planes named after it, `box 0 z-` for example.
    pub fn box_between(material: &str, lower: impl Into<PerAxis>, upper: impl Into<PerAxis>) -> WallBuilder {
        WallBuilder(schema::Wall {
            lower: Some(per_axis(lower)),
            upper: Some(per_axis(upper)),
            ..WallBuilder::empty(schema::WallKind::Box, material)
        })
    }

    /// A cylinder along z with the grains inside, in two dimensions a circle: x and y of the axis, and the radius, m.
    pub fn cylinder(material: &str, center: [f64; 2], radius: f64) -> WallBuilder {
        WallBuilder(schema::Wall {
            center: Some(center.to_vec()),
            radius: Some(radius),
            ..WallBuilder::empty(schema::WallKind::Cylinder, material)
        })
    }

    /// Name in messages and results. Default: kind and number, such as `plane 0`.
    #[must_use]
    pub fn name(mut self, name: &str) -> Self {
        self.0.name = Some(name.to_owned());
        self
    }

    /// Constant translation, m/s. Default: 0.
    #[must_use]
    pub fn velocity(mut self, velocity: impl Into<PerAxis>) -> Self {
        self.0.velocity = Some(per_axis(velocity));
        self
    }

    /// The faces that a box has. Default: all of the dimension.
    #[must_use]
    pub fn faces(mut self, faces: impl IntoIterator<Item = Side>) -> Self {
        self.0.faces = Some(faces.into_iter().map(|side| side.label().to_owned()).collect());
        self
    }

    setters! {
        /// Rotation of a cylinder about its axis, rad/s. Default: 0.
        spin: f64;
    }
}

/// A shape that clumps can have: a rigid set of spheres (disks), in any unit.
#[derive(Clone, Debug)]
pub struct ShapeBuilder(schema::Shape);

impl ShapeBuilder {
    fn empty(name: &str) -> schema::Shape {
        schema::Shape {
            name: name.to_owned(),
            members: None,
            file: None,
            kind: None,
            mesh: None,
            spheres: None,
            distance: None,
            count: None,
            seed: None,
            volume: None,
            center: None,
            inertia: None,
        }
    }

    /// The spheres (disks) themselves: centre and radius.
    pub fn of_members<C: Into<PerAxis>>(name: &str, members: impl IntoIterator<Item = (C, f64)>) -> ShapeBuilder {
        let member = |(center, radius): (C, f64)| schema::Member { center: per_axis(center), radius };
        let members = Some(members.into_iter().map(member).collect());
        ShapeBuilder(schema::Shape { members, ..ShapeBuilder::empty(name) })
    }

    /// The spheres (disks) of a CSV table with the columns x, y, z (not in two dimensions) and radius.
    pub fn of_file(name: &str, path: &str) -> ShapeBuilder {
        ShapeBuilder(schema::Shape { file: Some(path.to_owned()), ..ShapeBuilder::empty(name) })
    }

    /// By a rule of the library. Scenes have all of them under their own names already, with the defaults.
    pub fn of_kind(name: &str, kind: Kind) -> ShapeBuilder {
        ShapeBuilder(schema::Shape { kind: Some(kind.label().to_owned()), ..ShapeBuilder::empty(name) })
    }

    /// A closed surface of triangles in an STL file, filled by spheres (three dimensions).
    pub fn of_mesh(name: &str, path: &str) -> ShapeBuilder {
        ShapeBuilder(schema::Shape { mesh: Some(path.to_owned()), ..ShapeBuilder::empty(name) })
    }

    /// Mass properties at density 1: volume, centre of mass, and the inertia about it as `[Jxx, Jyy, Jzz, Jxy, Jxz, Jyz]`, in two
    /// dimensions `[Jzz]`. Default: computed.
    #[must_use]
    pub fn mass_properties<const N: usize>(
        mut self,
        volume: f64,
        center: impl Into<PerAxis>,
        inertia: [f64; N],
    ) -> Self {
        (self.0.volume, self.0.center, self.0.inertia) = (Some(volume), Some(per_axis(center)), Some(inertia.to_vec()));
        self
    }

    setters! {
        /// Of a rule: between the centres of neighbouring members, in their radii, from 0.001 to 2. Default: 1.
        distance: f64;
        /// Members of a rod or of a random shape. Default: 3; 5.
        count: usize;
        /// Of a random shape. Default: 1.
        seed: u64;
        /// Spheres that fill a mesh, at most. Default: 30.
        spheres: usize;
    }
}

/// How a clump is turned: from the axes of its shape to those of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Orientation {
    /// Counterclockwise, rad; two dimensions.
    Angle(f64),
    /// Of any length but 0; three dimensions.
    Quaternion(DQuat),
    /// About z by ψ, then about x by θ, then about z by φ, all axes those of the scene, rad; three dimensions.
    Euler { phi: f64, theta: f64, psi: f64 },
    /// All orientations alike; populations only.
    Random,
}

impl Orientation {
    fn key(self) -> schema::Orientation {
        match self {
            Orientation::Angle(angle) => schema::Orientation::Plane(angle),
            Orientation::Quaternion(DQuat { x, y, z, w }) => {
                schema::Orientation::Space(schema::Turn::Quaternion([w, x, y, z]))
            }
            Orientation::Euler { phi, theta, psi } => {
                schema::Orientation::Space(schema::Turn::Euler([phi, theta, psi]))
            }
            Orientation::Random => schema::Orientation::Word("random".to_owned()),
        }
    }
}

/// Spin, rad/s: from three numbers in three dimensions, from one in two.
#[derive(Clone, Debug)]
pub struct Spin(schema::Spin);

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
pub struct GrainBuilder(schema::Grain);

impl GrainBuilder {
    /// At this position, m, with this radius, m. Of a clump: its centre of mass, and the radius of the sphere (disk) of the same
    /// volume (area).
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
pub struct Radii(schema::Radius);

impl Radii {
    /// Uniform by number.
    pub fn uniform(min: f64, max: f64) -> Radii {
        Radii(schema::Radius::Law(schema::RadiusLaw::Uniform([min, max])))
    }

    /// Normal distribution, cut three standard deviations from the mean, below no lower than a tenth of the mean.
    pub fn normal(mean: f64, std: f64) -> Radii {
        Radii::of_normal(schema::Moments { mean, std, min: None, max: None })
    }

    /// Normal distribution, cut at these radii.
    pub fn truncated_normal(mean: f64, std: f64, min: f64, max: f64) -> Radii {
        Radii::of_normal(schema::Moments { mean, std, min: Some(min), max: Some(max) })
    }

    /// Log-normal distribution, cut like [`Radii::normal`]; mean and standard deviation are those of the radius, not of its logarithm.
    pub fn log_normal(mean: f64, std: f64) -> Radii {
        Radii::of_log_normal(schema::Moments { mean, std, min: None, max: None })
    }

    /// Log-normal distribution, cut at these radii.
    pub fn truncated_log_normal(mean: f64, std: f64, min: f64, max: f64) -> Radii {
        Radii::of_log_normal(schema::Moments { mean, std, min: Some(min), max: Some(max) })
    }

    /// One of these, each with the same probability.
    pub fn list(radii: impl IntoIterator<Item = f64>) -> Radii {
        Radii(schema::Radius::Law(schema::RadiusLaw::List(radii.into_iter().collect())))
    }

    fn of_normal(moments: schema::Moments) -> Radii {
        Radii(schema::Radius::Law(schema::RadiusLaw::Normal(moments)))
    }

    fn of_log_normal(moments: schema::Moments) -> Radii {
        Radii(schema::Radius::Law(schema::RadiusLaw::LogNormal(moments)))
    }
}

impl From<f64> for Radii {
    fn from(radius: f64) -> Radii {
        Radii(schema::Radius::Constant(radius))
    }
}

/// Many grains at once.
#[derive(Clone, Debug)]
pub struct PopulationBuilder(schema::Population);

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
        }
    }

    /// Grains that packstone places.
    pub fn new(material: &str, count: usize, radius: impl Into<Radii>) -> PopulationBuilder {
        PopulationBuilder(schema::Population {
            material: Some(material.to_owned()),
            count: Some(count),
            radius: Some(radius.into().0),
            ..PopulationBuilder::empty()
        })
    }

    /// Grains of a CSV table; its columns are listed in `docs/scene.md`.
    pub fn from_file(path: &str) -> PopulationBuilder {
        PopulationBuilder(schema::Population { file: Some(path.to_owned()), ..PopulationBuilder::empty() })
    }

    /// Of the rows of a table that name none.
    #[must_use]
    pub fn material(mut self, name: &str) -> Self {
        self.0.material = Some(name.to_owned());
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
        self.0.region = Some(schema::Region { lower: per_axis(lower), upper: per_axis(upper) });
        self
    }

    /// m/s; added to the velocities of a table. Default: 0.
    #[must_use]
    pub fn velocity(mut self, velocity: impl Into<PerAxis>) -> Self {
        self.0.velocity = Some(per_axis(velocity));
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

/// A method with its numbers.
#[derive(Clone, Debug)]
pub struct SolverBuilder(schema::Solver);

impl SolverBuilder {
    /// The discrete element method: springs and dashpots.
    pub fn discrete_elements() -> SolverBuilder {
        SolverBuilder(schema::Solver::default())
    }

    /// Contact dynamics: rigid grains, restitution 0.
    pub fn contact_dynamics() -> SolverBuilder {
        SolverBuilder(schema::Solver { method: schema::Method::Cd, ..schema::Solver::default() })
    }

    /// Time step, s. Default: chosen from the stability bound and the shortest collision.
    #[must_use]
    pub fn dt(mut self, dt: f64) -> Self {
        self.0.dt = schema::TimeStep::Seconds(dt);
        self
    }

    /// Contact dynamics: how the contacts of a step are solved. Default: [`solve::Solver::JacobiAccelerated`].
    #[must_use]
    pub fn relaxation(mut self, solver: solve::Solver) -> Self {
        self.0.relaxation = Some(solver.label().to_owned());
        self
    }

    /// Contact dynamics: the order of the contacts in a sweep of [`solve::Solver::GaussSeidel`]. Default: as they are numbered.
    #[must_use]
    pub fn order(mut self, order: solve::Order) -> Self {
        self.0.order = Some(order.label().to_owned());
        self
    }

    setters! {
        /// Of a time step that is chosen: fraction of the stability bound, in (0, 1]. Default: 0.15.
        dt_fraction: f64;
        /// Whether a time step above the bound is accepted. Default: false.
        allow_unstable: bool;
        /// Whether overlaps of more than 10 % of the radius are accepted at the start. Default: false.
        allow_overlap: bool;
        /// Global damping ξ, 1/s. Default: 0.
        damping: f64;
        /// Margin of the neighbour lists, mean radii, from 0.001 to 10. Default: 0.2, in contact dynamics 1.
        margin: f64;
        /// Contact dynamics: relative residual at which a step is solved. Default: 1e-3.
        tolerance: f64;
        /// Contact dynamics: passes after which a step goes on unsolved. Default: 1000.
        max_iterations: u32;
        /// Contact dynamics: at most this fast an overlap opens, m/s. Default: a tenth of what gravity gives in a step, or a
        /// thousandth of the mean radius per step without.
        max_correction_velocity: f64;
        /// Contact dynamics: whether free clumps keep their angular momentum, and not their angular velocity. Default: false.
        gyroscopic: bool;
    }
}
