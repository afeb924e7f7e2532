//! Where grains go: two closed forms, and a collapse against a reference at a sixteenth of the step.

use super::{
    log::{Log, Measure, again, no_reference},
    trial::{self, Cost, Setting, displacement, largest, rms, scene},
};
use crate::{
    Result,
    scene::{Assembly, Grain},
};
use glam::DVec3;

pub fn run(log: &mut Log) {
    let factors: &[f64] = log.pick(&[0.5, 1.0, 2.0], &[0.125, 0.25, 0.5, 1.0, 2.0, 4.0]);
    let settings = log.settings(factors);
    closed_form(log, &settings, "oblique impact", oblique(), 128, slip_errors);
    closed_form(log, &settings, "cradle", scene("cradle", include_str!("scenes/cradle.toml"), &[]), 400, cradle_errors);
    collapse(log, &settings);
}

/// A case whose end is known.
fn closed_form(
    log: &mut Log,
    settings: &[Setting],
    case: &str,
    start: Result<Assembly>,
    steps: u64,
    errors: fn(&[Grain]) -> Vec<Measure>,
) {
    for setting in settings {
        log.run(case, *setting, || {
            let start = start.as_ref().map_err(again)?;
            let (grains, cost) = trial::run(start, *setting, steps)?;
            Ok((cost, errors(&grains)))
        });
    }
}

/// Verification T1 to T3: k_T / k_N as the index of the material in `oblique.toml`, ψ = v_s / (μ v_n) before the
/// impact, and after it. Below 1 in ψ the contact sticks at once, far above it slips throughout, in between it does
/// both.
const OBLIQUE: &[(u32, f64, f64)] = &[
    // 2/7: the super-ball
    (0, 0.5, -0.5),
    (0, 1.0, -1.0),
    (0, 2.0, -2.0),
    (0, 3.0, -3.0),
    (0, 4.0, -3.0),
    (0, 6.0, -1.0),
    (0, 10.0, 3.0),
    // 1/2
    (1, 0.5, -0.303_510_670_1),
    (1, 1.0, -0.666_578_988_9),
    (1, 1.5, -1.067_882_117_4),
    (1, 3.0, -2.311_380_680_4),
    (1, 4.0, -2.524_819_187_7),
    (1, 5.0, -2.0),
    (1, 7.5, 0.5),
    // 1
    (2, 0.5, 0.424_911_429_3),
    (2, 1.5, 0.288_594_072_0),
    (2, 2.0, -0.203_591_867_5),
    (2, 3.0, -0.999_538_854_7),
    (2, 4.0, -1.456_513_043_1),
    (2, 5.0, -1.520_969_699_1),
    (2, 7.5, 0.5),
];
/// μ v_n of `oblique.toml`, m/s.
const OBLIQUE_UNIT: f64 = 0.25 * 5e-4;

fn oblique() -> Result<Assembly> {
    let mut assembly = scene("oblique", include_str!("scenes/oblique.toml"), &[])?;
    let first = assembly.grains[0];
    let row = |(k, (material, psi, _)): (usize, &(u32, f64, f64))| Grain {
        // Side by side, and a little above the wall: the first touch falls somewhere between two steps.
        position: first.position + DVec3::new(0.0, 0.03 * k as f64, 3e-8),
        velocity: first.velocity + DVec3::X * *psi * OBLIQUE_UNIT,
        material: *material,
        ..first
    };
    assembly.grains = OBLIQUE.iter().enumerate().map(row).collect();
    Ok(assembly)
}

/// ψ after the impact against the closed form.
fn slip_errors(grains: &[Grain]) -> Vec<Measure> {
    // Contact point: v + ω × (-R e_z).
    let psi = grains.iter().map(|g| (g.velocity.x - g.spin.y * g.radius) / OBLIQUE_UNIT);
    let errors = psi.zip(OBLIQUE).map(|(psi, (_, _, exact))| (psi - exact).abs()).collect::<Vec<_>>();
    of_list("psi", "mu v_n", &errors)
}

/// Verification N9, N = 5, over the speed of the first grain.
const CRADLE: [f64; 5] = [-0.132_279, -0.075_329, -0.031_011, 0.296_218, 0.942_402];
/// m/s
const CRADLE_SPEED: f64 = 1e-3;

fn cradle_errors(grains: &[Grain]) -> Vec<Measure> {
    let differences =
        grains.iter().zip(CRADLE).map(|(g, exact)| (g.velocity / CRADLE_SPEED - DVec3::X * exact).length());
    of_list("velocity", "v_0", &differences.collect::<Vec<_>>())
}

/// RMS, and worst.
fn of_list(quantity: &'static str, unit: &'static str, errors: &[f64]) -> Vec<Measure> {
    let worst = if quantity == "psi" { "psi worst" } else { "velocity worst" };
    vec![
        Measure::error(quantity, unit, rms(errors.iter().map(|e| e * e))),
        Measure::error(worst, unit, largest(errors.iter().copied())),
    ]
}

/// Over so many automatic steps: contacts close and slip, and differences have not yet grown into chaos.
const COLLAPSE_STEPS: u64 = 400;

fn collapse(log: &mut Log, settings: &[Setting]) {
    const CASE: &str = "collapse";
    let start = scene("collapse", include_str!("scenes/collapse.toml"), &[]);
    let run =
        |setting| -> Result<(Vec<Grain>, Cost)> { trial::run(start.as_ref().map_err(again)?, setting, COLLAPSE_STEPS) };
    let mut reference = None;
    log.run(CASE, Setting::REFERENCE, || {
        let (grains, cost) = run(Setting::REFERENCE)?;
        reference = Some(grains);
        Ok((cost, vec![Measure::reference("displacement", "mean radii")]))
    });
    for setting in settings {
        log.run(CASE, *setting, || {
            let (grains, cost) = run(*setting)?;
            let reference = reference.as_ref().ok_or_else(no_reference)?;
            let error = displacement(start.as_ref().map_err(again)?, &grains, reference);
            Ok((cost, vec![Measure::error("displacement", "mean radii", error)]))
        });
    }
}
