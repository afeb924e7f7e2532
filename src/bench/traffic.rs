//! How the lanes of a warp touch memory (`packstone bench traffic`): the addresses that a kernel walking neighbour lists
//! loads and stores, replayed on the lists of a scene that has run for a while. No device is needed: arrays lie as the
//! composed kernels have them, lists as the state does.
//!
//! Lanes of a warp take grains one after the other, and walk their lists in step until the longest ends. Loads and
//! stores are instructions of up to `WORD` bytes, as wide as an array's elements are aligned. An instruction takes as
//! many lines of the first cache as its lanes touch. What has to come from beyond that cache is counted once per
//! workgroup, in sectors: it is as if the cache held everything that its workgroup has touched.

use crate::{
    dem::ADVANCE,
    engine::programs::{Layouts, layouts, programs},
    error::Result,
    model::{Method, Model, Precision},
    nscd::{JACOBI_PASS, RESIDUAL},
    plans::Plans,
    scene::Assembly,
    simulation::{EngineChoice, Options, Simulation},
    stage::Stage,
    state::{
        ACTIVE, Array, INDEX, Length, NONE, State,
        array::{LIST_START, NEIGHBOUR},
    },
};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// Bytes of a cache line, of the sectors that lines are filled by, and of the widest access of a lane.
const LINE: usize = 128;
const SECTOR: usize = 32;
const WORD: usize = 16;
/// Lanes of a warp: of software drivers, of most devices, and of some.
const WIDTHS: [usize; 3] = [8, 32, 64];

/// What a kernel asks of the others of a grain's contacts, by the names in WGSL; what it does with its own grain, and with
/// entries, is seen from its bindings.
struct Kernel {
    stage: &'static Stage,
    /// Of every neighbour, and of those in contact only.
    near: &'static [&'static str],
    touching: &'static [&'static str],
    /// Touched where something rare happens.
    rare: &'static [&'static str],
}

const DISCRETE_ELEMENTS: &[Kernel] =
    &[Kernel { stage: &ADVANCE, near: &["position", "position_low"], touching: &["velocity", "spin"], rare: &["id"] }];

const CONTACT_DYNAMICS: &[Kernel] = &[
    Kernel { stage: &JACOBI_PASS, near: &[], touching: &["extrapolated_velocity", "extrapolated_spin"], rare: &[] },
    Kernel {
        stage: &RESIDUAL,
        near: &["extrapolated_velocity", "extrapolated_spin", "load_speed"],
        touching: &[],
        rare: &[],
    },
];

/// An array as an instruction of a kernel sees it: an element of the lane's grain, of its list or of a neighbour there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Access {
    array: &'static Array,
    of: Of,
    /// Only in contact.
    touching: bool,
    /// Bytes between elements, before what is accessed, and of that.
    stride: usize,
    offset: usize,
    bytes: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Of {
    Grain,
    Entry,
    Neighbour,
}

/// What the warps of a kernel do in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Count {
    warps: usize,
    grains: usize,
    /// Rounds of the loop over a list, of all warps.
    passes: usize,
    entries: usize,
    /// Lines and sectors that instructions touch, and bytes that they ask for.
    lines: usize,
    sectors: usize,
    bytes: usize,
    /// Sectors of neighbours that workgroups touch.
    gathered: usize,
}

impl Kernel {
    /// And the lanes of a workgroup.
    fn accesses(&self, model: &Model, layouts: &Layouts) -> Result<(Vec<Access>, usize)> {
        let mut accesses = Vec::new();
        let program = programs(model, &[self.stage])?.remove(0);
        for binding in &program.bindings {
            let name = binding.name.as_str();
            let Some(array) = self.stage.array(name) else { continue };
            if self.rare.contains(&name) {
                continue;
            }
            let mut add = |of, touching| {
                let stride = layouts.stride(array);
                // An element is as much aligned as every next one is.
                let bytes = WORD.min(1 << stride.trailing_zeros());
                let words = (0..stride).step_by(bytes);
                accesses.extend(words.map(|offset| Access { array, of, touching, stride, offset, bytes }));
            };
            let times = usize::from(binding.read) + usize::from(binding.written);
            match array.length {
                Length::Bodies | Length::BodiesPlusOne => (0..times).for_each(|_| add(Of::Grain, false)),
                // Whether a contact is one changes rarely.
                Length::Entries if *array == NEIGHBOUR => add(Of::Entry, false),
                Length::Entries => (0..times).for_each(|_| add(Of::Entry, !self.touching.is_empty())),
                _ => {} // all lanes the same
            }
            if self.near.contains(&name) {
                add(Of::Neighbour, false);
            } else if self.touching.contains(&name) {
                add(Of::Neighbour, true);
            }
        }
        Ok((accesses, program.module.entry_points[0].workgroup_size[0] as usize))
    }
}

/// Replay a step of all grains but the large ones, whose lists workgroups walk together.
fn count(s: &State, accesses: &[Access], lanes: usize, width: usize) -> Count {
    let bodies = s.sizes.bodies - s.sizes.large;
    let mut count = Count { grains: bodies, ..Count::default() };
    for first in (0..bodies).step_by(lanes) {
        let mut gathered = HashSet::new();
        let group = first..(first + lanes).min(bodies);
        for first in group.clone().step_by(width) {
            let lists: Vec<(usize, Vec<usize>)> = (first..(first + width).min(group.end))
                .map(|i| (i, s.row(i).take_while(|entry| s.neighbour[*entry] != NONE).collect()))
                .collect();
            let passes = lists.iter().map(|(_, list)| list.len()).max().unwrap_or(0);
            count.warps += 1;
            count.passes += passes;
            count.entries += lists.iter().map(|(_, list)| list.len()).sum::<usize>();
            for access in accesses {
                if access.of == Of::Grain {
                    count.instruction(access, lists.iter().map(|(i, _)| *i));
                    continue;
                }
                for pass in 0..passes {
                    let entries = lists.iter().filter_map(|(_, list)| list.get(pass).copied());
                    let entries = entries.filter(|entry| !access.touching || s.neighbour[*entry] & ACTIVE != 0);
                    if access.of == Of::Entry {
                        count.instruction(access, entries);
                    } else {
                        let neighbours = entries.map(|entry| (s.neighbour[entry] & INDEX) as usize);
                        let grains: Vec<usize> = neighbours.filter(|j| *j < s.sizes.bodies).collect();
                        gathered.extend(grains.iter().map(|j| (access.array.name, access.address(*j) / SECTOR)));
                        count.instruction(access, grains.into_iter());
                    }
                }
            }
        }
        count.gathered += gathered.len();
    }
    count
}

impl Access {
    fn address(&self, element: usize) -> usize {
        element * self.stride + self.offset
    }
}

impl Count {
    /// Of all lanes together, each with an element.
    fn instruction(&mut self, access: &Access, elements: impl Iterator<Item = usize>) {
        let (mut lines, mut sectors) = (Vec::new(), Vec::new());
        for element in elements {
            let address = access.address(element);
            lines.push(address / LINE);
            sectors.push(address / SECTOR);
            self.bytes += access.bytes;
        }
        self.lines += distinct(lines);
        self.sectors += distinct(sectors);
    }

    fn row(&self, kernel: &str, lanes: usize) -> Row {
        let per_warp = |n: usize| n as f64 / self.warps as f64;
        Row {
            kernel: kernel.to_owned(),
            lanes,
            warps: self.warps,
            passes: per_warp(self.passes),
            list: self.entries as f64 / self.grains as f64,
            lines: per_warp(self.lines),
            sectors: per_warp(self.sectors),
            bytes: per_warp(self.bytes),
            gathered: (self.gathered * SECTOR) as f64 / self.grains as f64,
        }
    }
}

fn distinct(mut numbers: Vec<usize>) -> usize {
    numbers.sort_unstable();
    numbers.dedup();
    numbers.len()
}

/// What a kernel does in a step, for warps of so many lanes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub kernel: String,
    pub lanes: usize,
    pub warps: usize,
    /// Rounds of the loop over the lists, of a warp.
    pub passes: f64,
    /// Entries of a list.
    pub list: f64,
    /// That a warp touches, and asks for.
    pub lines: f64,
    pub sectors: f64,
    pub bytes: f64,
    /// Bytes of neighbours that come from beyond the first cache, of a grain.
    pub gathered: f64,
}

/// What the kernels of a model do in the next step of a simulation, for warps of all widths.
///
/// # Errors
/// As [`Simulation::read`].
pub fn rows(model: &Model, simulation: &mut Simulation) -> Result<Vec<Row>> {
    let kernels = match model.method {
        Method::DiscreteElements => DISCRETE_ELEMENTS,
        Method::ContactDynamics => CONTACT_DYNAMICS,
    };
    let plans = Plans::new(model);
    let layouts = layouts(model, &plans)?;
    let s = simulation.read(&[&LIST_START, &NEIGHBOUR])?;
    let mut rows = Vec::new();
    for kernel in kernels.iter().filter(|kernel| plans.stages().contains(&kernel.stage)) {
        let (accesses, lanes) = kernel.accesses(model, &layouts)?;
        rows.extend(WIDTHS.map(|width| count(s, &accesses, lanes, width).row(kernel.stage.name, width)));
    }
    Ok(rows)
}

/// Run a scene for so many steps on the host, and count what its kernels would do in single precision in the next one,
/// with so many lists side by side: a table in Markdown.
///
/// # Errors
/// As [`Simulation::new`] and [`Simulation::advance`].
pub fn table(assembly: Assembly, steps: u64, lists_abreast: u32) -> Result<String> {
    let model = Model::of(&assembly, Precision::Single);
    let options = Options { engine: EngineChoice::Cpu, lists_abreast: Some(lists_abreast), ..Options::default() };
    let mut simulation = Simulation::new(assembly, options)?;
    simulation.advance(steps)?;
    let head = ["kernel", "lanes", "passes", "list", "lines", "sectors", "bytes", "gathered B/grain"];
    let mut text = format!("| {} |\n|{}\n", head.join(" | "), " --- |".repeat(head.len()));
    for row in rows(&model, &mut simulation)? {
        let Row { kernel, lanes, passes, list, lines, sectors, bytes, gathered, .. } = row;
        let numbers = format!("{passes:.2} | {list:.2} | {lines:.0} | {sectors:.0} | {bytes:.0} | {gathered:.0}");
        text += &format!("| {kernel} | {lanes} | {numbers} |\n");
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::Tangential,
        state::{Params, Sizes, array::*},
    };

    /// Ten grains in a row, each a neighbour of the next and of the one before, in touch with the next one only.
    fn row() -> State {
        let rough = |m: &&Model| m.dims() == 3 && m.tangential == Tangential::Coulomb;
        let model = *Model::all(Precision::Single).iter().find(rough).unwrap();
        let sizes = Sizes { bodies: 10, entries: 64, slice_shift: 5, ..Sizes::default() };
        let mut s = State::new(model, sizes, Params::default());
        s.list_start.copy_from_slice(&[0, 64]);
        s.neighbour.fill(NONE);
        for i in 0..10u32 {
            let next = (i < 9).then_some((i + 1) | ACTIVE);
            let list = i.checked_sub(1).into_iter().chain(next);
            s.row(i as usize).zip(list).for_each(|(entry, tagged)| s.neighbour[entry] = tagged);
        }
        s
    }

    #[test]
    fn a_row_of_grains_is_counted_by_hand() {
        let s = row();
        let access = |array, of, touching, stride, bytes| Access { array, of, touching, stride, offset: 0, bytes };
        // Positions of 16 bytes: eight to a line. Warps have eight grains and two.
        let own = count(&s, &[access(&POSITION, Of::Grain, false, 16, 16)], 64, 8);
        let all = Count { warps: 2, grains: 10, passes: 4, entries: 18, ..Count::default() };
        assert_eq!(own, Count { lines: 2, sectors: 4 + 1, bytes: 160, ..all });
        // First round: 1, 0 … 6, and then 7, 8. Second: 2 … 8, and 9.
        let near = count(&s, &[access(&POSITION, Of::Neighbour, false, 16, 16)], 64, 8);
        assert_eq!(near, Count { lines: 1 + 2 + 2 + 1, sectors: 4 + 2 + 4 + 1, bytes: 18 * 16, gathered: 5, ..all });
        // Touching are 1, and 9 others: first round 1, and none; second 2 … 8, and 9.
        let touching = count(&s, &[access(&VELOCITY, Of::Neighbour, true, 16, 16)], 64, 8);
        assert_eq!(touching, Count { lines: 1 + 2 + 1, sectors: 1 + 4 + 1, bytes: 9 * 16, gathered: 5, ..all });
        // Entries of 12 bytes, the first number of each: 0 … 7, and 8, 9; then 32 + 1 … 32 + 7, and 32 + 8.
        let entries = count(&s, &[access(&TANGENTIAL_FORCE, Of::Entry, false, 12, 4)], 64, 8);
        assert_eq!(entries, Count { lines: 1 + 1 + 1 + 1, sectors: 3 + 1 + 3 + 1, bytes: 18 * 4, ..all });
    }

    /// What is bound is touched: an array that a kernel gets anew cannot be forgotten here.
    #[test]
    fn kernels_touch_what_they_are_bound_to() {
        let model = row().model;
        let layouts = layouts(&model, &Plans::new(&model)).unwrap();
        let (accesses, lanes) = DISCRETE_ELEMENTS[0].accesses(&model, &layouts).unwrap();
        assert_eq!(lanes, 256);
        let of = |array: &Array, of| accesses.iter().filter(|a| a.array == array && a.of == of).count();
        // Own, read; near, read. Springs are read and written, one number at a time.
        assert_eq!((of(&POSITION, Of::Grain), of(&POSITION, Of::Neighbour)), (1, 1));
        assert_eq!((of(&VELOCITY_LOW_NEXT, Of::Grain), of(&DISPLACEMENT, Of::Grain)), (1, 2));
        assert_eq!((of(&NEIGHBOUR, Of::Entry), of(&TANGENTIAL_FORCE, Of::Entry)), (1, 6));
        assert!(of(&SPIN, Of::Neighbour) == 1 && accesses.iter().all(|a| a.array != &ID));
    }
}
