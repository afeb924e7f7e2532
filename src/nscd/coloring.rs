//! Colours of contacts: contacts of one colour share no grain, so that all of them may be updated in place at once.

mod assign_colors;
mod count_large_contacts;
mod order_by_color;
pub mod priority;
mod propose;
mod resolve;

use crate::{
    error::{Error, Result},
    stage::*,
    state::{ColoringState, Sizes, array},
};

/// What the host knows of the colours of a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Coloring {
    /// Colours that all contacts have.
    pub colors: u32,
    /// Whether arrays have turned out too short, so that it begins anew.
    pub too_short: bool,
    /// Contacts with a colour.
    colored: u32,
}

impl Coloring {
    /// Look at how far it is: whether all contacts have a colour. If arrays are too short, `sizes` become larger.
    ///
    /// # Errors
    /// [`Error::Device`] if it does not get on.
    pub fn look(&mut self, seen: &ColoringState, sizes: &mut Sizes) -> Result<bool> {
        let before = std::mem::take(&mut self.colored);
        self.too_short = sizes.make_room(seen);
        if self.too_short {
            return Ok(false);
        }
        if seen.uncolored == 0 {
            self.colors = seen.colors;
            return Ok(true);
        }
        if seen.contacts == before {
            // A defect, which must not turn into a loop without end: a contact that only one of its grains knows of.
            return Err(Error::Device("the contacts cannot be coloured".to_owned()));
        }
        self.colored = seen.contacts;
        Ok(false)
    }
}

/// Colors of contacts 1: what every body would have coloured next.
pub static PROPOSE: Stage = Stage::new("nscd/coloring", "propose", propose::propose, bodies);

/// Colors of clumps: what every clump would have coloured next, of what its members would.
pub static RESOLVE: Stage = Stage::new("nscd/coloring", "resolve", resolve::resolve, clumps);

/// Colors of contacts 2: what both grains agree on.
pub static ASSIGN_COLORS: Stage = Stage {
    check: Check { unordered: &[&array::CONTACT_COLOR], ..Check::ROUNDING },
    ..Stage::new("nscd/coloring", "assign_colors", assign_colors::assign_colors, bodies)
};

/// Colors of contacts, where grains are large: how many of theirs there are, which have no colours.
pub static COUNT_LARGE_CONTACTS: Stage =
    Stage::over_lists("nscd/coloring", "count_large_contacts", count_large_contacts::count_large_contacts);

/// Colors of contacts 3: contacts in their order.
pub static ORDER_BY_COLOR: Stage =
    Stage::new("nscd/coloring", "order_by_color", order_by_color::order_by_color, bodies);
