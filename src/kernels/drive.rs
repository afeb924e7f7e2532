//! Twin of `shaders/drive.wgsl`: what acts on the members of a clump moves and turns it.

use crate::{
    laws::{
        boundary::wrapped,
        contact::Gathered,
        dimension::moment,
        grains::{Gain, arm_of, attitude_step, clump, gained, is_round, labels, own_torque},
        leapfrog::advanced,
        precision::{Point, Turning, moved, turned_on},
        rotation::spun,
    },
    state::{Attitude, Motion, Spin, State},
};
use glam::{DVec3, DVec4};
use rayon::prelude::*;

/// What a clump is after a step.
struct Next {
    center: Point,
    motion: Motion,
    spin: DVec3,
    attitude: Turning,
    gain: Option<Gain>,
}

pub fn drive(s: &mut State) {
    if s.halt[0] != 0 {
        return;
    }
    let next: Vec<Next> = (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(|c| driven(s, c)).collect();
    for (c, next) in next.into_iter().enumerate() {
        s.center_next[c] = next.center.x;
        s.clump_motion_next[c] = next.motion;
        s.clump_spin_next[c].0 = next.spin;
        s.attitude_next[c] = Attitude(next.attitude.q);
        if !s.center_residue_next.is_empty() {
            s.center_residue_next[c] = next.center.residue;
            s.attitude_residue_next[c] = Attitude(next.attitude.residue);
        }
        if let Some(Gain { spin, rounds, settled }) = next.gain {
            s.spin_gain[c] = Spin(spin);
            s.rounds[0].most = s.rounds[0].most.max(rounds);
            s.rounds[0].capped += u32::from(!settled);
        }
    }
}

fn driven(s: &State, c: usize) -> Next {
    let here = clump(s, c);
    let mut sum = Gathered::default();
    for label in labels(s, c) {
        let i = s.whereabouts[label] as usize;
        let force = s.pull[i];
        sum.force += force;
        sum.torque += s.twist[i].0 + moment(arm_of(s, here.attitude, label), force);
    }
    let v = advanced(s, &here.motion, sum.force);
    let (mut spin, mut gain) = (here.spin, None);
    if !is_round(s, here.inverse_moments) {
        let found = gained(s, &here, own_torque(&here, sum.torque), s.spin_gain[c].0);
        spin += found.spin;
        gain = Some(found);
    } else if here.motion.inverse_mass != 0.0 {
        spin = spun(s, spin, here.inverse_moments * sum.torque);
    }
    let residue = s.attitude_residue.get(c).map_or(DVec4::ZERO, |r| r.0);
    let step = attitude_step(s, c, &here, spin);
    Next {
        center: wrapped(s, moved(s, here.center.x, here.center.residue, s.params.dt * v)),
        motion: Motion { v, inverse_mass: here.motion.inverse_mass },
        spin,
        attitude: turned_on(s, s.attitude[c].0, residue, step),
        gain,
    }
}
