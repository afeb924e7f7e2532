//! Devices that offer less than the one at hand, and devices that are lost.

use packstone::{
    Error,
    gpu::{Device, DeviceOptions, Restrictions},
    scene::{Assembly, Scene},
    simulation::{EngineChoice, Options, Simulation},
};
use std::path::Path;

/// None: there is no adapter, and none is expected.
fn open(restrictions: Restrictions) -> Option<Device> {
    match Device::open(DeviceOptions { restrictions, ..DeviceOptions::default() }) {
        Ok(device) => Some(device),
        Err(_) if std::env::var_os("PACKSTONE_ALLOW_NO_GPU").is_some() => None,
        Err(error) => panic!("no adapter; see PACKSTONE_ALLOW_NO_GPU in test.sh: {error}"),
    }
}

fn two_grains() -> Assembly {
    Scene::load(Path::new("examples/scenes/two_grains.toml"), &[]).unwrap().assemble().unwrap()
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
        let ran = Simulation::new(two_grains(), options).and_then(|mut simulation| simulation.advance(10_000));
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
    let features = device.device.features();
    assert!(!features.contains(wgpu::Features::TIMESTAMP_QUERY) && !features.contains(wgpu::Features::SUBGROUP));
    let summary = &device.summary;
    assert_eq!((summary.max_array_bytes, summary.max_arrays, summary.timestamps), (1 << 20, 8, false));
    assert!(summary.subgroup.is_none());
}
