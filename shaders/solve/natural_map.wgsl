// twin: src/solve/natural_map.rs
// The laws of Signorini and Coulomb at one contact, as pure functions: its natural map, its disc update, and the scales
// of both. Scenes and problems from files share them. Impulse and velocity are those of the first of the two sides,
// relative to the second; a normal impulse points against n, and a positive velocity along n is an approach. A problem
// u = W r + q, whose u_n > 0 opens, is of this form with n = -(1, 0, 0).

/// A contact as its first side sees it, the grain with the smaller index: both grains compute it from there, so that
/// they get the same bits, and turn what comes of it to their own side.
struct OrientedContact {
    sign: Real,          // 1: the grain of interest is that side; -1: the other
    share: Real,         // 1/2 of a contact that two grains add to a sum
    n: Vec,              // away from that side
    normal: Real,        // 1/kg, see `UpdateScales`
    tangential: Real,    // 1/kg
    friction: Real,
    velocity: Vec,       // m/s, of that side past the other in the contact point, beyond what they may approach
}

/// What the disc update divides velocities by, 1/kg.
struct UpdateScales {
    normal: Real,
    tangential: Real,
}

/// Scales for a contact with the block W_kk and normal n: W_nn and λmax(W_tt), and more where W joins the two. So much
/// more that the scales are nowhere less than W, and that friction at its limit, which answers to the normal impulse,
/// makes it overshoot by half at most.
fn update_scales(w: Columns, n: Vec, friction: Real) -> UpdateScales {
    var scales = UpdateScales();
    let across = times(w, n);
    scales.normal = dot(n, across);
    let along = across * (1 / scales.normal) - n; // how a normal impulse moves the point across
    let tangents = plus(plus(plus(w, -1, outer(n, across)), -1, outer(across, n)), scales.normal, outer(n, n));
    scales.tangential = largest_eigenvalue(tangents);
    let turned_aside = sqrt(dot(along, along));
    let joined = turned_aside * sqrt(scales.normal / scales.tangential);
    scales.normal *= max(1 + joined, (1 + friction * turned_aside) / 1.5);
    scales.tangential *= 1 + joined;
    return scales;
}

/// Vector shortened to a length.
fn project_on_disc(v: Vec, length: Real) -> Vec {
    let squared = dot(v, v);
    if (squared > length * length) {
        return v * (length / sqrt(squared));
    }
    return v;
}

/// Impulse on the first side after a projected gradient step from `impulse`: the normal impulse, then the friction
/// within the disc that it allows. `step` is a fraction of the contact's own scales. Its fixed points are contacts that
/// are open, stick or slip as Algorithm 1 has them; with step = 1 it is that algorithm for spheres.
fn disc_update(side: OrientedContact, impulse: Vec, step: Real) -> Vec {
    let normal_impulse = -dot(impulse, side.n);
    let approach = dot(side.velocity, side.n);
    let friction = impulse + normal_impulse * side.n;
    let slip = side.velocity - approach * side.n;
    let normal_impulse_next = max(normal_impulse + step / side.normal * approach, Real(0));
    // In m/s, because squares of a small grain's impulses are beyond single precision.
    let weight = side.tangential;
    let limit = side.friction * (weight * normal_impulse_next);
    let friction_next = project_on_disc(weight * friction - step * slip, limit);
    return (1 / weight) * friction_next - normal_impulse_next * side.n;
}

/// The natural map of a contact, m/s: (r - P_K(r - rho (u + mu |u_T| n))) / rho with rho = 1/weight, De Saxcé's form of
/// Coulomb's law: zero when and only when the laws hold. The weight is λmax(W_kk).
fn natural_map(side: OrientedContact, impulse: Vec, weight: Real) -> Vec {
    let normal_impulse = -dot(impulse, side.n);
    let approach = dot(side.velocity, side.n);
    let friction = impulse + normal_impulse * side.n;
    let slip = side.velocity - approach * side.n;
    let mu = side.friction;
    let normal = weight * normal_impulse + approach - mu * sqrt(dot(slip, slip));
    let across = weight * friction - slip;
    let length = sqrt(dot(across, across));
    if (normal > 0 && length <= mu * normal) {
        // What is left of the differences below, without the rounding of impulses beside which velocities are small.
        return slip + (approach - mu * sqrt(dot(slip, slip))) * side.n;
    }
    var projected_friction = Vec();
    var projected_normal = Real(0);
    if (mu * length > -normal) {
        projected_normal = (normal + mu * length) / (1 + mu * mu);
        projected_friction = across * (mu * projected_normal / length);
    }
    return (weight * friction - projected_friction) - (weight * normal_impulse - projected_normal) * side.n;
}

/// The product of two impulses in the scales of the disc update, J.
fn scaled_product(side: OrientedContact, a: Vec, b: Vec) -> Real {
    let a_normal = dot(a, side.n);
    let b_normal = dot(b, side.n);
    let a_across = side.tangential * (a - a_normal * side.n);
    return side.normal * a_normal * b_normal + dot(a_across, b - b_normal * side.n);
}
