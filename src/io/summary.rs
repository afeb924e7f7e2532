//! `summary.json`: how a run went, and where its walls stand in the end.

use super::files::at;
use crate::{
    error::{Error, Result},
    measure::{
        self, Packing, Sample, Sizes,
        micromechanics::{
            Cell, Totals,
            coordination::{Coordination, carrying},
            packing::LoadOnWall,
            stress::stress,
        },
    },
    protocol::jamming::{Jamming, JammingFraction},
    scene::{self, Assembly, Clump, Grain, Insertion, Surface},
    simulation::{DEEP_OVERLAP, DEEPER, DeepOverlap, Inlet, Other, Outlet, Simulation, SolverStatistics},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::{
    fmt::{self, Display},
    fs,
    path::Path,
};

/// The content of `summary.json`. Numbers that are not finite become `null`.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    pub scene: String,
    pub engine: &'static str,
    pub adapter: String,
    pub precision: &'static str,
    pub particles: usize,
    pub steps: u64,
    /// s, and so are the time steps.
    pub time: f64,
    pub dt: f64,
    pub dt_bound: f64,
    pub wall_seconds: f64,
    pub particle_steps_per_second: f64,
    pub bytes_per_particle: f64,
    pub replayed_chunks: u64,
    pub lost_contacts: u64,
    pub contacts: u64,
    pub coordination_number: f64,
    /// Of free particles that are no rattlers, and how many are.
    pub coordination_without_rattlers: Option<f64>,
    pub rattlers: usize,
    /// Over the cell, Pa; compression is positive.
    pub stress: Option<[[f64; 3]; 3]>,
    pub pressure: Option<f64>,
    pub packing_fraction: Option<f64>,
    pub packing_fraction_error: Option<f64>,
    pub overall_packing_fraction: Option<f64>,
    pub overall_packing_fraction_error: Option<f64>,
    /// m
    pub diameters: Option<Sizes>,
    pub max_overlap_over_radius: f64,
    /// Of all rows of the history.
    pub deepest_overlap: Option<Deepest>,
    /// m, of single precision.
    pub position_quantum: Option<f64>,
    pub unbalanced_force_ratio: f64,
    /// J
    pub kinetic_energy: f64,
    /// kg m/s
    pub momentum: DVec3,
    /// About the origin, kg m²/s.
    pub angular_momentum: Option<DVec3>,
    pub converged: bool,
    /// What the scene asks for and the last state has not: in words.
    pub missed: Option<String>,
    /// Of the cell since the start, if it deforms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strain: Option<Strain>,
    /// Of a search for it.
    #[serde(flatten)]
    pub jamming: Option<JammingFraction>,
    /// Of contact dynamics.
    #[serde(flatten)]
    pub relaxation: Option<Relaxation>,
    /// Of clumps.
    #[serde(flatten)]
    pub rotation: Option<Rotation>,
    /// What has come in, population by population, and what has left, outlet by outlet.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub insertions: Vec<Inserted>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outlets: Vec<Removed>,
    /// What makes the result doubtful, in words.
    pub doubts: Vec<String>,
    /// Why the run ended: `last step`, `at rest`, `at rest, unjammed`, `jamming fraction found`, `interrupted` or `error`.
    pub ended: &'static str,
    /// Why the run ended before its time.
    pub stopped: Option<String>,
    pub version: &'static str,
    #[serde(flatten)]
    pub surroundings: Surroundings,
}

/// The deepest overlap of a run, and when it was seen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Deepest {
    pub over_radius: f64,
    pub step: u64,
    /// s
    pub time: f64,
    /// A grain that has it, and the other one, or the name of the wall; None where it is too shallow to matter.
    pub grain: Option<u32>,
    pub other_grain: Option<u32>,
    pub wall: Option<String>,
}

impl Deepest {
    /// Overlaps of less, in radii, matter to nobody.
    const SHALLOW: f64 = 0.01;

    /// The deeper one of what was seen so far and of now, where the sample is of.
    ///
    /// # Errors
    /// As [`Simulation::deepest_overlap`].
    pub fn update(so_far: &mut Option<Deepest>, simulation: &mut Simulation, sample: &Sample) -> Result<()> {
        let over_radius = sample.max_overlap_over_radius;
        if Deepest::is_deeper(so_far.as_ref(), over_radius) {
            let found = if over_radius > Deepest::SHALLOW { simulation.deepest_overlap()? } else { None };
            let pair = found.and_then(|found| found.pair);
            *so_far = Some(Deepest::of(simulation, &DeepOverlap { over_radius, step: sample.step, pair }));
        }
        Ok(())
    }

    /// The deeper one of what was seen so far and of what the simulation has seen in its steps.
    pub fn update_from_steps(so_far: &mut Option<Deepest>, simulation: &Simulation) {
        let deeper = |found: &&DeepOverlap| Deepest::is_deeper(so_far.as_ref(), found.over_radius);
        if let Some(found) = simulation.deep_overlap().filter(deeper) {
            *so_far = Some(Deepest::of(simulation, found));
        }
    }

    fn is_deeper(so_far: Option<&Deepest>, over_radius: f64) -> bool {
        over_radius > so_far.map_or(0.0, |deepest| deepest.over_radius)
    }

    fn of(simulation: &Simulation, found: &DeepOverlap) -> Deepest {
        let &DeepOverlap { over_radius, step, pair } = found;
        let (grain, other) = pair.unzip();
        let (other_grain, wall) = match other {
            Some(Other::Grain(id)) => (Some(id), None),
            Some(Other::Wall(wall)) => (None, Some(simulation.assembly().walls[wall as usize].name.clone())),
            None => (None, None),
        };
        let time = step as f64 * simulation.dt();
        Deepest { over_radius, step, time, grain, other_grain, wall }
    }
}

impl Display for Deepest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "an overlap was {:.2} radii deep", self.over_radius)?;
        match (self.grain, self.other_grain, &self.wall) {
            (Some(grain), Some(other), _) => write!(f, ", of grains {grain} and {other}")?,
            (Some(grain), None, Some(wall)) => write!(f, ", of grain {grain} and the wall {wall}")?,
            _ => {}
        }
        write!(f, ", at step {} (t = {:.4e} s)", self.step, self.time)
    }
}

/// How the contacts of the steps of contact dynamics have been solved.
#[derive(Clone, Debug, Serialize)]
pub struct Relaxation {
    /// Steps that ended with a residual above the tolerance.
    pub unconverged_steps: u64,
    /// Largest residual of a contact, by the natural map and relative to what acts on it.
    pub residual_max: f64,
    pub residual_mean: f64,
    pub iterations_mean: f64,
    /// Of solvers that solve contacts one by one: updates that found no solution.
    pub local_failures: u64,
    /// How far the forces on a free grain are from balance at most, over its weight or the mean contact force, and which
    /// grain that is.
    pub force_balance_max: Option<f64>,
    pub force_balance_grain: Option<u32>,
}

impl Relaxation {
    fn new(solved: &SolverStatistics, balance: Option<(f64, u32)>) -> Relaxation {
        let steps = solved.steps.max(1) as f64;
        Relaxation {
            unconverged_steps: solved.unconverged,
            residual_max: solved.residual_max,
            residual_mean: solved.residual_sum / steps,
            iterations_mean: solved.iterations as f64 / steps,
            local_failures: solved.local_failures,
            force_balance_max: balance.map(|(worst, _)| worst),
            force_balance_grain: balance.map(|(_, grain)| grain),
        }
    }
}

/// How clumps have turned.
#[derive(Clone, Debug, Serialize)]
pub struct Rotation {
    pub clumps: usize,
    /// Most rounds of the iteration for the rotation of a clump in a step.
    pub rotation_rounds_max: u32,
    /// How often one ended before it met the tolerance.
    pub rotation_rounds_capped: u32,
}

/// Grains (clumps) of a population that have come in over time.
#[derive(Clone, Debug, Serialize)]
pub struct Inserted {
    pub name: String,
    /// Of so many.
    pub count: usize,
    pub inserted: usize,
    /// kg
    pub mass: f64,
    /// Times at which grains were to come in, and those of them at which one found no room.
    pub batches: u64,
    pub full: u64,
}

impl Inserted {
    fn new((insertion, inlet): (&Insertion, &Inlet)) -> Inserted {
        let (name, count) = (insertion.name.clone(), insertion.count());
        let Inlet { inserted, mass, full, batches, .. } = *inlet;
        Inserted { name, count, inserted, mass, batches, full }
    }
}

/// Grains (clumps) that have left.
#[derive(Clone, Debug, Serialize)]
pub struct Removed {
    pub name: String,
    pub removed: u64,
    /// kg
    pub mass: f64,
    /// kg m/s
    pub momentum: DVec3,
}

impl Removed {
    fn new((outlet, left): (&scene::Outlet, &Outlet)) -> Removed {
        Removed { name: outlet.name.clone(), removed: left.removed, mass: left.mass, momentum: left.momentum }
    }
}

/// True strains along the axes, and shears.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Strain {
    pub xx: f64,
    pub yy: f64,
    pub zz: f64,
    pub yz: f64,
    pub xz: f64,
    pub xy: f64,
}

/// What a simulation consists of now.
pub struct State<'a> {
    pub grains: &'a [Grain],
    pub clumps: &'a [Clump],
    pub walls: &'a [scene::Wall],
    /// Of its contacts.
    pub totals: Totals,
}

/// How a run ended.
pub struct Ending {
    pub wall_seconds: f64,
    pub converged: bool,
    /// Whether a target of the cell ended it.
    pub target_met: bool,
    pub ended: &'static str,
    pub stopped: Option<String>,
    pub deepest: Option<Deepest>,
    /// The deepest overlap of the state of another run that it began with, over the radius.
    pub inherited: f64,
    /// States of a search for the jamming fraction.
    pub jamming: Jamming,
}

impl Summary {
    /// Of a simulation now, with the sample and what it consists of now.
    ///
    /// # Errors
    /// Whatever goes wrong when the engine is asked.
    pub fn new(
        scene: &str,
        simulation: &mut Simulation,
        sample: &Sample,
        State { grains, clumps, walls, totals }: State,
        ending: Ending,
    ) -> Result<Summary> {
        let rounds = simulation.rotation_rounds()?;
        let balance = if simulation.solver_statistics().is_some() { simulation.force_balance()? } else { None };
        let (domain, strain) = (simulation.domain()?, simulation.strain()?);
        let s = &*simulation;
        let assembly = &s.assembly_in(domain);
        let (momentum, angular_momentum) = if clumps.is_empty() {
            let masses = measure::masses(assembly);
            (measure::momentum(grains, &masses), measure::angular_momentum(assembly, grains, &masses))
        } else {
            (measure::momentum_of_clumps(assembly, clumps), measure::angular_momentum_of_clumps(assembly, clumps))
        };
        let packing = Packing::added_up(assembly, grains, clumps, walls, totals);
        let coordination = Coordination::of(&packing, &carrying(&packing));
        let loads = packing.loads_on_walls();
        let of_stresses = assembly.missed_stresses(sample.cell.map(|cell| cell.stress()));
        let of_walls = assembly.missed_forces(walls, loads.iter().map(|load| load.normal_force));
        // A fraction or a pressure is met in passing, wherever stresses are then.
        let of_cell = assembly.stop.packing_fraction.is_some() || assembly.stop.pressure.is_some();
        let in_passing = ending.target_met && of_cell;
        let off_target = if ending.converged || in_passing { Vec::new() } else { [of_stresses, of_walls].concat() };
        let stress = Cell::of(&packing).map(|cell| stress(&packing, cell.volume()));
        let inside = measure::packing_fraction(assembly, grains, walls);
        let overall = measure::overall_packing_fraction(assembly, grains, walls);
        let work = grains.len() as f64 * s.step() as f64;
        Ok(Summary {
            scene: scene.to_owned(),
            engine: s.engine().name(),
            adapter: s.engine().adapter(),
            precision: s.model().precision.label(),
            particles: grains.len(),
            steps: s.step(),
            time: s.time(),
            dt: s.dt(),
            dt_bound: s.dt_bound(),
            wall_seconds: ending.wall_seconds,
            particle_steps_per_second: work / ending.wall_seconds,
            bytes_per_particle: s.bytes_per_particle()?,
            replayed_chunks: s.replayed_chunks(),
            lost_contacts: s.lost_contacts(),
            contacts: sample.contacts,
            coordination_number: sample.coordination_number,
            coordination_without_rattlers: coordination.coordination_without_rattlers,
            rattlers: coordination.rattlers,
            stress: stress.map(|stress| stress.total),
            pressure: stress.map(|stress| stress.pressure),
            packing_fraction: inside.map(|f| f.value),
            packing_fraction_error: inside.map(|f| f.error),
            overall_packing_fraction: overall.map(|f| f.value),
            overall_packing_fraction_error: overall.map(|f| f.error),
            diameters: Sizes::of(assembly),
            max_overlap_over_radius: sample.max_overlap_over_radius,
            position_quantum: s.position_quantum(),
            unbalanced_force_ratio: sample.unbalanced_force_ratio,
            kinetic_energy: sample.kinetic_energy,
            momentum,
            angular_momentum,
            converged: ending.converged,
            missed: missed(assembly, sample, &off_target, &ending),
            strain: strain.map(|[xx, yy, zz, yz, xz, xy]| Strain { xx, yy, zz, yz, xz, xy }),
            jamming: ending.jamming.found(assembly),
            relaxation: s.solver_statistics().map(|solved| Relaxation::new(solved, balance)),
            rotation: rounds.map(|(most, capped)| Rotation {
                clumps: clumps.len(),
                rotation_rounds_max: most,
                rotation_rounds_capped: capped,
            }),
            insertions: s.assembly().insertions.iter().zip(s.inlets()).map(Inserted::new).collect(),
            outlets: s.assembly().outlets.iter().zip(s.outlets()).map(Removed::new).collect(),
            doubts: doubts(s, sample, &off_target, &ending),
            deepest_overlap: ending.deepest,
            ended: ending.ended,
            stopped: ending.stopped,
            version: env!("CARGO_PKG_VERSION"),
            surroundings: Surroundings::new(assembly, walls).with_loads(&loads),
        })
    }
}

/// Positions that are multiples of more than this, in radii of the smallest grain, leave overlaps too few digits: an
/// overlap of 1e-4 radii would be off by 1e-5 of it.
const COARSE: f64 = 1e-9;

fn doubts(s: &Simulation, sample: &Sample, off_target: &[String], ending: &Ending) -> Vec<String> {
    let assembly = s.assembly();
    let smallest = assembly.grains.iter().map(|grain| grain.radius).fold(f64::INFINITY, f64::min);
    let coarse = s.position_quantum().filter(|quantum| *quantum > COARSE * smallest).map(|quantum| {
        format!(
            "so far from the origin positions in single precision are multiples of {quantum:.1e} m, {:.1e} of the smallest radius; use \
             --precision double",
            quantum / smallest
        )
    });
    // Nobody looks for more, until an overlap is deeper than what another run has left.
    let left = Some(ending.inherited).filter(|left| *left > DEEP_OVERLAP);
    let least = left.map_or(DEEP_OVERLAP, |left| DEEPER * left);
    let deepest = ending.deepest.as_ref().filter(|deepest| deepest.over_radius >= least);
    let deep = deepest.map(Deepest::to_string);
    let unseen = left.map(|left| {
        format!(
            "the state that it began with had an overlap {left:.2} radii deep; its own are judged only where they are deeper than \
             {least:.2} radii"
        )
    });
    let unsolved = s.solver_statistics().filter(|solved| solved.unconverged > 0).map(|solved| {
        format!(
            "{} of {} steps were not solved within solver.max_iterations: a contact had a residual of up to {:.1e}",
            solved.unconverged, solved.steps, solved.residual_max
        )
    });
    let missed = missed(assembly, sample, off_target, ending);
    let off_target = if missed.is_some() { &[] } else { off_target };
    let jamming = doubt_of_jamming(assembly, &ending.jamming);
    let told = [unseen, deep, unsolved, missed, jamming, coarse];
    told.into_iter().flatten().chain(off_target.iter().cloned()).chain(s.held_up()).collect()
}

/// States that have not come to rest, or a fraction that was not found.
fn doubt_of_jamming(assembly: &Assembly, jamming: &Jamming) -> Option<String> {
    let protocol = assembly.stop.jamming?;
    match (jamming.found(assembly), jamming.unconverged()) {
        (None, _) => {
            Some("the run ended before a state was jammed, or with jammed states alone that are not at rest".to_owned())
        }
        (Some(_), 0) => None,
        (Some(_), unconverged) => Some(format!(
            "{unconverged} of {} states were not at rest after {} steps, and are not in the fit; see jamming.csv",
            jamming.states.len(),
            protocol.relaxation_steps
        )),
    }
}

/// Rest that was asked for and not reached, with targets of servos, which are a part of it.
fn missed(assembly: &Assembly, sample: &Sample, off_target: &[String], ending: &Ending) -> Option<String> {
    let asked = assembly.stop.equilibrium.filter(|_| !ending.converged && !ending.target_met)?;
    let found = sample.unbalanced_force_ratio;
    let rest = format!("stop.equilibrium = {asked:e} was not reached: the ratio of unbalanced forces is {found:.1e}");
    let moving = off_target.is_empty() || !sample.at_rest(asked);
    Some(moving.then_some(rest).into_iter().chain(off_target.iter().cloned()).collect::<Vec<_>>().join("; "))
}

/// What surrounds the grains: the part of the summary that a picture needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surroundings {
    pub dimension: usize,
    /// m/s²; summaries of older versions have none.
    #[serde(default)]
    gravity: DVec3,
    domain: Domain,
    walls: Vec<Wall>,
}

/// A bound that is not there is `null`; JSON has no infinity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Domain {
    lower: [Option<f64>; 3],
    upper: [Option<f64>; 3],
    periodic: [bool; 3],
    /// Of a cell that has been sheared, m.
    #[serde(default, skip_serializing_if = "Tilt::is_none")]
    tilt: Tilt,
}

/// Of the third edge along y and along x, and of the second along x, m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Tilt {
    yz: f64,
    xz: f64,
    xy: f64,
}

impl Tilt {
    fn is_none(&self) -> bool {
        *self == Tilt::default()
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Wall {
    name: String,
    #[serde(flatten)]
    shape: Shape,
    velocity: DVec3,
    spin: f64,
    material: String,
    /// Of all grains on it, N and, about its point or centre, N m.
    force: Option<DVec3>,
    moment: Option<DVec3>,
    /// N, along the normals of the contacts; summaries of older versions have none.
    #[serde(default)]
    normal_force: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Shape {
    Plane { point: DVec3, normal: DVec3 },
    Cylinder { center: DVec3, radius: f64 },
}

impl Surroundings {
    /// Of a scene, with its walls where they are now.
    pub fn new(assembly: &Assembly, walls: &[scene::Wall]) -> Surroundings {
        let bounds = |corner: DVec3| corner.to_array().map(|x| Some(x).filter(|x| x.is_finite()));
        let domain = &assembly.domain;
        let wall = |wall: &scene::Wall| Wall {
            name: wall.name.clone(),
            shape: match wall.surface {
                Surface::Plane { point, normal } => Shape::Plane { point, normal },
                Surface::Cylinder { center, radius } => Shape::Cylinder { center, radius },
            },
            velocity: wall.velocity,
            spin: wall.spin,
            material: assembly.materials[wall.material as usize].name.clone(),
            force: None,
            moment: None,
            normal_force: None,
        };
        Surroundings {
            dimension: assembly.dimension,
            gravity: assembly.gravity,
            domain: Domain {
                lower: bounds(domain.lower),
                upper: bounds(domain.upper),
                periodic: domain.periodic,
                tilt: Tilt { yz: domain.tilt.x, xz: domain.tilt.y, xy: domain.tilt.z },
            },
            walls: walls.iter().map(wall).collect(),
        }
    }

    /// With what the grains do to the walls.
    fn with_loads(mut self, loads: &[LoadOnWall]) -> Surroundings {
        for (wall, load) in self.walls.iter_mut().zip(loads) {
            (wall.force, wall.moment) = (Some(load.force), Some(load.moment));
            wall.normal_force = Some(load.normal_force);
        }
        self
    }

    /// Unbounded space without walls.
    pub fn empty(dimension: usize) -> Surroundings {
        let domain = Domain { lower: [None; 3], upper: [None; 3], periodic: [false; 3], tilt: Tilt::default() };
        Surroundings { dimension, gravity: DVec3::ZERO, domain, walls: Vec::new() }
    }

    /// From `summary.json`.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read, [`Error::Scene`] if it is no summary.
    pub fn read(path: &Path) -> Result<Surroundings> {
        let text = fs::read_to_string(path).map_err(at(path))?;
        serde_json::from_str(&text).map_err(|e| Error::Scene(format!("{}: {e}", path.display())))
    }

    /// m/s²
    pub fn gravity(&self) -> DVec3 {
        self.gravity
    }

    pub fn domain(&self) -> scene::Domain {
        let corner = |of: [Option<f64>; 3], without: f64| DVec3::from_array(of.map(|x| x.unwrap_or(without)));
        scene::Domain {
            lower: corner(self.domain.lower, f64::NEG_INFINITY),
            upper: corner(self.domain.upper, f64::INFINITY),
            periodic: self.domain.periodic,
            tilt: DVec3::new(self.domain.tilt.yz, self.domain.tilt.xz, self.domain.tilt.xy),
            ..scene::Domain::default()
        }
    }

    /// The walls as a picture needs them: materials are not told apart.
    pub fn walls(&self) -> Vec<scene::Wall> {
        let wall = |wall: &Wall| scene::Wall {
            name: wall.name.clone(),
            surface: match wall.shape {
                Shape::Plane { point, normal } => Surface::Plane { point, normal },
                Shape::Cylinder { center, radius } => Surface::Cylinder { center, radius },
            },
            velocity: wall.velocity,
            spin: wall.spin,
            motion: scene::Motion::default(),
            servo: None,
            material: 0,
        };
        self.walls.iter().map(wall).collect()
    }
}
