// twin: src/contact/geometry.rs
// Geometry of two grains.

/// What two surfaces know of each other; n points from the grain of interest to the other.
struct Separation {
    gap: Real, // m, < 0 is overlap (erratum E1)
    n: Vec,
}

/// Gap and normal of grains i and j, with this branch vector. Coincident centres get an arbitrary axis, opposite for
/// the two grains.
fn sphere_separation(i: u32, j: u32, branch: Point, a: Real, b: Real, radii_rest: Real) -> Separation {
    let d = branch.x + branch.low;
    let distance = sqrt(dot(d, d));
    if (distance == 0) {
        return Separation(-(a + b), select(-first_axis(), first_axis(), id[i] < id[j]));
    }
    return Separation(gap_between(branch.x, branch.low, distance, a, b, radii_rest), d * (1 / distance));
}

/// Two grains from the side from which both compute their contact, so that they agree on it to the last bit.
struct OrientedPair {
    back: bool,      // whether that is the side of the other grain
    branch: Point,   // from the first of the two to the second
    radius: Real,    // m, of the first
    radius_to: Real, // m, of the second
    separation: Separation,
}

/// Grains i and j.
fn oriented_pair(i: u32, here: Body, j: u32) -> OrientedPair {
    let there = position[j];
    let low = position_low_of(j);
    let d = nearest_image(here.position.x, there.x, low.x - here.low.x);
    let back = backward(d.x);
    let branch = Point(select(d.x, -d.x, back), select(d.low, -d.low, back));
    let radius = select(here.position.radius, there.radius, back);
    let radius_to = select(there.radius, here.position.radius, back);
    let separation = sphere_separation(i, j, branch, radius, radius_to, here.low.radius + low.radius);
    return OrientedPair(back, branch, radius, radius_to, separation);
}

/// Unit vector along d; the other one where d has no length.
fn unit_or(d: Vec, other: Vec) -> Vec {
    let length_squared = dot(d, d);
    if (length_squared == 0) {
        return other;
    }
    return d * (1 / sqrt(length_squared));
}

/// Whether the surfaces are closer than this, m, judged without low parts: true where these could decide.
fn closer_than(a: Position, b: Position, gap: Real) -> bool {
    let d = nearest_image(a.x, b.x, Vec()).x;
    let reach = a.radius + b.radius + gap + params.position_slack;
    return dot(d, d) < reach * reach;
}

/// |branch + step| - |branch|, m, with the digits that this subtraction would lose.
fn lengthened(branch: Vec, step: Vec) -> Real {
    let end = branch + step;
    return (2 * dot(branch, step) + dot(step, step)) / (sqrt(dot(branch, branch)) + sqrt(dot(end, end)));
}

/// Whether surfaces overlap by more than is expected of grains, of which the smaller has this radius.
fn is_deep(gap: Real, radius: Real) -> bool {
    return -gap > params.deep_overlap * radius;
}
