//! Kernels on a device: pipelines, what they are bound to, and the workgroups of a dispatch
//! (`shaders/gpu/pipeline.wgsl`).

use super::{Device, Program};
use crate::error::{Error, Result};

/// Invocations per workgroup: `WG` of `pipeline.wgsl`.
const WORKGROUP: usize = 64;
/// Workgroups a dispatch may have along one dimension.
const GROUPS_PER_DIMENSION: usize = 65_535;

/// Workgroups with an invocation for every item.
pub fn workgroups(items: usize) -> (u32, u32) {
    folded(items.div_ceil(WORKGROUP))
}

/// At least so many workgroups, and one; more than fit into one dimension are folded into two.
pub fn folded(groups: usize) -> (u32, u32) {
    let groups = groups.max(1);
    let y = groups.div_ceil(GROUPS_PER_DIMENSION);
    (groups.div_ceil(y) as u32, y as u32)
}

impl Device {
    /// Compile a kernel.
    ///
    /// # Errors
    /// [`Error::Lacking`] if it uses more storage buffers than the device allows, [`Error::Shader`] if it does not compile.
    pub fn pipeline(&self, label: &str, program: Program) -> Result<wgpu::ComputePipeline> {
        let storage = program.bindings.iter().filter(|b| b.resource.is_storage_buffer()).count() as u32;
        if storage > self.summary.max_arrays {
            return Err(Error::Lacking(format!(
                "kernel `{label}` uses {storage} storage buffers, but {} allows {}; use --engine cpu",
                self.summary.name, self.summary.max_arrays
            )));
        }
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = self.options.checks.module(&self.device, &program.entry, program.module);
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: None,
            module: &module,
            entry_point: Some(&program.entry),
            compilation_options: Default::default(),
            cache: None,
        });
        match pollster::block_on(scope.pop()) {
            None => Ok(pipeline),
            Some(e) => Err(Error::Shader { file: format!("{}.wgsl", program.entry), line: 1, message: e.to_string() }),
        }
    }

    /// What a pipeline is bound to, in the order of the bindings of its program.
    pub fn group<'a>(
        &self,
        label: &str,
        pipeline: &wgpu::ComputePipeline,
        resources: impl IntoIterator<Item = wgpu::BindingResource<'a>>,
    ) -> wgpu::BindGroup {
        let entries = (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(label),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries.collect::<Vec<_>>(),
        })
    }
}
