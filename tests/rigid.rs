//! Contact dynamics against closed forms: rigid grains, restitution 0, implicit Euler. Cases by the names of the
//! verification suite.

mod common;

use common::*;
use glam::DVec3;
use packstone::scene::{Assembly, Grain, Method, Surface};

const DT: f64 = 1e-3;

fn falling(mut scene: Assembly) -> Assembly {
    scene.gravity = -G * up(&scene);
    scene.walls = vec![plane(DVec3::ZERO, up(&scene))];
    scene
}

fn up(scene: &Assembly) -> DVec3 {
    DVec3::AXES[scene.dimension - 1]
}

fn at(scene: &Assembly, height: f64) -> Grain {
    Grain { position: height * up(scene), ..grain(0.0, 0.0, 0.0) }
}

/// N1 and N12: free fall of implicit Euler, x0 - 1/2 g t² - 1/2 g t Δt; a grain lands with gap 0 and rests from the next
/// step on.
#[test]
fn landing() {
    for bench in engines() {
        for dimension in [2, 3] {
            let mut scene = falling(rigid(dimension, DT, 0.5, bench.pick(1e-8, 1e-5)));
            scene.grains = vec![at(&scene, 1.5 * R)];
            let mut simulation = bench.start(&scene);
            let rounding = bench.pick(1e-12, 1e-6);
            let mut before = 0.5 * R;
            for step in 1.. {
                simulation.advance(1).unwrap();
                let g = simulation.grains().unwrap()[0];
                let (gap, v) = (g.position.dot(up(&scene)) - R, g.velocity.dot(up(&scene)));
                let t = f64::from(step) * DT;
                let free = 0.5 * R - 0.5 * G * t * t - 0.5 * G * t * DT;
                if free > 0.0 {
                    close("gap in flight", gap, free, R, rounding);
                } else {
                    close("gap on landing", gap, 0.0, R, bench.pick(1e-9, 1e-6));
                    close("speed on landing", v, -before / DT, before / DT, bench.pick(1e-8, 1e-4));
                    break;
                }
                before = gap;
            }
            simulation.advance(1).unwrap();
            let rest = simulation.grains().unwrap()[0].velocity.length();
            close("speed at rest", rest, 0.0, G * DT, bench.pick(1e-6, 1e-5));
        }
    }
}

/// T6: oblique impact on a wall, e = 0, sticks if ψ < 1 + 1/β_I, else slips by μ v_n.
#[test]
fn oblique_impact() {
    let (mu, vn) = (0.3, 0.1);
    for bench in engines() {
        for dimension in [2, 3] {
            let c = 1.0 + 1.0 / gyration(dimension);
            for psi in [0.5, 2.0, 0.99 * c, 1.01 * c, 8.0] {
                let mut scene = rigid(dimension, DT, mu, bench.pick(1e-8, 1e-5));
                scene.walls = vec![plane(DVec3::ZERO, up(&scene))];
                let vt = psi * mu * vn;
                let velocity = vt * DVec3::X - vn * up(&scene);
                scene.grains = vec![Grain { velocity, ..at(&scene, R) }];
                let g = bench.after(&scene, 1)[0];
                let axis = up(&scene).cross(DVec3::X);
                let slip = g.velocity.x + R * (g.spin.cross(-up(&scene))).x;
                let expected = if psi < c { vt * (1.0 - 1.0 / c) } else { vt - mu * vn };
                close("tangential", g.velocity.x, expected, vt, bench.pick(1e-6, 1e-5));
                close("slip", slip, if psi < c { 0.0 } else { (psi - c) * mu * vn }, vt, bench.pick(1e-6, 1e-5));
                close("normal", g.velocity.dot(up(&scene)), 0.0, vn, bench.pick(1e-6, 1e-5));
                assert!(g.spin.cross(axis).length() <= 1e-5 * g.spin.length(), "spin {:?}", g.spin);
            }
        }
    }
}

/// R1: a sliding grain ends up rolling at 1/(1 + β_I) of its speed, whatever μ and Δt; the slip ends within a step of
/// v0 / (c μ g).
#[test]
fn sliding_to_rolling() {
    for bench in engines() {
        for dimension in [2, 3] {
            let (mu, v0) = (0.2, 0.1);
            let beta = gyration(dimension);
            let mut scene = falling(rigid(dimension, DT, mu, bench.pick(1e-8, 1e-5)));
            scene.grains = vec![Grain { velocity: v0 * DVec3::X, ..at(&scene, R) }];
            let expected = v0 / (1.0 + beta);
            let slipping = v0 / ((1.0 + 1.0 / beta) * mu * G) / DT;
            let mut simulation = bench.start(&scene);
            simulation.advance(slipping as u64 - 1).unwrap();
            assert!(simulation.grains().unwrap()[0].velocity.x > 1.001 * expected, "still slipping");
            simulation.advance(20).unwrap();
            let g = simulation.grains().unwrap()[0];
            close("rolling", g.velocity.x, expected, v0, bench.pick(1e-6, 1e-5));
            close("spin", g.spin.length() * R, expected, v0, bench.pick(1e-6, 1e-5));
        }
    }
}

/// R2: on an incline a grain slips if tan θ > c μ, and rolls without slip below, to 1e-6 in tan φ.
#[test]
fn incline() {
    for bench in engines() {
        for dimension in [2, 3] {
            let c = 1.0 + 1.0 / gyration(dimension);
            let mu = 0.1;
            let slip = |tan: f64| {
                let theta = tan.atan();
                let mut scene = falling(rigid(dimension, DT, mu, bench.pick(1e-10, 1e-5)));
                scene.gravity = G * (theta.sin() * DVec3::X - theta.cos() * up(&scene));
                scene.grains = vec![at(&scene, R)];
                let g = bench.after(&scene, 50)[0];
                (g.velocity.x + R * (g.spin.cross(-up(&scene))).x) / (50.0 * DT * G * theta.cos())
            };
            // Beyond the threshold the contact point accelerates by g cos θ (tan θ - c μ).
            let difference = bench.pick(1e-6, 1e-4);
            assert!(slip(c * mu - difference).abs() < 0.01 * difference, "{}: slips below", bench.name);
            close("slip", slip(c * mu + difference), difference, difference, 0.05);
        }
    }
}

/// A column: the force on the floor is the weight, and on every contact the weight above.
#[test]
fn columns() {
    for bench in engines() {
        for (n, tolerance) in [(10, 1e-5), (100, 1e-5)] {
            let mut scene = falling(rigid(3, DT, 0.5, tolerance));
            scene.grains = (0..n).map(|k| at(&scene, R * (1.0 + 2.0 * f64::from(k)))).collect();
            let mut simulation = bench.start(&scene);
            simulation.advance(1).unwrap();
            let solved = *simulation.solved().unwrap();
            println!("{} {n}: {solved:?}", bench.name);
            assert_eq!(solved.unconverged, 0);
            // Forces of all contacts of a grain: on the floor's grain they hold its own weight, so does every other.
            let weight = mass(3, R) * G;
            for (force, _) in simulation.forces().unwrap() {
                close("held", force.z, weight, weight, bench.pick(1e-3, 1e-3));
            }
            simulation.advance(20).unwrap();
            let grains = simulation.grains().unwrap();
            assert_eq!(simulation.solved().unwrap().unconverged, 0);
            let fastest = grains.iter().map(|g| g.velocity.length()).fold(0.0, f64::max);
            assert!(fastest < 1e-3 * G * DT, "{} {n}: {:e} of g dt", bench.name, fastest / (G * DT));
        }
    }
}

/// N11: rigid grains in a row, hit at one end, go on together with the momentum of the first.
#[test]
fn cradle() {
    for bench in engines() {
        let mut scene = rigid(3, DT, 0.0, bench.pick(1e-8, 1e-5));
        scene.grains = (0..5).map(|k| grain(2.0 * R * f64::from(k), 0.0, 0.0)).collect();
        scene.grains[0].velocity = 0.1 * DVec3::X;
        for g in bench.after(&scene, 1) {
            close(bench.name, g.velocity.x, 0.02, 0.1, bench.pick(1e-6, 1e-5));
        }
    }
}

/// CO7: two grains with opposite velocities and opposite spins meet without slip: nothing turns.
#[test]
fn meeting_without_slip() {
    for bench in engines() {
        let mut scene = rigid(3, DT, 0.4, bench.pick(1e-8, 1e-5));
        let spin = 10.0 * DVec3::Z;
        scene.grains = vec![
            Grain { velocity: 0.2 * DVec3::X, spin, ..grain(-R, 0.0, 0.0) },
            Grain { velocity: -0.2 * DVec3::X, spin: -spin, ..grain(R, 0.0, 0.0) },
        ];
        let after = bench.after(&scene, 1);
        for (g, spin) in after.iter().zip([spin, -spin]) {
            close("velocity", g.velocity.length(), 0.0, 0.2, bench.pick(1e-7, 1e-6));
            close("spin", (g.spin - spin).length(), 0.0, 10.0, bench.pick(1e-7, 1e-6));
        }
    }
}

/// Momentum and angular momentum of isolated grains that hit each other, to rounding; no energy appears.
#[test]
fn collisions_conserve_momentum() {
    use packstone::measure::{angular_momentum, masses, momentum};
    for bench in engines() {
        for dimension in [2, 3] {
            let mut scene = rigid(dimension, 2e-4, 0.4, 1e-4);
            scene.grains = cloud(dimension, 6, 0.2, 7);
            let m = masses(&scene);
            let first = momentum(&scene.grains, &m);
            let turning = angular_momentum(&scene, &scene.grains, &m).unwrap();
            let energy = |grains: &[Grain]| -> f64 {
                let beta = gyration(dimension);
                let of =
                    |g: &Grain, m: f64| m * (g.velocity.length_squared() + beta * (g.radius * g.spin.length()).powi(2));
                grains.iter().zip(&m).map(|(g, m)| 0.5 * of(g, *m)).sum()
            };
            let mut simulation = bench.start(&scene);
            let mut last = energy(&scene.grains);
            for _ in 0..30 {
                simulation.advance(1).unwrap();
                let now = energy(&simulation.grains().unwrap());
                assert!(now <= last * (1.0 + bench.pick(1e-9, 1e-5)), "{}: energy {last:e} to {now:e}", bench.name);
                last = now;
            }
            assert!(simulation.solved().unwrap().unconverged == 0 && simulation.lost_contacts() == 0);
            let grains = simulation.grains().unwrap();
            let scale: f64 = m.iter().sum::<f64>() * 0.2;
            let error = (momentum(&grains, &m) - first).length();
            close("momentum", error, 0.0, scale, bench.pick(1e-13, 1e-6));
            let turned = (angular_momentum(&scene, &grains, &m).unwrap() - turning).length();
            close("angular momentum", turned, 0.0, scale * 6.0 * R, bench.pick(1e-12, 1e-5));
        }
    }
}

/// Every solver, in one step of a heap that falls together: the same velocities, whatever the forces.
#[test]
fn solvers_agree() {
    use packstone::cd::{Order, Solver};
    for dimension in [2, 3] {
        let mut scene = falling(rigid(dimension, DT, 0.4, 1e-9));
        scene.grains = cloud(dimension, 4, 0.2, 5);
        let lower = 0.3 * R * up(&scene);
        scene.grains.iter_mut().for_each(|g| g.position -= lower);
        let side = SPACING * 4.0;
        scene.walls.push(plane(DVec3::ZERO, DVec3::X));
        scene.walls.push(plane(side * DVec3::X, -DVec3::X));
        let mut expected: Option<Vec<Grain>> = None;
        let choices = Solver::ALL.into_iter().flat_map(|solver| Order::ALL.map(|order| (solver, order)));
        for (solver, order) in choices.filter(|(s, o)| *s == Solver::GaussSeidel || *o == Order::Fixed) {
            if solver == Solver::Lemke && dimension == 3 {
                continue;
            }
            let Method::ContactDynamics(relaxation) = &mut scene.solver.method else { unreachable!() };
            (relaxation.solver, relaxation.order, relaxation.max_iterations) = (solver, order, 50_000);
            relaxation.tolerance = if solver == Solver::Jacobi { 1e-7 } else { 1e-8 };
            let mut simulation = CPU.start(&scene);
            simulation.advance(1).unwrap();
            let solved = *simulation.solved().unwrap();
            println!(
                "{dimension}D {} {}: {} passes, {:.1e}",
                solver.label(),
                order.label(),
                solved.iterations,
                solved.residual_max
            );
            assert_eq!(solved.unconverged, 0, "{}", solver.label());
            let grains = simulation.grains().unwrap();
            let reference = expected.get_or_insert_with(|| grains.clone());
            assert!(distance(&scene, &grains, reference) < 1e-5, "{} finds something else", solver.label());
        }
    }
}

/// A simulation that begins again does the same again, and its looks at the residual are those of the last step.
#[test]
fn rewound() {
    for bench in engines() {
        let mut scene = falling(rigid(3, DT, 0.4, 1e-3));
        scene.grains = cloud(3, 4, 0.2, 5);
        let mut simulation = bench.start(&scene);
        simulation.advance(20).unwrap();
        let (grains, solved) = (simulation.grains().unwrap(), *simulation.solved().unwrap());
        let looks = simulation.looks().to_vec();
        let last = looks.last().unwrap();
        assert_eq!((last.passes, last.residual), (solved.last_iterations, solved.last_residual), "{}", bench.name);
        assert!(looks.is_sorted_by(|a, b| a.passes < b.passes && a.seconds <= b.seconds), "{looks:?}");
        simulation.rewind().unwrap();
        assert_eq!(simulation.step(), 0);
        simulation.advance(20).unwrap();
        assert_eq!(simulation.grains().unwrap(), grains, "{}", bench.name);
        assert_eq!(*simulation.solved().unwrap(), solved);
        simulation.rewind().unwrap();
        simulation.limit_passes(2);
        simulation.advance(20).unwrap();
        assert!(simulation.solved().unwrap().iterations <= 40 && solved.iterations > 40);
    }
}

/// Passes from rest until every force in a column is known to 1 % of the weight on the floor: with momentum about as many as
/// grains, where plain passes take of the order of their square (group 2b).
#[test]
fn passes_grow_like_the_height_of_a_column() {
    let passes = |n: u32| -> f64 {
        let mut scene = falling(rigid(3, DT, 0.5, 1e-12));
        scene.grains = (0..n).map(|k| at(&scene, R * (1.0 + 2.0 * f64::from(k)))).collect();
        let weight = mass(3, R) * G;
        let mut most = f64::from(n);
        loop {
            let Method::ContactDynamics(relaxation) = &mut scene.solver.method else { unreachable!() };
            relaxation.max_iterations = most as u32;
            let mut simulation = CPU.start(&scene);
            simulation.advance(1).unwrap();
            // The load on contact k from below is the weight above it plus what the forces on the grains miss.
            let missing = simulation.forces().unwrap().into_iter().map(|(force, _)| weight - force.z);
            let error = missing.rev().scan(0.0, |sum, m| {
                *sum += m;
                Some(f64::abs(*sum))
            });
            if error.fold(0.0, f64::max) < 0.01 * f64::from(n) * weight {
                return most.floor();
            }
            most *= 1.15;
        }
    };
    let (ten, hundred, thousand) = (passes(10), passes(100), passes(1000));
    let exponent = (thousand / ten).log10() / 2.0;
    println!("10, 100, 1000 grains: {ten}, {hundred}, {thousand} passes, exponent {exponent:.2}");
    assert!(exponent < 1.2, "{exponent}");
}

/// R5: two disks on a floor and a third on top stand if μ >= tan 15°, and slide apart below.
#[test]
fn pyramid() {
    for bench in engines() {
        let sinks = |mu: f64| {
            let mut scene = falling(rigid(2, DT, mu, bench.pick(1e-9, 1e-5)));
            let top = grain(0.0, R + 3.0_f64.sqrt() * R, 0.0);
            scene.grains = vec![grain(-R, R, 0.0), grain(R, R, 0.0), top];
            let end = bench.after(&scene, 100);
            (top.position.y - end[2].position.y) / R
        };
        let limit = 15.0_f64.to_radians().tan();
        let (off, still) = bench.pick((1e-5, 1e-7), (1e-3, 1e-4));
        assert!(sinks(limit + off).abs() < still, "{}: sinks by {:e} R", bench.name, sinks(limit + off));
        assert!(sinks(limit - off) > 10.0 * still, "{}: stands by {:e} R", bench.name, sinks(limit - off));
    }
}

/// A grain between a floor and a wall that comes down has nowhere to go: every step is counted as unsolved, numbers stay
/// numbers, and the run ends with the grain named when its centre is beyond a wall.
#[test]
fn no_way_out() {
    for bench in engines() {
        let mut scene = rigid(3, DT, 0.5, 1e-3);
        scene.walls = vec![plane(DVec3::ZERO, DVec3::Z), plane(2.0 * R * DVec3::Z, -DVec3::Z)];
        scene.walls[1].velocity = -0.05 * DVec3::Z;
        scene.grains = vec![grain(0.0, 0.0, R)];
        let Method::ContactDynamics(relaxation) = &mut scene.solver.method else { unreachable!() };
        relaxation.max_iterations = 50;
        let mut simulation = bench.start(&scene);
        simulation.advance(10).unwrap();
        let solved = *simulation.solved().unwrap();
        assert!(solved.unconverged >= 9 && solved.last_residual > 0.1, "{solved:?}");
        let g = simulation.grains().unwrap()[0];
        assert!(g.velocity.z > -0.05 && g.velocity.z < -1e-3, "shared by the two walls: {g:?}");
        let error = simulation.advance(100).unwrap_err().to_string();
        assert!(error.contains("grain 0") && error.contains("beyond a wall"), "{error}");
    }
}

/// A deep overlap opens at the speed that the scene allows, and leaves no more energy behind than that.
#[test]
fn overlaps_open_gently() {
    for bench in engines() {
        for dimension in [2, 3] {
            let mut scene = rigid(dimension, DT, 0.5, bench.pick(1e-8, 1e-5));
            let speed = 0.02;
            let Method::ContactDynamics(relaxation) = &mut scene.solver.method else { unreachable!() };
            relaxation.max_correction_velocity = Some(speed);
            scene.grains = vec![grain(0.0, 0.0, 0.0), grain(1.8 * R, 0.0, 0.0)];
            let mut simulation = bench.start(&scene);
            for step in 1..=15 {
                simulation.advance(1).unwrap();
                let grains = simulation.grains().unwrap();
                let apart = (grains[1].velocity - grains[0].velocity).x;
                close("speed", apart, speed, speed, bench.pick(1e-6, 1e-4));
                let gap = (grains[1].position - grains[0].position).x - 2.0 * R;
                close("gap", gap, f64::from(step) * DT * speed - 0.2 * R, R, 1e-4);
            }
        }
    }
}

/// A cloud falls into a box, without friction, and with more than any real surface has. The latter is hard: relaxations of all
/// kinds leave most steps unsolved (they are counted), but no grain is lost, nothing flies off and overlaps stay small.
#[test]
fn no_friction_and_very_much() {
    for bench in engines() {
        for (mu, most, overlap) in [(0.0, 1000, 0.01), (10.0, 100, 0.05)] {
            let mut scene = falling(rigid(3, DT, mu, 1e-3));
            let Method::ContactDynamics(relaxation) = &mut scene.solver.method else { unreachable!() };
            relaxation.max_iterations = most;
            scene.grains = cloud(3, 5, 0.05, 9);
            let side = SPACING * 5.0;
            for normal in [DVec3::X, DVec3::Y] {
                scene.walls.push(plane(DVec3::ZERO, normal));
                scene.walls.push(plane(side * normal, -normal));
            }
            let mut simulation = bench.start(&scene);
            simulation.advance(60).unwrap();
            let (solved, sample) = (*simulation.solved().unwrap(), simulation.sample().unwrap());
            println!("{} μ = {mu}: {solved:?}, {sample:?}", bench.name);
            assert!(mu > 0.0 || solved.unconverged == 0, "{solved:?}");
            assert!(simulation.lost_contacts() == 0 && sample.contacts > 100, "{sample:?}");
            assert!(sample.max_overlap_over_radius < overlap, "{sample:?}");
            let fallen = mass(3, R) * 125.0 * G * R;
            assert!(sample.kinetic_energy < 0.1 * fallen, "{sample:?}");
        }
    }
}

/// A wall that pushes a grain is where it should be after every step, those too that had to be done again because grains came to
/// the end of the lists' reach; and the pushed grain goes with it.
#[test]
fn pushed_by_a_wall() {
    for bench in engines() {
        let mut scene = rigid(3, DT, 0.0, bench.pick(1e-8, 1e-5));
        let speed = 0.002;
        scene.solver.margin = 0.3;
        scene.walls = vec![plane(-R * DVec3::X, DVec3::X)];
        scene.walls[0].velocity = speed * DVec3::X;
        // They start slow and fall: the lists were made for less.
        scene.grains = vec![grain(0.0, 0.0, 0.0), grain(0.0, 10.0 * R, 10.0 * R)];
        scene.gravity = DVec3::new(0.0, 0.0, -G);
        let mut simulation = bench.start(&scene);
        for step in 1..=12 {
            simulation.advance(1).unwrap();
            let g = simulation.grains().unwrap()[0];
            close("velocity", g.velocity.x, speed, speed, bench.pick(1e-6, 1e-4));
            let Surface::Plane { point, .. } = simulation.walls().unwrap()[0].surface else { unreachable!() };
            close("wall", point.x, f64::from(step) * DT * speed - R, R, bench.pick(1e-9, 1e-5));
            close("gap", g.position.x - point.x - R, 0.0, R, bench.pick(1.1e-4, 1.2e-4));
        }
        println!("{}: {} steps done again", bench.name, simulation.replayed_chunks());
        assert!(simulation.replayed_chunks() > 0, "no step was done again");
        assert!(simulation.solved().unwrap().steps == 12);
    }
}
