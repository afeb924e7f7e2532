//! Twin of `shaders/measure/wall_loads.wgsl`: what free grains do to walls at step n, in an order that no sorting
//! changes.

use crate::{
    body::bodies::body,
    measure::{body_sums::couple, contacts::contact_of},
    space::dimension::moment,
    state::{INDEX, NONE, Spin, State, WallLoad},
};
use rayon::prelude::*;

pub fn wall_loads(s: &mut State) {
    let (rows, walls) = (s.sizes.partial_sums(), s.sizes.walls);
    let of_row = |k: usize| {
        let mut load = WallLoad::default();
        let numbers = (k / walls..s.sizes.bodies).step_by(rows);
        numbers.for_each(|number| add_body(s, s.index_of_id[number] as usize, k % walls, &mut load));
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
    }
}
