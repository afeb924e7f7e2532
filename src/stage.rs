//! What a stage is: a kernel in `shaders/CHAPTER/KERNEL.wgsl` beside its CPU twin in f64, `src/CHAPTER/KERNEL.rs`. The
//! stages themselves stand in their chapters.
//!
//! A twin is a function of one body mapped over all of them; nothing in it is clever enough to need reading twice.

use crate::state::{Array, Sizes, State};
use std::hash::{Hash, Hasher};

/// How many invocations a stage needs.
#[derive(Clone, Copy, Debug)]
pub enum Dispatch {
    /// One invocation per item.
    Items(fn(&Sizes) -> usize),
    /// A single workgroup.
    OneGroup,
    /// One workgroup per item.
    GroupEach(fn(&Sizes) -> usize),
}

/// One kernel: its name, its WGSL, its CPU twin, its dispatch size.
#[derive(Debug)]
pub struct Stage {
    /// Unique name, for plans, `check` and timings.
    pub name: &'static str,
    /// Folder in `shaders/` and `src/`.
    pub chapter: &'static str,
    /// Entry point, and stem of the file in the chapter.
    pub kernel: &'static str,
    /// The same on the CPU, in f64.
    pub twin: fn(&mut State),
    pub dispatch: Dispatch,
    /// WGSL bindings that stand for an array of another name.
    pub bind: &'static [(&'static str, &'static Array)],
    pub check: Check,
}

/// How `check` compares what a kernel writes with what its twin writes.
#[derive(Debug)]
pub struct Check {
    /// Arrays whose order inside a cell is arbitrary until `order_cells` has run; compared as multisets.
    pub unordered: &'static [&'static Array],
    /// Arrays whose order inside a list is arbitrary until `order_neighbours` has run; compared list by list.
    pub unordered_lists: &'static [&'static Array],
    /// Rows that are not compared.
    pub undecided: Undecided,
    pub tolerance: Tolerance,
    /// Magnitudes that a difference is compared with where an array has no larger value.
    pub floors: &'static [Floor],
    /// The same of each number of a record.
    pub member_floors: &'static [MemberFloors],
}

/// Arrays, and the floor that they have in common, in their unit.
pub type Floor = (&'static [&'static Array], fn(&State) -> f64);

/// An array of records, and the numbers of a record of floors.
pub type MemberFloors = (&'static Array, fn(&State) -> Vec<f64>);

/// What rounding may decide, so that no tolerance can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Undecided {
    Nothing,
    /// Whether two surfaces touch: with a dashpot the force jumps there.
    Contacts,
    /// The same for contacts of a clump.
    ContactsOfClumps,
    /// Whether a neighbour is within the reach of the lists.
    Reach,
}

/// What rounding may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tolerance {
    /// A few roundings of the largest term.
    Rounding,
    /// The same for forces: in double precision a gap is the difference of a distance and two radii, so what depends on
    /// forces loses as many digits as the overlap is smaller than a grain.
    Overlap,
    /// In this array sums of small differences, some of either sign.
    Cancellation(&'static Array),
}

impl Tolerance {
    /// A few, over the largest term.
    pub const ROUNDINGS: f64 = 64.0;
    /// Those of sums of small differences.
    pub const CANCELLED_ROUNDINGS: f64 = 1e4;
}

impl Check {
    /// A few roundings everywhere.
    pub const ROUNDING: Check = Check {
        unordered: &[],
        unordered_lists: &[],
        undecided: Undecided::Nothing,
        tolerance: Tolerance::Rounding,
        floors: &[],
        member_floors: &[],
    };
    /// Of forces.
    pub const FORCES: Check =
        Check { undecided: Undecided::Contacts, tolerance: Tolerance::Overlap, ..Check::ROUNDING };
    /// Of forces on clumps.
    pub const FORCES_ON_CLUMPS: Check = Check { undecided: Undecided::ContactsOfClumps, ..Check::FORCES };
}

impl PartialEq for Stage {
    fn eq(&self, other: &Stage) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Eq for Stage {}

impl Hash for Stage {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name.hash(state);
    }
}

impl Stage {
    /// A stage of a chapter whose kernel has its name.
    pub const fn new(
        chapter: &'static str,
        name: &'static str,
        twin: fn(&mut State),
        items: fn(&Sizes) -> usize,
    ) -> Stage {
        Stage { name, chapter, kernel: name, twin, dispatch: Dispatch::Items(items), bind: &[], check: Check::ROUNDING }
    }

    /// The same of one that walks the lists of all bodies.
    pub const fn over_lists(chapter: &'static str, name: &'static str, twin: fn(&mut State)) -> Stage {
        Stage { dispatch: Dispatch::GroupEach(list_groups), ..Stage::new(chapter, name, twin, list_groups) }
    }

    /// Its WGSL, relative to `shaders/`.
    pub fn file(&self) -> String {
        format!("{}/{}.wgsl", self.chapter, self.kernel)
    }

    /// The array a WGSL binding stands for; None for what is no array of the state.
    pub fn array(&self, binding: &str) -> Option<&'static Array> {
        self.bind.iter().find(|(from, _)| *from == binding).map(|(_, to)| *to).or_else(|| Array::named(binding))
    }
}

pub fn bodies(sizes: &Sizes) -> usize {
    sizes.bodies
}

pub fn clumps(sizes: &Sizes) -> usize {
    sizes.clumps
}

/// Workgroups that walk the lists of all bodies.
pub fn list_groups(sizes: &Sizes) -> usize {
    sizes.list_groups()
}

/// Grains that workgroups serve, one each.
pub fn large(sizes: &Sizes) -> usize {
    sizes.large
}

pub fn bodies_plus_one(sizes: &Sizes) -> usize {
    sizes.bodies + 1
}
