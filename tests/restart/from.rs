//! Scenes that begin with what another run has left.

use crate::{
    SETTLE,
    common::*,
    example,
    place::{self, Place, errors},
    rigid_clumps,
};
use packstone::simulation::Simulation;

/// Grains at rest that begin anew with what their contacts remember stay where they are; without it they sag.
#[test]
fn contacts_remember_in_another_simulation() {
    let mut scene = example("heap_2d.toml", &[]);
    scene.solver.damping = 40.0;
    for bench in engines().into_iter().filter(|bench| bench.name != GPU_DOUBLE.name) {
        let mut first = bench.start(&scene);
        first.advance(15_000).unwrap();
        let contacts = first.contact_history().unwrap();
        assert!(contacts.len() > 200, "{} contacts", contacts.len());
        let before = first.sample().unwrap();
        let mut after = scene.clone();
        after.grains = first.grains().unwrap();
        let (mut with, kept) = Simulation::with_history(after.clone(), bench.options(), &contacts, false).unwrap();
        assert_eq!((kept, with.lost_contacts()), (contacts.len(), 0));
        // As many as there were, up to those that touch by rounding alone.
        let now = with.sample().unwrap();
        let (elastic, expected) = (now.elastic_energy, before.elastic_energy);
        println!("{}: elastic energy {expected:e} J before, {elastic:e} J after", bench.name);
        assert!((elastic - expected).abs() < 1e-4 * expected, "{}: {elastic:e} J, not {expected:e} J", bench.name);
        let mut without = Simulation::new(after, bench.options()).unwrap();
        first.advance(500).unwrap();
        let expected = first.grains().unwrap();
        let moved = |simulation: &mut Simulation| {
            simulation.advance(500).unwrap();
            let grains = simulation.grains().unwrap();
            grains.iter().zip(&expected).map(|(a, b)| (a.position - b.position).length()).fold(0.0, f64::max)
        };
        let (with, without) = (moved(&mut with), moved(&mut without));
        println!("{}: {with:e} m from where they would be, {without:e} m if contacts forget", bench.name);
        assert!(with < 0.01 * without, "{}: {with:e} m, {without:e} m", bench.name);
    }
}

/// Settled, then with less friction and more grains under a lid that stops, then once more.
#[test]
fn scenes_go_on_from_each_other() {
    let place = Place::new(SETTLE);
    let more = "[[population]]\nmaterial = \"glass\"\ncount = 5\nradius = 1e-3\n\
                region = { lower = [0, 0.06], upper = [0.02, 0.075] }\n";
    let next = SETTLE.replace("friction = 0.5", "friction = 0.2").replace("[0, -0.1]", "[0, 0]") + more;
    place.write("next.toml", &next);
    place.errors(&["run", "scene.toml", "--engine=cpu", "--out=first"], 0);
    let before = place.summary("first");
    for engine in place::engines() {
        let (second, third) = (format!("second_{engine}"), format!("third_{engine}"));
        let engine = format!("--engine={engine}");
        let run = ["run", "next.toml", &engine, "--steps=50", "--from=first", "--out", &second];
        let said = place.errors(&run, 0);
        for line in [
            "population.0 is there already",
            "population.1 is added",
            "wall lid has moved, and goes on from where it is",
        ] {
            assert!(said.contains(line), "no \"{line}\": {said}");
        }
        let contacts = before["contacts"].as_u64().unwrap();
        assert!(
            contacts > 100 && said.contains(&format!("{contacts} of {contacts} contacts keep their history")),
            "{said}"
        );
        let after = place.summary(&second);
        assert_eq!(after["particles"], 105);
        let lid = |summary: &serde_json::Value| summary["walls"][3]["point"][1].as_f64().unwrap();
        assert!((lid(&after) - lid(&before)).abs() < 1e-7 && (lid(&before) - 0.08).abs() < 1e-4, "{}", lid(&after));
        let run = ["run", "next.toml", &engine, "--steps=50", "--from", &second, "--out", &third];
        let said = place.errors(&run, 0);
        assert!(said.contains("population.1 is there already"), "{said}");
        assert_eq!(place.summary(&third)["particles"], 105);
        // What it went on with is in its folder, so it can be taken further without the first.
        place.errors(&["run", "--resume", &third, "--steps=80"], 0);
        assert_eq!(place.summary(&third)["steps"], 80);
    }
}

/// What a GPU has left is read on the host, so that a machine without one can go on with it.
#[test]
fn states_of_a_gpu_need_none() {
    if !place::engines().contains(&"gpu") {
        return;
    }
    let without =
        [("VK_ICD_FILENAMES", "/nowhere"), ("VK_DRIVER_FILES", "/nowhere"), ("VK_LOADER_LAYERS_DISABLE", "*")];
    let place = Place::new(SETTLE);
    let clumps = SETTLE.replace("radius = {", "shape = { dimer = 1, disk = 1 }\nradius = {");
    for (name, scene) in [("disks", SETTLE), ("clumps", &clumps)] {
        place.write(&format!("{name}.toml"), scene);
        let (file, gpu, cpu) = (format!("{name}.toml"), format!("{name}_gpu"), format!("{name}_cpu"));
        place.packstone(&["run", &file, "--engine=gpu", "--time=0.1", "--out", &gpu], 0);
        let steps = "--set=stop.steps=1";
        let run = ["run", &file, "--engine=cpu", steps, "--from", &gpu, "--out", &cpu];
        let output = place.command(&run).envs(without).output().unwrap();
        let said = errors(&output);
        assert_eq!(output.status.code(), Some(0), "{said}");
        let contacts = place.summary(&gpu)["contacts"].as_u64().unwrap();
        let known: u64 = said.split(" grains and ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!(known > 50 && known <= contacts, "{known} of {contacts} contacts: {said}");
        assert!(said.contains(&format!("note: {known} of {known} contacts keep their history")), "{said}");
        // Whoever goes on with the run itself needs the device that it ran on.
        let output = place.command(&["run", "--resume", &gpu, "--time=0.11"]).envs(without).output().unwrap();
        assert!(output.status.code() == Some(2) && errors(&output).contains("no GPU adapter found"), "{output:?}");
    }
}

/// `describe` tells what such a run does, and changes nothing.
#[test]
fn describe_knows_what_goes_on() {
    let place = Place::new(SETTLE);
    place.packstone(&["run", "scene.toml", "--engine=cpu", "--steps=500", "--out=first"], 0);
    let more = "[[population]]\nmaterial = \"glass\"\ncount = 5\nradius = 1e-3\n\
                region = { lower = [0, 0.06], upper = [0.02, 0.08] }\n";
    place.write("next.toml", &(SETTLE.to_owned() + more));
    let describe = ["describe", "next.toml", "--from=first", "--json", "--engine=cpu", "--estimate"];
    let output = place.packstone(&describe, 0);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["particles"], &json["model"]["precision"]), (&105.into(), &"double".into()));
    assert!(errors(&output).contains("population.1 is added") && !place.path("out").exists(), "{output:?}");
}

/// What could be meant either way is asked, and what is gone is said.
#[test]
fn grains_are_not_doubled() {
    let place = Place::new(SETTLE);
    place.errors(&["run", "scene.toml", "--engine=cpu", "--steps=500", "--out=first"], 0);
    let from = |scene: String, code: i32| {
        place.write("next.toml", &scene);
        place.errors(&["run", "next.toml", "--engine=cpu", "--steps=10", "--from=first", "--out=next"], code)
    };
    let said = from(SETTLE.replace("count = 100", "count = 100\nvelocity = [0, -1]"), 2);
    assert!(said.contains("next.toml: population.0: velocity is not as given"), "{said}");
    let said = from(SETTLE.replace("\"lid\"", "\"piston\""), 0);
    assert!(said.contains("wall lid of the run before is gone"), "{said}");
    let said = from(SETTLE.replace("glass", "quartz"), 2);
    assert!(said.contains("material is not as given"), "{said}");
}

/// Impulses keep the forces that they stood for if the time step is another.
#[test]
fn impulses_follow_the_time_step() {
    let mut scene = rigid_clumps("jacobi-accelerated");
    scene.solver.dt = packstone::scene::TimeStep::Fixed(1e-4);
    let mut first = CPU.start(&scene);
    first.advance(300).unwrap();
    let contacts = first.contact_history().unwrap();
    assert!(contacts.len() > 10, "{} contacts", contacts.len());
    let mut after = scene.clone();
    (after.grains, after.clumps) = (first.grains().unwrap(), first.clumps().unwrap());
    after.solver.dt = packstone::scene::TimeStep::Fixed(0.5e-4);
    let (mut second, kept) = Simulation::with_history(after, CPU.options(), &contacts, false).unwrap();
    let again = second.contact_history().unwrap();
    assert!(kept > 0 && again.len() == kept);
    for contact in &again {
        let before = contacts.iter().find(|c| (c.grain, c.other) == (contact.grain, contact.other)).unwrap();
        let (now, before) = (contact.mean_force, before.mean_force);
        assert!((now - before).length() <= 1e-12 * before.length(), "{now} N, not {before} N");
    }
}
