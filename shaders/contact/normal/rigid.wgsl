// twin: src/contact/normal.rs
// Normal slot: rigid grains, which store nothing.

fn normal_force(pair: Pair, gap: Real) -> Real {
    return 0;
}

fn normal_energy(pair: Pair, gap: Real) -> Real {
    return 0;
}
