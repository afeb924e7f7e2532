//! The TOML schema, key by key as `docs/scene.md` lists it. Nothing here is checked beyond names and types. The builder
//! fills the same structures.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::check::show;
pub use super::law::{MaterialKeys as Material, PairKeys as Pair};

/// A whole scene file.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    pub title: Option<String>,
    pub dimension: usize,
    /// m/s²
    pub gravity: Option<Vec<f64>>,
    #[serde(default = "one")]
    pub seed: u64,
    pub domain: Option<Domain>,
    #[serde(default)]
    pub cell: Cell,
    #[serde(default)]
    pub material: BTreeMap<String, Material>,
    #[serde(default)]
    pub pair: Vec<Pair>,
    #[serde(default)]
    pub wall: Vec<Wall>,
    #[serde(default)]
    pub shape: Vec<Shape>,
    #[serde(default)]
    pub grain: Vec<Grain>,
    #[serde(default)]
    pub population: Vec<Population>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outlet: Vec<Outlet>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub growth: Vec<Growth>,
    #[serde(default)]
    pub solver: Solver,
    #[serde(default)]
    pub stop: Stop,
    pub jamming: Option<Jamming>,
    #[serde(default)]
    pub output: Output,
    /// What stages have of their own; `stages.rs` reads it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stage: Vec<toml::Table>,
}

fn one() -> u64 {
    1
}

#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub boundary: Option<Boundary>,
    pub tilt: Option<Tilt>,
}

/// How far edges of a cell lead along other axes: `xy` that along y along x.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tilt {
    pub yz: f64,
    pub xz: f64,
    pub xy: f64,
}

/// The periodic cell as it deforms.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Cell {
    pub strain_rate: Components,
    pub stress: Components,
    pub inertial_number: Option<f64>,
    pub gain: Option<f64>,
}

/// Of a strain of the cell, or its rate: `xy` is what moves along x with the distance along y.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct Components {
    pub xx: Option<f64>,
    pub yy: Option<f64>,
    pub zz: Option<f64>,
    pub yz: Option<f64>,
    pub xz: Option<f64>,
    pub xy: Option<f64>,
}

impl Components {
    /// In the order of [`COMPONENTS`](super::COMPONENTS).
    pub fn array(&self) -> [Option<f64>; 6] {
        let Components { xx, yy, zz, yz, xz, xy } = *self;
        [xx, yy, zz, yz, xz, xy]
    }
}

#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(
    untagged,
    expecting = "boundary must be \"open\", \"outlet\" or \"periodic\", or an array with one of them per axis"
)]
pub enum Boundary {
    Same(Face),
    Each(Vec<Face>),
}

/// What happens at a face of the domain.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Face {
    /// A grain that leaves through it stops the run with an error.
    Open,
    /// A grain that leaves through it is gone.
    Outlet,
    /// What leaves here comes in at the opposite face.
    Periodic,
}

/// One struct for all kinds, so that an unknown key is reported at its own line; `walls.rs` checks which keys go with
/// which kind.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    pub kind: WallKind,
    pub name: Option<String>,
    pub material: String,
    pub velocity: Option<Vec<f64>>,
    pub point: Option<Vec<f64>>,
    pub normal: Option<Vec<f64>>,
    pub lower: Option<Vec<f64>>,
    pub upper: Option<Vec<f64>>,
    pub faces: Option<Vec<String>>,
    pub center: Option<Vec<f64>>,
    pub radius: Option<f64>,
    pub spin: Option<f64>,
    pub start: Option<f64>,
    pub stop: Option<f64>,
    pub oscillation: Option<Oscillation>,
    pub turning: Option<Turning>,
    pub table: Option<String>,
    pub target_force: Option<f64>,
    pub target_pressure: Option<f64>,
    pub area: Option<f64>,
    pub gain: Option<f64>,
    pub max_speed: Option<f64>,
    pub inertial_number: Option<f64>,
}

/// To and fro; one period in every `interval`, s, if that is given.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Oscillation {
    pub amplitude: Vec<f64>,
    pub frequency: f64,
    pub interval: Option<f64>,
}

/// About an axis through a point.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Turning {
    pub point: Vec<f64>,
    pub axis: Option<Vec<f64>>,
    pub rate: f64,
}

#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub enum WallKind {
    Plane,
    Box,
    Cylinder,
}

/// Its members are given one way or another; `shape.rs` checks which keys go together.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    pub name: String,
    pub members: Option<Vec<Member>>,
    pub file: Option<String>,
    pub kind: Option<String>,
    pub mesh: Option<String>,
    pub spheres: Option<usize>,
    pub distance: Option<f64>,
    pub count: Option<usize>,
    pub seed: Option<u64>,
    pub volume: Option<f64>,
    pub center: Option<Vec<f64>>,
    pub inertia: Option<Vec<f64>>,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Member {
    pub center: Vec<f64>,
    pub radius: f64,
}

/// How a clump is turned: from the axes of its shape to those of the scene.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "orientation must be \"random\", a number of radians (dimension = 2), or one of { quaternion = [w, x, y, z] }, { euler = [phi, theta, psi] } (dimension = 3)"
)]
pub enum Orientation {
    Plane(f64),
    Word(String),
    Space(Rotation),
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Rotation {
    /// w, x, y, z; of any length but 0.
    Quaternion([f64; 4]),
    /// φ, θ, ψ about z, x' and z', rad.
    Euler([f64; 3]),
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Grain {
    pub position: Vec<f64>,
    pub radius: f64,
    pub shape: Option<String>,
    pub orientation: Option<Orientation>,
    pub material: String,
    pub velocity: Option<Vec<f64>>,
    pub spin: Option<Spin>,
    #[serde(default)]
    pub fixed: bool,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(untagged, expecting = "spin must be 3 numbers in three dimensions, one number in two (rad/s)")]
pub enum Spin {
    Plane(f64),
    Space([f64; 3]),
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Population {
    pub material: Option<Materials>,
    pub file: Option<String>,
    pub scale: Option<f64>,
    pub count: Option<usize>,
    pub radius: Option<Radius>,
    pub shape: Option<Mixture>,
    pub orientation: Option<Orientation>,
    pub placement: Option<Placement>,
    pub gap: Option<f64>,
    pub region: Option<Region>,
    pub velocity: Option<Vec<f64>>,
    #[serde(default)]
    pub velocity_spread: f64,
    #[serde(default)]
    pub fixed: bool,
    pub insertion: Option<Insertion>,
}

/// How grains come in over time.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Insertion {
    pub rate: Option<f64>,
    pub mass_rate: Option<f64>,
    pub mass: Option<f64>,
    pub start: Option<f64>,
    pub stop: Option<f64>,
    pub interval: Option<f64>,
    pub region_velocity: Option<Vec<f64>>,
}

/// Where grains leave; `outlet.rs` checks which keys go together.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Outlet {
    pub name: Option<String>,
    pub region: Option<Region>,
    pub point: Option<Vec<f64>>,
    pub normal: Option<Vec<f64>>,
    pub start: Option<f64>,
    pub stop: Option<f64>,
    pub interval: Option<f64>,
}

/// How radii change.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Growth {
    pub material: Option<String>,
    pub rate: f64,
    pub initial: Option<f64>,
    #[serde(rename = "final")]
    pub last: Option<f64>,
}

/// What a population is made of.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "material must be the name of a material, or a table of what the types in the file are such as { 1 = \"glass\", 2 = \"steel\" }"
)]
pub enum Materials {
    All(String),
    Types(BTreeMap<String, String>),
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "radius must be a number of metres or one of { uniform = [min, max] }, { normal = { mean, std } }, { log_normal = { mean, std } } (both with optional min and max), { list = [...] } (with optional shares), { sieve = { radius, passing } or a file }; each with optional by = \"number\" or \"volume\""
)]
pub enum Radius {
    Constant(f64),
    Distribution(Box<Distribution>),
}

/// One of the laws; `radius.rs` checks which keys go together.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Distribution {
    pub uniform: Option<[f64; 2]>,
    pub normal: Option<Moments>,
    pub log_normal: Option<Moments>,
    pub list: Option<Vec<f64>>,
    pub shares: Option<Vec<f64>>,
    pub sieve: Option<Sieve>,
    #[serde(default)]
    pub by: Weighting,
}

/// What the shares of sizes are shares of.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Weighting {
    #[default]
    Number,
    Volume,
}

/// A cumulative curve: what passes a sieve that holds back larger grains.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "sieve must be the name of a CSV file, or { radius = [...], passing = [...] } with as many numbers in both"
)]
pub enum Sieve {
    File(String),
    Curve(Curve),
}

#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// m
    pub radius: Vec<f64>,
    /// Ascending from 0; the last one is all.
    pub passing: Vec<f64>,
}

/// Mean and standard deviation of the radius, m, and where its distribution is cut.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Moments {
    pub mean: f64,
    pub std: f64,
    pub min: Option<f64>,
    pub max: Option<f64>,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "shape must be the name of a shape, or a table of names with their shares such as { dimer = 2, rod = 1 }"
)]
pub enum Mixture {
    All(String),
    Shares(BTreeMap<String, f64>),
}

/// How the grains of a population are placed.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Placement {
    /// On a jittered square or cubic lattice, layer by layer against gravity.
    Lattice,
    /// By random sequential insertion, the largest first.
    Random,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    /// Of a cylinder (circle), in which it is then.
    pub center: Option<Vec<f64>>,
    pub radius: Option<f64>,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    pub method: Method,
    pub dt: TimeStep,
    pub dt_fraction: Option<f64>,
    pub allow_unstable: bool,
    pub allow_overlap: bool,
    pub damping: Damping,
    pub margin: Option<f64>,
    pub relaxation: Option<String>,
    pub order: Option<String>,
    pub tolerance: Option<f64>,
    pub max_iterations: Option<u32>,
    pub max_correction_velocity: Option<f64>,
    pub compliance: Option<Compliance>,
    pub gyroscopic: Option<bool>,
    pub twist: Twist,
}

/// What contacts of contact dynamics give way by.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(untagged)]
pub enum Compliance {
    /// m/N, of all contacts.
    Constant(f64),
    Word(String),
}

impl Compliance {
    /// Whether contacts are rigid.
    pub fn is_none(&self) -> bool {
        match self {
            Compliance::Constant(compliance) => *compliance == 0.0,
            Compliance::Word(word) => word == "none",
        }
    }
}

/// Global damping.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(untagged)]
pub enum Damping {
    /// 1/s
    Constant(f64),
    Word(String),
}

impl From<f64> for Damping {
    fn from(rate: f64) -> Damping {
        Damping::Constant(rate)
    }
}

/// Whether springs follow the twist of their contact about its normal.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Twist {
    /// They stay as they are, (2.11) as printed.
    #[default]
    Ignored,
    /// They turn with the mean spin of the two.
    Followed,
}

impl Default for Solver {
    fn default() -> Solver {
        Solver {
            method: Method::Dem,
            dt: TimeStep::Word("auto".to_owned()),
            dt_fraction: None,
            allow_unstable: false,
            allow_overlap: false,
            damping: Damping::Constant(0.0),
            margin: None,
            relaxation: None,
            order: None,
            tolerance: None,
            max_iterations: None,
            max_correction_velocity: None,
            compliance: None,
            gyroscopic: None,
            twist: Twist::Ignored,
        }
    }
}

#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    Dem,
    Cd,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(untagged, expecting = "dt must be \"auto\" or a number of seconds")]
pub enum TimeStep {
    Seconds(f64),
    Word(String),
}

#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Stop {
    pub time: Option<f64>,
    pub steps: Option<u64>,
    pub equilibrium: Option<f64>,
    pub strain: Components,
    pub packing_fraction: Option<f64>,
    pub pressure: Option<f64>,
}

/// The protocol that finds the jamming fraction.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Jamming {
    pub step: Option<f64>,
    pub tolerance: Option<f64>,
    pub residual: Option<f64>,
    pub relaxation_steps: Option<u64>,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    pub history: Option<f64>,
    pub snapshots: Option<f64>,
    pub checkpoint: f64,
    pub works: bool,
    pub formats: Vec<Format>,
}

impl Default for Output {
    fn default() -> Output {
        Output {
            history: None,
            snapshots: None,
            checkpoint: 600.0,
            works: false,
            formats: vec![Format::Csv, Format::Vtp],
        }
    }
}

/// Files that a run writes.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// `final.csv`.
    Csv,
    /// `final.bin`, which costs a fraction of the time.
    Bin,
    /// `.vtp` and `.pvd` for ParaView.
    Vtp,
    /// Contacts in a table.
    #[serde(rename = "contacts.csv")]
    ContactsCsv,
    /// Contacts as lines from centre to centre, for ParaView.
    #[serde(rename = "contacts.vtp")]
    ContactsVtp,
    /// Grains, contacts, cell and walls for NumPy.
    Npz,
    /// Extended XYZ.
    Xyz,
    /// Dump of LAMMPS.
    Dump,
}

/// What is wrong with a TOML text, and where (lines and columns count from 1).
#[derive(Debug)]
pub struct Fault {
    pub line: usize,
    pub column: usize,
    pub message: String,
}

impl Fault {
    /// `start` is the byte at which the parser stumbled.
    pub fn new(text: &str, start: Option<usize>, message: &str) -> Fault {
        let (before, after) = text.split_at(start.unwrap_or(0).min(text.len()));
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Fault {
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            message: match message {
                "duplicate key" => duplicate(after.split(['=', ' ', '\n', ']']).next().unwrap_or_default()),
                message => in_words(message),
            },
        }
    }
}

/// What is said of a key that is given twice.
pub fn duplicate(key: &str) -> String {
    format!("duplicate key `{key}`; a key may appear once in a table")
}

/// Puts serde's terms in those of a scene file.
fn in_words(message: &str) -> String {
    short_number(message)
        .replace('\n', ", ")
        .replace("unknown field", "unknown key")
        .replace("missing field", "missing key")
        .replace("unknown variant", "unknown word")
        .replace(", expected one of ", "; allowed are ")
        .replace("expected f64", "expected a number")
        .replace("expected u64", "expected a whole number, 0 or more")
        .replace("expected usize", "expected a whole number, 0 or more")
        .replace("floating point", "number with a fraction")
}

/// The message with its number, which serde writes out digit by digit, as people write it.
fn short_number(message: &str) -> String {
    let number = |text: &str| text.parse::<f64>().ok().filter(|number| number.is_finite()).map(show);
    let shorten = || {
        let (before, rest) = message.split_once("floating point `")?;
        let (digits, after) = rest.split_once('`')?;
        Some(format!("{before}floating point `{}`{after}", number(digits)?))
    };
    shorten().unwrap_or_else(|| message.to_owned())
}

/// Reads a scene file.
pub fn read(text: &str) -> Result<File, Fault> {
    toml::from_str(text)
        .map_err(|error: toml::de::Error| Fault::new(text, error.span().map(|span| span.start), error.message()))
}
