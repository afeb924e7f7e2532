//! What a stage is: a kernel in `shaders/CHAPTER/KERNEL.wgsl` beside its CPU twin in f64, `src/CHAPTER/KERNEL.rs`. The stages
//! themselves stand in their chapters.
//!
//! A twin is a function of one body mapped over all of them; nothing in it is clever enough to need reading twice. In
//! `advance`, where the time goes, the contacts of many bodies are computed at a time.

use crate::state::{Sizes, State};

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
    /// Folder in `shaders/` and `src/`.
    pub chapter: &'static str,
    /// Entry point, and stem of the file in the chapter.
    pub kernel: &'static str,
    /// The same on the CPU, in f64.
    pub twin: fn(&mut State),
    pub dispatch: Dispatch,
    /// WGSL bindings that stand for an array of another name.
    pub bind: &'static [(&'static str, &'static str)],
    /// Arrays written whose order inside a cell is arbitrary until `order_cells` has run; compared as multisets.
    pub unordered: &'static [&'static str],
}

impl Stage {
    /// A stage of a chapter whose kernel has its name.
    pub const fn new(
        chapter: &'static str,
        name: &'static str,
        twin: fn(&mut State),
        items: fn(&Sizes) -> usize,
    ) -> Stage {
        Stage { name, chapter, kernel: name, twin, dispatch: Dispatch::Items(items), bind: &[], unordered: &[] }
    }

    /// Its WGSL, relative to `shaders/`.
    pub fn file(&self) -> String {
        format!("{}/{}.wgsl", self.chapter, self.kernel)
    }

    /// The array a WGSL binding stands for.
    pub fn array<'a>(&self, binding: &'a str) -> &'a str {
        self.bind.iter().find(|(from, _)| *from == binding).map_or(binding, |(_, to)| to)
    }
}

pub fn bodies(sizes: &Sizes) -> usize {
    sizes.bodies
}

pub fn clumps(sizes: &Sizes) -> usize {
    sizes.clumps
}

pub fn bodies_plus_one(sizes: &Sizes) -> usize {
    sizes.bodies + 1
}
