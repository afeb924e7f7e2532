//! Closed forms. Each tolerance is what the scheme deserves: rounding where leapfrog is exact, (ω Δt)² where it is
//! second order, and the resolution of an overlap in f32, ulp(position) / overlap, for the single-precision engine.

mod common;

use common::*;
use glam::DVec3;
use packstone::scene::{Assembly, Dashpot, Grain, Pair, TimeStep, Wall};
use std::f64::consts::{PI, TAU};

const INF: f64 = f64::INFINITY;

fn up(dimension: usize) -> DVec3 {
    DVec3::AXES[dimension - 1]
}

fn floor(dimension: usize) -> Wall {
    plane(DVec3::ZERO, up(dimension))
}

/// ω₀ of a default grain on a wall, 1/s.
fn omega(dimension: usize) -> f64 {
    (KN / mass(dimension, R)).sqrt()
}

/// Constant acceleration is exact for leapfrog started with a half kick (N1). f32: 200 additions of half an ulp of
/// 16 mm on a path of 4 mm are 3e-5 at worst.
#[test]
fn free_fall() {
    let mut scene = blank_dt(3, 1e-4);
    scene.solver.allow_unstable = true; // nothing touches
    scene.gravity = DVec3::new(1.0, -2.0, -G);
    scene.grains = (0..3).map(|k| grain(5.0 * R * f64::from(k), 0.0, 0.0)).collect();
    scene.grains[1].velocity = DVec3::new(0.1, 0.2, 0.3);
    scene.grains[2].velocity = DVec3::new(0.0, -0.3, 0.1);
    scene.grains[2].spin = DVec3::new(100.0, 20.0, -3.0);
    let t = 200.0 * 1e-4;
    for bench in engines() {
        for (g, g0) in bench.after(&scene, 200).iter().zip(&scene.grains) {
            let path = g0.velocity * t + 0.5 * t * t * scene.gravity;
            let v = g0.velocity + t * scene.gravity;
            let error = (g.position - g0.position - path).length();
            close(bench.name, error, 0.0, path.length(), bench.pick(1e-13, 3e-5));
            close(bench.name, (g.velocity - v).length(), 0.0, v.length(), bench.pick(1e-13, 1e-5));
            assert_eq!(g.spin, if bench.is_single() { g0.spin.as_vec3().as_dvec3() } else { g0.spin });
        }
    }
}

/// Global damping in free flight (N2): the centred discrete solution to rounding, terminal speed g/ξ, and order 2
/// against the continuous one.
#[test]
fn damped_flight() {
    let (xi, v0, end) = (40.0, 0.1, 0.05);
    let scene = |steps: u64| {
        let mut scene = blank_dt(3, end / steps as f64);
        scene.solver.allow_unstable = true; // nothing touches
        scene.solver.margin = 1.0;
        scene.solver.damping = xi;
        scene.gravity = DVec3::new(0.0, 0.0, -G);
        scene.grains = vec![grain(0.0, 0.0, 0.0)];
        scene.grains[0].velocity = DVec3::X * v0;
        scene.grains[0].spin = DVec3::X * 5.0;
        scene
    };
    for bench in engines() {
        let steps = 200;
        let h = 0.5 * xi * end / steps as f64;
        let g = bench.after(&scene(steps), steps)[0];
        // v(n+1/2) = v∞ + (v(1/2) - v∞) rⁿ and x is its sum; v(1/2) is half an explicit kick from v(0).
        let ratio = (1.0 - h) / (1.0 + h);
        let discrete = |v0: f64, limit: f64| {
            let first = v0 + h * (limit - v0);
            let sum = (1.0 - ratio.powi(steps as i32)) / (1.0 - ratio);
            (end * limit + end / steps as f64 * (first - limit) * sum, limit + (v0 - limit) * ratio.powi(steps as i32))
        };
        let tolerance = bench.pick(1e-13, 3e-5);
        let ((x, vx), (z, vz)) = (discrete(v0, 0.0), discrete(0.0, -G / xi));
        close("x", g.position.x, x, x.abs(), tolerance);
        close("z", g.position.z, z, z.abs(), tolerance);
        close("vx", g.velocity.x, vx, v0, tolerance);
        close("vz", g.velocity.z, vz, G / xi, tolerance);
        close("spin", g.spin.x, 5.0 * vx / v0, 5.0, tolerance);
    }
    let error =
        |steps: u64| (CPU.after(&scene(steps), steps)[0].position.x - v0 / xi * (1.0 - (-xi * end).exp())).abs();
    let order = (error(50) / error(100)).log2();
    println!("damped flight: order {order:.4}");
    close("order", order, 2.0, 1.0, 0.05);
}

/// Duration π/ω and depth v/ω of an elastic impact (N3) on a wall and between unequal spheres. The force has a kink at
/// first touch, which like the rest of the error is (ω Δt)² = 1e-3 at tc/100.
#[test]
fn elastic_impact() {
    for (dimension, partner) in [(3, None), (2, None), (3, Some(0.6 * R)), (2, Some(0.6 * R))] {
        let m = mass(dimension, R);
        let reduced = partner.map_or(m, |r| 1.0 / (1.0 / m + 1.0 / mass(dimension, r)));
        let w = (KN / reduced).sqrt();
        let (v, dt) = (1e-2 * R * w, PI / w / 100.0);
        let mut scene = blank_dt(dimension, dt);
        let axis = up(dimension);
        let mut flying = grain(0.0, 0.0, 0.0);
        flying.velocity = -v * axis;
        let rest = match partner {
            None => {
                scene.walls = vec![floor(dimension)];
                R
            }
            Some(r) => {
                scene.grains = vec![Grain { radius: r, ..grain(0.0, 0.0, 0.0) }];
                R + r
            }
        };
        flying.position = axis * (rest + 3.3 * dt * v);
        scene.grains.push(flying);
        let mut simulation = CPU.start(&scene);
        let mut depth: f64 = 0.0;
        let mut last = INF;
        let mut end = None;
        for step in 1..120 {
            simulation.advance(1).unwrap();
            let grains = simulation.grains().unwrap();
            let below = if partner.is_some() { grains[0].position } else { DVec3::ZERO };
            let gap = (grains.last().unwrap().position - below).dot(axis) - rest;
            depth = depth.max(-gap);
            if last < 0.0 && gap >= 0.0 {
                end = Some(f64::from(step) - gap / (gap - last));
            }
            last = gap;
        }
        let duration = (end.expect("they separate") - 3.3) * dt;
        let e = simulation.grains().unwrap();
        let out = e.last().unwrap().velocity - if partner.is_some() { e[0].velocity } else { DVec3::ZERO };
        println!(
            "{dimension}D: duration {:.2e}, depth {:.2e}, e - 1 = {:.2e}",
            duration * w / PI - 1.0,
            depth * w / v - 1.0,
            out.dot(axis) / v - 1.0
        );
        close("duration", duration, PI / w, PI / w, 1e-3);
        close("depth", depth, v / w, v / w, 1e-3);
        close("restitution", out.dot(axis), v, v, 1e-3);
    }
}

/// Mean restitution over 16 phases of the first touch between the steps, unequal spheres, one row per law.
fn restitutions(bench: Bench, laws: &[Dashpot], steps_per_contact: f64) -> Vec<f64> {
    let r = 0.6 * R;
    let reduced = 1.0 / (1.0 / mass(3, R) + 1.0 / mass(3, r));
    let w = (KN / reduced).sqrt();
    let (v, dt) = (2e-2 * R * w, PI / w / steps_per_contact);
    let mut scene = blank_dt(3, dt);
    let laws: Vec<Pair> = laws.iter().map(|dashpot| Pair { dashpot: *dashpot, ..law(0.0) }).collect();
    set_laws(&mut scene, &laws);
    for material in 0..laws.len() {
        for phase in 0..16 {
            let gap = v * dt * (2.0 + (f64::from(phase) + 0.5) / 16.0);
            let at = DVec3::new(0.0, 3.0 * R * f64::from(phase), 3.0 * R * material as f64);
            let material = material as u32;
            scene.grains.push(Grain { position: at, radius: r, material, ..grain(0.0, 0.0, 0.0) });
            let position = at + DVec3::X * (R + r + gap);
            scene.grains.push(Grain { position, material, velocity: DVec3::NEG_X * v, ..grain(0.0, 0.0, 0.0) });
        }
    }
    let grains = bench.after(&scene, (1.4 * steps_per_contact) as u64 + 4);
    for pair in grains.chunks(2) {
        assert!(pair[1].position.x - pair[0].position.x > R + r, "still in contact");
    }
    let e: Vec<f64> = grains.chunks(2).map(|p| (p[1].velocity - p[0].velocity).x / v).collect();
    e.chunks(16).map(|e| e.iter().sum::<f64>() / 16.0).collect()
}

/// Restitution from the dashpot slots (N4). The dashpot acts on velocities half a step old: then the discrete
/// contact obeys z² − (2 − γΔt − ω²Δt²) z + (1 − γΔt) = 0, which is first order in Δt around e. Both are checked: the
/// rebound follows the discrete law to (ωΔt)², and that law tends to e.
#[test]
fn restitution_by_dashpot() {
    let reduced = 1.0 / (1.0 / mass(3, R) + 1.0 / mass(3, 0.6 * R));
    let w = (KN / reduced).sqrt();
    let gamma = |e: f64| 2.0 * w * -e.ln() / (PI * PI + e.ln() * e.ln()).sqrt();
    let discrete = |gamma: f64, dt: f64| {
        let damped = 1.0 - gamma * dt;
        let angle = ((1.0 + damped - (w * dt).powi(2)) / 2.0 / damped.sqrt()).acos();
        (0.5 * damped.ln() * PI / angle).exp()
    };
    let wanted = [1.0, 0.9, 0.5, 0.2];
    let by_e: Vec<_> = wanted.iter().map(|e| Dashpot::Restitution(*e)).collect();
    let by_eta: Vec<_> = wanted.iter().map(|e| Dashpot::MassScaled(gamma(*e))).collect();
    for laws in [by_e, by_eta] {
        for (bench, resolution) in engines().into_iter().map(|b| (b, 100.0)).chain([(CPU, 1000.0)]) {
            let dt = PI / w / resolution;
            for (e, found) in wanted.iter().zip(restitutions(bench, &laws, resolution)) {
                let expected = discrete(gamma(*e), dt);
                println!(
                    "{} tc/{resolution}: e {e} + {:.1e}, discrete law + {:.1e}",
                    bench.name,
                    found - e,
                    found - expected
                );
                // The last touch falls anywhere in its step, which 16 phases average to γΔt/32.
                let tolerance = (w * dt).powi(2) + gamma(*e) * dt / 32.0;
                close("discrete law", found, expected, 1.0, tolerance);
                close("restitution", found, *e, 1.0, 0.5 * gamma(*e) * dt + tolerance);
            }
        }
    }
}

/// One oblique impact on a wall: k_T/k_N, ψ = v_s/(μ v_n) in, ψ expected out.
type Impact = (f64, f64, f64);

const FRICTION: f64 = 0.3;

/// All impacts at once, next to each other on one floor, in different directions. Returns ψ out of each, after checking what else the closed form says.
/// `depth` is the overlap in radii: the closed form is the limit of depth 0.
/// `phase` of a grain is the part of its first step in contact that it is away from the wall.
fn oblique(
    bench: Bench,
    dimension: usize,
    impacts: &[Impact],
    (depth, tolerance): (f64, f64),
    resolution: f64,
    phase: fn(usize) -> f64,
) -> Vec<f64> {
    let w = omega(dimension);
    let vn = depth * R * w;
    let dt = PI / w / resolution;
    let n = up(dimension);
    let c = 1.0 + 1.0 / gyration(dimension);
    let mut scene = blank_dt(dimension, dt);
    scene.solver.allow_unstable = true; // the bound counts neighbours that never meet
    scene.walls = vec![floor(dimension)];
    let laws: Vec<Pair> =
        impacts.iter().map(|(ratio, ..)| Pair { tangential_stiffness: ratio * KN, ..law(FRICTION) }).collect();
    set_laws(&mut scene, &laws);
    let direction = |k: usize| {
        let angle = if dimension == 2 { PI * (k % 2) as f64 } else { 2.4 * k as f64 };
        DVec3::new(angle.cos().round_if(dimension == 2), if dimension == 2 { 0.0 } else { angle.sin() }, 0.0)
    };
    for (k, (_, psi, _)) in impacts.iter().enumerate() {
        let lateral = DVec3::new((k % 8) as f64, 0.0, 0.0)
            + if dimension == 3 { DVec3::Y * (k / 8) as f64 } else { DVec3::X * 8.0 * (k / 8) as f64 };
        scene.grains.push(Grain {
            position: 3.0 * R * lateral + n * (R + vn * dt * (2.0 + phase(k))),
            velocity: -vn * n + psi * FRICTION * vn * direction(k),
            material: k as u32,
            ..grain(0.0, 0.0, 0.0)
        });
    }
    let grains = bench.after(&scene, resolution as u64 + 5);
    let mut out = Vec::new();
    for (k, (g, (ratio, psi, expected))) in grains.iter().zip(impacts).enumerate() {
        assert!(g.position.dot(n) > R, "grain {k} is still in contact");
        let unit = FRICTION * vn;
        let slip = g.velocity - g.velocity.dot(n) * n + g.spin.cross(-R * n);
        let found = slip.dot(direction(k)) / unit;
        let what = format!("{} {dimension}D kt/kn {ratio} psi {psi}", bench.name);
        close(&what, found, *expected, 1.0_f64.max(*psi), tolerance);
        let dv = g.velocity.dot(direction(k)) / unit - psi;
        close(&format!("{what}: dv"), dv, -(psi - expected) / c, 1.0_f64.max(*psi), tolerance);
        let spin = R * g.spin.dot(n.cross(direction(k))) / unit;
        close(&format!("{what}: spin"), spin, (psi - expected) * (c - 1.0) / c, 1.0_f64.max(*psi), tolerance);
        let aside = slip - slip.dot(direction(k)) * direction(k);
        close(&format!("{what}: aside"), aside.length(), 0.0, unit * 1.0_f64.max(*psi), tolerance);
        close(&format!("{what}: normal"), g.velocity.dot(n), vn, vn, tolerance);
        out.push(found);
    }
    out
}

trait RoundIf {
    fn round_if(self, yes: bool) -> f64;
}
impl RoundIf for f64 {
    fn round_if(self, yes: bool) -> f64 {
        if yes { self.round() } else { self }
    }
}

/// The first touch falls onto a step, so that the first step in contact is a whole one.
fn whole_step(_: usize) -> f64 {
    1e-6
}

/// Depth and tolerance for an engine: in f64 the depth can go to 0; f32 resolves 1e-3 R to 1e-4 and pays for the
/// depth with arms shorter by half of it.
fn impact_numbers(bench: Bench) -> (f64, f64) {
    bench.pick((1e-7, 1e-3), (1e-3, 5e-3))
}

/// T1: the super-ball law with its sharp kink, for spheres (k_T = 2/7 k_N) and disks (k_T = 1/3 k_N).
#[test]
fn super_ball() {
    for bench in engines() {
        let (depth, tolerance) = impact_numbers(bench);
        for (dimension, ratio, c) in [(3, 2.0 / 7.0, 3.5), (2, 1.0 / 3.0, 3.0)] {
            let law = |psi: f64| if psi < c { -psi } else { psi - 2.0 * c };
            let impacts: Vec<Impact> = [0.0, 0.1, 1.0, 0.8 * c, 0.99 * c, 1.01 * c, 1.5 * c, 3.0 * c]
                .into_iter()
                .map(|psi| (ratio, psi, law(psi)))
                .collect();
            oblique(bench, dimension, &impacts, (depth, tolerance), 200.0, whole_step);
        }
    }
}

/// T2, T3, T4.
#[rustfmt::skip]
const TABLE: &[(f64, &[(f64, f64)])] = &[
    (1.0, &[(0.25, 0.223408), (0.5, 0.424911), (1.5, 0.288594), (2.0, -0.203592), (3.0, -0.999539), (4.0, -1.456513),
            (5.0, -1.520970), (6.0, -1.0), (7.5, 0.5), (10.0, 3.0)]),
    (0.5, &[(0.25, -0.142583), (0.5, -0.303511), (1.0, -0.666579), (1.5, -1.067882), (3.0, -2.311381),
            (4.0, -2.524819), (5.0, -2.0), (6.0, -1.0), (7.5, 0.5)]),
    (1.48 / 1.72, &[(0.25, 0.151506), (0.5, 0.259032), (1.0, 0.300385), (1.5, -0.006831), (2.0, -0.498791),
            (3.0, -1.279215), (4.0, -1.687225), (5.0, -1.663191), (6.0, -1.0)]),
];

#[test]
fn oblique_impacts() {
    let rows = TABLE.iter().flat_map(|(ratio, rows)| rows.iter().map(|(psi, out)| (*ratio, *psi, *out)));
    let impacts: Vec<Impact> = rows.collect();
    for bench in engines() {
        let (depth, tolerance) = impact_numbers(bench);
        let out = oblique(bench, 3, &impacts, (depth, tolerance), 200.0, whole_step);
        let worst = out.iter().zip(&impacts).map(|(o, i)| (o - i.2).abs()).fold(0.0, f64::max);
        println!("{}: worst psi error {worst:.1e}", bench.name);
    }
}

/// The same from a table with more rows: the closed form, evaluated independently.
#[test]
fn oblique_impacts_of_the_table() {
    let text = include_str!("data/oblique_sphere.csv");
    let rows = text.lines().filter(|line| line.starts_with("sphere,"));
    let impacts: Vec<Impact> = rows
        .map(|row| {
            let n: Vec<f64> = row.split(',').skip(1).map(|x| x.trim().parse().unwrap()).collect();
            (n[0], n[1], n[2])
        })
        .collect();
    assert!(impacts.len() >= 30, "only {} rows", impacts.len());
    oblique(CPU, 3, &impacts, (1e-7, 3e-4), 500.0, whole_step);
}

/// A first touch between two steps: the spring is stretched by the slip of the whole step, although the contact is
/// younger. That is first order in Δt: an extra stretch of up to v_s Δt, which swings with Ω = √(c k_T/k_N) ω, so that
/// Δψ < Ω Δt ψ at worst, and half the step halves it.
#[test]
fn oblique_impacts_between_steps() {
    let rows = TABLE.iter().flat_map(|(ratio, rows)| rows.iter().map(|(psi, out)| (*ratio, *psi, *out)));
    let impacts: Vec<Impact> = rows.collect();
    let errors = |resolution: f64| -> Vec<f64> {
        let out = oblique(CPU, 3, &impacts, (1e-7, 0.1), resolution, |k| 0.618 * k as f64 % 1.0);
        out.iter().zip(&impacts).map(|(o, i)| (o - i.2) / ((3.5 * i.0).sqrt() * i.1)).collect()
    };
    let worst = |errors: &[f64]| errors.iter().fold(0.0_f64, |worst, e| worst.max(e.abs()));
    let (coarse, fine) = (errors(100.0), errors(1600.0));
    let order = (worst(&coarse) / worst(&fine)).log2() / 4.0;
    println!("oblique impacts between steps: worst {:.1e} and {:.1e}, order {order:.2}", worst(&coarse), worst(&fine));
    assert!(worst(&coarse) < PI / 100.0 && order > 0.9, "{coarse:?} {fine:?}");
}

/// MFiX DEM05: aluminium oxide on a wall at 3.9 m/s. Angle from the normal, tangential restitution, spin. The stiffness
/// is 1e6 times that of the source at the same k_T/k_N, because the table is the limit of a small overlap.
#[test]
fn dem05() {
    #[rustfmt::skip]
    const TABLE: [(f64, f64, f64); 10] = [
        (2.5, 0.86512, 22.946), (5.0, 0.80642, 65.798), (10.0, 0.65181, 235.802), (15.0, 0.59409, 409.722),
        (20.0, 0.59312, 542.726), (25.0, 0.62172, 623.492), (30.0, 0.68130, 621.460), (40.0, 0.78072, 549.713),
        (50.0, 0.84561, 461.264), (60.0, 0.89377, 358.800),
    ];
    let (r, v) = (2.5e-3, 3.9);
    let m = 4000.0 * 4.0 / 3.0 * PI * r * r * r;
    let kn = 1.72e7 * 1e6;
    let mut scene = blank(3);
    scene.materials[0].density = 4000.0;
    let tangential_stiffness = 1.48e7 * 1e6;
    scene.pairs[0] = Pair { normal_stiffness: kn, tangential_stiffness, friction: 0.092, dashpot: Dashpot::None };
    scene.walls = vec![floor(3)];
    scene.solver.allow_unstable = true;
    let tc = PI * (m / kn).sqrt();
    let dt = tc / 300.0;
    scene.solver.dt = TimeStep::Fixed(dt);
    for (k, (angle, ..)) in TABLE.iter().enumerate() {
        let (s, c) = angle.to_radians().sin_cos();
        let position = DVec3::new(3.0 * r * k as f64, 0.0, r + 2.000001 * dt * v * c);
        let velocity = DVec3::new(v * s, 0.0, -v * c);
        scene.grains.push(Grain { position, velocity, radius: r, ..grain(0.0, 0.0, 0.0) });
    }
    for (g, (angle, e, spin)) in CPU.after(&scene, 310).iter().zip(TABLE) {
        let vt = v * angle.to_radians().sin();
        close(&format!("{angle} degrees: e_t"), g.velocity.x / vt, e, 1.0, 1e-3);
        close(&format!("{angle} degrees: spin"), g.spin.y, spin, 650.0, 1e-3);
    }
}

/// CO7: equal spheres that meet head-on with opposite spins have no slip: nothing tangential happens, exactly.
#[test]
fn counter_spinning_pair() {
    for bench in engines() {
        let w = omega(3) * 2.0_f64.sqrt();
        let mut scene = blank_dt(3, PI / w / 50.0);
        scene.pairs = vec![law(0.4)];
        for side in [-1.0, 1.0] {
            let mut g = grain(side * 1.001 * R, 0.0, 0.0);
            g.velocity = DVec3::X * -side * 5e-3 * R * w;
            g.spin = DVec3::Z * side * 100.0;
            scene.grains.push(g);
        }
        let after = bench.after(&scene, 80);
        for (g, g0) in after.iter().zip(&scene.grains) {
            assert!(g.velocity.x * g0.velocity.x < 0.0, "they bounce");
            close("sideways", g.velocity.y, 0.0, 5e-3 * R * w, bench.pick(1e-15, 1e-7));
            close("spin", g.spin.z, g0.spin.z, 100.0, bench.pick(1e-15, 1e-7));
        }
    }
}

/// A law so stiff that a grain's weight makes an overlap of 1e-4 R in two and three dimensions.
fn bed_law(dimension: usize, friction: f64) -> Pair {
    let kn = mass(dimension, R) * G / (1e-4 * R);
    Pair { normal_stiffness: kn, tangential_stiffness: 2.0 / 7.0 * kn, friction, dashpot: Dashpot::None }
}

/// Frequency of the tangential spring of a grain that sticks to the floor, 1/s.
fn stick_frequency(dimension: usize) -> f64 {
    ((1.0 + 1.0 / gyration(dimension)) * 2.0 / 7.0 * G / (1e-4 * R)).sqrt()
}

/// R1: slides with -μ g, then rolls at 5/7 (disk 2/3) of the speed. With no dashpot along the tangent, the spring that
/// friction has stretched keeps swinging: with amplitude μ g/Ω around rolling, which is part of the closed form.
#[test]
fn sliding_becomes_rolling() {
    for bench in engines() {
        for dimension in [2, 3] {
            let (mu, v0) = (0.3, 0.05);
            let swing = stick_frequency(dimension);
            let dt = TAU / swing / 64.0;
            let mut scene = blank_dt(dimension, dt);
            scene.pairs = vec![bed_law(dimension, mu)];
            scene.gravity = -G * up(dimension);
            scene.walls = vec![floor(dimension)];
            let mut g = grain(0.0, 0.0, 0.0);
            g.position = up(dimension) * R * (1.0 - 1e-4);
            g.velocity = DVec3::X * v0;
            scene.grains = vec![g];
            let beta = gyration(dimension);
            let (until_rolling, rolling) = (v0 * beta / (1.0 + beta) / (mu * G), v0 / (1.0 + beta));
            let half = (0.5 * until_rolling / dt) as u64;
            let mut simulation = bench.start(&scene);
            simulation.advance(half).unwrap();
            let v = simulation.grains().unwrap()[0].velocity.x;
            // The spring starts at rest and is full within the first step, so friction acts from half a step on.
            assert!(mu * 1e-4 * R / (2.0 / 7.0) < v0 * dt);
            let expected = v0 - mu * G * (half as f64 - 0.5) * dt;
            close("sliding", v, expected, v0, bench.pick(1e-9, 1e-3));
            simulation.advance((1.2 * until_rolling / dt) as u64 - half).unwrap();
            let (mut sum, mut low, mut high, mut slip) = (0.0, INF, -INF, 0.0);
            for _ in 0..5 * 16 {
                simulation.advance(4).unwrap();
                let g = simulation.grains().unwrap()[0];
                let v = g.velocity.x;
                sum += v / 80.0;
                slip += (v + g.spin.cross(-up(dimension) * R).x) / 80.0;
                (low, high) = (v.min(low), v.max(high));
            }
            println!("{} {dimension}D: v/v0 off by {:.1e}, slip {:.1e}", bench.name, (sum - rolling) / v0, slip / v0);
            close("rolling speed", sum, rolling, v0, bench.pick(2e-4, 2e-3));
            close("slip", slip, 0.0, v0, bench.pick(2e-4, 2e-3));
            let amplitude = mu * G / swing;
            close("swing", 0.5 * (high - low), amplitude, amplitude, bench.pick(0.02, 0.1));
        }
    }
}

/// R2: from rest on an incline, rolls without slip iff tan θ ≤ (1 + 1/β) μ; accelerations and growth of the slip. The
/// plane is tilted, not gravity. Averages over whole swings of the spring.
#[test]
fn incline() {
    for dimension in [2, 3] {
        let theta: f64 = 0.3;
        let c = 1.0 + 1.0 / gyration(dimension);
        let swings = 64;
        let dt = TAU / stick_frequency(dimension) / f64::from(swings);
        let ratios = [0.3, 0.98, 1.02, 1.5, 3.0]; // tan θ over its threshold
        let mut scene = blank_dt(dimension, dt);
        let laws: Vec<Pair> = ratios.iter().map(|r| bed_law(dimension, theta.tan() / c / r)).collect();
        set_laws(&mut scene, &laws);
        let (normal, down) = if dimension == 2 {
            (DVec3::new(theta.sin(), theta.cos(), 0.0), DVec3::new(theta.cos(), -theta.sin(), 0.0))
        } else {
            (DVec3::new(0.0, theta.sin(), theta.cos()), DVec3::new(0.0, theta.cos(), -theta.sin()))
        };
        scene.gravity = -G * up(dimension);
        scene.walls = vec![plane(DVec3::ZERO, normal)];
        for material in 0..ratios.len() as u32 {
            let along = if dimension == 2 { down } else { DVec3::X };
            let position = normal * R * (1.0 - 1e-4 * theta.cos()) + 8.0 * R * f64::from(material) * along;
            scene.grains.push(Grain { position, material, ..grain(0.0, 0.0, 0.0) });
        }
        let mut simulation = CPU.start(&scene);
        let mut mean = || {
            let mut sums = vec![(0.0, 0.0); ratios.len()];
            for _ in 0..swings {
                simulation.advance(1).unwrap();
                for (sum, g) in sums.iter_mut().zip(simulation.grains().unwrap()) {
                    let v = g.velocity.dot(down) / f64::from(swings);
                    sum.0 += v;
                    sum.1 += v + g.spin.cross(-R * normal).dot(down) / f64::from(swings);
                }
            }
            let now = simulation.time();
            simulation.advance(2000).unwrap();
            (now, sums)
        };
        mean(); // the start, with its transient
        let (t0, before) = mean();
        let (t1, after) = mean();
        for (k, ratio) in ratios.iter().enumerate() {
            let mu = theta.tan() / c / ratio;
            let (a, slip) = ((after[k].0 - before[k].0) / (t1 - t0), (after[k].1 - before[k].1) / (t1 - t0));
            let (expected, expected_slip) = if *ratio <= 1.0 {
                (G * theta.sin() * (c - 1.0) / c, 0.0)
            } else {
                (G * (theta.sin() - mu * theta.cos()), G * (theta.sin() - c * mu * theta.cos()))
            };
            println!("{dimension}D {ratio}: a {:.1e}, slip {:.1e}", a / expected - 1.0, (slip - expected_slip) / G);
            close("acceleration", a, expected, G, 3e-4);
            close("growth of slip", slip, expected_slip, G, 3e-4);
        }
    }
}

/// A grain squeezed between two plates cannot roll, so it is a block on a frictional surface: it rests iff the pull is at
/// most 2 μ N. Damped critically, rest is at pull/2k_T and sliding at (pull − 2 μ N)/m ξ.
fn squeezed(dimension: usize, ratios: &[f64]) -> (Assembly, f64, f64, f64) {
    let overlap = 1e-3 * R;
    let m = mass(dimension, R);
    let kt = 2.0 / 7.0 * KN;
    let frequency = (2.0 * kt / m).sqrt();
    let pull = 2.0 * KN * overlap * 0.4; // N, along x
    let mut scene = blank_dt(dimension, 0.05 / frequency);
    let laws: Vec<Pair> = ratios.iter().map(|r| law(0.4 / r)).collect();
    set_laws(&mut scene, &laws);
    scene.gravity = DVec3::X * pull / m;
    scene.solver.damping = 2.0 * frequency;
    let n = up(dimension);
    scene.walls = vec![plane(-n * (R - overlap), n), plane(n * (R - overlap), -n)];
    for material in 0..ratios.len() as u32 {
        let along = if dimension == 2 { DVec3::X } else { DVec3::Y };
        scene.grains.push(Grain { material, position: 3.0 * R * f64::from(material) * along, ..grain(0.0, 0.0, 0.0) });
    }
    (scene, pull, kt, m)
}

#[test]
fn block_between_plates() {
    let ratios = [0.5, 0.99, 1.01, 2.0]; // pull over its threshold
    for bench in engines() {
        for dimension in [2, 3] {
            let (scene, pull, kt, m) = squeezed(dimension, &ratios);
            let after = bench.after(&scene, 700);
            for ((g, g0), ratio) in after.iter().zip(&scene.grains).zip(ratios) {
                let limit = pull / ratio; // 2 μ N
                let rest = pull / (2.0 * kt);
                let terminal = (pull - limit) / m / scene.solver.damping;
                let what = format!("{} {dimension}D ratio {ratio}", bench.name);
                close(
                    &format!("{what}: spin"),
                    g.spin.length() * R,
                    0.0,
                    pull / m / scene.solver.damping,
                    bench.pick(1e-12, 1e-3),
                );
                if ratio < 1.0 {
                    close(&what, g.position.x - g0.position.x, rest, rest, bench.pick(1e-9, 5e-3));
                    close(&what, g.velocity.x, 0.0, pull / m / scene.solver.damping, bench.pick(1e-9, 1e-3));
                } else {
                    // f32: the overlap of 1e-3 R is only known to 1e-4 to 1e-3, and with it the limit.
                    close(&what, g.velocity.x, terminal, pull / m / scene.solver.damping, bench.pick(1e-9, 2e-3));
                }
            }
        }
    }
}

/// N8: columns at rest; the contact below grain i of n carries (n − i) weights.
#[test]
fn columns_at_rest() {
    for bench in engines() {
        for (dimension, n) in [(2, 2), (3, 2), (2, 5), (3, 5)] {
            let m = mass(dimension, R);
            let kn = m * G / (5e-3 * R);
            let w = (kn / m).sqrt();
            let mut scene = blank_dt(dimension, 0.2 / w);
            scene.pairs = vec![Pair { normal_stiffness: kn, ..law(0.0) }];
            scene.gravity = -G * up(dimension);
            scene.solver.damping = 0.6 * w;
            scene.walls = vec![floor(dimension)];
            let at = |k: usize| Grain { position: up(dimension) * R * (1.0 + 2.0 * k as f64), ..grain(0.0, 0.0, 0.0) };
            scene.grains = (0..n).map(at).collect();
            let mut simulation = bench.start(&scene);
            simulation.advance(700).unwrap();
            let grains = simulation.grains().unwrap();
            let mut below = -R;
            for (k, g) in grains.iter().enumerate() {
                let height = g.position.dot(up(dimension));
                let overlap = 2.0 * R - (height - below);
                let expected = (n - k) as f64 * m * G / kn;
                // f32: ulp of 9 mm, 9e-10 m, over 5e-6 m.
                close(bench.name, overlap, expected, expected, bench.pick(1e-10, 4e-4));
                below = height;
            }
            let sample = simulation.sample().unwrap();
            assert_eq!(sample.contacts, n as u64);
            // A weight is 5e-3 R of overlap, of which f32 resolves 2e-4.
            assert!(sample.unbalanced_force_ratio < bench.pick(1e-10, 1e-3), "{sample:?}");
        }
    }
}

/// N9: touching elastic spheres, and N10: the same with gaps. Numbers of the linear chain, independent of k, m, v.
#[test]
fn newtons_cradle() {
    const TOUCHING: [&[f64]; 4] = [
        &[0.0, 1.0],
        &[-0.130262, 0.150230, 0.980032],
        &[-0.132275, -0.064975, 0.236978, 0.960272],
        &[-0.132279, -0.075329, -0.031011, 0.296218, 0.942402],
    ];
    let w = omega(3) * 2.0_f64.sqrt();
    let v = 5e-3 * R * w;
    let scene = |resolution: f64| {
        let mut scene = blank_dt(3, PI / w / resolution);
        for (row, chain) in TOUCHING.iter().enumerate() {
            for gap in [0.0, 0.05 * R] {
                for k in 0..chain.len() {
                    let y = 3.0 * R * row as f64 + if gap > 0.0 { 15.0 * R } else { 0.0 };
                    let mut g = grain((2.0 * R + gap) * k as f64, y, 0.0);
                    g.velocity.x = if k == 0 { v } else { 0.0 };
                    scene.grains.push(g);
                }
            }
        }
        scene
    };
    let check = |bench: Bench, resolution: f64, touching: f64, apart: f64| {
        // Five gaps of 0.05 R at 5e-3 R ω, and the contacts: 0.05/5e-3/π = 3.2 tc per gap.
        let grains = bench.after(&scene(resolution), (20.0 * resolution) as u64);
        let mut rest = grains.as_slice();
        for chain in TOUCHING {
            for (k, expected) in chain.iter().enumerate() {
                close("touching", rest[k].velocity.x / v, *expected, 1.0, touching);
                let last = if k + 1 == chain.len() { 1.0 } else { 0.0 };
                close("apart", rest[chain.len() + k].velocity.x / v, last, 1.0, apart);
            }
            rest = &rest[2 * chain.len()..];
        }
    };
    check(CPU, 500.0, 1e-5, 1e-4);
    for bench in engines() {
        check(bench, 50.0, bench.pick(1e-3, 3e-3), bench.pick(5e-3, 5e-3));
    }
}

/// A belt (plane moving along itself) sets a free grain rolling at β/(1+β) of its speed, two belts with the grain
/// between them carry it at their speed, and belts that run against each other only spin it.
#[test]
fn belts() {
    for dimension in [2, 3] {
        let n = up(dimension);
        let u = 0.02;
        let m = mass(dimension, R);
        let weight = m * G;
        let kn = bed_law(dimension, 0.3).normal_stiffness;
        let overlap = weight / kn;
        let beta = gyration(dimension);
        // velocity of the floor, of a ceiling if any, and what the grain should do: speed, surface speed of the spin
        let cases = [(u, None, u * beta / (1.0 + beta), u / (1.0 + beta)), (u, Some(u), u, 0.0), (u, Some(-u), 0.0, u)];
        for (below, above, speed, spinning) in cases {
            let swing = stick_frequency(dimension);
            let dt = TAU / (2.0 * swing) / 40.0;
            let mut scene = blank_dt(dimension, dt);
            scene.pairs = vec![bed_law(dimension, 0.3)];
            scene.walls = vec![plane(-n * (R - overlap), n)];
            scene.walls[0].velocity = DVec3::X * below;
            match above {
                None => scene.gravity = -G * n,
                Some(above) => {
                    scene.walls.push(plane(n * (R - overlap), -n));
                    scene.walls[1].velocity = DVec3::X * above;
                }
            }
            scene.grains = vec![grain(0.0, 0.0, 0.0)];
            let mut simulation = CPU.start(&scene);
            simulation.advance(3 * (u / (0.3 * G) / dt) as u64).unwrap();
            let samples = 2000;
            let (mut v, mut s) = (0.0, 0.0);
            for _ in 0..samples {
                simulation.advance(1).unwrap();
                let g = simulation.grains().unwrap()[0];
                v += g.velocity.x / f64::from(samples);
                // The floor drags the lower side along +x: ω × (-R n) points along +x.
                s += g.spin.cross(-R * n).x / f64::from(samples);
            }
            close("speed", v, speed, u, 1e-3);
            close("surface speed", s, spinning, u, 1e-3);
            let moved = simulation.walls().unwrap()[0].surface;
            let packstone::scene::Surface::Plane { point, .. } = moved else { panic!("a plane") };
            close("wall", point.x, below * simulation.time(), R, 1e-9);
        }
    }
}

/// A grain that rides on the inside of a spinning drum without gravity: no slip, constant speed, exactly on a circle
/// with overlap m Ω² r/k. Leapfrog shifts the phase by (Ω Δt)²/24 of it and the radius as little.
#[test]
fn riding_a_drum() {
    for bench in engines() {
        for dimension in [2, 3] {
            for sign in [-1.0, 1.0] {
                let (drum, steps) = (5.0 * R, 800);
                let m = mass(dimension, R);
                let spin = sign * 0.03 * omega(dimension);
                let overlap = m * spin * spin * (drum - R) / (KN - m * spin * spin);
                let r = drum - R + overlap;
                let dt = TAU / spin.abs() / 2.0 / f64::from(steps); // half a turn
                let mut scene = blank_dt(dimension, dt);
                scene.solver.allow_unstable = true;
                scene.pairs = vec![law(0.5)];
                let mut wall = cylinder(drum);
                wall.spin = spin;
                scene.walls = vec![wall];
                let mut g = grain(r, 0.0, 0.0);
                g.velocity = DVec3::Y * spin * r;
                g.spin = DVec3::Z * spin;
                scene.grains = vec![g];
                let after = bench.after(&scene, steps as u64)[0];
                let tolerance = bench.pick(2e-5, 1e-3);
                close("x", after.position.x, -r, r, tolerance);
                close("y", after.position.y, 0.0, r, tolerance);
                close("spin", after.spin.z, spin, spin.abs(), tolerance);
                close("speed", after.velocity.y, -spin * r, (spin * r).abs(), tolerance);
            }
        }
    }
}

/// A grain at rest at the bottom of a spinning drum slides: its spin grows by μ g/(β R) per second and it is pushed along
/// with μ g, both in the sense of the drum.
#[test]
fn slipping_in_a_drum() {
    for sign in [-1.0, 1.0] {
        let (mu, drum) = (0.05, 20.0 * R);
        let dt = 0.05 / stick_frequency(2);
        let mut scene = blank_dt(2, dt);
        scene.pairs = vec![bed_law(2, mu)];
        scene.gravity = -G * DVec3::Y;
        let mut wall = cylinder(drum);
        wall.spin = sign * 100.0;
        scene.walls = vec![wall];
        scene.grains = vec![grain(0.0, -(drum - R * (1.0 - 1e-4)), 0.0)];
        let g = CPU.after(&scene, 400)[0];
        let t = 400.0 * dt;
        close("spin", g.spin.z, sign * mu * G * t / (0.5 * R), mu * G * t / (0.5 * R), 1e-2);
        close("push", g.velocity.x, sign * mu * G * t, mu * G * t, 1e-2);
    }
}

/// Small swings inside a circle: T = 2π √(L/g) without friction, L the distance of the centres, and √(1 + β) times as
/// long for a grain that rolls. Amplitude a adds a²/16; the tangential spring's own compliance adds g/(Ω² L) or so.
#[test]
fn pendulum() {
    for (dimension, friction) in [(2, 0.0), (2, 0.8), (3, 0.8)] {
        let drum = 6.0 * R;
        let length = drum - R + 1e-4 * R;
        let (amplitude, dt) = (0.02_f64, 0.1 / stick_frequency(2));
        let mut scene = blank_dt(dimension, dt);
        scene.pairs = vec![bed_law(dimension, friction)];
        scene.gravity = -G * DVec3::Y;
        scene.walls = vec![cylinder(drum)];
        let at = length * DVec3::new(amplitude.sin(), -amplitude.cos(), 0.0);
        scene.grains = vec![grain(at.x, at.y, 0.0)];
        let mut simulation = CPU.start(&scene);
        let factor = if friction > 0.0 { (1.0 + gyration(dimension)).sqrt() } else { 1.0 };
        let period = TAU * (length / G).sqrt() * factor;
        // Time between the first and the third passage through the bottom.
        let mut passages = Vec::new();
        let mut last = at.x;
        while passages.len() < 3 && simulation.time() < 2.0 * period {
            simulation.advance(1).unwrap();
            let x = simulation.grains().unwrap()[0].position.x;
            if last * x < 0.0 {
                passages.push(simulation.time() - dt * x / (x - last));
            }
            last = x;
        }
        let found = passages[2] - passages[0];
        println!("pendulum {dimension}D friction {friction}: {:.1e}", found / period - 1.0);
        close("period", found, period, period, 3e-4);
    }
}

/// Observed order from three time steps: log₂ of the ratio of the differences.
fn order(scene: &Assembly, end: f64, coarsest: u64) -> f64 {
    let at = |steps: u64| {
        let mut scene = scene.clone();
        scene.solver.dt = TimeStep::Fixed(end / steps as f64);
        scene.solver.allow_unstable = true;
        CPU.after(&scene, steps)
    };
    let (a, b, c) = (at(coarsest), at(2 * coarsest), at(4 * coarsest));
    (distance(scene, &a, &b) / distance(scene, &b, &c)).log2()
}

/// Second order wherever no contact opens, closes or slides.
#[test]
fn second_order() {
    let w = omega(3);
    // An overlapping pair of unequal spheres swings open.
    let mut pair = blank(3);
    pair.grains = vec![grain(0.0, 0.0, 0.0), Grain { radius: 0.7 * R, ..grain(1.0 * R, 1.3 * R, 0.2 * R) }];
    // A damped grain bobs on the floor.
    let mut bobbing = blank(3);
    bobbing.walls = vec![floor(3)];
    bobbing.grains = vec![grain(0.0, 0.0, 0.98 * R)];
    bobbing.grains[0].velocity.z = 0.005 * R * w;
    bobbing.gravity = -0.02 * R * w * w * DVec3::Z;
    bobbing.solver.damping = 0.3 * w;
    // A grain that sticks to the floor swings on its tangential spring.
    let mut sticking = bobbing.clone();
    sticking.solver.damping = 0.0;
    sticking.pairs = vec![law(100.0)];
    sticking.grains[0].velocity.x = 0.005 * R * w;
    sticking.grains[0].spin = DVec3::new(0.001, 0.002, 0.003) * w;
    // Three grains in a ring, pressed together and turning about each other.
    let mut ring = blank(3);
    for k in 0..3 {
        let direction = DVec3::new((TAU * f64::from(k) / 3.0).cos(), (TAU * f64::from(k) / 3.0).sin(), 0.0);
        let mut g = grain(0.0, 0.0, 0.0);
        g.position = 1.1 * R * direction;
        g.velocity = 0.05 * w * DVec3::new(0.1, 0.2, 1.0).cross(g.position);
        ring.grains.push(g);
    }
    let cases = [("pair", pair, 1.0), ("bobbing", bobbing, 3.0), ("sticking", sticking, 3.0), ("ring", ring, 0.8)];
    for (name, scene, end) in cases {
        let order = order(&scene, end / w, 40);
        println!("order of {name}: {order:.3}");
        assert!(order >= 1.9, "order of {name}: {order}");
    }
}
