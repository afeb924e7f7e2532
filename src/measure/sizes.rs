//! The sizes of the grains.

use crate::scene::{Assembly, Clump, Grain};
use serde::Serialize;

/// Diameters, m: 10 %, 50 % and 90 % of the free grains are no larger. Of a clump it is that of the sphere (disk) of the
/// same volume.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    pub d10: f64,
    pub d50: f64,
    pub d90: f64,
}

/// By number and by volume (in two dimensions area).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sizes {
    pub by_number: Percentiles,
    pub by_volume: Percentiles,
}

impl Sizes {
    /// None if all grains are fixed.
    pub fn of(assembly: &Assembly) -> Option<Sizes> {
        let free_grain = |grain: &Grain| (!grain.fixed).then_some(2.0 * grain.radius);
        let free_clump = |clump: &Clump| (!clump.fixed).then_some(2.0 * clump.radius);
        let mut diameters: Vec<f64> = match &assembly.clumps[..] {
            [] => assembly.grains.iter().filter_map(free_grain).collect(),
            clumps => clumps.iter().filter_map(free_clump).collect(),
        };
        diameters.sort_by(f64::total_cmp);
        let largest = *diameters.last()?;
        let by = |power: i32| {
            let below = |sum: &mut f64, d: &f64| {
                *sum += (d / largest).powi(power);
                Some(*sum)
            };
            let sums: Vec<f64> = diameters.iter().scan(0.0, below).collect();
            let all = sums[sums.len() - 1];
            // Rounding must not make a tenth of ten grains two.
            let at = |share: f64| diameters[sums.partition_point(|sum| *sum < share * all * (1.0 - 1e-12))];
            Percentiles { d10: at(0.1), d50: at(0.5), d90: at(0.9) }
        };
        Some(Sizes { by_number: by(0), by_volume: by(assembly.dimension as i32) })
    }
}
