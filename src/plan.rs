//! The plan: what happens, in order. The function below is the first thing to read.

use crate::{
    kernels::{self, Stage},
    model::{Friction, Grains, Method, Model, Precision, Rotation},
};
use std::fmt;

/// One item of a plan.
#[derive(Clone, Copy, Debug)]
pub enum Op {
    /// Run a kernel or its twin.
    Run(&'static Stage),
    /// Set an array to zero.
    Clear(&'static str),
    /// Exchange two arrays without moving them.
    Swap(&'static str, &'static str),
}

impl Op {
    /// The stage it runs, if it runs one.
    pub fn stage(&self) -> Option<&'static Stage> {
        if let Op::Run(stage) = self { Some(*stage) } else { None }
    }
}

/// Sequences of operations. The state between steps is consistent at step n: positions at n, velocities at n - 1/2,
/// springs at n - 1. A chunk is `begin`, `sort` and `list` if the lists have served their time, `step` many times, then
/// `survey`. Nothing in it can go wrong without trace or return: lists that do not fit are not walked and `list` is done
/// again; a step that spends the margin of the lists halts those that follow.
///
/// In contact dynamics a step is `meet`, `relax` as often as `judge` asks for, and `step`; velocities are at n. By colours,
/// `colour` until all contacts have one, `arrange`, and before each `relax` a `sweep` for each colour.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What the device is to tell the host, forgotten.
    pub begin: Vec<Op>,
    /// Springs to the history, grains into the order of the cells.
    pub sort: Vec<Op>,
    /// Neighbour lists, with the springs of the history.
    pub list: Vec<Op>,
    /// Contact dynamics: the contacts of a step, with the impulses of the last one.
    pub meet: Vec<Op>,
    /// Contact dynamics: where a power iteration for the largest eigenvalue of W starts, and a pass of it. Contacts have to be
    /// met before, and again after.
    pub seed: Vec<Op>,
    pub probe: Vec<Op>,
    /// Contact dynamics by colours: all contacts without one; and a round that gives colours to some of those that have none.
    pub bleach: Vec<Op>,
    pub colour: Vec<Op>,
    /// Contact dynamics by colours: contacts in the order of their colours.
    pub arrange: Vec<Op>,
    /// Contact dynamics by colours: the contacts of the next colour.
    pub sweep: Vec<Op>,
    /// Contact dynamics: a pass over the contacts, or what follows the sweeps over all colours.
    pub relax: Vec<Op>,
    /// Contact dynamics: the residual that the passes have left.
    pub judge: Vec<Op>,
    pub step: Vec<Op>,
    /// The exchanges of a step alone; for steps that were halted.
    pub turn: Vec<Op>,
    pub survey: Vec<Op>,
    /// Once, at time 0: velocities half a step back.
    pub kick: Vec<Op>,
    /// Sums for a row of the history.
    pub sample: Vec<Op>,
    /// Velocities at step n, in `motion_next` and `spin_next`.
    pub synchronise: Vec<Op>,
    /// Contact forces and moments.
    pub forces: Vec<Op>,
}

/// The discrete element method, section 2.1, or contact dynamics, section 2.2.
pub fn plan(model: &Model) -> Plan {
    use Op::{Clear, Run};
    use kernels::*;

    let frictional = model.friction == Friction::Coulomb;

    let begin = vec![Clear("counters"), Clear("halt"), Clear("halt_next")];

    let mut sort = Vec::new();
    if frictional {
        sort.push(Run(&TALLY));
        sort.extend(SCAN_HISTORY.iter().map(Run));
        sort.push(Run(&REMEMBER));
    }
    sort.extend([Clear("cell_start"), Run(&BIN)]);
    sort.extend(SCAN_CELLS.iter().map(Run));
    sort.extend([Run(&SORT), Run(&ORDER), Run(&PERMUTE), Op::Swap("number", "number_next")]);
    sort.extend(exchange_bodies(model));

    let mut list = vec![Run(&COUNT)];
    list.extend(SCAN_SLOTS.iter().map(Run));
    list.push(Run(&NEIGHBOURS));

    let rigid = model.method == Method::ContactDynamics;
    let coloured = model.coloured;
    let clumped = model.grains == Grains::Clumps;
    let (mut meet, mut probe) = (vec![Run(&MEET), Run(&SET_OUT)], vec![Run(&PROBE), Run(&GAUGE), Run(&EXTRAPOLATE)]);
    let mut relax = vec![Run(if coloured { &FOLLOW } else { &RELAX })];
    if clumped {
        meet = vec![Run(&RELEASE), Run(&MEET), Run(&RESPOND_FIRST), Run(&SET_OUT)];
        if !coloured {
            // There is no pass before, so nothing of it may be left that could spoil the first; `arrange` sees to that.
            meet.extend([Clear("trial_before"), Clear("trial_spin_before"), Run(&EXTRAPOLATE)]);
        }
        probe.insert(1, Run(&ECHO));
        relax.push(Run(if coloured { &FALL_IN } else { &RESPOND }));
    }
    relax.extend(turns(model));
    relax.extend([Run(&STEER), Run(&EXTRAPOLATE)]);
    let (mut bleach, mut colour, mut arrange, mut sweep) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut judge = vec![Run(&JUDGE), Run(&CONCLUDE)];
    if coloured {
        relax.push(Clear("brush"));
        bleach = vec![Clear("hue"), Clear("painted"), Clear("palette"), Clear("brush")];
        colour = vec![Run(&PROPOSE), Run(&PAINT)];
        arrange = vec![Run(&ARRANGE)];
        sweep = vec![Run(&SWEEP), Op::Swap("brush", "brush_next")];
        judge.splice(..0, [Run(&DELIVER), Run(&GATHER)]);
        if clumped {
            colour.insert(1, Run(&ELECT));
            judge.insert(2, Run(&RECOVER));
        }
    }

    let mut step = match (rigid, clumped) {
        (true, false) => vec![Run(&DISPLACE)],
        (true, true) => vec![Run(&HAND_OVER), Run(&DISPLACE_CLUMPS), Run(&DISPLACE_MEMBERS)],
        (false, true) => vec![Run(&LOAD), Run(&DRIVE), Run(&CARRY)],
        (false, false) => vec![Run(&ADVANCE)],
    };
    if model.moving_walls {
        step.push(Run(&MOVE_WALLS));
    }
    step.extend(exchange(model));
    step.push(Op::Swap("halt", "halt_next"));

    let mut kick = vec![Run(if clumped { &KICK_CLUMPS } else { &HALF_KICK })];
    kick.extend(
        exchange(model).filter(|op| matches!(op, Op::Swap("motion" | "spin" | "clump_motion" | "clump_spin", _))),
    );
    let mut sample = vec![Run(&MEASURE)];
    if clumped {
        sample.push(Run(&MEASURE_CLUMPS));
    }

    if rigid {
        kick.clear(); // velocities are those of the positions
    }

    let turn = step.iter().filter(|op| matches!(op, Op::Swap(..))).copied().collect();
    Plan {
        begin,
        sort,
        list,
        meet: if rigid { meet } else { Vec::new() },
        seed: if rigid && !coloured { vec![Run(&SEED)] } else { Vec::new() },
        probe: if rigid && !coloured { probe } else { Vec::new() },
        bleach,
        colour,
        arrange,
        sweep,
        relax: if rigid { relax } else { Vec::new() },
        judge: if rigid { judge } else { Vec::new() },
        step,
        turn,
        survey: vec![Run(&SURVEY)],
        kick,
        sample,
        synchronise: vec![Run(if clumped { &SYNCHRONISE_CLUMPS } else { &SYNCHRONISE })],
        forces: vec![Run(&FORCES)],
    }
}

/// What comes next becomes what is.
fn exchange(model: &Model) -> impl Iterator<Item = Op> + use<> {
    let clumped = model.grains == Grains::Clumps;
    let split = clumped && model.precision == Precision::Single;
    let pairs = [
        (clumped, "center", "center_next"),
        (split, "center_residue", "center_residue_next"),
        (clumped, "attitude", "attitude_next"),
        (split, "attitude_residue", "attitude_residue_next"),
        (clumped, "clump_motion", "clump_motion_next"),
        (clumped, "clump_spin", "clump_spin_next"),
    ];
    exchange_bodies(model).chain(swaps(pairs))
}

/// The same for what bodies have; a sort moves them alone.
fn exchange_bodies(model: &Model) -> impl Iterator<Item = Op> + use<> {
    swaps([
        (true, "place", "place_next"),
        (model.precision == Precision::Single, "residue", "residue_next"),
        (true, "motion", "motion_next"),
        (model.rotation == Rotation::Sphere, "spin", "spin_next"),
    ])
}

/// Exchanges of arrays that are present.
fn swaps<const N: usize>(pairs: [(bool, &'static str, &'static str); N]) -> impl Iterator<Item = Op> {
    pairs.into_iter().filter(|(present, ..)| *present).map(|(_, now, next)| Op::Swap(now, next))
}

/// What a pass has written becomes the last, and the last what was before.
fn turns(model: &Model) -> impl Iterator<Item = Op> + use<> {
    swaps([
        (!model.coloured, "spring", "spring_before"),
        (model.coloured, "thrust", "thrust_before"),
        (true, "trial", "trial_before"),
        (model.rotation == Rotation::Sphere, "trial_spin", "trial_spin_before"),
    ])
}

impl Plan {
    /// All sequences with their names, in the order of a run.
    pub fn parts(&self) -> [(&'static str, &[Op]); 18] {
        [
            ("begin", &self.begin),
            ("sort", &self.sort),
            ("list", &self.list),
            ("kick", &self.kick),
            ("meet", &self.meet),
            ("seed", &self.seed),
            ("probe", &self.probe),
            ("bleach", &self.bleach),
            ("colour", &self.colour),
            ("arrange", &self.arrange),
            ("sweep", &self.sweep),
            ("relax", &self.relax),
            ("judge", &self.judge),
            ("step", &self.step),
            ("survey", &self.survey),
            ("sample", &self.sample),
            ("synchronise", &self.synchronise),
            ("forces", &self.forces),
        ]
    }

    /// Every stage once, in the order of first use.
    pub fn stages(&self) -> Vec<&'static Stage> {
        let mut stages: Vec<&'static Stage> = Vec::new();
        for op in self.parts().into_iter().flat_map(|(_, ops)| ops) {
            if let Some(stage) = op.stage()
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
            Op::Swap(a, b) => write!(f, "swap {a} <-> {b}"),
        }
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, (name, ops)) in self.parts().into_iter().enumerate() {
            let line = ops.iter().map(Op::to_string).collect::<Vec<_>>().join(", ");
            write!(f, "{}{name:<12} {line}", if k == 0 { "" } else { "\n" })?;
        }
        Ok(())
    }
}
