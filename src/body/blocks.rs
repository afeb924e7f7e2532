//! Runs of bodies that one task of the CPU engine works on.

use crate::state::{Sizes, State};
use rayon::{prelude::*, vec};

/// Grains that one task works on.
pub const BLOCK: usize = 512;

/// The runs of grains of an array over grains; empty runs where the model has no such array.
pub fn by_body<'a, T: Send>(array: &'a mut [T], s: &State) -> vec::IntoIter<&'a mut [T]> {
    let bodies = if array.is_empty() { 0 } else { s.sizes.bodies };
    runs(array, s.sizes.bodies, |i| i.min(bodies))
}

/// The same for an array over entries.
pub fn by_entry<'a, T: Send>(array: &'a mut [T], s: &State) -> vec::IntoIter<&'a mut [T]> {
    by_entry_of(array, &s.list_start, &s.sizes)
}

/// The same, where the rest of the state is not at hand.
pub fn by_entry_of<'a, T: Send>(array: &'a mut [T], list_start: &[u32], sizes: &Sizes) -> vec::IntoIter<&'a mut [T]> {
    let absent = array.is_empty();
    // A run begins with a slice of lists.
    runs(array, sizes.bodies, |i| if absent { 0 } else { list_start[sizes.slice_of(i)] as usize })
}

/// The same for an array over the history, which may be too short.
pub fn by_history<'a, T: Send>(array: &'a mut [T], history_start: &[u32], bodies: usize) -> vec::IntoIter<&'a mut [T]> {
    let len = array.len();
    runs(array, bodies, |i| (history_start[i] as usize).min(len))
}

/// The first entry of the run whose first grain this is.
#[inline(always)]
pub fn first_entry(s: &State, first: usize) -> usize {
    s.list_start[s.sizes.slice_of(first)] as usize
}

fn runs<T: Send>(mut array: &mut [T], bodies: usize, start: impl Fn(usize) -> usize) -> vec::IntoIter<&mut [T]> {
    let run = |begin: usize| {
        let len = start((begin + BLOCK).min(bodies)) - start(begin);
        let run;
        (run, array) = std::mem::take(&mut array).split_at_mut(len);
        run
    };
    (0..bodies).step_by(BLOCK).map(run).collect::<Vec<_>>().into_par_iter()
}
