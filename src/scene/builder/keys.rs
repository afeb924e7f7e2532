//! Vectors as scenes hold them.

use glam::{DVec2, DVec3};

/// Numbers, one per axis of the scene: from `[x, y]`, `[x, y, z]`, [`DVec2`] or [`DVec3`].
#[derive(Clone, Debug)]
pub struct PerAxis(Vec<f64>);

impl<const N: usize> From<[f64; N]> for PerAxis {
    fn from(numbers: [f64; N]) -> PerAxis {
        PerAxis(numbers.to_vec())
    }
}

impl From<DVec2> for PerAxis {
    fn from(vector: DVec2) -> PerAxis {
        PerAxis(vector.to_array().to_vec())
    }
}

impl From<DVec3> for PerAxis {
    fn from(vector: DVec3) -> PerAxis {
        PerAxis(vector.to_array().to_vec())
    }
}

/// As the schema has them.
pub(super) fn per_axis(vector: impl Into<PerAxis>) -> Vec<f64> {
    vector.into().0
}
