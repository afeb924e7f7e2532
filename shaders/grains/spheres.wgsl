// twin: src/laws/grains.rs
// Grains slot: every body is a grain, a sphere or disk.

/// Whether bodies i and j belong to one grain.
fn same_grain(i: u32, j: u32) -> bool {
    return i == j;
}

fn keep_index(label: u32, i: u32) {}

/// How many bodies the grain of body i has.
fn members_of(i: u32) -> u32 {
    return 1;
}

/// One of them.
fn member_of(i: u32, m: u32) -> u32 {
    return i;
}

/// What a free grain has by itself, with the force of its contacts and that of their dashpots.
fn energies(here: Body, sum: Gathered, drag: Vec) -> Energies {
    let inverse_mass = here.motion.inverse_mass;
    let v = velocity_now(here.motion, sum.force);
    let kinetic = 0.5 * dot(v, v) / inverse_mass + spin_energy(here, spin_now(here, sum.torque));
    let potential = -dot(params.gravity, here.place.x + here.residue.x) / inverse_mass;
    let total = sum.force + params.gravity / inverse_mass;
    // Dashpots know the velocities of half a step ago, but it is those of now that they work against.
    let dissipation = 2 * params.damping * kinetic - dot(drag, v - here.motion.v);
    return Energies(kinetic, potential, sqrt(dot(total, total)), dissipation);
}
