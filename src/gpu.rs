//! The GPU as a machine: adapters, composed kernels, arrays as images, clocks. Knows no physics.

pub mod compose;
pub mod device;
pub mod images;
pub mod layout;
pub mod pipeline;
pub mod stopwatch;

pub use compose::{Program, compose};
pub use device::{AdapterSummary, Arrays, Device, adapters};
pub use layout::{Binding, Layout};
pub use pipeline::workgroups;
pub use stopwatch::Stopwatch;
