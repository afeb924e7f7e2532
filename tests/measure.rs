//! What is read off a state: packings whose fraction is known, and contacts, energies and forces counted by hand.

mod common;

use common::*;
use glam::DVec3;
use packstone::{
    measure::{Sample, angular_momentum, backbone, masses, momentum, overall_packing_fraction, packing_fraction},
    scene::{Assembly, Domain, Grain, Scene, Wall},
};
use std::{f64::consts::PI, path::Path};

const SIMPLE_CUBIC: f64 = PI / 6.0;
const CLOSE_PACKED: f64 = 0.740_480_49;

fn fraction(assembly: &Assembly) -> Option<f64> {
    packing_fraction(assembly, &assembly.grains, &assembly.walls).map(|f| f.value)
}

#[track_caller]
fn expect(what: &str, assembly: &Assembly, expected: f64, tolerance: f64) {
    let found = fraction(assembly);
    println!("{what}: {found:?}, expected {expected:.5}");
    close(what, found.expect(what), expected, 1.0, tolerance);
}

/// Grains that touch in a simple cubic lattice of n cells, corner of the first cell at the origin.
fn simple_cubic(n: [i32; 3]) -> Vec<Grain> {
    let cells = (0..n[2]).flat_map(|z| (0..n[1]).flat_map(move |y| (0..n[0]).map(move |x| [x, y, z])));
    cells.map(|c| c.map(|i| (2.0 * f64::from(i) + 1.0) * R)).map(|[x, y, z]| grain(x, y, z)).collect()
}

/// Grains at these points of a cell (in units of its edges), repeated n times, in a periodic domain of that size.
fn periodic(dimension: usize, edges: DVec3, n: [i32; 3], basis: &[DVec3]) -> Assembly {
    let mut scene = blank(dimension);
    let cells = (0..n[2]).flat_map(|z| (0..n[1]).flat_map(move |y| (0..n[0]).map(move |x| [x, y, z])));
    let size = DVec3::from_array(n.map(f64::from)) * edges;
    let upper = if dimension == 2 { DVec3::new(size.x, size.y, f64::INFINITY) } else { size };
    let lower = if dimension == 2 { DVec3::new(0.0, 0.0, f64::NEG_INFINITY) } else { DVec3::ZERO };
    scene.domain = Domain { lower, upper, periodic: [true, true, dimension == 3], ..Domain::default() };
    for cell in cells {
        for b in basis {
            let x = (DVec3::from_array(cell.map(f64::from)) + *b) * edges;
            scene.grains.push(grain(x.x, x.y, x.z));
        }
    }
    scene
}

fn floor() -> Wall {
    plane(DVec3::ZERO, DVec3::Z)
}

#[test]
fn lattice_in_a_box() {
    for (what, gravity) in [("no gravity", DVec3::ZERO), ("gravity", -G * DVec3::Z), ("sideways", G * DVec3::X)] {
        let mut scene = blank(3);
        scene.gravity = gravity;
        scene.grains = simple_cubic([10; 3]);
        scene.walls = DVec3::AXES.into_iter().flat_map(|n| [plane(DVec3::ZERO, n), plane(20.0 * R * n, -n)]).collect();
        expect(what, &scene, SIMPLE_CUBIC, 0.002);
        // Without a lid, and with a cell of the mesh of columns that does not match the lattice.
        scene.walls.truncate(5);
        let shift = DVec3::new(0.37, 0.59, 0.0) * R;
        scene.grains.iter_mut().for_each(|g| g.position += shift);
        for wall in &mut scene.walls {
            if let packstone::scene::Surface::Plane { point, .. } = &mut wall.surface {
                *point += shift;
            }
        }
        expect(what, &scene, SIMPLE_CUBIC, 0.01);
    }
}

#[test]
fn lattices_that_repeat() {
    let point = DVec3::new;
    let cube = periodic(3, DVec3::splat(2.0 * R), [6; 3], &[point(0.5, 0.5, 0.5)]);
    expect("SC", &cube, SIMPLE_CUBIC, 0.001);
    let face = [point(0.0, 0.0, 0.0), point(0.5, 0.5, 0.0), point(0.5, 0.0, 0.5), point(0.0, 0.5, 0.5)];
    let fcc = periodic(3, DVec3::splat(2.0 * 2.0_f64.sqrt() * R), [5; 3], &face);
    expect("FCC", &fcc, CLOSE_PACKED, 0.001);
    let hexagonal =
        [point(0.0, 0.0, 0.0), point(0.5, 0.5, 0.0), point(0.5, 5.0 / 6.0, 0.5), point(0.0, 1.0 / 3.0, 0.5)];
    let edges = 2.0 * R * point(1.0, 3.0_f64.sqrt(), (8.0_f64 / 3.0).sqrt());
    let hcp = periodic(3, edges, [6, 4, 4], &hexagonal);
    expect("HCP", &hcp, CLOSE_PACKED, 0.001);
    let square = periodic(2, point(2.0, 2.0, 0.0) * R, [12, 12, 1], &[point(0.5, 0.5, 0.0)]);
    expect("square", &square, PI / 4.0, 0.001);
    let rows = [point(0.0, 0.0, 0.0), point(0.5, 0.5, 0.0)];
    let triangular = periodic(2, point(2.0, 2.0 * 3.0_f64.sqrt(), 0.0) * R, [12, 8, 1], &rows);
    expect("triangular", &triangular, PI / 12.0_f64.sqrt(), 0.001);
}

/// Where all space is inside, grains are counted to the last digit, and what two of them share once: spheres that overlap
/// by a tenth of R, across the seam too, unequal disks, and clumps, whose members share what they share.
#[test]
fn what_repeats_is_exact() {
    let exact = |what: &str, scene: &Assembly, expected: f64| {
        let found = packing_fraction(scene, &scene.grains, &scene.walls).expect(what);
        assert_eq!(found.error, 0.0);
        close(what, found.value, expected, expected, 1e-12);
    };
    let point = DVec3::new;
    let cube = periodic(3, DVec3::splat(2.0 * R), [6; 3], &[point(0.5, 0.5, 0.5)]);
    exact("SC", &cube, SIMPLE_CUBIC);
    // Caps of height 0.05 R on six sides.
    let pressed = periodic(3, DVec3::splat(1.9 * R), [6; 3], &[point(0.0, 0.5, 0.5)]);
    let cap = PI * 0.05 * 0.05 * (3.0 - 0.05) / 3.0;
    exact("pressed SC", &pressed, (4.0 / 3.0 * PI - 6.0 * cap) / 1.9_f64.powi(3));
    let mut disks = periodic(2, point(2.0, 1.7, 0.0) * R, [4, 1, 1], &[point(0.0, 0.0, 0.0), point(0.5, 0.5, 0.0)]);
    disks.grains.iter_mut().skip(1).step_by(2).for_each(|g| g.radius = 0.4 * R);
    disks.domain.upper.y = 5.0 * R;
    // Segments of both on the chord, by the angles at the two centres.
    let d = (1.0_f64 + 0.85 * 0.85).sqrt();
    let segment = |r: f64, s: f64| {
        let cos = (d * d + r * r - s * s) / (2.0 * d * r);
        r * r * (cos.acos() - cos * (1.0 - cos * cos).sqrt())
    };
    let lens = segment(1.0, 0.4) + segment(0.4, 1.0);
    exact("disks", &disks, (PI * 1.16 - 2.0 * lens) / 10.0);

    let text = "dimension = 3\ngravity = [0, 0, 0]\nstop.steps = 1\n[domain]\nlower = [0, 0, 0]\nupper = [1, 1, 1]\n\
                boundary = \"periodic\"\n[material.m]\ndensity = 1\nnormal_stiffness = 1\n[[grain]]\nmaterial = \"m\"\n\
                position = [0.1, 0.5, 0.5]\nradius = 0.1\nshape = \"dimer\"\n[[grain]]\nmaterial = \"m\"\n\
                position = [0.5, 0.5, 0.5]\nradius = 0.05\n";
    let clumps = Scene::parse(text, "clumps.toml", Path::new("."), &[]).unwrap().assemble().unwrap();
    exact("a dimer and a sphere", &clumps, 4.0 / 3.0 * PI * (1e-3 + 1.25e-4));
}

/// The error that is stated is that of the value, for 12 boxes of whole cells of a lattice.
#[test]
fn the_error_of_sampling_is_told() {
    let mut squares = Vec::new();
    for n in 8..20 {
        let mut scene = blank(3);
        scene.grains = simple_cubic([n; 3]);
        let edge = 2.0 * f64::from(n) * R;
        scene.walls = DVec3::AXES.into_iter().flat_map(|a| [plane(DVec3::ZERO, a), plane(edge * a, -a)]).collect();
        // A wall far away that stands across no axis: then nothing is exact any more.
        scene.walls.push(plane(DVec3::splat(-edge), DVec3::ONE.normalize()));
        let found = packing_fraction(&scene, &scene.grains, &scene.walls).unwrap();
        println!("{n}: {found:?}, off by {:.2} errors", (found.value - SIMPLE_CUBIC) / found.error);
        assert!(found.error > 0.0 && found.error < 2e-3, "{found:?}");
        squares.push(((found.value - SIMPLE_CUBIC) / found.error).powi(2));
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!(mean < 2.0 && squares.iter().all(|s| *s < 16.0), "{squares:?}");
}

/// Spheres in a row in a tube that they fill, and on top of each other in a box three radii wide: there is no inside, but
/// the vessel is filled to 2/3 of the tube, and by what lies below the highest centre.
#[test]
fn slender_vessels_have_an_overall_fraction() {
    let mut scene = blank(3);
    scene.gravity = -G * DVec3::Z;
    scene.walls = vec![floor(), cylinder(1.001 * R)];
    scene.grains = simple_cubic([1, 1, 20]);
    scene.grains.iter_mut().for_each(|g| g.position -= DVec3::new(R, R, 0.0));
    assert_eq!(fraction(&scene), None);
    let found = overall_packing_fraction(&scene, &scene.grains, &scene.walls).unwrap();
    // 19 and a half of them below the last centre, 39 R above the floor.
    let expected = 19.5 * 4.0 / 3.0 / (39.0 * 1.001 * 1.001);
    println!("tube: {found:?}, expected {expected}");
    assert!((found.value - expected).abs() < 4.0 * found.error && found.error < 2e-3, "{found:?}, {expected}");
    scene.walls[1] = cylinder(3.0 * R);
    let found = overall_packing_fraction(&scene, &scene.grains, &scene.walls).unwrap();
    // The box around the grains, whose corners are inside this tube.
    let expected = 19.5 * 4.0 / 3.0 * PI / (39.0 * 4.0);
    assert!((found.value - expected).abs() < 4.0 * found.error, "{found:?}, {expected}");
}

/// Where walls stand across the axes and nothing falls, what is inside is a box, and nothing is left to chance.
#[test]
fn lattice_in_a_box_is_exact() {
    for dimension in [2, 3] {
        let mut scene = blank(dimension);
        let n = 10;
        scene.grains = simple_cubic([n, n, if dimension == 2 { 1 } else { n }]);
        let far = 2.0 * f64::from(n) * R;
        for axis in DVec3::AXES.into_iter().take(dimension) {
            scene.walls.extend([plane(DVec3::ZERO, axis), plane(far * axis, -axis)]);
        }
        if dimension == 2 {
            scene.grains.iter_mut().for_each(|g| g.position.z = 0.0);
        }
        let found = packing_fraction(&scene, &scene.grains, &scene.walls).unwrap();
        let expected = if dimension == 2 { PI / 4.0 } else { SIMPLE_CUBIC };
        close("fraction", found.value, expected, 1.0, 1e-12);
        assert!(found.error < 1e-12, "{found:?}");
        // As far as sampling goes, a box that cuts grains anywhere has what it has: with weight it is sampled.
        scene.grains.iter_mut().for_each(|g| g.position *= 1.03);
        let exact = packing_fraction(&scene, &scene.grains, &scene.walls).unwrap();
        scene.gravity = -1e-9 * DVec3::AXES[dimension - 1];
        let sampled = packing_fraction(&scene, &scene.grains, &scene.walls).unwrap();
        assert!((exact.value - sampled.value).abs() < 0.02, "{exact:?} {sampled:?}");
    }
}

/// A lattice cut by a cylinder leaves holes at it, more than the two radii that are not counted.
#[test]
fn lattice_in_a_cylinder() {
    for (radius, tolerance) in [(20.0 * R, 0.02), (40.0 * R, 0.01)] {
        let mut scene = blank(3);
        scene.gravity = -G * DVec3::Z;
        scene.walls = vec![floor(), cylinder(radius)];
        let side = (radius / R) as i32;
        scene.grains = simple_cubic([side, side, 10]);
        scene.grains.iter_mut().for_each(|g| g.position -= DVec3::new(radius, radius, 0.0));
        scene.grains.retain(|g| g.position.truncate().length() <= radius - R);
        expect(&format!("cylinder of {} R", radius / R), &scene, SIMPLE_CUBIC, tolerance);
    }
}

#[test]
fn lattice_in_a_heap() {
    // A prism along y and a pyramid, on a floor.
    for (what, both) in [("prism", false), ("pyramid", true)] {
        let n = 24;
        let mut scene = blank(3);
        scene.gravity = -G * DVec3::Z;
        scene.walls = vec![floor()];
        scene.grains = simple_cubic([n, n, n / 2]);
        let middle = f64::from(n) * R;
        let room = |x: f64, z: f64| (x - middle).abs() < middle - z + 1.5 * R;
        scene.grains.retain(|g| room(g.position.x, g.position.z) && (!both || room(g.position.y, g.position.z)));
        expect(what, &scene, SIMPLE_CUBIC, 0.01);
        // Where gravity points makes no difference.
        for g in &mut scene.grains {
            g.position = DVec3::new(-g.position.z, g.position.x, g.position.y);
        }
        scene.gravity = G * DVec3::X;
        scene.walls = vec![plane(DVec3::ZERO, -DVec3::X)];
        expect(&format!("{what} on its side"), &scene, SIMPLE_CUBIC, 0.01);
    }
}

#[test]
fn fixed_grains_are_solid_but_no_region() {
    let mut scene = blank(3);
    scene.gravity = -G * DVec3::Z;
    scene.grains = simple_cubic([10; 3]);
    // Fixed grains in between fill space.
    for (k, g) in scene.grains.iter_mut().enumerate() {
        g.fixed = k % 3 == 0;
    }
    expect("every third one fixed", &scene, SIMPLE_CUBIC, 0.01);
    // A deep, sparse base is not looked into.
    scene.grains.iter_mut().for_each(|g| g.fixed = false);
    let without = fraction(&scene).unwrap();
    let base = simple_cubic([5, 5, 20]).into_iter().map(|g| Grain {
        position: DVec3::new(2.0 * g.position.x, 2.0 * g.position.y, -4.0 * g.position.z),
        fixed: true,
        ..g
    });
    scene.grains.extend(base);
    expect("on a base", &scene, without, 0.002);
    // Nor are fixed grains above.
    scene.grains.push(Grain { fixed: true, ..grain(10.0 * R, 10.0 * R, 100.0 * R) });
    expect("below a fixed grain", &scene, without, 0.002);
}

/// Its column ends where the grains below it end.
#[test]
fn a_stray_grain_changes_nothing() {
    let mut scene = blank(3);
    scene.gravity = -G * DVec3::Z;
    scene.walls = vec![floor()];
    scene.grains = simple_cubic([10; 3]);
    let without = fraction(&scene).unwrap();
    for height in [30.0, 100.0, 1000.0] {
        scene.grains.push(grain(9.0 * R, 11.0 * R, height * R));
        expect(&format!("one at {height} R"), &scene, without, 0.01);
        scene.grains.pop();
    }
}

#[test]
fn too_little_has_no_inside() {
    let mut scene = blank(3);
    scene.grains = vec![grain(0.0, 0.0, 0.0), grain(2.0 * R, 0.0, 0.0)];
    assert_eq!(fraction(&scene), None);
    scene.gravity = -G * DVec3::Z;
    scene.walls = vec![plane(DVec3::Z * -R, DVec3::Z)];
    assert_eq!(fraction(&scene), None);
    scene.grains = simple_cubic([3, 3, 1]);
    assert_eq!(fraction(&scene), None);
    scene.grains.iter_mut().for_each(|g| g.fixed = true);
    assert_eq!(fraction(&scene), None);
}

fn now(scene: &Assembly) -> Sample {
    CPU.start(scene).sample().unwrap()
}

/// Two free grains on a floor and against each other, a fixed one at the second, another fixed one in the floor and in
/// the first fixed one, a free one alone.
#[test]
fn contacts_counted_by_hand() {
    let (floor_overlap, between, at_fixed) = (0.01 * R, 0.02 * R, 0.03 * R);
    let mut scene = blank(3);
    scene.walls = vec![floor()];
    let z = R - floor_overlap;
    let (b, c) = (2.0 * R - between, 4.0 * R - between - at_fixed);
    scene.grains = vec![
        grain(0.0, 0.0, z),
        grain(b, 0.0, z),
        Grain { fixed: true, ..grain(c, 0.0, z + 1e-3 * floor_overlap) },
        Grain { fixed: true, ..grain(c, 1.9 * R, z) },
        grain(0.0, 0.0, 10.0 * R),
    ];
    scene.grains[2].position.z = z;
    let sample = now(&scene);
    println!("{sample:?}");
    assert_eq!(sample.contacts, 4);
    close("coordination number", sample.coordination_number, 5.0 / 3.0, 1.0, 1e-12);
    let overlaps = [floor_overlap, floor_overlap, between, at_fixed];
    let energy: f64 = overlaps.iter().map(|d| 0.5 * KN * d * d).sum();
    close("elastic energy", sample.elastic_energy, energy, energy, 1e-9);
    close("overlap", sample.max_overlap_over_radius, 0.03, 0.03, 1e-9);
    // Of the first: floor and pair; of the second: floor, and the rest of pair and fixed one; of the third: none.
    let first = floor_overlap.hypot(between);
    let second = floor_overlap.hypot(at_fixed - between);
    let ratio = (first + second) / 3.0 / (overlaps.iter().sum::<f64>() / 4.0);
    close("unbalanced force ratio", sample.unbalanced_force_ratio, ratio, ratio, 1e-9);
    assert_eq!((sample.step, sample.time), (0, 0.0));
    // Velocities go back by half a step and forth again.
    assert!(sample.kinetic_energy < 1e-25 * energy, "{sample:?}");
    // Weight is part of the total force.
    scene.gravity = -G * DVec3::Z;
    let push = KN * floor_overlap - mass(3, R) * G;
    let forces = [(KN * between).hypot(push), (KN * (at_fixed - between)).hypot(push), mass(3, R) * G];
    let ratio = forces.iter().sum::<f64>() / 3.0 / (KN * overlaps.iter().sum::<f64>() / 4.0);
    let sample = now(&scene);
    close("ratio with weight", sample.unbalanced_force_ratio, ratio, ratio, 1e-9);
    let potential = mass(3, R) * G * (2.0 * z + 10.0 * R);
    close("potential energy", sample.potential_energy, potential, potential, 1e-9);
    // Moving fixed grains have no energy.
    scene.grains[2].velocity = DVec3::X;
    assert!(now(&scene).kinetic_energy < 1e-25 * energy);
}

/// The contact force in the ratio is that of the springs; the total force has the dashpot's part.
#[test]
fn dashpots_in_the_unbalanced_ratio() {
    let mut scene = blank(3);
    let eta = 1e3;
    scene.pairs[0].dashpot = packstone::scene::Dashpot::MassScaled(eta);
    scene.walls = vec![floor()];
    scene.grains = vec![Grain { velocity: DVec3::NEG_Z, ..grain(0.0, 0.0, 0.99 * R) }];
    let (spring, dashpot) = (KN * 0.01 * R, eta * mass(3, R));
    let ratio = (spring + dashpot) / spring;
    close("ratio", now(&scene).unbalanced_force_ratio, ratio, ratio, 2e-2);
}

/// A sphere that two walls squeeze by 2 % of R each, on its way through the middle.
#[test]
fn passing_through_balance_is_not_rest() {
    let mut scene = blank(3);
    scene.walls = vec![plane(DVec3::X * (-0.98 * R), DVec3::X), plane(DVec3::X * (0.98 * R), -DVec3::X)];
    let elastic = KN * (0.02 * R).powi(2);
    for (kinetic, rest) in [(0.0, true), (5e-4, true), (2e-3, false), (0.1, false)] {
        let v = (2.0 * kinetic * elastic / mass(3, R)).sqrt();
        scene.grains = vec![Grain { velocity: DVec3::X * v, ..grain(0.0, 0.0, 0.0) }];
        let sample = now(&scene);
        assert!(sample.unbalanced_force_ratio < 1e-9, "{sample:?}");
        close("kinetic over elastic", sample.kinetic_energy / sample.elastic_energy, kinetic, 1.0, 1e-6);
        assert_eq!(sample.at_rest(1e-3), rest, "kinetic / elastic {kinetic}: {sample:?}");
    }
    // At rest off balance, and without any contact.
    scene.grains = vec![grain(0.001 * R, 0.0, 0.0)];
    assert!(!now(&scene).at_rest(1e-3) && now(&scene).at_rest(0.5));
    scene.walls.clear();
    let sample = now(&scene);
    assert!(sample.unbalanced_force_ratio.is_infinite() && !sample.at_rest(1e-3), "{sample:?}");
}

#[test]
fn momenta() {
    for dimension in [2, 3] {
        let mut scene = blank(dimension);
        let (v, w) = (DVec3::new(1.0, 2.0, if dimension == 2 { 0.0 } else { 3.0 }), DVec3::Z * 50.0);
        scene.grains = vec![
            Grain { velocity: v, spin: w, ..grain(3.0 * R, 0.0, 0.0) },
            Grain { velocity: -v, radius: 2.0 * R, ..grain(0.0, 5.0 * R, 0.0) },
            Grain { velocity: v, spin: w, fixed: true, ..grain(9.0 * R, 9.0 * R, 0.0) },
        ];
        let m = masses(&scene);
        let by_hand = [mass(dimension, R), mass(dimension, 2.0 * R), mass(dimension, R)];
        (0..3).for_each(|k| close("mass", m[k], by_hand[k], m[k], 1e-12));
        let p = (m[0] - m[1]) * v;
        close("momentum", (momentum(&scene.grains, &m) - p).length(), 0.0, p.length(), 1e-12);
        let orbit = m[0] * DVec3::X.cross(v) * 3.0 * R - m[1] * DVec3::Y.cross(v) * 5.0 * R;
        let l = orbit + gyration(dimension) * m[0] * R * R * w;
        let found = angular_momentum(&scene, &scene.grains, &m).unwrap();
        close("angular momentum", (found - l).length(), 0.0, l.length(), 1e-12);
        for axis in 0..dimension {
            scene.domain.periodic = [0, 1, 2].map(|a| a == axis);
            assert_eq!(angular_momentum(&scene, &scene.grains, &m), None, "periodic along {axis}");
        }
    }
}

/// A triangle with a tail of two grains, a wall at its end, and one grain alone: the tail goes grain by grain.
#[test]
fn rattlers_go_one_after_the_other() {
    let contacts = [(0, 1), (1, 2), (2, 0), (2, 3), (3, 4)];
    assert_eq!(backbone(&[true; 6], &contacts, 2), [true, true, true, false, false, false]);
    assert_eq!(backbone(&[true; 6], &contacts, 1), [true, true, true, true, true, false]);
    assert_eq!(backbone(&[true; 6], &contacts, 3), [false; 6]);
    let outside = [true, true, true, true, false, true];
    assert_eq!(backbone(&outside, &contacts, 2), [true, true, true, true, true, false]);
    let on_wall = [contacts.as_slice(), &[(4, 6)]].concat();
    assert_eq!(backbone(&[true; 6], &on_wall, 2), [true, true, true, true, true, false]);
}
