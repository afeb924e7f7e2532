//! Quantities of the field from samples and states.

use crate::{
    model::Dimension,
    scene::{Assembly, Domain, Grain},
    state::Part,
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
    /// Mean |total force| on free grains over mean |contact force|; infinite without contacts.
    pub unbalanced_force_ratio: f64,
    pub max_overlap_over_radius: f64,
    /// Touching pairs of grains, and of grain and wall.
    pub contacts: u64,
    /// Mean number of contacts of a grain, walls included.
    pub coordination_number: f64,
}

impl Sample {
    /// From the rows that the stage `measure` writes.
    pub fn new(step: u64, time: f64, free: usize, grains: usize, parts: &[Part]) -> Sample {
        let sum = |of: fn(&Part) -> f64| parts.iter().map(of).sum::<f64>();
        let sides: u64 = parts.iter().map(|p| u64::from(p.grain_sides)).sum();
        let wall_contacts: u64 = parts.iter().map(|p| u64::from(p.wall_contacts)).sum();
        let contacts = sides / 2 + wall_contacts;
        let mean_net = sum(|p| p.net_force) / free.max(1) as f64;
        let mean_contact = sum(|p| p.contact_force) / contacts as f64;
        Sample {
            step,
            time,
            kinetic_energy: sum(|p| p.kinetic),
            potential_energy: sum(|p| p.potential),
            elastic_energy: sum(|p| p.elastic),
            unbalanced_force_ratio: if contacts == 0 { f64::INFINITY } else { mean_net / mean_contact },
            max_overlap_over_radius: parts.iter().map(|p| p.overlap).fold(0.0, f64::max),
            contacts,
            coordination_number: (sides + wall_contacts) as f64 / grains as f64,
        }
    }
}

/// Mass of each grain, kg; fixed grains too.
pub fn masses(assembly: &Assembly) -> Vec<f64> {
    let dimension = if assembly.dimension == 2 { Dimension::Plane } else { Dimension::Space };
    let of = |g: &Grain| mass(dimension, assembly.materials[g.material as usize].density, g.radius);
    assembly.grains.iter().map(of).collect()
}

/// Linear momentum of the free grains, kg m/s.
pub fn momentum(grains: &[Grain], masses: &[f64]) -> DVec3 {
    let free = grains.iter().zip(masses).filter(|(g, _)| !g.fixed);
    free.map(|(g, m)| *m * g.velocity).sum()
}

/// Angular momentum of the free grains about the origin, spin included, kg m²/s.
pub fn angular_momentum(dimension: usize, grains: &[Grain], masses: &[f64]) -> DVec3 {
    let beta = if dimension == 2 { 0.5 } else { 0.4 };
    let free = grains.iter().zip(masses).filter(|(g, _)| !g.fixed);
    free.map(|(g, m)| *m * g.position.cross(g.velocity) + beta * m * g.radius * g.radius * g.spin).sum()
}

/// Fraction of space filled by grains in the core of the packing, overlaps counted once; None below 50 grains or where
/// the core is empty.
///
/// The core leaves out surface and wall effects: along gravity from the 10th to the 80th percentile of the centres,
/// sideways two largest radii inside their extent; a periodic axis counts whole. It is sampled at 2^18 quasi-random
/// points, which leaves an error of about 0.001.
pub fn packing_fraction(assembly: &Assembly, grains: &[Grain]) -> Option<f64> {
    const POINTS: u32 = 1 << 18;
    if grains.len() < 50 {
        return None;
    }
    let dims = assembly.dimension;
    let largest = grains.iter().map(|g| g.radius).fold(0.0, f64::max);
    let (lower, upper) = core(assembly, grains, largest);
    if (0..dims).any(|a| upper[a] <= lower[a]) {
        return None;
    }
    let cells = Cells::new(&assembly.domain, dims, grains, 2.0 * largest);
    // Additive recurrence with the generalised golden ratio: even coverage in any number of dimensions.
    let phi: f64 = if dims == 2 { 1.324_717_957_244_746 } else { 1.220_744_084_605_759_5 };
    let filled = (0..POINTS).filter(|k| {
        let u = |a: i32| (0.5 + f64::from(k + 1) / phi.powi(a + 1)).fract();
        let mut x = lower;
        (0..dims).for_each(|a| x[a] += u(a as i32) * (upper[a] - lower[a]));
        cells.covered(grains, x)
    });
    Some(filled.count() as f64 / f64::from(POINTS))
}

fn core(assembly: &Assembly, grains: &[Grain], largest: f64) -> (DVec3, DVec3) {
    let (mut lower, mut upper) = (DVec3::ZERO, DVec3::ZERO);
    let up = (0..assembly.dimension).max_by(|a, b| assembly.gravity[*a].abs().total_cmp(&assembly.gravity[*b].abs()));
    for axis in 0..assembly.dimension {
        if assembly.domain.periodic[axis] {
            (lower[axis], upper[axis]) = (assembly.domain.lower[axis], assembly.domain.upper[axis]);
            continue;
        }
        let mut centres: Vec<f64> = grains.iter().map(|g| g.position[axis]).collect();
        centres.sort_by(f64::total_cmp);
        let at = |q: f64| centres[((centres.len() - 1) as f64 * q) as usize];
        (lower[axis], upper[axis]) = match up {
            Some(up) if up == axis && assembly.gravity[axis] < 0.0 => (at(0.1), at(0.8)),
            Some(up) if up == axis && assembly.gravity[axis] > 0.0 => (at(0.2), at(0.9)),
            _ => (at(0.0) + 2.0 * largest, at(1.0) - 2.0 * largest),
        };
    }
    (lower, upper)
}

/// Grains by cell, to find the ones near a point.
struct Cells {
    domain: Domain,
    dims: usize,
    origin: DVec3,
    edge: DVec3,
    count: [i64; 3],
    start: Vec<usize>,
    ids: Vec<usize>,
}

impl Cells {
    fn new(domain: &Domain, dims: usize, grains: &[Grain], reach: f64) -> Cells {
        let mut cells = Cells {
            domain: *domain,
            dims,
            origin: DVec3::ZERO,
            edge: DVec3::ONE,
            count: [1; 3],
            start: Vec::new(),
            ids: vec![0; grains.len()],
        };
        for axis in 0..dims {
            let (low, high) = if domain.periodic[axis] {
                (domain.lower[axis], domain.upper[axis])
            } else {
                let ends = grains.iter().map(|g| g.position[axis]);
                ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
            };
            cells.origin[axis] = low;
            cells.count[axis] = ((high - low) / reach).floor().clamp(1.0, 512.0) as i64;
            cells.edge[axis] = ((high - low) / cells.count[axis] as f64).max(reach);
        }
        let total = cells.count.iter().product::<i64>() as usize;
        let home: Vec<usize> = grains.iter().map(|g| cells.index(cells.cell(g.position))).collect();
        cells.start = vec![0; total + 1];
        home.iter().for_each(|c| cells.start[c + 1] += 1);
        (0..total).for_each(|c| cells.start[c + 1] += cells.start[c]);
        let mut next = cells.start.clone();
        for (i, c) in home.into_iter().enumerate() {
            cells.ids[next[c]] = i;
            next[c] += 1;
        }
        cells
    }

    fn cell(&self, x: DVec3) -> [i64; 3] {
        std::array::from_fn(|a| {
            let c = ((x[a] - self.origin[a]) / self.edge[a]).floor() as i64;
            if self.domain.periodic[a] { c.rem_euclid(self.count[a]) } else { c.clamp(0, self.count[a] - 1) }
        })
    }

    fn index(&self, c: [i64; 3]) -> usize {
        (c[0] + self.count[0] * (c[1] + self.count[1] * c[2])) as usize
    }

    /// Whether a point lies in a grain.
    fn covered(&self, grains: &[Grain], x: DVec3) -> bool {
        let home = self.cell(x);
        let ring = |a: usize| if a < self.dims { -1..=1 } else { 0..=0 };
        let near = ring(0).flat_map(|i| ring(1).flat_map(move |j| ring(2).map(move |k| [i, j, k])));
        near.into_iter().any(|step: [i64; 3]| {
            let c: [i64; 3] = std::array::from_fn(|a| match self.domain.periodic[a] {
                true => (home[a] + step[a]).rem_euclid(self.count[a]),
                false => home[a] + step[a],
            });
            if (0..3).any(|a| c[a] < 0 || c[a] >= self.count[a]) {
                return false;
            }
            let ids = &self.ids[self.start[self.index(c)]..self.start[self.index(c) + 1]];
            ids.iter().any(|&i| self.nearest(grains[i].position - x).length_squared() < grains[i].radius.powi(2))
        })
    }

    fn nearest(&self, mut d: DVec3) -> DVec3 {
        for axis in (0..self.dims).filter(|a| self.domain.periodic[*a]) {
            let length = self.domain.upper[axis] - self.domain.lower[axis];
            d[axis] -= length * (d[axis] / length).round();
        }
        d
    }
}
