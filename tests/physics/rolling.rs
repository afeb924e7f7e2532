//! Rolling resistance: an elastic-plastic spring with history, capped at μ_r R* F_n.

use crate::{common::*, shared::frames};
use glam::DVec3;
use packstone::scene::{Assembly, Dashpot, Grain, Hertz, Pair, Rolling, Shape, TimeStep};
use std::f64::consts::PI;

/// A law so stiff that the weight makes an overlap of 1e-4 R, with this rolling resistance; a dashpot, so that the load
/// does not swing.
fn resisting(dimension: usize, rolling: Rolling) -> Pair {
    Pair { rolling: Some(rolling), dashpot: Dashpot::Restitution(0.1), ..bed_law(dimension, 1.0) }
}

/// A grain at rest on a floor, which its weight has already pressed in.
fn resting(dimension: usize, rolling: Rolling) -> Assembly {
    let mut scene = blank_dt(dimension, 0.1 * (1e-4 * R / G).sqrt());
    scene.gravity = -G * up(dimension);
    scene.pairs = vec![resisting(dimension, rolling)];
    scene.walls = vec![floor(dimension)];
    scene.solver.allow_unstable = true; // the bound counts neighbours that never meet
    scene.grains = vec![Grain { position: (1.0 - 1e-4) * R * up(dimension), ..grain(0.0, 0.0, 0.0) }];
    scene
}

/// Δt, s.
fn step(scene: &Assembly) -> f64 {
    match scene.solver.dt {
        TimeStep::Fixed(dt) => dt,
        TimeStep::Auto { .. } => unreachable!("scenes here have one"),
    }
}

/// Whatever turns is about y in space, about z in the plane, where x is along the floor.
fn about(dimension: usize) -> DVec3 {
    if dimension == 2 { DVec3::NEG_Z } else { DVec3::Y }
}

/// On an incline below tan α = μ_r a grain comes to rest, above it rolls with 1/(1 + J/mR²) of what gravity has left.
/// The threshold to 1e-3 takes long to tell, so that is for the cpu engine alone.
#[test]
fn incline() {
    let mu = 0.1;
    for bench in engines() {
        for (dimension, frame) in [2, 3].into_iter().flat_map(|d| frames(d).map(|frame| (d, frame))) {
            // Places along the incline, at four times `interval` apart, after it has begun to roll or has come to rest.
            let places = |excess: f64, begin: f64, interval: f64| {
                let mut scene = resting(dimension, Rolling { friction: mu, stiffness: 0.05, damping: 0.3 });
                let slope = f64::atan(mu * (1.0 + excess));
                scene.gravity = G * (slope.sin() * DVec3::X - slope.cos() * up(dimension));
                let steps = |time: f64| (time / step(&scene)).round() as u64;
                let mut simulation = frame.start(&bench, &scene);
                simulation.advance(steps(begin));
                [0, 1, 2].map(|k| {
                    simulation.advance(if k == 0 { 0 } else { steps(interval) });
                    simulation.grains()[0].position.x
                })
            };
            let what = format!("{} {dimension}D {frame:?}", bench.name);
            let check = |excess: f64, begin: f64, interval: f64, tolerance: f64| {
                let [a, b, c] = places(excess, begin, interval);
                let slope = f64::atan(mu * (1.0 + excess));
                let expected = G * (slope.sin() - mu * slope.cos()) / (1.0 + gyration(dimension));
                if excess < 0.0 {
                    // The tangential spring, which nothing damps, goes on swinging.
                    assert!(
                        (c - b).abs().max((b - a).abs()) < 1e-4 * R,
                        "{what}: rolls below the threshold, {a} {b} {c}"
                    );
                } else {
                    let found = (c - 2.0 * b + a) / (interval * interval);
                    close(&format!("{what}: acceleration {excess} above"), found, expected, expected, tolerance);
                }
            };
            check(-0.5, 0.05, 0.02, 0.0);
            check(0.5, 0.02, 0.05, bench.pick(2e-3, 4e-3));
            if bench.name == "cpu" {
                check(-1e-3, 0.8, 0.1, 0.0);
                // The overlap takes 5e-5 off the arm of the weight, a twentieth of what is left.
                check(1e-3, 0.1, 0.3, 0.1);
            }
        }
    }
}

/// Below the limit a grain swings on its rolling spring: period 2π √(J_c/k_r) about the contact point, J_c = J + m R²,
/// and the decay of the damping ratio. The tangential spring is in series and lengthens the period by k_r/(R² k_T) / 2
/// of it.
#[test]
fn oscillation() {
    for bench in engines() {
        for (dimension, clump_of_one) in [(2, false), (3, false), (3, true)] {
            let (stiffness, damping) = (2e-3, 0.05);
            let mut scene = resting(dimension, Rolling { friction: 10.0, stiffness, damping });
            let kn = scene.pairs[0].normal_stiffness;
            let m = mass(dimension, R);
            let own = (stiffness * kn / (m * (1.0 + gyration(dimension)))).sqrt();
            let series = 1.0 + 0.5 * 3.5 * stiffness / (1.0 + gyration(dimension));
            let period = 2.0 * PI / own * series / (1.0 - damping * damping).sqrt();
            let spin = 1e-4 * own * about(dimension);
            scene.grains[0].spin = spin;
            scene.grains[0].velocity = spin.cross(R * up(dimension));
            if clump_of_one {
                let clump = packstone::scene::Clump {
                    position: scene.grains[0].position,
                    velocity: scene.grains[0].velocity,
                    spin,
                    ..clump(0)
                };
                set_clumps(&mut scene, vec![Shape::sphere(dimension)], vec![clump]);
            }
            let dt = step(&scene);
            let mut simulation = bench.start(&scene);
            let (mut crossings, mut last, mut peaks) = (vec![], spin.dot(about(dimension)), vec![0.0_f64; 4]);
            for n in 1..(3.2 * period / dt) as usize {
                simulation.advance(1).unwrap();
                let now = simulation.grains().unwrap()[0].spin.dot(about(dimension));
                if (last > 0.0) != (now > 0.0) {
                    crossings.push((n as f64 - now / (now - last)) * dt);
                }
                let cycle = (n as f64 * dt / period) as usize;
                peaks[cycle] = peaks[cycle].max(-now);
                last = now;
            }
            let what = format!("{} {dimension}D clump {clump_of_one}", bench.name);
            close(
                &format!("{what}: period"),
                crossings[4] - crossings[0],
                2.0 * period,
                2.0 * period,
                bench.pick(4e-3, 6e-3),
            );
            let decay = (-2.0 * PI * damping / (1.0 - damping * damping).sqrt()).exp();
            close(&format!("{what}: decay"), peaks[1] / peaks[0], decay, 1.0, bench.pick(5e-3, 1e-2));
        }
    }
}

/// A pair that rolls on each other through the seam of a periodic cell does what it does elsewhere.
#[test]
fn seam() {
    for bench in engines() {
        let run = |shift: f64, rolling: Option<Rolling>| {
            let mut scene = blank_dt(3, 2e-6);
            scene.domain.lower = DVec3::ZERO;
            scene.domain.upper = DVec3::splat(0.02);
            scene.domain.periodic = [true; 3];
            scene.pairs = vec![Pair { rolling, ..law(0.5) }];
            let wrap = |x: f64| x.rem_euclid(0.02);
            for side in [-1.0, 1.0] {
                let mut g = grain(wrap(0.01 + shift + side * 0.99 * R), 0.01, 0.01);
                g.spin = DVec3::new(0.0, 30.0 * side, 40.0);
                scene.grains.push(g);
            }
            bench.after(&scene, 300)
        };
        let resistance = Some(Rolling { friction: 0.3, stiffness: 0.2, damping: 0.1 });
        let (middle, seam, free) = (run(0.0, resistance), run(0.01, resistance), run(0.0, None));
        for (a, b) in middle.iter().zip(&seam) {
            let scale = 50.0;
            assert!(
                (a.spin - b.spin).length() < bench.pick(1e-10, 3e-4) * scale,
                "{}: {} {}",
                bench.name,
                a.spin,
                b.spin
            );
            assert!(a.spin.length() > 1.0 && (a.spin - b.spin).is_finite());
        }
        // What differs from free rolling is equal and opposite.
        let couples = [0, 1].map(|i| middle[i].spin - free[i].spin);
        assert!(couples[0].length() > 1e-2 * free[0].spin.length(), "{}: {}", bench.name, couples[0]);
        assert!((couples[0] + couples[1]).length() < 1e-3 * couples[0].length(), "{couples:?}");
    }
}

/// Rolling torques go with their contacts when lists are made anew and grains are sorted: the same bits however long
/// lists live.
#[test]
fn history_goes_with_the_contacts() {
    for bench in engines() {
        let mut scene = blank_dt(3, 5e-6);
        scene.gravity = DVec3::new(0.4, 0.0, -9.81);
        scene.pairs = vec![Pair { rolling: Some(Rolling { friction: 0.2, stiffness: 0.1, damping: 0.1 }), ..law(0.5) }];
        scene.walls = vec![floor(3)];
        scene.domain.upper.x = 12.0 * R;
        scene.domain.lower.x = 0.0;
        scene.domain.periodic[0] = true;
        for k in 0..48 {
            let (x, y, z) = (k % 6, (k / 6) % 4, k / 24);
            let mut g = grain(2.0 * R * x as f64 + 0.3 * R, 1.99 * R * y as f64, R * (0.99 + 1.98 * z as f64));
            g.velocity = DVec3::new(0.05 * (k % 3) as f64, 0.02 * (k % 5) as f64, 0.0);
            g.spin = DVec3::new((k % 7) as f64, -(k as f64), (k % 4) as f64);
            scene.grains.push(g);
        }
        let run = |longest_chunk: u32| {
            let options = packstone::simulation::Options { longest_chunk, ..bench.options() };
            let mut simulation = bench.start_with(&scene, options);
            simulation.advance(400).unwrap();
            assert_eq!(simulation.lost_contacts(), 0);
            simulation.grains().unwrap()
        };
        let (short, long) = (run(3), run(200));
        for (a, b) in short.iter().zip(&long) {
            assert_eq!((a.position, a.velocity, a.spin), (b.position, b.velocity, b.spin), "{}", bench.name);
        }
    }
}

/// What is lost is told: energy and what rolling and its dashpot have dissipated add up to what there was.
#[test]
fn dissipation_adds_up() {
    for (damping, steps) in [(0.0, 20_000), (0.1, 20_000), (0.5, 20_000)] {
        balance(damping, steps);
    }
}

fn balance(damping: f64, steps: u32) {
    let mut scene = resting(3, Rolling { friction: 0.05, stiffness: 0.05, damping });
    scene.grains[0].velocity.x = 0.02;
    scene.grains[0].spin.y = 0.02 / R;
    let dt = step(&scene);
    let mut simulation = CPU.start(&scene);
    let energy = |s: &packstone::measure::Sample| s.kinetic_energy + s.potential_energy + s.elastic_energy;
    let first = simulation.sample().unwrap();
    let (mut lost, mut before) = (0.0, first.dissipation);
    for _ in 0..steps {
        simulation.advance(1).unwrap();
        let s = simulation.sample().unwrap();
        lost += 0.5 * (before + s.dissipation) * dt;
        before = s.dissipation;
    }
    let last = simulation.sample().unwrap();
    let kinetic = first.kinetic_energy;
    assert!(last.kinetic_energy < 1e-3 * kinetic, "it comes to rest");
    close(&format!("balance {damping}"), energy(&last) + lost, energy(&first), kinetic, 1e-3);
}

/// Two spheres of radii 1 and 2 without friction, of different spins, while they push each other apart: what they turn
/// towards each other swings with ω² = k_r (1/J_1 + 1/J_2), k_r = β k_n R*².
#[test]
fn unequal_spheres() {
    for bench in engines() {
        let stiffness = 3.0;
        let mut scene = blank_dt(3, 1e-7);
        scene.pairs = vec![Pair { rolling: Some(Rolling { friction: 1e6, stiffness, damping: 0.0 }), ..law(0.0) }];
        let spin = 1.0;
        scene.grains = vec![
            Grain { spin: spin * DVec3::Y, ..grain(0.0, 0.0, 0.0) },
            Grain { radius: 2.0 * R, ..grain(2.99 * R, 0.0, 0.0) },
        ];
        let [j1, j2] = [R, 2.0 * R].map(|r| gyration(3) * mass(3, r) * r * r);
        let reduced = R * 2.0 * R / (3.0 * R);
        let k = stiffness * scene.pairs[0].normal_stiffness * reduced * reduced;
        let omega = (k * (1.0 / j1 + 1.0 / j2)).sqrt();
        let m = 1.0 / (1.0 / mass(3, R) + 1.0 / mass(3, 2.0 * R));
        let part = PI / 2.0 * (m / scene.pairs[0].normal_stiffness).sqrt();
        let steps = (0.8 * part / 1e-7) as u64;
        let grains = bench.after(&scene, steps);
        // Spins are known at half steps.
        let turned = spin * (1.0 - (omega * (steps as f64 - 0.5) * 1e-7).cos()) / (omega * omega);
        let what = bench.name;
        assert!(omega * steps as f64 * 1e-7 > 1.0);
        close(
            &format!("{what}: the small one"),
            grains[0].spin.y,
            spin - k / j1 * turned,
            spin,
            bench.pick(3e-3, 3e-3),
        );
        close(&format!("{what}: the large one"), grains[1].spin.y, k / j2 * turned, spin, bench.pick(3e-3, 3e-3));
    }
}

/// Couple and dashpot together stay within μ_r R* F_n: in an impact spin changes by no more than μ_r R (1 + e) m v / J.
#[test]
fn the_limit_holds_with_a_dashpot() {
    for bench in engines() {
        for damping in [0.3, 1.0, 30.0] {
            let (mu, v, dt) = (0.01, 0.1, 2e-7);
            let mut scene = resting(3, Rolling { friction: mu, stiffness: 1.0, damping });
            scene.solver.dt = TimeStep::Fixed(dt);
            scene.gravity = DVec3::ZERO;
            scene.pairs[0] = Pair { friction: 0.0, dashpot: Dashpot::None, ..scene.pairs[0] };
            scene.grains[0].position.z = R + 2.5 * v * dt;
            scene.grains[0].velocity = -v * DVec3::Z;
            scene.grains[0].spin.y = 200.0;
            let duration = PI * (mass(3, R) / scene.pairs[0].normal_stiffness).sqrt();
            let g = bench.after(&scene, (1.2 * duration / dt) as u64)[0];
            assert!(g.velocity.z > 0.99 * v, "it has left the floor: {}", g.velocity);
            let most = mu * 2.0 * v / (gyration(3) * R);
            close(&format!("{} {damping}", bench.name), 200.0 - g.spin.y, most, most, 1e-2);
        }
    }
}

/// A sphere that swings on its overlap at twice its rolling frequency would be pumped up by a spring that keeps its
/// torque while it softens: k_r/J is β/0.4 of k_n/m, so β = 0.1.
#[test]
fn no_swing_pumps_rolling() {
    for bench in engines() {
        let hertz = Hertz::of_material(1e7, 0.3);
        let (m, spin) = (mass(3, R), 0.01);
        let rest = (3.0 * m * G / (4.0 * hertz.youngs_modulus * R.sqrt())).powf(2.0 / 3.0);
        let omega = (2.0 * hertz.youngs_modulus * (R * rest).sqrt() / m).sqrt();
        let dt = 0.03 / omega;
        let mut scene = blank_dt(3, dt);
        scene.gravity = -G * DVec3::Z;
        scene.walls = vec![floor(3)];
        scene.solver.allow_unstable = true;
        scene.pairs = vec![Pair {
            hertz: Some(hertz),
            rolling: Some(Rolling { friction: 10.0, stiffness: 0.1, damping: 0.0 }),
            ..Pair::default()
        }];
        scene.grains = vec![Grain { spin: spin * DVec3::Y, ..grain(0.0, 0.0, R - 0.5 * rest) }];
        let mut simulation = bench.start(&scene);
        let mut highest = 0.0_f64;
        for _ in 0..1000 {
            simulation.advance(17).unwrap();
            highest = highest.max(simulation.grains().unwrap()[0].spin.length());
        }
        assert!(highest < 1.05 * spin, "{}: spin grows to {highest}", bench.name);
    }
}

/// With elastic spheres the rolling stiffness follows the overlap: energies and what is told to be lost add up while a
/// sphere bounces, and its spin does not grow.
#[test]
fn elastic_spheres_tell_their_losses() {
    for bench in engines() {
        for stiffness in [0.05, 0.1, 0.2, 1.6] {
            let mut scene = blank_dt(3, 1e-6);
            scene.gravity = -G * DVec3::Z;
            scene.walls = vec![floor(3)];
            scene.solver.allow_unstable = true;
            scene.pairs = vec![Pair {
                normal_stiffness: 0.0,
                tangential_stiffness: 0.0,
                hertz: Some(Hertz::of_material(1e6, 0.3)),
                rolling: Some(Rolling { friction: 10.0, stiffness, damping: 0.0 }),
                ..law(0.0)
            }];
            scene.grains = vec![Grain { spin: 5.0 * DVec3::Y, ..grain(0.0, 0.0, 0.9985 * R) }];
            let mut simulation = bench.start(&scene);
            let energy = |s: &packstone::measure::Sample| s.kinetic_energy + s.potential_energy + s.elastic_energy;
            let turning = 0.5 * gyration(3) * mass(3, R) * (5.0 * R).powi(2);
            let first = simulation.sample().unwrap();
            let (mut lost, mut before, mut highest) = (0.0, first.dissipation, 0.0_f64);
            for _ in 0..2000 {
                simulation.advance(1).unwrap();
                let s = simulation.sample().unwrap();
                lost += 0.5 * (before + s.dissipation) * 1e-6;
                before = s.dissipation;
                highest = highest.max(simulation.grains().unwrap()[0].spin.length());
            }
            let last = simulation.sample().unwrap();
            let what = format!("{} {stiffness}", bench.name);
            assert!(highest < 5.0 * 1.001, "{what}: spin grows to {highest}");
            assert!(lost > 0.1 * turning, "{what}: there is something to tell, {lost:e} of {turning:e} J");
            close(&what, energy(&last) + lost, energy(&first), turning, bench.pick(1e-3, 2e-3));
        }
    }
}
