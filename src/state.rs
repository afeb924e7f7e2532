//! Twin of `shaders/state.wgsl`: every array by name, the same name in Rust and in WGSL, with its length and unit.
//!
//! The CPU engine works on this struct; the GPU engine keeps buffers of the same names, whose layout it reads from the
//! WGSL text, so that no struct is described twice. On the CPU a plane is space with z = 0.

mod column;
mod records;
mod sizes;

use crate::{
    error::Result,
    model::{
        Boundary, Compliance, Grains, Growth, History, Levels, Materials, Method, Model, Precision, Rolling, Rotation,
        Tangential, Walls,
    },
    units::{Quantity, Units},
};
pub use crate::{record::Element, solve::momentum::SolverState};
pub use column::Column;
use glam::DVec3;
pub use records::{
    Cell, ColorCursor, ColoredContact, ColoringState, ContactColor, ContactGeometry, Counters, GrowthStep,
    InverseEffectiveMass, LargeContacts, Level, LowBits, Orientation, Packed, Pair, Params, PartialSums, Position,
    PositionLow, ResidualSums, RollingPair, RotationIterations, Spin, StartSize, Velocity, VelocityLow, Wall, WallLoad,
    WallServo, Works,
};
pub use sizes::{GROUP, Length, Lifetime, PATH_STEPS, Sizes, TILE, WALL_PARTS};
use std::{
    fmt,
    hash::{Hash, Hasher},
};

/// Content of a list entry: `NONE`, `INDEX` and `ACTIVE` of `state.wgsl`.
pub const NONE: u32 = u32::MAX;
pub const INDEX: u32 = u32::MAX >> 1;
pub const ACTIVE: u32 = !INDEX;
/// `halt` counts the steps of a chunk; from here on it says that no more are to be done.
pub const HALTED: u32 = 1 << 31;

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
        state.complete().expect("there is room for it");
        state
    }

    /// Arrays of zeros in place of those that the model needs and that are not here.
    ///
    /// # Errors
    /// [`Error::Lacking`](crate::Error::Lacking) if there is no room for them.
    pub fn complete(&mut self) -> Result<()> {
        for array in present(&self.model, ARRAYS) {
            if self.column(array).is_empty() {
                let len = self.sizes.of(array.length);
                self.column_mut(array).reserve(len)?;
                self.column_mut(array).resize(len);
            }
        }
        Ok(())
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
    m.tangential != Tangential::None && (!rigid(m) || compliant(m))
}
fn compliant(m: &Model) -> bool {
    m.compliance == Compliance::Stiffness
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
fn adaptively_damped(m: &Model) -> bool {
    m.adaptive_damping
}
fn guided(m: &Model) -> bool {
    m.guided_walls
}
fn driven(m: &Model) -> bool {
    m.driven_walls
}
fn growing(m: &Model) -> bool {
    m.growth == Growth::Some
}
fn deforming(m: &Model) -> bool {
    m.boundary == Boundary::Deforming
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
    START_SIZE start_size: StartSize, Bodies, Scene, -, "by number", growing;
    GROWTH_PATH growth_path: GrowthStep, GrowthPaths, Scene, -, "after each step of a chunk", growing;
    GROWTH_RATE growth_rate: f64, Materials, State, Rate, "of radii, over themselves", growing;
    GROWTH_RATE_NEXT growth_rate_next: f64, Materials, Scratch, Rate, "of radii, over themselves", growing;
    WALL wall: Wall, Walls, State, -, "", walled;
    WALL_PATH wall_path: Wall, WallPaths, Scene, -, "after each step of a chunk", guided;
    WALL_SERVO wall_servo: WallServo, Walls, Scene, -, "of walls that one moves", driven;
    CELL cell: Cell, One, State, -, "", deforming;
    CELL_NEXT cell_next: Cell, One, Scratch, -, "", deforming;
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
    TANGENTIAL_FORCE_NEXT tangential_force_next: Packed, Entries, Scratch, Force, "", compliant;
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
    ENERGY_GAIN energy_gain: f64, PartialSums, Scratch, Energy, "of free grains in a step", adaptively_damped;
    STEPS_SINCE_RESTART steps_since_restart: u32, One, State, Number, "since momentum was dropped", adaptively_damped;
    WALL_LOAD_SUMS wall_load_sums: WallLoad, WallLoadSums, Scratch, -, "by row and wall", walled;
    WALL_LOAD wall_load: WallLoad, WallLoads, Scratch, -, "by part and wall", walled;
    WORKS works: Works, Bodies, State, -, "by number", working;
    FORCE force: DVec3, OnDemand, Scratch, Force, "", always;
    TORQUE torque: Spin, OnDemand, Scratch, Torque, "", rotating;
}
