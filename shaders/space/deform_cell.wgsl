// twin: src/space/deform_cell.rs
// The periodic cell, n to n + 1, before bodies come to where it is then. In the plan only if it may deform. A cell that
// becomes too narrow for its largest grains is left as it is, and the steps are halted.
var<storage, read_write> halt: u32;

@compute @workgroup_size(1)
fn deform_cell() {
    if (halt >= HALTED) {
        return;
    }
    var next = cell;
    next.rate = cell.rate_next;
    next.shear_rate = cell.shear_rate_next;
    let length = requantised(cell.length, cell.length_low);
    let tilt = requantised(as_vector(cell.tilt), as_vector(cell.tilt_low));
    let above = product_above(next.rate, next.shear_rate, cell.length, cell.tilt);
    let grown = displaced(length.x, length.low, params.dt * next.rate * cell.length);
    let sheared = displaced(tilt.x, tilt.low, as_vector(params.dt * above));
    next.length = grown.x;
    next.length_low = grown.low;
    // Open axes have no length, and nothing tilts along them.
    let open = cell.length == Vec();
    let count = excess_tilts(select(grown.x, Vec(1), open), as_spin(sheared.x));
    let whole = tilts_of(count, grown.x, as_spin(sheared.x));
    let low = tilts_of(count, grown.low, as_spin(sheared.low));
    let turned = displaced(sheared.x - as_vector(whole), sheared.low, -as_vector(low));
    next.tilt = as_spin(turned.x);
    next.tilt_low = as_spin(turned.low);
    next.turned_back = product_above(Vec(1), turned_back_by(count), Vec(1), cell.turned_back);
    let period = select(params.period, Vec(1), open);
    let edges = select(grown.x + grown.low, Vec(1), open);
    let inverse = inverse_above(edges, as_spin(turned.x + turned.low));
    next.stretch = period / edges;
    next.stretch_tilt = product_above(period, Spin(), Vec(1), inverse);
    if (any(edges < select(Vec(params.narrowest), Vec(), open))) {
        halt = HALTED;
        atomicMax(&counters.narrow_cell, 1u);
        return;
    }
    cell_next = next;
}
