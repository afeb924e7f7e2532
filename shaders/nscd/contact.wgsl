// twin: src/nscd/contact.rs
// What the kernels of contact dynamics share, section 2.2. Grains are rigid; a step is one implicit Euler step with
// restitution 0. Impulses and velocities are those of the whole step. A contact remembers its impulse, with which the
// next step begins.

/// Grains whose sums are added up before they leave the processor.
const GROUP = 64u;

/// A contact of the step, seen from the grain of interest.
struct ContactGeometry {
    n: Vec,       // from the grain of interest to the other
    speed: Real,  // m/s: what acts on it: gravity in a step, the free velocity of the two past each other, an overlap
}

/// What an impulse does to the two of a contact.
struct InverseEffectiveMass {
    arm: Real,        // m, from the centre of the grain of interest to the contact point
    arm_to: Real,     // m, from the centre of the other
    normal: Real,     // 1/kg, W in the direction of n; of clumps what takes its place, see `inverse_effective_mass_of`
    tangential: Real, // 1/kg, W across; of clumps what takes the place of its largest eigenvalue there
}

var<storage, read_write> contact_geometry: array<ContactGeometry>;            // entries
// Entries, m/s: of the grain of interest past the other at the end of the step if nothing touched, less the speed along
// n at which they may approach. It is q of the contact problem u = W r + q, and all velocities of passes are W r.
var<storage, read_write> free_contact_velocity: array<Packed>;
var<storage, read_write> inverse_effective_mass: array<InverseEffectiveMass>; // entries
// Velocities of passes are what the impulses of a step have added: those of a bed that is carried keep their digits.
var<storage, read_write> extrapolated_velocity: array<Velocity>;    // N, m/s, 1/kg: what a pass starts from
var<storage, read_write> pass_velocity: array<Velocity>;    // N, m/s, 1/kg: after the last pass
var<storage, read_write> pass_velocity_before: array<Velocity>; // N: after the pass before; a pass writes them anew
var<storage, read_write> impulse: array<Packed>;         // entries, N s: on the grain of interest
var<storage, read_write> impulse_before: array<Packed>;  // entries, N s: of the pass before; a pass writes them anew
var<storage, read_write> history_impulse: array<Packed>; // contacts, N s: on the grain with the smaller index

struct History {
    impulse: Vec, // N s
}

/// Sums of a workgroup, or of the body or clump of an invocation.
struct ResidualSums {
    reference: Real, // m²/s², squares of what residuals of contacts are relative to
    lipschitz_bound: Real,     // what no eigenvalue of W exceeds
    residual_squared: Real,  // and the next three: see `PassSums`; (m/s)²
    restart_criterion: Real, // J
    curvature: Real,         // J, by the velocities of the grains in the metric of their masses
    step_squared: Real,      // J
    largest_residual: Real,  // of a contact, relative to what acts on it
    resolved_residual: Real, // the same of what is beyond the rounding of loads
    max_normal_impulse: Real,  // N s, largest
    coulomb_excess: Real,    // N s, largest
    late_contacts: u32,       // pairs left out that meet after all
}

fn combined(a: ResidualSums, b: ResidualSums) -> ResidualSums {
    return ResidualSums(
        a.reference + b.reference,
        max(a.lipschitz_bound, b.lipschitz_bound),
        a.residual_squared + b.residual_squared,
        a.restart_criterion + b.restart_criterion,
        a.curvature + b.curvature,
        a.step_squared + b.step_squared,
        max(a.largest_residual, b.largest_residual),
        max(a.resolved_residual, b.resolved_residual),
        max(a.max_normal_impulse, b.max_normal_impulse),
        max(a.coulomb_excess, b.coulomb_excess),
        a.late_contacts + b.late_contacts,
    );
}

alias Sums = ResidualSums;
var<storage, read_write> load_speed: array<Real>; // N, m/s: what the loads of a grain do to it if they all push one way
var<storage, read_write> residual_sums: array<ResidualSums>; // workgroups that walk lists, then groups of clumps
var<storage, read_write> solver_state: SolverState;

/// What the contacts of a list, or some of them, add.
struct ListSums {
    impulse: ForceTorque, // N s and N m s, on the grain of interest
    load: Real,           // N s, sum of the impulses' amounts
    contacts: u32,
    sums: ResidualSums,
}

/// The part of `ListSums` that `of_lane` has no place for.
struct ListLoad {
    impulse: ForceTorque,
    load: Real,
    contacts: u32,
}

var<workgroup> load_of_lane: array<ListLoad, GROUP>;

/// A lane has this for the others.
fn bring(lane: u32, own: ListSums) {
    of_lane[lane] = own.sums;
    load_of_lane[lane] = ListLoad(own.impulse, own.load, own.contacts);
}

fn brought(lane: u32) -> ListSums {
    let load = load_of_lane[lane];
    return ListSums(load.impulse, load.load, load.contacts, of_lane[lane]);
}

fn together(a: ListSums, b: ListSums) -> ListSums {
    return ListSums(
        ForceTorque(a.impulse.force + b.impulse.force, a.impulse.torque + b.impulse.torque),
        a.load + b.load,
        a.contacts + b.contacts,
        combined(a.sums, b.sums),
    );
}

/// One more impulse, at an entry of the grain of interest.
fn with_impulse(sum: ForceTorque, entry: u32, impulse: Vec) -> ForceTorque {
    let arm = inverse_effective_mass[entry].arm * contact_geometry[entry].n;
    return ForceTorque(sum.force + impulse, sum.torque + moment(arm, impulse));
}

/// Add up the sums of the bodies of a workgroup, of which lanes bring their own.
fn store_residual_sums(group: u32, lane: u32, sums: ResidualSums) {
    let sum = sum_of_lanes(lane, GROUP, sums);
    if (lane == 0u && group < groups_of_lists()) {
        residual_sums[group] = sum;
    }
}

/// The same for a group of clumps.
fn store_clump_residual_sums(c: u32, sums: ResidualSums) {
    let sum = sum_of_lanes(c % GROUP, GROUP, sums);
    if (c % GROUP == 0u && c < params.clumps) {
        residual_sums[groups_of_lists() + c / GROUP] = sum;
    }
}

/// The sum over all groups, in a single workgroup; in lane 0 only.
fn total_sums(lane: u32) -> ResidualSums {
    let groups = groups_of_lists() + (params.clumps + GROUP - 1u) / GROUP;
    var sum = ResidualSums();
    for (var g = lane; g < groups; g += SUM_LANES) {
        sum = combined(sum, residual_sums[g]);
    }
    return sum_of_lanes(lane, SUM_LANES, sum);
}

/// What global damping, implicit like all else, leaves of velocities and to impulses.
fn damping_factor() -> Real {
    return 1 / (1 + params.dt * params.damping);
}

/// The inverse mass of a body that impulses act on, 1/kg.
fn impulse_inverse_mass(i: u32) -> Real {
    return damping_factor() * velocity[i].inverse_mass;
}

/// By how much the velocity of a grain would change in the step if nothing touched it, m/s.
fn free_velocity_change(velocity: Velocity) -> Vec {
    if (velocity.inverse_mass == 0) {
        return Vec();
    }
    return damping_factor() * params.dt * past_flow(params.gravity - params.damping * velocity.v, velocity.v);
}

/// The same for the spin, rad/s.
fn free_spin_change(velocity: Velocity, spin: Spin) -> Spin {
    if (velocity.inverse_mass == 0) {
        return Spin();
    }
    return -damping_factor() * params.dt * params.damping * spin;
}

/// A body or the first member of its clump at the end of the step if nothing touched, at the end of an arm from there.
struct FreeMotion {
    v: Vec,    // m/s: the velocity of its grain now, as all kernels know it
    rest: Vec, // m/s: all that comes to it, so that differences of two keep their digits
    spin: Spin,
}

/// Velocity of a point of the first of two bodies past the second in the same place, m/s.
fn past(a: FreeMotion, arm: Vec, b: FreeMotion, arm_to: Vec) -> Vec {
    let rest = a.rest + surface_velocity(a.spin, arm);
    return (a.v - b.v) + (rest - (b.rest + surface_velocity(b.spin, arm_to)));
}

/// Smaller than any speed that matters, m/s.
const NO_SPEED: Real = 1e-30;

/// Velocities of body i, after a pass and as carried ahead from it, by what its impulses make of them: freed of the
/// rounding that updates in place have left.
fn remove_rounding(i: u32, velocity: Velocity, spin: Spin) {
    let off = velocity.v - pass_velocity[i].v;
    let spin_off = spin - pass_spin_of(i);
    pass_velocity[i] = Velocity(pass_velocity[i].v + off, velocity.inverse_mass);
    pass_velocity_before[i] = Velocity(pass_velocity_before[i].v + off, velocity.inverse_mass);
    extrapolated_velocity[i] = Velocity(extrapolated_velocity[i].v + off, velocity.inverse_mass);
    store_pass_spin(i, pass_spin_of(i) + spin_off);
    store_pass_spin_before(i, pass_spin_before_of(i) + spin_off);
    store_extrapolated_spin(i, extrapolated_spin_of(i) + spin_off);
}

/// A contact of grains i and j, or of grain i with a wall, at a velocity of i past the other.
fn contact_at(
    i: u32,
    j: u32,
    geometry: ContactGeometry,
    inverse_mass: InverseEffectiveMass,
    velocity: Vec,
) -> OrientedContact {
    var side = OrientedContact();
    side.sign = 1;
    side.share = 1;
    side.n = geometry.n;
    side.normal = inverse_mass.normal;
    side.tangential = inverse_mass.tangential;
    side.friction = pair_of(i, j).friction;
    side.velocity = velocity;
    return side;
}

/// The contact at an entry of grain i at the velocities that a pass starts from.
fn oriented_contact(i: u32, entry: u32, j: u32, here: Velocity, spin: Spin) -> OrientedContact {
    var side = pushed_contact(i, entry, j, here, spin);
    side.velocity += side.sign * unpacked(free_contact_velocity[entry]);
    return side;
}

/// The same with what impulses have added to the velocity of its sides alone.
fn pushed_contact(i: u32, entry: u32, j: u32, here: Velocity, spin: Spin) -> OrientedContact {
    if (j >= params.bodies) {
        return contact_between(i, entry, j, here, spin, Velocity(), Spin());
    }
    return contact_between(i, entry, j, here, spin, extrapolated_velocity[j], extrapolated_spin_of(j));
}

/// The same, where grain j has a velocity and a spin to it too; a wall has none.
fn contact_between(
    i: u32,
    entry: u32,
    j: u32,
    here: Velocity,
    spin: Spin,
    there: Velocity,
    spin_to: Spin,
) -> OrientedContact {
    let inverse_mass = inverse_effective_mass[entry];
    var side = contact_at(i, j, contact_geometry[entry], inverse_mass, Vec());
    if (j >= params.bodies) {
        side.velocity = here.v + surface_velocity(spin, inverse_mass.arm * side.n);
        return side;
    }
    let first = i < j;
    side.sign = select(Real(-1), Real(1), first);
    side.share = 0.5;
    side.n = side.sign * side.n;
    let arm = select(inverse_mass.arm_to, inverse_mass.arm, first) * side.n;
    let arm_to = -select(inverse_mass.arm, inverse_mass.arm_to, first) * side.n;
    let surface = surface_velocity(select(spin_to, spin, first), arm);
    let surface_to = surface_velocity(select(spin, spin_to, first), arm_to);
    side.velocity = select(there.v - here.v, here.v - there.v, first) + (surface - surface_to);
    return side;
}

/// Moment of a contact about the grain's centre, N m. Rigid contacts carry no couple.
fn contact_torque(contact: Contact) -> Spin {
    return moment(contact.arm, contact.force);
}

/// The contact of grain i at an entry, as samples and forces see it: what carries an impulse is closed.
fn contact_of(i: u32, here: Body, entry: u32, tagged: u32) -> Contact {
    let j = tagged & INDEX;
    var contact = Contact();
    contact.is_active = (tagged & ACTIVE) != 0u;
    if (!contact.is_active) {
        return contact;
    }
    var touch = Separation();
    if (j < params.bodies) {
        touch = sphere_separation_of(i, here, j);
    } else {
        touch = wall_separation(j - params.bodies, here.position, here.low);
    }
    contact.gap = touch.gap;
    contact.force = warm_start_impulse(entry, tagged) * (1 / params.dt);
    contact.arm = (here.position.radius + 0.5 * touch.gap) * touch.n;
    return contact;
}

/// Gap and normal of grains i and j, opposite to the last bit for the two.
fn sphere_separation_of(i: u32, here: Body, j: u32) -> Separation {
    let pair = oriented_pair(i, here, j);
    return Separation(pair.separation.gap, select(pair.separation.n, -pair.separation.n, pair.back));
}

/// The entry of neighbour j in the list of grain i, which has it.
fn entry_of(i: u32, j: u32) -> u32 {
    let list = list_of(i);
    var entry = list.begin;
    while (entry + list.step < list.end && (neighbour[entry] & INDEX) != j) {
        entry += list.step;
    }
    return entry;
}

/// The impulse at this entry.
fn impulse_of(entry: u32) -> Vec {
    return unpacked(impulse[entry]);
}

fn store_impulse(entry: u32, r: Vec) {
    impulse[entry] = packed(r);
}

/// That of the last step, N s.
fn warm_start_impulse(entry: u32, tagged: u32) -> Vec {
    if ((tagged & ACTIVE) == 0u) {
        return Vec();
    }
    return impulse_of(entry);
}

fn store_lanes(at: u32, entry: u32) {
    history_impulse[at] = impulse[entry];
    store_spring(at, entry);
}

fn restore_lanes(entry: u32, at: u32, same: bool) {
    let r = unpacked(history_impulse[at]);
    store_impulse(entry, select(-r, r, same));
    restore_spring(entry, at, same);
}

/// Nothing: rigid grains store no energy.
fn forgotten_energy(i: u32, here: Body, entry: u32, tagged: u32) -> Real {
    return 0;
}

/// Nothing: velocities are those of the positions.
fn velocity_change_now(velocity: Velocity, force: Vec) -> Vec {
    return Vec();
}

fn spin_change_now(here: Body, torque: Spin) -> Spin {
    return Spin();
}

/// Whether a clump's spin is kept along the axes of the scene: of all, because impulses change it there.
fn spins_in_scene(inverse_moments: Spin) -> bool {
    return true;
}
