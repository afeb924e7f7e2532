// twin: src/measure/servo.rs
// The servo of the cell: components of the gradient of the flow that are to bring the stress of the contacts to a target.
// Rates are what would take away the difference within the servo's time if the cell were elastic and isotropic, with all
// its contacts as stiff as they are and no grain giving way: both Lamé constants are then the same. That is stiffer than any
// packing, so that stress comes to its target from one side. What other components do to the stress all the time, and grains
// that give way, is made up for by a rate that adds up slowly (a PI controller).
var<storage, read> halt: u32;

const LANES = 256u;

struct Virial {
    diagonal: Vec,
    above: Spin,
    stiffness: Real,
}

var<workgroup> of_lane: array<Virial, LANES>;

@compute @workgroup_size(LANES)
fn servo(@builtin(local_invocation_index) lane: u32) {
    let due = is_servo_due(halt);
    let rows = select(0u, params.partial_sums_len, due);
    var sum = Virial();
    for (var p = lane; p < rows; p += LANES) {
        let row = partial_sums[p];
        sum.diagonal += row.virial;
        sum.above += row.virial_above;
        sum.stiffness += row.stiffness;
    }
    of_lane[lane] = sum;
    workgroupBarrier();
    if (lane != 0u || !due) {
        return;
    }
    for (var l = 1u; l < LANES; l++) {
        sum.diagonal += of_lane[l].diagonal;
        sum.above += of_lane[l].above;
        sum.stiffness += of_lane[l].stiffness;
    }
    let volume = volume_of(cell.length);
    let stress = -sum.diagonal / volume;
    let stress_above = -sum.above / volume;
    // Modulus times time: never so little that rates leave the range of numbers.
    let all = Real(DIMENSIONS * (DIMENSIONS + 2u));
    let rigidity = max(params.servo_time * sum.stiffness / (all * volume), params.least_rigidity);
    let missing = params.controlled * (params.stress - stress);
    let count = dot(params.controlled, Vec(1));
    let mean = dot(missing, params.controlled) / max(count, Real(1));
    let step = -(Vec(mean / (count + 2)) + 0.5 * (missing - Vec(mean))) / rigidity;
    let shear_step = (stress_above - params.stress_above) / rigidity;
    let most = Vec(params.most_rate);
    let most_above = Spin(params.most_rate);
    let rate = clamp(cell.steady_rate + step, -most, most);
    let shear_rate = clamp(cell.steady_shear_rate + shear_step, -most_above, most_above);
    let controlled = params.controlled > Vec();
    let controlled_above = params.controlled_above > Spin();
    // It begins where the stress has come close to its target: before, all that is missing would add up. And a rate at its
    // limit says nothing of what the other components do to the stress.
    let recall = params.servo_recall;
    let close = abs(missing) < Vec(params.servo_band);
    let close_above = abs(stress_above - params.stress_above) < Spin(params.servo_band);
    let holds = close | (cell.steady_rate != Vec());
    let holds_above = close_above | (cell.steady_shear_rate != Spin());
    cell.steady_rate += select(Vec(), recall * step, controlled & holds & (abs(rate) < most));
    cell.steady_shear_rate +=
        select(Spin(), recall * shear_step, controlled_above & holds_above & (abs(shear_rate) < most_above));
    cell.rate_next = select(cell.rate_next, rate, controlled);
    cell.shear_rate_next = select(cell.shear_rate_next, shear_rate, controlled_above);
    cell.largest_rate = sqrt(dot(cell.rate_next, cell.rate_next) + spin_squared(cell.shear_rate_next));
    cell.stress = stress;
    cell.stress_above = stress_above;
}
