//! Closed forms. Each tolerance is what the scheme deserves: rounding where leapfrog is exact, (ω Δt)² where it is
//! second order, and the resolution of an overlap in f32, ulp(position) / overlap, for the single-precision engine.

#[path = "../common/mod.rs"]
mod common;
mod shared;

mod balances;
mod chains;
mod dissipation;
mod flight;
mod growth;
mod guided_walls;
mod hertz;
mod impact;
mod moving_walls;
mod oblique;
mod order;
mod range;
mod rolling;
mod shear;
mod silo;
mod sliding;
mod twist;
mod works;
