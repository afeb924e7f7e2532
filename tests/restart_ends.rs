//! Runs that are over, or were taken back, and go on: what a kill leaves between the last checkpoint and the results, rows
//! that are gone, a state whose next step has lost a grain.

mod common;
#[path = "common/place.rs"]
mod place;

use common::{GPU_DOUBLE, engines};
use glam::DVec3;
use packstone::{
    Error,
    prelude::*,
    simulation::{Checkpoint, Options, Simulation},
};
use place::{Place, errors};
use std::{fs, path::Path};

const SETTLE: &str = r#"
dimension = 2
seed = 3
[material.glass]
density = 2500
normal_stiffness = 1e5
friction = 0.5
restitution = 0.3
[[wall]]
kind = "box"
name = "bin"
material = "glass"
lower = [0, 0]
upper = [0.02, 1]
faces = ["x-", "x+", "y-"]
[[population]]
material = "glass"
count = 60
radius = { uniform = [0.8e-3, 1.2e-3] }
[solver]
damping = 100
[output]
formats = ["csv", "vtp"]
[stop]
time = 2
equilibrium = 1e-2
"#;

const STAGES: &str = "[[stage]]\nname = \"fall\"\n[[stage]]\nname = \"slip\"\nmaterial.glass.friction = 0.1\n\
                      stop.steps = 300\n";

/// Make of the result in a folder what a kill leaves between the last checkpoint and the results.
fn unfinish(folder: &Path) {
    let partial = folder.join("partial");
    fs::create_dir(&partial).unwrap();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        match &*name {
            "partial" | ".packstone" => {}
            "final.csv" | "summary.json" => fs::remove_file(entry.path()).unwrap(),
            _ => fs::rename(entry.path(), partial.join(&name)).unwrap(),
        }
    }
    reopen(&partial);
}

/// The record of a run that goes on.
fn reopen(folder: &Path) {
    let path = folder.join("run.json");
    let mut run: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    for key in ["end", "ended"] {
        run[key] = serde_json::Value::Null;
    }
    (run["complete"], run["files"]) = (false.into(), serde_json::json!({}));
    fs::write(path, run.to_string()).unwrap();
}

/// Grains, rows without the column that is never the same, and how it ended.
fn outcome(place: &Place, folder: &str) -> (String, Vec<Vec<String>>, serde_json::Value) {
    let history = place.text(&format!("{folder}/history.csv"));
    let mut rows: Vec<Vec<String>> = history.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
    let speed = rows[0].iter().position(|column| column == "particle_steps_per_second").unwrap();
    rows.iter_mut().for_each(|row| drop(row.remove(speed)));
    let mut summary = place.summary(folder);
    for key in ["wall_seconds", "particle_steps_per_second"] {
        summary.as_object_mut().unwrap().remove(key);
    }
    (place.text(&format!("{folder}/final.csv")), rows, summary)
}

#[test]
fn results_are_written_of_a_run_that_was_killed_at_its_end() {
    let place = Place::new(SETTLE);
    // At rest, at the last step with a row of its own, and with one that is among the others.
    for (name, more) in
        [("rest", &[][..]), ("between", &["--steps=250", "--set=output.history=1e-3"]), ("row", &["--steps=200"])]
    {
        let out = format!("--out={name}");
        place.run(&[&[&*out], more].concat(), 0);
        let before = outcome(&place, name);
        assert_eq!(before.2["ended"], if name == "rest" { "at rest" } else { "last step" });
        let resume = format!("--resume={name}");
        let said = place.errors(&["run", &resume], 2);
        assert!(said.contains("already") && said.contains("at rest") == (name == "rest"), "{said}");
        unfinish(&place.path(name));
        let said = place.errors(&["run", &resume], 0);
        assert!(said.contains("had come to its end"), "{said}");
        assert!(outcome(&place, name) == before, "{name}");
        assert!(!place.path(name).join("partial").exists());
    }
    // Whoever wants more steps has them, whatever there was.
    unfinish(&place.path("row"));
    place.errors(&["run", "--resume=row", "--steps=210"], 0);
    assert_eq!(place.summary("row")["steps"], 210);
}

#[test]
fn a_stage_that_cannot_go_on_locks_nobody_out() {
    let place = Place::new(&(SETTLE.to_owned() + STAGES));
    place.run(&["--out=out"], 0);
    let before = outcome(&place, "out/stages/slip");
    let kill = || {
        unfinish(&place.path("out/stages/slip"));
        fs::remove_file(place.path("out/summary.json")).unwrap();
        fs::create_dir(place.path("out/partial")).unwrap();
        for name in ["run.json", "scene.toml", "stages"] {
            fs::rename(place.path("out").join(name), place.path("out/partial").join(name)).unwrap();
        }
        reopen(&place.path("out/partial"));
    };
    kill();
    place.errors(&["run", "--resume=out"], 0);
    assert!(outcome(&place, "out/stages/slip") == before && !place.path("out/partial").exists());
    // Now without a checkpoint that could be read.
    kill();
    let checkpoint = place.path("out/partial/stages/slip/partial/checkpoint.bin");
    let good = fs::read(&checkpoint).unwrap();
    fs::write(&checkpoint, &good[..good.len() / 2]).unwrap();
    for _ in 0..2 {
        let said = place.errors(&["run", "--resume=out"], 1);
        assert!(said.contains("stage slip: ") && said.contains("is cut off"), "{said}");
        assert!(!place.path("out/run.json").exists());
    }
    let said = place.errors(&["run", "scene.toml", "--engine=cpu", "--from-stage=slip", "--out=out"], 0);
    assert!(said.contains("is now out/partial.1"), "{said}");
    assert!(outcome(&place, "out/stages/slip").0 == before.0);
    // What was set aside is whole again when its checkpoint is.
    fs::write(place.path("out/partial.1/stages/slip/partial/checkpoint.bin"), good).unwrap();
    place.errors(&["run", "--resume=out/partial.1"], 0);
    assert!(outcome(&place, "out/partial.1/stages/slip") == before);
}

/// Rows that somebody has taken out are gone; the others stay, and those that follow come behind them.
#[test]
fn a_history_may_lack_rows() {
    let place = Place::new(SETTLE);
    let run = ["--steps=200", "--set=output.history=1e-9"];
    place.run(&[&run[..], &["--out=whole"]].concat(), 0);
    let whole = outcome(&place, "whole").1;
    for (name, left, missing) in [("some", 3, 99), ("head", 1, 101), ("none", 0, 101)] {
        place.run(&["--steps=100", run[1], &format!("--out={name}")], 0);
        unfinish(&place.path(name));
        let history = place.path(name).join("partial/history.csv");
        let lines: Vec<String> =
            fs::read_to_string(&history).unwrap().lines().map(|line| format!("{line}\n")).collect();
        match left {
            0 => fs::remove_file(&history).unwrap(),
            _ => fs::write(&history, lines[..left].concat() + &lines[50][..20]).unwrap(),
        }
        let said = place.errors(&["run", &format!("--resume={name}"), "--steps=200"], 0);
        assert!(said.contains(&format!("history.csv: {missing} of 101 rows are gone")), "{said}");
        let rows = outcome(&place, name).1;
        assert!(rows == [&whole[..left.max(1)], &whole[102..]].concat(), "{name}: {} rows", rows.len());
    }
    let none = ["--steps=20", "--set=output.checkpoint=0", "--out=unsaved"];
    place.run(&none, 0);
    let said = place.errors(&["run", "--resume=unsaved", "--steps=30"], 2);
    assert!(said.contains("has output.checkpoint = 0") && !said.contains("killed"), "{said}");
}

/// An overlap that a run begins with hides no other one.
#[test]
fn inherited_overlaps_hide_no_others() {
    let grain = |x: f64, y: f64, v: f64, fixed: bool| {
        format!(
            "[[grain]]\nposition = [{x}, {y}, 0]\nvelocity = [0, {v}, 0]\nradius = 1e-3\nmaterial = \"soft\"\nfixed = {fixed}\n"
        )
    };
    let pair = grain(0.0, 0.0, 0.0, true) + &grain(0.4e-3, 0.0, 0.0, false);
    let scene = |grains: &str, steps: u32| {
        format!(
            "dimension = 3\ngravity = [0, 0, 0]\n[material.soft]\ndensity = 2500\nnormal_stiffness = 1e3\n{grains}\
             [solver]\nallow_overlap = true\ndt = 1e-6\n[stop]\nsteps = {steps}\n[output]\nhistory = 1e-9\n"
        )
    };
    let place = Place::new(&scene(&pair, 5));
    place.run(&["--out=first", "--strict"], 3);
    place.write("next.toml", &scene(&(pair + &grain(0.0, 0.01, 20.0, false) + &grain(0.0, 0.0125, 0.0, false)), 300));
    let said = place.errors(&["run", "next.toml", "--from=first", "--engine=cpu", "--out=next", "--strict"], 3);
    assert!(said.contains("warning: the state that it began with had an overlap 1.60 radii deep"), "{said}");
    assert!(said.contains("deeper than 2.00 radii"), "{said}");
}

/// A step that loses a grain is taken back: grains, walls, springs and works are those of the step before it, and it is
/// the same when it is done again.
#[test]
fn the_state_before_a_lost_grain_is_whole() {
    let bullet = "[[grain]]\nposition = [0.01, 0.06]\nvelocity = [0, 3]\nradius = 1e-3\nmaterial = \"glass\"\n\
                  [domain]\nlower = [-0.1, -0.1]\nupper = [0.1, 0.2]\n";
    // Walls that the device moves, and those that the host guides.
    for motion in ["velocity = [0.1, 0.05]", "oscillation = { amplitude = [3e-4, 0], frequency = 100 }"] {
        let text = SETTLE.replace("name = \"bin\"", &format!("name = \"bin\"\n{motion}")).replace("1e5", "2e4");
        let text = text.replace("damping = 100", "").replace("[output]", "[output]\nworks = true") + bullet;
        is_whole(&Scene::parse(&text, "scene.toml", Path::new(""), &[]).unwrap().assemble().unwrap());
        // What slid before is not known any more, and is no number.
        let place = Place::new(&text);
        let said = errors(&place.run(&["--out=out"], 1));
        assert!(said.contains("grain 0 has left the domain"), "{said}");
        let rows: Vec<Vec<String>> =
            place.text("out/history.csv").lines().map(|row| row.split(',').map(str::to_owned).collect()).collect();
        let unknown = rows.last().unwrap().iter().zip(&rows[0]).filter(|(number, _)| *number == "NaN");
        assert_eq!(unknown.map(|(_, name)| name).collect::<Vec<_>>(), ["dissipation"]);
    }
}

fn is_whole(assembly: &Assembly) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint.bin");
    for bench in engines().into_iter().filter(|bench| bench.name != GPU_DOUBLE.name) {
        let mut lost = bench.start(assembly);
        let reason = loop {
            if let Err(error) = lost.advance_chunk(u64::MAX) {
                break error;
            }
        };
        let at = lost.step();
        assert!(matches!(&reason, Error::Run { step, .. } if *step == at + 1), "{reason}, after step {at}");
        let mut whole = bench.start(assembly);
        whole.advance(at).unwrap();
        assert_same(&mut lost, &mut whole, bench.name);
        lost.save(&path, &()).unwrap();
        let mut checkpoint = Checkpoint::open(&path).unwrap();
        let mut again = Simulation::resume(assembly.clone(), Options::default(), &mut checkpoint).unwrap();
        assert_same(&mut again, &mut whole, bench.name);
        assert_eq!(again.advance_chunk(1).unwrap_err().to_string(), reason.to_string());
        assert_same(&mut again, &mut whole, bench.name);
        // Another run that begins with that state has the same springs.
        let contacts = again.contact_history().unwrap();
        let mut other = assembly.clone();
        (other.grains, other.walls) = (again.grains().unwrap(), again.walls().unwrap());
        other.walls.iter_mut().for_each(|wall| wall.motion = Default::default());
        other.solver.allow_overlap = true;
        let wanted = whole.sample().unwrap().elastic_energy;
        let [with, without] = [again.remembers_now(), false].map(|of_now| {
            let begun = Simulation::with_history(other.clone(), bench.options(), &contacts, of_now).unwrap();
            let (mut begun, kept) = begun;
            assert!(kept > 8, "{kept} contacts");
            (begun.sample().unwrap().elastic_energy / wanted - 1.0).abs()
        });
        println!("{}: elastic energy is {with:e} off, and {without:e} if springs were stretched again", bench.name);
        assert!(with < 2e-5 && 10.0 * with < without, "{}: {with:e}, {without:e}", bench.name);
    }
}

/// Up to rounding; what slides in the last step is not known any more as a power, but as an energy.
fn assert_same(found: &mut Simulation, wanted: &mut Simulation, name: &str) {
    assert_eq!(found.step(), wanted.step());
    let [(found_walls, found_contacts), (walls, contacts)] =
        [&mut *found, &mut *wanted].map(|s| (s.walls().unwrap(), s.contacts().unwrap()));
    assert_eq!(found_walls, walls, "{name}");
    assert!(contacts.len() > 8 && contacts.len() == found_contacts.len(), "{name}: {} contacts", contacts.len());
    let near = |a: DVec3, b: DVec3, of: f64, what: &str| {
        assert!((a - b).length() <= 2e-5 * of, "{name}: {what} is {a}, not {b}");
    };
    let largest = contacts.iter().map(|contact| contact.force.length()).fold(0.0, f64::max);
    for (a, b) in found_contacts.iter().zip(&contacts) {
        assert_eq!((a.grain, &a.other), (b.grain, &b.other), "{name}");
        near(a.force, b.force, largest, "a force");
    }
    let (found, wanted) = (found.sample().unwrap(), wanted.sample().unwrap());
    let sums = |s: &Sample| [s.elastic_energy, s.dissipated.unwrap(), s.work_walls.unwrap()];
    let of = sums(&found).into_iter().zip(sums(&wanted)).zip(["elastic energy", "dissipated", "work of walls"]);
    for ((found, wanted), what) in of {
        assert!(
            wanted != 0.0 && (found - wanted).abs() <= 1e-4 * wanted.abs(),
            "{name}: {what} {found:e}, not {wanted:e}"
        );
    }
}
