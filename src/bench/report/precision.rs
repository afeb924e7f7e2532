//! What the report says of precision: figures of hard cases beside f64, and long runs decade by decade.

use super::format::short;
use crate::bench::results::Point;
use std::fmt::Write;

pub fn write(text: &mut String, points: &[&Point]) {
    for failed in points.iter().filter(|p| !p.passed()) {
        let _ = writeln!(text, "{} on the {}: {}\n", failed.case, failed.engine, failed.status);
    }
    let (long, figures): (Vec<&Point>, Vec<&Point>) =
        points.iter().filter(|p| p.passed()).partition(|p| p.steps.is_some());
    of_figures(text, &figures);
    text.push('\n');
    by_decade(text, &long);
}

fn error(point: Option<&&Point>) -> String {
    point.and_then(|p| p.error).map_or(String::new(), short)
}

/// Errors of both engines beside what is right on the device.
fn of_figures(text: &mut String, points: &[&Point]) {
    text.push_str("| error | cpu f64 | gpu f32 | right up to |\n| --- | --- | --- | --- |\n");
    for group in groups(points, |p| (p.case.as_str(), p.quantity)) {
        let of = |engine: &str| group.iter().find(|p| p.engine == engine);
        let what = if group[0].quantity == "error" { String::new() } else { format!(": {}", group[0].quantity) };
        let allowed = of("gpu").or(of("cpu")).and_then(|p| p.allowed).map_or(String::new(), short);
        let _ = writeln!(text, "| {}{what} | {} | {} | {allowed} |", group[0].case, error(of("cpu")), error(of("gpu")));
    }
}

/// A column for every number of steps.
fn by_decade(text: &mut String, points: &[&Point]) {
    let mut steps: Vec<u64> = points.iter().filter_map(|p| p.steps).collect();
    steps.sort_unstable();
    steps.dedup();
    let heads: Vec<String> = steps.iter().map(|n| format!("10^{} steps", n.ilog10())).collect();
    let _ = writeln!(
        text,
        "| scene | dt | change of | engine | {} |\n|{}",
        heads.join(" | "),
        " --- |".repeat(4 + heads.len())
    );
    let scene = |p: &Point| p.case.split(',').next().unwrap_or_default().to_owned();
    for row in groups(points, |p| (scene(p), p.dt_over_auto.to_bits(), p.quantity, p.engine)) {
        let cells: Vec<String> = steps.iter().map(|n| error(row.iter().find(|p| p.steps == Some(*n)))).collect();
        let Point { quantity, engine, precision, dt_over_auto, .. } = row[0];
        let name = scene(row[0]);
        let _ = writeln!(
            text,
            "| {name} | × {dt_over_auto} | {quantity} | {engine}, {precision} | {} |",
            cells.join(" | ")
        );
    }
}

/// Points with the same key together, in the order of the first ones.
fn groups<'a, K: PartialEq>(points: &[&'a Point], key: impl Fn(&'a Point) -> K) -> Vec<Vec<&'a Point>> {
    let mut groups: Vec<(K, Vec<&Point>)> = Vec::new();
    for point in points {
        let own = key(point);
        match groups.iter_mut().find(|(known, _)| *known == own) {
            Some((_, group)) => group.push(point),
            None => groups.push((own, vec![point])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}
