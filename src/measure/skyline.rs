//! How high a packing reaches, column by column.

use crate::scene::{Assembly, Grain};
use glam::DVec3;
use std::collections::HashMap;

pub fn free(grains: &[Grain]) -> impl Iterator<Item = &Grain> + Clone {
    grains.iter().filter(|g| !g.fixed)
}

pub fn largest(grains: &[Grain]) -> f64 {
    grains.iter().map(|g| g.radius).fold(0.0, f64::max)
}

/// The axis along which gravity is strongest, and whether it points down along it; None without gravity.
pub fn vertical(assembly: &Assembly) -> Option<(usize, bool)> {
    let g = assembly.gravity;
    let axis = (0..assembly.dimension).max_by(|a, b| g[*a].abs().total_cmp(&g[*b].abs()))?;
    (g[axis] != 0.0).then_some((axis, g[axis] < 0.0))
}

/// Height of the packing in each upright column: the highest free grain that the ones below it reach up to. A stray
/// grain high above does not count.
pub struct Skyline {
    vertical: Option<(usize, bool)>,
    width: f64,
    pub tops: HashMap<[i64; 2], f64>,
}

impl Skyline {
    /// Of columns of this width; what is further above the next grain than `reach` is a stray.
    pub fn new(assembly: &Assembly, grains: &[Grain], width: f64, reach: f64) -> Skyline {
        let mut skyline = Skyline { vertical: vertical(assembly), width, tops: HashMap::new() };
        let mut columns: HashMap<[i64; 2], Vec<f64>> = HashMap::new();
        for (column, height) in free(grains).filter_map(|g| skyline.column(g.position)) {
            columns.entry(column).or_default().push(height);
        }
        for (column, mut heights) in columns {
            heights.sort_by(f64::total_cmp);
            let gap = heights.windows(2).position(|w| w[1] - w[0] > reach);
            skyline.tops.insert(column, heights[gap.unwrap_or(heights.len() - 1)]);
        }
        skyline
    }

    /// Column of a point, and its height, counted against gravity.
    pub fn column(&self, x: DVec3) -> Option<([i64; 2], f64)> {
        let (up, down) = self.vertical?;
        // Of a column as wide as space there is one, on both sides of 0.
        let cell = |x: f64| if self.width.is_finite() { (x / self.width).floor() as i64 } else { 0 };
        let mut sideways = (0..3).filter(|a| *a != up).map(|a| cell(x[a]));
        let column = std::array::from_fn(|_| sideways.next().expect("two axes are left"));
        Some((column, if down { x[up] } else { -x[up] }))
    }

    /// Where the middle of a column is; 0 along the vertical axis.
    pub fn middle(&self, column: [i64; 2]) -> DVec3 {
        let mut places = column.into_iter().map(|k| (k as f64 + 0.5) * self.width);
        let up = self.vertical.map(|(up, _)| up);
        DVec3::from_array([0, 1, 2].map(|axis| if Some(axis) == up { 0.0 } else { places.next().unwrap_or(0.0) }))
    }

    /// Depth of a point below the surface; infinite without gravity, negative where there is no grain above or below.
    pub fn depth(&self, x: DVec3) -> f64 {
        match self.column(x) {
            None => f64::INFINITY,
            Some((column, height)) => self.tops.get(&column).map_or(-1.0, |top| top - height),
        }
    }
}
