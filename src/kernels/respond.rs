//! Twin of `shaders/respond.wgsl`: clumps answer to the impulses that their members hold.

use crate::{
    laws::{
        answer::{Course, course_ahead, course_change, course_of, courses, member_motion, metric_of_clump},
        grains::{clump, labels},
        rigid::{keep_efforts_of_clumps, reference},
    },
    state::{Effort, Motion, Spin, State},
};

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
    let courses = courses(s, course_of);
    keep_efforts_of_clumps(s, |s, c| {
        let here = clump(s, c);
        let change = course_change(&course_ahead(s, c, &here), &courses[c]);
        let slots: usize = labels(s, c).map(|label| s.row(s.whereabouts[label] as usize).len()).sum();
        let free = s.clump_motion_next[c];
        let unpushed = Course { v: free.v, spin: s.clump_spin_next[c].0 };
        let squared = metric_of_clump(s, &here, &unpushed, &unpushed) * free.inverse_mass;
        Effort { work: metric_of_clump(s, &here, &change, &change), ..reference(s, slots, squared, free.inverse_mass) }
    });
    courses
}

/// The velocities of a clump's surface for its members.
pub fn spread(s: &mut State, courses: &[Course], into: impl Fn(&mut State) -> (&mut Vec<Motion>, &mut Vec<Spin>)) {
    for (c, course) in courses.iter().enumerate() {
        let here = clump(s, c);
        for label in labels(s, c) {
            let (i, motion) = (s.whereabouts[label] as usize, member_motion(s, &here, course, label));
            let (motions, spins) = into(s);
            (motions[i], spins[i]) = (motion, Spin(course.spin));
        }
    }
}
