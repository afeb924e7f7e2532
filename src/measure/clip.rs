//! What a box has of a sphere or a disk, in closed form.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Volume of the part of a sphere that is inside a box, m³ (in two dimensions area of a disk inside a rectangle, m²). Sides
/// of the box may be infinitely far away.
pub fn ball_in_box(dims: usize, center: DVec3, radius: f64, lower: DVec3, upper: DVec3) -> f64 {
    let (low, high) = ((lower - center) / radius, (upper - center) / radius);
    let axes = 0..dims;
    if axes.clone().any(|k| low[k] >= 1.0 || high[k] <= -1.0) {
        return 0.0;
    }
    if axes.clone().all(|k| low[k] <= -1.0 && high[k] >= 1.0) {
        return ball(dims) * radius.powi(dims as i32);
    }
    // A box is what is beyond its lower corner, less what is beyond an upper side, and so on.
    let mut sum = 0.0;
    for corner in 0..1_u32 << dims {
        let at = |k: usize| if corner >> k & 1 == 1 { high[k] } else { low[k] };
        let beyond = beyond(dims, [0, 1, 2].map(|k| if k < dims { at(k).clamp(-1.0, 1.0) } else { 0.0 }));
        sum += if corner.count_ones() % 2 == 0 { beyond } else { -beyond };
    }
    sum.max(0.0) * radius.powi(dims as i32)
}

/// Volume of the unit ball (area of the unit disk).
pub fn ball(dims: usize) -> f64 {
    if dims == 2 { PI } else { 4.0 / 3.0 * PI }
}

/// The part of the unit ball where every coordinate is larger than that of a corner.
fn beyond(dims: usize, mut corner: [f64; 3]) -> f64 {
    if let Some(axis) = (0..dims).find(|k| corner[*k] < 0.0) {
        // All of it along this axis, less its mirror image.
        let mirrored = -corner[axis];
        corner[axis] = 0.0;
        let half = beyond(dims, corner);
        corner[axis] = mirrored;
        return 2.0 * half - beyond(dims, corner);
    }
    let [a, b, c] = corner;
    if a * a + b * b + c * c >= 1.0 {
        return 0.0;
    }
    if dims == 2 { Section::new(1.0, a, b).area } else { octant(a, b, c) }
}

/// Beyond a corner inside the ball, none of whose coordinates is negative: a cone from the centre over the spherical
/// surface, whose area is that of Gauss and Bonnet, less those over the three plane faces.
fn octant(a: f64, b: f64, c: f64) -> f64 {
    let turn = |x: f64, y: f64| (1.0 - x * x - y * y).max(0.0).sqrt().atan2(-x * y);
    let section = |x: f64, y: f64, z: f64| Section::new((1.0 - x * x).max(0.0).sqrt(), y, z);
    let [on_a, on_b, on_c] = [section(a, b, c), section(b, c, a), section(c, a, b)];
    let curved = a * on_a.angle + b * on_b.angle + c * on_c.angle;
    let surface = TAU - curved - turn(a, b) - turn(b, c) - turn(c, a);
    (surface - a * on_a.area - b * on_b.area - c * on_c.area) / 3.0
}

/// The part of a disk beyond a corner inside of it, none of whose coordinates is negative.
struct Section {
    /// Of its arc.
    angle: f64,
    area: f64,
}

impl Section {
    fn new(radius: f64, x: f64, y: f64) -> Section {
        let along = |x: f64| (radius * radius - x * x).max(0.0).sqrt();
        let angle = along(x).atan2(x) - y.atan2(along(y));
        let area = 0.5 * (radius * radius * angle - x * (along(x) - y) - y * (along(y) - x));
        Section { angle, area }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By even points of the bounding box.
    fn sampled(dims: usize, center: DVec3, radius: f64, lower: DVec3, upper: DVec3) -> f64 {
        let n: usize = if dims == 2 { 1000 } else { 100 };
        let at = |k: usize| (2.0 * (k as f64 + 0.5) / n as f64 - 1.0) * radius;
        let depth = if dims == 2 { 1 } else { n };
        let mut inside = 0_u64;
        for (i, j, k) in (0..n).flat_map(|i| (0..n).flat_map(move |j| (0..depth).map(move |k| (i, j, k)))) {
            let arm = DVec3::new(at(i), at(j), if dims == 2 { 0.0 } else { at(k) });
            let x = center + arm;
            let within = (0..dims).all(|a| lower[a] <= x[a] && x[a] <= upper[a]);
            inside += u64::from(within && arm.length_squared() <= radius * radius);
        }
        inside as f64 * (2.0 * radius / n as f64).powi(dims as i32)
    }

    #[test]
    fn closed_form_and_sampling_agree() {
        let boxes = [
            ([-0.3, -0.4, -0.5], [0.2, 0.6, 0.7]),
            ([0.1, 0.2, 0.3], [2.0, 0.9, 0.8]),
            ([-0.9, -0.2, 0.5], [-0.1, 1.5, 2.0]),
            ([-2.0, -2.0, -0.6], [2.0, 2.0, 0.1]),
            ([0.5, 0.5, 0.4], [0.9, 0.7, 0.6]),
            ([0.0, 0.0, 0.0], [1.0, 1.0, 1.0]),
            ([-1.1, -0.7, -2.0], [0.3, f64::INFINITY, -0.66]),
        ];
        let (center, radius) = (DVec3::new(0.7, -1.3, 0.2), 0.8);
        for dims in [2, 3] {
            for (low, high) in boxes {
                let [lower, upper] = [low, high].map(|corner| center + radius * DVec3::from_array(corner));
                let found = ball_in_box(dims, center, radius, lower, upper);
                let expected = sampled(dims, center, radius, lower, upper);
                let error = (found - expected).abs() / (ball(dims) * radius.powi(dims as i32));
                assert!(error < 2e-3, "{dims}: {low:?} {high:?}: {found}, sampled {expected}");
            }
        }
    }

    /// Parts add up, octants are equal, and a plane cuts off a cap.
    #[test]
    fn parts_are_exact() {
        let far = DVec3::splat(f64::INFINITY);
        for dims in [2, 3] {
            let whole = ball(dims);
            let corner = DVec3::new(0.31, -0.42, 0.27);
            let parts = (0..1_u32 << dims).map(|k| {
                let up = |a: usize| k >> a & 1 == 1;
                let lower = [0, 1, 2].map(|a| if up(a) { corner[a] } else { f64::NEG_INFINITY });
                let upper = [0, 1, 2].map(|a| if up(a) { f64::INFINITY } else { corner[a] });
                ball_in_box(dims, DVec3::ZERO, 1.0, DVec3::from_array(lower), DVec3::from_array(upper))
            });
            assert!((parts.sum::<f64>() - whole).abs() < 4e-15 * whole);
            let octant = ball_in_box(dims, DVec3::ZERO, 1.0, DVec3::ZERO, far);
            assert!((octant * f64::from(1_u32 << dims) - whole).abs() < 4e-15 * whole);
        }
        let height: f64 = 0.3;
        let cap = ball_in_box(3, DVec3::ZERO, 1.0, DVec3::new(-9.0, -9.0, 1.0 - height), far);
        assert!((cap - PI / 3.0 * height * height * (3.0 - height)).abs() < 1e-14);
        let segment = ball_in_box(2, DVec3::ZERO, 1.0, DVec3::new(0.5, -9.0, 0.0), far);
        assert!((segment - (PI / 3.0 - 0.75_f64.sqrt() / 2.0)).abs() < 1e-14);
    }
}
