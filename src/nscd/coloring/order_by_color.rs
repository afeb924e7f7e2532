//! Twin of `shaders/nscd/coloring/order_by_color.wgsl`: contacts with the impulses they have now, in the order of the
//! colours. Momentum begins anew.

use crate::{
    nscd::contact::{entry_of, list_entries},
    state::{ACTIVE, ColoredContact, ContactColor, INDEX, NONE, Packed, State},
};
use rayon::prelude::*;

pub fn order_by_color(s: &mut State) {
    let begins: Vec<usize> = s
        .color_count
        .iter()
        .scan(0, |end, &contacts| {
            *end += contacts as usize;
            Some(*end - contacts as usize)
        })
        .collect();
    let contacts: Vec<_> = (0..s.sizes.bodies).into_par_iter().flat_map_iter(|i| colored_contacts_of(s, i)).collect();
    for (contact_color, contact) in contacts {
        let at = begins[contact_color.color as usize - 1] + contact_color.rank as usize;
        let entry = contact.entry as usize;
        let impulse = Packed(s.impulse[entry].0);
        (s.colored_contact[at], s.colored_impulse[at], s.colored_impulse_before[at]) = (contact, impulse, impulse);
        (s.colored_geometry[at], s.colored_inverse_effective_mass[at]) =
            (s.contact_geometry[entry], s.inverse_effective_mass[entry]);
        s.colored_free_velocity[at] = s.free_contact_velocity[entry];
    }
    s.pass_velocity_before.clone_from(&s.pass_velocity);
    s.extrapolated_velocity.clone_from(&s.pass_velocity);
    s.pass_spin_before.clone_from(&s.pass_spin);
    s.extrapolated_spin.clone_from(&s.pass_spin);
    (s.solver_state[0].theta, s.solver_state[0].beta) = (1.0, 0.0);
}

/// Coloured contacts of which grain i is the first.
fn colored_contacts_of(s: &State, i: usize) -> impl Iterator<Item = (ContactColor, ColoredContact)> + '_ {
    let own = move |&entry: &usize| s.contact_color[entry].color > 0 && (s.neighbour[entry] & INDEX) as usize > i;
    list_entries(s, i).filter(own).map(move |entry| (s.contact_color[entry], colored_contact_of(s, i, entry)))
}

fn colored_contact_of(s: &State, i: usize, entry: usize) -> ColoredContact {
    let second = s.neighbour[entry] & INDEX;
    let j = second as usize;
    ColoredContact {
        first: if s.neighbour[entry] & ACTIVE != 0 { i as u32 } else { NONE },
        second,
        entry: entry as u32,
        back: if j < s.sizes.bodies { entry_of(s, j, i) as u32 } else { NONE },
    }
}
