//! The plans of a model, each from its chapter: `packstone describe` prints them.

use crate::{
    dem, measure,
    model::{Method, Model},
    neighbours, nscd,
    plan::{Loop, Op, Plan, plan, repeat, swap_again},
    stage::Stage,
};
use std::fmt;

/// All that an engine is asked to do.
#[derive(Clone, Debug)]
pub struct Plans {
    /// Neighbour lists: those of time 0, and for samples after a step that has used them up.
    pub lists: Plan,
    /// Once, at time 0.
    pub start: Plan,
    /// What a run consists of, with the lists that it needs: in the discrete element method as many steps as lists
    /// serve, in contact dynamics one.
    pub chunk: Plan,
    /// Of a step what brings the state from n to n + 1.
    pub motion: Plan,
    /// The exchanges of that alone, to take a step back.
    pub swaps: Vec<Op>,
    pub sums: Plan,
    pub wall_loads: Plan,
    pub forget_works: Plan,
    pub velocities: Plan,
    pub forces: Plan,
    method: Method,
}

impl Plans {
    /// The discrete element method, section 2.1, or contact dynamics, section 2.2.
    pub fn new(model: &Model) -> Plans {
        let (start, chunk, motion) = match model.method {
            Method::DiscreteElements => {
                let step = dem::plan::step(model);
                (
                    dem::plan::start(model),
                    neighbours::plan::chunk(
                        model,
                        &plan([measure::plan::servo(model), measure::plan::works(model), step.clone()]),
                    ),
                    step,
                )
            }
            Method::ContactDynamics => (Plan::default(), nscd::plan::step(model), nscd::plan::motion(model)),
        };
        Plans {
            lists: neighbours::plan::lists(model),
            start,
            chunk,
            swaps: motion.swaps(),
            motion,
            sums: measure::plan::sums(model),
            wall_loads: measure::plan::wall_loads(model),
            forget_works: measure::plan::forget_works(model),
            velocities: measure::plan::velocities(model),
            forces: measure::plan::forces(),
            method: model.method,
        }
    }

    /// Those that there are, each once, in the order of a run.
    pub fn named(&self) -> Vec<(&'static str, &Plan)> {
        let own = match self.method {
            Method::DiscreteElements => {
                vec![("at time 0, with first lists", &self.start), ("chunk of steps", &self.chunk)]
            }
            Method::ContactDynamics => vec![("step", &self.chunk)],
        };
        let samples = [
            ("samples: sums", &self.sums),
            ("samples: loads on walls", &self.wall_loads),
            ("samples: works from then on", &self.forget_works),
            ("samples: velocities", &self.velocities),
            ("samples: contact forces", &self.forces),
        ];
        own.into_iter().chain(samples).filter(|(_, plan)| !plan.ops().is_empty()).collect()
    }

    /// All that there are, each with what may follow it at once: after a chunk a step may be taken back, or for a look at
    /// the forces taken back and done again.
    pub fn all(&self) -> Vec<Plan> {
        let back = || swap_again(&self.swaps);
        let again = repeat(Loop::IfStepIsTakenBack, plan([self.forces.clone(), back()]));
        let chunk = plan([self.chunk.clone(), repeat(Loop::IfStepIsTakenBack, plan([back(), again]))]);
        let others = [
            &self.lists,
            &self.start,
            &self.sums,
            &self.wall_loads,
            &self.forget_works,
            &self.velocities,
            &self.forces,
        ];
        others.into_iter().cloned().chain([chunk]).collect()
    }

    /// All operations, in order.
    pub fn ops(&self) -> Vec<Op> {
        self.named().into_iter().flat_map(|(_, plan)| plan.ops()).collect()
    }

    /// Every stage once, in the order of first use.
    pub fn stages(&self) -> Vec<&'static Stage> {
        let mut stages: Vec<&'static Stage> = Vec::new();
        for stage in self.ops().iter().filter_map(Op::stage) {
            if !stages.contains(&stage) {
                stages.push(stage);
            }
        }
        stages
    }
}

impl fmt::Display for Plans {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, plan) in self.named() {
            writeln!(f, "{name}")?;
            plan.to_string().lines().try_for_each(|line| writeln!(f, "  {line}"))?;
        }
        Ok(())
    }
}
