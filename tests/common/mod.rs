//! What the physics tests share: small assemblies and comparisons from the library, the engines that a test must have,
//! an oracle.
#![allow(dead_code, unused_imports)] // every test binary uses a part of it

pub mod oracle;

pub use packstone::bench::hard::{common::*, stiffness};

/// All engines: cpu (f64), gpu in f32, gpu in f64. A machine without an adapter fails the test, because a test that
/// silently checks nothing is worse than none; `PACKSTONE_ALLOW_NO_GPU=1` says that this is known and wanted.
pub fn engines() -> Vec<Bench> {
    let benches = packstone::bench::hard::common::engines();
    let allowed = std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|v| v == "1");
    for bench in [GPU_SINGLE, GPU_DOUBLE] {
        match (benches.iter().any(|present| present.name == bench.name), allowed) {
            (true, _) => {}
            (false, true) => println!("skipped: no adapter for {} (PACKSTONE_ALLOW_NO_GPU=1)", bench.name),
            (false, false) => panic!(
                "no adapter for {} among {:?}: install a driver (mesa-vulkan-drivers gives a software one), or set \
                 PACKSTONE_ALLOW_NO_GPU=1 to test the cpu engine alone",
                bench.name,
                packstone::gpu::adapters().iter().map(|a| &a.name).collect::<Vec<_>>()
            ),
        }
    }
    benches
}
