//! `packstone bench gpu`

use super::common::{INTERRUPTED, STOPPED, complain, say, tell, warn};
use super::run::{interrupted, listen};
use packstone::{
    Error,
    bench::gpu::{
        Finding, Outcome, Part, PartRecord, Record, measure, report,
        schedule::{Decision, decide, parts},
    },
    gpu::{Restrictions, selected},
};
use std::{
    io::{BufRead, BufReader, Read, Write},
    path::{Path, PathBuf},
    process::{Child, Command, ExitCode, ExitStatus, Stdio},
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
    /// Take this away from what the device has, as for packstone run
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
    // A Ctrl-C reaches the processes of the parts too, which leave it to the one that began them.
    listen()?;
    if let Some(part) = args.part {
        let done = measure(part, restrictions, &mut |finding| {
            let text = serde_json::to_string(&finding).expect("plain data is always JSON");
            // Where nobody listens any more, there is nothing to be measured.
            if writeln!(std::io::stdout(), "{text}").is_err() {
                std::process::exit(STOPPED.into());
            }
        });
        return match done {
            Err(error @ Error::Lacking(_)) => {
                complain(error);
                Ok(ExitCode::from(LACKING))
            }
            done => Ok(done.map(|()| ExitCode::SUCCESS)?),
        };
    }
    std::fs::create_dir_all(&args.out).map_err(|source| Error::Io { path: args.out.clone(), source })?;
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
            Decision::Run { limit } => run(args, part, limit, &mut record),
        };
        tell(line(&own));
        record.parts.push(own);
        write(&args.out, &record);
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

/// How the process of a part ends where the machine lacks something.
const LACKING: u8 = 4;

/// What cannot be written now may be the next time: someone may look at it, or make room.
fn write(folder: &Path, record: &Record) {
    if let Err(error) = report::write(folder, record) {
        warn(error);
    }
}

/// Run a part in a process of its own, which is killed after so many seconds. While it runs, `record` on disk has what it
/// has found so far.
fn run(args: &GpuArgs, part: Part, limit: f64, record: &mut Record) -> PartRecord {
    let start = Instant::now();
    let mut own = PartRecord { part, seconds: 0.0, outcome: Outcome::Running, findings: Vec::new() };
    let (mut child, events, errors) = match begin(part, record.restrictions) {
        Ok(begun) => begun,
        Err(error) => return PartRecord { outcome: Outcome::Failed(format!("does not start: {error}")), ..own },
    };
    let ended = loop {
        match child.try_wait() {
            Ok(None) => {}
            Ok(Some(status)) => break Ok(status),
            Err(error) => break Err(format!("cannot be waited for: {error}")),
        }
        own.seconds = start.elapsed().as_secs_f64();
        if interrupted() {
            break Err("interrupted".to_owned());
        }
        if own.seconds > limit {
            break Err(format!("killed after {limit:.0} s, when it should have ended long ago"));
        }
        match events.recv_timeout(POLL) {
            Ok(text) => {
                own.findings.push(heard(part, &text));
                record.parts.push(own.clone());
                write(&args.out, record);
                record.parts.pop();
            }
            Err(RecvTimeoutError::Disconnected) => thread::sleep(POLL),
            Err(RecvTimeoutError::Timeout) => {}
        }
    };
    if ended.is_err() {
        let _ = child.kill();
        // Not for ever: a driver may keep it.
        let killed = Instant::now();
        while matches!(child.try_wait(), Ok(None)) && killed.elapsed() < LAST_WORDS {
            thread::sleep(POLL);
        }
    }
    while let Ok(text) = events.recv_timeout(LAST_WORDS) {
        own.findings.push(heard(part, &text));
    }
    own.seconds = start.elapsed().as_secs_f64();
    own.outcome = match ended {
        Ok(status) if status.success() => Outcome::Done,
        _ if interrupted() => Outcome::NotRun("interrupted".to_owned()),
        Ok(status) => failure(part, status, &errors.recv_timeout(LAST_WORDS).unwrap_or_default()),
        Err(why) => Outcome::Failed(why),
    };
    own
}

/// How often a process is looked at, and how long one that was killed or has ended is waited for and heard.
const POLL: Duration = Duration::from_millis(20);
const LAST_WORDS: Duration = Duration::from_secs(5);

/// What a line of a process says.
fn heard(part: Part, line: &str) -> Finding {
    let unheard =
        |error| Finding::Failed { what: part.to_string(), why: format!("said {}: {error}", without_folders(line)) };
    serde_json::from_str(line).unwrap_or_else(unheard)
}

/// How a process has ended without success that wrote this to the standard error.
fn failure(part: Part, status: ExitStatus, said: &str) -> Outcome {
    // The library's own words, on one line; a driver may have said something too.
    let own_words = said.lines().rev().find_map(|line| line.strip_prefix("error: "));
    match (status.code(), own_words) {
        (Some(code), Some(words)) if code == i32::from(LACKING) && part.may_lack() => {
            Outcome::Lacking(without_folders(words))
        }
        (Some(_), Some(words)) => Outcome::Failed(without_folders(words)),
        _ => Outcome::Failed(format!("{status}: {}", without_folders(&last_lines(said)))),
    }
}

/// A text without what paths in it tell of whoever built or runs packstone.
fn without_folders(text: &str) -> String {
    let home = std::env::home_dir().filter(|home| home.components().count() > 1);
    let text = home.map_or(text.to_owned(), |home| text.replace(&*home.to_string_lossy(), "~"));
    text.split(' ').map(without_folder).collect::<Vec<_>>().join(" ")
}

/// Of a path, the sources of a crate, or else the file alone.
fn without_folder(word: &str) -> String {
    let separators = ['/', '\\'];
    let mut begins = word.match_indices(separators).map(|(k, _)| k);
    // Not in `GB/s`.
    let begin = begins.find(|k| !word[..*k].ends_with(char::is_alphanumeric)).filter(|k| k + 1 < word.len());
    let (before, path) = word.split_at(begin.unwrap_or(word.len()));
    let names: Vec<&str> = path.split(separators).collect();
    let sources = names.iter().rposition(|name| *name == "src").unwrap_or(names.len());
    format!("{before}{}", names[sources.saturating_sub(1)..].join("/"))
}

/// The process, its lines, and what it writes to the standard error, once it has ended.
fn begin(part: Part, restrictions: Restrictions) -> std::io::Result<(Child, Receiver<String>, Receiver<String>)> {
    let part = serde_json::to_string(&part).expect("plain data is always JSON");
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["bench", "gpu", "--part", &part]);
    if restrictions != Restrictions::default() {
        command.args(["--restrict", &restrictions.to_string()]);
    }
    if let Some(number) = selected() {
        command.args(["--adapter", &number.to_string()]);
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
        Outcome::Lacking(why) => format!("lacking: {why}"),
        Outcome::NotRun(why) => format!("not run, {why}"),
    };
    let speed = own.findings.iter().find_map(|finding| match finding {
        Finding::Speed(s) => Some(format!(", {:.2e} particle-steps/s", s.particle_steps_per_second)),
        _ => None,
    });
    format!("{}: {outcome}{}", own.part, speed.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_left_out() {
        for (text, left) in [
            (
                "at /home/alice/.cargo/registry/src/index-1/wgpu-core-27/src/lib.rs:12:3: lost",
                "at wgpu-core-27/src/lib.rs:12:3: lost",
            ),
            (
                "at C:\\Users\\alice\\.cargo\\registry\\src\\index-1\\naga-27\\src\\a.rs:1:2:",
                "at C:naga-27/src/a.rs:1:2:",
            ),
            ("`/opt/alice/libvulkan.so`: 3 / 4 GB/s, a\\b", "`libvulkan.so`: 3 / 4 GB/s, a\\b"),
            ("/src/lib.rs", "/src/lib.rs"),
        ] {
            assert_eq!(without_folders(text), left);
        }
        let home = std::env::home_dir().unwrap();
        let name = home.file_name().unwrap().to_string_lossy().into_owned();
        assert!(!without_folders(&home.join("file").display().to_string()).contains(&name));
    }

    #[cfg(unix)]
    #[test]
    fn errors_are_told_in_the_librarys_words() {
        use std::os::unix::process::ExitStatusExt;
        let ended = |code: i32| ExitStatus::from_raw(code << 8);
        let said = "MESA: error: no\nerror: shader advance.wgsl:3: kernel `a`: Shader validation error: b\nMESA: end\n";
        let words = "shader advance.wgsl:3: kernel `a`: Shader validation error: b".to_owned();
        let speed = Part::Speed { case: packstone::bench::gpu::Case::Disks, grains: 1000 };
        assert_eq!(failure(speed, ended(2), said), Outcome::Failed(words.clone()));
        assert_eq!(failure(speed, ended(LACKING.into()), said), Outcome::Lacking(words.clone()));
        // Without an adapter there is nothing.
        assert_eq!(failure(Part::Adapter, ended(LACKING.into()), said), Outcome::Failed(words));
        let crash = failure(speed, ExitStatus::from_raw(11), "\nat /home/alice/packstone/src/lib.rs:1\n");
        assert!(
            matches!(&crash, Outcome::Failed(why) if why.contains("SIGSEGV") && why.ends_with("at packstone/src/lib.rs:1"))
        );
        assert!(matches!(failure(speed, ended(101), "panicked"), Outcome::Failed(why) if why.ends_with(": panicked")));
    }
}
