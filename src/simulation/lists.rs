//! The life of the neighbour lists: how far they reach beyond contact, for how many steps, and how long they are.

use super::{options::Options, runner::Runner};
use crate::{
    error::{Error, Result},
    model::{Growth, Precision},
    plan::{Driver, Loop, Op},
    plans::Plans,
    record::record,
    scene::{Assembly, Wall},
    space::precision::{extent_of, follow_extent, quantum},
    state::{ARRAYS, Array, Counters, Length, PATH_STEPS, Params, State},
};

/// Steps that lists should live: long enough that making them does not matter, short enough that they need not reach
/// far.
const LIFE: f64 = 50.0;
/// The part of the margin that a chunk is planned to use; it ends early where that was too bold.
const BOLDNESS: f64 = 0.8;
/// The smallest margin, in mean radii: less of it would make lists hardly shorter.
const SMALLEST_MARGIN: f64 = 0.1;

/// The numbers of entries, and of what is a slice beyond the last, are less than what a sum of counts ends with that is
/// too large.
const MOST_ENTRIES: usize = u32::MAX as usize - 1024;
/// Devices round short buffers up, and kernels ask how long they are.
pub const LEAST_LENGTH: usize = 16;

record!(
    /// How long the lists live, and how long their arrays are.
    ListState {
        /// How far grains and walls are from the origin, m.
        extent: f64,
        wall_extent: f64,
        /// Of the fastest grain in the last chunk, m.
        displacement_per_step: f64,
        /// Entries that there are, and that the next lists get.
        entries: usize,
        next_entries: usize,
        /// Entries of the history that there are.
        history: usize,
        /// Contacts at the end of the last chunk: what the history has to hold.
        active_contacts: u32,
        /// Steps that the next lists are made for, that the present ones have left and have served.
        steps_planned: u32,
        steps_left: u32,
        steps_served: u32,
        /// Whether grains may have moved out of the reach of the lists.
        margin_used_up: bool,
        repeated_chunks: u64,
        lost_contacts: u64,
    }
);

/// Neighbour lists reach a margin ("skin") beyond contact, and are made anew before a grain has used up its half of it.
pub struct NeighbourLists {
    /// What the scene allows, m; lists are made with less where grains are slow.
    largest_margin: f64,
    smallest_margin: f64,
    /// The parameters at time 0.
    start: Params,
    /// The coarsest quantum of positions in single precision, m.
    coarsest: Option<f64>,
    walls: Vec<Wall>,
    /// How far grains are from the origin at time 0, m.
    first_extent: f64,
    /// Whether the host is told where they are.
    followed: bool,
    least_entries: usize,
    /// Steps that lists may serve at most.
    most_steps: u32,
    pub state: ListState,
}

/// A period of a wall has as many steps, or more.
const STEPS_OF_PERIOD: f64 = 20.0;

/// Of the fastest wall in a step, m.
///
/// # Errors
/// [`Error::Scene`] if that is more than lists can follow, or a period is too short for the steps.
pub fn wall_displacement(assembly: &Assembly, p: &Params) -> Result<f64> {
    for wall in &assembly.walls {
        if let Some(period) = wall.motion.oscillation.map(|oscillation| 1.0 / oscillation.frequency)
            && period < STEPS_OF_PERIOD * p.dt
        {
            return Err(Error::Scene(format!(
                "wall {} oscillates with a period of {period:e} s, less than {STEPS_OF_PERIOD} steps of {:e} s: use a smaller solver.dt",
                wall.name, p.dt
            )));
        }
    }
    let extent = assembly.extent();
    let speed = |w: &Wall| w.approach_speed(extent);
    let Some(wall) = assembly.walls.iter().max_by(|a, b| speed(a).total_cmp(&speed(b))) else { return Ok(0.0) };
    let displacement = speed(wall) * p.dt;
    if displacement > p.step_limit {
        return Err(Error::Scene(format!(
            "wall {} moves {displacement:e} m in a step of {:e} s; at most {:e} m can be followed: use a smaller solver.dt or a larger \
             solver.margin",
            wall.name, p.dt, p.step_limit
        )));
    }
    Ok(displacement)
}

/// How far the flow of the cell brings two grains together in a step, of the margin of their lists, m.
///
/// # Errors
/// [`Error::Scene`] if that is more than lists can follow.
fn check_flow(assembly: &Assembly, p: &Params) -> Result<()> {
    let largest = assembly.grains.iter().map(|g| g.radius).fold(0.0, f64::max);
    let rate = assembly.largest_rate();
    let most = p.step_limit / (largest + 0.5 * p.margin);
    if rate * p.dt > most {
        return Err(Error::Scene(format!(
            "the cell deforms by {:e} in a step of {:e} s; at most {most:e} can be followed: use a smaller solver.dt or cell.strain_rate, or \
             a larger solver.margin",
            rate * p.dt,
            p.dt
        )));
    }
    Ok(())
}

/// The same of radii that change.
///
/// # Errors
/// [`Error::Scene`] if they do so by more than lists can follow.
fn check_growth(assembly: &Assembly, p: &Params) -> Result<()> {
    let way = assembly.fastest_growth() * p.dt;
    if way > p.step_limit {
        return Err(Error::Scene(format!(
            "a radius changes by {way:e} m in a step of {:e} s; at most {:e} m can be followed: use a smaller growth.rate or solver.dt, or a \
             larger solver.margin",
            p.dt, p.step_limit
        )));
    }
    Ok(())
}

/// A length for this many entries, or contacts, and a few more.
///
/// # Errors
/// [`Error::Device`] if kernels could not number them.
pub fn with_room(needed: u32) -> Result<usize> {
    if needed as usize > MOST_ENTRIES {
        return Err(Error::Lacking(format!("scene too large: it needs lists of more than {MOST_ENTRIES} entries")));
    }
    Ok((needed as usize + needed as usize / 32 + LEAST_LENGTH).min(MOST_ENTRIES))
}

impl NeighbourLists {
    /// None yet, but arrays of this many entries.
    ///
    /// # Errors
    /// [`Error::Scene`] if a wall is too fast.
    pub fn new(assembly: &Assembly, state: &State, options: &Options) -> Result<NeighbourLists> {
        wall_displacement(assembly, &state.params)?;
        let (params, entries) = (&state.params, state.sizes.entries);
        check_flow(assembly, params)?;
        check_growth(assembly, params)?;
        let largest_margin = params.margin - params.reach;
        let single = state.model.precision == Precision::Single;
        Ok(NeighbourLists {
            start: *params,
            coarsest: single.then_some(quantum(0.25 * state.range)),
            largest_margin,
            smallest_margin: (SMALLEST_MARGIN * largest_margin / assembly.solver.margin).min(largest_margin),
            walls: assembly.walls.clone(),
            first_extent: assembly.extent(),
            followed: state.model.guided_walls || state.model.driven_walls,
            least_entries: options.entries.unwrap_or(0),
            most_steps: match state.model.guided_walls || state.model.growth == Growth::Some {
                true => options.longest_chunk.clamp(1, PATH_STEPS as u32),
                false => options.longest_chunk.max(1),
            },
            state: ListState {
                wall_extent: 0.25 * extent_of(params.quantum),
                entries,
                next_entries: entries,
                history: LEAST_LENGTH,
                steps_planned: 1,
                ..ListState::default()
            },
        })
    }

    /// Back to time 0; arrays stay as long as they are.
    pub fn rewind(&mut self, p: &mut Params) {
        *p = self.start;
        let ListState { entries, next_entries, history, .. } = self.state;
        let wall_extent = 0.25 * extent_of(p.quantum);
        self.state =
            ListState { wall_extent, entries, next_entries, history, steps_planned: 1, ..ListState::default() };
    }

    /// The first lists, of grains of which the fastest moves this far in a step, m.
    pub fn start(&mut self, plans: &Plans, runner: &mut Runner, displacement_per_step: f64) -> Result<()> {
        // Nothing is known yet of what forces will do to the speeds.
        self.state.displacement_per_step = displacement_per_step.max(self.largest_margin / LIFE);
        let counters = self.make(plans, runner)?;
        runner.check_lost(&counters)
    }

    /// Whether they have to be made anew before the next step.
    pub fn are_used_up(&self) -> bool {
        self.state.steps_left == 0
    }

    /// Whether they have served no step yet.
    pub fn are_new(&self) -> bool {
        self.state.steps_served == 0
    }

    /// Whether grains may have moved out of their reach.
    pub fn margin_is_used_up(&self) -> bool {
        self.state.margin_used_up
    }

    /// Let lists reach as far as they must to live a while, and plan for how many steps that is. Positions in single
    /// precision become multiples of more where grains have gone far.
    pub fn set_margin(&mut self, p: &mut Params) {
        if let Some(coarsest) = self.coarsest {
            follow_extent(p, self.state.extent.max(self.state.wall_extent), coarsest);
        }
        let of_walls = self.wall_displacement(p);
        let fastest = self.state.displacement_per_step.max(of_walls).max(f64::MIN_POSITIVE);
        let margin = (2.0 * fastest * LIFE / BOLDNESS).clamp(self.smallest_margin, self.largest_margin);
        (p.margin, p.displacement_limit) = (p.reach + margin, 0.5 * margin);
        let walls = p.displacement_limit / of_walls;
        let steps = (BOLDNESS * p.displacement_limit / fastest).min(walls).min(f64::from(self.most_steps));
        self.state.steps_planned = (steps as u32).max(1);
    }

    /// Of the fastest wall in a step, where grains are, m.
    fn wall_displacement(&self, p: &Params) -> f64 {
        // The farthest coordinate, and how far its grain may still go.
        let extent = 3f64.sqrt() * self.state.extent.max(self.first_extent) + self.largest_margin;
        self.walls.iter().map(|wall| wall.approach_speed(extent) * p.dt).fold(0.0, f64::max)
    }

    /// Walls that are guided, or moved by a servo, are or will be so far from the origin, m.
    pub fn see_walls(&mut self, extent: f64) {
        self.state.wall_extent = self.state.wall_extent.max(extent);
    }

    /// Steps until they have to be made anew; if they have to be now, those after that.
    pub fn steps(&self) -> u32 {
        if self.are_used_up() { self.state.steps_planned } else { self.state.steps_left }
    }

    /// New lists.
    pub fn make(&mut self, plans: &Plans, runner: &mut Runner) -> Result<Counters> {
        self.make_room_for_history(runner)?;
        let mut making = Making { lists: self, runner, counters: Counters::default() };
        plans.lists.walk(&mut making)?;
        Ok(making.counters)
    }

    /// New lists if it is time, and then this many steps, or fewer if a grain comes to the end of the lists' reach or
    /// is lost.
    pub fn run(&mut self, plans: &Plans, runner: &mut Runner, steps: u32) -> Result<Counters> {
        let rebuild = self.are_used_up();
        self.make_room_for_history(runner)?;
        let mut chunk = Chunk { lists: self, runner, steps, rebuild, counters: Counters::default() };
        plans.chunk.walk(&mut chunk)?;
        let counters = chunk.counters;
        runner.submit()?;
        if rebuild {
            self.begin(&counters)?;
        }
        // Where no step was done, exchanges have brought nothing to look at.
        if counters.steps_done > 0 {
            self.note_displacements(&counters, &runner.state.params);
        }
        self.state.steps_left = if self.state.margin_used_up { 0 } else { self.state.steps_left - counters.steps_done };
        self.state.repeated_chunks += u64::from(counters.steps_done < steps && counters.deep_overlaps == 0);
        Ok(counters)
    }

    /// The contacts that there are fit into the history. To be called before lists are made.
    pub fn make_room_for_history(&mut self, runner: &mut Runner) -> Result<()> {
        if self.state.active_contacts as usize > self.state.history {
            self.state.history = with_room(self.state.active_contacts)?;
            resize(runner, Length::History, self.state.history)?;
        }
        Ok(())
    }

    /// What the next lists need, so far as is known.
    pub fn make_room(&mut self, runner: &mut Runner) -> Result<()> {
        if self.state.next_entries != self.state.entries {
            runner.submit()?;
            self.resize_entries(runner, self.state.next_entries)?;
        }
        Ok(())
    }

    /// More if they have turned out too short: whether they have.
    fn make_more_room(&mut self, runner: &mut Runner, counters: &Counters) -> Result<bool> {
        let short = counters.entries_needed as usize > self.state.entries;
        if short {
            self.state.repeated_chunks += 1;
            runner.submit()?;
            self.resize_entries(runner, with_room(counters.entries_needed)?)?;
        }
        Ok(short)
    }

    /// Look at lists that are made without steps: what the device says when they fit. `round`: how many looks there
    /// have been.
    pub fn are_made(&mut self, runner: &mut Runner, round: u32) -> Result<Option<Counters>> {
        runner.submit()?;
        let counters = runner.engine.counters()?;
        if round == 1 && self.make_more_room(runner, &counters)? {
            return Ok(None);
        }
        self.begin(&counters)?;
        Ok(Some(counters))
    }

    /// They are new.
    fn begin(&mut self, counters: &Counters) -> Result<()> {
        let needed = counters.entries_needed as usize;
        let ample = with_room(counters.entries_needed)?.max(self.least_entries);
        self.state.next_entries = if 8 * needed < 7 * self.state.entries { ample } else { self.state.entries };
        let forgotten = self.state.active_contacts.saturating_sub(counters.restored_contacts);
        self.state.lost_contacts += u64::from(forgotten) + u64::from(counters.unlisted);
        (self.state.steps_left, self.state.steps_served, self.state.margin_used_up) =
            (self.state.steps_planned, 0, false);
        Ok(())
    }

    /// How far grains have gone, and how many contacts there are.
    pub fn note_displacements(&mut self, counters: &Counters, p: &Params) {
        self.state.active_contacts = counters.active_contacts;
        self.state.steps_served += counters.steps_done;
        self.state.extent = f64::from(f32::from_bits(counters.max_coordinate)) * p.quantum;
        if !self.followed {
            self.state.wall_extent += f64::from(counters.steps_done) * self.wall_displacement(p);
        }
        let displacement = f64::from(f32::from_bits(counters.max_displacement));
        self.state.margin_used_up = !(displacement <= 1.0);
        if self.state.steps_served > 0 {
            self.state.displacement_per_step = displacement * p.displacement_limit / f64::from(self.state.steps_served);
        }
    }

    /// A step of contact dynamics, which runs none of theirs, is done.
    pub fn serve_step(&mut self) {
        self.state.steps_left = self.state.steps_left.saturating_sub(1);
    }

    /// A step of contact dynamics was taken back, to be done again with longer ones.
    pub fn repeat_step(&mut self) {
        self.state.steps_left = 0;
        self.state.repeated_chunks += 1;
    }

    /// Grains have come in: so far from the origin, m, and so far in a step, m.
    pub fn see_grains(&mut self, extent: f64, displacement_per_step: f64) {
        self.state.extent = self.state.extent.max(extent);
        self.state.displacement_per_step = self.state.displacement_per_step.max(displacement_per_step);
    }

    /// There are none that the next lists could take over.
    pub fn forget_contacts(&mut self) {
        self.state.active_contacts = 0;
    }

    /// They are those of another state.
    pub fn discard(&mut self) {
        (self.state.margin_used_up, self.state.steps_left) = (true, 0);
    }

    pub fn most_steps(&self) -> u32 {
        self.most_steps
    }

    pub fn entries(&self) -> usize {
        self.state.entries
    }

    /// Entries of the history: as long as it is, and as many as are in use.
    pub fn history(&self) -> (usize, usize) {
        (self.state.history, self.state.active_contacts as usize)
    }

    pub fn repeated_chunks(&self) -> u64 {
        self.state.repeated_chunks
    }

    pub fn lost_contacts(&self) -> u64 {
        self.state.lost_contacts
    }

    fn resize_entries(&mut self, runner: &mut Runner, entries: usize) -> Result<()> {
        self.state.entries = entries;
        resize(runner, Length::Entries, entries)
    }
}

/// Give all arrays of a kind of length another one; their content is lost.
pub fn resize(runner: &mut Runner, kind: Length, len: usize) -> Result<()> {
    let of_kind = |a: &&&'static Array| a.length == kind && (a.needed)(&runner.state.model);
    let arrays: Vec<_> = ARRAYS.iter().filter(of_kind).copied().collect();
    runner.engine.resize(&arrays, len)
}

/// Walks the plan of lists.
struct Making<'a> {
    lists: &'a mut NeighbourLists,
    runner: &'a mut Runner,
    counters: Counters,
}

impl Driver for Making<'_> {
    fn run(&mut self, op: Op) -> Result<()> {
        self.runner.push(op);
        Ok(())
    }

    fn rounds(&mut self, of: Loop, done: u32) -> Result<u32> {
        match (of, done) {
            (Loop::UntilListsFit, 0) => self.lists.make_room(self.runner).map(|()| 1),
            (Loop::UntilListsFit, _) => match self.lists.are_made(self.runner, done)? {
                Some(counters) => {
                    self.counters = counters;
                    Ok(0)
                }
                None => Ok(1),
            },
            _ => Ok(0),
        }
    }
}

/// Walks the plan of a chunk of steps.
struct Chunk<'a> {
    lists: &'a mut NeighbourLists,
    runner: &'a mut Runner,
    steps: u32,
    rebuild: bool,
    /// What the last look has seen.
    counters: Counters,
}

impl Driver for Chunk<'_> {
    fn run(&mut self, op: Op) -> Result<()> {
        self.runner.push(op);
        Ok(())
    }

    fn rounds(&mut self, of: Loop, done: u32) -> Result<u32> {
        match (of, done) {
            (Loop::IfListsAreUsedUp | Loop::IfGrainsAreSorted, 0) => Ok(u32::from(self.rebuild)),
            (Loop::UntilListsFit, 0) => {
                if self.rebuild {
                    self.lists.make_room(self.runner)?;
                }
                Ok(1)
            }
            (Loop::UntilListsFit, 1) => self.lists.make_more_room(self.runner, &self.counters).map(u32::from),
            (Loop::Steps, 0) => Ok(self.steps),
            (Loop::HaltedSteps, 0) => {
                self.runner.submit()?;
                self.counters = self.runner.engine.counters()?;
                Ok(self.steps.saturating_sub(self.counters.steps_done))
            }
            _ => Ok(0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_at_most_as_long_as_kernels_can_count() {
        assert_eq!(with_room(1 << 31).unwrap(), (1 << 31) + (1 << 26) + LEAST_LENGTH);
        assert_eq!(with_room(u32::MAX - 2000).unwrap(), MOST_ENTRIES);
        // What a prefix sum ends with that has exceeded the largest number.
        assert!(with_room(u32::MAX).unwrap_err().to_string().contains("entries"));
    }
}
