//! `packstone bench gpu`: what it measures, and that whatever goes wrong becomes a line of the report.

use packstone::{
    Result,
    bench::gpu::{Case, Finding, Outcome, Part, PartRecord, Record, Speed, measure, report},
    gpu::{Device, DeviceOptions, Restrictions},
};
use serde_json::Value;
use std::{
    fs,
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
    // From the set-up to wherever it goes.
    for (k, lost_after) in (0..12).map(|k| 5 << k).enumerate() {
        let (all, done) = found(SPHERES, Restrictions { lost_after: Some(lost_after), ..Restrictions::default() });
        let Err(error) = done else {
            assert!(k > 0 && all.len() == 3, "it is lost in the set-up, or never");
            return;
        };
        assert!(error.to_string().ends_with("the device is lost"), "{error}");
        assert!(all.len() < 3 && (k > 0 || all.is_empty()), "{all:?}");
    }
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
    let children = format!("/proc/{0}/task/{0}/children", child.id());
    let part = loop {
        let children = fs::read_to_string(&children).unwrap();
        if let Some(part) = children.split_whitespace().next() {
            break part.to_owned();
        }
    };
    assert!(Command::new("kill").args(["-KILL", &part]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let record = json(folder.path());
    assert_eq!((&record["finished"], parts(&record, "failed", "SIGKILL")), (&Value::Bool(true), 1), "{record}");
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_benchmark_has_a_report() {
    if no_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut child = command(&["--minutes", "1"], folder.path()).spawn().unwrap();
    wait(folder.path(), &mut child, |record| parts(record, "done", "") >= 1);
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("Please send back"));
    assert!(page(folder.path()).contains("Not finished"));
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

/// Whatever a device calls itself, and whatever numbers come out.
#[test]
fn the_page_bears_anything() {
    let speed = |grains: usize, ms_per_step: f64| {
        Finding::Speed(Speed {
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
        })
    };
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
        part(SPHERES, Outcome::Done, vec![speed(1000, 0.1), speed(10_000, 0.0), speed(1_000_000, 1.0)]),
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
