//! How centres lie around each other: the radial distribution function.

use super::{cell::Cell, packing::Packing};
use crate::scene::{Neighbours, Surface};
use glam::DVec3;
use serde::Serialize;
use std::f64::consts::PI;

/// Mean number density of centres at a distance from a centre, over that of the cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shell {
    /// Inner and outer radius, m.
    pub low: f64,
    pub high: f64,
    pub g: f64,
}

/// Farthest distance and thickness of a shell, in mean diameters.
const REACH: f64 = 5.0;
const THICKNESS: f64 = 0.05;
/// Centres that are looked around from, if there are more of them.
const CENTERS: usize = 10_000;

/// Of the centres of free particles, around those that are farther than the last shell from faces that do not repeat.
/// Empty where there are none.
pub fn radial_distribution(packing: &Packing, cell: &Cell) -> Vec<Shell> {
    let (dims, domain) = (packing.dims(), &packing.assembly.domain);
    let free: Vec<usize> = packing.free().collect();
    let mean = 2.0 * free.iter().map(|k| packing.radius(*k)).sum::<f64>() / free.len().max(1) as f64;
    // Not so far that a grain is seen twice, or that none is far enough from both faces.
    let part = |axis: usize| if domain.periodic[axis] { 0.5 } else { 1.0 / 3.0 };
    let most = (0..dims).map(|axis| part(axis) * (cell.upper[axis] - cell.lower[axis]));
    let thickness = THICKNESS * mean;
    let reach = most.fold(REACH * mean, f64::min);
    let shells = (reach / thickness).floor() as usize;
    let reach = shells as f64 * thickness;
    let inside = |x: DVec3| {
        let faces = (0..dims).filter(|axis| !domain.periodic[*axis]);
        let from_faces = faces.map(|axis| (x[axis] - cell.lower[axis]).min(cell.upper[axis] - x[axis]));
        let from_walls = packing.walls.iter().map(|wall: &_| Surface::distance(&wall.surface, x));
        from_faces.chain(from_walls).fold(f64::INFINITY, f64::min) >= reach
    };
    let around: Vec<usize> = free.iter().copied().filter(|k| inside(packing.center(*k))).collect();
    if around.is_empty() || shells == 0 {
        return Vec::new();
    }
    let around: Vec<usize> = around.iter().copied().step_by(around.len().div_ceil(CENTERS)).collect();
    // As spheres of about the size of the grains, whose radius is taken off again: a search looks at cells as wide as spheres.
    let point = 0.5 * mean.min(reach);
    let points = Neighbours::of(*domain, dims, free.iter().map(|k| (packing.center(*k), point)).collect());
    let mut counts = vec![0_usize; shells];
    let mut found = Vec::new();
    for center in &around {
        found.clear();
        let place = packing.center(*center);
        points.find_overlap(place, reach - point, false, |other, overlap| {
            found.push((other, reach - overlap));
            false
        });
        // Two cells that share a bucket show a sphere twice.
        found.sort_by_key(|(other, _)| *other);
        found.dedup_by_key(|(other, _)| *other);
        for (_, distance) in found.iter().filter(|(other, _)| free[*other] != *center) {
            if let Some(count) = counts.get_mut((distance / thickness) as usize) {
                *count += 1;
            }
        }
    }
    let density = free.len() as f64 / cell.volume();
    let ball = |r: f64| if dims == 2 { PI * r * r } else { 4.0 / 3.0 * PI * r.powi(3) };
    let shell = |(k, count): (usize, &usize)| {
        let (low, high) = (k as f64 * thickness, (k + 1) as f64 * thickness);
        let expected = density * (ball(high) - ball(low)) * around.len() as f64;
        Shell { low, high, g: *count as f64 / expected }
    };
    counts.iter().enumerate().map(shell).collect()
}
