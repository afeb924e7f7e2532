//! Where grains come in and leave, and what has done so.

use super::setup::counted;
use crate::{
    measure::OpeningsSample,
    scene::{Assembly, Clump, Grain, Insertion, Numbers, Rate},
    state::{Params, Sizes},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::ops::Add;

/// What has come in of an [`Insertion`] so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inlet {
    /// Grains, or clumps.
    pub inserted: usize,
    /// kg
    pub mass: f64,
    /// Batches that ended because there was no room for a grain.
    pub full: u64,
    /// Batches so far.
    pub batches: u64,
    /// Whether the last one ended so.
    pub waits: bool,
}

/// What has left by an [`Outlet`](crate::scene::Outlet) so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outlet {
    /// Grains, or clumps.
    pub removed: u64,
    /// kg
    pub mass: f64,
    /// kg m/s
    pub momentum: DVec3,
    /// When it was asked for its flow, s, and the mass then.
    pub(super) asked: (f64, f64),
}

/// What a row of the history says of an outlet.
#[derive(Clone, Debug, PartialEq)]
pub struct Outflow {
    pub name: String,
    /// Grains, or clumps, so far.
    pub removed: u64,
    /// kg
    pub mass: f64,
    /// kg/s since it was asked before.
    pub rate: f64,
}

/// How far that is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    pub inlets: Vec<Inlet>,
    pub outlets: Vec<Outlet>,
    /// J
    pub inserted_energy: f64,
    pub removed_energy: f64,
}

/// Where grains come in and leave.
pub struct Openings {
    pub progress: Progress,
    /// The scene's grains and clumps at time 0, and their numbers.
    pub start: (Vec<Grain>, Vec<Clump>, Numbers),
    /// Of the scene, as checkpoints know it.
    pub checksum: u32,
    /// Grains above this radius are large, m.
    large: f64,
    /// Steps from one batch, and from one look, to the next.
    pub batches: Vec<u64>,
    pub looks: Vec<u64>,
}

/// A grain, or clump, that comes in: of which insertion, which of its grains, and where to.
pub struct Arrival {
    pub insertion: usize,
    pub number: usize,
    pub position: DVec3,
}

impl Openings {
    /// Of a scene at time 0, whose grains get their numbers.
    pub fn new(assembly: &mut Assembly, dt: f64) -> Openings {
        let (large, checksum) = (assembly.whole().largest_common_radius(), assembly.checksum());
        if assembly.numbers == Numbers::default() {
            let all = |count: usize| (0..count as u32).collect();
            assembly.numbers = Numbers { grains: all(assembly.grains.len()), clumps: all(assembly.clumps.len()) };
        }
        Openings {
            progress: Progress {
                inlets: vec![Inlet::default(); assembly.insertions.len()],
                outlets: vec![Outlet::default(); assembly.outlets.len()],
                ..Progress::default()
            },
            start: (assembly.grains.clone(), assembly.clumps.clone(), assembly.numbers.clone()),
            checksum,
            large,
            batches: assembly.insertions.iter().map(|insertion| insertion.interval(assembly, dt)).collect(),
            looks: assembly.outlets.iter().map(|outlet| outlet.interval(dt)).collect(),
        }
    }

    /// Sizes and parameters with these grains.
    pub fn counted(&self, assembly: &Assembly, sizes: &Sizes, params: &Params) -> (Sizes, Params) {
        counted(assembly, self.large, sizes, params)
    }

    pub fn sample(&self, particles: usize) -> OpeningsSample {
        let Progress { inlets, outlets, inserted_energy, removed_energy } = &self.progress;
        OpeningsSample {
            particles: particles as u64,
            inserted: inlets.iter().map(|inlet| inlet.inserted as u64).sum(),
            inserted_mass: inlets.iter().map(|inlet| inlet.mass).fold(0.0, f64::add),
            removed: outlets.iter().map(|outlet| outlet.removed).sum(),
            removed_mass: outlets.iter().map(|outlet| outlet.mass).fold(0.0, f64::add),
            inserted_energy: *inserted_energy,
            removed_energy: *removed_energy,
        }
    }
}

impl Inlet {
    /// Whether no more will come in after this time, s.
    pub fn is_done(&self, insertion: &Insertion, time: f64) -> bool {
        self.inserted == insertion.count() || self.mass >= insertion.most_mass || time > insertion.stop
    }

    /// Whether number `inserted`, of this mass, should have come in.
    pub fn is_due(&self, insertion: &Insertion, time: f64, mass: f64) -> bool {
        // What a sum of times has lost must not cost a grain.
        let due = insertion.due(time) * (1.0 + 1e-9);
        match insertion.rate {
            Rate::Number(_) => self.inserted as f64 + 1.0 <= due,
            Rate::Mass(_) => self.mass + mass <= due,
        }
    }
}
