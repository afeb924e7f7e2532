//! Composer: whole WGSL files are concatenated (module scope does not care about order), parsed by naga, and the
//! variables that the entry point uses get binding numbers. Bindings are matched to arrays by name, and the layout of
//! every array is read from the module, so that no struct is described twice.

use super::{
    images,
    layout::{Binding, Lane, LaneKind, Layout},
};
use crate::error::{Error, Result};
use naga::{
    AddressSpace, Handle, Module, ResourceBinding, ScalarKind, Type, TypeInner,
    proc::Layouter,
    valid::{Capabilities, GlobalUse, ModuleInfo, ValidationFlags, Validator},
};

/// A kernel ready for a device.
pub struct Program {
    /// With binding numbers assigned.
    pub module: Module,
    /// Entry point.
    pub entry: String,
    /// What the entry point uses; the position is the binding number.
    pub bindings: Vec<Binding>,
}

/// Compose `files` (name, text) into the kernel `entry`, with images in place of the arrays for which `image` holds.
///
/// # Errors
/// [`Error::Shader`] with file and line if the text does not parse or validate.
pub fn compose(files: &[(&str, &str)], entry: &str, image: impl Fn(&Binding) -> bool) -> Result<Program> {
    let mut module = parse(files)?;
    let info = validated(&module, files)?;
    let bindings = number(&mut module, &info, entry)?;
    let images: Vec<_> = bindings.iter().filter(|b| image(b)).collect();
    if images.is_empty() {
        return Ok(Program { module, entry: entry.to_owned(), bindings });
    }
    let variable = |name: &str| module.global_variables.iter().find(|(_, v)| v.name.as_deref() == Some(name));
    let declared = images.iter().filter_map(|b| Some(images::declaration(&module, variable(&b.name)?.0, b)));
    let declared: String = declared.collect();
    let files: Vec<_> = [("images", declared.as_str())].into_iter().chain(files.iter().copied()).collect();
    let mut module = parse(&files)?;
    images::redirect(&mut module, &images.iter().map(|b| b.name.as_str()).collect::<Vec<_>>());
    let info = validated(&module, &files)?;
    let with_images = number(&mut module, &info, entry)?.into_iter().map(|binding| {
        let array = binding.name.strip_suffix("_image").and_then(|name| images.iter().find(|b| b.name == name));
        array.map_or(binding.clone(), |array| Binding { image: true, ..(*array).clone() })
    });
    let bindings: Vec<Binding> = with_images.collect();
    if let Some(left) = images.iter().find(|image| bindings.iter().any(|b| b.name == image.name && !b.image)) {
        let message =
            format!("`{}` is not only loaded and stored element by element, so it cannot be an image", left.name);
        return Err(Error::Shader { file: entry.to_owned(), line: 1, message });
    }
    Ok(Program { module, entry: entry.to_owned(), bindings })
}

fn joined(files: &[(&str, &str)]) -> String {
    files.iter().flat_map(|(_, text)| [*text, "\n"]).collect()
}

fn parse(files: &[(&str, &str)]) -> Result<Module> {
    let text = joined(files);
    naga::front::wgsl::parse_str(&text).map_err(|e| {
        let line = e.location(&text).map_or(1, |l| l.line_number as usize);
        locate(files, line, e.message().to_owned())
    })
}

/// Validated without bindings, which are known only after this pass has found what the entry point uses; the device
/// validates the numbered module again.
fn validated(module: &Module, files: &[(&str, &str)]) -> Result<ModuleInfo> {
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
            uniform: variable.space == AddressSpace::Uniform,
            image: variable.space == AddressSpace::Handle,
            read: uses.intersects(GlobalUse::READ | GlobalUse::ATOMIC),
            written: uses.intersects(GlobalUse::WRITE | GlobalUse::ATOMIC),
            elementwise: matches!(module.types[variable.ty].inner, TypeInner::Array { .. })
                && !uses.intersects(GlobalUse::ATOMIC | GlobalUse::QUERY),
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

fn layout_of(module: &Module, layouter: &Layouter, ty: Handle<Type>) -> Layout {
    let (element, stride) = match module.types[ty].inner {
        TypeInner::Array { base, stride, .. } => (base, stride as usize),
        _ => (ty, layouter[ty].size as usize),
    };
    if matches!(module.types[element].inner, TypeInner::Image { .. }) {
        return Layout::default(); // that of the array it stands for is filled in by `compose`
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
fn locate(files: &[(&str, &str)], line: usize, message: String) -> Error {
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
