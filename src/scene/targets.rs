//! What a cell can be asked for, and when it has it.

use glam::DVec3;

use super::check::{AXES, Check, show};
use super::{Assembly, COMPONENTS, Cell};
use crate::Result;

/// Axis along which a component moves, and along which its distance is.
const AXES_OF: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];

impl Assembly {
    /// Whether the cell may be anything but a box that stays as it is.
    pub fn deforms(&self) -> bool {
        self.cell != Cell::default() || self.domain.tilt != DVec3::ZERO
    }

    /// Of the cell, m³ (m²).
    fn cell_volume(&self) -> f64 {
        let size = self.domain.upper - self.domain.lower;
        size.to_array()[..self.dimension].iter().product()
    }

    /// Volumes of all grains, m³ (m²), overlaps counted twice.
    fn grain_volume(&self) -> f64 {
        let of = |radius: f64| match self.dimension {
            2 => std::f64::consts::PI * radius * radius,
            _ => 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3),
        };
        match &self.clumps[..] {
            [] => self.grains.iter().map(|grain| of(grain.radius)).sum(),
            clumps => clumps.iter().map(|clump| of(clump.radius)).sum(),
        }
    }

    /// When the first target of the cell is met, s; None without one.
    pub fn time_of_target(&self) -> Option<f64> {
        let rates = self.cell.strain_rate;
        let of_strain = self.stop.strain.iter().zip(rates).filter_map(|(target, rate)| Some((*target)? / rate));
        let of_fraction = self.stop.packing_fraction.map(|target| {
            let fraction = self.grain_volume() / self.cell_volume();
            (fraction / target).ln() / rates[..3].iter().sum::<f64>()
        });
        of_strain.chain(of_fraction).min_by(f64::total_cmp)
    }
}

/// Tilts, rates and targets that a cell can have.
pub fn check_cell(assembly: &Assembly, check: &Check) -> Result<()> {
    let Assembly { domain, cell, stop, gravity, .. } = assembly;
    let dims = check.dimension;
    let periodic = |key: &str, axes: [usize; 2]| match axes.into_iter().find(|axis| !domain.periodic[*axis]) {
        Some(axis) => Err(check.origin.wrong(
            key,
            format!("the axis {} is not periodic; a cell deforms between periodic faces only", AXES[axis]),
        )),
        None => Ok(()),
    };
    for (k, axes) in AXES_OF.into_iter().enumerate().skip(3) {
        let (key, tilt) = (format!("domain.tilt.{}", COMPONENTS[k]), domain.tilt[k - 3]);
        if tilt != 0.0 {
            periodic(&key, axes)?;
            let most = 0.5 * (domain.upper[axes[0]] - domain.lower[axes[0]]);
            check.within(&key, tilt, -most, most, &format!(" m, half of the length along {}", AXES[axes[0]]))?;
        }
    }
    for (k, axes) in AXES_OF.into_iter().enumerate() {
        let rate = cell.strain_rate[k];
        let key = format!("cell.strain_rate.{}", COMPONENTS[k]);
        check.finite(&key, DVec3::X * rate)?;
        if rate == 0.0 {
            continue;
        }
        periodic(&key, axes)?;
        if gravity[axes[0]] != 0.0 {
            let message =
                format!("the cell deforms along {}, along which gravity acts; set gravity to 0 there", AXES[axes[0]]);
            return Err(check.origin.wrong(&key, message));
        }
    }
    for (k, target) in stop.strain.iter().enumerate() {
        let (key, rate) = (format!("stop.strain.{}", COMPONENTS[k]), cell.strain_rate[k]);
        if let Some(target) = *target
            && !(target / rate > 0.0)
        {
            let rule = format!("is never met with cell.strain_rate.{} = {}", COMPONENTS[k], show(rate));
            return Err(check.origin.bad(&key, show(target), rule));
        }
    }
    if let Some(target) = stop.packing_fraction {
        let key = "stop.packing_fraction";
        check.positive(key, target, "")?;
        if !(0..dims).all(|axis| domain.periodic[axis]) {
            return Err(check.origin.wrong(key, "is that of a cell; all axes must be periodic"));
        }
        let fraction = assembly.grain_volume() / assembly.cell_volume();
        let rate: f64 = cell.strain_rate[..3].iter().sum();
        if !((fraction / target).ln() / rate > 0.0) {
            let rule = format!(
                "is never met: the cell begins with {} and its volume grows at {} 1/s (cell.strain_rate)",
                show(fraction),
                show(rate)
            );
            return Err(check.origin.bad(key, show(target), rule));
        }
    }
    Ok(())
}
