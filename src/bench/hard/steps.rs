//! The time step around its critical value. Everything starts at rest in place, with the velocities of the mode that
//! swings fastest: then its amplitude after n steps is v Δt U(n), U(n+1) = (2 − z²) U(n) − U(n−1), z = 2 Δt/Δt_c. The
//! mode may be one of turns alone, which are no part of the state, so amplitudes are summed up from velocities and
//! spins.

use super::common::*;
use super::figure::{Figure, Length, worse};
use super::scenes::scene;
use super::stiffness::{Link, Mode, critical_mode, product};
use crate::{
    scene::{Assembly, Pair, TimeStep},
    time_step::bound,
};
use glam::DVec3;
use std::sync::OnceLock;

/// A scene with its linear theory.
struct System {
    scene: Assembly,
    /// Masses and radii.
    grains: Vec<(f64, f64)>,
    critical: f64,
    mode: Mode,
    /// Amplitudes of the mode between which the scene is linear: contacts neither open nor begin.
    from: f64,
    to: f64,
}

impl System {
    /// `linear` is the displacement, m, that the most moved grain, or its surface, may have.
    fn new(mut scene: Assembly, links: &[Link], bench: Bench, linear: f64) -> System {
        scene.solver.allow_unstable = true;
        let grains: Vec<(f64, f64)> =
            scene.grains.iter().map(|g| (mass(scene.dimension, g.radius), g.radius)).collect();
        let law = scene.pairs[0];
        let kt = if law.friction > 0.0 { law.tangential_stiffness } else { 0.0 };
        let (critical, mode) = critical_mode(scene.dimension, &grains, links, law.normal_stiffness, kt);
        let most = mode.iter().map(|(x, w)| x.length().max(R * w.length())).fold(0.0, f64::max);
        let to = linear / most;
        System { scene, grains, critical, mode, from: bench.pick(1e-6, 0.05) * to, to }
    }

    /// Amplitude of the mode after 0, 1, 2, … steps of this share of the critical one, in units of v Δt.
    fn amplitudes(&self, bench: Bench, share: f64, most: usize) -> Vec<f64> {
        let dt = share * self.critical;
        let mut scene = self.scene.clone();
        scene.solver.dt = TimeStep::Fixed(dt);
        for (g, (v, w)) in scene.grains.iter_mut().zip(&self.mode) {
            (g.velocity, g.spin) = (self.from / dt * *v, self.from / dt * *w);
        }
        let mut simulation = bench.start(&scene);
        let mut path: Vec<f64> = vec![0.0, 1.0];
        while path.len() <= most && path[path.len() - 1].abs() * self.from < self.to {
            simulation.advance(1).unwrap();
            let now = simulation.grains().unwrap();
            let velocities: Mode = now.iter().map(|g| (g.velocity, g.spin)).collect();
            let v = product(scene.dimension, &self.grains, &velocities, &self.mode) * dt / self.from;
            // v at step n is (x(n+1) − x(n−1)) / 2 Δt.
            path.push(path[path.len() - 2] + 2.0 * v);
        }
        path.iter().map(|x| x.abs()).collect()
    }

    fn figures(&self, bench: Bench, tolerance: f64) -> Vec<Figure> {
        let safe = bound(&self.scene) / self.critical;
        // Where it is exact, by rounding it may be above.
        let mut figures = vec![Figure::new("bound over critical step: ½ to 1", 0.75, 0.25 + 1e-9, safe)];
        // Below: U(n) = sin nθ / sin θ, cos θ = 1 − z²/2.
        let theta = (1.0 - 1.8_f64.powi(2) / 2.0).acos();
        let most = (1..=200).map(|n| (theta * f64::from(n)).sin().abs() / theta.sin()).fold(0.0, f64::max);
        let largest = self.amplitudes(bench, 0.9, 200).into_iter().fold(0.0, worse);
        figures.push(Figure::new("0.9: largest amplitude in 200 steps over v Δt", most, tolerance * most, largest));
        let path = self.amplitudes(bench, 1.0, 50);
        let n = path.len() - 1;
        figures.push(Figure::new("1.0: amplitude of step n over n v Δt", 1.0, tolerance, path[n] / n as f64));
        for share in [1.01, 1.1] {
            let z = 2.0 * share;
            let q = z * z / 2.0 - 1.0_f64;
            let lambda = q + (q * q - 1.0).sqrt();
            let path = self.amplitudes(bench, share, 200);
            // The decaying solution shares the first steps: the closed form says how much is left of it.
            let n = path.len() - 1;
            let left = (1.0 - lambda.powi(-2 * n as i32)) / (1.0 - lambda.powi(-2 * (n as i32 - 1)));
            let found = path[n] / path[n - 1] / left;
            figures.push(Figure::new(format!("{share}: growth of a step"), lambda, tolerance * lambda, found));
        }
        figures
    }
}

/// Contacts as they are, with their overlaps.
fn links(scene: &Assembly) -> Vec<Link> {
    let grains = &scene.grains;
    let mut links = Vec::new();
    for i in 0..grains.len() {
        for j in i + 1..grains.len() {
            let d = scene.domain.nearest(grains[j].position - grains[i].position);
            let overlap = grains[i].radius + grains[j].radius - d.length();
            if overlap > 0.0 {
                links.push(Link { i, j: Some(j), n: d.normalize(), overlap });
            }
        }
        for wall in &scene.walls {
            let crate::scene::Surface::Plane { normal, .. } = wall.surface else { panic!("a plane") };
            let overlap = grains[i].radius - wall.surface.distance(grains[i].position);
            links.push(Link { i, j: None, n: -normal, overlap });
        }
    }
    links
}

/// A sphere that two walls squeeze by 2 % of R: |λ| = 1, 1, 1.3266, 2.4282. Exactly linear, so only rounding is
/// allowed: in f32 an overlap of 2e-2 R known to 1e-6 of itself gives 2e-8 R a step to an amplitude of 5e-4 R.
pub fn confined_sphere(bench: Bench, _: Length) -> Vec<Figure> {
    let scene = scene("confined_sphere");
    System::new(scene.clone(), &links(&scene), bench, 0.01 * R).figures(bench, bench.pick(1e-6, 5e-4))
}

/// FCC, pressed by 1 % of R, sticking with k_T = k_N. Off by the turning of contacts: amplitude over R.
pub fn close_packing(bench: Bench, _: Length) -> Vec<Figure> {
    let edge = (2.0 - 0.01) * R * 2.0_f64.sqrt();
    let mut scene = periodic_box(2.0 * edge);
    // A friction that never slides.
    scene.pairs = vec![Pair { tangential_stiffness: KN, ..law(1e3) }];
    let shifts = [DVec3::ZERO, DVec3::new(0.5, 0.5, 0.0), DVec3::new(0.5, 0.0, 0.5), DVec3::new(0.0, 0.5, 0.5)];
    for k in 0..8 {
        let cell = DVec3::new(f64::from(k % 2), f64::from(k / 2 % 2), f64::from(k / 4));
        for shift in shifts {
            let at = edge * (cell + shift + DVec3::splat(0.2));
            scene.grains.push(grain(at.x, at.y, at.z));
        }
    }
    let contacts = links(&scene);
    assert_eq!(contacts.len(), 6 * scene.grains.len(), "12 contacts each");
    let system = System::new(scene, &contacts, bench, bench.pick(1e-4, 1e-3) * R);
    let mut figures = system.figures(bench, bench.pick(1e-3, 3e-3));
    // Pressed by 1 %, which the table's unpressed lattice is not.
    let unit = (mass(3, R) / KN).sqrt();
    figures.push(Figure::new("critical step over √(m/k_N)", 0.3162, 0.003, system.critical / unit));
    figures
}

/// 64 equal spheres at solid fraction 0.66, relaxed, sticking with k_T = 2/7 k_N.
pub fn random_packing(bench: Bench, _: Length) -> Vec<Figure> {
    static PACKING: OnceLock<Assembly> = OnceLock::new();
    let mut scene = PACKING.get_or_init(|| relaxed(64, 0.66)).clone();
    scene.pairs = vec![law(1e3)];
    let contacts = links(&scene);
    let system = System::new(scene, &contacts, bench, 1e-4 * R);
    let mut figures = system.figures(bench, bench.pick(1e-3, 2e-2));
    let unit = (mass(3, R) / KN).sqrt();
    // The most constrained grain of a sample decides; so small a one spreads by a tenth.
    figures.push(Figure::new("critical step over √(m/k_N)", 0.697, 0.07, system.critical / unit));
    figures
}

fn periodic_box(length: f64) -> Assembly {
    let mut scene = blank(3);
    scene.domain.upper = DVec3::splat(length);
    scene.domain.lower = DVec3::ZERO;
    scene.domain.periodic = [true; 3];
    scene
}

/// Spheres at random in a periodic box, pushed apart by heavily damped motion without friction, in f64 for all engines.
fn relaxed(count: usize, fraction: f64) -> Assembly {
    let length = (count as f64 * 4.0 / 3.0 * std::f64::consts::PI / fraction).cbrt() * R;
    let mut scene = periodic_box(length);
    let omega = (KN / mass(3, R)).sqrt();
    scene.solver.dt = TimeStep::Fixed(0.3 / omega);
    scene.solver.allow_unstable = true; // far below: at most 20 contacts overlap at the random start
    scene.solver.damping = 0.5 * omega;
    scene.solver.margin = 10.0; // deep overlaps push hard
    let mut random = Random(11);
    scene.grains = (0..count)
        .map(|_| {
            let at = 0.5 * length * (DVec3::ONE + random.vector(3));
            grain(at.x, at.y, at.z)
        })
        .collect();
    let mut simulation = CPU.start(&scene);
    simulation.advance(8000).unwrap();
    scene.grains = simulation.grains().unwrap();
    scene.grains.iter_mut().for_each(|g| g.velocity = DVec3::ZERO);
    (scene.solver.damping, scene.solver.margin) = (0.0, 0.2);
    scene
}
