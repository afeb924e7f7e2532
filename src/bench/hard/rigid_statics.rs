//! Few rigid grains whose equilibrium is known, and springs beside them.

use super::common::*;
use super::figure::{Figure, Length, worse};
use super::scenes::{compliant, relaxation, scene, solved_to};
use crate::{
    measure::masses,
    scene::{Assembly, Grain, Surface},
    simulation::Simulation,
    solve::Solver,
    state::{INDEX, NONE, array},
};
use glam::DVec3;

/// Stiffness of a spring that this weight compresses by this part of R, N/m.
fn stiffness(scene: &Assembly, part: f64) -> f64 {
    weight(scene) / (part * R)
}

/// Of the last grain, N.
fn weight(scene: &Assembly) -> f64 {
    masses(scene)[scene.grains.len() - 1] * G
}

/// A step of 0.2 √(m/k_N), s, for such springs.
fn short_step(part: f64) -> f64 {
    0.2 * (part * R / G).sqrt()
}

/// Forces of walls on the only grain, N.
fn wall_forces(simulation: &mut Simulation) -> Vec<DVec3> {
    let dt = simulation.dt();
    let state = simulation.read(&[&array::LIST_START, &array::NEIGHBOUR, &array::IMPULSE]).unwrap();
    let slots = state.row(0).filter(|slot| state.neighbour[*slot] != NONE);
    let mut forces: Vec<(u32, DVec3)> =
        slots.map(|slot| (state.neighbour[slot] & INDEX, state.impulse[slot].0 / dt)).collect();
    forces.sort_by_key(|(wall, _)| *wall);
    forces.into_iter().map(|(_, force)| force).collect()
}

/// A disk in a wedge of 90°. By symmetry and the balance of moments both walls press with N and pull up with T, and
/// N + T = m g/√2. Nothing else is known: N₁ + N₂ is anything from √2 m g/(1 + μ) to √2 m g/(1 − μ). Springs know: as
/// the disk sinks they are pressed and sheared alike, so T/N = k_T/k_N.
pub fn rigid_wedge(bench: Bench, _: Length) -> Vec<Figure> {
    let tolerance = bench.pick(1e-9, 1e-5);
    let given = solved_to(scene("rigid_wedge"), tolerance);
    let (weight, mu, dt) = (weight(&given), given.pairs[0].friction, 1e-3);
    let solvers: &[Solver] =
        if bench.name == "cpu" { &Solver::ALL } else { &[Solver::Jacobi, Solver::JacobiAccelerated] };
    let (mut least, mut most, mut unbalanced, mut excess, mut fastest, mut residual) =
        (f64::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0);
    // At rest, turning either way, and coming from either side.
    let starts = [(0.0, 0.0), (5.0, 0.0), (-50.0, 0.0), (0.0, 0.02), (20.0, -0.05)];
    for (solver, (spin, aside)) in solvers.iter().flat_map(|solver| starts.map(|start| (solver, start))) {
        let mut scene = given.clone();
        (relaxation(&mut scene).solver, relaxation(&mut scene).max_iterations) = (*solver, 20_000);
        (scene.grains[0].spin, scene.grains[0].velocity) = (spin * DVec3::Z, aside * DVec3::X);
        let mut simulation = bench.start(&scene);
        simulation.advance(60).unwrap();
        residual = worse(residual, simulation.solver_statistics().unwrap().last_residual);
        let g = simulation.grains().unwrap()[0];
        fastest = worse(fastest, g.velocity.length().max(R * g.spin.length()) / (G * dt));
        let mut pressing = 0.0;
        for (force, wall) in wall_forces(&mut simulation).into_iter().zip(&scene.walls) {
            let Surface::Plane { normal, .. } = wall.surface else { unreachable!() };
            let (n, t) = (force.dot(normal), force - force.dot(normal) * normal);
            pressing += n / (2.0_f64.sqrt() * weight);
            unbalanced = worse(unbalanced, ((n + t.y * 2.0_f64.sqrt()) / (weight / 2.0_f64.sqrt()) - 1.0).abs());
            excess = worse(excess, (t.length() - mu * n) / weight);
        }
        (least, most) = (pressing.min(least), worse(most, pressing));
    }
    let (low, high) = (1.0 / (1.0 + mu), 1.0 / (1.0 - mu));
    // Contacts to ε; N + T by the velocity √2 of that, and the disk's inertia.
    let limit = 4.0 * tolerance;
    let range = |what: &str, found: f64| {
        Figure::new(format!("CD: (N₁ + N₂)/√2 m g, {what}"), 0.5 * (low + high), 0.5 * (high - low) + limit, found)
    };
    // Exact but for the order of overlap over R. f32 holds normals of 45° to 3e-8 only: 4e-8 R of 0.8e-4 R.
    let part = bench.pick(1e-6, 1e-4);
    let springs = compliant(&given, stiffness(&given, part), short_step(part), 4.0 * (G / (part * R)).sqrt());
    let g = bench.after(&springs, 2000)[0];
    let sunk = springs.walls.iter().map(|wall| R - wall.surface.distance(g.position));
    let pressing = sunk.sum::<f64>() * springs.pairs[0].normal_stiffness / (2.0_f64.sqrt() * weight);
    vec![
        Figure::zero("CD: N + T over m g/√2, worst error", limit, unbalanced),
        range("least", least),
        range("most", most),
        Figure::zero("CD: friction above μ N, over m g", limit, excess.max(0.0)),
        Figure::zero("CD: fastest over g Δt", limit, fastest),
        Figure::zero("CD: residual, worst", tolerance, residual),
        Figure::new("DEM: (N₁ + N₂)/√2 m g", 1.0 / (1.0 + 2.0 / 7.0), bench.pick(1e-6, 5e-4), pressing),
    ]
}

/// Critical friction of three equal disks that lean on each other: the outer ones stand on supports in the direction a₀
/// above the horizontal, the middle one on them in the direction a₁.
///
/// Half of the weight of the middle disk, and all that of an outer one, go down each side, together with a thrust H. In
/// the contact of the two the friction is T₁ = ½ m g cos a₁ − H sin a₁, in that of the support T₀ = 3/2 m g cos a₀ − H
/// sin a₀. An outer disk turns unless T₀ = −T₁, which gives H = m g (½ cos a₁ + 3/2 cos a₀)/(sin a₀ + sin a₁); and the
/// push between the disks, N₁ = H cos a₁ + ½ m g sin a₁, is the smaller one. So μ_c = |T₁|/N₁; on a floor with a₁ = 60°
/// that is tan 15°.
fn critical_friction(support: f64, middle: f64) -> f64 {
    let thrust = (0.5 * middle.cos() + 1.5 * support.cos()) / (support.sin() + middle.sin());
    let friction = 0.5 * middle.cos() - thrust * middle.sin();
    friction.abs() / (thrust * middle.cos() + 0.5 * middle.sin())
}

/// The nearest relative offsets from critical friction, of a ladder with the largest first, at which grains sink by
/// less than `still`, and by three times more.
fn nearest(ladder: &[f64], critical: f64, still: f64, sinks: &dyn Fn(f64) -> f64) -> (f64, f64) {
    let last = |fits: &dyn Fn(f64) -> bool| {
        ladder.iter().copied().take_while(|off| fits(*off)).last().unwrap_or(f64::INFINITY)
    };
    let holds = last(&|off| sinks(critical * (1.0 + off)) < still);
    (holds, last(&|off| sinks(critical * (1.0 - off)) > 3.0 * still))
}

/// Three disks over an opening, and three in a pyramid: how near to their critical friction they still hold and still
/// fail.
pub fn rigid_arch(bench: Bench, _: Length) -> Vec<Figure> {
    let arch = solved_to(scene("rigid_arch"), bench.pick(1e-9, 1e-5));
    let mut pyramid = arch.clone();
    pyramid.grains = vec![grain(-R, R, 0.0), grain(R, R, 0.0), grain(0.0, R + 3.0_f64.sqrt() * R, 0.0)];
    pyramid.walls = vec![plane(DVec3::ZERO, DVec3::Y)];
    let mut figures = Vec::new();
    for (what, given, keystone, support, middle) in
        [("arch", arch, 2, 75.0_f64, 30.0_f64), ("pyramid", pyramid, 2, 90.0, 60.0)]
    {
        let critical = critical_friction(support.to_radians(), middle.to_radians());
        // In so many steps, after others.
        let sunk = |scene: &Assembly, before: u64, steps: u64| {
            let mut simulation = bench.start(scene);
            let mut height = |steps: u64| {
                simulation.advance(steps).unwrap();
                simulation.grains().unwrap()[keystone].position.y
            };
            (height(before) - height(steps)) / R
        };
        let ladder: &[f64] = bench.pick(&[1e-2, 1e-3, 1e-4, 1e-5], &[1e-2, 1e-3, 3e-4]);
        let (holds, fails) = nearest(ladder, critical, bench.pick(1e-7, 1e-4), &|mu| {
            let mut scene = given.clone();
            scene.pairs[0].friction = mu;
            sunk(&scene, 0, 100)
        });
        let limit = bench.pick(1e-5, 3e-4);
        figures.push(Figure::zero(format!("CD: {what}, μ/μ_c − 1 at which it holds"), limit, holds));
        figures.push(Figure::zero(format!("CD: {what}, 1 − μ/μ_c at which it fails"), limit, fails));
        // Springs yield by a few overlaps, and forces by as much; this is counted from when they have come to rest.
        let part = 1e-5;
        let (holds, fails) = nearest(&[1e-2, 1e-3], critical, 1e-5, &|mu| {
            let mut scene = compliant(&given, stiffness(&given, part), short_step(part), 2000.0);
            scene.pairs[0].friction = mu;
            sunk(&scene, 5_000, 10_000)
        });
        figures.push(Figure::zero(format!("DEM: {what}, μ/μ_c − 1 at which it holds"), 1e-3, holds));
        figures.push(Figure::zero(format!("DEM: {what}, 1 − μ/μ_c at which it fails"), 1e-3, fails));
    }
    figures
}

/// A grain on an incline rolls without slip up to tan θ = c μ, and beyond slips with g cos θ (tan θ − c μ).
pub fn rigid_incline(bench: Bench, _: Length) -> Vec<Figure> {
    let given = solved_to(scene("rigid_incline"), bench.pick(1e-10, 1e-5));
    let mu = given.pairs[0].friction;
    let off = bench.pick(1e-6, 1e-4);
    let mut figures =
        vec![Figure::new("CD: δ", 1e-6, bench.pick(0.0, 1e-4), off), Figure::new("DEM: δ", 1e-3, 0.0, 1e-3)];
    for dimension in [2, 3] {
        let up = DVec3::AXES[dimension - 1];
        let c = 1.0 + 1.0 / gyration(dimension);
        let slip = |given: &Assembly, tan: f64, steps: u64| {
            let (mut scene, theta) = (given.clone(), tan.atan());
            scene.dimension = dimension;
            scene.walls = vec![plane(DVec3::ZERO, up)];
            // Springs start with the overlap that carries the grain.
            let stiffness = scene.pairs[0].normal_stiffness;
            let overlap = if stiffness > 0.0 { mass(dimension, R) * G * theta.cos() / stiffness } else { 0.0 };
            scene.grains[0].position = (R - overlap) * up;
            scene.gravity = G * (theta.sin() * DVec3::X - theta.cos() * up);
            let mut simulation = bench.start(&scene);
            let mut speed = |steps: u64| {
                simulation.advance(steps).unwrap();
                let g = simulation.grains().unwrap()[0];
                g.velocity.x + R * (g.spin.cross(-up)).x
            };
            // Springs that are not sheared yet begin with a slip.
            let change = -speed(steps) + speed(steps);
            change / (simulation.time() / 2.0 * G * theta.cos())
        };
        let mut both = |what: &str, given: &Assembly, off: f64, below: f64, steps: u64| {
            let figure = |sign: &str| format!("{what}, {dimension}D: slip at tan θ = c μ {sign} δ, over δ g t cos θ");
            figures.push(Figure::zero(figure("−"), below, slip(given, c * mu - off, steps) / off));
            figures.push(Figure::new(figure("+"), 1.0, 0.05, slip(given, c * mu + off, steps) / off));
        };
        both("CD", &given, off, 0.01, 25);
        // Springs swing about the shear they need by less the nearer the threshold is; their overlap changes c by
        // itself.
        let (part, off) = (bench.pick(1e-6, 1e-4), 1e-3);
        let mut springs = compliant(&given, 1.0, short_step(part), 0.0);
        springs.pairs[0].normal_stiffness = mass(dimension, R) * G / (part * R);
        springs.pairs[0].tangential_stiffness = 2.0 / 7.0 * springs.pairs[0].normal_stiffness;
        both("DEM", &springs, off, 0.02, 5_000);
    }
    figures
}

/// 400 grains side by side: nothing but weights, and nothing sideways.
pub fn rigid_layer(bench: Bench, _: Length) -> Vec<Figure> {
    let tolerance = bench.pick(1e-8, 1e-5);
    let given = solved_to(scene("rigid_layer"), tolerance);
    let (n, weight) = (given.grains.len() as f64, weight(&given));
    let uneven = |simulation: &mut Simulation| {
        let forces = simulation.forces().unwrap();
        forces.iter().map(|(force, _)| (*force - weight * DVec3::Z).length() / weight).fold(0.0, worse)
    };
    let spread = |grains: &[Grain]| {
        let heights = grains.iter().map(|g| g.position.z);
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
        (high - low) / R
    };
    // A residual of ε, if all of it were in one contact.
    let limit = n.sqrt() * tolerance;
    let mut simulation = bench.start(&given);
    simulation.advance(20).unwrap();
    let solved = *simulation.solver_statistics().unwrap();
    let mut figures = vec![
        Figure::new("grains", 400.0, 0.0, n),
        Figure::zero("CD: force of floor and neighbours, over m g, worst error", limit, uneven(&mut simulation)),
        Figure::zero("CD: steps not solved", 0.0, solved.unconverged as f64),
    ];
    let mut dropped = given.clone();
    dropped.grains.iter_mut().for_each(|g| g.position.z += 2.0 * R);
    let mut simulation = bench.start(&dropped);
    simulation.advance(40).unwrap();
    let grains = simulation.grains().unwrap();
    figures.push(Figure::zero(
        "CD: dropped by 2 R, heights differ by R times",
        bench.pick(1e-9, 1e-6),
        spread(&grains),
    ));
    let height = grains.iter().map(|g| g.position.z / R - 1.0).fold(0.0, |a, b| worse(a, b.abs()));
    // The band in which gaps are none.
    figures.push(Figure::zero("CD: dropped by 2 R, height over R", 1.01e-4, height));
    let part = 1e-4;
    let springs = compliant(&given, stiffness(&given, part), short_step(part), 2.0 * (G / (part * R)).sqrt());
    let mut simulation = bench.start(&springs);
    simulation.advance(200).unwrap();
    let limit = bench.pick(1e-8, 1e-5);
    figures.push(Figure::zero(
        "DEM: force of floor and neighbours, over m g, worst error",
        limit,
        uneven(&mut simulation),
    ));
    figures
}

/// A lid comes down on a grain: the residual tells it from the first step on, and the run ends with the grain named.
pub fn rigid_squeezed(bench: Bench, _: Length) -> Vec<Figure> {
    let given = scene("rigid_squeezed");
    let lid = given.walls[1].velocity.z.abs();
    let named = |simulation: &mut Simulation, steps: u64| {
        let message = simulation.advance(steps).err().map(|e| e.to_string()).unwrap_or_default();
        f64::from(u8::from(message.contains("grain 0") && message.contains("beyond the wall")))
    };
    let mut simulation = bench.start(&given);
    simulation.advance(10).unwrap();
    let solved = *simulation.solver_statistics().unwrap();
    let g = simulation.grains().unwrap()[0];
    let missed = 0.5 * (lid / (G * 1e-3) + 0.2);
    let mut figures = vec![
        Figure::new("CD: of 10 steps, told to be unsolved", 10.0, 0.0, solved.unconverged as f64),
        // Each contact misses half of v and of what would open both overlaps, 0.1 g Δt each; at the floor in parts of
        // g Δt, and of a little of its load, which grows from pass to pass.
        Figure::new("CD: residual of the floor", 0.5 * missed, 0.49 * missed, solved.last_residual),
        Figure::new("CD: grain's speed over the lid's", 0.5, 1e-3, -g.velocity.z / lid),
    ];
    figures.push(Figure::new("CD: ends, and names the grain", 1.0, 0.0, named(&mut simulation, 100)));
    let time = simulation.time();
    // To a step.
    figures.push(Figure::new("CD: the time of that over 2 R/v", 1.0, 0.026, time * lid / (2.0 * R)));
    let part = 1e-2;
    let springs = compliant(&given, stiffness(&given, part), short_step(part), 0.0);
    let mut simulation = bench.start(&springs);
    let steps = (2.0 * R / lid / simulation.dt()) as u64;
    figures.push(Figure::new("DEM: ends, and names the grain", 1.0, 0.0, named(&mut simulation, steps)));
    figures
}
