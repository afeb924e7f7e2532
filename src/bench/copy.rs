//! How fast this machine copies: what the bytes that stages move are measured by.

use crate::{
    error::Result,
    gpu::{Device, DeviceOptions},
    memory,
};
use rayon::prelude::*;
use std::{borrow::Cow, time::Instant};
use wgpu::BufferUsages;

/// Bytes of what is copied, well beyond the caches; less where a device allows less.
const BYTES: u64 = 1 << 28;
/// The median of so many measurements,
const REPEATS: usize = 5;
/// each of as many copies as take about so long, s.
const STRETCH: f64 = 0.05;

/// Of the processor and its memory with all threads, bytes read and written per second.
///
/// # Errors
/// [`crate::Error::Lacking`] if there is no memory for the copy.
pub fn of_host() -> Result<f64> {
    const BLOCK: usize = 1 << 15;
    memory::check_host(2 * BYTES)?;
    let from = vec![1_u64; BYTES as usize / 8];
    let mut to = vec![0_u64; from.len()];
    let copies = |count| {
        for _ in 0..count {
            to.par_chunks_mut(BLOCK).zip(from.par_chunks(BLOCK)).for_each(|(to, from)| to.copy_from_slice(from));
        }
        Ok(())
    };
    Ok(2.0 * BYTES as f64 / median_seconds(copies)?)
}

/// Of the adapter that the gpu engine takes, bytes read and written per second: by its own copy, and by a kernel that
/// copies.
///
/// # Errors
/// [`crate::Error::Lacking`] if there is no adapter, or no memory for the copy.
pub fn of_device(options: DeviceOptions) -> Result<[f64; 2]> {
    let device = Device::open(options)?;
    let bytes = BYTES.min(device.summary.max_array_bytes / 256 * 256);
    if device.software {
        memory::check_host(2 * bytes)?;
    }
    let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
    let (from, to) = (device.buffer("copied", bytes, usage)?, device.buffer("copy", bytes, usage)?);
    let kernel = Kernel::new(&device, &from, &to);
    let time = |encode: &dyn Fn(&mut wgpu::CommandEncoder)| {
        median_seconds(|count| {
            let mut encoder = device.device.create_command_encoder(&Default::default());
            (0..count).for_each(|_| encode(&mut encoder));
            device.submit(encoder);
            device.wait()
        })
    };
    let own = time(&|encoder| encoder.copy_buffer_to_buffer(&from, 0, &to, 0, bytes))?;
    let by_kernel = time(&|encoder| kernel.encode(encoder))?;
    device.check()?;
    Ok([own, by_kernel].map(|seconds| 2.0 * bytes as f64 / seconds))
}

/// Seconds of one copy.
fn median_seconds(mut copies: impl FnMut(usize) -> Result<()>) -> Result<f64> {
    let mut seconds = |count: usize| {
        let start = Instant::now();
        copies(count).map(|()| start.elapsed().as_secs_f64() / count as f64)
    };
    seconds(1)?; // pages and kernels are made by the first one
    let count = (STRETCH / seconds(1)?).ceil().clamp(1.0, 1000.0) as usize;
    let mut all = (0..REPEATS).map(|_| seconds(count)).collect::<Result<Vec<_>>>()?;
    all.sort_by(f64::total_cmp);
    Ok(all[REPEATS / 2])
}

const SOURCE: &str = "
@group(0) @binding(0) var<storage, read> source: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read_write> copy: array<vec4<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.x + id.y * groups.x * 64u;
    if (i < arrayLength(&source)) {
        copy[i] = source[i];
    }
}
";

/// A kernel that copies, a vector per invocation as the stages do.
struct Kernel {
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    groups: (u32, u32),
}

impl Kernel {
    fn new(device: &Device, from: &wgpu::Buffer, to: &wgpu::Buffer) -> Kernel {
        let module = device.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("copy"),
            source: wgpu::ShaderSource::Wgsl(Cow::Borrowed(SOURCE)),
        });
        let pipeline = device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("copy"),
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            cache: None,
        });
        let group = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("copy"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[(0, from), (1, to)]
                .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }),
        });
        let all = (from.size() / 16).div_ceil(64) as u32;
        let rows = all.div_ceil(65_535);
        Kernel { pipeline, group, groups: (all.div_ceil(rows), rows) }
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.dispatch_workgroups(self.groups.0, self.groups.1, 1);
    }
}
