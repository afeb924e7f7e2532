//! Tests of an element of soil in stages, and studies of several cases and seeds.

#[path = "common/place.rs"]
mod place;

use place::Place;

/// Disks that a servo compresses, that come closer with less friction, and are then loaded along y. Weights of pressure over
/// stiffness and of the rates make it short, not quasi-static.
const BIAXIAL: &str = r#"
dimension = 2
seed = 1
gravity = [0, 0]
[domain]
lower = [0, 0]
upper = [0.024, 0.024]
boundary = "periodic"
[material.sand]
density = 2500
normal_stiffness = 1e5
friction = 0.5
restitution = 0.2
[[population]]
material = "sand"
count = 100
radius = { uniform = [0.8e-3, 1.2e-3] }
placement = "random"
[solver]
damping = 200
[output]
formats = ["csv"]
history = 2e-4
[[stage]]
name = "compress"
cell.stress = { xx = 500, yy = 500 }
cell.inertial_number = 1e-2
stop.equilibrium = 1e-2
stop.time = 0.3
[[stage]]
name = "densify"
material.sand.friction = 0
cell.stress = { xx = 500, yy = 500 }
stop.packing_fraction = 0.83
stop.equilibrium = 1e-3
stop.time = 0.3
[[stage]]
name = "load"
cell.stress = { xx = 500 }
cell.gain = 1e-2
cell.strain_rate = { yy = -1 }
stop.strain.xx = 0.01
stop.time = 0.1
"#;

/// Columns of a history, row by row.
fn columns<const N: usize>(place: &Place, file: &str, names: [&str; N]) -> Vec<[f64; N]> {
    let text = place.text(file);
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let at = names.map(|name| header.iter().position(|title| *title == name).unwrap_or_else(|| panic!("no {name}")));
    lines.map(|row| at.map(|at| row[at].parse().unwrap_or_else(|e| panic!("{}: {e}", row[at])))).collect()
}

#[test]
fn a_fraction_is_prepared_and_loaded_under_a_servo() {
    let place = Place::new(BIAXIAL);
    place.run(&["--out", "o"], 0);
    let of = |stage: &str| place.summary(&format!("o/stages/{stage}"));
    assert_eq!(of("compress")["ended"], "at rest");
    // Ended by the target, so that rest is not missed, at the first row that has it.
    let densify = of("densify");
    assert_eq!((&densify["ended"], &densify["missed"]), (&"target met".into(), &serde_json::Value::Null));
    let fractions = columns(&place, "o/stages/densify/history.csv", ["solid_fraction"]);
    let (last, before) = (fractions[fractions.len() - 1][0], fractions[fractions.len() - 2][0]);
    assert!(before < 0.83 && (0.83..0.84).contains(&last), "{before} {last}");
    // A strain that the servo makes.
    assert_eq!(of("load")["ended"], "target met");
    let names = [
        "strain_xx",
        "strain_yy",
        "volumetric_strain",
        "stress_xx",
        "stress_yy",
        "stress_xy",
        "pressure",
        "deviatoric_stress",
    ];
    let load = columns(&place, "o/stages/load/history.csv", names);
    let [xx, yy, volume, stress_xx, stress_yy, stress_xy, pressure, deviator] = load[load.len() - 1];
    assert!((0.01..0.02).contains(&xx) && yy < -0.005, "{xx} {yy}");
    assert!((volume - (xx + yy)).abs() < 1e-12);
    assert!((pressure - 0.5 * (stress_xx + stress_yy)).abs() < 1e-9 * pressure);
    let difference = (stress_xx - stress_yy).hypot(2.0 * stress_xy);
    assert!((deviator - difference).abs() < 1e-9 * deviator && deviator > 50.0, "{deviator} {difference}");
}

/// What cannot be met by given rates can be by a servo, and the other way round.
#[test]
fn targets_that_are_never_met_are_refused() {
    let place = Place::new(BIAXIAL);
    let refused = place.errors(&["run", "scene.toml", "--set", "stage.load.stop.strain.yy=0.1"], 2);
    assert!(refused.contains("stop.strain.yy") && refused.contains("never met"), "{refused}");
    let fixed = ["--set", "stage.compress.cell={}", "--set", "stage.compress.stop.packing_fraction=0.9"];
    let refused = place.errors(&[&["run", "scene.toml"][..], &fixed].concat(), 2);
    assert!(refused.contains("never met"), "{refused}");
    assert!(!place.path("out").exists());
}

/// The mean of two seeds by two cases, one of which does not come to rest.
const STUDY: &str = r#"
title = "Falling"
text = "Two disks."
seeds = 2
[scene]
dimension = 2
[scene.domain]
lower = [0, 0]
upper = [0.1, 0.1]
[scene.material.glass]
density = 2500
normal_stiffness = 1e5
[[scene.population]]
material = "glass"
count = 2
radius = 1e-3
placement = "random"
region = { lower = [0, 0], upper = [0.1, 0.1] }
[scene.stop]
steps = 20
[[column]]
title = "energy"
history = "kinetic_energy"
over = "time"
rows = "peak"
[[column]]
title = "steps"
summary = "steps"
[[column]]
title = "dozens of grains"
measure = "particles"
unit = 12
[[case]]
name = "as it is"
published = { steps = "20 (nobody)" }
[[case]]
name = "no rest"
set = { "stop.equilibrium" = 1e-9 }
"#;

#[test]
fn studies_are_means_of_runs_that_are_done_once() {
    let place = Place::new("");
    place.write("fall.toml", STUDY);
    let study = ["study", "fall.toml", "--out", "s", "--engine", "cpu", "--page", "page.md"];
    let first = place.errors(&study, 0);
    assert!(first.contains("as it is, seed 2 of 2"), "{first}");
    let page = place.text("page.md");
    assert!(page.contains("|  | energy | steps | published | dozens of grains | runs |"), "{page}");
    assert!(
        page.contains("| as it is |") && page.contains("| 20.0000 ± 0.0000 | 20 (nobody) | 0.1667 ± 0.0000 | 2 of 2 |"),
        "{page}"
    );
    assert!(
        page.contains("| no rest |  |  |  |  | 0 of 2 |")
            && page.contains("Not counted: no rest, seed 1: stop.equilibrium"),
        "{page}"
    );
    // Free fall: all have the same.
    let [row] = &columns(&place, "s/fall/as_it_is/seed_1/history.csv", ["step"])[..1] else { unreachable!() };
    assert_eq!(row, &[0.0]);
    let again = place.errors(&study, 0);
    assert!(!again.contains("seed 2 of 2"), "{again}");
    assert_eq!(place.text("page.md"), page);
}

#[test]
fn studies_that_cannot_be_run_are_refused() {
    let place = Place::new("");
    for (change, to, word) in [
        ("steps = 20", "steps = 0", "stop.steps"),
        ("summary = \"steps\"", "", "must have one of summary"),
        ("summary = \"steps\"", "summary = \"steps\"\nover = \"time\"", "over goes with history"),
        ("unit = 12", "unit = 0", "unit must be"),
        (
            "measure = \"particles\"",
            "exponent = { of = \"pressure\", at_jamming = 0, range = [1e-2, 1e-4] }",
            "exponent.range must be",
        ),
        ("published = { steps", "published = { stops", "stops"),
        ("\"stop.equilibrium\"", "\"stop.equilibria\"", "equilibria"),
        ("seeds = 2", "seed = 2", "seed"),
    ] {
        place.write("bad.toml", &STUDY.replace(change, to));
        let refused = place.errors(&["study", "bad.toml", "--out", "s"], 2);
        assert!(refused.contains(word) && refused.contains("bad.toml"), "{refused}");
        assert!(!place.path("s").exists());
    }
    let unknown = place.errors(&["study", "nothing"], 2);
    assert!(unknown.contains("friction"), "{unknown}");
}

/// Of states as `[jamming]` leaves them: those of the decompression, at rest and in the range.
#[test]
fn exponents_are_those_of_the_decompression() {
    let place = Place::new("");
    let exponent = "exponent = { of = \"coordination_without_rattlers\", at_jamming = 4, range = [1e-4, 1e-2] }";
    place.write(
        "states.toml",
        &STUDY.replace("summary = \"steps\"", exponent).replace("measure = \"particles\"", "summary = \"steps\""),
    );
    let header = "step,packing_fraction,pressure,coordination_number,coordination_without_rattlers,rattlers,residual,converged,jammed";
    let state = |beyond: f64, z: f64, converged: bool| {
        format!("1,{},{},4,{z},0,1e-9,{converged},true", 0.84 + beyond, 0.3 * beyond)
    };
    let root = |beyond: f64| 4.0 + 3.5 * beyond.powf(0.5);
    let states = [
        state(0.003, 9.0, true), // While it is compressed,
        state(0.02, root(0.02), true),
        state(8e-3, root(8e-3), true),
        state(4e-3, 9.0, false), // not at rest,
        state(2e-3, root(2e-3), true),
        state(5e-4, root(5e-4), true),
        state(5e-5, 9.0, true), // and too close.
    ];
    for (seed, states) in [(1, &states[..]), (2, &states[..3])] {
        let folder = format!("s/states/as_it_is/seed_{seed}");
        std::fs::create_dir_all(place.path(&folder)).unwrap();
        place.write(&format!("{folder}/summary.json"), r#"{"jamming_fraction": 0.84, "steps": 24, "missed": null}"#);
        place.write(&format!("{folder}/jamming.csv"), &format!("{header}\n{}\n", states.join("\n")));
        place.write(&format!("{folder}/history.csv"), "kinetic_energy,time\n2,1\n");
    }
    place.errors(&["study", "states.toml", "--out", "s", "--only-page", "--page", "page.md"], 0);
    let page = place.text("page.md");
    assert!(page.contains("| as it is | 2.0000 | 0.5000 | 20 (nobody) | 2.0000 | 1 of 2 |"), "{page}");
    assert!(page.contains("as it is, seed 2: has fewer than 3 states for \"steps\""), "{page}");
}
