//! Twin of `shaders/solve/natural_map.wgsl`: the laws of Signorini and Coulomb at one contact, as pure functions: its
//! natural map, its disc update, and the scales of both. Scenes and problems from files share them.
//!
//! Impulse and velocity are those of the first of the two sides, relative to the second; a normal impulse points
//! against n, and a positive velocity along n is an approach. A problem `u = W r + q`, whose u_n > 0 opens, is
//! of this form with n = −(1, 0, 0).

use glam::{DMat3, DVec3, Vec3Swizzles};

/// A contact as its first side sees it, the grain with the smaller index.
#[derive(Clone, Copy, Debug)]
pub struct OrientedContact {
    /// 1: the grain of interest is that side; -1: the other.
    pub sign: f64,
    /// 1/2 of a contact that two grains add to a sum.
    pub share: f64,
    /// Away from that side.
    pub n: DVec3,
    /// 1/kg, see [`UpdateScales`].
    pub normal: f64,
    pub tangential: f64,
    pub friction: f64,
    /// m/s, of that side past the other in the contact point, beyond what they may approach.
    pub velocity: DVec3,
}

/// What the disc update divides velocities by, 1/kg.
#[derive(Clone, Copy, Debug, Default)]
pub struct UpdateScales {
    pub normal: f64,
    pub tangential: f64,
}

/// Scales for a contact with the block `W_kk` and normal n: W_nn and λmax(W_tt), and more where W joins the two. So
/// much more that the scales are nowhere less than W, and that friction at its limit, which answers to the normal
/// impulse, makes it overshoot by half at most.
pub fn update_scales(w: &DMat3, n: DVec3, friction: f64) -> UpdateScales {
    let across = DMat3::IDENTITY - DMat3::from_cols(n * n.x, n * n.y, n * n.z);
    let (normal, tangential) = (n.dot(*w * n), largest_eigenvalue(&(across * *w * across)));
    let turned_aside = ((*w * n) / normal - n).length();
    let joined = turned_aside * (normal / tangential).sqrt();
    let more = (1.0 + joined).max((1.0 + friction * turned_aside) / 1.5);
    UpdateScales { normal: more * normal, tangential: (1.0 + joined) * tangential }
}

/// Vector shortened to a length.
fn project_on_disc(v: DVec3, length: f64) -> DVec3 {
    let squared = v.length_squared();
    if squared > length * length { v * (length / squared.sqrt()) } else { v }
}

/// Impulse on the first side after a projected gradient step from `impulse`: the normal impulse, then the friction
/// within the disc that it allows. `step` is a fraction of the contact's own scales. Its fixed points are contacts that
/// are open, stick or slip as Algorithm 1 has them; with `step` = 1 it is that algorithm for spheres.
pub fn disc_update(side: &OrientedContact, impulse: DVec3, step: f64) -> DVec3 {
    let normal_impulse = -impulse.dot(side.n);
    let approach = side.velocity.dot(side.n);
    let friction = impulse + normal_impulse * side.n;
    let slip = side.velocity - approach * side.n;
    let normal_impulse_next = (normal_impulse + step / side.normal * approach).max(0.0);
    let weight = side.tangential;
    let friction_next =
        project_on_disc(weight * friction - step * slip, side.friction * (weight * normal_impulse_next));
    (1.0 / weight) * friction_next - normal_impulse_next * side.n
}

/// The natural map of a contact, m/s: `(r − P_K(r − ρ (u + μ‖u_T‖ n))) / ρ` with `ρ = 1/weight`, De Saxcé's form of
/// Coulomb's law: zero when and only when the laws hold. The weight is λmax(W_kk).
pub fn natural_map(side: &OrientedContact, impulse: DVec3, weight: f64) -> DVec3 {
    let normal_impulse = -impulse.dot(side.n);
    let approach = side.velocity.dot(side.n);
    let friction = impulse + normal_impulse * side.n;
    let slip = side.velocity - approach * side.n;
    let mu = side.friction;
    let normal = weight * normal_impulse + approach - mu * slip.length();
    let across = weight * friction - slip;
    let length = across.length();
    if normal > 0.0 && length <= mu * normal {
        // What is left of the differences below, without the rounding of impulses beside which velocities are small.
        return slip + (approach - mu * slip.length()) * side.n;
    }
    let (mut projected_friction, mut projected_normal) = (DVec3::ZERO, 0.0);
    if mu * length > -normal {
        projected_normal = (normal + mu * length) / (1.0 + mu * mu);
        projected_friction = across * (mu * projected_normal / length);
    }
    (weight * friction - projected_friction) - (weight * normal_impulse - projected_normal) * side.n
}

/// The product of two impulses in the scales of the disc update, J.
pub fn scaled_product(side: &OrientedContact, a: DVec3, b: DVec3) -> f64 {
    let (a_normal, b_normal) = (a.dot(side.n), b.dot(side.n));
    let a_across = side.tangential * (a - a_normal * side.n);
    side.normal * a_normal * b_normal + a_across.dot(b - b_normal * side.n)
}

/// Largest eigenvalue of a positive semidefinite symmetric 3×3 matrix, by Jacobi's rotations; as in
/// `shaders/space/dimension/space.wgsl`.
pub fn largest_eigenvalue(m: &DMat3) -> f64 {
    let mut diagonal = DVec3::new(m.x_axis.x, m.y_axis.y, m.z_axis.z);
    let size = diagonal.element_sum();
    if !(size > 0.0) {
        return 0.0;
    }
    diagonal /= size;
    let mut off = DVec3::new(m.y_axis.z, m.z_axis.x, m.x_axis.y) / size;
    for _ in 0..15 {
        let square = off.z * off.z;
        if square > 0.0 {
            let half = 0.5 * (diagonal.y - diagonal.x);
            let t = if half >= 0.0 { off.z } else { -off.z } / (half.abs() + (half * half + square).sqrt());
            diagonal += t * off.z * DVec3::new(-1.0, 1.0, 0.0);
            off = DVec3::new(off.x + t * off.y, off.y - t * off.x, 0.0) / (1.0 + t * t).sqrt();
        }
        // The next two axes.
        (diagonal, off) = (diagonal.yzx(), off.yzx());
    }
    size * diagonal.max_element()
}
