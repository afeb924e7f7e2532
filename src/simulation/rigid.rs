//! A step of contact dynamics: passes over the contacts until their residual is small enough.

use super::{Simulation, host};
use crate::{
    error::{Error, Result},
    scene::Method,
    state::{ARRAYS, Length, SolverState},
};
use std::time::Instant;

/// Fewest and most passes that are begun without a look at the residual.
const LEAST_AT_ONCE: u32 = 4;
const MOST_AT_ONCE: u32 = 256;

/// By colours velocities gather rounding until they are judged, and momentum adds it up twice: in single precision the residual
/// would stay above 5e-4.
const MOST_BY_COLOURS: u32 = 16;
/// The same for sweeps over a colour, of which a pass has as many as there are colours: a grain may have hundreds of contacts.
const MOST_SWEEPS: u32 = 8192;

/// Passes of the power iteration when lists have been made.
const PROBES: u32 = 40;

/// Rounds of colouring before the host asks whether all contacts have a colour.
const ROUNDS_OF_COLOURS: u32 = 8;

/// Most solutions of a step on the host, each with the pairs that the one before has brought together.
const ROUNDS: u32 = 16;

/// How the contacts of the steps so far have been solved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solved {
    pub steps: u64,
    /// Steps that ended with a residual above the tolerance.
    pub unconverged: u64,
    /// Passes of all steps, and of the last one.
    pub iterations: u64,
    pub last_iterations: u32,
    /// Relative residual of the natural map: sum over the steps, largest, and of the last one.
    pub residual_sum: f64,
    pub residual_max: f64,
    pub last_residual: f64,
    /// Largest friction beyond the Coulomb limit over the largest normal impulse, of the last step.
    pub last_excess: f64,
    /// Solvers that solve contacts one by one: updates that found no solution, also those of steps done again.
    pub local_failures: u64,
}

/// What the host has seen of the relaxation of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Passes so far.
    pub passes: u32,
    /// Relative residual of the natural map.
    pub residual: f64,
    /// Wall time since contacts were looked for in the lists, s.
    pub seconds: f64,
}

impl Simulation {
    /// One step.
    ///
    /// # Errors
    /// As [`Simulation::advance`].
    pub(super) fn advance_rigid(&mut self) -> Result<()> {
        loop {
            if self.life == 0 {
                self.set_margin();
                let counters = self.run(0)?;
                if counters.lost_body > 0 {
                    return Err(self.gone(counters.lost_body, self.step)?);
                }
            }
            let (passes, residual, coulomb_excess) = self.relax()?;
            let params = self.params();
            let step = (&self.plan.step[..], 1);
            self.engine.execute(&params, &[step, (&self.plan.survey, 1)])?;
            let counters = self.engine.counters()?;
            // Lists have to reach to where the step ends, because grains meet on their way there.
            self.note_drift(&counters);
            if counters.lost_body > 0 {
                let reason = self.gone(counters.lost_body, self.step)?;
                self.engine.execute(&params, &[(&self.plan.swaps, 1)])?;
                (self.spent, self.life) = (true, 0);
                return Err(reason);
            }
            if !self.spent {
                self.solved.add(passes, residual, coulomb_excess, self.state.params.tolerance);
                self.life = self.life.saturating_sub(1);
                self.step += 1;
                return Ok(());
            }
            self.engine.execute(&params, &[(&self.plan.swaps, 1)])?;
            self.life = 0;
            self.replayed += 1;
        }
    }

    /// Passes until the step is solved, or its iterations are used up: how many, the residual and the Coulomb excess that are
    /// left.
    fn relax(&mut self) -> Result<(u32, f64, f64)> {
        let began = Instant::now();
        self.looks.clear();
        let tolerance = self.state.params.tolerance;
        let params = self.params();
        let (begin, meet) = ((&self.plan.begin[..], 1), (&self.plan.meet[..], 1));
        if self.age == 0 {
            // Contacts are others than before.
            self.engine.execute(&params, &[(&self.plan.bleach, 1)])?;
        }
        if self.age == 0 && !self.plan.seed.is_empty() {
            let (seed, probe) = ((&self.plan.seed[..], 1), (&self.plan.probe[..], PROBES));
            self.engine.execute(&params, &[begin, meet, seed, probe])?;
        }
        self.engine.execute(&params, &[begin, meet])?;
        if let Method::ContactDynamics(relaxation) = self.assembly.solver.method
            && !host::on_engine(relaxation.solver)
        {
            let mut passes = 0;
            for round in 1.. {
                passes = self.relax_on_host(&relaxation, passes, began)?;
                self.engine.execute(&params, &[(&self.plan.judge, 1)])?;
                let judged = self.look(began, |_| passes)?;
                // Pairs that were left out may have met; then once more, with them.
                let out = passes >= self.most_passes || round == ROUNDS;
                if judged.residual <= tolerance || judged.late_contacts == 0 || out {
                    return Ok((passes, judged.residual, judged.coulomb_excess));
                }
            }
        }
        let mut passes = 0;
        let mut colors = self.color()?;
        // Most steps take about as many passes as the one before; to learn of fewer, begin with fewer.
        let mut batch = (self.solved.last_iterations * 3 / 4).clamp(LEAST_AT_ONCE, MOST_AT_ONCE);
        let mut seen = (0, f64::INFINITY);
        loop {
            batch = batch.min(self.most_passes - passes);
            if let Some(most) = MOST_SWEEPS.checked_div(colors) {
                batch = batch.min(MOST_BY_COLOURS).min(most.max(1));
            }
            let pass = [(&self.plan.sweep[..], colors), (&self.plan.relax, 1)];
            let batched = (0..batch).flat_map(|_| pass).chain([(&self.plan.judge[..], 1)]);
            self.engine.execute(&params, &batched.collect::<Vec<_>>())?;
            let relaxation = self.look(began, |relaxation| relaxation.passes)?;
            passes = relaxation.passes;
            if relaxation.residual <= tolerance || passes >= self.most_passes || relaxation.residual.is_nan() {
                return Ok((passes, relaxation.residual, relaxation.coulomb_excess));
            }
            if relaxation.late_contacts > 0 {
                colors = self.color()?;
            }
            // As many as it takes if the residual goes on falling as it has since the last look, but no more than a quarter of
            // what there were.
            let fall = (seen.1 / relaxation.residual).ln() / f64::from(passes - seen.0);
            let needed = (relaxation.residual / tolerance).ln() / fall;
            batch = if needed > 0.0 { needed.ceil() as u32 } else { u32::MAX }
                .min(passes / 4)
                .clamp(LEAST_AT_ONCE, MOST_AT_ONCE);
            seen = (passes, relaxation.residual);
        }
    }

    /// Read what the last judgement has found, and keep it with the passes so far and the time.
    fn look(&mut self, began: Instant, passes: impl Fn(&SolverState) -> u32) -> Result<SolverState> {
        self.engine.read(&["solver_state"], &mut self.state)?;
        let judged = self.state.solver_state[0];
        let seconds = began.elapsed().as_secs_f64();
        self.looks.push(Look { passes: passes(&judged), residual: judged.residual, seconds });
        Ok(judged)
    }

    /// Give colours to all contacts that have none, and put them in order: how many colours there are. 0 if contacts are not
    /// updated by colours.
    fn color(&mut self) -> Result<u32> {
        if !self.state.model.colored {
            return Ok(0);
        }
        let params = self.params();
        let mut colored = 0;
        loop {
            self.engine.execute(&params, &[(&self.plan.color, ROUNDS_OF_COLOURS), (&self.plan.color[..1], 1)])?;
            self.engine.read(&["coloring_state"], &mut self.state)?;
            let coloring_state = self.state.coloring_state[0];
            if self.state.sizes.make_room(&coloring_state) {
                for array in ARRAYS.iter().filter(|a| matches!(a.length, Length::Contacts | Length::Colors)) {
                    self.engine.resize(array.name, self.state.sizes.of(array.length))?;
                }
                self.engine.execute(&params, &[(&self.plan.bleach, 1)])?;
                colored = 0;
            } else if coloring_state.uncolored == 0 {
                self.engine.execute(&params, &[(&self.plan.arrange, 1)])?;
                return Ok(coloring_state.colors);
            } else if coloring_state.contacts == colored {
                // A defect, which must not turn into a loop without end: a contact that only one of its grains knows of.
                return Err(Error::Device(format!("{} cannot colour the contacts", self.engine.name())));
            } else {
                colored = coloring_state.contacts;
            }
        }
    }

    /// From now on a step of contact dynamics may take this many passes.
    pub fn limit_passes(&mut self, most: u32) {
        if let Method::ContactDynamics(relaxation) = &mut self.assembly.solver.method {
            (relaxation.max_iterations, self.most_passes) = (most.max(1), most.max(1));
        }
    }

    /// The residual of the last step as its relaxation went on; the last entry is what it ended with.
    pub fn looks(&self) -> &[Look] {
        &self.looks
    }

    /// How the contacts have been solved so far; None outside of contact dynamics.
    pub fn solved(&self) -> Option<&Solved> {
        (self.most_passes > 0).then_some(&self.solved)
    }
}

impl Solved {
    fn add(&mut self, passes: u32, residual: f64, coulomb_excess: f64, tolerance: f64) {
        self.steps += 1;
        self.unconverged += u64::from(!(residual <= tolerance));
        self.iterations += u64::from(passes);
        self.residual_sum += residual;
        self.residual_max = if residual.is_nan() { f64::INFINITY } else { self.residual_max.max(residual) };
        (self.last_iterations, self.last_residual, self.last_excess) = (passes, residual, coulomb_excess);
    }
}
