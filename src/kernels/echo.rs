//! Twin of `shaders/echo.wgsl`: the impulses that their members hold alone give clumps velocities.

use super::respond::spread;
use crate::{
    laws::{
        answer::{Course, course_ahead, metric_of_clump, push_of},
        grains::clump,
        rigid::keep_efforts_of_clumps,
    },
    state::{Effort, State},
};
use rayon::prelude::*;

pub fn echo(s: &mut State) {
    keep_efforts_of_clumps(s, |s, c| {
        let here = clump(s, c);
        let start = course_ahead(s, c, &here);
        Effort { work: metric_of_clump(s, &here, start.0, start.1), ..Effort::default() }
    });
    let of = |c| push_of(s, c, &clump(s, c));
    let courses: Vec<Course> = (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(of).collect();
    spread(s, &courses, |s| (&mut s.trial, &mut s.trial_spin));
}
