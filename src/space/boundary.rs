//! Twin of `shaders/space/boundary/`. What steps do to every grain is told which boundary the model has, so that loops over
//! grains have no branch for it.

use crate::{
    model::{Boundary, Precision},
    space::{
        dimension::{last_above, next_above, row_lengths, whole_periods},
        precision::{Point, displaced, on_grid},
    },
    state::{Cell, State},
};
use glam::DVec3;

/// An upper triangular matrix, of the numbers on its diagonal and above it, times a vector.
#[inline(always)]
pub fn transformed(diagonal: DVec3, above: DVec3, v: DVec3) -> DVec3 {
    diagonal * v + (next_above(above, v) + last_above(above, v))
}

impl Cell {
    /// How many edges take a difference to the box of the lengths around 0, in which the nearest image is.
    #[inline(always)]
    fn edges_in(&self, s: &State, d: DVec3) -> DVec3 {
        whole_periods(d + 0.5 * self.length, s.params.inverse_period * self.stretch, self.tilt.0)
    }

    /// So many of its edges, m: the part that is exact, and the rest.
    #[inline(always)]
    fn edges(&self, k: DVec3) -> Point {
        Point { x: transformed(self.length, self.tilt.0, k), low: transformed(self.length_low, self.tilt_low.0, k) }
    }
}

/// From a to (the nearest image of) b + low part: the part that is exact, and the rest.
#[inline(always)]
pub fn nearest_image(s: &State, a: DVec3, b: DVec3, low: DVec3) -> Point {
    let d = b - a;
    let k = match s.model.boundary {
        Boundary::Open => None,
        Boundary::Periodic => periods(d * s.params.inverse_period + DVec3::splat(0.5)),
        Boundary::Deforming => return nearest_image_in_cell(s, d, low),
    };
    k.map_or(Point { x: d, low }, |k| Point { x: d - s.params.period * k, low: low - s.params.period_low * k })
}

/// Apart, so that searches elsewhere are spared it.
#[inline(never)]
fn nearest_image_in_cell(s: &State, d: DVec3, low: DVec3) -> Point {
    let cell = &s.cell[0];
    let edges = cell.edges(cell.edges_in(s, d));
    Point { x: d - edges.x, low: low - edges.low }
}

/// The same of a difference in double precision.
#[inline(always)]
pub fn nearest_image_of(s: &State, boundary: Boundary, d: DVec3) -> DVec3 {
    match boundary {
        Boundary::Open => d,
        Boundary::Periodic => d - s.params.period * (d * s.params.inverse_period + DVec3::splat(0.5)).floor(),
        Boundary::Deforming => d - s.cell[0].edges(s.cell[0].edges_in(s, d)).x,
    }
}

/// The image of a point that lies in the domain, split anew; of a cell that deforms, in the box of its lengths, where it
/// is at the end of the step.
#[inline(always)]
pub fn wrap(s: &State, boundary: Boundary, p: Point) -> Point {
    let k = match boundary {
        Boundary::Open => None,
        Boundary::Periodic => periods((p.x - s.params.cell_origin) * s.params.inverse_period),
        Boundary::Deforming => {
            let next = &s.cell_next[0];
            let k = whole_periods(p.x - s.params.cell_origin, s.params.inverse_period * next.stretch, next.tilt.0);
            let period = next.edges(k);
            return displaced(s, p.x - period.x, p.low, -period.low);
        }
    };
    k.map_or(p, |k| displaced(s, p.x - s.params.period * k, p.low, -s.params.period_low * k))
}

/// A velocity past the flow at some place, as one past the flow at another one that is further by d.
#[inline(always)]
pub fn past_flow(s: &State, boundary: Boundary, v: DVec3, d: DVec3) -> DVec3 {
    match boundary {
        Boundary::Deforming => v - transformed(s.cell[0].rate, s.cell[0].shear_rate.0, d),
        _ => v,
    }
}

/// The same of the flow of the step that bodies are doing, which contacts do not see before the next one.
#[inline(always)]
pub fn past_next_flow(s: &State, boundary: Boundary, v: DVec3, d: DVec3) -> DVec3 {
    match boundary {
        Boundary::Deforming => v - transformed(s.cell_next[0].rate, s.cell_next[0].shear_rate.0, d),
        _ => v,
    }
}

/// The velocity in space in a step from x with this one past the flow, which is that of the middle of the way.
#[inline(always)]
pub fn carried(s: &State, boundary: Boundary, x: DVec3, v: DVec3) -> DVec3 {
    past_next_flow(s, boundary, v, s.params.cell_origin - x - 0.5 * s.params.dt * v)
}

/// What a grain of this size that goes so far, m, takes of the margin of the lists: the flow brings it closer to those
/// within their reach, too.
#[inline(always)]
pub fn approach(s: &State, boundary: Boundary, stride: f64, radius: f64) -> f64 {
    match boundary {
        Boundary::Deforming => stride + s.params.dt * s.cell[0].largest_rate * (radius + 0.5 * s.params.margin),
        _ => stride,
    }
}

/// Where a point is in the cell of the grid; in single precision with the rounding of a device.
#[inline(always)]
pub fn reduced(s: &State, x: DVec3) -> DVec3 {
    let d = match s.model.precision {
        Precision::Single => (x.as_vec3() - s.params.cell_origin.as_vec3()).as_dvec3(),
        Precision::Double => x - s.params.cell_origin,
    };
    match s.model.boundary {
        Boundary::Deforming => reduced_in_cell(s, d),
        _ => d,
    }
}

/// Apart, so that searches elsewhere are spared it.
#[inline(never)]
fn reduced_in_cell(s: &State, d: DVec3) -> DVec3 {
    let Cell { stretch, stretch_tilt, .. } = &s.cell[0];
    let beside = on_grid(s, next_above(stretch_tilt.0, d)) + on_grid(s, last_above(stretch_tilt.0, d));
    on_grid(s, *stretch * d) + beside
}

/// How far points there can be from it that are no further than this from x, m.
#[inline(always)]
pub fn reduced_reach(s: &State, reach: f64) -> DVec3 {
    match s.model.boundary {
        Boundary::Deforming => reach * row_lengths(s.cell[0].stretch, s.cell[0].stretch_tilt.0),
        _ => DVec3::splat(reach),
    }
}

/// Work of the flow on what has this virial, per time, W.
pub fn flow_power(s: &State, virial: DVec3, virial_above: DVec3) -> f64 {
    match s.model.boundary {
        Boundary::Deforming => s.cell[0].rate.dot(virial) + s.cell[0].shear_rate.0.dot(virial_above),
        _ => 0.0,
    }
}

/// The whole periods in `k`, if there are any: mostly there are none, and to see that takes one branch, as the numbers
/// from 0 to 1 are those with bits below those of 1.
#[inline(always)]
fn periods(k: DVec3) -> Option<DVec3> {
    let within = |k: f64| k.to_bits() < 1.0_f64.to_bits();
    if within(k.x) & within(k.y) & within(k.z) { None } else { Some(k.floor()) }
}
