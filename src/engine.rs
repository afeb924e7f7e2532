//! Engines run a plan on a state. `Cpu` and `Gpu` are the only two.

mod arrays;
pub mod cpu;
pub mod gpu;
mod placements;
pub mod programs;
pub mod times;
pub mod traffic;

pub use cpu::Cpu;
pub use gpu::Gpu;
pub use times::Times;

use crate::{
    error::Result,
    plan::Op,
    state::{Array, Counters, Params, State},
};
use std::any::Any;

/// What a simulation needs from the machine it runs on. It can go to another thread.
pub trait Engine: Any + Send {
    /// `cpu` or `gpu`.
    fn name(&self) -> &'static str;
    /// The adapter, or the number of threads.
    fn adapter(&self) -> String;
    /// Run operations in order, without looking at anything in between.
    fn execute(&mut self, params: &Params, ops: &[Op]) -> Result<()>;
    /// Wait for everything so far and read what the device has to say.
    fn counters(&mut self) -> Result<Counters>;
    /// Give an array another length; its content is lost.
    fn resize(&mut self, array: &'static Array, len: usize) -> Result<()>;
    /// Overwrite arrays of the engine from the state.
    fn write(&mut self, arrays: &[&'static Array], state: &State) -> Result<()>;
    /// Overwrite arrays of the state from the engine.
    fn read(&mut self, arrays: &[&'static Array], state: &mut State) -> Result<()>;
    /// Where the times of stages are gathered; None: nowhere, and nothing is timed. Timing costs some speed.
    fn times(&mut self) -> &mut Option<Times>;
    /// What tells the times of stages.
    fn clock(&self) -> &'static str;
    /// Bytes from one element of an array to the next.
    fn stride(&self, array: &'static Array) -> usize;
}
