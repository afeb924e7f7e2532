//! Twin of `shaders/method/cd.wgsl`: contact dynamics, section 2.2. Grains are rigid; a step is one
//! implicit Euler step with restitution 0.

use super::{
    Touch,
    contact::{Body, Contact, Gathered, way_to},
    friction::kept_spring,
    materials::pair_of,
    precision::residue_of,
    rotation::surface_velocity,
    touch::touch_grain,
    walls::{touch_wall, wall_velocity},
};
use crate::state::{Effort, GROUP, INDEX, Meeting, Motion, NONE, SPRUNG, State};
use glam::DVec3;
use rayon::prelude::*;

/// Sums of two together.
pub fn combined(a: Effort, b: Effort) -> Effort {
    Effort {
        reference: a.reference + b.reference,
        least: a.least + b.least,
        imposed: a.imposed.max(b.imposed),
        crowd: a.crowd.max(b.crowd),
        residual: a.residual + b.residual,
        turn: a.turn + b.turn,
        work: a.work + b.work,
        way: a.way + b.way,
        pressing: a.pressing.max(b.pressing),
        excess: a.excess.max(b.excess),
        late: a.late + b.late,
    }
}

/// The sum over all groups.
pub fn total(s: &State) -> Effort {
    s.effort.iter().copied().fold(Effort::default(), combined)
}

/// What global damping, implicit like all else, leaves of velocities and to impulses.
pub fn held(s: &State) -> f64 {
    1.0 / (1.0 + s.params.dt * s.params.damping)
}

/// Velocity that a grain would have at the end of the step if nothing touched it, and the inverse mass that impulses meet.
pub fn freed(s: &State, motion: &Motion) -> Motion {
    if motion.inverse_mass == 0.0 {
        return *motion;
    }
    Motion { v: held(s) * (motion.v + s.params.dt * s.params.gravity), inverse_mass: held(s) * motion.inverse_mass }
}

/// The same for the spin.
pub fn freed_spin(s: &State, motion: &Motion, spin: DVec3) -> DVec3 {
    if motion.inverse_mass == 0.0 {
        return spin;
    }
    held(s) * spin
}

/// What residuals are relative to: the square of a grain's free velocity, m²/s²; and `crowd`.
pub fn reference(s: &State, crowd: usize, squared: f64, inverse_mass: f64) -> Effort {
    let mut effort = Effort { crowd: crowd as f64, ..Effort::default() };
    if inverse_mass != 0.0 {
        effort.reference = squared;
        effort.least = s.params.dt * s.params.dt * s.params.gravity.length_squared();
    }
    effort
}

/// Velocities of body i, after a pass and as carried ahead from it, by what its impulses make of them: freed of the rounding
/// that updates in place have left.
pub fn settle(s: &mut State, i: usize, motion: Motion, spin: DVec3) {
    let off = motion.v - s.trial[i].v;
    for motions in [&mut s.trial, &mut s.trial_before, &mut s.ahead] {
        motions[i] = Motion { v: motions[i].v + off, ..motion };
    }
    let spin_off = s.trial_spin.get(i).map_or(DVec3::ZERO, |last| spin - last.0);
    for spins in [&mut s.trial_spin, &mut s.trial_spin_before, &mut s.ahead_spin] {
        if let Some(kept) = spins.get_mut(i) {
            kept.0 += spin_off;
        }
    }
}

/// A contact as its first side sees it, the grain with the smaller index.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// 1: the grain of interest is that side; -1: the other.
    pub turn: f64,
    /// 1/2 of a contact that two grains add to a sum.
    pub share: f64,
    /// Away from that side.
    pub n: DVec3,
    /// m/s
    pub closing: f64,
    /// 1/kg, as in [`crate::state::Lever`]: W in the direction of n, and across; of clumps more than that.
    pub normal: f64,
    pub tangential: f64,
    pub friction: f64,
    /// m/s, of that side past the other in the contact point.
    pub velocity: DVec3,
}

/// The contact in a slot of grain i at the velocities that `at` gives for a grain: translation and spin.
pub fn side_of(s: &State, i: usize, slot: usize, at: impl Fn(usize) -> (DVec3, DVec3)) -> Side {
    let j = (s.neighbour[slot] & INDEX) as usize;
    let (Meeting { n, closing }, l) = (s.meeting[slot], s.lever[slot]);
    let (v, spin) = at(i);
    let friction = pair_of(s, i, j).friction;
    let side = Side {
        turn: 1.0,
        share: 1.0,
        n,
        closing,
        normal: l.normal,
        tangential: l.tangential,
        friction,
        velocity: DVec3::ZERO,
    };
    if let Some(w) = j.checked_sub(s.sizes.bodies) {
        let arm = l.own * n;
        let velocity = (v - wall_velocity(&s.wall[w], s.place[i].x + arm)) + surface_velocity(spin, arm);
        return Side { velocity, ..side };
    }
    let there = at(j);
    let turn = if i < j { 1.0 } else { -1.0 };
    let n = turn * n;
    let ((first, arm), (second, arm_to)) =
        if i < j { (((v, spin), l.own), (there, l.other)) } else { ((there, l.other), ((v, spin), l.own)) };
    let surface = surface_velocity(first.1, arm * n) - surface_velocity(second.1, -arm_to * n);
    Side { turn, share: 0.5, n, velocity: (first.0 - second.0) + surface, ..side }
}

/// The speed that closes a gap within the step; an overlap opens at a bounded one. Gaps within rounding are none.
pub fn closing_of(s: &State, gap: f64) -> f64 {
    if gap.abs() < s.params.gap_band {
        return 0.0;
    }
    if gap > 0.0 {
        return gap / s.params.dt;
    }
    ((gap + s.params.gap_band) / s.params.dt).max(-s.params.correction)
}

/// Vector shortened to a length.
fn capped(v: DVec3, length: f64) -> DVec3 {
    let squared = v.length_squared();
    if squared > length * length { v * (length / squared.sqrt()) } else { v }
}

/// Impulse on the first side after a pass from `impulse`: the disc update. Its fixed points are contacts that are open,
/// stick or slip as Algorithm 1 has them; with `step` = 1 it is that algorithm for spheres.
pub fn relaxed(side: &Side, impulse: DVec3, step: f64) -> DVec3 {
    let pressing = -impulse.dot(side.n);
    let approach = side.velocity.dot(side.n);
    let friction = impulse + pressing * side.n;
    let slip = side.velocity - approach * side.n;
    let pressing_next = (pressing + step / side.normal * (approach - side.closing)).max(0.0);
    let weight = side.tangential;
    let friction_next = capped(weight * friction - step * slip, side.friction * (weight * pressing_next));
    (1.0 / weight) * friction_next - pressing_next * side.n
}

/// The natural map of a contact, m/s: r - P(r - rho (u + mu |u_T| n)), rho = 1/weight, over rho. The weight is
/// λmax(W_kk).
pub fn natural_map(side: &Side, impulse: DVec3, weight: f64) -> DVec3 {
    let pressing = -impulse.dot(side.n);
    let approach = side.velocity.dot(side.n);
    let friction = impulse + pressing * side.n;
    let slip = side.velocity - approach * side.n;
    let mu = side.friction;
    let normal = weight * pressing + (approach - side.closing) - mu * slip.length();
    let across = weight * friction - slip;
    let length = across.length();
    if normal > 0.0 && length <= mu * normal {
        // What is left of the differences below, without the rounding of impulses beside which velocities are small.
        return slip + (approach - side.closing - mu * slip.length()) * side.n;
    }
    let (mut kept, mut pressed) = (DVec3::ZERO, 0.0);
    if mu * length > -normal {
        pressed = (normal + mu * length) / (1.0 + mu * mu);
        kept = across * (mu * pressed / length);
    }
    (weight * friction - kept) - (weight * pressing - pressed) * side.n
}

/// The contact of grain i with neighbour j, as samples and forces see it: what carries an impulse is closed.
pub fn contact(s: &State, i: usize, here: &Body, j: usize, impulse: DVec3) -> Contact {
    if impulse == DVec3::ZERO {
        return Contact::default();
    }
    let Touch { gap, n } = meet(s, i, here, j);
    let force = impulse * (1.0 / s.params.dt);
    let arm = (here.place.radius + 0.5 * gap) * n;
    Contact { gap, closed: true, force, arm, spring: force - force.dot(n) * n, ..Contact::default() }
}

/// Gap and normal of grain i and neighbour j, which may be a wall.
pub fn meet(s: &State, i: usize, here: &Body, j: usize) -> Touch {
    match j.checked_sub(s.sizes.bodies) {
        None => {
            let rest = here.residue.radius + residue_of(s, j).radius;
            touch_grain(way_to(s, i, j), here.place.radius, s.place[j].radius, rest)
        }
        Some(w) => touch_wall(&s.wall[w], &here.place, here.residue),
    }
}

/// The slots of grain i that hold a neighbour.
pub fn filled(s: &State, i: usize) -> impl Iterator<Item = usize> + '_ {
    s.row(i).take_while(|&slot| s.neighbour[slot] != NONE)
}

/// Those of them that take part in passes.
pub fn taking_part(s: &State, i: usize) -> impl Iterator<Item = usize> + '_ {
    filled(s, i).filter(|&slot| s.neighbour[slot] & SPRUNG != 0)
}

/// Sum and moment of the impulses of grain i, N s and N m s.
pub fn gathered(s: &State, i: usize) -> Gathered {
    let mut sum = Gathered::default();
    for slot in filled(s, i) {
        add_impulse(&mut sum, s, slot, kept_spring(&s.spring[slot]));
    }
    sum
}

/// One more impulse.
pub fn add_impulse(sum: &mut Gathered, s: &State, slot: usize, impulse: DVec3) {
    sum.force += impulse;
    sum.torque += super::dimension::moment(s.lever[slot].own * s.meeting[slot].n, impulse);
}

/// Keep the sums over the bodies of every group.
pub fn keep_efforts(s: &mut State, of_body: impl Fn(&State, usize) -> Effort + Sync) {
    let sums = by_group(s.sizes.bodies, |i| of_body(s, i));
    s.effort[..sums.len()].copy_from_slice(&sums);
}

/// The same for clumps, whose groups come after those of the bodies.
pub fn keep_efforts_of_clumps(s: &mut State, of_clump: impl Fn(&State, usize) -> Effort + Sync) {
    let sums = by_group(s.sizes.clumps, |c| of_clump(s, c));
    s.effort[s.sizes.bodies.div_ceil(GROUP)..][..sums.len()].copy_from_slice(&sums);
}

fn by_group(items: usize, of_item: impl Fn(usize) -> Effort + Sync) -> Vec<Effort> {
    let groups = (0..items.div_ceil(GROUP)).into_par_iter();
    let of = |g: usize| g * GROUP..((g + 1) * GROUP).min(items);
    groups.map(|g| of(g).map(&of_item).fold(Effort::default(), combined)).collect()
}
