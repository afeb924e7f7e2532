//! Contact dynamics against closed forms: rigid grains, restitution 0, implicit Euler. Cases by the names of the
//! verification suite. Columns, thresholds, overlaps and crowds are in `tests/hard`.

mod common;

use common::*;
use glam::DVec3;
use packstone::{
    scene::{Assembly, Grain, Method, Pair, Surface},
    state::array::*,
};

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

/// N1 and N12: free fall of implicit Euler, x0 - 1/2 g t² - 1/2 g t Δt; a grain lands with gap 0 and rests from the
/// next step on.
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
            assert!(simulation.solver_statistics().unwrap().unconverged == 0 && simulation.lost_contacts() == 0);
            let grains = simulation.grains().unwrap();
            let scale: f64 = m.iter().sum::<f64>() * 0.2;
            let error = (momentum(&grains, &m) - first).length();
            close("momentum", error, 0.0, scale, bench.pick(1e-13, 1e-6));
            let turned = (angular_momentum(&scene, &grains, &m).unwrap() - turning).length();
            close("angular momentum", turned, 0.0, scale * 6.0 * R, bench.pick(1e-12, 1e-5));
        }
    }
}

/// Every solver, on grains of two materials and several sizes that fall together onto a floor that moves, some of them
/// fixed, sideways without end: the same velocities, whatever the forces, in steps that begin with the impulses of the
/// last one.
#[test]
fn solvers_agree() {
    use packstone::solve::{Order, Solver};
    const STEPS: u64 = 8;
    for dimension in [2, 3] {
        let mut scene = falling(rigid(dimension, DT, 0.4, 1e-9));
        scene.grains = cloud(dimension, 4, 0.05, 5);
        let lower = 0.3 * R * up(&scene);
        for (k, g) in scene.grains.iter_mut().enumerate() {
            g.position -= lower;
            g.radius *= [1.0, 0.9, 0.5][k % 3];
            g.material = (k % 2) as u32;
            g.fixed = k % 9 == 4;
            if g.fixed {
                (g.velocity, g.spin) = (DVec3::ZERO, DVec3::ZERO);
            }
        }
        let law = |friction| Pair { friction, ..Pair::default() };
        set_laws(&mut scene, &[law(0.4), law(0.7)]);
        scene.domain.upper.x = SPACING * 4.0;
        scene.domain.lower.x = 0.0;
        scene.domain.periodic[0] = true;
        scene.walls[0].velocity = 0.05 * DVec3::X;
        let mut expected: Option<Vec<Grain>> = None;
        let choices = Solver::ALL.into_iter().flat_map(|solver| Order::ALL.map(|order| (solver, order)));
        for (solver, order) in choices.filter(|(s, o)| *s == Solver::GaussSeidel || *o == Order::Fixed) {
            if solver == Solver::Lemke && dimension == 3 {
                continue;
            }
            let on_device = !matches!(solver, Solver::GaussSeidel | Solver::Socp | Solver::Lemke);
            for bench in engines().into_iter().filter(|bench| on_device || bench.name == "cpu") {
                let Method::ContactDynamics(relaxation) = &mut scene.solver.method else { unreachable!() };
                (relaxation.solver, relaxation.order, relaxation.max_iterations) = (solver, order, 50_000);
                relaxation.tolerance = bench.pick(if solver == Solver::Jacobi { 1e-7 } else { 1e-8 }, 1e-5);
                let mut simulation = bench.start(&scene);
                simulation.advance(STEPS).unwrap();
                let solved = *simulation.solver_statistics().unwrap();
                let name = format!("{dimension}D {} {} {}", bench.name, solver.label(), order.label());
                println!("{name}: {} passes, {:.1e}", solved.iterations, solved.residual_max);
                assert_eq!(solved.unconverged, 0, "{name}");
                let grains = simulation.grains().unwrap();
                let reference = expected.get_or_insert_with(|| grains.clone());
                let off = distance(&scene, &grains, reference);
                assert!(off < bench.pick(1e-5, 1e-3), "{name} is {off:e} off");
            }
        }
    }
}

/// 200 small grains meet one that is ten times as large, all at once: as many colours as that grain has contacts, and
/// the same velocities as without.
#[test]
fn many_contacts_of_one_grain() {
    use packstone::solve::Solver;
    const SMALL: usize = 200;
    let mut scene = rigid(3, 1e-4, 0.3, 1e-9);
    let large = grain(0.0, 0.0, 0.0);
    // Points of a spiral around the sphere, each of the same area.
    let direction = |k: usize| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / SMALL as f64;
        let angle = 2.399963 * k as f64;
        (1.0 - z * z).sqrt() * DVec3::new(angle.cos(), angle.sin(), 0.0) + z * DVec3::Z
    };
    let small = |k: usize| {
        let n = direction(k);
        let velocity = 1e-2 * (n.any_orthonormal_vector() - (1.5 + 0.5 * n.x) * n);
        Grain { position: 1.1 * R * n, radius: 0.1 * R, velocity, ..large }
    };
    scene.grains = std::iter::once(large).chain((0..SMALL).map(small)).collect();
    let mut expected: Option<Vec<Grain>> = None;
    for solver in [Solver::GaussSeidel, Solver::ColouredAccelerated, Solver::JacobiAccelerated] {
        for bench in engines().into_iter().filter(|bench| solver != Solver::GaussSeidel || bench.name == "cpu") {
            let Method::ContactDynamics(relaxation) = &mut scene.solver.method else { unreachable!() };
            (relaxation.solver, relaxation.tolerance) = (solver, bench.pick(1e-9, 1e-5));
            let mut simulation = bench.start(&scene);
            simulation.advance(2).unwrap();
            let name = format!("{} {}", bench.name, solver.label());
            assert_eq!(simulation.solver_statistics().unwrap().unconverged, 0, "{name}");
            let grains = simulation.grains().unwrap();
            let reference = expected.get_or_insert_with(|| grains.clone());
            assert!(reference[0].velocity.length() > 1e-4, "the large grain is pushed");
            let off = distance(&scene, &grains, reference);
            assert!(off < bench.pick(1e-6, 1e-3), "{name} is {off:e} off");
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
        let (grains, solved) = (simulation.grains().unwrap(), *simulation.solver_statistics().unwrap());
        let looks = simulation.residual_history().to_vec();
        let last = looks.last().unwrap();
        assert_eq!((last.passes, last.residual), (solved.last_iterations, solved.last_residual), "{}", bench.name);
        assert!(looks.is_sorted_by(|a, b| a.passes < b.passes && a.seconds <= b.seconds), "{looks:?}");
        simulation.rewind().unwrap();
        assert_eq!(simulation.step(), 0);
        simulation.advance(20).unwrap();
        assert_eq!(simulation.grains().unwrap(), grains, "{}", bench.name);
        assert_eq!(*simulation.solver_statistics().unwrap(), solved);
        simulation.rewind().unwrap();
        simulation.limit_passes(2);
        simulation.advance(20).unwrap();
        assert!(simulation.solver_statistics().unwrap().iterations <= 40 && solved.iterations > 40);
    }
}

/// After steps on kept lists every contact has one place in the order of the colours, in which both of its grains find
/// it, and no grain stands twice in a colour; the same scene run again gives the same bits.
#[test]
fn contacts_of_a_colour_share_no_grain() {
    use packstone::{
        solve::Solver,
        state::{ACTIVE, INDEX, NONE},
    };
    for bench in engines() {
        let mut scene = falling(rigid(3, DT, 0.5, 1e-4));
        scene.grains = cloud(3, 5, 0.05, 3);
        let Method::ContactDynamics(relaxation) = &mut scene.solver.method else { unreachable!() };
        relaxation.solver = Solver::ColouredAccelerated;
        let run = || {
            let mut simulation = bench.start(&scene);
            simulation.advance(25).unwrap();
            simulation
        };
        let mut simulation = run();
        let s = simulation
            .read(&[&CONTACT_COLOR, &COLORED_CONTACT, &COLOR_COUNT, &COLORING_STATE, &NEIGHBOUR, &LIST_START])
            .unwrap();
        let bodies = s.sizes.bodies;
        let turns = &s.colored_contact[..s.coloring_state[0].contacts as usize];
        assert!(turns.len() > bodies, "{}: only {} contacts", bench.name, turns.len());
        let mut at = 0;
        for contacts in s.color_count.iter().filter(|n| **n > 0) {
            let mut seen = vec![false; bodies];
            for turn in turns[at..at + *contacts as usize].iter().filter(|turn| turn.first != NONE) {
                for grain in [turn.first, turn.second].map(|i| i as usize).into_iter().filter(|i| *i < bodies) {
                    assert!(!std::mem::replace(&mut seen[grain], true), "{}: grain {grain} twice", bench.name);
                }
            }
            at += *contacts as usize;
        }
        assert_eq!(at, turns.len());
        let mut listed = 0;
        for i in 0..bodies {
            for slot in s.row(i).filter(|&slot| s.neighbour[slot] != NONE && s.contact_color[slot].color > 0) {
                let j = (s.neighbour[slot] & INDEX) as usize;
                if j < i {
                    continue;
                }
                let mine = |turn: &&packstone::state::ColoredContact| turn.entry as usize == slot;
                let turn = turns.iter().find(mine).expect("a coloured contact has a place");
                assert!(turn.second as usize == j && (turn.first == NONE || turn.first as usize == i));
                if j < bodies {
                    let back = turn.back as usize;
                    assert!(s.row(j).any(|entry| entry == back) && (s.neighbour[back] & INDEX) as usize == i);
                    assert_eq!(s.neighbour[back] & ACTIVE, s.neighbour[slot] & ACTIVE, "both know of it");
                }
                listed += 1;
            }
        }
        assert_eq!(listed, turns.len(), "{}: each once", bench.name);
        let again = run().grains().unwrap();
        assert!(simulation.grains().unwrap() == again, "{}: other bits", bench.name);
    }
}

/// A wall that pushes a grain is where it should be after every step, those too that had to be done again because
/// grains came to the end of the lists' reach; and the pushed grain goes with it.
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
        assert!(simulation.solver_statistics().unwrap().steps == 12);
    }
}
