//! What the report says of speed beyond its table: growth with size, two against three dimensions, and the stages.

use super::format::{met, percent, short, table};
use crate::bench::results::{Point, StageRow};
use std::fmt::Write;

/// What time per particle-step may grow by from 10,000 grains to the largest packing.
const GROWTH: f64 = 1.5;
/// Packings from which on growth counts: smaller ones sit in caches.
const LARGE: usize = 5000;

/// Stages that take less of the time are left to the table on disk.
const SMALL: f64 = 1e-3;

/// The table, and what it comes to.
pub fn write(text: &mut String, points: &[&Point], stages: &[StageRow]) {
    table(text, points);
    let largest = largest(points);
    for last in &largest {
        growth(text, points, last);
    }
    for (disks, spheres) in pairs("disks", points) {
        if largest.iter().any(|p| p.case == disks.case) {
            frugality(text, disks, spheres);
        }
    }
    for (rods, spheres) in pairs("rods", points) {
        price_of_rods(text, rods, spheres);
    }
    for last in &largest {
        stage_table(text, last, stages);
    }
}

fn scene(point: &Point) -> &str {
    point.case.split(' ').next().unwrap_or_default()
}

/// The number of grains asked for; lattices have a few more or less.
fn size(point: &Point) -> &str {
    point.case.split(' ').nth(1).unwrap_or_default()
}

fn rate(point: &Point) -> f64 {
    point.particle_steps_per_second.unwrap_or(f64::NAN)
}

/// Whether two points are of the same engine and precision.
fn alike(a: &Point, b: &Point) -> bool {
    (a.engine, a.precision) == (b.engine, b.precision)
}

/// The largest packing that ran, per scene and engine.
fn largest<'a>(points: &[&'a Point]) -> Vec<&'a Point> {
    let mut found: Vec<&Point> = Vec::new();
    for point in points.iter().filter(|p| p.passed()) {
        match found.iter_mut().find(|p| scene(p) == scene(point) && alike(p, point)) {
            Some(known) if known.grains < point.grains => *known = point,
            Some(_) => {}
            None => found.push(point),
        }
    }
    found
}

/// Packings of a scene with as many spheres on the same engine.
fn pairs<'a>(name: &'static str, points: &[&'a Point]) -> impl Iterator<Item = (&'a Point, &'a Point)> {
    let of = |name: &'static str| points.iter().copied().filter(move |p| p.passed() && scene(p) == name);
    let spheres: Vec<&Point> = of("spheres").collect();
    let others: Vec<&Point> = of(name).collect();
    others
        .into_iter()
        .filter_map(move |d| Some((d, spheres.iter().copied().find(|s| alike(d, s) && size(d) == size(s))?)))
}

fn growth(text: &mut String, points: &[&Point], last: &Point) {
    let large = |p: &&&Point| p.passed() && p.grains.is_some_and(|n| n > LARGE) && scene(p) == scene(last);
    let Some(base) = points.iter().filter(large).filter(|p| alike(p, last)).min_by_key(|p| p.grains) else { return };
    if last.grains <= base.grains {
        return;
    }
    let grown = rate(base) / rate(last);
    let [from, to] = [base, &last].map(|p| p.grains.unwrap_or(0));
    let _ = writeln!(
        text,
        "\n{} on the {}: time per particle-step grows {grown:.2} × from {from} to {to} grains (at most {GROWTH}: {}).",
        scene(last),
        last.engine,
        match points.iter().find(|p| !p.passed() && scene(p) == scene(last) && alike(p, last)) {
            Some(failed) => format!("not decided, {} failed", failed.case),
            None => met(grown <= GROWTH).to_owned(),
        }
    );
}

fn frugality(text: &mut String, disks: &Point, spheres: &Point) {
    let (Some(few), Some(many)) = (disks.bytes_per_step, spheres.bytes_per_step) else { return };
    let faster = rate(disks) / rate(spheres);
    let _ = writeln!(
        text,
        "\nSmooth disks on the {}: {faster:.2} × as fast as rough spheres, which move {:.2} × the bytes (at least as much: \
         {}).",
        disks.engine,
        many / few,
        met(faster >= many / few)
    );
}

/// Contacts that a member of a rod has with other rods, and a sphere with others, on the same lattice.
const CONTACTS: [f64; 2] = [8.0 - 4.0 / 3.0, 8.0];
/// The least part of the rate of spheres that clumps are to reach.
const PRICE: f64 = 0.6;

fn price_of_rods(text: &mut String, rods: &Point, spheres: &Point) {
    let members = rate(rods) / rate(spheres);
    let _ = writeln!(
        text,
        "\nRods of three spheres, {} members, on the {}: {members:.2} × the member-steps of as many spheres (at least {PRICE}: {}), {:.2} × \
         the contacts, of which a member has {:.2} and a sphere {}; {:.3e} member-contacts/s.",
        rods.grains.unwrap_or(0),
        rods.engine,
        met(members >= PRICE),
        members * CONTACTS[0] / CONTACTS[1],
        CONTACTS[0],
        CONTACTS[1],
        rate(rods) * CONTACTS[0]
    );
}

/// The stages of a run, the most expensive one first.
fn stage_table(text: &mut String, point: &Point, stages: &[StageRow]) {
    let own = |s: &&StageRow| s.case == point.case && (s.engine, s.precision) == (point.engine, point.precision);
    let mut rows: Vec<&StageRow> = stages.iter().filter(own).collect();
    let Some(first) = rows.first() else { return };
    let _ = writeln!(text, "\n### {}: stages on the {} (clock: {})\n", point.case, point.engine, first.clock);
    let header = "stage | calls | ms/call | share of time | bytes/grain | GB/s | of copy";
    let _ = writeln!(text, "| {header} |\n|{}", " --- |".repeat(header.split('|').count()));
    rows.sort_by(|a, b| b.share.total_cmp(&a.share));
    for row in rows.iter().filter(|row| row.share >= SMALL) {
        let number = |x: Option<f64>| x.map_or(String::new(), short);
        let cells = [
            row.stage.to_owned(),
            row.calls.map_or(String::new(), |n| n.to_string()),
            number(row.ms_per_call),
            percent(row.share),
            number(row.bytes_per_particle),
            number(row.gigabytes_per_second),
            row.copy_fraction.map_or(String::new(), percent),
        ];
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
}
