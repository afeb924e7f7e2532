//! Rigid clumps: rotation against closed forms and Jacobi's elliptic functions, impacts, and what may not change it.

mod common;

use common::*;
use glam::{DQuat, DVec3};
use packstone::scene::{Assembly, Clump, Domain, Scene, Shape, TimeStep};
use packstone::state::{array, present};
use std::{
    f64::consts::{PI, TAU},
    path::Path,
};

/// One member with moments of inertia as asked for: a top without a surface.
fn top(moments: DVec3) -> Shape {
    Shape { gyration: 0.4 * moments, name: "top".into(), ..Shape::sphere(3) }
}

/// A top that turns freely, at the origin.
fn free(moments: DVec3, spin: DVec3, dt: f64) -> Assembly {
    let mut scene = blank_dt(3, dt);
    set_clumps(&mut scene, vec![top(moments)], vec![Clump { spin, ..clump(0) }]);
    scene
}

/// The clumps after so many steps, velocities at the time of the positions.
fn after(bench: Bench, scene: &Assembly, steps: u64) -> Vec<Clump> {
    let mut simulation = bench.start(scene);
    simulation.advance(steps).unwrap_or_else(|e| panic!("{}: {e}", bench.name));
    let (rounds, capped) = simulation.rotation_rounds().unwrap().unwrap();
    assert_eq!(capped, 0, "{}: rounds were capped, {rounds}", bench.name);
    simulation.clumps().unwrap()
}

/// Spin along the principal axes.
fn own_spin(c: &Clump) -> DVec3 {
    c.orientation.inverse() * c.spin
}

/// sn, cn, dn of u for the parameter m, by the arithmetic-geometric mean (Abramowitz & Stegun 16.4).
fn jacobi(u: f64, m: f64) -> [f64; 3] {
    let (mut a, mut b, mut c) = (vec![1.0], (1.0 - m).sqrt(), vec![m.sqrt()]);
    while c.last().unwrap().abs() > 1e-16 {
        let last = *a.last().unwrap();
        c.push(0.5 * (last - b));
        a.push(0.5 * (last + b));
        b = (last * b).sqrt();
    }
    let n = a.len() - 1;
    let mut phi = 2f64.powi(n as i32) * a[n] * u;
    for k in (1..=n).rev() {
        phi = 0.5 * (phi + (c[k] / a[k] * phi.sin()).clamp(-1.0, 1.0).asin());
    }
    let (s, c) = phi.sin_cos();
    [s, c, (1.0 - m * s * s).sqrt()]
}

/// Quarter period K(m).
fn quarter(m: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - m).sqrt());
    for _ in 0..40 {
        (a, b) = (0.5 * (a + b), f64::sqrt(a * b));
    }
    0.5 * PI / a
}

/// ω(t) of a free body with J = (1, 2, 3) and ω(0) = (1, 0, 1): energy 2, |L|² = 10, so it turns about the axis of J3,
/// where cn(0) = dn(0) = 1 and sn(0) = 0 (Landau & Lifshitz, Mechanics, 37).
fn euler_top(t: f64) -> DVec3 {
    let (j1, j2, j3) = (1.0f64, 2.0, 3.0);
    let (energy2, l2) = (j1 + j3, j1 * j1 + j3 * j3);
    let rate = ((j3 - j2) * (l2 - energy2 * j1) / (j1 * j2 * j3)).sqrt();
    let m = (j2 - j1) * (energy2 * j3 - l2) / ((j3 - j2) * (l2 - energy2 * j1));
    let [sn, cn, dn] = jacobi(rate * t, m);
    let amplitude = |x: f64| x.sqrt();
    DVec3::new(
        amplitude((energy2 * j3 - l2) / (j1 * (j3 - j1))) * cn,
        amplitude((energy2 * j3 - l2) / (j2 * (j3 - j2))) * sn,
        amplitude((l2 - energy2 * j1) / (j3 * (j3 - j1))) * dn,
    )
}

#[test]
fn a_symmetric_top_precesses() {
    // About the axis of symmetry at (J3 - J1) / J1 ω3 in the body, at |L| / J1 in space; the angle stays. The step is
    // that of stiff contacts: a thousandth of what the spin alone would need.
    let moments = DVec3::new(1.0, 1.0, 2.0);
    let (spin, dt, steps) = (DVec3::new(0.5, 0.0, 3.0), 1e-3, 2000);
    for bench in engines() {
        let c = after(bench, &free(moments, spin, dt), steps)[0];
        let t = dt * steps as f64;
        let w = own_spin(&c);
        // Of the two solutions of a leapfrog the angle that it makes in a step is 2 asin(rate dt / 2), not rate dt.
        let angle = 3.0 * t;
        let expected = DVec3::new(0.5 * angle.cos(), 0.5 * angle.sin(), 3.0);
        let turn = w.truncate().angle_to(expected.truncate()).abs() / angle;
        println!("{}: ω = {w}, phase error over phase {turn:e}", bench.name);
        close(bench.name, turn, 0.0, 1.0, bench.pick(1e-6, 1e-5));
        close(bench.name, w.z, 3.0, 3.0, bench.pick(1e-12, 1e-6));
        // The axis goes around L at |L| / J1.
        let l = DVec3::new(0.5, 0.0, 6.0);
        let axis = |q: DQuat| q * DVec3::Z;
        let about = DQuat::from_axis_angle(l.normalize(), l.length() * t);
        let off = (axis(c.orientation) - about * DVec3::Z).length() / (l.length() * t);
        println!("{}: axis off by {off:e} of the angle", bench.name);
        close(bench.name, off, 0.0, 1.0, bench.pick(1e-6, 1e-5));
    }
}

#[test]
fn an_asymmetric_top_follows_elliptic_functions() {
    // The other solution of the same equations, from the reference in shared verification data: independent of the
    // formulas above.
    let reference = DVec3::new(0.78537467, -0.62704596, 0.93395456);
    let turned = [0.60756996, -0.36459619, 0.14783240, -0.68998112];
    let start = DVec3::new(1.0, 0.1, 1.0);
    let moments = DVec3::new(1.0, 2.0, 3.0);
    let mut errors = Vec::new();
    for k in 0..5 {
        let dt = 0.1 / f64::from(1 << k);
        let c = after(CPU, &free(moments, start, dt), 200 << k)[0];
        let q = DQuat::from_xyzw(turned[1], turned[2], turned[3], turned[0]);
        let other = c.orientation * c.orientation.dot(q).signum();
        let (error, turn) = ((own_spin(&c) - reference).length(), (other - q).length());
        println!("dt {dt}: error of ω {error:.2e}, of q {turn:.2e}");
        errors.push((error, turn));
    }
    for pair in errors.windows(2) {
        let order = |a: f64, b: f64| (a / b).log2();
        assert!(order(pair[0].0, pair[1].0) > 1.9 && order(pair[0].1, pair[1].1) > 1.9, "{errors:?}");
    }
    assert!(errors[4].0 < 6e-5, "{errors:?}");
}

#[test]
fn a_hundred_turns_drift_by_the_square_of_the_step() {
    let moments = DVec3::new(1.0, 2.0, 3.0);
    let start = DVec3::new(1.0, 0.0, 1.0);
    let (mut found, mut drifts) = (Vec::new(), Vec::new());
    for steps_per_turn in [100, 200, 400] {
        let dt = TAU / f64::from(steps_per_turn);
        let mut simulation = CPU.start(&free(moments, start, dt));
        let (mut worst, mut energy, mut momentum) = (0.0f64, 0.0f64, 0.0f64);
        for turn in 1..=100 {
            simulation.advance(steps_per_turn as u64).unwrap();
            let c = simulation.clumps().unwrap()[0];
            let w = own_spin(&c);
            let exact = euler_top(TAU * f64::from(turn));
            worst = worst.max((w - exact).length());
            energy = energy.max(((moments * w).dot(w) / 4.0 - 1.0).abs());
            momentum = momentum.max(((moments * w).length() / 10f64.sqrt() - 1.0).abs());
        }
        println!("{steps_per_turn} steps a turn: ω {worst:.2e}, energy {energy:.2e}, |L| {momentum:.2e}");
        found.push(worst);
        drifts.push((energy, momentum));
    }
    for k in 0..2 {
        assert!((found[k] / found[k + 1]).log2() > 1.9, "{found:?}");
        assert!((drifts[k].0 / drifts[k + 1].0).log2() > 1.9, "{drifts:?}");
        assert!((drifts[k].1 / drifts[k + 1].1).log2() > 1.9, "{drifts:?}");
    }
}

/// Dzhanibekov: spun about the middle axis, it turns over again and again.
#[test]
fn the_middle_axis_flips_with_the_period_of_elliptic_functions() {
    let moments = DVec3::new(1.0, 2.0, 3.0);
    let start = DVec3::new(0.01, 1.0, 0.01);
    let (energy2, l2) = ((moments * start).dot(start), (moments * start).length_squared());
    // Here energy and momentum say that L goes around the axis of J3 or of J1.
    let (a, c) = if l2 > energy2 * 2.0 { (1.0, 3.0) } else { (3.0, 1.0) };
    let rate = ((c - 2.0) * (l2 - energy2 * a) / (a * 2.0 * c)).sqrt();
    let m = (2.0 - a) * (energy2 * c - l2) / ((c - 2.0) * (l2 - energy2 * a));
    let half = 2.0 * quarter(m) / rate;
    for bench in [CPU] {
        let dt = 0.005;
        let mut simulation = bench.start(&free(moments, start, dt));
        let (mut last, mut crossings) = (1.0, Vec::new());
        for step in 1..(4.0 * half / dt) as u64 {
            simulation.advance(1).unwrap();
            let w = own_spin(&simulation.clumps().unwrap()[0]).y;
            if w * last < 0.0 {
                crossings.push(dt * (step as f64 - w / (w - last)));
            }
            last = w;
        }
        let found = crossings.windows(2).map(|c| c[1] - c[0]).sum::<f64>() / (crossings.len() - 1) as f64;
        println!("{}: flips every {found} s, exact {half} s, {} of them", bench.name, crossings.len());
        assert!(crossings.len() >= 3);
        close(bench.name, found, half, half, 1e-6);
    }
}

#[test]
fn fast_spin_takes_few_rounds_and_stays() {
    let moments = DVec3::new(1.0, 2.0, 3.0);
    for bench in engines() {
        for per_step in [0.01, 0.1, 0.5] {
            let spin = per_step * DVec3::new(0.6, 0.5, 0.62).normalize();
            let mut simulation = bench.start(&free(moments, spin, 1.0));
            simulation.advance(5_000).unwrap();
            let w = own_spin(&simulation.clumps().unwrap()[0]);
            let (rounds, capped) = simulation.rotation_rounds().unwrap().unwrap();
            let energy = (moments * w).dot(w) / (moments * spin).dot(spin);
            println!("{}: ωΔt = {per_step}: {rounds} rounds at most, energy {energy}", bench.name);
            assert_eq!(capped, 0, "{}", bench.name);
            assert!((energy - 1.0).abs() < 2e-3 * (per_step / 0.5).powi(2) + bench.pick(1e-4, 2e-4), "{energy}");
            let most = if bench.is_single() { 6 } else { 12 };
            assert!(rounds <= if per_step < 0.05 { 5 } else { most }, "{}: {rounds} rounds", bench.name);
        }
    }
}

#[test]
fn damped_spin_decays_as_the_scheme_says() {
    // About a principal axis nothing couples: ω_{n+1/2} = ω_{n-1/2} (1 - ξΔt/2) / (1 + ξΔt/2).
    let (xi, dt, steps) = (3.0, 1e-2, 200);
    for bench in engines() {
        let mut scene = free(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.0, 2.0), dt);
        scene.solver.damping = xi;
        let w = own_spin(&after(bench, &scene, steps)[0]).z;
        let factor = ((1.0 - 0.5 * xi * dt) / (1.0 + 0.5 * xi * dt)).powi(steps as i32);
        close(bench.name, w, 2.0 * factor, 2.0, bench.pick(1e-10, 2e-6));
        close("exponential", w, 2.0 * (-xi * dt * steps as f64).exp(), 2.0, 1e-3);
    }
}

/// A dimer falls on its side onto a floor, tilted: it touches with one member, whose impulse turns it.
#[test]
fn a_dimer_that_hits_the_floor_turns_as_it_must() {
    let tilt: f64 = 0.4;
    for bench in engines() {
        for dimension in [2, 3] {
            let shape = Shape::of_union("dimer", &members(&[-DVec3::X, DVec3::X]), dimension);
            let mut scene = blank_dt(dimension, 2e-7);
            let (up, about) = if dimension == 2 { (DVec3::Y, DVec3::Z) } else { (DVec3::Z, DVec3::NEG_Y) };
            scene.walls = vec![plane(DVec3::ZERO, up)];
            let (arm, radius) = (R * shape.members[1].arm.length(), R * shape.members[1].radius);
            // So slow that it does not turn while it touches.
            let speed = 5e-3;
            let height = radius + arm * tilt.sin() + 1e-8;
            let falling = Clump {
                position: height * up,
                velocity: -speed * up,
                orientation: DQuat::from_axis_angle(about, tilt),
                ..clump(0)
            };
            let j = shape.gyration.z.max(shape.gyration.y) * R * R; // over the mass
            set_clumps(&mut scene, vec![shape], vec![falling]);
            let mut simulation = bench.start(&scene);
            // Until the contact has come and gone.
            let (mut touched, mut steps) = (false, 0);
            loop {
                simulation.advance(50).unwrap();
                steps += 1;
                let contacts = simulation.sample().unwrap().contacts;
                if touched && contacts == 0 {
                    break;
                }
                touched |= contacts > 0;
                assert!(steps < 20_000, "no rebound");
            }
            let c = simulation.clumps().unwrap()[0];
            // An elastic impulse at the lever a = arm cos(tilt): p / m = 2 v / (1 + a² / (J/m)).
            let lever = arm * tilt.cos();
            let impulse = 2.0 * speed / (1.0 + lever * lever / j);
            let (v, w) = (c.velocity.dot(up), c.spin.dot(about));
            let turn = -impulse * lever / j;
            println!("{} {dimension}D: v {v}, ω {w}; expected {} {turn}", bench.name, impulse - speed);
            close(bench.name, v, impulse - speed, speed, 1e-3);
            close(bench.name, w, turn, speed / R, 1e-3);
        }
    }
}

fn boomerang() -> Shape {
    let centers = [DVec3::ZERO, DVec3::new(1.2, 0.3, 0.1), DVec3::new(-0.2, 1.4, -0.3)];
    Shape::of_union("boomerang", &members(&centers), 3)
}

/// Two clumps that meet off their centres, rough.
fn oblique() -> Assembly {
    let mut scene = blank_dt(3, 1e-6);
    scene.pairs = vec![law(0.5)];
    let one = Clump { position: DVec3::new(-1.7 * R, 0.2 * R, 0.0), velocity: DVec3::new(0.6, 0.0, 0.05), ..clump(0) };
    let two = Clump {
        position: DVec3::new(1.7 * R, -0.5 * R, 0.3 * R),
        velocity: DVec3::new(-0.5, 0.1, 0.0),
        spin: DVec3::new(20.0, -30.0, 10.0),
        orientation: DQuat::from_rotation_y(0.9),
        radius: 1.2 * R,
        ..clump(0)
    };
    set_clumps(&mut scene, vec![boomerang()], vec![one, two]);
    scene
}

#[test]
fn an_oblique_impact_keeps_momentum() {
    use packstone::measure::{angular_momentum_of_clumps as angular, momentum_of_clumps as linear};
    let scene = oblique();
    for bench in engines() {
        let mut simulation = bench.start(&scene);
        let (mut contacts, mut worst) = (0, [0.0f64; 2]);
        let (p, l) = (linear(&scene, &scene.clumps), angular(&scene, &scene.clumps).unwrap());
        let mass = packstone::measure::mass_of_clump(&scene, &scene.clumps[0]);
        for _ in 0..60 {
            simulation.advance(100).unwrap();
            contacts = contacts.max(simulation.sample().unwrap().contacts);
            let now = simulation.clumps().unwrap();
            worst[0] = worst[0].max((linear(&scene, &now) - p).length() / (mass * 0.3));
            worst[1] = worst[1].max((angular(&scene, &now).unwrap() - l).length() / (mass * 0.3 * R));
        }
        println!("{}: {contacts} contacts, linear {:.1e}, angular {:.1e}", bench.name, worst[0], worst[1]);
        assert!(contacts > 0);
        // Linear momentum is exact; angular momentum as well as the rotation is, of second order in the step.
        assert!(worst[0] < bench.pick(1e-13, 2e-6), "{worst:?}");
        assert!(worst[1] < bench.pick(2e-6, 2e-5), "{worst:?}");
    }
}

/// Velocities of members are those at which they move: over a step of a spinning clump, the way over the time.
#[test]
fn members_move_at_their_velocities() {
    let mut scene = blank_dt(3, 1e-5);
    let spinning = Clump { velocity: DVec3::new(0.1, -0.2, 0.05), spin: DVec3::new(300.0, -200.0, 400.0), ..clump(0) };
    set_clumps(&mut scene, vec![boomerang()], vec![spinning]);
    for bench in engines() {
        let mut simulation = bench.start(&scene);
        simulation.advance(10).unwrap();
        let arrays = [&array::POSITION, &array::POSITION_LOW, &array::VELOCITY, &array::SPIN];
        let arrays = present(simulation.model(), &arrays);
        let read = |simulation: &mut packstone::simulation::Simulation| {
            let s = simulation.read(&arrays).unwrap();
            let x = |i: usize| s.position[i].x + s.position_low.get(i).map_or(DVec3::ZERO, |r| r.x);
            (0..3).map(|i| (x(i), s.velocity[i].v)).collect::<Vec<_>>()
        };
        let before = read(&mut simulation);
        simulation.advance(1).unwrap();
        let after = read(&mut simulation);
        for ((x, _), (y, v)) in before.iter().zip(&after) {
            let error = ((*y - *x) / 1e-5 - *v).length() / v.length();
            println!("{}: velocity {v}, error {error:.1e}", bench.name);
            // What a straight line misses of an arc, (ωΔt)²/24, and in f32 the places' last bits.
            assert!(error < bench.pick(5e-6, 1e-4), "{}: {error:e}", bench.name);
        }
        // Where clumps are said to be, their members are, and with the velocities that a rigid body has there.
        let (c, grains) = (simulation.clumps().unwrap()[0], simulation.grains().unwrap());
        for (member, grain) in c.members(&scene.shapes[0]).zip(&grains) {
            assert!((member.position - grain.position).length() < bench.pick(1e-15, 1e-9), "{}", bench.name);
            assert!((member.velocity - grain.velocity).length() < bench.pick(1e-12, 1e-5), "{}", bench.name);
        }
    }
}

/// Verification R3: a block of four disks on a slope slides at g (sin θ - μ cos θ) and does not turn; on less of a
/// slope it stays.
#[test]
fn a_block_slides_or_stays() {
    let square = Shape::of_union(
        "square",
        &members(&[-1.0, 1.0].map(|x| [-1.0, 1.0].map(|y| DVec3::new(x, y, 0.0))).concat()),
        2,
    );
    let mu = 0.3;
    for (tangent, bench) in [(0.4, CPU), (0.2, CPU)] {
        let mut scene = blank_dt(2, 1e-6);
        scene.pairs = vec![law(mu)];
        scene.pairs[0].dashpot = packstone::scene::Dashpot::Restitution(0.3);
        let theta = f64::atan(tangent);
        scene.gravity = G * DVec3::new(theta.sin(), -theta.cos(), 0.0);
        scene.walls = vec![plane(DVec3::ZERO, DVec3::Y)];
        // Where its two feet carry it: the overlap that its weight makes.
        let r = R * square.members[0].radius;
        let height = r - R * square.members[0].arm.y;
        let weight = mass(2, R) * G * theta.cos();
        let block = Clump { position: (height - weight / 2.0 / KN) * DVec3::Y, ..clump(0) };
        set_clumps(&mut scene, vec![square.clone()], vec![block]);
        let mut simulation = bench.start(&scene);
        // Once it no longer rocks.
        simulation.advance(100_000).unwrap();
        let before = simulation.clumps().unwrap()[0];
        simulation.advance(50_000).unwrap();
        let c = simulation.clumps().unwrap()[0];
        let found = (c.velocity.x - before.velocity.x) / 0.05;
        let expected = (G * (theta.sin() - mu * theta.cos())).max(0.0);
        println!("{} tan {tangent}: a {found}, expected {expected}, ω {}", bench.name, c.spin.z);
        close(bench.name, found, expected, G, 1e-3);
        close(bench.name, c.spin.z * R, 0.0, c.velocity.x.abs().max(1e-3), 1e-3);
    }
}

/// Kinetic, potential and elastic energy lose what `dissipation` says, in a rough, damped collision of spinning clumps.
#[test]
fn energy_is_accounted_for() {
    let loss = |dt: f64| {
        let mut scene = oblique();
        scene.solver.dt = TimeStep::Fixed(dt);
        scene.solver.damping = 20.0;
        scene.gravity = DVec3::new(0.0, 0.0, -G);
        scene.pairs[0].dashpot = packstone::scene::Dashpot::Restitution(0.4);
        let mut simulation = CPU.start(&scene);
        let energy = |s: &packstone::measure::Sample| s.kinetic_energy + s.potential_energy + s.elastic_energy;
        let first = energy(&simulation.sample().unwrap());
        let (mut lost, mut contacts, mut last) = (0.0, 0, first);
        for _ in 0..(3e-3 / dt) as u64 {
            simulation.advance(1).unwrap();
            let sample = simulation.sample().unwrap();
            (lost, contacts, last) = (lost + dt * sample.dissipation, contacts.max(sample.contacts), energy(&sample));
        }
        assert!(contacts > 0);
        println!("dt {dt:e}: {:e} of {first:e} lost, balance {:.2e}", lost, (first - last) / lost - 1.0);
        (first - last) / lost - 1.0
    };
    let (coarse, fine) = (loss(1e-6), loss(2.5e-7));
    assert!(coarse.abs() < 5e-3 && fine.abs() < 2e-3, "{coarse:e} {fine:e}");
}

/// What a run writes at its end is what the next one can start from.
#[test]
fn clumps_go_on_from_a_table() {
    use packstone::{io::csv::write_clumps, scene::Scene};
    let head = "gravity = [0, 0, 0]\n[material.a]\ndensity = 2500\nnormal_stiffness = 1e4\n[stop]\nsteps = 1\n[[shape]]\n\
                name = \"boomerang\"\nmembers = [{ center = [0, 0, 0], radius = 1 }, { center = [1.2, 0.3, 0.1], radius = 1 }, \
                { center = [-0.2, 1.4, -0.3], radius = 1 }]\n";
    let folder = tempfile::tempdir().unwrap();
    let scene = |rest: &str| {
        Scene::parse(&format!("dimension = 3\n{head}{rest}"), "test", folder.path(), &[]).unwrap().assemble().unwrap()
    };
    let start = scene(
        "[[grain]]\nposition = [0, 0, 0]\nradius = 1e-3\nmaterial = \"a\"\nshape = \"boomerang\"\nspin = [300, -200, 100]\n\
         orientation = { euler = [0.3, 0.8, -0.4] }\n[[grain]]\nposition = [0.01, 0, 0]\nradius = 1e-3\nmaterial = \"a\"\n",
    );
    let mut simulation = CPU.start(&start);
    simulation.advance(1000).unwrap();
    let (clumps, grains) = (simulation.clumps().unwrap(), simulation.grains().unwrap());
    write_clumps(&folder.path().join("final.csv"), &clumps, &start.shapes, &start.materials).unwrap();
    let again = scene("[[population]]\nfile = \"final.csv\"\n");
    assert_eq!(again.grains.len(), grains.len());
    for (a, b) in again.grains.iter().zip(&grains) {
        assert!(
            (a.position - b.position).length() < 1e-15 && (a.velocity - b.velocity).length() < 1e-12,
            "{a:?} {b:?}"
        );
        assert!((a.spin - b.spin).length() < 1e-9 && a.radius == b.radius, "{a:?} {b:?}");
    }
}

/// Spheres among themselves, as grains and as clumps of one member.
#[test]
fn a_clump_of_one_member_is_a_sphere_bit_for_bit() {
    for dimension in [2, 3] {
        let mut scene = blank_dt(dimension, 2e-6);
        scene.pairs = vec![law(0.5)];
        scene.gravity = if dimension == 2 { -G * DVec3::Y } else { -G * DVec3::Z };
        scene.solver.damping = 2.0;
        scene.walls = vec![plane(DVec3::ZERO, if dimension == 2 { DVec3::Y } else { DVec3::Z })];
        let across = if dimension == 2 { 1 } else { 3 };
        for k in 0..4 * across * across {
            let (a, b, c) = (k % 4, k / 4 % across, k / 4 / across);
            let (x, y, z) =
                (1.95 * f64::from(a) + 0.1 * f64::from(b), 1.9 * f64::from(b) + 0.3 * f64::from(a), f64::from(c));
            let mut g = if dimension == 2 {
                grain(x * R, (1.0 + y) * R, 0.0)
            } else {
                grain(x * R, y * R, (0.97 + 1.97 * z) * R)
            };
            g.radius = R * (1.0 - 0.02 * f64::from(k % 3));
            g.spin = if dimension == 2 { 5.0 * DVec3::Z } else { DVec3::new(3.0, -2.0, f64::from(k % 5)) };
            g.velocity = if dimension == 2 { 0.02 * DVec3::X } else { DVec3::new(0.01, 0.02 * f64::from(k % 2), 0.0) };
            scene.grains.push(g);
        }
        let spheres = CPU.after(&scene, 2000);
        let clumps = scene.grains.iter().map(|g| Clump {
            position: g.position,
            velocity: g.velocity,
            spin: g.spin,
            radius: g.radius,
            ..clump(0)
        });
        let clumps = clumps.collect();
        set_clumps(&mut scene, vec![Shape::sphere(dimension)], clumps);
        let (mut simulation, mut contacts) = (CPU.start(&scene), 0);
        for _ in 0..20 {
            simulation.advance(100).unwrap();
            contacts = contacts.max(simulation.sample().unwrap().contacts);
        }
        assert_eq!(simulation.grains().unwrap(), spheres, "{dimension} dimensions");
        assert!(contacts > 1, "{contacts} contacts");
    }
}

/// Everything turned by the same angle goes the same way, turned.
#[test]
fn a_turned_scene_goes_the_same_way() {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 1.1);
    let scene = oblique();
    let mut turned = scene.clone();
    let clumps = scene.clumps.iter().map(|c| Clump {
        position: turn * c.position,
        velocity: turn * c.velocity,
        spin: turn * c.spin,
        orientation: turn * c.orientation,
        ..*c
    });
    let clumps = clumps.collect();
    set_clumps(&mut turned, scene.shapes.clone(), clumps);
    for bench in engines() {
        let (a, b) = (after(bench, &scene, 3000), after(bench, &turned, 3000));
        for (a, b) in a.iter().zip(&b) {
            let off = (turn * a.position - b.position).length() / R;
            let spin = (turn * a.spin - b.spin).length() / 100.0;
            println!("{}: {off:.1e} R, {spin:.1e}", bench.name);
            assert!(
                off < bench.pick(2e-11, 2e-5) && spin < bench.pick(1e-10, 1e-4),
                "{}: {off:e} {spin:e}",
                bench.name
            );
        }
    }
}

/// Clumps that stand out of a periodic domain meet their neighbours around the corner.
#[test]
fn clumps_go_around_periods() {
    let mut inside = oblique();
    inside.domain = Domain {
        lower: DVec3::splat(-8.0 * R),
        upper: DVec3::splat(8.0 * R),
        periodic: [true; 3],
        ..Domain::default()
    };
    let mut across = inside.clone();
    let shift = DVec3::new(8.0 * R, 7.5 * R, -8.0 * R);
    let wrap = |x: DVec3| x - 16.0 * R * (x / (16.0 * R) + 0.5).floor();
    let clumps = inside.clumps.iter().map(|c| Clump { position: wrap(c.position + shift), ..*c }).collect();
    set_clumps(&mut across, inside.shapes.clone(), clumps);
    across.grains.iter_mut().for_each(|g| g.position = wrap(g.position));
    for bench in engines() {
        let (a, b) = (after(bench, &inside, 3000), after(bench, &across, 3000));
        for (a, b) in a.iter().zip(&b) {
            let off = wrap(a.position + shift - b.position).length() / R;
            println!("{}: {off:.1e} R", bench.name);
            assert!(off < bench.pick(2e-11, 1e-5), "{}: {off:e}", bench.name);
        }
    }
}

/// In single precision a clump turns on however slowly it does.
#[test]
fn slow_turns_are_not_lost() {
    for bench in engines() {
        let mut scene = free(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.0, 1e-3), 1e-6);
        scene.solver.dt = TimeStep::Fixed(1e-6);
        // As well when it has turned for a while, and the residue is large.
        for before in [0.0, 3.1e-4] {
            scene.clumps[0].orientation = DQuat::from_rotation_z(before);
            let c = after(bench, &scene, 20_000)[0];
            let angle = 2.0 * c.orientation.z.atan2(c.orientation.w) - before;
            println!("{}: turned by {angle:e}", bench.name);
            close(bench.name, angle, 2e-5, 2e-5, bench.pick(1e-9, 0.03));
        }
    }
}

/// A rod that turns 160 times about its middle in a step, and one whose turn is a little more than a radian, cannot be
/// followed: the run stops at that step, names the clump, and keeps the state before.
#[test]
fn a_clump_that_turns_too_far_is_a_stop() {
    let scene = |spin: &str| {
        let text = format!(
            "dimension = 3\ngravity = [0, 0, 0]\nsolver.dt = 1e-6\nstop.steps = 1000\n[material.s]\ndensity = 2500\n\
             normal_stiffness = 1e4\n[[grain]]\nposition = [0, 0, 0.1]\nradius = 0.001\nmaterial = \"s\"\n\
             [[grain]]\nposition = [0, 0, 0]\nradius = 0.001\nmaterial = \"s\"\nshape = \"rod\"\nspin = {spin}\n"
        );
        Scene::parse(&text, "rod.toml", Path::new("."), &[]).unwrap().assemble().unwrap()
    };
    for bench in engines() {
        for spin in ["[1e3, 1e9, 3e3]", "[1.1e6, 0, 0]"] {
            let mut simulation = bench.start(&scene(spin));
            let error = simulation.advance(1000).expect_err("it turns too far").to_string();
            assert!(error.contains("step 1") && error.contains("clump 1 ") && error.contains("turns by"), "{error}");
            assert_eq!(simulation.step(), 0);
            let clumps = simulation.clumps().unwrap();
            let whole = |q: glam::DQuat| (q.length() - 1.0).abs() < 1e-6 && q.is_finite();
            assert!(clumps.iter().all(|c| whole(c.orientation) && c.spin.is_finite()), "{}: {clumps:?}", bench.name);
        }
        let mut simulation = bench.start(&scene("[0.9e6, 0, 0]"));
        simulation.advance(10).unwrap();
    }
}
