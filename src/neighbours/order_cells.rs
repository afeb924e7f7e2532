//! Twin of `shaders/neighbours/order_cells.wgsl`: ascending numbers inside each cell.

use crate::state::State;

pub fn order_cells(s: &mut State) {
    for cell in s.cell_start.windows(2) {
        s.sorted[cell[0] as usize..cell[1] as usize].sort_unstable_by_key(|&i| s.id[i as usize]);
    }
}
