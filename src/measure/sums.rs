//! Twin of `shaders/measure/sums.wgsl`: what the sums over grains, [`PartialSums`](crate::state::PartialSums), are made
//! of.

/// What a grain has by itself at step n: J, J, N and W.
#[derive(Clone, Copy, Debug, Default)]
pub struct Energies {
    pub kinetic: f64,
    pub potential: f64,
    pub net_force: f64,
    /// Of global damping, and what dashpots take less because velocities have changed since the half step.
    pub dissipation: f64,
}
