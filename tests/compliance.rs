//! Contact dynamics with compliance: contacts give way by the springs and dashpots of the discrete element method, taken
//! implicitly, in steps that are many times as long.

mod common;

use common::*;
use glam::DVec3;
use packstone::{
    measure::Contact,
    scene::{Assembly, Dashpot, Grain, Method, Pair, Relaxation},
    simulation::Simulation,
    solve::Solver,
};

/// The scene in contact dynamics, by its own springs.
fn compliant(scene: &Assembly, dt: f64, solver: Solver, tolerance: f64) -> Assembly {
    let like = rigid(scene.dimension, dt, 0.0, tolerance);
    let Method::ContactDynamics(relaxation) = like.solver.method else { unreachable!() };
    let relaxation = Relaxation { solver, compliant: true, max_iterations: 100_000, ..relaxation };
    let mut scene = scene.clone();
    scene.solver = packstone::scene::Solver { method: Method::ContactDynamics(relaxation), ..like.solver };
    scene
}

fn jacobi(scene: &Assembly, dt: f64, bench: &Bench) -> Assembly {
    compliant(scene, dt, Solver::JacobiAccelerated, bench.pick(1e-10, 1e-5))
}

/// √(m/k) of the default grain, s: the discrete element method takes about a tenth of it.
fn period(dimension: usize) -> f64 {
    (mass(dimension, R) / KN).sqrt()
}

/// A step of spring and dashpot, solved by hand: they press with k (Δt u - g) + c u at the approach u that they leave.
#[test]
fn an_impact_is_one_of_spring_and_dashpot() {
    for bench in engines() {
        for dashpot in [Dashpot::None, Dashpot::Restitution(0.3), Dashpot::MassScaled(2e3)] {
            for gap in [0.0, -0.01 * R, 1e-4 * R] {
                let (m, dt, v) = (mass(3, R), 3.0 * period(3), 0.1);
                let mut scene = blank(3);
                scene.pairs = vec![Pair { dashpot, ..law(0.0) }];
                scene.walls = vec![plane(DVec3::ZERO, DVec3::Z)];
                scene.grains = vec![Grain { velocity: -v * DVec3::Z, ..grain(0.0, 0.0, R + gap) }];
                let c = match dashpot {
                    Dashpot::None => 0.0,
                    Dashpot::Restitution(e) => {
                        let ratio = -e.ln() / (std::f64::consts::PI.powi(2) + e.ln().powi(2)).sqrt();
                        2.0 * ratio * (m * KN).sqrt()
                    }
                    Dashpot::MassScaled(eta) => eta * m,
                };
                // What the dashpot does before a gap is closed is left out.
                let pressed = if gap > 0.0 { (KN * dt + c) * gap / dt } else { KN * gap };
                let u = (m * v + dt * pressed) / (m + dt * (KN * dt + c));
                let left = -bench.after(&jacobi(&scene, dt, &bench), 1)[0].velocity.z;
                close(&format!("{} {dashpot:?} {gap}", bench.name), left, u, v, bench.pick(1e-9, 1e-5));
            }
        }
    }
}

/// A column rests on its springs: the overlaps are those of the weight above.
#[test]
fn a_column_rests_on_its_springs() {
    let n = 8;
    for bench in engines() {
        for dimension in [2, 3] {
            let mut scene = falling(dimension, n);
            scene.solver.damping = 0.0;
            let mut simulation = bench.start(&jacobi(&scene, 20.0 * period(dimension), &bench));
            simulation.advance(400).unwrap();
            let grains = simulation.grains().unwrap();
            let mut below = 0.0;
            for (k, g) in grains.iter().enumerate() {
                let at = g.position.dot(up(dimension));
                let (touch, load) = (at - below - if k == 0 { R } else { 2.0 * R }, (n - k) as f64);
                let overlap = load * mass(dimension, R) * G / KN;
                close(
                    &format!("{} {dimension} overlap {k}", bench.name),
                    -touch,
                    overlap,
                    overlap,
                    bench.pick(1e-6, 2e-3),
                );
                below = at;
            }
        }
    }
}

fn falling(dimension: usize, n: usize) -> Assembly {
    let mut scene = blank(dimension);
    scene.gravity = -G * up(dimension);
    scene.walls = vec![floor(dimension)];
    scene.grains =
        (0..n).map(|k| Grain { position: (2 * k + 1) as f64 * R * up(dimension), ..grain(0.0, 0.0, 0.0) }).collect();
    scene
}

/// Grains between walls, brought to rest by springs in small steps.
fn bed(dimension: usize) -> (Assembly, Simulation) {
    let mut scene = falling(dimension, 0);
    let across = if dimension == 2 { vec![DVec3::X] } else { vec![DVec3::X, DVec3::Y] };
    let width = 10.0 * R;
    for axis in &across {
        scene.walls.push(plane(DVec3::ZERO, *axis));
        scene.walls.push(plane(width * *axis, -*axis));
    }
    // As soft in space as in the plane.
    let stiffness = KN * mass(dimension, R) / mass(2, R);
    let dashpot = Dashpot::Restitution(0.3);
    let law = Pair { normal_stiffness: stiffness, tangential_stiffness: 2.0 / 7.0 * stiffness, dashpot, ..law(0.4) };
    scene.pairs = vec![law];
    let mut random = Random(7);
    let count = if dimension == 2 { 60 } else { 120 };
    scene.grains = (0..count)
        .map(|k| {
            let side = 4_usize;
            let row = if dimension == 2 { k / side } else { k / (side * side) };
            let mut place = |cell: usize| (1.3 + 2.4 * cell as f64 + 0.1 * random.unit()) * R;
            let (x, y) = (place(k % side), if dimension == 2 { 0.0 } else { place(k / side % side) });
            let radius = R * (0.9 + 0.2 * random.unit());
            let height = (1.3 + 2.4 * row as f64) * R;
            let position = if dimension == 2 { DVec3::new(x, height, 0.0) } else { DVec3::new(x, y, height) };
            Grain { position, radius, ..grain(0.0, 0.0, 0.0) }
        })
        .collect();
    scene.solver.dt = packstone::scene::TimeStep::Fixed(0.1 * period(2));
    scene.solver.damping = 20.0;
    let mut simulation = CPU.start(&scene);
    simulation.advance(30_000).unwrap();
    // What would still be falling is no bed at rest.
    let fastest = simulation.grains().unwrap().iter().map(|g| g.velocity.length()).fold(0.0, f64::max);
    assert!(fastest < 1e-5, "{fastest} m/s");
    scene.grains = simulation.grains().unwrap();
    (scene, simulation)
}

fn largest_difference(a: &[Contact], b: &[Contact]) -> f64 {
    let pairs = |contacts: &[Contact]| contacts.iter().map(|c| (c.grain, c.other)).collect::<Vec<_>>();
    assert_eq!(pairs(a), pairs(b));
    let largest = a.iter().map(|c| c.force.length()).fold(0.0, f64::max);
    a.iter().zip(b).map(|(a, b)| (a.force - b.force).length() / largest).fold(0.0, f64::max)
}

/// A bed that rests on springs goes on resting, with each force as it was, friction too.
#[test]
fn a_bed_at_rest_keeps_its_forces() {
    for dimension in [2, 3] {
        let (scene, mut springs) = bed(dimension);
        let (history, of_now) = (springs.contact_history().unwrap(), springs.remembers_now());
        let before = touching(&mut springs);
        assert!(before.len() > scene.grains.len(), "{} contacts", before.len());
        for bench in engines() {
            let next = jacobi(&scene, 10.0 * period(2), &bench);
            let (mut simulation, kept) = Simulation::with_history(next, bench.options(), &history, of_now).unwrap();
            assert!(kept >= before.len());
            simulation.advance(50).unwrap();
            let solved = *simulation.solver_statistics().unwrap();
            assert_eq!(solved.unconverged, 0, "{} {solved:?}", bench.name);
            let off = largest_difference(&before, &touching(&mut simulation));
            assert!(off < bench.pick(1e-3, 2e-3), "{} {dimension}: forces differ by {off:e}", bench.name);
        }
    }
}

fn touching(simulation: &mut Simulation) -> Vec<Contact> {
    let mut contacts = simulation.contacts().unwrap();
    let largest = contacts.iter().map(|contact| contact.force.length()).fold(0.0, f64::max);
    contacts.retain(|contact| contact.force.length() > 1e-6 * largest);
    contacts
}

/// Forces are unique: all relaxations find the same.
#[test]
fn all_solvers_find_the_same_forces() {
    let (mut scene, mut springs) = bed(2);
    let (history, of_now) = (springs.contact_history().unwrap(), springs.remembers_now());
    // Some of them slide now.
    scene.gravity = G * DVec3::new(0.4, -1.0, 0.0);
    let forces = |solver: Solver| {
        let next = compliant(&scene, 10.0 * period(2), solver, 1e-9);
        let (mut simulation, _) = Simulation::with_history(next, CPU.options(), &history, of_now).unwrap();
        simulation.advance(1).unwrap();
        let solved = *simulation.solver_statistics().unwrap();
        assert_eq!(solved.unconverged, 0, "{solver:?} {solved:?}");
        touching(&mut simulation)
    };
    let first = forces(Solver::JacobiAccelerated);
    assert!(first.iter().any(|c| c.tangential_force().length() > 0.399 * c.normal_force()));
    for solver in [Solver::ColouredAccelerated, Solver::GaussSeidel, Solver::Socp, Solver::Lemke] {
        let off = largest_difference(&first, &forces(solver));
        assert!(off < 1e-6, "{solver:?}: {off:e}");
    }
}
