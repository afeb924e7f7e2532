//! Which part of space the grains fill.

use super::{
    analysis::{mass_of_clump, masses},
    clip::ball_in_box,
    skyline::{Skyline, free, largest, vertical},
};
use crate::scene::{Assembly, Grain, Neighbours, Surface, Wall};
use glam::DVec3;
use serde::Serialize;
use std::f64::consts::PI;

/// A part of space, with the standard error of what is sampled; 0 where it is exact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PackingFraction {
    pub value: f64,
    pub error: f64,
}

/// Fraction of space filled by grains inside the packing, overlaps counted once; None where the packing has no inside.
///
/// Inside is what lies two largest radii away from every wall, from the free faces of the packing and, under gravity,
/// below its surface: the highest free grain of each upright column two largest radii wide. So heaps and cylinders
/// count with what they fill. Where everything repeats and nothing falls, all space is inside, and the fraction is
/// exact as long as no point is inside three grains; where walls and free faces leave a box, it is as exact but for the
/// overlaps that its faces cut.
pub fn packing_fraction(assembly: &Assembly, grains: &[Grain], walls: &[Wall]) -> Option<PackingFraction> {
    free(grains).next()?;
    let dims = assembly.dimension;
    if assembly.domain.periodic[..dims].iter().all(|periodic| *periodic)
        && walls.is_empty()
        && vertical(assembly).is_none()
    {
        let size = assembly.domain.upper - assembly.domain.lower;
        let space: f64 = size.to_array()[..dims].iter().product();
        return Some(PackingFraction { value: solid_volume(assembly, grains) / space, error: 0.0 });
    }
    let inset = 2.0 * largest(grains);
    let (lower, upper) = extent(assembly, grains, |up| if up { 0.0 } else { inset });
    if let Some((lower, upper)) = boxed(assembly, walls, inset, lower, upper) {
        return in_box(assembly, grains, lower, upper);
    }
    let surface = Skyline::new(assembly, grains, inset, 2.0 * inset);
    sampled(assembly, grains, lower, upper, |x| {
        surface.depth(x) >= inset && walls.iter().all(|w| w.surface.distance(x) >= inset)
    })
}

/// The part of a box that is as far as `inset` from all walls, if that is a box too, and nothing falls.
fn boxed(assembly: &Assembly, walls: &[Wall], inset: f64, lower: DVec3, upper: DVec3) -> Option<(DVec3, DVec3)> {
    let (mut lower, mut upper) = (lower, upper);
    for wall in walls {
        let Surface::Plane { point, normal } = wall.surface else { return None };
        let axis = (0..assembly.dimension).find(|axis| normal[*axis].abs() == 1.0)?;
        match normal[axis] > 0.0 {
            true => lower[axis] = lower[axis].max(point[axis] + inset),
            false => upper[axis] = upper[axis].min(point[axis] - inset),
        }
    }
    (vertical(assembly).is_none() && assembly.clumps.is_empty()).then_some((lower, upper))
}

/// What grains fill of a box, by what it has of each of them, less the lenses that two of them share where their middle is
/// inside; the error is what lenses that its faces cut may change. None of a box with nothing in it.
fn in_box(assembly: &Assembly, grains: &[Grain], lower: DVec3, upper: DVec3) -> Option<PackingFraction> {
    let dims = assembly.dimension;
    if (0..dims).any(|axis| upper[axis] <= lower[axis]) {
        return None;
    }
    // A periodic axis counts whole, wherever a grain is along it.
    let along = |bound: DVec3, open: f64| {
        DVec3::from_array([0, 1, 2].map(|axis| if assembly.domain.periodic[axis] { open } else { bound[axis] }))
    };
    let (low, high) = (along(lower, f64::NEG_INFINITY), along(upper, f64::INFINITY));
    let spheres = Neighbours::of_grains(assembly.domain, dims, grains);
    let (mut solid, mut cut, mut others) = (0.0, 0.0, Vec::new());
    for (k, grain) in grains.iter().enumerate() {
        let (x, radius) = (grain.position, grain.radius);
        solid += ball_in_box(dims, x, radius, low, high);
        others.clear();
        spheres.find_overlap(x, radius, false, |other, overlap| {
            others.push((other, overlap));
            false
        });
        others.sort_by_key(|(other, _)| *other);
        others.dedup_by_key(|(other, _)| *other);
        for (other, overlap) in others.iter().filter(|(other, _)| *other > k) {
            let branch = assembly.domain.nearest(grains[*other].position - x);
            let middle = x + (radius - 0.5 * overlap) * branch.normalize_or_zero();
            let reach = (2.0 * radius.min(grains[*other].radius) * overlap).sqrt();
            let depth = (0..dims).map(|axis| (middle[axis] - low[axis]).min(high[axis] - middle[axis]));
            let depth = depth.fold(f64::INFINITY, f64::min);
            let shared = lens(dims, radius, grains[*other].radius, *overlap);
            solid -= if depth >= 0.0 { shared } else { 0.0 };
            cut += if depth.abs() < reach { shared } else { 0.0 };
        }
    }
    let space: f64 = (0..dims).map(|axis| upper[axis] - lower[axis]).product();
    Some(PackingFraction { value: solid / space, error: cut / space })
}

/// Fraction of the whole vessel that grains fill, next to walls too: between the walls, within the box around the free
/// grains and, under gravity, below the centre of the highest of them that others reach up to. It is what there is of a
/// vessel too slender for an inside.
pub fn overall_packing_fraction(assembly: &Assembly, grains: &[Grain], walls: &[Wall]) -> Option<PackingFraction> {
    free(grains).next()?;
    let radius = largest(grains);
    let (lower, upper) = extent(assembly, grains, |_| -radius);
    let surface = Skyline::new(assembly, grains, f64::INFINITY, 4.0 * radius);
    sampled(assembly, grains, lower, upper, |x| {
        surface.depth(x) >= 0.0 && walls.iter().all(|w| w.surface.distance(x) >= 0.0)
    })
}

/// By 2^18 quasi-random points of a box, of which those count that are inside; None if these are few. The error is that
/// of the mean of 16 parts of them, each of which covers the box evenly.
fn sampled(
    assembly: &Assembly,
    grains: &[Grain],
    lower: DVec3,
    upper: DVec3,
    inside: impl Fn(DVec3) -> bool,
) -> Option<PackingFraction> {
    const POINTS: u32 = 1 << 18;
    const FEW: f64 = 2000.0;
    const PARTS: usize = 16;
    let dims = assembly.dimension;
    if (0..dims).any(|a| upper[a] <= lower[a]) {
        return None;
    }
    let spheres = Neighbours::of_grains(assembly.domain, dims, grains);
    // Additive recurrence with the generalised golden ratio: even coverage in any number of dimensions.
    let phi: f64 = if dims == 2 { 1.324_717_957_244_746 } else { 1.220_744_084_605_759_5 };
    let mut parts = [[0.0; 2]; PARTS];
    for k in 0..POINTS {
        let u = |a: i32| (0.5 + f64::from(k + 1) / phi.powi(a + 1)).fract();
        let mut x = lower;
        (0..dims).for_each(|a| x[a] += u(a as i32) * (upper[a] - lower[a]));
        if inside(x) {
            let [covered, all] = &mut parts[k as usize / (POINTS as usize / PARTS)];
            *all += 1.0;
            *covered += f64::from(u8::from(spheres.find_overlap(x, 0.0, false, |_, _| true).is_some()));
        }
    }
    let [covered, all] = parts.iter().fold([0.0; 2], |[c, a], part| [c + part[0], a + part[1]]);
    let value = covered / all;
    let squares: f64 = parts.iter().map(|[covered, all]| (covered - value * all).powi(2)).sum();
    let error = (squares * PARTS as f64 / (PARTS as f64 - 1.0)).sqrt() / all;
    (all >= FEW).then_some(PackingFraction { value, error })
}

/// What all grains fill: their volumes, of clumps those of their unions, less the lenses that two of them share, m³ (in
/// two dimensions m²).
fn solid_volume(assembly: &Assembly, grains: &[Grain]) -> f64 {
    let dims = assembly.dimension;
    let owners = assembly.owners();
    let density = |material: u32| assembly.materials[material as usize].density;
    let volumes: f64 = match &assembly.clumps[..] {
        [] => masses(assembly).iter().zip(&assembly.grains).map(|(m, g)| m / density(g.material)).sum(),
        clumps => clumps.iter().map(|c| mass_of_clump(assembly, c) / density(c.material)).sum(),
    };
    let mut spheres = Neighbours::new(assembly.domain, dims, largest(grains));
    let (mut shared, mut others) = (0.0, Vec::new());
    for (k, grain) in grains.iter().enumerate() {
        others.clear();
        spheres.find_overlap(grain.position, grain.radius, false, |other, overlap| {
            others.push((other, overlap));
            false
        });
        // Two cells that share a bucket show a sphere twice.
        others.sort_by_key(|(other, _)| *other);
        others.dedup_by_key(|(other, _)| *other);
        let foreign = others.iter().filter(|(other, _)| owners.is_empty() || owners[k] != owners[*other]);
        shared += foreign.map(|(o, overlap)| lens(dims, grain.radius, grains[*o].radius, *overlap)).sum::<f64>();
        spheres.insert(grain.position, grain.radius);
    }
    volumes - shared
}

/// What two spheres (disks) share that overlap by this, m³ (m²).
pub(super) fn lens(dims: usize, a: f64, b: f64, overlap: f64) -> f64 {
    let d = (a + b - overlap).max((a - b).abs());
    let inside = d <= (a - b).abs();
    let small = a.min(b);
    if dims == 2 {
        if inside {
            return PI * small * small;
        }
        // Half the chord; both segments are on it, so that what rounding does to it cancels.
        let chord = ((-d + a + b) * (d + a - b) * (d - a + b) * (d + a + b)).max(0.0).sqrt() / (2.0 * d);
        let segment = |r: f64, s: f64| {
            let x = (d * d + r * r - s * s) / (2.0 * d);
            r * r * chord.atan2(x) - x * chord
        };
        return segment(a, b) + segment(b, a);
    }
    if inside {
        return 4.0 / 3.0 * PI * small.powi(3);
    }
    PI / (12.0 * d) * overlap * overlap * (d * d + 2.0 * d * (a + b) - 3.0 * (a - b) * (a - b))
}

/// Box of the free grains' centres; along axes that do not repeat less an inset, of the vertical one and of others.
fn extent(assembly: &Assembly, grains: &[Grain], inset: impl Fn(bool) -> f64) -> (DVec3, DVec3) {
    let (mut lower, mut upper) = (DVec3::ZERO, DVec3::ZERO);
    for axis in 0..assembly.dimension {
        if assembly.domain.periodic[axis] {
            (lower[axis], upper[axis]) = (assembly.domain.lower[axis], assembly.domain.upper[axis]);
            continue;
        }
        let ends = free(grains).map(|g| g.position[axis]);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let inset = inset(vertical(assembly).is_some_and(|(up, _)| up == axis));
        (lower[axis], upper[axis]) = (low + inset, high - inset);
    }
    (lower, upper)
}
