//! Colours of contacts: contacts of one colour share no grain, so that all of them may be updated in place at once.

mod assign_colors;
mod order_by_color;
pub mod priority;
mod propose;
mod resolve;

use crate::{stage::*, state::array};

/// Colors of contacts 1: what every body would have coloured next.
pub static PROPOSE: Stage = Stage::new("nscd/coloring", "propose", propose::propose, bodies);

/// Colors of clumps: what every clump would have coloured next, of what its members would.
pub static RESOLVE: Stage = Stage::new("nscd/coloring", "resolve", resolve::resolve, clumps);

/// Colors of contacts 2: what both grains agree on.
pub static ASSIGN_COLORS: Stage = Stage {
    check: Check { unordered: &[&array::CONTACT_COLOR], ..Check::ROUNDING },
    ..Stage::new("nscd/coloring", "assign_colors", assign_colors::assign_colors, bodies)
};

/// Colors of contacts 3: contacts in their order.
pub static ORDER_BY_COLOR: Stage =
    Stage::new("nscd/coloring", "order_by_color", order_by_color::order_by_color, bodies);
