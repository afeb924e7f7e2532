// twin: src/measure/energies.rs
// Energies of spheres and disks.

/// What a free grain has by itself, with the force of its contacts and that of their dashpots.
fn energies(here: Body, sum: ForceTorque, drag: ForceTorque) -> Energies {
    let inverse_mass = here.velocity.inverse_mass;
    let change = velocity_change_now(here.velocity, sum.force);
    let spin_change = spin_change_now(here, sum.torque);
    let v = here.velocity.v + change;
    let w = here.spin + spin_change;
    let kinetic = 0.5 * dot(v, v) / inverse_mass + spin_energy(here, w);
    let potential = -dot(params.gravity, here.position.x + here.low.x) / inverse_mass;
    let total = sum.force + params.gravity / inverse_mass;
    // Dashpots know the velocities of half a step ago, but it is those of now that they work against.
    let late = dot(drag.force, change) + spin_dot(drag.torque, spin_change);
    let dissipation = 2 * params.damping * kinetic - late;
    let momentum = v / inverse_mass;
    return Energies(kinetic, potential, sqrt(dot(total, total)), dissipation, momentum * v, outer_above(momentum, v));
}
