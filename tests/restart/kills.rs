//! Runs that are killed, and what they leave behind.

use crate::{
    FEW_DIMERS, FEW_DISKS, SETTLE,
    place::{self, Place},
};
use std::{
    fs,
    path::Path,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::Duration,
};

/// A scene, what is changed in it, and how it is run. The last one has all that there is of motion: walls, periods, clumps.
const RUNS: [(&str, &[&str], &[&str]); 4] = [
    (
        "hard/size_ratio.toml",
        &[],
        &["--engine=cpu", "--steps=6000", "--set=output.snapshots=5e-4", "--set=output.works=true"],
    ),
    ("hard/size_ratio.toml", &[], &["--engine=gpu", "--steps=1500", "--set=output.snapshots=2e-4"]),
    (
        "hard/rigid_settling_2d.toml",
        &FEW_DISKS,
        &[
            "--engine=cpu",
            "--steps=300",
            "--set=solver.relaxation=coloured-accelerated",
            "--set=solver.max_iterations=50",
        ],
    ),
    ("hard/dimer_bed.toml", &FEW_DIMERS, &["--engine=gpu", "--steps=1500", "--set=output.formats=[\"csv\", \"bin\"]"]),
];

/// Killed again and again, at moments that nobody has chosen, a run leaves what it leaves when nobody disturbs it.
#[test]
fn kills_leave_no_trace() {
    let gpu = place::engines().contains(&"gpu");
    let folder = tempfile::tempdir().unwrap();
    let packstone = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_packstone"));
        command.current_dir(folder.path()).args(arguments).stdout(Stdio::null()).stderr(Stdio::piped());
        command.spawn().unwrap()
    };
    let ends = |child: Child| {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    let mut random = 7_u64;
    let mut kills = 0;
    for (k, (scene, changes, how)) in RUNS.into_iter().enumerate() {
        if !gpu && how[0] == "--engine=gpu" {
            continue;
        }
        let scene = Path::new("examples/scenes").join(scene).canonicalize().unwrap();
        let (whole, cut) = (format!("whole_{k}"), format!("cut_{k}"));
        let changes: Vec<String> = changes.iter().map(|change| format!("--set={change}")).collect();
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let run = [&["run", scene.to_str().unwrap()], how, &changes].concat();
        ends(packstone(&[&run[..], &["--out", &whole]].concat()));
        let mut child = packstone(&[&run[..], &["--set=output.checkpoint=0.01", "--out", &cut]].concat());
        let place = folder.path().join(&cut);
        for _ in 0..5 {
            let latest = || fs::metadata(place.join("partial/checkpoint.bin")).and_then(|found| found.modified()).ok();
            let before = latest();
            while latest() == before && child.try_wait().unwrap().is_none() {
                sleep(Duration::from_millis(1));
            }
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sleep(Duration::from_micros((random >> 32) % 60_000));
            child.kill().unwrap();
            if child.wait().unwrap().code().is_some() {
                break;
            }
            kills += 1;
            child = packstone(&["run", "--resume", &cut]);
        }
        ends(child);
        assert_alike(&folder.path().join(&whole), &place);
    }
    println!("{kills} kills");
    assert!(kills >= if gpu { 16 } else { 8 }, "only {kills} runs were killed before they ended");
}

/// Killed in every stage, as it begins and in its middle, a run in stages goes on in that stage and leaves the same.
#[test]
fn kills_in_stages_leave_no_trace() {
    const STAGES: &str = r#"
[[stage]]
name = "fall"
[[stage]]
name = "slip"
material.glass.friction = 0.1
[[stage]]
name = "press"
wall.lid.velocity = [0, -0.05]
wall.lid.oscillation = { amplitude = [0, 1e-4], frequency = 50 }
"#;
    let place = Place::new(&(SETTLE.to_owned() + STAGES));
    let run = ["run", "scene.toml", "--engine=cpu", "--time=0.3"];
    place.packstone(&[&run[..], &["--out=whole"]].concat(), 0);
    let mut arguments = [&run[..], &["--out=cut", "--set=output.checkpoint=0.01"]].concat();
    let mut kills = 0;
    for (k, seen) in
        ["fall/partial/checkpoint.bin", "slip", "slip/partial/checkpoint.bin", "press/partial/checkpoint.bin"]
            .into_iter()
            .enumerate()
    {
        let mut child = place.command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        while !place.path("cut/partial/stages").join(seen).exists() && child.try_wait().unwrap().is_none() {
            sleep(Duration::from_millis(1));
        }
        sleep(Duration::from_millis(7 * k as u64));
        child.kill().unwrap();
        kills += u32::from(child.wait().unwrap().code().is_none());
        arguments = vec!["run", "--resume", "cut"];
    }
    assert!(kills >= 3, "only {kills} runs were killed before they ended");
    let said = place.errors(&arguments, 0);
    assert!(said.contains("goes on from step") || kills < 4, "{said}");
    assert_alike(&place.path("whole"), &place.path("cut"));
    let stages = place.summary("cut")["stages"].as_array().unwrap().len();
    assert_eq!((stages, place.path("cut/partial").exists()), (3, false));
}

/// All files of a result are those of another one, but for times, the command line, and when there were checkpoints.
fn assert_alike(whole: &Path, cut: &Path) {
    for entry in fs::read_dir(whole).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let [whole, cut] = [whole, cut].map(|folder| folder.join(&name));
        let of = |path: &Path| fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        match &*name {
            "run.json" | "scene.toml" | "scene.given.toml" | "checkpoint.bin" | ".packstone" => {}
            _ if whole.is_dir() => assert_alike(&whole, &cut),
            "history.csv" => assert_eq!(without_speeds(&of(&whole)), without_speeds(&of(&cut)), "{}", cut.display()),
            "summary.json" => {
                let summary = |path: &Path| {
                    let mut summary: serde_json::Value = serde_json::from_slice(&of(path)).unwrap();
                    let keys = summary.as_object_mut().unwrap();
                    ["wall_seconds", "particle_steps_per_second"]
                        .iter()
                        .for_each(|key| assert!(keys.remove(*key).is_some()));
                    summary
                };
                assert_eq!(summary(&whole), summary(&cut), "{}", cut.display());
            }
            _ => assert!(of(&whole) == of(&cut), "{}", cut.display()),
        }
    }
}

/// The rows of a history without the column that is never the same.
fn without_speeds(history: &[u8]) -> Vec<Vec<String>> {
    let rows = std::str::from_utf8(history).unwrap().lines().map(|line| line.split(',').map(str::to_owned).collect());
    let mut rows: Vec<Vec<String>> = rows.collect();
    let speed = rows[0].iter().position(|column| column == "particle_steps_per_second").unwrap();
    rows.iter_mut().for_each(|row| drop(row.remove(speed)));
    rows
}

/// What goes wrong around a checkpoint costs neither it nor the result beside it.
#[test]
fn results_beside_checkpoints_stay_usable() {
    let place = Place::new(SETTLE);
    place.errors(&["run", "scene.toml", "--engine=cpu", "--steps=500", "--out=out"], 0);
    let killed = |out: &str| {
        let run = ["run", "scene.toml", "--engine=cpu", "--steps=100000000", "--set=output.checkpoint=1e6", out];
        let mut child = place.command(&run).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let folder = place.path(out.strip_prefix("--out=").unwrap());
        while !fs::read_to_string(folder.join("partial/history.csv")).is_ok_and(|rows| rows.lines().count() > 1) {
            assert!(child.try_wait().unwrap().is_none());
            sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        child.wait().unwrap();
    };
    // A partial result without a checkpoint hides no result that has one.
    killed("--out=out");
    let said = place.errors(&["run", "--resume=out", "--steps=600"], 0);
    assert!(said.contains("was killed before its first checkpoint"), "{said}");
    assert_eq!(place.summary("out")["steps"], 600);
    killed("--out=out");
    place.write("next.toml", SETTLE);
    let said = place.errors(&["run", "next.toml", "--from=out", "--engine=cpu", "--steps=10", "--out=next"], 0);
    assert!(said.contains("note: out at step 600"), "{said}");

    // A run that cannot be continued leaves all as it was, so that it can be when that is mended.
    let scene = place.text("next/scene.toml");
    place.write("next/scene.toml", "no scene");
    place.errors(&["run", "--resume=next", "--steps=20"], 2);
    assert!(!place.path("next/partial").exists());
    place.write("next/scene.toml", &scene);
    place.errors(&["run", "--resume=next", "--steps=20"], 0);

    // A run that was set aside can be continued where it is.
    let long = ["run", "scene.toml", "--engine=cpu", "--steps=40000", "--set=output.checkpoint=1e-3", "--out=cut"];
    let mut child = place.command(&long).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !place.path("cut/partial/checkpoint.bin").exists() {
        sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let said = place.errors(&["run", "scene.toml", "--engine=cpu", "--steps=100", "--out=cut"], 0);
    assert!(said.contains("packstone run --resume cut/partial.1 goes on with it"), "{said}");
    place.errors(&["run", "--resume=cut/partial.1"], 0);
    // The scene ends before.
    assert_eq!(place.summary("cut/partial.1")["ended"], "last step");
    for (wrong, why) in [("nowhere", "there is no such folder"), ("scene.toml", "is a file"), (".", "has no run.json")]
    {
        let said = place.errors(&["run", "--resume", wrong], 2);
        assert!(said.contains(why), "{said}");
    }
}
