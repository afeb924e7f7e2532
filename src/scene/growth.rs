//! Radii that grow or shrink over time.

use std::borrow::Cow;

use super::check::{AXES, Check, show};
use super::{Assembly, Grain, Method, schema};
use crate::Result;

/// How the radii of grains of a material change: R(t) = R f(t), where f goes from `start` at `rate` until it is `end`
/// (Lubachevsky & Stillinger 1990). Densities stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// The factor at time 0: 1 in a scene, and less in [`Assembly::whole`], whose radii are the largest ones.
    pub start: f64,
    /// 1/s; below 0 grains shrink.
    pub rate: f64,
    /// The factor at which that is over.
    pub end: Option<f64>,
}

impl Default for Growth {
    /// Radii that stay as they are.
    fn default() -> Growth {
        Growth { start: 1.0, rate: 0.0, end: None }
    }
}

impl Growth {
    /// The factor after so many seconds.
    pub fn factor(&self, time: f64) -> f64 {
        let factor = self.start + self.rate * time;
        match self.end {
            Some(end) if self.rate < 0.0 => factor.max(end),
            Some(end) => factor.min(end),
            None => factor,
        }
    }

    /// Whether radii change at all.
    fn changes(&self) -> bool {
        self.rate != 0.0 && self.end.is_none_or(|end| (end - self.start) * self.rate > 0.0)
    }

    /// When that is over, s.
    fn ends(&self) -> f64 {
        match self.end {
            _ if !self.changes() => 0.0,
            Some(end) => (end - self.start) / self.rate,
            None => f64::INFINITY,
        }
    }
}

/// The growth of a scene as a function of time.
#[derive(Clone, Debug, PartialEq)]
pub struct GrowthLaw {
    /// Material by material.
    growth: Vec<Growth>,
    /// Volumes of the grains where factors are 1, m³ (m²).
    volumes: Vec<f64>,
    dimension: i32,
    /// When radii cease to change, whatever the materials say, s: the target of the run is met.
    pub ends: f64,
    /// When they cannot grow any further, s: grains fill the cell, or would meet two images of a neighbour.
    pub full: f64,
}

impl GrowthLaw {
    /// Of radii where the factor is 1.
    pub fn factor(&self, material: u32, time: f64) -> f64 {
        self.growth[material as usize].factor(time.min(self.ends).min(self.full))
    }

    /// How fast radii have grown in the step of this length that ends at this time, over themselves, 1/s; before time 0 as
    /// after it.
    pub fn rate(&self, material: u32, time: f64, dt: f64) -> f64 {
        let (before, now) = if time > 0.0 { (time - dt, time) } else { (0.0, dt) };
        let [before, now] = [before, now].map(|time| self.factor(material, time));
        (now - before) / (dt * if time > 0.0 { now } else { before })
    }

    /// Volumes of all grains, m³ (m²).
    pub fn volume(&self, time: f64) -> f64 {
        (0..)
            .zip(&self.volumes)
            .map(|(material, volume)| volume * self.factor(material, time).powi(self.dimension))
            .sum()
    }

    /// Whether a radius changes after this time, s.
    pub fn goes_on(&self, time: f64) -> bool {
        self.growth.iter().any(|growth| time < growth.ends().min(self.ends))
    }

    /// The smallest and the largest factor of a material.
    fn range(&self, material: usize) -> [f64; 2] {
        let factors = [0.0, f64::MAX].map(|time| self.factor(material as u32, time));
        [factors[0].min(factors[1]), factors[0].max(factors[1])]
    }

    /// The first time at which the volume is this one, s.
    fn time_of_volume(&self, volume: f64) -> Option<f64> {
        let (mut before, begun) = (0.0, self.volume(0.0));
        let met = |time: f64| if begun < volume { self.volume(time) >= volume } else { self.volume(time) <= volume };
        let fastest = self.growth.iter().map(|growth| (growth.rate / growth.start).abs()).fold(0.0, f64::max);
        let over = self.growth.iter().map(Growth::ends).fold(0.0, f64::max).min(LONGEST / fastest);
        while before < over {
            let mut after = (before + 1e-3 * (before + 1.0 / fastest)).min(over);
            if met(after) {
                // To the last bit.
                loop {
                    let middle = 0.5 * (before + after);
                    match middle {
                        _ if middle <= before || middle >= after => return Some(after),
                        _ if met(middle) => after = middle,
                        _ => before = middle,
                    }
                }
            }
            before = after;
        }
        None
    }
}

/// Of the shortest period: a little less than what it must be four times as long as.
const LARGEST: f64 = 0.2499;

/// Radii may change by this factor.
const LONGEST: f64 = 1e3;

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

/// What a scene file says of growth, material by material; `placed` if its grains have their first radii from it.
pub(super) fn growth(given: &[schema::Growth], placed: bool, check: &Check) -> Result<Vec<Growth>> {
    let mut all: Vec<Option<Growth>> = vec![None; check.materials.len()];
    for (number, of) in given.iter().enumerate() {
        let at = |field: &str| format!("growth.{number}.{field}");
        let materials = match &of.material {
            Some(name) => {
                let material = check.material(&at("material"), name)? as usize;
                material..material + 1
            }
            None => 0..all.len(),
        };
        let initial = of.initial.unwrap_or(1.0);
        check.within(&at("initial"), initial, 1.0 / LONGEST, LONGEST, " of the radii that the scene gives")?;
        let start = if placed { initial } else { 1.0 };
        let end = of.last.map(|last| check.within(&at("final"), last, 1.0 / LONGEST, LONGEST, "")).transpose()?;
        if let Some(last) = of.last
            && placed
            && (last - start) * of.rate < 0.0
        {
            let rule =
                format!("is never reached: radii begin with {} and change at rate = {}", show(start), show(of.rate));
            return Err(check.origin.bad(&at("final"), show(last), rule));
        }
        if of.rate < 0.0 && end.is_none() {
            return Err(check
                .origin
                .wrong(&format!("growth.{number}"), "missing key `final`, at which grains cease to shrink"));
        }
        for material in materials {
            if all[material].is_some() {
                let message = format!("another entry has the growth of \"{}\" already", check.materials[material]);
                return Err(check.origin.wrong(&format!("growth.{number}"), message));
            }
            all[material] = Some(Growth { start: 1.0, rate: of.rate, end: end.map(|end| end / start) });
        }
    }
    let all: Vec<Growth> = all.into_iter().map(Option::unwrap_or_default).collect();
    Ok(if all.iter().any(Growth::changes) { all } else { Vec::new() })
}

/// Radii at time 0 over those that a scene file gives, material by material.
pub(super) fn initial_factors(given: &[schema::Growth], materials: &[&str]) -> Vec<f64> {
    let of = |name: &&str| {
        let own = given.iter().find(|of| of.material.as_deref().is_none_or(|material| material == *name));
        own.and_then(|of| of.initial).unwrap_or(1.0)
    };
    materials.iter().map(of).collect()
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
