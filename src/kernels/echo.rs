//! Twin of `shaders/echo.wgsl`: the impulses that their members hold alone give clumps velocities.

use super::respond::spread;
use crate::{
    laws::{
        answer::{course_ahead, courses, metric_of_clump, push_of},
        grains::clump,
        rigid::keep_efforts_of_clumps,
    },
    state::{Effort, State},
};

pub fn echo(s: &mut State) {
    keep_efforts_of_clumps(s, |s, c| {
        let here = clump(s, c);
        let start = course_ahead(s, c, &here);
        Effort { work: metric_of_clump(s, &here, &start, &start), ..Effort::default() }
    });
    spread(s, &courses(s, push_of), |s| (&mut s.trial, &mut s.trial_spin));
}
