//! A benchmark on disk: `bench.csv`, `stages.csv`, `relaxation.csv`, `residuals.csv`, `bench.json`, `report.md` and the
//! plots.

pub mod format;
mod precision;
mod relaxation;
mod speed;

use super::{
    machine::Machine,
    plot::Picture,
    results::{Bench, Effort, Point, Suite},
};
use crate::{
    error::Result,
    io::{at, replace},
};
use format::{short, table};
use serde::Serialize;
use std::{fmt::Write, fs, path::Path};

pub const TABLE: &str = "bench.csv";
pub const STAGES: &str = "stages.csv";
pub const RELAXATION: &str = "relaxation.csv";
pub const RESIDUALS: &str = "residuals.csv";
pub const JSON: &str = "bench.json";
pub const REPORT: &str = "report.md";

/// Write everything to a folder, which is made if need be.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub fn write(folder: &Path, bench: &Bench) -> Result<()> {
    fs::create_dir_all(folder).map_err(at(folder))?;
    rows(&folder.join(TABLE), &bench.points)?;
    rows(&folder.join(STAGES), &bench.stages)?;
    rows(&folder.join(RELAXATION), &bench.relaxation)?;
    rows(&folder.join(RESIDUALS), &bench.residuals)?;
    save(&folder.join(JSON), json(bench).as_bytes())?;
    for suite in suites(bench) {
        if let Some(picture) = Picture::of(suite, bench) {
            picture.write(folder, suite.name())?;
        }
    }
    save(&folder.join(REPORT), markdown(bench).as_bytes())
}

/// The benchmark as JSON; numbers that are not finite are null.
pub fn json(bench: &Bench) -> String {
    let mut text = serde_json::to_string_pretty(bench).expect("plain data is always JSON");
    text.push('\n');
    text
}

fn rows(path: &Path, rows: &[impl Serialize]) -> Result<()> {
    let mut table = csv::Writer::from_writer(Vec::new());
    rows.iter().try_for_each(|row| table.serialize(row)).map_err(|e| at(path)(std::io::Error::other(e)))?;
    save(path, &table.into_inner().map_err(|e| at(path)(e.into_error()))?)
}

fn save(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, |part| fs::write(part, bytes).map_err(at(part)))
}

/// The suites that have points, in order.
fn suites(bench: &Bench) -> impl Iterator<Item = Suite> {
    Suite::ALL.into_iter().filter(|suite| bench.points.iter().any(|p| p.suite == *suite))
}

/// The report, with links to the plots beside it.
pub fn markdown(bench: &Bench) -> String {
    let mut text = String::from("# packstone bench\n\n");
    let effort = match bench.effort {
        Effort::Quick => "--quick",
        Effort::Full => "full",
        Effort::Long => "--long",
    };
    let failed = bench.points.iter().filter(|p| !p.passed()).count();
    let _ = writeln!(text, "{effort}, {:.0} s, {} points, {failed} failed.", bench.wall_seconds, bench.points.len());
    if bench.interrupted {
        text.push_str("\n**Interrupted: points are missing.**\n");
    }
    text.push('\n');
    machine(&mut text, &bench.machine);
    text.push_str(
        "\nBeside every error stands the wall time per simulated second. In plots a line joins the Pareto front, and in \
         tables a star marks it: no other setting has a smaller error in no more time. dt is in units of the automatic \
         step. Definitions: docs/bench.md.\n",
    );
    for suite in suites(bench) {
        let points: Vec<&Point> = bench.points.iter().filter(|p| p.suite == suite).collect();
        let name = suite.name();
        let _ = writeln!(text, "\n## {name}\n\n{}\n", about(suite));
        if Picture::of(suite, bench).is_some() {
            let _ = writeln!(text, "![{name}]({name}.svg)\n");
        }
        match suite {
            Suite::Speed => speed::write(&mut text, &points, &bench.stages),
            Suite::Relaxation => relaxation::write(&mut text, &points, &bench.relaxation),
            Suite::Precision => precision::write(&mut text, &points),
            _ => by_quantity(&mut text, &points),
        }
    }
    text
}

fn machine(text: &mut String, machine: &Machine) {
    let adapter = machine.adapter.as_ref();
    let of_adapter = |of: fn(&crate::gpu::AdapterSummary) -> String| adapter.map_or("none".to_owned(), of);
    let double = machine.double_adapter.clone().unwrap_or_else(|| "no adapter".to_owned());
    let rows = [
        ("processor", machine.cpu.clone()),
        ("threads", machine.cores.to_string()),
        ("system", machine.system.clone()),
        ("adapter", of_adapter(|a| format!("{} ({}, {})", a.name, a.kind, a.backend))),
        ("driver", of_adapter(|a| a.driver.clone())),
        ("f64 in shaders", double),
        ("copy, processor", copied(machine.cpu_copy_bandwidth)),
        ("copy, adapter", copied(machine.gpu_copy_bandwidth)),
        ("packstone", format!("{}, commit {}", machine.version, machine.commit)),
    ];
    text.push_str("| | |\n| --- | --- |\n");
    for (name, value) in rows {
        let _ = writeln!(text, "| {name} | {value} |");
    }
}

fn copied(bandwidth: Option<f64>) -> String {
    bandwidth.map_or("not measured".to_owned(), |b| format!("{} GB/s, read and written", short(1e-9 * b)))
}

fn about(suite: Suite) -> &'static str {
    match suite {
        Suite::Local => {
            "Force and moment of every grain on the same state of a settling bed, against the f64 CPU engine, over the RMS \
             of what is expected."
        }
        Suite::Trajectory => {
            "Oblique impacts on a wall and a cradle against closed forms; a collapse of 1,000 grains against f64 at a \
             sixteenth of the automatic step."
        }
        Suite::Invariants => {
            "What elastic gases keep: energy (largest deviation, and slope), linear or angular momentum, per 10^5 steps. Of \
             rough grains that lose energy: how far it is from what friction and damping take, over what they take."
        }
        Suite::Ensembles => {
            "Settled beds, mean ± standard deviation over seeds. The error is the distance from the mean of the f64 CPU \
             engine at its smallest step; below about two standard errors it is scatter."
        }
        Suite::Speed => {
            "Dense packings of rough spheres (3D, friction) and smooth disks (2D). The error is the RMS distance from the \
             f64 CPU engine at the same step, after 20 steps. Bytes per particle-step are those that the stages have to \
             move, counted; beside them the part of the machine's copy bandwidth that this makes."
        }
        Suite::Sizes => {
            "Grains of wide sizes: time and memory of a particle-step over those of as many equal grains. Boxes are 30 % \
             solid; the other scenes are compared with themselves without their large grains."
        }
        Suite::Relaxation => {
            "Contact dynamics: one step of a bed of rigid, rough spheres that has come to rest (3D, friction 0.5), from no \
             impulses. Passes and wall time of its relaxation until the relative residual is as small as the head of the \
             column, counted at the looks that the host takes; - where a run ended before."
        }
        Suite::Precision => {
            "What single precision loses, beside f64: hard cases with what their tests allow; and the largest change of \
             energy and momentum since the start of long runs."
        }
    }
}

fn by_quantity(text: &mut String, points: &[&Point]) {
    let mut groups: Vec<(&str, &'static str)> = Vec::new();
    for group in points.iter().map(|p| (p.case.as_str(), p.quantity)) {
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    for group in groups {
        let rows: Vec<&Point> = points.iter().filter(|p| (p.case.as_str(), p.quantity) == group).copied().collect();
        let unit = rows[0].unit;
        let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
        let title = if group.1.is_empty() { "what failed" } else { group.1 };
        let _ = writeln!(text, "\n### {}: {title}{unit}\n", group.0);
        table(text, &rows);
        fastest(text, &rows);
    }
}

/// Which setting is fastest at a given error: the front, read from the largest error down.
fn fastest(text: &mut String, points: &[&Point]) {
    let mut front: Vec<&&Point> = points.iter().filter(|p| p.pareto).collect();
    front.sort_by(|a, b| b.error.unwrap_or(0.0).total_cmp(&a.error.unwrap_or(0.0)));
    let words: Vec<String> = front
        .iter()
        .map(|p| {
            let error = short(p.error.unwrap_or(0.0));
            format!("{error} with {} {} at dt × {}", p.engine, p.precision, p.dt_over_auto)
        })
        .collect();
    if !words.is_empty() {
        let _ = writeln!(text, "\nFastest, from the largest error down: {}.", words.join("; "));
    }
}
