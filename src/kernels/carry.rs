//! Twin of `shaders/carry.wgsl`: members follow from where their clumps are.

use crate::{
    laws::{
        boundary::wrapped,
        dimension::{arm_gain, attitude_gain, outside},
        grains::{arm_of, clump, global_spin},
        precision::{Point, moved, residue_of},
        rotation::surface_velocity,
    },
    state::{Motion, Place, Residue, Spin, State},
};
use glam::DVec4;
use rayon::prelude::*;

/// What a member is after a step, and how far it went.
struct Next {
    point: Point,
    motion: Motion,
    spin: Spin,
    stride: f64,
}

pub fn carry(s: &mut State) {
    if s.halt[0] != 0 {
        s.halt_next[0] = 1;
        return;
    }
    let next: Vec<Next> = (0..s.sizes.bodies).into_par_iter().with_min_len(256).map(|i| carried(s, i)).collect();
    for (i, Next { point, motion, spin, stride }) in next.into_iter().enumerate() {
        let radius_rest = residue_of(s, i).radius;
        s.place_next[i] = Place { x: point.x, radius: s.place[i].radius };
        if let Some(residue) = s.residue_next.get_mut(i) {
            *residue = Residue { x: point.residue, radius: radius_rest };
        }
        s.motion_next[i] = motion;
        s.spin_next[i] = spin;
        s.travel[i] += stride;
        let lost = outside(point.x, s.params.lower, s.params.upper) || !(stride <= s.params.step_limit);
        if lost {
            s.counters[0].bad_body = s.counters[0].bad_body.max(s.params.bodies - s.number[i]);
        }
        if lost || !(s.travel[i] <= s.params.drift_limit) {
            s.halt_next[0] = 1;
        }
    }
}

fn carried(s: &State, i: usize) -> Next {
    let label = s.number[i] as usize;
    let c = s.owner[label] as usize;
    let before = clump(s, c);
    let q = s.attitude_next[c].0 + s.attitude_residue_next.get(c).map_or(DVec4::ZERO, |r| r.0);
    let v = s.clump_motion_next[c].v;
    let spin = global_spin(s, &before, before.attitude, s.clump_spin_next[c].0);
    let arm = arm_of(s, before.attitude, label);
    let gain = arm_gain(attitude_gain(0.25 * s.params.dt * spin), arm);
    let residue = s.center_residue_next.get(c).copied().unwrap_or_default();
    let way = s.params.dt * v + gain;
    Next {
        point: wrapped(s, moved(s, s.center_next[c], residue, arm_of(s, q, label))),
        motion: Motion { v: v + surface_velocity(spin, arm + 0.5 * gain), inverse_mass: before.motion.inverse_mass },
        spin: Spin(spin),
        stride: way.length(),
    }
}
