//! Oblique impact: the tangential spring with its Coulomb limit.

use crate::{common::*, shared::*};
use glam::DVec3;
use packstone::scene::{Grain, Pair, TimeStep};
use std::f64::consts::PI;

/// One oblique impact on a wall: k_T/k_N, ψ = v_s/(μ v_n) in, ψ expected out.
type Impact = (f64, f64, f64);

const FRICTION: f64 = 0.3;

/// All impacts at once, next to each other on one floor, in different directions. Returns ψ out of each, after checking
/// what else the closed form says. `depth` is the overlap in radii: the closed form is the limit of depth 0. `phase` of
/// a grain is the part of its first step in contact that it is away from the wall.
fn oblique(
    bench: Bench,
    dimension: usize,
    impacts: &[Impact],
    (depth, tolerance): (f64, f64),
    resolution: f64,
    phase: fn(usize) -> f64,
    variant: Variant,
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
    let grains = variant.after(&bench, &scene, resolution as u64 + 5);
    let mut out = Vec::new();
    for (k, (g, (ratio, psi, expected))) in grains.iter().zip(impacts).enumerate() {
        assert!(g.position.dot(n) > R, "grain {k} is still in contact");
        let unit = FRICTION * vn;
        let slip = g.velocity - g.velocity.dot(n) * n + g.spin.cross(-R * n);
        let found = slip.dot(direction(k)) / unit;
        let what = format!("{} {variant:?} {dimension}D kt/kn {ratio} psi {psi}", bench.name);
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
            for variant in variants(dimension) {
                oblique(bench, dimension, &impacts, (depth, tolerance), 200.0, whole_step, variant);
            }
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
        for variant in variants(3) {
            let out = oblique(bench, 3, &impacts, (depth, tolerance), 200.0, whole_step, variant);
            let worst = out.iter().zip(&impacts).map(|(o, i)| (o - i.2).abs()).fold(0.0, f64::max);
            println!("{} {variant:?}: worst psi error {worst:.1e}", bench.name);
        }
    }
}

/// The same from a table with more rows: the closed form, evaluated independently.
#[test]
fn oblique_impacts_of_the_table() {
    let text = include_str!("../data/oblique_sphere.csv");
    let rows = text.lines().filter(|line| line.starts_with("sphere,"));
    let impacts: Vec<Impact> = rows
        .map(|row| {
            let n: Vec<f64> = row.split(',').skip(1).map(|x| x.trim().parse().unwrap()).collect();
            (n[0], n[1], n[2])
        })
        .collect();
    assert!(impacts.len() >= 30, "only {} rows", impacts.len());
    oblique(CPU, 3, &impacts, (1e-7, 3e-4), 500.0, whole_step, AT_REST);
}

/// A first touch between two steps: the spring is stretched by the slip of the whole step, although the contact is
/// younger. That is first order in Δt: an extra stretch of up to v_s Δt, which swings with Ω = √(c k_T/k_N) ω, so that
/// Δψ < Ω Δt ψ at worst, and half the step halves it.
#[test]
fn oblique_impacts_between_steps() {
    let rows = TABLE.iter().flat_map(|(ratio, rows)| rows.iter().map(|(psi, out)| (*ratio, *psi, *out)));
    let impacts: Vec<Impact> = rows.collect();
    let errors = |resolution: f64| -> Vec<f64> {
        let out = oblique(CPU, 3, &impacts, (1e-7, 0.1), resolution, |k| 0.618 * k as f64 % 1.0, AT_REST);
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
    scene.pairs[0] = Pair { normal_stiffness: kn, tangential_stiffness, friction: 0.092, ..Pair::default() };
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
