//! Shader modules, with or without the checks that wgpu adds to kernels.
#![allow(unsafe_code, reason = "nowhere else may a device be trusted with kernels as they are")]

/// Whether kernels check their indices, divisors and the ends of loops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Checks {
    /// Where something is wrong, a kernel does something harmless
    #[default]
    On,
    /// Kernels are trusted; faster on some devices
    Off,
}

impl Checks {
    /// The module of a kernel on a device.
    pub(super) fn module(self, device: &wgpu::Device, entry: &str, program: wgpu::naga::Module) -> wgpu::ShaderModule {
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(entry),
            source: wgpu::ShaderSource::Naga(std::borrow::Cow::Owned(program)),
        };
        match self {
            Checks::On => device.create_shader_module(descriptor),
            // SAFETY: kernels are made of the files of this crate alone. Their indices are numbers of bodies, cells and
            // entries that kernels have counted themselves, in arrays that the host has made as long (lists that do not
            // fit are not walked), and the tests of all kernels run with the checks too, whose results are the same.
            // Loops go through a list, a row of cells or a table once, or halve or shorten what is left (`wrapped`); divisors
            // are sizes that are never 0.
            Checks::Off => unsafe {
                device.create_shader_module_trusted(descriptor, wgpu::ShaderRuntimeChecks::unchecked())
            },
        }
    }
}
