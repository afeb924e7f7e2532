//! Twin of `shaders/fall_in.wgsl`: members get the velocities that the sweeps have given the first of them, and what the momentum of
//! the next pass depends on.

use crate::{
    laws::{
        answer::{Course, course_ahead, course_by, course_change, metric_of_clump},
        grains::{arm_of, clump, labels},
        rigid::keep_efforts_of_clumps,
        rotation::surface_velocity,
    },
    state::{Effort, Motion, State},
};

pub fn fall_in(s: &mut State) {
    keep_efforts_of_clumps(s, |s, c| {
        let here = clump(s, c);
        let i = s.whereabouts[s.first_member[c] as usize] as usize;
        let now = course_ahead(s, c, &here);
        let last = course_by(s, c, &here, s.trial[i].v, s.trial_spin[i].0);
        let before = course_by(s, c, &here, s.trial_before[i].v, s.trial_spin_before[i].0);
        // From where the sweeps set out to where they led, along the way from the pass before.
        let beta = s.relaxation[0].beta;
        let way = course_change(&before, &last);
        let start = Course { v: last.v + beta * way.v, spin: last.spin + beta * way.spin };
        let turn = metric_of_clump(s, &here, &course_change(&now, &start), &course_change(&last, &now));
        Effort { turn, ..Effort::default() }
    });
    for c in 0..s.sizes.clumps {
        let (q, first) = (clump(s, c).attitude, s.first_member[c] as usize);
        let i = s.whereabouts[first] as usize;
        let (motion, spin, lead) = (s.ahead[i], s.ahead_spin[i], arm_of(s, q, first));
        for label in labels(s, c) {
            let from_first = arm_of(s, q, label) - lead;
            let member = s.whereabouts[label] as usize;
            s.trial_before[member] = Motion { v: motion.v + surface_velocity(spin.0, from_first), ..motion };
            s.trial_spin_before[member] = spin;
        }
    }
}
