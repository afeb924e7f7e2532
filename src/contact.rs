//! Contact: what two surfaces do to each other, and what they remember.

pub mod batch;
pub mod blocks;
pub mod cohesion;
pub mod contacts;
pub mod damping;
pub mod geometry;
pub mod growth;
pub mod history;
pub mod kicks;
pub mod law;
pub mod materials;
pub mod normal;
pub mod overlap;
pub mod rolling;
pub mod state;
pub mod tangential;
pub mod twist;
