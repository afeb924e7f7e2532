//! The periodic cell as it deforms.

use glam::{DMat3, DVec3};

/// Components of a strain of the cell, in Voigt's order. The gradient of the flow in it is upper triangular: `xy` is what
/// moves along x with the distance along y.
pub const COMPONENTS: [&str; 6] = ["xx", "yy", "zz", "yz", "xz", "xy"];

/// How a cell deforms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// 1/s, component by component, see [`COMPONENTS`]: true (logarithmic) strains, and shears, per time.
    pub strain_rate: [f64; 6],
    /// Pa (in two dimensions N/m), targets of a servo, which then sets the rate; compression is positive.
    pub stress: [Option<f64>; 6],
    /// Most of the rates that the servo sets, over d √(ρ/p) with the mean diameter and density, and the largest target.
    pub inertial_number: f64,
    /// Part of a missing stress that the servo adds in a step.
    pub gain: f64,
}

impl Default for Cell {
    /// A cell that keeps its form.
    fn default() -> Cell {
        Cell { strain_rate: [0.0; 6], stress: [None; 6], inertial_number: 1e-3, gain: 3e-3 }
    }
}

impl Cell {
    /// The gradient of the flow with which it becomes, in a step of this length, s, what it would become if it deformed all
    /// the time: on the diagonal, and above it.
    pub fn gradient(&self, dt: f64) -> (DVec3, DVec3) {
        let [xx, yy, zz, yz, xz, xy] = self.strain_rate.map(|rate| dt * rate);
        let m = DMat3::from_cols_array_2d(&[[xx, 0.0, 0.0], [xy, yy, 0.0], [xz, yz, zz]]);
        // exp(m) - 1, by its series, whose last term is below rounding while a step is short.
        let series = |sum: DMat3, k: u32| m * (DMat3::IDENTITY + sum * (1.0 / f64::from(k)));
        let grown = (2..=12).rev().fold(m, series) * (1.0 / dt);
        let at = |row: usize, column: usize| grown.col(column)[row];
        (DVec3::new(at(0, 0), at(1, 1), at(2, 2)), DVec3::new(at(1, 2), at(0, 2), at(0, 1)))
    }

    /// Whether the servo has a target for a component.
    pub fn is_controlled(&self) -> bool {
        self.stress != [None; 6]
    }

    /// Whether the volume is what the servo makes of it.
    pub fn has_volume_of_servo(&self) -> bool {
        self.stress[..3] != [None; 3]
    }

    /// The largest target, Pa (N/m).
    pub fn largest_stress(&self) -> f64 {
        self.stress.iter().flatten().map(|stress| stress.abs()).fold(0.0, f64::max)
    }
}
