// twin: src/neighbours/order_long_lists.rs
// Neighbour lists 5 of large grains: what `order_neighbours` does, by a workgroup for each, because one invocation would
// take as long as the square of their thousands of neighbours.
const LANES = 64u;

/// The entries of a list.
struct Row {
    begin: u32,
    filled: u32, // one past the last that has been filled
    end: u32,    // one past the last
}

var<workgroup> own_row: Row;
var<workgroup> grains: atomic<u32>;

/// The id of the neighbour at an entry; NONE comes last.
fn order_of(j: u32) -> u32 {
    if (j == NONE) {
        return NONE;
    }
    return id[j];
}

/// Entries a < b in ascending order.
fn compare_and_swap(a: u32, b: u32) {
    let first = neighbour[a];
    let second = neighbour[b];
    if (order_of(first) > order_of(second)) {
        neighbour[a] = second;
        neighbour[b] = first;
    }
}

@compute @workgroup_size(LANES)
fn order_long_lists(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let place = number_of(group, groups);
    let i = params.bodies - params.large + min(place, params.large - 1u);
    if (lane == 0u) {
        own_row = Row();
        if (place < params.large && all_entries() <= params.entries) {
            let list = list_of(i);
            own_row = Row(list.begin, list.end - (entries_across(i) - filled_across(i)), list.end);
        }
    }
    let row = workgroupUniformLoad(&own_row);
    let count = row.filled - row.begin;
    let fixed = velocity[i].inverse_mass == 0;
    for (var entry = row.begin + lane; entry < row.filled; entry += LANES) {
        let j = neighbour[entry];
        if (j != NONE && fixed && velocity[j].inverse_mass == 0) {
            neighbour[entry] = NONE;
        }
    }
    storageBarrier();
    // Bitonic sort. Every merge begins with mirrored pairs, so that what is beyond the end never has to move.
    for (var size = 2u; size < 2u * count; size *= 2u) {
        let half = size / 2u;
        let pairs = (count + size - 1u) / size * half;
        for (var k = lane; k < pairs; k += LANES) {
            let a = k / half * size + k % half;
            let b = k / half * size + size - 1u - k % half;
            if (b < count) {
                compare_and_swap(row.begin + a, row.begin + b);
            }
        }
        storageBarrier();
        for (var distance = half / 2u; distance > 0u; distance /= 2u) {
            for (var k = lane; k < pairs; k += LANES) {
                let a = k / distance * 2u * distance + k % distance;
                if (a + distance < count) {
                    compare_and_swap(row.begin + a, row.begin + a + distance);
                }
            }
            storageBarrier();
        }
    }
    var own = 0u;
    for (var entry = row.begin + lane; entry < row.filled; entry += LANES) {
        own += select(0u, 1u, neighbour[entry] != NONE);
    }
    atomicAdd(&grains, own);
    workgroupBarrier();
    if (lane == 0u && row.end > row.begin) {
        own_row.filled = list_walls(i, List(row.begin, row.end, 1u), row.begin + atomicLoad(&grains));
    }
    storageBarrier();
    let listed = workgroupUniformLoad(&own_row);
    var inherited = 0u;
    for (var entry = listed.begin + lane; entry < listed.filled; entry += LANES) {
        inherited += restore_history(entry, i, neighbour[entry]);
    }
    if (inherited != 0u) {
        atomicAdd(&counters.restored_contacts, inherited);
    }
}
