//! Packings of any size: lattices of grains that touch, jittered, with random velocities; and one of grains that are
//! about to touch, above a floor.

use crate::scene::{Assembly, Clump, Grain, Member, Shape};
use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Overlap of neighbours, and largest displacement along an axis, over the diameter.
const OVERLAP: f64 = 0.005;
const JITTER: f64 = 0.01;
/// Largest velocity along an axis in units of radius × natural frequency of a contact: overlaps stay near half a
/// percent.
const SPEED: f64 = 0.005;

/// Radius of a boulder over that of the others, and how many of these a domain as wide as four boulders takes.
const BOULDER: f64 = 10.0;
const LEAST_AROUND_BOULDER: usize = 11_000;

/// Gap between the largest neighbours above a floor, over the diameter, and by how much radii differ.
const GAP: f64 = 0.02;
const SPREAD: f64 = 0.05;

/// Fill the periodic domain with about `count` copies of the scene's grain: body-centred in space (8 contacts, solid
/// fraction 0.69), triangular in the plane (6 contacts). The domain is made to fit; the same seed gives the same
/// grains.
pub fn fill(scene: &Assembly, count: usize) -> Assembly {
    let mut filled = scene.clone();
    let first = scene.grains[0];
    let spacing = 2.0 * first.radius * (1.0 - OVERLAP);
    let (places, upper) = if scene.dimension == 2 { triangular(count, spacing) } else { body_centred(count, spacing) };
    (0..scene.dimension).for_each(|axis| {
        filled.domain.lower[axis] = 0.0;
        filled.domain.upper[axis] = upper[axis];
    });
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut scatter = |most: f64| {
        let mut vector = DVec3::ZERO;
        (0..scene.dimension).for_each(|axis| vector[axis] = random.random_range(-most..most));
        vector
    };
    let mass = crate::measure::masses(scene)[0];
    let speed = SPEED * first.radius * (2.0 * scene.pairs[0].normal_stiffness / mass).sqrt();
    let inside = |x: DVec3| x.rem_euclid(upper.max(DVec3::splat(f64::MIN_POSITIVE)));
    let grain = |place: DVec3| Grain {
        position: inside(place + scatter(2.0 * first.radius * JITTER)),
        velocity: scatter(speed),
        ..first
    };
    filled.grains = places.into_iter().map(grain).collect();
    filled
}

/// [`fill`] with a sphere of ten times the radius in the middle instead of those that it would overlap by more than
/// jitter; at least as many as make the domain wide enough for it.
pub fn around_boulder(scene: &Assembly, count: usize) -> Assembly {
    let mut filled = fill(scene, count.max(LEAST_AROUND_BOULDER));
    let (center, small) = (0.5 * filled.domain.upper, scene.grains[0].radius);
    let boulder = Grain { position: center, radius: BOULDER * small, ..scene.grains[0] };
    let nearest = boulder.radius + small * (1.0 - 4.0 * JITTER);
    filled.grains.retain(|grain| (grain.position - center).length() > nearest);
    filled.grains.push(boulder);
    filled
}

/// Fill the periodic domain with clumps of three of the scene's grain in a row, about `count` members in all: the
/// body-centred lattice of [`fill`], cut up along its diagonals, so that a member has 6 2/3 contacts with other clumps.
pub fn rods(scene: &Assembly, count: usize) -> Assembly {
    let mut filled = scene.clone();
    let first = scene.grains[0];
    let spacing = 2.0 * first.radius * (1.0 - OVERLAP);
    // Diagonals hold two members per cell, and have to be cut up without a rest.
    let cells = ((count as f64 / 2.0).cbrt() / 3.0).round().max(2.0) as usize * 3;
    let (places, upper) = body_centred(2 * cells.pow(3), spacing);
    let shape = Shape::of_union(
        "rod",
        &[-1.0, 0.0, 1.0].map(|k| Member { arm: k * spacing * DVec3::X, radius: first.radius }),
        3,
    );
    (filled.domain.lower, filled.domain.upper) = (DVec3::ZERO, upper);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut scatter = |most: f64| DVec3::from_array(std::array::from_fn(|_| random.random_range(-most..most)));
    let mass = crate::measure::masses(scene)[0];
    let speed = SPEED * first.radius * (2.0 * scene.pairs[0].normal_stiffness / mass).sqrt();
    let inside = |x: DVec3| x.rem_euclid(upper);
    let along = DQuat::from_rotation_arc(DVec3::X, DVec3::ONE.normalize());
    let step = DVec3::splat(upper.x / (2 * cells) as f64);
    filled.grains.clear();
    // Places come in pairs, corner and centre of a cell; along its diagonal a member's number follows from any one
    // coordinate.
    for place in places {
        let number = (place.x / step.x).round() as usize;
        if number % 3 != 1 {
            continue;
        }
        let clump = Clump {
            shape: 0,
            first: filled.grains.len() as u32,
            position: inside(place + scatter(2.0 * first.radius * JITTER)),
            orientation: along,
            velocity: scatter(speed),
            spin: DVec3::ZERO,
            radius: shape.radius,
            material: first.material,
            fixed: false,
        };
        filled.grains.extend(clump.members(&shape).map(|g| Grain { position: inside(g.position), ..g }));
        filled.clumps.push(clump);
    }
    filled.shapes = vec![shape];
    filled
}

/// Put about `count` copies of the scene's grain above a floor at height 0, as high as wide: body-centred, jittered,
/// radii up to `SPREAD` smaller, none in touch. The sides of the domain are made to fit.
pub fn pile(scene: &Assembly, count: usize) -> Assembly {
    let mut piled = scene.clone();
    let first = scene.grains[0];
    let (places, upper) = body_centred(count, 2.0 * first.radius * (1.0 + GAP));
    for axis in [0, 1] {
        (piled.domain.lower[axis], piled.domain.upper[axis]) = (0.0, upper[axis]);
    }
    let mut random = ChaCha8Rng::seed_from_u64(1);
    // Two neighbours come closer by at most the diagonal of twice the jitter.
    let jitter = first.radius * GAP / 3.0_f64.sqrt();
    let mut grain = |place: DVec3| {
        let scatter = DVec3::from_array(std::array::from_fn(|_| random.random_range(-jitter..jitter)));
        let mut position = place + scatter + (1.0 + GAP) * first.radius * DVec3::Z;
        [0, 1].into_iter().for_each(|axis| position[axis] = position[axis].rem_euclid(upper[axis]));
        Grain { position, radius: first.radius * (1.0 - random.random_range(0.0..SPREAD)), ..first }
    };
    piled.grains = places.into_iter().map(&mut grain).collect();
    piled
}

fn body_centred(count: usize, spacing: f64) -> (Vec<DVec3>, DVec3) {
    let edge = 2.0 / 3.0_f64.sqrt() * spacing;
    let n = (count as f64 / 2.0).cbrt().round() as usize;
    let corner = move |k: usize| edge * DVec3::new((k % n) as f64, (k / n % n) as f64, (k / n / n) as f64);
    let pair = |x: DVec3| [x, x + DVec3::splat(0.5 * edge)];
    ((0..n * n * n).map(corner).flat_map(pair).collect(), DVec3::splat(edge * n as f64))
}

fn triangular(count: usize, spacing: f64) -> (Vec<DVec3>, DVec3) {
    let columns = (count as f64).sqrt().round() as usize;
    let rows = (count / columns).next_multiple_of(2);
    let height = 0.75_f64.sqrt() * spacing;
    let place = |k: usize| {
        let (column, row) = (k % columns, k / columns);
        DVec3::new(spacing * (column as f64 + 0.5 * (row % 2) as f64), height * row as f64, 0.0)
    };
    let upper = DVec3::new(spacing * columns as f64, height * rows as f64, 0.0);
    ((0..columns * rows).map(place).collect(), upper)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Domain;

    #[test]
    fn lattices_repeat() {
        for (lattice, contacts) in [(body_centred as fn(_, _) -> _, 8), (triangular, 6)] {
            let (places, upper) = lattice(250, 1.0);
            let periodic = upper.to_array().map(|length| length > 0.0);
            let domain = Domain { lower: DVec3::ZERO, upper, periodic, ..Domain::default() };
            let near = |a: DVec3, b: DVec3| (domain.nearest(a - b).length() - 1.0).abs() < 1e-9;
            assert!(places.iter().all(|a| places.iter().filter(|b| near(*a, **b)).count() == contacts));
        }
    }
}
