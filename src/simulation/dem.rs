//! Steps of the discrete element method.

use super::{lists::NeighbourLists, runner::Runner};
use crate::{
    error::{Error, Result},
    plans::Plans,
};

/// One chunk of at most `steps`: the steps done.
///
/// # Errors
/// [`Error::Run`] if a grain is lost or moves too fast; the state is then the last good one.
pub fn advance(plans: &Plans, runner: &mut Runner, lists: &mut NeighbourLists, steps: u64) -> Result<u64> {
    if lists.are_used_up() {
        lists.set_margin(&mut runner.state.params);
    }
    let alone = runner.step == 0 || runner.springs_of_now;
    let steps = if alone { 1 } else { steps.clamp(1, u64::from(lists.steps())) as u32 };
    lists.see_walls(runner.guide(steps)?);
    let counters = lists.run(plans, runner, steps)?;
    runner.overlaps_deeply = counters.deep_overlaps > 0;
    if counters.lost_body > 0 {
        let reason = runner.lost_grain(counters.lost_body, runner.step + u64::from(counters.steps_done))?;
        if counters.steps_done > 0 {
            // The state before the step that lost the grain is where the step after it would have been written; walls have
            // not moved in it.
            runner.execute(&plans.swaps, 1)?;
            runner.step += u64::from(counters.steps_done - 1);
            runner.springs_of_now = true;
            lists.discard();
        }
        return Err(reason);
    }
    if counters.narrow_cell > 0 {
        runner.step += u64::from(counters.steps_done);
        return Err(runner.narrow_cell(runner.step)?);
    }
    if counters.steps_done == 0 {
        // A defect, which must not turn into a loop without end.
        let engine = runner.engine.name();
        return Err(Error::Device(format!("{engine} did none of {steps} steps and gave no reason")));
    }
    runner.step += u64::from(counters.steps_done);
    runner.springs_of_now = false;
    Ok(u64::from(counters.steps_done))
}
