//! The library of shapes: sets of members by rule.

use std::f64::consts::TAU;
use std::str::FromStr;

use glam::DVec3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::member::Member;

/// A rule that makes a shape of members of radius 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One member in the plane.
    Disk,
    /// One member in space.
    Sphere,
    /// Two members.
    Dimer,
    /// Members in a row.
    Rod,
    /// Three members, each touching (or overlapping) the others.
    Triangle,
    /// Four members at the corners of a square.
    Square,
    /// One member with one more on either side of it along every axis.
    Cross,
    /// Four members at the corners of a tetrahedron.
    Tetrahedron,
    /// Six members at the corners of an octahedron.
    Octahedron,
    /// Eight members at the corners of a cube.
    Cube,
    /// Members of radii from 0.5 to 1, each stuck to an earlier one in a random direction.
    Random,
}

/// What a rule may be told.
pub struct Options {
    /// Between the centres of neighbouring members, in their radii (`random`: in the larger radius).
    pub distance: f64,
    /// Members of a rod (3 if not given) or of a random shape (5).
    pub count: Option<usize>,
    /// Of a random shape.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Options {
        Options { distance: 1.0, count: None, seed: 1 }
    }
}

impl Kind {
    /// All rules, with the words for them.
    pub const ALL: [Kind; 11] = [
        Kind::Disk,
        Kind::Sphere,
        Kind::Dimer,
        Kind::Rod,
        Kind::Triangle,
        Kind::Square,
        Kind::Cross,
        Kind::Tetrahedron,
        Kind::Octahedron,
        Kind::Cube,
        Kind::Random,
    ];

    /// The word for it in scene files.
    pub fn label(self) -> &'static str {
        match self {
            Kind::Disk => "disk",
            Kind::Sphere => "sphere",
            Kind::Dimer => "dimer",
            Kind::Rod => "rod",
            Kind::Triangle => "triangle",
            Kind::Square => "square",
            Kind::Cross => "cross",
            Kind::Tetrahedron => "tetrahedron",
            Kind::Octahedron => "octahedron",
            Kind::Cube => "cube",
            Kind::Random => "random",
        }
    }

    /// Whether it is a shape of that dimension.
    pub fn fits(self, dimension: usize) -> bool {
        match self {
            Kind::Disk => dimension == 2,
            Kind::Sphere | Kind::Tetrahedron | Kind::Octahedron | Kind::Cube => dimension == 3,
            _ => true,
        }
    }

    /// Whether it can be told how many members it has.
    pub fn counts(self) -> bool {
        matches!(self, Kind::Rod | Kind::Random)
    }

    /// The members.
    pub fn members(self, dimension: usize, options: &Options) -> Vec<Member> {
        let axes = &DVec3::AXES[..dimension];
        let half = 0.5 * options.distance;
        // Corners all at the same distance from their neighbours, about the origin.
        let centers: Vec<DVec3> = match self {
            Kind::Disk | Kind::Sphere => vec![DVec3::ZERO],
            Kind::Dimer => vec![-half * DVec3::X, half * DVec3::X],
            Kind::Rod => {
                let count = options.count.unwrap_or(3);
                (0..count).map(|k| half * (2.0 * k as f64 - (count - 1) as f64) * DVec3::X).collect()
            }
            Kind::Triangle => {
                let corner = |k: usize| DVec3::from((glam::DVec2::from_angle(TAU * k as f64 / 3.0), 0.0));
                (0..3).map(|k| options.distance / 3f64.sqrt() * corner(k)).collect()
            }
            Kind::Square => signs(2).map(|s| half * s).collect(),
            Kind::Cross => {
                let arms = axes.iter().flat_map(|a| [-options.distance * *a, options.distance * *a]);
                std::iter::once(DVec3::ZERO).chain(arms).collect()
            }
            Kind::Tetrahedron => {
                let even = signs(3).filter(|s| s.x * s.y * s.z > 0.0);
                even.map(|s| half / 2f64.sqrt() * s).collect()
            }
            Kind::Octahedron => {
                let reach = options.distance / 2f64.sqrt();
                axes.iter().flat_map(|a| [-reach * *a, reach * *a]).collect()
            }
            Kind::Cube => signs(3).map(|s| half * s).collect(),
            Kind::Random => return random(dimension, options),
        };
        centers.into_iter().map(|arm| Member { arm, radius: 1.0 }).collect()
    }
}

/// Corners (±1, ±1) or (±1, ±1, ±1).
fn signs(dimension: usize) -> impl Iterator<Item = DVec3> {
    let sign =
        move |bits: usize, axis: usize| if axis >= dimension { 0.0 } else { ((bits >> axis & 1) * 2) as f64 - 1.0 };
    (0..1usize << dimension).map(move |bits| DVec3::new(sign(bits, 0), sign(bits, 1), sign(bits, 2)))
}

fn random(dimension: usize, options: &Options) -> Vec<Member> {
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let mut members = vec![Member { arm: DVec3::ZERO, radius: 1.0 }];
    while members.len() < options.count.unwrap_or(5) {
        let from = members[rng.random_range(0..members.len())];
        let radius: f64 = rng.random_range(0.5..=1.0);
        let z: f64 = if dimension == 2 { 0.0 } else { rng.random_range(-1.0..=1.0) };
        let flat = glam::DVec2::from_angle(rng.random_range(0.0..TAU)) * (1.0 - z * z).sqrt();
        // Not so close that one is swallowed.
        let distance = (options.distance * radius.max(from.radius))
            .clamp((from.radius - radius).abs() + 0.1, from.radius + radius);
        members.push(Member { arm: from.arm + distance * flat.extend(z), radius });
    }
    members
}

impl FromStr for Kind {
    type Err = String;

    fn from_str(word: &str) -> Result<Kind, String> {
        Kind::ALL.into_iter().find(|kind| kind.label() == word).ok_or_else(|| word.to_owned())
    }
}
