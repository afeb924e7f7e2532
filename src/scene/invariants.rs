//! What holds of every [`Assembly`], whoever made it.

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::check::{self, Check, show};
use super::origin::Origin;
use super::validate::{check_count, check_output, check_solver, check_start, check_stop, first_error, fold_ends};
use super::wall_targets::check_servo;
use super::walls::{not_periodic, turns_across};
use super::{Assembly, Clump, Dashpot, Grain, Method, Rate, Shape, Surface};
use crate::Result;
use std::collections::BTreeSet;

/// How far a direction may be from unit length, and a member from where its clump has it, in radii of the clump:
/// rounding of single precision, and no more.
const SLACK: f64 = 1e-4;

impl Assembly {
    /// Checks what scene files and builders guarantee: finite numbers, positive radii and densities, indices that
    /// exist, members where their clumps have them, grains inside domain and walls that do not overlap by more than the
    /// scene allows. The messages are those of scene files. [`Simulation::new`](crate::simulation::Simulation::new)
    /// calls this.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) with the first value that is wrong.
    pub fn validate(&self) -> Result<()> {
        let origin = &Origin { name: "assembly".to_owned(), directory: "".into(), set: Vec::new() };
        check::dimension(self.dimension, origin)?;
        let check = &Check {
            origin,
            dimension: self.dimension,
            rigid: self.solver.method != Method::DiscreteElements,
            materials: self.materials.iter().map(|material| material.name.as_str()).collect(),
            densities: self.materials.iter().map(|material| material.density).collect(),
            initial: vec![1.0; self.materials.len()],
            placed: false,
        };
        check.finite("gravity", self.gravity)?;
        self.check_domain(check)?;
        self.check_materials(check)?;
        self.check_walls(check)?;
        check_solver(&self.solver, check)?;
        check_stop(&self.stop, check)?;
        check_output(&self.output, check)?;
        check_count(self.whole().grains.len(), check)?;
        self.check_openings(check)?;
        first_error(self.grains.par_iter().enumerate().map(|(id, grain)| self.check_grain(id, grain, check)))?;
        self.shapes.iter().enumerate().try_for_each(|(k, shape)| check_shape(k, shape, check))?;
        self.check_clumps(check)?;
        check_start(self, check)
    }

    /// Moves what is at the upper end of a period to the lower one.
    pub(crate) fn fold_ends(&mut self) {
        fold_ends(&mut self.grains, &mut self.clumps, &self.domain);
    }

    /// What comes in over time, and what leaves.
    fn check_openings(&self, check: &Check) -> Result<()> {
        for insertion in &self.insertions {
            let key = &insertion.name;
            let (Rate::Number(rate) | Rate::Mass(rate)) = insertion.rate;
            check.positive(&format!("{key}.insertion.rate"), rate, "")?;
            check.finite(&format!("{key}.region.lower"), insertion.region.lower)?;
            check.finite(&format!("{key}.region.upper"), insertion.region.upper)?;
            let grains = insertion.grains.iter().enumerate();
            grains.into_iter().try_for_each(|(k, grain)| self.check_grain(k, grain, check))?;
        }
        let names = self.outlets.iter().map(|outlet| &outlet.name).collect::<BTreeSet<_>>();
        match names.len() == self.outlets.len() {
            true => Ok(()),
            false => Err(check.origin.wrong("outlet", "two outlets have the same name")),
        }
    }

    fn check_domain(&self, check: &Check) -> Result<()> {
        let domain = &self.domain;
        for (corner, at) in [("lower", domain.lower), ("upper", domain.upper)] {
            let bad = |axis: &usize| at[*axis].is_nan() || (domain.periodic[*axis] && at[*axis].is_infinite());
            if let Some(axis) = (0..3).find(bad) {
                return Err(check.origin.bad(&format!("domain.{corner}.{axis}"), at[axis], check::FINITE));
            }
        }
        if check.dimension == 2 && domain.periodic[2] {
            return Err(check.origin.wrong("domain.boundary", "the axis z cannot be periodic (dimension = 2)"));
        }
        let dims = check.dimension;
        check.corners("domain", &domain.lower.to_array()[..dims], &domain.upper.to_array()[..dims])?;
        Ok(())
    }

    fn check_materials(&self, check: &Check) -> Result<()> {
        for (k, material) in self.materials.iter().enumerate() {
            check.positive(&format!("material.{k}.density"), material.density, " of kg/m³")?;
        }
        let count = self.materials.len();
        if self.pairs.len() != count * count {
            let message = format!("has {} entries, must be {count}² for {count} materials", self.pairs.len());
            return Err(check.origin.wrong("pair", message));
        }
        let compliant = matches!(self.solver.method, Method::ContactDynamics(relaxation) if relaxation.compliant);
        for (k, pair) in self.pairs.iter().enumerate() {
            pair.check(k, compliant, check)?;
            if *pair != self.pairs[k % count * count + k / count] {
                let message = "differs from the pair of the same materials in the other order";
                return Err(check.origin.wrong(&format!("pair.{k}"), message));
            }
        }
        if self.pairs.iter().any(|pair| pair.hertz.is_some() != self.pairs[0].hertz.is_some()) {
            let message = "some are of elastic spheres (hertz) and some have linear springs; all pairs of a scene must use the same law";
            return Err(check.origin.wrong("pair", message));
        }
        let has = |kind: fn(&Dashpot) -> bool| self.pairs.iter().any(|pair| kind(&pair.dashpot));
        if has(|d| matches!(d, Dashpot::Restitution(_))) && has(|d| matches!(d, Dashpot::MassScaled(_))) {
            let message = "some have restitution and some normal_damping; all pairs of a scene must use the same one";
            return Err(check.origin.wrong("pair", message));
        }
        Ok(())
    }

    fn check_walls(&self, check: &Check) -> Result<()> {
        for (k, wall) in self.walls.iter().enumerate() {
            let key = format!("wall.{k}");
            let at = |field: &str| format!("{key}.{field}");
            check.index(&at("material"), wall.material, self.materials.len(), "material")?;
            check.finite(&at("velocity"), wall.velocity)?;
            check.finite(&at("motion"), wall.at(wall.motion.start, 1.0).velocity_at(DVec3::ZERO))?;
            let mut across = (0..check.dimension).filter(|axis| turns_across(&wall.motion, *axis));
            across.try_for_each(|axis| not_periodic(&key, axis, &self.domain, check))?;
            check_servo(wall, &key, check)?;
            match wall.surface {
                Surface::Plane { point, normal } => {
                    check.finite(&at("point"), point)?;
                    check.finite(&at("normal"), normal)?;
                    if wall.spin != 0.0 {
                        return Err(check.origin.bad(&at("spin"), wall.spin, "must be 0, because the wall is a plane"));
                    }
                    if (normal.length() - 1.0).abs() > SLACK {
                        return Err(check.origin.bad(&at("normal"), normal, "must be a unit vector"));
                    }
                    let mut across = (0..check.dimension).filter(|axis| normal[*axis] != 0.0);
                    across.try_for_each(|axis| not_periodic(&key, axis, &self.domain, check))?;
                }
                Surface::Cylinder { center, radius } => {
                    check.finite(&at("center"), center)?;
                    check.positive(&at("radius"), radius, " of m")?;
                    check.finite(&at("spin"), wall.spin * DVec3::X)?;
                    (0..2).try_for_each(|axis| not_periodic(&key, axis, &self.domain, check))?;
                }
            }
        }
        Ok(())
    }

    /// Keys are spelt out only where something is wrong, because there may be millions of grains.
    fn check_grain(&self, id: usize, grain: &Grain, check: &Check) -> Result<()> {
        let numbers = [grain.position, grain.velocity, grain.spin].iter().all(|vector| vector.is_finite());
        let flat = grain.position.z == 0.0 && grain.velocity.z == 0.0 && grain.spin.truncate() == glam::DVec2::ZERO;
        let material = (grain.material as usize) < self.materials.len();
        let radius = grain.radius > 0.0 && grain.radius.is_finite();
        let mass = || !self.clumps.is_empty() || check.fault_of_body(grain.radius, grain.material).is_none();
        if numbers && (flat || check.dimension == 3) && material && radius && mass() {
            return Ok(());
        }
        let at = |field: &str| format!("grain.{id}.{field}");
        check.finite(&at("position"), grain.position)?;
        check.finite(&at("velocity"), grain.velocity)?;
        check_spin(&at("spin"), grain.spin, check)?;
        check.positive(&at("radius"), grain.radius, " of m")?;
        check.index(&at("material"), grain.material, self.materials.len(), "material")?;
        check.body(&at("radius"), grain.radius, grain.material)
    }

    fn check_clumps(&self, check: &Check) -> Result<()> {
        let mut first = 0;
        for (k, clump) in self.clumps.iter().enumerate() {
            let at = |field: &str| format!("clump.{k}.{field}");
            check.index(&at("shape"), clump.shape, self.shapes.len(), "shape")?;
            check.finite(&at("position"), clump.position)?;
            check.finite(&at("velocity"), clump.velocity)?;
            check_spin(&at("spin"), clump.spin, check)?;
            check_rotation(&at("orientation"), clump.orientation, check)?;
            check.positive(&at("radius"), clump.radius, " of m")?;
            check.index(&at("material"), clump.material, self.materials.len(), "material")?;
            check.body(&at("radius"), clump.radius, clump.material)?;
            let shape = &self.shapes[clump.shape as usize];
            let last = first + shape.members.len();
            if clump.first as usize != first || last > self.grains.len() {
                let rule = format!("must be {first}, with {} members from there on in `grains`", shape.members.len());
                return Err(check.origin.bad(&at("first"), clump.first, rule));
            }
            for (id, member) in (first..last).zip(clump.members(shape)) {
                if !self.agrees(clump, &self.grains[id], &member) {
                    let message = format!("is not what shape, place and size of clump {k} make of it");
                    return Err(check.origin.wrong(&format!("grain.{id}"), message));
                }
            }
            first = last;
        }
        if !self.clumps.is_empty() && first != self.grains.len() {
            let message = format!("have {first} members, must have all {} grains", self.grains.len());
            return Err(check.origin.wrong("clump", message));
        }
        Ok(())
    }

    /// Whether a grain is this member of the clump, but for its period.
    fn agrees(&self, clump: &Clump, grain: &Grain, member: &Grain) -> bool {
        let off = self.domain.nearest(grain.position - member.position);
        let near = |distance: f64| distance <= SLACK * clump.radius;
        let same = grain.material == clump.material && grain.fixed == clump.fixed;
        near(off.length()) && near((grain.radius - member.radius).abs()) && same
    }
}

/// rad/s; in two dimensions about z.
fn check_spin(key: &str, spin: DVec3, check: &Check) -> Result<()> {
    if let Some(axis) = (0..3).find(|axis| !spin[*axis].is_finite()) {
        return Err(check.origin.bad(&format!("{key}.{axis}"), spin[axis], check::FINITE));
    }
    match check.dimension == 2 && (spin.x != 0.0 || spin.y != 0.0) {
        true => Err(check.origin.wrong(key, "must be about z alone (dimension = 2)")),
        false => Ok(()),
    }
}

fn check_rotation(key: &str, rotation: DQuat, check: &Check) -> Result<()> {
    match (rotation.length() - 1.0).abs() <= SLACK {
        true => Ok(()),
        false => Err(check.origin.bad(key, rotation, "must be a quaternion of length 1")),
    }
}

fn check_shape(k: usize, shape: &Shape, check: &Check) -> Result<()> {
    let at = |field: &str| format!("shape.{k}.{field}");
    if shape.members.is_empty() {
        return Err(check.origin.wrong(&at("members"), "must have at least one"));
    }
    if shape.exposed.len() != shape.members.len() {
        let rule =
            format!("has {} entries, must have one for each of {} members", shape.exposed.len(), shape.members.len());
        return Err(check.origin.wrong(&at("exposed"), rule));
    }
    for (m, member) in shape.members.iter().enumerate() {
        check.finite(&at(&format!("members.{m}.center")), member.arm)?;
        check.positive(&at(&format!("members.{m}.radius")), member.radius, "")?;
    }
    if !(shape.gyration.is_finite() && shape.gyration.min_element() > 0.0) {
        let g = shape.gyration;
        let value = format!("[{}, {}, {}]", show(g.x), show(g.y), show(g.z));
        return Err(check.origin.bad(&at("gyration"), value, "must be positive numbers"));
    }
    check_rotation(&at("frame"), shape.frame, check)
}
