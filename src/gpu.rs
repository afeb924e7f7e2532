//! The GPU as a machine: adapters, composed kernels, where arrays lie, clocks. Knows no physics.

pub(crate) mod adapters;
pub(crate) mod checks;
pub(crate) mod compose;
pub(crate) mod device;
pub(crate) mod images;
pub(crate) mod layout;
pub(crate) mod pipeline;
pub(crate) mod placement;
mod redirect;
pub(crate) mod restrictions;
pub(crate) mod stopwatch;
mod values;

pub use adapters::{AdapterSummary, adapter_facts, adapters, select, selected};
pub use checks::Checks;
pub use compose::{Program, compose};
pub use device::{Arrays, Device, DeviceOptions};
pub use layout::{Binding, Layout, Pack, Resource};
pub use pipeline::{folded, workgroups};
pub use placement::{Parts, Placement};
pub use restrictions::Restrictions;
pub use stopwatch::Stopwatch;
