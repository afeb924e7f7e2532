//! Grains that come in over time and leave through outlets.

use packstone::{
    model::Precision,
    prelude::*,
    scene::builder::{InsertionBuilder, OutletBuilder},
    simulation::Checkpoint,
};
use std::{f64::consts::PI, fs, process::Command};

const R: f64 = 1e-3;
const DT: f64 = 2e-5;

fn glass() -> MaterialBuilder {
    MaterialBuilder::new(2500.0).normal_stiffness(1e3).friction(0.5).restitution(0.5)
}

/// A bin of 16 radii, open above.
fn bin() -> SceneBuilder {
    let walls = WallBuilder::box_between("glass", [0.0; 3], [0.016, 0.016, 0.1]);
    let solver = SolverBuilder::discrete_elements().dt(DT);
    Scene::builder(3).material("glass", glass()).wall(walls).solver(solver).stop_time(1.0)
}

fn rain(count: usize, insertion: InsertionBuilder) -> PopulationBuilder {
    rain_from(0.03, count, insertion)
}

/// From a region up to this height.
fn rain_from(top: f64, count: usize, insertion: InsertionBuilder) -> PopulationBuilder {
    PopulationBuilder::new("glass", count, Radii::uniform(0.8 * R, R))
        .region([0.0, 0.0, 0.02], [0.016, 0.016, top])
        .velocity([0.0, 0.0, -0.5])
        .insertion(insertion)
}

fn on(engine: EngineChoice, precision: Precision) -> Options {
    Options { engine, precision, ..Options::default() }
}

fn cpu() -> Options {
    on(EngineChoice::Cpu, Precision::Double)
}

/// The engines that there are here; only without a GPU may one be missing.
fn engines() -> Vec<Options> {
    let gpu = on(EngineChoice::Gpu, Precision::Single);
    match Simulation::new(bin().grain(GrainBuilder::new("glass", [8e-3; 3], R)).assemble().unwrap(), gpu) {
        Ok(_) => vec![cpu(), gpu],
        Err(e) if std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|v| v == "1") => {
            println!("skipped the gpu, PACKSTONE_ALLOW_NO_GPU=1: {e}");
            vec![cpu()]
        }
        Err(e) => panic!("{e}"),
    }
}

fn mass(grains: &[Grain]) -> f64 {
    grains.iter().map(|g| 2500.0 * 4.0 / 3.0 * PI * g.radius.powi(3)).sum()
}

/// The deepest overlap of a grain from this one on with any other, m; < 0 where they are apart.
fn deepest(grains: &[Grain], from: usize) -> f64 {
    let pairs = (from..grains.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let overlap = |(i, j): (usize, usize)| {
        let (a, b) = (&grains[i], &grains[j]);
        a.radius + b.radius - (a.position - b.position).length()
    };
    pairs.map(overlap).fold(f64::NEG_INFINITY, f64::max)
}

/// Steps in which as many come in as a rate says, on both engines the same ones.
#[test]
fn grains_come_in_at_their_rate() {
    for insertion in [InsertionBuilder::rate(1000.0), InsertionBuilder::mass_rate(8e-3)] {
        let by_mass = format!("{insertion:?}").contains("mass_rate: Some");
        let scene = bin().population(rain(60, insertion.interval(100.0 * DT).stop(0.05))).assemble().unwrap();
        assert_eq!((scene.grains.len(), scene.whole().grains.len()), (0, 60));
        let mut first = Vec::new();
        for options in engines() {
            let mut simulation = Simulation::new(scene.clone(), options).unwrap();
            for step in (0..3000).step_by(100) {
                let grains = simulation.grains().unwrap();
                let (inlet, due) = (simulation.inlets()[0], (step as f64 * DT).min(0.05));
                assert_eq!((grains.len(), inlet.full), (inlet.inserted, 0), "step {step}");
                assert!((mass(&grains) - inlet.mass).abs() < 1e-12 * mass(&grains).max(1e-30));
                match by_mass {
                    true => assert!((due * 8e-3 - inlet.mass) / (2500.0 * 4.2 * R.powi(3)) < 1.0, "step {step}"),
                    false => assert_eq!(inlet.inserted, ((1000.0 * due + 1e-6) as usize).min(60), "step {step}"),
                }
                if step == 100 {
                    first.push(grains.iter().map(|grain| (grain.radius, grain.position)).collect::<Vec<_>>());
                }
                simulation.advance(100).unwrap();
            }
            assert!(!simulation.expects_grains() && simulation.held_up().is_empty());
            assert_eq!(simulation.lost_contacts(), 0);
        }
        assert!(!first[0].is_empty());
        for pair in first.windows(2) {
            for (a, b) in pair[0].iter().zip(&pair[1]) {
                assert!((a.0 - b.0).abs() < 1e-9 * R && (a.1 - b.1).length() < 1e-9 * R);
            }
        }
    }
}

/// Grains and clumps come in beside all others, walls and each other, and where that is not possible they wait.
#[test]
fn nothing_comes_in_onto_another() {
    let fast = || InsertionBuilder::rate(1e5).interval(50.0 * DT);
    for clumps in [false, true] {
        let population = rain_from(0.0235, 150, fast());
        let population = if clumps { population.shape("dimer") } else { population };
        // Clumps are stable in shorter steps.
        let dt = if clumps { 0.5 * DT } else { DT };
        let solver = SolverBuilder::discrete_elements().dt(dt);
        let scene = bin().population(population).solver(solver).assemble().unwrap();
        let mut simulation = Simulation::new(scene, cpu()).unwrap();
        let mut there = 0;
        let mut waited = 0;
        for _ in 0..60 {
            simulation.advance((50.0 * DT / dt) as u64).unwrap();
            let grains = simulation.grains().unwrap();
            // Members of one clump may overlap.
            let from = if clumps { grains.len() } else { there };
            assert!(deepest(&grains, from) < 0.0);
            for grain in &grains[there..] {
                let (x, r) = (grain.position, grain.radius * (1.0 - 1e-9));
                assert!(x.min_element() >= r && x.x.max(x.y) <= 0.016 - r && (0.02 + r..=0.0235 - r).contains(&x.z));
            }
            if clumps {
                for (i, j) in (there..grains.len()).flat_map(|i| (0..i).map(move |j| (i, j))) {
                    let (a, b) = (&grains[i], &grains[j]);
                    let apart = (a.position - b.position).length() >= a.radius + b.radius;
                    assert!(apart || i / 2 == j / 2, "{i} and {j}");
                }
            }
            there = grains.len();
            waited += usize::from(!simulation.held_up().is_empty());
        }
        let inlet = simulation.inlets()[0];
        assert!(inlet.full > 5 && waited > 5, "{inlet:?}");
        assert_eq!(inlet.inserted, 150, "{inlet:?}");
        assert!(simulation.held_up().is_empty());
    }
}

/// Without a way out the region stays full, and the run says so.
#[test]
fn a_full_region_is_told() {
    let still = PopulationBuilder::new("glass", 500, R)
        .region([0.0; 3], [0.01; 3])
        .insertion(InsertionBuilder::rate(1e6).interval(10.0 * DT));
    let scene = bin().gravity([0.0; 3]).population(still).assemble().unwrap();
    let mut simulation = Simulation::new(scene, cpu()).unwrap();
    simulation.advance(200).unwrap();
    let inlet = simulation.inlets()[0];
    assert!((20..100).contains(&inlet.inserted) && inlet.full > 10, "{inlet:?}");
    let told = simulation.held_up();
    assert!(told.len() == 1 && told[0].starts_with("population.0: ") && told[0].contains("was full"), "{told:?}");
}

/// A stack that slides, a grain that rolls, and others that an outlet takes: the former keep every bit.
#[test]
fn others_keep_every_bit() {
    let scene = |outlet: bool| {
        let at = |x: f64, z: f64, v: [f64; 3]| GrainBuilder::new("glass", [x, 8e-3, z], R).velocity(v);
        let grains = [
            at(2e-3, 1e-3, [0.3, 0.0, 0.0]),
            at(13e-3, 1e-3, [0.0; 3]),
            at(2.2e-3, 3e-3, [0.25, 0.05, 0.0]),
            at(13.1e-3, 3e-3, [0.0; 3]),
            at(13e-3, 20e-3, [0.0; 3]),
        ];
        let scene = bin().grains(grains);
        let taken = OutletBuilder::inside([12e-3, 0.0, 0.0], [16e-3, 16e-3, 4e-3]).interval(150.0 * DT);
        if outlet { scene.outlet(taken.stop(200.0 * DT)) } else { scene }.assemble().unwrap()
    };
    for options in engines() {
        let [mut with, mut without] = [true, false].map(|outlet| Simulation::new(scene(outlet), options).unwrap());
        for _ in 0..20 {
            with.advance(25).unwrap();
            without.advance(25).unwrap();
            let all = without.grains().unwrap();
            let numbers = &with.assembly().numbers.grains.clone();
            let there = with.grains().unwrap();
            for (grain, number) in there.iter().zip(numbers) {
                let other = &all[*number as usize];
                if *number != 4 {
                    assert_eq!(
                        (grain.position, grain.velocity, grain.spin),
                        (other.position, other.velocity, other.spin)
                    );
                }
            }
        }
        assert_eq!(with.assembly().numbers.grains, [0, 2, 4]);
        assert_eq!((with.outlets()[0].removed, with.particles()), (2, 3));
        assert_eq!(with.lost_contacts(), 0);
    }
}

/// What comes in and what leaves: mass, energy and momentum.
#[test]
fn what_comes_and_goes_balances() {
    let fall = bin()
        .population(rain(150, InsertionBuilder::rate(3000.0).interval(100.0 * DT)))
        .outlet(OutletBuilder::inside([0.0; 3], [8e-3, 16e-3, 3e-3]).interval(100.0 * DT).start(0.02))
        .output_works(true)
        .solver(SolverBuilder::discrete_elements().dt(DT / 8.0))
        .assemble()
        .unwrap();
    let mut simulation = Simulation::new(fall, cpu()).unwrap();
    simulation.advance(32_000).unwrap();
    let sample = simulation.sample().unwrap();
    let of = sample.openings.unwrap();
    let there = mass(&simulation.grains().unwrap());
    assert_eq!(of.inserted - of.removed, of.particles);
    assert!(of.inserted == 150 && of.removed > 20, "{of:?}");
    assert!((of.inserted_mass - of.removed_mass - there).abs() < 1e-12 * of.inserted_mass);
    let energy = sample.kinetic_energy + sample.potential_energy + sample.elastic_energy;
    let walls = sample.work_walls.unwrap() + sample.work_fixed.unwrap();
    let left = energy + sample.dissipated.unwrap() - walls - of.inserted_energy + of.removed_energy;
    println!("{left:e} of {:e} J are missing, {:e} J have left", of.inserted_energy, of.removed_energy);
    // What the time step of an impact of 90 steps leaves.
    assert!(left.abs() < 1e-3 * of.inserted_energy, "{left:e} of {:e}", of.inserted_energy);
}

/// A run that goes on from a checkpoint has the bits of one that was never interrupted: spheres and clumps, both methods,
/// both engines, walls that move.
#[test]
fn resumed_pouring_has_the_same_bits() {
    let scene = |clumps: bool, rigid: bool| {
        let population = rain(80, InsertionBuilder::rate(4000.0).interval(90.0 * DT));
        let population = if clumps { population.shape("dimer") } else { population };
        let solver = match rigid {
            true => SolverBuilder::contact_dynamics().dt(10.0 * DT),
            false => SolverBuilder::discrete_elements().dt(if clumps { 0.5 * DT } else { DT }),
        };
        let floor = WallBuilder::plane("glass", [0.0, 0.0, 1e-3], [0.0, 0.0, 1.0]).velocity([0.0, 0.0, 1e-2]);
        let outlet = OutletBuilder::inside([0.0; 3], [4e-3, 16e-3, 8e-3]).interval(120.0 * DT);
        bin().population(population).solver(solver).wall(floor).outlet(outlet).assemble().unwrap()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint.bin");
    for options in engines() {
        for (clumps, rigid) in [(false, false), (true, false), (false, true)] {
            let scene = scene(clumps, rigid);
            let steps = if rigid { 75 } else { 660 * (1 + u64::from(clumps)) };
            let mut straight = Simulation::new(scene.clone(), options).unwrap();
            let mut broken = Simulation::new(scene.clone(), options).unwrap();
            for _ in 0..4 {
                straight.advance(steps).unwrap();
                broken.advance(steps).unwrap();
                broken.save(&path, &()).unwrap();
                drop(broken);
                broken = Simulation::resume(scene.clone(), options, &mut Checkpoint::open(&path).unwrap()).unwrap();
            }
            let what = format!("clumps {clumps}, rigid {rigid}, {:?}", options.engine);
            assert!(straight.outlets()[0].removed > 3 && straight.particles() > 10, "{what}: {:?}", straight.outlets());
            assert_eq!(straight.grains().unwrap(), broken.grains().unwrap(), "{what}");
            assert_eq!(straight.clumps().unwrap(), broken.clumps().unwrap(), "{what}");
            assert_eq!(straight.assembly().numbers, broken.assembly().numbers, "{what}");
            assert_eq!(straight.contact_history().unwrap(), broken.contact_history().unwrap(), "{what}");
            assert_eq!((straight.inlets(), straight.outlets()), (broken.inlets(), broken.outlets()), "{what}");
            assert_eq!(straight.lost_contacts(), 0, "{what}");
        }
    }
}

/// An engine's state does not depend on how far chunks of steps reach.
#[test]
fn chunks_change_no_bit() {
    let scene = bin()
        .population(rain(80, InsertionBuilder::rate(4000.0)))
        .outlet(OutletBuilder::behind([6e-3, 0.0, 0.0], [1.0, 0.0, 0.0]).interval(120.0 * DT))
        .assemble()
        .unwrap();
    for options in engines() {
        let run = |longest_chunk: u32| {
            let mut simulation = Simulation::new(scene.clone(), Options { longest_chunk, ..options }).unwrap();
            simulation.advance(1500).unwrap();
            (simulation.grains().unwrap(), simulation.assembly().numbers.clone())
        };
        let (a, b) = (run(200), run(7));
        assert!(a.1.grains.len() > 10 && a == b);
    }
}

const FILE: &str = r#"
dimension = 3
[material.glass]
density = 2500
normal_stiffness = 1e3
[domain]
lower = [0, 0, -0.01]
upper = [0.02, 0.02, 0.05]
boundary = ["periodic", "periodic", "outlet"]
[[population]]
material = "glass"
count = 20
radius = 1e-3
velocity = [0, 0, -1]
region = { lower = [0, 0, 0.02], upper = [0.02, 0.02, 0.03] }
insertion = { rate = 2000 }
[solver]
dt = 2e-5
[stop]
time = 1
[output]
history = 0.005
"#;

/// The whole program: nothing at the start, nothing at the end, and all that is in between in rows and summary.
#[test]
fn a_run_begins_and_ends_empty() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, FILE).unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_packstone"));
        let output = command.current_dir(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    run(&["run", "scene.toml", "--engine", "cpu", "--out", "whole"]);
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("whole/summary.json")).unwrap()).unwrap();
    assert_eq!(summary["ended"], "no grain left");
    assert_eq!(summary["particles"], 0);
    assert_eq!(summary["insertions"][0]["inserted"], 20);
    assert_eq!(summary["outlets"][0]["name"], "domain");
    assert_eq!(summary["outlets"][0]["removed"], 20);
    let mass = 20.0 * 2500.0 * 4.0 / 3.0 * PI * 1e-9;
    assert!((summary["outlets"][0]["mass"].as_f64().unwrap() - mass).abs() < 1e-12 * mass);
    // What flows out in the rows is all there was.
    let rows = csv_of(&fs::read_to_string(folder.path().join("whole/history.csv")).unwrap());
    let flow: f64 = rows.iter().map(|row| row("outlets.domain.flow_rate")).sum::<f64>();
    let time = rows[1]("time") - rows[0]("time");
    assert!((flow * time - mass).abs() < 0.02 * mass, "{} of {mass}", flow * time);
    let last = rows.last().unwrap();
    assert_eq!([last("inserted"), last("removed"), last("particles")], [20.0, 20.0, 0.0]);
    // Interrupted in between, and gone on with.
    run(&["run", "scene.toml", "--engine", "cpu", "--out", "parts", "--steps", "900"]);
    let ids = fs::read_to_string(folder.path().join("parts/final.csv")).unwrap();
    assert!(ids.lines().count() > 5);
    run(&["run", "--resume", "parts", "--steps", "50000"]);
    let without_speed = |name: &str| {
        let rows = csv_of(&fs::read_to_string(folder.path().join(name).join("history.csv")).unwrap());
        let keys = ["step", "kinetic_energy", "removed_energy", "outlets.domain.flow_rate"];
        rows.iter().map(|row| keys.map(row)).collect::<Vec<_>>()
    };
    // The first part ended with a row of its own.
    let parts: Vec<_> = without_speed("parts").into_iter().filter(|row| row[0] != 900.0).collect();
    let whole = without_speed("whole");
    assert_eq!(parts.len(), whole.len());
    for (a, b) in parts.iter().zip(&whole) {
        assert_eq!(a[..3], b[..3]);
    }
}

/// Grains keep their numbers in results, through checkpoints, and in the run of another scene.
#[test]
fn numbers_stay() {
    let folder = tempfile::tempdir().unwrap();
    let outlet = "[[outlet]]\nregion = { lower = [0, 0, 0], upper = [0.01, 0.02, 0.015] }\ninterval = 1e-3\n[solver]";
    let formats = "[output]\nformats = [\"csv\", \"xyz\", \"dump\", \"npz\", \"vtp\", \"bin\", \"contacts.csv\"]";
    let text = FILE.replace("[solver]", outlet).replace("[output]", formats);
    fs::write(folder.path().join("scene.toml"), text).unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_packstone"));
        let output = command.current_dir(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    run(&["run", "scene.toml", "--engine", "cpu", "--out", "old", "--steps", "900"]);
    let told = run(&["run", "scene.toml", "--from", "old", "--engine", "cpu", "--out", "new", "--steps", "1"]);
    assert!(told.contains("population.0 is there already as far as it has come in"), "{told}");
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let first = |text: String, behind: &str, separator: char| -> Vec<u32> {
        let rows = text.lines().skip_while(|line| !line.starts_with(behind)).skip(1);
        rows.map(|line| line.split(separator).next().unwrap().parse().unwrap()).collect()
    };
    let ids = first(read("old/final.csv"), "id", ',');
    assert!((5..18).contains(&ids.len()) && ids.iter().any(|id| *id > ids.len() as u32), "{ids:?}");
    assert_eq!(first(read("new/final.csv"), "id", ','), ids);
    assert_eq!(first(read("old/final.xyz"), "Lattice", ' '), ids);
    let from_one: Vec<u32> = ids.iter().map(|id| id + 1).collect();
    assert_eq!(first(read("old/final.dump"), "ITEM: ATOMS", ' '), from_one);
    // Grains in a file keep their numbers too.
    let file = folder.path().join("old/final.bin");
    let scene = Scene::builder(3)
        .material("glass", glass())
        .grain(GrainBuilder::new("glass", [0.0, 0.0, 1.0], R))
        .population(PopulationBuilder::from_file(file.to_str().unwrap()))
        .population(PopulationBuilder::new("glass", 2, R).region([0.0, 0.0, 2.0], [0.1, 0.1, 2.1]))
        .stop_time(1.0)
        .assemble()
        .unwrap();
    let last = 1 + ids.iter().max().unwrap();
    let expected: Vec<u32> = [0].into_iter().chain(from_one).chain([last + 1, last + 2]).collect();
    assert_eq!(scene.numbers.grains, expected);
}

/// Rows of a table, by the names of its columns.
fn csv_of(text: &str) -> Vec<impl Fn(&str) -> f64 + use<>> {
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = lines.next().unwrap();
    lines
        .map(|row| {
            let header = header.clone();
            move |name: &str| row[header.iter().position(|h| h == name).unwrap()].parse().unwrap_or(f64::NAN)
        })
        .collect()
}

#[test]
fn what_is_wrong_is_said() {
    let message = |from: &str, to: &str| {
        assert!(FILE.contains(from));
        let text = FILE.replace(from, to);
        let scene = Scene::parse(&text, "scene", std::path::Path::new(""), &[]);
        scene.and_then(|scene| scene.assemble()).unwrap_err().to_string()
    };
    let insertion = "insertion = { rate = 2000 }";
    let region = "region = { lower = [0, 0, 0.02], upper = [0.02, 0.02, 0.03] }";
    for (from, to, parts) in [
        ("rate = 2000", "rate = -1", ["population.0.insertion.rate", "-1"]),
        ("rate = 2000", "rate = 2000, mass_rate = 1", ["population.0.insertion", "one of `rate`"]),
        ("{ rate = 2000 }", "{}", ["population.0.insertion", "one of `rate`"]),
        ("rate = 2000", "rate = 2000, start = 2, stop = 1", ["insertion.stop", "after start"]),
        ("rate = 2000", "rate = 2000, interval = 0", ["insertion.interval", "positive"]),
        ("rate = 2000", "rate = 2000, mass = -2", ["insertion.mass", "positive"]),
        ("rate = 2000", "rates = 2000", ["rates", "unknown key"]),
        (
            region,
            "region = { lower = [0, 0, 0.06], upper = [0.02, 0.02, 0.07] }",
            ["population.0.region", "outside of"],
        ),
        (region, "region = { lower = [0, 0, 0.02], upper = [0.02, 0.02, 0.021] }", ["population.0.region", "0.002 m"]),
        (
            region,
            "region = { lower = [0, 0, 0.02], upper = [0.02, 0.02, 0.03], center = [0.01, 0.01] }",
            ["population.0.region", "`center` and `radius` together"],
        ),
        (
            region,
            "region = { lower = [0, 0, 0.02], upper = [0.02, 0.02, 0.03], center = [0.01, 0.01], radius = 5e-4 }",
            ["population.0.region.radius", "at least 0.001 m"],
        ),
        (insertion, "insertion = { rate = 1 }\nfixed = true", ["population.0.fixed", "`insertion`"]),
        (insertion, "insertion = { rate = 1 }\nplacement = \"random\"", ["population.0.placement", "`insertion`"]),
        ("[solver]", "[[outlet]]\npoint = [0, 0, 0]\n[solver]", ["outlet.0", "`normal`"]),
        ("[solver]", "[[outlet]]\npoint = [0, 0, 0]\nnormal = [0, 0, 0]\n[solver]", ["outlet.0.normal", "zero"]),
        (
            "[solver]",
            "[[outlet]]\nname = \"domain\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n[solver]",
            ["outlet", "domain"],
        ),
    ] {
        let message = message(from, to);
        assert!(parts.iter().all(|part| message.contains(part)) && message.starts_with("scene"), "{to}: {message}");
    }
}
