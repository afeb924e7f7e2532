//! The GPU as a machine: adapters, composed kernels, buffers by name. Knows no physics; only `engine::gpu` and the
//! renderer use it.

pub mod compose;
pub mod device;
pub mod images;

pub use compose::{Binding, Layout, Program, compose};
pub use device::{AdapterSummary, Arrays, Device, adapters};
