//! Grains that come in and leave, between two steps: the arrays of an engine hold those that are there, and what kernels
//! know is how many these are.

use super::{ContactHistory, Simulation, count_free, runner::Runner, setup::counted, start};
use crate::{
    error::Result,
    measure::{OpeningsSample, Other, Sample},
    plan::Op,
    scene::{Assembly, Clump, Domain, Grain, Insertion, Method, Neighbours, Numbers, Rate, Wall},
    state::{
        ARRAYS, Array, Length, Lifetime, NONE, Params, Sizes, State,
        array::{DISPLACEMENT, ID, INDEX_OF_ID, LIST_START, WORKS},
        present,
    },
};
use glam::DVec3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::{collections::HashMap, ops::Add};

/// Places that are tried for a grain, at each time.
const ATTEMPTS: usize = 1000;
/// Random numbers that a time has to itself, as a power of two.
const WORDS: u32 = 16;

/// What has come in of an [`Insertion`] so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inlet {
    /// Grains, or clumps.
    pub inserted: usize,
    /// kg
    pub mass: f64,
    /// Batches that ended because there was no room for a grain.
    pub full: u64,
    /// Batches so far.
    pub batches: u64,
    /// Whether the last one ended so.
    pub waits: bool,
}

/// What has left by an [`Outlet`](crate::scene::Outlet) so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outlet {
    /// Grains, or clumps.
    pub removed: u64,
    /// kg
    pub mass: f64,
    /// kg m/s
    pub momentum: DVec3,
    /// When it was asked for its flow, s, and the mass then.
    asked: (f64, f64),
}

/// What a row of the history says of an outlet.
#[derive(Clone, Debug, PartialEq)]
pub struct Outflow {
    pub name: String,
    /// Grains, or clumps, so far.
    pub removed: u64,
    /// kg
    pub mass: f64,
    /// kg/s since it was asked before.
    pub rate: f64,
}

/// How far that is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    pub inlets: Vec<Inlet>,
    pub outlets: Vec<Outlet>,
    /// J
    pub inserted_energy: f64,
    pub removed_energy: f64,
}

/// Where grains come in and leave.
pub struct Openings {
    pub progress: Progress,
    /// The scene's grains and clumps at time 0, and their numbers.
    start: (Vec<Grain>, Vec<Clump>, Numbers),
    /// Of the scene, as checkpoints know it.
    pub checksum: u32,
    /// Grains above this radius are large, m.
    large: f64,
    /// Steps from one batch, and from one look, to the next.
    batches: Vec<u64>,
    looks: Vec<u64>,
}

/// A grain, or clump, that comes in: of which insertion, which of its grains, and where to.
struct Arrival {
    insertion: usize,
    number: usize,
    position: DVec3,
}

impl Openings {
    /// Of a scene at time 0, whose grains get their numbers.
    pub fn new(assembly: &mut Assembly, dt: f64) -> Openings {
        let (large, checksum) = (assembly.whole().largest_common_radius(), assembly.checksum());
        if assembly.numbers == Numbers::default() {
            let all = |count: usize| (0..count as u32).collect();
            assembly.numbers = Numbers { grains: all(assembly.grains.len()), clumps: all(assembly.clumps.len()) };
        }
        Openings {
            progress: Progress {
                inlets: vec![Inlet::default(); assembly.insertions.len()],
                outlets: vec![Outlet::default(); assembly.outlets.len()],
                ..Progress::default()
            },
            start: (assembly.grains.clone(), assembly.clumps.clone(), assembly.numbers.clone()),
            checksum,
            large,
            batches: assembly.insertions.iter().map(|insertion| insertion.interval(assembly, dt)).collect(),
            looks: assembly.outlets.iter().map(|outlet| outlet.interval(dt)).collect(),
        }
    }

    /// Sizes and parameters with these grains.
    pub fn counted(&self, assembly: &Assembly, sizes: &Sizes, params: &Params) -> (Sizes, Params) {
        counted(assembly, self.large, sizes, params)
    }

    pub fn sample(&self, particles: usize) -> OpeningsSample {
        let Progress { inlets, outlets, inserted_energy, removed_energy } = &self.progress;
        OpeningsSample {
            particles: particles as u64,
            inserted: inlets.iter().map(|inlet| inlet.inserted as u64).sum(),
            inserted_mass: inlets.iter().map(|inlet| inlet.mass).fold(0.0, f64::add),
            removed: outlets.iter().map(|outlet| outlet.removed).sum(),
            removed_mass: outlets.iter().map(|outlet| outlet.mass).fold(0.0, f64::add),
            inserted_energy: *inserted_energy,
            removed_energy: *removed_energy,
        }
    }
}

impl Inlet {
    /// Whether no more will come in after this time, s.
    fn is_done(&self, insertion: &Insertion, time: f64) -> bool {
        self.inserted == insertion.count() || self.mass >= insertion.most_mass || time > insertion.stop
    }

    /// Whether number `inserted`, of this mass, should have come in.
    fn is_due(&self, insertion: &Insertion, time: f64, mass: f64) -> bool {
        // What a sum of times has lost must not cost a grain.
        let due = insertion.due(time) * (1.0 + 1e-9);
        match insertion.rate {
            Rate::Number(_) => self.inserted as f64 + 1.0 <= due,
            Rate::Mass(_) => self.mass + mass <= due,
        }
    }
}

impl Simulation {
    /// Grains or, in a scene with clumps, clumps that there are now.
    pub fn particles(&self) -> usize {
        match &self.assembly.clumps[..] {
            [] => self.assembly.grains.len(),
            clumps => clumps.len(),
        }
    }

    /// What has come in so far, insertion by insertion.
    pub fn inlets(&self) -> &[Inlet] {
        self.openings.as_ref().map_or(&[], |openings| &openings.progress.inlets)
    }

    /// What has left so far, outlet by outlet.
    pub fn outlets(&self) -> &[Outlet] {
        self.openings.as_ref().map_or(&[], |openings| &openings.progress.outlets)
    }

    /// Whether grains are still to come in.
    pub fn expects_grains(&self) -> bool {
        let time = self.time();
        let insertions = self.inlets().iter().zip(&self.assembly.insertions);
        insertions.into_iter().any(|(inlet, insertion)| !inlet.is_done(insertion, time))
    }

    /// What is due, and waits for room in its region: in words.
    pub fn held_up(&self) -> Vec<String> {
        let time = self.time();
        let waiting = self.inlets().iter().zip(&self.assembly.insertions).filter(|(inlet, _)| inlet.waits);
        let words = |(inlet, insertion): (&Inlet, &Insertion)| {
            let due = insertion.due(time);
            let missing = match insertion.rate {
                Rate::Number(_) => {
                    format!("{} grains", (due as usize).min(insertion.count()).saturating_sub(inlet.inserted))
                }
                Rate::Mass(_) => format!("{:.3e} kg", due.min(insertion.most_mass) - inlet.mass),
            };
            format!(
                "{}: {missing} that were due have not come in, as its region was full ({} of {} times); take a larger region or \
                 a lower rate",
                insertion.name, inlet.full, inlet.batches
            )
        };
        waiting.map(words).collect()
    }

    /// What has left by each outlet, and how fast since this was asked before.
    pub fn outflows(&mut self) -> Vec<Outflow> {
        let time = self.time();
        let Some(openings) = &mut self.openings else { return Vec::new() };
        let flow = |(outlet, of): (&mut Outlet, &crate::scene::Outlet)| {
            let (then, mass) = std::mem::replace(&mut outlet.asked, (time, outlet.mass));
            let rate = if time > then { (outlet.mass - mass) / (time - then) } else { 0.0 };
            Outflow { name: of.name.clone(), removed: outlet.removed, mass: outlet.mass, rate }
        };
        openings.progress.outlets.iter_mut().zip(&self.assembly.outlets).map(flow).collect()
    }

    /// Steps to the next one at which grains may come or go.
    pub(super) fn steps_to_opening(&self) -> u64 {
        let Some(openings) = &self.openings else { return u64::MAX };
        let time = self.time();
        let insertions = openings.progress.inlets.iter().zip(&self.assembly.insertions).zip(&openings.batches);
        let insertions = insertions.filter(|((inlet, insertion), _)| !inlet.is_done(insertion, time));
        let outlets = self.assembly.outlets.iter().zip(&openings.looks).filter(|(outlet, _)| time <= outlet.stop);
        let intervals = insertions.map(|(_, every)| every).chain(outlets.map(|(_, every)| every));
        intervals.map(|every| every - self.step() % every).min().unwrap_or(u64::MAX)
    }

    /// Let grains go, and let grains come, if it is time.
    pub(super) fn open(&mut self) -> Result<()> {
        let Some(openings) = &self.openings else { return Ok(()) };
        let (step, time) = (self.step(), self.time());
        let strikes = |every: &u64| step.is_multiple_of(*every);
        let outlets = self.assembly.outlets.iter().zip(&openings.looks).enumerate();
        let outlets = outlets
            .filter(|(_, (outlet, every))| step > 0 && strikes(every) && (outlet.start..=outlet.stop).contains(&time));
        let outlets: Vec<usize> = outlets.map(|(k, _)| k).collect();
        let inlets = openings.progress.inlets.iter().zip(&self.assembly.insertions).zip(&openings.batches).enumerate();
        let inlets = inlets.filter(|(_, ((inlet, insertion), every))| {
            strikes(every) && time >= insertion.start && !inlet.is_done(insertion, time)
        });
        let inlets: Vec<usize> = inlets.map(|(k, _)| k).collect();
        if outlets.is_empty() && inlets.is_empty() {
            return Ok(());
        }
        let (grains, clumps, domain) = (self.grains()?, self.clumps()?, self.domain()?);
        let leaving = self.leaving(&outlets, &grains, &clumps, &domain);
        let arrivals = self.arrivals(&inlets, &grains, &leaving, &domain)?;
        if arrivals.is_empty() && !leaving.contains(&true) {
            return Ok(());
        }
        if !leaving.contains(&true) {
            return self.change(&leaving, &arrivals);
        }
        let before = self.sums()?;
        self.change(&leaving, &arrivals)?;
        let after = self.sums()?;
        let brought = arrivals.iter().map(|arrival| self.energy(arrival)).sum::<f64>();
        let energy = |sample: &Sample| sample.kinetic_energy + sample.potential_energy + sample.elastic_energy;
        if let Some(openings) = &mut self.openings {
            openings.progress.removed_energy += energy(&before) + brought - energy(&after);
        }
        if let Some(works) = &mut self.works {
            works.change(self.runner.state.params.dt, &before, &after);
        }
        Ok(())
    }

    /// Kinetic and potential energy of what comes in, J.
    fn energy(&self, Arrival { insertion, number, position }: &Arrival) -> f64 {
        let insertion = &self.assembly.insertions[*insertion];
        let mass = insertion.mass(*number, &self.assembly);
        mass * (0.5 * insertion.velocity(*number).length_squared() - self.assembly.gravity.dot(*position))
    }

    /// Which particles leave; outlets count them.
    fn leaving(&mut self, outlets: &[usize], grains: &[Grain], clumps: &[Clump], domain: &Domain) -> Vec<bool> {
        let mut leaving = vec![false; self.particles()];
        let Some(openings) = &mut self.openings else { return leaving };
        for (k, leaves) in leaving.iter_mut().enumerate() {
            let (x, v, radius, material, fixed) = match clumps.get(k) {
                Some(c) => (c.position, c.velocity, c.radius, c.material, c.fixed),
                None => (grains[k].position, grains[k].velocity, grains[k].radius, grains[k].material, grains[k].fixed),
            };
            let takes = |outlet: &&usize| !fixed && self.assembly.outlets[**outlet].takes(x, domain);
            if let Some(outlet) = outlets.iter().find(takes) {
                let (outlet, mass) = (&mut openings.progress.outlets[*outlet], self.assembly.mass_of(radius, material));
                outlet.removed += 1;
                outlet.mass += mass;
                outlet.momentum += mass * v;
                *leaves = true;
            }
        }
        leaving
    }

    /// Who comes in, and where: as many as are due and find room. Insertions count them.
    fn arrivals(
        &mut self,
        inlets: &[usize],
        grains: &[Grain],
        leaving: &[bool],
        domain: &Domain,
    ) -> Result<Vec<Arrival>> {
        let (step, time, walls, owners) = (self.step(), self.time(), self.walls()?, self.assembly.owners());
        let Simulation { assembly, openings: Some(openings), .. } = self else { return Ok(Vec::new()) };
        let mut arrivals = Vec::new();
        let mut known: Vec<Grain> = Vec::new();
        for &k in inlets {
            let insertion = &assembly.insertions[k];
            let region = insertion.region.moved(time * insertion.region_velocity);
            let largest = insertion.grains.iter().chain(grains).map(|grain| grain.radius).fold(0.0, f64::max);
            let mut neighbours = Neighbours::new(*domain, assembly.dimension, largest);
            let stays = |(i, _): &(usize, &Grain)| !leaving[owners.get(*i).map_or(*i, |owner| *owner as usize)];
            let staying = grains.iter().enumerate().filter(stays).map(|(_, grain)| grain);
            for grain in staying.chain(&known).filter(|grain| region.is_near(grain.position, grain.radius, domain)) {
                neighbours.insert(grain.position, grain.radius);
            }
            let is_free = |grain: &Grain, neighbours: &Neighbours| {
                let apart = |wall: &Wall| wall.surface.distance(grain.position) >= grain.radius;
                let alone = |_: usize, _: f64| true;
                region.holds(grain.position, grain.radius, domain)
                    && walls.iter().all(apart)
                    && neighbours.find_overlap(grain.position, grain.radius, false, alone).is_none()
            };
            let inlet = &mut openings.progress.inlets[k];
            inlet.batches += 1;
            inlet.waits = false;
            while !inlet.is_done(insertion, time) {
                let number = inlet.inserted;
                let mass = insertion.mass(number, assembly);
                if !inlet.is_due(insertion, time, mass) {
                    break;
                }
                // Another time other places are tried.
                let mut rng = ChaCha8Rng::seed_from_u64(insertion.seed);
                rng.set_stream(1 + number as u64);
                rng.set_word_pos(u128::from(step) << WORDS);
                let members = spheres(assembly, insertion, number);
                let inset = if members.len() == 1 { members[0].radius } else { 0.0 };
                let mut places = (0..ATTEMPTS).map(|_| region.random_point(inset, domain, &mut rng));
                let at = |x: DVec3, member: &Grain| Grain { position: x + member.position, ..*member };
                let fits = |x: &DVec3| members.iter().all(|member| is_free(&at(*x, member), &neighbours));
                let Some(mut position) = places.find(fits) else {
                    inlet.full += 1;
                    inlet.waits = true;
                    break;
                };
                for member in members.iter().map(|member| at(position, member)) {
                    neighbours.insert(member.position, member.radius);
                    known.push(member);
                }
                domain.fold(&mut position);
                inlet.inserted += 1;
                inlet.mass += mass;
                arrivals.push(Arrival { insertion: k, number, position });
            }
        }
        let energy = arrivals.iter().map(|arrival| self.energy(arrival)).sum::<f64>();
        if let Some(openings) = &mut self.openings {
            openings.progress.inserted_energy += energy;
        }
        Ok(arrivals)
    }

    /// The state without those that leave and with those that come in: all others keep every bit, and what their contacts
    /// remember.
    fn change(&mut self, leaving: &[bool], arrivals: &[Arrival]) -> Result<()> {
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
        self.runner.engine.read(&[&[&ID], &arrays[..]].concat(), crate::engine::ALL, &mut kept)?;
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

/// What number k of an insertion consists of, around its centre.
fn spheres(assembly: &Assembly, insertion: &Insertion, k: usize) -> Vec<Grain> {
    match insertion.clumps.get(k) {
        None => vec![Grain { position: DVec3::ZERO, ..insertion.grains[k] }],
        Some(clump) => {
            let clump = Clump { position: DVec3::ZERO, ..*clump };
            clump.members(&assembly.shapes[clump.shape as usize]).collect()
        }
    }
}
