//! The plan: what happens, in order. The function below is the first thing to read.

use crate::{
    kernels::{self, Stage},
    model::{Friction, Model, Precision, Rotation},
};
use std::fmt;

/// One item of a plan.
#[derive(Clone, Copy, Debug)]
pub enum Op {
    /// Run a kernel or its twin.
    Run(&'static Stage),
    /// Set an array to zero.
    Clear(&'static str),
    /// Copy an array.
    Copy { from: &'static str, to: &'static str },
    /// Exchange two arrays without moving them.
    Swap(&'static str, &'static str),
}

/// Sequences of operations. The state between steps is consistent at step n: positions, forces and springs at n,
/// velocities at n - 1/2. A chunk is `rebuild`, then `step` many times, then `close`; if the counters then show that
/// something did not fit, `restore` brings the state of before the chunk back.
#[derive(Clone, Debug)]
pub struct Plan {
    pub rebuild: Vec<Op>,
    pub step: Vec<Op>,
    pub close: Vec<Op>,
    pub restore: Vec<Op>,
    /// Once, at time 0, after `rebuild`: first with dt = 0 so that springs start at zero, then `kick` with the real dt.
    pub start: Vec<Op>,
    pub kick: Vec<Op>,
    /// Sums for a row of the history.
    pub sample: Vec<Op>,
}

/// The discrete element method.
pub fn plan(model: &Model) -> Plan {
    use Op::{Clear, Run};
    use kernels::*;

    let frictional = model.friction == Friction::Coulomb;

    let mut step = vec![Run(&INTEGRATE)];
    if model.moving_walls {
        step.push(Run(&MOVE_WALLS));
    }
    step.push(Run(&CONTACT));

    let mut rebuild = vec![Clear("counters")];
    rebuild.extend(saved(model).map(|(now, before)| Op::Copy { from: now, to: before }));
    if frictional {
        rebuild.extend(exchange());
    }
    rebuild.extend([Clear("cell_start"), Run(&BIN)]);
    rebuild.extend(SCAN_CELLS.iter().map(Run));
    rebuild.extend([Run(&SORT), Run(&ORDER), Clear("slot_start"), Run(&COUNT)]);
    rebuild.extend(SCAN_SLOTS.iter().map(Run));
    rebuild.push(Run(&NEIGHBOURS));

    let mut restore: Vec<Op> = saved(model).map(|(now, before)| Op::Copy { from: before, to: now }).collect();
    if frictional {
        restore.extend(exchange());
    }

    Plan {
        rebuild,
        step,
        close: vec![Run(&DRIFT)],
        restore,
        start: vec![Run(&CONTACT)],
        kick: vec![Run(&HALF_KICK)],
        sample: vec![Run(&MEASURE)],
    }
}

/// Arrays that a step overwrites, with their copies.
fn saved(model: &Model) -> impl Iterator<Item = (&'static str, &'static str)> {
    let rotating = model.rotation == Rotation::Sphere;
    [
        (true, "place", "place_before"),
        (model.precision == Precision::Single, "residue", "residue_before"),
        (true, "motion", "motion_before"),
        (true, "force", "force_before"),
        (rotating, "spin", "spin_before"),
        (rotating, "torque", "torque_before"),
        (model.moving_walls, "wall", "wall_before"),
    ]
    .into_iter()
    .filter(|(present, ..)| *present)
    .map(|(_, now, before)| (now, before))
}

/// The lists of this chunk are made from those of the chunk before, which thereby stay intact for a replay.
fn exchange() -> [Op; 3] {
    [
        Op::Swap("slot_start", "slot_start_before"),
        Op::Swap("neighbour", "neighbour_before"),
        Op::Swap("spring", "spring_before"),
    ]
}

impl Plan {
    /// Every stage once, in the order of first use.
    pub fn stages(&self) -> Vec<&'static Stage> {
        let mut stages: Vec<&'static Stage> = Vec::new();
        let all = [&self.rebuild, &self.start, &self.kick, &self.step, &self.close, &self.sample];
        for op in all.into_iter().flatten() {
            if let Op::Run(stage) = op
                && !stages.iter().any(|s| s.name == stage.name)
            {
                stages.push(stage);
            }
        }
        stages
    }
}

impl fmt::Display for Op {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Op::Run(stage) => write!(f, "{}", stage.name),
            Op::Clear(array) => write!(f, "clear {array}"),
            Op::Copy { from, to } => write!(f, "copy {from} -> {to}"),
            Op::Swap(a, b) => write!(f, "swap {a} <-> {b}"),
        }
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = |ops: &[Op]| ops.iter().map(Op::to_string).collect::<Vec<_>>().join(", ");
        writeln!(f, "start    {}, {}", line(&self.start), line(&self.kick))?;
        writeln!(f, "rebuild  {}", line(&self.rebuild))?;
        writeln!(f, "step     {}", line(&self.step))?;
        writeln!(f, "close    {}", line(&self.close))?;
        writeln!(f, "sample   {}", line(&self.sample))?;
        write!(f, "restore  {}", line(&self.restore))
    }
}
