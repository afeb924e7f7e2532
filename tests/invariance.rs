//! What must not change: conserved quantities, symmetries, and results under everything that is only bookkeeping.

mod common;

use common::*;
use glam::{DQuat, DVec3};
use packstone::{
    Error,
    bench::hard,
    measure::{angular_momentum, masses, momentum},
    scene::{Assembly, Clump, Dashpot, Grain, Method, Scene, Shape, Surface, TimeStep, Wall},
    simulation::{Options, Simulation},
    solve::Solver,
    state::{ARRAYS, Array, array, present},
};
use std::hash::{DefaultHasher, Hash, Hasher};

/// Overlaps of about 2 % of R.
fn speed(dimension: usize) -> f64 {
    0.02 * R * (KN / mass(dimension, R)).sqrt()
}

/// 1/50 of a contact of two default grains.
fn dt(dimension: usize) -> f64 {
    std::f64::consts::PI / (2.0 * KN / mass(dimension, R)).sqrt() / 50.0
}

/// A dense frictional cloud in open space, in two materials.
fn gas(dimension: usize, side: usize, friction: f64, dashpot: Dashpot) -> Assembly {
    let mut scene = blank_dt(dimension, dt(dimension));
    scene.grains = cloud(dimension, side, speed(dimension), 3);
    let first = packstone::scene::Pair { dashpot, ..law(friction) };
    set_laws(&mut scene, &[first, packstone::scene::Pair { normal_stiffness: 0.6 * KN, ..first }]);
    scene.grains.iter_mut().enumerate().for_each(|(k, g)| g.material = (k % 2) as u32);
    scene
}

fn periodic(mut scene: Assembly, side: usize) -> Assembly {
    for axis in 0..scene.dimension {
        (scene.domain.lower[axis], scene.domain.upper[axis]) = (0.0, SPACING * side as f64);
        scene.domain.periodic[axis] = true;
    }
    scene
}

/// Momentum, linear and angular, of isolated frictional grains with dashpots: every force has its opposite, and both
/// act at one point (erratum E7).
#[test]
fn momentum_is_conserved() {
    let mut pair = gas(3, 2, 0.5, Dashpot::Restitution(0.8));
    pair.grains.truncate(2);
    pair.grains[1].position = pair.grains[0].position + 1.9 * R * DVec3::new(1.0, 2.0, 2.0).normalize();
    pair.grains[1].velocity = -pair.grains[0].velocity + DVec3::new(0.0, -0.5 * speed(3), 0.0);
    let scenes = [
        ("pair", pair),
        ("2D gas", gas(2, 10, 0.5, Dashpot::Restitution(0.8))),
        ("3D gas", gas(3, 5, 0.5, Dashpot::None)),
    ];
    for (name, scene) in scenes {
        let masses = masses(&scene);
        let scale: f64 = scene.grains.iter().zip(&masses).map(|(g, m)| m * g.velocity.length()).sum();
        let extent = scene.grains.iter().map(|g| g.position.length()).fold(R, f64::max);
        for bench in engines() {
            let after = bench.after(&scene, 400);
            let moved = after.iter().zip(&scene.grains).map(|(a, b)| (a.velocity - b.velocity).length());
            assert!(moved.fold(0.0, f64::max) > 0.3 * speed(scene.dimension), "nothing collides");
            let linear = (momentum(&after, &masses) - momentum(&scene.grains, &masses)).length() / scale;
            let of = |grains: &[Grain]| angular_momentum(&scene, grains, &masses).expect("an open domain");
            let angular = of(&after) - of(&scene.grains);
            let angular = angular.length() / scale / extent;
            println!("{name} on {}: momentum {linear:.1e}, angular {angular:.1e}", bench.name);
            assert!(linear < bench.pick(1e-13, 1e-6), "{name} on {}: momentum {linear:e}", bench.name);
            // f32: a constant velocity is rounded the same way step after step, up to 400 half ulp of 3e-3 m.
            assert!(angular < bench.pick(1e-13, 1e-5), "{name} on {}: angular {angular:e}", bench.name);
        }
    }
}

/// Energy of an elastic frictionless gas: leapfrog conserves it on average, each touch costs (ω Δt)², random in sign.
#[test]
fn energy_of_an_elastic_gas() {
    let scene = periodic(gas(2, 8, 0.0, Dashpot::None), 8);
    let worst = |refine: u64| {
        let mut scene = scene.clone();
        scene.solver.dt = packstone::scene::TimeStep::Fixed(dt(2) / refine as f64);
        let mut simulation = CPU.start(&scene);
        let energy = |s: packstone::measure::Sample| s.kinetic_energy + s.elastic_energy;
        let first = energy(simulation.sample().unwrap());
        let mut worst: f64 = 0.0;
        for _ in 0..60 {
            simulation.advance(20 * refine).unwrap();
            worst = worst.max((energy(simulation.sample().unwrap()) / first - 1.0).abs());
        }
        worst
    };
    let (coarse, fine) = (worst(1), worst(4));
    println!("energy: {coarse:.1e}, with a quarter of the step {fine:.1e}");
    assert!(coarse < 2e-3 && fine < coarse / 8.0, "{coarse:e} {fine:e}");
}

/// Energy with friction but without sliding: an isolated pair that sticks keeps kinetic, normal and tangential energy.
#[test]
fn energy_of_a_sticking_pair() {
    for dimension in [2, 3] {
        let mut scene = blank_dt(dimension, dt(dimension) / 20.0);
        scene.pairs = vec![law(1e3)];
        scene.grains = vec![grain(0.0, 0.0, 0.0), grain(2.0 * R, 0.0, 0.0)];
        let v = 0.05 * speed(dimension);
        scene.grains[0].velocity = DVec3::new(v, v, 0.0);
        let mut simulation = CPU.start(&scene);
        let first = simulation.sample().unwrap().kinetic_energy;
        let mut exchanged: f64 = 0.0;
        for _ in 0..90 {
            simulation.advance(10).unwrap();
            let s = simulation.sample().unwrap();
            exchanged = exchanged.max(s.elastic_energy / first);
            close("energy", s.kinetic_energy + s.elastic_energy, first, first, 3e-3);
        }
        assert!(exchanged > 0.2, "{exchanged}");
    }
}

/// The cases of the symmetry tests: name, scene, steps.
fn scenes() -> Vec<(&'static str, Assembly, u64)> {
    let mut box3 = gas(3, 3, 0.4, Dashpot::Restitution(0.9));
    box3.gravity = DVec3::new(10.0, 20.0, -50.0);
    for axis in 0..3 {
        let side = 3.0 * SPACING;
        box3.walls.push(plane(DVec3::ZERO, DVec3::AXES[axis]));
        box3.walls.push(plane(DVec3::AXES[axis] * side, -DVec3::AXES[axis]));
    }
    box3.walls[1].velocity = DVec3::new(0.0, 0.3 * speed(3), 0.0);
    vec![("2D gas", gas(2, 6, 0.5, Dashpot::Restitution(0.8)), 300), ("3D box", box3, 200)]
}

/// How far two runs of the same physics may differ. Each rounds its coordinates at every step by up to half an ulp,
/// which in free flight goes the same way every time, and collisions make it grow: 2 steps times what the worst of four
/// shakes of the start by up to one rounding error, at a coordinate `member_offset`, does to the end.
fn rounding(bench: Bench, scene: &Assembly, steps: u64, offset: f64) -> f64 {
    let eps = bench.pick(f64::EPSILON, f64::from(f32::EPSILON));
    let expected = CPU.after(scene, steps); // in f64, so that only the shaking differs
    let spread = |seed: u64| {
        let mut random = Random(seed);
        let mut shaken = scene.clone();
        for g in &mut shaken.grains {
            g.position += eps * offset * random.vector(scene.dimension);
            g.velocity *= 1.0 + eps * random.sign();
        }
        distance(scene, &CPU.after(&shaken, steps), &expected)
    };
    let allowed = 2.0 * steps as f64 * (1..=4).map(spread).fold(0.0, f64::max);
    allowed.min(bench.pick(1e-8, 1e-2)) // far below what different physics does, in any case
}

#[track_caller]
fn same(what: &str, bench: Bench, scene: &Assembly, a: &[Grain], b: &[Grain], allowed: f64) {
    let found = distance(scene, a, b);
    println!("{what} on {}: {found:.1e} of {allowed:.1e}", bench.name);
    assert!(found <= allowed, "{what} on {}: {found:e}, allowed {allowed:e}", bench.name);
}

/// The order of the input decides only the order of sums.
#[test]
fn permutation() {
    for (name, scene, steps) in scenes() {
        let count = scene.grains.len();
        let place = |k: usize| (k * 5 + 2) % count; // 5 is prime to 27 and 36
        let mut permuted = scene.clone();
        for k in 0..count {
            permuted.grains[place(k)] = scene.grains[k];
        }
        for bench in engines() {
            let a = bench.after(&scene, steps);
            let b = bench.after(&permuted, steps);
            let b: Vec<Grain> = (0..count).map(|k| b[place(k)]).collect();
            same(name, bench, &scene, &b, &a, rounding(bench, &scene, steps, 3.0 * SPACING));
        }
    }
}

/// Physics knows no origin: 1,000 radii away nothing changes beyond rounding. In f64 rounding is that of the far
/// positions; in f32 positions carry a residue, and only the walls' own places are rounded there.
#[test]
fn translation() {
    for (name, scene, steps) in scenes() {
        for bench in engines() {
            let offset = 1000.0 * R;
            let shift =
                offset * if scene.dimension == 2 { DVec3::new(1.0, -0.7, 0.0) } else { DVec3::new(1.0, -0.7, 0.3) };
            let mut moved = scene.clone();
            moved.grains.iter_mut().for_each(|g| g.position += shift);
            for wall in &mut moved.walls {
                if let Surface::Plane { point, .. } = &mut wall.surface {
                    *point += shift;
                }
            }
            let mut a = bench.after(&moved, steps);
            a.iter_mut().for_each(|g| g.position -= shift);
            same(
                name,
                bench,
                &scene,
                &a,
                &bench.after(&scene, steps),
                rounding(
                    bench,
                    &scene,
                    steps,
                    bench.pick(offset, if scene.walls.is_empty() { 0.0 } else { offset }) + 6.0 * SPACING,
                ),
            );
        }
    }
}

fn rotated(scene: &Assembly, turn: DQuat) -> Assembly {
    let mut turned = scene.clone();
    turned.gravity = turn * scene.gravity;
    for wall in &mut turned.walls {
        wall.velocity = turn * wall.velocity;
        if let Surface::Plane { point, normal } = &mut wall.surface {
            (*point, *normal) = (turn * *point, turn * *normal);
        }
    }
    turned.grains = turn_grains(&scene.grains, turn);
    turned
}

fn turn_grains(grains: &[Grain], turn: DQuat) -> Vec<Grain> {
    let of = |g: &Grain| Grain { position: turn * g.position, velocity: turn * g.velocity, spin: turn * g.spin, ..*g };
    grains.iter().map(of).collect()
}

/// Physics knows no direction: a quarter turn and an odd angle, about z in the plane, about any axis in space.
#[test]
fn rotation() {
    for (name, scene, steps) in scenes() {
        let axis = if scene.dimension == 2 { DVec3::Z } else { DVec3::new(1.0, -2.0, 0.5).normalize() };
        let odd = DQuat::from_axis_angle(axis, 1.234);
        let quarter =
            DQuat::from_axis_angle(if scene.dimension == 2 { DVec3::Z } else { DVec3::Y }, 0.5 * std::f64::consts::PI);
        for (turn, angle) in [(quarter, "quarter"), (odd, "odd")] {
            let mut turned = rotated(&scene, turn);
            if scene.dimension == 2 {
                // What the quaternion's rounding leaves along z is no physics.
                turned.grains.iter_mut().for_each(|g| (g.position.z, g.velocity.z) = (0.0, 0.0));
                turned.grains.iter_mut().for_each(|g| (g.spin.x, g.spin.y) = (0.0, 0.0));
            }
            for bench in engines() {
                let back = turn_grains(&bench.after(&turned, steps), turn.inverse());
                let what = format!("{name}, {angle}");
                let allowed = rounding(bench, &scene, steps, 4.0 * SPACING);
                same(&what, bench, &scene, &back, &bench.after(&scene, steps), allowed);
            }
        }
    }
}

/// Mirror images: spins are axial vectors.
#[test]
fn reflection() {
    for (name, scene, steps) in scenes() {
        let flip = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
        let axial = |v: DVec3| DVec3::new(v.x, -v.y, -v.z);
        let mirror = |grains: &[Grain]| -> Vec<Grain> {
            let of =
                |g: &Grain| Grain { position: flip(g.position), velocity: flip(g.velocity), spin: axial(g.spin), ..*g };
            grains.iter().map(of).collect()
        };
        let mut mirrored = scene.clone();
        mirrored.gravity = flip(scene.gravity);
        mirrored.grains = mirror(&scene.grains);
        for wall in &mut mirrored.walls {
            wall.velocity = flip(wall.velocity);
            if let Surface::Plane { point, normal } = &mut wall.surface {
                (*point, *normal) = (flip(*point), flip(*normal));
            }
        }
        for bench in engines() {
            let back = mirror(&bench.after(&mirrored, steps));
            let allowed = rounding(bench, &scene, steps, 3.0 * SPACING);
            same(name, bench, &scene, &back, &bench.after(&scene, steps), allowed);
        }
    }
}

/// Everything that a run ends with, bit by bit.
fn bits(grains: &[Grain]) -> Vec<[u64; 9]> {
    let of = |g: &Grain| {
        let mut all = [0; 9];
        let parts = [g.position, g.velocity, g.spin].into_iter().flat_map(|v| v.to_array());
        all.iter_mut().zip(parts).for_each(|(bits, x)| *bits = x.to_bits());
        all
    };
    grains.iter().map(of).collect()
}

/// All that the arrays of a simulation hold, bit by bit.
fn contents(simulation: &mut Simulation) -> Vec<(&'static str, u64)> {
    let arrays = present(simulation.model(), ARRAYS);
    let dims = simulation.model().dims();
    let state = simulation.read(&arrays).unwrap();
    let of = |array: &&'static Array| {
        let mut hasher = DefaultHasher::new();
        state.column(array).lanes(dims, &mut |x| x.to_bits().hash(&mut hasher));
        (array.name, hasher.finish())
    };
    arrays.iter().map(of).collect()
}

/// Places that atomics give out in whatever order invocations come: of grains in their cell, before cells are sorted,
/// and of contacts in their colour, of which none sees what the others do.
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
                    let (shaken, others): (Vec<&str>, Vec<&str>) = differ.partition(|array| UNORDERED.contains(array));
                    println!("{name} on {}, run {k}, piece {piece}: other orders in {shaken:?}", bench.name);
                    assert!(others.is_empty(), "{name} on {}, run {k}, piece {piece}: {others:?}", bench.name);
                }
            }
        }
    }
}

/// A dense frictional periodic gas that is fast enough to need new lists every few steps.
fn violent(dimension: usize) -> (Assembly, u64) {
    let side = if dimension == 2 { 10 } else { 5 };
    let mut scene = periodic(gas(dimension, side, 0.6, Dashpot::Restitution(0.9)), side);
    scene.grains.iter_mut().for_each(|g| g.velocity *= 2.0);
    (scene, 400)
}

/// Lists are bookkeeping: the same bits from run to run, whether lists overflow or not, and however often they are
/// made.
#[test]
fn bookkeeping_leaves_no_trace() {
    for dimension in [2, 3] {
        let (scene, steps) = violent(dimension);
        for bench in engines() {
            let run = |options: Options| {
                let mut simulation = bench.start_with(&scene, options);
                simulation.advance(steps).unwrap();
                assert_eq!(simulation.lost_contacts(), 0, "{} lost contacts", bench.name);
                let sample = simulation.sample().unwrap();
                assert!(sample.contacts > 3, "{sample:?}");
                (bits(&simulation.grains().unwrap()), simulation.replayed_chunks())
            };
            let usual = bench.options();
            let (reference, replayed) = run(Options { entries: Some(100_000), ..usual });
            let overflows = run(Options { entries: Some(1), ..usual });
            let growing = run(Options { entries: Some(scene.grains.len() * 2), ..usual });
            println!("{dimension}D {}: {replayed}, {}, {} replays", bench.name, overflows.1, growing.1);
            assert!(overflows.1 > replayed, "nothing was done again for want of slots");
            for (what, found) in [
                ("again", run(Options { entries: Some(100_000), ..usual }).0),
                ("one slot", overflows.0),
                ("a slot or two per grain", growing.0),
                ("lists every step", run(Options { longest_chunk: 1, ..usual }).0),
                ("lists every three steps", run(Options { longest_chunk: 3, ..usual }).0),
                ("lists side by side", run(Options { lists_abreast: Some(32), ..usual }).0),
            ] {
                assert!(found == reference, "{dimension}D {}: {what}: other bits", bench.name);
            }
        }
    }
}

/// Sums are taken by the numbers of the grains, so that neither the reach of the lists nor the order of the cells
/// changes a bit of a row of the history. More grains than there are rows of partial sums.
#[test]
fn sums_leave_no_trace_of_the_lists() {
    for bench in engines() {
        for (side, dimension) in [(6, 3), (18, 3), (20, 2)] {
            let rows = |margin: f64| {
                let mut scene = gas(dimension, side, 0.5, Dashpot::Restitution(0.7));
                scene.gravity = DVec3::Y * -G;
                scene.solver.margin = margin;
                let mut simulation = bench.start(&scene);
                let mut row = || {
                    simulation.advance(30).unwrap();
                    let s = simulation.sample().unwrap();
                    let energies = [s.kinetic_energy, s.potential_energy, s.elastic_energy, s.dissipation];
                    let ratios = [s.unbalanced_force_ratio, s.max_overlap_over_radius, s.coordination_number];
                    [&energies[..], &ratios].concat().into_iter().map(f64::to_bits).collect::<Vec<_>>()
                };
                (0..3).map(|_| row()).collect::<Vec<_>>()
            };
            let given = rows(0.2);
            for margin in [0.07, 0.5, 1.0, 3.0] {
                assert_eq!(rows(margin), given, "{} {dimension}D {side}, margin {margin}", bench.name);
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

/// A chunk in which a grain outran its margin ends there: a cloud that starts at rest and falls onto a rough
/// floor outruns chunks that grew while it was slow.
#[test]
fn a_chunk_cut_short_leaves_no_trace() {
    for dimension in [2, 3] {
        let side = if dimension == 2 { 6 } else { 4 };
        let mut scene = gas(dimension, side, 0.6, Dashpot::Restitution(0.9));
        scene.grains.iter_mut().for_each(|g| g.velocity *= 0.02);
        scene.grains.iter_mut().for_each(|g| g.spin *= 0.02);
        let n = DVec3::AXES[dimension - 1];
        scene.gravity = 0.01 * speed(dimension) / dt(dimension) * (DVec3::X - n);
        scene.walls = vec![plane(DVec3::ZERO, n)];
        for bench in engines() {
            let run = |longest_chunk: u32| {
                let mut simulation = bench.start_with(&scene, Options { longest_chunk, ..bench.options() });
                simulation.advance(250).unwrap();
                assert!(simulation.sample().unwrap().contacts > 0 && simulation.lost_contacts() == 0);
                (bits(&simulation.grains().unwrap()), simulation.replayed_chunks())
            };
            let (short, long) = (run(1), run(1000));
            println!("{dimension}D {}: {} and {} replays", bench.name, short.1, long.1);
            assert!(long.1 > 0, "no chunk was cut short");
            assert!(short.0 == long.0, "{dimension}D {}: other bits", bench.name);
        }
    }
}

/// Lists that outgrow their room in the middle of a run, while springs are stretched. A thin margin makes the lists as
/// long as there are contacts, and they start empty.
#[test]
fn lists_that_grow_keep_the_springs() {
    for dimension in [2, 3] {
        let (mut scene, _) = violent(dimension);
        scene.solver.margin = 0.03;
        for bench in engines() {
            let run = |slots: usize| {
                let mut simulation = bench.start_with(&scene, Options { entries: Some(slots), ..bench.options() });
                simulation.advance(200).unwrap();
                (bits(&simulation.grains().unwrap()), simulation.lost_contacts())
            };
            let mut simulation = bench.start(&scene);
            let mut needed = |steps: u64| {
                simulation.advance(steps).unwrap();
                simulation.read(&[&array::LIST_START]).unwrap().all_entries()
            };
            let (few, many) = (needed(0), needed(100));
            assert!(many > few + 8, "the lists do not grow: {few} to {many}");
            let (expected, _) = run(100_000);
            for slots in (0..4).map(|k| few + (many - few) * k / 4) {
                let (found, lost) = run(slots);
                let same = found.iter().zip(&expected).filter(|(a, b)| a == b).count();
                println!("{dimension}D {} {slots} slots: {same} grains as with room, {lost} lost", bench.name);
                assert!(found == expected && lost == 0, "{dimension}D {}: {slots} slots: other bits", bench.name);
            }
        }
    }
}

/// A layer of a dense packing creeps to and fro through the seam of a periodic domain: whenever lists are made, also
/// right after a grain has come through it, it sees the same bits.
#[test]
fn the_seam_leaves_no_trace_of_the_lists() {
    for dimension in [2, 3] {
        let (mut scene, _) = violent(dimension);
        let (spacing, mut periods) = (1.97 * R, scene.domain.upper);
        for axis in 0..dimension {
            // At least one of these periods is far from a multiple of the quantum of positions in single precision.
            let period = scene.domain.upper.x / SPACING * spacing + axis as f64 * 1.2e-6 * R;
            for g in &mut scene.grains {
                let at = g.position[axis] / SPACING;
                g.position[axis] = (at.floor() * spacing + 5e-4 * R * (at.fract() - 0.5)).rem_euclid(period);
            }
            periods[axis] = period;
        }
        scene.domain.upper = periods;
        scene.grains.iter_mut().for_each(|g| (g.velocity, g.radius) = (2e-4 * g.velocity, R));
        for bench in engines() {
            let run = |margin: f64, longest_chunk: u32| {
                let mut scene = scene.clone();
                scene.solver.margin = margin;
                let mut simulation = bench.start_with(&scene, Options { longest_chunk, ..bench.options() });
                simulation.advance(120).unwrap();
                assert!(simulation.sample().unwrap().contacts > scene.grains.len() as u64);
                bits(&simulation.grains().unwrap())
            };
            let given = run(0.2, 1000);
            for (margin, longest_chunk) in [(0.2, 1), (0.07, 2), (1.0, 5), (3.0, 1000)] {
                let same = run(margin, longest_chunk).iter().zip(&given).filter(|(a, b)| a == b).count();
                let what = format!("{dimension}D {}, margin {margin}, {longest_chunk} steps", bench.name);
                println!("{what}: {same} of {} grains", given.len());
                assert_eq!(same, given.len(), "{what}: other bits");
            }
        }
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

/// The seam of a periodic domain is nowhere: shifted by half a cell the same happens, contacts with their springs
/// included.
#[test]
fn seamless() {
    for dimension in [2, 3] {
        let (scene, _) = violent(dimension);
        let steps = 150;
        let length = scene.domain.upper.x;
        for bench in engines() {
            let shift = 0.5 * length * if dimension == 2 { DVec3::new(1.0, 1.0, 0.0) } else { DVec3::ONE };
            let mut shifted = scene.clone();
            for g in &mut shifted.grains {
                g.position += shift;
                for axis in 0..dimension {
                    if g.position[axis] >= length {
                        g.position[axis] -= length;
                    }
                }
            }
            let mut back = bench.after(&shifted, steps);
            back.iter_mut().for_each(|g| g.position -= shift);
            let allowed = rounding(bench, &scene, steps, length);
            same(&format!("{dimension}D"), bench, &scene, &back, &bench.after(&scene, steps), allowed);
        }
    }
}

/// A pair that slides and rolls on each other while it flies through the seam keeps its spring: it does what a pair
/// does that meets no seam.
#[test]
fn a_contact_flies_through_the_seam() {
    for dimension in [2, 3] {
        let drift = 100.0 * speed(dimension);
        let pair = |periodic_domain: bool| {
            let mut scene = blank_dt(dimension, dt(dimension));
            scene.pairs = vec![law(0.5)];
            scene.solver.margin = 1.5;
            let n = DVec3::new(0.6, 0.8, 0.0);
            scene.grains = vec![grain(0.0, 0.0, 0.0), grain(0.0, 0.0, 0.0)];
            scene.grains[1].position = 1.95 * R * n;
            scene.grains[1].spin = DVec3::Z * 20.0 * speed(dimension) / R;
            for g in &mut scene.grains {
                g.position += DVec3::new(8.7 * R, 4.0 * R, 0.0);
                g.velocity = drift * DVec3::new(0.8, 0.6, 0.0);
            }
            scene.walls = if dimension == 3 { vec![plane(DVec3::NEG_Z * 0.999 * R, DVec3::Z)] } else { vec![] };
            if periodic_domain {
                for axis in 0..2 {
                    (scene.domain.lower[axis], scene.domain.upper[axis]) = (0.0, 10.0 * R);
                    scene.domain.periodic[axis] = true;
                }
            }
            scene
        };
        let (closed, open) = (pair(true), pair(false));
        for bench in engines() {
            let (a, b) = (bench.after(&closed, 24), bench.after(&open, 24));
            assert!(b[0].position.x > 10.0 * R && a[0].position.x < 5.0 * R, "it crosses");
            assert!((b[1].spin - open.grains[1].spin).length() > 0.05 * open.grains[1].spin.length(), "it slides");
            // 24 ulp of 10 R, and as much again by the overlap of 0.05 R that they change.
            let found = distance(&closed, &a, &b);
            println!("{dimension}D {}: {found:.1e}", bench.name);
            assert!(found < bench.pick(1e-13, 5e-5), "{dimension}D {}: {found:e}", bench.name);
        }
    }
}

/// A grain that leaves an open domain stops the run with its id and step; the state is the last good one.
#[test]
fn escape() {
    for bench in engines() {
        let mut scene = blank_dt(3, 1e-6);
        scene.grains = (0..5).map(|k| grain(0.0, 3.0 * R * f64::from(k), 0.0)).collect();
        (scene.domain.lower, scene.domain.upper) = (DVec3::splat(-2.0 * R), DVec3::splat(15.0 * R));
        scene.grains[3].velocity = DVec3::new(-10.0, 0.0, 0.0); // 2 R in 200 steps
        scene.grains[3].position.x = -0.0035 * R; // so that no step ends on the face
        let mut simulation = bench.start(&scene);
        let error = simulation.advance(1000).expect_err("it leaves");
        let Error::Run { step, time, reason } = &error else { panic!("{error}") };
        assert_eq!(*step, 200, "{error}");
        close("time", *time, 200e-6, 200e-6, 1e-12);
        assert!(
            reason.contains("grain 3") && reason.contains("left the domain") && reason.contains("open lower x face"),
            "{reason}"
        );
        assert_eq!(simulation.step(), 199);
        for (g, g0) in simulation.grains().unwrap().iter().zip(&scene.grains) {
            let path = 199e-6 * g0.velocity;
            assert!(g.position.x > -2.0 * R, "inside");
            close("position", (g.position - g0.position - path).length(), 0.0, R, bench.pick(1e-12, 1e-4));
        }
    }
}

/// A grain driven through a wall, a grain too fast to follow, and a force that is no number stop the run.
#[test]
fn hopeless_grains() {
    for bench in engines() {
        let base = || {
            let mut scene = blank_dt(3, 1e-6);
            scene.grains = (0..4).map(|k| grain(0.0, 3.0 * R * f64::from(k), 1.5 * R)).collect();
            scene.walls = vec![plane(DVec3::ZERO, DVec3::Z)];
            scene
        };
        // A lid that comes down on them, slowly, so that no impact explains what it does.
        let mut through = base();
        through.solver.dt = TimeStep::Fixed(1e-5);
        through.walls.push(Wall { velocity: DVec3::Z * -0.1, ..plane(DVec3::Z * 2.6 * R, -DVec3::Z) });
        let mut fast = base();
        fast.grains[1].velocity.x = 500.0; // half a radius per step, with a margin of a fifth
        // A force of infinity along the normal is 0 · ∞ across it.
        let mut no_number = base();
        no_number.grains[3].position.z = 0.9 * R;
        no_number.pairs[0].normal_stiffness = 1e308;
        no_number.solver.allow_unstable = true;
        if bench.is_single() {
            let error = Simulation::new(no_number.clone(), bench.options()).err().expect("out of range").to_string();
            assert!(error.contains("1e308 N/m") && error.contains("single precision"), "{error}");
        }
        let stops = [
            (through, 0, "comes at 1.0000e-1 m/s and the grains cannot give way"),
            (fast, 1, "solver.dt must be below"),
            (no_number, 3, "number"),
        ];
        for (scene, id, words) in stops.into_iter().take(bench.pick(3, 2)) {
            let mut simulation = bench.start(&scene);
            let error = simulation.advance(4000).expect_err(words);
            let text = error.to_string();
            assert!(text.contains(&format!("grain {id}")) && text.contains(words), "{}: {text}", bench.name);
            let grains = simulation.grains().unwrap();
            // The state left is the last one in which every grain has a place; a wall is found crossed where it was.
            let inside = |g: &Grain| g.position.is_finite() && g.position.z > -0.1 * R;
            assert!(grains.iter().all(inside), "{}: {grains:?}", bench.name);
        }
    }
}
