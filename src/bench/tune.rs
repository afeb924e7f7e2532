//! The fastest setting that keeps an error, for a user's scene (`packstone tune`).
//!
//! Errors are those of a small part of the scene over a short time, from a moment at which its grains touch, against
//! f64 at a sixteenth of the automatic step. Speeds are those of the first steps of the whole scene.

use super::{
    log::again,
    machine::Machine,
    speed::{Budget, timed},
    trial::{self, Backend, Cost, Setting, Trial, automatic_step, displacement},
};
use crate::{
    check::balance::{BALANCED_STEPS, balances},
    error::{Error, Result},
    model::Precision,
    scene::{Assembly, Grain, Solver},
};
use glam::DVec3;
use serde::Serialize;

/// Free grains that the small version has at most.
const MOST: usize = 1000;
/// Its time, in automatic steps: a few collisions, not yet chaos. A multiple of all factors.
const HORIZON: u64 = 480;
/// Particle-steps spent on reaching contact.
const PATIENCE: f64 = 1e7;
const FACTORS: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 3.0, 4.0];

/// What was tried, and what is best.
#[derive(Clone, Debug, Serialize)]
pub struct Tuning {
    /// RMS distance from the reference over the mean radius that is asked for.
    pub asked: f64,
    /// How the scene was made small.
    pub version: String,
    /// s; where the compared stretch begins and how long it is.
    pub from: f64,
    pub horizon: f64,
    /// Mean contacts of a free grain at its begin. Without contacts there is little to compare.
    pub coordination_number: f64,
    pub machine: Machine,
    pub candidates: Vec<Candidate>,
    /// The fastest candidate that keeps the error; None if there is none.
    pub best: Option<usize>,
    /// The candidate with the smallest error.
    pub closest: Option<usize>,
}

/// A setting with its error and its speed.
#[derive(Clone, Debug, Serialize)]
pub struct Candidate {
    pub engine: &'static str,
    pub precision: &'static str,
    /// s
    pub dt: f64,
    pub dt_over_auto: f64,
    /// None: the run failed.
    pub error: Option<f64>,
    /// Of the whole scene: wall seconds per simulated second.
    pub wall_per_simulated: Option<f64>,
    pub particle_steps_per_second: Option<f64>,
    /// What it loses by rounding the same way in every step, with how much of what should be there is missing.
    pub loses: Option<(&'static str, f64)>,
    /// `ok`, or `failed: ` and why.
    pub status: String,
}

impl Candidate {
    fn new(setting: Setting, automatic: f64, outcome: Result<(f64, Loss, Cost)>) -> Candidate {
        let dt = setting.factor * automatic;
        let (error, loses, rate, wall, status) = match outcome {
            Ok((error, loses, cost)) => {
                // A step costs the same whatever its length.
                let wall = cost.ms_per_step() * 1e-3 / dt;
                (Some(error), loses, Some(cost.rate()), Some(wall), "ok".to_owned())
            }
            Err(error) => (None, None, None, None, format!("failed: {error}")),
        };
        Candidate {
            engine: setting.backend.engine(),
            precision: setting.backend.precision().label(),
            dt,
            dt_over_auto: setting.factor,
            error,
            loses,
            wall_per_simulated: wall,
            particle_steps_per_second: rate,
            status,
        }
    }

    /// Whether the error is at most this; one that is not a number is not. What loses momentum keeps no error for long.
    pub fn keeps(&self, error: f64) -> bool {
        self.loses.is_none() && self.error.is_some_and(|own| own <= error)
    }
}

/// Try engines, precisions and steps on a scene. `watch` hears what is being done.
///
/// # Errors
/// [`Error::Scene`] if the error asked for is no positive number; whatever stops the reference.
pub fn tune(scene: &Assembly, asked: f64, watch: &mut dyn FnMut(&str)) -> Result<Tuning> {
    if !(asked > 0.0 && asked.is_finite()) {
        return Err(Error::Scene(format!("--error {asked}: must be a number > 0, in mean radii")));
    }
    if !scene.clumps.is_empty() {
        return Err(Error::Scene("tune does not take clumps yet: small versions would cut them up".to_owned()));
    }
    let machine = Machine::here();
    let (small, version) = reduce(scene);
    watch(&format!("{version}; advancing it until grains touch"));
    let start = in_contact(small)?;
    watch("reference: cpu in f64 at a sixteenth of the automatic step");
    let (expected, _) = trial::run(&start.assembly, Setting::REFERENCE, HORIZON)?;
    let automatic = automatic_step(&start.assembly)?;
    let mut candidates = Vec::new();
    for backend in machine.backends() {
        watch(&format!("{} in {} precision", backend.engine(), backend.precision().label()));
        let cost = of_whole(scene, backend);
        for factor in FACTORS {
            let setting = Setting { backend, factor };
            let outcome = error(&start.assembly, setting, &expected)
                .and_then(|error| Ok((error, loss(&start.assembly, setting)?, *cost.as_ref().map_err(again)?)));
            candidates.push(Candidate::new(setting, automatic, outcome));
        }
    }
    let least = |key: fn(&Candidate) -> Option<f64>, among: &dyn Fn(&Candidate) -> bool| {
        let finite = |k: &usize| among(&candidates[*k]) && key(&candidates[*k]).is_some_and(f64::is_finite);
        (0..candidates.len()).filter(finite).min_by(|a, b| {
            let value = |k: &usize| key(&candidates[*k]).unwrap_or(f64::INFINITY);
            value(a).total_cmp(&value(b))
        })
    };
    Ok(Tuning {
        asked,
        version,
        from: start.time,
        horizon: HORIZON as f64 * automatic,
        coordination_number: start.coordination_number,
        best: least(|c| c.wall_per_simulated, &|c| c.keeps(asked)),
        closest: least(|c| c.error, &|_| true),
        machine,
        candidates,
    })
}

fn error(start: &Assembly, setting: Setting, expected: &[Grain]) -> Result<f64> {
    let (grains, _) = trial::run(start, setting, HORIZON)?;
    Ok(displacement(start, &grains, expected))
}

/// What a setting loses, and the part that is missing.
type Loss = Option<(&'static str, f64)>;

/// The balance that holds least, if one does not. In double precision they do.
fn loss(start: &Assembly, setting: Setting) -> Result<Loss> {
    if setting.backend.precision() == Precision::Double {
        return Ok(None);
    }
    let mut trial = Trial::new(start, setting)?;
    let found = balances(&mut trial.simulation, BALANCED_STEPS)?;
    // Energy depends on the length of the step first of all, of which the error tells.
    let broken = found.into_iter().filter(|b| b.of != "energy" && !b.holds());
    Ok(broken.max_by(|a, b| a.worst.total_cmp(&b.worst)).map(|b| (b.of, b.worst)))
}

/// What a step of the whole scene costs.
fn of_whole(scene: &Assembly, backend: Backend) -> Result<Cost> {
    Ok(timed(scene, Setting { backend, factor: 1.0 }, Budget { work: 1e6, least: 10, repeats: 1 })?.2)
}

/// A scene of at most [`MOST`] free grains, and in words how it was made: the grains whose centres lie in a window
/// about the middle of the free ones, as high as the scene if there is gravity, so that depths and loads stay what they
/// are.
fn reduce(scene: &Assembly) -> (Assembly, String) {
    let free: Vec<&Grain> = scene.grains.iter().filter(|g| !g.fixed).collect();
    if free.len() <= MOST {
        return (scene.clone(), format!("the whole scene, {} grains", scene.grains.len()));
    }
    let up = (0..scene.dimension).max_by(|a, b| scene.gravity[*a].abs().total_cmp(&scene.gravity[*b].abs()));
    let up = up.filter(|axis| scene.gravity[*axis] != 0.0);
    let axes: Vec<usize> = (0..scene.dimension).filter(|axis| Some(*axis) != up).collect();
    let middle = free.iter().map(|g| g.position).sum::<DVec3>() / free.len() as f64;
    let reach = |g: &Grain| axes.iter().map(|a| (g.position[*a] - middle[*a]).abs()).fold(0.0, f64::max);
    let mut reaches: Vec<f64> = free.iter().map(|g| reach(g)).collect();
    reaches.sort_by(f64::total_cmp);
    // Strictly inside of the first that is too many, unless a lattice puts all of them equally far.
    let half = if reaches[0] < reaches[MOST] { reaches[MOST] } else { f64::INFINITY };
    let mut small = scene.clone();
    small.grains.retain(|g| reach(g) < half);
    let shape = if up.is_some() { "a column of the scene, of its full height" } else { "a window in the scene" };
    let words = format!(
        "{shape}, {:.3e} m wide about its middle: {} of {} grains; walls and domain as they are",
        2.0 * half,
        small.grains.len(),
        scene.grains.len()
    );
    (small, words)
}

struct Start {
    assembly: Assembly,
    time: f64,
    coordination_number: f64,
}

/// The scene when its free grains have one contact on average, or when patience or its time ends.
fn in_contact(scene: Assembly) -> Result<Start> {
    const PIECE: u64 = 50;
    let mut trial = Trial::new(&scene, Setting { backend: Backend::Cpu, factor: 1.0 })?;
    let patience = (PATIENCE / scene.grains.len() as f64).min(1e5) as u64;
    let of_time = scene.stop.time.map(|time| (time / trial.simulation.dt()) as u64);
    let last = of_time.into_iter().chain(scene.stop.steps).fold(patience, u64::min).saturating_sub(HORIZON);
    let mut coordination_number = trial.simulation.sample()?.coordination_number;
    while coordination_number < 1.0 && trial.simulation.step() < last {
        trial.advance(PIECE)?;
        coordination_number = trial.simulation.sample()?.coordination_number;
    }
    let (grains, walls) = (trial.simulation.grains()?, trial.simulation.walls()?);
    let time = trial.simulation.time();
    // What grains have come to by themselves is a start.
    let solver = Solver { allow_overlap: true, ..scene.solver };
    Ok(Start { assembly: Assembly { grains, walls, solver, ..scene }, time, coordination_number })
}
