//! A packing at a time, and its cell as other programs have it.

use crate::measure::{Packing, micromechanics::Cell};
use glam::{DMat3, DVec3};

/// A packing at a time.
#[derive(Clone, Copy)]
pub struct Instant<'a> {
    pub packing: &'a Packing<'a>,
    pub step: u64,
    /// s
    pub time: f64,
}

/// The cell as a parallelepiped: edges along x, in the plane x-y, and beyond, as LAMMPS has them.
pub struct Lattice {
    /// m
    pub origin: DVec3,
    /// One edge per column, m.
    pub edges: DMat3,
    pub periodic: [bool; 3],
}

impl Lattice {
    /// In two dimensions it is as thick as the mean grain, and repeats along z as LAMMPS wants it.
    pub fn of(packing: &Packing) -> Lattice {
        let cell = Cell::of(packing);
        let (mut lower, mut upper) = cell.map_or((DVec3::ZERO, DVec3::ZERO), |cell| (cell.lower, cell.upper));
        let mut periodic = packing.assembly.domain.periodic;
        if packing.dims() == 2 {
            let mean = packing.assembly.mean_radius();
            (lower.z, upper.z, periodic[2]) = (-mean, mean, true);
        }
        // Grains beyond a wall, or fixed ones outside, belong to it as well.
        for grain in packing.grains {
            for axis in (0..packing.dims()).filter(|axis| !periodic[*axis]) {
                lower[axis] = lower[axis].min(grain.position[axis] - grain.radius);
                upper[axis] = upper[axis].max(grain.position[axis] + grain.radius);
            }
        }
        let mut edges = DMat3::from_diagonal(upper - lower);
        let DVec3 { x: yz, y: xz, z: xy } = packing.assembly.domain.tilt;
        (edges.y_axis.x, edges.z_axis.x, edges.z_axis.y) = (xy, xz, yz);
        Lattice { origin: lower, edges, periodic }
    }
}
