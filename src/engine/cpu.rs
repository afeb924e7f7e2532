//! The f64 engine: the twins, on all cores; where the time goes, [`Blocks`] stand in for them.

use super::{Engine, Times, within};
use crate::{
    dem::blocks::Blocks,
    error::Result,
    plan::Op,
    state::{Array, Counters, Params, State},
};
use std::{ops::Range, time::Instant};

/// Runs the twins in f64 on a state of its own.
pub struct Cpu {
    state: State,
    blocks: Blocks,
    times: Option<Times>,
}

impl Cpu {
    /// An engine that starts from the state; arrays that are missing are zero.
    pub fn new(mut state: State) -> Cpu {
        state.complete();
        Cpu { state, blocks: Blocks::default(), times: None }
    }

    fn run(&mut self, op: &Op) {
        let start = self.times.as_ref().map(|_| Instant::now());
        if !self.blocks.run(op, &mut self.state) {
            apply(op, &mut self.state);
        }
        if let (Op::Run(stage), Some(times), Some(start)) = (op, &mut self.times, start) {
            times.add(stage, start.elapsed().as_secs_f64());
        }
    }
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
        rayon::scope(|_| {
            ops.iter().for_each(|op| self.run(op));
            self.blocks.put_back(&mut self.state);
        });
        Ok(())
    }

    fn counters(&mut self) -> Result<Counters> {
        Ok(self.state.counters[0])
    }

    fn resize(&mut self, array: &'static Array, len: usize) -> Result<()> {
        self.blocks.forget(array);
        self.state.column_mut(array).resize(len);
        Ok(())
    }

    fn write(&mut self, arrays: &[&'static Array], first: usize, state: &State) -> Result<()> {
        for array in arrays {
            self.blocks.forget(array);
            self.state.column_mut(array).overwrite(first, state.column(array));
        }
        Ok(())
    }

    fn read(&mut self, arrays: &[&'static Array], elements: Range<usize>, state: &mut State) -> Result<()> {
        for array in arrays {
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
