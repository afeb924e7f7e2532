//! Where a benchmark ran, and with what.

use super::{copy, trial::Backend};
use crate::{
    gpu::{AdapterSummary, DeviceOptions, adapters},
    io::cpu_name,
};
use serde::Serialize;

/// The machine and the program.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    pub cpu: String,
    /// Threads that can run at once.
    pub cores: usize,
    pub system: String,
    /// The adapter that the gpu engine takes; None: there is none, and only the cpu engine is measured.
    pub adapter: Option<AdapterSummary>,
    /// The one it takes in double precision, if any can.
    pub double_adapter: Option<String>,
    /// Bytes that a copy reads and writes per second on all threads; None: not measured, here and below.
    pub cpu_copy_bandwidth: Option<f64>,
    /// The same on the adapter.
    pub gpu_copy_bandwidth: Option<f64>,
    pub version: &'static str,
    /// Commit of the sources when they were compiled, `+` if they were changed since; `unknown` outside a git checkout.
    pub commit: &'static str,
}

impl Machine {
    pub fn here() -> Machine {
        let adapters = adapters();
        Machine {
            cpu: cpu_name(),
            cores: std::thread::available_parallelism().map_or(1, |n| n.get()),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            double_adapter: adapters.iter().find(|a| a.double).map(|a| a.name.clone()),
            adapter: adapters.into_iter().next(),
            cpu_copy_bandwidth: None,
            gpu_copy_bandwidth: None,
            version: env!("CARGO_PKG_VERSION"),
            commit: env!("PACKSTONE_COMMIT"),
        }
    }

    /// Find out how fast memory is copied; takes some seconds.
    pub fn measure_copies(&mut self) {
        self.cpu_copy_bandwidth = copy::of_host().ok();
        let of_device = self.adapter.as_ref().and_then(|_| copy::of_device(DeviceOptions::default()).ok());
        self.gpu_copy_bandwidth = of_device.map(|[own, by_kernel]| own.max(by_kernel));
    }

    /// Bytes that a copy reads and writes per second on the engine's memory.
    pub fn copy_bandwidth(&self, backend: Backend) -> Option<f64> {
        if backend == Backend::Cpu { self.cpu_copy_bandwidth } else { self.gpu_copy_bandwidth }
    }

    /// What can be run here.
    pub fn backends(&self) -> Vec<Backend> {
        let present = |backend: &Backend| match backend {
            Backend::Cpu => true,
            Backend::GpuSingle => self.adapter.is_some(),
            Backend::GpuDouble => self.double_adapter.is_some(),
        };
        Backend::ALL.into_iter().filter(present).collect()
    }
}
