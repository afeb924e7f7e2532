//! Radii that grow or shrink over time.

use super::check::{Check, show};
use super::schema;
use crate::Result;

/// How the radii of grains of a material change: R(t) = R f(t), where f goes from `start` at `rate` until it is `end`
/// (Lubachevsky & Stillinger 1990). Densities stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// The factor at time 0: 1 in a scene, and less in [`Assembly::whole`](super::Assembly::whole), whose radii are the largest ones.
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
    pub(super) fn changes(&self) -> bool {
        self.rate != 0.0 && self.end.is_none_or(|end| (end - self.start) * self.rate > 0.0)
    }

    /// When that is over, s.
    pub(super) fn ends(&self) -> f64 {
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
    pub(super) growth: Vec<Growth>,
    /// Volumes of the grains where factors are 1, m³ (m²).
    pub(super) volumes: Vec<f64>,
    pub(super) dimension: i32,
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
    pub(super) fn range(&self, material: usize) -> [f64; 2] {
        let factors = [0.0, f64::MAX].map(|time| self.factor(material as u32, time));
        [factors[0].min(factors[1]), factors[0].max(factors[1])]
    }

    /// The first time at which the volume is this one, s.
    pub(super) fn time_of_volume(&self, volume: f64) -> Option<f64> {
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

/// Radii may change by this factor.
const LONGEST: f64 = 1e3;

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
