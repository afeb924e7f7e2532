//! A packing at one moment: grains, walls and contacts, and what acts on whom.

use super::{
    contact::{Contact, Other},
    totals::{Load, OnWall, Totals},
};
use crate::{
    measure::analysis::{mass_of_clump, masses},
    scene::{Assembly, Clump, Grain, Wall},
};
use glam::{DMat3, DVec3};

/// Grains, clumps, walls and contacts of one moment. Its *particles* are what moves by itself: the clumps, or the grains
/// of a scene without any.
pub struct Packing<'a> {
    pub assembly: &'a Assembly,
    pub grains: &'a [Grain],
    pub clumps: &'a [Clump],
    pub walls: &'a [Wall],
    /// None if they have only been added up.
    pub contacts: &'a [Contact],
    pub totals: Totals,
    /// The particle of every grain; empty without clumps.
    owners: Vec<u32>,
    /// kg, of every particle.
    masses: Vec<f64>,
}

/// What a contact does to one of its free particles.
#[derive(Clone, Copy, Debug)]
pub struct Action {
    pub particle: usize,
    /// m, from its centre of mass to the contact point.
    pub arm: DVec3,
    /// N
    pub force: DVec3,
    /// N m, besides the moment of the force.
    pub couple: DVec3,
}

/// What free grains do to a wall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadOnWall {
    /// N
    pub force: DVec3,
    /// N m, about its point, or the centre of a cylinder.
    pub moment: DVec3,
    /// N, what presses on it, along the normals of the contacts.
    pub normal_force: f64,
    /// m, where the wall is: of a plane how far from the origin along its normal, of a cylinder its radius.
    pub position: f64,
}

impl<'a> Packing<'a> {
    pub fn new(
        assembly: &'a Assembly,
        grains: &'a [Grain],
        clumps: &'a [Clump],
        walls: &'a [Wall],
        contacts: &'a [Contact],
    ) -> Packing<'a> {
        let totals = Totals { walls: vec![OnWall::default(); walls.len()], ..Totals::default() };
        let mut packing = Packing { contacts, ..Packing::added_up(assembly, grains, clumps, walls, totals) };
        contacts.iter().for_each(|contact| packing.add_up(contact));
        packing
    }

    /// Of contacts that have been added up and are not at hand one by one.
    pub fn added_up(
        assembly: &'a Assembly,
        grains: &'a [Grain],
        clumps: &'a [Clump],
        walls: &'a [Wall],
        totals: Totals,
    ) -> Packing<'a> {
        let masses = match clumps {
            [] => masses(assembly),
            clumps => clumps.iter().map(|clump| mass_of_clump(assembly, clump)).collect(),
        };
        Packing { assembly, grains, clumps, walls, contacts: &[], totals, owners: assembly.owners(), masses }
    }

    /// One more contact.
    pub fn add_up(&mut self, contact: &Contact) {
        let actions = self.actions(contact);
        let totals = &mut self.totals;
        for Action { force, arm, .. } in actions.into_iter().flatten() {
            totals.virial.iter_mut().zip(arm.to_array()).for_each(|(column, arm)| column.add(-arm * force));
        }
        if actions.iter().flatten().count() == 1 {
            totals.outside.push((totals.ends.len() as u32, contact.normal));
        }
        totals.frictional |= contact.friction > 0.0;
        totals.rough.push(contact.friction > 0.0 && !contact.sliding);
        let ends = self.ends(contact);
        self.totals.ends.push(ends);
        if let Other::Wall(wall) = contact.other {
            let arm = self.point(contact) - self.walls[wall as usize].surface.reference();
            let on_wall = &mut self.totals.walls[wall as usize];
            on_wall.force.add(-contact.force);
            on_wall.moment.add(-(arm.cross(contact.force) + contact.couple));
            on_wall.normal_force.add(DVec3::X * -contact.force.dot(contact.normal));
            on_wall.contacts += 1;
        }
    }

    /// The particles of a contact; walls come after all of them.
    fn ends(&self, contact: &Contact) -> (u32, u32) {
        let other = match contact.other {
            Other::Grain(other) => self.particle_of(other),
            Other::Wall(wall) => self.particles() + wall as usize,
        };
        (self.particle_of(contact.grain) as u32, other as u32)
    }

    pub fn dims(&self) -> usize {
        self.assembly.dimension
    }

    /// How many there are, fixed ones included.
    pub fn particles(&self) -> usize {
        self.masses.len()
    }

    /// The particle that a grain is, or belongs to.
    pub fn particle_of(&self, grain: u32) -> usize {
        self.owners.get(grain as usize).map_or(grain as usize, |owner| *owner as usize)
    }

    /// What a particle is called.
    pub fn number(&self, particle: usize) -> u32 {
        match self.clumps {
            [] => self.assembly.numbers.of_grain(particle),
            _ => self.assembly.numbers.of_clump(particle),
        }
    }

    pub fn is_free(&self, particle: usize) -> bool {
        !self.clumps.get(particle).map_or_else(|| self.grains[particle].fixed, |clump| clump.fixed)
    }

    /// Those that are free.
    pub fn free(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.particles()).filter(|particle| self.is_free(*particle))
    }

    /// kg
    pub fn mass(&self, particle: usize) -> f64 {
        self.masses[particle]
    }

    /// m³ (m² in two dimensions)
    pub fn volume(&self, particle: usize) -> f64 {
        let material = self.clumps.get(particle).map_or_else(|| self.grains[particle].material, |clump| clump.material);
        self.masses[particle] / self.assembly.materials[material as usize].density
    }

    /// Centre of mass, m.
    pub fn center(&self, particle: usize) -> DVec3 {
        self.clumps.get(particle).map_or_else(|| self.grains[particle].position, |clump| clump.position)
    }

    /// m/s
    pub fn velocity(&self, particle: usize) -> DVec3 {
        self.clumps.get(particle).map_or_else(|| self.grains[particle].velocity, |clump| clump.velocity)
    }

    /// rad/s
    pub fn spin(&self, particle: usize) -> DVec3 {
        self.clumps.get(particle).map_or_else(|| self.grains[particle].spin, |clump| clump.spin)
    }

    /// m; of a clump that of the sphere (disk) of the same volume.
    pub fn radius(&self, particle: usize) -> f64 {
        self.clumps.get(particle).map_or_else(|| self.grains[particle].radius, |clump| clump.radius)
    }

    /// From the centre of a grain to the middle of an overlap along a normal, m.
    fn arm_of_grain(&self, grain: u32, normal: DVec3, overlap: f64) -> DVec3 {
        let own = &self.grains[grain as usize];
        (own.radius - 0.5 * overlap) * normal
    }

    /// From the centre of mass of a grain's particle to the contact point, m.
    fn arm(&self, grain: u32, normal: DVec3, overlap: f64) -> DVec3 {
        let arm = self.arm_of_grain(grain, normal, overlap);
        match self.owners.get(grain as usize) {
            None => arm,
            Some(owner) => {
                let to_member = self.grains[grain as usize].position - self.clumps[*owner as usize].position;
                self.assembly.domain.nearest(to_member) + arm
            }
        }
    }

    /// The contact point, m: in the middle of the overlap, beside the grain of the contact, be it outside of a period.
    pub fn point(&self, contact: &Contact) -> DVec3 {
        let arm = self.arm_of_grain(contact.grain, contact.normal, contact.overlap);
        self.grains[contact.grain as usize].position + arm
    }

    /// What a contact does to its particles, of which one may be fixed and is left out, as walls are.
    pub fn actions(&self, contact: &Contact) -> [Option<Action>; 2] {
        let &Contact { grain, other, normal, overlap, force, couple, .. } = contact;
        let action = |grain: u32, sign: f64| {
            let particle = self.particle_of(grain);
            let arm = || self.arm(grain, sign * normal, overlap);
            self.is_free(particle).then(|| Action { particle, arm: arm(), force: sign * force, couple: sign * couple })
        };
        [action(grain, 1.0), if let Other::Grain(other) = other { action(other, -1.0) } else { None }]
    }

    /// Of all contacts, on every particle about its centre of mass; nothing on fixed ones.
    pub fn loads(&self) -> Vec<Load> {
        let mut loads = vec![Load::default(); self.particles()];
        for Action { particle, arm, force, couple } in self.all_actions() {
            loads[particle].force += force;
            loads[particle].moment += arm.cross(force) + couple;
        }
        loads
    }

    /// Of all contacts.
    pub fn all_actions(&self) -> impl Iterator<Item = Action> + '_ {
        self.contacts.iter().flat_map(|contact| self.actions(contact)).flatten()
    }

    /// On every wall, about its point or the centre of a cylinder.
    pub fn loads_on_walls(&self) -> Vec<LoadOnWall> {
        let load = |(on_wall, wall): (&OnWall, &Wall)| LoadOnWall {
            force: on_wall.force.total(),
            moment: on_wall.moment.total(),
            normal_force: on_wall.normal_force.total().x,
            position: wall.surface.position(),
        };
        self.totals.walls.iter().zip(self.walls).map(load).collect()
    }
}

/// a ⊗ b: row i, column k has `a_i b_k`.
pub fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Row by row, as files have it.
pub fn rows(m: DMat3) -> [[f64; 3]; 3] {
    m.transpose().to_cols_array_2d()
}
