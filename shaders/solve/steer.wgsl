// twin: src/solve/momentum.rs
// A pass, 3 of 3: whether the step was short enough for W, and how momentum goes on. It is Nesterov's, dropped when it leads away
// from where the step went or when the residual has risen.
var<storage, read_write> residuals: array<Real>; // of the latest passes, by turns

const MARGIN = 1.02; // by which L is raised beyond what was seen of it
const WORSE = 1.5;   // times the best residual: a restart

fn steered(sum: Sums) -> Relaxation {
    var state = relaxation;
    state.passes++;
    state.residual = sqrt(sum.residual);
    state.improved = u32(state.residual < state.least);
    state.least = min(state.least, state.residual);
    let long = sum.curvature > state.largest * sum.length && sum.length > rule.round_off * sum.size;
    state.accepted = u32(!long);
    state.beta = 0;
    if (long) {
        state.largest = MARGIN * sum.curvature / sum.length;
        state.theta = 1;
    } else if (rule.accelerated != 0u) {
        let worse = state.residual > WORSE * state.best;
        state.best = select(min(state.best, state.residual), state.residual, worse);
        if (worse || sum.uphill > 0) {
            state.theta = 1;
        } else {
            let square = state.theta * state.theta;
            let theta = 0.5 * (state.theta * sqrt(square + 4) - square);
            state.beta = state.theta * (1 - state.theta) / (square + theta);
            state.theta = theta;
        }
    }
    return state;
}

@compute @workgroup_size(SUM_LANES)
fn steer(@builtin(local_invocation_index) lane: u32) {
    of_lane[lane] = Sums();
    let groups = (rule.contacts + WG - 1u) / WG;
    for (var group = lane; group < groups; group += SUM_LANES) {
        of_lane[lane] = combined(of_lane[lane], sums[group]);
    }
    let sum = gathered(lane, SUM_LANES);
    if (lane == 0u && !paused()) {
        let state = steered(sum);
        residuals[relaxation.passes % arrayLength(&residuals)] = state.residual;
        relaxation = state;
    }
}
