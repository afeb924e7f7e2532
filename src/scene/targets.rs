//! What a cell can be asked for, and when it has it.

use glam::DVec3;

use super::check::{AXES, Check, show};
use super::{Assembly, COMPONENTS, Cell, Grain, Method};
use crate::Result;

/// Axis along which a component moves, and along which its distance is.
const AXES_OF: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];

/// A target is reached within this part of it.
pub const CLOSE: f64 = 0.01;

impl Assembly {
    /// Whether the cell may be anything but a box that stays as it is.
    pub fn deforms(&self) -> bool {
        self.cell != Cell::default() || self.domain.tilt != DVec3::ZERO
    }

    /// The most that the servo of the cell makes of a rate, 1/s.
    pub fn most_rate(&self) -> f64 {
        let grains = self.grains.len() as f64;
        let diameter = 2.0 * self.mean_radius();
        let density = |grain: &Grain| self.materials[grain.material as usize].density;
        let density = self.grains.iter().map(density).sum::<f64>() / grains;
        match self.cell.is_controlled() {
            true => self.cell.inertial_number * (self.cell.largest_stress() / density).sqrt() / diameter,
            false => 0.0,
        }
    }

    /// No distance in the cell shrinks faster, over its length, 1/s.
    pub fn largest_rate(&self) -> f64 {
        let most = self.most_rate();
        let rate = |(rate, stress): (&f64, &Option<f64>)| if stress.is_some() { most } else { *rate };
        self.cell.strain_rate.iter().zip(&self.cell.stress).map(rate).map(|rate| rate * rate).sum::<f64>().sqrt()
    }

    /// Which components of a stress are not what the servo of the cell is asked for, in words.
    pub fn missed_stresses(&self, stress: Option<[Option<f64>; 6]>) -> Vec<String> {
        let most = CLOSE * self.cell.largest_stress();
        let missed = |k: usize| {
            let (target, found) = (self.cell.stress[k]?, stress?[k]?);
            ((found - target).abs() > most)
                .then(|| format!("cell.stress.{} = {target:e} Pa was not reached: it is {found:.4e} Pa", COMPONENTS[k]))
        };
        (0..6).filter_map(missed).collect()
    }

    /// Of the cell, m³ (m²).
    fn cell_volume(&self) -> f64 {
        let size = self.domain.upper - self.domain.lower;
        size.to_array()[..self.dimension].iter().product()
    }

    /// Volumes of all grains, m³ (m²), overlaps counted twice.
    pub fn grain_volume(&self) -> f64 {
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
    check_servo(assembly, check)?;
    for (k, target) in stop.strain.iter().enumerate() {
        let (key, rate) = (format!("stop.strain.{}", COMPONENTS[k]), cell.strain_rate[k]);
        if let Some(target) = *target
            && !(target / rate > 0.0)
        {
            let rule = format!("is never met with cell.strain_rate.{} = {}", COMPONENTS[k], show(rate));
            return Err(check.origin.bad(&key, show(target), rule));
        }
    }
    if let Some(target) = stop.packing_fraction
        && cell.is_controlled()
    {
        let rule = "is for a cell whose rates are given (cell.strain_rate); one with a target stress comes to a fraction of its own";
        return Err(check.origin.bad("stop.packing_fraction", show(target), rule));
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

/// Targets of a servo, and its numbers.
fn check_servo(assembly: &Assembly, check: &Check) -> Result<()> {
    let Assembly { domain, cell, gravity, .. } = assembly;
    check.positive("cell.inertial_number", cell.inertial_number, "")?;
    check.fraction("cell.gain", cell.gain)?;
    for (k, axes) in AXES_OF.into_iter().enumerate() {
        let key = format!("cell.stress.{}", COMPONENTS[k]);
        let Some(stress) = cell.stress[k] else { continue };
        check.finite(&key, DVec3::X * stress)?;
        if cell.strain_rate[k] != 0.0 {
            return Err(check
                .origin
                .wrong(&key, format!("cell.strain_rate.{} is given, too; one of them has to go", COMPONENTS[k])));
        }
        if k < 3 {
            check.positive(&key, stress, " of Pa (N/m in two dimensions); compression is positive")?;
        }
        if assembly.solver.method != Method::DiscreteElements {
            return Err(check.origin.wrong(&key, "is for method = \"dem\" only"));
        }
        if !(0..check.dimension).all(|axis| domain.periodic[axis]) || axes[1] >= check.dimension {
            return Err(check
                .origin
                .wrong(&key, "all axes of the cell must be periodic, and the component one of them"));
        }
        if *gravity != DVec3::ZERO {
            return Err(check.origin.wrong(&key, "gravity must be 0, or the stress is not the same everywhere"));
        }
    }
    Ok(())
}
