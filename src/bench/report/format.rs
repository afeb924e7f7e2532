//! Tables and numbers of a report.

use crate::bench::results::{Point, Suite};
use std::fmt::Write;

/// Rows of points, with the columns that they fill.
pub fn table(text: &mut String, points: &[&Point]) {
    let ensembles = points.iter().any(|p| p.value.is_some());
    let speed = points.iter().any(|p| p.suite == Suite::Speed);
    let mut header = vec!["engine", "precision", "dt", "error"];
    if ensembles {
        header.extend(["value", "standard errors"]);
    }
    header.extend(["wall s per s", "particle-steps/s", "ms/step", "bytes/grain", "front"]);
    if speed {
        header.extend(["bytes/particle-step", "of copy"]);
        header.insert(0, "case");
    }
    let _ = writeln!(text, "| {} |\n|{}", header.join(" | "), " --- |".repeat(header.len()));
    for p in points {
        let error = if p.passed() { p.error.map_or("reference".to_owned(), short) } else { p.status.clone() };
        let mut cells = vec![p.engine.to_owned(), p.precision.to_owned(), format!("× {}", p.dt_over_auto), error];
        if ensembles {
            let value = p.value.zip(p.spread).map_or(String::new(), |(v, s)| format!("{v:.5} ± {s:.1e}"));
            cells.extend([value, p.standard_errors.map_or(String::new(), |e| format!("{e:.1}"))]);
        }
        let number = |x: Option<f64>| x.map_or(String::new(), short);
        cells.extend([number(p.wall_per_simulated), number(p.particle_steps_per_second)]);
        cells.push(p.ms_per_step.map_or(String::new(), |x| format!("{x:.3}")));
        cells.push(p.bytes_per_particle.map_or(String::new(), |x| format!("{x:.0}")));
        cells.push(if p.pareto { "★" } else { "" }.to_owned());
        if speed {
            cells.extend([number(p.bytes_per_step), p.copy_fraction.map_or(String::new(), percent)]);
            cells.insert(0, p.case.clone());
        }
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
}

pub fn met(yes: bool) -> &'static str {
    if yes { "met" } else { "missed" }
}

pub fn percent(x: f64) -> String {
    format!("{:.1} %", 100.0 * x)
}

/// Three digits.
pub fn short(x: f64) -> String {
    match x.abs() {
        size if !(1e-2..1e4).contains(&size) => format!("{x:.2e}"),
        size if size >= 100.0 => format!("{x:.0}"),
        size if size >= 10.0 => format!("{x:.1}"),
        size if size >= 1.0 => format!("{x:.2}"),
        _ => format!("{x:.4}"),
    }
}
