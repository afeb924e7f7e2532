//! Grains of wide sizes: neighbour lists against all pairs, the same bits whatever the lists are, and how much the
//! search for neighbours looks at, in counts.

mod common;

use common::{CPU, KN, R, Random, blank, engines, law, mass, rigid, set_laws};
use glam::DVec3;
use packstone::{
    engine::cpu::apply,
    neighbours::{
        grid::{for_candidates, for_spans},
        levels::level_of,
    },
    scene::{Assembly, Dashpot, Grain, Method, Pair, Scene},
    simulation::{Options, Setup},
    solve::Solver,
    state::{INDEX, NONE, Position, State, array},
};
use std::path::Path;

fn direction(random: &mut Random, dimension: usize) -> DVec3 {
    loop {
        let v = random.vector(dimension);
        if (0.1..1.0).contains(&v.length()) {
            return v.normalize();
        }
    }
}

/// Grains of sizes from R to `ratio` R, most of them small, each of which lies about as far from one before it as lists
/// reach; in any order.
fn crowd(dimension: usize, ratio: f64, periodic: bool, count: usize) -> Assembly {
    let mut random = Random(ratio as u64 + dimension as u64);
    let mut scene = blank(dimension);
    let edge = (5.0 * ratio).max(24.0) * R;
    if periodic {
        for axis in 0..2 {
            (scene.domain.lower[axis], scene.domain.upper[axis]) = (-0.5 * edge, 0.5 * edge);
            scene.domain.periodic[axis] = true;
        }
    }
    let mut grains: Vec<Grain> = Vec::new();
    for k in 0..count {
        let size = if k < 3 { 1.0 } else { random.unit().powi(4) };
        let mut grain = Grain { radius: R * ratio.powf(size), ..common::grain(0.0, 0.0, 0.0) };
        if k > 0 {
            // Every other one at one of the largest, so that these have many neighbours.
            let at = grains[(random.unit() * if k % 2 == 0 { k.min(3) } else { k } as f64) as usize];
            let gap = R * (-0.1 + random.unit());
            grain.position = at.position + (at.radius + grain.radius + gap) * direction(&mut random, dimension);
            for axis in (0..3).filter(|axis| scene.domain.periodic[*axis]) {
                grain.position[axis] = (grain.position[axis] + 0.5 * edge).rem_euclid(edge) - 0.5 * edge;
            }
        }
        grains.push(grain);
    }
    for k in (1..count).rev() {
        grains.swap(k, (random.unit() * (k + 1) as f64) as usize);
    }
    scene.grains = grains;
    if !periodic {
        scene.walls = vec![common::plane(DVec3::Y * -3.0 * edge, DVec3::Y)];
    }
    scene
}

/// The neighbours of grain i that its list has, as ids in the order of the list.
fn listed(s: &State, i: usize) -> Vec<u32> {
    let entries = s.row(i).map(|entry| s.neighbour[entry]).take_while(|entry| *entry != NONE);
    entries.map(|entry| (entry & INDEX) as usize).filter(|j| *j < s.sizes.bodies).map(|j| s.id[j]).collect()
}

/// Lists have all pairs that are closer than they reach, and no others, in ascending order of the ids, whatever the
/// sizes are.
#[test]
fn no_neighbour_is_missed() {
    for dimension in [2, 3] {
        for periodic in [false, true] {
            for ratio in [1.0, 7.0, 50.0, 300.0] {
                let scene = crowd(dimension, ratio, periodic, 1200);
                for bench in engines() {
                    let mut simulation = bench.start(&scene);
                    let arrays = [&array::POSITION, &array::ID, &array::LIST_START, &array::NEIGHBOUR];
                    let s = simulation.read(&arrays).unwrap();
                    let levels = s.sizes.levels;
                    assert!(if ratio == 1.0 { levels == 1 } else { levels > 2 }, "{levels} levels at 1:{ratio}");
                    let reach = s.params.margin + s.params.position_slack;
                    let rounding = bench.pick(1e-12, 1e-5) * ratio * R;
                    let (mut across, mut longest) = (0, 0);
                    for i in 0..s.sizes.bodies {
                        let here = &s.position[i];
                        let gap = |there: &Position| {
                            scene.domain.nearest(there.x - here.x).length() - here.radius - there.radius
                        };
                        let near = |limit: f64| {
                            let others = (0..s.sizes.bodies).filter(|j| *j != i && gap(&s.position[*j]) < limit);
                            let mut ids: Vec<u32> = others.map(|j| s.id[j]).collect();
                            ids.sort_unstable();
                            ids
                        };
                        let found = listed(s, i);
                        let (least, most) = (near(reach - rounding), near(reach + rounding));
                        let what = format!("{dimension}D, periodic {periodic}, 1:{ratio}, {}", bench.name);
                        assert!(found.is_sorted_by(|a, b| a < b), "{what}: order");
                        assert!(least.iter().all(|j| found.contains(j)), "{what}: grain {} misses one", s.id[i]);
                        assert!(found.iter().all(|j| most.contains(j)), "{what}: grain {} has too many", s.id[i]);
                        longest = longest.max(found.len());
                        let own = level_of(s, here.radius);
                        let radius = |j: usize| s.position[j].radius;
                        across += (0..s.sizes.bodies)
                            .filter(|j| found.binary_search(&s.id[*j]).is_ok() && level_of(s, radius(*j)) != own)
                            .count();
                    }
                    assert!(ratio == 1.0 || across > 1000, "only {across} pairs of two levels");
                    assert!(ratio < 50.0 || dimension == 2 || longest > 100, "the longest list has {longest}");
                }
            }
        }
    }
}

/// Lists of another reach, of another length and made at other times: the same bits, also where workgroups add up the
/// contacts of large grains.
#[test]
fn lists_of_wide_sizes_leave_no_trace() {
    for dimension in [2, 3] {
        let mut scene = crowd(dimension, 25.0, false, 700);
        set_laws(
            &mut scene,
            &[Pair {
                normal_stiffness: 0.01 * KN,
                tangential_stiffness: 0.003 * KN,
                dashpot: Dashpot::Restitution(0.5),
                ..law(0.5)
            }],
        );
        scene.gravity = DVec3::new(0.0, -9.81, 0.0);
        let touches = |a: &Grain, b: &Grain| a.position.distance(b.position) < a.radius + b.radius;
        let contacts = |a: &Grain| scene.grains.iter().filter(|b| touches(a, b)).count();
        let most = scene.grains.iter().map(contacts).max();
        assert!(most > Some(if dimension == 2 { 10 } else { 65 }), "at most {most:?} contacts");
        for bench in engines() {
            let run = |margin: f64, options: Options| {
                let mut changed = scene.clone();
                changed.solver.margin = margin;
                let mut simulation = bench.start_with(&changed, options);
                assert!(simulation.model().large_grains);
                simulation.advance(60).unwrap();
                assert_eq!(simulation.lost_contacts(), 0, "{} lost contacts", bench.name);
                let of = |g: &Grain| [g.position, g.velocity, g.spin].map(|v| v.to_array().map(f64::to_bits));
                simulation.grains().unwrap().iter().map(of).collect::<Vec<_>>()
            };
            let reference = run(0.2, bench.options());
            for (what, margin, options) in [
                ("again", 0.2, bench.options()),
                ("a longer reach", 0.4, bench.options()),
                ("one entry", 0.2, Options { entries: Some(1), ..bench.options() }),
                ("lists every step", 0.2, Options { longest_chunk: 1, ..bench.options() }),
            ] {
                assert!(run(margin, options) == reference, "{dimension}D {}: {what}: other bits", bench.name);
            }
        }
    }
}

fn relaxed_by(scene: &Assembly, solver: Solver) -> Assembly {
    let mut scene = scene.clone();
    let Method::ContactDynamics(relaxation) = &mut scene.solver.method else { panic!("no contact dynamics") };
    relaxation.solver = solver;
    scene
}

/// Rigid grains run again, with lists that have to be made longer first: the same bits. Lists of another reach give other
/// ones, because passes add up over grains in the order of the cells.
#[test]
fn rigid_grains_of_wide_sizes_have_the_same_bits() {
    let mut scene = rigid(3, 1e-4, 0.4, 1e-4);
    scene.grains = crowd(3, 25.0, false, 700).grains;
    scene.gravity = DVec3::new(0.0, -9.81, 0.0);
    for solver in [Solver::JacobiAccelerated, Solver::ColouredAccelerated] {
        let mut scene = relaxed_by(&scene, solver);
        if let Method::ContactDynamics(relaxation) = &mut scene.solver.method {
            relaxation.max_iterations = 30;
        }
        for bench in engines() {
            let run = |options: Options| {
                let mut simulation = bench.start_with(&scene, options);
                assert!(simulation.model().large_grains);
                simulation.advance(3).unwrap();
                let of = |g: &Grain| [g.position, g.velocity, g.spin].map(|v| v.to_array().map(f64::to_bits));
                simulation.grains().unwrap().iter().map(of).collect::<Vec<_>>()
            };
            let again = run(Options { entries: Some(1), ..bench.options() });
            assert!(run(bench.options()) == again, "{} {solver:?}: other bits", bench.name);
        }
    }
}

/// A boulder in a cup of small grains that lean on fixed ones: what it weighs is carried, by so many contacts that a
/// colour for each would be too many.
#[test]
fn a_boulder_rests_on_many_grains() {
    const SIZE: f64 = 12.0;
    let (dt, gravity) = (1e-3, 9.81);
    let mut scene = rigid(3, dt, 0.5, 1e-5);
    scene.gravity = DVec3::NEG_Z * gravity;
    let mut grains = vec![Grain { radius: SIZE * R, ..common::grain(0.0, 0.0, 0.0) }];
    let width = 2.1 / (SIZE + 1.0);
    for ring in 1..7 {
        let (sin, cos) = (f64::from(ring) * width).sin_cos();
        let count = (std::f64::consts::TAU * sin / width) as u32;
        for k in 0..count {
            let (y, x) = (std::f64::consts::TAU * f64::from(k) / f64::from(count)).sin_cos();
            let outward = R * DVec3::new(sin * x, sin * y, -cos);
            for (distance, fixed) in [(SIZE + 1.0, false), (SIZE + 3.0, true)] {
                grains.push(Grain { position: distance * outward, fixed, ..common::grain(0.0, 0.0, 0.0) });
            }
        }
    }
    let around = (grains.len() - 1) / 2;
    assert!(around > 100, "only {around} grains around the boulder");
    scene.grains = grains;
    let weight = mass(3, SIZE * R) * gravity;
    for bench in engines() {
        let passes = [Solver::JacobiAccelerated, Solver::ColouredAccelerated].map(|solver| {
            let mut simulation = bench.start(&relaxed_by(&scene, solver));
            assert!(simulation.model().large_grains);
            simulation.advance(3).unwrap();
            let statistics = *simulation.solver_statistics().unwrap();
            let moves = simulation.grains().unwrap()[0].velocity.length();
            let missing = moves / (3.0 * gravity * dt);
            println!("{} {solver:?}: {} passes, {missing:e} of {weight:e} N", bench.name, statistics.iterations);
            assert_eq!(statistics.unconverged, 0, "{} {solver:?}", bench.name);
            assert!(missing < 1e-3, "{} {solver:?}: {missing:e} of the weight is not carried", bench.name);
            if solver == Solver::ColouredAccelerated {
                let colors = simulation.read(&[&array::COLORING_STATE]).unwrap().coloring_state[0].colors;
                assert!((1..8).contains(&colors), "{colors} colours");
            }
            statistics.iterations
        });
        assert!(passes[1] <= 2 * passes[0], "{}: {passes:?} passes", bench.name);
    }
}

/// A boulder that stands on a wall or on a fixed grain, and hundreds of small grains on it and around it: the contact that
/// carries it gets on as if these were not there.
#[test]
fn a_boulder_stands_among_many_grains() {
    const SIZE: f64 = 12.0;
    let (dt, gravity) = (1e-3, 9.81);
    let mut scene = rigid(3, dt, 0.5, 1e-5);
    scene.gravity = DVec3::NEG_Z * gravity;
    let mut grains = vec![Grain { radius: SIZE * R, ..common::grain(0.0, 0.0, 0.0) }];
    // Rings from the top down to where a grain touches the floor too.
    let lowest = std::f64::consts::PI - ((SIZE - 1.0) / (SIZE + 1.0)).acos();
    let rings = (lowest * (SIZE + 1.0) / 2.1) as u32;
    for ring in 1..=rings {
        let (sin, cos) = (lowest * f64::from(ring) / f64::from(rings)).sin_cos();
        let count = (std::f64::consts::TAU * sin * (SIZE + 1.0) / 2.1) as u32;
        for k in 0..count {
            let (y, x) = (std::f64::consts::TAU * f64::from(k) / f64::from(count)).sin_cos();
            let outward = (SIZE + 1.0) * R * DVec3::new(sin * x, sin * y, cos);
            grains.push(Grain { position: outward, ..common::grain(0.0, 0.0, 0.0) });
        }
    }
    let around = grains.len() - 1;
    assert!(around > 300, "only {around} grains around the boulder");
    scene.grains = grains;
    let mut on_wall = scene.clone();
    on_wall.walls = vec![common::plane(DVec3::NEG_Z * SIZE * R, DVec3::Z)];
    let mut on_grain = scene;
    let below = DVec3::NEG_Z * (SIZE + 1.0) * R;
    on_grain.grains.push(Grain { position: below, fixed: true, ..common::grain(0.0, 0.0, 0.0) });
    for (bench, (floor, scene)) in engines().iter().flat_map(|b| [(b, ("wall", &on_wall)), (b, ("grain", &on_grain))]) {
        let passes = [Solver::JacobiAccelerated, Solver::ColouredAccelerated].map(|solver| {
            let mut simulation = bench.start(&relaxed_by(scene, solver));
            assert!(simulation.model().large_grains);
            simulation.advance(3).unwrap();
            let statistics = *simulation.solver_statistics().unwrap();
            let missing = simulation.grains().unwrap()[0].velocity.length() / (3.0 * gravity * dt);
            let what = format!("{} {solver:?} on a {floor}", bench.name);
            println!("{what}: {} passes, {missing:e} of the weight", statistics.iterations);
            assert_eq!(statistics.unconverged, 0, "{what}");
            assert!(missing < 1e-3, "{what}: {missing:e} of the weight is not carried");
            statistics.iterations
        });
        assert!(passes[1] <= 2 * passes[0], "{} on a {floor}: {passes:?} passes", bench.name);
    }
}

/// What the search for neighbours costs, per grain.
#[derive(Debug)]
struct Cost {
    /// Cells that there are.
    cells: f64,
    /// Spans of cells that are looked at, and grains in them.
    spans: f64,
    candidates: f64,
    entries: f64,
    large: usize,
    bytes: f64,
}

fn cost(scene: &Assembly) -> Cost {
    let options = Options { entries: Some(40 * scene.grains.len()), ..CPU.options() };
    let setup = Setup::new(scene, &options).unwrap();
    let (mut state, plans) = (setup.whole(scene).unwrap(), setup.plans);
    plans.lists.ops().iter().for_each(|op| apply(op, &mut state));
    let (s, bodies) = (&state, state.sizes.bodies);
    assert!(s.lists_fit());
    let (mut spans, mut candidates) = (0, 0);
    for here in &s.position[..bodies] {
        for level in &s.level[level_of(s, here.radius)..] {
            for_spans(s, here, level, |_| spans += 1);
            for_candidates(s, here, level, |_| candidates += 1);
        }
    }
    let simulation = CPU.start(scene);
    let per_grain = |count: usize| count as f64 / bodies as f64;
    Cost {
        cells: per_grain(s.sizes.cells),
        spans: per_grain(spans),
        candidates: per_grain(candidates),
        entries: per_grain(s.all_entries()),
        large: s.sizes.large,
        bytes: simulation.bytes_per_particle().unwrap(),
    }
}

fn reported(name: &str) -> Assembly {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/bench/scenes").join(name);
    Scene::load(&path, &[]).unwrap().assemble().unwrap()
}

/// With a few large grains the search looks at little more than without them.
#[test]
fn a_few_large_grains_cost_little() {
    for (name, large) in [("ratio_20.toml", 2), ("boulder.toml", 1)] {
        let with = reported(name);
        let mut without = with.clone();
        let smallest = with.grains.iter().map(|g| g.radius).fold(f64::INFINITY, f64::min);
        without.grains.retain(|g| g.radius < 2.0 * smallest);
        let (with, without) = (cost(&with), cost(&without));
        println!("{name}\n  with    {with:?}\n  without {without:?}");
        assert_eq!((with.large, without.large), (large, 0), "{name}");
        // Every grain looks at the one or two cells of the large ones besides.
        assert!(with.spans <= 2.0 * without.spans && with.spans > without.spans, "{name}: {} spans", with.spans);
        assert!(with.candidates <= without.candidates + 1.1 * large as f64, "{name}: {} candidates", with.candidates);
        assert!(with.entries <= 1.3 * without.entries + 1.0, "{name}: {} entries", with.entries);
        assert!(with.bytes <= 1.3 * without.bytes, "{name}: {} bytes", with.bytes);
        assert!(with.cells < 3.0, "{name}: {} cells", with.cells);
    }
}

/// Cells are bounded by grains, not by volume: strays of every size far away add next to none.
#[test]
fn strays_get_no_cells() {
    let scene = crowd(3, 50.0, false, 1000);
    let mut astray = scene.clone();
    for k in 0..6 {
        let place = DVec3::from_array(std::array::from_fn(|axis| if axis == k % 3 { 1e5 } else { 0.0 }));
        let radius = R * if k < 3 { 1.0 } else { 50.0 };
        astray.grains.push(Grain { radius, ..common::grain(place.x, place.y, place.z) });
    }
    let (scene, astray) = (cost(&scene), cost(&astray));
    println!("{scene:?}\n{astray:?}");
    assert!(astray.cells < 4.0 && scene.cells < 4.0, "{} and {} cells", scene.cells, astray.cells);
    assert!(astray.candidates < 40.0 * scene.candidates, "{} candidates", astray.candidates);
}
