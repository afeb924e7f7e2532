//! Grains that come in over time.

use std::f64::consts::PI;

use glam::DVec3;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::bodies::Bodies;
use super::check::{AXES, Check, show};
use super::schema;
use super::{Assembly, Domain, Insertion, Rate, Region, Surface};
use crate::Result;

impl Region {
    /// The same elsewhere.
    #[must_use]
    pub fn moved(&self, by: DVec3) -> Region {
        let around = self.around.map(|around| match around {
            Surface::Cylinder { center, radius } => Surface::Cylinder { center: center + by.with_z(0.0), radius },
            plane @ Surface::Plane { .. } => plane,
        });
        Region { lower: self.lower + by, upper: self.upper + by, around }
    }

    /// Whether it reaches around the domain along a periodic axis.
    fn wraps(&self, axis: usize, domain: &Domain) -> bool {
        domain.periodic[axis] && self.lower[axis] <= domain.lower[axis] && self.upper[axis] >= domain.upper[axis]
    }

    /// Whether a grain is inside as a whole.
    pub fn holds(&self, x: DVec3, radius: f64, domain: &Domain) -> bool {
        let within = |axis: usize| x[axis] - radius >= self.lower[axis] && x[axis] + radius <= self.upper[axis];
        let bounded = |axis: usize| self.upper[axis] > self.lower[axis] && !self.wraps(axis, domain);
        (0..3).filter(|axis| bounded(*axis)).all(within)
            && self.around.is_none_or(|around| around.distance(x) >= radius)
    }

    /// A place for the centre of a grain, of this radius, that is inside of the box as a whole, which is not narrower.
    pub fn random_point(&self, radius: f64, domain: &Domain, rng: &mut ChaCha8Rng) -> DVec3 {
        let mut point = DVec3::ZERO;
        for axis in (0..3).filter(|axis| self.upper[*axis] > self.lower[*axis]) {
            let inset = if self.wraps(axis, domain) { 0.0 } else { radius };
            let (low, high) = (self.lower[axis] + inset, self.upper[axis] - inset);
            point[axis] = low + (high - low) * rng.random::<f64>();
        }
        point
    }

    /// Whether a grain may reach into it, as far as axes without periods tell.
    pub fn is_near(&self, x: DVec3, radius: f64, domain: &Domain) -> bool {
        let within = |axis: usize| x[axis] + radius >= self.lower[axis] && x[axis] - radius <= self.upper[axis];
        (0..3).filter(|axis| !domain.periodic[*axis] && self.upper[*axis] > self.lower[*axis]).all(within)
    }

    /// m³ (m²)
    fn volume(&self, dimension: usize) -> f64 {
        let sides = self.upper - self.lower;
        let area = match self.around {
            Some(Surface::Cylinder { radius, .. }) => (PI * radius * radius).min(sides.x * sides.y),
            _ => sides.x * sides.y,
        };
        if dimension == 2 { area } else { area * sides.z }
    }

    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) if it is without bounds, or too narrow for a grain of this radius.
    fn check_room(&self, key: &str, radius: f64, check: &Check) -> Result<()> {
        for (axis, name) in AXES.iter().enumerate().take(check.dimension) {
            let width = self.upper[axis] - self.lower[axis];
            if !width.is_finite() {
                let message = format!("missing; without it the space along {name} has no bounds");
                return Err(check.origin.wrong(key, message));
            }
            if width < 2.0 * radius {
                let what = match width {
                    ..=0.0 => "is outside of the domain, or beyond a wall".to_owned(),
                    _ => format!("inside of domain and walls is {} m wide along {name}", show(width)),
                };
                let message = format!("{what}; the largest grain needs {} m", show(2.0 * radius));
                return Err(check.origin.wrong(key, message));
            }
        }
        match self.around {
            Some(Surface::Cylinder { radius: own, .. }) if own < radius => {
                let rule = format!("must be at least {} m, for the largest grain", show(radius));
                Err(check.origin.bad(&format!("{key}.radius"), show(own), rule))
            }
            _ => Ok(()),
        }
    }
}

/// Of a region, in two and three dimensions, that a batch of grains fills: so few that hardly one has to wait.
const FILLED: [f64; 2] = [0.2, 0.1];
/// Steps between batches where nothing moves out of the region.
const USUAL_STEPS: f64 = 1000.0;

impl Insertion {
    /// What a population says of it.
    pub(super) fn read(
        given: &schema::Insertion,
        key: &str,
        region: Region,
        largest: f64,
        check: &Check,
    ) -> Result<Insertion> {
        let at = |field: &str| format!("{key}.insertion.{field}");
        region.check_room(&format!("{key}.region"), largest, check)?;
        let rate = match (given.rate, given.mass_rate) {
            (Some(rate), None) => Rate::Number(check.positive(&at("rate"), rate, " of grains/s")?),
            (None, Some(rate)) => Rate::Mass(check.positive(&at("mass_rate"), rate, " of kg/s")?),
            _ => {
                let message = "takes one of `rate` (grains/s) and `mass_rate` (kg/s)";
                return Err(check.origin.wrong(&format!("{key}.insertion"), message));
            }
        };
        let positive = |field: &str, value: Option<f64>, unit: &str| {
            value.map(|value| check.positive(&at(field), value, unit)).transpose()
        };
        let start = check.not_negative(&at("start"), given.start.unwrap_or(0.0), " of s")?;
        let stop = given.stop.unwrap_or(f64::INFINITY);
        if stop <= start {
            let rule = format!("must be after start = {} s", show(start));
            return Err(check.origin.bad(&at("stop"), show(stop), rule));
        }
        Ok(Insertion {
            name: key.to_owned(),
            region,
            region_velocity: check.vector_or_zero(&at("region_velocity"), given.region_velocity.as_deref())?,
            rate,
            most_mass: positive("mass", given.mass, " of kg")?.unwrap_or(f64::INFINITY),
            start,
            stop,
            interval: positive("interval", given.interval, " of s")?,
            seed: 0,
            grains: Vec::new(),
            clumps: Vec::new(),
            first_grain: 0,
            first_clump: 0,
        })
    }

    /// Grains or, among clumps, clumps.
    pub fn count(&self) -> usize {
        if self.clumps.is_empty() { self.grains.len() } else { self.clumps.len() }
    }

    /// kg, of number k.
    pub fn mass(&self, k: usize, assembly: &Assembly) -> f64 {
        let (radius, material) = match self.clumps.get(k) {
            Some(clump) => (clump.radius, clump.material),
            None => (self.grains[k].radius, self.grains[k].material),
        };
        assembly.mass_of(radius, material)
    }

    /// m/s, of number k as it comes in.
    pub fn velocity(&self, k: usize) -> DVec3 {
        self.clumps.get(k).map_or_else(|| self.grains[k].velocity, |clump| clump.velocity)
    }

    /// How many should have come in, or what mass (kg), at this time, s.
    pub fn due(&self, time: f64) -> f64 {
        let (Rate::Number(rate) | Rate::Mass(rate)) = self.rate;
        rate * (time.min(self.stop) - self.start).max(0.0)
    }

    /// When the last one should have come in, s.
    fn end(&self, assembly: &Assembly) -> f64 {
        let seconds = match self.rate {
            Rate::Number(rate) => self.count() as f64 / rate,
            Rate::Mass(rate) => (0..self.count()).map(|k| self.mass(k, assembly)).sum::<f64>() / rate,
        };
        self.stop.min(self.start + seconds)
    }

    /// Steps from one batch to the next: as given, or the time in which what comes in leaves the region again, but less if
    /// a batch would then fill much of it.
    pub fn interval(&self, assembly: &Assembly, dt: f64) -> u64 {
        let seconds = self.interval.unwrap_or_else(|| {
            let count = self.count().max(1) as f64;
            let mean = |of: &dyn Fn(usize) -> f64| (0..self.count()).map(of).sum::<f64>() / count;
            let mass = mean(&|k| self.mass(k, assembly));
            let volume = self.grains.iter().map(|g| assembly.volume_of(g.radius)).sum::<f64>() / count;
            let per_second = match self.rate {
                Rate::Number(rate) => rate,
                Rate::Mass(rate) => rate / mass,
            };
            let room = FILLED[assembly.dimension - 2] * self.region.volume(assembly.dimension);
            self.time_inside(assembly.gravity, dt).min(room / (per_second * volume))
        });
        ((seconds / dt * (1.0 + 1e-9)) as u64).max(1)
    }

    /// In which a grain falls, or flies, through the region, s.
    fn time_inside(&self, gravity: DVec3, dt: f64) -> f64 {
        let count = self.count().max(1) as f64;
        let velocity = (0..self.count()).map(|k| self.velocity(k)).sum::<DVec3>() / count;
        let Some(down) = gravity.try_normalize().or_else(|| velocity.try_normalize()) else { return USUAL_STEPS * dt };
        let height = (self.region.upper - self.region.lower).dot(down.abs());
        let (v, g) = (velocity.dot(down).max(0.0), gravity.length());
        // The positive root of v t + g t² / 2 = height.
        2.0 * height / (v + (v * v + 2.0 * g * height).sqrt())
    }
}

/// An insertion with its part of the bodies that have been made: the numbers of its first grain and of what is behind its
/// last.
pub(super) struct Waiting {
    pub insertion: Insertion,
    pub grains: std::ops::Range<usize>,
}

/// Split off what comes in over time, which is last.
pub(super) fn split(assembly: &mut Assembly, waiting: Vec<Waiting>) {
    let Some(first) = waiting.first().map(|waiting| waiting.grains.start) else { return };
    for Waiting { mut insertion, grains } in waiting {
        let clump = |number: usize| assembly.clumps.partition_point(|clump| (clump.first as usize) < number);
        let clumps = clump(grains.start)..clump(grains.end);
        insertion.first_grain = assembly.numbers.of_grain(grains.start);
        insertion.first_clump = assembly.numbers.of_clump(clumps.start);
        insertion.clumps = assembly.clumps[clumps].to_vec();
        insertion.clumps.iter_mut().for_each(|clump| clump.first -= grains.start as u32);
        insertion.grains = assembly.grains[grains].to_vec();
        // How far they may go with the region is known, too.
        let by = insertion.end(assembly) * insertion.region_velocity;
        insertion.grains.iter_mut().skip(1).step_by(2).for_each(|grain| grain.position += by);
        assembly.insertions.push(insertion);
    }
    let clumps = assembly.clumps.partition_point(|clump| (clump.first as usize) < first);
    assembly.grains.truncate(first);
    assembly.clumps.truncate(clumps);
    assembly.numbers.grains.truncate(first);
    assembly.numbers.clumps.truncate(clumps);
}

/// What comes in over time is made last.
pub(super) fn populate_over_time(
    file: &schema::File,
    bodies: &mut Bodies,
    mut make: impl FnMut(usize, &mut Bodies) -> Result<Option<Insertion>>,
) -> Result<Vec<Waiting>> {
    let mut waiting = Vec::new();
    for over_time in [false, true] {
        for (number, population) in file.population.iter().enumerate() {
            if population.insertion.is_some() == over_time {
                let first = bodies.grains.len();
                if let Some(insertion) = make(number, bodies)? {
                    waiting.push(Waiting { insertion, grains: first..bodies.grains.len() });
                }
            }
        }
    }
    Ok(waiting)
}
