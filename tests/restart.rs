//! A run that goes on from a checkpoint is the run that was never interrupted, to the bit.

mod common;

use common::*;
use packstone::{
    measure::Sample,
    scene::{Assembly, Scene},
    simulation::{Checkpoint, Options, Simulation},
    state::{ACTIVE, ARRAYS, Array, Lifetime, NONE, array::IMPULSE, present},
};
use std::{
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
    let mut moving = example("heap_2d.toml", &[]);
    moving.walls[0].velocity.y = 0.05;
    let mut beads = example("elastic_beads.toml", &column);
    beads.grains.iter_mut().for_each(|grain| grain.velocity.z = -2.0);
    vec![
        ("disks on a moving floor", moving, 1000),
        ("works in a periodic box", periodic, 150),
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

/// All that later steps depend on, array by array. Impulses of pairs that do not touch are left over, and never read.
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
        (array.name, bits)
    };
    kept.iter().map(content).collect()
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
            let mut second = Simulation::resume(scene.clone(), Options::default(), &mut checkpoint).unwrap();
            assert_eq!(second.step(), at);
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
        }
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
        let (mut with, kept) = Simulation::with_history(after.clone(), bench.options(), &contacts).unwrap();
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
        for entry in fs::read_dir(folder.path().join(&whole)).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let of = |folder_of: &str| {
                let content = fs::read(folder.path().join(folder_of).join(&name));
                content.unwrap_or_else(|e| panic!("{folder_of}/{name}: {e}"))
            };
            match &*name {
                // Times, the command line, and when there were checkpoints.
                "run.json" | "scene.toml" | "checkpoint.bin" | ".packstone" => {}
                "history.csv" => assert_eq!(without_speeds(&of(&whole)), without_speeds(&of(&cut)), "{cut}"),
                "summary.json" => {
                    let summary = |folder: &str| {
                        let mut summary: serde_json::Value = serde_json::from_slice(&of(folder)).unwrap();
                        let keys = summary.as_object_mut().unwrap();
                        ["wall_seconds", "particle_steps_per_second"]
                            .iter()
                            .for_each(|key| assert!(keys.remove(*key).is_some()));
                        summary
                    };
                    assert_eq!(summary(&whole), summary(&cut), "{cut}");
                }
                _ => assert!(of(&whole) == of(&cut), "{cut}/{name}"),
            }
        }
    }
    println!("{kills} kills");
    assert!(kills >= if allowed { 8 } else { 16 }, "only {kills} runs were killed before they ended");
}

/// The rows of a history without the last column.
fn without_speeds(history: &[u8]) -> Vec<String> {
    let lines = std::str::from_utf8(history).unwrap().lines();
    lines.map(|line| line.rsplit_once(',').unwrap().0.to_owned()).collect()
}
