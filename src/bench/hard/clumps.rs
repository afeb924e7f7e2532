//! Clumps: a body that turns for very long, and packings of grains that are no spheres.

use super::common::*;
use super::figure::{Figure, Length, worse};
use super::scenes::changed_scene;
use crate::{
    measure::packing_fraction,
    scene::{Assembly, Clump, Shape},
    state::{array, present},
};
use glam::{DVec3, DVec4};

/// Of unlike sizes, so that a body about none of its axes tumbles.
const MOMENTS: DVec3 = DVec3::new(1.0, 2.0, 3.0);

/// Free bodies with these moments of inertia and a spin of 1 rad/s, far from each other.
pub fn turning_bodies(count: u32) -> Assembly {
    let mut scene = blank(3);
    let body = Shape { gyration: 0.4 * MOMENTS, name: "body".into(), ..Shape::sphere(3) };
    let spin = DVec3::new(0.6, 0.5, 0.62);
    let of = |k: u32| Clump { position: 9.0 * R * f64::from(k) * DVec3::X, spin, ..clump(0) };
    set_clumps(&mut scene, vec![body], (0..count).map(of).collect());
    scene
}

/// A free body with J = (1, 2, 3), ω Δt = 1e-3, 10^7 steps: the quaternion stays one, energy and angular momentum stay
/// where they are but for what the scheme lets them oscillate by.
pub fn free_body(bench: Bench, length: Length) -> Vec<Figure> {
    let scene = Assembly { solver: blank_dt(3, 1e-3).solver, ..turning_bodies(1) };
    let mut simulation = bench.start(&scene);
    let steps = if length == Length::Full { 10_000_000 } else { 100_000 };
    // Kinetic energy and angular momentum along the axes of the scene, over those of unit moments.
    let state = |c: &Clump| {
        let w = c.orientation.inverse() * c.spin;
        ((MOMENTS * w).dot(w), c.orientation * (MOMENTS * w))
    };
    let (energy, momentum) = state(&simulation.clumps().unwrap()[0]);
    let (mut norm, mut energies, mut lengths, mut directions) = (0.0, 0.0, 0.0, 0.0);
    for _ in 0..10 {
        simulation.advance(steps / 10).unwrap();
        let (e, l) = state(&simulation.clumps().unwrap()[0]);
        let kept = present(simulation.model(), &[&array::ORIENTATION, &array::ORIENTATION_LOW]);
        let s = simulation.read(&kept).unwrap();
        let attitude = s.orientation[0].0 + s.orientation_low.first().map_or(DVec4::ZERO, |low| low.0);
        norm = worse(norm, attitude.length() - 1.0);
        energies = worse(energies, e / energy - 1.0);
        lengths = worse(lengths, l.length() / momentum.length() - 1.0);
        directions = worse(directions, l.angle_between(momentum));
    }
    let (rounds, capped) = simulation.rotation_rounds().unwrap().unwrap();
    // f32: velocities walk at random by roundings of 6e-8, 2e-4 in 10^7 steps.
    let walk = 2.0 * 6e-8 * (steps as f64).sqrt();
    vec![
        Figure::zero("length of q less 1", bench.pick(1e-14, 1e-9), norm),
        Figure::zero("energy", bench.pick(1e-6, walk), energies),
        Figure::zero("length of the angular momentum", bench.pick(1e-6, walk), lengths),
        Figure::zero("its direction, rad", bench.pick(1e-6, walk), directions),
        Figure::zero("steps whose rounds were capped", 0.0, f64::from(capped)),
        Figure::new("rounds at most", 2.0, 1.0, f64::from(rounds)),
    ]
}

/// Smooth dimers and smooth spheres, poured and at rest, between periodic sides.
pub fn dimer_bed(bench: Bench, length: Length) -> Vec<Figure> {
    let fraction = |shape: &str| {
        let mut set = vec![format!("population.0.shape=\"{shape}\"")];
        if length == Length::Short {
            set.extend(["population.0.count=400".to_owned(), "domain.upper=[0.014, 0.014, 1]".to_owned()]);
        }
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        let scene = changed_scene("dimer_bed", &set);
        let mut simulation = bench.start(&scene);
        let steps = (scene.stop.time.unwrap() / simulation.dt()) as u64;
        for _ in 0..50 {
            simulation.advance(steps / 50).unwrap();
            if simulation.sample().unwrap().at_rest(1e-3) {
                break;
            }
        }
        let (sample, grains) = (simulation.sample().unwrap(), simulation.grains().unwrap());
        let walls = simulation.walls().unwrap();
        assert!(sample.max_overlap_over_radius < 0.02, "{sample:?}");
        (packing_fraction(&scene, &grains, &walls).unwrap().value, sample.unbalanced_force_ratio)
    };
    let (dimers, unbalanced) = fraction("dimer14");
    let (spheres, _) = fraction("sphere");
    vec![
        Figure::new("dimers, aspect ratio 1.4: packing fraction", 0.70, 0.015, dimers),
        Figure::new("spheres: packing fraction", 0.64, 0.015, spheres),
        // A smooth packing comes to rest slowly; its density no longer changes.
        Figure::zero("dimers: unbalanced force ratio", 0.15, unbalanced),
    ]
}
