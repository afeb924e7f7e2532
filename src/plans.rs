//! The plans of a model, each from its chapter: `packstone describe` prints them.

use crate::{
    dem, measure,
    model::{Method, Model},
    neighbours::{self, DISPLACEMENT_CHECK},
    nscd,
    plan::{Op, Plan, run},
    stage::Stage,
};
use std::fmt;

/// All that an engine is asked to do.
#[derive(Clone, Debug)]
pub struct Plans {
    /// Once, at time 0.
    pub start: Plan,
    /// New lists, and in the discrete element method the steps that they serve.
    pub chunk: Plan,
    /// A step: explicit, or implicit with the solution of its contacts.
    pub step: Plan,
    /// Of a step what brings the state from n to n + 1.
    pub motion: Plan,
    /// The exchanges of that alone: for a step that was halted, or to take one back.
    pub swaps: Vec<Op>,
    /// Contact dynamics by colours: all contacts without one.
    pub reset_colors: Vec<Op>,
    /// How far grains have gone since their lists were made; part of the above.
    pub displacements: Plan,
    pub sums: Plan,
    pub velocities: Plan,
    pub forces: Plan,
    method: Method,
}

impl Plans {
    /// The discrete element method, section 2.1, or contact dynamics, section 2.2.
    pub fn new(model: &Model) -> Plans {
        let (start, chunk, step, motion) = match model.method {
            Method::DiscreteElements => {
                let step = dem::plan::step(model);
                (dem::plan::start(model), neighbours::plan::chunk(model, step.clone()), step.clone(), step)
            }
            Method::ContactDynamics => {
                let chunk = neighbours::plan::chunk(model, Plan::default());
                (Plan::default(), chunk, nscd::plan::step(model), nscd::plan::motion(model))
            }
        };
        Plans {
            start,
            chunk,
            step,
            swaps: motion.swaps(),
            motion,
            reset_colors: nscd::plan::reset_colors().ops(),
            displacements: run(&DISPLACEMENT_CHECK),
            sums: measure::plan::sums(model),
            velocities: measure::plan::velocities(model),
            forces: measure::plan::forces(),
            method: model.method,
        }
    }

    /// Those that there are, each once, in the order of a run.
    pub fn named(&self) -> Vec<(&'static str, &Plan)> {
        let own = match self.method {
            Method::DiscreteElements => [("start", &self.start), ("chunk of steps", &self.chunk)],
            Method::ContactDynamics => [("neighbour lists", &self.chunk), ("step", &self.step)],
        };
        let measurements = [("sums", &self.sums), ("velocities", &self.velocities), ("contact forces", &self.forces)];
        own.into_iter().chain(measurements).collect()
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
