//! Checks that all parts of a scene share.

use glam::DVec3;

use super::Origin;
use crate::{Error, Result};

/// What a check needs to know: where the scene came from, its dimension, its materials.
pub struct Check<'a> {
    pub origin: &'a Origin,
    pub dimension: usize,
    /// Names of the materials, sorted.
    pub materials: Vec<&'a str>,
}

impl Check<'_> {
    /// `value > 0`.
    pub fn positive(&self, key: &str, value: f64, unit: &str) -> Result<f64> {
        let rule = || format!("must be a positive number{unit}");
        self.holds(value > 0.0, key, value, rule)
    }

    /// `value >= 0`.
    pub fn not_negative(&self, key: &str, value: f64, unit: &str) -> Result<f64> {
        let rule = || format!("must be 0 or a positive number{unit}");
        self.holds(value >= 0.0, key, value, rule)
    }

    /// `0 < value <= 1`.
    pub fn fraction(&self, key: &str, value: f64) -> Result<f64> {
        let rule = || "must be above 0 and at most 1".to_owned();
        self.holds(value > 0.0 && value <= 1.0, key, value, rule)
    }

    fn holds(&self, ok: bool, key: &str, value: f64, rule: impl Fn() -> String) -> Result<f64> {
        if ok { Ok(value) } else { Err(self.origin.bad(key, show(value), rule())) }
    }

    /// An array with one number per axis; `z = 0` in two dimensions.
    pub fn vector(&self, key: &str, value: &[f64]) -> Result<DVec3> {
        match (self.dimension, value) {
            (2, &[x, y]) => Ok(DVec3::new(x, y, 0.0)),
            (3, &[x, y, z]) => Ok(DVec3::new(x, y, z)),
            (dimension, _) => {
                let rule = format!("must have {dimension} numbers (dimension = {dimension})");
                Err(self.origin.bad(key, format!("{value:?}"), rule))
            }
        }
    }

    /// Like [`Check::vector`] for an optional key that defaults to 0.
    pub fn vector_or_zero(&self, key: &str, value: Option<&[f64]>) -> Result<DVec3> {
        value.map_or(Ok(DVec3::ZERO), |value| self.vector(key, value))
    }

    /// Two corners with `lower < upper` on every axis.
    pub fn corners(&self, key: &str, lower: &[f64], upper: &[f64]) -> Result<(DVec3, DVec3)> {
        let low = self.vector(&format!("{key}.lower"), lower)?;
        let high = self.vector(&format!("{key}.upper"), upper)?;
        match (0..self.dimension).find(|&axis| low[axis] >= high[axis]) {
            None => Ok((low, high)),
            Some(axis) => {
                let rule = format!("must be above lower = {lower:?} on axis {}", AXES[axis]);
                let value = format!("{upper:?}");
                Err(self.origin.bad(&format!("{key}.upper"), value, rule))
            }
        }
    }

    /// Index of a material.
    pub fn material(&self, key: &str, name: &str) -> Result<u32> {
        match self.material_index(name) {
            Some(index) => Ok(index),
            None => Err(self.unknown_material(key, name)),
        }
    }

    pub fn material_index(&self, name: &str) -> Option<u32> {
        let index = self.materials.binary_search(&name).ok()?;
        Some(index as u32)
    }

    fn unknown_material(&self, key: &str, name: &str) -> Error {
        let rule = format!("is no material; {}", self.known_materials());
        self.origin.bad(key, format!("\"{name}\""), rule)
    }

    pub fn known_materials(&self) -> String {
        match self.materials.is_empty() {
            true => "the scene has no [material.NAME]".to_owned(),
            false => format!("the scene has {}", self.materials.join(", ")),
        }
    }
}

/// Names of the axes.
pub const AXES: [char; 3] = ['x', 'y', 'z'];

/// A number as people write it, with at most seven digits.
pub fn show(value: f64) -> String {
    let value: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    let size = value.abs();
    if size == 0.0 || (1e-3..1e6).contains(&size) { format!("{value}") } else { format!("{value:e}") }
}

/// A point or vector with the components that the dimension has.
pub fn show_vector(value: DVec3, dimension: usize) -> String {
    let parts: Vec<String> = value.to_array()[..dimension].iter().map(|&v| show(v)).collect();
    format!("[{}]", parts.join(", "))
}
