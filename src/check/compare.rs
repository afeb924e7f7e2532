//! How far twin and device are apart: values with their masks and floors. What is measured how is data: of stages in
//! [`crate::stage::Check`], of arrays in [`super::rules`].

use super::rules::{Rule, rule};
use crate::{
    body::grains::{member_ids, same_grain},
    contact::overlap::overlaps,
    neighbours::{
        grid::{counting_slack, for_candidates},
        levels::level_of,
    },
    space::{boundary::nearest_image, precision::position_low_of, walls::wall_separation},
    stage::{Stage, Undecided},
    state::{Array, Length, Level, State, Wall, array::WORKS},
};
use glam::DVec3;
use std::{cmp::Ordering, ops::Range};

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
    let grain = |i: usize, j: usize, level: &Level| {
        let reach = s.position[i].radius + s.position[j].radius + margin + s.params.position_slack;
        let distance = nearest_image(s, s.position[i].x, s.position[j].x, DVec3::ZERO).x.length();
        [0.0, counting_slack(level)].iter().any(|more| (distance - (reach + more)).abs() < rounding * reach)
    };
    let wall = |i: usize, wall: &Wall| {
        let here = &s.position[i];
        let gap = wall_separation(wall, here, position_low_of(s, i)).gap;
        let scale = (here.x - wall.point).length() + here.radius;
        [1.0, 2.0].iter().any(|reach| (gap - reach * margin).abs() < rounding * scale)
    };
    let of_walls = |i: usize| s.wall[..s.sizes.walls].iter().any(|w| wall(i, w));
    let mut near: Vec<bool> = (0..s.sizes.bodies).map(of_walls).collect();
    for i in 0..s.sizes.bodies {
        for level in &s.level[level_of(s, s.position[i].radius)..] {
            for_candidates(s, &s.position[i], level, |j| {
                let undecided = !same_grain(s, i, j) && grain(i, j, level);
                near[i] |= undecided;
                near[j] |= undecided;
            });
        }
    }
    near
}

/// Whether a row of an array follows from something undecided.
fn is_masked(s: &State, stage: &Stage, array: &Array, undecided: &[bool], row: usize) -> bool {
    let row = if *array == WORKS { s.index_of_id[row] as usize } else { row }; // by number
    let of_clumps = stage.check.undecided == Undecided::ContactsOfClumps;
    let is_undecided = |row: usize| undecided.get(row).is_some_and(|u| *u);
    match array.length {
        // What is behind the contacts that there are is of nobody: an alias may have left numbers there that are none.
        Length::History => s.history_start.last().is_none_or(|end| row >= *end as usize),
        _ if undecided.is_empty() => false,
        Length::Bodies if of_clumps => is_undecided(s.clump_of_id[s.id[row] as usize] as usize),
        Length::Bodies | Length::BodiesPlusOne | Length::Clumps | Length::OnDemand => is_undecided(row),
        Length::SlicesPlusOne if row < s.sizes.slices() => s.sizes.lists_of_slice(row).0.any(is_undecided),
        Length::Entries => owner(s, row).is_some_and(is_undecided),
        Length::WallLoadSums => is_masked_row(s, undecided, row / s.sizes.walls),
        Length::WallLoads => undecided.contains(&true),
        Length::PartialSums => is_masked_row(s, undecided, row),
        _ => false,
    }
}

/// Whether one of the bodies is undecided that a row of the measurement adds up.
fn is_masked_row(s: &State, undecided: &[bool], row: usize) -> bool {
    (row..undecided.len()).step_by(s.sizes.partial_sums()).any(|body| undecided[body])
}

/// What differences in some lanes of an array are measured against at least.
fn floor(s: &State, stage: &Stage, array: &Array, lanes: Range<usize>) -> f64 {
    let check = &stage.check;
    let of_array = check.floors.iter().filter(|(arrays, _)| arrays.contains(&array)).map(|(_, of)| of(s));
    let of_members = check.member_floors.iter().filter(|(floored, _)| *floored == array);
    let of_members = of_members.flat_map(|(_, of)| of(s)[lanes.clone()].to_vec());
    of_array.chain(of_members).fold(0.0, f64::max)
}

/// Worst and RMS relative difference of an array between twin and device.
pub fn compare(twin: &State, device: &State, stage: &Stage, array: &Array, undecided: &[bool]) -> (f64, f64) {
    let masked = |row: usize| is_masked(twin, stage, array, undecided, row);
    match rule(array) {
        Some(Rule::Records(difference)) => {
            let difference = difference(twin, device);
            return (difference, difference);
        }
        Some(Rule::Parts { value, low, scale }) if !twin.column(low[0]).is_empty() => {
            return parts(twin, device, value, low, scale(twin), masked);
        }
        Some(Rule::Velocities { of, scales }) => {
            return velocities(twin, device, *of, scales(twin), twin.column(array).len(), masked);
        }
        _ => {}
    }
    let column = twin.column(array);
    let widths = column.widths(twin.model.dims());
    let width: usize = widths.iter().sum();
    let (mut a, mut b) = (lanes(twin, array), lanes(device, array));
    let runs = match &stage.check {
        check if check.unordered.contains(&array) => vec![(0..column.len()).collect()],
        check if check.unordered_lists.contains(&array) => lists(twin),
        _ => Vec::new(),
    };
    for run in runs {
        sort_rows(&mut a, width, &run);
        sort_rows(&mut b, width, &run);
    }
    if column.integer() {
        let different = (0..a.len()).filter(|k| a[*k] != b[*k] && !masked(*k / width)).count();
        return (different as f64 / a.len() as f64, 0.0);
    }
    // Members of a record have different units, so each is compared with its own largest value; vectors as a whole.
    let mut result = (0.0_f64, 0.0_f64);
    let mut end = 0;
    for len in widths {
        let members = end..end + len;
        end += len;
        let floor = floor(twin, stage, array, members.clone());
        let (mut worst, mut largest, mut squares, mut scale) = (0.0_f64, floor, 0.0, 0.0);
        for k in (0..a.len()).filter(|k| members.contains(&(k % width)) && !masked(k / width)) {
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

/// All numbers of an array.
fn lanes(s: &State, array: &Array) -> Vec<f64> {
    let mut lanes = Vec::new();
    s.column(array).lanes(s.model.dims(), &mut |x| lanes.push(x));
    lanes
}

/// Put these rows of an array into ascending order.
fn sort_rows(lanes: &mut [f64], width: usize, which: &[usize]) {
    let mut rows: Vec<Vec<f64>> = which.iter().map(|row| lanes[row * width..][..width].to_vec()).collect();
    rows.sort_by(|a, b| a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal));
    which.iter().zip(rows).for_each(|(row, sorted)| lanes[row * width..][..width].copy_from_slice(&sorted));
}

/// The difference of values with their low parts over a scale: either part alone may differ by a whole unit in the last
/// place.
fn parts(
    twin: &State,
    device: &State,
    value: &Array,
    low: &[&Array],
    scale: f64,
    masked: impl Fn(usize) -> bool,
) -> (f64, f64) {
    let mut differences = vec![0.0; lanes(twin, value).len()];
    for array in [&[value], low].concat() {
        let both = lanes(twin, array).into_iter().zip(lanes(device, array));
        differences.iter_mut().zip(both).for_each(|(sum, (a, b))| *sum += a - b);
    }
    let width: usize = twin.column(value).widths(twin.model.dims()).iter().sum();
    let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0.0_f64);
    for (_, difference) in differences.iter().enumerate().filter(|(k, _)| !masked(k / width)) {
        let difference = difference.abs();
        worst = if difference.is_nan() { f64::INFINITY } else { worst.max(difference) };
        squares += difference * difference;
        count += 1.0;
    }
    if worst == 0.0 { (0.0, 0.0) } else { (worst / scale, (squares / count).sqrt() / scale) }
}

/// The differences of velocities and spins with what single precision leaves out of them, over scales.
fn velocities(
    twin: &State,
    device: &State,
    of: fn(&State, usize) -> [DVec3; 2],
    scales: [f64; 2],
    rows: usize,
    masked: impl Fn(usize) -> bool,
) -> (f64, f64) {
    let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0.0_f64);
    for row in (0..rows).filter(|row| !masked(*row)) {
        let (a, b) = (of(twin, row), of(device, row));
        for ((a, b), scale) in a.into_iter().zip(b).zip(scales) {
            let difference = (a - b).abs().max_element();
            let relative = if difference == 0.0 { 0.0 } else { difference / scale };
            worst = if relative.is_nan() { f64::INFINITY } else { worst.max(relative) };
            squares += relative * relative;
            count += 1.0;
        }
    }
    (worst, (squares / count.max(1.0)).sqrt())
}

/// The entries of each list.
fn lists(s: &State) -> Vec<Vec<usize>> {
    (0..s.sizes.bodies).map(|i| s.row(i).collect()).collect()
}

/// The grain a list entry belongs to; the last slice may have entries of none.
fn owner(s: &State, entry: usize) -> Option<usize> {
    let slice = s.list_start[..s.sizes.slices()].partition_point(|begin| *begin as usize <= entry).saturating_sub(1);
    let (mut grains, lists) = s.sizes.lists_of_slice(slice);
    grains.nth(entry.saturating_sub(s.list_start[slice] as usize) % lists)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::{Model, Precision},
        stage::bodies,
        state::{ARRAYS, Params, Sizes, present},
    };

    /// A state of ones under every model of a precision, once for each set of arrays.
    fn states(precision: Precision) -> Vec<State> {
        let mut seen = Vec::new();
        let mut states = Vec::new();
        for model in Model::all(precision) {
            let arrays: Vec<&str> = present(&model, ARRAYS).iter().map(|a| a.name).collect();
            let key = (model.dims(), arrays);
            if !seen.contains(&key) {
                seen.push(key);
                let sizes =
                    Sizes { bodies: 2, clumps: 1, walls: 1, materials: 1, cells: 1, levels: 1, ..Sizes::default() };
                let mut s = State::new(model, sizes, Params { dt: 1.0, ..Params::default() });
                for array in present(&model, ARRAYS) {
                    s.column_mut(array).resize(3); // one more than there are bodies, for `history_start`
                    s.column_mut(array).fill(model.dims(), &mut || 1.0);
                }
                states.push(s);
            }
        }
        states
    }

    #[test]
    fn a_wrong_number_is_found_in_every_member_of_every_array() {
        let stage = Stage::new("", "", |_| (), bodies);
        for twin in [states(Precision::Single), states(Precision::Double)].concat() {
            let dims = twin.model.dims();
            for array in present(&twin.model, ARRAYS) {
                let right = lanes(&twin, array);
                let width: usize = twin.column(array).widths(dims).iter().sum();
                assert_eq!(width * twin.column(array).len(), right.len(), "{array:?}: widths");
                let named = twin.column(array).names(dims).len();
                let members = twin.column(array).widths(dims).len();
                assert!(named <= 1 || members == named || members == 1, "{array:?}: {members} members, {named} names");
                assert_eq!(compare(&twin, &twin, &stage, array, &[]), (0.0, 0.0), "{array:?}");
                // A spin in the plane needs one of two words.
                let unused = |k: usize| dims == 2 && k == 3 && array.original().ends_with("velocity_low");
                for wrong in (0..width).filter(|k| !unused(*k)) {
                    let mut device = twin.clone();
                    let mut k = 0;
                    device.column_mut(array).fill(dims, &mut || {
                        k += 1;
                        if k - 1 == wrong { 3.0 } else { 1.0 }
                    });
                    let (worst, _) = compare(&twin, &device, &stage, array, &[]);
                    // A bit of a low part is little beside what a step changes.
                    let least = if array.original().ends_with("velocity_low") { 0.0 } else { 1e-2 };
                    assert!(worst > least, "{array:?} in {dims} dimensions: number {wrong} is wrong by {worst} only");
                }
            }
        }
    }
}
