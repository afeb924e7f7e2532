//! `packstone bench` and `packstone tune`: that they run, and that errors (not times) stay where they were measured.

use packstone::{
    bench::{self, Bench, Effort, Point, RelaxationRow, StageRow, Suite, report},
    engine::{Engine, Gpu, Times},
    gpu::{Device, DeviceOptions, Restrictions},
    scene::Scene,
    simulation::{Options, Setup},
};
use std::{collections::BTreeMap, fs, ops::ControlFlow, path::Path, process::Command};

fn gpu_expected() -> bool {
    std::env::var_os("PACKSTONE_ALLOW_NO_GPU").is_none()
}

/// Largest error allowed at the automatic step (ensembles: at four times that): three times what was measured, because
/// a device may fuse or reorder operations, but a lost digit or a wrong sign costs far more. `single` is for f32; the
/// first number holds for f64 on either engine, where discretisation is all there is. Local errors in f64 are round-off
/// over the overlap, and allowed a hundred units of it.
const BOUNDS: [(&str, &str, f64, f64); 18] = [
    ("settling bed", "force rms", 1e-13, 3e-7),
    ("settling bed", "force worst", 1e-12, 3e-6),
    ("settling bed", "moment rms", 1e-13, 7e-7),
    ("settling bed", "moment worst", 1e-12, 6e-6),
    ("oblique impact", "psi", 1e-2, 1e-2),
    ("cradle", "velocity", 4e-4, 4e-4),
    ("collapse", "displacement", 1.5e-4, 1.5e-4),
    ("smooth gas", "energy", 6e-5, 6e-5),
    ("smooth gas", "momentum drift", 1e-12, 3e-6),
    ("rough drum", "angular momentum drift", 1e-11, 6e-6),
    ("rough rain", "energy balance", 7e-3, 7e-3),
    // Per 10^4 steps, over the energy of what moves within what is carried along at 5 m/s.
    ("ring, 10^4 steps", "energy", 1e-9, 2e-4),
    ("ring, 10^4 steps", "momentum", 1e-13, 1e-9),
    ("bodies, 10^4 steps", "energy", 1e-7, 1e-7),
    ("bodies, 10^4 steps", "angular momentum", 5e-7, 5e-7),
    // What `check` allows.
    ("smooth gas", "path", 1e-4, 1e-4),
    ("smooth gas", "momentum", 1e-4, 1e-4),
    ("rough rain", "angular momentum", 1e-4, 1e-4),
];

#[test]
fn the_quick_benchmark_keeps_its_errors() {
    let bench = bench::run(&Suite::ALL, Effort::Quick, &mut |_| ControlFlow::Continue(()));
    let failed: Vec<&Point> = bench.points.iter().filter(|p| !p.passed()).collect();
    assert!(failed.is_empty(), "{failed:?}");
    assert!(!gpu_expected() || bench.machine.adapter.is_some(), "no adapter; see PACKSTONE_ALLOW_NO_GPU in test.sh");

    for p in bench.points.iter().filter(|p| p.dt_over_auto == 1.0) {
        let Some((.., double, single)) = BOUNDS.iter().find(|(case, of, ..)| (*case, *of) == (&p.case, p.quantity))
        else {
            continue;
        };
        let bound = if p.precision == "single" { single } else { double };
        assert!(p.error.is_none_or(|error| error <= *bound), "above {bound:e}: {p:?}");
    }
    for (case, quantity, ..) in BOUNDS {
        assert!(bench.points.iter().any(|p| (p.case.as_str(), p.quantity) == (case, quantity)), "{case}: {quantity}");
    }
    // Six standard errors of three seeds, whose scatter is itself known to a third at best.
    for p in bench.points.iter().filter(|p| p.suite == Suite::Ensembles && p.error.is_some()) {
        assert!(p.standard_errors.unwrap() < 6.0, "{p:?}");
    }
    // Two engines on a dense packing, 20 steps on.
    for p in bench.points.iter().filter(|p| p.suite == Suite::Speed && p.error.is_some()) {
        assert!(p.error.unwrap() < 3e-6, "{p:?}");
    }
    // Figures of hard cases and stages are no runs.
    for p in bench.points.iter().filter(|p| p.allowed.is_none()) {
        assert!(p.wall_per_simulated.unwrap() > 0.0 && p.particle_steps_per_second.unwrap() > 0.0, "{p:?}");
    }
    for p in bench.points.iter().filter(|p| p.allowed.is_some()) {
        assert!(p.error <= p.allowed && p.error.is_some(), "{p:?}");
    }
    for p in bench.points.iter().filter(|p| p.suite == Suite::Sizes && p.quantity.starts_with("bytes")) {
        assert!(p.error.is_none_or(|ratio| (0.5..1.5).contains(&ratio)), "{p:?}");
    }
    every_speed_has_its_bytes_and_stages(&bench);
    every_solver_relaxes_the_bed(&bench);
    halving_the_step_of_the_cradle_divides_its_error_by_four(&bench);
    one_front_per_group(&bench);
    the_report_has_all_its_files(&bench);
}

/// What is counted, and that what is measured is there; how long anything takes is not judged.
fn every_speed_has_its_bytes_and_stages(bench: &Bench) {
    let positive = |x: Option<f64>| x.is_some_and(|x| x > 0.0 && x.is_finite());
    let speeds: Vec<&Point> = bench.points.iter().filter(|p| p.suite == Suite::Speed).collect();
    for p in &speeds {
        // Rounded up, the arrays of a grain and its slots, read and written.
        assert!(p.bytes_per_step.is_some_and(|b| (50.0..2000.0).contains(&b)), "{p:?}");
        assert!(positive(p.copy_fraction), "{p:?}");
        let own = |s: &&StageRow| (&s.case, s.engine, s.precision) == (&p.case, p.engine, p.precision);
        let stages: Vec<&StageRow> = bench.stages.iter().filter(own).collect();
        // Of clumps, the stage of a step that walks the lists.
        let clumps = p.case.starts_with("rods");
        let name = if clumps { "member_forces" } else { "advance" };
        let advance = stages.iter().find(|s| s.stage == name).expect("a step advances");
        assert_eq!(advance.calls, p.steps, "{advance:?}");
        for stage in stages.iter().filter(|s| s.stage != "rest") {
            // A clock may be too coarse for the shortest stages.
            assert!(stage.ms_per_call.is_some_and(|ms| ms >= 0.0) && positive(stage.bytes_per_particle), "{stage:?}");
            assert!(clumps || advance.bytes_per_particle >= stage.bytes_per_particle, "{stage:?}");
        }
        assert!(positive(advance.gigabytes_per_second) && positive(advance.copy_fraction), "{advance:?}");
        let total: f64 = stages.iter().map(|s| s.share).sum();
        assert!((total - 1.0).abs() < 1e-9, "with the rest, shares are everything: {total}");
        // The same grains in larger numbers move the same.
        let alike = |q: &&&Point| q.case.split(' ').next() == p.case.split(' ').next() && q.engine == p.engine;
        let other = speeds.iter().filter(alike).max_by_key(|q| q.grains).unwrap().bytes_per_step.unwrap();
        assert!((p.bytes_per_step.unwrap() / other - 1.0).abs() < 0.1, "{p:?}: {other}");
    }
    assert!(bench.points.iter().all(|p| p.suite == Suite::Speed || p.bytes_per_step.is_none()));
}

/// Counts and residuals. How long anything takes is not judged; but runs end when their time does, so only what was
/// reached is compared.
fn every_solver_relaxes_the_bed(bench: &Bench) {
    let engines: &[&str] = if bench.machine.adapter.is_some() { &["cpu", "gpu"] } else { &["cpu"] };
    for case in ["rigid bed 100", "rigid bed 1000"] {
        let found = |solver: &str, engine: &str| -> &RelaxationRow {
            let own =
                |row: &&RelaxationRow| (row.case.as_str(), row.solver.as_str(), row.engine) == (case, solver, engine);
            bench.relaxation.iter().find(own).unwrap_or_else(|| panic!("{case}: {solver} on the {engine} is missing"))
        };
        for order in ["fixed", "shuffled-once", "random-sweep", "random-sequential"] {
            assert!(found(&format!("gauss-seidel {order}"), "cpu").passes > 0);
        }
        for engine in engines {
            // Hundred passes or two to 1e-2, where plain ones take a thousand or two.
            let plain = found("jacobi", engine);
            for fast in ["jacobi-accelerated", "coloured-accelerated"].map(|solver| found(solver, engine)) {
                let passes = fast.passes_to_1e2.unwrap_or(fast.passes);
                assert!(passes < plain.passes_to_1e2.unwrap_or(u32::MAX), "{fast:?} {plain:?}");
            }
        }
    }
    assert!(bench.relaxation.iter().any(|row| row.solver == "socp"));
    for row in &bench.relaxation {
        let curve: Vec<_> = bench
            .residuals
            .iter()
            .filter(|r| (&r.case, &r.solver, r.engine) == (&row.case, &row.solver, row.engine))
            .collect();
        let end = curve.last().expect("every run has a curve");
        assert_eq!((end.passes, end.residual), (row.passes, row.residual), "{row:?}");
        assert!(curve.len() <= 200 && curve.is_sorted_by(|a, b| a.passes <= b.passes && a.seconds <= b.seconds));
        assert!(row.contacts as usize > row.grains && row.contact_passes_per_second > 0.0, "{row:?}");
        if row.passes_to_1e4.is_some() {
            assert!(row.residual <= 1e-4, "{row:?}");
        }
    }
}

/// Stages that device and host have timed: the same ones, equally often.
#[test]
fn both_clocks_see_the_same_stages() {
    let Ok(device) = Device::open(DeviceOptions::default()) else {
        assert!(!gpu_expected(), "no adapter; see PACKSTONE_ALLOW_NO_GPU in test.sh");
        return;
    };
    let scene = Scene::load(Path::new("examples/scenes/two_grains.toml"), &[]).unwrap().assemble().unwrap();
    let setup = Setup::new(&scene, &Options::default()).unwrap();
    let (state, plans) = (setup.whole(&scene).unwrap(), setup.plans);
    let timed = |device: Device| {
        let mut gpu = Gpu::new(device, &plans, &state).unwrap();
        *gpu.times() = Some(Times::default());
        // Lists and a step, then more steps.
        let steps = (0..5000).flat_map(|_| plans.motion.ops());
        let ops: Vec<_> = plans.lists.ops().into_iter().chain(steps).collect();
        gpu.execute(&state.params, &ops).unwrap();
        let times = gpu.times().take().unwrap();
        assert!(times.0.last().unwrap().seconds > 0.0, "{times:?}");
        (gpu.clock(), times.0.iter().map(|t| (t.stage.name, t.calls)).collect::<Vec<_>>())
    };
    let (own, seen) = timed(device);
    let restrictions = Restrictions { no_timestamps: true, ..Restrictions::default() };
    let without = Device::open(DeviceOptions { restrictions, ..DeviceOptions::default() }).unwrap();
    let (host, from_host) = timed(without);
    assert_eq!(seen, from_host);
    assert!(seen.contains(&("advance", 5000)), "{seen:?}");
    assert!(host.starts_with("host") && (own == "device" || own == host), "{own}, {host}");
}

fn halving_the_step_of_the_cradle_divides_its_error_by_four(bench: &Bench) {
    let cradle = |factor: f64| {
        let of = |p: &&Point| p.case == "cradle" && p.engine == "cpu" && p.quantity == "velocity";
        bench.points.iter().filter(of).find(|p| p.dt_over_auto == factor).unwrap().error.unwrap()
    };
    let ratio = cradle(2.0) / cradle(1.0);
    assert!((3.0..5.0).contains(&ratio), "the leapfrog is of second order: {ratio}");
}

fn one_front_per_group(bench: &Bench) {
    let mut fronts: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for p in bench.points.iter().filter(|p| p.error.is_some() && p.allowed.is_none()) {
        let front = fronts.entry(format!("{:?}", p.group())).or_default();
        if p.pareto {
            front.push((p.wall_per_simulated.unwrap(), p.error.unwrap()));
        }
    }
    for (group, mut front) in fronts {
        assert!(!front.is_empty(), "{group}");
        front.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert!(front.windows(2).all(|w| w[1].1 <= w[0].1), "{group}: slower must mean better: {front:?}");
    }
}

fn the_report_has_all_its_files(bench: &Bench) {
    let folder = tempfile::tempdir().unwrap();
    report::write(folder.path(), bench).unwrap();
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(csv::Reader::from_reader(read(report::TABLE).as_bytes()).records().count(), bench.points.len());
    assert_eq!(csv::Reader::from_reader(read(report::STAGES).as_bytes()).records().count(), bench.stages.len());
    let rows = |name: &str| csv::Reader::from_reader(read(name).as_bytes()).records().count();
    assert_eq!(rows(report::RELAXATION), bench.relaxation.len());
    assert_eq!(rows(report::RESIDUALS), bench.residuals.len());
    let json: serde_json::Value = serde_json::from_str(&read(report::JSON)).unwrap();
    assert_eq!(json["relaxation"].as_array().unwrap().len(), bench.relaxation.len());
    assert_eq!(json["residuals"].as_array().unwrap().len(), bench.residuals.len());
    assert_eq!(json["stages"].as_array().unwrap().len(), bench.stages.len());
    assert!(json["machine"]["cpu_copy_bandwidth"].as_f64().unwrap() > 0.0);
    assert_eq!(json["points"].as_array().unwrap().len(), bench.points.len());
    let text = read(report::REPORT);
    for word in
        ["processor", "driver", "commit", "particle-steps/s", "★", "bytes/particle-step", "share of time", "to 1e-3"]
    {
        assert!(text.contains(word), "the report lacks `{word}`");
    }
    for suite in Suite::ALL.into_iter().filter(|s| text.contains(&format!("{}.svg", s.name()))) {
        assert!(read(&format!("{}.svg", suite.name())).contains("</svg>"));
        let picture = fs::File::open(folder.path().join(format!("{}.png", suite.name()))).unwrap();
        let info = png::Decoder::new(std::io::BufReader::new(picture)).read_info().unwrap().info().size();
        assert!(info.0 >= 480 && info.1 >= 360);
    }
}

#[test]
fn a_failed_point_is_a_row() {
    let mut calls = 0;
    let bench = bench::run(&[Suite::Local], Effort::Quick, &mut |_| {
        calls += 1;
        ControlFlow::Break(())
    });
    assert!(bench.interrupted && calls == bench.points.len(), "an interrupted benchmark keeps what it has");
    let mut failed = bench;
    for point in &mut failed.points {
        point.status = "failed: no memory, \"quoted\"".to_owned();
        (point.error, point.wall_per_simulated, point.particle_steps_per_second) = (None, None, None);
    }
    let folder = tempfile::tempdir().unwrap();
    report::write(folder.path(), &failed).unwrap();
    let table = fs::read_to_string(folder.path().join(report::TABLE)).unwrap();
    assert_eq!(csv::Reader::from_reader(table.as_bytes()).records().count(), failed.points.len());
    assert!(fs::read_to_string(folder.path().join(report::REPORT)).unwrap().contains("failed: no memory"));
}

fn packstone(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_packstone"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn tuning_two_grains_finds_the_fastest_that_keeps_the_error() {
    let scene = "examples/scenes/two_grains.toml";
    let (code, out, _) = packstone(&["tune", scene, "--error", "1e-3", "--json"]);
    assert_eq!(code, 0);
    let tuning: serde_json::Value = serde_json::from_str(&out).unwrap();
    let candidates = tuning["candidates"].as_array().unwrap();
    let wall = |c: &serde_json::Value| c["wall_per_simulated"].as_f64().unwrap();
    let best = &candidates[tuning["best"].as_u64().unwrap() as usize];
    assert!(best["error"].as_f64().unwrap() <= 1e-3);
    for other in candidates.iter().filter(|c| c["error"].as_f64().is_some_and(|e| e <= 1e-3)) {
        assert!(wall(best) <= wall(other), "{other} is faster than {best}");
    }
    // Errors are of one collision, so they are small, and smaller with smaller steps.
    let error = |factor: f64| {
        let of = |c: &&serde_json::Value| c["engine"] == "cpu" && c["dt_over_auto"].as_f64() == Some(factor);
        candidates.iter().find(of).unwrap()["error"].as_f64().unwrap()
    };
    assert!(error(0.25) < 1e-5 && error(0.25) < error(4.0) && error(4.0) < 2e-3);
    assert_eq!(tuning["coordination_number"].as_f64(), Some(1.0));
}

#[test]
fn tuning_says_when_nothing_keeps_the_error() {
    let (code, out, _) = packstone(&["tune", "examples/scenes/two_grains.toml", "--error", "1e-30"]);
    assert_eq!(code, 1);
    assert!(out.contains("nothing keeps 1e-30; closest is --engine"), "{out}");
}

#[test]
fn bad_input_is_refused_in_one_sentence() {
    let scene = "examples/scenes/two_grains.toml";
    for (arguments, words) in [
        (vec!["tune", scene, "--error", "-1"], "--error -1: must be a number > 0"),
        (vec!["tune", scene, "--error", "0"], "--error 0: must be a number > 0"),
        (vec!["tune", scene, "--error", "nan"], "--error NaN: must be a number > 0"),
        (vec!["tune", "nowhere.toml", "--error", "1e-3"], "nowhere.toml"),
        (vec!["tune", scene, "--error", "1e-3", "--set", "solver.speed=1"], "speed"),
        (vec!["bench", "accuracy"], "there is no suite `accuracy`; there are local, trajectory, invariants"),
        (vec!["bench", "hard", "easy"], "there is no hard case `easy`; there are confined_sphere, close_packing"),
        (vec!["bench", "local", "--quick", "--out", "Cargo.toml"], "Cargo.toml"),
    ] {
        let (code, out, err) = packstone(&arguments);
        assert_eq!(code, 2, "{arguments:?}: {err}");
        assert!(out.is_empty() && err.starts_with("error: ") && err.contains(words), "{arguments:?}: {err}");
    }
}

#[test]
fn hard_cases_are_a_table() {
    let (code, out, err) = packstone(&["bench", "hard", "confined_sphere", "--short"]);
    assert_eq!(code, 0, "{err}");
    let rows: Vec<&str> = out.lines().collect();
    assert!(
        rows[0].starts_with("| case | figure | expected | cpu f64") && rows[2].contains("`confined_sphere`: S1"),
        "{out}"
    );
    assert!(rows.len() > 2 && !out.contains("missed"), "{out}");
}

#[test]
fn the_table_goes_to_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let (code, json, _) = packstone(&["bench", "local", "--quick", "--json", "--out", out]);
    assert_eq!(code, 0);
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(found["points"].as_array().unwrap().iter().all(|p| p["suite"] == "local"));
    assert!(Path::new(out).join(report::REPORT).is_file());
}
