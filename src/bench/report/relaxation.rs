//! What the report says of relaxations: passes and times, how they grow with the bed, and who is fastest.

use super::format::{met, short};
use crate::bench::results::{Point, RelaxationRow};
use std::fmt::Write;

const MARKS: [&str; 3] = ["1e-2", "1e-3", "1e-4"];
/// Beds from which on the accelerated relaxations of the gpu engine are to be faster than Gauss-Seidel on the cpu.
const LARGE: usize = 9000;
/// Beds from which on growth counts: smaller ones are hardly deeper than the reach of their floor.
const SMALL: usize = 900;

pub fn write(text: &mut String, points: &[&Point], rows: &[RelaxationRow]) {
    for failed in points.iter().filter(|p| !p.passed()) {
        let _ = writeln!(text, "{} on the {}: {}\n", failed.case, failed.engine, failed.status);
    }
    let mut cases: Vec<&str> = rows.iter().map(|row| row.case.as_str()).collect();
    cases.dedup();
    for case in &cases {
        let own: Vec<&RelaxationRow> = rows.iter().filter(|row| row.case == *case).collect();
        let _ = writeln!(text, "### {case}: {} grains, {} contacts\n", own[0].grains, own[0].contacts);
        table(text, &own);
        fastest(text, &own);
        ratio(text, &own);
        text.push('\n');
    }
    let deep: Vec<&RelaxationRow> = rows.iter().filter(|row| row.grains >= SMALL).collect();
    if deep.iter().any(|row| row.case != deep[0].case) {
        growth(text, &deep);
    }
}

fn name(row: &RelaxationRow) -> String {
    format!("{}, {}", row.solver, row.engine)
}

fn heading(text: &mut String, header: &str) {
    let _ = writeln!(text, "| {header} |\n|{}", " --- |".repeat(header.split('|').count()));
}

fn table(text: &mut String, rows: &[&RelaxationRow]) {
    heading(
        text,
        "solver | engine | passes, s to 1e-2 | to 1e-3 | to 1e-4 | at the end: passes | s | residual | contacts × passes/s",
    );
    for row in rows {
        let mark = |mark: Option<(u32, f64)>| mark.map_or("-".to_owned(), |(n, s)| format!("{n}, {}", short(s)));
        let mut cells = vec![row.solver.clone(), row.engine.to_owned()];
        cells.extend(row.marks().map(mark));
        cells.extend([row.passes.to_string(), short(row.seconds), format!("{:.1e}", row.residual)]);
        cells.push(short(row.contact_passes_per_second));
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
}

fn fastest(text: &mut String, rows: &[&RelaxationRow]) {
    let of = |k: usize| {
        let reached = rows.iter().filter_map(|row| Some((row, row.marks()[k]?.1)));
        let first = reached.min_by(|a, b| a.1.total_cmp(&b.1));
        let words = first.map_or("none".to_owned(), |(row, s)| format!("{} ({} s)", name(row), short(s)));
        format!("to {}: {words}", MARKS[k])
    };
    let _ = writeln!(text, "\nFastest {}.", [of(0), of(1), of(2)].join("; "));
}

/// The fastest accelerated relaxation of the gpu engine beside the fastest order of Gauss-Seidel.
fn ratio(text: &mut String, rows: &[&RelaxationRow]) {
    let target = rows[0].grains >= LARGE;
    let best = |k: usize, of: &dyn Fn(&RelaxationRow) -> bool| {
        rows.iter().filter(|r| of(r)).filter_map(|r| Some(r.marks()[k]?.1)).min_by(f64::total_cmp)
    };
    let swept = |row: &RelaxationRow| row.solver.starts_with("gauss-seidel");
    // One that has not got there has taken longer than all its time.
    let spent = rows.iter().filter(|r| swept(r)).map(|r| r.seconds).min_by(f64::total_cmp);
    let Some(spent) = spent else { return };
    for (k, mark) in MARKS.iter().enumerate() {
        let Some(gpu) = best(k, &|row| row.engine == "gpu" && row.solver.ends_with("-accelerated")) else { continue };
        let sweeps = best(k, &swept);
        let (more, ratio) = (if sweeps.is_none() { "more than " } else { "" }, sweeps.unwrap_or(spent) / gpu);
        let verdict = match sweeps {
            _ if !target => String::new(),
            None if ratio < 1.0 => " (at least 1: not decided)".to_owned(),
            _ => format!(" (at least 1: {})", met(ratio >= 1.0)),
        };
        let _ = writeln!(
            text,
            "\nTo {mark} gauss-seidel in its fastest order takes {more}{} × the time of the fastest accelerated relaxation on \
             the gpu engine{verdict}.",
            short(ratio)
        );
    }
}

/// Exponents of passes and of seconds with the number of grains, over the beds where a solver got there.
fn growth(text: &mut String, rows: &[&RelaxationRow]) {
    text.push_str(
        "### Growth with the number of grains\n\nExponents b of least squares, passes or seconds ~ grains^b, ",
    );
    text.push_str("over the beds (how many) where a run got there.\n\n");
    heading(text, "solver | engine | beds | passes to 1e-2 | seconds | beds | passes to 1e-3 | seconds");
    let mut names: Vec<String> = Vec::new();
    for row in rows {
        if names.contains(&name(row)) {
            continue;
        }
        names.push(name(row));
        let mut cells = vec![row.solver.clone(), row.engine.to_owned()];
        for k in [0, 1] {
            let reached: Vec<(f64, u32, f64)> = rows
                .iter()
                .filter(|other| name(other) == name(row))
                .filter_map(|r| r.marks()[k].map(|(passes, seconds)| (r.grains as f64, passes, seconds)))
                .collect();
            let slope = |of: fn(&(f64, u32, f64)) -> f64| {
                let slope = exponent(reached.iter().map(|r| (r.0, of(r))));
                slope.map_or("-".to_owned(), |b| format!("{b:.2}"))
            };
            cells.extend([reached.len().to_string(), slope(|r| f64::from(r.1)), slope(|r| r.2)]);
        }
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
}

/// The slope of a straight line through logarithms; None of less than two points.
fn exponent(points: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let logarithms: Vec<(f64, f64)> = points.map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logarithms.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logarithms.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| logarithms.iter().map(of).sum::<f64>();
    (n > 1.0).then(|| sum(&|p| (p.0 - x) * (p.1 - y)) / sum(&|p| (p.0 - x).powi(2)))
}

#[cfg(test)]
mod tests {
    use super::exponent;

    #[test]
    fn powers_have_their_exponent() {
        let power = |x: f64| (x, 3.0 * x.powf(0.4));
        assert!((exponent([1e3, 1e4, 1e5].map(power).into_iter()).unwrap() - 0.4).abs() < 1e-12);
        assert!(exponent([power(1e3)].into_iter()).is_none());
    }
}
