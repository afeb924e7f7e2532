//! Materials and pairs of them.

use super::keys::setters;
use crate::scene::schema;

/// A material.
#[derive(Clone, Debug)]
pub struct MaterialBuilder(pub(super) schema::Material);

impl MaterialBuilder {
    /// Of this density, kg/m³; in two dimensions at unit thickness.
    pub fn new(density: f64) -> MaterialBuilder {
        MaterialBuilder(schema::Material {
            density,
            normal_stiffness: None,
            tangential_stiffness: None,
            friction: 0.0,
            restitution: None,
            normal_damping: None,
        })
    }

    setters! {
        /// k_N of a contact of the material with itself, N/m. The discrete element method needs it.
        normal_stiffness: f64;
        /// k_T, N/m. Default: 2/7 of the normal stiffness.
        tangential_stiffness: f64;
        /// μ = tan φ. Default: 0.
        friction: f64;
        /// Normal coefficient of restitution, in (0, 1]. Default: no dashpot.
        restitution: f64;
        /// Mass-scaled damping η of the normal motion, 1/s, in place of a restitution. Default: no dashpot.
        normal_damping: f64;
    }
}

/// What replaces single parameters of the mixing rule for a pair of materials.
#[derive(Clone, Debug)]
pub struct PairBuilder(pub(super) schema::Pair);

impl PairBuilder {
    /// For two materials, in any order, or for one against itself.
    pub fn new(a: &str, b: &str) -> PairBuilder {
        PairBuilder(schema::Pair {
            materials: vec![a.to_owned(), b.to_owned()],
            normal_stiffness: None,
            tangential_stiffness: None,
            friction: None,
            restitution: None,
            normal_damping: None,
        })
    }

    setters! {
        /// k_N, N/m.
        normal_stiffness: f64;
        /// k_T, N/m.
        tangential_stiffness: f64;
        /// μ = tan φ.
        friction: f64;
        /// Normal coefficient of restitution, in (0, 1].
        restitution: f64;
        /// Mass-scaled damping η, 1/s.
        normal_damping: f64;
    }
}
