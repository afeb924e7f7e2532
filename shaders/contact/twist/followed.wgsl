// twin: src/contact/twist.rs
// Twist slot, in space: springs turn about the normal with the mean spin of the two, so that what they do depends on what
// the two do to each other alone, and not on how both turn together.

/// By how much a contact has turned about its normal in this step, from the sum of the two spins: tan of half the angle.
fn twist_of(n: Vec, spins: Spin) -> Real {
    return 0.25 * params.history_dt * dot(spins, n);
}

/// What a spring of a step ago changes by, N, where it turns into the contact plane of now, and in it. As with attitudes
/// (2.40), the turn has no sine or cosine, and leaves the length as it is.
fn turning(old: Vec, c: ContactState) -> Vec {
    let change = transport(old, c.n, c.n_before);
    let v = old + change;
    let h = c.twist;
    return change + (2 * h / (1 + h * h)) * (cross(c.n, v) - h * v);
}

/// The same of a moment, N m.
fn turning_spin(old: Spin, c: ContactState) -> Spin {
    return turning(old, c);
}
