//! Twin of `shaders/measure/add_works_of_clumps.wgsl`: what free clumps add to the dissipation of their members in a
//! step; it stands with the first of them.

use crate::{
    measure::{body_sums::add_to_works, energies::energies_of_clump},
    space::boundary::flow_power,
    state::{HALTED, State, Works},
};
use rayon::prelude::*;

pub fn add_works_of_clumps(s: &mut State) {
    if s.halt[0] >= HALTED {
        return;
    }
    let power = |c| {
        let own = energies_of_clump(s, c);
        Works { dissipated: own.dissipation, cell: flow_power(s, -own.flux, -own.flux_above), ..Works::default() }
    };
    let powers: Vec<Works> = (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(power).collect();
    for (c, power) in powers.into_iter().enumerate() {
        add_to_works(&mut s.works[s.first_member[c] as usize], s.params.dt, &power);
    }
}
