//! All measures of a packing together.

use super::{
    cell::Cell,
    coordination::{Coordination, carrying, fabric},
    correlation::{Shell, radial_distribution},
    distribution::OfContacts,
    equilibrium::{Energies, Equilibrium},
    packing::Packing,
    profile::{self, Part},
    stress::{Stress, stress},
};
use crate::measure::{
    Sizes, Slope,
    packing::{PackingFraction, overall_packing_fraction, packing_fraction},
    slope,
};
use glam::DVec3;
use serde::Serialize;

/// What is asked for beyond what every packing has.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// Corners of a box, m.
    pub bounds: Option<[DVec3; 2]>,
    /// Axis of the profile.
    pub axis: usize,
    /// Width of its slabs, m; None: two mean diameters.
    pub width: Option<f64>,
    /// Of static equilibrium.
    pub tolerance: f64,
}

/// Solid fractions, by the space that they are of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SolidFractions {
    /// Of the cell.
    pub cell: Option<f64>,
    /// Of the whole vessel, next to walls too, up to the highest centre.
    pub overall: Option<PackingFraction>,
    /// Away from walls and surfaces.
    pub inside: Option<PackingFraction>,
}

/// The space over which the stress of the packing is averaged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CellSize {
    /// m
    pub lower: DVec3,
    pub upper: DVec3,
    /// m³ (m² in two dimensions)
    pub volume: f64,
}

/// Force, N, and moment, N m, on a wall.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OnWall {
    pub name: String,
    pub force: DVec3,
    pub moment: DVec3,
    /// N, along the normals of the contacts.
    pub normal_force: f64,
    pub contacts: usize,
}

/// All measures of a packing. Keys and units: `docs/output.md`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measures {
    pub particles: usize,
    pub free: usize,
    pub solid_fraction: SolidFractions,
    #[serde(flatten)]
    pub coordination: Coordination,
    pub cell: Option<CellSize>,
    pub stress: Option<Stress>,
    pub walls: Vec<OnWall>,
    pub fabric: Option<[[f64; 3]; 3]>,
    #[serde(rename = "box")]
    pub part: Option<Part>,
    pub equilibrium: Equilibrium,
    pub diameters: Option<Sizes>,
    pub slope: Option<Slope>,
    pub distributions: OfContacts,
    pub profile_axis: &'static str,
    pub profile: Vec<Part>,
    pub radial_distribution: Vec<Shell>,
}

impl Measures {
    pub fn of(packing: &Packing, energies: Energies, asked: &Asked) -> Measures {
        let cell = Cell::of(packing);
        let dims = packing.dims();
        let volume = cell.as_ref().map(Cell::volume);
        let free = packing.free().count();
        let mean = 2.0 * packing.free().map(|k| packing.radius(k)).sum::<f64>() / free.max(1) as f64;
        let width = asked.width.unwrap_or(2.0 * mean);
        let profile = cell.as_ref().map(|cell| profile::profile(packing, cell, asked.axis, width)).unwrap_or_default();
        let solid: f64 = profile.iter().map(|part| part.solid_fraction * part.volume).sum();
        let Packing { assembly, grains, walls, .. } = *packing;
        let of_walls = packing.totals.walls.iter().zip(walls);
        Measures {
            particles: packing.particles(),
            free,
            solid_fraction: SolidFractions {
                cell: volume.map(|volume| solid / volume),
                overall: overall_packing_fraction(assembly, grains, walls),
                inside: packing_fraction(assembly, grains, walls),
            },
            coordination: Coordination::of(packing, &carrying(packing)),
            cell: cell.as_ref().zip(volume).map(|(cell, volume)| CellSize {
                lower: cell.lower,
                upper: if dims == 2 { cell.upper.with_z(0.0) } else { cell.upper },
                volume,
            }),
            stress: volume.map(|volume| stress(packing, volume)),
            walls: of_walls
                .map(|(on_wall, wall)| OnWall {
                    name: wall.name.clone(),
                    force: on_wall.force.total(),
                    moment: on_wall.moment.total(),
                    normal_force: on_wall.normal_force.total().x,
                    contacts: on_wall.contacts,
                })
                .collect(),
            fabric: fabric(packing),
            part: asked.bounds.map(|[lower, upper]| profile::of_box(packing, lower, upper)),
            equilibrium: Equilibrium::of(packing, energies, asked.tolerance),
            diameters: Sizes::of(assembly),
            slope: slope(assembly, grains),
            distributions: OfContacts::of(packing),
            profile_axis: ["x", "y", "z"][asked.axis],
            profile,
            radial_distribution: cell.map(|cell| radial_distribution(packing, &cell)).unwrap_or_default(),
        }
    }
}
