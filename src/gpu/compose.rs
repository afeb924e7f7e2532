//! Composer: whole WGSL files are concatenated (module scope does not care about order), parsed by naga for many
//! kernels at once, and reduced to what an entry point uses; the variables among that get binding numbers. Bindings are
//! matched to arrays by name, and the layout of every array is read from the module, so that no struct is described
//! twice.

use super::{
    layout::{Binding, Lane, LaneKind, Layout, Resource},
    placement::{Declarations, Placement},
    redirect::{only_elements, redirect},
};
use crate::error::{Error, Result};
use naga::{
    AddressSpace, EntryPoint, Handle, Module, ResourceBinding, ScalarKind, Type, TypeInner,
    compact::{KeepUnused, compact},
    proc::Layouter,
    valid::{Capabilities, GlobalUse, ModuleInfo, ValidationFlags, Validator},
};
use std::collections::HashMap;

/// A kernel ready for a device.
pub struct Program {
    /// With binding numbers assigned.
    pub module: Module,
    /// Entry point.
    pub entry: String,
    /// What the entry point uses; the position is the binding number.
    pub bindings: Vec<Binding>,
}

/// The name and the text of a file of WGSL.
pub type File<'a> = (&'a str, &'a str);

/// Compose `shared` files and a file of its own into every kernel (entry point, own file), with arrays where
/// `placement` says, which is asked with the number of the kernel.
///
/// # Errors
/// [`Error::Shader`] with file and line if the text does not parse or validate.
pub fn compose(
    shared: &[File<'_>],
    kernels: &[(&str, File<'_>)],
    placement: impl Fn(usize, &Binding) -> Placement,
) -> Result<Vec<Program>> {
    let mut groups: Vec<Group> = Vec::new();
    for (k, (_, file)) in kernels.iter().enumerate() {
        match groups.iter_mut().find(|group| group.can_take(*file)) {
            Some(group) => group.take(k, *file),
            None => {
                groups.push(Group::default());
                groups.last_mut().expect("just made").take(k, *file);
            }
        }
    }
    let mut programs = Vec::new();
    for group in groups {
        let own = group.files.iter().map(|(name, text)| (*name, text.as_str()));
        let files: Vec<File> = shared.iter().copied().chain(own).collect();
        let mut module = parse(&files)?;
        validated(&module, &files)?;
        let entries = std::mem::take(&mut module.entry_points);
        let composed = group.kernels.iter().map(|&k| Ok((k, isolated(&module, &entries, kernels[k].0, &[], &files)?)));
        let composed: Vec<_> = composed.collect::<Result<_>>()?;
        programs.extend(placed(composed, files, &placement)?);
    }
    programs.sort_by_key(|(k, _)| *k);
    Ok(programs.into_iter().map(|(_, program)| program).collect())
}

/// The kernels of a group with arrays where they are to lie.
fn placed(
    composed: Vec<(usize, Program)>,
    files: Vec<File<'_>>,
    placement: impl Fn(usize, &Binding) -> Placement,
) -> Result<Vec<(usize, Program)>> {
    let moved_of = |k: usize, program: &Program| -> Vec<(Binding, Placement)> {
        let placed = program.bindings.iter().map(|b| (b.clone(), placement(k, b)));
        placed.filter(|(_, placement)| *placement != Placement::Buffer).collect()
    };
    let mut declarations = Declarations::default();
    for (k, program) in &composed {
        for (binding, placement) in moved_of(*k, program) {
            declarations.add(&program.module, &binding, placement);
        }
    }
    if declarations.is_empty() {
        return Ok(composed);
    }
    let text = declarations.text();
    let files: Vec<File> = [("placement", text.as_str())].into_iter().chain(files).collect();
    let mut module = parse(&files)?;
    let entries = std::mem::take(&mut module.entry_points);
    let redirected = composed.into_iter().map(|(k, program)| {
        let moved = moved_of(k, &program);
        if moved.is_empty() {
            return Ok((k, program));
        }
        let program = isolated(&module, &entries, &program.entry, &moved, &files)?;
        Ok((k, Program { bindings: declarations.bound(program.bindings), ..program }))
    });
    redirected.collect()
}

/// Kernels that are parsed together, because what takes time is to parse what they share. What two of them declare
/// alike is declared once.
#[derive(Default)]
struct Group<'a> {
    kernels: Vec<usize>,
    files: Vec<(&'a str, String)>,
    declared: HashMap<&'a str, Option<&'a str>>,
}

impl<'a> Group<'a> {
    fn has(&self, (file, _): File<'a>) -> bool {
        self.files.iter().any(|(name, _)| *name == file)
    }

    /// Whether nothing in a file is declared otherwise in the others.
    fn can_take(&self, file: File<'a>) -> bool {
        let known = |name| self.declared.get(name);
        let mut declared = file.1.lines().filter_map(declaration);
        self.has(file) || declared.all(|(name, whole)| known(name).is_none_or(|k| whole.is_some() && *k == whole))
    }

    fn take(&mut self, kernel: usize, file: File<'a>) {
        self.kernels.push(kernel);
        if self.has(file) {
            return;
        }
        let mut text = String::new();
        for line in file.1.lines() {
            let again = declaration(line).is_some_and(|(name, whole)| self.declared.insert(name, whole).is_some());
            text += if again { "" } else { line };
            text.push('\n');
        }
        self.files.push((file.0, text));
    }
}

/// The name that a line of WGSL declares in module scope, and all of the declaration if that is of a constant or a
/// variable and ends there.
fn declaration(line: &str) -> Option<(&str, Option<&str>)> {
    let keywords = ["fn ", "struct ", "alias ", "const ", "var<"];
    let (keyword, rest) = keywords.iter().find_map(|keyword| Some((*keyword, line.strip_prefix(keyword)?)))?;
    let rest = if keyword == "var<" { rest.split_once('>')?.1.trim_start() } else { rest };
    let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()?;
    let value = matches!(keyword, "const " | "var<");
    Some((name, line.split_once(';').map(|(whole, _)| whole).filter(|_| value)))
}

/// One of the entry points, which have been taken out of the module, with what it uses of the module; and these arrays
/// where they are to lie.
fn isolated(
    module: &Module,
    entries: &[EntryPoint],
    entry: &str,
    moved: &[(Binding, Placement)],
    files: &[File<'_>],
) -> Result<Program> {
    let entry_points = entries.iter().filter(|e| e.name == entry).cloned().collect();
    let mut module = Module { entry_points, ..module.clone() };
    if !moved.is_empty() {
        redirect(&mut module, moved);
    }
    compact(&mut module, KeepUnused::No);
    let info = validated(&module, files)?;
    let bindings = number(&mut module, &info, entry)?;
    Ok(Program { module, entry: entry.to_owned(), bindings })
}

fn joined(files: &[File<'_>]) -> String {
    files.iter().flat_map(|(_, text)| [*text, "\n"]).collect()
}

fn parse(files: &[File<'_>]) -> Result<Module> {
    let text = joined(files);
    naga::front::wgsl::parse_str(&text).map_err(|e| {
        let line = e.location(&text).map_or(1, |l| l.line_number as usize);
        locate(files, line, e.message().to_owned())
    })
}

/// Validated without bindings, which are known only after this pass has found what the entry point uses; the device
/// validates the numbered module again.
fn validated(module: &Module, files: &[File<'_>]) -> Result<ModuleInfo> {
    let flags = ValidationFlags::all() - ValidationFlags::BINDINGS;
    Validator::new(flags, Capabilities::all()).validate(module).map_err(|e| {
        let text = joined(files);
        let line = e.location(&text).map_or(1, |l| l.line_number as usize);
        locate(files, line, e.emit_to_string(&text))
    })
}

/// Give the variables that the entry point uses the numbers 0, 1, 2, …
fn number(module: &mut Module, info: &ModuleInfo, entry: &str) -> Result<Vec<Binding>> {
    let unknown = || Error::Shader { file: entry.to_owned(), line: 1, message: format!("no entry point `{entry}`") };
    let index = module.entry_points.iter().position(|e| e.name == entry).ok_or_else(unknown)?;
    let mut layouter = Layouter::default();
    layouter.update(module.to_ctx()).map_err(|e| Error::Shader {
        file: entry.to_owned(),
        line: 1,
        message: e.to_string(),
    })?;
    let variables = module.global_variables.iter();
    let bound = variables.filter(|(_, v)| {
        matches!(v.space, AddressSpace::Uniform | AddressSpace::Storage { .. } | AddressSpace::Handle)
    });
    let (used, unused): (Vec<_>, Vec<_>) =
        bound.map(|(handle, _)| handle).partition(|h| !info.get_entry_point(index)[*h].is_empty());
    let bindings = used.iter().map(|&handle| {
        let variable = &module.global_variables[handle];
        let uses = info.get_entry_point(index)[handle];
        Binding {
            name: variable.name.clone().unwrap_or_default(),
            resource: match variable.space {
                AddressSpace::Uniform => Resource::Uniform,
                AddressSpace::Handle => Resource::Image,
                _ => Resource::Buffer,
            },
            read: uses.intersects(GlobalUse::READ | GlobalUse::ATOMIC),
            written: uses.intersects(GlobalUse::WRITE | GlobalUse::ATOMIC),
            elementwise: matches!(module.types[variable.ty].inner, TypeInner::Array { base, .. } if !has_atomics(module, base))
                && !uses.intersects(GlobalUse::ATOMIC | GlobalUse::QUERY)
                && only_elements(module, handle),
            layout: layout_of(module, &layouter, variable.ty),
        }
    });
    let bindings: Vec<Binding> = bindings.collect();
    // Unused variables need a number too, to be valid; they come last and are never bound.
    for (number, handle) in used.into_iter().chain(unused).enumerate() {
        let binding = ResourceBinding { group: 0, binding: number as u32 };
        module.global_variables.get_mut(handle).binding = Some(binding);
    }
    Ok(bindings)
}

fn has_atomics(module: &Module, ty: Handle<Type>) -> bool {
    match &module.types[ty].inner {
        TypeInner::Atomic(_) => true,
        TypeInner::Struct { members, .. } => members.iter().any(|m| has_atomics(module, m.ty)),
        _ => false,
    }
}

fn layout_of(module: &Module, layouter: &Layouter, ty: Handle<Type>) -> Layout {
    let (element, stride) = match module.types[ty].inner {
        TypeInner::Array { base, stride, .. } => (base, stride as usize),
        _ => (ty, layouter[ty].size as usize),
    };
    if matches!(module.types[element].inner, TypeInner::Image { .. }) {
        return Layout::default(); // that of the array it stands for is filled in by `placed`
    }
    let names = match &module.types[element].inner {
        TypeInner::Struct { members, .. } => members.iter().map(|m| m.name.clone().unwrap_or_default()).collect(),
        _ => Vec::new(),
    };
    let mut lanes = Vec::new();
    flatten(module, element, 0, &mut lanes);
    Layout { stride, lanes, names }
}

fn flatten(module: &Module, ty: Handle<Type>, offset: usize, lanes: &mut Vec<Lane>) {
    let mut push = |scalar: naga::Scalar, offset| {
        let kind = match (scalar.kind, scalar.width) {
            (ScalarKind::Float, 4) => LaneKind::F32,
            (ScalarKind::Float, _) => LaneKind::F64,
            _ => LaneKind::U32,
        };
        lanes.push(Lane { offset, kind });
    };
    match &module.types[ty].inner {
        TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => push(*scalar, offset),
        TypeInner::Vector { size, scalar } => {
            (0..*size as usize).for_each(|k| push(*scalar, offset + k * usize::from(scalar.width)));
        }
        TypeInner::Struct { members, .. } => {
            members.iter().for_each(|m| flatten(module, m.ty, offset + m.offset as usize, lanes));
        }
        other => unreachable!("arrays of {other:?} are not used"),
    }
}

/// File and line of a line of the composed text.
fn locate(files: &[File<'_>], line: usize, message: String) -> Error {
    let mut line = line;
    for (file, text) in files {
        let lines = text.lines().count() + 1;
        if line <= lines {
            return Error::Shader { file: (*file).to_owned(), line, message };
        }
        line -= lines;
    }
    Error::Shader { file: "composed".to_owned(), line, message }
}
