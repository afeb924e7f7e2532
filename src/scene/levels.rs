//! Grains of like size, for the levels of the hierarchical grid.

use super::{Assembly, Grain};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Median radii from which on a grain is large: so many neighbours fit around it that workgroups serve it.
const LARGE: f64 = 8.0;

/// Grains so alike that they share a level of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeLevel {
    /// Radii, m.
    pub smallest: f64,
    pub largest: f64,
    pub grains: usize,
}

impl SizeLevel {
    fn with(self, other: SizeLevel) -> SizeLevel {
        SizeLevel {
            smallest: self.smallest.min(other.smallest),
            largest: self.largest.max(other.largest),
            grains: self.grains + other.grains,
        }
    }
}

impl Assembly {
    /// Mean radius of the grains, m.
    pub fn mean_radius(&self) -> f64 {
        self.grains.iter().map(|g| g.radius).sum::<f64>() / self.grains.len() as f64
    }

    /// The sizes of grains, finest first. The cells of a level are as wide as its largest grain with the margin of the
    /// lists, so every level is twice as wide as the one before, or more where there are no grains between. Large
    /// grains have levels of their own.
    pub fn size_levels(&self) -> Vec<SizeLevel> {
        let margin = self.solver.margin * self.mean_radius();
        let width = |radius: f64| 2.0 * radius + margin;
        let widest = self.grains.iter().map(|g| width(g.radius)).fold(0.0, f64::max);
        let limit = self.largest_common_radius();
        let alone = |grain: &Grain| {
            let halvings = (widest / width(grain.radius)).log2() as i32;
            let level = SizeLevel { smallest: grain.radius, largest: grain.radius, grains: 1 };
            ((grain.radius > limit, -halvings), level)
        };
        let with = |mut levels: BTreeMap<_, SizeLevel>, (key, more): (_, SizeLevel)| {
            levels.entry(key).and_modify(|level| *level = level.with(more)).or_insert(more);
            levels
        };
        let levels = self.grains.par_iter().map(alone).fold(BTreeMap::new, with);
        let levels = levels.reduce(BTreeMap::new, |levels, more| more.into_iter().fold(levels, with));
        levels.into_values().collect()
    }

    /// How many grains are large. This follows from the sizes alone, because sums over their contacts may be rounded
    /// otherwise, which lists must not decide.
    pub fn large_grains(&self) -> usize {
        let limit = self.largest_common_radius();
        self.grains.iter().filter(|g| g.radius > limit).count()
    }

    /// Grains above this radius are large, m.
    pub(crate) fn largest_common_radius(&self) -> f64 {
        let mut radii: Vec<f64> = self.grains.iter().map(|g| g.radius).collect();
        let middle = radii.len() / 2;
        LARGE * *radii.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}
