//! CPU twins of the slots in `shaders/`: same function names, same order of arguments and of floating-point operations,
//! in f64. A law takes the model where WGSL takes a file, and values where WGSL takes values.

pub mod answer;
pub mod batch;
pub mod boundary;
pub mod colours;
pub mod contact;
pub mod dashpot;
pub mod dimension;
pub mod friction;
pub mod grains;
pub mod grid;
pub mod gyration;
pub mod leapfrog;
pub mod materials;
pub mod normal;
pub mod precision;
pub mod predictor_corrector;
pub mod rigid;
pub mod rotation;
pub mod touch;
pub mod walls;

use glam::DVec3;

/// What two surfaces know of each other; `n` points from the grain of interest to the other. Twin of `Touch`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// m, < 0 is overlap (erratum E1).
    pub gap: f64,
    pub n: DVec3,
}
