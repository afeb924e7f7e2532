//! Other grains than before, between two steps: the arrays of an engine hold those that are there, and what kernels know
//! is how many these are.

use super::{
    ContactHistory, Simulation, count_free,
    openings::{Arrival, Inlet, Outlet, Progress},
    runner::Runner,
    start,
};
use crate::{
    engine::ALL,
    error::Result,
    measure::Other,
    plan::Op,
    scene::{Assembly, Clump, Grain, Insertion, Method, Numbers},
    state::{
        ARRAYS, Array, Length, Lifetime, NONE, State,
        array::{DISPLACEMENT, ID, INDEX_OF_ID, LIST_START, WORKS},
        present,
    },
};
use glam::DVec3;
use std::collections::HashMap;

impl Simulation {
    /// The state without those that leave and with those that come in: all others keep every bit, and what their contacts
    /// remember.
    pub(super) fn change(&mut self, leaving: &[bool], arrivals: &[Arrival]) -> Result<()> {
        let contacts = self.contact_history()?;
        if let Some(works) = &mut self.works {
            works.collect(&mut self.runner, &self.plans.forget_works)?;
        }
        let particles: Vec<usize> = (0..leaving.len()).filter(|k| !leaving[*k]).collect();
        let grains: Vec<usize> = match &self.assembly.clumps[..] {
            [] => particles.clone(),
            _ => particles.iter().flat_map(|k| self.assembly.members(*k)).collect(),
        };
        let (arrays, kept) = self.keep(&grains, &particles)?;
        let mut place = vec![NONE; self.assembly.grains.len()];
        grains.iter().enumerate().for_each(|(now, before)| place[*before] = now as u32);
        self.assembly = self.with(&grains, &particles, arrivals);
        let speed = arrivals.iter().map(|a| self.assembly.insertions[a.insertion].velocity(a.number).length());
        let far = |grain: &Grain| grain.position.abs().max_element() + grain.radius;
        let extent = self.assembly.grains[grains.len()..].iter().map(far).fold(0.0, f64::max);
        self.lists.see_grains(extent, speed.fold(0.0, f64::max) * self.dt());
        self.take_up()?;
        self.runner.engine.write(&arrays, 0, &kept)?;
        let there = |id: u32| Some(place[id as usize]).filter(|id| *id != NONE);
        let moved = |contact: &ContactHistory| {
            let other = match contact.other {
                Other::Grain(id) => Other::Grain(there(id)?),
                wall @ Other::Wall(_) => wall,
            };
            Some(ContactHistory { grain: there(contact.grain)?, other, ..*contact })
        };
        let contacts: Vec<_> = contacts.iter().filter_map(moved).collect();
        self.lists.forget_contacts();
        self.runner.execute(&[Op::Clear(&LIST_START)], 1)?;
        self.remember(&contacts)?;
        self.lists.set_margin(&mut self.runner.state.params);
        self.lists.make(&self.plans, &mut self.runner)?;
        Ok(())
    }

    /// What later steps depend on of these grains and clumps, in this order: the arrays, and a state with them alone.
    fn keep(&mut self, grains: &[usize], clumps: &[usize]) -> Result<(Vec<&'static Array>, State)> {
        let s = &self.runner.state;
        let of_lists = [&ID, &INDEX_OF_ID, &DISPLACEMENT, &WORKS];
        let mut kept = State { units: s.units, range: s.range, ..State::bare(s.model, s.sizes, s.params) };
        let arrays = present(&s.model, ARRAYS).into_iter().filter(|array| array.lifetime == Lifetime::State);
        let arrays = arrays.filter(|array| [Length::Bodies, Length::Clumps].contains(&array.length));
        let arrays: Vec<_> = arrays.filter(|array| !of_lists.contains(array)).collect();
        self.runner.engine.read(&[&[&ID], &arrays[..]].concat(), ALL, &mut kept)?;
        let mut index = vec![0; kept.id.len()];
        kept.id.iter().enumerate().for_each(|(i, id)| index[*id as usize] = i);
        let bodies: Vec<usize> = grains.iter().map(|id| index[*id]).collect();
        for array in &arrays {
            kept.column_mut(array).select(if array.length == Length::Clumps { clumps } else { &bodies });
        }
        Ok((arrays, kept))
    }

    /// The assembly of these grains and clumps, and behind them what comes in, with velocities as steps have them.
    fn with(&self, grains: &[usize], particles: &[usize], arrivals: &[Arrival]) -> Assembly {
        let before = &self.assembly;
        let clumped = !before.clumps.is_empty() || before.insertions.iter().any(|of| !of.clumps.is_empty());
        let mut now =
            Assembly { grains: Vec::new(), clumps: Vec::new(), numbers: Numbers::default(), ..before.clone() };
        now.grains.extend(grains.iter().map(|k| before.grains[*k]));
        now.numbers.grains.extend(grains.iter().map(|k| before.numbers.of_grain(*k)));
        if clumped {
            let mut first = 0;
            for k in particles {
                now.clumps.push(Clump { first, ..before.clumps[*k] });
                first += before.members(*k).len() as u32;
            }
            now.numbers.clumps.extend(particles.iter().map(|k| before.numbers.of_clump(*k)));
        }
        // In the discrete element method velocities are half a step old.
        let back = match before.solver.method {
            Method::DiscreteElements => 0.5 * self.dt() * before.gravity,
            Method::ContactDynamics(_) => DVec3::ZERO,
        };
        for Arrival { insertion, number, position } in arrivals {
            let insertion = &before.insertions[*insertion];
            let Some(clump) = insertion.clumps.get(*number) else {
                let grain = insertion.grains[*number];
                now.grains.push(Grain { position: *position, velocity: grain.velocity - back, ..grain });
                now.numbers.grains.push(insertion.first_grain + *number as u32);
                continue;
            };
            let first = now.grains.len() as u32;
            let clump = Clump { first, position: *position, velocity: clump.velocity - back, ..*clump };
            let members = clump.members(&before.shapes[clump.shape as usize]);
            let of_insertion = insertion.clumps[*number].first;
            now.grains.extend(members.map(|mut member| {
                before.domain.fold(&mut member.position);
                member
            }));
            let count = now.grains.len() as u32 - first;
            now.numbers.grains.extend((0..count).map(|k| insertion.first_grain + of_insertion + k));
            now.clumps.push(clump);
            now.numbers.clumps.push(insertion.first_clump + *number as u32);
        }
        now
    }

    /// Arrays with the grains of the assembly as they are there, and all that is known of how many there are.
    fn take_up(&mut self) -> Result<()> {
        let Simulation { openings: Some(openings), assembly, runner, .. } = self else { return Ok(()) };
        let Runner { engine, state, .. } = runner;
        (state.sizes, state.params) = openings.counted(assembly, &state.sizes, &state.params);
        engine.count(&state.sizes)?;
        start::fill(state, assembly, &mut |arrays, first, piece| engine.write(arrays, first, piece))?;
        self.free = count_free(assembly);
        runner.known.numbers.clone_from(&assembly.numbers);
        Ok(())
    }

    /// Be as a checkpoint says: with the grains and clumps of these numbers.
    pub(super) fn resume_openings(&mut self, progress: Progress, numbers: Numbers) -> Result<()> {
        let Some(openings) = &mut self.openings else { return Ok(()) };
        openings.progress = progress;
        let (grains, clumps, own) = &openings.start;
        let insertions = &self.assembly.insertions;
        let mut known: HashMap<u32, Grain> = own.grains.iter().copied().zip(grains.iter().copied()).collect();
        let mut known_clumps: HashMap<u32, Clump> = own.clumps.iter().copied().zip(clumps.iter().copied()).collect();
        for Insertion { grains, clumps, first_grain, first_clump, .. } in insertions {
            known.extend((*first_grain..).zip(grains.iter().copied()));
            known_clumps.extend((*first_clump..).zip(clumps.iter().copied()));
        }
        let mut first = 0;
        let mut clumps = Vec::new();
        for clump in numbers.clumps.iter().filter_map(|number| known_clumps.get(number)) {
            clumps.push(Clump { first, ..*clump });
            first += self.assembly.shapes[clump.shape as usize].members.len() as u32;
        }
        let grains = numbers.grains.iter().filter_map(|number| known.get(number).copied()).collect();
        (self.assembly.grains, self.assembly.clumps, self.assembly.numbers) = (grains, clumps, numbers);
        self.take_up()
    }

    /// Be as at time 0, but for arrays.
    pub(super) fn close_openings(&mut self) -> Result<()> {
        let Some(openings) = &mut self.openings else { return Ok(()) };
        let Progress { inlets, outlets, .. } = &openings.progress;
        openings.progress = Progress {
            inlets: vec![Inlet::default(); inlets.len()],
            outlets: vec![Outlet::default(); outlets.len()],
            ..Progress::default()
        };
        let (grains, clumps, numbers) = openings.start.clone();
        (self.assembly.grains, self.assembly.clumps, self.assembly.numbers) = (grains, clumps, numbers);
        self.take_up()
    }
}
