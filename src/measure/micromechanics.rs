//! What a packing does inside: its contacts one by one, and stress, fabric, coordination, distributions, profiles and
//! equilibrium from them. All of it is computed on the host in double precision, from contacts, grains and walls.

pub mod cell;
pub mod contact;
pub mod coordination;
pub mod correlation;
pub mod distribution;
pub mod equilibrium;
pub mod measures;
pub mod packing;
pub mod profile;
pub mod stress;
pub mod totals;

pub use cell::Cell;
pub use contact::{Contact, Other};
pub use measures::{Asked, Measures};
pub use packing::Packing;
pub use totals::Totals;
