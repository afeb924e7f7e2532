//! Radii that change, looked at between chunks.

use super::Simulation;
use crate::error::{Error, Result};

impl Simulation {
    /// # Errors
    /// [`Error::Run`] if grains can grow no further, and nobody has asked them to cease.
    pub(super) fn check_room_to_grow(&self) -> Result<()> {
        let Some(law) = &self.growth else { return Ok(()) };
        if self.time() < law.full || law.ends <= law.full {
            return Ok(());
        }
        let reason = "the grains fill the cell, or are as large as a period lets them be, and would grow on: end the run before \
                      (stop.packing_fraction, stop.pressure), or growth by growth.final"
            .to_owned();
        Err(Error::Run { step: self.step(), time: self.time(), reason })
    }
}
