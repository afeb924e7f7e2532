//! Walls that servos move, looked at between chunks: where they are, and whether they find anything to press on.

use super::Simulation;
use crate::{
    error::{Error, Result},
    scene::{Surface, Wall},
};

impl Simulation {
    /// Lists follow walls that servos have moved.
    ///
    /// # Errors
    /// [`Error::Run`] if one has gone through all of the bed, or as far away from it, to no avail.
    pub(super) fn follow_driven_walls(&mut self) -> Result<()> {
        if !self.model().driven_walls {
            return Ok(());
        }
        let walls = self.walls()?;
        let points = self.runner.state.wall.iter().map(|wall| wall.point.abs().max_element());
        self.lists.see_walls(points.fold(0.0, f64::max));
        for ((now, start), longest) in walls.iter().zip(&self.assembly.walls).zip(&self.longest_ways) {
            if let Some(reason) = gone_too_far(start, now, *longest) {
                return Err(Error::Run { step: self.step(), time: self.time(), reason });
            }
        }
        Ok(())
    }
}

/// Why a servo moves its wall to no avail.
fn gone_too_far(start: &Wall, now: &Wall, longest: f64) -> Option<String> {
    let way = now.surface.position() - start.surface.position();
    if start.servo.is_none() || way.abs() < longest {
        return None;
    }
    let (inward, what) = match start.surface {
        Surface::Plane { .. } => (way > 0.0, "has moved it by"),
        Surface::Cylinder { .. } => (way < 0.0, "has changed its radius by"),
    };
    let why = if inward {
        "through all of the bed, and finds too little to press on"
    } else {
        "away from the bed, which presses on it with more than its target all the same"
    };
    let name = &start.name;
    Some(format!(
        "the servo of the wall \"{name}\" {what} {:.4e} m, {why}; change the target, or what is in its way",
        way.abs()
    ))
}
