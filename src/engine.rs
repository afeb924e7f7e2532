//! Engines run a plan on a state. `Cpu` and `Gpu` are the only two.

pub mod cpu;
pub mod gpu;

pub use cpu::Cpu;
pub use gpu::Gpu;

use crate::{
    error::Result,
    plan::Op,
    state::{Counters, Params, State},
};

/// What a simulation needs from the machine it runs on.
pub trait Engine {
    /// `cpu` or `gpu`.
    fn name(&self) -> &'static str;
    /// The adapter, or the number of threads.
    fn adapter(&self) -> String;
    /// Run operations in order, `times` over.
    fn execute(&mut self, params: &Params, ops: &[Op], times: u32) -> Result<()>;
    /// Wait for everything so far and read what the device has to say.
    fn counters(&mut self) -> Result<Counters>;
    /// Give an array over slots another length; its content is lost.
    fn resize(&mut self, array: &'static str, len: usize) -> Result<()>;
    /// Overwrite arrays of the engine from the state.
    fn write(&mut self, arrays: &[&'static str], state: &State) -> Result<()>;
    /// Overwrite arrays of the state from the engine.
    fn read(&mut self, arrays: &[&'static str], state: &mut State) -> Result<()>;
}

/// Refuse what the host's memory cannot hold. Where the system does not tell, everything passes.
pub(crate) fn check_host_memory(need: u64) -> Result<()> {
    let available = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find(|l| l.starts_with("MemAvailable:"))?;
        Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
    });
    match available {
        Some(available) if need > available => Err(crate::error::Error::Device(format!(
            "scene too large: it needs {need} bytes, but {available} bytes of memory are available"
        ))),
        _ => Ok(()),
    }
}
