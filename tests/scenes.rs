//! Every example scene, at reduced size, on both engines: it runs, loses nothing, and the engines agree on what a
//! researcher would read off.

use packstone::{
    measure::{Sample, packing_fraction},
    model::Precision,
    scene::{Scene, TimeStep},
    simulation::{EngineChoice, Options, Simulation},
    time_step::bound,
};
use std::path::Path;

/// What the engines must agree on at the end.
#[derive(Clone, Copy, PartialEq)]
enum Read {
    /// Energies.
    Energy,
    /// Velocities and spins of every grain.
    Motion,
    /// A packing at rest, at this share of the stability bound: contacts, energies, packing fraction.
    Rest(f64),
}

/// Scene, overrides that make it small and let it settle, steps, the largest overlap over radius that its stiffness
/// allows, and what to read off.
const SCENES: &[(&str, &[&str], u64, f64, Read)] = &[
    ("two_grains", &[], 2000, 0.1, Read::Motion),
    ("sliding_sphere", &[], 3000, 0.01, Read::Energy),
    ("sliding_block", &[], 3000, 0.01, Read::Energy),
    (
        "heap_2d",
        // Softer, to settle in fewer steps.
        &["population.1.count=150", "solver.damping=50", "material.wood.normal_stiffness=2e5"],
        8000,
        0.05,
        Read::Rest(0.6),
    ),
    (
        "box_100k",
        &[
            "population.0.count=1000",
            "wall.0.upper=[0.02,0.02,1]",
            // Softer, to settle in fewer steps.
            "material.glass.normal_stiffness=200",
            "material.glass.normal_damping=2700",
            "solver.damping=40",
        ],
        8000,
        0.05,
        Read::Rest(0.9),
    ),
    (
        "elastic_beads",
        &[
            "population.0.count=150",
            "wall.0.upper=[0.008,0.008,1]",
            "material.glass.youngs_modulus=5e5",
            "solver.damping=40",
        ],
        14_000,
        0.1,
        Read::Rest(0.9),
    ),
    // Thrown onto the floor.
    ("clumps", &["population.0.count=40", "population.0.velocity=[0,0,-0.5]"], 3000, 0.1, Read::Energy),
    ("pebbles", &["population.0.count=4", "shape.0.spheres=5"], 200, 0.05, Read::Energy),
    ("silo_filling", &["population.0.count=150", "population.0.insertion.rate=20000"], 6000, 0.1, Read::Energy),
    ("outlet", &["population.4.count=500"], 6000, 0.1, Read::Energy),
    // The first stages of these, which pour.
    ("oedometer", &["population.0.count=200"], 2000, 0.1, Read::Energy),
    ("tapping", &["population.0.count=200"], 2000, 0.1, Read::Energy),
    ("triaxial", &["population.0.count=100", "domain.upper=[0.0104,0.0104,0.0104]"], 2000, 0.1, Read::Energy),
    ("simple_shear", &["population.0.count=100", "domain.upper=[0.0104,0.0104,0.0104]"], 2000, 0.1, Read::Energy),
    ("battery_electrode", &["population.0.count=300", "domain.upper=[74e-6,74e-6,74e-6]"], 2000, 0.1, Read::Energy),
    ("growth", &["population.0.count=150", "domain.upper=[0.0052,0.0052,0.0052]"], 6000, 0.1, Read::Energy),
    (
        "published_bed",
        &["population.0.count=1500", "material.M1.normal_stiffness=200", "solver.damping=40"],
        10_000,
        0.05,
        Read::Rest(0.9),
    ),
];

fn run(
    name: &str,
    set: &[&str],
    engine: EngineChoice,
    precision: Precision,
    steps: u64,
    share: Option<f64>,
) -> Option<(Sample, Simulation)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.toml"));
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
    let mut assembly = Scene::load(&path, &set).and_then(|s| s.assemble()).unwrap_or_else(|e| panic!("{e}"));
    if let Some(share) = share {
        assembly.solver.dt = TimeStep::Fixed(share * bound(&assembly));
    }
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
        if path.is_dir() {
            continue; // `hard` is for `tests/hard`
        }
        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
        // The grains of the first are not in the repository, see below; the others are those of `tests/jamming.rs`.
        if ["peer_bed", "jamming_2d", "jamming_3d"].contains(&&*stem) {
            continue;
        }
        assert!(SCENES.iter().any(|(name, ..)| *name == stem), "{stem} has no row in SCENES");
    }
}

/// The bed that other codes are timed on, with a table of two grains instead of its own: one rests on the floor, one on
/// it.
#[test]
fn peer_bed_takes_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("two.csv");
    let rows = "# periodic\nx,y,z,radius,vx,vy,vz,wx,wy,wz\n0.01,0.01,0.001,0.001,0,0,0,0,0,0\n0.01,0.01,0.003,0.001,0,0,0,0,0,0\n";
    std::fs::write(&table, rows).unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/peer_bed.toml");
    let assembly =
        Scene::load(&scene, &[format!("population.0.file={}", table.display())]).unwrap().assemble().unwrap();
    let options = Options { engine: EngineChoice::Cpu, ..Options::default() };
    let mut simulation = Simulation::new(assembly, options).unwrap();
    simulation.advance(3000).unwrap();
    let sample = simulation.sample().unwrap();
    assert_eq!(sample.contacts, 2);
    let weight = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-9 * 9.81;
    let expected = 2.0 * weight / 2000.0 / 1e-3;
    let found = sample.max_overlap_over_radius;
    assert!((found / expected - 1.0).abs() < 1e-3, "overlap {found:e}, expected {expected:e}");
}

/// Collects what differs, so that one run shows all of it.
#[derive(Default)]
struct Differences(Vec<String>);

impl Differences {
    fn check(&mut self, what: String, found: f64, expected: f64, scale: f64, tolerance: f64) {
        let error = (found - expected).abs() / scale;
        println!("{what}: {found:.6e}, cpu {expected:.6e}, error {error:.2e} of {tolerance:.1e}");
        // NaN must not pass.
        if !(error <= tolerance) {
            self.0.push(format!("{what}: {found:e}, cpu {expected:e}, error {error:.2e}, allowed {tolerance:e}"));
        }
    }
}

fn packing(simulation: &mut Simulation) -> Option<f64> {
    let (grains, walls) = (simulation.grains().unwrap(), simulation.walls().unwrap());
    packing_fraction(simulation.assembly(), &grains, &walls).map(|f| f.value)
}

#[test]
fn scenes_run_and_engines_agree() {
    let mut bad = Differences::default();
    for &(name, set, steps, overlap, read) in SCENES {
        let started = std::time::Instant::now();
        let share = if let Read::Rest(share) = read { Some(share) } else { None };
        let one = |engine, precision| run(name, set, engine, precision, steps, share);
        let (cpu, mut on_cpu) = one(EngineChoice::Cpu, Precision::Double).expect("the CPU is there");
        let own = |bad: &mut Differences, engine: &str, sample: &Sample, simulation: &Simulation| {
            assert_eq!(simulation.lost_contacts(), 0, "{name} {engine}");
            assert!(sample.max_overlap_over_radius < overlap, "{name} {engine}: {sample:?}");
            assert!(sample.kinetic_energy.is_finite() && sample.contacts < 10_000, "{name} {engine}: {sample:?}");
            if matches!(read, Read::Rest(_)) {
                bad.check(format!("{name}, {engine}, unbalanced"), sample.unbalanced_force_ratio, 0.0, 1.0, 0.05);
            }
        };
        own(&mut bad, "cpu", &cpu, &on_cpu);
        println!("{name}: cpu {:.1} s, {cpu:?}", started.elapsed().as_secs_f64());
        let Some((gpu, mut on_gpu)) = one(EngineChoice::Gpu, Precision::Single) else { continue };
        own(&mut bad, "gpu", &gpu, &on_gpu);
        println!("{name}: {:.1} s, {gpu:?}", started.elapsed().as_secs_f64());
        // Trajectories of many grains are chaotic; heights, and so the potential energy, hardly. (The 1,000 grains of
        // `box_100k` on the CPU with gravity changed by 1e-7 to 1e-5 of it: potential energies up to 1.7e-3 apart.)
        let scale = cpu.potential_energy.abs().max(cpu.kinetic_energy);
        bad.check(format!("{name}, potential energy"), gpu.potential_energy, cpu.potential_energy, scale, 5e-3);
        match read {
            Read::Energy => {}
            Read::Motion => {
                let (a, b) = (on_cpu.grains().unwrap(), on_gpu.grains().unwrap());
                for (k, (a, b)) in a.iter().zip(&b).enumerate() {
                    let (v, w) = ((a.velocity - b.velocity).length(), (a.spin - b.spin).length());
                    assert!(a.spin.length() > 1.0, "{name}: the collision turns the grains");
                    bad.check(format!("{name}, velocity of {k}"), v, 0.0, a.velocity.length(), 1e-3);
                    bad.check(format!("{name}, spin of {k}"), w, 0.0, a.spin.length(), 1e-3);
                }
            }
            Read::Rest(_) => {
                let mut relative = |what: &str, of: fn(&Sample) -> f64, tolerance: f64| {
                    bad.check(format!("{name}, {what}"), of(&gpu), of(&cpu), of(&cpu), tolerance);
                };
                relative("contacts", |s| s.contacts as f64, 0.03);
                relative("coordination number", |s| s.coordination_number, 0.03);
                // So few grains carry much of it that packings whose starts differ by rounding differ by 2 to 8 %.
                relative("elastic energy", |s| s.elastic_energy, 0.12);
                match (packing(&mut on_gpu), packing(&mut on_cpu)) {
                    (Some(a), Some(b)) => bad.check(format!("{name}, packing fraction"), a, b, 1.0, 0.01),
                    (a, b) => assert_eq!(a, b, "{name}: packing fraction"),
                }
            }
        }
    }
    assert!(bad.0.is_empty(), "{}", bad.0.join("\n"));
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
        let Some((_, mut simulation)) = run("sliding_sphere", &[], engine, precision, 1, None) else { continue };
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
            let Some((_, mut simulation)) = run("sliding_block", &[&friction], engine, precision, 1, None) else {
                continue;
            };
            simulation.advance((0.05 / simulation.dt()) as u64).unwrap();
            let v = simulation.grains().unwrap()[0].velocity.z;
            let expected = if factor > 1.0 { 0.0 } else { -9.81 * (1.0 - factor) / 5000.0 };
            let scale = 9.81 * 10.0 * near / 5000.0;
            assert!((v - expected).abs() < tolerance * scale, "{engine:?} at {factor}: {v:e}, not {expected:e}");
        }
    }
}
