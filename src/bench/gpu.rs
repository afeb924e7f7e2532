//! One GPU, measured whole (`packstone bench gpu`): what the device says of itself, whether it computes the right thing
//! and twice the same, and how fast. It is made to run on devices that nobody has seen, so every [`Part`] runs in a
//! process of its own: what fails, hangs or crashes a driver there becomes a line of the report.

mod parts;
pub mod report;
pub mod schedule;

pub use parts::measure;

use super::{lattice, trial::scene};
use crate::{Result, gpu::Restrictions, scene::Assembly};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, fmt};

/// What is simulated, for any number of grains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Case {
    /// Rough spheres in a dense lattice.
    Spheres,
    /// Clumps of three of them in a row.
    Rods,
    /// Smooth disks.
    Disks,
    /// Spheres around one of ten times their radius: grids of several levels, lists that workgroups walk.
    Boulder,
    /// A bed on a floor, with contact dynamics.
    Rigid,
}

impl Case {
    pub const ALL: [Case; 5] = [Case::Spheres, Case::Rods, Case::Disks, Case::Boulder, Case::Rigid];

    fn name(self) -> &'static str {
        match self {
            Case::Spheres => "spheres",
            Case::Rods => "rods",
            Case::Disks => "disks",
            Case::Boulder => "boulder",
            Case::Rigid => "rigid",
        }
    }

    /// About so many grains; of rods, so many members.
    fn assembly(self, grains: usize) -> Result<Assembly> {
        let spheres = || scene("spheres", include_str!("scenes/spheres.toml"), &[]);
        Ok(match self {
            Case::Spheres => lattice::fill(&spheres()?, grains),
            Case::Rods => lattice::rods(&spheres()?, grains),
            Case::Disks => lattice::fill(&scene("disks", include_str!("scenes/disks.toml"), &[])?, grains),
            Case::Boulder => lattice::around_boulder(&spheres()?, grains),
            Case::Rigid => lattice::pile(&scene("rigid bed", include_str!("scenes/rigid.toml"), &[])?, grains),
        })
    }
}

/// Runs whose bits are compared: in so many processes, so often in each.
const PROCESSES: [u32; 2] = [1, 2];
const RUNS: [&str; 2] = ["first", "second"];

/// What one process measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// The machine, all adapters, and whether the best one opens.
    Adapter,
    /// How fast memory is copied.
    Copies,
    /// Kernels beside their twins.
    Check { case: Case, double: bool },
    /// The same run twice in this process, to be compared with those of another one.
    Repeat { case: Case, grains: usize, process: u32 },
    /// Particle-steps per second, work of the host, stages, traffic.
    Speed { case: Case, grains: usize },
    /// The spheres with other settings than the default ones, beside these.
    Variants { grains: usize },
}

impl Part {
    /// Whether it is no defect that a machine has not what this takes: packings grow until they do not fit, and few devices
    /// have f64.
    pub fn may_lack(self) -> bool {
        !matches!(self, Part::Adapter | Part::Copies | Part::Check { double: false, .. })
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Part::Adapter => write!(f, "adapter"),
            Part::Copies => write!(f, "copies"),
            Part::Check { case, double } => {
                write!(f, "check {}, {}", case.name(), if *double { "double" } else { "single" })
            }
            Part::Repeat { case, grains, process } => {
                write!(f, "repeat {} {grains}, process {process}", case.name())
            }
            Part::Speed { case, grains } => write!(f, "speed {} {grains}", case.name()),
            Part::Variants { grains } => write!(f, "variants of spheres {grains}"),
        }
    }
}

/// What a part finds. Numbers that may come out as none are options, since JSON has no others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// Names and values.
    Facts {
        of: String,
        rows: Vec<(String, String)>,
    },
    /// Bytes read and written per second.
    Copy {
        what: String,
        bytes_per_second: f64,
    },
    Check(CheckFinding),
    /// The bits of a final state. Those of the same run have to be the same.
    Bits {
        run: String,
        place: String,
        hash: String,
    },
    Speed(Speed),
    Stages {
        case: Case,
        grains: usize,
        clock: String,
        rows: Vec<Stage>,
    },
    Traffic {
        case: Case,
        grains: usize,
        rows: Vec<super::traffic::Row>,
    },
    Variant(Variant),
    /// What the device does not have.
    Lacking {
        what: String,
        why: String,
    },
    /// Something within a part that did not work.
    Failed {
        what: String,
        why: String,
    },
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckFinding {
    pub case: Case,
    pub precision: String,
    pub grains: usize,
    pub contacts: u64,
    pub passed: bool,
    /// How far the engines part when they run freely, mean radii.
    pub trajectory: Option<f64>,
    pub rows: Vec<CheckRow>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckRow {
    pub stage: String,
    pub array: String,
    /// None: no number.
    pub worst: Option<f64>,
    pub tolerance: f64,
    pub passed: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Speed {
    pub case: Case,
    pub grains: usize,
    /// That were timed at once.
    pub steps: u64,
    /// From the scene to the end of the first step, s.
    pub setup_seconds: f64,
    pub ms_per_step: f64,
    /// What the host does of it, besides waiting for the device.
    pub host_ms_per_step: f64,
    /// Of that, for submissions, which is when software drivers compute.
    pub submission_ms_per_step: f64,
    /// And for the next steps, while the device works.
    pub ahead_ms_per_step: f64,
    pub particle_steps_per_second: f64,
    /// On the device.
    pub bytes_per_grain: f64,
    /// Where arrays lie there, and how many.
    pub placements: BTreeMap<String, usize>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    pub stage: String,
    pub calls: u64,
    pub ms_per_call: f64,
    /// Of the wall time.
    pub share: f64,
    /// That a call has to move.
    pub bytes: u64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Variant {
    pub name: String,
    pub grains: usize,
    pub ms_per_step: f64,
    /// Of the default settings, measured in turn.
    pub default_ms_per_step: f64,
    /// Whether both ended with the same bits; None: they are not meant to.
    pub same_bits: Option<bool>,
}

/// How a part has ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Under way, or killed with the whole benchmark.
    Running,
    Done,
    Failed(String),
    /// The machine has not what it takes, such as memory.
    Lacking(String),
    /// And why.
    NotRun(String),
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartRecord {
    pub part: Part,
    /// Wall time.
    pub seconds: f64,
    pub outcome: Outcome,
    pub findings: Vec<Finding>,
}

/// Everything that is known so far.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Record {
    pub version: &'static str,
    pub commit: &'static str,
    /// Seconds since 1970.
    pub started: u64,
    /// To be used.
    pub minutes: f64,
    pub restrictions: Restrictions,
    /// That all parts have had their turn.
    pub finished: bool,
    pub parts: Vec<PartRecord>,
}

impl Record {
    pub fn new(minutes: f64, restrictions: Restrictions) -> Record {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        Record {
            version: env!("CARGO_PKG_VERSION"),
            commit: env!("PACKSTONE_COMMIT"),
            started: now.map_or(0, |since| since.as_secs()),
            minutes,
            restrictions,
            finished: false,
            parts: Vec::new(),
        }
    }

    pub fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.parts.iter().flat_map(|part| &part.findings)
    }

    /// What has gone wrong, in words: parts that failed, checks that did not pass, bits that differ.
    pub fn defects(&self) -> Vec<String> {
        let failed = self.parts.iter().filter_map(|p| match &p.outcome {
            Outcome::Failed(why) => Some(format!("{}: {why}", p.part)),
            _ => None,
        });
        let found = self.findings().filter_map(|finding| match finding {
            Finding::Failed { what, why } => Some(format!("{what}: {why}")),
            Finding::Check(check) if !check.passed => {
                let exceeded = check.rows.iter().filter(|row| !row.passed);
                let names: Vec<String> = exceeded.map(|row| format!("{} {}", row.stage, row.array)).collect();
                Some(format!("check {}, {}: {} exceeded", check.case.name(), check.precision, names.join(", ")))
            }
            Finding::Variant(Variant { name, grains, same_bits: Some(false), .. }) => {
                Some(format!("{name}, {grains} grains: other bits than with the default settings"))
            }
            _ => None,
        });
        let differ = self.runs().into_iter().filter(|(_, all)| all.iter().any(|(_, hash)| *hash != all[0].1));
        let differ = differ.map(|(run, _)| format!("{run}: runs with the same input ended with different bits"));
        failed.chain(found).chain(differ).collect()
    }

    /// All runs with where they were done and the bits they ended with.
    pub fn runs(&self) -> Vec<(&str, Vec<(&str, &str)>)> {
        let mut runs: Vec<(&str, Vec<(&str, &str)>)> = Vec::new();
        for finding in self.findings() {
            let Finding::Bits { run, place, hash } = finding else { continue };
            match runs.iter_mut().find(|(known, _)| known == run) {
                Some((_, all)) => all.push((place, hash)),
                None => runs.push((run, vec![(place, hash)])),
            }
        }
        runs
    }

    /// Parts that are over, also those that failed.
    pub fn tried(&self) -> impl Iterator<Item = &PartRecord> {
        self.parts.iter().filter(|p| matches!(p.outcome, Outcome::Done | Outcome::Failed(_)))
    }

    /// Of every input, how many of all runs that there should be have ended with the bits of the first one.
    pub fn repeated(&self) -> Vec<String> {
        let mut inputs: Vec<(Case, usize, Vec<&String>)> = Vec::new();
        for p in self.tried() {
            let Part::Repeat { case, grains, .. } = p.part else { continue };
            let hashes =
                p.findings.iter().filter_map(|f| if let Finding::Bits { hash, .. } = f { Some(hash) } else { None });
            match inputs.iter_mut().find(|(c, n, _)| (*c, *n) == (case, grains)) {
                Some((.., all)) => all.extend(hashes),
                None => inputs.push((case, grains, hashes.collect())),
            }
        }
        let of_input = |(case, grains, all): (Case, usize, Vec<&String>)| {
            let same = all.iter().filter(|hash| **hash == all[0]).count();
            format!("{} {grains}, {same} of {} runs", case.name(), PROCESSES.len() * RUNS.len())
        };
        inputs.into_iter().map(of_input).collect()
    }
}
