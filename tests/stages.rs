//! Scenes in stages: what each begins with, what is kept, and what is refused before the first step.

#[path = "common/place.rs"]
mod place;

use packstone::{
    io::{folder, read_rows, schedule::Schedule},
    prelude::*,
};
use place::{Place, engines};
use serde_json::Value;
use std::fs;

/// A bed that slides when its friction is lowered, and is then pressed while more grains come.
const SCENE: &str = r#"
dimension = 2
seed = 3
[material.glass]
density = 2500
normal_stiffness = 4e4
friction = 0.5
restitution = 0.3
[[wall]]
kind = "box"
name = "bin"
material = "glass"
lower = [0, 0]
upper = [0.02, 1]
faces = ["x-", "x+", "y-"]
[[wall]]
kind = "plane"
name = "lid"
material = "glass"
point = [0, 0.03]
normal = [0, -1]
[[population]]
material = "glass"
count = 60
radius = { uniform = [0.8e-3, 1.2e-3] }
[solver]
damping = 20
[stop]
time = 0.03
[[stage]]
name = "fill"
[[stage]]
name = "slip"
material.glass.friction = 0.1
stop.time = 0.01
[[stage]]
name = "press"
wall.lid.velocity = [0, -0.05]
stop.time = 0.01
[[stage.population]]
material = "glass"
count = 3
radius = 0.5e-3
region = { lower = [0, 0.026], upper = [0.02, 0.0295] }
"#;

/// What the program says on the standard error.
fn packstone(place: &Place, arguments: &str, code: i32) -> String {
    place.errors(&arguments.split(' ').collect::<Vec<_>>(), code)
}

/// A column of a history.
fn column(place: &Place, stage: &str, name: &str) -> Vec<f64> {
    let text = place.text(&format!("{stage}/history.csv"));
    let column = text.lines().next().unwrap().split(',').position(|column| column == name).unwrap();
    text.lines().skip(1).map(|row| row.split(',').nth(column).unwrap().parse().unwrap()).collect()
}

fn names(summary: &Value) -> Vec<(&str, &str, bool)> {
    let stages = summary["stages"].as_array().unwrap();
    stages
        .iter()
        .map(|stage| {
            let word = |key: &str| stage[key].as_str().unwrap_or("-");
            (word("name"), word("ended"), stage["outdated"].as_bool().unwrap())
        })
        .collect()
}

#[test]
fn each_stage_begins_with_the_state_of_the_one_before() {
    for engine in engines() {
        let place = Place::new(SCENE);
        let said = packstone(&place, &format!("run scene.toml --engine {engine} --out out"), 0);
        assert!(said.contains("stage press (3 of 3)") && said.contains("population.1 is added"), "{said}");
        let summary = place.json("out/summary.json");
        let all = [("fill", "last step", false), ("slip", "last step", false), ("press", "last step", false)];
        assert_eq!(names(&summary), all);
        assert_eq!((&summary["stage"], &summary["particles"]), (&"press".into(), &63.into()));
        let of = |stage: &str| place.json(&format!("out/stages/{stage}/summary.json"));
        assert_eq!((&of("slip")["particles"], &of("slip")["scene"]), (&60.into(), &"scene: slip".into()));
        // The lid has gone where it should.
        let lid = summary["walls"].as_array().unwrap().last().unwrap();
        let expected = 0.03 - 0.05 * summary["time"].as_f64().unwrap();
        assert!((lid["point"][1].as_f64().unwrap() - expected).abs() < 1e-9, "{lid}");
        let kept: Vec<&str> = said.lines().filter(|line| line.contains("contacts keep their history")).collect();
        let whole = |line: &&str| {
            let numbers: Vec<&str> = line.split(' ').filter(|word| word.parse::<u32>().is_ok()).collect();
            numbers[0] == numbers[1] && numbers[0].parse::<u32>().unwrap() > 20
        };
        assert!(kept.len() == 2 && kept.iter().all(whole), "{kept:?}");
        // As with --from, to the bit.
        fs::copy(place.path("out/stages/slip/scene.given.toml"), place.path("slip.toml")).unwrap();
        packstone(&place, &format!("run slip.toml --engine {engine} --from out/stages/fill --out slip"), 0);
        assert!(place.text("slip/final.csv") == place.text("out/stages/slip/final.csv"), "{engine}");
        // A result of stages is also one.
        assert_eq!(folder::find(&place.path("out")).unwrap(), (place.path("out/stages/press"), None));
        let said = packstone(&place, &format!("run slip.toml --engine {engine} --steps 1 --from out --out more"), 0);
        assert!(said.contains("out/stages/press at step") && said.contains("63 grains"), "{said}");
        // Where a stage changes nothing, springs and speeds are those at the end of the one before.
        let same =
            "--set stage.slip.material.glass.friction=0.5 --set stage.slip.stop.steps=2 --set stage.press.stop.steps=1";
        packstone(&place, &format!("run scene.toml --engine {engine} --out same {same}"), 0);
        for energy in ["elastic_energy", "kinetic_energy"] {
            let last = *column(&place, "same/stages/fill", energy).last().unwrap();
            let first = column(&place, "same/stages/slip", energy)[0];
            assert!(last > 0.0 && (first / last - 1.0).abs() < 1e-4, "{engine}: {energy} {last:e} J, then {first:e} J");
        }
    }
}

#[test]
fn stages_run_again_and_the_others_stay() {
    let place = Place::new(SCENE);
    packstone(&place, "run scene.toml --engine cpu --out out", 0);
    let first = |name: &str| fs::read(place.path("out/stages/fill").join(name)).unwrap();
    let (history, checkpoint) = (first("history.csv"), first("checkpoint.bin"));
    let finals = ["slip", "press"].map(|stage| place.text(&format!("out/stages/{stage}/final.csv")));
    let same = |finals: &[String; 2]| {
        assert!(first("history.csv") == history && first("checkpoint.bin") == checkpoint);
        ["slip", "press"].map(|stage| place.text(&format!("out/stages/{stage}/final.csv"))) == *finals
    };
    packstone(&place, "run scene.toml --engine cpu --out out --from-stage slip", 0);
    assert!(same(&finals));
    // One alone, changed: what is behind it is as it was, and is said not to follow from it.
    let said = packstone(&place, "run scene.toml --engine cpu --out out --only slip --set stage.slip.gravity=[5,0]", 0);
    assert!(said.contains("warning: stage press began with a state that was there before"), "{said}");
    assert!(!same(&finals) && place.text("out/stages/press/final.csv") == finals[1]);
    let summary = place.json("out/summary.json");
    assert_eq!(names(&summary)[1..], [("slip", "last step", false), ("press", "last step", true)]);
    assert!(summary["doubts"][0].as_str().unwrap().starts_with("stage press: began with"), "{}", summary["doubts"]);
    // The scene has it otherwise now.
    let said = packstone(&place, "run scene.toml --engine cpu --out out --from-stage press", 0);
    assert!(said.contains("stage slip is as it was run; the scene has it otherwise now"), "{said}");
    assert!(!said.contains("stage fill is as it was"), "{said}");
    assert_eq!(names(&place.json("out/summary.json"))[2], ("press", "last step", false));
    assert!(place.text("out/stages/press/final.csv") != finals[1]);
    // A result without stages takes the place of all of it.
    place.write("plain.toml", SCENE.split("[[stage]]").next().unwrap());
    packstone(&place, "run plain.toml --engine cpu --steps 2 --out out", 0);
    assert!(!place.path("out/stages").exists() && place.path("out/final.csv").exists());
}

/// Nothing runs, and nothing is written, if any stage is wrong.
#[test]
fn what_is_wrong_with_a_later_stage_is_said_first() {
    let place = Place::new(SCENE);
    for (arguments, words) in [
        ("--set stage.press.solvr.damping=1", "scene.toml: stage.press: unknown key `solvr`"),
        ("--set stage.press.solver.dt=1", "scene.toml: stage.press: "),
        (
            "--set solver.dt=1e-6 --set stage.press.wall.lid.velocity=[0,-5000]",
            "scene.toml: stage.press: wall lid moves",
        ),
        // Of what is added, too, at once or over time.
        ("--set solver.dt=2e-5 --set stage.press.population.0.radius=5e-5", "scene.toml: stage.press: "),
        (
            "--set solver.dt=2e-5 --set stage.press.population.0.radius=5e-5 --set stage.press.population.0.insertion={rate=1e3}",
            "scene.toml: stage.press: ",
        ),
        ("--set stage.slip.population.0.count=61", "stage.slip: population.0: count is not as given"),
        ("--set stage.press.stop.time=0", "stage.press (--set stage.press.stop.time=0): stop.time = 0"),
        ("--set stage.fill.output.checkpoint=0", "stage.fill: output.checkpoint = 0: must be above 0, as stage slip"),
        ("--only pess", "--only pess: there is no such stage; there are fill, slip, press"),
        ("--only slip", "there is no such folder"),
    ] {
        let said = packstone(&place, &format!("run scene.toml --engine cpu --out out {arguments}"), 2);
        assert!(said.contains(words), "{arguments}: {said}");
        assert!(!place.path("out").exists(), "{arguments}");
    }
    // What a stage has added is there in those behind it.
    place.write("later.toml", &format!("{SCENE}[[stage]]\nname = \"later\"\n"));
    let small = "--set solver.dt=2e-5 --set stage.press.population.0.radius=5e-5 --set stage.press.solver.dt=1e-6";
    let said = packstone(&place, &format!("run later.toml --engine cpu --out out {small}"), 2);
    assert!(said.contains("later.toml: stage.later: ") && said.contains("bound"), "{said}");
    let said = packstone(&place, "describe scene.toml --set stage.press.stop.steps=7 --set solver.dt=2e-5", 0);
    assert!(!said.contains("error"), "{said}");
    place.write("plain.toml", SCENE.split("[[stage]]").next().unwrap());
    let said = packstone(&place, "run plain.toml --only fill", 2);
    assert!(said.contains("has no [[stage]]"), "{said}");
    // What somebody else has put where results go.
    fs::create_dir_all(place.path("out/stages/slip")).unwrap();
    place.write("out/stages/slip/summary.json", "mine");
    let said = packstone(&place, "run scene.toml --engine cpu --out out", 2);
    assert!(said.contains("was not written by packstone"), "{said}");
    assert_eq!(place.text("out/stages/slip/summary.json"), "mine");
}

#[test]
fn a_stage_that_does_not_come_to_rest_stops_the_run_or_not() {
    let place = Place::new(SCENE);
    let rest = "--set stop.time=1e-3 --set stage.fill.stop.equilibrium=1e-2 --set stage.slip.stop.steps=5";
    let said = packstone(&place, &format!("run scene.toml --engine cpu --out out {rest}"), 1);
    assert!(said.contains("error: stage fill: stop.equilibrium = 1e-2 was not reached"), "{said}");
    let summary = place.json("out/summary.json");
    assert_eq!(names(&summary), [("fill", "last step", false), ("slip", "-", false), ("press", "-", false)]);
    assert!(summary["stages"][0]["missed"].as_str().unwrap().starts_with("stop.equilibrium"));
    let said = packstone(&place, "run --resume out", 2);
    assert!(said.contains("stage fill has come to its end already"), "{said}");
    // A longer one comes to rest, and the others follow.
    packstone(&place, "run --resume out --time 10", 0);
    let ended = [("fill", "at rest", false), ("slip", "last step", false), ("press", "last step", false)];
    assert_eq!(names(&place.json("out/summary.json")), ended);
    assert!(!place.path("out/partial").exists());
    let may = format!("{rest} --set stage.fill.required=false");
    packstone(&place, &format!("run scene.toml --engine cpu --out may {may}"), 0);
    assert_eq!(names(&place.json("may/summary.json"))[0], ("fill", "last step", false));
    packstone(&place, &format!("run scene.toml --engine cpu --out strict --strict {may}"), 3);
    assert!(place.path("strict/stages/press/final.csv").exists());
}

/// A periodic cell goes on as it has become: contacts are what they were across its faces, which have moved and tilted.
#[test]
fn cells_go_on_as_they_have_become() {
    const CELL: &str = r#"
dimension = 2
seed = 5
gravity = [0, 0]
[domain]
lower = [0, 0]
upper = [0.019, 0.019]
boundary = "periodic"
[material.glass]
density = 2500
normal_stiffness = 4e4
friction = 0.3
restitution = 0.3
[[population]]
material = "glass"
count = 64
radius = { uniform = [0.9e-3, 1.1e-3] }
gap = 0.02
velocity_spread = 0.1
[solver]
damping = 50
[[stage]]
name = "squeeze"
cell.strain_rate = { xx = -2, yy = -2 }
stop.packing_fraction = 0.9
[[stage]]
name = "shear"
cell.strain_rate = { xy = 2 }
stop.strain.xy = 0.3
[[stage]]
name = "on"
material.glass.friction = 0.5
cell.strain_rate = { xy = 2 }
stop.strain.xy = 0.3
"#;
    let place = Place::new(CELL);
    for engine in engines() {
        let said = packstone(&place, &format!("run scene.toml --engine={engine} --out=out"), 0);
        assert_eq!(said.matches("the cell has deformed, and goes on from what it is").count(), 2, "{said}");
        for [before, after] in [["squeeze", "shear"], ["shear", "on"]] {
            let ends = |name: &str| {
                let [before, after] = [before, after].map(|stage| column(&place, &format!("out/stages/{stage}"), name));
                (*before.last().unwrap(), after[0])
            };
            let (contacts, energy) = (ends("contacts"), ends("elastic_energy"));
            assert!(contacts.0 > 100.0 && contacts.0 == contacts.1, "{engine}, {after}: {contacts:?} contacts");
            // A contact remembers its springs of a step ago: their last step is done anew, with flow and friction as they
            // are now.
            assert!((energy.0 / energy.1 - 1.0).abs() < 1e-3, "{engine}, {after}: {energy:?} J");
        }
        let tilt = &place.json("out/summary.json")["domain"]["tilt"];
        assert!(tilt.to_string().len() > 4, "{tilt}");
    }
}

/// The same scene in code, run stage by stage, is what the program makes of the file, to the bit.
#[test]
fn stages_in_code_are_those_of_the_file() {
    let glass = MaterialBuilder::new(2500.0).normal_stiffness(4e4).friction(0.5).restitution(0.3);
    let bin = WallBuilder::box_between("glass", [0.0, 0.0], [0.02, 1.0]).name("bin");
    let few = PopulationBuilder::new("glass", 3, Radii::uniform(0.5e-3, 0.5e-3)).region([0.0, 0.026], [0.02, 0.0295]);
    let scene = Scene::builder(2)
        .seed(3)
        .material("glass", glass)
        .wall(bin.faces([Side::XLower, Side::XUpper, Side::YLower]))
        .wall(WallBuilder::plane("glass", [0.0, 0.03], [0.0, -1.0]).name("lid"))
        .population(PopulationBuilder::new("glass", 60, Radii::uniform(0.8e-3, 1.2e-3)))
        .solver(SolverBuilder::discrete_elements().damping(20.0))
        .stop_time(0.03)
        .stage(StageBuilder::new("fill"))
        .stage(StageBuilder::new("slip").set("material.glass.friction", 0.1).set("stop.time", 0.01))
        .stage(
            StageBuilder::new("press").set("wall.lid.velocity", [0.0, -0.05]).set("stop.time", 0.01).population(few),
        );
    let scene = scene.build().unwrap();
    assert_eq!(scene.stages().iter().map(|stage| &*stage.name).collect::<Vec<_>>(), ["fill", "slip", "press"]);
    for engine in engines() {
        let place = Place::new(&SCENE.replace("radius = 0.5e-3", "radius = { uniform = [0.5e-3, 0.5e-3] }"));
        packstone(&place, &format!("run scene.toml --engine {engine} --out out"), 0);
        let engine = if *engine == "gpu" { EngineChoice::Gpu } else { EngineChoice::Cpu };
        let mut run = StageRun::new(&scene, Options { engine, ..Options::default() }).unwrap();
        loop {
            let end = Schedule::new(run.simulation.assembly(), run.simulation.dt()).end.unwrap();
            run.simulation.advance(end).unwrap();
            let rows = read_rows(&place.path(&format!("out/stages/{}/final.csv", run.name()))).unwrap();
            let file: Vec<_> = rows.iter().map(|row| (row.position(), row.velocity())).collect();
            let code: Vec<_> = run.simulation.grains().unwrap().iter().map(|g| (g.position, g.velocity)).collect();
            assert!(file == code, "{} on {engine:?}", run.name());
            if !run.go_on().unwrap() {
                break;
            }
            assert!(run.notices.iter().any(|notice| notice.contains("contacts keep their history")));
        }
        assert_eq!((run.simulation.grains().unwrap().len(), run.name()), (63, "press"));
    }
    let wrong = |stage: StageBuilder| Scene::builder(2).stop_steps(1).stage(stage).build().unwrap_err().to_string();
    assert_eq!(
        wrong(StageBuilder::new("a").set("gravty", 1)).split(';').next(),
        Some("scene: stage.a: unknown key `gravty`")
    );
    assert!(
        wrong(StageBuilder::new("a").set("stop.time", 1.0).set("stop.time", 2.0))
            .contains("stage.a: stop.time: has been given already")
    );
    assert!(wrong(StageBuilder::new("a/b")).contains("a name has"));
}

/// Grains go on with the radii that they have grown to, which fill the cell as asked for, to rounding.
#[test]
fn grains_go_on_as_they_have_grown() {
    const GROWN: &str = r#"
dimension = 2
seed = 5
gravity = [0, 0]
[domain]
lower = [0, 0]
upper = [0.0153, 0.0153]
boundary = "periodic"
[material.glass]
density = 2500
normal_stiffness = 4e4
friction = 0.3
restitution = 0.3
[[population]]
material = "glass"
count = 64
radius = { uniform = [0.8e-3, 1.2e-3] }
placement = "random"
velocity_spread = 0.1
[stop]
time = 1
[[stage]]
name = "grow"
stop.packing_fraction = 0.84
[[stage.growth]]
initial = 0.6
rate = 5
[[stage]]
name = "rest"
solver.damping = "adaptive"
stop.steps = 50
[[stage]]
name = "press"
stop.pressure = 2e3
output.works = true
[[stage.growth]]
rate = 1
"#;
    let place = Place::new(GROWN);
    for engine in engines() {
        packstone(&place, &format!("run scene.toml --engine={engine} --out=out"), 0);
        let ends = [("grow", "target met", false), ("rest", "last step", false), ("press", "target met", false)];
        assert_eq!(names(&place.json("out/summary.json")), ends);
        let of = |stage: &str, name: &str| column(&place, &format!("out/stages/{stage}"), name);
        let filled = *of("grow", "solid_fraction").last().unwrap();
        assert!((filled / 0.84 - 1.0).abs() < 1e-12, "{engine}: {filled}");
        let radii = |stage: &str| {
            let text = place.text(&format!("out/stages/{stage}/final.csv"));
            let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
            let at = head.iter().position(|name| *name == "radius").unwrap();
            text.lines().skip(1).map(|row| row.split(',').nth(at).unwrap().parse().unwrap()).collect::<Vec<f64>>()
        };
        let (grown, pressed) = (radii("grow"), radii("press"));
        assert_eq!(grown, radii("rest"), "{engine}");
        let factors: Vec<f64> = pressed.iter().zip(&grown).map(|(now, before)| now / before).collect();
        assert!(factors[0] > 1.0 && factors.iter().all(|factor| (factor / factors[0] - 1.0).abs() < 1e-14), "{engine}");
        let pressure = of("press", "pressure");
        assert!(pressure.last() >= Some(&2e3) && pressure[pressure.len() - 2] < 2e3, "{engine}: {pressure:?}");
        assert!(of("press", "work_growth").last() > Some(&0.0), "{engine}");
    }
}
