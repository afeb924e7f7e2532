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
