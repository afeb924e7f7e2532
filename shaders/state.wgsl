// twin: src/state.rs (records of the same names; the host packs them by the layout naga reads from this file)
// What every kernel may know. Numbers are a field of Params, choices are a slot, arrays belong to who writes them.

struct Position {
    x: Vec,       // m
    radius: Real, // m
}

/// What single precision leaves out of a Position.
struct PositionLow {
    x: Vec,       // m
    radius: Real, // m
}

/// A position: in single precision a multiple of params.quantum and a low part.
struct Point {
    x: Vec,   // m
    low: Vec, // m
}

/// An attitude: in single precision a multiple of some quantum, a low part that is one of a finer quantum, and a rest.
struct SplitOrientation {
    q: Orientation,
    low: Orientation,
    rest: Orientation,
}

struct Velocity {
    v: Vec,             // m/s, at the half step n - 1/2
    inverse_mass: Real, // 1/kg; 0 for a fixed grain
}

/// What single precision leaves out of a velocity and a spin: see `accelerated`.
struct VelocityLow {
    v: vec2<u32>,
    spin: vec2<u32>,
}

/// A number, and what single precision leaves out of it.
struct SplitReal {
    value: Real,
    low: Real,
}

/// A velocity, m/s: in single precision a number and what it leaves out.
struct SplitVelocity {
    v: Vec,
    low: vec2<u32>,
}

/// A spin, rad/s.
struct SplitSpin {
    spin: Spin,
    low: vec2<u32>,
}

/// Contact parameters of a pair of materials.
struct Pair {
    stiffness: Real,            // k_N, N/m
    tangential_stiffness: Real, // k_T, N/m
    friction: Real,             // mu
    dashpot: Real,              // damping ratio, or coefficient in 1/s: see the damping slot
}

struct Params {
    gravity: Vec,                  // m/s²
    lower: Vec,                    // m, a grain beyond has escaped through an open face
    upper: Vec,                    // m
    period: Vec,                   // m, 0 along an open axis
    period_low: Vec,               // m, what the period has beyond a multiple of the quantum, in single precision
    inverse_period: Vec,           // 1/m, 0 along an open axis
    cell_origin: Vec,              // m; the lower face of the domain along a periodic axis
    narrowest: Real,               // m, faces of a cell that deforms must not come closer
    stress: Vec,                   // Pa (N/m), targets of the servo of the cell: xx, yy, zz; compression is positive
    stress_above: Spin,            // Pa (N/m): yz, xz, xy
    controlled: Vec,               // 1 where there is a target, else 0
    controlled_above: Spin,
    servo_time: Real,              // s
    servo_recall: Real,            // part of what it takes away that it makes steady, from look to look
    servo_band: Real,              // Pa (N/m): stresses that miss no more than that settle
    most_rate: Real,               // 1/s, that the servo sets
    least_rigidity: Real,          // Pa s (N s/m), that it takes a modulus times its time for
    dt: Real,                      // s
    history_dt: Real,              // s, since the history of contacts was last written: dt, but 0 in the first step
    damping: Real,                 // xi, 1/s
    reach: Real,                   // m, contacts may act this far beyond touching
    margin: Real,                  // m, neighbour lists reach this much beyond touching
    quantum: Real,                 // m, a power of two: in single precision positions are multiples of it and a low part
    inverse_quantum: Real,         // 1/m
    position_slack: Real,          // m, what a distance may be off if low parts are left out
    length_unit: Real,             // m, a power of two: lengths up to a contact distance are 15 bits of it and a rest
    inverse_length_unit: Real,     // 1/m
    arm_unit: Real,                // m, a power of two: arms of clumps are 22 bits of it and a rest
    inverse_arm_unit: Real,        // 1/m
    step_limit: Real,              // m, no grain may go further in a step
    displacement_limit: Real,      // m, lists are good while no grain has moved further than this
    tolerance: Real,               // contact dynamics: relative residual of its contacts at which a step is solved
    load_fraction: Real,           // contact dynamics: part of the loads of two grains that their residual is relative to
    load_rounding: Real,           // contact dynamics: rounding of loads, as a part of them over the tolerance
    max_momentum: Real,            // most momentum of a pass, 0 to 1
    max_correction_velocity: Real, // m/s, at most this fast overlaps open
    wall_depth: Real,              // m, at most this far beyond a wall the hardest impact drives a centre
    deep_overlap: Real,            // over the smaller radius: contacts that overlap more are looked at by the host
    turn_limit: Real,              // rad, no clump may turn further in a step
    gap_band: Real,                // m, gaps and overlaps up to this are taken for contacts
    @align(16) pair: Pair,         // the pair parameters of a scene with one material
    axes: vec3<u32>,               // of the grid: along which of x, y, z its 1st, 2nd and 3rd coordinate count
    cells: u32,                    // of all levels of the grid
    levels: u32,                   // of the grid
    bodies: u32,                   // grains; members of clumps
    large: u32,                    // those of them that are so large that workgroups serve them, one each; the last ones
    slice_shift: u32,        // of all but these, 2^slice_shift lists lie side by side
    clumps: u32,
    arm_shift: u32,                // the quantum is 2^this units of arms (at most 2^26; 0 if it is less than one)
    arm_shift_fine: u32,           // and 2^this of their fine units, which are 2^-11 units
    walls: u32,
    materials: u32,
    partial_sums_len: u32,         // rows of the measurement
    entries: u32,                  // length of the lists; the engine fills these three in
    history: u32,                  // length of the history
    colors: u32,                   // of contacts, that there are schedules for
    servo_steps: u32,              // from one look of the servo to the next
    step: u32,                     // steps done before this chunk, less multiples of 2^32
}

var<uniform> params: Params;

/// What the device has to tell the host, once per chunk.
struct Counters {
    entries_needed: atomic<u32>,    // entries that the lists ask for
    steps_done: atomic<u32>,        // steps done since the lists were made
    max_displacement: atomic<u32>,  // bits of an f32: largest displacement since the lists were made, over the limit
    max_coordinate: atomic<u32>,    // bits of an f32: largest coordinate of a grain, over the quantum
    lost_body: atomic<u32>,         // bodies - id of a grain that is lost (NaN, outside, beyond a wall, too fast); 0: none
    active_contacts: atomic<u32>,   // contacts with a history at the end of the chunk, each counted once
    restored_contacts: atomic<u32>, // contacts whose history the new lists took over
    unlisted: atomic<u32>,          // neighbours that found no entry: 0, or a defect
    deep_overlaps: atomic<u32>,     // 1 if a contact overlaps by more than `deep_overlap`, after which no step is done
    narrow_cell: atomic<u32>,       // 1 if the cell would become too narrow for its largest grains
}

var<storage, read_write> counters: Counters;

// Neighbour lists: a grain's entries lie where `list_of` says, in ascending order of the neighbours'
// ids, then walls. An entry is the neighbour's index, or bodies + w for wall w; its top bit says that the contact has a
// history.
var<storage, read_write> list_start: array<u32>; // slices + 1: first entries
var<storage, read_write> neighbour: array<u32>;  // entries

/// `halt` counts the steps done in this chunk; from here on it says that no more are to be done.
const HALTED = 0x80000000u;

/// Whether servos look before the step that is so many steps into the chunk. They have done so if it was taken back, after
/// which springs are those of now.
fn is_servo_due(halt: u32) -> bool {
    let step = params.step + halt;
    let again = params.history_dt == 0 && step > 0u;
    return halt < HALTED && !again && step % params.servo_steps == 0u;
}

/// Fills entries that were reserved and not needed.
const NONE = 0xffffffffu;
const INDEX = 0x7fffffffu;
const ACTIVE = 0x80000000u;
