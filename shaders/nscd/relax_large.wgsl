// twin: src/nscd/relax_large.rs
// Contact dynamics 3, coloured, in place of `after_sweep` where grains are large: their contacts have no colours, of which
// there would have to be as many as contacts. So after all colours these contacts take a step all at once, each as if its
// grains were split into as many parts as they have such contacts (mass splitting, Tonge et al. 2012): together they do
// not overshoot then, whatever the parts are. With a small grain the step is about that of the contact by itself, as the
// part of the large one is the heavier of the two. With what is heavy it is as short as the part is light: so the few
// contacts that carry a large grain share half of it, and the many with small grains the other half.
var<storage, read_write> large_contacts: array<LargeContacts>; // N, see `standing_for`
var<storage, read_write> pass_residual: array<Real>;           // N, (m/s)²

/// What it adds to the scales of a contact with j that body i has a part of its grain there only.
fn split_scales(i: u32, j: u32) -> UpdateScales {
    let grain = standing_for(i);
    let small = atomicLoad(&large_contacts[grain].small);
    let heavy = atomicLoad(&large_contacts[grain].heavy);
    let alike = select(small, heavy, is_heavy(j));
    let parts = select(alike, 2u * alike, small != 0u && heavy != 0u);
    let others = Real(parts - 1u);
    let scales = largest_response(i);
    return UpdateScales(others * scales.normal, others * scales.tangential);
}

/// How body i moves since the colours have been relaxed.
fn swept(i: u32) -> ContactBody {
    var body = contact_body(i, Vec());
    body.velocity.v += surface_velocity(body.spin, body.arm);
    return body;
}

/// From `first` on, the entry of the next contact that has no colour; `end` if there is none. Most grains have none, and
/// software drivers skip loops but not branches.
fn next_without_color(i: u32, first: u32, end: u32) -> u32 {
    var entry = first;
    while (entry < end) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            entry = end;
        } else if ((tagged & ACTIVE) != 0u && (is_large(i) || is_large(tagged & INDEX))) {
            break;
        } else {
            entry += lists_abreast();
        }
    }
    return entry;
}

fn relax_large_of(i: u32, entries: vec2<u32>) -> ListSums {
    let here = swept(i);
    var total = ListSums();
    var entry = next_without_color(i, entries.x, entries.y);
    for (; entry < entries.y; entry = next_without_color(i, entry + lists_abreast(), entries.y)) {
        let j = neighbour[entry] & INDEX;
        var there = ContactBody();
        // In an order on which both sides agree, so that both get the same bits.
        var scales = split_scales(min(i, j), max(i, j));
        if (j < params.bodies) {
            there = swept(j);
            let second = split_scales(max(i, j), min(i, j));
            scales = UpdateScales(scales.normal + second.normal, scales.tangential + second.tangential);
        }
        var side = contact_between(i, entry, j, here.velocity, here.spin, there.velocity, there.spin);
        side.velocity += side.sign * unpacked(free_contact_velocity[entry]);
        let old = side.sign * impulse_of(entry);
        let start = old + solver_state.beta * (old - side.sign * unpacked(impulse_before[entry]));
        let compliance = compliance_of(pair_of(i, j), inverse_effective_mass[entry]);
        side = compliant(side, compliance, start);
        let error = natural_map(side, start, natural_map_scale(entry, side, compliance));
        side.normal += scales.normal;
        side.tangential += scales.tangential;
        let next = disc_update(side, start, Real(1));
        impulse_before[entry] = packed(side.sign * next);
        total.impulse = with_impulse(total.impulse, entry, side.sign * (next - start));
        total.sums.residual_squared += side.share * dot(error, error);
    }
    return total;
}

@compute @workgroup_size(GROUP)
fn relax_large(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let walk = walk_of(workgroup, workgroups, lane);
    let rounds = rounds_of(walk);
    var total = ListSums();
    var round = 0u;
    loop {
        total = added_up(walk, total, relax_large_of(walk.body, entries_of(walk, round)));
        continuing {
            round++;
            break if round >= rounds;
        }
    }
    if (walk.answers) {
        let i = walk.body;
        total.sums.residual_squared += pass_residual[i];
        pass_residual[i] = 0;
        total.sums.restart_criterion = respond_to_large_contacts(i, total.impulse);
    }
    store_residual_sums(walk.group, lane, total.sums);
}
