// twin: src/solve/jacobi.rs
// Jacobi's relaxation of contacts whose W is a matrix, u = W r + q: what its kernels share, with the letters of the twin. An
// invocation is a contact; its vectors are (n, t1, t2), or (n, t) in the plane. Velocities are multiples of |q| and impulses of
// |q| / (largest eigenvalue of a W_kk), so that no units leave the range of single precision.

struct Contact {
    q: Packed,
    mu: Real,
    lambda: Real,  // largest eigenvalue of W_kk, by which the natural map is scaled
    normal: Real,  // W_nn and
    tangent: Real, // largest eigenvalue of W_tt: the scales of the relaxation
}

struct Iterate {
    r: Packed,
    u: Packed,
}

/// What the host asks for.
struct Rule {
    contacts: u32,
    accelerated: u32, // 1: with momentum
    limit: u32,       // passes at most
    goal: Real,       // residual that ends the passes
    round_off: Real,  // a step is lost in it whose square is a smaller part of that of r
}

/// The state of the relaxation.
struct Relaxation {
    passes: u32,
    accepted: u32,  // 1: the last pass is the new iterate, 0: its step was too long for W
    improved: u32,  // 1: the last pass is the best
    residual: Real, // of the last pass
    least: Real,    // of the best pass
    largest: Real,  // the largest eigenvalue L of the scaled W known so far; a step is 1/L
    theta: Real,    // Nesterov's sequence
    beta: Real,     // momentum
    best: Real,     // residual since the last restart for its sake
}

/// Sums over contacts.
struct Sums {
    residual: Real,  // square of the natural map
    length: Real,    // square of the step, in the scales of the relaxation like the rest
    curvature: Real, // of W along the step
    size: Real,      // square of r
    uphill: Real,    // > 0: momentum leads away from where the step went
}

var<uniform> rule: Rule;
var<storage, read_write> relaxation: Relaxation;
var<storage, read> contact: array<Contact>;
var<storage, read_write> x: array<Iterate>;
var<storage, read_write> y: array<Iterate>;     // where momentum leads from x, and a step begins
var<storage, read_write> next: array<Packed>;   // r where the step ends
var<storage, read_write> u_next: array<Packed>; // u there

/// Whether there is no pass to do.
fn paused() -> bool {
    return relaxation.residual <= rule.goal || relaxation.passes >= rule.limit;
}

/// The part across the normal.
fn across(v: Vec) -> Vec {
    return v - v.x * first_axis();
}

/// a b in the scales of the relaxation.
fn scaled(c: Contact, a: Vec, b: Vec) -> Real {
    return c.normal * a.x * b.x + c.tangent * dot(across(a), across(b));
}

fn length_of(v: Vec) -> Real {
    return sqrt(dot(v, v));
}

const SUM_LANES = 256u;
var<workgroup> of_lane: array<Sums, SUM_LANES>;
var<storage, read_write> sums: array<Sums>; // groups

fn combined(a: Sums, b: Sums) -> Sums {
    return Sums(
        a.residual + b.residual,
        a.length + b.length,
        a.curvature + b.curvature,
        a.size + b.size,
        a.uphill + b.uphill,
    );
}

/// Lane 0 gets the sum of what the first lanes left in `of_lane`, always in the same order.
fn gathered(lane: u32, lanes: u32) -> Sums {
    workgroupBarrier();
    var sum = Sums();
    if (lane == 0u) {
        for (var l = 0u; l < lanes; l++) {
            sum = combined(sum, of_lane[l]);
        }
    }
    return sum;
}
