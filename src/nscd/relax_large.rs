//! Twin of `shaders/nscd/relax_large.wgsl`: what `after_sweep` does, when the contacts of large grains, which have no
//! colours, have taken a step, all at once.

use crate::{
    body::{ForceTorque, rotation::surface_velocity},
    model::Grains,
    neighbours::lists::is_large,
    nscd::{
        after_sweep::restart_criterion,
        coloring::priority::is_heavy,
        compliance::{compliance_at, compliant},
        contact::{active_entries, add_impulse, oriented_contact, store_residual_sums},
        jacobi_pass::passes,
        response::{
            contact_body, extrapolated_velocity_of, largest_response, natural_map_scale, response, standing_for,
            store_member_load,
        },
    },
    solve::natural_map::{UpdateScales, disc_update, natural_map},
    state::{INDEX, LargeContacts, Packed, ResidualSums, Spin, State, Velocity},
};
use glam::DVec3;

/// Whether one of the two of a contact is large.
pub fn joins_large(s: &State, i: usize, entry: usize) -> bool {
    is_large(&s.sizes, i) || is_large(&s.sizes, (s.neighbour[entry] & INDEX) as usize)
}

pub fn relax_large(s: &mut State) {
    if s.model.grains == Grains::Clumps {
        let (changes, sums): (Vec<ForceTorque>, Vec<ResidualSums>) =
            passes(s, relax_large_of, |_, _, change, sums| (change, sums)).into_iter().unzip();
        store_residual_sums(s, |_, i| sums[i]);
        s.pass_residual.fill(0.0);
        return store_member_load(s, changes.into_iter());
    }
    let swept = passes(s, relax_large_of, |s, i, change, sums| {
        let ((v, w), (velocity, spin)) = (extrapolated_velocity_of(s, i), response(s, i, &change));
        let (now, spin) = (Velocity { v: v + velocity.v, ..s.extrapolated_velocity[i] }, w + spin);
        let restart_criterion = restart_criterion(s, i, &now, spin);
        (now, spin, ResidualSums { restart_criterion, ..sums })
    });
    store_residual_sums(s, |_, i| swept[i].2);
    s.pass_residual.fill(0.0);
    for (i, (velocity, spin, _)) in swept.into_iter().enumerate() {
        s.pass_velocity_before[i] = velocity;
        if let Some(kept) = s.pass_spin_before.get_mut(i) {
            *kept = Spin(spin);
        }
    }
}

/// By how much the impulses of body i without a colour change, and the residual that the pass has met; `before` as in
/// `jacobi_pass_of`.
fn relax_large_of(s: &State, i: usize, before: &mut [Packed], begin: usize) -> (ForceTorque, ResidualSums) {
    let mut sums = ResidualSums { residual_squared: s.pass_residual[i], ..ResidualSums::default() };
    let mut change = ForceTorque::default();
    for entry in active_entries(s, i).filter(|&entry| joins_large(s, i, entry)) {
        let j = (s.neighbour[entry] & INDEX) as usize;
        let mut side = oriented_contact(s, i, entry, |i| swept(s, i));
        let before = &mut before[entry - begin];
        let old = side.sign * s.impulse[entry].0;
        let start = old + s.solver_state[0].beta * (old - side.sign * before.0);
        let compliance = compliance_at(s, i, entry);
        side = compliant(s, &side, &compliance, start);
        let error = natural_map(&side, start, natural_map_scale(s, entry, &side, &compliance));
        let own = split_scales(s, i, j);
        let other = if j < s.sizes.bodies { split_scales(s, j, i) } else { UpdateScales::default() };
        side.normal += own.normal + other.normal;
        side.tangential += own.tangential + other.tangential;
        let next = disc_update(&side, start, 1.0);
        before.0 = side.sign * next;
        add_impulse(&mut change, s, entry, side.sign * (next - start));
        sums.residual_squared += side.share * error.length_squared();
    }
    (change, sums)
}

/// What it adds to the scales of a contact with j that body i has a part of its grain there only.
fn split_scales(s: &State, i: usize, j: usize) -> UpdateScales {
    let LargeContacts { small, heavy } = s.large_contacts[standing_for(s, i)];
    let alike = if is_heavy(s, j) { heavy } else { small };
    let others = f64::from(if small != 0 && heavy != 0 { 2 * alike - 1 } else { alike - 1 });
    let UpdateScales { normal, tangential } = largest_response(s, i);
    UpdateScales { normal: others * normal, tangential: others * tangential }
}

/// How body i moves since the colours have been relaxed.
fn swept(s: &State, i: usize) -> (DVec3, DVec3) {
    let body = contact_body(s, i, DVec3::ZERO);
    (body.velocity.v + surface_velocity(body.spin, body.arm), body.spin)
}
