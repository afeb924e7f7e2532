//! Scenes in code. Every builder fills the structure that a table of a scene file is read into, and the scene then
//! passes the same checks: keys, defaults and messages are those of `docs/scene.md`.

mod cell;
mod grains;
mod growth;
mod keys;
mod openings;
mod shapes;
mod solver;
mod stages;
mod walls;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::SystemTime;

pub use super::law::{MaterialBuilder, PairBuilder};
use super::origin::Origin;
use super::schema::{self, Face, Format};
use super::{Assembly, JammingProtocol, Scene, overrides};
use crate::{Error, Result};

use keys::per_axis;

pub use cell::{CellBuilder, Component};
pub use grains::{GrainBuilder, PopulationBuilder, Radii, Spin};
pub use growth::GrowthBuilder;
pub use keys::PerAxis;
pub use openings::{InsertionBuilder, OutletBuilder};
pub use shapes::{Orientation, ShapeBuilder};
pub use solver::SolverBuilder;
pub use stages::StageBuilder;
pub use walls::{Side, WallBuilder};

impl Scene {
    /// A scene in code, of disks (2) or spheres (3): the same keys, defaults, checks and messages as in a file.
    ///
    /// ```
    /// use packstone::prelude::*;
    ///
    /// let assembly = Scene::builder(3)
    ///     .material("glass", MaterialBuilder::new(2500.0).normal_stiffness(2e3).friction(0.5))
    ///     .wall(WallBuilder::plane("glass", [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
    ///     .grain(GrainBuilder::new("glass", [0.0, 0.0, 1.2e-3], 1e-3))
    ///     .stop_time(0.1)
    ///     .assemble()?;
    /// assert_eq!(assembly.grains.len(), 1);
    /// # Ok::<(), packstone::Error>(())
    /// ```
    pub fn builder(dimension: usize) -> SceneBuilder {
        SceneBuilder::new(dimension)
    }
}

/// A whole scene; see [`Scene::builder`].
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    file: schema::File,
    directory: PathBuf,
    /// A material that was given twice.
    twice: Option<String>,
    /// What stages have that no file can hold.
    fault: Option<String>,
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
            cell: schema::Cell::default(),
            material: BTreeMap::new(),
            pair: Vec::new(),
            wall: Vec::new(),
            shape: Vec::new(),
            grain: Vec::new(),
            population: Vec::new(),
            outlet: Vec::new(),
            growth: Vec::new(),
            solver: schema::Solver::default(),
            stop: schema::Stop::default(),
            jamming: None,
            output: schema::Output::default(),
            stage: Vec::new(),
        };
        SceneBuilder { file, directory: PathBuf::new(), twice: None, fault: None }
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
        self.file.domain = Some(schema::Domain { lower, upper, boundary: Some(boundary.into().0), tilt: None });
        self
    }

    /// How the cell between periodic faces deforms. Default: not at all.
    #[must_use]
    pub fn cell(mut self, cell: CellBuilder) -> Self {
        self.file.cell = cell.0;
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

    /// Where grains leave.
    #[must_use]
    pub fn outlet(mut self, outlet: OutletBuilder) -> Self {
        self.file.outlet.push(outlet.0);
        self
    }

    /// A part of a run with values of its own, which begins where the one before it has ended: [`Scene::stages`], which
    /// [`StageRun`](crate::simulation::StageRun) runs one after the other. Default: none, the scene runs in one go.
    #[must_use]
    pub fn stage(mut self, stage: StageBuilder) -> Self {
        let StageBuilder { table, fault } = stage;
        let name = table.get("name").and_then(toml::Value::as_str).unwrap_or_default();
        let fault = fault.map(|fault| format!("stage.{name}: {fault}"));
        self.fault = self.fault.or(fault);
        self.file.stage.push(table);
        self
    }

    /// How radii change over time.
    #[must_use]
    pub fn growth(mut self, growth: GrowthBuilder) -> Self {
        self.file.growth.push(growth.0);
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

    /// Strain of the cell at which a run ends.
    #[must_use]
    pub fn stop_strain(mut self, component: Component, strain: f64) -> Self {
        component.set(&mut self.file.stop.strain, strain);
        self
    }

    /// Find the fraction at which the packing jams, and end there.
    #[must_use]
    pub fn jamming(mut self, protocol: JammingProtocol) -> Self {
        let JammingProtocol { step, tolerance, residual, relaxation_steps } = protocol;
        self.file.jamming = Some(schema::Jamming {
            step: Some(step),
            tolerance: Some(tolerance),
            residual: Some(residual),
            relaxation_steps: Some(relaxation_steps),
        });
        self
    }

    /// Volumes of grains over that of the cell at which a run ends.
    #[must_use]
    pub fn stop_packing_fraction(mut self, fraction: f64) -> Self {
        self.file.stop.packing_fraction = Some(fraction);
        self
    }

    /// Pressure of the cell at which a run ends, Pa (in two dimensions N/m).
    #[must_use]
    pub fn stop_pressure(mut self, pressure: f64) -> Self {
        self.file.stop.pressure = Some(pressure);
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

    /// Wall time between checkpoints, s; there is one at the end, too. 0: none at all. Default: 600.
    #[must_use]
    pub fn output_checkpoint(mut self, interval: f64) -> Self {
        self.file.output.checkpoint = interval;
        self
    }

    /// Whether dissipation and works are added up in every step, for `history.csv`. Default: no.
    #[must_use]
    pub fn output_works(mut self, works: bool) -> Self {
        self.file.output.works = works;
        self
    }

    /// Files that a run writes. Default: csv and vtp.
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
    /// [`Error::Scene`] for what no scene file can hold: numbers that are not finite, two materials of one name; and for
    /// keys of stages that scenes do not have.
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
        if let Some(fault) = self.fault {
            return Err(Error::Scene(format!("{}: {fault}", origin.name)));
        }
        // Stages are the text of a scene with values written into it.
        let has_stages = !self.file.stage.is_empty();
        let text = has_stages.then(|| toml::to_string(&table).expect("it is a table"));
        overrides::refuse_infinite_in(table, &origin)?;
        let made = SystemTime::now();
        let mut scene = Scene { file: self.file, origin, text, made, going_on: None, stages: Vec::new(), common: None };
        scene.stages = scene.read_stages()?;
        Ok(scene)
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
