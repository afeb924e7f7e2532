//! How long arrays are, and how long what they hold matters.

use super::records::ColoringState;
use std::ops::Range;

/// Values per tile of the prefix sum: `TILE` of `scan_*.wgsl`.
pub const TILE: usize = 256;
/// Bodies of a workgroup: `GROUP` of `nscd/contact.wgsl`.
pub const GROUP: usize = 64;
/// Parts that the loads on a wall are left in: `WALL_PARTS` of `measure/sums.wgsl`.
pub const WALL_PARTS: usize = 256;
/// Bodies that a row of the measurement adds up, and so many rows at most, which the host adds up.
const BODIES_OF_ROW: usize = 16;
const MOST_ROWS: usize = 1 << 16;

/// Steps of a chunk, at most, for which the host says where walls go, and how radii change.
pub const PATH_STEPS: usize = 256;

/// What the length of an array follows from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    One,
    Bodies,
    BodiesPlusOne,
    BodiesAndWalls,
    Clumps,
    ClumpsPlusOne,
    Walls,
    /// Walls for each of [`PATH_STEPS`].
    WallPaths,
    Materials,
    MaterialsSquared,
    /// Materials for each of [`PATH_STEPS`].
    GrowthPaths,
    Levels,
    CellsPlusOne,
    Tiles,
    /// Of lists, see `neighbours/entries.wgsl`.
    SlicesPlusOne,
    Entries,
    History,
    Contacts,
    Colors,
    PartialSums,
    /// For each of these one of every wall, and sums of them.
    WallLoadSums,
    WallLoads,
    /// Workgroups that walk lists, then groups of [`GROUP`] clumps.
    Groups,
    /// Nothing, until somebody asks for what it holds.
    OnDemand,
}

impl Length {
    /// Whether it follows from how many grains there are now.
    pub fn is_of_grains(self) -> bool {
        match self {
            Length::Bodies
            | Length::BodiesPlusOne
            | Length::BodiesAndWalls
            | Length::Clumps
            | Length::ClumpsPlusOne
            | Length::Tiles
            | Length::SlicesPlusOne
            | Length::PartialSums
            | Length::WallLoadSums
            | Length::Groups => true,
            Length::One
            | Length::Walls
            | Length::WallPaths
            | Length::Materials
            | Length::MaterialsSquared
            | Length::GrowthPaths
            | Length::Levels
            | Length::CellsPlusOne
            | Length::Entries
            | Length::History
            | Length::Contacts
            | Length::Colors
            | Length::WallLoads
            | Length::OnDemand => false,
        }
    }
}

/// How long the content of an array matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lifetime {
    /// The scene says it, and it never changes.
    Scene,
    /// Later steps depend on it: a checkpoint has it.
    State,
    /// Of a step, of the making of lists, of a sample: written before it is read.
    Scratch,
}

/// The numbers all lengths follow from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sizes {
    pub bodies: usize,
    /// Those of them that workgroups serve, one each.
    pub large: usize,
    /// Of all others, 2^slice_shift lists lie side by side.
    pub slice_shift: u32,
    pub clumps: usize,
    pub walls: usize,
    pub materials: usize,
    /// Of the grid, and the cells of all of them.
    pub levels: usize,
    pub cells: usize,
    pub entries: usize,
    pub history: usize,
    /// Contact dynamics by colours: contacts and colours that there is room for.
    pub contacts: usize,
    pub colors: usize,
}

impl Sizes {
    /// Make room for all colours and contacts, with some to spare: whether there was too little.
    pub fn make_room(&mut self, coloring_state: &ColoringState) -> bool {
        let (colors, contacts) = (coloring_state.colors as usize, coloring_state.contacts as usize);
        let short = colors > self.colors || contacts > self.contacts;
        if short {
            self.colors = self.colors.max(2 * colors);
            self.contacts = self.contacts.max(contacts + contacts / 4);
        }
        short
    }

    /// Those of a scene of the same kind with so many bodies, in which every listed pair is in contact.
    pub fn for_bodies(&self, bodies: usize) -> Sizes {
        let scaled = |count: usize| (count as u128 * bodies as u128).div_ceil(self.bodies.max(1) as u128) as usize;
        let entries = scaled(self.entries);
        Sizes {
            bodies,
            large: scaled(self.large),
            clumps: scaled(self.clumps),
            cells: scaled(self.cells),
            entries,
            history: entries / 2,
            contacts: scaled(self.contacts),
            ..*self
        }
    }

    /// As lists are in a dense packing, whatever they are at the start: half as long again as they are thought to be before
    /// they are made, and every other entry one of a contact.
    pub fn of_dense_packing(&self) -> Sizes {
        let entries = self.entries + self.entries / 2;
        Sizes { entries, history: entries / 2, ..*self }
    }

    /// Workgroups that walk the lists of all bodies: one for each large grain, which come first, and for [`GROUP`] others.
    pub fn list_groups(&self) -> usize {
        self.large + (self.bodies - self.large).div_ceil(GROUP)
    }

    /// Slices of lists.
    pub fn slices(&self) -> usize {
        self.slice_of(self.bodies)
    }

    /// Rows of the measurement.
    pub fn partial_sums(&self) -> usize {
        self.bodies.div_ceil(BODIES_OF_ROW).clamp(1, MOST_ROWS)
    }

    /// The slice that grain i is in; large grains have one each.
    #[inline(always)]
    pub fn slice_of(&self, i: usize) -> usize {
        let others = self.bodies - self.large;
        if i < others { i >> self.slice_shift } else { others.div_ceil(1 << self.slice_shift) + (i - others) }
    }

    /// The grains in a slice, and how many lists lie side by side there.
    pub fn lists_of_slice(&self, slice: usize) -> (Range<usize>, usize) {
        let others = self.bodies - self.large;
        let lists = 1 << self.slice_shift;
        match slice.checked_sub(others.div_ceil(lists)) {
            None => (slice * lists..((slice + 1) * lists).min(others), lists),
            Some(large) => (others + large..others + large + 1, 1),
        }
    }

    /// Number of elements. Never 0: a device has no empty buffers.
    pub fn of(&self, length: Length) -> usize {
        let len = match length {
            Length::One => 1,
            Length::Bodies => self.bodies,
            Length::BodiesPlusOne => self.bodies + 1,
            Length::BodiesAndWalls => self.bodies + self.walls,
            Length::Clumps => self.clumps,
            Length::ClumpsPlusOne => self.clumps + 1,
            Length::Walls => self.walls,
            Length::WallPaths => self.walls * PATH_STEPS,
            Length::Materials => self.materials,
            Length::GrowthPaths => self.materials * PATH_STEPS,
            Length::MaterialsSquared => self.materials * self.materials,
            Length::Levels => self.levels,
            Length::CellsPlusOne => self.cells + 1,
            Length::Tiles => self.cells.max(self.bodies) / TILE + 1,
            Length::SlicesPlusOne => self.slices() + 1,
            Length::Entries => self.entries,
            Length::History => self.history,
            Length::Contacts => self.contacts,
            Length::Colors => self.colors,
            Length::PartialSums => self.partial_sums(),
            Length::WallLoadSums => self.partial_sums() * self.walls,
            Length::WallLoads => WALL_PARTS * self.walls,
            Length::Groups => self.list_groups() + self.clumps.div_ceil(GROUP),
            Length::OnDemand => 0,
        };
        len.max(1)
    }
}
