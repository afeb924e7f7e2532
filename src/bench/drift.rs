//! Long runs (`packstone bench precision`): whether roundings add up like a random walk, or with the number of steps.
//!
//! Energy and momentum are computed in f64 from the state that an engine writes out, in a frame that is carried along.
//! The energy is the one that leapfrog itself keeps while forces are linear, ½ Σ m v(n − 1/2)·v(n + 1/2) + V: that of
//! v(n) swings by (ω Δt)², which would hide all else.

use super::{
    hard::{
        clumps::turning_bodies,
        common::{G, R, blank, grain, plane},
    },
    log::{Log, Measure, again},
    trial::{Backend, Cost, Setting, Trial, automatic_step, largest},
};
use crate::{
    error::Result,
    measure::{angular_momentum_of_clumps, mass_of_clump, masses, momentum},
    scene::{Assembly, Clump, Domain, Grain, Surface},
    simulation::Simulation,
};
use glam::DVec3;

/// The shortest run is of 10 to the power of this many steps.
const FIRST: u32 = 4;
/// Looks at the state per decade.
const LOOKS: u64 = 10;

/// What everything in a periodic box is carried along with, m/s.
const CARRIED: DVec3 = DVec3::new(4.0, 3.0, 0.0);

struct Case {
    name: &'static str,
    /// Time step over the automatic one.
    factor: f64,
    scene: fn() -> Assembly,
    carried: DVec3,
}

const CASES: [Case; 5] = [
    Case { name: "bead", factor: 0.01, scene: bead, carried: DVec3::ZERO },
    Case { name: "ring", factor: 1.0, scene: ring, carried: CARRIED },
    Case { name: "ring", factor: 0.01, scene: ring, carried: CARRIED },
    Case { name: "triangle", factor: 0.01, scene: triangle, carried: CARRIED },
    Case { name: "bodies", factor: 1.0, scene: bodies, carried: DVec3::ZERO },
];

/// A bead bounces on a floor.
fn bead() -> Assembly {
    let mut scene = blank(3);
    scene.gravity = DVec3::NEG_Z * G;
    scene.walls = vec![plane(DVec3::ZERO, DVec3::Z)];
    scene.grains = vec![Grain { velocity: DVec3::NEG_Z * 5e-3, ..grain(0.0, 0.0, 1.001 * R) }];
    scene
}

/// Three grains in a periodic box that is too short for them swing against each other, and never part.
fn ring() -> Assembly {
    let overlap = 3e-3 * R;
    let mut scene = periodic(DVec3::new(6.0 * R - 3.0 * overlap, 6.0 * R, 6.0 * R));
    scene.grains = [0.03, -0.02, -0.01]
        .into_iter()
        .enumerate()
        .map(|(k, v)| Grain { velocity: CARRIED + v * DVec3::X, ..grain((2.0 * R - overlap) * k as f64, R, R) })
        .collect();
    scene
}

/// Three smooth grains collide in a periodic box.
fn triangle() -> Assembly {
    let mut scene = periodic(DVec3::splat(6.0 * R));
    let at = |x: f64, y: f64, z: f64, v: DVec3| Grain { velocity: CARRIED + v, ..grain(x * R, y * R, z * R) };
    scene.grains = vec![
        at(1.0, 1.0, 1.0, DVec3::new(0.7, 0.5, 0.3)),
        at(3.9, 1.4, 1.2, DVec3::new(-0.8, 0.2, 0.1)),
        at(2.1, 3.8, 1.5, DVec3::new(0.1, -0.7, -0.4)),
    ];
    scene
}

fn periodic(upper: DVec3) -> Assembly {
    Assembly { domain: Domain { lower: DVec3::ZERO, upper, periodic: [true; 3], ..Domain::default() }, ..blank(3) }
}

/// Two free bodies turn by 1e-3 rad in a step.
pub fn bodies() -> Assembly {
    let mut scene = turning_bodies(2);
    let dt = automatic_step(&scene).expect("they could touch");
    scene.clumps.iter_mut().for_each(|clump| clump.spin *= 1e-3 / dt);
    scene
}

/// After 10^4 steps, and so on for every decade.
pub fn run(log: &mut Log, decades: u32) {
    for case in &CASES {
        for setting in log.settings(&[case.factor]).into_iter().filter(|s| s.backend != Backend::GpuDouble) {
            let mut run = Run::start(case, setting);
            for decade in FIRST..FIRST + decades {
                log.run(&format!("{}, 10^{decade} steps", case.name), setting, || {
                    run.as_mut().map_err(|error| again(error))?.until(10_u64.pow(decade))
                });
            }
        }
    }
}

struct Run<'a> {
    case: &'a Case,
    scene: Assembly,
    trial: Trial,
    start: Kept,
    /// So far, relative.
    energy: f64,
    momentum: f64,
}

impl Run<'_> {
    fn start(case: &Case, setting: Setting) -> Result<Run<'_>> {
        let scene = (case.scene)();
        let mut trial = Trial::new(&scene, setting)?;
        let start = Kept::of(case, &scene, &mut trial.simulation)?;
        Ok(Run { case, scene, trial, start, energy: 0.0, momentum: 0.0 })
    }

    /// The largest changes since the start.
    fn until(&mut self, step: u64) -> Result<(Cost, Vec<Measure>)> {
        let every = step / LOOKS;
        while self.trial.simulation.step() < step {
            let done = self.trial.simulation.step();
            self.trial.advance(every - done % every)?;
            let now = Kept::of(self.case, &self.scene, &mut self.trial.simulation)?;
            let changes = [now.energy - self.start.energy, (now.momentum - self.start.momentum).length()];
            self.energy = largest([self.energy, changes[0].abs() / self.start.kinetic].into_iter());
            self.momentum = largest([self.momentum, changes[1] / self.start.size_of_momentum].into_iter());
        }
        let mut measures = vec![Measure::error("energy", "", self.energy)];
        if self.scene.walls.is_empty() {
            let quantity = if self.scene.clumps.is_empty() { "momentum" } else { "angular momentum" };
            measures.push(Measure::error(quantity, "", self.momentum));
        }
        Ok((self.trial.cost()?, measures))
    }
}

/// What ought to stay.
struct Kept {
    /// J, and of it that of motion.
    energy: f64,
    kinetic: f64,
    /// Of clumps that of their spins.
    momentum: DVec3,
    size_of_momentum: f64,
}

impl Kept {
    fn of(case: &Case, scene: &Assembly, simulation: &mut Simulation) -> Result<Kept> {
        let dt = simulation.dt();
        Ok(match &simulation.clumps()?[..] {
            [] => Kept::by_grains(scene, &simulation.grains()?, case.carried, dt),
            clumps => Kept::by_bodies(scene, clumps),
        })
    }

    fn by_grains(scene: &Assembly, grains: &[Grain], carried: DVec3, dt: f64) -> Kept {
        let masses = masses(scene);
        let mut forces: Vec<DVec3> = masses.iter().map(|m| *m * scene.gravity).collect();
        let mut potential: f64 = grains.iter().zip(&forces).map(|(g, weight)| -weight.dot(g.position)).sum();
        let stiffness = scene.pairs[0].normal_stiffness;
        for (i, a) in grains.iter().enumerate() {
            for (j, b) in grains[..i].iter().enumerate() {
                let apart = scene.domain.nearest(a.position - b.position);
                let overlap = (a.radius + b.radius - apart.length()).max(0.0);
                potential += 0.5 * stiffness * overlap * overlap;
                forces[i] += stiffness * overlap * apart.normalize();
                forces[j] -= stiffness * overlap * apart.normalize();
            }
            for wall in &scene.walls {
                let Surface::Plane { point, normal } = wall.surface else { continue };
                let overlap = (a.radius - (a.position - point).dot(normal)).max(0.0);
                potential += 0.5 * stiffness * overlap * overlap;
                forces[i] += stiffness * overlap * normal;
            }
        }
        let kinetic: f64 =
            grains.iter().zip(&masses).map(|(g, m)| 0.5 * m * (g.velocity - carried).length_squared()).sum();
        let halves: f64 = forces.iter().zip(&masses).map(|(f, m)| dt * dt * f.length_squared() / (8.0 * m)).sum();
        Kept {
            energy: kinetic - halves + potential,
            kinetic,
            momentum: momentum(grains, &masses),
            size_of_momentum: grains.iter().zip(&masses).map(|(g, m)| m * g.velocity.length()).sum(),
        }
    }

    fn by_bodies(scene: &Assembly, clumps: &[Clump]) -> Kept {
        let energy = |c: &Clump| {
            let shape = &scene.shapes[c.shape as usize];
            let own = (c.orientation * shape.frame).inverse() * c.spin;
            0.5 * mass_of_clump(scene, c) * c.radius * c.radius * (shape.gyration * own).dot(own)
        };
        let kinetic = clumps.iter().map(energy).sum();
        let momentum = angular_momentum_of_clumps(scene, clumps).expect("they are not in a periodic box");
        Kept { energy: kinetic, kinetic, momentum, size_of_momentum: momentum.length() }
    }
}
