// twin: src/contact/rolling.rs
// Rolling slot: elastic-plastic spring-dashpot with history (Iwashita & Oda 1998; type C of Ai, Chen, Rotter & Ooi
// 2011, Powder Technol. 206, 269). The couple grows with the angle by which the surfaces roll on each other, up to mu_r
// R* F_n; a dashpot damps it below that. Owns the rolling torque.

var<storage, read_write> rolling_torque: array<Spin>;         // entries, N m: on the grain of interest
var<storage, read_write> history_rolling_torque: array<Spin>; // contacts, N m: on the grain with the smaller index
var<storage, read> rolling_pair: array<RollingPair>;          // pairs of materials

struct RollingPair {
    friction: Real,  // mu_r
    stiffness: Real, // k_r / (k_n R*²)
    damping: Real,   // damping ratio eta_r
}

/// What a contact remembers.
struct RollingHistory {
    torque: Spin, // N m, of the spring
}

/// The rolling part of a contact, on the first of the two.
struct Rolling {
    couple: Spin,  // N m
    damping: Spin, // N m, the part of the couple that is the dashpot's
    history: RollingHistory,
    dashpot: Real, // W, dissipation of the dashpot
    plastic: Real, // W, that of plastic rolling
}

/// That of the contact at this entry.
fn rolling_history(entry: u32, tagged: u32) -> RollingHistory {
    if ((tagged & ACTIVE) == 0u) {
        return RollingHistory();
    }
    return RollingHistory(rolling_torque[entry]);
}

fn set_rolling_history(entry: u32, h: RollingHistory) {
    rolling_torque[entry] = h.torque;
}

/// As the other of the two sees it, if `back`.
fn opposite_rolling(h: RollingHistory, back: bool) -> RollingHistory {
    return RollingHistory(select(h.torque, -h.torque, back));
}

fn store_rolling(at: u32, entry: u32) {
    history_rolling_torque[at] = rolling_torque[entry];
}

fn restore_rolling(entry: u32, at: u32, same: bool) {
    set_rolling_history(entry, opposite_rolling(RollingHistory(history_rolling_torque[at]), !same));
}

/// `stiffness` is the slope of the normal force, N/m, and `normal_force` that force, N.
fn rolling_contact(c: ContactState, stiffness: Real, normal_force: Real, old: RollingHistory) -> Rolling {
    let pair = rolling_pair[c.materials];
    let k = rolling_stiffness(pair, c, stiffness);
    let rate = across_spin(c.spin, c.n);
    let turn = turning_spin(old.torque, c);
    let change = turn - softening(c) * (old.torque + turn);
    let held = old.torque + change;
    let rolled = change - (k * params.history_dt) * rate;
    let limit = pair.friction * c.radius * max(normal_force, Real(0));
    var torque = Spin();
    var excess = old.torque + rolled;
    var dashpot = Real(0); // N m s
    if (limit > 0) {
        // In parts of the limit, because the squares of small grains' torques are beyond single precision.
        let before = old.torque / limit;
        let gain = rolled / limit;
        let part = before + gain;
        let beyond = (spin_squared(before) - 1) + spin_dot(gain, 2 * before + gain);
        let length = sqrt(1 + beyond);
        if (beyond > 1) {
            torque = (limit / length) * part;
            excess -= torque;
        } else {
            excess = Spin();
            if (beyond > 0) {
                excess = (beyond / (length * (length + 1)) * limit) * part;
            } else {
                dashpot = capped_dashpot(2 * pair.damping * rolling_dashpot(k, c), part, rate / limit);
            }
            torque = accumulated_spin(old.torque, rolled - excess);
        }
    }
    var plastic = Real(0);
    if (k > 0 && params.history_dt > 0) {
        let lost = spin_dot(0.5 * (held + torque), excess) + 0.5 * spin_squared(held) * stiffness_change(c);
        plastic = lost / (k * params.history_dt);
    }
    let power = dashpot * spin_squared(rate);
    return Rolling(torque - dashpot * rate, -dashpot * rate, RollingHistory(torque), power, plastic);
}

/// As much of a dashpot, N m s, as keeps |part - dashpot rate| within 1, spring and rate being in parts of the limit.
fn capped_dashpot(dashpot: Real, part: Spin, rate: Spin) -> Real {
    let damping = dashpot * rate;
    let size = sqrt(spin_squared(damping));
    if (!(size > 0)) {
        return dashpot;
    }
    let along = spin_dot(part, damping / size);
    return dashpot * min(Real(1), (along + sqrt(max(along * along + 1 - spin_squared(part), Real(0)))) / size);
}

/// √(k I) with the inertia I about the contact point, N m s: half of what damps critically.
fn rolling_dashpot(k: Real, c: ContactState) -> Real {
    return select(Real(0), sqrt(k) / sqrt(c.inverse_rolling_inertia), c.inverse_rolling_inertia > 0);
}

/// N m per radian.
fn rolling_stiffness(pair: RollingPair, c: ContactState, stiffness: Real) -> Real {
    return pair.stiffness * stiffness * (c.radius * c.radius);
}

/// The moment of a contact's force and its couple, N m.
fn with_couple(torque: Spin, couple: Spin) -> Spin {
    return torque + couple;
}

/// Energy stored in the rolling spring, J; nothing where the surfaces have no stiffness any more.
fn rolling_energy(c: ContactState, stiffness: Real, h: RollingHistory) -> Real {
    let k = rolling_stiffness(rolling_pair[c.materials], c, stiffness);
    if (!(k > 0)) {
        return 0;
    }
    return 0.5 * spin_squared(h.torque) / k;
}
