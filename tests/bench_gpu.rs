//! `packstone bench gpu`: what it measures, and that whatever goes wrong becomes a line of the report.

use packstone::{
    Error, Result,
    bench::{
        gpu::{Case, CheckFinding, Finding, Outcome, Part, PartRecord, Record, Speed, Stage, measure, report},
        traffic,
    },
    gpu::{Device, DeviceOptions, Restrictions},
};
use serde_json::Value;
use std::{
    fs,
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

fn no_gpu() -> bool {
    let none = Device::open(DeviceOptions::default()).is_err();
    let expected = std::env::var_os("PACKSTONE_ALLOW_NO_GPU").is_none();
    assert!(!(none && expected), "no adapter; see PACKSTONE_ALLOW_NO_GPU in test.sh");
    none
}

fn found(part: Part, restrictions: Restrictions) -> (Vec<Finding>, Result<()>) {
    let mut all = Vec::new();
    let done = measure(part, restrictions, &mut |finding| all.push(finding));
    (all, done)
}

const SPHERES: Part = Part::Speed { case: Case::Spheres, grains: 500 };

#[test]
fn a_speed_has_work_of_the_host_stages_and_traffic() {
    if no_gpu() {
        return;
    }
    for no_timestamps in [false, true] {
        let (all, done) = found(SPHERES, Restrictions { no_timestamps, ..Restrictions::default() });
        done.unwrap();
        let [Finding::Speed(speed), Finding::Stages { clock, rows, .. }, Finding::Traffic { rows: counted, .. }] =
            &all[..]
        else {
            panic!("{all:?}");
        };
        let Speed { ms_per_step, host_ms_per_step, submission_ms_per_step, .. } = *speed;
        assert!(ms_per_step >= host_ms_per_step && host_ms_per_step >= submission_ms_per_step, "{speed:?}");
        assert!(speed.ahead_ms_per_step > 0.0 && speed.ahead_ms_per_step < host_ms_per_step, "{speed:?}");
        assert!(submission_ms_per_step > 0.0 && speed.bytes_per_grain > 100.0, "{speed:?}");
        assert!(rows.iter().any(|stage| stage.stage == "advance" && stage.ms_per_call > 0.0), "{rows:?}");
        assert!(!no_timestamps || clock.starts_with("host"), "{clock}");
        // A lattice of eight neighbours, and lists that reach a little beyond.
        assert!(counted.iter().all(|row| row.kernel == "advance" && row.list >= 8.0), "{counted:?}");
    }
}

#[test]
fn runs_end_with_the_same_bits_whatever_the_settings() {
    if no_gpu() {
        return;
    }
    let (all, done) = found(Part::Repeat { case: Case::Rods, grains: 500, process: 1 }, Restrictions::default());
    done.unwrap();
    let [Finding::Bits { hash: first, .. }, Finding::Bits { hash: second, .. }] = &all[..] else { panic!("{all:?}") };
    assert_eq!(first, second);
    let (all, done) = found(Part::Variants { grains: 500 }, Restrictions::default());
    done.unwrap();
    let mut compared = 0;
    for finding in &all {
        match finding {
            Finding::Variant(variant) => {
                assert!(variant.ms_per_step > 0.0 && variant.same_bits != Some(false), "{variant:?}");
                compared += usize::from(variant.same_bits.is_some());
            }
            Finding::Lacking { .. } => {}
            other => panic!("{other:?}"),
        }
    }
    assert!(compared >= 4, "{all:?}");
}

/// Neither what does not fit nor settings that a device lacks are failures.
#[test]
fn what_a_machine_lacks_is_told_apart() {
    let huge = Part::Speed { case: Case::Spheres, grains: 1_000_000_000 };
    let (all, done) = found(huge, Restrictions::default());
    assert!(all.is_empty() && matches!(done, Err(Error::Lacking(_))), "{done:?}");
    if no_gpu() {
        return;
    }
    let few = Restrictions { storage_buffers: Some(8), ..Restrictions::default() };
    let (all, done) = found(Part::Variants { grains: 500 }, few);
    done.unwrap();
    let lacks = |what: &str| all.iter().any(|f| matches!(f, Finding::Lacking { what: lacking, .. } if lacking == what));
    assert!(lacks("--arrays buffers") && !lacks("--checks off"), "{all:?}");
    assert!(!all.iter().any(|finding| matches!(finding, Finding::Failed { .. })), "{all:?}");
}

#[test]
fn kernels_are_checked() {
    if no_gpu() {
        return;
    }
    let (all, done) = found(Part::Check { case: Case::Disks, double: false }, Restrictions::default());
    done.unwrap();
    let [Finding::Check(check)] = &all[..] else { panic!("{all:?}") };
    assert!(check.passed && check.contacts > 1000 && check.rows.len() > 20, "{check:?}");
}

#[test]
fn what_was_found_before_the_device_was_lost_stands() {
    if no_gpu() {
        return;
    }
    // From the set-up on; most submissions are those of the stages, one by one, after the speed is known.
    let mut seen = [0; 2];
    for lost_after in (0..16).map(|k| 5 << k) {
        let restrictions =
            Restrictions { lost_after: Some(lost_after), no_timestamps: true, ..Restrictions::default() };
        let (all, done) = found(SPHERES, restrictions);
        match done {
            Ok(()) => break,
            Err(error) => assert!(error.to_string().ends_with("the device is lost"), "{error}"),
        }
        match &all[..] {
            [] => seen[0] += 1,
            [Finding::Speed(_), ..] => seen[1] += 1,
            other => panic!("{other:?}"),
        }
    }
    println!("lost before a speed was known, and after: {seen:?}");
    assert!(seen.iter().all(|times| *times > 0), "{seen:?}");
}

fn command(arguments: &[&str], out: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_packstone"));
    command.args(["bench", "gpu", "--out"]).arg(out).args(arguments);
    command.current_dir(env!("CARGO_MANIFEST_DIR")).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn json(out: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(out.join(report::JSON)).unwrap()).unwrap()
}

fn page(out: &Path) -> String {
    fs::read_to_string(out.join(report::PAGE)).unwrap()
}

/// Parts of which this is the outcome: `done`, or what the text under `failed` or `not_run` contains.
fn parts(record: &Value, outcome: &str, text: &str) -> usize {
    let is = |part: &&Value| match &part["outcome"] {
        Value::String(word) => word == outcome,
        other => other[outcome].as_str().is_some_and(|why| why.contains(text)),
    };
    record["parts"].as_array().unwrap().iter().filter(is).count()
}

#[test]
fn a_device_that_is_lost_again_and_again_is_reported() {
    if no_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = command(&["--minutes", "0.2", "--restrict", "lost-after=3"], folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let record = json(folder.path());
    assert_eq!(record["finished"], true);
    // Opening it submits nothing.
    assert!(parts(&record, "done", "") >= 1, "{record}");
    assert!(parts(&record, "failed", "the device is lost") >= 3, "{record}");
    let page = page(folder.path());
    assert!(page.contains("check spheres, single: ") && page.contains("the device is lost"));
    assert!(page.contains("taken to have less than it has: lost-after=3"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_machine_without_adapter_gets_a_report_too() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = command(&[], folder.path());
    let output = command.env("VK_DRIVER_FILES", "/dev/null").env("VK_ICD_FILENAMES", "/dev/null").output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let record = json(folder.path());
    assert_eq!((parts(&record, "failed", "no GPU adapter found"), parts(&record, "done", "")), (1, 0));
    assert!(parts(&record, "not_run", "no device can be opened") > 10);
    assert!(page(folder.path()).contains("no GPU adapter found"));
}

/// Wait until the record on disk is as wanted.
fn wait(out: &Path, child: &mut Child, wanted: impl Fn(&Value) -> bool) {
    let start = Instant::now();
    while !(out.join(report::JSON).is_file() && wanted(&json(out))) {
        assert!(start.elapsed() < Duration::from_secs(120), "nothing comes");
        assert!(child.try_wait().unwrap().is_none(), "it is over already");
        sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_kill_leaves_what_was_measured() {
    if no_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut child = command(&["--minutes", "1"], folder.path()).spawn().unwrap();
    wait(folder.path(), &mut child, |record| parts(record, "done", "") >= 2);
    child.kill().unwrap();
    child.wait().unwrap();
    let record = json(folder.path());
    assert_eq!(record["finished"], false);
    let page = page(folder.path());
    assert!(page.contains("Not finished") && page.contains("a kernel that copies") && page.ends_with("</html>\n"));
}

/// As where a driver crashes, or memory runs out.
#[cfg(target_os = "linux")]
#[test]
fn a_part_that_is_killed_is_a_line_and_not_the_end() {
    if no_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut child = command(&["--minutes", "0.1"], folder.path()).spawn().unwrap();
    wait(folder.path(), &mut child, |record| parts(record, "done", "") >= 1);
    let part = process_of_part(&child);
    assert!(Command::new("kill").args(["-KILL", &part]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let record = json(folder.path());
    assert_eq!((&record["finished"], parts(&record, "failed", "SIGKILL")), (&Value::Bool(true), 1), "{record}");
}

/// The process of the part that runs.
#[cfg(target_os = "linux")]
fn process_of_part(child: &Child) -> String {
    let children = format!("/proc/{0}/task/{0}/children", child.id());
    loop {
        if let Some(part) = fs::read_to_string(&children).unwrap().split_whitespace().next() {
            return part.to_owned();
        }
    }
}

/// As at a terminal, where all processes get the Ctrl-C.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_benchmark_has_a_report() {
    use std::os::unix::process::CommandExt;
    if no_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut child = command(&["--minutes", "1"], folder.path()).process_group(0).spawn().unwrap();
    wait(folder.path(), &mut child, |record| parts(record, "done", "") >= 1);
    process_of_part(&child);
    assert!(Command::new("kill").args(["-INT", "--", &format!("-{}", child.id())]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("Please send back"));
    let record = json(folder.path());
    assert_eq!((parts(&record, "not_run", "interrupted"), parts(&record, "failed", "")), (1, 0), "{record}");
    let page = page(folder.path());
    assert!(page.contains("Not finished") && page.contains("Nothing failed"));
}

/// Where the page is open in a viewer, or the disk is full for a while.
#[test]
fn a_report_that_cannot_be_written_is_written_later() {
    if no_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (out, away) = (folder.path().join("out"), folder.path().join("away"));
    let mut child = command(&["--minutes", "0.1"], &out).spawn().unwrap();
    wait(&out, &mut child, |record| parts(record, "done", "") >= 1);
    fs::rename(&out, &away).unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(|line| line.ok());
    let warning = lines.find(|line| line.starts_with("warning: ")).expect("something cannot be written");
    assert!(warning.contains("out"), "{warning}");
    fs::rename(&away, &out).unwrap();
    lines.for_each(drop);
    assert!(child.wait().unwrap().code().is_some_and(|code| code < 2));
    assert_eq!(json(&out)["finished"], true);
}

#[test]
fn wrong_arguments_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    for (out, arguments, words) in [
        (folder.path(), &["--minutes", "0"][..], "must be a number > 0"),
        (folder.path(), &["--minutes", "nan"], "must be a number > 0"),
        (folder.path(), &["--restrict", "buffers"], "there is no restriction `buffers`"),
        (folder.path(), &["--part", "everything"], "invalid value 'everything'"),
        (file.as_path(), &[], "file"),
    ] {
        let output = command(arguments, out).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(errors.starts_with("error: ") && errors.contains(words), "{errors}");
    }
}

fn speed(grains: usize, ms_per_step: f64) -> Speed {
    Speed {
        case: Case::Spheres,
        grains,
        steps: 50,
        setup_seconds: 0.1,
        ms_per_step,
        host_ms_per_step: 0.04,
        submission_ms_per_step: 0.01,
        ahead_ms_per_step: 0.01,
        particle_steps_per_second: 1e3 * grains as f64 / ms_per_step,
        bytes_per_grain: 300.0,
        placements: [("buffer".to_owned(), 9)].into(),
    }
}

/// Whatever a device calls itself, and whatever numbers come out.
#[test]
fn the_page_bears_anything() {
    let facts = Finding::Facts { of: "device".to_owned(), rows: vec![("name".to_owned(), "</script><b>&".to_owned())] };
    let bits = |place: &str, hash: &str| Finding::Bits {
        run: "spheres".to_owned(),
        place: place.to_owned(),
        hash: hash.to_owned(),
    };
    let part = |part, outcome, findings| PartRecord { part, seconds: 1.0, outcome, findings };
    let mut record = Record::new(5.0, Restrictions::default());
    record.parts = vec![
        part(Part::Adapter, Outcome::Done, vec![facts]),
        part(Part::Copies, Outcome::Failed("no <memory>".to_owned()), Vec::new()),
        part(
            SPHERES,
            Outcome::Done,
            [(1000, 0.1), (10_000, 0.0), (1_000_000, 1.0)].map(|(n, ms)| Finding::Speed(speed(n, ms))).into(),
        ),
        part(SPHERES, Outcome::Running, vec![bits("here", "1"), bits("there", "2")]),
    ];
    let defects = record.defects();
    assert_eq!(defects.len(), 2, "{defects:?}");
    assert!(defects[1].contains("different bits"), "{defects:?}");
    let folder = tempfile::tempdir().unwrap();
    report::write(folder.path(), &record).unwrap();
    let page = page(folder.path());
    for text in ["&lt;/script&gt;&lt;b&gt;&amp;", "no &lt;memory&gt;", "(at most 0.05: met)", "DIFFERENT", "</svg>"] {
        assert!(page.contains(text), "the page lacks {text}");
    }
    assert_eq!(page.matches("</script>").count(), 1);
    let data = page.split_once("id=\"record\">").unwrap().1.split_once("</script>").unwrap().0;
    let data: Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["parts"][0]["findings"][0]["facts"]["rows"][0][1], "</script><b>&");
}

/// What did not run is not counted as if it had gone well, nor what does not fit as if it had gone wrong.
#[test]
fn the_page_counts_what_was_tried() {
    let bits = |hash: &str| Finding::Bits { run: "r".to_owned(), place: "p".to_owned(), hash: hash.to_owned() };
    let check = |passed| {
        let (case, precision) = (Case::Disks, "single".to_owned());
        let rows = Vec::new();
        Finding::Check(CheckFinding { case, precision, grains: 9, contacts: 9, passed, trajectory: None, rows })
    };
    let repeat = |case, process| Part::Repeat { case, grains: 70, process };
    let checked = |case, double| Part::Check { case, double };
    let [failed, lacking] = [Outcome::Failed("f".to_owned()), Outcome::Lacking("no <room>".to_owned())];
    let part = |part, outcome, findings| PartRecord { part, seconds: 1.0, outcome, findings };
    let mut record = Record::new(5.0, Restrictions::default());
    record.parts = vec![
        part(checked(Case::Disks, false), Outcome::Done, vec![check(true)]),
        part(checked(Case::Rods, false), failed.clone(), Vec::new()),
        part(checked(Case::Spheres, true), lacking.clone(), Vec::new()),
        part(repeat(Case::Spheres, 1), Outcome::Done, vec![bits("1"), bits("1")]),
        part(repeat(Case::Rods, 1), failed.clone(), Vec::new()),
        part(repeat(Case::Disks, 1), Outcome::NotRun("no time".to_owned()), Vec::new()),
        part(repeat(Case::Spheres, 2), failed, vec![bits("1")]),
        part(SPHERES, lacking, Vec::new()),
    ];
    assert_eq!(record.defects().len(), 3, "{:?}", record.defects());
    let folder = tempfile::tempdir().unwrap();
    report::write(folder.path(), &record).unwrap();
    let page = page(folder.path());
    for text in [
        "1 of 2 scenes passed",
        "spheres 70, 3 of 4 runs; rods 70, 0 of 4 runs<",
        "speed spheres 500</td><td>no &lt;room",
    ] {
        assert!(page.contains(text), "the page lacks {text}");
    }
}

/// Accesses are counted for arrays in buffers: the times of others say nothing of them.
#[test]
fn traffic_stands_beside_the_times_of_buffers_only() {
    let row = traffic::Row {
        kernel: "advance".to_owned(),
        lanes: 32,
        warps: 16,
        passes: 1.0,
        list: 1.0,
        lines: 1.0,
        sectors: 1.0,
        bytes: 1.0,
        gathered: 1.0,
    };
    let stage = Stage { stage: "advance".to_owned(), calls: 1, ms_per_call: 0.123_45, share: 1.0, bytes: 1 };
    let (case, grains) = (Case::Disks, 500);
    let times = |placement: &str| {
        let mut speed = speed(grains, 1.0);
        (speed.case, speed.placements) = (case, [("buffer".to_owned(), 9), (placement.to_owned(), 1)].into());
        let mut record = Record::new(5.0, Restrictions::default());
        let findings = vec![
            Finding::Speed(speed),
            Finding::Stages { case, grains, clock: "host".to_owned(), rows: vec![stage.clone()] },
            Finding::Traffic { case, grains, rows: vec![row.clone()] },
        ];
        record.parts = vec![PartRecord { part: SPHERES, seconds: 1.0, outcome: Outcome::Done, findings }];
        let folder = tempfile::tempdir().unwrap();
        report::write(folder.path(), &record).unwrap();
        page(folder.path()).matches(">0.12345<").count()
    };
    assert_eq!((times("buffer"), times("image")), (2, 1));
}

/// Arrays in parts, or packed: the same runs with the same bits.
#[test]
fn lesser_devices_end_with_the_same_bits() {
    if no_gpu() {
        return;
    }
    let bits = |restrict: Option<&str>| {
        let restrictions = restrict.map(|list| list.parse().unwrap()).unwrap_or_default();
        let (all, done) = found(Part::Repeat { case: Case::Spheres, grains: 2000, process: 1 }, restrictions);
        done.unwrap_or_else(|error| panic!("{restrict:?}: {error}"));
        all
    };
    let expected = bits(None);
    for list in ["storage-buffers=8", "binding-bytes=200000", "no-subgroups", "no-timestamps"] {
        assert_eq!(bits(Some(list)), expected, "{list}");
    }
}
