//! Adapters and devices.

use crate::error::{Error, Result};
use std::sync::{Arc, Mutex};
use wgpu::{DeviceType, Features, Limits};

/// What is worth knowing of an adapter before choosing it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct AdapterSummary {
    pub name: String,
    pub kind: String,
    pub backend: String,
    pub driver: String,
    /// f64 in shaders: `--precision double`.
    pub double: bool,
    /// Per-stage timings.
    pub timestamps: bool,
    /// Smallest and largest subgroup, if the device has subgroup operations.
    pub subgroup: Option<(u32, u32)>,
    /// Largest array a kernel can see, bytes.
    pub max_array_bytes: u64,
    /// Arrays a kernel can see.
    pub max_arrays: u32,
}

/// An open device.
pub struct Device {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub summary: AdapterSummary,
    /// Runs on the host's processor and memory.
    pub software: bool,
    /// The first error nobody was waiting for.
    failure: Arc<Mutex<Option<String>>>,
}

fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::PRIMARY,
        // Where the driver tells its budget, refuse what exceeds it instead of swapping or losing the device.
        memory_budget_thresholds: wgpu::MemoryBudgetThresholds {
            for_resource_creation: Some(95),
            for_device_loss: None,
        },
        ..wgpu::InstanceDescriptor::new_without_display_handle_from_env()
    })
}

/// All adapters, best first: discrete, integrated, virtual, software.
fn candidates() -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::PRIMARY));
    adapters.sort_by_key(|a| match a.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    });
    adapters
}

fn summary(adapter: &wgpu::Adapter) -> AdapterSummary {
    let info = adapter.get_info();
    let features = adapter.features();
    let limits = adapter.limits();
    AdapterSummary {
        name: info.name,
        kind: format!("{:?}", info.device_type),
        backend: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        double: features.contains(Features::SHADER_F64),
        timestamps: features.contains(Features::TIMESTAMP_QUERY),
        subgroup: features.contains(Features::SUBGROUP).then_some((info.subgroup_min_size, info.subgroup_max_size)),
        max_array_bytes: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
        max_arrays: limits.max_storage_buffers_per_shader_stage,
    }
}

/// All adapters of this machine, best first.
pub fn adapters() -> Vec<AdapterSummary> {
    candidates().iter().map(summary).collect()
}

impl Device {
    /// Open the best adapter that can do what is asked.
    ///
    /// # Errors
    /// [`Error::Device`] if there is none, or it cannot be opened.
    pub fn open(double: bool) -> Result<Device> {
        let all = candidates();
        if all.is_empty() {
            return Err(Error::Device(
                "no GPU adapter found: install a Vulkan, Metal or DX12 driver (on Debian or Ubuntu, mesa-vulkan-drivers \
                 gives a software one), or use --engine cpu"
                    .to_owned(),
            ));
        }
        let wanted = Features::SHADER_F64;
        let names: Vec<String> = all.iter().map(|a| a.get_info().name).collect();
        let adapter = all.into_iter().find(|a| !double || a.features().contains(wanted)).ok_or_else(|| {
            Error::Device(format!(
                "--precision double needs the feature SHADER_F64, which no adapter has ({}); use --precision single or \
                 --engine cpu",
                names.join(", ")
            ))
        })?;
        let summary = summary(&adapter);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("packstone"),
            required_features: (if double { wanted } else { Features::empty() })
                | (adapter.features() & Features::TIMESTAMP_QUERY),
            required_limits: Limits { ..adapter.limits() },
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| Error::Device(format!("{} cannot be opened: {e}", summary.name)))?;
        let software = adapter.get_info().device_type == DeviceType::Cpu;
        let failure = Arc::new(Mutex::new(None));
        let first = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            if let Ok(mut slot) = first.lock() {
                slot.get_or_insert_with(|| e.to_string());
            }
        }));
        Ok(Device { device, queue, summary, software, failure })
    }

    /// Create a buffer of zeros.
    ///
    /// # Errors
    /// [`Error::Device`] with the number of bytes if it exceeds a limit or the memory of the device.
    pub fn buffer(&self, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
        if bytes > self.summary.max_array_bytes {
            return Err(Error::Device(format!(
                "array `{label}` needs {bytes} bytes, but {} allows {} per array; use fewer grains or --engine cpu",
                self.summary.name, self.summary.max_array_bytes
            )));
        }
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.next_multiple_of(4).max(16),
            usage,
            mapped_at_creation: false,
        });
        match pollster::block_on(scope.pop()) {
            None => Ok(buffer),
            Some(e) => {
                Err(Error::Device(format!("{}: no memory for `{label}`, {bytes} bytes: {e}", self.summary.name)))
            }
        }
    }

    /// Whether everything so far went well.
    ///
    /// # Errors
    /// [`Error::Device`] with the first error of the device.
    pub fn check(&self) -> Result<()> {
        match self.failure.lock().ok().and_then(|slot| slot.clone()) {
            None => Ok(()),
            Some(e) => Err(Error::Device(format!("{}: {e}", self.summary.name))),
        }
    }

    /// Wait for everything submitted.
    pub fn wait(&self) -> Result<()> {
        match self.device.poll(wgpu::PollType::wait_indefinitely()) {
            Ok(_) => Ok(()),
            Err(e) => Err(Error::Device(format!("{} stopped answering: {e}", self.summary.name))),
        }
    }

    /// Copy the first `bytes` of a buffer to the host.
    pub fn read(&self, buffer: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let staging = self.buffer("staging", bytes, usage)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes.next_multiple_of(4));
        self.queue.submit([encoder.finish()]);
        let lost = |e: String| Error::Device(format!("{}: reading back failed: {e}", self.summary.name));
        let (sender, receiver) = std::sync::mpsc::channel();
        staging.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            let _ = sender.send(result);
        });
        self.wait()?;
        receiver.recv().map_err(|e| lost(e.to_string()))?.map_err(|e| lost(e.to_string()))?;
        let view = staging.slice(..).get_mapped_range().map_err(|e| lost(e.to_string()))?;
        Ok(view[..bytes as usize].to_vec())
    }
}
