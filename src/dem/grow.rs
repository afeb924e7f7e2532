//! Twin of `shaders/dem/grow.wgsl`: radii and masses, n to n + 1.

use crate::{
    contact::materials::material_of,
    space::precision::product_of,
    state::{HALTED, Position, PositionLow, State, Velocity},
};
use rayon::prelude::*;

pub fn grow(s: &mut State) {
    if s.halt[0] >= HALTED {
        return;
    }
    let row = s.halt[0] as usize * s.sizes.materials;
    for material in 0..s.sizes.materials {
        s.growth_rate_next[material] = s.growth_path[row + material].rate;
    }
    let of_body = |i: usize| {
        let now = s.growth_path[row + material_of(s, i)];
        let start = s.start_size[s.id[i] as usize];
        let (radius, low) = product_of(s, [start.radius, start.radius_low], [now.factor, now.factor_low]);
        (radius, low, start.inverse_mass * now.inverse_volume)
    };
    let grown: Vec<_> = (0..s.sizes.bodies).into_par_iter().with_min_len(256).map(of_body).collect();
    let mut used_up = false;
    for (i, (radius, low, inverse_mass)) in grown.into_iter().enumerate() {
        s.position_next[i] = Position { radius, ..s.position_next[i] };
        if let Some(of_place) = s.position_low_next.get_mut(i) {
            *of_place = PositionLow { radius: low, ..*of_place };
        }
        s.velocity_next[i] = Velocity { inverse_mass, ..s.velocity_next[i] };
        s.displacement[i] += (radius - s.position[i].radius).max(0.0);
        used_up |= !(s.displacement[i] <= s.params.displacement_limit);
    }
    if used_up {
        s.halt_next[0] = HALTED;
    }
}
