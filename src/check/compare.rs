//! How far twin and device are apart: values with their masks and floors.

use crate::{
    body::grains::{member_ids, same_grain},
    contact::overlap::overlaps,
    model::{Method, Precision},
    neighbours::grid::for_candidates,
    space::{boundary::nearest_image, precision::position_low_of, walls::wall_separation},
    stage::{Stage, Undecided},
    state::{Array, Element, Length, PARTIAL_SUMS as ROWS, PartialSums, ResidualSums, State, Velocity, Wall, array::*},
};
use glam::DVec3;

/// For each body, or clump, whether rounding decides what a stage makes of it. Empty: of none.
pub fn undecided(s: &State, of: Undecided) -> Vec<bool> {
    match of {
        Undecided::Nothing => Vec::new(),
        Undecided::Contacts => contacts(s),
        Undecided::ContactsOfClumps => contacts_of_clumps(s),
        Undecided::Reach => reach(s),
    }
}

/// Grains with a contact so close to opening that rounding decides whether it is one. With a dashpot the force jumps
/// there, so no tolerance can hold for them.
fn contacts(s: &State) -> Vec<bool> {
    let limit = 16.0 * s.model.precision.epsilon();
    (0..s.sizes.bodies).map(|i| overlaps(s, i).any(|o| o.relative.abs() < limit)).collect()
}

/// Clumps with such a member.
fn contacts_of_clumps(s: &State) -> Vec<bool> {
    let members = contacts(s);
    (0..s.sizes.clumps).map(|c| member_ids(s, c).any(|member_id| members[s.index_of_id[member_id] as usize])).collect()
}

/// Grains with a neighbour so close to the reach of the lists that rounding decides whether it is listed.
fn reach(s: &State) -> Vec<bool> {
    let rounding = 16.0 * s.model.precision.epsilon();
    let margin = s.params.margin;
    let grain = |i: usize, j: usize| {
        let reach = s.position[i].radius + s.position[j].radius + margin + s.params.position_slack;
        let distance = nearest_image(s, s.position[i].x, s.position[j].x, DVec3::ZERO).x.length();
        let slack = 1e-5 * s.position[i].radius;
        [0.0, slack].iter().any(|more| (distance - (reach + more)).abs() < rounding * reach)
    };
    let wall = |i: usize, wall: &Wall| {
        let here = &s.position[i];
        let gap = wall_separation(wall, here, position_low_of(s, i)).gap;
        let scale = (here.x - wall.point).length() + here.radius;
        [1.0, 2.0].iter().any(|reach| (gap - reach * margin).abs() < rounding * scale)
    };
    let near = |i: usize| {
        let mut near = false;
        for_candidates(s, s.position[i].x, |j| near |= !same_grain(s, i, j) && grain(i, j));
        near
    };
    (0..s.sizes.bodies).map(|i| near(i) || s.wall[..s.sizes.walls].iter().any(|w| wall(i, w))).collect()
}

/// Whether a row of an array follows from something undecided.
fn is_masked(s: &State, stage: &Stage, array: &Array, undecided: &[bool], row: usize) -> bool {
    let of_clumps = stage.check.undecided == Undecided::ContactsOfClumps;
    let is_undecided = |row: usize| undecided.get(row).is_some_and(|u| *u);
    match array.length {
        _ if undecided.is_empty() => false,
        Length::Bodies if of_clumps => is_undecided(s.clump_of_id[s.id[row] as usize] as usize),
        Length::Bodies | Length::BodiesPlusOne | Length::Clumps | Length::OnDemand => is_undecided(row),
        Length::Entries => is_undecided(owner(s, row)),
        Length::PartialSums => (row..undecided.len()).step_by(ROWS).any(is_undecided),
        _ => false,
    }
}

/// What differences in a member of an array are measured against at least.
fn floor(s: &State, stage: &Stage, array: &Array, member: usize) -> f64 {
    let declared = stage.check.floors.iter().find(|(arrays, _)| arrays.contains(&array)).map_or(0.0, |(_, of)| of(s));
    if *array == PARTIAL_SUMS {
        declared.max(partial_sums_floor(s, member))
    } else if *array == RESIDUAL_SUMS {
        declared.max(residual_sums_floor(s, ResidualSums::names(3)[member]))
    } else {
        declared
    }
}

/// Worst and RMS relative difference of an array between twin and device.
pub fn compare(twin: &State, device: &State, stage: &Stage, array: &Array, undecided: &[bool]) -> (f64, f64) {
    // A value and what single precision leaves out of it are compared together.
    let single = twin.model.precision == Precision::Single;
    if *array == POSITION_LOW_NEXT {
        return positions(twin, device, undecided);
    } else if *array == CENTER_LOW_NEXT {
        return centers(twin, device);
    } else if *array == ORIENTATION_LOW_NEXT || (*array == ORIENTATION_NEXT && single) {
        return orientations(twin, device);
    } else if *array == ROTATION_ITERATIONS {
        return rotation_iterations(twin, device);
    }
    let lanes = |s: &State| {
        let mut lanes = Vec::new();
        s.column(array).lanes(twin.model.dims(), &mut |x| lanes.push(x));
        lanes
    };
    let (mut a, mut b) = (lanes(twin), lanes(device));
    if stage.check.unordered.contains(&array) {
        a.sort_by(f64::total_cmp);
        b.sort_by(f64::total_cmp);
    }
    if *array == COUNTERS {
        return counters(&a, &b);
    }
    let width = a.len() / twin.column(array).len().max(1);
    let masked = |k: usize| is_masked(twin, stage, array, undecided, k / width);
    if twin.column(array).integer() {
        let different = (0..a.len()).filter(|k| a[*k] != b[*k] && !masked(*k)).count();
        return (different as f64 / a.len() as f64, 0.0);
    }
    // Members of a record have different units, so each is compared with its own largest value; vectors as a whole.
    let mut result = (0.0_f64, 0.0_f64);
    for (member, members) in member_lanes(twin, array, width).into_iter().enumerate() {
        let floor = floor(twin, stage, array, member);
        let (mut worst, mut largest, mut squares, mut scale) = (0.0_f64, floor, 0.0, 0.0);
        for k in (0..a.len()).filter(|k| members.contains(&(k % width)) && !masked(*k)) {
            let difference = (a[k] - b[k]).abs();
            // NaN must fail, and f64::max would swallow it.
            worst = if difference.is_nan() { f64::INFINITY } else { worst.max(difference) };
            largest = largest.max(a[k].abs());
            squares += difference * difference;
            scale += a[k] * a[k];
        }
        let relative = |d: f64, of: f64| if d == 0.0 { 0.0 } else { d / of };
        result.0 = result.0.max(relative(worst, largest));
        let own = scale.sqrt().max(floor * (a.len() as f64).sqrt());
        result.1 = result.1.max(relative(squares.sqrt(), own));
    }
    result
}

/// What sums over contacts that are solved may differ by for a member of [`ResidualSums`]: the square of the rounding of velocities,
/// (m/s)², and the energy of that, J.
fn residual_sums_floor(s: &State, member: &str) -> f64 {
    let squares = |of: fn(&Velocity) -> f64| {
        s.extrapolated_velocity.iter().map(of).fold(0.0, f64::max) * s.model.precision.epsilon()
    };
    match member {
        "residual_squared" => squares(|m| m.v.length_squared()),
        "restart_criterion" | "curvature" | "step_squared" => {
            squares(|m| if m.inverse_mass == 0.0 { 0.0 } else { m.v.length_squared() / m.inverse_mass })
        }
        _ => 0.0,
    }
}

/// What sums over grains at rest may differ by for a member of [`PartialSums`]: the energy, J, that gravity gives the heaviest in a step,
/// what global damping takes of it, W, and in contact dynamics the contact forces that balance, N.
fn partial_sums_floor(s: &State, member: usize) -> f64 {
    let lightest = s.velocity.iter().map(|m| m.inverse_mass).filter(|m| *m > 0.0).fold(f64::INFINITY, f64::min);
    let kinetic = 0.5 * (s.params.gravity.length() * s.params.dt).powi(2) / lightest;
    match PartialSums::names(3)[member] {
        "kinetic" => kinetic,
        "net_force" if s.model.method == Method::ContactDynamics => {
            s.partial_sums.iter().map(|part| part.contact_force).fold(0.0, f64::max)
        }
        "dissipation" => 2.0 * s.params.damping * kinetic,
        _ => 0.0,
    }
}

/// Lanes of each member of a record: a vector is one member. Plain arrays have one.
fn member_lanes(s: &State, array: &Array, width: usize) -> Vec<std::ops::Range<usize>> {
    let names = s.column(array).names(s.model.dims());
    if names.is_empty() || names.starts_with(&["x", "y"]) {
        return std::iter::once(0..width).collect();
    }
    let vectors = ["x", "v", "point", "low", "normal", "velocity"];
    let mut at = 0;
    names
        .iter()
        .map(|name| {
            let len = if vectors.contains(name) { s.model.dims() } else { 1 };
            at += len;
            at - len..at
        })
        .collect()
}

/// The grain a list entry belongs to.
fn owner(s: &State, entry: usize) -> usize {
    s.list_start[..s.sizes.bodies].partition_point(|begin| *begin as usize <= entry).saturating_sub(1)
}

/// Flags must agree; the displacement is a number behind its bits.
fn counters(a: &[f64], b: &[f64]) -> (f64, f64) {
    const DISPLACEMENT: usize = 2;
    let flags = (0..a.len()).filter(|k| *k != DISPLACEMENT && a[*k] != b[*k]).count() as f64;
    let displacement = |c: &[f64]| f64::from(f32::from_bits(c[DISPLACEMENT] as u32));
    let (x, y) = (displacement(a), displacement(b));
    let difference = if x == y { 0.0 } else { (x - y).abs() / x.max(y) };
    (flags.max(difference), difference)
}

/// Positions with their low parts: the difference over the largest displacement of this step, which is what must not be
/// lost. (Either part alone may differ by a whole unit in the last place of the position.)
fn positions(twin: &State, device: &State, undecided: &[bool]) -> (f64, f64) {
    let displacement = twin.velocity_next.iter().map(|m| m.v.abs().max_element()).fold(0.0, f64::max) * twin.params.dt;
    // Members of clumps are put at the ends of arms, anew in every step, with 34 bits of the longest of these.
    let arm = twin.member_offset.iter().map(|arm| arm.0.length()).fold(0.0, f64::max);
    let largest = displacement.max(arm * 2f64.powi(-15)).max(twin.params.quantum / 64.0);
    let decided = (0..twin.sizes.bodies).filter(|i| !undecided.get(*i).is_some_and(|u| *u));
    let difference = |i: usize| {
        let rest = twin.position_low_next[i].x - device.position_low_next[i].x;
        ((twin.position_next[i].x - device.position_next[i].x) + rest).abs().max_element()
    };
    worst_and_rms(decided.map(difference), largest)
}

/// Rounding may make a round more or less.
fn rotation_iterations(twin: &State, device: &State) -> (f64, f64) {
    let (a, b) = (twin.rotation_iterations[0], device.rotation_iterations[0]);
    let different = a.most.abs_diff(b.most) > 1 || a.capped != b.capped;
    (f64::from(u8::from(different)), 0.0)
}

/// The same for the centres of clumps.
fn centers(twin: &State, device: &State) -> (f64, f64) {
    let largest = twin.clump_velocity_next.iter().map(|m| m.v.abs().max_element()).fold(0.0, f64::max) * twin.params.dt;
    let difference = |c: usize| {
        let rest = twin.center_low_next[c] - device.center_low_next[c];
        ((twin.center_next[c] - device.center_next[c]) + rest).abs().max_element()
    };
    worst_and_rms((0..twin.sizes.clumps).map(difference), largest.max(twin.params.quantum / 64.0))
}

/// The same for their orientations, over the largest rotation of this step.
fn orientations(twin: &State, device: &State) -> (f64, f64) {
    let largest = twin.clump_spin_next.iter().map(|w| w.0.abs().max_element()).fold(0.0, f64::max);
    let difference = |c: usize| {
        let rest = twin.orientation_low_next[c].0 - device.orientation_low_next[c].0;
        ((twin.orientation_next[c].0 - device.orientation_next[c].0) + rest).abs().max_element()
    };
    // At rest, some units in the last place of the low parts are what their lengths are corrected by.
    worst_and_rms((0..twin.sizes.clumps).map(difference), (0.5 * largest * twin.params.dt).max(2f64.powi(-16)))
}

/// The largest difference and their root mean square, over a scale.
fn worst_and_rms(differences: impl Iterator<Item = f64>, scale: f64) -> (f64, f64) {
    let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0.0_f64);
    for difference in differences {
        worst = if difference.is_nan() { f64::INFINITY } else { worst.max(difference) };
        squares += difference * difference;
        count += 1.0;
    }
    if worst == 0.0 { (0.0, 0.0) } else { (worst / scale, (squares / count).sqrt() / scale) }
}
