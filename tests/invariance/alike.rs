//! The same bits from run to run, whatever threads there are and whenever somebody looks.

use crate::{bits, common::*, gas, periodic, violent};
use glam::{DQuat, DVec3};
use packstone::{
    bench::hard,
    scene::{Assembly, Clump, Dashpot, Grain, Method, Scene, Shape, TimeStep},
    simulation::Simulation,
    solve::Solver,
    state::{ARRAYS, Array, Length, array, present},
};
use std::hash::{DefaultHasher, Hash, Hasher};

/// All that the arrays of a simulation hold, bit by bit, or row by row in any order.
fn contents(simulation: &mut Simulation) -> Vec<(&'static str, u64)> {
    let arrays = present(simulation.model(), ARRAYS);
    let dims = simulation.model().dims();
    let state = simulation.read(&arrays).unwrap();
    let of = |array: &&'static Array| {
        let (mut hasher, mut bits) = (DefaultHasher::new(), Vec::new());
        state.column(array).lanes(dims, &mut |x| bits.push(x.to_bits()));
        if UNORDERED.contains(&array.name) {
            let width = bits.len() / state.column(array).len().max(1);
            let mut rows: Vec<&[u64]> = bits.chunks(width.max(1)).collect();
            // Behind the contacts that have a colour is what was there before.
            if array.length == Length::Contacts {
                rows.truncate(state.coloring_state[0].contacts as usize);
            }
            rows.sort_unstable();
            rows.hash(&mut hasher);
        } else {
            bits.hash(&mut hasher);
        }
        (array.name, hasher.finish())
    };
    arrays.iter().map(of).collect()
}

/// Places that atomics give out in whatever order invocations come: of grains in their cell, before cells are sorted,
/// and of contacts in their colour, of which none sees what the others do. The same rows are there all the same.
const UNORDERED: [&str; 8] = [
    "cell_rank",
    "contact_color",
    "colored_contact",
    "colored_geometry",
    "colored_free_velocity",
    "colored_inverse_effective_mass",
    "colored_impulse",
    "colored_impulse_before",
];

/// Crowds with grains of two sizes, 1:10, for every way to go through a step.
fn crowds() -> Vec<(String, Assembly, u64)> {
    let set = [
        "population.0.count=2",
        "population.1.count=498",
        "wall.0.upper=[0.025, 0.025, 2]",
        "population.0.region.upper=[0.025, 0.025, 0.05]",
        "solver.max_iterations=60",
    ];
    let path = hard::folder().join("rigid_settling_3d.toml");
    let rigid = Scene::load(&path, &set.map(str::to_owned)).and_then(|scene| scene.assemble()).unwrap();
    let shape = Shape::of_union("dimer", &members(&[DVec3::ZERO, DVec3::X]), 3);
    let mut clumps = rigid.clone();
    let at = |(k, g): (usize, &Grain)| Clump {
        position: g.position,
        orientation: DQuat::from_rotation_y(k as f64),
        velocity: g.velocity,
        radius: g.radius * 0.79,
        ..clump(0)
    };
    set_clumps(&mut clumps, vec![shape], rigid.grains.iter().enumerate().map(at).collect());
    let soft = |mut scene: Assembly| {
        scene.solver.method = Method::DiscreteElements;
        scene.solver.dt = TimeStep::Fixed(8e-6);
        scene.solver.margin = 0.2;
        scene.pairs.iter_mut().for_each(|pair| {
            (pair.normal_stiffness, pair.tangential_stiffness) = (2e3, 1e3);
            pair.dashpot = Dashpot::Restitution(0.8);
        });
        scene
    };
    let mut crowds = Vec::new();
    for (name, scene) in [("spheres", rigid), ("clumps", clumps)] {
        for solver in [Solver::JacobiAccelerated, Solver::ColouredAccelerated] {
            let mut scene = scene.clone();
            if let Method::ContactDynamics(relaxation) = &mut scene.solver.method {
                relaxation.solver = solver;
            }
            crowds.push((format!("{name}, {}", solver.label()), scene, 3));
        }
        crowds.push((format!("{name}, dem"), soft(scene), 250));
    }
    crowds
}

/// Runs of one scene beside each other, so that threads are interrupted anywhere and invocations come in another order
/// every time: all that there is has the same bits.
#[test]
fn runs_are_alike() {
    for bench in engines() {
        for (name, scene, steps) in crowds() {
            let run = || {
                let mut simulation = bench.start(&scene);
                assert!(simulation.model().large_grains, "{name}");
                let piece = |_| {
                    simulation.advance(steps).unwrap();
                    contents(&mut simulation)
                };
                let pieces: Vec<_> = (0..4).map(piece).collect();
                let contacts = simulation.sample().unwrap().contacts;
                assert!(contacts > 10, "{name} on {}: {contacts} contacts", bench.name);
                pieces
            };
            let runs: Vec<_> = std::thread::scope(|scope| {
                let threads: Vec<_> = (0..3).map(|_| scope.spawn(run)).collect();
                threads.into_iter().map(|thread| thread.join().unwrap()).collect()
            });
            for (k, pieces) in runs.iter().enumerate() {
                for (piece, (found, expected)) in pieces.iter().zip(&runs[0]).enumerate() {
                    let differ = found.iter().zip(expected).filter(|(a, b)| a != b).map(|(a, _)| a.0);
                    let differ: Vec<&str> = differ.collect();
                    assert!(differ.is_empty(), "{name} on {}, run {k}, piece {piece}: {differ:?}", bench.name);
                }
            }
        }
    }
}

/// Tasks are blocks of grains, not shares of the threads: as many threads as one likes give the same bits.
#[test]
fn threads_leave_no_trace() {
    let side = 9; // 729 grains, three blocks
    let mut scene = periodic(gas(3, side, 0.6, Dashpot::Restitution(0.9)), side);
    scene.grains.iter_mut().for_each(|g| g.velocity *= 2.0);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bits(&CPU.after(&scene, 200)))
    };
    let alone = run(1);
    for threads in [2, 3, 8] {
        assert!(run(threads) == alone, "{threads} threads: other bits");
    }
}

/// Advancing in pieces, and looking in between, is the same as advancing at once.
#[test]
fn looking_does_not_disturb() {
    let (scene, _) = violent(3);
    for bench in engines() {
        let at_once = bench.after(&scene, 150);
        let mut simulation = bench.start(&scene);
        for piece in [1, 2, 47, 13, 87] {
            simulation.advance(piece).unwrap();
            simulation.sample().unwrap();
            simulation.grains().unwrap();
            simulation.read(&[&array::TANGENTIAL_FORCE, &array::NEIGHBOUR]).unwrap();
        }
        assert_eq!(simulation.step(), 150);
        assert!(bits(&simulation.grains().unwrap()) == bits(&at_once), "{}", bench.name);
    }
}
