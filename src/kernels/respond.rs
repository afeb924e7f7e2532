//! Twin of `shaders/respond.wgsl`: clumps answer to the impulses that their members hold.

use crate::{
    laws::{
        answer::{Course, course_ahead, course_of, metric_of_clump},
        grains::{arm_of, clump, labels},
        rigid::{keep_efforts_of_clumps, reference},
        rotation::surface_velocity,
    },
    state::{Effort, Motion, Spin, State},
};
use rayon::prelude::*;

/// After `meet`: velocities in `trial`.
pub fn respond_first(s: &mut State) {
    let courses = responded(s);
    spread(s, &courses, |s| (&mut s.trial, &mut s.trial_spin));
}

/// After a pass: velocities in `trial_before`.
pub fn respond(s: &mut State) {
    let courses = responded(s);
    spread(s, &courses, |s| (&mut s.trial_before, &mut s.trial_spin_before));
}

fn responded(s: &mut State) -> Vec<Course> {
    let of = |c| course_of(s, c, &clump(s, c));
    let courses: Vec<Course> = (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(of).collect();
    keep_efforts_of_clumps(s, |s, c| {
        let here = clump(s, c);
        let (start, next) = (course_ahead(s, c, &here), courses[c]);
        let slots: usize = labels(s, c).map(|label| s.row(s.whereabouts[label] as usize).len()).sum();
        let free = s.clump_motion_next[c];
        let squared = metric_of_clump(s, &here, free.v, s.clump_spin_next[c].0) * free.inverse_mass;
        Effort {
            work: metric_of_clump(s, &here, next.0 - start.0, next.1 - start.1),
            // Blocks of W are at most twice their parts along and across n.
            ..reference(s, 2 * slots, squared, free.inverse_mass)
        }
    });
    courses
}

/// The velocities of a clump's surface for its members.
pub fn spread(s: &mut State, courses: &[Course], into: impl Fn(&mut State) -> (&mut Vec<Motion>, &mut Vec<Spin>)) {
    for (c, (v, spin)) in courses.iter().enumerate() {
        let attitude = clump(s, c).attitude;
        for label in labels(s, c) {
            let i = s.whereabouts[label] as usize;
            let v = v + surface_velocity(*spin, arm_of(s, attitude, label));
            let inverse_mass = s.clump_motion_next[c].inverse_mass;
            let (motions, spins) = into(s);
            (motions[i], spins[i]) = (Motion { v, inverse_mass }, Spin(*spin));
        }
    }
}
