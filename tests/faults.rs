//! What users and machines do to runs: kills, full disks, folders that vanish, files that are in the way.

#[path = "common/place.rs"]
mod place;

use place::{Place, errors};
use serde_json::Value;
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

const DISKS: &str = r#"
dimension = 2
[material.glass]
density = 2500
normal_stiffness = 1e5
friction = 0.4
normal_damping = 2000
[[wall]]
kind = "box"
name = "bin"
material = "glass"
lower = [0, 0]
upper = [0.025, 1]
faces = ["x-", "x+", "y-"]
[[population]]
material = "glass"
count = 100
radius = { uniform = [0.8e-3, 1.2e-3] }
[stop]
steps = 200
[output]
formats = ["csv", "bin", "vtp"]
"#;

/// Goes on for hours, and has something to write all the time.
const ENDLESS: [&str; 3] = ["--steps=100000000", "--set=output.history=1e-3", "--set=output.snapshots=1e-2"];

/// A child that does not outlive a test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Running {
    /// A run that has written some rows.
    fn start(place: &Place, more: &[&str]) -> Running {
        let arguments = [&["run", "scene.toml", "--engine=cpu"], &ENDLESS[..], more].concat();
        let mut command = place.command(&arguments);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
        let out = more.iter().find_map(|argument| argument.strip_prefix("--out=")).unwrap_or("out/scene");
        let history = place.path(out).join("partial/history.csv");
        let began = Instant::now();
        while !fs::read_to_string(&history).is_ok_and(|text| text.lines().count() > 5) {
            let ended = child.try_wait().expect("a process");
            assert!(ended.is_none() && began.elapsed() < Duration::from_secs(30), "{ended:?}");
            sleep(Duration::from_millis(10));
        }
        Running(child)
    }

    fn kill(mut self) {
        self.0.kill().expect("a process");
        self.0.wait().expect("a process");
    }

    /// Waits for the end, in vain if it takes too long.
    fn end(mut self, code: i32) -> Output {
        let began = Instant::now();
        while self.0.try_wait().expect("a process").is_none() {
            assert!(began.elapsed() < Duration::from_secs(30), "it goes on");
            sleep(Duration::from_millis(10));
        }
        use std::io::Read;
        let (mut stdout, mut stderr) = (Vec::new(), Vec::new());
        self.0.stdout.take().unwrap().read_to_end(&mut stdout).unwrap();
        self.0.stderr.take().unwrap().read_to_end(&mut stderr).unwrap();
        let output = Output { status: self.0.wait().unwrap(), stdout, stderr };
        assert_eq!(output.status.code(), Some(code), "{output:?}");
        output
    }

    #[cfg(unix)]
    fn interrupt(&self) {
        let status = Command::new("kill").args(["-INT", &self.0.id().to_string()]).status();
        assert!(status.expect("kill starts").success());
    }
}

/// All files of a folder and those in it, but for what packstone hides.
fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let (name, kind) = (entry.file_name().into_string().unwrap(), entry.file_type().unwrap());
        if kind.is_dir() && name != ".packstone" {
            found.extend(content(&entry.path()).into_iter().map(|(inside, text)| (format!("{name}/{inside}"), text)));
        } else if kind.is_file() {
            found.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    found
}

/// What is in a folder but not in those of results that did not end.
fn result(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    content(folder).into_iter().filter(|(name, _)| !name.starts_with("partial")).collect()
}

/// Every line of a history is whole, and there are several.
fn check_history(text: &str) {
    let columns = text.lines().next().expect("a header").split(',').count();
    assert!(text.ends_with('\n') && text.lines().count() > 1, "{text}");
    assert!(text.lines().all(|line| line.split(',').count() == columns), "{text}");
}

#[test]
fn a_killed_run_leaves_the_older_result_and_its_own() {
    let place = Place::new(DISKS);
    place.run(&[], 0);
    let before = result(&place.path("out/scene"));
    Running::start(&place, &[]).kill();
    assert_eq!(result(&place.path("out/scene")), before);
    let partial = content(&place.path("out/scene/partial"));
    check_history(std::str::from_utf8(&partial["history.csv"]).unwrap());
    assert!(partial["snapshot_000000.vtp"].ends_with(b"</VTKFile>\n"));
    // The series lists what is there, up to one that was just being written.
    let series = String::from_utf8(partial["packstone.pvd"].clone()).unwrap();
    let snapshots = partial.keys().filter(|name| name.ends_with(".vtp")).count();
    let listed = series.matches("<DataSet ").count();
    assert!(series.ends_with("</VTKFile>\n") && (listed == snapshots || listed + 1 == snapshots), "{series}");
    assert_eq!(place.json("out/scene/partial/run.json")["ended"], Value::Null);
    assert_eq!(packstone::io::folder::find(&place.path("out/scene")).unwrap(), (place.path("out/scene"), None));

    // The next run keeps what is there of it.
    let output = place.run(&["--steps=50"], 0);
    assert!(
        errors(&output)
            .contains("note: out/scene/partial, the partial result of an earlier run, is now out/scene/partial.1")
    );
    assert_eq!(content(&place.path("out/scene/partial.1")), partial);
    assert!(!place.path("out/scene/partial").exists());
    assert_eq!(place.json("out/scene/summary.json")["steps"], 50);
}

/// Nobody takes the folder of a run that is not at its end for one without the right formats.
#[test]
fn render_tells_that_a_run_was_killed() {
    let place = Place::new(DISKS);
    let csv = "--set=output.formats=[\"csv\"]";
    Running::start(&place, &[csv]).kill();
    let said = place.errors(&["render", "out/scene"], 2);
    assert!(said.contains("neither grains nor a checkpoint yet; if it was, run its scene anew"), "{said}");
    let running = Running::start(&place, &[csv, "--out=with", "--set=output.checkpoint=1e-3"]);
    let checkpoint = place.path("with/partial/checkpoint.bin");
    let began = Instant::now();
    while !checkpoint.exists() {
        assert!(began.elapsed() < Duration::from_secs(30), "no checkpoint");
        sleep(Duration::from_millis(10));
    }
    running.kill();
    let said = place.errors(&["render", "with"], 2);
    assert!(
        said.contains("has written no grains yet; if it was, packstone run --resume with goes on with it"),
        "{said}"
    );
}

/// `run <(command)` has no name to call its result by.
#[cfg(unix)]
#[test]
fn a_scene_from_a_pipe_needs_a_name_for_its_result() {
    let place = Place::new(DISKS);
    let fifo = place.path("fifo");
    assert!(Command::new("mkfifo").arg(&fifo).status().expect("mkfifo starts").success());
    let said = place.errors(&["run", "fifo", "--engine=cpu"], 2);
    assert!(said.contains("fifo: is no file; name the folder of its result with --out") && !place.path("out").exists());
    let mut running = place.command(&["run", "fifo", "--engine=cpu", "--out=new/folder"]).spawn().unwrap();
    fs::write(&fifo, DISKS).unwrap();
    assert!(running.wait().unwrap().success());
    assert!(place.path("new/folder/summary.json").exists());
}

/// Scenes around the limit of the memory run, or say in a line that they are too large. None of them aborts.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_not_there_is_an_error() {
    let place = Place::new(DISKS);
    let (mut ran, mut refused) = (0, 0);
    for count in
        [1_000, 100_000, 300_000, 400_000, 500_000, 700_000, 1_000_000, 3_000_000, 1_000_000_000_000_000_000_u64]
    {
        let line = format!(
            "ulimit -v 900000; exec {} run scene.toml --engine=cpu --steps=1 --out=large --set=population.0.count={count} \
             --set='wall.0.upper=[1, 1000]'",
            env!("CARGO_BIN_EXE_packstone")
        );
        let mut command = Command::new("sh");
        // Threads take address space of their own.
        let output =
            command.current_dir(place.folder()).env("RAYON_NUM_THREADS", "2").args(["-c", &line]).output().unwrap();
        let said = errors(&output);
        match output.status.code() {
            Some(0) => ran += 1,
            Some(2) => {
                refused += 1;
                assert!(said.starts_with("error: scene.toml: ") && said.lines().count() == 1, "{count}: {said}");
                assert!(said.contains("scene too large: "), "{count}: {said}");
            }
            other => panic!("{count}: {other:?}, {said}"),
        }
    }
    assert!(ran >= 2 && refused >= 2, "{ran} ran, {refused} were refused");
}

#[test]
fn a_run_that_was_killed_first_is_found() {
    let place = Place::new(DISKS);
    Running::start(&place, &[]).kill();
    let (found, notice) = packstone::io::folder::find(&place.path("out/scene")).unwrap();
    assert_eq!(found, place.path("out/scene/partial"));
    assert!(notice.unwrap().contains("did not come to its end"));
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_takes_an_empty_place_only() {
    let place = Place::new(DISKS);
    let running = Running::start(&place, &[]);
    running.interrupt();
    running.end(130);
    assert!(place.json("out/scene/run.json")["ended"].as_str().unwrap().starts_with("interrupted at step"));
    assert!(!place.path("out/scene/partial").exists());
    check_history(&place.text("out/scene/history.csv"));

    place.run(&[], 0);
    let before = result(&place.path("out/scene"));
    let running = Running::start(&place, &[]);
    running.interrupt();
    let output = running.end(130);
    assert!(String::from_utf8_lossy(&output.stdout).contains("results in out/scene/partial"), "{output:?}");
    assert!(errors(&output).contains("note: out/scene keeps the older result"), "{output:?}");
    assert_eq!(result(&place.path("out/scene")), before);
    assert!(place.text("out/scene/partial/final.csv").lines().count() == 101);
}

/// What stopped by its physics is no better than what was there.
#[test]
fn a_run_that_had_to_stop_leaves_the_older_result() {
    let place = Place::new(DISKS);
    place.run(&[], 0);
    let before = result(&place.path("out/scene"));
    let output = place.run(&["--set=solver.dt=1e-2", "--set=solver.allow_unstable=true"], 1);
    assert!(errors(&output).contains("error: scene.toml: stopped at step"), "{output:?}");
    assert_eq!(result(&place.path("out/scene")), before);
    assert!(place.json("out/scene/partial/run.json")["ended"].as_str().unwrap().starts_with("stopped at step"));
    assert_eq!(place.text("out/scene/partial/final.csv").lines().count(), 101);
}

#[test]
fn one_run_at_a_time_has_a_folder() {
    let place = Place::new(DISKS);
    let running = Running::start(&place, &[]);
    let output = place.run(&[], 2);
    let wanted = format!("error: out/scene: process {} is writing its results there", running.0.id());
    assert!(errors(&output).starts_with(&wanted), "{output:?}");
    // What it writes at present is a part of that, and so is what would be in it.
    for within in [["--resume", "out/scene/partial"], ["--out", "out/scene/partial"], ["--out", "out/scene/stages/one"]]
    {
        let run: &[&str] = if within[0] == "--out" { &["run", "scene.toml", "--engine=cpu"] } else { &["run"] };
        let said = place.errors(&[run, &within[..]].concat(), 2);
        assert!(said.contains("/out/scene: process ") && said.contains("is writing its results there"), "{said}");
    }
    running.kill();
    // Whoever goes on with it there leaves nothing that is in the way.
    place.run(&["--steps=50", "--set=output.checkpoint=1e-9", "--out=cut"], 0);
    fs::create_dir(place.path("cut/partial")).unwrap();
    for name in ["run.json", "scene.toml", "checkpoint.bin", "history.csv"] {
        fs::rename(place.path("cut").join(name), place.path("cut/partial").join(name)).unwrap();
    }
    fs::create_dir(place.path("cut/partial/.packstone")).unwrap();
    fs::write(place.path("cut/partial/.packstone/lock"), "").unwrap();
    fs::create_dir(place.path("cut/partial/mine")).unwrap();
    fs::write(place.path("cut/partial/mine/notes.txt"), "mine").unwrap();
    for name in ["final.csv", "final.bin", "summary.json", "packstone.pvd", "snapshot_000000.vtp"] {
        fs::remove_file(place.path("cut").join(name)).unwrap();
    }
    place.packstone(&["run", "--resume=cut", "--steps=60"], 0);
    assert_eq!(place.text("cut/partial.1/mine/notes.txt"), "mine");
    place.run(&["--out=cut"], 0);
    place.run(&[], 0);
}

/// Files may be no longer than that.
#[cfg(target_os = "linux")]
#[test]
fn a_limit_of_files_is_an_error() {
    let place = Place::new(DISKS);
    let line = format!(
        "ulimit -f 40; exec {} run scene.toml --engine=cpu --steps=100000 --set=output.history=1e-9",
        env!("CARGO_BIN_EXE_packstone")
    );
    let mut command = Command::new("sh");
    let command = command.current_dir(place.folder()).env("TMPDIR", place.temporary()).args(["-c", &line]);
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(errors(&output).contains("File too large"), "{output:?}");
    check_history(&place.text("out/scene/partial/history.csv"));
}

#[test]
fn what_is_not_packstones_is_not_touched() {
    for name in ["summary.json", "history.csv", "final.csv", "run.json", "snapshot_000001.vtp", "checkpoint.bin"] {
        let place = Place::new(DISKS);
        fs::create_dir_all(place.path("out/scene")).unwrap();
        fs::write(place.path("out/scene").join(name), "{}").unwrap();
        let before = content(place.folder());
        let output = place.run(&[], 2);
        assert!(
            errors(&output).starts_with(&format!("error: out/scene/{name}: was not written by packstone")),
            "{output:?}"
        );
        assert_eq!(content(place.folder()), before);
        assert!(!place.path("out/scene/.packstone").exists());
    }
    // What was changed is not packstone's any more, even if it is as long as it was.
    let place = Place::new(DISKS);
    place.run(&[], 0);
    let summary = place.text("out/scene/summary.json");
    fs::write(place.path("out/scene/summary.json"), summary.replace("scene", "bench")).unwrap();
    assert!(errors(&place.run(&[], 2)).contains("summary.json: was not written by packstone, or was changed since"));
    // Other names stay, whatever they are.
    fs::write(place.path("out/scene/summary.json"), summary).unwrap();
    fs::write(place.path("out/scene/notes.txt"), "mine").unwrap();
    fs::write(place.path("out/scene/inputs"), "mine").unwrap();
    place.run(&[], 0);
    assert_eq!(place.text("out/scene/notes.txt") + &place.text("out/scene/inputs"), "minemine");
}

/// They had no record of their files.
#[test]
fn results_of_version_0_1_are_replaced() {
    let place = Place::new(DISKS);
    place.run(&["--set=output.snapshots=1e-3"], 0);
    for name in ["run.json", "scene.toml", "checkpoint.bin", ".packstone/lock"] {
        fs::remove_file(place.path("out/scene").join(name)).unwrap();
    }
    fs::remove_dir(place.path("out/scene/.packstone")).unwrap();
    assert!(place.path("out/scene/snapshot_000001.bin").exists());
    place.run(&["--steps=30", "--set=output.formats=[]"], 0);
    let names: Vec<String> = content(&place.path("out/scene")).into_keys().collect();
    assert_eq!(names, ["checkpoint.bin", "history.csv", "run.json", "scene.toml", "summary.json"]);
}

#[cfg(unix)]
#[test]
fn links_are_not_followed() {
    use std::os::unix::fs::symlink;
    let place = Place::new(DISKS);
    fs::create_dir_all(place.path("out/scene")).unwrap();
    fs::create_dir(place.path("mine")).unwrap();
    fs::write(place.path("mine/text"), "mine").unwrap();
    for (name, target) in
        [("summary.json", "mine/text"), ("final.csv", "nowhere"), ("partial", "mine"), (".packstone", "mine")]
    {
        let link = place.path("out/scene").join(name);
        symlink(place.path(target), &link).unwrap();
        let output = place.run(&[], 2);
        assert!(errors(&output).contains(&format!("out/scene/{name}")), "{output:?}");
        fs::remove_file(&link).unwrap();
    }
    for name in ["final.csv", "summary.json"] {
        fs::create_dir(place.path("out/scene").join(name)).unwrap();
        assert!(errors(&place.run(&[], 2)).contains(name));
        fs::remove_dir(place.path("out/scene").join(name)).unwrap();
    }
    assert_eq!(content(&place.path("mine")), BTreeMap::from([("text".to_owned(), b"mine".to_vec())]));
    assert!(errors(&place.run(&["--out=scene.toml"], 2)).contains("scene.toml: is no folder"));
    // The folder itself may be a link, as its user says where that leads.
    fs::create_dir(place.path("elsewhere")).unwrap();
    fs::remove_dir_all(place.path("out/scene")).unwrap();
    symlink(place.path("elsewhere"), place.path("out/scene")).unwrap();
    place.run(&[], 0);
    assert!(place.path("elsewhere/summary.json").exists());
}

/// From the last state of a run in the same folder, in text and in binary, and again.
#[test]
fn the_input_may_be_in_the_folder_of_the_result() {
    for file in ["final.csv", "final.bin"] {
        let place = Place::new(DISKS);
        place.run(&[], 0);
        let first = fs::read(place.path("out/scene").join(file)).unwrap();
        let scene = DISKS
            .replace("count = 100\nradius = { uniform = [0.8e-3, 1.2e-3] }", &format!("file = \"out/scene/{file}\""));
        fs::write(place.path("scene.toml"), &scene).unwrap();
        place.run(&[], 0);
        assert_eq!(fs::read(place.path("out/scene/inputs").join(file)).unwrap(), first);
        let second = fs::read(place.path("out/scene").join(file)).unwrap();
        assert_ne!(second, first);
        // The scene that is in the result gives the result, also when it is replaced by itself.
        place.packstone(&["run", "out/scene/scene.toml", "--engine=cpu", "--out=again"], 0);
        assert_eq!(fs::read(place.path("again").join(file)).unwrap(), second);
        place.packstone(&["run", "again/scene.toml", "--engine=cpu", "--out=again"], 0);
        assert_eq!(fs::read(place.path("again").join(file)).unwrap(), second);
        assert_eq!(fs::read(place.path("again/inputs").join(file)).unwrap(), first);
    }
}

/// The folder of a project may be that of its result; scene and table stay the user's.
#[test]
fn the_scene_may_be_in_the_folder_of_the_result() {
    let place = Place::new(DISKS);
    fs::create_dir(place.path("inputs")).unwrap();
    fs::write(place.path("inputs/bed.csv"), "x,y,radius\n0.01,0.01,1e-3\n").unwrap();
    let scene = DISKS.replace("count = 100\nradius = { uniform = [0.8e-3, 1.2e-3] }", "file = \"inputs/bed.csv\"");
    fs::write(place.path("scene.toml"), &scene).unwrap();
    place.run(&["--out=.", "--steps=20"], 0);
    assert_eq!(place.text("scene.toml"), scene);
    let run = place.json("run.json");
    assert_eq!((&run["scene"], &run["scene_as_run"]), (&"scene.toml".into(), &"scene.1.toml".into()));
    assert_eq!(run["inputs"][0]["path"], "inputs/bed.1.csv");
    assert!(place.text("scene.1.toml").contains("steps = 20"));
    place.run(&["--out=.", "--steps=30"], 0);
    assert!(place.text("scene.1.toml").contains("steps = 30") && !place.path("scene.2.toml").exists());
    assert_eq!(place.text("inputs/bed.csv"), place.text("inputs/bed.1.csv"));
}

/// Large files stay where they are, and names do not clash.
#[test]
fn tables_are_kept_by_size_and_name() {
    let place = Place::new(DISKS);
    let table = |folder: &str, x: f64, comment: usize| {
        fs::create_dir(place.path(folder)).unwrap();
        let text = format!("#{}\nx,y,radius\n{x},0.01,1e-3\n", "-".repeat(comment));
        fs::write(place.path(folder).join("bed.csv"), text).unwrap();
    };
    table("a", 0.004, 0);
    table("b", 0.008, 0);
    table("c", 0.012, 17 << 20);
    let population = |folder: &str| format!("file = \"{folder}/bed.csv\"\n[[population]]\nmaterial = \"glass\"\n");
    let files = ["a", "b", "c"].map(population).concat() + "file = \"a/../c/bed.csv\"\nfixed = true";
    let scene = DISKS.replace("count = 100\nradius = { uniform = [0.8e-3, 1.2e-3] }", &files);
    fs::write(place.path("scene.toml"), scene + "[solver]\nallow_overlap = true\n").unwrap();
    place.run(&[], 0);
    let run = place.json("out/scene/run.json");
    let kept = run["inputs"].as_array().unwrap();
    let paths: Vec<&str> = kept.iter().map(|kept| kept["path"].as_str().unwrap()).collect();
    let large = place.path("c/bed.csv").canonicalize().unwrap();
    assert_eq!(paths, ["inputs/bed.csv", "inputs/bed.1.csv", large.to_str().unwrap(), large.to_str().unwrap()]);
    assert!(kept[2]["bytes"].as_u64().unwrap() > 17 << 20 && kept[2]["crc32"] == kept[3]["crc32"]);
    place.packstone(&["run", "out/scene/scene.toml", "--engine=cpu", "--out=again"], 0);
    assert_eq!(place.text("again/final.csv"), place.text("out/scene/final.csv"));
}

/// As many files as were announced, and about as many bytes.
#[test]
fn floods_are_announced() {
    let place = Place::new(DISKS);
    let many = ["--set=output.snapshots=1e-9", "--set=output.formats=[\"csv\", \"bin\", \"vtp\"]", "--steps=500"];
    let described = place.packstone(&[&["describe", "scene.toml"], &many[..2], &["--set=stop.steps=500"]].concat(), 0);
    let described = String::from_utf8_lossy(&described.stdout).into_owned();
    let output = place.run(&many, 0);
    let said = errors(&output);
    assert!(said.contains("note: snapshots will be 1002 files, "), "{output:?}");
    let found = result(&place.path("out/scene"));
    let line = described.lines().find(|line| line.starts_with("output ")).unwrap();
    let wanted = format!("101 rows of history, 501 snapshots; about {} files, ", found.len());
    let megabytes = line.split(&wanted).nth(1).unwrap_or_else(|| panic!("{line}: not {wanted}"));
    let megabytes: f64 = megabytes.strip_suffix(" MB").unwrap().parse().unwrap();
    let bytes: usize = found.values().map(Vec::len).sum();
    assert!((megabytes * 1e6 / bytes as f64 - 1.0).abs() < 0.05, "{megabytes} MB, {bytes} bytes");
    assert!(!errors(&place.run(&["--out=few"], 0)).contains("note:"));
}

#[test]
fn a_run_is_estimated_by_its_first_steps() {
    let place = Place::new(DISKS);
    let output = place.packstone(&["describe", "scene.toml", "--estimate", "--engine=cpu"], 0);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        said.contains("steps      200\n") && said.contains("200 steps in ") && said.contains("engine cpu"),
        "{said}"
    );
    assert!(!place.path("out").exists());
}

#[test]
fn scenes_of_one_name_do_not_share_a_folder() {
    let place = Place::new(DISKS);
    for folder in ["a", "b"] {
        fs::create_dir(place.path(folder)).unwrap();
        fs::write(place.path(folder).join("heap.toml"), DISKS).unwrap();
    }
    let run =
        |scene: &str, more: &[&str], code| place.packstone(&[&["run", scene, "--engine=cpu"], more].concat(), code);
    run("a/heap.toml", &[], 0);
    run("a/../a/heap.toml", &[], 0);
    let before = content(place.folder());
    let refused = errors(&run("b/heap.toml", &[], 2));
    assert!(
        refused.contains("out/heap: has the result of another scene file") && refused.contains("a/heap.toml"),
        "{refused}"
    );
    assert!(refused.contains("--out out/heap"), "{refused}");
    assert_eq!(content(place.folder()), before);
    run("b/heap.toml", &["--out=out/heap"], 0);
    // A project that is moved as a whole is the same.
    let moved = Place::new(DISKS);
    for (name, bytes) in content(place.folder()) {
        fs::create_dir_all(moved.path(&name).parent().unwrap()).unwrap();
        fs::write(moved.path(&name), bytes).unwrap();
    }
    moved.packstone(&["run", "b/heap.toml", "--engine=cpu"], 0);
}

#[test]
fn a_removed_folder_costs_no_state() {
    let place = Place::new(DISKS);
    let running = Running::start(&place, &[]);
    // As long as the run puts in what is taken out.
    while place.path("out/scene").exists() {
        let _ = fs::remove_dir_all(place.path("out/scene"));
    }
    let output = running.end(1);
    let rescued = place.path("out/scene.rescued.1");
    assert!(errors(&output).contains("error: ") && errors(&output).contains("scene.rescued.1"), "{output:?}");
    assert_eq!(fs::read_to_string(rescued.join("final.csv")).unwrap().lines().count(), 101);
    check_history(&fs::read_to_string(rescued.join("history.csv")).unwrap());
    assert!(rescued.join("run.json").exists());
    // It can be gone on with from there.
    let steps = place.json("out/scene.rescued.1/summary.json")["steps"].as_u64().unwrap() + 10;
    place.packstone(&["run", "--resume=out/scene.rescued.1", &format!("--steps={steps}")], 0);
    assert_eq!(place.json("out/scene.rescued.1/summary.json")["steps"], steps);
}

/// A small file system of its own; None where that is not allowed.
#[cfg(target_os = "linux")]
struct Mounted(PathBuf);

#[cfg(target_os = "linux")]
impl Mounted {
    fn new(path: PathBuf, size: &str) -> Option<Mounted> {
        fs::create_dir_all(&path).unwrap();
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", size, "tmpfs"]).arg(&path).output();
        let mounted = mounted.is_ok_and(|output| output.status.success());
        if !mounted {
            println!("skipped: no file system may be mounted here");
        }
        mounted.then_some(Mounted(path))
    }
}

#[cfg(target_os = "linux")]
impl Drop for Mounted {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).output();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_costs_no_state() {
    let place = Place::new(DISKS);
    let Some(_disk) = Mounted::new(place.path("disk"), "size=400k") else { return };
    place.packstone(&["run", "scene.toml", "--engine=cpu", "--steps=20", "--out=disk/out"], 0);
    let before = result(&place.path("disk/out"));
    let output = place.run(&[&ENDLESS[..], &["--out=disk/out"]].concat(), 1);
    assert!(
        errors(&output).contains("No space left") && errors(&output).contains("the last state is in"),
        "{output:?}"
    );
    assert_eq!(result(&place.path("disk/out")), before);
    let partial = content(&place.path("disk/out/partial"));
    check_history(std::str::from_utf8(&partial["history.csv"]).unwrap());
    assert!(partial.keys().all(|name| !name.ends_with(".part")), "{:?}", partial.keys());
    let whole = |bytes: &[u8]| bytes.ends_with(b"</VTKFile>\n");
    assert!(partial.iter().all(|(name, bytes)| !name.ends_with(".vtp") || whole(bytes)));
    let rescued = content(place.temporary());
    let text = |name: &str| std::str::from_utf8(&rescued[&format!("out.rescued.1/{name}")]).unwrap();
    assert_eq!(text("final.csv").lines().count(), 101);
    check_history(text("history.csv"));
    let summary: Value = serde_json::from_str(text("summary.json")).unwrap();
    let last = text("history.csv").lines().last().unwrap().split(',').next().unwrap();
    assert_eq!(last, summary["steps"].to_string());
}

/// Neither in the folder nor beside it; what was open before can be written on.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_cannot_be_written_any_more_costs_no_state() {
    let place = Place::new(DISKS);
    let running = Running::start(&place, &["--out=disk/out"]);
    let Some(_disk) = Mounted::new(place.path("disk"), "ro") else { return };
    let output = running.end(1);
    let rescued = place.temporary().join("out.rescued.1");
    assert!(errors(&output).contains(rescued.to_str().unwrap()), "{output:?}");
    let rescued = content(place.temporary());
    assert!(rescued.contains_key("out.rescued.1/final.csv") && rescued.contains_key("out.rescued.1/summary.json"));
    check_history(std::str::from_utf8(&rescued["out.rescued.1/history.csv"]).unwrap());
}

#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_cannot_be_written_is_said() {
    let place = Place::new(DISKS);
    let Some(_disk) = Mounted::new(place.path("disk"), "ro") else { return };
    let output = place.run(&["--out=disk/out"], 2);
    assert!(errors(&output).starts_with("error: disk/out: Read-only file system"), "{output:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn what_cannot_be_said_is_an_error() {
    let place = Place::new(DISKS);
    let full = || Stdio::from(fs::OpenOptions::new().write(true).open("/dev/full").unwrap());
    let output = place.command(&["describe", "scene.toml"]).stdout(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert_eq!(errors(&output), "error: standard output: No space left on device (os error 28)\n");
    // Errors that nobody hears are no reason to panic.
    let status = place.command(&["describe", "nowhere.toml"]).stdout(full()).stderr(full()).status().unwrap();
    assert_eq!(status.code(), Some(2));
}
