//! Where grains leave.

use glam::DVec3;

use super::check::{Check, show, show_list};
use super::schema;
use super::{Domain, Outlet, Place, Region, Surface};
use crate::Result;

/// Steps from one look to the next.
const STEPS: u64 = 1000;

impl Outlet {
    /// Whether a grain at this place is gone.
    pub fn takes(&self, x: DVec3, domain: &Domain) -> bool {
        match self.place {
            Place::Inside(Region { lower, upper, around }) => {
                let within = (0..3).all(|axis| (lower[axis]..=upper[axis]).contains(&x[axis]));
                within && around.is_none_or(|around| around.distance(x) >= 0.0)
            }
            Place::Behind { point, normal } => (x - point).dot(normal) < 0.0,
            Place::OutsideDomain => {
                let beyond = |axis: usize| !(domain.lower[axis]..=domain.upper[axis]).contains(&x[axis]);
                (0..3).any(|axis| domain.outlet[axis] && beyond(axis))
            }
        }
    }

    /// Steps from one look to the next.
    pub fn interval(&self, dt: f64) -> u64 {
        self.interval.map_or(STEPS, |seconds| ((seconds / dt * (1.0 + 1e-9)) as u64).max(1))
    }
}

/// All outlets of a scene.
pub(super) fn outlets(given: &[schema::Outlet], domain: &Domain, check: &Check) -> Result<Vec<Outlet>> {
    let mut outlets: Vec<Outlet> = Vec::new();
    for (number, given) in given.iter().enumerate() {
        let key = format!("outlet.{number}");
        let outlet = outlet(given, &key, number, check)?;
        if outlets.iter().any(|other| other.name == outlet.name) {
            return Err(check.origin.bad(
                &format!("{key}.name"),
                format!("\"{}\"", outlet.name),
                "two outlets have it",
            ));
        }
        outlets.push(outlet);
    }
    if domain.outlet.contains(&true) {
        let name = "domain".to_owned();
        if outlets.iter().any(|other| other.name == name) {
            let message = "no outlet may be called domain where domain.boundary has an outlet, which is called so";
            return Err(check.origin.wrong("outlet", message));
        }
        let place = Place::OutsideDomain;
        outlets.push(Outlet { name, place, start: 0.0, stop: f64::INFINITY, interval: None });
    }
    Ok(outlets)
}

fn outlet(given: &schema::Outlet, key: &str, number: usize, check: &Check) -> Result<Outlet> {
    let at = |field: &str| format!("{key}.{field}");
    let place = match (&given.region, &given.point, &given.normal) {
        (Some(given), None, None) => Place::Inside(region(given, &at("region"), check)?),
        (None, Some(point), Some(normal)) => {
            let Some(direction) = check.vector(&at("normal"), normal)?.try_normalize() else {
                let rule = "must not be zero; it points to the side where grains stay";
                return Err(check.origin.bad(&at("normal"), show_list(normal), rule));
            };
            Place::Behind { point: check.vector(&at("point"), point)?, normal: direction }
        }
        _ => {
            let message = "takes a `region`, or the `point` and the `normal` of a plane";
            return Err(check.origin.wrong(key, message));
        }
    };
    let start = check.not_negative(&at("start"), given.start.unwrap_or(0.0), " of s")?;
    let stop = given.stop.unwrap_or(f64::INFINITY);
    if stop <= start {
        let rule = format!("must be after start = {} s", show(start));
        return Err(check.origin.bad(&at("stop"), show(stop), rule));
    }
    let interval = given.interval.map(|interval| check.positive(&at("interval"), interval, " of s")).transpose()?;
    let name = given.name.clone().unwrap_or_else(|| format!("outlet {number}"));
    Ok(Outlet { name, place, start, stop, interval })
}

/// What a region says by itself.
pub(super) fn region(given: &schema::Region, key: &str, check: &Check) -> Result<Region> {
    let (lower, upper) = check.corners(key, &given.lower, &given.upper)?;
    let around = match (given.center.as_deref(), given.radius) {
        (None, None) => None,
        (Some(&[x, y]), Some(radius)) => {
            let radius = check.positive(&format!("{key}.radius"), radius, " of m")?;
            Some(Surface::Cylinder { center: DVec3::new(x, y, 0.0), radius })
        }
        (Some(center), Some(_)) => {
            let rule = "must have 2 numbers, x and y of the axis";
            return Err(check.origin.bad(&format!("{key}.center"), show_list(center), rule));
        }
        _ => return Err(check.origin.wrong(key, "takes `center` and `radius` together")),
    };
    Ok(Region { lower, upper, around })
}
