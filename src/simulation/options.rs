//! How to run a scene, as opposed to what.

use crate::{
    gpu::{Arrays, Checks, DeviceOptions, Restrictions},
    model::Precision,
};

/// Which engine to run on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EngineChoice {
    /// The best adapter, else the CPU, which is faster, and in f64, where the only adapter is a software driver.
    #[default]
    Auto,
    Gpu,
    Cpu,
}

/// How to run, as opposed to what.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub engine: EngineChoice,
    pub precision: Precision,
    /// List entries there are at least; more are made when needed. None: as many as are needed.
    pub entries: Option<usize>,
    /// Lists that lie side by side in memory, a power of two of 512 at most. None: as suits the engine.
    pub lists_abreast: Option<u32>,
    /// Most steps that neighbour lists may serve.
    pub longest_chunk: u32,
    /// What arrays are on a device.
    pub arrays: Arrays,
    /// Whether kernels check their indices.
    pub checks: Checks,
    /// What a device is taken not to have.
    pub restrictions: Restrictions,
    /// Asked now and then in the middle of a step of contact dynamics, which may take minutes: whether to give it up.
    pub interrupted: fn() -> bool,
}

impl Options {
    /// For the device that runs it.
    pub fn device(&self) -> DeviceOptions {
        let Options { arrays, checks, restrictions, .. } = *self;
        DeviceOptions { double: self.precision == Precision::Double, arrays, checks, restrictions }
    }
}

impl Default for Options {
    fn default() -> Options {
        Options {
            engine: EngineChoice::Auto,
            precision: Precision::Single,
            entries: None,
            lists_abreast: None,
            longest_chunk: 200,
            arrays: Arrays::Auto,
            checks: Checks::On,
            restrictions: Restrictions::default(),
            interrupted: || false,
        }
    }
}
