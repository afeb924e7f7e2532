//! What a relaxation needs to know of the contacts, whether they come as a matrix or as bodies.

use glam::{DMat3, DVec3};

/// The affine map from impulses to relative velocities at contacts, `u = W r + q`.
///
/// A matrix gathers rows of W. Bodies keep their velocities, `v = v_free + M⁻¹ H r`, as the state, and read `u = Hᵀ v`;
/// then a change of one impulse costs two bodies and not a row. Vectors are (n, t1, t2), with t2 = 0 in the plane.
pub trait Operator {
    /// What follows from all impulses together; nothing for a matrix.
    type State;

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

    /// The state that belongs to the impulses `r`.
    fn state(&self, r: &[DVec3]) -> Self::State;

    /// `u_k`, where `state` belongs to `r`.
    fn velocity(&self, state: &Self::State, r: &[DVec3], k: usize) -> DVec3;

    /// Brings the state up to date after `r_k` changed by `change`.
    fn add(&self, state: &mut Self::State, k: usize, change: DVec3);

    /// Contacts whose velocity depends on `r_k`; k itself may be among them.
    fn neighbours(&self, k: usize) -> impl Iterator<Item = usize>;
}

/// `W r + q` at all contacts, into `u`. One pass.
pub fn velocities<O: Operator>(operator: &O, r: &[DVec3], u: &mut [DVec3]) {
    let state = operator.state(r);
    for (k, u) in u.iter_mut().enumerate() {
        *u = operator.velocity(&state, r, k);
    }
}
