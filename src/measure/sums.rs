//! Twin of `shaders/measure/sums.wgsl`: what the sums over grains, [`PartialSums`](crate::state::PartialSums), are made
//! of.

use glam::DVec3;

/// What a grain has by itself at step n: J, J, N and W.
#[derive(Clone, Copy, Debug, Default)]
pub struct Energies {
    pub kinetic: f64,
    pub potential: f64,
    pub net_force: f64,
    /// Of global damping, and what dashpots take less because velocities have changed since the half step.
    pub dissipation: f64,
    /// J, mass times velocity times velocity: on the diagonal, and above it.
    pub flux: DVec3,
    pub flux_above: DVec3,
}
