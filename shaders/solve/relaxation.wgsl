// twin: src/solve/jacobi.rs
// Jacobi's relaxation of contacts whose W is a matrix, u = W r + q: what its kernels share, with the letters of the
// twin. An invocation is a contact; its vectors are (n, t1, t2), or (n, t) in the plane. Velocities are multiples of
// |q| and impulses of |q| / (largest eigenvalue of a W_kk), so that no units leave the range of single precision.

struct ProblemContact {
    q: Packed,
    mu: Real,
    lambda: Real,     // largest eigenvalue of W_kk, by which the natural map is scaled
    normal: Real,     // see `UpdateScales`
    tangential: Real,
}

struct Iterate {
    r: Packed,
    u: Packed,
}

/// What the host asks for.
struct Rule {
    contacts: u32,
    limit: u32, // passes at most
    goal: Real, // residual that ends the passes
    max_momentum: Real, // see `MomentumLimits`
    rounding: Real,
}

/// The best pass so far.
struct BestPass {
    improved: u32,  // 1: it is the last one
    residual: Real, // of it
}

var<uniform> rule: Rule;
var<storage, read_write> solver_state: SolverState;
var<storage, read_write> best_pass: BestPass;
var<storage, read> contact: array<ProblemContact>;
var<storage, read_write> x: array<Iterate>;
var<storage, read_write> y: array<Iterate>;     // where momentum leads from x, and a step begins
var<storage, read_write> next: array<Packed>;   // r where the step ends
var<storage, read_write> u_next: array<Packed>; // u there

/// Whether there is no pass to do.
fn paused() -> bool {
    return solver_state.residual_estimate <= rule.goal || solver_state.passes >= rule.limit;
}

/// A contact at velocity u.
fn contact_at(c: ProblemContact, u: Vec) -> OrientedContact {
    return OrientedContact(1, 1, -first_axis(), c.normal, c.tangential, c.mu, u);
}

alias Sums = PassSums;
var<storage, read_write> pass_sums: array<PassSums>; // groups

fn combined(a: PassSums, b: PassSums) -> PassSums {
    return PassSums(
        a.residual_squared + b.residual_squared,
        a.restart_criterion + b.restart_criterion,
        a.curvature + b.curvature,
        a.step_squared + b.step_squared,
    );
}
