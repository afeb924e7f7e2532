//! The stiffness matrix of a packing, written from the theory and not from the crate: its highest frequency is the true
//! critical time step.

use super::common::{Random, gyration};
use glam::DVec3;

/// A contact: of two grains, or of a grain with a wall.
pub struct Link {
    pub i: usize,
    pub j: Option<usize>,
    /// From i to j.
    pub n: DVec3,
    /// How deep it is pressed, m: shortens the arms, and lets the normal force turn with the normal.
    pub overlap: f64,
}

impl Link {
    /// A contact without force.
    pub fn new(i: usize, j: Option<usize>, n: DVec3) -> Link {
        Link { i, j, n, overlap: 0.0 }
    }
}

/// Displacement and turn of every grain.
pub type Mode = Vec<(DVec3, DVec3)>;

/// 2/ω_max of linear springs that stick, s.
pub fn critical_step(dimension: usize, grains: &[(f64, f64)], links: &[Link], kn: f64, kt: f64) -> f64 {
    critical_mode(dimension, grains, links, kn, kt).0
}

/// 2/ω_max, s, and the mode that swings with ω_max, of norm 1 in √mass: power iteration of M⁻¹K over translations and
/// rotations. Grains are given by mass and radius.
pub fn critical_mode(dimension: usize, grains: &[(f64, f64)], links: &[Link], kn: f64, kt: f64) -> (f64, Mode) {
    let mut random = Random(7);
    let turn = |r: DVec3| if dimension == 2 { DVec3::Z * r.z } else { r };
    let mut u: Mode = grains.iter().map(|g| (random.vector(dimension), turn(random.vector(3)) / g.1)).collect();
    let mut omega_squared = 0.0;
    for _ in 0..6000 {
        let mut a = vec![(DVec3::ZERO, DVec3::ZERO); grains.len()];
        for link in links {
            let arm = |k: usize| grains[k].1 - 0.5 * link.overlap;
            let (i, n) = (link.i, link.n);
            let apart = u[i].0 - link.j.map_or(DVec3::ZERO, |j| u[j].0);
            let slip = apart + u[i].1.cross(arm(i) * n) + link.j.map_or(DVec3::ZERO, |j| u[j].1.cross(arm(j) * n));
            let normal = slip.dot(n) * n;
            let friction = kt * (slip - normal);
            let distance = link.j.map_or(f64::INFINITY, |j| grains[i].1 + grains[j].1 - link.overlap);
            let f = kn * normal + friction - kn * link.overlap / distance * (apart - normal);
            for (k, sign) in [(Some(i), 1.0), (link.j, -1.0)] {
                let Some(k) = k else { continue };
                let (m, r) = grains[k];
                a[k].0 += sign * f / m;
                // Both arms point from their own centre to the contact, and both forces are opposite: same moment.
                a[k].1 += turn((arm(k) * n).cross(friction)) / (gyration(dimension) * m * r * r);
            }
        }
        omega_squared = norm(dimension, grains, &a) / norm(dimension, grains, &u);
        let scale = 1.0 / norm(dimension, grains, &a);
        u = a.into_iter().map(|(x, w)| (scale * x, scale * w)).collect();
    }
    (2.0 / omega_squared.sqrt(), u)
}

/// Product of two modes in which M⁻¹K is symmetric.
pub fn product(dimension: usize, grains: &[(f64, f64)], a: &[(DVec3, DVec3)], b: &[(DVec3, DVec3)]) -> f64 {
    let of = |k: usize| {
        let (m, r) = grains[k];
        m * a[k].0.dot(b[k].0) + gyration(dimension) * m * r * r * a[k].1.dot(b[k].1)
    };
    (0..grains.len()).map(of).sum()
}

fn norm(dimension: usize, grains: &[(f64, f64)], mode: &[(DVec3, DVec3)]) -> f64 {
    product(dimension, grains, mode, mode).sqrt()
}

/// Links of a lattice that repeats `side` times along each axis; positions in units of the period.
pub fn lattice_links(positions: &[DVec3], period: f64, reach: f64) -> Vec<Link> {
    let mut links = Vec::new();
    for i in 0..positions.len() {
        for j in i + 1..positions.len() {
            let d = positions[j] - positions[i];
            let d = d - period * (d / period).round();
            if d.length() < reach {
                links.push(Link::new(i, Some(j), d.normalize()));
            }
        }
    }
    links
}
