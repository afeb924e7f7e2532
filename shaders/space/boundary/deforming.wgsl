// twin: src/space/boundary.rs
// Boundary slot: periodic faces that move, so that the cell between them changes its lengths and shears (Lees & Edwards
// 1972). The edges of the cell are the columns of an upper triangular matrix: lengths, and tilts above them. What is in
// the cell is carried along with it, by a flow whose gradient is the same everywhere; the velocities of all bodies are
// those past that flow. So a body and its images have the same velocity, and where a body is in the cell, or where the
// lower corner is, no contact can tell. Owns the cell.

struct Cell {
    length: Vec,           // m, of the edges along their own axes; 0 along an open axis
    length_low: Vec,       // m, what it has beyond a multiple of the quantum
    tilt: Spin,            // m: of the third edge along y and along x, of the second along x; at most half a length
    tilt_low: Spin,        // m
    turned_back: Spin,     // whole lengths that have been taken off the tilts, as the same of a matrix of such edges
    stretch: Vec,          // from places in the cell to those in the cell with the lengths params.period, without tilts
    stretch_tilt: Spin,    // (the inverse of its deformation), with what is above the diagonal
    rate: Vec,             // 1/s, gradient of the flow that has brought the cell here: dv_x/dx, dv_y/dy, dv_z/dz
    shear_rate: Spin,      // 1/s: dv_y/dz, dv_x/dz, dv_x/dy
    rate_next: Vec,        // 1/s: the same of the next step
    shear_rate_next: Spin,
    steady_rate: Vec,      // 1/s: what the servo has come to in the long run
    steady_shear_rate: Spin,
    settled: Real,         // from 0, as the servo sees it for the first time, to 1: how long stresses have been close to targets
    largest_rate: Real,    // 1/s, no distance shrinks faster in the next step, over its length
    stress: Vec,           // Pa (N/m), of contacts, when a servo last looked: xx, yy, zz; compression is positive
    stress_above: Spin,    // Pa (N/m): yz, xz, xy
}

var<storage, read_write> cell: Cell;
var<storage, read_write> cell_next: Cell;

/// An upper triangular matrix, of the numbers on its diagonal and above it, times a vector.
fn transformed(diagonal: Vec, above: Spin, v: Vec) -> Vec {
    return diagonal * v + (next_above(above, v) + last_above(above, v));
}

/// From a to the image of b + low part in the box of the cell's lengths around a, which is the nearest one if that is
/// within half of these: the part that is exact, and the rest.
fn nearest_image(a: Vec, b: Vec, low: Vec) -> Point {
    let d = b - a;
    let k = whole_periods(d + 0.5 * cell.length, params.inverse_period * cell.stretch, cell.tilt);
    return Point(d - transformed(cell.length, cell.tilt, k), low - transformed(cell.length_low, cell.tilt_low, k));
}

/// The image of a point that lies in the box of the cell's lengths, where the cell is at the end of the step.
fn wrap(p: Point) -> Point {
    let k = whole_periods(p.x - params.cell_origin, params.inverse_period * cell_next.stretch, cell_next.tilt);
    let period = transformed(cell_next.length, cell_next.tilt, k);
    return displaced(p.x - period, p.low, -transformed(cell_next.length_low, cell_next.tilt_low, k));
}

/// A velocity past the flow at some place, as one past the flow at another one that is further by d.
fn past_flow(v: Vec, d: Vec) -> Vec {
    return v - transformed(cell.rate, cell.shear_rate, d);
}

/// The same of the flow of the step that bodies are doing, which contacts do not see before the next one.
fn past_next_flow(v: Vec, d: Vec) -> Vec {
    return v - transformed(cell_next.rate, cell_next.shear_rate, d);
}

/// The velocity in space in a step from x with this one past the flow, which is that of the middle of the way.
fn carried(x: Vec, v: Vec) -> Vec {
    return past_next_flow(v, params.cell_origin - x - 0.5 * params.dt * v);
}

/// What a grain of this size that goes so far, m, takes of the margin of the lists: the flow brings it closer to those
/// within their reach, too.
fn approach(stride: Real, radius: Real) -> Real {
    return stride + params.dt * cell.largest_rate * (radius + 0.5 * params.margin);
}

/// Where a point is in the cell of the grid: in single precision sums of multiples of the quantum, which no driver can
/// round another way.
fn reduced(x: Vec) -> Vec {
    let d = x - params.cell_origin;
    let beside = on_grid(next_above(cell.stretch_tilt, d)) + on_grid(last_above(cell.stretch_tilt, d));
    return on_grid(cell.stretch * d) + beside;
}

/// How far points there can be from it that are no further than this from x, m.
fn reduced_reach(reach: Real) -> Vec {
    return reach * row_lengths(cell.stretch, cell.stretch_tilt);
}

/// Work of the flow on what has this virial, per time, W.
fn flow_power(virial: Vec, virial_above: Spin) -> Real {
    return dot(cell.rate, virial) + spin_dot(cell.shear_rate, virial_above);
}
