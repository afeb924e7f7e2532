//! A scene whose radii change: when they do what is asked for, and the sizes that they come to.

use std::borrow::Cow;

use super::check::{AXES, Check};
use super::growth::{Growth, GrowthLaw};
use super::{Assembly, Grain, Method};
use crate::Result;

/// Of the shortest period: a little less than what it must be four times as long as.
const LARGEST: f64 = 0.2499;

impl Assembly {
    /// Whether any radius changes over time.
    pub fn grows(&self) -> bool {
        self.growth.iter().any(Growth::changes)
    }

    /// How radii change, if any does.
    pub fn growth_law(&self) -> Option<GrowthLaw> {
        self.grows().then(|| {
            let mut volumes = vec![0.0; self.growth.len()];
            self.grains.iter().for_each(|grain| volumes[grain.material as usize] += self.volume_of(grain.radius));
            let (growth, dimension) = (self.growth.clone(), self.dimension as i32);
            let mut law = GrowthLaw { growth, volumes, dimension, ends: f64::INFINITY, full: f64::INFINITY };
            let periodic = (0..self.dimension).all(|axis| self.domain.periodic[axis]);
            if periodic && law.growth.iter().any(|growth| growth.ends().is_infinite()) {
                let by_volume = law.time_of_volume(self.cell_volume()).unwrap_or(f64::INFINITY);
                law.full = self.time_of_largest().min(by_volume);
            }
            if periodic && self.keeps_volume() {
                let of_target = self.stop.packing_fraction.and_then(|phi| law.time_of_volume(phi * self.cell_volume()));
                law.ends = of_target.unwrap_or(f64::INFINITY);
            }
            law
        })
    }

    /// Whether the cell is as large at all times.
    fn keeps_volume(&self) -> bool {
        self.cell.strain_rate[..3] == [0.0; 3] && !self.cell.has_volume_of_servo()
    }

    /// When the first grain is as large as a period can hold, s.
    fn time_of_largest(&self) -> f64 {
        let lengths = (self.domain.upper - self.domain.lower).to_array();
        let shortest = lengths[..self.dimension].iter().copied().fold(f64::INFINITY, f64::min);
        let of_grain = |grain: &Grain| {
            let growth = &self.growth[grain.material as usize];
            if growth.rate > 0.0 {
                (LARGEST * shortest / grain.radius - growth.start) / growth.rate
            } else {
                f64::INFINITY
            }
        };
        self.grains.iter().map(of_grain).fold(f64::INFINITY, f64::min)
    }

    /// The same with radii as they are at a time, s.
    pub fn at_time(&self, law: &GrowthLaw, time: f64) -> Assembly {
        let mut now = self.clone();
        now.grains.iter_mut().for_each(|grain| grain.radius *= law.factor(grain.material, time));
        now.growth = Vec::new();
        now
    }

    /// The same with the smallest radii that grains will have.
    pub fn with_smallest_radii(&self) -> Cow<'_, Assembly> {
        self.resized(|law, material| law.range(material)[0])
    }

    /// The same with the largest.
    pub fn with_largest_radii(&self) -> Cow<'_, Assembly> {
        self.resized(|law, material| law.range(material)[1])
    }

    /// The same with the radii of time 0.
    pub fn with_first_radii(&self) -> Cow<'_, Assembly> {
        self.resized(|law, material| law.growth[material].start)
    }

    /// Radii times a factor of their material, and as much less growth to come.
    fn resized(&self, factor: impl Fn(&GrowthLaw, usize) -> f64) -> Cow<'_, Assembly> {
        let Some(law) = self.growth_law() else { return Cow::Borrowed(self) };
        let factors: Vec<f64> = (0..self.growth.len()).map(|material| factor(&law, material)).collect();
        let mut resized = self.clone();
        for (growth, factor) in resized.growth.iter_mut().zip(&factors) {
            let end = growth.end.map(|end| end / factor);
            *growth = Growth { start: growth.start / factor, rate: growth.rate / factor, end };
        }
        resized.grains.iter_mut().for_each(|grain| grain.radius *= factors[grain.material as usize]);
        Cow::Owned(resized)
    }

    /// The fastest that a surface moves away from its centre, m/s.
    pub fn fastest_growth(&self) -> f64 {
        let speed =
            |grain: &Grain| self.growth.get(grain.material as usize).map_or(0.0, |of| of.rate.abs() * grain.radius);
        match self.grows() {
            true => self.grains.iter().map(speed).fold(0.0, f64::max),
            false => 0.0,
        }
    }

    /// When radii that change bring a cell that keeps its volume to a packing fraction, s.
    pub(super) fn time_of_growth(&self) -> Option<f64> {
        self.growth_law().map(|law| law.ends).filter(|ends| ends.is_finite())
    }

    /// Whether a packing fraction follows from growth and from how the cell deforms, both.
    pub(super) fn grows_in_changing_cell(&self) -> bool {
        self.grows() && !self.keeps_volume()
    }
}

/// What growth needs.
pub(super) fn check_growth(assembly: &Assembly, check: &Check) -> Result<()> {
    let Assembly { growth, domain, solver, stop, .. } = assembly;
    if growth.is_empty() {
        return Ok(());
    }
    if growth.len() != assembly.materials.len() {
        let message =
            format!("has {} entries, must have one for each of {} materials", growth.len(), assembly.materials.len());
        return Err(check.origin.wrong("growth", message));
    }
    for (k, of) in growth.iter().enumerate() {
        check.positive(&format!("growth.{k}.start"), of.start, "")?;
        check.finite(&format!("growth.{k}.rate"), glam::DVec3::X * of.rate)?;
        let ends = of.end.map_or(of.rate >= 0.0, |end| end > 0.0 && end.is_finite());
        if !ends {
            return Err(check
                .origin
                .wrong(&format!("growth.{k}.end"), "must be there where grains shrink, and be positive"));
        }
    }
    if !assembly.grows() {
        return Ok(());
    }
    let open = (0..check.dimension).find(|axis| !domain.periodic[*axis]);
    let unlimited = growth.iter().any(|of| of.changes() && of.end.is_none());
    let wrong = match () {
        () if solver.method != Method::DiscreteElements => "is for method = \"dem\" only",
        () if !assembly.clumps.is_empty() => "is for spheres and disks; clumps keep their sizes",
        () if assembly.changes() => "does not go with grains that come in (population.insertion) or leave (outlet)",
        () if stop.jamming.is_some() => "does not go with [jamming], which compresses the cell; leave one of them out",
        () if unlimited && open.is_some() => {
            let axis = AXES[open.unwrap_or_default()];
            let message = format!(
                "missing key `final`: without it grains grow until they fill the cell, but the axis {axis} is not periodic"
            );
            return Err(check.origin.wrong("growth", message));
        }
        () => return Ok(()),
    };
    Err(check.origin.wrong("growth", wrong))
}
