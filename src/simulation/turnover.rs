//! Grains that come in and leave between two steps: when, which, and where to.

use super::{
    Simulation,
    openings::{Arrival, Inlet, Outflow, Outlet},
};
use crate::{
    error::Result,
    measure::Sample,
    scene::{Assembly, Clump, Domain, Grain, Insertion, Neighbours, Rate, Wall},
};
use glam::DVec3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Places that are tried for a grain, at each time.
const ATTEMPTS: usize = 1000;
/// Random numbers that a time has to itself, as a power of two.
const WORDS: u32 = 16;

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
