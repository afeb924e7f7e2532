//! Twin of `shaders/measure/contact_forces.wgsl`: force and moment of all contacts of every grain at step n.

use crate::{
    body::bodies::body,
    contact::contacts::contacts_of,
    measure::contacts::contact_of,
    state::{Spin, State},
};
use rayon::prelude::*;

pub fn contact_forces(s: &mut State) {
    let sums = (0..s.sizes.bodies).into_par_iter().map(|i| contacts_of(s, i, &body(s, i), contact_of));
    let sums: Vec<_> = sums.collect();
    s.force = sums.iter().map(|sum| sum.force).collect();
    if !s.torque.is_empty() {
        s.torque = sums.iter().map(|sum| Spin(sum.torque)).collect();
    }
}
