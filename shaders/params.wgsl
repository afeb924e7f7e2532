// twin: src/state.rs (records of the same names; the host packs them by the layout naga reads from this file)
// What every kernel may know. Numbers are a field of Params, choices are a slot, arrays belong to who writes them.

struct Place {
    x: Vec,       // m
    radius: Real, // m
}

struct Motion {
    v: Vec,             // m/s, at the half step n - 1/2
    inverse_mass: Real, // 1/kg; 0 for a fixed grain
}

/// Contact parameters of a pair of materials.
struct Pair {
    stiffness: Real,            // k_N, N/m
    tangential_stiffness: Real, // k_T, N/m
    friction: Real,             // mu
    dashpot: Real,              // damping ratio, or coefficient in 1/s: see the dashpot slot
}

struct Params {
    gravity: Vec,           // m/s²
    lower: Vec,             // m, a grain beyond has escaped through an open face
    upper: Vec,             // m
    period: Vec,            // m, 0 along an open axis
    period_rest: Vec,       // m, what the period has beyond a multiple of the quantum, in single precision
    inverse_period: Vec,    // 1/m, 0 along an open axis
    cell_origin: Vec,       // m; the lower face of the domain along a periodic axis
    inverse_cell: Vec,      // 1/m, per axis
    dt: Real,               // s
    damping: Real,          // xi, 1/s
    margin: Real,           // m, neighbour lists reach this much beyond contact
    quantum: Real,          // m, a power of two: single precision keeps positions as multiples of it and a residue
    inverse_quantum: Real,  // 1/m
    drift_limit: Real,      // m, lists are good while no grain has moved further than this
    @align(16) pair: Pair,  // the pair parameters of a scene with one material
    cells: vec3<u32>,       // cells per axis; the grid wraps around on every axis
    bodies: u32,            // grains
    walls: u32,
    materials: u32,
    parts: u32,             // rows of the measurement
}

var<uniform> params: Params;

/// What the device has to tell the host, once per chunk.
struct Counters {
    slots_needed: atomic<u32>, // neighbour slots that the lists ask for
    broken: atomic<u32>,       // 1 if a grain moved further than drift_limit since the lists were made
    drift: atomic<u32>,        // bits of an f32: largest (movement / drift_limit)²
    bad_body: atomic<u32>,     // bodies - id of a grain that is no number, left the domain or crossed a wall; 0: none
    lost: atomic<u32>,         // springs of the old lists that found no slot in the new ones
}

/// Fills list slots that were reserved and not needed.
const NONE = 0xffffffffu;

override WG: u32 = 64;

/// The index of this invocation in a dispatch that may be folded into two dimensions.
fn linear(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.x + id.y * groups.x * WG;
}

/// What two surfaces know of each other; n points from the grain of interest to the other.
struct Touch {
    gap: Real, // m, < 0 is overlap (erratum E1)
    n: Vec,
}
