// twin: src/nscd/compliance.rs
// Compliance slot: contacts are rigid, and remember their impulse alone.

fn compliance_of(pair: Pair, inverse_mass: InverseEffectiveMass) -> UpdateScales {
    return UpdateScales();
}

/// The speed that closes a gap within the step; an overlap opens at a bounded one. Gaps within rounding are none.
fn bias_velocity_of(gap: Real, pair: Pair, inverse_mass: InverseEffectiveMass) -> Real {
    if (max(gap, -gap) < params.gap_band) {
        return 0;
    }
    if (gap > 0) {
        return gap / params.dt;
    }
    return max((gap + params.gap_band) / params.dt, -params.max_correction_velocity);
}

fn spring_velocity(entry: u32, tagged: u32, n: Vec, compliance: UpdateScales) -> Vec {
    return Vec();
}

fn remember_spring(entry: u32, impulse: Vec) {
}

fn compliant(side: OrientedContact, compliance: UpdateScales, impulse: Vec) -> OrientedContact {
    return side;
}

fn compliant_work(n: Vec, compliance: UpdateScales, change: Vec) -> Real {
    return 0;
}


fn store_spring(at: u32, entry: u32) {
}

fn restore_spring(entry: u32, at: u32, same: bool) {
}
