// twin: src/measure/servo.rs
// The servo of the cell: components of the gradient of the flow that are to bring the stress of the contacts to a target.
// A rate is what would take away the difference within the servo's time if the cell were elastic, with all its contacts as
// stiff as they are and no grain giving way, which is stiffer than any packing: so stress comes to its target from one side.
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
    var sum = Virial();
    for (var p = lane; p < params.partial_sums_len; p += LANES) {
        let row = partial_sums[p];
        sum.diagonal += row.virial;
        sum.above += row.virial_above;
        sum.stiffness += row.stiffness;
    }
    of_lane[lane] = sum;
    workgroupBarrier();
    if (lane != 0u || halt >= HALTED || (params.step + halt) % params.servo_steps != 0u) {
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
    let viscosity = params.servo_time * sum.stiffness / (Real(DIMENSIONS) * volume);
    let missing = params.stress - stress;
    let missing_above = params.stress_above - stress_above;
    let rate = -missing / max(Vec(viscosity), abs(missing) / params.most_rate + Vec(LEAST));
    let shear_rate = -missing_above / max(Spin(viscosity), abs(missing_above) / params.most_rate + Spin(LEAST));
    cell.rate = select(cell.rate, rate, params.controlled > Vec());
    cell.shear_rate = select(cell.shear_rate, shear_rate, params.controlled_above > Spin());
    cell.largest_rate = sqrt(dot(cell.rate, cell.rate) + spin_squared(cell.shear_rate));
    cell.stress = stress;
    cell.stress_above = stress_above;
}

/// Against divisions by 0.
const LEAST: Real = 0x1p-100;
