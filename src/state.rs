//! Twin of `shaders/state.wgsl`: every array by name, the same name in Rust and in WGSL, with its length and unit.
//!
//! The CPU engine works on this struct; the GPU engine keeps buffers of the same names, whose layout it reads from the
//! WGSL text, so that no struct is described twice. On the CPU a plane is space with z = 0.

use crate::{
    model::{Grains, History, Levels, Materials, Method, Model, Precision, Rolling, Rotation, Tangential, Walls},
    record::record,
    units::{Quantity, Units},
};
pub use crate::{record::Element, solve::momentum::SolverState};
use glam::{DVec3, DVec4, UVec3};
use std::{
    any::Any,
    fmt,
    hash::{Hash, Hasher},
    ops::Range,
};

/// Content of a list entry: `NONE`, `INDEX` and `ACTIVE` of `state.wgsl`.
pub const NONE: u32 = u32::MAX;
pub const INDEX: u32 = u32::MAX >> 1;
pub const ACTIVE: u32 = !INDEX;
/// `halt` counts the steps of a chunk; from here on it says that no more are to be done.
pub const HALTED: u32 = 1 << 31;
/// Values per tile of the prefix sum: `TILE` of `scan_*.wgsl`.
pub const TILE: usize = 256;
/// Bodies of a workgroup: `GROUP` of `nscd/contact.wgsl`.
pub const GROUP: usize = 64;
/// Bodies that a row of the measurement adds up, and so many rows at most, which the host adds up.
const BODIES_OF_ROW: usize = 16;
const MOST_ROWS: usize = 1 << 16;

/// An angular quantity: three components in space, one about z in the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spin(pub DVec3);

impl Element for Spin {
    fn put(&self, dims: usize, sink: &mut impl FnMut(f64)) {
        if dims == 2 { sink(self.0.z) } else { self.0.put(dims, sink) }
    }
    fn take(dims: usize, source: &mut impl FnMut() -> f64) -> Spin {
        Spin(if dims == 2 { DVec3::new(0.0, 0.0, source()) } else { DVec3::take(dims, source) })
    }
}

/// A vector without the padding that arrays of vectors have on a device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Packed(pub DVec3);

impl Element for Packed {
    fn names(dims: usize) -> &'static [&'static str] {
        &["x", "y", "z"][..dims]
    }
    fn put(&self, dims: usize, sink: &mut impl FnMut(f64)) {
        self.0.put(dims, sink);
    }
    fn take(dims: usize, source: &mut impl FnMut() -> f64) -> Packed {
        Packed(DVec3::take(dims, source))
    }
}

/// The turn from the axes of a body to those of the scene: a unit quaternion (x, y, z, w), in the plane (z, w) of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orientation(pub DVec4);

impl Element for Orientation {
    fn put(&self, dims: usize, sink: &mut impl FnMut(f64)) {
        self.0.to_array()[if dims == 2 { 2 } else { 0 }..].iter().for_each(|c| sink(*c));
    }
    fn take(dims: usize, source: &mut impl FnMut() -> f64) -> Orientation {
        let mut q = [0.0; 4];
        q[if dims == 2 { 2 } else { 0 }..].iter_mut().for_each(|c| *c = source());
        Orientation(q.into())
    }
}

/// What single precision leaves out of a velocity or a spin: parts of a unit in the last place, packed. Empty in double
/// precision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LowBits(pub [u32; 2]);

impl Element for LowBits {
    const INTEGER: bool = true;
    fn put(&self, _: usize, sink: &mut impl FnMut(f64)) {
        self.0.iter().for_each(|bits| sink(f64::from(*bits)));
    }
    fn take(_: usize, source: &mut impl FnMut() -> f64) -> LowBits {
        LowBits(std::array::from_fn(|_| source() as u32))
    }
}

record!(
    /// Where a grain is. Units and meaning of all records: `shaders/state.wgsl`.
    Position { x: DVec3 [Length], radius: f64 [Length] }
);
record!(
    /// What single precision leaves out of a place.
    PositionLow { x: DVec3 [Length], radius: f64 [Length] }
);
record!(
    /// How a grain moves.
    Velocity { v: DVec3 [Velocity], inverse_mass: f64 [InverseMass] }
);
record!(
    /// What single precision leaves out of velocity and spin.
    VelocityLow { v: LowBits, spin: LowBits }
);
record!(
    /// Contact parameters of a pair of materials.
    Pair {
        stiffness: f64 [NormalStiffness],
        tangential_stiffness: f64 [TangentialStiffness],
        friction: f64,
        dashpot: f64 [Dashpot],
    }
);
record!(
    /// Parameters of rolling resistance of a pair of materials (`shaders/contact/rolling/elastic_plastic.wgsl`).
    RollingPair { friction: f64, stiffness: f64, damping: f64 }
);
record!(
    /// A wall (`shaders/space/walls/some.wgsl`).
    Wall {
        point: DVec3 [Length],
        low: DVec3 [Length],
        normal: DVec3,
        normal_low: DVec3,
        velocity: DVec3 [Velocity],
        radius: f64 [Length],
        radius_low: f64 [Length],
        spin: f64 [Rate],
    }
);
record!(
    /// A level of the grid (`shaders/neighbours/grid.wgsl`).
    Level { inverse_cell: DVec3 [InverseLength], radius: f64 [Length], cells: UVec3, first_cell: u32, strip: u32 }
);
record!(
    /// What the device tells the host once per chunk.
    Counters {
        entries_needed: u32,
        steps_done: u32,
        max_displacement: u32,
        max_coordinate: u32,
        lost_body: u32,
        active_contacts: u32,
        restored_contacts: u32,
        unlisted: u32,
    }
);
record!(
    /// A row of the measurement (`shaders/measure/measure.wgsl`).
    PartialSums {
        kinetic: f64 [Energy],
        potential: f64 [Energy],
        elastic: f64 [Energy],
        net_force: f64 [Force],
        contact_force: f64 [Force],
        dissipation: f64 [Power],
        sliding: f64 [Power],
        wall_power: f64 [Power],
        fixed_power: f64 [Power],
        overlap: f64,
        sides: u32,
        single_sides: u32,
    }
);
record!(
    /// Dissipation and works since the host has read them (`shaders/measure/sums.wgsl`).
    Works { dissipated: f64 [Energy], walls: f64 [Energy], fixed: f64 [Energy] }
);
record!(
    /// A contact of a step of contact dynamics (this and the next: `shaders/nscd/contact.wgsl`).
    ContactGeometry { n: DVec3, speed: f64 [Velocity] }
);
record!(
    /// What an impulse does to the two of a contact.
    InverseEffectiveMass {
        arm: f64 [Length],
        arm_to: f64 [Length],
        normal: f64 [InverseMass],
        tangential: f64 [InverseMass],
    }
);
record!(
    /// Sums of a group of grains.
    ResidualSums {
        reference: f64 [VelocitySquared],
        lipschitz_bound: f64,
        residual_squared: f64 [VelocitySquared],
        restart_criterion: f64 [Energy],
        curvature: f64 [Energy],
        step_squared: f64 [Energy],
        largest_residual: f64,
        resolved_residual: f64,
        max_normal_impulse: f64 [Impulse],
        coulomb_excess: f64 [Impulse],
        late_contacts: u32,
    }
);
record!(
    /// The colour of a contact (this and the next four: `shaders/nscd/coloring/priority.wgsl`).
    ContactColor { color: u32, rank: u32 }
);
record!(
    /// A contact in the order of the colours.
    ColoredContact { first: u32, second: u32, entry: u32, back: u32 }
);
record!(
    /// How far a pass is.
    ColorCursor { colors: u32, contacts: u32 }
);
record!(
    /// How far the colouring is.
    ColoringState { uncolored: u32, colors: u32, contacts: u32 }
);
record!(
    /// Contacts of a grain that have no colour.
    LargeContacts { small: u32, heavy: u32 }
);
record!(
    /// How hard the iterations for the rotation of clumps had to work (`shaders/body/grains/clumps.wgsl`).
    RotationIterations { most: u32, capped: u32 }
);
record!(
    /// What every kernel may know.
    Params {
        gravity: DVec3 [Acceleration],
        lower: DVec3 [Length],
        upper: DVec3 [Length],
        period: DVec3 [Length],
        period_low: DVec3 [Length],
        inverse_period: DVec3 [InverseLength],
        cell_origin: DVec3 [Length],
        dt: f64 [Time],
        history_dt: f64 [Time],
        damping: f64 [Rate],
        reach: f64 [Length],
        margin: f64 [Length],
        quantum: f64 [Length],
        inverse_quantum: f64 [InverseLength],
        position_slack: f64 [Length],
        length_unit: f64 [Length],
        inverse_length_unit: f64 [InverseLength],
        arm_unit: f64 [Length],
        inverse_arm_unit: f64 [InverseLength],
        step_limit: f64 [Length],
        displacement_limit: f64 [Length],
        tolerance: f64,
        load_fraction: f64,
        load_rounding: f64,
        max_momentum: f64,
        max_correction_velocity: f64 [Velocity],
        wall_depth: f64 [Length],
        turn_limit: f64,
        gap_band: f64 [Length],
        pair: Pair,
        axes: UVec3,
        cells: u32,
        levels: u32,
        bodies: u32,
        large: u32,
        slice_shift: u32,
        clumps: u32,
        arm_shift: u32,
        arm_shift_fine: u32,
        walls: u32,
        materials: u32,
        partial_sums_len: u32,
        entries: u32,
        history: u32,
        colors: u32,
        step: u32,
    }
);

impl Params {
    /// As a device in single precision sees them.
    pub fn rounded(&self, dims: usize, units: &Units) -> Params {
        let quantities = Params::quantities(Quantity::Number, dims);
        let lanes = self.lanes(dims).into_iter().zip(quantities);
        // Counts may be more than f32 has digits for.
        let mut lanes = lanes.map(|(x, q)| if x == x.trunc() && x.abs() < 4.3e9 { x } else { units.rounded(q, x) });
        Params::take(dims, &mut || lanes.next().expect("as many lanes as were put"))
    }
}

/// An array behind its name: what engines need to move it between host and device.
pub trait Column: Any {
    /// Number of elements.
    fn len(&self) -> usize;
    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Bytes of an element.
    fn stride(&self) -> usize;
    /// Change the length; new elements are zero.
    fn resize(&mut self, len: usize);
    /// Member names of a record, empty for plain values.
    fn names(&self, dims: usize) -> &'static [&'static str];
    /// Number of lanes of each member of an element.
    fn widths(&self, dims: usize) -> Vec<usize>;
    /// What the lanes of an element measure; a plain value measures `of`.
    fn quantities(&self, of: Quantity, dims: usize) -> Vec<Quantity>;
    /// Whether elements are whole numbers.
    fn integer(&self) -> bool;
    /// All lanes, element by element.
    fn lanes(&self, dims: usize, sink: &mut dyn FnMut(f64));
    /// Overwrite all elements from lanes.
    fn fill(&mut self, dims: usize, source: &mut dyn FnMut() -> f64);
    /// A copy of some elements.
    fn duplicate(&self, elements: Range<usize>) -> Box<dyn Any>;
    /// Overwrite elements, from number `first` on, with all of another array of this kind.
    fn overwrite(&mut self, first: usize, content: &dyn Column);
    /// Put another array's content here and hand the old content back; anything but an array of this kind empties it.
    fn replace(&mut self, content: Box<dyn Any>) -> Box<dyn Any>;
}

impl<T: Element> Column for Vec<T> {
    fn len(&self) -> usize {
        self.len()
    }
    fn stride(&self) -> usize {
        size_of::<T>()
    }
    fn resize(&mut self, len: usize) {
        self.resize(len, T::default());
    }
    fn names(&self, dims: usize) -> &'static [&'static str] {
        T::names(dims)
    }
    fn widths(&self, dims: usize) -> Vec<usize> {
        T::widths(dims)
    }
    fn quantities(&self, of: Quantity, dims: usize) -> Vec<Quantity> {
        T::quantities(of, dims)
    }
    fn integer(&self) -> bool {
        T::INTEGER
    }
    fn lanes(&self, dims: usize, sink: &mut dyn FnMut(f64)) {
        self.iter().for_each(|e| e.put(dims, &mut |x| sink(x)));
    }
    fn fill(&mut self, dims: usize, source: &mut dyn FnMut() -> f64) {
        self.iter_mut().for_each(|e| *e = T::take(dims, &mut || source()));
    }
    fn duplicate(&self, elements: Range<usize>) -> Box<dyn Any> {
        Box::new(self[elements].to_vec())
    }
    fn overwrite(&mut self, first: usize, content: &dyn Column) {
        let content = (content as &dyn Any).downcast_ref::<Vec<T>>().expect("an array of the same kind");
        self[first..first + content.len()].clone_from_slice(content);
    }
    fn replace(&mut self, content: Box<dyn Any>) -> Box<dyn Any> {
        let content = content.downcast::<Vec<T>>().map(|v| *v).unwrap_or_default();
        Box::new(std::mem::replace(self, content))
    }
}

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
    MaterialsSquared,
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
    /// Workgroups that walk lists, then groups of [`GROUP`] clumps.
    Groups,
    /// Nothing, until somebody asks for what it holds.
    OnDemand,
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
            Length::Groups => self.list_groups() + self.clumps.div_ceil(GROUP),
            Length::OnDemand => 0,
        };
        len.max(1)
    }
}

/// An entry of the dictionary: `&array::POSITION` is the handle of the array `position`.
pub struct Array {
    /// In Rust and in WGSL.
    pub name: &'static str,
    pub length: Length,
    pub lifetime: Lifetime,
    /// What the numbers measure; those of a record say it themselves.
    pub quantity: Quantity,
    /// What else there is to say of them.
    pub note: &'static str,
    /// Whether the array exists under a model.
    pub needed: fn(&Model) -> bool,
    column: fn(&State) -> &dyn Column,
    column_mut: fn(&mut State) -> &mut dyn Column,
}

impl PartialEq for Array {
    fn eq(&self, other: &Array) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Eq for Array {}

impl Hash for Array {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name.hash(state);
    }
}

impl fmt::Debug for Array {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// Declares `State` and its dictionary in one table; what records measure, they say themselves.
macro_rules! state {
    (@quantity -) => { Quantity::Number };
    (@quantity $quantity:ident) => { Quantity::$quantity };
    ($($handle:ident $name:ident: $ty:ty, $length:ident, $lifetime:ident, $quantity:tt, $note:literal, $needed:expr;)*) => {
        /// All arrays, with what the scene chose and the numbers kernels may know. An array may be missing, or be a
        /// piece of what an engine has.
        #[derive(Clone, Debug)]
        pub struct State {
            pub model: Model,
            pub sizes: Sizes,
            pub params: Params,
            /// What a device computes in; the numbers here are in SI units.
            pub units: Units,
            /// How far from the origin positions in single precision may go along open axes, m.
            pub range: f64,
            $(pub $name: Vec<$ty>,)*
        }

        /// The handles of the arrays.
        pub mod array {
            use super::*;
            $(pub static $handle: Array = Array {
                name: stringify!($name),
                length: Length::$length,
                lifetime: Lifetime::$lifetime,
                quantity: state!(@quantity $quantity),
                note: $note,
                needed: $needed,
                column: |s| &s.$name,
                column_mut: |s| &mut s.$name,
            };)*
        }

        /// The dictionary of arrays.
        pub static ARRAYS: &[&Array] = &[$(&array::$handle,)*];

        impl State {
            /// A state without arrays.
            pub fn bare(model: Model, sizes: Sizes, params: Params) -> State {
                let (units, range) = (Units::default(), f64::INFINITY);
                State { model, sizes, params, units, range, $($name: Vec::new(),)* }
            }
        }
    };
}

impl State {
    /// A state of zeros with exactly the arrays that the model needs.
    pub fn new(model: Model, sizes: Sizes, params: Params) -> State {
        let mut state = State::bare(model, sizes, params);
        state.complete();
        state
    }

    /// Arrays of zeros in place of those that the model needs and that are not here.
    pub fn complete(&mut self) {
        for array in present(&self.model, ARRAYS) {
            if self.column(array).is_empty() {
                let len = self.sizes.of(array.length);
                self.column_mut(array).resize(len);
            }
        }
    }

    /// Bytes of all arrays that the model needs, of these sizes.
    pub fn bytes(&self, sizes: &Sizes) -> u64 {
        let of = |array: &Array| sizes.of(array.length) as u64 * self.column(array).stride() as u64;
        present(&self.model, ARRAYS).into_iter().map(of).sum()
    }

    /// Let go of arrays.
    pub fn release(&mut self, arrays: &[&'static Array]) {
        for array in arrays {
            self.column_mut(array).replace(Box::new(()));
        }
    }

    pub fn column(&self, array: &Array) -> &dyn Column {
        (array.column)(self)
    }

    /// The unit of an array, member by member, and what else there is to say of its numbers.
    pub fn unit_text(&self, array: &Array) -> String {
        let (quantities, mut lane) = (self.quantities(array), 0);
        let mut parts: Vec<&str> = Vec::new();
        for width in self.column(array).widths(self.model.dims()) {
            parts.push(quantities[lane].unit());
            lane += width;
        }
        if parts.iter().all(|part| *part == "1") {
            parts.clear();
        }
        parts.extend(Some(array.note).filter(|note| !note.is_empty()));
        parts.join(", ")
    }

    /// What the lanes of an element of an array measure.
    pub fn quantities(&self, array: &Array) -> Vec<Quantity> {
        self.column(array).quantities(array.quantity, self.model.dims())
    }

    pub fn column_mut(&mut self, array: &Array) -> &mut dyn Column {
        (array.column_mut)(self)
    }

    /// Exchange two arrays of the same kind.
    pub fn swap(&mut self, a: &Array, b: &Array) {
        let first = self.column_mut(a).replace(Box::new(()));
        let second = self.column_mut(b).replace(first);
        self.column_mut(a).replace(second);
    }

    /// Whether there are entries for all neighbours.
    pub fn lists_fit(&self) -> bool {
        self.all_entries() <= self.neighbour.len()
    }

    /// Entries of all lists.
    pub fn all_entries(&self) -> usize {
        self.list_start[self.sizes.slices()] as usize
    }

    /// The list entries of grain i.
    #[inline(always)]
    pub fn row(&self, i: usize) -> Row {
        let slice = self.sizes.slice_of(i);
        let shift = if i < self.sizes.bodies - self.sizes.large { self.sizes.slice_shift } else { 0 };
        let lane = i & ((1 << shift) - 1);
        let [next, end] = [slice, slice + 1].map(|slice| self.list_start[slice] as usize + lane);
        Row { next, end, shift }
    }
}

impl Array {
    /// The entry of this name, as WGSL has it.
    pub fn named(name: &str) -> Option<&'static Array> {
        ARRAYS.iter().copied().find(|a| a.name == name)
    }

    /// The name of the array whose WGSL declaration gives this one its layout: what comes next, or was before, is laid
    /// out like what is.
    pub fn original(&self) -> &'static str {
        let name = self.name;
        name.strip_suffix("_next").or_else(|| name.strip_suffix("_before")).unwrap_or(name)
    }
}

/// The entries of a list, every 2^shift-th from the first on: `List` of `neighbours/entries.wgsl`.
#[derive(Clone, Debug)]
pub struct Row {
    next: usize,
    end: usize,
    shift: u32,
}

impl Row {
    /// Counted from this entry on.
    #[inline(always)]
    pub fn from(self, begin: usize) -> Row {
        Row { next: self.next - begin, end: self.end - begin, ..self }
    }
}

impl Iterator for Row {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let entry = self.next;
        self.next += 1 << self.shift;
        (entry < self.end).then_some(entry)
    }

    #[inline(always)]
    fn nth(&mut self, n: usize) -> Option<usize> {
        self.next += n << self.shift;
        self.next()
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.end.saturating_sub(self.next) >> self.shift;
        (left, Some(left))
    }
}

impl ExactSizeIterator for Row {}

/// Those of the arrays that a model needs.
pub fn present<'a>(model: &Model, arrays: impl IntoIterator<Item = &'a &'static Array>) -> Vec<&'static Array> {
    arrays.into_iter().copied().filter(|a| (a.needed)(model)).collect()
}

fn always(_: &Model) -> bool {
    true
}
fn single(m: &Model) -> bool {
    m.precision == Precision::Single
}
fn frictional(m: &Model) -> bool {
    m.tangential != Tangential::None && !rigid(m)
}
fn rolling(m: &Model) -> bool {
    m.rolling != Rolling::None
}
fn remembering(m: &Model) -> bool {
    m.history == History::Kept
}
fn rotating(m: &Model) -> bool {
    m.rotation == Rotation::Sphere
}
fn mixed(m: &Model) -> bool {
    m.materials == Materials::Many
}
fn rigid(m: &Model) -> bool {
    m.method == Method::ContactDynamics
}
fn rigid_rotating(m: &Model) -> bool {
    rigid(m) && rotating(m)
}
fn clumped(m: &Model) -> bool {
    m.grains == Grains::Clumps
}
fn soft_clumped(m: &Model) -> bool {
    clumped(m) && !rigid(m)
}
fn rigid_clumped(m: &Model) -> bool {
    rigid(m) && clumped(m)
}
fn single_clumped(m: &Model) -> bool {
    clumped(m) && single(m)
}
fn single_spheres(m: &Model) -> bool {
    !clumped(m) && single(m)
}
fn leveled(m: &Model) -> bool {
    m.levels == Levels::Several
}
fn working(m: &Model) -> bool {
    m.works
}
fn colored(m: &Model) -> bool {
    m.colored
}
fn colored_with_large(m: &Model) -> bool {
    m.colored && m.large_grains
}
fn walled(m: &Model) -> bool {
    m.walls == Walls::Some
}

state! {
    POSITION position: Position, Bodies, State, -, "", always;
    POSITION_NEXT position_next: Position, Bodies, Scratch, -, "", always;
    POSITION_LOW position_low: PositionLow, Bodies, State, -, "beyond f32", single;
    POSITION_LOW_NEXT position_low_next: PositionLow, Bodies, Scratch, -, "beyond f32", single;
    VELOCITY velocity: Velocity, Bodies, State, -, "", always;
    VELOCITY_NEXT velocity_next: Velocity, Bodies, Scratch, -, "", always;
    SPIN spin: Spin, Bodies, State, Rate, "", rotating;
    SPIN_NEXT spin_next: Spin, Bodies, Scratch, Rate, "", rotating;
    VELOCITY_LOW velocity_low: VelocityLow, Bodies, State, -, "beyond f32", single_spheres;
    VELOCITY_LOW_NEXT velocity_low_next: VelocityLow, Bodies, Scratch, -, "beyond f32", single_spheres;
    ID id: u32, Bodies, State, Number, "number in the scene", always;
    ID_NEXT id_next: u32, Bodies, Scratch, Number, "number in the scene", always;
    CLUMP_OF_ID clump_of_id: u32, Bodies, Scene, Number, "clump, by number", clumped;
    MEMBER_OFFSET member_offset: Packed, Bodies, Scene, Length, "by number", clumped;
    INDEX_OF_ID index_of_id: u32, Bodies, State, Number, "index, by number", always;
    FIRST_MEMBER first_member: u32, ClumpsPlusOne, Scene, Number, "number in the scene", clumped;
    INVERSE_MOMENTS inverse_moments: Spin, Clumps, Scene, InverseInertia, "", clumped;
    CENTER center: DVec3, Clumps, State, Length, "", clumped;
    CENTER_NEXT center_next: DVec3, Clumps, Scratch, Length, "", clumped;
    CENTER_LOW center_low: DVec3, Clumps, State, Length, "beyond f32", single_clumped;
    CENTER_LOW_NEXT center_low_next: DVec3, Clumps, Scratch, Length, "beyond f32", single_clumped;
    ORIENTATION orientation: Orientation, Clumps, State, Number, "unit quaternion", clumped;
    ORIENTATION_NEXT orientation_next: Orientation, Clumps, Scratch, Number, "unit quaternion", clumped;
    ORIENTATION_LOW orientation_low: Orientation, Clumps, State, Number, "beyond f32", single_clumped;
    ORIENTATION_LOW_NEXT orientation_low_next: Orientation, Clumps, Scratch, Number, "beyond f32", single_clumped;
    ORIENTATION_REST orientation_rest: Orientation, Clumps, State, Number, "beyond that", single_clumped;
    ORIENTATION_REST_NEXT orientation_rest_next: Orientation, Clumps, Scratch, Number, "beyond that", single_clumped;
    CLUMP_VELOCITY clump_velocity: Velocity, Clumps, State, -, "", clumped;
    CLUMP_VELOCITY_NEXT clump_velocity_next: Velocity, Clumps, Scratch, -, "", clumped;
    CLUMP_SPIN clump_spin: Spin, Clumps, State, Rate, "", clumped;
    CLUMP_SPIN_NEXT clump_spin_next: Spin, Clumps, Scratch, Rate, "", clumped;
    CLUMP_VELOCITY_LOW clump_velocity_low: VelocityLow, Clumps, State, -, "beyond f32", single_clumped;
    CLUMP_VELOCITY_LOW_NEXT clump_velocity_low_next: VelocityLow, Clumps, Scratch, -, "beyond f32", single_clumped;
    SPIN_INCREMENT spin_increment: Spin, Clumps, State, Rate, "of the last step", soft_clumped;
    MEMBER_FORCE member_force: DVec3, Bodies, Scratch, Load, "", clumped;
    MEMBER_TORQUE member_torque: Spin, Bodies, Scratch, LoadTorque, "", clumped;
    ROTATION_ITERATIONS rotation_iterations: RotationIterations, One, State, -, "of iterations for the rotation", clumped;
    DISPLACEMENT displacement: f64, Bodies, State, Length, "since the lists were made", always;
    MATERIAL material: u32, BodiesAndWalls, Scene, Number, "index, by number", mixed;
    PAIR pair: Pair, MaterialsSquared, Scene, -, "", mixed;
    WALL wall: Wall, Walls, State, -, "", walled;
    LEVEL level: Level, Levels, Scene, -, "of the grid", always;
    CELL_RANK cell_rank: u32, Bodies, Scratch, Number, "order inside the cell", always;
    SORTED sorted: u32, Bodies, Scratch, Number, "index before the sort", always;
    CELL_START cell_start: u32, CellsPlusOne, Scratch, Number, "index of the first grain", always;
    TILE_SUM tile_sum: u32, Tiles, Scratch, Number, "sums of the prefix sum", always;
    ACROSS across: u32, Bodies, Scratch, Number, "entries for neighbours on other levels", leveled;
    ACROSS_FILLED across_filled: u32, Bodies, Scratch, Number, "how many of them are filled", leveled;
    LIST_START list_start: u32, SlicesPlusOne, State, Number, "index into neighbour", always;
    NEIGHBOUR neighbour: u32, Entries, State, Number, "index and flag; wall w is bodies + w", always;
    TANGENTIAL_FORCE tangential_force: Packed, Entries, State, Force, "", frictional;
    IMPULSE impulse: Packed, Entries, State, Impulse, "", rigid;
    HISTORY_START history_start: u32, BodiesPlusOne, Scratch, Number, "index into history_other", remembering;
    HISTORY_OTHER history_other: u32, History, Scratch, Number, "index before the sort", remembering;
    HISTORY_TANGENTIAL_FORCE history_tangential_force: Packed, History, Scratch, Force, "", frictional;
    ROLLING_PAIR rolling_pair: RollingPair, MaterialsSquared, Scene, -, "", rolling;
    ROLLING_TORQUE rolling_torque: Spin, Entries, State, Torque, "", rolling;
    HISTORY_ROLLING_TORQUE history_rolling_torque: Spin, History, Scratch, Torque, "", rolling;
    HISTORY_IMPULSE history_impulse: Packed, History, Scratch, Impulse, "", rigid;
    CONTACT_GEOMETRY contact_geometry: ContactGeometry, Entries, Scratch, -, "", rigid;
    FREE_CONTACT_VELOCITY free_contact_velocity: Packed, Entries, Scratch, Velocity, "if nothing touched", rigid;
    INVERSE_EFFECTIVE_MASS inverse_effective_mass: InverseEffectiveMass, Entries, Scratch, -, "", rigid;
    DELASSUS_EIGENVALUE delassus_eigenvalue: f64, Entries, Scratch, InverseMass, "", rigid_clumped;
    IMPULSE_BEFORE impulse_before: Packed, Entries, Scratch, Impulse, "", rigid;
    PASS_VELOCITY pass_velocity: Velocity, Bodies, Scratch, -, "after the last pass", rigid;
    PASS_VELOCITY_BEFORE pass_velocity_before: Velocity, Bodies, Scratch, -, "after the pass before", rigid;
    EXTRAPOLATED_VELOCITY extrapolated_velocity: Velocity, Bodies, Scratch, -, "carried ahead by momentum", rigid;
    PASS_SPIN pass_spin: Spin, Bodies, Scratch, Rate, "", rigid_rotating;
    PASS_SPIN_BEFORE pass_spin_before: Spin, Bodies, Scratch, Rate, "", rigid_rotating;
    EXTRAPOLATED_SPIN extrapolated_spin: Spin, Bodies, Scratch, Rate, "", rigid_rotating;
    CONTACT_COLOR contact_color: ContactColor, Entries, State, -, "from 1, index", colored;
    PROPOSAL proposal: u32, Bodies, Scratch, Number, "neighbour, as in the lists", colored;
    COLORING_STATE coloring_state: ColoringState, One, State, -, "see nscd/coloring/priority.wgsl", colored;
    COLOR_COUNT color_count: u32, Colors, State, Number, "contacts of each colour", colored;
    COLORED_CONTACT colored_contact: ColoredContact, Contacts, Scratch, -, "see nscd/coloring/priority.wgsl", colored;
    COLORED_GEOMETRY colored_geometry: ContactGeometry, Contacts, Scratch, -, "", colored;
    COLORED_FREE_VELOCITY colored_free_velocity: Packed, Contacts, Scratch, Velocity, "", colored;
    COLORED_INVERSE_EFFECTIVE_MASS colored_inverse_effective_mass: InverseEffectiveMass, Contacts, Scratch, -, "", colored;
    COLORED_IMPULSE colored_impulse: Packed, Contacts, Scratch, Impulse, "", colored;
    COLORED_IMPULSE_BEFORE colored_impulse_before: Packed, Contacts, Scratch, Impulse, "", colored;
    COLOR_CURSOR color_cursor: ColorCursor, One, Scratch, -, "see nscd/coloring/priority.wgsl", colored;
    COLOR_CURSOR_NEXT color_cursor_next: ColorCursor, One, Scratch, -, "see nscd/coloring/priority.wgsl", colored;
    PASS_RESIDUAL pass_residual: f64, Bodies, Scratch, VelocitySquared, "", colored;
    LARGE_CONTACTS large_contacts: LargeContacts, Bodies, Scratch, -, "see nscd/coloring/priority.wgsl", colored_with_large;
    LOAD_SPEED load_speed: f64, Bodies, Scratch, Velocity, "if loads all push one way", rigid;
    RESIDUAL_SUMS residual_sums: ResidualSums, Groups, Scratch, -, "", rigid;
    SOLVER_STATE solver_state: SolverState, One, State, -, "see nscd/contact.wgsl", rigid;
    HALT halt: u32, One, Scratch, Number, "steps of this chunk, or HALTED", always;
    HALT_NEXT halt_next: u32, One, Scratch, Number, "steps of this chunk, or HALTED", always;
    COUNTERS counters: Counters, One, Scratch, -, "see state.wgsl", always;
    PARTIAL_SUMS partial_sums: PartialSums, PartialSums, Scratch, -, "", always;
    WORKS works: Works, Bodies, State, -, "by number", working;
    FORCE force: DVec3, OnDemand, Scratch, Force, "", always;
    TORQUE torque: Spin, OnDemand, Scratch, Torque, "", rotating;
}
