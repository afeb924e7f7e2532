//! The periodic cell as it deforms: its faces do nothing to contacts, grains go where they should, and it ends where it is
//! asked to.

mod common;

use common::*;
use glam::{DMat3, DVec3};
use packstone::{
    check::balance::balances,
    io::schedule::Schedule,
    scene::{Assembly, Cell, Clump, Domain, Grain, Scene, TimeStep},
    simulation::{Options, Simulation},
};
use std::path::Path;

/// How long a contact of two default grains takes, s.
fn contact(dimension: usize) -> f64 {
    std::f64::consts::PI / (2.0 * KN / mass(dimension, R)).sqrt()
}

/// s, 1/50 of that of spheres.
const DT: f64 = 1.4e-6;

/// In double precision a device does what the twins do, which `tests/twins.rs` sees to.
fn benches() -> Vec<Bench> {
    engines().into_iter().filter(|bench| bench.name != GPU_DOUBLE.name).collect()
}

/// A cell of these lengths and rates (xx, yy, zz, yz, xz, xy), without grains.
fn cell(dimension: usize, size: DVec3, strain_rate: [f64; 6]) -> Assembly {
    let mut scene = blank_dt(dimension, DT);
    let periodic = [true, true, dimension == 3];
    let upper = if dimension == 2 { DVec3::new(size.x, size.y, f64::INFINITY) } else { size };
    let lower = if dimension == 2 { DVec3::new(0.0, 0.0, f64::NEG_INFINITY) } else { DVec3::ZERO };
    scene.domain = Domain { lower, upper, periodic, ..Domain::default() };
    scene.cell = Cell { strain_rate, ..Cell::default() };
    scene
}

/// The gradient of the flow.
fn gradient([xx, yy, zz, yz, xz, xy]: [f64; 6]) -> DMat3 {
    DMat3::from_cols_array_2d(&[[xx, 0.0, 0.0], [xy, yy, 0.0], [xz, yz, zz]])
}

/// exp(m), by squaring.
fn exponential(m: DMat3) -> DMat3 {
    let small = m * 2.0_f64.powi(-6);
    let series = (1..=16).rev().fold(DMat3::IDENTITY, |sum, k| DMat3::IDENTITY + small * sum * (1.0 / f64::from(k)));
    (0..6).fold(series, |sum, _| sum * sum)
}

/// Shears that are about to be turned back.
fn almost_turned_back(scene: &mut Assembly) {
    let size = scene.domain.upper;
    let half = |length: f64, part: f64| if length.is_finite() { part * length } else { 0.0 };
    let tilted = DVec3::new(half(size.y, 0.4999), half(size.x, 0.4998), half(size.x, 0.4999));
    scene.domain.tilt = if scene.dimension == 2 { DVec3::Z * tilted } else { tilted };
}

/// Two rough grains in contact, or two dimers, that slide on each other: wherever they are in the cell, and whichever face,
/// edge or corner is between them, their forces and motions are the same while tilts are turned back.
#[test]
fn a_face_does_nothing_to_a_contact() {
    for (dimension, dimers) in [(2, false), (3, false), (3, true)] {
        let size = R * DVec3::new(9.0, 10.0, 11.0);
        let rates = if dimension == 2 { [-3.0, 2.0, 0.0, 0.0, 0.0, 9.0] } else { [-3.0, 2.0, 1.0, 8.0, 7.0, 9.0] };
        let mut scene = cell(dimension, size, rates);
        almost_turned_back(&mut scene);
        // So soft that they do not part before all tilts are turned back.
        scene.pairs = vec![law(0.5)];
        scene.pairs[0].normal_stiffness *= 0.25;
        let n = if dimension == 2 { DVec3::new(0.6, 0.8, 0.0) } else { DVec3::new(0.48, 0.64, 0.6) };
        let across = DVec3::new(0.8, -0.6, 0.0);
        let spin = if dimension == 2 { DVec3::Z } else { DVec3::new(0.3, -0.5, 0.7) };
        let middle = if dimension == 2 { 0.5 * size * DVec3::new(1.0, 1.0, 0.0) } else { 0.5 * size };
        let shape = packstone::scene::Shape::of_union("dimer", &members(&[-0.5 * across, 0.5 * across]), 3);
        let radius = if dimers { R * shape.members[0].radius } else { R };
        let place = |scene: &Assembly, shift: DVec3| {
            let mut scene = scene.clone();
            let mut positions = [-0.99, 0.99].map(|d| middle + shift + d * radius * n);
            positions.iter_mut().for_each(|x| scene.domain.fold(x));
            let velocities = [across, -across].map(|v| 0.05 * v);
            if dimers {
                let clumps = positions.iter().zip(velocities).map(|(x, velocity)| Clump {
                    position: *x,
                    velocity,
                    spin: 40.0 * spin,
                    radius: R,
                    ..clump(0)
                });
                set_clumps(&mut scene, vec![shape.clone()], clumps.collect());
            } else {
                let grain = |(x, velocity): (&DVec3, DVec3)| Grain {
                    position: *x,
                    velocity,
                    spin: 40.0 * spin,
                    ..grain(0.0, 0.0, 0.0)
                };
                scene.grains = positions.iter().zip(velocities).map(grain).collect();
            }
            scene
        };
        for bench in benches() {
            let run = |shift: DVec3| {
                let mut simulation = bench.start(&place(&scene, shift));
                let mut seen = Vec::new();
                for _ in 0..3 {
                    simulation.advance(8).unwrap();
                    let grains = simulation.grains().unwrap();
                    let forces = simulation.forces().unwrap();
                    let domain = simulation.domain().unwrap();
                    let branch = domain.nearest(grains[1].position - grains[0].position);
                    seen.push((forces, branch, grains[0].velocity, grains[0].spin));
                }
                let domain = simulation.domain().unwrap();
                assert!(domain.tilt.z < 0.0, "the tilt has not been turned back: {domain:?}");
                assert_eq!(simulation.lost_contacts(), 0);
                assert!(simulation.sample().unwrap().contacts >= 1);
                seen
            };
            let expected = run(DVec3::ZERO);
            let force = expected.iter().flat_map(|seen| &seen.0).map(|f| f.0.length()).fold(0.0, f64::max);
            let torque = expected.iter().flat_map(|seen| &seen.0).map(|f| f.1.length()).fold(0.0, f64::max);
            assert!(force > 0.01 && torque > 1e-3 * R * force, "{force} {torque}");
            let mut worst = 0.0_f64;
            // On a device, which is slow to start, not all of them.
            for k in (1..if dimension == 2 { 9 } else { 27 }).step_by(if bench.name == CPU.name { 1 } else { 4 }) {
                let half = DVec3::new(f64::from(k % 3), f64::from(k / 3 % 3), f64::from(k / 9)) * 0.5;
                let edges = (0..dimension).map(|axis| half[axis] * scene.domain.edge(axis));
                for (found, expected) in run(edges.sum()).iter().zip(&expected) {
                    for ((f, t), (g, u)) in found.0.iter().zip(&expected.0) {
                        worst = worst.max((*f - *g).length() / force).max((*t - *u).length() / torque);
                    }
                    worst = worst.max((found.1 - expected.1).length() / R);
                    worst = worst.max((found.2 - expected.2).length() / 0.05);
                    worst = worst.max((found.3 - expected.3).length() / 40.0);
                }
            }
            println!("{dimension}D, dimers: {dimers}, on {}: {worst:.1e}", bench.name);
            assert!(worst < bench.pick(1e-11, 2e-5), "{dimension}D on {}: {worst:e}", bench.name);
        }
    }
}

/// A face-centred cubic (square) lattice of spheres (disks) that overlap.
fn lattice(dimension: usize, side: usize, spacing: f64, strain_rate: [f64; 6]) -> Assembly {
    let basis: &[DVec3] = match dimension {
        2 => &[DVec3::ZERO],
        _ => &[DVec3::ZERO, DVec3::new(0.5, 0.5, 0.0), DVec3::new(0.5, 0.0, 0.5), DVec3::new(0.0, 0.5, 0.5)],
    };
    let layers = if dimension == 2 { 1 } else { side };
    let mut scene = cell(dimension, DVec3::splat(side as f64 * spacing), strain_rate);
    for k in 0..side * side * layers {
        let corner = DVec3::new((k % side) as f64, (k / side % side) as f64, (k / side / side) as f64);
        let inside = if dimension == 2 { DVec3::new(0.25, 0.25, 0.0) } else { DVec3::splat(0.25) };
        scene.grains.extend(basis.iter().map(|b| {
            let x = spacing * (corner + *b + inside);
            grain(x.x, x.y, x.z)
        }));
    }
    scene
}

/// Grains of a lattice stay on the lattice that the cell makes of it, because their forces balance, and overlap as its
/// links say; the cell is what the rates make of it in that time, but for tilts that are turned back.
#[test]
fn a_lattice_deforms_with_its_cell() {
    let steps = 100; // a strained lattice is unstable in the long run
    for (dimension, rates) in
        [(2, [-120.0, -60.0, 0.0, 0.0, 0.0, 4200.0]), (3, [-120.0, 60.0, -180.0, 600.0, -1800.0, 4200.0])]
    {
        let spacing = if dimension == 2 { 1.99 * R } else { 1.99 * R * 2.0_f64.sqrt() };
        let scene = lattice(dimension, 4, spacing, rates);
        let grown = exponential(gradient(rates) * (steps as f64 * DT));
        let links = |grown: DMat3| {
            let far = |x: i32| f64::from(x) * 0.5;
            let all = (0..343).map(move |k| DVec3::new(far(k % 7 - 3), far(k / 7 % 7 - 3), far(k / 49 - 3)));
            let on_lattice = move |x: &DVec3| match dimension {
                2 => x.z == 0.0 && x.x.fract() == 0.0 && x.y.fract() == 0.0,
                _ => (x.x + x.y + x.z).fract() == 0.0,
            };
            all.filter(on_lattice).map(move |x| grown * (spacing * x)).filter(|link| *link != DVec3::ZERO)
        };
        let overlap = 2.0 - links(grown).map(DVec3::length).fold(f64::INFINITY, f64::min) / R;
        assert!(overlap > 0.02, "{overlap}");
        for bench in benches() {
            let mut simulation = bench.start(&scene);
            simulation.advance(steps).unwrap();
            let domain = simulation.domain().unwrap();
            let start = DMat3::from_cols(
                scene.domain.edge(0),
                scene.domain.edge(1),
                match dimension {
                    2 => DVec3::Z,
                    _ => scene.domain.edge(2),
                },
            );
            let edges = (0..dimension).map(|axis| domain.edge(axis));
            let cell = DMat3::from_cols_array_2d(&{
                let mut all = [[0.0, 0.0, 1.0]; 3];
                edges.zip(&mut all).for_each(|(edge, to)| *to = edge.to_array());
                all
            });
            let count = cell.inverse() * (grown * start);
            let whole = DMat3::from_cols_array(&count.to_cols_array().map(f64::round));
            let off = (count - whole).to_cols_array().map(f64::abs).into_iter().fold(0.0, f64::max);
            assert!(whole != DMat3::IDENTITY, "no tilt has been turned back");
            let mut worst = off;
            for (now, before) in simulation.grains().unwrap().iter().zip(&scene.grains) {
                let expected = grown * before.position;
                let inside =
                    |axis: usize| (0.0..=domain.upper[axis]).contains(&(now.position[axis] - domain.lower[axis]));
                assert!((0..dimension).all(inside), "{} in {domain:?}", now.position);
                worst = worst.max(domain.nearest(now.position - expected).length() / R);
            }
            let sample = simulation.sample().unwrap();
            // Half of every link is this grain's.
            let volume = grown.determinant() * spacing.powi(dimension as i32) / if dimension == 2 { 1.0 } else { 4.0 };
            let of_link = |l: DVec3| {
                let press = KN * (2.0 * R - l.length()).max(0.0) / l.length() / (2.0 * volume);
                press * DMat3::from_cols(l * l.x, l * l.y, l * l.z)
            };
            let stress = links(grown).map(of_link).fold(DMat3::ZERO, |a, b| a + b);
            let found = sample.cell.unwrap().stress().map(Option::unwrap);
            let expected =
                [stress.x_axis.x, stress.y_axis.y, stress.z_axis.z, stress.z_axis.y, stress.z_axis.x, stress.y_axis.x];
            let stress_off =
                found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / stress.x_axis.x;
            assert!(stress_off < bench.pick(1e-10, 1e-4), "{dimension}D on {}: stress {stress_off:e}", bench.name);
            let [xx, yy, zz, yz, xz, xy] = simulation.strain().unwrap().unwrap();
            let expected = [
                grown.x_axis.x.ln(),
                grown.y_axis.y.ln(),
                grown.z_axis.z.ln(),
                grown.z_axis.y / grown.z_axis.z,
                grown.z_axis.x / grown.z_axis.z,
                grown.y_axis.x / grown.y_axis.y,
            ];
            let strain = [xx, yy, zz, yz, xz, xy].iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let overlap_off = (sample.max_overlap_over_radius - overlap).abs();
            println!("{dimension}D on {}: off {worst:.1e}, overlap {overlap_off:.1e}, strain {strain:.1e}", bench.name);
            assert!(worst < bench.pick(1e-9, 2e-4), "{dimension}D on {}: {worst:e}", bench.name);
            assert!(overlap_off < bench.pick(1e-10, 1e-5), "{dimension}D on {}: {overlap_off:e}", bench.name);
            assert!(strain < bench.pick(1e-11, 1e-6), "{dimension}D on {}: {strain:e}", bench.name);
            assert_eq!(simulation.lost_contacts(), 0);
        }
    }
}

/// Nothing acts on a single grain, so it goes straight on in space, whatever shears around it and through however many
/// faces it leaves.
#[test]
fn what_is_free_goes_straight_on() {
    for dimension in [2, 3] {
        let rates = if dimension == 2 { [0.0, 0.0, 0.0, 0.0, 0.0, 900.0] } else { [0.0, 0.0, 0.0, 0.0, 500.0, 900.0] };
        let mut scene = cell(dimension, R * DVec3::new(5.0, 6.0, 7.0), rates);
        scene.grains = vec![Grain { velocity: DVec3::new(1.0, 9.0, 0.0), ..grain(R, 2.0 * R, 0.0) }];
        if dimension == 3 {
            scene.grains[0].velocity.z = -8.0;
        }
        let start = scene.grains[0];
        let velocity = start.velocity + gradient(rates) * start.position;
        for bench in benches() {
            let mut simulation = bench.start(&scene);
            simulation.advance(1500).unwrap();
            let now = simulation.grains().unwrap()[0];
            let expected = start.position + simulation.time() * velocity;
            assert!(expected.y > 3.0 * scene.domain.upper.y, "it has left through few faces");
            let domain = simulation.domain().unwrap();
            let off = domain.nearest(now.position - expected).length() / R;
            println!("{dimension}D on {}: {off:.1e}", bench.name);
            assert!(off < bench.pick(1e-9, 1e-3), "{dimension}D on {}: {off:e}", bench.name);
        }
    }
}

/// Steps too small for the digits of single precision add up all the same.
#[test]
fn tiny_strains_add_up() {
    let steps = 6000;
    let rates = [1e-8 / DT, -1e-8 / DT, 0.0, 0.0, 0.0, 1e-8 / DT];
    let grown = exponential(gradient(rates) * (DT * steps as f64));
    let mut scene = cell(2, R * DVec3::new(7.0, 6.0, 0.0), rates);
    scene.grains = vec![grain(5.3 * R, 4.1 * R, 0.0)];
    for bench in benches() {
        let mut simulation = bench.start(&scene);
        simulation.advance(steps).unwrap();
        let found = simulation.strain().unwrap().unwrap();
        let expected = [grown.x_axis.x.ln(), grown.y_axis.y.ln(), 0.0, 0.0, 0.0, grown.y_axis.x / grown.y_axis.y];
        let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / expected[5];
        let (start, now) = (scene.grains[0].position, simulation.grains().unwrap()[0].position);
        let place = (now - grown * start).length() / (grown * start - start).length();
        println!("{}: strain off by {off:.1e}, place by {place:.1e}", bench.name);
        assert!(off < bench.pick(1e-9, 1e-5) && place < bench.pick(1e-9, 1e-5), "{}: {off:e} {place:e}", bench.name);
    }
}

/// Rigid grains that the cell presses together across a face keep touching, and no more.
#[test]
fn rigid_grains_are_pressed_across_faces() {
    let rates = [-5.0, 0.0, 0.0, 0.0, 0.0, 3.0];
    for dimension in [2, 3] {
        let mut scene = rigid(dimension, 1e-4, 0.3, 1e-6);
        let like = cell(dimension, R * DVec3::new(10.0, 8.0, 9.0), rates);
        (scene.domain, scene.cell, scene.gravity) = (like.domain, like.cell, DVec3::ZERO);
        // In space they would rest, and be pressed by nothing.
        scene.solver.damping = 50.0;
        let z = if dimension == 2 { 0.0 } else { 0.1 * R };
        for bench in benches() {
            let distance = |x: f64, y: f64| {
                let mut scene = scene.clone();
                scene.grains = vec![grain(x, y, z), grain(x + 2.0 * R, y, z)];
                scene.grains.iter_mut().for_each(|g| scene.domain.fold(&mut g.position));
                let mut simulation = bench.start(&scene);
                simulation.advance(60).unwrap();
                let grains = simulation.grains().unwrap();
                assert_eq!(simulation.sample().unwrap().contacts, 1, "they have parted");
                let d = simulation.domain().unwrap().nearest(grains[1].position - grains[0].position);
                (d.length() / R, d.y / R)
            };
            let expected = distance(4.0 * R, 4.0 * R);
            assert!((expected.0 - 2.0).abs() < 2e-3, "{expected:?}");
            for (x, y) in [(9.5 * R, 4.0 * R), (9.5 * R, 0.0), (8.0 * R, 7.99 * R)] {
                let found = distance(x, y);
                let off = (found.0 - expected.0).abs().max((found.1 - expected.1).abs());
                assert!(off < bench.pick(1e-6, 1e-4), "{dimension}D on {}: {found:?}, {expected:?}", bench.name);
            }
        }
    }
}

const SCENE: &str = r#"
dimension = 3
gravity = [0, 0, 0]
[domain]
lower = [0, 0, 0]
upper = [0.02, 0.02, 0.02]
boundary = "periodic"
[material.glass]
density = 2500
normal_stiffness = 1e4
[[population]]
material = "glass"
count = 500
radius = 0.001
[cell]
strain_rate = { xx = -20, yy = -20, zz = -20 }
[stop]
packing_fraction = 0.3
"#;

fn assembled(text: &str, set: &[&str]) -> packstone::Result<Assembly> {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    Scene::parse(text, "scene", Path::new("."), &set).and_then(|scene| scene.assemble())
}

/// A run ends at the first step at which a target is met.
#[test]
fn targets_are_met_in_a_step() {
    let scene = assembled(SCENE, &["solver.dt=1e-5"]).unwrap();
    let end = Schedule::new(&scene, 1e-5).end.unwrap();
    let mut simulation = CPU.start(&scene);
    let fraction = |simulation: &mut Simulation| {
        let domain = simulation.domain().unwrap();
        500.0 * 4.0 / 3.0 * std::f64::consts::PI * R.powi(3) / (domain.upper - domain.lower).element_product()
    };
    simulation.advance(end - 1).unwrap();
    assert!(fraction(&mut simulation) < 0.3);
    simulation.advance(1).unwrap();
    assert!((0.3..0.3 * (1.0 + 1e-3)).contains(&fraction(&mut simulation)));

    let scene =
        assembled(&SCENE.replace("packing_fraction = 0.3", "strain = { xx = -0.02, yy = -0.01 }"), &[]).unwrap();
    assert_eq!(Schedule::new(&scene, 1e-5).end, Some(50));
    assert_eq!(scene.solver.dt, TimeStep::Auto { fraction: 0.15 });
}

/// What a cell cannot do is said in a sentence.
#[test]
fn what_a_cell_cannot_do_is_told() {
    let refused = |set: &[&str], words: &[&str]| {
        let scene = assembled(SCENE, set).map(|scene| Simulation::new(scene, CPU.options()).map(|_| ()));
        let message = match scene {
            Err(error) | Ok(Err(error)) => error.to_string(),
            Ok(Ok(())) => panic!("{set:?} is accepted"),
        };
        words.iter().for_each(|word| assert!(message.contains(word), "{set:?}: {message}"));
    };
    let open = "domain.boundary=[\"periodic\", \"periodic\", \"open\"]";
    refused(&[open], &["cell.strain_rate.zz", "the axis z is not periodic"]);
    refused(&["gravity=[0, 0, -9.81]"], &["cell.strain_rate.zz", "gravity"]);
    refused(&["stop.packing_fraction=0.01"], &["stop.packing_fraction", "never met", "0.26"]);
    refused(&["stop.strain.xx=0.1"], &["stop.strain.xx", "0.1", "never met", "-20"]);
    refused(&["domain.tilt.xy=0.011"], &["domain.tilt.xy", "0.011", "0.01"]);
    refused(&["cell.strain_rate.xy=1e6", "solver.dt=1e-6"], &["cell.strain_rate", "solver.dt"]);
    refused(&["cell.strain_rate.yx=1"], &["yx", "xy"]);
    refused(&["cell.strain_rate.xx=inf"], &["finite"]);
}

/// A cell that becomes narrower than two grains side by side ends the run, in the state before.
#[test]
fn a_cell_must_not_become_too_narrow() {
    for mut scene in [cell(2, R * DVec3::new(4.1, 9.0, 0.0), [-1000.0, 0.0, 0.0, 0.0, 0.0, 0.0]), {
        let like = cell(2, R * DVec3::new(4.1, 9.0, 0.0), [-1000.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        Assembly { domain: like.domain, cell: like.cell, gravity: DVec3::ZERO, ..rigid(2, DT, 0.0, 1e-5) }
    }] {
        scene.grains = vec![grain(2.0 * R, 3.0 * R, 0.0)];
        for bench in benches() {
            let mut simulation = bench.start(&scene);
            let message = simulation.advance(100).unwrap_err().to_string();
            assert!(message.contains("the cell is only 4.00") && message.contains("along x"), "{message}");
            // 4.1 exp(-17.6 × 1.4e-3) = 4.0003
            assert_eq!(simulation.step(), 17, "{message}");
            let length = simulation.domain().unwrap().upper.x / R;
            assert!((4.0..4.006).contains(&length), "{length}");
        }
    }
}

/// No result has a bit of how long lists live and where they lie.
#[test]
fn bits_do_not_depend_on_lists() {
    let mut scene = cell(3, DVec3::splat(4.0 * SPACING), [-240.0, -280.0, -260.0, 300.0, -400.0, 1000.0]);
    scene.grains = cloud(3, 4, 0.3, 5);
    let bed = packstone::scene::Pair { dashpot: packstone::scene::Dashpot::Restitution(0.5), ..law(0.4) };
    scene.pairs = vec![bed];
    for bench in benches() {
        let run = |longest_chunk: u32, lists_abreast: Option<u32>, margin: f64| {
            let mut scene = scene.clone();
            scene.solver.margin = margin;
            let options = Options { longest_chunk, lists_abreast, ..bench.options() };
            let mut simulation = bench.start_with(&scene, options);
            simulation.advance(450).unwrap();
            let contacts = simulation.sample().unwrap().contacts;
            assert!(contacts > 60, "{contacts} contacts");
            assert_eq!(simulation.lost_contacts(), 0);
            assert!(simulation.strain().unwrap().unwrap()[5] > 0.3, "a tilt has been turned back");
            let bits = |g: &Grain| [g.position, g.velocity, g.spin].map(|v| v.to_array().map(f64::to_bits));
            simulation.grains().unwrap().iter().map(bits).collect::<Vec<_>>()
        };
        let expected = run(200, None, 0.2);
        for (longest_chunk, lists_abreast, margin) in [(7, None, 0.2), (200, Some(8), 0.2), (200, None, 0.5)] {
            assert!(run(longest_chunk, lists_abreast, margin) == expected, "{}: {longest_chunk}", bench.name);
        }
    }
}

/// Colliding rough grains, and dimers, in a cell that is squeezed and sheared: what they have and lose is what they had and
/// the cell has done.
#[test]
fn the_work_of_the_cell_is_accounted_for() {
    for (dimension, dimers) in [(2, false), (3, false), (3, true)] {
        let rates = if dimension == 2 {
            [-150.0, -50.0, 0.0, 0.0, 0.0, 300.0]
        } else {
            [-150.0, -50.0, -90.0, 100.0, -200.0, 300.0]
        };
        let side = if dimension == 2 { 6 } else { 4 };
        let slower = contact(dimension) / contact(3);
        let mut scene = cell(dimension, DVec3::splat(side as f64 * SPACING), rates.map(|rate| rate / slower));
        scene.grains = cloud(dimension, side, 0.2 / slower, 5);
        scene.pairs = vec![packstone::scene::Pair { dashpot: packstone::scene::Dashpot::Restitution(0.8), ..law(0.3) }];
        scene.output.works = true;
        if dimers {
            let shape = packstone::scene::Shape::of_union("dimer", &members(&[-0.4 * DVec3::X, 0.4 * DVec3::X]), 3);
            let clumps = scene.grains.iter().map(|g| Clump {
                position: g.position,
                velocity: g.velocity,
                spin: 50.0 * g.velocity,
                radius: 0.8 * R,
                ..clump(0)
            });
            let clumps = clumps.collect();
            set_clumps(&mut scene, vec![shape], clumps);
        }
        for bench in benches() {
            let off = |refine: u64| {
                let mut scene = scene.clone();
                scene.solver.dt = TimeStep::Fixed(0.01 * contact(dimension) / refine as f64);
                let mut simulation = bench.start(&scene);
                let before = simulation.sample().unwrap();
                simulation.advance(1500 * refine).unwrap();
                let now = simulation.sample().unwrap();
                let work = now.cell.unwrap().work_cell.unwrap();
                let gain = now.kinetic_energy + now.elastic_energy - before.kinetic_energy - before.elastic_energy;
                assert!(now.contacts > 3 && work > 0.3 * before.kinetic_energy, "{} contacts, {work:e}", now.contacts);
                (gain + now.dissipated.unwrap() - work) / work
            };
            let found = off(1);
            println!("{dimension}D, dimers: {dimers}, on {}: {found:.1e}", bench.name);
            assert!(found.abs() < 2e-3, "{dimension}D, dimers: {dimers}, on {}: {found:e}", bench.name);
        }
    }
}

/// A servo holds the stress along one axis while another one is loaded, and makes up for what it lags behind at first.
#[test]
fn a_servo_holds_a_stress_beside_a_load() {
    let target = 20.0;
    let mut scene = cell(2, DVec3::splat(12.0 * SPACING), [0.0; 6]);
    scene.grains = cloud(2, 12, 0.01, 5);
    scene.grains.iter_mut().enumerate().for_each(|(k, g)| g.radius *= [1.0, 0.8, 0.9][k % 3]);
    scene.pairs = vec![packstone::scene::Pair { dashpot: packstone::scene::Dashpot::Restitution(0.3), ..law(0.3) }];
    scene.solver.dt = TimeStep::Fixed(0.04 * contact(2));
    scene.solver.damping = 0.02 / contact(2);
    scene.cell.stress = [Some(target), Some(target), None, None, None, None];
    scene.cell.inertial_number = 1e-2;
    scene.stop.equilibrium = Some(1e-2);
    let mut simulation = CPU.start(&scene);
    simulation.advance(60_000).unwrap();
    assert!(scene.missed_stresses(Some(simulation.sample().unwrap().cell.unwrap().stress())).is_empty());
    // From the same state, loaded slowly.
    let mut loaded = scene.clone();
    loaded.grains = simulation.grains().unwrap();
    loaded.domain = simulation.domain().unwrap();
    loaded.cell.stress[1] = None;
    loaded.cell.strain_rate[1] = -0.03 * scene.most_rate();
    loaded.cell.gain = 0.01;
    loaded.solver.allow_overlap = true;
    let mut simulation = CPU.start(&loaded);
    let mut lags = Vec::new();
    for _ in 0..8 {
        let mut mean = 0.0;
        for _ in 0..50 {
            simulation.advance(200).unwrap();
            mean += simulation.sample().unwrap().cell.unwrap().stress_xx.unwrap() / 50.0;
        }
        lags.push(mean / target - 1.0);
    }
    let late = lags[4..].iter().sum::<f64>() / 4.0;
    println!("lags {lags:.4?}, at last {late:.4}");
    assert!(late.abs() < 0.01, "{lags:?}");
}

/// Disks and spheres, loosely placed, rough and smooth, that a servo compresses, slowly and fast: every component of the
/// stress comes to its target without going beyond it by more than 1 %, and no momentum gets lost on the way.
#[test]
fn a_servo_comes_to_its_target() {
    for (dimension, friction, inertial_number) in
        [(2, 0.3, 1e-2), (3, 0.3, 1e-2), (2, 0.0, 1e-2), (3, 0.0, 1e-1), (2, 0.3, 1e-1)]
    {
        let target = if dimension == 2 { 20.0 } else { 1e4 };
        let side = if dimension == 2 { 8 } else { 4 };
        let mut scene = cell(dimension, DVec3::splat(side as f64 * SPACING), [0.0; 6]);
        scene.grains = cloud(dimension, side, 0.01, 5);
        scene.grains.iter_mut().enumerate().for_each(|(k, g)| g.radius *= [1.0, 0.8, 0.9][k % 3]);
        let dashpot = packstone::scene::Dashpot::Restitution(0.3);
        scene.pairs = vec![packstone::scene::Pair { dashpot, ..law(friction) }];
        scene.solver.dt = TimeStep::Fixed(0.04 * contact(dimension));
        scene.solver.damping = 0.02 / contact(dimension);
        let normal = |axis: usize| (axis < dimension).then_some(target);
        scene.cell.stress = [normal(0), normal(1), normal(2), None, None, None];
        scene.cell.inertial_number = inertial_number;
        scene.stop.equilibrium = Some(1e-2);
        let mut simulation = CPU.start(&scene);
        let (mut most, mut at, mut balanced) = (0.0_f64, None, false);
        for k in 0..300 {
            simulation.advance(200).unwrap();
            let sample = simulation.sample().unwrap();
            let stress = sample.cell.unwrap().stress();
            most = (0..dimension).map(|k| stress[k].unwrap()).fold(most, f64::max);
            let there = scene.missed_stresses(Some(stress)).is_empty() && sample.at_rest(1e-2);
            at = at.or(there.then_some(k));
            if most > 0.3 * target && !std::mem::replace(&mut balanced, true) {
                for balance in balances(&mut simulation, 30).unwrap() {
                    assert!(balance.holds() && balance.of != "energy", "{dimension}D: {balance:?}");
                }
            }
        }
        let cell = simulation.sample().unwrap().cell.unwrap();
        let most = most / target;
        println!(
            "{dimension}D, μ {friction}, I {inertial_number}: at most {most:.4} of the target, there after {at:?}"
        );
        assert!(most < 1.01, "{dimension}D, μ {friction}, I {inertial_number}: {most} of the target");
        assert!(at.is_some() && scene.missed_stresses(Some(cell.stress())).is_empty(), "{cell:?}");
        assert_eq!(simulation.lost_contacts(), 0);
    }
}
