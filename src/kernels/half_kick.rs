//! Twin of `shaders/half_kick.wgsl`: velocities from time 0 to -1/2.

use crate::{laws::rotation::half_kick_spin, model::Rotation, state::State};

pub fn half_kick(s: &mut State) {
    let p = s.params;
    for i in 0..s.sizes.bodies {
        let inverse_mass = s.motion[i].inverse_mass;
        if inverse_mass != 0.0 {
            let acceleration = inverse_mass * s.force[i] + p.gravity - p.damping * s.motion[i].v;
            s.motion[i].v -= 0.5 * p.dt * acceleration;
        }
        if s.model.rotation == Rotation::Sphere {
            s.spin[i].0 = half_kick_spin(s, s.spin[i].0, s.torque[i].0, &s.place[i], inverse_mass);
        }
    }
}
