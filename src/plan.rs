//! The plan: what happens, in order. The function below is the first thing to read.

use crate::{
    model::{Grains, History, Method, Model, Precision, Rotation},
    stage::Stage,
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
/// `displacement_check`. Nothing in it can go wrong without trace or return: lists that do not fit are not walked and `list` is done
/// again; a step that spends the margin of the lists halts those that follow.
///
/// In contact dynamics a step is `setup_contacts`, `jacobi_pass` as often as `residual` asks for, and `step`; velocities are at n. By colours,
/// `colour` until all contacts have one, `order_by_color`, and before each `jacobi_pass` a `gauss_seidel_pass` for each colour.
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
    pub color: Vec<Op>,
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
    pub swaps: Vec<Op>,
    pub survey: Vec<Op>,
    /// Once, at time 0: velocities half a step back.
    pub kick: Vec<Op>,
    /// Sums for a row of the history.
    pub sample: Vec<Op>,
    /// Velocities at step n, in `velocity_next` and `spin_next`.
    pub synchronise: Vec<Op>,
    /// Contact forces and moments.
    pub forces: Vec<Op>,
}

/// The discrete element method, section 2.1, or contact dynamics, section 2.2.
pub fn plan(model: &Model) -> Plan {
    use crate::{
        dem::*,
        measure::*,
        neighbours::*,
        nscd::{coloring::*, *},
        space::*,
    };
    use Op::{Clear, Run};

    let remembering = model.history == History::Kept;

    let begin = vec![Clear("counters"), Clear("halt"), Clear("halt_next")];

    let mut sort = Vec::new();
    if remembering {
        sort.push(Run(&HISTORY_COUNT));
        sort.extend(SCAN_HISTORY.iter().map(Run));
        sort.push(Run(&HISTORY_STORE));
    }
    sort.extend([Clear("cell_start"), Run(&BIN)]);
    sort.extend(SCAN_CELLS.iter().map(Run));
    sort.extend([Run(&SORT), Run(&ORDER_CELLS), Run(&PERMUTE), Op::Swap("id", "id_next")]);
    sort.extend(exchange_bodies(model));

    let mut list = vec![Run(&COUNT_NEIGHBOURS)];
    list.extend(SCAN_SLOTS.iter().map(Run));
    list.push(Run(&FILL_NEIGHBOURS));

    let rigid = model.method == Method::ContactDynamics;
    let colored = model.colored;
    let clumped = model.grains == Grains::Clumps;
    let (mut meet, mut probe) = (
        vec![Run(&SETUP_CONTACTS), Run(&INIT_SOLVER)],
        vec![Run(&POWER_ITERATION_PASS), Run(&POWER_ITERATION_EIGENVALUE), Run(&EXTRAPOLATE)],
    );
    let mut relax = vec![Run(if colored { &AFTER_SWEEP } else { &JACOBI_PASS })];
    if clumped {
        meet = vec![Run(&FREE_VELOCITIES), Run(&SETUP_CONTACTS), Run(&CLUMP_RESPONSE_FIRST), Run(&INIT_SOLVER)];
        if !colored {
            // There is no pass before, so nothing of it may be left that could spoil the first; `order_by_color` sees to that.
            meet.extend([Clear("pass_velocity_before"), Clear("pass_spin_before"), Run(&EXTRAPOLATE)]);
        }
        probe.insert(1, Run(&POWER_ITERATION_CLUMPS));
        relax.push(Run(if colored { &SYNC_MEMBERS } else { &CLUMP_RESPONSE }));
    }
    relax.extend(turns(model));
    relax.extend([Run(&MOMENTUM_RESTART), Run(&EXTRAPOLATE)]);
    let (mut bleach, mut color, mut arrange, mut sweep) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut judge = vec![Run(&RESIDUAL), Run(&REDUCE_RESIDUAL)];
    if colored {
        relax.push(Clear("color_cursor"));
        bleach = vec![Clear("contact_color"), Clear("color_count"), Clear("coloring_state"), Clear("color_cursor")];
        color = vec![Run(&PROPOSE), Run(&ASSIGN_COLORS)];
        arrange = vec![Run(&ORDER_BY_COLOR)];
        sweep = vec![Run(&GAUSS_SEIDEL_PASS), Op::Swap("color_cursor", "color_cursor_next")];
        judge.splice(..0, [Run(&SCATTER_IMPULSES), Run(&GATHER_IMPULSES)]);
        if clumped {
            color.insert(1, Run(&RESOLVE));
            judge.insert(2, Run(&REFRESH_MEMBERS));
        }
    }

    let mut step = match (rigid, clumped) {
        (true, false) => vec![Run(&MOVE_SPHERES)],
        (true, true) => vec![Run(&MEMBER_IMPULSES), Run(&MOVE_CLUMPS), Run(&MOVE_MEMBERS)],
        (false, true) => vec![Run(&MEMBER_FORCES), Run(&INTEGRATE_CLUMPS), Run(&PLACE_MEMBERS)],
        (false, false) => vec![Run(&ADVANCE)],
    };
    if model.moving_walls {
        step.push(Run(&MOVE_WALLS));
    }
    step.extend(exchange(model));
    step.push(Op::Swap("halt", "halt_next"));

    let mut kick = vec![Run(if clumped { &HALF_KICK_CLUMPS } else { &HALF_KICK })];
    kick.extend(
        exchange(model).filter(|op| matches!(op, Op::Swap("velocity" | "spin" | "clump_velocity" | "clump_spin", _))),
    );
    let mut sample = vec![Run(&MEASURE)];
    if clumped {
        sample.push(Run(&MEASURE_CLUMPS));
    }

    if rigid {
        kick.clear(); // velocities are those of the positions
    }

    let swaps = step.iter().filter(|op| matches!(op, Op::Swap(..))).copied().collect();
    Plan {
        begin,
        sort,
        list,
        meet: if rigid { meet } else { Vec::new() },
        seed: if rigid && !colored { vec![Run(&POWER_ITERATION_START)] } else { Vec::new() },
        probe: if rigid && !colored { probe } else { Vec::new() },
        bleach,
        color,
        arrange,
        sweep,
        relax: if rigid { relax } else { Vec::new() },
        judge: if rigid { judge } else { Vec::new() },
        step,
        swaps,
        survey: vec![Run(&DISPLACEMENT_CHECK)],
        kick,
        sample,
        synchronise: vec![Run(if clumped { &SYNCHRONISE_CLUMPS } else { &SYNCHRONISE })],
        forces: vec![Run(&CONTACT_FORCES)],
    }
}

/// What comes next becomes what is.
fn exchange(model: &Model) -> impl Iterator<Item = Op> + use<> {
    let clumped = model.grains == Grains::Clumps;
    let split = clumped && model.precision == Precision::Single;
    let pairs = [
        (clumped, "center", "center_next"),
        (split, "center_low", "center_low_next"),
        (clumped, "orientation", "orientation_next"),
        (split, "orientation_low", "orientation_low_next"),
        (clumped, "clump_velocity", "clump_velocity_next"),
        (clumped, "clump_spin", "clump_spin_next"),
    ];
    exchange_bodies(model).chain(swaps(pairs))
}

/// The same for what bodies have; a sort moves them alone.
fn exchange_bodies(model: &Model) -> impl Iterator<Item = Op> + use<> {
    swaps([
        (true, "position", "position_next"),
        (model.precision == Precision::Single, "position_low", "position_low_next"),
        (true, "velocity", "velocity_next"),
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
        (!model.colored, "impulse", "impulse_before"),
        (model.colored, "colored_impulse", "colored_impulse_before"),
        (true, "pass_velocity", "pass_velocity_before"),
        (model.rotation == Rotation::Sphere, "pass_spin", "pass_spin_before"),
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
            ("setup_contacts", &self.meet),
            ("power_iteration_start", &self.seed),
            ("power_iteration_pass", &self.probe),
            ("bleach", &self.bleach),
            ("colour", &self.color),
            ("order_by_color", &self.arrange),
            ("gauss_seidel_pass", &self.sweep),
            ("jacobi_pass", &self.relax),
            ("residual", &self.judge),
            ("step", &self.step),
            ("displacement_check", &self.survey),
            ("sample", &self.sample),
            ("synchronise", &self.synchronise),
            ("contact_forces", &self.forces),
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
