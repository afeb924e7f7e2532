//! Twin of `shaders/recover.wgsl`: the velocities of members freed of the rounding that the updates in place have left in them.

use crate::{
    laws::{
        answer::{course_of, courses, member_motion},
        grains::{clump, labels},
        rigid::settle,
    },
    state::State,
};

pub fn recover(s: &mut State) {
    for (c, course) in courses(s, course_of).iter().enumerate() {
        let here = clump(s, c);
        for label in labels(s, c) {
            let motion = member_motion(s, &here, course, label);
            settle(s, s.whereabouts[label] as usize, motion, course.spin);
        }
    }
}
