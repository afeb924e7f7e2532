//! The GPU as a machine: adapters, composed kernels, buffers by name, a clock. Knows no physics; only `engine::gpu` and the
//! renderer use it.

pub mod compose;
pub mod device;
pub mod images;
pub mod stopwatch;

pub use compose::{Binding, Layout, Program, compose};
pub use device::{AdapterSummary, Arrays, Device, adapters};
pub use stopwatch::Stopwatch;
