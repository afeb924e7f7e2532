//! The benchmark of a GPU on disk: a page that needs nothing beside it, and the same numbers as JSON.

use super::{Case, CheckFinding, Finding, Outcome, Part, PartRecord, Record, Speed, Stage, Variant};
use crate::{
    bench::{
        plot::{Curves, Picture},
        report::format::{met, percent, short},
    },
    error::Result,
    gpu::Placement,
    io::{at, replace},
};
use std::{fmt::Write, fs, path::Path};

pub const PAGE: &str = "report.html";
pub const JSON: &str = "gpu.json";

/// What the host may do for a step of a thousand grains besides waiting, ms.
const HOST_WORK: f64 = 0.05;
const FEW: usize = 1100;

/// Write what is known so far.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub fn write(folder: &Path, record: &Record) -> Result<()> {
    let json = serde_json::to_string_pretty(record).expect("plain data is always JSON");
    for (name, text) in [(JSON, &json), (PAGE, &page(record, &json)?)] {
        replace(&folder.join(name), |part| fs::write(part, text).map_err(at(part)))?;
    }
    Ok(())
}

const STYLE: &str = "body{font:15px/1.45 sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;margin:.7em 0}td,th{padding:.15em .7em;border-bottom:1px solid #ddd;text-align:left;\
vertical-align:top}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}.bad{color:#b00020;font-weight:bold}\
svg{max-width:100%;height:auto}summary{cursor:pointer}";

/// A page that grows.
struct Page(String);

impl Page {
    fn heading(&mut self, text: &str) {
        let _ = writeln!(self.0, "<h2>{}</h2>", escaped(text));
    }

    fn paragraph(&mut self, text: &str) {
        let _ = writeln!(self.0, "<p>{}</p>", escaped(text));
    }

    /// Something wrong.
    fn alarm(&mut self, text: &str) {
        let _ = writeln!(self.0, "<p class=\"bad\">{}</p>", escaped(text));
    }

    /// A table; cells with a number stand on the right.
    fn table(&mut self, head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) {
        self.0.push_str("<table><tr>");
        for cell in head {
            let _ = write!(self.0, "<th>{}</th>", escaped(cell));
        }
        self.0.push_str("</tr>\n");
        for row in rows {
            self.0.push_str("<tr>");
            for cell in row {
                let number = cell.trim_end_matches(" %").parse::<f64>();
                let class = if number.is_ok() { " class=\"n\"" } else { "" };
                let _ = write!(self.0, "<td{class}>{}</td>", escaped(&cell));
            }
            self.0.push_str("</tr>\n");
        }
        self.0.push_str("</table>\n");
    }

    /// Something long, folded away.
    fn folded(&mut self, title: &str, content: impl FnOnce(&mut Page)) {
        let _ = writeln!(self.0, "<details><summary>{}</summary>", escaped(title));
        content(self);
        self.0.push_str("</details>\n");
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn page(record: &Record, json: &str) -> Result<String> {
    let device = facts(record, "device");
    let name = device.and_then(|rows| rows.first()).map_or("no device", |(_, name)| name);
    let title = format!("packstone bench gpu: {name}");
    let mut page = Page(format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>{0}</title><style>{STYLE}</style>\n<h1>{0}</h1>\n",
        escaped(&title)
    ));
    head(&mut page, record);
    in_short(&mut page, record);
    parts(&mut page, record);
    machine(&mut page, record);
    copies(&mut page, record);
    speed(&mut page, record)?;
    stages(&mut page, record);
    variants(&mut page, record);
    traffic(&mut page, record);
    checks(&mut page, record);
    bits(&mut page, record);
    // Nothing in a script may look like its end.
    let json = json.replace("</", "<\\/");
    let _ = writeln!(page.0, "<script type=\"application/json\" id=\"record\">\n{json}\n</script>\n</html>");
    Ok(page.0)
}

fn head(page: &mut Page, record: &Record) {
    page.paragraph(
        "Please send back the folder that this page is in, as an archive; or this page alone, which has all numbers in it. \
         It holds names and limits of processor, adapters and driver, what was measured, and what errors say, without the \
         folders that they name.",
    );
    let Record { version, commit, minutes, restrictions, .. } = record;
    let seconds: f64 = record.parts.iter().map(|p| p.seconds).sum();
    page.paragraph(&format!(
        "packstone {version}, commit {commit}. Measured for {seconds:.0} s of {:.0} s that were allowed.",
        60.0 * minutes
    ));
    if *restrictions != Default::default() {
        page.alarm(&format!("The device was taken to have less than it has: {restrictions}."));
    }
    if !record.finished {
        page.alarm("Not finished: the benchmark is under way, or it was stopped here. What is below stands.");
    }
}

fn in_short(page: &mut Page, record: &Record) {
    page.heading("In short");
    let speeds: Vec<&Speed> = speeds(record).filter(|s| s.case == Case::Spheres).collect();
    let mut rows = Vec::new();
    let mut row = |what: &str, found: String| rows.push(vec![what.to_owned(), found]);
    if let Some(best) = speeds.iter().max_by(|a, b| a.particle_steps_per_second.total_cmp(&b.particle_steps_per_second))
    {
        row(
            "rough spheres, best",
            format!("{} particle-steps/s, {} grains", short(best.particle_steps_per_second), best.grains),
        );
    }
    if let Some(most) = speeds.iter().max_by_key(|s| s.grains) {
        row("most grains that ran", format!("{}, {:.0} bytes each on the device", most.grains, most.bytes_per_grain));
    }
    if let Some(few) = speeds.iter().find(|s| s.grains <= FEW) {
        let host = few.host_ms_per_step;
        let submissions = few.submission_ms_per_step;
        let software = facts(record, "device").is_some_and(|rows| rows.contains(&software()));
        let verdict =
            if software { "not decided, a software driver computes in submissions" } else { met(host <= HOST_WORK) };
        row(
            "work of the host, 1,000 grains",
            format!("{host:.4} ms per step, {submissions:.4} of it for submissions (at most {HOST_WORK}: {verdict})"),
        );
    }
    let passed = checked(record).filter(|check| check.passed).count();
    let tried = record.tried().filter(|p| matches!(p.part, Part::Check { .. })).count();
    row("kernels beside their f64 twins", format!("{passed} of {tried} scenes passed"));
    let repeated = record.repeated();
    row("same input, same bits", if repeated.is_empty() { "not tried".to_owned() } else { repeated.join("; ") });
    page.table(&["", ""], rows);
    let defects = record.defects();
    if defects.is_empty() {
        page.paragraph("Nothing failed.");
    } else {
        page.alarm("What went wrong:");
        page.table(&[""], defects.into_iter().map(|defect| vec![defect]));
    }
}

fn parts(page: &mut Page, record: &Record) {
    page.heading("Parts");
    let not_run = record.parts.iter().filter(|p| matches!(p.outcome, Outcome::NotRun(_))).count();
    page.folded(&format!("{} parts, {not_run} not run", record.parts.len()), |page| {
        let row = |p: &PartRecord| {
            let outcome = match &p.outcome {
                Outcome::Running => "under way".to_owned(),
                Outcome::Done => "done".to_owned(),
                Outcome::Failed(why) => format!("failed: {why}"),
                Outcome::Lacking(why) => format!("lacking: {why}"),
                Outcome::NotRun(why) => format!("not run: {why}"),
            };
            vec![p.part.to_string(), format!("{:.1}", p.seconds), outcome]
        };
        page.table(&["part", "s", "outcome"], record.parts.iter().map(row));
    });
    let lacking = record.findings().filter_map(|f| match f {
        Finding::Lacking { what, why } => Some(vec![what.clone(), why.clone()]),
        _ => None,
    });
    let parts = record.parts.iter().filter_map(|p| match &p.outcome {
        Outcome::Lacking(why) => Some(vec![p.part.to_string(), why.clone()]),
        _ => None,
    });
    let lacking: Vec<_> = parts.chain(lacking).collect();
    if !lacking.is_empty() {
        page.paragraph("What the machine does not have:");
        page.table(&["", ""], lacking);
    }
}

fn facts<'a>(record: &'a Record, name: &str) -> Option<&'a Vec<(String, String)>> {
    record.findings().find_map(|f| match f {
        Finding::Facts { of, rows } if of == name => Some(rows),
        _ => None,
    })
}

/// The fact that says so.
fn software() -> (String, String) {
    ("software driver".to_owned(), "yes".to_owned())
}

fn machine(page: &mut Page, record: &Record) {
    page.heading("Machine and device");
    let cells = |rows: &[(String, String)]| {
        rows.iter().map(|(name, value)| vec![name.clone(), value.clone()]).collect::<Vec<_>>()
    };
    for name in ["machine", "device"] {
        if let Some(rows) = facts(record, name) {
            page.table(&[name, ""], cells(rows));
        }
    }
    for finding in record.findings() {
        if let Finding::Facts { of, rows } = finding
            && of.starts_with("adapter")
        {
            let name = rows.first().map_or("", |(_, name)| name);
            page.folded(&format!("{of}, {name}: all limits and features"), |page| page.table(&["", ""], cells(rows)));
        }
    }
}

/// Bytes per second of the faster copy on the device.
fn bandwidth(record: &Record) -> Option<f64> {
    let of_device = record.findings().filter_map(|f| match f {
        Finding::Copy { what, bytes_per_second } if what.starts_with("device") => Some(*bytes_per_second),
        _ => None,
    });
    of_device.reduce(f64::max)
}

fn copies(page: &mut Page, record: &Record) {
    page.heading("Copies");
    let rows = record.findings().filter_map(|f| match f {
        Finding::Copy { what, bytes_per_second } => Some(vec![what.clone(), short(1e-9 * bytes_per_second)]),
        _ => None,
    });
    page.table(&["what copies", "GB/s, read and written"], rows);
}

fn speeds(record: &Record) -> impl Iterator<Item = &Speed> {
    record.findings().filter_map(|f| if let Finding::Speed(speed) = f { Some(speed) } else { None })
}

fn speed(page: &mut Page, record: &Record) -> Result<()> {
    page.heading("Speed");
    page.paragraph(
        "Dense packings: rough spheres (3D, friction), rods of three of them (grains are members), smooth disks (2D). The work \
         of the host is wall time less the time spent waiting for the device. Submissions are part of it, in which software \
         drivers compute, and what is encoded ahead while the device works.",
    );
    let head = [
        "scene",
        "grains",
        "particle-steps/s",
        "ms/step",
        "host ms/step",
        "submission ms/step",
        "ahead ms/step",
        "bytes/grain",
        "arrays",
        "first step s",
        "steps timed",
    ];
    let row = |s: &Speed| {
        vec![
            s.case.name().to_owned(),
            s.grains.to_string(),
            short(s.particle_steps_per_second),
            format!("{:.4}", s.ms_per_step),
            format!("{:.4}", s.host_ms_per_step),
            format!("{:.4}", s.submission_ms_per_step),
            format!("{:.4}", s.ahead_ms_per_step),
            format!("{:.0}", s.bytes_per_grain),
            s.placements.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", "),
            format!("{:.2}", s.setup_seconds),
            s.steps.to_string(),
        ]
    };
    page.table(&head, speeds(record).map(row));
    let points = |case: Case, y: fn(&Speed) -> f64| {
        speeds(record).filter(|s| s.case == case).map(|s| (s.grains as f64, y(s))).collect::<Vec<_>>()
    };
    let cases = [Case::Spheres, Case::Rods, Case::Disks];
    let mut rates = cases.map(|case| points(case, |s| s.particle_steps_per_second)).to_vec();
    rates.push(Vec::new());
    let mut times = cases.map(|case| points(case, |s| s.ms_per_step)).to_vec();
    times.push(points(Case::Spheres, |s| s.host_ms_per_step));
    let curves =
        |title: &str, y: &str, points| Curves { title: title.to_owned(), axes: ("grains", y.to_owned()), points };
    let picture = Picture::of_curves(
        &["spheres", "rods", "disks", "work of the host, spheres"],
        vec![curves("speed", "particle-steps per second", rates), curves("time of a step", "milliseconds", times)],
    );
    if speeds(record).next().is_some() {
        page.0.push_str(&picture.svg()?);
    }
    Ok(())
}

/// Bytes per second of a stage.
fn moved(stage: &Stage) -> Option<f64> {
    (stage.ms_per_call > 0.0).then(|| stage.bytes as f64 / (1e-3 * stage.ms_per_call))
}

fn stages(page: &mut Page, record: &Record) {
    page.heading("Stages");
    page.paragraph(
        "Bytes are those that a call has to move: every array it reads once, and each that it writes once more. `of copy` is \
         what that makes per second over what a copy moves. Stages are timed one by one, which takes longer than a step.",
    );
    let copy = bandwidth(record);
    for finding in record.findings() {
        let Finding::Stages { case, grains, clock, rows } = finding else { continue };
        let mut rows: Vec<&Stage> = rows.iter().collect();
        rows.sort_by(|a, b| b.share.total_cmp(&a.share));
        page.folded(&format!("{} {grains} (clock: {clock})", case.name()), |page| {
            let row = |s: &&Stage| {
                let rate = moved(s);
                vec![
                    s.stage.clone(),
                    s.calls.to_string(),
                    format!("{:.5}", s.ms_per_call),
                    percent(s.share),
                    format!("{:.1}", s.bytes as f64 / *grains as f64),
                    rate.map_or(String::new(), |rate| short(1e-9 * rate)),
                    rate.zip(copy).map_or(String::new(), |(rate, copy)| percent(rate / copy)),
                ]
            };
            let head = ["stage", "calls", "ms/call", "share of time", "bytes/grain", "GB/s", "of copy"];
            page.table(&head, rows.iter().map(row));
        });
    }
}

fn variants(page: &mut Page, record: &Record) {
    page.heading("Other settings");
    page.paragraph("Rough spheres, beside the default settings, measured in turn. Below 1 is faster than these.");
    let row = |f: &Finding| {
        let Finding::Variant(Variant { name, grains, ms_per_step, default_ms_per_step, same_bits }) = f else {
            return None;
        };
        let bits = match same_bits {
            Some(true) => "the same",
            Some(false) => "DIFFERENT",
            None => "not compared",
        };
        Some(vec![
            name.clone(),
            grains.to_string(),
            format!("{ms_per_step:.4}"),
            format!("{default_ms_per_step:.4}"),
            format!("{:.3}", ms_per_step / default_ms_per_step),
            bits.to_owned(),
        ])
    };
    page.table(
        &["setting", "grains", "ms/step", "default ms/step", "ratio", "bits"],
        record.findings().filter_map(row),
    );
}

fn traffic(page: &mut Page, record: &Record) {
    page.heading("Traffic, counted and measured");
    page.paragraph(
        "The accesses of the kernel that walks neighbour lists, replayed on the lists of the packing, for warps of 8, 32 and 64 \
         lanes: rounds of the loop, cache lines, sectors and bytes of a warp, and bytes of neighbours from beyond the first \
         cache of a grain; all with a buffer for every array. Where arrays lie like that, beside them the measured time of a \
         call, what lines and gathered bytes make of it, and how many times as long it takes as a copy of the bytes that it \
         has to move.",
    );
    let copy = bandwidth(record);
    let buffers = |s: &Speed| s.placements.keys().all(|name| name == Placement::Buffer.name());
    let stage = |of: (Case, usize), name: &str| {
        speeds(record).find(|s| (s.case, s.grains) == of && buffers(s))?;
        record.findings().find_map(|f| match f {
            Finding::Stages { case, grains, rows, .. } if (*case, *grains) == of => {
                rows.iter().find(|s| s.stage == name)
            }
            _ => None,
        })
    };
    let mut rows = Vec::new();
    for finding in record.findings() {
        let Finding::Traffic { case, grains, rows: counted } = finding else { continue };
        for c in counted {
            let stage = stage((*case, *grains), &c.kernel);
            let per_second = |n: f64| {
                stage.map_or(String::new(), |s| short(1e-9 * n / (1e-3 * s.ms_per_call).max(f64::MIN_POSITIVE)))
            };
            let over_copy = stage.and_then(moved).zip(copy).map(|(moved, copy)| copy / moved);
            rows.push(vec![
                format!("{} {grains}, {}", case.name(), c.kernel),
                c.lanes.to_string(),
                format!("{:.2}", c.passes),
                format!("{:.2}", c.list),
                format!("{:.0}", c.lines),
                format!("{:.0}", c.sectors),
                format!("{:.0}", c.bytes),
                format!("{:.0}", c.gathered),
                stage.map_or(String::new(), |s| format!("{:.5}", s.ms_per_call)),
                per_second(c.lines * c.warps as f64),
                per_second(c.gathered * *grains as f64),
                over_copy.map_or(String::new(), short),
            ]);
        }
    }
    let head = [
        "kernel",
        "lanes",
        "passes",
        "list",
        "lines",
        "sectors",
        "bytes",
        "gathered B/grain",
        "ms/call",
        "1e9 lines/s",
        "gathered GB/s",
        "× a copy",
    ];
    page.table(&head, rows);
}

fn checked(record: &Record) -> impl Iterator<Item = &CheckFinding> {
    record.findings().filter_map(|f| if let Finding::Check(check) = f { Some(check) } else { None })
}

fn checks(page: &mut Page, record: &Record) {
    page.heading("Kernels beside their twins");
    page.paragraph(
        "Every kernel and its f64 twin on the processor get the same numbers; what they write is compared, over the largest \
         value. A check without contacts checks little.",
    );
    let row = |check: &CheckFinding| {
        let exceeded = check.rows.iter().filter(|row| !row.passed).count();
        vec![
            check.case.name().to_owned(),
            check.precision.clone(),
            check.grains.to_string(),
            check.contacts.to_string(),
            if check.passed { "passed".to_owned() } else { format!("FAILED: {exceeded} of {}", check.rows.len()) },
            check.trajectory.map_or("no number".to_owned(), |x| format!("{x:.1e}")),
        ]
    };
    let head = ["scene", "precision", "grains", "contacts", "verdict", "free runs apart, mean radii"];
    page.table(&head, checked(record).map(row));
    for check in checked(record) {
        page.folded(&format!("{}, {}: all arrays of all stages", check.case.name(), check.precision), |page| {
            let row = |row: &super::CheckRow| {
                vec![
                    row.stage.clone(),
                    row.array.clone(),
                    row.worst.map_or("no number".to_owned(), |x| format!("{x:.1e}")),
                    format!("{:.1e}", row.tolerance),
                    if row.passed { "ok" } else { "EXCEEDED" }.to_owned(),
                ]
            };
            page.table(&["stage", "array", "worst", "tolerance", "verdict"], check.rows.iter().map(row));
        });
    }
}

fn bits(page: &mut Page, record: &Record) {
    page.heading("Bits of final states");
    page.paragraph(
        "The same input on the same device has to end with the same bits. Those of other devices may differ.",
    );
    let rows = record.runs().into_iter().flat_map(|(run, all)| {
        let first = all[0].1;
        all.into_iter().map(move |(place, hash)| {
            let verdict = if hash == first { "" } else { "DIFFERENT" };
            vec![run.to_owned(), place.to_owned(), format!("#{hash}"), verdict.to_owned()]
        })
    });
    page.table(&["run", "where", "hash of positions, velocities and spins", ""], rows);
}
