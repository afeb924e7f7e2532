//! Checkpoints: all that later steps depend on is in them, and what is wrong with one is noticed.

use crate::{FEW_DIMERS, FEW_DISKS, SETTLE, common::*, example, place::Place, rigid_clumps};
use glam::DVec3;
use packstone::{
    measure::Sample,
    scene::{Assembly, Growth, Oscillation, Servo, Surface, Target},
    simulation::{Checkpoint, Options, Simulation},
    state::{
        ACTIVE, ARRAYS, Array, Lifetime, NONE,
        array::{CONTACT_COLOR, IMPULSE},
        present,
    },
};
use std::{cell::Cell, fs, process::Stdio, thread::sleep, time::Duration};

/// Scenes of every kind of memory, and the steps to a sample: lists are made anew in between, but not at every one.
fn scenes() -> Vec<(&'static str, Assembly, u64)> {
    let column = ["population.0.count=300"];
    let with = |solver: &[&'static str]| {
        let few = ["population.0.count=2", "population.1.count=498", "solver.max_iterations=20"];
        let narrow = ["wall.0.upper=[0.025, 0.025, 2]", "population.0.region.upper=[0.025, 0.025, 0.05]"];
        example("hard/rigid_settling_3d.toml", &[&few[..], &narrow[..], solver].concat())
    };
    let rigid = |solver| with(&[solver]);
    let springs =
        ["material.stone.normal_stiffness=2e4", "material.stone.restitution=0.5", "solver.compliance=stiffness"];
    let gauss_seidel = [&["solver.relaxation=gauss-seidel"][..], &FEW_DISKS].concat();
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
    let mut growing = periodic.clone();
    growing.growth = vec![Growth { rate: 20.0, ..Growth::default() }];
    let mut damped = sheared.clone();
    (damped.solver.adaptive_damping, damped.output.works, damped.cell.strain_rate[5]) = (true, false, 0.0);
    // One side comes in, with the other one at rest or swinging; a tube closes.
    let mut piston = example("heap_2d.toml", &[]);
    piston.grains.retain(|grain| grain.position.x - grain.radius > -0.2);
    piston.walls[0].surface = Surface::Plane { point: -0.2 * DVec3::X, normal: DVec3::X };
    piston.walls[0].servo =
        Some(Servo { target: Target::Force(1000.0), area: None, gain: 0.01, max_speed: 0.3, inertial_number: None });
    let mut swinging = piston.clone();
    let oscillation = Oscillation { amplitude: 1e-3 * DVec3::X, frequency: 50.0, interval: None };
    swinging.walls[1].motion.oscillation = Some(oscillation);
    let pressure = ["wall.0.target_pressure=2e3", "wall.0.area=1e-3", "wall.0.max_speed=0.3", "wall.0.gain=0.01"];
    let tube = example("tapping.toml", &[&["population.0.count=300"], &pressure[..]].concat());
    let mut moving = example("heap_2d.toml", &[]);
    moving.walls[0].velocity.y = 0.05;
    let mut beads = example("elastic_beads.toml", &column);
    beads.grains.iter_mut().for_each(|grain| grain.velocity.z = -2.0);
    vec![
        ("disks on a moving floor", moving, 1000),
        ("works in a periodic box", periodic, 150),
        ("grains that grow", growing, 150),
        ("a cell that shears", sheared, 150),
        ("a cell with a servo", driven, 150),
        ("adaptive damping", damped, 150),
        ("a piston with a servo", piston, 1000),
        ("the same beside a wall that swings", swinging, 1000),
        ("a tube with a servo", tube, 1000),
        ("elastic spheres that roll", beads, 150),
        ("spheres of two sizes", example("hard/size_ratio.toml", &[]), 150),
        ("clumps", example("hard/dimer_bed.toml", &FEW_DIMERS), 150),
        ("jacobi", rigid("solver.relaxation=jacobi-accelerated"), 7),
        ("colours", rigid("solver.relaxation=coloured-accelerated"), 7),
        ("springs in contact dynamics", with(&springs), 7),
        ("disks by gauss-seidel", example("hard/rigid_settling_2d.toml", &gauss_seidel), 4),
        ("clumps by jacobi", rigid_clumps("jacobi-accelerated"), 7),
        ("clumps by colours", rigid_clumps("coloured-accelerated"), 7),
    ]
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
/// atomics give contacts of a colour their ranks in any order, but the same ones.
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
            let mut colors: Vec<[u64; 2]> = bits.chunks(2).map(|color| [color[0], color[1]]).collect();
            colors.sort_unstable();
            bits.iter_mut().skip(1).step_by(2).zip(colors).for_each(|(rank, color)| *rank = color[1]);
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
