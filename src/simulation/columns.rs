//! Grains as columns, for analysis.

use crate::scene::Grain;
use glam::DVec3;

/// All grains of one moment: entry k of every column is grain k. The order is that of the scene, as in
/// [`Assembly::grains`](crate::scene::Assembly::grains), and never changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// Centres, m; in two dimensions z = 0.
    pub position: Vec<DVec3>,
    /// m/s, at the time of the positions.
    pub velocity: Vec<DVec3>,
    /// rad/s, at the time of the positions; in two dimensions about z.
    pub spin: Vec<DVec3>,
    /// m
    pub radius: Vec<f64>,
    /// Indices into [`Assembly::materials`](crate::scene::Assembly::materials).
    pub material: Vec<u32>,
    /// Whether a grain keeps its velocity and spin, whatever pushes it.
    pub fixed: Vec<bool>,
}

impl Columns {
    /// How many grains there are.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }
}

impl From<&[Grain]> for Columns {
    fn from(grains: &[Grain]) -> Columns {
        Columns {
            position: grains.iter().map(|grain| grain.position).collect(),
            velocity: grains.iter().map(|grain| grain.velocity).collect(),
            spin: grains.iter().map(|grain| grain.spin).collect(),
            radius: grains.iter().map(|grain| grain.radius).collect(),
            material: grains.iter().map(|grain| grain.material).collect(),
            fixed: grains.iter().map(|grain| grain.fixed).collect(),
        }
    }
}
