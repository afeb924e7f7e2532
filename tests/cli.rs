//! The program as its users see it: arguments in; files, words and exit codes out.

#[path = "common/place.rs"]
mod place;

use packstone::{io, scene::Scene};
use place::Place;
use serde_json::Value;
use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

const TWO_GRAINS: &str = r#"
dimension = 3
gravity = [0, 0, 0]
[material.glass]
density = 2500
normal_stiffness = 1e5
friction = 0.4
[[grain]]
material = "glass"
position = [0, 0, 0]
radius = 1e-3
velocity = [0.1, 0, 0]
[[grain]]
material = "glass"
position = [2.1e-3, 0.5e-3, 0]
radius = 1e-3
[stop]
time = 2e-3
"#;

const HUNDRED_DISKS: &str = r#"
title = "a hundred disks"
dimension = 2
[material.glass]
density = 2500
normal_stiffness = 1e5
friction = 0.4
normal_damping = 2000
[material.steel]
density = 7800
normal_stiffness = 1e5
friction = 0.3
normal_damping = 2000
[[wall]]
kind = "box"
name = "bin"
material = "steel"
lower = [0, 0]
upper = [0.025, 1]
faces = ["x-", "x+", "y-"]
[[population]]
material = "glass"
count = 100
radius = { uniform = [0.8e-3, 1.2e-3] }
[stop]
time = 0.02
[output]
snapshots = 0.005
"#;

/// Turns the two grains into an explosion: half inside each other, with a time step far above the bound.
const EXPLOSION: [&str; 4] = [
    "--set=grain.1.position=[1e-3, 0, 0]",
    "--set=solver.dt=1e-3",
    "--set=solver.allow_unstable=true",
    "--set=solver.allow_overlap=true",
];

/// The files of a result.
fn results(place: &Place) -> Vec<String> {
    let entries = fs::read_dir(place.path("out/scene")).expect("a folder of results");
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.retain(|name| name != ".packstone");
    names.sort();
    names
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The program's own errors; drivers complain on the same stream.
fn errors(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    let own = text.lines().filter(|line| line.starts_with("error: ") && !line.contains("XDG_RUNTIME_DIR"));
    own.collect::<Vec<_>>().join("\n")
}

/// Header and rows.
fn table(text: &str) -> (Vec<&str>, Vec<Vec<&str>>) {
    let mut lines = text.lines().map(|line| line.split(',').collect());
    (lines.next().expect("a header line"), lines.collect())
}

fn column(text: &str, name: &str) -> Vec<f64> {
    let (header, rows) = table(text);
    let at = header.iter().position(|h| *h == name).unwrap_or_else(|| panic!("no column {name}"));
    rows.iter().map(|row| row[at].parse().unwrap_or_else(|_| panic!("{name} = {}", row[at]))).collect()
}

/// Whether there is a GPU adapter; that there is none is a failure unless the environment allows it.
fn gpu() -> bool {
    let found = !packstone::gpu::adapters().is_empty();
    let allowed = std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|value| value == "1");
    assert!(found || allowed, "no GPU adapter; set PACKSTONE_ALLOW_NO_GPU=1 to skip this test");
    found
}

#[test]
fn two_grains_leave_all_files_and_keys() {
    let place = Place::new(TWO_GRAINS);
    let output = place.run(&[], 0);
    assert_eq!(
        results(&place),
        [
            "checkpoint.bin",
            "final.csv",
            "history.csv",
            "packstone.pvd",
            "run.json",
            "scene.toml",
            "snapshot_000000.vtp",
            "summary.json"
        ]
    );
    let (said, noted) = (out(&output), String::from_utf8_lossy(&output.stderr).into_owned());
    assert!(noted.contains("engine cpu"), "{noted}");
    assert!(noted.contains("(0 %)") && noted.contains("(100 %)"), "{noted}");
    assert!(said.starts_with("ended: last step") && said.contains("out/scene"), "{said}");

    let summary = place.summary("out/scene");
    let keys = "scene engine adapter precision dimension particles steps time dt dt_bound wall_seconds \
                particle_steps_per_second bytes_per_particle replayed_chunks lost_contacts contacts \
                coordination_number packing_fraction packing_fraction_error \
                overall_packing_fraction overall_packing_fraction_error diameters max_overlap_over_radius \
                deepest_overlap position_quantum unbalanced_force_ratio kinetic_energy momentum angular_momentum converged ended stopped version domain walls";
    for key in keys.split_whitespace() {
        assert!(summary.get(key).is_some(), "no {key}");
    }
    assert_eq!((&summary["engine"], &summary["precision"]), (&"cpu".into(), &"double".into()));
    assert_eq!((&summary["particles"], &summary["dimension"]), (&2.into(), &3.into()));
    assert_eq!((&summary["stopped"], &summary["converged"]), (&Value::Null, &false.into()));
    assert!(summary["unbalanced_force_ratio"].is_null(), "the grains have parted");
    assert_eq!(summary["diameters"]["by_volume"]["d90"], 2e-3);
    assert!(summary["time"].as_f64().unwrap() >= 2e-3);
    let momentum = summary["momentum"][0].as_f64().unwrap();
    let before = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-9 * 0.1;
    assert!((momentum / before - 1.0).abs() < 1e-12, "{momentum} was {before}");
}

#[test]
fn a_hundred_disks_have_history_and_snapshots() {
    let place = Place::new(HUNDRED_DISKS);
    place.run(&[], 0);
    let summary = place.summary("out/scene");
    assert_eq!(summary["scene"], "a hundred disks");
    assert_eq!(summary["walls"].as_array().unwrap().len(), 3);
    assert_eq!(summary["walls"][0]["kind"], "plane");

    let history = place.text("out/scene/history.csv");
    let times = column(&history, "time");
    assert_eq!(times.len(), 101);
    assert!(times[0] == 0.0 && times.windows(2).all(|w| w[0] < w[1]));
    assert_eq!(*times.last().unwrap(), summary["time"].as_f64().unwrap());
    assert_eq!(*column(&history, "contacts").last().unwrap(), summary["contacts"].as_f64().unwrap());
    assert!(column(&history, "particle_steps_per_second")[1..].iter().all(|rate| *rate > 0.0));

    let series = place.text("out/scene/packstone.pvd");
    let files: Vec<&str> = series.split("file=\"").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert_eq!(files.len(), 5, "0, 5, 10, 15 and 20 ms");
    assert_eq!(files, results(&place).iter().filter(|name| name.ends_with(".vtp")).collect::<Vec<_>>());
    files.iter().for_each(|file| check_snapshot(&place.text(&format!("out/scene/{file}")), 100));
}

/// Tags match, and every array has as many bytes as it says and as there are grains.
fn check_snapshot(text: &str, grains: usize) {
    assert!(text.contains(&format!("NumberOfPoints=\"{grains}\" NumberOfVerts=\"{grains}\"")));
    let mut open: Vec<&str> = Vec::new();
    let mut arrays = 0;
    for (tag, content) in text.split('<').skip(1).map(|rest| rest.split_once('>').expect("a closed tag")) {
        match tag.strip_prefix('/') {
            Some(name) => assert_eq!(open.pop(), Some(name)),
            None if tag.starts_with('?') => {}
            None => open.push(tag.split(' ').next().unwrap()),
        }
        if tag.contains("format=\"binary\"") {
            let value = |key: &str| tag.split(&format!("{key}=\"")).nth(1).unwrap().split('"').next().unwrap();
            let width = if value("type").ends_with("64") { 8 } else { 4 };
            let wanted = grains * width * value("NumberOfComponents").parse::<usize>().unwrap();
            assert_eq!(decode(content).len(), wanted, "{tag}");
            arrays += 1;
        }
    }
    assert!(open.is_empty() && arrays == 8, "{open:?}, {arrays} arrays");
}

/// Bytes of an array, without the count in front, which must be right.
fn decode(text: &str) -> Vec<u8> {
    use base64::{Engine, engine::general_purpose::STANDARD};
    let mut bytes = STANDARD.decode(text).expect("base64");
    let content = bytes.split_off(8);
    assert_eq!(u64::from_le_bytes(bytes.try_into().unwrap()), content.len() as u64);
    content
}

#[test]
fn the_last_state_can_be_the_first() {
    let place = Place::new(HUNDRED_DISKS);
    place.run(&["--set=output.formats=[\"csv\", \"bin\"]"], 0);
    let first = place.text("out/scene/final.csv");
    let (header, rows) = table(&first);
    assert_eq!(header.join(","), "id,x,y,z,vx,vy,vz,wx,wy,wz,radius,material");
    assert_eq!(rows.len(), 100);
    assert!(rows.iter().zip(0..).all(|(row, id)| row[0] == id.to_string() && row[11] == "glass"));

    // Without forces and in a step too short to matter, every number must come back as it was.
    for file in ["final.csv", "final.bin"] {
        let scene = HUNDRED_DISKS
            .replace("radius = { uniform = [0.8e-3, 1.2e-3] }", &format!("file = \"out/scene/{file}\""))
            .replace("time = 0.02", "steps = 1")
            .replace("dimension = 2", "dimension = 2\ngravity = [0, 0]\nsolver = { dt = 1e-100 }");
        fs::write(place.path("again.toml"), scene).unwrap();
        let output = place.output(&["run", "again.toml", "--engine", "cpu", "--out", "again"]);
        assert!(output.status.success(), "{output:?}");
        let second = fs::read_to_string(place.path("again/final.csv")).unwrap();
        assert_eq!(first, second, "{file}");
    }
}

/// Of clumps the binary file has what the table has, and their members besides.
#[test]
fn clumps_come_back_from_binary_files_as_from_tables() {
    let example = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/scenes/clumps.toml")).unwrap();
    let place = Place::new(&example);
    place.run(&["--steps=20", "--set=output.formats=[\"csv\", \"bin\"]", "--set=output.snapshots=1"], 0);
    assert_eq!(
        results(&place),
        [
            "checkpoint.bin",
            "final.bin",
            "final.csv",
            "history.csv",
            "members.csv",
            "run.json",
            "scene.toml",
            "snapshot_000000.bin",
            "summary.json"
        ]
    );
    let scene = Scene::parse(&example, "scene.toml", place.folder(), &[]).unwrap();
    let read = |file: &str| {
        let population = format!("[[population]]\nfile = \"out/scene/{file}\"\n");
        let (start, rest) = example.split_once("[[population]]").unwrap();
        let rest = rest.split_once("\n\n").map_or("", |(_, rest)| rest);
        let text = format!("{start}{population}\n{rest}");
        Scene::parse(&text, "scene.toml", place.folder(), &[]).unwrap().assemble().unwrap()
    };
    let (table, binary) = (read("final.csv"), read("final.bin"));
    assert_eq!(table.clumps.len(), scene.assemble().unwrap().clumps.len());
    assert_eq!(table, binary);
    assert_ne!(read("snapshot_000000.bin"), binary);
    let rows = |file: &str| io::read_rows(&place.path("out/scene").join(file)).unwrap();
    let mut members = rows("members.csv");
    members.iter_mut().for_each(|row| (row.wx, row.wy, row.wz, row.material) = (0.0, 0.0, 0.0, String::new()));
    assert_eq!(members, rows("final.bin"));
}

/// A file that a full disk or a hasty hand has spoilt stops a scene before it begins.
#[test]
fn spoilt_binary_files_are_refused() {
    let place = Place::new(HUNDRED_DISKS);
    place.run(&["--steps=1", "--set=output.formats=[\"bin\"]"], 0);
    let whole = fs::read(place.path("out/scene/final.bin")).unwrap();
    let scene = HUNDRED_DISKS.replace("radius = { uniform = [0.8e-3, 1.2e-3] }", "file = \"grains.bin\"");
    fs::write(place.path("again.toml"), scene).unwrap();
    let message = |bytes: &[u8], more: &[&str]| {
        fs::write(place.path("grains.bin"), bytes).unwrap();
        let output = place.output(&[&["describe", "again.toml"], more].concat());
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        errors(&output)
    };
    let (cut, mut altered) = (&whole[..whole.len() - 1], whole.clone());
    altered[whole.len() - 1000] ^= 1;
    assert!(message(cut, &[]).contains("grains.bin: is cut off: it has"));
    assert!(message(&altered, &[]).contains("grains.bin: is damaged: the checksum of column"));
    assert!(message(&whole, &["--set=population.0.count=101"]).contains("has 100 rows, but count = 101"));
    assert!(message(&whole, &["--set=dimension=3"]).contains("dimension"));
}

#[test]
fn steps_and_formats_are_obeyed() {
    let place = Place::new(HUNDRED_DISKS);
    place.run(&[], 0);
    fs::write(place.path("out/scene/notes.txt"), "mine").unwrap();
    place.run(&["--steps", "10", "--set", "output.formats=[\"csv\"]"], 0);
    assert_eq!(place.summary("out/scene")["steps"], 10);
    assert_eq!(column(&place.text("out/scene/history.csv"), "step").len(), 11);
    let left = ["checkpoint.bin", "final.csv", "history.csv", "notes.txt", "run.json", "scene.toml", "summary.json"];
    assert_eq!(results(&place), left, "only the old run is gone");
}

#[test]
fn time_and_history_are_obeyed() {
    let place = Place::new(TWO_GRAINS);
    place.run(&["--time", "1e-3", "--set", "output.history=2.5e-4"], 0);
    let summary = place.summary("out/scene");
    let (time, dt) = (summary["time"].as_f64().unwrap(), summary["dt"].as_f64().unwrap());
    assert!((1e-3..1e-3 + dt).contains(&time));
    let times = column(&place.text("out/scene/history.csv"), "time");
    assert_eq!(times.len(), 5);
    assert!(times.iter().zip(0..).all(|(t, k)| (*t - 2.5e-4 * f64::from(k)).abs() <= dt), "{times:?}");
}

#[test]
fn equilibrium_ends_a_run() {
    let place = Place::new(HUNDRED_DISKS);
    place.run(&["--time=5", "--set=stop.equilibrium=0.05", "--set=solver.damping=50"], 0);
    let summary = place.summary("out/scene");
    assert_eq!(summary["converged"], true);
    assert!(summary["time"].as_f64().unwrap() < 4.9);
    assert!(summary["unbalanced_force_ratio"].as_f64().unwrap() < 0.05);
    assert!(summary["packing_fraction"].as_f64().unwrap() > 0.7);
}

/// A lid comes down on a rigid grain that cannot give way.
const PRESSED: &str = r#"
dimension = 3
[material.stone]
density = 2500
friction = 0.5
[[wall]]
kind = "plane"
name = "floor"
material = "stone"
point = [0, 0, 0]
normal = [0, 0, 1]
[[wall]]
kind = "plane"
name = "lid"
material = "stone"
point = [0, 0, 2e-3]
normal = [0, 0, -1]
velocity = [0, 0, -0.1]
[[grain]]
material = "stone"
position = [0, 0, 1e-3]
radius = 1e-3
[solver]
method = "cd"
dt = 5e-4
[stop]
steps = 10
"#;

/// Steps that no impulses solve, deep overlaps and rest that was not reached are said, and a strict run ends with 3.
#[test]
fn doubtful_results_are_told() {
    let place = Place::new(PRESSED);
    let output = place.run(&["--set=stop.equilibrium=1e-6"], 0);
    let warnings = String::from_utf8_lossy(&output.stderr).into_owned();
    for doubt in ["an overlap was 0.2", "10 of 10 steps were not solved", "stop.equilibrium = 1e-6 was not reached"] {
        assert!(warnings.contains(doubt), "{doubt}: {warnings}");
    }
    assert_eq!(place.summary("out/scene")["doubts"].as_array().unwrap().len(), 3);
    place.run(&["--strict"], 3);
    // Out of reach of the lid for so long.
    let output = place.run(&["--strict", "--set=wall.1.velocity=[0, 0, 0.1]"], 0);
    let noted = String::from_utf8_lossy(&output.stderr);
    assert!(!noted.contains("warning:") && out(&output).contains("no doubts"), "{output:?}");
    assert_eq!(place.summary("out/scene")["doubts"].as_array().unwrap().len(), 0);
    assert!(place.summary("out/scene")["force_balance_max"].as_f64().unwrap() < 1e-4);
}

#[test]
fn bad_input_leaves_nothing_behind() {
    let place = Place::new(TWO_GRAINS);
    for (set, part) in [
        ("solver.dx=1", "unknown key `dx`"),
        ("grain.7.radius=1", "no entry `7`"),
        ("solver.dt=1", "above the stability bound"),
        ("stop.steps=0", "must be at least 1"),
    ] {
        let output = place.run(&["--set", set], 2);
        let error = errors(&output);
        assert!(error.starts_with("error: ") && error.contains(part), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    let missing = place.output(&["run", "nowhere.toml"]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(errors(&missing).contains("nowhere.toml"));
    assert_eq!(fs::read_dir(place.folder()).unwrap().count(), 1, "only the scene file");
}

#[test]
fn an_explosion_keeps_the_last_good_state() {
    let place = Place::new(TWO_GRAINS);
    let output = place.run(&EXPLOSION, 1);
    let error = errors(&output);
    assert!(error.contains("stopped at step") && error.contains("grain "), "{error}");

    let summary = place.summary("out/scene");
    let said = format!("error: scene.toml: {}", summary["stopped"].as_str().unwrap());
    assert!(error.contains(&said), "{error}");
    assert_eq!(summary["converged"], false);
    let grains = place.text("out/scene/final.csv");
    for name in ["x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz", "radius"] {
        let values = column(&grains, name);
        assert!(values.len() == 2 && values.iter().all(|x| x.is_finite()), "{name}: {values:?}");
    }
    let last = *column(&place.text("out/scene/history.csv"), "step").last().unwrap();
    assert_eq!(last, summary["steps"].as_f64().unwrap());
}

#[test]
fn describe_tells_memory_and_time_step() {
    let place = Place::new(HUNDRED_DISKS);
    let output = place.output(&["describe", "scene.toml"]);
    assert!(output.status.success(), "{output:?}");
    let said = out(&output);
    let parts = [
        "a hundred disks",
        "by number",
        "by volume",
        "bytes/particle",
        "total",
        "time step",
        "bound",
        "damping/mass_scaled.wgsl",
    ];
    for part in parts.into_iter().chain(["contact/law.wgsl", "displacement_check", "neighbour"]) {
        assert!(said.contains(part), "no {part} in\n{said}");
    }
    let smooth = ["--set", "material.glass.friction=0", "--set", "material.steel.friction=0"];
    let said = out(&place.output(&[&["describe", "scene.toml"], &smooth[..]].concat()));
    assert!(!said.contains("torque"), "no friction, no torque:\n{said}");
}

/// Of frictional spheres as much as is alive while a step is done or bodies are sorted, and nothing besides: what they are and
/// will be, lists, and where the sorted ones come from. The history has no memory of its own.
#[test]
fn describe_counts_what_is_alive_at_once() {
    let scene = "examples/scenes/published_bed.toml";
    let output = Command::new(env!("CARGO_BIN_EXE_packstone"))
        .args(["describe", scene, "--engine=gpu", "--count", "400000000"])
        .output();
    let said = String::from_utf8(output.unwrap().stdout).unwrap();
    let arrays = said.split_once("\nArrays\n").unwrap().1;
    let bytes = |name: &str| {
        let mut rows = arrays.lines().map(str::split_whitespace).filter_map(|mut row| Some((row.next()?, row.nth(1)?)));
        let (_, bytes) = rows.find(|(array, _)| *array == name).unwrap_or_else(|| panic!("no `{name}` in\n{arrays}"));
        bytes.parse::<u64>().unwrap_or(0)
    };
    let bodies = ["position", "position_low", "velocity", "spin", "velocity_low", "id"];
    let state: u64 = bodies.into_iter().map(bytes).sum();
    let next: u64 = bodies.into_iter().map(|array| bytes(&format!("{array}_next"))).sum();
    let lists: u64 = ["list_start", "neighbour", "tangential_force"].into_iter().map(bytes).sum();
    let others: u64 = ["index_of_id", "displacement", "sorted", "cell_start"].into_iter().map(bytes).sum();
    assert!([state, next, lists, others].iter().all(|part| *part > 0));
    let (total, alive) = (bytes("total"), state + next + lists + others);
    assert!(total >= alive && (total - alive) as f64 <= 1e-3 * alive as f64, "{total} bytes, {alive} alive\n{arrays}");
    assert!(total <= 283 * 400_000_000, "{total} bytes");
}

/// What a population cannot have is said beside the results, whatever the command.
#[test]
fn distributions_that_were_cut_are_noted() {
    let place = Place::new(HUNDRED_DISKS);
    let wide = "population.0.radius={normal={mean=1e-3,std=1e-3,min=0.9e-3,max=1.1e-3}}";
    let output = place.output(&["describe", "scene.toml", "--engine=cpu", "--set", wide]);
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.starts_with("note: population.0.radius.normal: no normal distribution between"), "{said}");
    let output = place.output(&["describe", "scene.toml", "--engine=cpu"]);
    assert!(output.stderr.is_empty(), "{output:?}");
}

/// An energy that is no number is no result.
#[test]
fn sums_that_are_no_numbers_stop_a_run() {
    let place = Place::new(TWO_GRAINS);
    let output = place.run(&["--set", "grain.0.spin=[1e200, 0, 0]", "--set", "material.glass.friction=0"], 1);
    assert!(errors(&output).contains("stopped at step 0") && errors(&output).contains("no numbers"), "{output:?}");
    assert!(place.summary("out/scene")["stopped"].is_string());
}

/// What a run needs follows from the grains that there are, and not from the space between them.
#[cfg(unix)]
#[test]
fn grains_far_apart_need_no_memory() {
    let walls = "[[wall]]\nkind = \"plane\"\nmaterial = \"glass\"\npoint = [0, 0, -1]\nnormal = [0, 0, 1]\n";
    for (far, gravity, walls) in [("2", "0", ""), ("2e5", "0", ""), ("2e5", "-9.81", walls)] {
        let scene = TWO_GRAINS
            .replace("[2.1e-3, 0.5e-3, 0]", &format!("[{far}, {far}, {far}]"))
            .replace("gravity = [0, 0, 0]", &format!("gravity = [0, 0, {gravity}]"))
            .replace("time = 2e-3", "steps = 3");
        let place = Place::new(&(scene + walls));
        let program = env!("CARGO_BIN_EXE_packstone");
        let limited = format!("ulimit -v 400000; exec '{program}' run scene.toml --engine cpu");
        let output = Command::new("sh")
            .current_dir(place.folder())
            .env("RAYON_NUM_THREADS", "1")
            .args(["-c", &limited])
            .output()
            .expect("a shell");
        assert!(output.status.success(), "{far}: {output:?}");
        assert_eq!(place.summary("out/scene")["steps"], 3);
    }
}

#[test]
fn every_command_has_help_with_an_example() {
    let place = Place::new("");
    for command in ["run", "check", "render", "describe", "adapters"] {
        let output = place.output(&[command, "--help"]);
        assert!(output.status.success());
        assert!(out(&output).contains(&format!("  packstone {command}")), "{command}");
    }
    assert_eq!(place.output(&["fly"]).status.code(), Some(2));
}

#[test]
fn adapters_are_listed_or_missed() {
    let output = Place::new("").output(&["adapters"]);
    if gpu() {
        assert!(output.status.success(), "{output:?}");
        assert!(out(&output).contains("subgroup"), "{output:?}");
    } else {
        assert_eq!(output.status.code(), Some(2));
        assert!(errors(&output).contains("install"), "{output:?}");
    }
}

#[test]
fn check_compares_the_engines() {
    let place = Place::new(HUNDRED_DISKS);
    if !gpu() {
        return;
    }
    let arguments = ["check", "scene.toml", "--steps", "3", "--after", "2000"];
    let output = place.output(&arguments);
    assert!(output.status.success(), "{output:?}");
    assert!(out(&output).contains("passed: all"), "{output:?}");
    let output = place.output(&[&arguments[..], &["--json"]].concat());
    let report: Value = serde_json::from_str(&out(&output)).expect("JSON");
    assert_eq!(report["passed"], true);
    assert!(!report["rows"].as_array().unwrap().is_empty());
}

#[test]
fn pictures_are_drawn_from_folders_and_tables() {
    let place = Place::new(HUNDRED_DISKS);
    if !gpu() {
        return;
    }
    place.run(&["--steps", "10"], 0);
    let size = ["--width", "64", "--height", "48"];
    for (state, color, picture) in
        [("out/scene", "speed", "out/scene/picture.png"), ("out/scene/final.csv", "id", "out/scene/final.png")]
    {
        let output = place.output(&[&["render", state, "--color", color], &size[..]].concat());
        assert!(output.status.success(), "{output:?}");
        assert_eq!(Path::new(out(&output).trim()), Path::new(picture));
        assert!(fs::read(place.path(picture)).unwrap().starts_with(b"\x89PNG"));
    }
}

/// Frames are there from the beginning to the end, in colours and view of all; a run that goes on counts on, and the next
/// run takes away what was its own.
#[test]
fn frames_are_drawn_while_a_run_goes() {
    let place = Place::new(HUNDRED_DISKS);
    let said = place.errors(&["run", "scene.toml", "--color", "speed"], 2);
    assert!(said.contains("--frames"), "{said}");
    if !gpu() {
        return;
    }
    let look = ["--color", "speed", "--width", "64", "--height", "48"];
    let shown = |folder: &str| {
        let record = place.json(&format!("{folder}/frames.json"));
        let steps: Vec<u64> =
            record["shown"].as_array().unwrap().iter().map(|shown| shown["step"].as_u64().unwrap()).collect();
        let alike = record["shown"].as_array().unwrap().iter().all(|shown| shown["scales"] == record["scales"]);
        assert!(alike, "{record:#}");
        let names = (1..=steps.len()).map(|k| format!("frame_{k:04}.png")).chain(["frames.json".to_owned()]);
        let names: std::collections::BTreeSet<String> = names.collect();
        let found =
            fs::read_dir(place.path(folder)).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap());
        assert_eq!(found.filter(|name| name != "film.mp4").collect::<std::collections::BTreeSet<_>>(), names);
        for name in names.iter().filter(|name| name.ends_with("png")) {
            assert!(fs::read(place.path(&format!("{folder}/{name}"))).unwrap().starts_with(b"\x89PNG"));
        }
        steps
    };
    place.run(&[&["--steps", "20", "--frames", "3"], &look[..]].concat(), 0);
    assert_eq!(shown("out/scene/frames"), [0, 10, 20]);
    assert!(place.json("out/scene/run.json")["files"]["frames/frame_0003.png"]["bytes"].as_u64().unwrap() > 0);
    place.packstone(&["run", "--resume", "out/scene", "--steps", "45"], 0);
    assert_eq!(shown("out/scene/frames"), [0, 10, 20, 30, 40, 45]);
    place.write("out/scene/frames/film.mp4", "mine");
    // The last state alone, with rods, in every stage.
    let stages = "stage = [{ name = \"a\", stop = { steps = 7 } }, { name = \"b\" }]\n";
    place.write("scene.toml", &(stages.to_owned() + HUNDRED_DISKS));
    place.run(
        &[&["--steps", "7", "--frames", "1", "--chains", "--color", "force", "--out", "staged"], &look[2..]].concat(),
        0,
    );
    assert_eq!((shown("staged/stages/a/frames"), shown("staged/stages/b/frames")), (vec![7], vec![7]));
    place.write("scene.toml", HUNDRED_DISKS);
    place.run(&["--steps", "5"], 0);
    let left: Vec<_> =
        fs::read_dir(place.path("out/scene/frames")).unwrap().map(|file| file.unwrap().file_name()).collect();
    assert_eq!(left, ["film.mp4"]);
    place.write("out/scene/frames/frame_0001.png", "mine");
    let said = place.errors(&["run", "scene.toml", "--steps", "5", "--engine", "cpu"], 2);
    assert!(said.contains("frame_0001.png: was not written by packstone"), "{said}");
}

/// An adapter for an engine that has none is no choice that anybody has meant.
#[test]
fn adapters_are_for_gpus() {
    let place = Place::new(TWO_GRAINS);
    for command in [&["run", "scene.toml"][..], &["describe", "scene.toml"], &["solve", "problem.dat"]] {
        let said = place.errors(&[command, &["--engine=cpu", "--adapter=0"]].concat(), 2);
        assert!(said.contains("error: --adapter 0: the cpu engine has no use for an adapter"), "{said}");
    }
}

#[test]
fn describe_tells_the_precision_of_the_engine() {
    let place = Place::new(TWO_GRAINS);
    let precision = |more: &[&str]| {
        let output = place.packstone(&[&["describe", "scene.toml", "--json"], more].concat(), 0);
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        json["model"]["precision"].as_str().unwrap().to_owned()
    };
    assert_eq!(precision(&["--engine=cpu"]), "double");
    assert_eq!(precision(&["--engine=gpu"]), "single");
    assert_eq!(precision(&["--engine=gpu", "--precision=double"]), "double");
    // As a run would have it.
    place.packstone(&["run", "scene.toml", "--steps=1"], 0);
    assert_eq!(precision(&[]), place.summary("out/scene")["precision"].as_str().unwrap());
}

#[test]
fn what_cannot_be_drawn_is_bad_input() {
    let place = Place::new(TWO_GRAINS);
    fs::write(place.path("words.csv"), "a,b\n1,2\n").unwrap();
    for (state, part) in [("nowhere", "nowhere"), (".", "final.csv"), ("words.csv", "lacks the column")] {
        let output = place.output(&["render", state]);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        assert!(errors(&output).contains(part), "{output:?}");
    }
}
