//! Finds grains near a point. Grains are sorted by size into levels, each with a hashed grid of its own,
//! so that a few large grains among many small ones cost no more than equal grains.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use rayon::prelude::*;

use super::{Domain, Grain};

const END: u32 = u32::MAX;

/// Spheres (or disks) that can be looked up by place, across periodic faces too.
pub struct Neighbours {
    domain: Domain,
    dimension: usize,
    /// Largest radius expected, m; larger ones only cost time.
    largest: f64,
    /// Level `k` holds the radii in `(largest/2^(k+1), largest/2^k]`.
    levels: BTreeMap<i32, Level>,
    spheres: Vec<(DVec3, f64)>,
    /// The next sphere in the same bucket.
    next: Vec<u32>,
}

struct Level {
    /// No radius of the level is above this, m.
    radius: f64,
    /// Edges of a cell, m. At least `2 radius`.
    cell: DVec3,
    /// Cells along each periodic axis.
    cells: [Option<i64>; 3],
    /// First sphere of each bucket; several cells may share one.
    buckets: Vec<u32>,
    members: Vec<u32>,
}

impl Neighbours {
    pub fn new(domain: Domain, dimension: usize, largest: f64) -> Neighbours {
        Neighbours { domain, dimension, largest, levels: BTreeMap::new(), spheres: Vec::new(), next: Vec::new() }
    }

    /// Of many spheres at once.
    pub fn of(domain: Domain, dimension: usize, spheres: Vec<(DVec3, f64)>) -> Neighbours {
        let largest = spheres.iter().map(|(_, radius)| *radius).fold(0.0, f64::max);
        let mut all = Neighbours { spheres, ..Neighbours::new(domain, dimension, largest) };
        all.next = vec![END; all.spheres.len()];
        let numbers: Vec<i32> = all.spheres.par_iter().map(|(_, radius)| all.level_of(*radius)).collect();
        for number in BTreeSet::from_iter(numbers.iter().copied()) {
            let mut level = all.new_level(number);
            level.members = (0..).zip(&numbers).filter(|(_, of)| **of == number).map(|(id, _)| id).collect();
            level.buckets = vec![END; (2 * level.members.len()).next_power_of_two()];
            let places = level.members.par_iter().map(|id| all.bucket_of(&level, *id));
            let places: Vec<u32> = places.map(|bucket| bucket as u32).collect();
            for (id, bucket) in level.members.iter().zip(places) {
                all.next[*id as usize] = std::mem::replace(&mut level.buckets[bucket as usize], *id);
            }
            all.levels.insert(number, level);
        }
        all
    }

    pub fn of_grains(domain: Domain, dimension: usize, grains: &[Grain]) -> Neighbours {
        Neighbours::of(domain, dimension, grains.par_iter().map(|grain| (grain.position, grain.radius)).collect())
    }

    pub fn insert(&mut self, position: DVec3, radius: f64) {
        let number = self.level_of(radius);
        let mut level = match self.levels.remove(&number) {
            Some(level) => level,
            None => self.new_level(number),
        };
        let id = self.spheres.len() as u32;
        self.spheres.push((position, radius));
        self.next.push(END);
        level.members.push(id);
        if level.members.len() * 2 > level.buckets.len() {
            level.buckets = vec![END; level.buckets.len() * 4];
            let members = std::mem::take(&mut level.members);
            members.iter().for_each(|member| self.link(&mut level, *member));
            level.members = members;
        } else {
            self.link(&mut level, id);
        }
        self.levels.insert(number, level);
    }

    fn link(&mut self, level: &mut Level, id: u32) {
        let bucket = self.bucket_of(level, id);
        self.next[id as usize] = std::mem::replace(&mut level.buckets[bucket], id);
    }

    fn bucket_of(&self, level: &Level, id: u32) -> usize {
        let relative = self.domain.sheared_back(self.spheres[id as usize].0 - self.origin());
        let place = cell_of(relative, level.cell).to_array();
        bucket(std::array::from_fn(|axis| wrap(place[axis] as i64, level.cells[axis])), level.buckets.len())
    }

    fn level_of(&self, radius: f64) -> i32 {
        (self.largest / radius).log2().floor() as i32
    }

    fn new_level(&self, number: i32) -> Level {
        // The tiny excess covers the rounding of the logarithm.
        let radius = self.largest * 0.5_f64.powi(number) * (1.0 + 1e-9);
        let mut cell = DVec3::INFINITY;
        let mut cells = [None; 3];
        for axis in 0..self.dimension {
            cell[axis] = 2.0 * radius;
            if self.domain.periodic[axis] {
                let length = self.domain.upper[axis] - self.domain.lower[axis];
                let count = (length / cell[axis]).floor().max(1.0);
                cell[axis] = length / count;
                cells[axis] = Some(count as i64);
            }
        }
        Level { radius, cell, cells, buckets: vec![END; 64], members: Vec::new() }
    }

    fn origin(&self) -> DVec3 {
        let lower = self.domain.lower;
        DVec3::select(lower.is_finite_mask(), lower, DVec3::ZERO)
    }

    /// The first sphere for which `wanted(index, overlap in m)` holds, among those that overlap the given one.
    /// To look at `pairs` from all spheres is to see every two that overlap at least once, from the smaller one.
    pub fn find_overlap(
        &self,
        position: DVec3,
        radius: f64,
        pairs: bool,
        mut wanted: impl FnMut(usize, f64) -> bool,
    ) -> Option<(usize, f64)> {
        let last = match pairs {
            true => self.level_of(radius),
            false => i32::MAX,
        };
        let mut test = |id: u32| {
            let (other, other_radius) = self.spheres[id as usize];
            let overlap = radius + other_radius - self.domain.nearest(position - other).length();
            (overlap > 0.0 && wanted(id as usize, overlap)).then_some((id as usize, overlap))
        };
        let mut levels = self.levels.range(..=last);
        levels.find_map(|(number, level)| {
            self.find_in_level(level, position, radius, pairs && *number == last, &mut test)
        })
    }

    fn find_in_level<T>(
        &self,
        level: &Level,
        position: DVec3,
        radius: f64,
        ahead: bool,
        test: &mut impl FnMut(u32) -> Option<T>,
    ) -> Option<T> {
        let reach = self.domain.sheared_reach(radius + level.radius);
        let relative = self.domain.sheared_back(position - self.origin());
        let first = cell_of(relative - reach, level.cell);
        let last = cell_of(relative + reach, level.cell);
        let mut first = first.to_array().map(|v| v as i64);
        let own = cell_of(relative, level.cell).to_array().map(|v| v as i64);
        // Cells behind this one are left to the spheres there.
        let mut from = if ahead { own } else { first };
        let mut count = [0; 3];
        for axis in 0..3 {
            count[axis] = last[axis] as i64 - first[axis] + 1;
            if let Some(cells) = level.cells[axis].filter(|&cells| cells < count[axis]) {
                (first[axis], count[axis]) = (0, cells);
                from = [i64::MIN; 3];
            }
        }
        let volume: f64 = count.iter().map(|&n| n as f64).product();
        if volume > level.members.len() as f64 {
            return level.members.iter().find_map(|&id| test(id));
        }
        for z in first[2].max(from[2])..first[2] + count[2] {
            let row = if z == from[2] { from[1] } else { i64::MIN };
            for y in first[1].max(row)..first[1] + count[1] {
                let place = if y == row { from[0] } else { i64::MIN };
                let (y, z) = (wrap(y, level.cells[1]), wrap(z, level.cells[2]));
                for x in first[0].max(place)..first[0] + count[0] {
                    let x = wrap(x, level.cells[0]);
                    let mut id = level.buckets[bucket([x, y, z], level.buckets.len())];
                    while id != END {
                        if let Some(found) = test(id) {
                            return Some(found);
                        }
                        id = self.next[id as usize];
                    }
                }
            }
        }
        None
    }
}

/// The cell of a point. Far away cells merge, which keeps their numbers within the integers.
fn cell_of(relative: DVec3, cell: DVec3) -> DVec3 {
    const FAR: DVec3 = DVec3::splat(1e15);
    (relative / cell).floor().clamp(-FAR, FAR)
}

fn wrap(index: i64, cells: Option<i64>) -> i64 {
    cells.map_or(index, |cells| index.rem_euclid(cells))
}

/// Bucket of a cell; `len` is a power of two.
fn bucket(place: [i64; 3], len: usize) -> usize {
    // Neighbours along x stay neighbours in memory; large odd factors scatter the rows.
    let row =
        (place[1] as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (place[2] as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
    ((row >> 20).wrapping_add(place[0] as u64) as usize) & (len - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Every two of random spheres that overlap are seen, of one size and of many, in open space and where two, three or
    /// more cells fit between periodic faces, also of spheres beyond these.
    #[test]
    fn all_pairs_that_overlap_are_seen() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for (sides, largest) in [(DVec3::splat(4.1), 1.0), (DVec3::new(4.1, 6.1, 11.0), 1.0), (DVec3::splat(20.0), 8.0)]
        {
            for (dimension, periodic) in [(2, [false; 3]), (2, [true, true, false]), (3, [false; 3]), (3, [true; 3])] {
                for smallest in [1.0, 0.1] {
                    let tilt = if periodic[2] { 0.45 * DVec3::new(sides.y, -sides.x, sides.x) } else { DVec3::ZERO };
                    let domain = Domain { lower: DVec3::ZERO, upper: sides, periodic, tilt, ..Domain::default() };
                    let sphere = |_| {
                        let mut x = DVec3::from_array(std::array::from_fn(|k| rng.random_range(-0.2..1.2) * sides[k]));
                        x.z *= f64::from(u8::from(dimension == 3));
                        (x, largest * rng.random_range(0.9 * smallest..=smallest))
                    };
                    let count = if smallest == 1.0 { 40 } else { 300 };
                    let mut spheres: Vec<(DVec3, f64)> = (0..count).map(sphere).collect();
                    spheres.iter_mut().take(5).for_each(|(_, radius)| *radius = largest);
                    let of = |i: usize, j: usize| {
                        let ((a, r), (b, s)) = (spheres[i], spheres[j]);
                        r + s > domain.nearest(a - b).length()
                    };
                    let every = (0..count).flat_map(|i| (0..i).map(move |j| (j, i)));
                    let expected: BTreeSet<_> = every.filter(|(i, j)| of(*i, *j)).collect();
                    let all = Neighbours::of(domain, dimension, spheres.clone());
                    let mut seen = BTreeSet::new();
                    for (i, (x, radius)) in spheres.iter().enumerate() {
                        all.find_overlap(*x, *radius, true, |j, _| {
                            if i != j {
                                seen.insert((i.min(j), i.max(j)));
                            }
                            false
                        });
                    }
                    assert!(expected.len() > 5, "{} pairs overlap", expected.len());
                    assert_eq!(seen, expected, "{dimension}D, {periodic:?}, {sides}, from {smallest} on");
                }
            }
        }
    }
}
