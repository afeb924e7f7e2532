//! Spheres and clumps on their way into the assembly.

use glam::DQuat;

use super::shape::{Shape, Shapes};
use super::{Clump, Domain, Grain};

/// A shape, and how it is turned: from its own axes to those of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    pub shape: u32,
    pub orientation: DQuat,
}

/// A sphere (disk), or a clump whose centre of mass, velocity, spin and size (that of the sphere of the same volume) the grain has.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    pub grain: Grain,
    pub pose: Option<Pose>,
}

impl Body {
    /// The clump; `first` is the number of its first member. None of a sphere.
    fn clump(&self, first: usize) -> Option<Clump> {
        let Grain { position, velocity, spin, radius, material, fixed } = self.grain;
        let Pose { shape, orientation } = self.pose?;
        Some(Clump { shape, first: first as u32, position, orientation, velocity, spin, radius, material, fixed })
    }

    /// The spheres that it consists of.
    pub fn spheres(&self, shapes: &[Shape]) -> Vec<Grain> {
        match self.clump(0) {
            Some(clump) => clump.members(&shapes[clump.shape as usize]).collect(),
            None => vec![self.grain],
        }
    }

    /// Radius of the ball about its centre that holds it, m.
    pub fn reach(&self, shapes: &[Shape]) -> f64 {
        self.grain.radius * self.pose.map_or(1.0, |pose| shapes[pose.shape as usize].reach())
    }
}

/// Everything that has been placed.
pub struct Bodies<'a> {
    pub shapes: Shapes<'a>,
    domain: Domain,
    pub grains: Vec<Grain>,
    clumps: Vec<Clump>,
}

impl<'a> Bodies<'a> {
    pub fn new(shapes: Shapes<'a>, domain: Domain) -> Bodies<'a> {
        Bodies { shapes, domain, grains: Vec::new(), clumps: Vec::new() }
    }

    pub fn push(&mut self, body: &Body) {
        let Some(clump) = body.clump(self.grains.len()) else {
            self.grains.push(body.grain);
            return;
        };
        let domain = self.domain;
        let members = clump.members(&self.shapes.all[clump.shape as usize]).map(|mut member| {
            for axis in (0..3).filter(|axis| domain.periodic[*axis]) {
                let (low, length) = (domain.lower[axis], domain.upper[axis] - domain.lower[axis]);
                // The centre is in the domain, or an error later on; its members may stand out.
                let outside = member.position[axis] < low || member.position[axis] >= low + length;
                if outside && (domain.lower[axis]..=domain.upper[axis]).contains(&clump.position[axis]) {
                    member.position[axis] = low + (member.position[axis] - low).rem_euclid(length);
                }
            }
            member
        });
        self.grains.extend(members);
        self.clumps.push(clump);
    }

    /// Shapes, grains and clumps; among clumps, spheres are clumps too.
    pub fn finish(mut self) -> (Vec<Shape>, Vec<Grain>, Vec<Clump>) {
        if self.clumps.is_empty() {
            return (Vec::new(), self.grains, Vec::new());
        }
        let mut clumps = Vec::with_capacity(self.clumps.len());
        let mut at = 0;
        let end = (self.grains.len(), 0);
        let places = self.clumps.iter().map(|c| (c.first as usize, self.shapes.all[c.shape as usize].members.len()));
        let places: Vec<(usize, usize)> = places.chain([end]).collect();
        for (k, (first, members)) in places.into_iter().enumerate() {
            for (sphere, grain) in (at..first).zip(&self.grains[at..first]) {
                let pose = Some(Pose { shape: self.shapes.sphere(), orientation: DQuat::IDENTITY });
                clumps.extend(Body { grain: *grain, pose }.clump(sphere));
            }
            clumps.extend(self.clumps.get(k));
            at = first + members;
        }
        (self.shapes.all, self.grains, clumps)
    }
}
