//! Arrays in the memory of others, seen from what kernels read and write in the order of runs.

use packstone::{
    Result,
    engine::{
        aliases::{Aliases, Room},
        placements::layouts_and_aliases,
        programs::programs,
    },
    gpu::Program,
    model::{Boundary, Damping, Dimension, Levels, Model, Precision, Twist, Walls},
    neighbours::DISPLACEMENT_CHECK,
    plan::{Driver, Loop, Op, Plan, swap_again},
    plans::Plans,
    stage::Stage,
    state::{Array, Sizes, array::*},
};
use std::collections::HashMap;

/// A piece of memory: a buffer by the array that had it first.
type Piece = (&'static str, usize);

/// Who has written to each piece of memory last, while plans are walked.
struct Trace<'a> {
    aliases: &'a Aliases,
    kernels: &'a HashMap<&'static Stage, Program>,
    /// The array that had the memory first which one has now.
    memory: HashMap<&'static str, &'static str>,
    /// The alias that has written a piece of memory last; None: whose memory it is.
    wrote: HashMap<Piece, Option<&'static Array>>,
    steps: Vec<Op>,
    /// Whether lists are made anew, and turn out too short at first; and steps are taken back.
    new_lists: bool,
    short: bool,
    taken_back: bool,
    /// Whether lists do not fit now, so that steps do nothing.
    halted: bool,
    faults: Vec<String>,
}

impl Trace<'_> {
    fn piece(&self, Room { host, part }: &Room) -> Piece {
        (self.memory.get(host.name).copied().unwrap_or(host.name), *part)
    }

    /// The pieces that an array lies in: parts that nobody else lies in are as good as one.
    fn pieces(&self, array: &'static Array) -> Vec<Piece> {
        match self.aliases.get(array) {
            Some(rooms) => rooms.iter().map(|room| self.piece(room)).collect(),
            None => {
                let lodging = self.aliases.values().flatten().filter(|room| room.host == array);
                let parts = lodging.map(|room| room.part + 1).max().unwrap_or(1);
                (0..parts).map(|part| self.piece(&Room { host: array, part })).collect()
            }
        }
    }

    fn run_stage(&mut self, stage: &'static Stage) {
        let bindings = &self.kernels[stage].bindings;
        let arrays: Vec<_> = bindings.iter().filter_map(|b| Some((b, stage.array(&b.name)?))).collect();
        let mut bound = HashMap::new();
        for (binding, array) in &arrays {
            let owner = self.aliases.contains_key(array).then_some(*array);
            for piece in self.pieces(array) {
                if let Some(other) = bound.insert(piece, array.name) {
                    self.faults.push(format!("{}: `{}` and `{other}` in the same memory", stage.name, array.name));
                }
                // Nobody has written to memory that is not in here; it is zero.
                let last = self.wrote.get(&piece).copied().unwrap_or_default();
                if binding.read && last != owner {
                    let last = last.map_or("its host", |other| other.name);
                    self.faults.push(format!("{} reads `{}`, but {last} has written there", stage.name, array.name));
                }
            }
        }
        for (_, array) in arrays.iter().filter(|(binding, _)| binding.written) {
            let owner = self.aliases.contains_key(array).then_some(*array);
            for piece in self.pieces(array) {
                self.wrote.insert(piece, owner);
            }
        }
    }
}

impl Driver for Trace<'_> {
    fn run(&mut self, op: Op) -> Result<()> {
        match op {
            Op::Run(_) if self.halted && (self.steps.contains(&op) || op == Op::Run(&DISPLACEMENT_CHECK)) => {}
            Op::Run(stage) => self.run_stage(stage),
            Op::Clear(array) => {
                let owner = self.aliases.contains_key(array).then_some(array);
                for piece in self.pieces(array) {
                    self.wrote.insert(piece, owner);
                }
            }
            Op::Swap(a, b) => {
                let [of_a, of_b] = [a, b].map(|array| self.memory.get(array.name).copied().unwrap_or(array.name));
                self.memory.extend([(a.name, of_b), (b.name, of_a)]);
            }
        }
        Ok(())
    }

    fn rounds(&mut self, of: Loop, done: u32) -> Result<u32> {
        Ok(match of {
            Loop::IfListsAreUsedUp | Loop::IfGrainsAreSorted => u32::from(done == 0 && self.new_lists),
            Loop::UntilListsFit => {
                self.halted = self.new_lists && self.short && done == 0;
                u32::from(done == 0 || self.new_lists && self.short && done == 1)
            }
            // An odd number, so that arrays have changed their names.
            Loop::Steps => 3 * u32::from(done == 0),
            Loop::HaltedSteps if self.halted => 3 * u32::from(done == 0),
            Loop::HaltedSteps => 0,
            Loop::IfStepIsTakenBack => u32::from(done == 0 && self.taken_back),
            Loop::UntilStepIsWithinLists => u32::from(done == 0 || self.taken_back && done == 1),
            Loop::Times(n) => n * u32::from(done == 0),
            _ => 2_u32.saturating_sub(done).min(1),
        })
    }
}

/// All that can come in a run, in some orders: what was found wrong.
fn faults(model: &Model, aliases: &Aliases) -> Vec<String> {
    let plans = Plans::new(model);
    let stages = plans.stages();
    let kernels = stages.iter().copied().zip(programs(model, &stages).unwrap()).collect();
    let mut trace = Trace {
        aliases,
        kernels: &kernels,
        memory: HashMap::new(),
        wrote: HashMap::new(),
        steps: plans.chunk.within(Loop::Steps).ops(),
        new_lists: false,
        short: false,
        taken_back: false,
        halted: false,
        faults: Vec::new(),
    };
    let back = swap_again(&plans.swaps);
    let Plans { sums, forget_works, velocities, forces, .. } = &plans;
    let looks: [&Plan; 8] = [sums, forget_works, velocities, forces, &back, forces, &back, sums];
    let mut walk = |plan: &Plan, new_lists, short, taken_back| {
        (trace.new_lists, trace.short, trace.taken_back) = (new_lists, short, taken_back);
        plan.walk(&mut trace).unwrap();
    };
    for lists_for_looks in [true, false] {
        walk(&plans.lists, true, false, false);
        walk(&plans.start, false, false, false);
        for (new_lists, short, taken_back) in
            [(false, false, false), (true, false, false), (false, false, true), (true, true, false), (true, true, true)]
        {
            walk(&plans.chunk, new_lists, short, taken_back);
            if lists_for_looks {
                walk(&plans.lists, true, short, false);
            }
            // A step is taken back at once, or not at all.
            let looks = if lists_for_looks { &looks[..4] } else { &looks };
            looks.iter().for_each(|plan| walk(plan, false, false, false));
        }
    }
    trace.faults
}

/// Of as many grains, cells, entries and contacts as there may be.
fn sizes(model: &Model) -> Sizes {
    Sizes {
        bodies: 1000,
        large: if model.large_grains { 10 } else { 0 },
        slice_shift: 5,
        clumps: 400,
        walls: 3,
        materials: 2,
        levels: 2,
        cells: 900,
        entries: 6000,
        history: 2500,
        contacts: 3000,
        colors: 16,
    }
}

fn models() -> impl Iterator<Item = Model> {
    // What else there is to choose has no arrays and no stages.
    let has_most = |m: &Model| {
        let bounded = m.boundary == Boundary::Periodic && m.walls == Walls::Some && m.dimension == Dimension::Space;
        bounded && m.damping == Damping::None && m.twist == Twist::Ignored
    };
    [Precision::Single, Precision::Double].into_iter().flat_map(Model::all).filter(has_most)
}

/// No array is read where another one has been written since: found by going forward through runs, while the choice was made
/// by going backward through plans.
#[test]
fn no_array_is_overwritten_while_it_is_alive() {
    let (mut models_seen, mut seen) = ([0, 0], 0);
    for model in models() {
        let (_, aliases) = layouts_and_aliases(&model, &Plans::new(&model), &sizes(&model)).unwrap();
        let faults = faults(&model, &aliases);
        assert!(faults.is_empty(), "{model:?}\n{aliases:#?}\n{faults:#?}");
        models_seen[usize::from(model.levels == Levels::Several)] += 1;
        seen += aliases.len();
    }
    let [one_size, many_sizes] = models_seen;
    assert!(one_size > 20 && many_sizes > 20, "{models_seen:?}");
    assert!(seen > 4 * (one_size + many_sizes), "{seen} aliases in {models_seen:?} models");
}

/// Whoever lies where something else is alive is found out.
#[test]
fn arrays_that_are_alive_together_are_told_apart() {
    let rough = |m: &Model| (HISTORY_OTHER.needed)(m);
    let model = models().find(rough).unwrap();
    let room = |host: &'static Array| vec![Room { host, part: 0 }];
    assert!(faults(&model, &Aliases::new()).is_empty());
    for (alias, host, why) in [
        (&SORTED, &POSITION_NEXT, "permute: "),
        (&SORTED, &DISPLACEMENT, "permute: "),
        (&HISTORY_OTHER, &SORTED, "order_neighbours: "),
        (&HISTORY_START, &CELL_START, "count_neighbours reads `cell_start`, but history_start has written there"),
        (&CELL_RANK, &ID, "order_cells reads `id`, but cell_rank has written there"),
        (&HISTORY_OTHER, &VELOCITY, "order_neighbours: "),
    ] {
        let wrong: Aliases = [(alias, room(host))].into_iter().collect();
        let faults = faults(&model, &wrong);
        assert!(faults.iter().any(|fault| fault.starts_with(why)), "{alias:?} in {host:?}: {faults:#?}");
    }
}
