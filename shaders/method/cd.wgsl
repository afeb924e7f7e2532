// twin: src/laws/rigid.rs
// Method slot: contact dynamics, section 2.2. Grains are rigid; a step is one implicit Euler step with restitution 0. Here is
// what its kernels share. Impulses and velocities are those of the whole step; the friction slot keeps the impulse of a contact
// where the discrete element method keeps its spring, and hands it on in the same way.

/// Grains whose sums are added up before they leave the processor.
const GROUP = 64u;

/// A contact of the step, seen from the grain of interest.
struct Meeting {
    n: Vec,       // from the grain of interest to the other
    closing: Real, // m/s: the grains may approach each other at most at this speed, which closes the gap
}

/// What an impulse does to the two.
struct Lever {
    own: Real,        // m, from the centre of the grain of interest to the contact point
    other: Real,      // m, from the centre of the other
    normal: Real,     // 1/kg, W in the direction of n; of clumps what takes its place, see `lever_of`
    tangential: Real, // 1/kg, W across; of clumps what takes the place of its largest eigenvalue there
}

/// The state of a step's relaxation.
struct Relaxation {
    scale: Real,     // m/s: what residuals are relative to, max(|v_free|, g dt sqrt(N)), or the largest velocity imposed
    crowd: Real,     // what no eigenvalue of W exceeds, for the number of contacts that a grain has
    stretch: Real,   // the largest eigenvalue of W known so far, with contacts scaled by both numbers of their `Lever`
    theta: Real,     // Nesterov's sequence
    beta: Real,      // momentum of the next pass
    estimate: Real,  // relative residual of the natural map that the last pass has met
    best: Real,      // the smallest one since the residual rose last
    lowest: Real,    // the smallest one since steps were made shorter
    lowest_at: u32,  // after so many passes
    shorter: Real,   // by this factor steps are shorter than W asks for
    residual: Real,  // relative residual of the natural map, as last judged
    excess: Real,    // largest friction beyond the Coulomb limit, over the largest normal impulse, as last judged
    passes: u32,
    late: u32,       // pairs found by the last judgement to meet after all, counted from both sides
}

var<storage, read_write> meeting: array<Meeting>; // slots
var<storage, read_write> lever: array<Lever>;     // slots
var<storage, read_write> ahead: array<Motion>;    // N, m/s, 1/kg: what a pass starts from
var<storage, read_write> trial: array<Motion>;    // N, m/s, 1/kg: after the last pass
var<storage, read_write> trial_before: array<Motion>; // N: after the pass before; a pass writes them anew
var<storage, read_write> spring_before: array<Packed>; // slots, N s: the impulses of the pass before; a pass writes them anew

/// Sums of a workgroup, or of the body or clump of an invocation.
struct Effort {
    reference: Real, // m²/s², free velocities, of clumps with their spins
    least: Real,     // m²/s², what gravity gives them in a step
    imposed: Real,   // m/s, largest velocity that a wall, a fixed grain, a spin or an overlap asks for
    crowd: Real,     // what no eigenvalue of W exceeds
    residual: Real,  // m²/s²
    turn: Real,      // J, > 0: momentum carries the wrong way
    work: Real,      // J, of the pass: its velocities in the metric of the masses
    way: Real,       // J, its impulses in the metric of W_kk
    pressing: Real,  // N s, largest
    excess: Real,    // N s, largest
    late: u32,       // pairs left out that meet after all
}

fn combined(a: Effort, b: Effort) -> Effort {
    return Effort(
        a.reference + b.reference,
        a.least + b.least,
        max(a.imposed, b.imposed),
        max(a.crowd, b.crowd),
        a.residual + b.residual,
        a.turn + b.turn,
        a.work + b.work,
        a.way + b.way,
        max(a.pressing, b.pressing),
        max(a.excess, b.excess),
        a.late + b.late,
    );
}

const SUM_LANES = 256u;
var<workgroup> of_lane: array<Effort, SUM_LANES>;
var<storage, read_write> effort: array<Effort>; // groups of bodies, then of clumps
var<storage, read_write> relaxation: Relaxation;

fn groups_of(items: u32) -> u32 {
    return (items + GROUP - 1u) / GROUP;
}

/// Add up what the lanes of a group of bodies have left in `of_lane`.
fn add_group(lane: u32, group: u32) {
    workgroupBarrier();
    if (lane == 0u && group * GROUP < params.bodies) {
        effort[group] = sum_of_lanes();
    }
}

/// The same for a group of clumps.
fn add_group_of_clumps(lane: u32, group: u32) {
    workgroupBarrier();
    if (lane == 0u && group * GROUP < params.clumps) {
        effort[groups_of(params.bodies) + group] = sum_of_lanes();
    }
}

fn sum_of_lanes() -> Effort {
    var sum = of_lane[0];
    for (var l = 1u; l < GROUP; l++) {
        sum = combined(sum, of_lane[l]);
    }
    return sum;
}

/// The sum over all groups, in a single workgroup; in lane 0 only.
fn total(lane: u32) -> Effort {
    let groups = groups_of(params.bodies) + groups_of(params.clumps);
    var sum = Effort();
    for (var g = lane; g < groups; g += SUM_LANES) {
        sum = combined(sum, effort[g]);
    }
    of_lane[lane] = sum;
    workgroupBarrier();
    if (lane == 0u) {
        for (var l = 1u; l < SUM_LANES; l++) {
            sum = combined(sum, of_lane[l]);
        }
    }
    return sum;
}

/// What global damping, implicit like all else, leaves of velocities and to impulses.
fn held() -> Real {
    return 1 / (1 + params.dt * params.damping);
}

/// Velocity that a grain would have at the end of the step if nothing touched it, and the inverse mass that impulses meet.
fn freed(motion: Motion) -> Motion {
    if (motion.inverse_mass == 0) {
        return motion;
    }
    return Motion(held() * (motion.v + params.dt * params.gravity), held() * motion.inverse_mass);
}

/// The same for the spin.
fn freed_spin(motion: Motion, spin: Spin) -> Spin {
    if (motion.inverse_mass == 0) {
        return spin;
    }
    return held() * spin;
}

/// What residuals are relative to: the square of a grain's free velocity, m²/s²; and `crowd`.
fn reference(crowd: u32, squared: Real, inverse_mass: Real) -> Effort {
    var effort = Effort();
    effort.crowd = Real(crowd);
    if (inverse_mass != 0) {
        effort.reference = squared;
        effort.least = params.dt * params.dt * dot(params.gravity, params.gravity);
    }
    return effort;
}

/// Velocities of body i, after a pass and as carried ahead from it, by what its impulses make of them: freed of the rounding that
/// updates in place have left.
fn settle(i: u32, motion: Motion, spin: Spin) {
    let off = motion.v - trial[i].v;
    let spin_off = spin - trial_spin_of(i);
    trial[i] = Motion(trial[i].v + off, motion.inverse_mass);
    trial_before[i] = Motion(trial_before[i].v + off, motion.inverse_mass);
    ahead[i] = Motion(ahead[i].v + off, motion.inverse_mass);
    keep_trial_spin(i, trial_spin_of(i) + spin_off);
    keep_trial_spin_before(i, trial_spin_before_of(i) + spin_off);
    keep_ahead_spin(i, ahead_spin_of(i) + spin_off);
}

/// A contact as its first side sees it, the grain with the smaller index: both grains compute it from there, so that they get
/// the same bits, and turn what comes of it to their own side.
struct Side {
    turn: Real,       // 1: the grain of interest is that side; -1: the other
    share: Real,      // 1/2 of a contact that two grains add to a sum
    n: Vec,           // away from that side
    closing: Real,     // m/s
    normal: Real,     // 1/kg, as in `Lever`
    tangential: Real, // 1/kg
    friction: Real,
    velocity: Vec,    // m/s, of that side past the other in the contact point
}

/// The contact in a slot of grain i at the velocities that a pass starts from.
fn side_of(i: u32, slot: u32, j: u32, here: Motion, spin: Spin) -> Side {
    let m = meeting[slot];
    let l = lever[slot];
    var side = Side();
    side.friction = pair_of(i, j).friction;
    side.closing = m.closing;
    side.normal = l.normal;
    side.tangential = l.tangential;
    if (j >= params.bodies) {
        side.turn = 1;
        side.share = 1;
        side.n = m.n;
        let arm = l.own * m.n;
        side.velocity = (here.v - wall_velocity(j - params.bodies, place[i].x + arm)) + surface_velocity(spin, arm);
        return side;
    }
    let first = i < j;
    let there = ahead[j];
    let spin_to = ahead_spin_of(j);
    side.turn = select(Real(-1), Real(1), first);
    side.share = 0.5;
    side.n = side.turn * m.n;
    let surface = surface_velocity(select(spin_to, spin, first), select(l.other, l.own, first) * side.n);
    let surface_to = surface_velocity(select(spin, spin_to, first), -select(l.own, l.other, first) * side.n);
    side.velocity = select(there.v - here.v, here.v - there.v, first) + (surface - surface_to);
    return side;
}

/// The speed that closes a gap within the step; an overlap opens at a bounded one. Gaps within rounding are none.
fn closing_of(gap: Real) -> Real {
    if (max(gap, -gap) < params.gap_band) {
        return 0;
    }
    if (gap > 0) {
        return gap / params.dt;
    }
    return max((gap + params.gap_band) / params.dt, -params.correction);
}

/// Vector shortened to a length.
fn capped(v: Vec, length: Real) -> Vec {
    let squared = dot(v, v);
    if (squared > length * length) {
        return v * (length / sqrt(squared));
    }
    return v;
}

/// Impulse on the first side after a pass from `impulse`: the disc update. Its fixed points are contacts that are open, stick
/// or slip as Algorithm 1 has them; with step = 1 it is that algorithm for spheres.
fn relaxed(side: Side, impulse: Vec, step: Real) -> Vec {
    let pressing = -dot(impulse, side.n);
    let approach = dot(side.velocity, side.n);
    let friction = impulse + pressing * side.n;
    let slip = side.velocity - approach * side.n;
    let pressing_next = max(pressing + step / side.normal * (approach - side.closing), Real(0));
    // In m/s, because squares of a small grain's impulses are beyond single precision.
    let weight = side.tangential;
    let friction_next = capped(weight * friction - step * slip, side.friction * (weight * pressing_next));
    return (1 / weight) * friction_next - pressing_next * side.n;
}

/// The natural map of a contact, m/s: r - P(r - rho (u + mu |u_T| n)), rho = 1/weight, over rho. The weight is λmax(W_kk).
fn natural_map(side: Side, impulse: Vec, weight: Real) -> Vec {
    let pressing = -dot(impulse, side.n);
    let approach = dot(side.velocity, side.n);
    let friction = impulse + pressing * side.n;
    let slip = side.velocity - approach * side.n;
    let mu = side.friction;
    let normal = weight * pressing + (approach - side.closing) - mu * sqrt(dot(slip, slip));
    let across = weight * friction - slip;
    let length = sqrt(dot(across, across));
    if (normal > 0 && length <= mu * normal) {
        // What is left of the differences below, without the rounding of impulses beside which velocities are small.
        return slip + (approach - side.closing - mu * sqrt(dot(slip, slip))) * side.n;
    }
    var kept = Vec();
    var pressed = Real(0);
    if (mu * length > -normal) {
        pressed = (normal + mu * length) / (1 + mu * mu);
        kept = across * (mu * pressed / length);
    }
    return (weight * friction - kept) - (weight * pressing - pressed) * side.n;
}

/// The contact of grain i in a slot, as samples and forces see it: what carries an impulse is closed.
fn contact_of(i: u32, here: Body, slot: u32, entry: u32) -> Contact {
    let j = entry & INDEX;
    var contact = Contact();
    contact.closed = (entry & SPRUNG) != 0u;
    if (!contact.closed) {
        return contact;
    }
    var touch = Touch();
    if (j < params.bodies) {
        touch = meet_grain(i, here, j);
    } else {
        touch = touch_wall(j - params.bodies, here.place, here.residue);
    }
    contact.gap = touch.gap;
    contact.force = spring_of(slot, entry) * (1 / params.dt);
    contact.arm = (here.place.radius + 0.5 * touch.gap) * touch.n;
    contact.spring = contact.force - dot(contact.force, touch.n) * touch.n;
    return contact;
}

/// Gap and normal of grains i and j, opposite to the last bit for the two.
fn meet_grain(i: u32, here: Body, j: u32) -> Touch {
    let there = place[j];
    let residue = residue_of(j);
    let d = between(here.place.x, there.x, residue.x - here.residue.x);
    let back = backward(d.x);
    let way = Point(select(d.x, -d.x, back), select(d.residue, -d.residue, back));
    let radius = select(here.place.radius, there.radius, back);
    let radius_to = select(there.radius, here.place.radius, back);
    let touch = touch_grain(i, j, way, radius, radius_to, here.residue.radius + residue.radius);
    return Touch(touch.gap, select(touch.n, -touch.n, back));
}

/// Velocities are those of the positions.
fn velocity_now(motion: Motion, force: Vec) -> Vec {
    return motion.v;
}

fn spin_now(here: Body, torque: Spin) -> Spin {
    return here.spin;
}

/// Whether a clump's spin is kept along the axes of the scene: of all, because impulses change it there.
fn spins_in_scene(inverse_moments: Spin) -> bool {
    return true;
}
