//! What contacts remember, by the numbers of their grains: to be looked at, or to begin another simulation with.

use super::{
    Options, Simulation,
    lists::{resize, with_room},
    runner::{Runner, is_kept},
};
use crate::{
    engine::PIECE,
    error::Result,
    measure::{
        Contact, Other, Packing,
        micromechanics::{Totals, contact::contacts_of},
    },
    memory,
    model::History,
    scene::{Assembly, Clump, Grain, Wall},
    state::{
        ACTIVE, Array, INDEX, Length, NONE, Packed, Sizes, Spin, State,
        array::{
            CELL, CLUMP_OF_ID, GROWTH_RATE, ID, IMPULSE, LIST_START, MATERIAL, NEIGHBOUR, POSITION, POSITION_LOW,
            ROLLING_TORQUE, SPIN, TANGENTIAL_FORCE, VELOCITY, WALL,
        },
        present,
    },
};
use glam::DVec3;

/// The arrays that lists of contacts consist of, with what contacts remember.
const OF_CONTACTS: [&Array; 5] = [&LIST_START, &NEIGHBOUR, &TANGENTIAL_FORCE, &ROLLING_TORQUE, &IMPULSE];

/// What a contact remembers: what the law of contact or contact dynamics has no use for is zero. Forces and torques are
/// those on `grain`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactHistory {
    /// By its place in [`Assembly::grains`].
    pub grain: u32,
    pub other: Other,
    /// Of the tangential spring, N.
    pub tangential_force: DVec3,
    /// Of the rolling spring, N m.
    pub rolling_torque: DVec3,
    /// Of the last step of contact dynamics, its impulse over the time step, N.
    pub mean_force: DVec3,
}

impl Simulation {
    /// What the contacts remember that there are now, each once. None of a law without memory.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) if the device is lost.
    pub fn contact_history(&mut self) -> Result<Vec<ContactHistory>> {
        let model = *self.model();
        let arrays = present(&model, OF_CONTACTS.iter().chain(&[&ID]));
        let bodies = self.runner.state.sizes.bodies;
        let s = self.runner.read(&arrays)?;
        let mut contacts = Vec::new();
        for i in 0..bodies {
            let grain = s.id[i];
            for entry in s.row(i) {
                let tagged = s.neighbour[entry];
                if tagged == NONE || tagged & ACTIVE == 0 {
                    continue;
                }
                let j = (tagged & INDEX) as usize;
                let other = match s.id.get(j) {
                    Some(id) if *id < grain => continue,
                    Some(id) => Other::Grain(*id),
                    None => Other::Wall((j - bodies) as u32),
                };
                contacts.push(ContactHistory {
                    grain,
                    other,
                    tangential_force: s.tangential_force.get(entry).map_or(DVec3::ZERO, |f| f.0),
                    rolling_torque: s.rolling_torque.get(entry).map_or(DVec3::ZERO, |t| t.0),
                    mean_force: s.impulse.get(entry).map_or(DVec3::ZERO, |p| p.0 / s.params.dt),
                });
            }
        }
        self.runner.state.release(&arrays);
        contacts.sort_unstable_by_key(|contact| contact.key());
        Ok(contacts)
    }

    /// The contacts of free grains now, each once, by the numbers of their grains, with walls last. They are computed
    /// on the host in double precision, from what the engine holds: forces and couples are those of the next step, in
    /// contact dynamics the impulses of the last one over the time step.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) if the device is lost.
    pub fn contacts(&mut self) -> Result<Vec<Contact>> {
        let mut contacts = Vec::new();
        self.refresh()?;
        let sizes = self.sizes();
        for_contacts(&mut self.runner, sizes, |contact| contacts.push(contact))?;
        contacts.sort_unstable_by_key(|contact| (contact.grain, contact.other));
        Ok(contacts)
    }

    /// The same added up, given what else there is now: the host never has them all.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) if the device is lost.
    pub fn contact_totals(&mut self, grains: &[Grain], clumps: &[Clump], walls: &[Wall]) -> Result<Totals> {
        self.refresh()?;
        let (sizes, domain, time) = (self.sizes(), self.domain()?, self.time());
        let grown = self.growth.as_ref().map(|law| self.assembly.at_time(law, time));
        let assembly = grown.as_ref().unwrap_or(&self.assembly).within(domain);
        let mut packing = Packing::new(&assembly, grains, clumps, walls, &[]);
        for_contacts(&mut self.runner, sizes, |contact| packing.add_up(&contact))?;
        Ok(packing.totals)
    }

    /// As [`Simulation::new`], with contacts that remember what they did elsewhere. Those that are not near each other
    /// any more, and what the law has no use for, are forgotten. `of_now`: whether that is of the state that they are in, as
    /// [`Simulation::remembers_now`] says, and not of a step before. Also returns how many are not forgotten.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn with_history(
        assembly: Assembly,
        options: Options,
        contacts: &[ContactHistory],
        of_now: bool,
    ) -> Result<(Simulation, usize)> {
        let mut simulation = Simulation::build(assembly, options)?;
        let given = simulation.remember(contacts)?;
        simulation.runner.remembering &= !of_now;
        simulation.start()?;
        let forgotten = std::mem::take(&mut simulation.lists.state.lost_contacts);
        Ok((simulation, given - forgotten as usize))
    }

    /// Lists of these contacts alone, of grains that have not been sorted: the first lists take over what they hold, as
    /// all lists do from those before them. Returns how many there are.
    pub(super) fn remember(&mut self, contacts: &[ContactHistory]) -> Result<usize> {
        let model = *self.model();
        let sizes = self.sizes();
        let arrays = present(&model, &OF_CONTACTS);
        if contacts.is_empty() || model.history == History::None {
            return Ok(0);
        }
        let mut of_grain: Vec<Vec<&ContactHistory>> = memory::filled(Vec::new(), sizes.bodies)?;
        contacts.iter().for_each(|contact| of_grain[contact.grain as usize].push(contact));
        let mut lists = State::bare(model, sizes, *self.params());
        lists.list_start = vec![0];
        for slice in 0..sizes.slices() {
            let (grains, abreast) = sizes.lists_of_slice(slice);
            let longest = grains.map(|i| of_grain[i].len()).max().unwrap_or(0);
            lists.list_start.push(lists.list_start[slice] + (longest * abreast) as u32);
        }
        let entries = lists.all_entries();
        for array in &arrays[1..] {
            lists.column_mut(array).reserve(entries)?;
            lists.column_mut(array).resize(entries);
        }
        lists.neighbour.fill(NONE);
        for (i, contacts) in of_grain.iter().enumerate() {
            for (entry, contact) in lists.row(i).zip(contacts) {
                let number = match contact.other {
                    Other::Grain(id) => id,
                    Other::Wall(wall) => sizes.bodies as u32 + wall,
                };
                lists.neighbour[entry] = number | ACTIVE;
                if let Some(force) = lists.tangential_force.get_mut(entry) {
                    *force = Packed(contact.tangential_force);
                }
                if let Some(torque) = lists.rolling_torque.get_mut(entry) {
                    *torque = Spin(contact.rolling_torque);
                }
                if let Some(impulse) = lists.impulse.get_mut(entry) {
                    *impulse = Packed(contact.mean_force * lists.params.dt);
                }
            }
        }
        if entries > sizes.entries {
            let entries = with_room(entries as u32)?;
            resize(&mut self.runner, Length::Entries, entries)?;
            (self.lists.state.entries, self.lists.state.next_entries) = (entries, entries);
        }
        self.lists.state.active_contacts = contacts.len() as u32;
        self.runner.remembering = true;
        self.runner.engine.write(&arrays, 0, &lists)?;
        Ok(contacts.len())
    }
}

/// All contacts, in the order in which grains lie in memory.
fn for_contacts(runner: &mut Runner, sizes: Sizes, mut visit: impl FnMut(Contact)) -> Result<()> {
    let model = runner.state.model;
    let of_bodies = [
        &POSITION,
        &POSITION_LOW,
        &VELOCITY,
        &SPIN,
        &ID,
        &CLUMP_OF_ID,
        &MATERIAL,
        &GROWTH_RATE,
        &LIST_START,
        &WALL,
        &CELL,
    ];
    let of_bodies = present(&model, &of_bodies);
    let of_entries = present(&model, &[&NEIGHBOUR, &TANGENTIAL_FORCE, &ROLLING_TORQUE, &IMPULSE]);
    runner.read(&of_bodies)?;
    let params = runner.params();
    let kept = std::mem::replace(&mut runner.state.params, params);
    let mut lists = State::bare(model, sizes, params);
    let Runner { engine, state: s, .. } = runner;
    let mut slice = 0;
    while slice < sizes.slices() {
        // Lists of about as many entries as are moved at a time.
        let first = s.list_start[slice] as usize;
        let further = s.list_start[slice + 1..].partition_point(|start| (*start as usize) < first + PIECE);
        let next = (slice + further.max(1)).min(sizes.slices());
        engine.read(&of_entries, first..s.list_start[next] as usize, &mut lists)?;
        let bodies = sizes.lists_of_slice(slice).0.start..sizes.lists_of_slice(next - 1).0.end;
        contacts_of(s, bodies, &lists, first).into_iter().for_each(&mut visit);
        slice = next;
    }
    s.params = kept;
    s.release(&of_bodies.into_iter().filter(|array| !is_kept(array)).collect::<Vec<_>>());
    Ok(())
}

impl ContactHistory {
    /// Grains by their numbers, then walls.
    fn key(&self) -> (u32, u64) {
        let other = match self.other {
            Other::Grain(id) => u64::from(id),
            Other::Wall(wall) => (1 << 32) + u64::from(wall),
        };
        (self.grain, other)
    }
}
