//! One scene under one setting, and what its steps cost.

use crate::{
    error::Result,
    model::Precision,
    scene::{Assembly, Grain, Scene, TimeStep},
    simulation::{EngineChoice, Options, Simulation},
    time_step,
};
use std::{path::Path, time::Instant};

/// An engine in a precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// Always in double precision.
    Cpu,
    GpuSingle,
    GpuDouble,
}

impl Backend {
    pub const ALL: [Backend; 3] = [Backend::Cpu, Backend::GpuSingle, Backend::GpuDouble];

    pub fn engine(self) -> &'static str {
        if self == Backend::Cpu { "cpu" } else { "gpu" }
    }

    pub fn precision(self) -> Precision {
        if self == Backend::GpuSingle { Precision::Single } else { Precision::Double }
    }

    /// For a simulation.
    pub fn options(self) -> Options {
        let engine = if self == Backend::Cpu { EngineChoice::Cpu } else { EngineChoice::Gpu };
        Options { engine, precision: self.precision(), ..Options::default() }
    }
}

/// What a case is run with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    pub backend: Backend,
    /// Time step over the one that `dt = "auto"` gives.
    pub factor: f64,
}

impl Setting {
    /// What trajectories are compared with: f64 at a sixteenth of the automatic step.
    pub const REFERENCE: Setting = Setting { backend: Backend::Cpu, factor: 1.0 / 16.0 };
}

/// What steps cost.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    pub grains: usize,
    pub steps: u64,
    /// Wall time of the steps, s.
    pub seconds: f64,
    /// s
    pub dt: f64,
    /// s
    pub dt_bound: f64,
    pub bytes_per_particle: f64,
    /// That a particle-step has to move, where that was counted.
    pub bytes_per_step: Option<f64>,
}

impl Cost {
    /// Wall seconds per simulated second.
    pub fn wall_per_simulated(&self) -> f64 {
        self.seconds / (self.steps as f64 * self.dt)
    }

    /// Particle-steps per second.
    pub fn rate(&self) -> f64 {
        self.grains as f64 * self.steps as f64 / self.seconds
    }

    pub fn ms_per_step(&self) -> f64 {
        1e3 * self.seconds / self.steps as f64
    }

    /// Of two runs of the same size.
    pub fn and(self, other: Cost) -> Cost {
        Cost { steps: self.steps + other.steps, seconds: self.seconds + other.seconds, ..self }
    }
}

/// A simulation whose steps are timed.
pub struct Trial {
    pub simulation: Simulation,
    steps: u64,
    seconds: f64,
}

impl Trial {
    /// Build the scene with this setting; that is not timed.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn new(assembly: &Assembly, setting: Setting) -> Result<Trial> {
        let mut assembly = assembly.clone();
        assembly.solver.dt = TimeStep::Fixed(setting.factor * automatic_step(&assembly)?);
        Ok(Trial { simulation: Simulation::new(assembly, setting.backend.options())?, steps: 0, seconds: 0.0 })
    }

    /// # Errors
    /// As [`Simulation::advance`].
    pub fn advance(&mut self, steps: u64) -> Result<()> {
        let start = Instant::now();
        self.simulation.advance(steps)?;
        self.seconds += start.elapsed().as_secs_f64();
        self.steps += steps;
        Ok(())
    }

    pub fn cost(&self) -> Result<Cost> {
        Ok(Cost {
            grains: self.simulation.assembly().grains.len(),
            steps: self.steps,
            seconds: self.seconds,
            dt: self.simulation.dt(),
            dt_bound: self.simulation.dt_bound(),
            bytes_per_particle: self.simulation.bytes_per_particle()?,
            bytes_per_step: None,
        })
    }
}

/// What `dt = "auto"` gives, whatever the scene says, s.
pub fn automatic_step(assembly: &Assembly) -> Result<f64> {
    let mut assembly = assembly.clone();
    if let TimeStep::Fixed(_) = assembly.solver.dt {
        assembly.solver.dt = TimeStep::Auto { fraction: 0.15 };
    }
    Ok(time_step::choose(&assembly)?.0)
}

/// Run a scene over `steps` automatic steps' time and return the grains with the cost. Other steps take as many more or
/// fewer as end at the same time, so `steps` should be a multiple of the largest factor.
pub fn run(assembly: &Assembly, setting: Setting, steps: u64) -> Result<(Vec<Grain>, Cost)> {
    let mut trial = Trial::new(assembly, setting)?;
    trial.advance((steps as f64 / setting.factor).round() as u64)?;
    Ok((trial.simulation.grains()?, trial.cost()?))
}

/// A scene of the benchmark with some values changed.
///
/// # Errors
/// [`crate::Error::Scene`] if the embedded text is no scene: a defect.
pub fn scene(name: &str, text: &str, set: &[String]) -> Result<Assembly> {
    Scene::parse(text, name, Path::new("."), set)?.assemble()
}

/// Root mean square distance between the same grains in two states, over the mean radius; the shorter way around along
/// periodic axes.
pub fn displacement(assembly: &Assembly, a: &[Grain], b: &[Grain]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| assembly.domain.nearest(a.position - b.position).length_squared());
    let mean_radius = a.iter().map(|g| g.radius).sum::<f64>() / a.len() as f64;
    rms(squares) / mean_radius
}

/// Root of the mean of squares; not a number if any of them is.
pub fn rms(squares: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = squares.len() as f64;
    (squares.sum::<f64>() / n).sqrt()
}

/// The largest of some numbers; not a number if any of them is, which `f64::max` would swallow.
pub fn largest(numbers: impl Iterator<Item = f64>) -> f64 {
    numbers.fold(0.0, |a, b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) })
}
