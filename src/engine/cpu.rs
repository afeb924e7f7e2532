//! The f64 engine: the twins, on all cores; where contacts are computed in steps and for sums, [`Blocks`] stand in for
//! them.

use super::{Engine, Times, within};
use crate::{
    contact::blocks::Blocks,
    dem::{
        self, ADVANCE, ADVANCE_LARGE, DAMP, GROW, INTEGRATE_CLUMPS, MEASURE_GAIN, MEMBER_FORCES, PLACE_MEMBERS, RESTART,
    },
    error::Result,
    measure::{
        self, ADD_WALL_LOADS, ADD_WORKS, MEASURE, MEASURE_FOR_SERVO, SERVO, SERVO_WALLS, WALL_LOADS,
        WALL_LOADS_FOR_SERVO,
    },
    model::{Method, Precision},
    neighbours::{
        COUNT_NEIGHBOURS, DISPLACEMENT_CHECK, FILL_NEIGHBOURS, ORDER_LONG_LISTS, ORDER_NEIGHBOURS,
        displacement_check::displacement_check_of_blocks,
        found::{self, Found},
    },
    plan::Op,
    space::{DEFORM_CELL, GUIDE_WALLS, MOVE_WALLS},
    stage::Stage,
    state::{ARRAYS, Array, Counters, Params, Sizes, State, present},
};
use std::{ops::Range, time::Instant};

/// Runs the twins in f64 on a state of its own.
pub struct Cpu {
    state: State,
    blocks: Blocks,
    found: Found,
    times: Option<Times>,
}

impl Cpu {
    /// An engine that starts from the state; arrays that are missing are zero.
    ///
    /// # Errors
    /// [`Error::Lacking`](crate::Error::Lacking) if there is no room for them.
    pub fn new(mut state: State) -> Result<Cpu> {
        state.complete()?;
        Ok(Cpu { state, blocks: Blocks::default(), found: Found::default(), times: None })
    }

    fn run(&mut self, op: &Op) {
        let start = self.times.as_ref().map(|_| Instant::now());
        let Cpu { state, blocks, found, .. } = self;
        match op {
            // Of other states blocks know nothing; where lists lie side by side, one is of a device.
            _ if state.model.precision == Precision::Single || state.sizes.slice_shift != 0 => apply(op, state),
            Op::Run(stage) if state.model.method == Method::DiscreteElements && stand_in(stage, blocks, state) => {}
            Op::Run(stage) => {
                blocks.put_back(state);
                match () {
                    () if **stage == COUNT_NEIGHBOURS => found::count_neighbours(found, state),
                    () if **stage == FILL_NEIGHBOURS => found::fill_neighbours(found, state),
                    () => apply(op, state),
                }
                if [&ORDER_NEIGHBOURS, &ORDER_LONG_LISTS].contains(stage) {
                    blocks.discard();
                }
            }
            Op::Clear(array) => {
                blocks.forget(state, array);
                apply(op, state);
            }
            Op::Swap(..) => apply(op, state),
        }
        if let (Op::Run(stage), Some(times), Some(start)) = (op, &mut self.times, start) {
            times.add(stage, start.elapsed().as_secs_f64());
        }
    }
}

/// Stages that look at no list, nor at what contacts remember, so that blocks may keep what is in them.
const WITHOUT_CONTACTS: &[&Stage] = &[
    &INTEGRATE_CLUMPS,
    &PLACE_MEMBERS,
    &MOVE_WALLS,
    &GUIDE_WALLS,
    &DEFORM_CELL,
    &SERVO,
    &SERVO_WALLS,
    &ADD_WALL_LOADS,
    &MEASURE_GAIN,
    &RESTART,
    &DAMP,
    &GROW,
];

/// Do what a stage does with blocks, or without lists: whether it was done.
fn stand_in(stage: &Stage, blocks: &mut Blocks, s: &mut State) -> bool {
    match () {
        () if *stage == ADVANCE => dem::blocks::advance(blocks, s),
        () if *stage == ADVANCE_LARGE => {} // done by `advance`
        () if *stage == MEMBER_FORCES => dem::blocks::member_forces(blocks, s),
        () if *stage == DISPLACEMENT_CHECK => displacement_check_of_blocks(blocks, s),
        () if *stage == MEASURE => measure::blocks::measure(blocks, s),
        () if *stage == MEASURE_FOR_SERVO => measure::blocks::measure_for_servo(blocks, s),
        () if *stage == WALL_LOADS => measure::blocks::wall_loads(blocks, s),
        () if *stage == ADD_WORKS => measure::blocks::add_works(blocks, s),
        () if *stage == WALL_LOADS_FOR_SERVO => measure::blocks::wall_loads_for_servo(blocks, s),
        () if WITHOUT_CONTACTS.contains(&stage) => (stage.twin)(s),
        () => return false,
    }
    true
}

/// One operation on a state.
pub fn apply(op: &Op, state: &mut State) {
    match op {
        Op::Run(stage) => (stage.twin)(state),
        Op::Clear(array) => {
            let column = state.column_mut(array);
            let len = column.len();
            column.resize(0);
            column.resize(len);
        }
        Op::Swap(a, b) => state.swap(a, b),
    }
}

impl Engine for Cpu {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn adapter(&self) -> String {
        format!("{} threads", rayon::current_num_threads())
    }

    fn execute(&mut self, params: &Params, ops: &[Op]) -> Result<()> {
        self.state.params = *params;
        // On a thread of the pool, so that not every loop has to wake one.
        rayon::scope(|_| ops.iter().for_each(|op| self.run(op)));
        Ok(())
    }

    fn counters(&mut self) -> Result<Counters> {
        Ok(self.state.counters[0])
    }

    fn count(&mut self, sizes: &Sizes) -> Result<()> {
        let state = &mut self.state;
        self.blocks.put_back(state);
        self.blocks.discard();
        state.sizes = Sizes { bodies: sizes.bodies, large: sizes.large, clumps: sizes.clumps, ..state.sizes };
        let now = state.sizes;
        for array in present(&state.model, ARRAYS).into_iter().filter(|array| array.length.is_of_grains()) {
            state.column_mut(array).resize(0);
            state.column_mut(array).resize(now.of(array.length));
        }
        Ok(())
    }

    fn resize(&mut self, arrays: &[&'static Array], len: usize) -> Result<()> {
        for array in arrays {
            self.blocks.forget(&mut self.state, array);
            self.state.column_mut(array).reserve(len)?;
            self.state.column_mut(array).resize(len);
        }
        Ok(())
    }

    fn write(&mut self, arrays: &[&'static Array], first: usize, state: &State) -> Result<()> {
        for array in arrays {
            self.blocks.forget(&mut self.state, array);
            self.state.column_mut(array).overwrite(first, state.column(array));
        }
        Ok(())
    }

    fn read(&mut self, arrays: &[&'static Array], elements: Range<usize>, state: &mut State) -> Result<()> {
        for array in arrays {
            self.blocks.show(&mut self.state, array);
            let column = self.state.column(array);
            let content = column.duplicate(within(&elements, column.len()));
            state.column_mut(array).replace(content);
        }
        Ok(())
    }

    fn times(&mut self) -> &mut Option<Times> {
        &mut self.times
    }

    fn clock(&self) -> &'static str {
        "host"
    }

    fn stride(&self, array: &'static Array) -> usize {
        self.state.column(array).stride()
    }
}
