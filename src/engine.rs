//! Engines run a plan on a state. `Cpu` and `Gpu` are the only two.

pub mod aliases;
mod arrays;
pub mod cpu;
pub mod gpu;
pub mod liveness;
pub mod placements;
pub mod programs;
pub mod times;
pub mod traffic;

pub use cpu::Cpu;
pub use gpu::Gpu;
pub use times::Times;

use crate::{
    error::Result,
    plan::Op,
    state::{Array, Counters, Params, Sizes, State},
};
use std::{any::Any, ops::Range};

/// Elements that are moved between host and engine at a time, so that the host needs little memory of its own.
pub const PIECE: usize = 1 << 15;
/// Of a range: all elements.
pub const ALL: Range<usize> = 0..usize::MAX;

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
    /// From now on so many bodies and clumps, no more than arrays were made for; the content of their arrays is lost.
    fn count(&mut self, sizes: &Sizes) -> Result<()>;
    /// Give arrays another length; their content is lost.
    fn resize(&mut self, arrays: &[&'static Array], len: usize) -> Result<()>;
    /// Overwrite elements of the engine's arrays, from number `first` on, with all that the state has.
    fn write(&mut self, arrays: &[&'static Array], first: usize, state: &State) -> Result<()>;
    /// Overwrite arrays of the state with elements of the engine's, those of this range that there are.
    fn read(&mut self, arrays: &[&'static Array], elements: Range<usize>, state: &mut State) -> Result<()>;
    /// Where the times of stages are gathered; None: nowhere, and nothing is timed. Timing costs some speed.
    fn times(&mut self) -> &mut Option<Times>;
    /// What tells the times of stages.
    fn clock(&self) -> &'static str;
    /// Bytes from one element of an array to the next.
    fn stride(&self, array: &'static Array) -> usize;
}

/// The part of a range that is below `len`.
fn within(elements: &Range<usize>, len: usize) -> Range<usize> {
    elements.start.min(len)..elements.end.min(len)
}
