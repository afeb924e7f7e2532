//! Inputs that users of DEM codes reported as wrong, and once were here: `tests/data/reports/`. Each has its right value
//! on every engine. (Those about packings, lists and files have theirs in `wide_sizes`, `measure` and `cli` too.)

mod common;

use common::*;
use packstone::{
    measure::Sample,
    scene::{Assembly, Scene},
    simulation::Simulation,
};
use std::{path::PathBuf, process::Command};

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/reports/{name}.toml"))
}

fn assemble(name: &str) -> packstone::Result<Assembly> {
    Scene::load(&file(name), &[])?.assemble()
}

fn report(name: &str) -> Assembly {
    assemble(name).unwrap()
}

/// To this time, s.
fn until(simulation: &mut Simulation, time: f64) {
    let steps = (time / simulation.dt()).round() as u64;
    simulation.advance(steps).unwrap();
}

/// Gravity that adds less than half of a velocity's last place in a step.
#[test]
fn gravity_is_felt_by_what_is_fast() {
    for bench in engines() {
        let mut simulation = bench.start(&report("gravity-lost"));
        simulation.advance(1000).unwrap();
        let gained = simulation.grains().unwrap()[0].velocity.z + 4.2;
        close(bench.name, gained, -9.81 * simulation.time(), 9.81 * simulation.time(), 1e-4);
    }
}

/// A fast bead slows down by μ g t and spins up by 5 μ g t/2R.
#[test]
fn friction_slows_what_is_fast() {
    for bench in engines() {
        let mut simulation = bench.start(&report("fast-slide"));
        until(&mut simulation, 0.02);
        let (bead, slowed) = (simulation.grains().unwrap()[0], 0.1 * 9.81 * simulation.time());
        close(bench.name, 5.0 - bead.velocity.x, slowed, slowed, 1e-3);
        let spun = 2.5 * slowed / bead.radius;
        close(bench.name, bead.spin.y, spun, spun, 1e-3);
    }
}

/// Two grains squeezed between planes keep their contacts where all are carried along.
#[test]
fn what_is_squeezed_stays_so_on_the_way() {
    for bench in engines() {
        let mut simulation = bench.start(&report("carried-pair"));
        let squeezed = simulation.sample().unwrap();
        until(&mut simulation, 0.005);
        let now = simulation.sample().unwrap();
        assert_eq!((squeezed.contacts, now.contacts), (3, 3), "{}", bench.name);
        let (found, expected) = (now.max_overlap_over_radius, squeezed.max_overlap_over_radius);
        close(bench.name, found, expected, expected, 1e-3);
    }
}

/// A grain at rest in a drum 2,000 times as wide overlaps with it by m g/k_N.
#[test]
fn a_wide_drum_bears_a_grain() {
    for bench in engines() {
        let mut simulation = bench.start(&report("drum-wall"));
        simulation.advance(10_000).unwrap();
        let grain = simulation.grains().unwrap()[0];
        let expected = 2500.0 * std::f64::consts::PI * grain.radius.powi(3) / 0.75 * 9.81 / 1e4;
        let overlap = grain.position.truncate().length() + grain.radius - 2.0;
        close(bench.name, overlap, expected, expected, 1e-5);
    }
}

/// Friction of grains of ten nanometres on contacts of 1e-11 N/m.
#[test]
fn small_and_soft_grains_spin_up() {
    for bench in engines() {
        let mut simulation = bench.start(&report("f32-friction-nano"));
        simulation.advance(1500).unwrap();
        let spin = simulation.grains().unwrap()[0].spin.length();
        close(bench.name, spin, 16.00, 16.0, 1e-3);
    }
}

/// An attitude that is no number any more, or turns too fast to be followed, ends a run.
#[test]
fn a_clump_that_turns_too_fast_ends_the_run() {
    for bench in engines() {
        let ended = Simulation::new(report("clump-nan-silent"), bench.options()).and_then(|mut s| s.advance(1000));
        let why = ended.unwrap_err().to_string();
        assert!(why.contains("clump 0"), "{}: {why}", bench.name);
    }
}

/// A ball that falls on a floor so soft that its centre sinks below it is thrown back.
#[test]
fn a_ball_bounces_on_a_soft_floor() {
    for bench in engines() {
        let mut simulation = bench.start(&report("soft-fall"));
        let mut fastest = 0.0_f64;
        while simulation.time() < 1.0 {
            simulation.advance(5).unwrap();
            fastest = fastest.max(simulation.grains().unwrap()[0].velocity.z);
        }
        let expected = 0.5 * (2.0 * 9.81 * 0.5_f64).sqrt();
        close(bench.name, fastest, expected, expected, 0.1);
    }
}

/// A floor out of two walls in one plane would count twice.
#[test]
fn two_tiles_are_no_floor() {
    let why = assemble("two-tiles").unwrap_err().to_string();
    assert!(why.contains("left") && why.contains("right"), "{why}");
}

/// What is asked of a distribution is what comes out.
#[test]
fn sizes_are_what_was_asked() {
    let radii: Vec<f64> = report("log-normal").grains.iter().map(|g| g.radius * 1e6).collect();
    let mean = radii.iter().sum::<f64>() / radii.len() as f64;
    let variance = radii.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / radii.len() as f64;
    close("mean", mean, 5.0, 5.0, 0.02);
    close("standard deviation", variance.sqrt(), 5.0, 5.0, 0.1);
}

/// A column of 100 rests on its floor whatever rests beside it.
#[test]
fn a_column_is_carried_beside_many() {
    for bench in engines() {
        let mut simulation = bench.start(&report("lay1000"));
        simulation.advance(1).unwrap();
        let fallen: f64 = simulation.grains().unwrap()[..100].iter().map(|g| g.velocity.z).sum();
        close(bench.name, 1.0 + fallen / (100.0 * 9.81 * 1e-3), 1.0, 1.0, 1e-2);
    }
}

/// How long lists are, and so how often they are made anew, changes no bit of a sum.
#[test]
fn sums_do_not_depend_on_lists() {
    for bench in engines() {
        let samples = |margin: Option<f64>| -> Vec<Sample> {
            let mut scene = report("det");
            scene.solver.margin = margin.unwrap_or(scene.solver.margin);
            let mut simulation = bench.start(&scene);
            let sample = |_| {
                simulation.advance(100).unwrap();
                simulation.sample().unwrap()
            };
            (0..5).map(sample).collect()
        };
        assert_eq!(format!("{:?}", samples(None)), format!("{:?}", samples(Some(0.07))), "{}", bench.name);
    }
}

/// Two grains twenty times as large as the rest lose no contact.
#[test]
fn large_grains_among_small_ones() {
    let mut samples = Vec::new();
    for bench in engines() {
        let mut simulation = bench.start(&report("ratio-20"));
        simulation.advance(30).unwrap();
        assert_eq!(simulation.lost_contacts(), 0, "{}", bench.name);
        samples.push(simulation.sample().unwrap().contacts);
    }
    assert!(samples.iter().all(|contacts| *contacts == samples[0]), "{samples:?}");
}

/// What contact dynamics cannot solve, it says: walls that leave no room, and masses beyond what numbers hold.
#[test]
fn doubtful_results_are_told() {
    for name in ["piston-cd", "cd-unsolved-exit0"] {
        for engine in ["cpu", "gpu"] {
            let place = tempfile::tempdir().unwrap();
            let out = place.path().join("out");
            let output = Command::new(env!("CARGO_BIN_EXE_packstone"))
                .args(["run", file(name).to_str().unwrap(), "--strict", "--engine", engine, "--out"])
                .arg(&out)
                .output()
                .unwrap();
            let told = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(!output.status.success() && told.contains("steps were not solved"), "{name} {engine}: {told}");
        }
    }
}
