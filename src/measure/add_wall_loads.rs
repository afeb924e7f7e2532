//! Twin of `shaders/measure/add_wall_loads.wgsl`: sums of the rows that walls have.

use crate::state::{Spin, State, WALL_PARTS, WallLoad};

pub fn add_wall_loads(s: &mut State) {
    let (parts, rows) = (WALL_PARTS * s.sizes.walls, s.sizes.partial_sums() * s.sizes.walls);
    for part in 0..parts {
        let mut sum = WallLoad::default();
        for row in (part..rows).step_by(parts) {
            sum.force += s.wall_load_sums[row].force;
            sum.moment = Spin(sum.moment.0 + s.wall_load_sums[row].moment.0);
            sum.normal_force += s.wall_load_sums[row].normal_force;
            sum.stiffness += s.wall_load_sums[row].stiffness;
        }
        s.wall_load[part] = sum;
    }
}
