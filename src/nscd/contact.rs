//! Twin of `shaders/nscd/contact.wgsl`: contact dynamics, section 2.2. Grains are rigid; a step is one
//! implicit Euler step with restitution 0.

use crate::solve::natural_map::OrientedContact;
use crate::state::{ACTIVE, ContactGeometry, GROUP, INDEX, InverseEffectiveMass, NONE, ResidualSums, State, Velocity};
use crate::{
    body::{Body, ForceTorque, rotation::surface_velocity},
    contact::{
        geometry::{Separation, branch_vector, sphere_separation},
        law::Contact,
        materials::pair_of,
    },
    neighbours::lists::bodies_of_group,
    space::{boundary::past_flow, dimension::moment, precision::position_low_of, walls::wall_separation},
};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Sums of two together.
pub fn combined(a: ResidualSums, b: ResidualSums) -> ResidualSums {
    ResidualSums {
        reference: a.reference + b.reference,
        lipschitz_bound: a.lipschitz_bound.max(b.lipschitz_bound),
        residual_squared: a.residual_squared + b.residual_squared,
        restart_criterion: a.restart_criterion + b.restart_criterion,
        curvature: a.curvature + b.curvature,
        step_squared: a.step_squared + b.step_squared,
        largest_residual: a.largest_residual.max(b.largest_residual),
        resolved_residual: a.resolved_residual.max(b.resolved_residual),
        max_normal_impulse: a.max_normal_impulse.max(b.max_normal_impulse),
        coulomb_excess: a.coulomb_excess.max(b.coulomb_excess),
        late_contacts: a.late_contacts + b.late_contacts,
    }
}

/// The sum over all groups.
pub fn total_sums(s: &State) -> ResidualSums {
    s.residual_sums.iter().copied().fold(ResidualSums::default(), combined)
}

/// What global damping, implicit like all else, leaves of velocities and to impulses.
pub fn damping_factor(s: &State) -> f64 {
    1.0 / (1.0 + s.params.dt * s.params.damping)
}

/// The inverse mass of a body that impulses act on, 1/kg.
pub fn impulse_inverse_mass(s: &State, i: usize) -> f64 {
    damping_factor(s) * s.velocity[i].inverse_mass
}

/// By how much the velocity of a grain would change in the step if nothing touched it, m/s.
pub fn free_velocity_change(s: &State, velocity: &Velocity) -> DVec3 {
    if velocity.inverse_mass == 0.0 {
        return DVec3::ZERO;
    }
    damping_factor(s)
        * s.params.dt
        * past_flow(s, s.model.boundary, s.params.gravity - s.params.damping * velocity.v, velocity.v)
}

/// The same for the spin, rad/s.
pub fn free_spin_change(s: &State, velocity: &Velocity, spin: DVec3) -> DVec3 {
    if velocity.inverse_mass == 0.0 {
        return DVec3::ZERO;
    }
    -damping_factor(s) * s.params.dt * s.params.damping * spin
}

/// A body or the first member of its clump at the end of the step if nothing touched.
#[derive(Clone, Copy, Debug, Default)]
pub struct FreeMotion {
    /// m/s: the velocity of its grain now, as all kernels know it.
    pub v: DVec3,
    /// m/s: all that comes to it, so that differences of two keep their digits.
    pub rest: DVec3,
    pub spin: DVec3,
}

/// Velocity of a point of the first of two bodies past the second in the same place, m/s.
pub fn past(a: &FreeMotion, arm: DVec3, b: &FreeMotion, arm_to: DVec3) -> DVec3 {
    let rest = |motion: &FreeMotion, arm| motion.rest + surface_velocity(motion.spin, arm);
    (a.v - b.v) + (rest(a, arm) - rest(b, arm_to))
}

/// Smaller than any speed that matters, m/s.
pub const NO_SPEED: f64 = 1e-30;

/// Velocities of body i, after a pass and as carried ahead from it, by what its impulses make of them: freed of the
/// rounding that updates in place have left.
pub fn remove_rounding(s: &mut State, i: usize, velocity: Velocity, spin: DVec3) {
    let off = velocity.v - s.pass_velocity[i].v;
    for velocities in [&mut s.pass_velocity, &mut s.pass_velocity_before, &mut s.extrapolated_velocity] {
        velocities[i] = Velocity { v: velocities[i].v + off, ..velocity };
    }
    let spin_off = s.pass_spin.get(i).map_or(DVec3::ZERO, |last| spin - last.0);
    for spins in [&mut s.pass_spin, &mut s.pass_spin_before, &mut s.extrapolated_spin] {
        if let Some(kept) = spins.get_mut(i) {
            kept.0 += spin_off;
        }
    }
}

/// A contact of grains i and j, or of grain i with a wall, at a velocity of i past the other.
pub fn contact_at(
    s: &State,
    (i, j): (usize, usize),
    geometry: &ContactGeometry,
    inverse_mass: &InverseEffectiveMass,
    velocity: DVec3,
) -> OrientedContact {
    OrientedContact {
        sign: 1.0,
        share: 1.0,
        n: geometry.n,
        normal: inverse_mass.normal,
        tangential: inverse_mass.tangential,
        friction: pair_of(s, i, j).friction,
        velocity,
    }
}

/// The contact at an entry of grain i at the velocities that `at` gives for a grain: translation and spin.
pub fn oriented_contact(s: &State, i: usize, entry: usize, at: impl Fn(usize) -> (DVec3, DVec3)) -> OrientedContact {
    let side = pushed_contact(s, i, entry, at);
    OrientedContact { velocity: side.velocity + side.sign * s.free_contact_velocity[entry].0, ..side }
}

/// The same with what impulses have added to the velocity of its sides alone.
pub fn pushed_contact(s: &State, i: usize, entry: usize, at: impl Fn(usize) -> (DVec3, DVec3)) -> OrientedContact {
    let j = (s.neighbour[entry] & INDEX) as usize;
    let (geometry, inverse_mass) = (s.contact_geometry[entry], s.inverse_effective_mass[entry]);
    let (here, arm, arm_to) = (at(i), inverse_mass.arm, inverse_mass.arm_to);
    let side = |velocity| contact_at(s, (i, j), &geometry, &inverse_mass, velocity);
    if j >= s.sizes.bodies {
        return side(here.0 + surface_velocity(here.1, arm * geometry.n));
    }
    let sign = if i < j { 1.0 } else { -1.0 };
    let n = sign * geometry.n;
    let velocity = match i < j {
        true => relative_velocity(here, arm * n, at(j), -arm_to * n),
        false => relative_velocity(at(j), arm_to * n, here, -arm * n),
    };
    OrientedContact { sign, share: 0.5, n, ..side(velocity) }
}

/// Velocity in the contact point of the first of two grains past the second, of translation and spin of both.
pub fn relative_velocity(first: (DVec3, DVec3), arm: DVec3, second: (DVec3, DVec3), arm_to: DVec3) -> DVec3 {
    (first.0 - second.0) + (surface_velocity(first.1, arm) - surface_velocity(second.1, arm_to))
}

/// The contact of grain i with neighbour j, as samples and forces see it: what carries an impulse is closed.
pub fn contact_of(s: &State, i: usize, here: &Body, j: usize, entry: usize) -> Contact {
    let impulse = warm_start_impulse(s, entry);
    if impulse == DVec3::ZERO {
        return Contact::default();
    }
    let Separation { gap, n } = separation_with(s, i, here, j);
    let force = impulse * (1.0 / s.params.dt);
    let arm = (here.position.radius + 0.5 * gap) * n;
    let branch = s.position.get(j).map_or(DVec3::ZERO, |there| (here.position.radius + there.radius + gap) * n);
    Contact { gap, is_active: true, force, arm, branch, torque: moment(arm, force), ..Contact::default() }
}

/// Gap and normal of grain i and neighbour j, which may be a wall.
pub fn separation_with(s: &State, i: usize, here: &Body, j: usize) -> Separation {
    match j.checked_sub(s.sizes.bodies) {
        None => {
            let rest = here.low.radius + position_low_of(s, j).radius;
            sphere_separation(branch_vector(s, i, j), here.position.radius, s.position[j].radius, rest)
        }
        Some(w) => wall_separation(&s.wall[w], &here.position, here.low),
    }
}

/// The entries of grain i that hold a neighbour.
pub fn list_entries(s: &State, i: usize) -> impl Iterator<Item = usize> + '_ {
    s.row(i).take_while(|&entry| s.neighbour[entry] != NONE)
}

/// Those of them that take part in passes.
pub fn active_entries(s: &State, i: usize) -> impl Iterator<Item = usize> + '_ {
    list_entries(s, i).filter(|&entry| s.neighbour[entry] & ACTIVE != 0)
}

/// The entry of neighbour j in the list of grain i.
pub fn entry_of(s: &State, i: usize, j: usize) -> usize {
    list_entries(s, i).find(|&entry| (s.neighbour[entry] & INDEX) as usize == j).expect("it is a neighbour")
}

/// Sum and moment of the impulses at these entries of a grain, N s and N m s.
pub fn impulse_sum(s: &State, entries: impl Iterator<Item = usize>) -> ForceTorque {
    let mut sum = ForceTorque::default();
    for entry in entries {
        add_impulse(&mut sum, s, entry, s.impulse[entry].0);
    }
    sum
}

/// One more impulse.
pub fn add_impulse(sum: &mut ForceTorque, s: &State, entry: usize, impulse: DVec3) {
    sum.force += impulse;
    sum.torque += moment(s.inverse_effective_mass[entry].arm * s.contact_geometry[entry].n, impulse);
}

/// Keep the sums over the bodies of every group.
pub fn store_residual_sums(s: &mut State, of_body: impl Fn(&State, usize) -> ResidualSums + Sync) {
    let bodies = |group: usize| bodies_of_group(&s.sizes, group);
    let sums = by_group(s.sizes.list_groups(), bodies, |i| of_body(s, i));
    s.residual_sums[..sums.len()].copy_from_slice(&sums);
}

/// The same for clumps, whose groups come after those of the bodies.
pub fn store_clump_residual_sums(s: &mut State, of_clump: impl Fn(&State, usize) -> ResidualSums + Sync) {
    let clumps = |group: usize| group * GROUP..((group + 1) * GROUP).min(s.sizes.clumps);
    let sums = by_group(s.sizes.clumps.div_ceil(GROUP), clumps, |c| of_clump(s, c));
    s.residual_sums[s.sizes.list_groups()..][..sums.len()].copy_from_slice(&sums);
}

fn by_group(
    groups: usize,
    items: impl Fn(usize) -> Range<usize> + Sync,
    of_item: impl Fn(usize) -> ResidualSums + Sync,
) -> Vec<ResidualSums> {
    let of_group = |group| items(group).map(&of_item).fold(ResidualSums::default(), combined);
    (0..groups).into_par_iter().map(of_group).collect()
}

/// The impulse at this entry of the last step, N s.
pub fn warm_start_impulse(s: &State, entry: usize) -> DVec3 {
    if s.neighbour[entry] & ACTIVE != 0 { s.impulse[entry].0 } else { DVec3::ZERO }
}
