// twin: src/measure/servo.rs
// The servo of the cell: components of the gradient of the flow that are to bring the stress of the contacts to a target.
// Rates are what would take away the difference within the servo's time if the cell were elastic and isotropic, with all
// its contacts as stiff as they are and no grain giving way: both Lamé constants are then the same, but the one against shear
// is taken for half as much. That is stiffer than any packing, so that stress comes to its target from one side. Packings
// without friction keep differences of their stresses for long, and moving grains shake them. So until it has settled, the
// largest stress counts instead of their mean, and less is asked for while grains move. What other components do to the
// stress all the time, and grains that give way, is made up for by a rate that adds up slowly (a PI controller).
var<storage, read> halt: u32;

const LANES = 256u;

/// By how much less is asked for while motion has the energy of the contacts, a part of the band.
const HELD_BACK: Real = 0.2;

/// How fast it settles: in twice the time in which steady rates come to what they have to be.
const SETTLING: Real = 0.5;

struct Stressed {
    virial: Vec,
    virial_above: Spin,
    stiffness: Real,
    kinetic: Real,
    elastic: Real,
}

var<workgroup> of_lane: array<Stressed, LANES>;

/// The root of the energy of motion over that in contacts, at most 50.
fn restlessness(kinetic: Real, elastic: Real) -> Real {
    let most = Real(50);
    if (kinetic < most * most * elastic) {
        return sqrt(kinetic / elastic);
    }
    return most;
}

@compute @workgroup_size(LANES)
fn servo(@builtin(local_invocation_index) lane: u32) {
    let due = is_servo_due(halt);
    let rows = select(0u, params.partial_sums_len, due);
    var sum = Stressed();
    for (var p = lane; p < rows; p += LANES) {
        let row = partial_sums[p];
        sum.virial += row.virial;
        sum.virial_above += row.virial_above;
        sum.stiffness += row.stiffness;
        sum.kinetic += row.kinetic;
        sum.elastic += row.elastic;
    }
    of_lane[lane] = sum;
    workgroupBarrier();
    if (lane != 0u || !due) {
        return;
    }
    for (var l = 1u; l < LANES; l++) {
        sum.virial += of_lane[l].virial;
        sum.virial_above += of_lane[l].virial_above;
        sum.stiffness += of_lane[l].stiffness;
        sum.kinetic += of_lane[l].kinetic;
        sum.elastic += of_lane[l].elastic;
    }
    let volume = volume_of(cell.length);
    let stress = -sum.virial / volume;
    let stress_above = -sum.virial_above / volume;
    // Modulus times time: never so little that rates leave the range of numbers.
    let shares = Real(DIMENSIONS * (DIMENSIONS + 2u));
    let rigidity = max(params.servo_time * sum.stiffness / (shares * volume), params.least_rigidity);
    let missing = params.controlled * (params.stress - stress);
    let count = dot(params.controlled, Vec(1));
    let mean = dot(missing, params.controlled) / max(count, Real(1));
    let uneven = params.controlled * (missing - Vec(mean));
    let missing_above = stress_above - params.stress_above;
    let close = abs(missing) < Vec(params.servo_band);
    let close_above = abs(params.controlled_above * missing_above) < Spin(params.servo_band);
    if (all(close) && all(close_above)) {
        // What begins close to its targets is there.
        let begins = params.step + halt == 0u;
        cell.settled = select(min(cell.settled + SETTLING * params.servo_recall, Real(1)), Real(1), begins);
    }
    let held_back = HELD_BACK * params.servo_band * restlessness(sum.kinetic, sum.elastic);
    let least = -largest_component(min(uneven, Vec()));
    let lead = mean + (1 - cell.settled) * (least - held_back);
    let step = -(Vec(lead / (count + 2)) + uneven) / rigidity;
    let shear_step = missing_above / rigidity;
    let most = Vec(params.most_rate);
    let most_above = Spin(params.most_rate);
    let rate = clamp(cell.steady_rate + step, -most, most);
    let shear_rate = clamp(cell.steady_shear_rate + shear_step, -most_above, most_above);
    let controlled = params.controlled > Vec();
    let controlled_above = params.controlled_above > Spin();
    // A rate at its limit says nothing of what the other components do to the stress.
    let recall = cell.settled * params.servo_recall;
    cell.steady_rate += select(Vec(), recall * step, controlled & (abs(rate) < most));
    cell.steady_shear_rate +=
        select(Spin(), recall * shear_step, controlled_above & (abs(shear_rate) < most_above));
    cell.rate_next = select(cell.rate_next, rate, controlled);
    cell.shear_rate_next = select(cell.shear_rate_next, shear_rate, controlled_above);
    cell.largest_rate = sqrt(dot(cell.rate_next, cell.rate_next) + spin_squared(cell.shear_rate_next));
    cell.stress = stress;
    cell.stress_above = stress_above;
}
