//! Twin of `shaders/measure/wall_loads.wgsl`: what free grains do to walls at step n, in an order that no sorting
//! changes.

use crate::{
    body::{Body, bodies::body},
    contact::law::Contact,
    measure::{body_sums::couple, contacts::contact_of},
    space::dimension::moment,
    state::{INDEX, NONE, Spin, State, WallLoad},
};
use rayon::prelude::*;

pub fn wall_loads(s: &mut State) {
    let loads: Vec<Load> =
        (0..s.sizes.bodies).into_par_iter().with_min_len(64).flat_map_iter(|i| of_grain(s, i)).collect();
    add_up(s, loads);
}

/// Of grain i.
fn of_grain(s: &State, i: usize) -> impl Iterator<Item = Load> {
    // Walls come last, behind them what a slice leaves empty.
    let row = s.row(i);
    let entries = (0..row.len()).rev().filter_map(move |k| row.clone().nth(k));
    let other = |entry: usize| (s.neighbour[entry] & INDEX) as usize;
    let of_walls = entries.skip_while(|entry| s.neighbour[*entry] == NONE);
    of_walls.take_while(move |entry| other(*entry) >= s.sizes.bodies).filter_map(move |entry| {
        let (here, j) = (body(s, i), other(entry));
        Load::of(s, i, &here, j, &contact_of(s, i, &here, j, entry))
    })
}

/// What a grain does to a wall.
pub struct Load {
    number: u32,
    wall: u32,
    load: WallLoad,
}

impl Load {
    /// Of the contact of body i with neighbour j: none if that is no wall, the contact is open or the body is fixed.
    pub fn of(s: &State, i: usize, here: &Body, j: usize, contact: &Contact) -> Option<Load> {
        let wall = j.checked_sub(s.sizes.bodies).filter(|_| contact.is_active && here.velocity.inverse_mass > 0.0)?;
        let arm = (here.position.x - s.wall[wall].point) + contact.arm;
        let moment = Spin(-(moment(arm, contact.force) + couple(contact)));
        Some(Load { number: s.id[i], wall: wall as u32, load: WallLoad { force: -contact.force, moment } })
    }
}

/// Row by row, in the order of the numbers.
pub fn add_up(s: &mut State, mut loads: Vec<Load>) {
    let (rows, walls) = (s.sizes.partial_sums(), s.sizes.walls);
    loads.par_sort_unstable_by_key(|load| (load.number, load.wall));
    s.wall_load_sums.fill(WallLoad::default());
    for Load { number, wall, load } in loads {
        let sum = &mut s.wall_load_sums[number as usize % rows * walls + wall as usize];
        sum.force += load.force;
        sum.moment.0 += load.moment.0;
    }
}
