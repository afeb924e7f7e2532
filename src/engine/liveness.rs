//! When the content of arrays matters, from the plans and from what kernels are seen to read and to write: arrays that are
//! never alive at the same time can lie in the same memory. A kernel that writes an array and does not read it is taken to
//! write all of it that is read later, or to go on with what the kernel before it has begun.

use crate::{
    gpu::Program,
    plan::{Op, Plan},
    plans::Plans,
    stage::Stage,
    state::{ARRAYS, Array},
};
use std::collections::{HashMap, HashSet};

/// A set of arrays: bits in the order of [`ARRAYS`].
type Set = u128;

fn bit(array: &Array) -> Set {
    const { assert!(ARRAYS.len() <= Set::BITS as usize, "more arrays than bits") };
    1 << ARRAYS.iter().position(|other| *other == array).expect("every array is in the dictionary")
}

/// Which arrays are alive at the same time.
#[derive(Clone)]
pub struct Liveness {
    /// Those that are, or are touched, at some operation.
    moments: HashSet<Set>,
    /// Those whose content matters between two plans.
    at_rest: Set,
    /// Those that are exchanged with others.
    exchanged: Set,
}

/// What a kernel does to arrays.
#[derive(Clone, Copy, Default)]
struct Access {
    read: Set,
    written: Set,
    /// Those of the latter that it begins to write.
    begun: Set,
}

impl Liveness {
    /// With kernels that are composed for an array per buffer.
    pub fn of(plans: &Plans, programs: &[(&'static Stage, Program)]) -> Liveness {
        let access = |(stage, program): &(&'static Stage, Program)| {
            let mut access = Access::default();
            for binding in &program.bindings {
                let set = stage.array(&binding.name).map_or(0, bit);
                access.read |= if binding.read { set } else { 0 };
                access.written |= if binding.written { set } else { 0 };
            }
            (*stage, Access { begun: access.written & !access.read, ..access })
        };
        let mut kernels: HashMap<&Stage, Access> = programs.iter().map(access).collect();
        let plans = plans.all();
        plans.iter().for_each(|plan| leave_to_the_first(&plan.ops(), &mut kernels));
        let all = |of: fn(&Access) -> Set| kernels.values().fold(0, |all, access| all | of(access));
        let exchanged = |op: &Op| if let Op::Swap(a, b) = op { bit(a) | bit(b) } else { 0 };
        let exchanged = plans.iter().flat_map(Plan::ops).fold(0, |all, op| all | exchanged(&op));
        let mut liveness = Liveness {
            moments: HashSet::new(),
            // What no kernel reads, under any name, is for the host.
            at_rest: all(|access| access.written) & !all(|access| access.read) & !exchanged,
            exchanged,
        };
        loop {
            let after = liveness.at_rest;
            for plan in &plans {
                for lists_are_made in [false, true] {
                    let before =
                        plan.backwards(after, lists_are_made, &mut |op, after| liveness.pass(&kernels, op, after));
                    liveness.at_rest |= before;
                }
            }
            if liveness.at_rest == after {
                return liveness;
            }
        }
    }

    /// What is alive before an operation, if this is after it.
    fn pass(&mut self, kernels: &HashMap<&Stage, Access>, op: Op, after: Set) -> Set {
        let (touched, before) = match op {
            Op::Run(stage) => {
                let Access { read, written, begun } = kernels[stage];
                (read | written, after & !begun | read)
            }
            Op::Clear(array) => (bit(array), after & !bit(array)),
            Op::Swap(a, b) => {
                let [of_a, of_b] = [a, b].map(|array| after & bit(array) != 0);
                let others = after & !(bit(a) | bit(b));
                (bit(a) | bit(b), others | if of_b { bit(a) } else { 0 } | if of_a { bit(b) } else { 0 })
            }
        };
        self.moments.insert(touched | after | before);
        before
    }

    /// Whether what one of them holds never matters while something is done to the other.
    pub fn are_apart(&self, a: &Array, b: &Array) -> bool {
        let both = bit(a) | bit(b);
        self.moments.iter().all(|alive| alive & both != both)
    }

    /// Whether an array is used, but what it holds does not matter between two plans, and it is exchanged with none.
    pub fn is_scratch(&self, array: &Array) -> bool {
        let used = self.moments.iter().any(|alive| alive & bit(array) != 0);
        used && (self.at_rest | self.exchanged) & bit(array) == 0
    }
}

/// Of kernels that write an array one after the other, with none between that reads it, the first begins to.
fn leave_to_the_first(ops: &[Op], kernels: &mut HashMap<&Stage, Access>) {
    let mut written = 0;
    for op in ops {
        match op {
            Op::Run(stage) => {
                let access = kernels.get_mut(stage).expect("the plans' stages are compiled");
                access.begun &= !written;
                written = (written | access.written) & !access.read;
            }
            Op::Clear(array) => written |= bit(array),
            Op::Swap(a, b) => written &= !(bit(a) | bit(b)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        engine::programs::programs,
        model::{Method, Model, Precision},
        state::{Lifetime, present},
    };

    /// Checkpoints have what the table of arrays says that later steps depend on; the plans say the same. Not of contact
    /// dynamics, whose loops could all be left out as far as plans say.
    #[test]
    fn what_matters_between_two_plans_is_no_scratch() {
        let mut models = Model::all(Precision::Single);
        models.retain(|model| model.method == Method::DiscreteElements);
        let (mut seen, mut scratch) = (0, HashSet::new());
        for model in models.iter().step_by(1 + models.len() / 40) {
            let plans = Plans::new(model);
            let stages = plans.stages();
            let programs: Vec<_> = stages.iter().copied().zip(programs(model, &stages).unwrap()).collect();
            let liveness = Liveness::of(&plans, &programs);
            let read = programs.iter().flat_map(|(stage, program)| {
                let read = program.bindings.iter().filter(|binding| binding.read);
                read.filter_map(|binding| stage.array(&binding.name))
            });
            let read: HashSet<&Array> = read.collect();
            for array in present(model, ARRAYS) {
                // What is only written is for the host, which looks at once.
                let matters = liveness.at_rest & bit(array) != 0 && read.contains(array);
                seen += u32::from(matters);
                scratch.extend((matters && array.lifetime == Lifetime::Scratch).then_some(array.name));
            }
        }
        assert!(seen > 100, "{seen} arrays matter");
        assert!(scratch.is_empty(), "{scratch:?}");
    }
}
