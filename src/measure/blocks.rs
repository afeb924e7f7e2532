//! Sums over grains on the CPU engine, with contacts computed in blocks.

use super::{
    add_works,
    body_sums::{BodySums, fixed_power, is_single, share, stiffness_of},
    measure, measure_for_servo,
    wall_sums::{self, Load, Of},
};
use crate::{
    body::{ForceTorque, blocks::by_body, bodies::body},
    contact::{
        batch::{Batch, Kept, LANES, OfGrains, Row, Rows, Springs, at, index, lanes_of, set},
        blocks::{Block, Blocks, Single, Task, Workspace},
        history::History,
        law::{Contact, GrainPair, energy_forgotten_by_grains, forgotten_energy, grain_contact},
        rolling::RollingHistory,
        state::Law,
        tangential::TangentialHistory,
    },
    model::Growth,
    space::dimension::outer_above,
    state::{HALTED, PartialSums, State},
};
use glam::DVec3;
use rayon::prelude::*;
use std::cell::RefCell;

thread_local!(static WORKSPACE: RefCell<Workspace<BodySums>> = RefCell::default());

/// Stands in for the twin of `measure`.
pub fn measure(blocks: &mut Blocks, s: &mut State) {
    let of_bodies = sums_of_bodies(blocks, s);
    measure::add_up(s, &of_bodies);
}

/// Stands in for the twin of `measure_for_servo`.
pub fn measure_for_servo(blocks: &mut Blocks, s: &mut State) {
    if measure_for_servo::is_due(s) {
        measure(blocks, s);
    }
}

/// Stands in for the twin of `add_works`.
pub fn add_works(blocks: &mut Blocks, s: &mut State) {
    if s.halt[0] < HALTED {
        let of_bodies = sums_of_bodies(blocks, s);
        add_works::add_up(s, &of_bodies);
    }
}

/// Stands in for the twin of `wall_loads`.
pub fn wall_loads(blocks: &mut Blocks, s: &mut State) {
    sum_of_walls(blocks, s, Of::All);
}

/// Stands in for the twin of `wall_loads_for_servo`.
pub fn wall_loads_for_servo(blocks: &mut Blocks, s: &mut State) {
    if measure_for_servo::is_due(s) {
        sum_of_walls(blocks, s, Of::Driven);
    }
}

/// Contacts with walls are in no batch of pairs.
fn sum_of_walls(blocks: &mut Blocks, s: &mut State, of: Of) {
    blocks.update(s);
    let of_contact = |(i, one): (usize, &Single)| {
        let here = body(s, i);
        Load::of(s, of, i, &here, one.other as usize, || one.contact(s, i, &here))
    };
    let loads: Vec<Load> = blocks.singles().filter_map(of_contact).collect();
    wall_sums::add_up(s, loads);
}

fn sums_of_bodies(blocks: &mut Blocks, s: &State) -> Vec<PartialSums> {
    blocks.update(s);
    let mut of_bodies = vec![PartialSums::default(); s.sizes.bodies];
    let tasks = by_body(&mut of_bodies, s).map(AddUp);
    blocks.run(s, &WORKSPACE, tasks).for_each(|()| ());
    of_bodies
}

/// What the sums take of contacts side by side.
#[derive(Default)]
struct Measured {
    force: Rows,
    torque: Rows,
    torque_to: Rows,
    damping: Rows,
    couple_damping: Rows,
    elastic: Row,
    contact_force: Row,
    dissipation: Row,
    sliding: Row,
    virial: Rows,
    virial_above: Rows,
    stiffness: Row,
    overlap: Row,
    single: [bool; LANES],
}

impl Kept for Measured {
    #[inline(always)]
    fn store(&mut self, lane: usize, pair: &GrainPair, contact: &Contact) {
        let single = (pair.inverse_mass == 0.0) | (pair.inverse_mass_to == 0.0);
        let share = share(single);
        set(&mut self.force, lane, contact.force);
        set(&mut self.torque, lane, contact.torque);
        set(&mut self.torque_to, lane, contact.torque_to);
        set(&mut self.damping, lane, contact.damping);
        set(&mut self.couple_damping, lane, contact.couple_damping);
        self.elastic[lane] = share * contact.energy;
        self.contact_force[lane] = share * (contact.force - contact.damping).length();
        self.dissipation[lane] = share * (contact.dashpot + contact.sliding);
        self.sliding[lane] = share * contact.sliding;
        set(&mut self.virial, lane, share * (contact.force * contact.branch));
        set(&mut self.virial_above, lane, share * outer_above(contact.force, contact.branch));
        self.stiffness[lane] = share * stiffness_of(contact);
        self.overlap[lane] = -contact.gap / pair.radius.min(pair.radius_to);
        self.single[lane] = single;
    }
}

impl Measured {
    /// What a contact adds to the sums of its first grain, and to those of the second.
    #[inline(always)]
    fn sums(&self, lane: usize) -> [BodySums; 2] {
        let (force, damping) = (at(&self.force, lane), at(&self.damping, lane));
        let (torque, couple_damping) = (at(&self.torque, lane), at(&self.couple_damping, lane));
        let first = BodySums {
            contacts: ForceTorque { force, torque },
            dashpots: ForceTorque { force: damping, torque: couple_damping },
            elastic: self.elastic[lane],
            contact_force: self.contact_force[lane],
            dissipation: self.dissipation[lane],
            sliding: self.sliding[lane],
            overlap: self.overlap[lane],
            virial: at(&self.virial, lane),
            virial_above: at(&self.virial_above, lane),
            stiffness: self.stiffness[lane],
            sides: 1,
            single_sides: u32::from(self.single[lane]),
            ..BodySums::default()
        };
        let second = BodySums {
            contacts: ForceTorque { force: -force, torque: at(&self.torque_to, lane) },
            dashpots: ForceTorque { force: -damping, torque: -couple_damping },
            ..first
        };
        [first, second]
    }
}

/// The task: what the grains of a block have.
struct AddUp<'a>(&'a mut [PartialSums]);

impl Task for AddUp<'_> {
    type Sum = BodySums;
    type Output = ();

    #[inline(always)]
    fn run(self, s: &State, block: &mut Block, workspace: &mut Workspace<BodySums>) {
        add_contacts_of_grains(s, block, workspace);
        let mut single = block.single.iter().peekable();
        for (k, (of_body, sums)) in self.0.iter_mut().zip(&mut workspace.sums[..]).enumerate() {
            let i = block.grains.start + k;
            let here = body(s, i);
            while let Some(one) = single.next_if(|one| one.grain == k as u32) {
                let (contact, j) = (one.contact(s, i, &here), one.other as usize);
                if contact.is_active {
                    sums.add_contact(s, i, &here, j, &contact);
                } else if one.is_active {
                    sums.add_opened(s, is_single(s, j), forgotten_energy(s, i, &here, j, one.history));
                }
            }
            if here.velocity.inverse_mass != 0.0 {
                *of_body = sums.of_body(s, i, &here);
            }
        }
    }
}

#[inline(always)]
fn add_contacts_of_grains(s: &State, block: &Block, workspace: &mut Workspace<BodySums>) {
    block.begin(s, workspace);
    let Workspace { grains, sums } = workspace;
    let mut batch: Batch<Measured> = Batch::new(s);
    for (group, pairs) in block.pairs.iter().enumerate() {
        let (mut is_active, mut force) = (block.is_active[group], block.force[group]);
        let mut torque = block.torque.get(group).copied();
        let mut springs = Springs { is_active: &mut is_active, force: &mut force, torque: torque.as_mut() };
        batch.compute(s, grains, pairs, block.materials.get(group), &mut springs);
        let (measured, was_active, lanes) = (&batch.contacts, &block.is_active[group], block.lanes(group));
        for lane in lanes_of::<LANES>(lanes, |lane| is_active[lane] | was_active[lane]) {
            let [first, second] = pairs.map(|indices| index(indices[lane]));
            if !is_active[lane] {
                let forgotten = energy_forgotten_by_grains(Law::of(s), &batch.pair(lane, history(block, group, lane)));
                for k in [first, second] {
                    sums[k].add_opened(s, measured.single[lane], forgotten);
                }
                continue;
            }
            let of_contact = measured.sums(lane);
            sums[first].add(&of_contact[0]);
            sums[second].add(&of_contact[1]);
            if s.model.growth == Growth::Some {
                let share = share(measured.single[lane]);
                let pair = batch.pair(lane, History::default());
                let power = share * pair.growth_power(s.model.normal, at(&measured.force, lane));
                for k in [first, second] {
                    sums[k].growth_power += power;
                }
            }
            if measured.single[lane] {
                let pair = batch.pair(lane, history(block, group, lane));
                add_fixed_power(s, block, pairs.map(|indices| indices[lane]), &pair, sums);
            }
        }
    }
}

/// Work of the fixed one of two grains on the other, per time.
fn add_fixed_power(s: &State, block: &Block, [a, b]: [u16; 2], pair: &GrainPair, sums: &mut OfGrains<BodySums>) {
    let (free, fixed, seen) = if pair.inverse_mass != 0.0 { (a, b, *pair) } else { (b, a, pair.reversed()) };
    let (here, contact) = (body(s, block.body(free)), grain_contact(Law::of(s), &seen, true));
    sums[index(free)].fixed_power += fixed_power(s, &here, block.body(fixed), &contact);
}

/// What the first of a pair remembers.
fn history(block: &Block, group: usize, lane: usize) -> History {
    let torque = block.torque.get(group).map_or(DVec3::ZERO, |torque| at(torque, lane));
    History {
        tangential: TangentialHistory { force: at(&block.force[group], lane) },
        rolling: RollingHistory { torque },
    }
}
