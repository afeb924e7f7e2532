//! What a cell can be asked for, and when it has it.

use glam::DVec3;

use super::check::{AXES, Check, show};
use super::{Assembly, COMPONENTS, Cell, Grain, Method, Wall};
use crate::Result;

/// Axis along which a component moves, and along which its distance is.
const AXES_OF: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];

/// A target is reached within this part of it.
pub const CLOSE: f64 = 0.01;

/// The same where no rest is asked for: the stress of grains that flow is never quite the same.
pub const CLOSE_IN_FLOW: f64 = 0.05;

impl Assembly {
    /// Whether the cell may be anything but a box that stays as it is.
    pub fn deforms(&self) -> bool {
        self.cell != Cell::default() || self.domain.tilt != DVec3::ZERO || self.stop.jamming.is_some()
    }

    /// Whether nothing but contacts can set grains in motion: no gravity, no wall or fixed grain that moves, and no flow of
    /// the cell.
    pub fn is_left_alone(&self) -> bool {
        let still = |wall: &Wall| !wall.moves() && wall.spin == 0.0;
        let fixed = |grain: &Grain| !grain.fixed || (grain.velocity == DVec3::ZERO && grain.spin == DVec3::ZERO);
        self.gravity == DVec3::ZERO
            && self.cell == Cell::default()
            && self.walls.iter().all(still)
            && self.grains.iter().all(fixed)
    }

    /// The most that the servo of the cell makes of a rate, 1/s.
    pub fn most_rate(&self) -> f64 {
        match self.cell.is_controlled() {
            true => self.rate_of(self.cell.inertial_number, self.cell.largest_stress()),
            false => 0.0,
        }
    }

    /// The strain rate with this inertial number under a pressure, Pa (N/m), of the mean diameter and density, 1/s.
    pub(super) fn rate_of(&self, inertial_number: f64, pressure: f64) -> f64 {
        let grains = self.grains.len() as f64;
        let density = |grain: &Grain| self.materials[grain.material as usize].density;
        let density = self.grains.iter().map(density).sum::<f64>() / grains;
        inertial_number * (pressure / density).sqrt() / (2.0 * self.mean_radius())
    }

    /// No distance in the cell shrinks faster, over its length, 1/s.
    pub fn largest_rate(&self) -> f64 {
        let most = self.most_rate();
        let rate = |(rate, stress): (&f64, &Option<f64>)| if stress.is_some() { most } else { *rate };
        self.cell.strain_rate.iter().zip(&self.cell.stress).map(rate).map(|rate| rate * rate).sum::<f64>().sqrt()
    }

    /// How far from its target what a servo is asked for may be, over the target.
    pub(super) fn tolerance(&self) -> f64 {
        if self.stop.equilibrium.is_some() { CLOSE } else { CLOSE_IN_FLOW }
    }

    /// Which components of a stress are not what the servo of the cell is asked for, in words.
    pub fn missed_stresses(&self, stress: Option<[Option<f64>; 6]>) -> Vec<String> {
        let most = self.tolerance() * self.cell.largest_stress();
        let missed = |k: usize| {
            let (target, found) = (self.cell.stress[k]?, stress?[k]?);
            ((found - target).abs() > most)
                .then(|| format!("cell.stress.{} = {target:e} Pa was not reached: it is {found:.4e} Pa", COMPONENTS[k]))
        };
        (0..6).filter_map(missed).collect()
    }

    /// Of the cell, m³ (m²).
    pub(super) fn cell_volume(&self) -> f64 {
        let size = self.domain.upper - self.domain.lower;
        size.to_array()[..self.dimension].iter().product()
    }

    /// Volumes of all grains, m³ (m²), overlaps counted twice.
    pub fn grain_volume(&self) -> f64 {
        match &self.clumps[..] {
            [] => self.grains.iter().map(|grain| self.volume_of(grain.radius)).sum(),
            clumps => clumps.iter().map(|clump| self.volume_of(clump.radius)).sum(),
        }
    }

    /// When the first target is met of those that follow from given rates, s; None without one.
    pub fn time_of_target(&self) -> Option<f64> {
        let Cell { strain_rate: rates, stress, .. } = self.cell;
        let of_strain = (0..6).filter(|k| stress[*k].is_none()).filter_map(|k| Some(self.stop.strain[k]? / rates[k]));
        of_strain.chain(self.time_of_fraction()).min_by(f64::total_cmp)
    }

    /// When the packing fraction is met, if that follows from given rates, s.
    fn time_of_fraction(&self) -> Option<f64> {
        let target = self.stop.packing_fraction.filter(|_| !self.is_fraction_looked_at())?;
        if self.grows() {
            return self.time_of_growth();
        }
        let fraction = self.grain_volume() / self.cell_volume();
        let time = (fraction / target).ln() / self.cell.strain_rate[..3].iter().sum::<f64>();
        (time > 0.0 && time.is_finite()).then_some(time)
    }

    /// Whether it can only be seen when the packing fraction is met: the volume is what the servo makes of it, or grains grow
    /// in a cell that changes, too.
    fn is_fraction_looked_at(&self) -> bool {
        self.cell.has_volume_of_servo() || self.grows_in_changing_cell()
    }

    /// Whether a cell has come to a pressure that was asked for: grains that shrink, in a cell that does not, come to it from
    /// above.
    pub fn has_pressure(&self, pressure: Option<f64>) -> bool {
        let shrinking = self.grows() && self.growth.iter().all(|growth| growth.rate <= 0.0);
        let sparser = shrinking && self.cell == Cell::default();
        let met = |(target, now): (f64, f64)| if sparser { now <= target } else { now >= target };
        self.stop.pressure.zip(pressure).is_some_and(met)
    }

    /// Whether a cell that began as the scene's has met a strain or a fraction of which it has to be seen when.
    pub fn has_target_of_servo(&self, strain: [f64; 6], fraction: Option<f64>) -> bool {
        let far = |k: usize, target: f64| self.cell.stress[k].is_some() && strain[k] * target.signum() >= target.abs();
        let of_strain = (0..6).any(|k| self.stop.strain[k].is_some_and(|target| far(k, target)));
        let begun = self.grain_volume() / self.cell_volume();
        let beyond = |target: f64, now: f64| if begun < target { now >= target } else { now <= target };
        let of_fraction = self.stop.packing_fraction.zip(fraction);
        of_strain || self.is_fraction_looked_at() && of_fraction.is_some_and(|(target, now)| beyond(target, now))
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
    check_jamming(assembly, check)?;
    for (k, target) in stop.strain.iter().enumerate() {
        let (key, rate) = (format!("stop.strain.{}", COMPONENTS[k]), cell.strain_rate[k]);
        if let Some(target) = *target
            && cell.stress[k].is_none()
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
        if !assembly.is_fraction_looked_at() && assembly.time_of_fraction().is_none() {
            let rate: f64 = cell.strain_rate[..3].iter().sum();
            let why = match assembly.growth_law() {
                Some(law) => {
                    let last = law.volume(f64::MAX) / assembly.cell_volume();
                    format!("and radii change until it is {} (growth)", show(last))
                }
                None => format!("and its volume grows at {} 1/s (cell.strain_rate)", show(rate)),
            };
            let rule = format!("is never met: the cell begins with {} {why}", show(fraction));
            return Err(check.origin.bad(key, show(target), rule));
        }
    }
    if stop.pressure.is_some() {
        let wrong = match () {
            () if !(0..dims).all(|axis| domain.periodic[axis]) => "is that of a cell; all axes must be periodic",
            () if assembly.solver.method != Method::DiscreteElements => "is for method = \"dem\" only",
            () if !assembly.deforms() && assembly.growth.is_empty() => {
                "nothing changes it: give [cell] rates or stresses, or [[growth]]"
            }
            () => return Ok(()),
        };
        return Err(check.origin.wrong("stop.pressure", wrong));
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

/// What the search for the jamming fraction needs.
fn check_jamming(assembly: &Assembly, check: &Check) -> Result<()> {
    let Assembly { domain, cell, gravity, stop, solver, walls, .. } = assembly;
    let Some(jamming) = stop.jamming else { return Ok(()) };
    check.within("jamming.step", jamming.step, 1e-6, 0.1, "")?;
    check.positive("jamming.tolerance", jamming.tolerance, "")?;
    check.positive("jamming.residual", jamming.residual, "")?;
    if jamming.tolerance >= jamming.step {
        let rule = format!("must be below jamming.step, {}", show(jamming.step));
        return Err(check.origin.bad("jamming.tolerance", show(jamming.tolerance), rule));
    }
    if jamming.relaxation_steps == 0 {
        return Err(check.origin.bad("jamming.relaxation_steps", 0, "must be at least 1"));
    }
    let of_cell = stop.packing_fraction.is_some() || stop.pressure.is_some() || stop.strain != [None; 6];
    let targets = stop.equilibrium.is_some() || of_cell;
    let wrong = match () {
        () if !(0..check.dimension).all(|axis| domain.periodic[axis]) => "all axes must be periodic",
        () if !walls.is_empty() => "there must be no walls, between which a cell cannot shrink alike on all sides",
        () if *gravity != DVec3::ZERO => "gravity must be 0",
        () if solver.method != Method::DiscreteElements => "is for method = \"dem\" only",
        () if *cell != Cell::default() => "the cell deforms as the protocol asks; [cell] must not be given",
        () if targets => "ends the run; of [stop] only time and steps may be given beside it",
        () if !solver.adaptive_damping && solver.damping == 0.0 => {
            "grains must come to rest; give solver.damping, best \"adaptive\""
        }
        () => return Ok(()),
    };
    Err(check.origin.wrong("jamming", wrong))
}
