//! Checks that all parts of a scene share.

use glam::DVec3;

use super::origin::Origin;
use crate::{Error, Result};

/// What a check needs to know: where the scene came from, its dimension, its materials.
pub struct Check<'a> {
    pub origin: &'a Origin,
    pub dimension: usize,
    /// Whether grains are rigid, so that nobody asks for stiffness.
    pub rigid: bool,
    /// Names of the materials, sorted.
    pub materials: Vec<&'a str>,
    /// Their densities, kg/m³.
    pub densities: Vec<f64>,
    /// Radii that grains have at first, over those that the scene gives them.
    pub initial: Vec<f64>,
    /// Whether grains get their places, and these radii, from the scene.
    pub placed: bool,
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

    /// `low <= value <= high`.
    pub fn within(&self, key: &str, value: f64, low: f64, high: f64, unit: &str) -> Result<f64> {
        let rule = || format!("must be from {} to {}{unit}", show(low), show(high));
        self.holds((low..=high).contains(&value), key, value, rule)
    }

    /// A radius, m, that gives a grain of the material a mass to calculate with. `key` names the radius.
    pub fn body(&self, key: &str, radius: f64, material: u32) -> Result<()> {
        match self.fault_of_body(radius, material) {
            None => Ok(()),
            Some(rule) => Err(self.origin.bad(key, show(radius), rule)),
        }
    }

    /// What is wrong with a grain of this radius, m, and material.
    pub fn fault_of_body(&self, radius: f64, material: u32) -> Option<String> {
        let density = self.densities[material as usize];
        let disk = density * std::f64::consts::PI * radius * radius;
        let (mass, gyration) = if self.dimension == 2 { (disk, 0.5) } else { (disk * 4.0 / 3.0 * radius, 0.4) };
        let inverse_inertia = 1.0 / (gyration * mass * radius * radius);
        // The square leaves room for products of masses with each other, with accelerations and with squares of speeds.
        let usable = [mass, mass * mass, inverse_inertia].iter().all(|value| value.is_normal() && *value > 0.0);
        (!usable).then(|| {
            format!(
                "with the density {} kg/m³ of \"{}\" the mass of a grain is {} kg and its inverse inertia {} 1/(kg m²), beyond what double precision can calculate with; change the radius or the density",
                show(density),
                self.materials[material as usize],
                show(mass),
                show(inverse_inertia)
            )
        })
    }

    fn holds(&self, ok: bool, key: &str, value: f64, rule: impl Fn() -> String) -> Result<f64> {
        match ok {
            _ if !value.is_finite() => Err(self.origin.bad(key, value, FINITE)),
            true => Ok(value),
            false => Err(self.origin.bad(key, show(value), rule())),
        }
    }

    /// Components that are numbers; in two dimensions z = 0.
    pub fn finite(&self, key: &str, vector: DVec3) -> Result<()> {
        match (0..3).find(|axis| !vector[*axis].is_finite()) {
            Some(axis) => Err(self.origin.bad(&format!("{key}.{axis}"), vector[axis], FINITE)),
            None if self.dimension == 2 && vector.z != 0.0 => {
                Err(self.origin.bad(&format!("{key}.2"), show(vector.z), "must be 0 (dimension = 2)"))
            }
            None => Ok(()),
        }
    }

    /// An index into a list of so many.
    pub fn index(&self, key: &str, index: u32, count: usize, what: &str) -> Result<()> {
        match (index as usize) < count {
            true => Ok(()),
            false => Err(self.origin.bad(key, index, format!("is no {what}; there are {count}, counted from 0"))),
        }
    }

    /// An array with one number per axis; `z = 0` in two dimensions.
    pub fn vector(&self, key: &str, value: &[f64]) -> Result<DVec3> {
        match (self.dimension, value) {
            (2, &[x, y]) => Ok(DVec3::new(x, y, 0.0)),
            (3, &[x, y, z]) => Ok(DVec3::new(x, y, z)),
            (dimension, _) => {
                let rule = format!("must have {dimension} numbers (dimension = {dimension})");
                Err(self.origin.bad(key, show_list(value), rule))
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
                let rule = format!("must be above lower = {} on axis {}", show_list(lower), AXES[axis]);
                let value = show_list(upper);
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

/// What is said of numbers that TOML and Rust can write but no quantity can have.
pub const FINITE: &str = "must be a finite number";

/// What is said of radii whose powers double precision cannot hold.
pub const TOO_WIDE: &str = "must be a range of radii that double precision can hold; take sizes of real grains";

/// Disks or spheres.
pub fn dimension(dimension: usize, origin: &Origin) -> Result<()> {
    match dimension {
        2 | 3 => Ok(()),
        _ => Err(origin.bad("dimension", dimension, "must be 2 or 3")),
    }
}

/// Names of the axes.
pub const AXES: [char; 3] = ['x', 'y', 'z'];

/// A number as people write it, with at most seven digits.
pub fn show(value: f64) -> String {
    let value: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    let size = value.abs();
    if size == 0.0 || (1e-4..1e6).contains(&size) { format!("{value}") } else { format!("{value:e}") }
}

/// An array as the scene gives it.
pub fn show_list(values: &[f64]) -> String {
    let parts: Vec<String> = values.iter().map(|&v| show(v)).collect();
    format!("[{}]", parts.join(", "))
}

/// A point or vector with the components that the dimension has.
pub fn show_vector(value: DVec3, dimension: usize) -> String {
    show_list(&value.to_array()[..dimension])
}
