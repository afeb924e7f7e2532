//! `packstone bench gpu`

use super::common::{INTERRUPTED, STOPPED, complain, say};
use super::run::{interrupted, listen};
use packstone::{
    bench::gpu::{
        Finding, Outcome, Part, PartRecord, Record, measure, report,
        schedule::{Decision, decide, parts},
    },
    gpu::Restrictions,
};
use std::{
    io::{BufRead, BufReader, Read, Write},
    path::PathBuf,
    process::{Child, Command, ExitCode, Stdio},
    sync::mpsc::{Receiver, RecvTimeoutError, channel},
    thread,
    time::{Duration, Instant},
};

/// Everything about this machine's GPU in a folder to send back: device, copies, checks, speeds, stages, determinism
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  packstone bench gpu --out out/gpu\n  packstone bench gpu --out out/gpu --minutes 20\n\n\
    Packings grow until time or memory are used up. Whatever fails becomes a line of the report, which is written anew after\n\
    every result: what a kill or a lost device leaves is usable. Ctrl-C ends at once, with a report."
)]
pub struct GpuArgs {
    /// Folder for the report, to be sent back as it is
    #[arg(long, value_name = "DIR", default_value = "out/gpu")]
    out: PathBuf,
    /// How long it may take, about
    #[arg(long, value_name = "M", default_value_t = 5.0, value_parser = minutes)]
    minutes: f64,
    /// Take this away from what the device has, as for `packstone run`
    #[arg(long, value_name = "LIST")]
    restrict: Option<Restrictions>,
    /// Measure this part here, and say what is found as JSON: how the command calls itself
    #[arg(long, value_name = "JSON", hide = true, value_parser = part)]
    part: Option<Part>,
}

fn minutes(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|m: &f64| m.is_finite() && *m > 0.0);
    number.ok_or_else(|| "must be a number > 0".to_owned())
}

fn part(text: &str) -> Result<Part, String> {
    serde_json::from_str(text).map_err(|e| e.to_string())
}

pub fn gpu(args: &GpuArgs) -> anyhow::Result<ExitCode> {
    let restrictions = args.restrict.unwrap_or_default();
    if let Some(part) = args.part {
        measure(part, restrictions, &mut |finding| {
            let text = serde_json::to_string(&finding).expect("plain data is always JSON");
            // Where nobody listens any more, there is nothing to be measured.
            if writeln!(std::io::stdout(), "{text}").is_err() {
                std::process::exit(STOPPED.into());
            }
        })?;
        return Ok(ExitCode::SUCCESS);
    }
    std::fs::create_dir_all(&args.out).map_err(|source| packstone::Error::Io { path: args.out.clone(), source })?;
    listen()?;
    let mut record = Record::new(args.minutes, restrictions);
    report::write(&args.out, &record)?;
    let start = Instant::now();
    for part in parts() {
        let left = 60.0 * args.minutes - start.elapsed().as_secs_f64();
        let own = match decide(part, &record.parts, left) {
            _ if interrupted() => break,
            Decision::Skip(why) => {
                PartRecord { part, seconds: 0.0, outcome: Outcome::NotRun(why), findings: Vec::new() }
            }
            Decision::Run { limit } => run(args, part, limit, &mut record)?,
        };
        eprintln!("{}", line(&own));
        record.parts.push(own);
        report::write(&args.out, &record)?;
    }
    record.finished = !interrupted();
    report::write(&args.out, &record)?;
    let defects = record.defects();
    defects.iter().for_each(complain);
    say(format!("Please send back the folder {}; {} in it is to be read.", args.out.display(), report::PAGE));
    Ok(match () {
        () if !record.finished => ExitCode::from(INTERRUPTED),
        () if !defects.is_empty() => ExitCode::from(STOPPED),
        () => ExitCode::SUCCESS,
    })
}

/// Run a part in a process of its own, which is killed after so many seconds. While it runs, `record` on disk has what it
/// has found so far.
fn run(args: &GpuArgs, part: Part, limit: f64, record: &mut Record) -> anyhow::Result<PartRecord> {
    let start = Instant::now();
    let mut own = PartRecord { part, seconds: 0.0, outcome: Outcome::Running, findings: Vec::new() };
    let (mut child, events, errors) = match begin(part, record.restrictions) {
        Ok(begun) => begun,
        Err(error) => return Ok(PartRecord { outcome: Outcome::Failed(format!("does not start: {error}")), ..own }),
    };
    let ended = loop {
        let seconds = start.elapsed().as_secs_f64();
        if interrupted() {
            break Some("interrupted".to_owned());
        }
        if seconds > limit {
            break Some(format!("killed after {limit:.0} s, when it should have ended long ago"));
        }
        match events.recv_timeout(Duration::from_millis(50)) {
            Ok(text) => {
                match serde_json::from_str(&text) {
                    Ok(finding) => own.findings.push(finding),
                    Err(error) => own
                        .findings
                        .push(Finding::Failed { what: part.to_string(), why: format!("said {text}: {error}") }),
                }
                own.seconds = seconds;
                record.parts.push(own.clone());
                let written = report::write(&args.out, record);
                record.parts.pop();
                written?;
            }
            Err(RecvTimeoutError::Disconnected) => break None,
            Err(RecvTimeoutError::Timeout) => {}
        }
    };
    if ended.is_some() {
        child.kill()?;
    }
    let status = child.wait()?;
    own.seconds = start.elapsed().as_secs_f64();
    own.outcome = match ended {
        Some(why) => Outcome::Failed(why),
        None if status.success() => Outcome::Done,
        None => {
            let said = errors.recv().unwrap_or_default();
            Outcome::Failed(match status.code() {
                // The library's own words.
                Some(1 | 2) => said.rsplit("error: ").next().unwrap_or_default().trim().to_owned(),
                _ => format!("{status}: {}", last_lines(&said)),
            })
        }
    };
    Ok(own)
}

/// The process, its lines, and what it writes to the standard error, once it has ended.
fn begin(part: Part, restrictions: Restrictions) -> std::io::Result<(Child, Receiver<String>, Receiver<String>)> {
    let part = serde_json::to_string(&part).expect("plain data is always JSON");
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["bench", "gpu", "--part", &part]);
    if restrictions != Restrictions::default() {
        command.args(["--restrict", &restrictions.to_string()]);
    }
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let (line, lines) = channel();
    let output = BufReader::new(child.stdout.take().expect("piped"));
    thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|text| line.send(text)));
    let (error, errors) = channel();
    let mut output = child.stderr.take().expect("piped");
    thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = output.read_to_end(&mut bytes);
        error.send(String::from_utf8_lossy(&bytes).into_owned())
    });
    Ok((child, lines, errors))
}

/// What a panic or a driver has said at the end.
fn last_lines(text: &str) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    lines[lines.len().saturating_sub(5)..].join(" ")
}

/// A part that has ended, on one line.
fn line(own: &PartRecord) -> String {
    let outcome = match &own.outcome {
        Outcome::Running => "under way".to_owned(),
        Outcome::Done => format!("{:.1} s", own.seconds),
        Outcome::Failed(why) => format!("failed: {why}"),
        Outcome::NotRun(why) => format!("not run, {why}"),
    };
    let speed = own.findings.iter().find_map(|finding| match finding {
        Finding::Speed(s) => Some(format!(", {:.2e} particle-steps/s", s.particle_steps_per_second)),
        _ => None,
    });
    format!("{}: {outcome}{}", own.part, speed.unwrap_or_default())
}
