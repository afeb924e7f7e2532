//! Devices that offer less than the one at hand, and devices that are lost.

use packstone::{
    Error,
    engine::{ALL, Cpu, Engine, Gpu},
    gpu::{Arrays, Device, DeviceOptions, Placement, Restrictions, adapters},
    neighbours::SCAN_LISTS,
    plan::Op,
    scene::{Assembly, Scene},
    simulation::{EngineChoice, Options, Setup, Simulation},
    state::{ARRAYS, Array, array::LIST_START, present},
};
use std::{collections::HashMap, path::Path};

/// None: there is no adapter, and none is expected.
fn open(restrictions: Restrictions) -> Option<Device> {
    match Device::open(DeviceOptions { restrictions, ..DeviceOptions::default() }) {
        Ok(device) => Some(device),
        Err(_) if std::env::var_os("PACKSTONE_ALLOW_NO_GPU").is_some() => None,
        Err(error) => panic!("no adapter; see PACKSTONE_ALLOW_NO_GPU in test.sh: {error}"),
    }
}

fn example(name: &str, set: &[&str]) -> Assembly {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    Scene::load(&Path::new("examples/scenes").join(name), &set).unwrap().assemble().unwrap()
}

/// At once, in the middle of the set-up, and in the middle of a run.
#[test]
fn a_lost_device_is_an_error() {
    for lost_after in [0, 3, 40] {
        let restrictions = Restrictions { lost_after: Some(lost_after), ..Restrictions::default() };
        if open(restrictions).is_none() {
            return;
        }
        let options = Options { engine: EngineChoice::Gpu, restrictions, ..Options::default() };
        let ran = Simulation::new(example("two_grains.toml", &[]), options)
            .and_then(|mut simulation| simulation.advance(10_000));
        let Err(Error::Device(why)) = ran else { panic!("after {lost_after} submissions: {ran:?}") };
        assert!(why.ends_with("the device is lost"), "after {lost_after} submissions: {why}");
    }
}

/// wgpu itself holds kernels to what is left.
#[test]
fn restrictions_hold_for_the_device() {
    let restrictions = Restrictions {
        binding_bytes: Some(1 << 20),
        storage_buffers: Some(8),
        no_timestamps: true,
        no_subgroups: true,
        lost_after: None,
    };
    let Some(device) = open(restrictions) else { return };
    let limits = device.device.limits();
    assert_eq!((limits.max_storage_buffer_binding_size, limits.max_storage_buffers_per_shader_stage), (1 << 20, 8));
    assert!(!device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY));
    let summary = &device.summary;
    assert_eq!((summary.max_array_bytes, summary.max_arrays, summary.timestamps), (1 << 20, 8, false));
    // They are never asked for, but told of.
    assert!(summary.subgroup.is_none());
    assert!(adapters()[0].subgroup.is_some(), "no subgroups to take away");
}

/// Whether an array lies in the memory of another one, or another one in its.
fn shares(gpu: &Gpu, array: &Array) -> bool {
    let mut aliases = gpu.aliases().iter();
    aliases.any(|(alias, rooms)| *alias == array || rooms.iter().any(|room| room.host == array))
}

/// Everything there is after some steps, array by array, without those that share memory and need not hold anything then;
/// and how many arrays lie like this.
fn after(
    scene: &Assembly,
    steps: u64,
    options: Options,
    placed: fn(&Gpu, &Array) -> bool,
) -> (HashMap<&'static str, Vec<u64>>, usize) {
    let options = Options { engine: EngineChoice::Gpu, ..options };
    let mut simulation = Simulation::new(scene.clone(), options).unwrap();
    simulation.advance(steps).unwrap();
    assert!(simulation.sample().unwrap().contacts > 10);
    let arrays = present(simulation.model(), ARRAYS);
    let gpu = simulation.engine().gpu().unwrap();
    let count = arrays.iter().filter(|array| placed(gpu, array)).count();
    // What is not ordered until a later stage may differ from run to run.
    let is_ordered = |array: &&&'static Array| array.name != "cell_rank" && !array.name.contains("color");
    let held: Vec<_> = arrays.iter().filter(|array| !shares(gpu, array)).filter(is_ordered).copied().collect();
    let dims = simulation.model().dims();
    let state = simulation.read(&held).unwrap();
    let content = |array: &&'static Array| {
        let mut bits = Vec::new();
        state.column(array).lanes(dims, &mut |x| bits.push(x.to_bits()));
        (array.name, bits)
    };
    (held.iter().map(content).collect(), count)
}

/// Scenes, steps, and the bytes of a buffer that are so few that arrays lie in parts.
fn scenes() -> Vec<(&'static str, Assembly, u64, u64)> {
    let rigid = |solver| {
        let few = ["population.0.count=2", "population.1.count=498", "solver.max_iterations=20", solver];
        let narrow = ["wall.0.upper=[0.025, 0.025, 2]", "population.0.region.upper=[0.025, 0.025, 0.05]"];
        example("hard/rigid_settling_3d.toml", &[&few[..], &narrow[..]].concat())
    };
    vec![
        ("bed of spheres", example("published_bed.toml", &[]), 5, 1 << 20),
        ("spheres of two sizes", example("hard/size_ratio.toml", &[]), 300, 1 << 13),
        ("jacobi", rigid("solver.relaxation=jacobi-accelerated"), 12, 1 << 16),
        ("colours", rigid("solver.relaxation=coloured-accelerated"), 12, 1 << 16),
        ("clumps", example("hard/dimer_bed.toml", &[]), 300, 1 << 16),
    ]
}

/// An array that is longer than a kernel may see of a buffer lies in several; one of a kernel that may see few buffers,
/// with others in one; one whose content does not matter for a while, in the memory of another one. No bit of a result
/// knows of it, nor of lists that have to grow.
#[test]
fn where_arrays_lie_leaves_no_trace() {
    if open(Restrictions::default()).is_none() {
        return;
    }
    let mut grown = 0;
    for (name, scene, steps, binding_bytes) in scenes() {
        let restrictions = Restrictions { binding_bytes: Some(binding_bytes), ..Restrictions::default() };
        let in_parts = |gpu: &Gpu, array: &Array| matches!(gpu.placement(array), Placement::Parts(_));
        let is_packed = |gpu: &Gpu, array: &Array| gpu.placement(array) == Placement::Packed;
        let few = Restrictions { storage_buffers: Some(8), ..Restrictions::default() };
        let buffers = Options { arrays: Arrays::Buffers, ..Options::default() };
        let packed = Options { arrays: Arrays::Packed, restrictions: few, ..buffers };
        // Packed arrays lie in no memory of others.
        let (expected, count) = after(&scene, steps, packed, is_packed);
        assert!(count > 10, "{name}: {count} arrays");
        for (how, options, placed) in [
            ("shared", buffers, shares as fn(&Gpu, &Array) -> bool),
            ("shared that grow", Options { entries: Some(100), ..buffers }, shares),
            ("parts", Options { restrictions, ..buffers }, in_parts),
            ("parts that grow", Options { restrictions, entries: Some(100), ..buffers }, in_parts),
            ("packed that grow", Options { entries: Some(100), ..packed }, is_packed),
        ] {
            let (found, count) = after(&scene, steps, options, placed);
            println!("{name}, {how}: {count} arrays");
            // Lists that grow end shorter than a first guess.
            if how == "parts that grow" {
                grown += count;
            } else {
                assert!(count > 0, "{name}, {how}: {count} arrays");
            }
            let other = found.iter().find(|(array, content)| expected.get(*array).is_some_and(|of| of != *content));
            assert!(other.is_none(), "{name}, {how}: {:?}", other.map(|(array, _)| array));
        }
    }
    assert!(grown > 2, "{grown} arrays in parts have grown");
}

#[test]
fn too_few_buffers_are_an_error_that_says_what_to_do() {
    let restrictions = Restrictions { storage_buffers: Some(8), ..Restrictions::default() };
    if open(restrictions).is_none() {
        return;
    }
    let options = Options { engine: EngineChoice::Gpu, arrays: Arrays::Buffers, restrictions, ..Options::default() };
    let error = Simulation::new(example("two_grains.toml", &[]), options).err().expect("8 are too few").to_string();
    assert!(error.contains("allows 8; use --arrays packed"), "{error}");
}

/// Counts of so many entries that no number of 32 bits can tell them all.
#[test]
fn prefix_sums_do_not_wrap() {
    let Some(device) = open(Restrictions::default()) else { return };
    let scene = example("published_bed.toml", &[]);
    let Setup { mut state, plans, .. } = Setup::new(&scene, &Options::default()).unwrap();
    state.list_start = (0..state.sizes.slices() as u32 + 1).map(|k| 200_000 + k).collect();
    let mut sum = 0u64;
    let mut before = |count: &u32| {
        let here = sum.min(u64::from(u32::MAX)) as u32;
        sum += u64::from(*count);
        here
    };
    let expected: Vec<u32> = state.list_start.iter().map(&mut before).collect();
    assert_eq!(expected.last(), Some(&u32::MAX));
    let engines: [Box<dyn Engine>; 2] =
        [Box::new(Gpu::new(device, &plans, &state).unwrap()), Box::new(Cpu::new(state.clone()).unwrap())];
    for mut engine in engines {
        engine.execute(&state.params, &SCAN_LISTS.each_ref().map(Op::Run)).unwrap();
        let mut found = state.clone();
        engine.read(&[&LIST_START], ALL, &mut found).unwrap();
        assert!(found.list_start == expected, "{}", engine.name());
    }
}

/// What was encoded ahead is what comes, and where something else comes, it leaves no trace.
#[test]
fn chunks_are_encoded_ahead() {
    if open(Restrictions::default()).is_none() {
        return;
    }
    let options = Options { engine: EngineChoice::Gpu, ..Options::default() };
    let mut straight = Simulation::new(example("two_grains.toml", &[]), options).unwrap();
    straight.advance(2000).unwrap();
    let ahead = straight.engine().gpu().unwrap().ahead();
    assert!(2 * ahead.used > ahead.operations && ahead.used > 1000, "{ahead:?}");
    let mut looked_at = Simulation::new(example("two_grains.toml", &[]), options).unwrap();
    while looked_at.step() < 2000 {
        looked_at.advance(37.min(2000 - looked_at.step())).unwrap();
        looked_at.sample().unwrap();
    }
    let bits = |simulation: &mut Simulation| {
        let grains = simulation.grains().unwrap();
        grains
            .iter()
            .flat_map(|g| [g.position, g.velocity, g.spin])
            .map(|x| x.to_array().map(f64::to_bits))
            .collect::<Vec<_>>()
    };
    assert_eq!(bits(&mut straight), bits(&mut looked_at));
}
