//! What a simulation hands out: sums, grains, clumps, forces and walls now.

use super::{
    Simulation,
    columns::Columns,
    overlaps::DeepOverlap,
    runner::{Runner, is_kept},
};
use crate::{
    body::grains::{self, same_grain},
    contact::overlap::gaps,
    error::{Error, Result},
    measure::{CellSample, GrowthSample, Other, Sample, mass_of_clump, masses, micromechanics::packing::LoadOnWall},
    memory,
    model::{Grains, Rotation},
    plan::swap_again,
    scene::{self, Assembly, Clump, Domain, Grain, GrowthLaw, Surface, Wall},
    space::{
        boundary::flow_power,
        dimension::{inverse_above, product_above, volume_of},
        precision::{low_of, position_low_of, spin_low_of},
    },
    state::{Array, Cell, RotationIterations, Spin, array::*, present},
    units::Quantity,
};
use glam::{DQuat, DVec3, DVec4};
use rayon::prelude::*;
use std::borrow::Cow;

impl Simulation {
    /// Lists that reach, for a look at the contacts between two chunks.
    pub(super) fn refresh(&mut self) -> Result<()> {
        if self.lists.margin_is_used_up() {
            self.lists.set_margin(&mut self.runner.state.params);
            self.lists.make(&self.plans, &mut self.runner)?;
        }
        Ok(())
    }

    /// Sums over the grains now, but for works.
    pub(super) fn sums(&mut self) -> Result<Sample> {
        self.refresh()?;
        self.runner.execute_plan(&self.plans.sums)?;
        self.runner.read(&[&PARTIAL_SUMS])?;
        Ok(Sample::new(self.step(), self.time(), self.free, &self.runner.state.partial_sums))
    }

    /// Sums over the grains now.
    pub fn sample(&mut self) -> Result<Sample> {
        let free = self.free;
        let sample = self.sums()?;
        let sample = Sample { openings: self.openings.as_ref().map(|of| of.sample(self.particles())), ..sample };
        let sample = self.with_cell(sample)?;
        let sample = self.with_growth(sample);
        let Some(solved) = self.solver_statistics() else {
            return match &mut self.works {
                Some(works) => works.complete(&mut self.runner, &self.plans.forget_works, sample),
                None => Ok(sample),
            };
        };
        let p = &self.runner.state.params;
        let masses = masses(&self.assembly).into_iter().zip(&self.assembly.grains).filter(|(_, g)| !g.fixed);
        let mass: f64 = masses.map(|(m, _)| m).sum();
        let pull = p.gravity.length().max(sample.contact_force * free as f64 / f64::max(mass, f64::MIN_POSITIVE));
        Ok(Sample {
            iterations: Some(solved.last_iterations),
            residual: Some(solved.last_residual),
            unsolved: solved.last_unsolved,
            coulomb_excess: Some(solved.last_excess),
            step_energy: 0.5 * mass * (pull * p.dt).powi(2),
            ..sample
        })
    }

    /// What free grains do to every wall now; moments are about its point, or the centre of a cylinder. The engine adds it
    /// up, in its precision.
    ///
    /// # Errors
    /// [`Error::Device`] if the device is lost.
    pub fn wall_loads(&mut self) -> Result<Vec<LoadOnWall>> {
        let walls = self.walls()?;
        if walls.is_empty() {
            return Ok(Vec::new());
        }
        self.refresh()?;
        self.runner.execute_plan(&self.plans.wall_loads)?;
        let s = self.runner.read(&[&WALL_LOAD, &WALL])?;
        let load = |wall: &Wall| LoadOnWall { position: wall.surface.position(), ..LoadOnWall::default() };
        let mut loads: Vec<LoadOnWall> = walls.iter().map(load).collect();
        for (k, part) in s.wall_load.iter().enumerate() {
            loads[k % walls.len()].force += part.force;
            loads[k % walls.len()].moment += part.moment.0;
            loads[k % walls.len()].normal_force += part.normal_force;
        }
        // The engine's point of a plane is the one that is nearest to the grains.
        for (load, (now, wall)) in loads.iter_mut().zip(s.wall.iter().zip(&walls)) {
            load.moment += (now.point - wall.surface.reference()).cross(load.force);
        }
        self.runner.state.release(&[&WALL_LOAD]);
        Ok(loads)
    }

    /// The deepest overlap now. None where nothing touches.
    ///
    /// # Errors
    /// [`Error::Device`] if the device is lost.
    pub fn deepest_overlap(&mut self) -> Result<Option<DeepOverlap>> {
        self.deepest_of(&[0.0])
    }

    /// The deepest overlap of now and of where bodies were before the last step, in which they may have parted.
    pub(super) fn deepest_overlap_of_step(&mut self) -> Result<Option<DeepOverlap>> {
        let dt = self.dt();
        self.deepest_of(&[0.0, dt])
    }

    /// The deepest overlap of several moments so long ago, s, going back with the velocities of now.
    fn deepest_of(&mut self, moments: &[f64]) -> Result<Option<DeepOverlap>> {
        self.refresh()?;
        let step = self.step();
        let arrays = [&POSITION, &POSITION_LOW, &VELOCITY, &ID, &CLUMP_OF_ID, &LIST_START, &NEIGHBOUR, &WALL, &CELL];
        let arrays = present(self.model(), &arrays);
        let numbers = &self.assembly.numbers;
        self.runner.read(&arrays)?;
        let s = &mut self.runner.state;
        let bodies = s.sizes.bodies;
        let (mut deepest, mut ago) = (None, 0.0);
        for moment in moments {
            let back = moment - ago;
            s.position.iter_mut().zip(&s.velocity).for_each(|(position, velocity)| position.x -= back * velocity.v);
            ago = *moment;
            let s = &*s;
            let of_grain = |i: usize| {
                let others = gaps(s, i).filter(|gap| gap.other >= bodies || !same_grain(s, i, gap.other));
                let overlaps = others.map(|gap| (gap.over_smaller(s.position[i].radius), i, gap.other));
                overlaps.max_by(|a, b| a.0.total_cmp(&b.0))
            };
            let of_moment = (0..bodies).into_par_iter().filter_map(of_grain).max_by(|a, b| a.0.total_cmp(&b.0));
            deepest = deepest.into_iter().chain(of_moment).max_by(|a: &(f64, _, _), b| a.0.total_cmp(&b.0));
        }
        let found = deepest.filter(|(overlap, ..)| *overlap > 0.0).map(|(overlap, i, j)| {
            let number = |id: u32| numbers.of_grain(id as usize);
            let other = s.id.get(j).map_or(Other::Wall((j - bodies) as u32), |id| Other::Grain(number(*id)));
            DeepOverlap { over_radius: overlap, step, pair: Some((number(s.id[i]), other)) }
        });
        s.release(&arrays.into_iter().filter(|array| !is_kept(array)).collect::<Vec<_>>());
        Ok(found)
    }

    /// All grains now, in input order, with velocities and spins brought to the time of the positions.
    pub fn grains(&mut self) -> Result<Vec<Grain>> {
        self.refresh()?;
        self.runner.execute_plan(&self.plans.velocities)?;
        let arrays = [&POSITION, &POSITION_LOW, &VELOCITY_NEXT, &SPIN_NEXT, &VELOCITY_LOW_NEXT, &ID];
        let mut grains = memory::copied(&self.assembly.grains)?;
        if let Some(law) = &self.growth {
            let time = self.time();
            grains.iter_mut().for_each(|grain| grain.radius *= law.factor(grain.material, time));
        }
        self.runner.read_pieces(&arrays, grains.len(), |_, s| {
            for (i, id) in s.id.iter().enumerate() {
                let grain = &mut grains[*id as usize];
                grain.position = s.position[i].x + position_low_of(s, i).x;
                let low = s.velocity_low_next.get(i).copied().unwrap_or_default();
                let v = s.velocity_next[i].v;
                grain.velocity = v + low_of(s, Quantity::Velocity, v, low.v);
                grain.spin = s.spin_next.get(i).map_or(grain.spin, |spin| spin.0 + spin_low_of(s, spin.0, low.spin));
            }
        })?;
        Ok(grains)
    }

    /// The same as columns.
    ///
    /// # Errors
    /// As [`Simulation::grains`].
    pub fn columns(&mut self) -> Result<Columns> {
        Ok(Columns::from(&self.grains()?[..]))
    }

    /// All clumps now, in input order, with velocities and spins brought to the time of the positions; empty in a scene
    /// without.
    pub fn clumps(&mut self) -> Result<Vec<Clump>> {
        if self.runner.state.model.grains == Grains::Spheres {
            return Ok(Vec::new());
        }
        self.refresh()?;
        self.runner.execute_plan(&self.plans.velocities)?;
        let arrays = [
            &CENTER,
            &CENTER_LOW,
            &ORIENTATION,
            &ORIENTATION_LOW,
            &CLUMP_VELOCITY_NEXT,
            &CLUMP_SPIN_NEXT,
            &CLUMP_VELOCITY_LOW_NEXT,
            &INVERSE_MOMENTS,
        ];
        let mut clumps = memory::copied(&self.assembly.clumps)?;
        self.runner.read_pieces(&arrays, clumps.len(), |first, s| {
            for (c, clump) in clumps[first..].iter_mut().take(s.center.len()).enumerate() {
                let orientation = s.orientation[c].0 + s.orientation_low.get(c).map_or(DVec4::ZERO, |low| low.0);
                clump.position = s.center[c] + s.center_low.get(c).copied().unwrap_or_default();
                let low = s.clump_velocity_low_next.get(c).copied().unwrap_or_default();
                let (v, w) = (s.clump_velocity_next[c].v, s.clump_spin_next[c].0);
                clump.velocity = v + low_of(s, Quantity::Velocity, v, low.v);
                let w = w + spin_low_of(s, w, low.spin);
                clump.spin = grains::global_spin(s, s.inverse_moments[c].0, orientation, w);
                let principal = DQuat::from_vec4(orientation).normalize();
                clump.orientation = principal * self.assembly.shapes[clump.shape as usize].frame.inverse();
            }
        })?;
        Ok(clumps)
    }

    /// How hard the iterations for the rotation of clumps had to work so far, the predictor-corrector (2.24)-(2.31) or
    /// in contact dynamics that of the gyroscopic term: most rounds for a clump, and how often one ended before it met
    /// the tolerance. None in a scene without clumps.
    pub fn rotation_rounds(&mut self) -> Result<Option<(u32, u32)>> {
        if self.runner.state.model.grains == Grains::Spheres {
            return Ok(None);
        }
        let s = self.runner.read(&[&ROTATION_ITERATIONS])?;
        let RotationIterations { most, capped } = s.rotation_iterations[0];
        Ok(Some((most, capped)))
    }

    /// Contact force (N) and its moment about the centre (N m) on every grain now, in input order; walls and dashpots
    /// included, weight and global damping not.
    pub fn forces(&mut self) -> Result<Vec<(DVec3, DVec3)>> {
        self.refresh()?;
        self.listed_forces()
    }

    /// The same of the last step of contact dynamics, from where it set out: there its impulses acted. Nothing may have
    /// been asked of the simulation since.
    pub(crate) fn forces_of_last_step(&mut self) -> Result<Vec<(DVec3, DVec3)>> {
        let back = swap_again(&self.plans.swaps);
        self.runner.execute_plan(&back)?;
        let forces = self.listed_forces();
        self.runner.execute_plan(&back)?;
        forces
    }

    /// Of the lists that there are.
    fn listed_forces(&mut self) -> Result<Vec<(DVec3, DVec3)>> {
        let bodies = self.runner.state.sizes.bodies;
        let rotating = self.runner.state.model.rotation == Rotation::Sphere;
        let arrays: &[&'static Array] = if rotating { &[&FORCE, &TORQUE] } else { &[&FORCE] };
        self.runner.engine.resize(arrays, bodies)?;
        self.runner.execute_plan(&self.plans.forces)?;
        let mut forces = memory::filled((DVec3::ZERO, DVec3::ZERO), bodies)?;
        self.runner.read_pieces(&[arrays, &[&ID]].concat(), bodies, |_, s| {
            for (i, id) in s.id.iter().enumerate() {
                forces[*id as usize] = (s.force[i], s.torque.get(i).map_or(DVec3::ZERO, |t| t.0));
            }
        })?;
        self.runner.engine.resize(arrays, 1)?;
        Ok(forces)
    }

    /// How far the forces on a free grain are from balance at most: `|ΣF + m g|` over its weight or, where that is more,
    /// the mean contact force; and the number of that grain, of a clump its own. In contact dynamics that is the
    /// acceleration which the impulses of the last step have left. None without a free grain.
    pub fn force_balance(&mut self) -> Result<Option<(f64, u32)>> {
        let contact_force = self.sample()?.contact_force;
        let forces = self.forces()?;
        let (masses, gravity) = (masses(&self.assembly_now()), self.assembly.gravity);
        let of_grain = |mass: f64, force: DVec3| {
            let scale = (mass * gravity.length()).max(contact_force).max(f64::MIN_POSITIVE);
            (force + mass * gravity).length() / scale
        };
        let numbers = &self.assembly.numbers;
        let balances: Vec<(f64, u32)> = match &self.assembly.clumps[..] {
            [] => {
                let free = self.assembly.grains.iter().enumerate().filter(|(_, grain)| !grain.fixed);
                free.map(|(i, _)| (of_grain(masses[i], forces[i].0), numbers.of_grain(i))).collect()
            }
            clumps => {
                let free = clumps.iter().enumerate().filter(|(_, clump)| !clump.fixed);
                let load = |c: usize| self.assembly.members(c).map(|i| forces[i].0).sum();
                let of_clump = |c, clump| of_grain(mass_of_clump(&self.assembly, clump), load(c));
                free.map(|(c, clump)| (of_clump(c, clump), numbers.of_clump(c))).collect()
            }
        };
        Ok(balances.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)))
    }

    /// The domain now: its cell may have deformed.
    ///
    /// # Errors
    /// [`Error::Device`] if the device is lost.
    pub fn domain(&mut self) -> Result<Domain> {
        let mut domain = self.assembly.domain;
        if let Some(cell) = self.cell()? {
            let length = cell.length + cell.length_low;
            for axis in (0..3).filter(|axis| domain.periodic[*axis]) {
                domain.upper[axis] = domain.lower[axis] + length[axis];
            }
            domain.tilt = cell.tilt.0 + cell.tilt_low.0;
        }
        Ok(domain)
    }

    /// Strain of the cell so far, component by component as [`Cell::strain_rate`](crate::scene::Cell::strain_rate): true
    /// strains along the axes, and shears (how far faces have moved past each other, over their distance now). None of a
    /// cell that does not deform.
    ///
    /// # Errors
    /// [`Error::Device`] if the device is lost.
    pub fn strain(&mut self) -> Result<Option<[f64; 6]>> {
        let Some(cell) = self.cell()? else { return Ok(None) };
        let start = self.assembly.domain;
        let closed = |length: DVec3| DVec3::select(length.cmpeq(DVec3::ZERO), DVec3::ONE, length);
        let (period, length) = (closed(self.params().period), closed(cell.length + cell.length_low));
        // The edges as if no tilt had been turned back, and what has made them of those of the start.
        let tilt = product_above(length, cell.tilt.0 + cell.tilt_low.0, DVec3::ONE, cell.turned_back.0);
        let grown = length / period;
        let inverse = inverse_above(period, start.tilt);
        let shear = product_above(length, tilt, 1.0 / period, inverse) / DVec3::new(grown.z, grown.z, grown.y);
        let normal = grown.map(f64::ln);
        Ok(Some([normal.x, normal.y, normal.z, shear.x, shear.y, shear.z]))
    }

    /// The sample with what there is to say of a cell that may deform.
    fn with_cell(&mut self, sample: Sample) -> Result<Sample> {
        let (dims, grain_volume) = (self.model().dims(), self.grain_volume());
        let Some(cell) = self.cell()? else {
            // Grains that grow load a cell that keeps its form, too.
            let closed = self.growth.is_some() && (0..dims).all(|axis| self.assembly.domain.periodic[axis]);
            let (dimension, p) = (self.model().dimension, self.params());
            let volume = closed.then(|| volume_of(dimension, p.period + p.period_low));
            let of = |volume| CellSample::new(&sample, [0.0; 6], Some(volume), grain_volume, dims);
            return Ok(Sample { cell: volume.map(of), ..sample });
        };
        let strain = self.strain()?.unwrap_or_default();
        let length = cell.length + cell.length_low;
        let volume = Some(volume_of(self.model().dimension, length)).filter(|volume| *volume > 0.0);
        let of_sample = CellSample::new(&sample, strain, volume, grain_volume, dims);
        let part = |of: &[f64; 6]| (DVec3::new(of[0], of[1], of[2]), DVec3::new(of[3], of[4], of[5]));
        let ((virial, above), (flux, flux_above)) = (part(&sample.virial), part(&sample.flux));
        let cell_power = flow_power(&self.runner.state, virial - flux, above - flux_above);
        Ok(Sample { cell_power, cell: Some(of_sample), ..sample })
    }

    /// The sample with what there is to say of radii that change.
    fn with_growth(&self, sample: Sample) -> Sample {
        let growth = self.growth.as_ref().map(|law| {
            let radius = |grain: &Grain| grain.radius * law.factor(grain.material, self.time());
            let mean_radius = self.assembly.grains.iter().map(radius).sum::<f64>() / self.assembly.grains.len() as f64;
            GrowthSample { mean_radius, work_growth: None }
        });
        Sample { growth, ..sample }
    }

    /// Volumes of all grains now, m³ (m²), overlaps counted twice.
    fn grain_volume(&self) -> f64 {
        self.growth.as_ref().map_or_else(|| self.assembly.grain_volume(), |law| law.volume(self.time()))
    }

    /// Whether a radius still changes.
    pub fn is_growing(&self) -> bool {
        self.growth.as_ref().is_some_and(|law| law.goes_on(self.time()))
    }

    /// The scene with radii as they are now.
    pub(super) fn assembly_now(&self) -> Cow<'_, Assembly> {
        let at = |law: &GrowthLaw| Cow::Owned(self.assembly.at_time(law, self.time()));
        self.growth.as_ref().map_or(Cow::Borrowed(&self.assembly), at)
    }

    /// The cell as a device has it, if it may deform.
    fn cell(&mut self) -> Result<Option<Cell>> {
        if !(CELL.needed)(self.model()) {
            return Ok(None);
        }
        Ok(Some(self.runner.read(&[&CELL])?.cell[0]))
    }

    /// From now on the cell deforms at these rates, 1/s, as [`Cell::strain_rate`](crate::scene::Cell::strain_rate).
    ///
    /// # Errors
    /// [`Error::Scene`] of a cell that keeps its form, [`Error::Device`] if the
    /// device is lost.
    pub fn deform(&mut self, strain_rate: [f64; 6]) -> Result<()> {
        let (rate, shear_rate) = scene::Cell { strain_rate, ..self.assembly.cell }.gradient(self.dt());
        if self.cell()?.is_none() {
            return Err(Error::Scene("the cell of the scene keeps its form".to_owned()));
        }
        let Runner { engine, state, .. } = &mut self.runner;
        let cell = &mut state.cell[0];
        (cell.rate_next, cell.shear_rate_next) = (rate, Spin(shear_rate));
        cell.largest_rate = (rate.length_squared() + shear_rate.length_squared()).sqrt();
        engine.write(&[&CELL], 0, state)
    }

    /// Whether the grains of a sample of now are at rest without carrying anything: no overlap is more than this part of
    /// the radius, no grain goes as much of it in a step, and nothing will drive them.
    pub fn is_unjammed(&self, sample: &Sample) -> bool {
        const UNJAMMED: f64 = 1e-7;
        let assembly = &*self.assembly_now();
        let masses = masses(assembly).into_iter().zip(&assembly.grains).filter(|(_, grain)| !grain.fixed);
        let mass: f64 = masses.map(|(mass, _)| mass).sum();
        let stride = self.dt() * (2.0 * sample.kinetic_energy / mass).sqrt();
        assembly.is_left_alone()
            && !self.is_growing()
            && sample.max_overlap_over_radius <= UNJAMMED
            && stride <= UNJAMMED * assembly.mean_radius()
    }

    /// Walls now.
    pub fn walls(&mut self) -> Result<Vec<Wall>> {
        let mut walls = self.assembly.walls.clone();
        if self.runner.state.model.moving_walls {
            self.runner.read(&[&WALL])?;
            for (wall, now) in walls.iter_mut().zip(&self.runner.state.wall) {
                match &mut wall.surface {
                    Surface::Plane { point, normal } => {
                        *point = now.point + now.low;
                        if wall.motion.turning.is_some() {
                            *normal = now.normal + now.normal_low;
                        }
                    }
                    Surface::Cylinder { center, radius } => {
                        *center = now.point + now.low;
                        if wall.servo.is_some() {
                            *radius = now.radius + now.radius_low;
                        }
                    }
                }
                if wall.is_guided() || wall.servo.is_some() {
                    (wall.velocity, wall.spin) = (now.velocity, now.spin.0.z);
                }
            }
        }
        Ok(walls)
    }
}
