//! Twin of `shaders/neighbours/history_count.wgsl`: how many contacts with a history each grain has.

use crate::{contact::history::active_contacts, state::State};
use rayon::prelude::*;

pub fn history_count(s: &mut State) {
    let mut history_start = std::mem::take(&mut s.history_start);
    let (last, bodies) = history_start.split_last_mut().expect("one more than there are grains");
    bodies.par_iter_mut().enumerate().for_each(|(i, count)| *count = active_contacts(s, i).count() as u32);
    *last = 0;
    s.history_start = history_start;
}
