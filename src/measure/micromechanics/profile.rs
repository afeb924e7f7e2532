//! Coarse graining: what is inside a box, or inside the slabs of a stack. Grains count with the part of their volume that
//! is inside, contacts with the part of their branch vector (Lätzel, Luding & Herrmann 2000, with a box for the weight).

use super::{
    cell::Cell,
    packing::{Packing, outer},
    stress::{Stress, mean_velocity},
};
use crate::{
    measure::{
        analysis::masses,
        clip::{ball, ball_in_box},
        packing::lens,
    },
    scene::Domain,
};
use glam::{DMat3, DVec3};
use serde::Serialize;
use std::ops::Range;

/// What a part of space holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Part {
    /// Corners, m; None where it ends with the cell.
    pub lower: [Option<f64>; 3],
    pub upper: [Option<f64>; 3],
    /// m³ (m² in two dimensions)
    pub volume: f64,
    pub solid_fraction: f64,
    /// What overlaps that a face cuts may change of it.
    pub solid_fraction_error: f64,
    /// By mass, of the free grains, m/s; None where there are none.
    pub velocity: Option<DVec3>,
    pub stress: Stress,
}

/// Sums over a part of space.
#[derive(Clone, Copy)]
struct Sums {
    solid: f64,
    cut: f64,
    mass: f64,
    momentum: DVec3,
    kinetic: DMat3,
    contact: DMat3,
}

impl Sums {
    const NONE: Sums =
        Sums { solid: 0.0, cut: 0.0, mass: 0.0, momentum: DVec3::ZERO, kinetic: DMat3::ZERO, contact: DMat3::ZERO };
}

/// A box of space; sides may be infinitely far away.
#[derive(Clone, Copy)]
struct Bounds {
    lower: DVec3,
    upper: DVec3,
}

impl Bounds {
    fn contains(&self, x: DVec3, dims: usize) -> bool {
        (0..dims).all(|axis| self.lower[axis] <= x[axis] && x[axis] < self.upper[axis])
    }

    /// How much of a line from a to a + l is inside, as a part of it.
    fn share(&self, a: DVec3, l: DVec3, dims: usize) -> f64 {
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for axis in 0..dims {
            let (low, high) = (self.lower[axis] - a[axis], self.upper[axis] - a[axis]);
            if l[axis] == 0.0 {
                if low > 0.0 || high <= 0.0 {
                    return 0.0;
                }
                continue;
            }
            let (first, second) = (low / l[axis], high / l[axis]);
            (from, to) = (from.max(first.min(second)), to.min(first.max(second)));
        }
        (to - from).max(0.0)
    }
}

/// Shifts by edges of the cell that bring a box around something to where it meets `bounds`. Along an axis without bounds
/// one image is enough.
fn images(domain: &Domain, dims: usize, low: DVec3, high: DVec3, bounds: &Bounds) -> Vec<DVec3> {
    let mut shifts = vec![DVec3::ZERO];
    // Edges along an axis lead along those before it, too.
    for axis in (0..dims).rev() {
        let ends = |s: DVec3| [bounds.lower[axis] - high[axis] - s[axis], bounds.upper[axis] - low[axis] - s[axis]];
        if !(domain.periodic[axis] && bounds.lower[axis].is_finite()) {
            shifts.retain(|s| ends(*s)[0] <= 0.0 && ends(*s)[1] >= 0.0);
            continue;
        }
        let edge = domain.edge(axis);
        let shifted = |s: DVec3| {
            let [first, last] = ends(s).map(|end| end / edge[axis]);
            (first.ceil() as i64..=last.floor() as i64).map(move |n| s + n as f64 * edge)
        };
        shifts = shifts.into_iter().flat_map(shifted).collect();
    }
    shifts
}

/// A box by its corners, m. It is no longer than the period along periodic axes.
pub fn of_box(packing: &Packing, lower: DVec3, upper: DVec3) -> Part {
    let bounds = Bounds { lower, upper };
    let volume = (0..packing.dims()).map(|axis| upper[axis] - lower[axis]).product();
    let sums = sums(packing, &bounds, &[bounds], |_, _| 0..1);
    part(packing, &bounds, volume, &sums[0])
}

/// The cell in slabs of equal width, which is nearest to the one given, m, from its lower face to its upper one.
pub fn profile(packing: &Packing, cell: &Cell, axis: usize, width: f64) -> Vec<Part> {
    let (low, high) = (cell.lower[axis], cell.upper[axis]);
    let count = ((high - low) / width).round().max(1.0) as usize;
    let edge = |k: usize| low + (high - low) * (k as f64 / count as f64);
    let slab = |of: &Bounds, k: usize| Bounds {
        lower: of.lower.with_axis(axis, edge(k)),
        upper: of.upper.with_axis(axis, edge(k + 1)),
    };
    let everything = Bounds { lower: DVec3::NEG_INFINITY, upper: DVec3::INFINITY };
    // Where the cell is tilted, what is beyond a face is not beside what is there. A period is the box of its lengths, as
    // good as the tilted one.
    let domain = &packing.assembly.domain;
    let mut period = everything;
    for axis in (0..packing.dims()).filter(|axis| domain.periodic[*axis] && domain.tilt != DVec3::ZERO) {
        (period.lower[axis], period.upper[axis]) = (cell.lower[axis], cell.upper[axis]);
    }
    let slabs: Vec<Bounds> = (0..count).map(|k| slab(&period, k)).collect();
    let find = |from: DVec3, to: DVec3| {
        let place = |x: f64| ((x - low) / (high - low) * count as f64).clamp(-2.0, count as f64 + 2.0) as i64;
        let bound = |k: i64| k.clamp(0, count as i64) as usize;
        bound(place(from[axis]) - 1)..bound(place(to[axis]) + 2)
    };
    let all = Bounds { lower: period.lower.with_axis(axis, low), upper: period.upper.with_axis(axis, high) };
    let sums = sums(packing, &all, &slabs, find);
    let volume = |k: usize| cell.slab(axis, edge(k), edge(k + 1));
    (0..count).map(|k| part(packing, &slab(&everything, k), volume(k), &sums[k])).collect()
}

/// A vector with one component replaced.
trait WithAxis {
    fn with_axis(self, axis: usize, value: f64) -> Self;
}

impl WithAxis for DVec3 {
    fn with_axis(mut self, axis: usize, value: f64) -> DVec3 {
        self[axis] = value;
        self
    }
}

/// Over boxes, all within one; `find` says which of them a box from one corner to another may meet.
fn sums(packing: &Packing, all: &Bounds, boxes: &[Bounds], find: impl Fn(DVec3, DVec3) -> Range<usize>) -> Vec<Sums> {
    let (dims, domain) = (packing.dims(), &packing.assembly.domain);
    let mut sums = vec![Sums::NONE; boxes.len()];
    let mut visit = |low: DVec3, high: DVec3, add: &mut dyn FnMut(&Bounds, DVec3, &mut Sums)| {
        for shift in images(domain, dims, low, high, all) {
            find(low + shift, high + shift).for_each(|k| add(&boxes[k], shift, &mut sums[k]));
        }
    };
    let mean = mean_velocity(packing);
    for (grain, mass) in packing.grains.iter().zip(masses(packing.assembly)) {
        let (x, radius) = (grain.position, grain.radius);
        let density = packing.assembly.materials[grain.material as usize].density;
        let whole = ball(dims) * radius.powi(dims as i32);
        visit(x - radius, x + radius, &mut |bounds, shift, sums| {
            let inside = ball_in_box(dims, x + shift, radius, bounds.lower, bounds.upper) / whole;
            sums.solid += mass / density * inside;
            if !grain.fixed {
                let (mass, v) = (mass * inside, grain.velocity - mean);
                sums.mass += mass;
                sums.momentum += mass * v;
                sums.kinetic += outer(mass * v, v);
            }
        });
    }
    for contact in packing.contacts {
        let [first, second] = packing.actions(contact);
        // From centre to centre, or from a centre to what does not move.
        let (start, branch, force) = match (first, second) {
            (Some(a), Some(b)) => (packing.center(a.particle), a.arm - b.arm, a.force),
            (Some(a), None) | (None, Some(a)) => (packing.center(a.particle), a.arm, a.force),
            (None, None) => continue,
        };
        let end = start + branch;
        visit(start.min(end), start.max(end), &mut |bounds, shift, sums| {
            sums.contact -= outer(force, branch) * bounds.share(start + shift, branch, dims);
        });
        if let super::Other::Grain(other) = contact.other
            && contact.overlap > 0.0
        {
            let [a, b] = [contact.grain, other].map(|grain| packing.grains[grain as usize].radius);
            let (x, shared) = (packing.point(contact), lens(dims, a, b, contact.overlap));
            // A disk of this radius, so thin that it is inside where its middle is.
            let reach = (2.0 * a.min(b) * contact.overlap).sqrt();
            visit(x - reach, x + reach, &mut |bounds, shift, sums| {
                let within = |reach: f64| Bounds { lower: bounds.lower + reach, upper: bounds.upper - reach };
                sums.solid -= if bounds.contains(x + shift, dims) { shared } else { 0.0 };
                sums.cut += if within(reach).contains(x + shift, dims) { 0.0 } else { shared };
            });
        }
    }
    sums
}

fn part(packing: &Packing, bounds: &Bounds, volume: f64, sums: &Sums) -> Part {
    let dims = packing.dims();
    let mean = if sums.mass > 0.0 { sums.momentum / sums.mass } else { DVec3::ZERO };
    let kinetic = sums.kinetic - outer(sums.mass * mean, mean);
    let corner = |x: DVec3| [0, 1, 2].map(|axis| Some(x[axis]).filter(|x| axis < dims && x.is_finite()));
    Part {
        lower: corner(bounds.lower),
        upper: corner(bounds.upper),
        volume,
        solid_fraction: sums.solid / volume,
        solid_fraction_error: sums.cut / volume,
        velocity: (sums.mass > 0.0).then(|| mean_velocity(packing) + mean),
        stress: Stress::new(dims, volume, sums.contact, kinetic),
    }
}
