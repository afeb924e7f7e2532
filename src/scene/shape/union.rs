//! Volume, centre and inertia of a union of balls or disks, overlaps counted once.
//!
//! Disks: exact, from the arcs of the boundary by Green's theorem. Balls: in closed form if the caps that neighbours
//! cut off a ball do not meet on it (rods, dimers, whatever does not overlap three-fold); else slices, each of them a
//! union of disks, are integrated over z by an adaptive Gauss-Kronrod rule, whose error is taken to be the difference
//! of its two rules.

use std::collections::BinaryHeap;
use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::member::Member;

/// Integrals over a body of density 1: ∫dV, ∫x dV, ∫x xᵀ dV.
#[derive(Clone, Copy, Debug)]
pub struct Moments {
    pub volume: f64,
    pub first: DVec3,
    pub second: DMat3,
}

impl Moments {
    const NONE: Moments = Moments { volume: 0.0, first: DVec3::ZERO, second: DMat3::ZERO };

    fn add(&mut self, other: &Moments, factor: f64) {
        self.volume += factor * other.volume;
        self.first += factor * other.first;
        self.second += factor * other.second;
    }

    /// The same about a point that lies at `shift` from the old one, seen from the new one.
    pub fn moved(&self, shift: DVec3) -> Moments {
        Moments {
            volume: self.volume,
            first: self.first + self.volume * shift,
            second: self.second
                + outer(self.first, shift)
                + outer(shift, self.first)
                + self.volume * outer(shift, shift),
        }
    }

    /// Inertia about the origin, tr(S) I - S. Of a disk only the zz component means something.
    pub fn inertia(&self) -> DMat3 {
        let trace = self.second.x_axis.x + self.second.y_axis.y + self.second.z_axis.z;
        trace * DMat3::IDENTITY - self.second
    }

    fn lanes(&self) -> [f64; LANES] {
        let s = &self.second;
        let (x, y, z) = (s.x_axis, s.y_axis, s.z_axis);
        [self.volume, self.first.x, self.first.y, self.first.z, x.x, y.y, z.z, x.y, x.z, y.z]
    }

    fn from_lanes(l: [f64; LANES]) -> Moments {
        Moments {
            volume: l[0],
            first: DVec3::new(l[1], l[2], l[3]),
            second: DMat3::from_cols(
                DVec3::new(l[4], l[7], l[8]),
                DVec3::new(l[7], l[5], l[9]),
                DVec3::new(l[8], l[9], l[6]),
            ),
        }
    }
}

const LANES: usize = 10;

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// A result about a point amid the members, and its error relative to volume and size (of lengths, their powers).
pub struct Measured {
    pub middle: DVec3,
    pub moments: Moments,
    pub error: f64,
}

/// Rounding of what is computed in closed form.
const ROUNDING: f64 = 1e-14;

/// Moments of disks (`dimension` 2, z = 0) or balls.
pub fn measure(members: &[Member], dimension: usize) -> Measured {
    // About a point amid the members, where least cancels.
    let middle = members.iter().map(|m| m.arm).sum::<DVec3>() / members.len() as f64;
    let near: Vec<Member> = members.iter().map(|m| Member { arm: m.arm - middle, ..*m }).collect();
    let (moments, error) = match dimension {
        2 => (of_disks(&near), ROUNDING),
        _ => of_separate_caps(&near).map_or_else(|| of_slices(&near), |moments| (moments, ROUNDING)),
    };
    Measured { middle, moments, error }
}

/// Disks, exactly.
fn of_disks(disks: &[Member]) -> Moments {
    let mut sum = Moments::NONE;
    let mut covered: Vec<(f64, f64)> = Vec::new();
    for (i, disk) in disks.iter().enumerate() {
        covered.clear();
        let swallowed = disks.iter().enumerate().any(|(k, other)| {
            let d = other.arm - disk.arm;
            let (distance, r, s) = (d.length(), disk.radius, other.radius);
            if k == i || distance >= r + s || distance + s <= r {
                // The other is elsewhere or inside; one of two equal disks is inside the first of them.
                return k < i && distance + s <= r && distance + r <= s;
            }
            if distance + r <= s {
                return true;
            }
            let middle = d.y.atan2(d.x);
            let half = ((distance * distance + r * r - s * s) / (2.0 * distance * r)).clamp(-1.0, 1.0).acos();
            let begin = (middle - half).rem_euclid(TAU);
            let end = begin + 2.0 * half;
            covered.push((begin, end.min(TAU)));
            if end > TAU {
                covered.push((0.0, end - TAU));
            }
            false
        });
        if swallowed {
            continue;
        }
        covered.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut at = 0.0;
        for &(begin, end) in &covered {
            if begin > at {
                add_arc(&mut sum, disk, at, begin);
            }
            at = end.max(at);
        }
        if at < TAU {
            add_arc(&mut sum, disk, at, TAU);
        }
    }
    sum
}

/// What an arc of the boundary adds by Green's theorem: area ½∮(x dy - y dx), ½∮x² dy, -½∮y² dx, ⅓∮x³ dy, -⅓∮y³ dx,
/// ½∮x²y dy.
fn add_arc(sum: &mut Moments, disk: &Member, begin: f64, end: f64) {
    let (x, y, r) = (disk.arm.x, disk.arm.y, disk.radius);
    // Antiderivatives of cᵏ, sᵏ (k = 1 to 4), s c, s c², s c³.
    let primitive = |t: f64| {
        let (s, c) = t.sin_cos();
        let (half, quarter) = ((2.0 * t).sin() / 4.0, (4.0 * t).sin() / 32.0);
        [
            s,
            t / 2.0 + half,
            s - s.powi(3) / 3.0,
            0.375 * t + half + quarter,
            -c,
            t / 2.0 - half,
            c.powi(3) / 3.0 - c,
            0.375 * t - half + quarter,
            s * s / 2.0,
            -c.powi(3) / 3.0,
            -c.powi(4) / 4.0,
        ]
    };
    let (a, b) = (primitive(begin), primitive(end));
    let [c1, c2, c3, c4, s1, s2, s3, s4, sc, scc, sccc] = std::array::from_fn(|k| b[k] - a[k]);
    sum.volume += 0.5 * r * (r * (end - begin) + x * c1 + y * s1);
    sum.first.x += 0.5 * r * (x * x * c1 + 2.0 * x * r * c2 + r * r * c3);
    sum.first.y += 0.5 * r * (y * y * s1 + 2.0 * y * r * s2 + r * r * s3);
    let cubic = |x: f64, i: [f64; 4]| {
        r / 3.0 * (x.powi(3) * i[0] + 3.0 * x * x * r * i[1] + 3.0 * x * r * r * i[2] + r.powi(3) * i[3])
    };
    sum.second.x_axis.x += cubic(x, [c1, c2, c3, c4]);
    sum.second.y_axis.y += cubic(y, [s1, s2, s3, s4]);
    let mixed = 0.5
        * r
        * (y * (x * x * c1 + 2.0 * x * r * c2 + r * r * c3) + r * (x * x * sc + 2.0 * x * r * scc + r * r * sccc));
    sum.second.x_axis.y += mixed;
    sum.second.y_axis.x += mixed;
}

/// A part of a ball beyond a plane.
struct Cap {
    /// Unit vector from the ball's centre.
    n: DVec3,
    /// From the centre to the plane; negative if the cap is more than half of the ball.
    d: f64,
}

/// Balls that are cut up by planes so that each has its own part of the union: a ball loses a cap to each neighbour.
/// None if caps meet, so that there is no closed form.
fn of_separate_caps(balls: &[Member]) -> Option<Moments> {
    let mut sum = Moments::NONE;
    for (i, ball) in balls.iter().enumerate() {
        let r = ball.radius;
        let mut caps: Vec<Cap> = Vec::new();
        let mut swallowed = false;
        for (k, other) in balls.iter().enumerate() {
            let way = other.arm - ball.arm;
            let (distance, s) = (way.length(), other.radius);
            if k == i || distance >= r + s {
                continue;
            }
            if distance + r <= s && (k < i || distance + s > r) {
                swallowed = true;
                break;
            }
            if distance + s <= r {
                continue;
            }
            caps.push(Cap { n: way / distance, d: (distance * distance + r * r - s * s) / (2.0 * distance) });
        }
        if swallowed {
            continue;
        }
        let opening = |cap: &Cap| (cap.d / r).clamp(-1.0, 1.0).acos();
        let apart = |a: &Cap, b: &Cap| a.n.dot(b.n).clamp(-1.0, 1.0).acos() >= opening(a) + opening(b);
        if caps.iter().enumerate().any(|(k, a)| caps[..k].iter().any(|b| !apart(a, b))) {
            return None;
        }
        let volume = 4.0 / 3.0 * PI * r.powi(3);
        let mut own = Moments { volume, first: DVec3::ZERO, second: volume * r * r / 5.0 * DMat3::IDENTITY };
        for cap in &caps {
            own.add(&of_cap(cap, r), -1.0);
        }
        sum.add(&own.moved(ball.arm), 1.0);
    }
    Some(sum)
}

/// About the ball's centre: slices of area π (R² - t²) from t = d to R.
fn of_cap(cap: &Cap, r: f64) -> Moments {
    let Cap { n, d } = *cap;
    let h = r - d;
    let along = PI * ((r.powi(5) - r * r * d.powi(3)) / 3.0 - (r.powi(5) - d.powi(5)) / 5.0);
    let whole = |t: f64| r.powi(4) * t - 2.0 / 3.0 * r * r * t.powi(3) + t.powi(5) / 5.0;
    let across = 0.25 * PI * (whole(r) - whole(d));
    let axis = outer(n, n);
    Moments {
        volume: PI * h * h * (3.0 * r - h) / 3.0,
        first: 0.25 * PI * (r * r - d * d).powi(2) * n,
        second: along * axis + across * (DMat3::IDENTITY - axis),
    }
}

/// Error, relative, at which slices are fine enough (of many members, for which they take long), and how many times
/// they are divided at most.
const TOLERANCE: f64 = 1e-11;
const ROUGH: f64 = 1e-8;
const MANY: usize = 50;
const DIVISIONS: usize = 4000;

/// A piece of the z axis with its integral.
struct Piece {
    begin: f64,
    end: f64,
    sum: [f64; LANES],
    error: [f64; LANES],
    /// The largest error, relative.
    worst: f64,
}

impl PartialEq for Piece {
    fn eq(&self, other: &Piece) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Piece {}
impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Piece) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Piece {
    fn cmp(&self, other: &Piece) -> std::cmp::Ordering {
        self.worst.total_cmp(&other.worst).then(other.begin.total_cmp(&self.begin))
    }
}

/// Balls, by slices.
fn of_slices(balls: &[Member]) -> (Moments, f64) {
    // Between the ends of balls and of the circles in which they meet the slices change smoothly but for three-fold
    // corners.
    let mut ends: Vec<f64> = balls.iter().flat_map(|b| [b.arm.z - b.radius, b.arm.z + b.radius]).collect();
    for (k, a) in balls.iter().enumerate().filter(|_| balls.len() <= MANY) {
        for b in &balls[..k] {
            let way = b.arm - a.arm;
            let distance = way.length();
            let along = (distance * distance + a.radius * a.radius - b.radius * b.radius) / (2.0 * distance);
            let circle = a.radius * a.radius - along * along;
            if distance > 0.0 && circle > 0.0 {
                let n = way / distance;
                let rise = (circle * (1.0 - n.z * n.z).max(0.0)).sqrt();
                ends.extend([a.arm.z + along * n.z - rise, a.arm.z + along * n.z + rise]);
            }
        }
    }
    ends.sort_by(f64::total_cmp);
    let size = ends.last().zip(ends.first()).map_or(0.0, |(last, first)| 0.5 * (last - first));
    let reach = balls.iter().map(|b| b.arm.length() + b.radius).fold(size, f64::max);
    let bulk: f64 = 4.0 / 3.0 * PI * balls.iter().map(|b| b.radius.powi(3)).fold(0.0, f64::max);
    let scales: [f64; LANES] = std::array::from_fn(|k| match k {
        0 => bulk,
        1..4 => bulk * reach,
        _ => bulk * reach * reach,
    });
    let tolerance = if balls.len() <= MANY { TOLERANCE } else { ROUGH };
    let piece = |begin: f64, end: f64| Piece::new(balls, begin, end, &scales);
    let spans: Vec<&[f64]> = ends.windows(2).filter(|w| w[1] - w[0] > 1e-13 * reach).collect();
    let mut pieces = BinaryHeap::from(spans.par_iter().map(|w| piece(w[0], w[1])).collect::<Vec<Piece>>());
    for _ in 0..DIVISIONS {
        if pieces.iter().map(|p| p.worst).sum::<f64>() <= tolerance {
            break;
        }
        let Some(worst) = pieces.pop() else { break };
        let middle = 0.5 * (worst.begin + worst.end);
        let (below, above) = rayon::join(|| piece(worst.begin, middle), || piece(middle, worst.end));
        pieces.extend([below, above]);
    }
    // In a fixed order, so that the sum is the same wherever it is taken.
    let mut pieces = pieces.into_vec();
    pieces.sort_by(|a, b| a.begin.total_cmp(&b.begin));
    let (mut sum, mut error) = ([0.0; LANES], [0.0; LANES]);
    for piece in &pieces {
        for k in 0..LANES {
            sum[k] += piece.sum[k];
            error[k] += piece.error[k];
        }
    }
    let error = (0..LANES).map(|k| error[k] / scales[k]).fold(ROUNDING, f64::max);
    (Moments::from_lanes(sum), error)
}

impl Piece {
    fn new(balls: &[Member], begin: f64, end: f64, scales: &[f64; LANES]) -> Piece {
        let (middle, half) = (0.5 * (begin + end), 0.5 * (end - begin));
        let (mut fine, mut coarse) = ([0.0; LANES], [0.0; LANES]);
        for (k, &(node, weight)) in KRONROD.iter().enumerate() {
            for sign in if node == 0.0 { &[1.0][..] } else { &[-1.0, 1.0] } {
                let slice = slice(balls, middle + sign * half * node).lanes();
                for lane in 0..LANES {
                    fine[lane] += half * weight * slice[lane];
                    // Every second node is one of Gauss's.
                    if k % 2 == 1 {
                        coarse[lane] += half * GAUSS[k / 2] * slice[lane];
                    }
                }
            }
        }
        let error: [f64; LANES] = std::array::from_fn(|k| (fine[k] - coarse[k]).abs());
        let worst = (0..LANES).map(|k| error[k] / scales[k]).fold(0.0, f64::max);
        Piece { begin, end, sum: fine, error, worst }
    }
}

/// The union at height z, per length.
fn slice(balls: &[Member], z: f64) -> Moments {
    let disk = |b: &Member| {
        let squared = b.radius * b.radius - (z - b.arm.z).powi(2);
        (squared > 0.0).then(|| Member { arm: b.arm.with_z(0.0), radius: squared.sqrt() })
    };
    let disks: Vec<Member> = balls.iter().filter_map(disk).collect();
    of_disks(&disks).moved(DVec3::new(0.0, 0.0, z))
}

/// Nodes and weights of the 15-point Kronrod rule on [-1, 1], from the outermost to the middle (Piessens et al.,
/// QUADPACK, 1983).
const KRONROD: [(f64, f64); 8] = [
    (0.991_455_371_120_812_6, 0.022_935_322_010_529_224),
    (0.949_107_912_342_758_5, 0.063_092_092_629_978_55),
    (0.864_864_423_359_769_1, 0.104_790_010_322_250_18),
    (0.741_531_185_599_394_5, 0.140_653_259_715_525_92),
    (0.586_087_235_467_691_1, 0.169_004_726_639_267_9),
    (0.405_845_151_377_397_2, 0.190_350_578_064_785_41),
    (0.207_784_955_007_898_47, 0.204_432_940_075_298_89),
    (0.0, 0.209_482_141_084_727_83),
];
/// Weights of the 7-point Gauss rule at every second of them.
const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_agree_with_caps() {
        let ball = |x: f64, y: f64, z: f64, radius: f64| Member { arm: DVec3::new(x, y, z), radius };
        let chain =
            [ball(0.0, 0.0, 0.0, 1.0), ball(1.3, 0.4, -0.5, 0.8), ball(-1.1, 0.9, 0.4, 0.7), ball(-0.2, 0.1, 0.1, 0.3)];
        let caps = of_separate_caps(&chain).expect("no point is in three of them").lanes();
        let (slices, error) = of_slices(&chain);
        assert!(error < 1e-10, "{error:e}");
        for (a, b) in caps.iter().zip(slices.lanes()) {
            assert!((a - b).abs() < 1e-10, "{a} {b}");
        }
    }
}
