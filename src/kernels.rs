//! The kernels: one file per `shaders/*.wgsl` entry point, same name, with its CPU twin in f64.
//!
//! A twin is a function of one body mapped over all of them; nothing in it is clever enough to need reading twice. In
//! `advance`, where the time goes, the contacts of many bodies are computed at a time.

mod advance;
mod arrange;
mod bin;
mod carry;
mod conclude;
mod count;
mod deliver;
mod displace;
mod displace_clumps;
mod displace_members;
mod drive;
mod echo;
mod elect;
mod extrapolate;
mod fall_in;
mod follow;
mod forces;
mod gather;
mod gauge;
mod half_kick;
mod hand_over;
mod judge;
mod kick_clumps;
mod load;
mod measure;
mod measure_clumps;
mod meet;
mod move_walls;
mod neighbours;
mod order;
mod paint;
mod permute;
mod probe;
mod propose;
mod recover;
mod relax;
mod release;
mod remember;
mod respond;
mod scan;
mod seed;
mod set_out;
mod sort;
mod steer;
mod survey;
mod sweep;
mod synchronise;
mod synchronise_clumps;
mod tally;

use crate::{
    laws::{
        contact::{Body, Gathered, body, contacts_of},
        grid::{cell_index, cell_of},
    },
    state::{Motion, PARTS, Sizes, State, TILE},
};
use glam::DVec3;
use rayon::{prelude::*, vec};

/// How many invocations a stage needs.
#[derive(Clone, Copy, Debug)]
pub enum Dispatch {
    /// One invocation per item.
    Items(fn(&Sizes) -> usize),
    /// A single workgroup.
    OneGroup,
}

/// One kernel: its name, its WGSL, its CPU twin, its dispatch size.
#[derive(Debug)]
pub struct Stage {
    /// Unique name, for plans, `check` and timings.
    pub name: &'static str,
    /// Entry point, and stem of the file in `shaders/`.
    pub kernel: &'static str,
    /// The same on the CPU, in f64.
    pub twin: fn(&mut State),
    pub dispatch: Dispatch,
    /// WGSL bindings that stand for an array of another name.
    pub bind: &'static [(&'static str, &'static str)],
    /// Arrays written whose order inside a cell is arbitrary until `order` has run; compared as multisets.
    pub unordered: &'static [&'static str],
}

impl Stage {
    const fn new(name: &'static str, twin: fn(&mut State), items: fn(&Sizes) -> usize) -> Stage {
        Stage { name, kernel: name, twin, dispatch: Dispatch::Items(items), bind: &[], unordered: &[] }
    }

    /// The array a WGSL binding stands for.
    pub fn array<'a>(&self, binding: &'a str) -> &'a str {
        self.bind.iter().find(|(from, _)| *from == binding).map_or(binding, |(_, to)| to)
    }
}

fn bodies(sizes: &Sizes) -> usize {
    sizes.bodies
}

fn clumps(sizes: &Sizes) -> usize {
    sizes.clumps
}

fn bodies_plus_one(sizes: &Sizes) -> usize {
    sizes.bodies + 1
}

/// History 1: springs per grain.
pub static TALLY: Stage = Stage::new("tally", tally::tally, bodies_plus_one);
/// Prefix sum of `history_start`.
pub static SCAN_HISTORY: [Stage; 3] = [
    Stage {
        kernel: "scan_reduce",
        bind: &[("values", "history_start")],
        ..Stage::new(
            "scan_reduce history_start",
            |s| scan::scan_reduce(&s.history_start, &mut s.tile),
            |s| s.bodies / TILE + 1,
        )
    },
    Stage {
        kernel: "scan_top",
        bind: &[("values", "history_start")],
        dispatch: Dispatch::OneGroup,
        ..Stage::new("scan_top history_start", |s| scan::scan_top(&s.history_start, &mut s.tile), |_| 1)
    },
    Stage {
        kernel: "scan_down",
        bind: &[("values", "history_start")],
        ..Stage::new(
            "scan_down history_start",
            |s| scan::scan_down(&mut s.history_start, &s.tile),
            |s| s.bodies / TILE + 1,
        )
    },
];
/// History 2: the springs.
pub static REMEMBER: Stage = Stage::new("remember", remember::remember, bodies);
/// Broad phase 1: histogram over cells.
pub static BIN: Stage = Stage { unordered: &["rank"], ..Stage::new("bin", bin::bin, bodies) };
/// Prefix sum of `cell_start`.
pub static SCAN_CELLS: [Stage; 3] = [
    Stage {
        kernel: "scan_reduce",
        bind: &[("values", "cell_start")],
        ..Stage::new(
            "scan_reduce cell_start",
            |s| scan::scan_reduce(&s.cell_start, &mut s.tile),
            |s| s.cells / TILE + 1,
        )
    },
    Stage {
        kernel: "scan_top",
        bind: &[("values", "cell_start")],
        dispatch: Dispatch::OneGroup,
        ..Stage::new("scan_top cell_start", |s| scan::scan_top(&s.cell_start, &mut s.tile), |_| 1)
    },
    Stage {
        kernel: "scan_down",
        bind: &[("values", "cell_start")],
        ..Stage::new("scan_down cell_start", |s| scan::scan_down(&mut s.cell_start, &s.tile), |s| s.cells / TILE + 1)
    },
];
/// Broad phase 2: scatter to cells.
pub static SORT: Stage = Stage { unordered: &["sorted"], ..Stage::new("sort", sort::sort, bodies) };
/// Broad phase 3: ascending numbers inside cells.
pub static ORDER: Stage = Stage::new("order", order::order, |sizes| sizes.cells);
/// Broad phase 4: grains into that order.
pub static PERMUTE: Stage = Stage::new("permute", permute::permute, bodies);
/// Neighbour lists 1: slots per grain.
pub static COUNT: Stage = Stage::new("count", count::count, bodies_plus_one);
/// Prefix sum of `slot_start`.
pub static SCAN_SLOTS: [Stage; 3] = [
    Stage {
        kernel: "scan_reduce",
        bind: &[("values", "slot_start")],
        ..Stage::new(
            "scan_reduce slot_start",
            |s| scan::scan_reduce(&s.slot_start, &mut s.tile),
            |s| s.bodies / TILE + 1,
        )
    },
    Stage {
        kernel: "scan_top",
        bind: &[("values", "slot_start")],
        dispatch: Dispatch::OneGroup,
        ..Stage::new("scan_top slot_start", |s| scan::scan_top(&s.slot_start, &mut s.tile), |_| 1)
    },
    Stage {
        kernel: "scan_down",
        bind: &[("values", "slot_start")],
        ..Stage::new("scan_down slot_start", |s| scan::scan_down(&mut s.slot_start, &s.tile), |s| s.bodies / TILE + 1)
    },
];
/// Neighbour lists 2: entries and springs.
pub static NEIGHBOURS: Stage = Stage::new("neighbours", neighbours::neighbours, bodies);
/// Velocities from 0 to -1/2.
pub static HALF_KICK: Stage = Stage::new("half_kick", half_kick::half_kick, bodies);
/// Contact forces and leapfrog: a step.
pub static ADVANCE: Stage = Stage::new("advance", advance::advance, bodies);
/// A step of clumps 1: contact forces on members.
pub static LOAD: Stage = Stage::new("load", load::load, bodies);
/// A step of clumps 2: leapfrog and rotation.
pub static DRIVE: Stage = Stage::new("drive", drive::drive, clumps);
/// A step of clumps 3: members follow.
pub static CARRY: Stage = Stage::new("carry", carry::carry, bodies);
/// Velocities of clumps from 0 to -1/2.
pub static KICK_CLUMPS: Stage = Stage::new("kick_clumps", kick_clumps::kick_clumps, clumps);
/// Moving walls.
pub static MOVE_WALLS: Stage = Stage::new("move_walls", move_walls::move_walls, |sizes| sizes.walls);
/// How far grains went in a chunk, and how many springs there are.
pub static SURVEY: Stage = Stage::new("survey", survey::survey, bodies);
/// Contact dynamics 1: contacts of a step.
pub static MEET: Stage = Stage::new("meet", meet::meet, bodies);
/// Contact dynamics, length of the passes' steps 1: where the power iteration starts.
pub static SEED: Stage = Stage::new("seed", seed::seed, bodies);
/// Contact dynamics, length of the passes' steps 2: a pass of the power iteration.
pub static PROBE: Stage = Stage::new("probe", probe::probe, bodies);
/// Contact dynamics, length of the passes' steps 3: the largest eigenvalue of W.
pub static GAUGE: Stage = Stage { dispatch: Dispatch::OneGroup, ..Stage::new("gauge", gauge::gauge, |_| 1) };
/// Contact dynamics 2: the relaxation of a step begins.
pub static SET_OUT: Stage = Stage { dispatch: Dispatch::OneGroup, ..Stage::new("set_out", set_out::set_out, |_| 1) };
/// Contact dynamics 3: a pass.
pub static RELAX: Stage = Stage::new("relax", relax::relax, bodies);
/// Colours of contacts 1: what every body would have coloured next.
pub static PROPOSE: Stage = Stage::new("propose", propose::propose, bodies);
/// Colours of clumps: what every clump would have coloured next, of what its members would.
pub static ELECT: Stage = Stage::new("elect", elect::elect, clumps);
/// Colours of contacts 2: what both grains agree on.
pub static PAINT: Stage = Stage { unordered: &["hue"], ..Stage::new("paint", paint::paint, bodies) };
/// Colours of contacts 3: contacts in their order.
pub static ARRANGE: Stage = Stage::new("arrange", arrange::arrange, bodies);
/// Contact dynamics 3, coloured: the contacts of one colour.
pub static SWEEP: Stage = Stage::new("sweep", sweep::sweep, |sizes| sizes.bodies.div_ceil(4));
/// Contact dynamics 3, coloured: velocities after all colours.
pub static FOLLOW: Stage = Stage::new("follow", follow::follow, bodies);
/// Contact dynamics of clumps 3, coloured: members follow the first of them.
pub static FALL_IN: Stage = Stage::new("fall_in", fall_in::fall_in, clumps);
/// Colours of contacts 4: impulses back into the lists.
pub static DELIVER: Stage = Stage::new("deliver", deliver::deliver, bodies);
/// Colours of contacts 5: velocities without the rounding of the sweeps.
pub static GATHER: Stage = Stage::new("gather", gather::gather, bodies);
/// Colours of clumps, after `gather`: velocities without the rounding of the sweeps.
pub static RECOVER: Stage = Stage::new("recover", recover::recover, clumps);
/// Contact dynamics 4: momentum.
pub static STEER: Stage = Stage { dispatch: Dispatch::OneGroup, ..Stage::new("steer", steer::steer, |_| 1) };
/// Contact dynamics 5: velocities, carried ahead by momentum.
pub static EXTRAPOLATE: Stage = Stage::new("extrapolate", extrapolate::extrapolate, bodies);
/// Contact dynamics 6: residual.
pub static JUDGE: Stage =
    Stage { bind: &[("ahead", "trial"), ("ahead_spin", "trial_spin")], ..Stage::new("judge", judge::judge, bodies) };
/// Contact dynamics 7: the judgement.
pub static CONCLUDE: Stage =
    Stage { dispatch: Dispatch::OneGroup, ..Stage::new("conclude", conclude::conclude, |_| 1) };
/// Contact dynamics 8: positions.
pub static DISPLACE: Stage = Stage::new("displace", displace::displace, bodies);
/// Contact dynamics of clumps 0: velocities if nothing touched.
pub static RELEASE: Stage = Stage::new("release", release::release, clumps);
/// Contact dynamics of clumps, after `meet`: clumps answer to impulses.
pub static RESPOND_FIRST: Stage = Stage {
    kernel: "respond",
    bind: &[("response", "trial"), ("response_spin", "trial_spin")],
    ..Stage::new("respond_first", respond::respond_first, clumps)
};
/// Contact dynamics of clumps, after a pass: clumps answer to impulses.
pub static RESPOND: Stage = Stage {
    bind: &[("response", "trial_before"), ("response_spin", "trial_spin_before")],
    ..Stage::new("respond", respond::respond, clumps)
};
/// Contact dynamics of clumps, length of the passes' steps, after `probe`.
pub static ECHO: Stage =
    Stage { bind: &[("response", "trial"), ("response_spin", "trial_spin")], ..Stage::new("echo", echo::echo, clumps) };
/// Contact dynamics of clumps 8: impulses that the step ends with.
pub static HAND_OVER: Stage = Stage::new("hand_over", hand_over::hand_over, bodies);
/// Contact dynamics of clumps 9: centres and attitudes.
pub static DISPLACE_CLUMPS: Stage = Stage::new("displace_clumps", displace_clumps::displace_clumps, clumps);
/// Contact dynamics of clumps 10: members follow.
pub static DISPLACE_MEMBERS: Stage = Stage::new("displace_members", displace_members::displace_members, bodies);
/// Sums over grains.
pub static MEASURE: Stage = Stage::new("measure", measure::measure, |_| PARTS);
/// Velocities at the time of the positions.
pub static SYNCHRONISE: Stage = Stage::new("synchronise", synchronise::synchronise, bodies);
/// Sums over clumps.
pub static MEASURE_CLUMPS: Stage = Stage::new("measure_clumps", measure_clumps::measure_clumps, |_| PARTS);
/// Velocities of clumps at the time of the positions.
pub static SYNCHRONISE_CLUMPS: Stage = Stage::new("synchronise_clumps", synchronise_clumps::synchronise_clumps, clumps);
/// Contact forces and moments.
pub static FORCES: Stage = Stage::new("forces", forces::forces, bodies);

/// Grains that one task works on.
const BLOCK: usize = 256;

/// The runs of grains of an array over grains; empty runs where the model has no such array.
fn by_body<'a, T: Send>(array: &'a mut [T], s: &State) -> vec::IntoIter<&'a mut [T]> {
    let bodies = if array.is_empty() { 0 } else { s.sizes.bodies };
    runs(array, s.sizes.bodies, |i| i.min(bodies))
}

/// The same for an array over slots.
fn by_slot<'a, T: Send>(array: &'a mut [T], s: &State) -> vec::IntoIter<&'a mut [T]> {
    let absent = array.is_empty();
    runs(array, s.sizes.bodies, |i| if absent { 0 } else { s.slot_start[i] as usize })
}

fn runs<T: Send>(mut array: &mut [T], bodies: usize, start: impl Fn(usize) -> usize) -> vec::IntoIter<&mut [T]> {
    let run = |begin: usize| {
        let len = start((begin + BLOCK).min(bodies)) - start(begin);
        let run;
        (run, array) = std::mem::take(&mut array).split_at_mut(len);
        run
    };
    (0..bodies).step_by(BLOCK).map(run).collect::<Vec<_>>().into_par_iter()
}

/// The cell of every grain.
fn cells(s: &State) -> Vec<usize> {
    s.place[..s.sizes.bodies].par_iter().map(|place| cell_index(s, cell_of(s, place.x))).collect()
}

/// Velocities and spins that follow from the contact forces now, for all grains.
fn velocities(s: &mut State, law: impl Fn(&State, &Body, &Gathered) -> (DVec3, DVec3) + Sync) {
    let of_body = |i| {
        let here = body(s, i);
        law(s, &here, &contacts_of(s, i, &here))
    };
    let values: Vec<_> = (0..s.sizes.bodies).into_par_iter().map(of_body).collect();
    for (i, (v, spin)) in values.into_iter().enumerate() {
        s.motion_next[i] = Motion { v, inverse_mass: s.motion[i].inverse_mass };
        if let Some(next) = s.spin_next.get_mut(i) {
            next.0 = spin;
        }
    }
}
