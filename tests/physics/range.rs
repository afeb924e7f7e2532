//! Single precision wherever f64 goes: any units, far from where a scene began, in wide vessels; or it says no.

use crate::{common::*, shared::*};
use glam::{DVec2, DVec3};
use packstone::{
    Error,
    scene::{Assembly, Dashpot, Grain, Pair, Surface, TimeStep},
    simulation::Simulation,
};

/// The same numbers in other units: lengths, masses and times are these multiples of what they were.
fn in_units(mut scene: Assembly, length: f64, mass: f64, time: f64) -> Assembly {
    let velocity = length / time;
    scene.gravity *= velocity / time;
    for grain in &mut scene.grains {
        grain.position *= length;
        grain.radius *= length;
        grain.velocity *= velocity;
        grain.spin /= time;
    }
    for wall in &mut scene.walls {
        let (Surface::Plane { point: at, .. } | Surface::Cylinder { center: at, .. }) = &mut wall.surface;
        *at *= length;
        wall.velocity *= velocity;
    }
    scene.materials.iter_mut().for_each(|m| m.density *= mass / length.powi(3));
    for pair in &mut scene.pairs {
        pair.normal_stiffness *= mass / (time * time);
        pair.tangential_stiffness *= mass / (time * time);
    }
    let TimeStep::Fixed(dt) = &mut scene.solver.dt else { unreachable!() };
    *dt *= time;
    scene
}

/// Nanometres and kilometres, micrograms and kilotons: in units that differ by powers of two nothing changes but the
/// unit, to the last bit.
#[test]
fn units_change_nothing() {
    let mut soft = blank(3);
    soft.gravity = -G * DVec3::Z;
    soft.pairs = vec![Pair { dashpot: Dashpot::Restitution(0.6), ..law(0.3) }];
    soft.walls = vec![floor(3)];
    soft.grains = cloud(3, 2, 0.4, 7);
    let mut hard = rigid(3, 1e-4, 0.3, 1e-5);
    (hard.gravity, hard.walls, hard.grains) = (soft.gravity, soft.walls.clone(), soft.grains.clone());
    let power = |exponent| 2.0_f64.powi(exponent);
    for (scene, steps) in [(soft, 600), (hard, 30)] {
        for bench in engines() {
            let expected = bench.after(&scene, steps);
            for (length, mass, time) in [(-21, -70, -25), (20, 40, 12), (-40, -120, -30), (33, 99, 5)] {
                let (length, mass, time) = (power(length), power(mass), power(time));
                for (a, b) in bench.after(&in_units(scene.clone(), length, mass, time), steps).iter().zip(&expected) {
                    assert_eq!(a.position / length, b.position, "{}", bench.name);
                    assert_eq!(a.velocity * time / length, b.velocity, "{}", bench.name);
                    assert_eq!(a.spin * time, b.spin, "{}", bench.name);
                }
            }
        }
    }
}

/// What single precision cannot hold is refused by name, before anything runs.
#[test]
fn numbers_out_of_range() {
    let scene = || {
        let mut scene = blank(3);
        scene.grains = (0..2).map(|k| grain(5.0 * R * f64::from(k), 0.0, 0.0)).collect();
        scene
    };
    let mut spin = scene();
    spin.grains[1].spin = 1e100 * DVec3::Z;
    let mut speed = scene();
    speed.grains[1].velocity = 1e40 * DVec3::X;
    let mut soft = scene();
    set_laws(&mut soft, &[law(0.0), Pair { normal_stiffness: 1e-30 * KN, ..law(0.0) }]);
    soft.grains[1].material = 1;
    let mut tiny = scene();
    tiny.grains[1].radius = 1e-30;
    tiny.solver.allow_unstable = true;
    for (scene, words) in [
        (spin, "grain 1: spin = 1e100 1/s"),
        (speed, "grain 1: velocity.v = 1.0"),
        (soft, "pair of materials 1"),
        (tiny, "grain 1: "),
    ] {
        let error = Simulation::new(scene, GPU_SINGLE.options()).err().expect(words).to_string();
        assert!(error.contains(words) && error.contains("single precision"), "{error}");
    }
}

/// Forces of curved walls on grains that overlap with them by 1e-5 to 1e-3 of their radius, in vessels up to 10,000
/// radii wide, anywhere.
#[test]
fn curved_walls() {
    let mut random = Random(11);
    for dimension in [2, 3] {
        for width in [3.0, 100.0, 500.0, 2_000.0, 10_000.0] {
            let (center, radius) = (DVec3::new(0.31, -1.7, 0.0) * R, 1.0371 * width * R);
            let mut scene = blank(dimension);
            scene.walls = vec![cylinder(radius)];
            scene.walls[0].surface = Surface::Cylinder { center, radius };
            scene.solver.allow_overlap = true;
            let mut overlaps = Vec::new();
            for k in 0..12 {
                let own = R * (0.8 + 0.2 * random.unit());
                let overlap = own * 10.0_f64.powf(-5.0 + 2.0 * random.unit());
                // Fixed ones do not touch each other.
                let angle = std::f64::consts::TAU * (f64::from(k) + random.unit()) / 12.0;
                let distance = radius - own + overlap;
                let at = center + distance * DVec2::from_angle(angle).extend(0.0);
                let up = if dimension == 3 { 3.0 * R * f64::from(k) * DVec3::Z } else { DVec3::ZERO };
                let position = at + up;
                overlaps.push(((position - center).truncate().length() - (radius - own), (at - center) / distance));
                scene.grains.push(Grain { position, radius: own, ..grain(0.0, 0.0, 0.0) });
            }
            if width < 10.0 && dimension == 2 {
                continue; // disks would overlap each other
            }
            for bench in engines() {
                let mut simulation = bench.start(&scene);
                for ((force, _), (overlap, n)) in simulation.forces().unwrap().iter().zip(&overlaps) {
                    let expected = -KN * overlap * *n;
                    let error = (*force - expected).length() / expected.length();
                    close(&format!("{} in {width} R", bench.name), error, 0.0, 1.0, bench.pick(1e-6, 1e-5));
                }
            }
        }
    }
}

/// Forces of planes that are along no axis, on grains that overlap with them by 1e-5 to 1e-3 of their radius, up to 16,000
/// radii from each other.
#[test]
fn oblique_planes() {
    let mut random = Random(12);
    for dimension in [2, 3] {
        for width in [1.0, 30.0, 1_000.0, 8_000.0] {
            let mut scene = blank(dimension);
            let point = random.vector(dimension) * R;
            scene.walls = vec![plane(point, random.vector(dimension))];
            let Surface::Plane { normal, .. } = scene.walls[0].surface else { unreachable!() };
            let along =
                if dimension == 2 { normal.truncate().perp().extend(0.0) } else { normal.any_orthonormal_vector() };
            scene.solver.allow_overlap = true;
            let mut overlaps = Vec::new();
            for k in 0..12 {
                let radius = R * (0.8 + 0.2 * random.unit());
                let overlap = radius * 10.0_f64.powf(-5.0 + 2.0 * random.unit());
                let away = (f64::from(k) - 5.5) * (3.0 + width / 6.0) * R;
                let position = point + away * along + (radius - overlap) * normal;
                overlaps.push(radius - (position - point).dot(normal));
                scene.grains.push(Grain { position, radius, ..grain(0.0, 0.0, 0.0) });
            }
            for bench in engines() {
                let mut simulation = bench.start(&scene);
                for ((force, _), overlap) in simulation.forces().unwrap().iter().zip(&overlaps) {
                    let expected = KN * overlap * normal;
                    let error = (*force - expected).length() / expected.length();
                    close(&format!("{} over {width} R", bench.name), error, 0.0, 1.0, 1e-5);
                }
            }
        }
    }
}

/// Two grains squeezed between planes, all carried along: overlaps stay what they are, 200 radii from where they began.
#[test]
fn carried_pair() {
    let (overlap, speed, steps) = (1e-4 * R, 100.0, 2_000);
    for dimension in [2, 3] {
        let along = DVec3::X;
        let mut scene = blank(dimension);
        scene.solver.dt = TimeStep::Fixed(0.1 * R / speed);
        scene.solver.margin = 0.5;
        scene.pairs = vec![Pair { dashpot: Dashpot::Restitution(0.5), ..law(0.5) }];
        scene.walls = [-1.0, 1.0].map(|side| plane(side * (2.0 * R - 1.5 * overlap) * along, -side * along)).to_vec();
        scene.grains = [-1.0, 1.0].map(|side| grain(side * (R - 0.5 * overlap), 0.0, 0.0)).to_vec();
        scene.walls.iter_mut().for_each(|wall| wall.velocity = speed * along);
        scene.grains.iter_mut().for_each(|grain| grain.velocity = speed * along);
        for bench in engines() {
            let mut simulation = bench.start(&scene);
            simulation.advance(steps).unwrap();
            let sample = simulation.sample().unwrap();
            assert_eq!(sample.contacts, 3, "{}", bench.name);
            close(bench.name, sample.max_overlap_over_radius * R, overlap, overlap, bench.pick(1e-8, 1e-4));
            let gone = steps as f64 * 0.1 * R;
            assert!(gone > 199.0 * R);
            let middle: f64 = simulation.grains().unwrap().iter().map(|g| 0.5 * g.position.x).sum();
            close(bench.name, middle, gone, gone, bench.pick(1e-9, 1e-6));
        }
    }
}

/// What flies so far that contacts would lose digits in single precision stops the run and says so.
#[test]
fn too_far() {
    let mut scene = blank(3);
    scene.solver.margin = 1.0;
    scene.solver.dt = TimeStep::Fixed(0.4 * R);
    scene.solver.allow_unstable = true; // nothing touches
    scene.grains = vec![grain(0.0, 0.0, 0.0), grain(9.0 * R, 0.0, 0.0)];
    scene.grains[1].velocity = DVec3::Y;
    for bench in engines() {
        let mut simulation = bench.start(&scene);
        if !bench.is_single() {
            assert!(simulation.advance(100).is_ok());
            continue;
        }
        let error = simulation.advance(60_000).expect_err("too far");
        let text = error.to_string();
        let Error::Run { step, .. } = error else { panic!("{text}") };
        assert!(text.contains("grain 1") && text.contains("single precision"), "{text}");
        let (far, before) = (step as f64 * 0.4, simulation.grains().unwrap()[1].position.y / R);
        assert!((16_000.0..17_000.0).contains(&far), "{far} R");
        close("path", before, (simulation.step() as f64) * 0.4, far, 1e-6);
    }
}
