//! What a relaxation needs to know of the contacts, whether they come as a matrix or as bodies.

use glam::{DMat3, DVec3};

/// The affine map from impulses to relative velocities at contacts, `u = W r + q`.
///
/// Velocities are kept as a state that follows the impulses: those of bodies, `v = v_free + M⁻¹ H r`, of which
/// `u = Hᵀ v` is read, or those of the contacts themselves where all there is is a matrix. A change of one impulse then
/// costs two bodies, or a column. Vectors are (n, t1, t2), with t2 = 0 in the plane.
pub trait Operator {
    /// Affine in the impulses.
    type State: Clone;

    /// Contacts.
    fn len(&self) -> usize;

    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// 2 or 3.
    fn dims(&self) -> usize;

    /// `W_kk`: velocity per impulse of contact k.
    fn block(&self, k: usize) -> DMat3;

    /// Coefficient of friction of contact k.
    fn mu(&self, k: usize) -> f64;

    /// The velocity that residuals are relative to, > 0.
    fn reference(&self) -> f64;

    /// Velocities that residuals of single contacts are relative to, > 0, if the largest of these is asked for, and not
    /// their norm over the reference.
    fn speeds(&self) -> Option<&[f64]> {
        None
    }

    /// The state without any impulse.
    fn free(&self) -> Self::State;

    /// Makes the state that of the impulses `r`. One pass.
    fn set(&self, state: &mut Self::State, r: &[DVec3]);

    /// `u_k` in that state.
    fn velocity(&self, state: &Self::State, k: usize) -> DVec3;

    /// Brings the state up to date after `r_k` changed by `change`.
    fn add(&self, state: &mut Self::State, k: usize, change: DVec3);

    /// `state ← newer + β (newer − older)`, which belongs to impulses that go beyond in the same way.
    fn extrapolate(&self, state: &mut Self::State, newer: &Self::State, older: &Self::State, beta: f64);

    /// Contacts whose velocity depends on `r_k`; k itself may be among them.
    fn neighbours(&self, k: usize) -> impl Iterator<Item = usize>;
}

/// `W r + q` at all contacts, into `u`, by way of the state. One pass.
pub fn velocities<O: Operator>(operator: &O, state: &mut O::State, r: &[DVec3], u: &mut [DVec3]) {
    operator.set(state, r);
    for (k, u) in u.iter_mut().enumerate() {
        *u = operator.velocity(state, k);
    }
}
