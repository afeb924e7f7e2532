//! Single precision wherever f64 goes: any units, wide vessels, far from where a scene began.

use super::common::*;
use super::figure::{Figure, Length, worse};
use crate::scene::{Assembly, Dashpot, Grain, Method, Pair, Surface, TimeStep};
use glam::{DVec2, DVec3};

/// Forces of curved walls on grains that overlap with them by 1e-5 to 1e-3 of their radius, in vessels up to 10,000
/// radii wide, anywhere.
pub fn curved_walls(bench: Bench, _: Length) -> Vec<Figure> {
    let (mut random, mut worst) = (Random(11), 0.0);
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
            for ((force, _), (overlap, n)) in bench.start(&scene).forces().unwrap().iter().zip(&overlaps) {
                let expected = -KN * overlap * *n;
                worst = worse(worst, (*force - expected).length() / expected.length());
            }
        }
    }
    vec![Figure::zero("forces of cylinders 3 to 10,000 R wide, relative error", bench.pick(1e-6, 1e-5), worst)]
}

/// Forces of planes that are along no axis, on grains that overlap with them by 1e-5 to 1e-3 of their radius, up to
/// 16,000 radii from each other.
pub fn oblique_planes(bench: Bench, _: Length) -> Vec<Figure> {
    let (mut random, mut worst) = (Random(12), 0.0);
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
            for ((force, _), overlap) in bench.start(&scene).forces().unwrap().iter().zip(&overlaps) {
                let expected = KN * overlap * normal;
                worst = worse(worst, (*force - expected).length() / expected.length());
            }
        }
    }
    vec![Figure::zero("forces of oblique planes up to 16,000 R long, relative error", bench.pick(1e-7, 1e-5), worst)]
}

/// Two grains squeezed between planes, all carried along: overlaps stay what they are, 200 radii from where they began.
pub fn carried_pair(bench: Bench, _: Length) -> Vec<Figure> {
    let (overlap, speed, steps) = (1e-4 * R, 100.0, 2_000);
    let (mut contacts, mut overlaps, mut places) = (vec![], 0.0, 0.0);
    for dimension in [2, 3] {
        let along = DVec3::X;
        let mut scene = blank(dimension);
        scene.solver.dt = TimeStep::Fixed(0.1 * R / speed);
        scene.solver.margin = 0.5;
        scene.pairs = vec![Pair { dashpot: Dashpot::Restitution(0.5), ..law(0.5) }];
        scene.walls = [-1.0, 1.0].map(|side| plane(side * (2.0 * R - 1.5 * overlap) * along, -side * along)).to_vec();
        scene.grains = [-1.0, 1.0].map(|side| grain(side * (R - 0.5 * overlap), 0.0, 0.0)).to_vec();
        let mut simulation = bench.start(&carried(&scene, speed * along));
        simulation.advance(steps).unwrap();
        let sample = simulation.sample().unwrap();
        let gone = steps as f64 * 0.1 * R;
        let middle: f64 = simulation.grains().unwrap().iter().map(|g| 0.5 * g.position.x).sum();
        contacts.push(sample.contacts as f64);
        overlaps = worse(overlaps, (sample.max_overlap_over_radius * R / overlap - 1.0).abs());
        places = worse(places, (middle / gone - 1.0).abs());
    }
    vec![
        Figure::new("contacts", 6.0, 0.0, contacts.iter().sum()),
        Figure::zero("largest overlap after 200 R, relative error", bench.pick(1e-8, 1e-4), overlaps),
        Figure::zero("path, relative error", bench.pick(1e-9, 1e-6), places),
    ]
}

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
pub fn units(bench: Bench, _: Length) -> Vec<Figure> {
    let mut soft = blank(3);
    soft.gravity = -G * DVec3::Z;
    soft.pairs = vec![Pair { dashpot: Dashpot::Restitution(0.6), ..law(0.3) }];
    soft.walls = vec![floor(3)];
    soft.grains = cloud(3, 2, 0.4, 7);
    let mut hard = rigid(3, 1e-4, 0.3, 1e-5);
    (hard.gravity, hard.walls, hard.grains) = (soft.gravity, soft.walls.clone(), soft.grains.clone());
    let power = |exponent| 2.0_f64.powi(exponent);
    [(soft, 600), (hard, 30)]
        .into_iter()
        .map(|(scene, steps)| {
            let expected = bench.after(&scene, steps);
            let mut different = 0;
            for (length, mass, time) in [(-21, -70, -25), (20, 40, 12), (-40, -120, -30), (33, 99, 5)] {
                let (length, mass, time) = (power(length), power(mass), power(time));
                let found = bench.after(&in_units(scene.clone(), length, mass, time), steps);
                let back = |g: &Grain| [g.position / length, g.velocity * time / length, g.spin * time];
                let same = |(a, b): &(&Grain, &Grain)| back(a) == [b.position, b.velocity, b.spin];
                different += found.iter().zip(&expected).filter(|pair| !same(pair)).count();
            }
            let method = if scene.solver.method == Method::DiscreteElements { "springs" } else { "contact dynamics" };
            Figure::zero(format!("{method}: grains that differ in other units"), 0.0, different as f64)
        })
        .collect()
}
