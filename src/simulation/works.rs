//! Dissipation and works since step 0. The device adds up some steps; the host adds up those sums in double precision,
//! before what a step adds is too little beside them to keep its digits.

use super::runner::Runner;
use crate::{
    error::Result,
    measure::{CellSample, GrowthSample, Sample},
    plan::Plan,
    record::record,
    state::{Works, array::WORKS},
};

/// Steps that the device adds up by itself: in single precision they cost its sums less than 1e-5 of their value.
const STEPS: u64 = 256;

record!(
    /// Of the steps done so far.
    Totals {
        sum: Works,
        /// What step 0 has added by itself, per time, W.
        first: Works,
        /// The step after the last one in the sum.
        step: u64,
    }
);

fn powers(sample: &Sample) -> Works {
    Works {
        dissipated: sample.dissipation,
        walls: sample.wall_power,
        fixed: sample.fixed_power,
        cell: sample.cell_power,
        growth: sample.growth_power,
    }
}

impl Totals {
    /// At time 0.
    pub fn start(runner: &mut Runner, forget: &Plan, sample: &Sample) -> Result<Totals> {
        runner.execute_plan(forget)?;
        Ok(Totals { first: powers(sample), ..Totals::default() })
    }

    /// Steps until it is time to take over what the device has added up: always after as many, as chunks of steps may be
    /// of any length, and the order of a sum must not depend on it.
    pub fn steps_left(&self, step: u64) -> u64 {
        (self.step + STEPS).saturating_sub(step).max(1)
    }

    /// Take it over if it is time.
    pub fn keep_up(&mut self, runner: &mut Runner, forget: &Plan) -> Result<()> {
        if runner.step < self.step + STEPS { Ok(()) } else { self.collect(runner, forget) }
    }

    pub fn collect(&mut self, runner: &mut Runner, forget: &Plan) -> Result<()> {
        let bodies = runner.state.sizes.bodies;
        runner.read_pieces(&[&WORKS], bodies, |_, s| {
            for of_body in &s.works {
                self.sum.dissipated += of_body.dissipated;
                self.sum.walls += of_body.walls;
                self.sum.fixed += of_body.fixed;
                self.sum.cell += of_body.cell;
                self.sum.growth += of_body.growth;
            }
        })?;
        runner.execute_plan(forget)?;
        self.step = runner.step;
        Ok(())
    }

    /// Grains have come and gone between two samples of one step: half of that step is with those before, half with those
    /// after.
    pub fn change(&mut self, dt: f64, before: &Sample, after: &Sample) {
        let half = 0.5 * dt;
        let (before, after) = (powers(before), powers(after));
        self.sum.dissipated += half * (before.dissipated - after.dissipated);
        self.sum.walls += half * (before.walls - after.walls);
        self.sum.fixed += half * (before.fixed - after.fixed);
        self.sum.cell += half * (before.cell - after.cell);
        self.sum.growth += half * (before.growth - after.growth);
    }

    /// Take off what a step would add to which this sample belongs.
    pub fn take_back(&mut self, runner: &Runner, sample: &Sample) {
        let (of_step, dt) = (powers(sample), runner.state.params.dt);
        self.sum.dissipated -= dt * of_step.dissipated;
        self.sum.walls -= dt * of_step.walls;
        self.sum.fixed -= dt * of_step.fixed;
        self.sum.cell -= dt * of_step.cell;
        self.sum.growth -= dt * of_step.growth;
    }

    /// The sample with the works up to its step. A step's forces act from half a step before to half a step after its
    /// positions, so half of the first step was before time 0, and half of the next one is before this sample. What it
    /// finds to have slid since the step before is all before this sample.
    pub fn complete(&mut self, runner: &mut Runner, forget: &Plan, sample: Sample) -> Result<Sample> {
        self.collect(runner, forget)?;
        let (sum, first, now) = (self.sum, self.first, powers(&sample));
        let half = 0.5 * runner.state.params.dt;
        let slid = half * sample.sliding;
        let of = |part: fn(&Works) -> f64| Some(part(&sum) + half * (part(&now) - part(&first)));
        Ok(Sample {
            dissipated: of(|w| w.dissipated).map(|sum| sum + slid),
            work_walls: of(|w| w.walls),
            work_fixed: of(|w| w.fixed),
            cell: sample.cell.map(|cell| CellSample { work_cell: of(|w| w.cell), ..cell }),
            growth: sample.growth.map(|growth| GrowthSample { work_growth: of(|w| w.growth), ..growth }),
            ..sample
        })
    }
}
