//! Every stage against its twin, on random states, over models that cover every pair of slot alternatives. A new kernel
//! is tested by standing in the plan.

mod common;

use common::{clump, members, set_clumps};
use glam::{DQuat, DVec3, EulerRot};
use packstone::{
    Result,
    check::{Report, check},
    engine::{ALL, Cpu, Engine, cpu::apply, programs::layouts},
    gpu::{Arrays, Checks},
    model::{
        Boundary, Compliance, Damping as DampingSlot, Dimension, Grains, Growth as GrowthSlot, Gyroscopic, History,
        Levels, Materials, Method as MethodSlot, Model, Normal as NormalSlot, Precision, Rolling as RollingSlot,
        Rotation, Tangential, Turning as TurningSlot, Twist as TwistSlot, Walls,
    },
    plans::Plans,
    scene::*,
    simulation::{EngineChoice, Options, Setup},
    solve,
    state::{ACTIVE, ARRAYS, HALTED, Length, NONE, State, array::NEIGHBOUR, present},
};
use rand::{Rng, SeedableRng, rngs::StdRng};
use std::collections::HashSet;

/// Grains thrown into a small box, many of them overlapping, moving and spinning: every branch of the contact law is
/// taken by some of them.
fn random_scene(model: &Model, seed: u64) -> Assembly {
    let mut rng = StdRng::seed_from_u64(seed);
    let dims = model.dims();
    let edge = if model.large_grains { 0.037 } else { 0.03 };
    let mut vector = |low: f64, high: f64| {
        let mut v = DVec3::from_array(std::array::from_fn(|_| rng.random_range(low..high)));
        if dims == 2 {
            v.z = 0.0;
        }
        v
    };
    let many = model.levels == Levels::Several;
    let count = match dims {
        2 if many => 800,
        2 => 250,
        _ if model.large_grains => 2200,
        _ if many => 1200,
        _ => 900,
    };
    let radius = |k: usize| match k {
        _ if model.large_grains && k == 0 => 9e-3,
        _ if many && k.is_multiple_of(7) => 0.3e-3,
        _ if many && !model.large_grains && k.is_multiple_of(31) => 2e-3,
        _ => [1e-3, 1.3e-3, 0.7e-3][k % 3],
    };
    let materials = if model.materials == Materials::Many { 2 } else { 1 };
    let grains = (0..count).map(|k| {
        let w = vector(-80.0, 80.0);
        let spin = if dims == 2 { DVec3::new(0.0, 0.0, w.x) } else { w };
        Grain {
            position: vector(1.5e-3, edge - 1.5e-3),
            velocity: vector(-0.1, 0.1),
            spin: if model.rotation == Rotation::Sphere { spin } else { DVec3::ZERO },
            radius: radius(k),
            material: (k % materials) as u32,
            fixed: k % 37 == 5,
        }
    });
    let mut grains: Vec<Grain> = grains.collect();
    // Deep inside of a large grain contacts would be too violent to be followed.
    let large: Vec<Grain> = grains.iter().filter(|g| g.radius > 4e-3).copied().collect();
    grains.retain(|g| large.iter().all(|l| l == g || l.position.distance(g.position) > l.radius + 0.5 * g.radius));
    let (periodic, deforming) = (model.boundary != Boundary::Open, model.boundary == Boundary::Deforming);
    let axis = |a: usize| periodic && a < dims && (a != 1 || model.servo);
    let bounds = |value: f64, open: f64| DVec3::from_array(std::array::from_fn(|a| if axis(a) { value } else { open }));
    let rigid = model.method == MethodSlot::ContactDynamics;
    let hertz = model.normal == NormalSlot::Hertz;
    // So soft in contact dynamics that overlaps open at a speed which its steps can follow; images may lie deep inside of a
    // large grain.
    let spring = match model.compliance {
        Compliance::Stiffness if model.large_grains => {
            if dims == 2 {
                100.0
            } else {
                0.03
            }
        }
        Compliance::Stiffness if dims == 2 => 3e3,
        Compliance::Stiffness => 1.0,
        Compliance::None if rigid || hertz => 0.0,
        Compliance::None => 1e4,
    };
    let rough = model.tangential != Tangential::None && model.rotation == Rotation::Sphere;
    let pair = |k: usize| Pair {
        normal_stiffness: spring * (1.0 + k as f64),
        rolling: (model.rolling != RollingSlot::None).then_some(Rolling {
            friction: 0.1,
            stiffness: 0.3,
            damping: 0.2,
        }),
        // About as stiff, where grains overlap by a tenth of a radius.
        hertz: hertz.then(|| Hertz::of_material(4e7 * (1.0 + k as f64), 0.3)),
        tangential_stiffness: 0.3 * spring,
        friction: if rough { 0.4 + 0.1 * k as f64 } else { 0.0 },
        dashpot: match model.damping {
            DampingSlot::None => Dashpot::None,
            DampingSlot::Restitution => Dashpot::Restitution(0.6),
            DampingSlot::MassScaled => Dashpot::MassScaled(3000.0),
        },
    };
    // One component or two along the axes, and rates as they are limited or as the servo wants them.
    let stress = [None, Some(3e3), (dims == 3).then_some(2e3), None, None, Some(-2e3)];
    let inertial_number = if dims == 3 { 10.0 } else { Cell::default().inertial_number };
    let servo = if model.servo { Cell { stress, inertial_number, ..Cell::default() } } else { Cell::default() };
    let mut scene = Assembly {
        dimension: dims,
        gravity: match dims {
            _ if model.servo => DVec3::ZERO,
            2 => DVec3::new(0.0, -9.81, 0.0),
            // None along an axis that deforms.
            _ => DVec3::new(0.0, 0.3, if deforming { 0.0 } else { -9.81 }),
        },
        domain: Domain {
            lower: bounds(0.0, f64::NEG_INFINITY),
            upper: bounds(edge, f64::INFINITY),
            periodic: std::array::from_fn(axis),
            // Almost so much that it is turned back.
            tilt: if deforming && dims == 3 { DVec3::Y * 0.4999 * edge } else { DVec3::ZERO },
            ..Domain::default()
        },
        cell: match (deforming, dims) {
            (false, _) => Cell::default(),
            (true, 2) => Cell { strain_rate: [-3.0, 0.0, 0.0, 0.0, 0.0, 0.0], ..servo },
            (true, _) if model.servo => Cell { strain_rate: [-3.0, 0.0, 0.0, 0.0, 20.0, 0.0], ..servo },
            (true, _) => Cell { strain_rate: [-3.0, 0.0, 1.0, 0.0, 20.0, 0.0], ..servo },
        },
        materials: (0..materials)
            .map(|k| Material { name: format!("m{k}"), density: 2000.0 + 500.0 * k as f64 })
            .collect(),
        pairs: if materials == 2 { vec![pair(0), pair(1), pair(1), pair(2)] } else { vec![pair(0)] },
        walls: if model.walls == Walls::Some { walls(model, edge, materials) } else { Vec::new() },
        grains,
        shapes: Vec::new(),
        clumps: Vec::new(),
        insertions: Vec::new(),
        outlets: Vec::new(),
        growth: match model.growth {
            GrowthSlot::Some => (0..materials).map(|material| growth(model, material)).collect(),
            GrowthSlot::None => Vec::new(),
        },
        waiting: 0,
        numbers: Numbers::default(),
        notices: Vec::new(),
        solver: Solver {
            method: if rigid {
                Method::ContactDynamics(Relaxation {
                    solver: if model.colored {
                        solve::Solver::ColouredAccelerated
                    } else {
                        solve::Solver::JacobiAccelerated
                    },
                    order: solve::Order::default(),
                    tolerance: 1e-4,
                    max_iterations: 30,
                    max_correction_velocity: (model.compliance == Compliance::None).then_some(0.01),
                    compliant: model.compliance == Compliance::Stiffness,
                    gyroscopic: model.gyroscopic == Gyroscopic::Kept,
                })
            } else {
                Method::DiscreteElements
            },
            // Overlaps of this depth are many times stiffer by Hertz than those that the bound of the time step thinks
            // of.
            dt: TimeStep::Auto { fraction: if hertz { 0.08 } else { 0.1 } },
            allow_unstable: false,
            allow_overlap: true,
            damping: if model.adaptive_damping { 0.0 } else { 3.0 },
            adaptive_damping: model.adaptive_damping,
            margin: if rigid { 1.0 } else { 0.2 },
            twist: match model.twist {
                TwistSlot::Followed => Twist::Followed,
                TwistSlot::Ignored => Twist::Ignored,
            },
        },
        stop: Stop { steps: Some(1), ..Stop::default() },
        output: Output { works: model.works, ..Output::default() },
    };
    if model.grains == Grains::Clumps {
        stick_together(&mut scene);
    }
    scene
}

/// Some grow, others shrink; none that are of one material come to an end within a few steps.
fn growth(model: &Model, material: usize) -> Growth {
    // A large grain almost fills its cell.
    let rate = if model.large_grains { 0.1 } else { [3.0, -2.0][material] };
    Growth { rate, end: Some(1.0 + 0.1 * rate), ..Growth::default() }
}

/// Every other grain becomes a clump: round ones and long ones, some of them with three different moments, turned any
/// way.
fn stick_together(scene: &mut Assembly) {
    let flat = scene.dimension == 2;
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, if flat { 0.0 } else { z });
    let shape = |name: &str, centers: &[DVec3]| Shape::of_union(name, &members(centers), scene.dimension);
    let shapes = vec![
        shape("dimer", &[corner(-0.6, 0.0, 0.0), corner(0.6, 0.0, 0.0)]),
        shape("sphere", &[DVec3::ZERO]),
        shape("boomerang", &[corner(0.0, 0.0, 0.0), corner(1.2, 0.3, 0.1), corner(-0.2, 1.4, -0.3)]),
    ];
    let clump = |(k, grain): (usize, &Grain)| {
        let turn = 0.37 * k as f64;
        Clump {
            // What is large must not be longer than the domain.
            shape: if grain.radius > 4e-3 { 1 } else { (k % 3) as u32 },
            position: grain.position,
            orientation: if flat {
                DQuat::from_rotation_z(turn)
            } else {
                DQuat::from_euler(EulerRot::XYZ, turn, 2.0 * turn, 3.0 * turn)
            },
            velocity: grain.velocity,
            spin: grain.spin,
            radius: grain.radius,
            material: grain.material,
            fixed: grain.fixed,
            ..clump(0)
        }
    };
    let clumps = scene.grains.iter().step_by(2).enumerate().map(clump).collect();
    set_clumps(scene, shapes, clumps);
}

fn walls(model: &Model, edge: f64, materials: usize) -> Vec<Wall> {
    let velocity = if model.moving_walls { DVec3::new(0.02, 0.05, 0.0) } else { DVec3::ZERO };
    let plane = |point: DVec3, normal: DVec3| Surface::Plane { point, normal };
    // No member of a clump may begin with its centre beyond a wall.
    let inset = if model.grains == Grains::Clumps { -0.5e-3 } else { 1e-3 };
    let mut surfaces = vec![plane(DVec3::Y * inset, DVec3::Y), plane(DVec3::Y * (edge - inset), DVec3::NEG_Y)];
    if model.boundary == Boundary::Open {
        let center = DVec3::new(0.5 * edge, 0.5 * edge, 0.0);
        surfaces.push(Surface::Cylinder { center, radius: 0.75 * edge });
    }
    let turns = model.turning == TurningSlot::Some;
    let wall = |(k, surface)| {
        let round = matches!(surface, Surface::Cylinder { .. });
        // A radius that changes is for walls of which points move unlike each other.
        let servo = servo(k).filter(|_| model.driven_walls && (turns || !round));
        Wall {
            name: format!("wall {k}"),
            surface,
            velocity: if servo.is_some() { velocity * DVec3::X } else { velocity },
            spin: if turns && round { 2.0 } else { 0.0 },
            motion: match model.guided_walls && servo.is_none() {
                true => motion(model, &surface),
                false => Motion::default(),
            },
            servo,
            material: (k % materials) as u32,
        }
    };
    surfaces.into_iter().enumerate().map(wall).collect()
}

/// Of the first plane, and of the cylinder.
fn servo(wall: usize) -> Option<Servo> {
    let with = |target, area| Servo { target, area, gain: 0.01, max_speed: 0.05, inertial_number: None };
    match wall {
        0 => Some(with(Target::Force(30.0), None)),
        2 => Some(with(Target::Pressure(1e4), Some(1e-3))),
        _ => None,
    }
}

/// All that walls can do.
fn motion(model: &Model, surface: &Surface) -> Motion {
    let periodic = model.boundary != Boundary::Open;
    let axis = if model.dims() == 2 || matches!(surface, Surface::Cylinder { .. }) { DVec3::Z } else { DVec3::X };
    let turning = (!periodic).then_some(Turning { point: DVec3::new(0.01, 0.02, 0.0), axis, rate: 1.5 });
    let oscillation = Some(Oscillation { amplitude: DVec3::Y * 1e-5, frequency: 50.0, interval: None });
    Motion { oscillation, turning, table: vec![(0.0, DVec3::ZERO), (1.0, DVec3::Y * 0.01)], ..Motion::default() }
}

/// The alternatives of a model, with moving walls as one more.
fn choices(model: &Model) -> Vec<String> {
    let slots = model.slots().into_iter().map(|(slot, choice)| format!("{slot}={choice}"));
    // Of which grains, because what large ones ask for is otherwise with each.
    let relaxation = match model.method {
        MethodSlot::DiscreteElements => "none".to_owned(),
        MethodSlot::ContactDynamics => {
            format!("{} of {}", if model.colored { "coloured" } else { "jacobi" }, model.grains.label())
        }
    };
    slots
        .chain([
            format!("moving_walls={}, guided={}", model.moving_walls, model.guided_walls),
            format!("relaxation={relaxation}"),
            format!("large={}", model.large_grains),
        ])
        .collect()
}

/// Few models in which every two alternatives that can meet do meet; then a few in which all of them meet walls with a servo.
fn covering(precision: Precision) -> Vec<Model> {
    let pairs = |m: &Model| -> HashSet<(String, String)> {
        let c = choices(m);
        if m.driven_walls {
            return c.into_iter().map(|choice| ("driven".to_owned(), choice)).collect();
        }
        c.iter().enumerate().flat_map(|(k, a)| c[k + 1..].iter().map(|b| (a.clone(), b.clone()))).collect()
    };
    let all = Model::all(precision);
    let mut missing: HashSet<_> = all.iter().flat_map(pairs).collect();
    let mut chosen = Vec::new();
    while !missing.is_empty() {
        let best = all.iter().max_by_key(|m| pairs(m).intersection(&missing).count()).expect("there are models");
        pairs(best).iter().for_each(|p| {
            missing.remove(p);
        });
        chosen.push(*best);
    }
    chosen.sort_by_key(|m| m.driven_walls);
    chosen
}

fn without_gpu(error: &packstone::Error) -> bool {
    let allowed = std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|v| v == "1");
    if allowed {
        println!("skipped, PACKSTONE_ALLOW_NO_GPU=1: {error}");
    }
    allowed
}

fn twins_agree(options: Options, every: usize) {
    let precision = options.precision;
    for (k, model) in covering(precision).into_iter().enumerate().step_by(every) {
        let scene = random_scene(&model, k as u64);
        assert_eq!(Model::of(&scene, precision), model, "the scene must ask for the model it is made for");
        // Lists one after the other, and side by side.
        let options = Options { lists_abreast: Some([1, 8, 32][k % 3]), ..options };
        // A servo looks before the tenth step.
        let after = if model.servo || model.driven_walls { 9 } else { 3 };
        let report: Result<Report> = check(&scene, options, after, 3, 0);
        match report {
            Err(e) if packstone::gpu::adapters().is_empty() && without_gpu(&e) => return,
            Err(e) if e.to_string().contains("has no images for arrays") => return println!("skipped: {e}"),
            Err(e) => panic!("{model:?}: {e}"),
            Ok(report) => {
                let failed: Vec<_> = report.rows.iter().filter(|r| !r.passed).collect();
                assert!(failed.is_empty(), "{model:?}: {failed:#?}");
                // Rigid grains push each other apart; what carries an impulse are few of those that have met.
                let enough = match (model.method, model.grains) {
                    (MethodSlot::DiscreteElements, _) => 200,
                    (MethodSlot::ContactDynamics, Grains::Spheres) => 15,
                    (MethodSlot::ContactDynamics, Grains::Clumps) => 10,
                };
                assert!(report.contacts > enough, "{model:?}: only {} contacts", report.contacts);
            }
        }
    }
}

#[test]
fn single_precision_kernels_agree_with_their_twins() {
    twins_agree(Options { precision: Precision::Single, arrays: Arrays::Buffers, ..Options::default() }, 1);
}

#[test]
fn kernels_without_checks_agree_with_their_twins() {
    twins_agree(Options { arrays: Arrays::Buffers, checks: Checks::Off, ..Options::default() }, 4);
}

/// Which they are on old software drivers in all other tests.
#[test]
fn kernels_agree_with_their_twins_if_arrays_are_images() {
    twins_agree(Options { precision: Precision::Single, arrays: Arrays::Images, ..Options::default() }, 4);
}

#[test]
fn kernels_agree_with_their_twins_if_arrays_are_packed() {
    twins_agree(Options { precision: Precision::Single, arrays: Arrays::Packed, ..Options::default() }, 4);
}

#[test]
fn double_precision_kernels_agree_with_their_twins() {
    twins_agree(Options { precision: Precision::Double, arrays: Arrays::Buffers, ..Options::default() }, 1);
}

/// Steps of the CPU engine, which computes each contact once and many at a time, beside those of the twins: all arrays
/// have the same numbers, to the last bit.
fn steps_are_those_of_the_twins(scene: &Assembly) {
    let options = Options { engine: EngineChoice::Cpu, entries: Some(100_000), ..Options::default() };
    let setup = Setup::new(scene, &options).unwrap();
    let (mut state, plans) = (setup.whole(scene).unwrap(), setup.plans);
    let model = state.model;
    for array in present(&model, ARRAYS).into_iter().filter(|array| array.length == Length::History) {
        state.column_mut(array).resize(100_000);
    }
    let mut engine = Cpu::new(state.clone()).unwrap();
    let ops =
        [plans.lists.ops(), plans.start.ops(), plans.motion.ops(), plans.motion.ops(), plans.motion.ops()].concat();
    // The history of a step is asked for by the sums after it. A chunk has works, and what the host is told, besides.
    // Grains of these scenes overlap deeply, which may only halt the last step.
    let (deep_overlap, never) = (state.params.deep_overlap, f64::INFINITY);
    for (ops, deep_overlap) in [
        (ops, never),
        (plans.sums.ops(), never),
        (plans.motion.ops(), never),
        (plans.lists.ops(), never),
        (plans.motion.ops(), never),
        (plans.sums.ops(), never),
        (plans.chunk.ops(), deep_overlap),
    ] {
        state.params.deep_overlap = deep_overlap;
        let params = state.params;
        engine.execute(&params, &ops).unwrap();
        ops.iter().for_each(|op| apply(op, &mut state));
        let arrays = present(&model, ARRAYS);
        let mut found = state.clone();
        engine.read(&arrays, ALL, &mut found).unwrap();
        assert!(state.halt[0] < HALTED || state.counters[0].deep_overlaps > 0, "{model:?}: halted");
        let active = |entry: usize| state.neighbour[entry] != NONE && state.neighbour[entry] & ACTIVE != 0;
        for array in arrays {
            let lanes = |state: &State| {
                let mut lanes = Vec::new();
                state.column(array).lanes(model.dims(), &mut |x| lanes.push(x));
                lanes
            };
            let (a, b) = (lanes(&state), lanes(&found));
            let width = a.len() / state.column(array).len().max(1);
            // Contacts that are open, and entries of none, may remember anything.
            let open = |k: usize| array.length == Length::Entries && *array != NEIGHBOUR && !active(k / width);
            let differ = (0..a.len()).find(|&k| a[k] != b[k] && !open(k));
            assert_eq!(differ, None, "{model:?}: {}: {:?}", array.name, differ.map(|k| (a[k], b[k])));
        }
    }
    let active = state.neighbour.iter().filter(|tagged| **tagged != NONE && **tagged & ACTIVE != 0).count();
    assert!(active > 100 || model.history == History::None, "{model:?}: only {active} contacts");
}

#[test]
fn steps_of_the_cpu_engine_are_those_of_the_twins() {
    let soft = |m: &Model| m.method == MethodSlot::DiscreteElements;
    for (k, model) in covering(Precision::Double).into_iter().filter(soft).enumerate() {
        for seed in [k as u64, 3] {
            steps_are_those_of_the_twins(&random_scene(&model, seed));
        }
    }
}

/// A grain with more neighbours than a block of the CPU engine takes in.
#[test]
fn steps_of_a_boulder_are_those_of_the_twins() {
    let of = |m: &Model| {
        m.tangential == Tangential::Coulomb && m.large_grains && m.grains == Grains::Spheres && m.walls == Walls::None
    };
    let model = Model::all(Precision::Double).into_iter().find(|m| of(m) && m.dimension == Dimension::Space).unwrap();
    let mut scene = random_scene(&model, 0);
    let (boulder, count) =
        (Grain { radius: 0.05, position: DVec3::splat(0.015), fixed: false, ..scene.grains[0] }, 6000);
    let around = |k: usize| {
        // Evenly on a sphere.
        let (z, angle) = (1.0 - (2.0 * k as f64 + 1.0) / f64::from(count), 2.399_963 * k as f64);
        let ring = (1.0 - z * z).sqrt();
        let n = DVec3::new(ring * angle.cos(), ring * angle.sin(), z);
        let (radius, position) = (5e-4, boulder.position + (boulder.radius + 4.99e-4) * n);
        Grain { radius, position, velocity: -0.01 * n, fixed: false, ..boulder }
    };
    scene.grains = std::iter::once(boulder).chain((0..count as usize).map(around)).collect();
    scene.domain = Domain { lower: DVec3::NEG_INFINITY, upper: DVec3::INFINITY, ..Domain::default() };
    steps_are_those_of_the_twins(&scene);
}

#[test]
fn every_model_composes_and_matches_the_rust_records() {
    for precision in [Precision::Single, Precision::Double] {
        for model in Model::all(precision) {
            // Walls that stay are those that may move, with a kernel less.
            let moving = Model { moving_walls: true, ..model };
            if model.walls == Walls::Some && model != moving {
                let kernels = |m: &Model| Plans::new(m).stages().iter().map(|s| s.kernel).collect::<HashSet<_>>();
                assert!(kernels(&model).is_subset(&kernels(&moving)) && model.files() == moving.files());
                continue;
            }
            layouts(&model, &Plans::new(&model)).unwrap_or_else(|e| panic!("{model:?}: {e}"));
        }
    }
}

#[test]
fn a_plane_is_covered_in_both_dimensions() {
    let models = covering(Precision::Single);
    assert!(models.iter().any(|m| m.dimension == Dimension::Plane));
    assert!(models.len() < 40, "{} models are too many to run", models.len());
}
