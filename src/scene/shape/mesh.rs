//! Clumps from closed surfaces: a triangle mesh (STL, binary or ASCII) filled by spheres.
//!
//! Candidates are medial balls: the largest that touch the surface at a point of it from within (shrinking ball; Ma,
//! Bae and Choi, The Visual Computer 28, 2012). Of these, those are taken one by one that bring the surface of the
//! clump closest to that of the mesh, by the sum of squared distances from points spread over the mesh. No sphere
//! reaches out of the mesh.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::io::Cursor;
use std::path::Path;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::member::{Mass, Member};
use crate::{Error, Result, input};

/// Distances from points spread over the surface of a mesh to the nearest member, over the shape's `radius`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    pub mean: f64,
    pub max: f64,
}

/// Points on the surface, each with a candidate.
const POINTS: usize = 3000;
/// A ball smaller than this part of the largest fills a corner that nobody can see.
const SMALLEST: f64 = 0.02;

/// Relative error of sums over triangles.
pub const ROUNDING: f64 = 1e-12;

/// A mesh whose triangles point outward.
struct Mesh {
    triangles: Vec<[DVec3; 3]>,
    mass: Mass,
}

/// Spheres in a mesh, and what the mesh itself weighs.
pub struct Filled {
    pub members: Vec<Member>,
    pub mass: Mass,
    pub misfit: Misfit,
}

/// At most `count` spheres that fill the mesh in the file.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Scene`] if it is no STL file or its surface is not closed.
pub fn fill(path: &Path, count: usize) -> Result<Filled> {
    let mesh = read(path)?;
    let points = spread(&mesh.triangles);
    let candidates: Vec<Member> = points.par_iter().map(|(x, n)| medial_ball(&mesh, &points, *x, *n)).collect();
    let largest = candidates.iter().map(|ball| ball.radius).fold(0.0, f64::max);
    let seen = |ball: &Member| ball.radius > SMALLEST * largest && is_inside(&mesh.triangles, ball.arm);
    let candidates: Vec<Member> = candidates.into_par_iter().filter(seen).collect();
    let members = choose(&points, &candidates, count);
    let gaps = points.iter().map(|(x, _)| gap_to(&members, *x));
    let (sum, max) = gaps.fold((0.0, 0.0f64), |(sum, max), gap| (sum + gap, max.max(gap)));
    Ok(Filled { members, mass: mesh.mass, misfit: Misfit { mean: sum / points.len() as f64, max } })
}

fn read(path: &Path) -> Result<Mesh> {
    let wrong = |message: String| Error::Scene(format!("{}: {message}", path.display()));
    let mut bytes = input::read(path)?;
    // A binary file has 84 bytes and 50 per triangle, whatever it begins with; a text may begin with nothing but the
    // word.
    let count = bytes.get(80..84).map_or(0, |n| u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize);
    if bytes.len() == 84 + 50 * count {
        bytes[..80].fill(0);
    } else if bytes.starts_with(b"solid\n") || bytes.starts_with(b"solid\r") {
        bytes.splice(5..5, *b" mesh");
    }
    let stl =
        stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|_| wrong("is no STL mesh that can be read".to_owned()))?;
    let vertex = |k: usize| {
        let [x, y, z] = stl.vertices[k].0;
        DVec3::new(x.into(), y.into(), z.into())
    };
    if let Some(k) = (0..stl.vertices.len()).find(|k| !vertex(*k).is_finite()) {
        return Err(wrong(format!("vertex {k} has a coordinate that is no number")));
    }
    // Places that differ in the sign of a zero are one; triangles without area say nothing of the surface.
    let mut places: HashMap<[u64; 3], usize> = HashMap::new();
    let mut place = |k: usize| {
        let next = places.len();
        *places.entry((vertex(k) + 0.0).to_array().map(f64::to_bits)).or_insert(next)
    };
    let faces: Vec<([usize; 3], [DVec3; 3])> = stl
        .faces
        .iter()
        .map(|face| (face.vertices.map(&mut place), face.vertices.map(vertex)))
        .filter(|([a, b, c], _)| a != b && b != c && c != a)
        .collect();
    if faces.is_empty() {
        return Err(wrong("has no triangles".to_owned()));
    }
    // In a closed surface every edge is passed once in each direction.
    let mut edges: HashMap<(usize, usize), i32> = HashMap::new();
    for ([a, b, c], _) in &faces {
        let (a, b, c) = (*a, *b, *c);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    let open = edges.values().filter(|passes| **passes != 0).count();
    if open > 0 {
        return Err(wrong(format!(
            "its surface is not closed: {open} of {} edges do not have a triangle on either side, both facing the same way; repair the mesh",
            edges.len()
        )));
    }
    let mut triangles: Vec<[DVec3; 3]> = faces.into_iter().map(|(_, corners)| corners).collect();
    let mut mass = weigh(&triangles);
    if mass.volume < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mass = weigh(&triangles);
    }
    match mass.volume > 0.0 && mass.volume.is_normal() {
        true => Ok(Mesh { triangles, mass }),
        false => Err(wrong("encloses no volume".to_owned())),
    }
}

/// Volume, centre and inertia of what the surface encloses: tetrahedra from one point to the triangles, with their
/// signs.
fn weigh(triangles: &[[DVec3; 3]]) -> Mass {
    let origin = triangles[0][0];
    let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for t in triangles {
        let [a, b, c] = t.map(|x| x - origin);
        let v = a.dot(b.cross(c)) / 6.0;
        let sum = a + b + c;
        volume += v;
        first += v / 4.0 * sum;
        let outer = |p: DVec3| DMat3::from_cols(p * p.x, p * p.y, p * p.z);
        second += v / 20.0 * (outer(sum) + outer(a) + outer(b) + outer(c));
    }
    let center = first / volume;
    let second = second - volume * DMat3::from_cols(center * center.x, center * center.y, center * center.z);
    let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
    Mass { volume, center: center + origin, inertia: trace * DMat3::IDENTITY - second }
}

/// Points spread evenly over the surface, with its outward normal there.
fn spread(triangles: &[[DVec3; 3]]) -> Vec<(DVec3, DVec3)> {
    let normal = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]);
    let mut reached = 0.0;
    let ends: Vec<f64> = triangles
        .iter()
        .map(|t| {
            reached += 0.5 * normal(t).length();
            reached
        })
        .collect();
    // Along the triangles at equal areas; inside of each by the additive recurrence with the generalised golden ratio.
    let point = |k: usize| {
        let at = reached * (k as f64 + 0.5) / POINTS as f64;
        let t = &triangles[ends.partition_point(|end| *end < at).min(triangles.len() - 1)];
        let u = (0.5 + 0.754_877_666_246_692_8 * k as f64).fract();
        let v = (0.5 + 0.569_840_290_998_053_2 * k as f64).fract();
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        (t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]), normal(t).normalize_or_zero())
    };
    (0..POINTS).map(point).collect()
}

/// The largest ball inside that touches the surface at x, where n points outward.
fn medial_ball(mesh: &Mesh, points: &[(DVec3, DVec3)], x: DVec3, n: DVec3) -> Member {
    let mut radius = mesh.mass.volume.cbrt() * 10.0;
    for _ in 0..40 {
        let center = x - radius * n;
        let nearest = points
            .iter()
            .map(|(p, _)| *p)
            .min_by(|a, b| a.distance_squared(center).total_cmp(&b.distance_squared(center)));
        let Some(p) = nearest.filter(|p| p.distance(center) < radius * (1.0 - 1e-9)) else { break };
        let way = x - p;
        let along = way.dot(n);
        // The ball through x and p.
        let next = if along > 0.0 { way.length_squared() / (2.0 * along) } else { 0.0 };
        if next >= radius * (1.0 - 1e-9) {
            break;
        }
        radius = next;
    }
    let center = x - radius * n;
    // Points do not see the whole surface, triangles do.
    Member { arm: center, radius: mesh.triangles.iter().map(|t| distance_to(t, center)).fold(radius, f64::min) }
}

/// Whether the surface winds around x: the solid angles of its triangles add up to 4π (van Oosterom and Strackee,
/// 1983). Where a part of the mesh is thinner than the distance of the points on it, a ball may have gone through to
/// the other side.
fn is_inside(triangles: &[[DVec3; 3]], x: DVec3) -> bool {
    let angle = |t: &[DVec3; 3]| {
        let [a, b, c] = t.map(|corner| corner - x);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        2.0 * a.dot(b.cross(c)).atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
    };
    triangles.iter().map(angle).sum::<f64>() > 2.0 * PI
}

/// How far x is outside of all balls.
fn gap_to(balls: &[Member], x: DVec3) -> f64 {
    balls.iter().map(|ball| x.distance(ball.arm) - ball.radius).fold(f64::INFINITY, f64::min).max(0.0)
}

/// One ball after the other, each time the one that brings the sum of squared gaps down most.
fn choose(points: &[(DVec3, DVec3)], candidates: &[Member], count: usize) -> Vec<Member> {
    let mut gaps = vec![f64::INFINITY; points.len()];
    let mut chosen: Vec<Member> = Vec::new();
    while chosen.len() < count {
        let left = |ball: &Member| -> f64 {
            let gap = |((x, _), gap): (&(DVec3, DVec3), &f64)| (x.distance(ball.arm) - ball.radius).max(0.0).min(*gap);
            points.iter().zip(&gaps).map(gap).map(|gap| gap * gap).sum()
        };
        let sums: Vec<f64> = candidates.par_iter().map(left).collect();
        let best = (0..candidates.len()).min_by(|a, b| sums[*a].total_cmp(&sums[*b]));
        let Some(ball) = best.map(|k| candidates[k]).filter(|ball| !chosen.contains(ball)) else { break };
        for ((x, _), gap) in points.iter().zip(&mut gaps) {
            *gap = gap.min((x.distance(ball.arm) - ball.radius).max(0.0));
        }
        chosen.push(ball);
    }
    chosen
}

/// Distance of a point from a triangle: from its plane, if the foot lies inside, else from the nearest edge.
fn distance_to(t: &[DVec3; 3], x: DVec3) -> f64 {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]);
    let edges = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    let inside = edges.iter().all(|(a, b)| (*b - *a).cross(x - *a).dot(normal) >= 0.0);
    if inside && normal != DVec3::ZERO {
        return (x - t[0]).dot(normal).abs() / normal.length();
    }
    let to_edge = |(a, b): &(DVec3, DVec3)| {
        let way = *b - *a;
        let along = if way == DVec3::ZERO { 0.0 } else { ((x - *a).dot(way) / way.length_squared()).clamp(0.0, 1.0) };
        x.distance(*a + along * way)
    };
    edges.iter().map(to_edge).fold(f64::INFINITY, f64::min)
}
