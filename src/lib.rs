//! packstone
pub mod check;
pub mod engine;
pub mod error;
pub mod gpu;
pub mod kernels;
pub mod laws;
pub mod measure;
pub mod model;
pub mod plan;
pub mod render;
pub mod scene;
pub mod shaders;
pub mod simulation;
pub mod state;
pub mod time_step;

pub use error::{Error, Result};
