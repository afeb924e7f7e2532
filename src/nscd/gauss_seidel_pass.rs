//! Twin of `shaders/nscd/gauss_seidel_pass.wgsl`: all contacts of the next colour, each updated with a step of its own
//! (of spheres that is Algorithm 1, which solves it exactly) for the velocities that the colours before have left.

use crate::{
    body::rotation::surface_velocity,
    contact::materials::pair_of,
    nscd::{
        compliance::{compliance_of, compliant},
        contact::contact_at,
        response::{ContactBody, VelocityUpdate, apply_impulse, contact_body, natural_map_scale},
    },
    solve::natural_map::{disc_update, natural_map},
    state::{ColorCursor, ColoredContact, NONE, Packed, State},
};
use glam::DVec3;
use rayon::prelude::*;

/// Contacts that one task works on at least.
const LEAST: usize = 256;

pub fn gauss_seidel_pass(s: &mut State) {
    let ColorCursor { colors, contacts } = s.color_cursor[0];
    let end = contacts + s.color_count[colors as usize];
    s.color_cursor_next[0] = ColorCursor { colors: colors + 1, contacts: end };
    let of_color = contacts as usize..end as usize;
    // Contacts of a colour share no grain, so that none sees what the others do.
    let updates: Vec<_> = of_color.clone().into_par_iter().with_min_len(LEAST).map(|k| Update::of(s, k)).collect();
    for (k, update) in of_color.zip(updates).filter_map(|(k, update)| Some((k, update?))) {
        s.colored_impulse_before[k] = Packed(update.next);
        s.pass_residual[s.colored_contact[k].first as usize] += update.residual_squared;
        update.velocities.iter().flatten().for_each(|velocity| velocity.store(s));
    }
}

/// What a contact's update changes.
struct Update {
    /// N s, on the first grain.
    next: DVec3,
    /// (m/s)², of the natural map that the update has met
    residual_squared: f64,
    /// Of the grains; a wall has none.
    velocities: [Option<VelocityUpdate>; 2],
}

impl Update {
    fn of(s: &State, k: usize) -> Option<Update> {
        let ColoredContact { first, second, entry, .. } = s.colored_contact[k];
        if first == NONE {
            return None;
        }
        let (i, j) = (first as usize, second as usize);
        let (geometry, inverse_mass) = (s.colored_geometry[k], s.colored_inverse_effective_mass[k]);
        let arm = inverse_mass.arm * geometry.n;
        let here = contact_body(s, i, arm);
        let there = (j < s.sizes.bodies).then(|| contact_body(s, j, -inverse_mass.arm_to * geometry.n));
        let velocity = |body: &ContactBody| body.velocity.v + surface_velocity(body.spin, body.arm);
        let pushed = velocity(&here) - there.as_ref().map_or(DVec3::ZERO, velocity);
        let old = s.colored_impulse[k].0;
        let start = old + s.solver_state[0].beta * (old - s.colored_impulse_before[k].0);
        let rigid = contact_at(s, (i, j), &geometry, &inverse_mass, pushed + s.colored_free_velocity[k].0);
        let compliance = compliance_of(s, &pair_of(s, i, j), &inverse_mass);
        let side = compliant(s, &rigid, &compliance, start);
        let next = disc_update(&side, start, 1.0);
        let change = next - start;
        let error = natural_map(&side, start, natural_map_scale(s, entry as usize, &side, &compliance));
        Some(Update {
            next,
            residual_squared: error.length_squared(),
            velocities: [
                Some(apply_impulse(s, i, &here, change)),
                there.map(|there| apply_impulse(s, j, &there, -change)),
            ],
        })
    }
}
