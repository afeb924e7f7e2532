//! Quantities of the field from samples and states.

use crate::{
    model::Dimension,
    scene::{Assembly, Clump, Grain},
    state::PartialSums,
    time_step::mass,
};
use glam::DVec3;

/// A row of the history: sums over all grains at one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Sample {
    pub step: u64,
    /// s
    pub time: f64,
    /// Translation and spin, J.
    pub kinetic_energy: f64,
    /// In gravity, J, zero at the origin.
    pub potential_energy: f64,
    /// Normal and tangential springs, J.
    pub elastic_energy: f64,
    /// Power of dashpots, sliding, contacts that open and global damping, W.
    pub dissipation: f64,
    /// Lost so since step 0, and work of walls and of fixed grains on free grains, J. None unless they are added up in
    /// every step.
    pub dissipated: Option<f64>,
    pub work_walls: Option<f64>,
    pub work_fixed: Option<f64>,
    /// Mean |total force| on free grains over mean |contact force|; infinite without contacts.
    pub unbalanced_force_ratio: f64,
    pub max_overlap_over_radius: f64,
    /// Contacts of free grains: with each other, with fixed grains and with walls.
    pub contacts: u64,
    /// Mean number of contacts of a free grain.
    pub coordination_number: f64,
    /// Contact dynamics, of the last step: passes, relative residual of the natural map, and largest friction beyond
    /// the Coulomb limit over the largest normal impulse.
    pub iterations: Option<u32>,
    pub residual: Option<f64>,
    pub coulomb_excess: Option<f64>,
    /// What of the dissipation is of the step before: sliding, plastic rolling and contacts that open, W.
    #[serde(skip)]
    pub sliding: f64,
    /// Work of walls and of fixed grains on free grains per time, W.
    #[serde(skip)]
    pub wall_power: f64,
    #[serde(skip)]
    pub fixed_power: f64,
    /// Work of the flow of the cell on free grains per time, W.
    #[serde(skip)]
    pub cell_power: f64,
    /// Work of radii that change per time, W.
    #[serde(skip)]
    pub growth_power: f64,
    /// Force times branch vector of all contacts, and mass times velocity times velocity of all free grains, J: component by
    /// component as [`COMPONENTS`](crate::scene::COMPONENTS).
    #[serde(skip)]
    pub virial: [f64; 6],
    #[serde(skip)]
    pub flux: [f64; 6],
    /// Of a cell that may deform: further columns.
    #[serde(skip)]
    pub cell: Option<CellSample>,
    /// Of a scene in which radii change: further columns.
    #[serde(skip)]
    pub growth: Option<GrowthSample>,
    /// Of a scene in which grains come in or leave: further columns.
    #[serde(skip)]
    pub openings: Option<OpeningsSample>,
    /// Mean |contact force|, N; 0 without contacts.
    #[serde(skip)]
    pub contact_force: f64,
    /// Contact dynamics: kinetic energy of all grains that gravity, or the mean contact force if that is more, has
    /// pulled for one step, J.
    #[serde(skip)]
    pub step_energy: f64,
    /// Contact dynamics: the last step was not solved, so that its forces are none.
    #[serde(skip)]
    pub unsolved: bool,
}

/// What a row of the history has of grains that have come in and left since step 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct OpeningsSample {
    /// Grains (clumps) that are there now.
    pub particles: u64,
    pub inserted: u64,
    /// kg
    pub inserted_mass: f64,
    pub removed: u64,
    pub removed_mass: f64,
    /// Kinetic and potential energy of those that have come in, and all that has gone with those that have left, J.
    pub inserted_energy: f64,
    pub removed_energy: f64,
}

/// What a row of the history has of radii that change.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct GrowthSample {
    /// m
    pub mean_radius: f64,
    /// Work of growth since step 0, J. None unless works are added up in every step.
    pub work_growth: Option<f64>,
}

/// What a row of the history has of a cell that may deform.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct CellSample {
    /// True strains since the start, and shears.
    pub strain_xx: f64,
    pub strain_yy: f64,
    pub strain_zz: f64,
    pub strain_yz: f64,
    pub strain_xz: f64,
    pub strain_xy: f64,
    /// Sum of the strains along axes; compression is negative.
    pub volumetric_strain: f64,
    /// Of contacts and motion, Pa (N/m); compression is positive. None unless all axes are periodic.
    pub stress_xx: Option<f64>,
    pub stress_yy: Option<f64>,
    pub stress_zz: Option<f64>,
    pub stress_yz: Option<f64>,
    pub stress_xz: Option<f64>,
    pub stress_xy: Option<f64>,
    /// Mean of the stresses along axes, Pa (N/m).
    pub pressure: Option<f64>,
    /// √(D/(D − 1) s : s) of the deviator s in D dimensions, Pa (N/m): σ₁ − σ₃ in a triaxial state, σ₁ − σ₂ of disks.
    pub deviatoric_stress: Option<f64>,
    /// Volumes of grains over that of the cell, overlaps counted twice.
    pub solid_fraction: Option<f64>,
    /// Work of the cell on free grains since step 0, J. None unless works are added up in every step.
    pub work_cell: Option<f64>,
}

impl CellSample {
    /// Of a cell of this volume, m³ (m²), if it has one, around grains of this volume.
    pub fn new(
        sample: &Sample,
        strain: [f64; 6],
        volume: Option<f64>,
        grain_volume: f64,
        dimension: usize,
    ) -> CellSample {
        let [strain_xx, strain_yy, strain_zz, strain_yz, strain_xz, strain_xy] = strain;
        let stress = |k: usize| volume.map(|volume| (sample.flux[k] - sample.virial[k]) / volume);
        let tensor = volume.map(|_| std::array::from_fn(|k| stress(k).unwrap_or_default()));
        let (pressure, deviatoric_stress) = tensor.map(|stress| invariants(stress, dimension)).unzip();
        CellSample {
            strain_xx,
            strain_yy,
            strain_zz,
            strain_yz,
            strain_xz,
            strain_xy,
            volumetric_strain: strain_xx + strain_yy + strain_zz,
            stress_xx: stress(0),
            stress_yy: stress(1),
            stress_zz: stress(2),
            stress_yz: stress(3),
            stress_xz: stress(4),
            stress_xy: stress(5),
            pressure,
            deviatoric_stress,
            solid_fraction: volume.map(|volume| grain_volume / volume),
            work_cell: None,
        }
    }

    /// Component by component as [`COMPONENTS`](crate::scene::COMPONENTS).
    pub fn strain(&self) -> [f64; 6] {
        [self.strain_xx, self.strain_yy, self.strain_zz, self.strain_yz, self.strain_xz, self.strain_xy]
    }

    /// Component by component as [`COMPONENTS`](crate::scene::COMPONENTS), Pa (N/m).
    pub fn stress(&self) -> [Option<f64>; 6] {
        [self.stress_xx, self.stress_yy, self.stress_zz, self.stress_yz, self.stress_xz, self.stress_xy]
    }
}

/// Mean and deviatoric stress of a symmetric tensor, component by component as in Voigt's order.
fn invariants(stress: [f64; 6], dimension: usize) -> (f64, f64) {
    let (dims, normal) = (dimension as f64, &stress[..dimension]);
    let mean = normal.iter().sum::<f64>() / dims;
    let along: f64 = normal.iter().map(|stress| (stress - mean).powi(2)).sum();
    let shear: f64 = stress[3..].iter().map(|stress| 2.0 * stress * stress).sum();
    (mean, (dims / (dims - 1.0) * (along + shear)).sqrt())
}

impl Sample {
    /// From the rows that the stage `measure` writes.
    pub fn new(step: u64, time: f64, free: usize, parts: &[PartialSums]) -> Sample {
        let sum = |of: fn(&PartialSums) -> f64| parts.iter().map(of).sum::<f64>();
        let count = |of: fn(&PartialSums) -> u32| parts.iter().map(|p| u64::from(of(p))).sum::<u64>();
        let (sides, single) = (count(|p| p.sides), count(|p| p.single_sides));
        let contacts = (sides - single) / 2 + single;
        let mean_net = sum(|p| p.net_force) / free.max(1) as f64;
        let mean_contact = sum(|p| p.contact_force) / contacts as f64;
        let tensor = |of: fn(&PartialSums) -> [DVec3; 2]| {
            let [diagonal, above] = parts.iter().map(of).fold([DVec3::ZERO; 2], |[a, b], [c, d]| [a + c, b + d]);
            [diagonal.x, diagonal.y, diagonal.z, above.x, above.y, above.z]
        };
        Sample {
            virial: tensor(|p| [p.virial, p.virial_above.0]),
            flux: tensor(|p| [p.flux, p.flux_above.0]),
            step,
            time,
            kinetic_energy: sum(|p| p.kinetic),
            potential_energy: sum(|p| p.potential),
            elastic_energy: sum(|p| p.elastic),
            dissipation: sum(|p| p.dissipation),
            sliding: sum(|p| p.sliding),
            wall_power: sum(|p| p.wall_power),
            fixed_power: sum(|p| p.fixed_power),
            growth_power: sum(|p| p.growth_power),
            unbalanced_force_ratio: if contacts == 0 { f64::INFINITY } else { mean_net / mean_contact },
            max_overlap_over_radius: parts.iter().map(|p| p.overlap).fold(0.0, f64::max),
            contacts,
            coordination_number: sides as f64 / free.max(1) as f64,
            contact_force: if contacts == 0 { 0.0 } else { mean_contact },
            ..Sample::default()
        }
    }

    /// Whether the grains are at rest: forces are there, balanced to this ratio, and the grains do not merely pass through
    /// balance, because their kinetic energy is as small a part of the energy in the contacts.
    pub fn at_rest(&self, tolerance: f64) -> bool {
        !self.unsolved
            && self.contacts > 0
            && self.unbalanced_force_ratio < tolerance
            && self.kinetic_energy <= tolerance * self.elastic_energy.max(self.step_energy)
    }
}

/// Mass of each grain, kg; fixed grains too. Of a member, its part by size of the clump's.
pub fn masses(assembly: &Assembly) -> Vec<f64> {
    let dimension = if assembly.dimension == 2 { Dimension::Plane } else { Dimension::Space };
    let of = |g: &Grain| mass(dimension, assembly.materials[g.material as usize].density, g.radius);
    let mut masses: Vec<f64> = assembly.grains.iter().map(of).collect();
    for (k, clump) in assembly.clumps.iter().enumerate() {
        let members = &mut masses[assembly.members(k)];
        let part = mass_of_clump(assembly, clump) / members.iter().sum::<f64>();
        members.iter_mut().for_each(|m| *m *= part);
    }
    masses
}

/// Mass of a clump, kg.
pub fn mass_of_clump(assembly: &Assembly, clump: &Clump) -> f64 {
    let dimension = if assembly.dimension == 2 { Dimension::Plane } else { Dimension::Space };
    mass(dimension, assembly.materials[clump.material as usize].density, clump.radius)
}

/// Linear momentum of the free clumps, kg m/s.
pub fn momentum_of_clumps(assembly: &Assembly, clumps: &[Clump]) -> DVec3 {
    clumps.iter().filter(|c| !c.fixed).map(|c| mass_of_clump(assembly, c) * c.velocity).sum()
}

/// Angular momentum of the free clumps about the origin, kg m²/s; None in a periodic domain.
pub fn angular_momentum_of_clumps(assembly: &Assembly, clumps: &[Clump]) -> Option<DVec3> {
    if assembly.domain.periodic.contains(&true) {
        return None;
    }
    let of = |c: &Clump| {
        let (m, shape) = (mass_of_clump(assembly, c), &assembly.shapes[c.shape as usize]);
        let principal = c.orientation * shape.frame;
        let own = m * c.radius * c.radius * (shape.gyration * (principal.inverse() * c.spin));
        m * c.position.cross(c.velocity) + principal * own
    };
    Some(clumps.iter().filter(|c| !c.fixed).map(of).sum())
}

/// Linear momentum of the free grains, kg m/s.
pub fn momentum(grains: &[Grain], masses: &[f64]) -> DVec3 {
    let free = grains.iter().zip(masses).filter(|(g, _)| !g.fixed);
    free.map(|(g, m)| *m * g.velocity).sum()
}

/// Angular momentum of the free grains about the origin, spin included, kg m²/s; None in a periodic domain, where a
/// grain that crosses the edge changes its arm.
pub fn angular_momentum(assembly: &Assembly, grains: &[Grain], masses: &[f64]) -> Option<DVec3> {
    if assembly.domain.periodic.contains(&true) {
        return None;
    }
    let beta = if assembly.dimension == 2 { 0.5 } else { 0.4 };
    let free = grains.iter().zip(masses).filter(|(g, _)| !g.fixed);
    Some(free.map(|(g, m)| *m * g.position.cross(g.velocity) + beta * m * g.radius * g.radius * g.spin).sum())
}

/// Which grains are no rattlers: those inside with fewer than `least` contacts are taken away, with their contacts,
/// until there are none. Grains outside stay, and so do indices without a grain, walls: a free surface, where weight
/// holds grains on fewer contacts, would otherwise take the bed along with it.
pub fn backbone(inside: &[bool], contacts: &[(u32, u32)], least: usize) -> Vec<bool> {
    let mut left = vec![true; inside.len()];
    loop {
        let mut count = vec![0; inside.len()];
        let stays = |i: u32| left.get(i as usize).is_none_or(|left| *left);
        for (i, j) in contacts.iter().filter(|(i, j)| stays(*i) && stays(*j)) {
            [i, j].into_iter().filter_map(|i| inside.get(*i as usize).map(|_| *i as usize)).for_each(|i| count[i] += 1);
        }
        let next: Vec<bool> = (0..left.len()).map(|i| left[i] && (!inside[i] || count[i] >= least)).collect();
        if next == left {
            return left;
        }
        left = next;
    }
}
