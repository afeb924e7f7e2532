//! What runs: a state, the engine that holds it, and the operations that wait to be submitted.

use super::{
    start::Guides,
    stops::{self, Known},
};
use crate::{
    engine::{ALL, Engine, PIECE},
    error::{Error, Result},
    plan::{Op, Plan},
    state::{Array, Counters, Params, State, array::*, present},
};

/// The parameters of a chunk after so many steps: at time 0 springs have not been stretched yet, if contacts are new.
pub fn params_of_step(p: &Params, step: u64) -> Params {
    Params { history_dt: if step == 0 { 0.0 } else { p.dt }, step: step as u32, ..*p }
}

/// What the mirror has at all times.
pub fn is_kept(array: &Array) -> bool {
    [&WALL, &CELL].contains(&array)
}

pub struct Runner {
    pub engine: Box<dyn Engine>,
    /// The host's mirror: arrays that have been read, as fresh as that, and parameters.
    pub state: State,
    /// Steps done.
    pub step: u64,
    /// Whether the last step had an overlap of more than `deep_overlap`.
    pub overlaps_deeply: bool,
    /// Whether contacts remember what was before step 0.
    pub remembering: bool,
    /// Whether they remember this step already, as it was taken back: what they had before is not kept. The step is the
    /// same when it is done again.
    pub springs_of_now: bool,
    /// Operations of many steps are submitted together.
    queue: Vec<Op>,
    /// What messages say of the scene.
    pub known: Known,
    /// Where the host says where walls go, and how radii change.
    guides: Option<Guides>,
}

impl Runner {
    pub fn new(engine: Box<dyn Engine>, state: State, known: Known, guides: Option<Guides>) -> Runner {
        let (step, queue) = (0, Vec::new());
        let (overlaps_deeply, remembering, springs_of_now) = (false, false, false);
        Runner { engine, state, step, overlaps_deeply, remembering, springs_of_now, queue, known, guides }
    }

    /// Tell the engine where walls go, and how radii change, in the next steps, if the host says so: how far walls get from
    /// the origin, m.
    pub fn guide(&mut self, steps: u32) -> Result<f64> {
        let Some(guides) = &self.guides else { return Ok(0.0) };
        let (path, farthest) = guides.path(&self.state, self.step, steps);
        self.engine.write(&present(&self.state.model, &[&WALL_PATH, &GROWTH_PATH]), 0, &path)?;
        Ok(farthest)
    }

    /// The parameters of the next step.
    pub fn params(&self) -> Params {
        let params = params_of_step(&self.state.params, self.step);
        match () {
            () if self.springs_of_now => Params { history_dt: 0.0, ..params },
            () if self.remembering => Params { history_dt: params.dt, ..params },
            () => params,
        }
    }

    /// To be done with the next submission.
    pub fn push(&mut self, op: Op) {
        self.queue.push(op);
    }

    /// Nothing of what waits is to be done.
    pub fn forget_queue(&mut self) {
        self.queue.clear();
    }

    /// Have the engine do all that waits.
    pub fn submit(&mut self) -> Result<()> {
        let params = self.params();
        let done = if self.queue.is_empty() { Ok(()) } else { self.engine.execute(&params, &self.queue) };
        self.queue.clear();
        done
    }

    /// Submit operations, this many times.
    pub fn execute(&mut self, ops: &[Op], times: u32) -> Result<()> {
        (0..times).for_each(|_| self.queue.extend(ops));
        self.submit()
    }

    /// Submit a plan without loops.
    pub fn execute_plan(&mut self, plan: &Plan) -> Result<()> {
        self.execute(&plan.ops(), 1)
    }

    /// Read arrays into the host's mirror.
    pub fn read(&mut self, arrays: &[&'static Array]) -> Result<&State> {
        self.engine.read(arrays, ALL, &mut self.state)?;
        Ok(&self.state)
    }

    /// Look at arrays of so many elements piece by piece: the number of the first element, and a state that has these
    /// elements alone. The mirror has nothing of the arrays afterwards.
    pub fn read_pieces(
        &mut self,
        arrays: &[&'static Array],
        len: usize,
        mut see: impl FnMut(usize, &State),
    ) -> Result<()> {
        let arrays = present(&self.state.model, arrays);
        for first in (0..len).step_by(PIECE) {
            self.engine.read(&arrays, first..(first + PIECE).min(len), &mut self.state)?;
            see(first, &self.state);
        }
        self.state.release(&arrays);
        Ok(())
    }

    /// An error if the device says that a grain is lost.
    pub fn check_lost(&mut self, counters: &Counters) -> Result<()> {
        match counters.lost_body {
            0 => Ok(()),
            mark => Err(self.lost_grain(mark, self.step)?),
        }
    }

    /// Why the run cannot go on after this step, from the device's mark of the grain.
    pub fn lost_grain(&mut self, mark: u32, step: u64) -> Result<Error> {
        let arrays = [&POSITION, &POSITION_LOW, &VELOCITY, &SPIN, &ID, &CLUMP_OF_ID, &WALL, &CELL];
        let arrays = present(&self.state.model, &arrays);
        self.read(&arrays)?;
        let dt = self.state.params.dt;
        let reason = stops::reason(&self.state, self.state.params.bodies - mark, &self.known);
        self.state.release(&arrays.into_iter().filter(|array| !is_kept(array)).collect::<Vec<_>>());
        Ok(Error::Run { step, time: step as f64 * dt, reason })
    }

    /// Why the cell cannot deform any further after this step.
    pub fn narrow_cell(&mut self, step: u64) -> Result<Error> {
        let (p, cell) = (self.state.params, self.read(&[&CELL])?.cell[0]);
        let lengths = (cell.length + cell.length_low).to_array();
        let narrow = (0..3).filter(|axis| lengths[*axis] > 0.0).min_by(|a, b| lengths[*a].total_cmp(&lengths[*b]));
        let axis = narrow.unwrap_or(0);
        let reason = format!(
            "the cell is only {:.4e} m long along {} now; it must stay above {:.4e} m, or grains would meet two images of a neighbour: \
             stop earlier (stop.strain, stop.packing_fraction) or take more grains",
            lengths[axis],
            ["x", "y", "z"][axis],
            p.narrowest
        );
        Ok(Error::Run { step, time: step as f64 * p.dt, reason })
    }
}
