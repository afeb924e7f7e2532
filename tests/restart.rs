//! A run that goes on from a checkpoint is the run that was never interrupted, to the bit.

mod common;
#[path = "common/place.rs"]
mod place;

use common::*;
use packstone::{
    measure::Sample,
    scene::{Assembly, Scene},
    simulation::{Checkpoint, Options, Simulation},
    state::{
        ACTIVE, ARRAYS, Array, Lifetime, NONE,
        array::{CONTACT_COLOR, IMPULSE},
        present,
    },
};
use place::{Place, errors};
use std::{
    cell::Cell,
    fs,
    path::Path,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::Duration,
};

fn example(name: &str, set: &[&str]) -> Assembly {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    Scene::load(&Path::new("examples/scenes").join(name), &set).unwrap().assemble().unwrap()
}

/// Scenes of every kind of memory, and the steps to a sample: lists are made anew in between, but not at every one.
fn scenes() -> Vec<(&'static str, Assembly, u64)> {
    let column = ["population.0.count=300"];
    let rigid = |solver| {
        let few = ["population.0.count=2", "population.1.count=498", "solver.max_iterations=20", solver];
        let narrow = ["wall.0.upper=[0.025, 0.025, 2]", "population.0.region.upper=[0.025, 0.025, 0.05]"];
        example("hard/rigid_settling_3d.toml", &[&few[..], &narrow[..]].concat())
    };
    let mut periodic = example("hard/gas.toml", &["output.works=true"]);
    periodic.solver.allow_overlap = true;
    let mut sheared = example("hard/gas.toml", &["output.works=true"]);
    sheared.solver.allow_overlap = true;
    sheared.cell.strain_rate[..2].fill(-30.0);
    sheared.cell.strain_rate[5] = 100.0;
    sheared.domain.tilt.z = 0.4999 * (sheared.domain.upper.x - sheared.domain.lower.x);
    let mut driven = sheared.clone();
    driven.cell.strain_rate[..2].fill(0.0);
    driven.cell.stress[..3].fill(Some(500.0));
    driven.cell.inertial_number = 0.1;
    let mut moving = example("heap_2d.toml", &[]);
    moving.walls[0].velocity.y = 0.05;
    let mut beads = example("elastic_beads.toml", &column);
    beads.grains.iter_mut().for_each(|grain| grain.velocity.z = -2.0);
    vec![
        ("disks on a moving floor", moving, 1000),
        ("works in a periodic box", periodic, 150),
        ("a cell that shears", sheared, 150),
        ("a cell with a servo", driven, 150),
        ("elastic spheres that roll", beads, 150),
        ("spheres of two sizes", example("hard/size_ratio.toml", &[]), 150),
        ("clumps", example("hard/dimer_bed.toml", &[]), 150),
        ("jacobi", rigid("solver.relaxation=jacobi-accelerated"), 7),
        ("colours", rigid("solver.relaxation=coloured-accelerated"), 7),
        ("disks by gauss-seidel", example("hard/rigid_settling_2d.toml", &["solver.relaxation=gauss-seidel"]), 4),
        ("clumps by jacobi", rigid_clumps("jacobi-accelerated"), 7),
        ("clumps by colours", rigid_clumps("coloured-accelerated"), 7),
    ]
}

fn rigid_clumps(solver: &str) -> Assembly {
    let solver = format!("solver.relaxation={solver}");
    let set = ["solver.method=cd", "solver.dt=2e-4", "solver.max_iterations=20", &solver];
    example("hard/dimer_bed.toml", &set)
}

/// Samples every so many steps, so often.
fn samples(simulation: &mut Simulation, steps: u64, times: u64) -> Vec<Sample> {
    let sample = |_| {
        let next = simulation.step() + steps;
        while simulation.step() < next {
            simulation.advance_chunk(next - simulation.step()).unwrap();
        }
        simulation.sample().unwrap()
    };
    (0..times).map(sample).collect()
}

/// All that later steps depend on, array by array. Impulses of pairs that do not touch are left over, and never read;
/// atomics give contacts of a colour their ranks in any order.
fn content(simulation: &mut Simulation) -> Vec<(&'static str, Vec<u64>)> {
    let arrays = present(simulation.model(), ARRAYS);
    let kept: Vec<_> = arrays.into_iter().filter(|array| array.lifetime == Lifetime::State).collect();
    let dims = simulation.model().dims();
    let state = simulation.read(&kept).unwrap();
    let content = |array: &&'static Array| {
        let mut bits = Vec::new();
        state.column(array).lanes(dims, &mut |x| bits.push(x.to_bits()));
        if **array == IMPULSE {
            let touching = state.neighbour.iter().map(|entry| *entry != NONE && entry & ACTIVE != 0);
            bits.chunks_mut(dims).zip(touching).filter(|(_, touching)| !touching).for_each(|(bits, _)| bits.fill(0));
        }
        if **array == CONTACT_COLOR {
            bits.iter_mut().skip(1).step_by(2).for_each(|rank| *rank = 0);
        }
        (array.name, bits)
    };
    kept.iter().map(content).collect()
}

thread_local!(
    /// How many looks it takes until a step is given up; 0: never.
    static LOOKS: Cell<u32> = const { Cell::new(0) }
);

fn interrupted() -> bool {
    let left = LOOKS.get();
    LOOKS.set(left.min(1).max(left.saturating_sub(1)));
    left == 1
}

#[test]
fn runs_go_on_from_checkpoints_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint.bin");
    for (name, scene, steps) in scenes() {
        for bench in engines() {
            // The first runs on the host alone; double precision on a device moves what the others have moved.
            let skipped = name.contains("gauss-seidel") || bench.name == GPU_DOUBLE.name && !name.contains("clumps");
            if bench.name != CPU.name && skipped {
                continue;
            }
            let mut whole = bench.start(&scene);
            let expected = samples(&mut whole, steps, 4);
            let expected_content = content(&mut whole);
            assert!(expected.last().unwrap().contacts > 10, "{name}: hardly any contacts");

            // In the middle between two samples, and of lists.
            let mut first = bench.start(&scene);
            let before = samples(&mut first, steps, 1);
            while first.step() < steps + steps / 2 {
                first.advance_chunk(2 * steps - first.step()).unwrap();
            }
            first.save(&path, &"whatever").unwrap();
            let at = first.step();
            drop(first);

            let mut checkpoint = Checkpoint::open(&path).unwrap();
            assert_eq!((checkpoint.about().step, checkpoint.about().run.as_str()), (at, Some("whatever")));
            let options = Options { interrupted, ..Options::default() };
            let mut second = Simulation::resume(scene.clone(), options, &mut checkpoint).unwrap();
            assert_eq!(second.step(), at);
            if second.solver_statistics().is_some() {
                // A step of contact dynamics that is given up in the middle has never been begun.
                LOOKS.set(2);
                assert_eq!((second.advance_chunk(1).unwrap(), second.step()), (0, at), "{name} on {}", bench.name);
                LOOKS.set(0);
            }
            let rest = 2 * steps - at;
            let mut after = if rest > 0 { samples(&mut second, rest, 1) } else { vec![second.sample().unwrap()] };
            after.extend(samples(&mut second, steps, 2));
            let bytes = fs::metadata(&path).unwrap().len() / scene.grains.len() as u64;
            println!("{name} on {}: {bytes} bytes per grain, {} samples", bench.name, before.len() + after.len());
            let found = [before, after].concat();
            assert_eq!(found, expected, "{name} on {}", bench.name);
            for ((array, found), (_, expected)) in content(&mut second).iter().zip(&expected_content) {
                assert!(found == expected, "{name} on {}: {array} differs", bench.name);
            }
            assert_eq!(second.solver_statistics(), whole.solver_statistics(), "{name} on {}", bench.name);
            assert_eq!(second.replayed_chunks(), whole.replayed_chunks(), "{name} on {}", bench.name);

            // The host sees in the file what the engine has.
            second.save(&path, &"whatever").unwrap();
            let mut view = Simulation::view(scene.clone(), &mut Checkpoint::open(&path).unwrap()).unwrap();
            assert_eq!((view.engine().name(), view.step(), view.time()), ("cpu", second.step(), second.time()));
            same_to_the_eye(&mut view, &mut second, &format!("{name} on {}", bench.name));
        }
    }
}

/// Positions to the bit, and velocities and what contacts remember to the rounding of single precision.
fn same_to_the_eye(a: &mut Simulation, b: &mut Simulation, what: &str) {
    let vectors = |simulation: &mut Simulation| {
        let forces = simulation.contacts().unwrap();
        let (grains, clumps) = (simulation.grains().unwrap(), simulation.clumps().unwrap());
        let contacts = simulation.contact_history().unwrap();
        let positions: Vec<_> = grains.iter().map(|g| g.position).chain(clumps.iter().map(|c| c.position)).collect();
        let walls = simulation.walls().unwrap();
        let others: Vec<_> = contacts.iter().map(|contact| (contact.grain, contact.other)).collect();
        let numbers = [
            grains.iter().map(|g| g.velocity).chain(clumps.iter().map(|c| c.velocity)).collect::<Vec<_>>(),
            grains.iter().map(|g| g.spin).chain(clumps.iter().map(|c| c.spin)).collect(),
            contacts.iter().map(|contact| contact.tangential_force).collect(),
            contacts.iter().map(|contact| contact.rolling_torque).collect(),
            contacts.iter().map(|contact| contact.mean_force).collect(),
            forces.iter().map(|contact| contact.force).collect(),
        ];
        (positions, walls, others, numbers)
    };
    let (seen, own) = (vectors(a), vectors(b));
    assert!(seen.0 == own.0, "{what}: positions");
    assert_eq!((seen.1, seen.2), (own.1, own.2), "{what}: walls and contacts");
    for (k, (seen, own)) in seen.3.iter().zip(&own.3).enumerate() {
        let largest = own.iter().map(|x| x.length()).fold(0.0, f64::max);
        let apart = seen.iter().zip(own).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
        assert!(apart <= 1e-5 * largest, "{what}: vectors {k} are {apart:e} apart of {largest:e}");
    }
}

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

/// A scene, and how it is run. The last one has all that there is of motion: walls, periods, clumps.
const RUNS: [(&str, &[&str]); 4] = [
    (
        "hard/size_ratio.toml",
        &["--engine=cpu", "--steps=6000", "--set=output.snapshots=5e-4", "--set=output.works=true"],
    ),
    ("hard/size_ratio.toml", &["--engine=gpu", "--steps=1500", "--set=output.snapshots=2e-4"]),
    (
        "hard/rigid_settling_2d.toml",
        &[
            "--engine=cpu",
            "--steps=60",
            "--set=solver.relaxation=coloured-accelerated",
            "--set=solver.max_iterations=50",
        ],
    ),
    ("hard/dimer_bed.toml", &["--engine=gpu", "--steps=1500", "--set=output.formats=[\"csv\", \"bin\"]"]),
];

/// Killed again and again, at moments that nobody has chosen, a run leaves what it leaves when nobody disturbs it.
#[test]
fn kills_leave_no_trace() {
    let allowed = std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|v| v == "1");
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
    for (k, (scene, how)) in RUNS.into_iter().enumerate() {
        if allowed && how[0] == "--engine=gpu" {
            continue;
        }
        let scene = Path::new("examples/scenes").join(scene).canonicalize().unwrap();
        let (whole, cut) = (format!("whole_{k}"), format!("cut_{k}"));
        let run = [&["run", scene.to_str().unwrap()], how].concat();
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
    assert!(kills >= if allowed { 8 } else { 16 }, "only {kills} runs were killed before they ended");
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

/// The rows of a history without the column that is never the same.
fn without_speeds(history: &[u8]) -> Vec<Vec<String>> {
    let rows = std::str::from_utf8(history).unwrap().lines().map(|line| line.split(',').map(str::to_owned).collect());
    let mut rows: Vec<Vec<String>> = rows.collect();
    let speed = rows[0].iter().position(|column| column == "particle_steps_per_second").unwrap();
    rows.iter_mut().for_each(|row| drop(row.remove(speed)));
    rows
}

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
[[wall]]
kind = "plane"
name = "lid"
material = "glass"
point = [0, 0.1]
normal = [0, -1]
velocity = [0, -0.1]
[[population]]
material = "glass"
count = 100
radius = { uniform = [0.8e-3, 1.2e-3] }
[solver]
damping = 20
[stop]
time = 0.2
"#;

#[test]
fn damaged_checkpoints_are_refused_and_the_one_before_is_taken() {
    let place = Place::new(SETTLE);
    place.errors(&["run", "scene.toml", "--engine=cpu", "--steps=500", "--out=done"], 0);
    // A complete run has no other.
    assert!(!place.path("done/checkpoint.previous.bin").exists());
    let checkpoint = place.path("done/checkpoint.bin");
    let good = fs::read(&checkpoint).unwrap();
    let altered = |good: &[u8], at: usize| {
        let mut altered = good.to_owned();
        altered[at] ^= 1;
        altered
    };
    let middle = good.len() / 2;
    for (bad, why) in [(&good[..middle], "is cut off"), (&altered(&good, middle), "is damaged"), (b"", "is cut off")] {
        fs::write(&checkpoint, bad).unwrap();
        let said = place.errors(&["run", "--resume=done", "--steps=600"], 2);
        assert!(said.contains(why), "{said}");
    }
    fs::write(&checkpoint, &good).unwrap();
    let said = place.errors(&["run", "--resume=done"], 2);
    assert!(said.contains("is at step 500"), "{said}");
    let said = place.errors(&["run", "--resume=nowhere"], 2);
    assert!(said.contains("nowhere: there is no such folder"), "{said}");

    // With the one before it the run goes on.
    let long = ["run", "scene.toml", "--engine=cpu", "--steps=40000", "--set=output.checkpoint=1e-3"];
    place.errors(&[&long[..], &["--out=whole"]].concat(), 0);
    let mut command = place.command(&[&long[..], &["--out=cut"]].concat());
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !place.path("cut/partial/checkpoint.previous.bin").exists() {
        assert!(child.try_wait().unwrap().is_none(), "the run has ended too soon");
        sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let checkpoint = place.path("cut/partial/checkpoint.bin");
    let latest = fs::read(&checkpoint).unwrap_or(good);
    fs::write(&checkpoint, altered(&latest, latest.len() / 2)).unwrap();
    let said = place.errors(&["run", "--resume=cut"], 0);
    assert!(said.contains("this is the checkpoint before it"), "{said}");
    let grains = |folder: &str| fs::read(place.path(folder).join("final.csv")).unwrap();
    assert!(grains("cut") == grains("whole"));
}

/// A run that was changed in between is no longer the same.
#[test]
fn checkpoints_of_another_scene_are_refused() {
    let place = Place::new(SETTLE);
    place.errors(&["run", "scene.toml", "--engine=cpu", "--steps=500", "--out=out"], 0);
    let scene = place.path("out/scene.toml");
    let text = fs::read_to_string(&scene).unwrap();
    fs::write(&scene, text.replace("friction = 0.5", "friction = 0.4")).unwrap();
    let said = place.errors(&["run", "--resume=out", "--steps=600"], 2);
    assert!(said.contains("is of another scene, or the scene beside it"), "{said}");
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
    for engine in ["cpu", "gpu"] {
        if engine == "gpu" && std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|v| v == "1") {
            continue;
        }
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
    if std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|v| v == "1") {
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

/// What the run before has left is told as that, also of a run that was interrupted.
#[test]
fn inherited_doubts_are_told_as_such() {
    let soft = SETTLE.replace("normal_stiffness = 1e5", "normal_stiffness = 8000");
    let place = Place::new(&soft);
    place.packstone(&["run", "scene.toml", "--engine=cpu", "--out=first"], 0);
    assert!(place.summary("first")["doubts"][0].as_str().unwrap().contains("an overlap was"));
    // The lid goes up again, so that nothing is pressed deeper.
    place.write("next.toml", &soft.replace("[0, -0.1]", "[0, 0.5]"));
    let run = ["run", "next.toml", "--engine=cpu", "--steps=100", "--from=first", "--out=next"];
    let said = place.errors(&run, 0);
    let summary = place.summary("next");
    assert!(summary["deepest_overlap"]["over_radius"].as_f64().unwrap() > 0.1, "{}", summary["deepest_overlap"]);
    assert_eq!(summary["deepest_overlap"]["step"], 0);
    let inherited = |summary: &serde_json::Value| {
        let doubts = summary["doubts"].as_array().unwrap();
        assert_eq!(doubts.len(), 1, "{doubts:?}");
        doubts[0].as_str().unwrap().starts_with("the state that it began with had an overlap")
    };
    assert!(inherited(&summary) && said.contains("its scene.toml alone will begin without it"), "{said}");
    place.packstone(&["run", "--resume=next", "--steps=200"], 0);
    assert!(inherited(&place.summary("next")));
}

/// What makes a result doubtful is said, with the grain and the time.
#[test]
fn deep_overlaps_are_told_with_grain_and_time() {
    let place = Place::new(SETTLE);
    // Springs so soft that weight presses grains into each other.
    place.write("soft.toml", &SETTLE.replace("normal_stiffness = 1e5", "normal_stiffness = 5"));
    let said = place.errors(&["run", "soft.toml", "--engine=cpu", "--out=soft", "--strict"], 3);
    let summary = place.summary("soft");
    let deepest = &summary["deepest_overlap"];
    assert!(deepest["over_radius"].as_f64().unwrap() > 0.1 && deepest["grain"].is_u64(), "{deepest}");
    assert!(deepest["other_grain"].is_u64() != deepest["wall"].is_string(), "{deepest}");
    assert!(said.contains("warning: an overlap was"), "{said}");
    assert_eq!(summary["ended"], "last step");
}

/// Positions of single precision have more digits than anybody asks for, unless the scene is thousands of times as wide.
#[test]
fn coarse_positions_are_told() {
    let place = Place::new(SETTLE);
    let run = ["run", "scene.toml", "--engine=gpu", "--steps=10", "--out=out"];
    let near = place.errors(&run, 0);
    let quantum = place.summary("out")["position_quantum"].as_f64().unwrap();
    assert!(quantum < 1e-13 && !near.contains("warning:"), "{quantum}: {near}");
    let far = place.errors(&[&run[..], &["--set=wall.0.lower=[-2000, 0]"]].concat(), 0);
    assert!(far.contains("warning: so far from the origin positions"), "{far}");
}

/// An impact between two rows of the history, of spheres on soft springs: the deepest overlap is v √(m / 2 k).
#[test]
fn overlaps_between_rows_are_told() {
    let (radius, density, stiffness, speed) = (0.01_f64, 2500.0, 1e4, 6.0);
    let scene = format!(
        "dimension = 3\ngravity = [0, 0, 0]\n[material.soft]\ndensity = {density}\nnormal_stiffness = {stiffness}\nrestitution = 1.0\n\
         [[grain]]\nradius = {radius}\nmaterial = \"soft\"\nposition = [-0.02, 0, 0]\nvelocity = [{half}, 0, 0]\n\
         [[grain]]\nradius = {radius}\nmaterial = \"soft\"\nposition = [0.02, 0, 0]\nvelocity = [-{half}, 0, 0]\n\
         [stop]\ntime = 0.02\n[output]\nhistory = 0.02\n",
        half = 0.5 * speed
    );
    let place = Place::new(&scene);
    let mass = density * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    let deepest = speed * (mass / (2.0 * stiffness)).sqrt() / radius;
    assert!((0.3..1.0).contains(&deepest), "{deepest}");
    for engine in ["--engine=cpu", "--engine=gpu"] {
        let said = place.errors(&["run", "scene.toml", engine, "--out=impact"], 0);
        let (summary, rows) = (place.summary("impact"), place.text("impact/history.csv"));
        assert_eq!((rows.lines().count(), summary["max_overlap_over_radius"].as_f64()), (3, Some(0.0)), "{rows}");
        let told = &summary["deepest_overlap"];
        let over_radius = told["over_radius"].as_f64().unwrap();
        assert!(over_radius <= deepest * 1.001 && deepest <= 1.25 * over_radius, "{over_radius} of {deepest}");
        let time = told["time"].as_f64().unwrap();
        assert!(0.02 / speed < time && time < 0.02 / speed + 0.01, "{told}");
        assert!([&told["grain"], &told["other_grain"]].iter().all(|id| id.as_u64().is_some_and(|id| id < 2)), "{told}");
        assert!(said.contains("warning: an overlap was"), "{said}");
    }
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
