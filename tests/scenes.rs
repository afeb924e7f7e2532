//! Every example scene, at reduced size, on both engines: it runs, loses nothing, and the engines agree on what a
//! researcher would read off.

use packstone::{
    measure::Sample,
    model::Precision,
    scene::Scene,
    simulation::{EngineChoice, Options, Simulation},
};
use std::path::Path;

/// Scene, overrides that make it small, steps, and the largest overlap over radius that its stiffness allows.
const SCENES: &[(&str, &[&str], u64, f64)] = &[
    ("two_grains", &[], 2000, 0.1),
    ("sliding_sphere", &[], 3000, 0.01),
    ("sliding_block", &[], 3000, 0.01),
    ("heap_2d", &["population.0.count=60", "population.1.count=150"], 3000, 0.05),
    ("box_100k", &["population.0.count=1000", "wall.0.upper=[0.02,0.02,1]"], 3000, 0.05),
    ("published_bed", &["population.0.count=1500"], 2000, 0.05),
];

fn run(
    name: &str,
    set: &[&str],
    engine: EngineChoice,
    precision: Precision,
    steps: u64,
) -> Option<(Sample, Simulation)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.toml"));
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
    let assembly = Scene::load(&path, &set).and_then(|s| s.assemble()).unwrap_or_else(|e| panic!("{e}"));
    let options = Options { engine, precision, ..Options::default() };
    let mut simulation = match Simulation::new(assembly, options) {
        Ok(simulation) => simulation,
        Err(e) if engine == EngineChoice::Gpu && std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|v| v == "1") => {
            println!("skipped, PACKSTONE_ALLOW_NO_GPU=1: {e}");
            return None;
        }
        Err(e) => panic!("{name}: {e}"),
    };
    simulation.advance(steps).unwrap_or_else(|e| panic!("{name}: {e}"));
    Some((simulation.sample().unwrap(), simulation))
}

#[test]
fn every_shipped_scene_is_tested() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
        assert!(SCENES.iter().any(|(name, ..)| *name == stem), "{stem} has no row in SCENES");
    }
}

#[test]
fn scenes_run_and_engines_agree() {
    for &(name, set, steps, overlap) in SCENES {
        let (cpu, simulation) = run(name, set, EngineChoice::Cpu, Precision::Double, steps).expect("the CPU is there");
        assert_eq!(simulation.lost_contacts(), 0, "{name}");
        assert!(cpu.max_overlap_over_radius < overlap, "{name}: overlap {}", cpu.max_overlap_over_radius);
        assert!(cpu.kinetic_energy.is_finite() && cpu.contacts < 10_000, "{name}: {cpu:?}");
        let Some((gpu, simulation)) = run(name, set, EngineChoice::Gpu, Precision::Single, steps) else { return };
        assert_eq!(simulation.lost_contacts(), 0, "{name}");
        // Trajectories of many grains are chaotic; heights, and so the potential energy, are not.
        let scale = cpu.potential_energy.abs().max(cpu.kinetic_energy);
        let difference = (gpu.potential_energy - cpu.potential_energy).abs();
        assert!(
            difference <= 2e-3 * scale,
            "{name}: potential energy {} or {}",
            cpu.potential_energy,
            gpu.potential_energy
        );
        assert!(gpu.max_overlap_over_radius < overlap, "{name}: overlap {}", gpu.max_overlap_over_radius);
    }
}

/// Speed along x, averaged over many swings of the undamped tangential spring.
fn mean_speed(simulation: &mut Simulation) -> f64 {
    let samples = 500;
    let mut sum = 0.0;
    for _ in 0..samples {
        simulation.advance(11).unwrap();
        sum += simulation.grains().unwrap()[0].velocity.x;
    }
    sum / f64::from(samples)
}

#[test]
fn a_sphere_that_slides_ends_up_rolling() {
    for (engine, precision) in [(EngineChoice::Cpu, Precision::Double), (EngineChoice::Gpu, Precision::Single)] {
        let Some((_, mut simulation)) = run("sliding_sphere", &[], engine, precision, 1) else { return };
        simulation.advance((0.12 / simulation.dt()) as u64).unwrap();
        let v = mean_speed(&mut simulation);
        assert!((v - 5.0 / 7.0).abs() < 1e-4, "{engine:?}: {v}");
    }
}

#[test]
fn a_squeezed_sphere_holds_above_the_threshold_and_slides_below() {
    // 2 mu k_N overlap = m g, see the scene.
    let mass = 2700.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-6;
    let threshold = mass * 9.81 / (2.0 * 1e5 * 1e-5);
    for (engine, precision, near, tolerance) in
        [(EngineChoice::Cpu, Precision::Double, 1e-3, 1e-9), (EngineChoice::Gpu, Precision::Single, 1e-2, 1e-2)]
    {
        for factor in [1.0 + near, 1.0 - 10.0 * near] {
            let friction = format!("material.stone.friction={}", factor * threshold);
            let Some((_, mut simulation)) = run("sliding_block", &[&friction], engine, precision, 1) else { return };
            simulation.advance((0.05 / simulation.dt()) as u64).unwrap();
            let v = simulation.grains().unwrap()[0].velocity.z;
            let expected = if factor > 1.0 { 0.0 } else { -9.81 * (1.0 - factor) / 5000.0 };
            let scale = 9.81 * 10.0 * near / 5000.0;
            assert!((v - expected).abs() < tolerance * scale, "{engine:?} at {factor}: {v:e}, not {expected:e}");
        }
    }
}
