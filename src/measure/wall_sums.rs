//! Twin of `shaders/measure/wall_sums.wgsl`: what free grains do to walls at step n, in an order that no sorting changes.

use crate::{
    body::bodies::body,
    measure::{
        body_sums::{STEEPEST, couple},
        contacts::contact_of,
    },
    space::dimension::moment,
    state::{INDEX, NONE, Spin, State, WallLoad},
};
use rayon::prelude::*;

/// Row by row, of those walls that count.
pub fn add_up(s: &mut State, counts: impl Fn(&State, usize) -> bool + Sync) {
    let (rows, walls) = (s.sizes.partial_sums(), s.sizes.walls);
    let of_row = |k: usize| {
        let mut load = WallLoad::default();
        if counts(s, k % walls) {
            let numbers = (k / walls..s.sizes.bodies).step_by(rows);
            numbers.for_each(|number| add_body(s, s.index_of_id[number] as usize, k % walls, &mut load));
        }
        load
    };
    let sums: Vec<WallLoad> = (0..rows * walls).into_par_iter().with_min_len(64).map(of_row).collect();
    s.wall_load_sums[..sums.len()].copy_from_slice(&sums);
}

fn add_body(s: &State, i: usize, w: usize, load: &mut WallLoad) {
    let (row, j) = (s.row(i), s.sizes.bodies + w);
    // Walls come last, behind them what a slice leaves empty.
    let entries = (0..row.len()).rev().filter_map(|k| row.clone().nth(k));
    let is_before = |tagged: u32| tagged != NONE && (tagged & INDEX) as usize <= j;
    let Some(entry) = entries.into_iter().find(|entry| is_before(s.neighbour[*entry])) else { return };
    if (s.neighbour[entry] & INDEX) as usize != j || s.velocity[i].inverse_mass == 0.0 {
        return;
    }
    let here = body(s, i);
    let contact = contact_of(s, i, &here, j, entry);
    if contact.is_active {
        let arm = (here.position.x - s.wall[w].point) + contact.arm;
        load.force -= contact.force;
        load.moment = Spin(load.moment.0 - (moment(arm, contact.force) + couple(&contact)));
        let n = contact.arm / contact.arm.length();
        load.normal_force -= contact.force.dot(n);
        // Rigid grains store nothing, and have no stiffness.
        if contact.gap < 0.0 && contact.energy > 0.0 {
            load.stiffness += STEEPEST * (contact.damping - contact.force).dot(n).max(0.0) / -contact.gap;
        }
    }
}
