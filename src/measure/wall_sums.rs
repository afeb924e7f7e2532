//! Twin of `shaders/measure/wall_sums.wgsl`: what free grains do to walls at step n, in an order that no sorting changes.

use crate::{
    body::{Body, bodies::body},
    contact::law::Contact,
    measure::{
        body_sums::{STEEPEST, couple},
        contacts::contact_of,
    },
    space::dimension::moment,
    state::{INDEX, NONE, Spin, State, WallLoad},
};
use rayon::prelude::*;

/// All walls, or driven ones alone.
#[derive(Clone, Copy, PartialEq)]
pub enum Of {
    All,
    Driven,
}

impl Of {
    fn has(self, s: &State, wall: usize) -> bool {
        self == Of::All || s.wall[wall].driven != 0
    }
}

pub fn sum(s: &mut State, of: Of) {
    let bodies = (0..s.sizes.bodies).into_par_iter().with_min_len(64);
    let loads: Vec<Load> = bodies.flat_map_iter(|i| of_grain(s, of, i)).collect();
    add_up(s, loads);
}

/// Of grain i.
fn of_grain(s: &State, of: Of, i: usize) -> impl Iterator<Item = Load> {
    // Walls come last, behind them what a slice leaves empty.
    let row = s.row(i);
    let entries = (0..row.len()).rev().filter_map(move |k| row.clone().nth(k));
    let other = |entry: usize| (s.neighbour[entry] & INDEX) as usize;
    let of_walls = entries.skip_while(|entry| s.neighbour[*entry] == NONE);
    let of_walls = of_walls.take_while(move |entry| other(*entry) >= s.sizes.bodies);
    of_walls.filter(move |entry| of.has(s, other(*entry) - s.sizes.bodies)).filter_map(move |entry| {
        let (here, j) = (body(s, i), other(entry));
        Load::of(s, of, i, &here, j, || contact_of(s, i, &here, j, entry))
    })
}

/// What a grain does to a wall.
pub struct Load {
    number: u32,
    wall: u32,
    load: WallLoad,
}

impl Load {
    /// Of the contact of body i with neighbour j: none if that is no wall that counts, the contact is open or the body is
    /// fixed.
    pub fn of(s: &State, of: Of, i: usize, here: &Body, j: usize, contact: impl Fn() -> Contact) -> Option<Load> {
        let wall = j.checked_sub(s.sizes.bodies).filter(|wall| of.has(s, *wall))?;
        let contact = contact();
        if !contact.is_active || here.velocity.inverse_mass == 0.0 {
            return None;
        }
        let arm = (here.position.x - s.wall[wall].point) + contact.arm;
        let n = contact.arm / contact.arm.length();
        // Rigid grains store nothing, and have no stiffness.
        let is_elastic = contact.gap < 0.0 && contact.energy > 0.0;
        let load = WallLoad {
            force: -contact.force,
            moment: Spin(-(moment(arm, contact.force) + couple(&contact))),
            normal_force: -contact.force.dot(n),
            stiffness: match is_elastic {
                true => STEEPEST * (contact.damping - contact.force).dot(n).max(0.0) / -contact.gap,
                false => 0.0,
            },
        };
        Some(Load { number: s.id[i], wall: wall as u32, load })
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
        sum.normal_force += load.normal_force;
        sum.stiffness += load.stiffness;
    }
}
