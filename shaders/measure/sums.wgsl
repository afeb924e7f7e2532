// twin: src/measure/sums.rs
// Sums over grains.

var<storage, read_write> partial_sums: array<PartialSums>;      // parts: rows of the measurement

var<storage, read_write> wall_load_sums: array<WallLoad>; // parts x walls

var<storage, read_write> works: array<Works>; // N, by number, of the steps since the host has read them

/// Parts that the loads on a wall are left in.
const WALL_PARTS: u32 = 256u;

struct PartialSums {
    kinetic: Real,       // J, velocities brought to step n
    potential: Real,     // J
    elastic: Real,       // J, stored in contacts
    net_force: Real,     // N, sum of |total force| over free grains
    contact_force: Real, // N, sum of |force without dashpots| over contacts
    dissipation: Real,   // W, of dashpots, sliding, contacts that open and global damping
    sliding: Real,       // W, what of that is of the step before n: sliding, contacts that open
    wall_power: Real,    // W, work of walls on free grains per time
    fixed_power: Real,   // W, that of fixed grains
    growth_power: Real,  // W, that of radii which grow
    overlap: Real,       // largest overlap over the smaller radius
    sides: u32,          // contacts of free grains; one between two free grains is seen twice
    single_sides: u32,   // those of them with a wall or a fixed grain
    virial: Vec,         // J, sum over contacts of grains of force times branch vector, xx, yy, zz
    virial_above: Spin,  // J: yz, xz, xy
    flux: Vec,           // J, sum over free grains of mass times velocity times velocity, xx, yy, zz
    flux_above: Spin,    // J: yz, xz, xy
    stiffness: Real,     // J, sum over contacts of grains of what a strain of all lengths alike does to the trace of the virial
}

/// What free grains do to a wall.
struct WallLoad {
    force: Vec,   // N
    moment: Spin, // N m, about its point, or the centre of a cylinder
    normal_force: Real, // N, along the normals of the contacts; pressing is positive
    stiffness: Real,    // N/m, of the contacts along their normals, at most
}

/// What free grains have lost, and what others have done to them, J.
struct Works {
    dissipated: Real,
    walls: Real,
    fixed: Real,
    cell: Real,
    growth: Real,
}

/// What a grain has by itself at step n.
struct Energies {
    kinetic: Real,     // J
    potential: Real,   // J
    net_force: Real,   // N
    dissipation: Real, // W, of global damping, and what dashpots take less as velocities changed since the half step
    flux: Vec,         // J, mass times velocity times velocity, xx, yy, zz
    flux_above: Spin,  // J: yz, xz, xy
}
