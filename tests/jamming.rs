//! Rest that ends, and the fraction at which packings jam.

mod common;
#[path = "common/place.rs"]
mod place;

use common::*;
use packstone::{
    measure::Sample,
    scene::{Assembly, Scene},
    simulation::{Options, Simulation},
};
use place::Place;
use std::{fs, path::Path, process::Stdio, thread::sleep, time::Duration};

/// Frictionless disks 1:1.4 in a periodic square, at a packing fraction, about the places of a square lattice.
fn disks(side: usize, fraction: f64) -> Assembly {
    let spacing = (std::f64::consts::PI * 0.37e-6 / fraction).sqrt();
    let edge = spacing * side as f64;
    // Halton's numbers, which are spread like random ones.
    let halton = |mut k: usize, base: usize| {
        let (mut sum, mut digit) = (0.0, 1.0);
        while k > 0 {
            digit /= base as f64;
            sum += digit * (k % base) as f64;
            k /= base;
        }
        sum
    };
    let grain = |k: usize| {
        let at = |place: usize, base: usize| spacing * (place as f64 + 0.4 * halton(k + 1, base));
        let (x, y, radius) = (at(k % side, 3), at(k / side, 5), [5e-4, 7e-4][k.count_ones() as usize % 2]);
        format!("[[grain]]\nmaterial = \"disk\"\nposition = [{x:e}, {y:e}]\nradius = {radius}\n")
    };
    let text = format!(
        "dimension = 2\ngravity = [0, 0]\n[domain]\nlower = [0, 0]\nupper = [{edge}, {edge}]\nboundary = \"periodic\"\n\
         [material.disk]\ndensity = 1000\nnormal_stiffness = 1e4\n\
         [solver]\ndamping = \"adaptive\"\nallow_overlap = true\nmargin = 1\ndt_fraction = 0.35\n[stop]\nequilibrium = 1e-10\n{}",
        (0..side * side).map(grain).collect::<String>()
    );
    Scene::parse(&text, "disks", Path::new("."), &[]).unwrap().assemble().unwrap()
}

/// Steps until forces balance to this part of contact forces, looked at every hundred steps, and the state then.
fn steps_to_rest(simulation: &mut Simulation, residual: f64, most: u64) -> (u64, Sample) {
    loop {
        simulation.advance(100).unwrap();
        let sample = simulation.sample().unwrap();
        if sample.at_rest(residual) || sample.step >= most {
            return (sample.step, sample);
        }
    }
}

/// Adaptive damping brings a packing to rest in hardly more steps than the best of the global dampings, and in far fewer than
/// one that is ten times too strong or too weak.
#[test]
fn adaptive_damping_needs_no_number() {
    const MOST: u64 = 30_000;
    let scene = disks(14, 0.8515);
    let frequency = (1e4 / (1000.0 * std::f64::consts::PI * 0.25e-6)).sqrt();
    for bench in engines().into_iter().filter(|bench| bench.name != GPU_DOUBLE.name) {
        let residual = if bench.name == CPU.name { 1e-10 } else { 1e-5 };
        let mut simulation = bench.start(&scene);
        let (steps, rest) = steps_to_rest(&mut simulation, residual, MOST);
        println!("{}: {steps} steps to {:.1e}", bench.name, rest.unbalanced_force_ratio);
        assert!(steps < MOST, "{}: {rest:?}", bench.name);
        assert!(rest.coordination_number > 3.8 && rest.max_overlap_over_radius < 0.1, "{rest:?}");
        if bench.name != CPU.name {
            continue;
        }
        // The same bits, however steps are put together.
        let mut again = Simulation::new(scene.clone(), Options { longest_chunk: 7, ..bench.options() }).unwrap();
        assert_eq!(steps_to_rest(&mut again, residual, MOST).1, rest);
        for damping in [0.3, 0.03, 0.003] {
            let mut damped = scene.clone();
            (damped.solver.adaptive_damping, damped.solver.damping) = (false, damping * frequency);
            damped.solver.dt = packstone::scene::TimeStep::Fixed(simulation.dt());
            let (of_number, _) = steps_to_rest(&mut Simulation::new(damped, bench.options()).unwrap(), residual, MOST);
            println!("damping {damping}: {of_number} steps");
            let best = damping == 0.03;
            let fewer = if best { 2 * of_number > steps } else { of_number > 2 * steps };
            assert!(fewer, "{of_number} steps with {damping}, {steps} with adaptive damping");
        }
    }
}

const GAS: &str = r#"
dimension = 2
gravity = [0, 0]
[domain]
lower = [0, 0]
upper = [0.02, 0.02]
boundary = "periodic"
[material.disk]
density = 1000
normal_stiffness = 1e4
[[population]]
material = "disk"
count = 60
radius = { list = [5e-4, 7e-4] }
placement = "random"
velocity_spread = 0.1
[stop]
equilibrium = 1e-4
"#;

#[test]
fn grains_that_touch_nothing_come_to_rest() {
    for damping in ["\"adaptive\"", "100"] {
        let place = Place::new(GAS);
        place.run(&[&format!("--set=solver.damping={damping}")], 0);
        let summary = place.summary("out/scene");
        assert_eq!(summary["ended"], "at rest, unjammed", "{damping}");
        assert_eq!((&summary["converged"], &summary["doubts"]), (&true.into(), &serde_json::json!([])));
        assert!(summary["max_overlap_over_radius"].as_f64().unwrap() <= 1e-7);
    }
    // Without damping they fly on for ever, and that is told.
    let place = Place::new(GAS);
    place.run(&["--steps=3000", "--strict"], 3);
    let summary = place.summary("out/scene");
    assert_eq!((&summary["ended"], &summary["converged"]), (&"last step".into(), &false.into()));
    assert!(summary["missed"].as_str().unwrap().contains("was not reached"), "{summary}");
    // What falls is not at rest before it has begun to.
    let place = Place::new(GAS);
    place.run(&["--steps=50", "--set=gravity=[0, -9.81]", "--set=population.0.velocity_spread=0"], 0);
    assert_eq!(place.summary("out/scene")["ended"], "last step");
}

/// The shipped scenes, smaller.
const DISKS: &str = include_str!("../examples/scenes/jamming_2d.toml");
const SPHERES: &str = include_str!("../examples/scenes/jamming_3d.toml");
const OF_DISKS: [&str; 2] = ["--set=population.0.count=200", "--set=domain.upper=[0.0226, 0.0226]"];
const OF_SPHERES: [&str; 2] = ["--set=population.0.count=100", "--set=domain.upper=[6e-3, 6e-3, 6e-3]"];
const FILES: [&str; 2] = ["--set=output.formats=[\"csv\"]", "--set=output.checkpoint=0.05"];

/// Packing fraction at which packings of so many disks 1:1.4 or equal spheres jam that were quenched from random places,
/// and the standard deviation of single ones (O'Hern, Silbert, Liu & Nagel 2003).
fn published(dimension: i32, count: i32) -> (f64, f64) {
    let (many, exponent) = if dimension == 2 { (0.842, -0.70) } else { (0.639, -0.47) };
    let count = f64::from(count);
    // Full width at half maximum.
    (many - 0.12 * count.powf(exponent), 0.16 * count.powf(-0.55) / 2.355)
}

/// The jamming fraction that a run has found, if it is what is published for one packing.
fn found(place: &Place, dimension: i32, count: i32) -> f64 {
    let summary = place.summary("out/scene");
    let (value, error) = (&summary["jamming_fraction"], &summary["jamming_fraction_error"]);
    let (value, error) = (value.as_f64().unwrap(), error.as_f64().unwrap());
    let (mean, sigma) = published(dimension, count);
    println!("{value} ± {error}; published {mean} ± {sigma} for a packing");
    assert!((value - mean).abs() < 3.0 * sigma, "{value} ± {error}, published {mean} ± {sigma}");
    assert_eq!(summary["ended"], "jamming fraction found");
    value
}

/// The columns of jamming.csv.
fn states(text: &str) -> Vec<packstone::protocol::jamming::RelaxedState> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(|row| row.unwrap()).collect()
}

#[test]
fn disks_jam_where_they_should() {
    let place = Place::new(DISKS);
    place.run(&[&OF_DISKS[..], &FILES].concat(), 0);
    let value = found(&place, 2, 200);
    let summary = place.summary("out/scene");
    assert!(summary["jamming_fraction_error"].as_f64().unwrap() < 2e-4, "{summary}");
    let table = place.text("out/scene/jamming.csv");
    let states = states(&table);
    let last = states.last().unwrap();
    println!("{table}");
    assert!(states.iter().all(|state| state.converged), "{table}");
    assert!(last.jammed && (last.packing_fraction - value).abs() < 1.5e-4, "{last:?}");
    // Isostatic, but for what it is still compressed.
    assert!((last.coordination_without_rattlers.unwrap() - 4.0).abs() < 0.1, "{last:?}");
    assert_eq!(summary["coordination_without_rattlers"], last.coordination_without_rattlers.unwrap());

    // Killed in the middle, it goes on to the same states.
    let killed = Place::new(DISKS);
    let run = [&["run", "scene.toml", "--engine=cpu"], &OF_DISKS[..], &FILES].concat();
    let mut child = killed.command(&run).stderr(Stdio::null()).spawn().unwrap();
    let partial = killed.path("out/scene/partial");
    while fs::read_to_string(partial.join("jamming.csv")).unwrap_or_default().lines().count() < states.len() / 2
        || !partial.join("checkpoint.bin").exists()
    {
        assert!(child.try_wait().unwrap().is_none(), "has ended");
        sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    killed.packstone(&["run", "--resume", "out/scene"], 0);
    for file in ["jamming.csv", "final.csv"] {
        assert_eq!(killed.text(&format!("out/scene/{file}")), place.text(&format!("out/scene/{file}")), "{file}");
    }
}

/// Disks that have grown beyond jamming, from a dilute gas, jam where those do that were compressed.
#[test]
fn grown_disks_jam_where_they_should() {
    let grow =
        "[[stage]]\nname = \"grow\"\nstop.packing_fraction = 0.86\n[[stage.growth]]\ninitial = 0.6\nrate = 0.5\n";
    let place =
        Place::new(&DISKS.replace("\n[jamming]", &format!("\n{grow}[[stage]]\nname = \"jam\"\n[stage.jamming]")));
    place.run(&OF_DISKS, 0);
    found(&place, 2, 200);
}

#[test]
fn spheres_jam_where_they_should() {
    let place = Place::new(SPHERES);
    place.run(&[&OF_SPHERES[..], &FILES, &["--set=jamming.step=0.02", "--set=jamming.tolerance=1e-3"]].concat(), 0);
    let value = found(&place, 3, 100);
    let states = states(&place.text("out/scene/jamming.csv"));
    let last = states.last().unwrap();
    println!("{last:?}");
    assert!(last.converged && last.jammed && (last.packing_fraction - value).abs() < 1.5e-3, "{last:?}");
    assert!((last.coordination_without_rattlers.unwrap() - 6.0).abs() < 0.5, "{last:?}");
}

/// In single precision too, here of few disks and in large steps.
#[test]
fn a_device_finds_a_jamming_fraction() {
    let place = Place::new(DISKS);
    let few = ["--set=population.0.count=40", "--set=domain.upper=[0.009, 0.009]", "--set=jamming.step=0.04"];
    let run = ["run", "scene.toml", "--engine=gpu", "--set=jamming.tolerance=4e-3"];
    place.packstone(&[&run[..], &few, &FILES].concat(), 0);
    found(&place, 2, 40);
    assert!(states(&place.text("out/scene/jamming.csv")).iter().all(|state| state.converged));
}

#[test]
fn what_cannot_jam_is_refused() {
    for (set, message) in [
        ("domain.boundary=open", "jamming: all axes must be periodic"),
        ("gravity=[0, -9.81]", "jamming: gravity must be 0"),
        ("solver.damping=0", "jamming: grains must come to rest"),
        ("solver.damping=fire", "solver.damping = \"fire\": must be \"adaptive\""),
        ("jamming.tolerance=0.1", "jamming.tolerance = 0.1: must be below jamming.step"),
        ("jamming.step=0", "jamming.step = 0"),
        ("cell.strain_rate.xx=-1", "[cell] must not be given"),
        ("stop.equilibrium=1e-4", "of [stop] only time and steps"),
        ("output.works=true", "solver.damping = \"adaptive\": takes away what output.works"),
    ] {
        let place = Place::new(DISKS);
        let errors = place.errors(&["run", "scene.toml", &format!("--set={set}"), OF_DISKS[0]], 2);
        assert!(errors.contains(message), "{set}: {errors}");
    }
}
