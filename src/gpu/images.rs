//! Arrays as storage images, for software drivers: lavapipe loads from a buffer lane by lane in a loop, but from an
//! image with one gather, which takes a tenth of the time. The kernels know nothing of this. They are written for
//! buffers; what they do to an element of such an array becomes a call of `…_image_load` or `…_image_store`.
//!
//! Elements are loaded whole or member by member and stored whole; the index is not a constant. Anything else that is
//! done to an array in an image does not compose.
//!
//! Four floats are a texel; a smaller element is as many texels of one scalar, because only those can be both read and
//! written by a kernel. The bytes are those of the buffer, in rows of [`ROW`] texels.

use super::layout::{Binding, LaneKind, Layout};
use naga::{Block, Expression, Function, GlobalVariable, Handle, Module, Range, Span, Statement, Type, TypeInner};
use std::collections::HashMap;
use wgpu::TextureFormat;

/// Texels in a row.
pub const ROW: usize = 4096;

/// The format of an array as an image, if it can be one.
pub fn format(layout: &Layout) -> Option<TextureFormat> {
    let kind = layout.lanes.first()?.kind;
    match (kind, layout.stride) {
        _ if layout.lanes.iter().any(|lane| lane.kind != kind) => None,
        (LaneKind::F32, 16) => Some(TextureFormat::Rgba32Float),
        (LaneKind::U32, 16) => Some(TextureFormat::Rgba32Uint),
        (LaneKind::F32, 4 | 8 | 12) => Some(TextureFormat::R32Float),
        (LaneKind::U32, 4 | 8 | 12) => Some(TextureFormat::R32Uint),
        _ => None,
    }
}

/// Texels of an element.
pub fn texels(layout: &Layout) -> usize {
    if layout.stride == 16 { 1 } else { layout.stride / 4 }
}

/// Whether a kernel can do with an image what it does with this array.
pub fn possible(binding: &Binding) -> bool {
    let both = binding.read && binding.written;
    binding.elementwise
        && format(&binding.layout)
            .is_some_and(|f| !both || !matches!(f, TextureFormat::Rgba32Float | TextureFormat::Rgba32Uint))
}

fn access(binding: &Binding) -> &'static str {
    match (binding.read, binding.written) {
        (true, true) => "read_write",
        (true, false) => "read",
        _ => "write",
    }
}

/// The name of the image that takes the place of an array: kernels that do other things to the array have other images.
pub fn name(binding: &Binding) -> String {
    format!("{}_{}_image", binding.name, access(binding))
}

/// WGSL of the image that takes the place of an array, and of the functions that load and store an element.
pub fn declaration(module: &Module, binding: &Binding) -> String {
    let array = module.global_variables.iter().find(|(_, v)| v.name.as_ref() == Some(&binding.name));
    let TypeInner::Array { base, .. } = module.types[array.expect("bound").1.ty].inner else {
        unreachable!("`{}` is no array", binding.name);
    };
    let (name, ty, texels) = (name(binding), type_name(module, base), texels(&binding.layout));
    let (format, vector) = match format(&binding.layout) {
        Some(TextureFormat::Rgba32Float) => ("rgba32float", "vec4<f32>"),
        Some(TextureFormat::Rgba32Uint) => ("rgba32uint", "vec4<u32>"),
        Some(TextureFormat::R32Uint) => ("r32uint", "vec4<u32>"),
        _ => ("r32float", "vec4<f32>"),
    };
    let access = access(binding);
    let texel = |k| format!("vec2<u32>((i * {texels}u + {k}u) % {ROW}u, (i * {texels}u + {k}u) / {ROW}u)");
    let mut text = format!("var {name}: texture_storage_2d<{format}, {access}>;\n");
    // What the kernel does not do, functions that it does not call may still ask for.
    if !binding.read {
        text += &format!("fn {name}_load(i: u32) -> {ty} {{\nreturn {ty}();\n}}\n");
    } else {
        let loads: String = (0..texels).map(|k| format!("let t{k} = textureLoad({name}, {});\n", texel(k))).collect();
        let whole = built(module, base, 0, &|scalar| match texels {
            1 => format!("t0[{scalar}]"),
            _ => format!("t{scalar}[0]"),
        });
        text += &format!("fn {name}_load(i: u32) -> {ty} {{\n{loads}return {whole};\n}}\n");
    }
    if !binding.written {
        text += &format!("fn {name}_store(i: u32, v: {ty}) {{}}\n");
    } else {
        let mut scalars = vec!["0".to_owned(); binding.layout.stride / 4];
        take_apart(module, base, 0, "v", &mut scalars);
        let values = scalars.chunks(scalars.len() / texels).map(|of_texel| of_texel.join(", "));
        let stores =
            values.enumerate().map(|(k, value)| format!("textureStore({name}, {}, {vector}({value}));\n", texel(k)));
        text += &format!("fn {name}_store(i: u32, v: {ty}) {{\n{}}}\n", stores.collect::<String>());
    }
    text
}

fn type_name(module: &Module, ty: Handle<Type>) -> String {
    let ty = &module.types[ty];
    match (&ty.name, &ty.inner) {
        (Some(name), _) => name.clone(),
        (None, TypeInner::Vector { size, scalar }) => format!("vec{}<{}>", *size as u8, scalar_name(*scalar)),
        (None, TypeInner::Scalar(scalar)) => scalar_name(*scalar).to_owned(),
        (None, other) => unreachable!("{other:?} in an image"),
    }
}

fn scalar_name(scalar: naga::Scalar) -> &'static str {
    if scalar.kind == naga::ScalarKind::Float { "f32" } else { "u32" }
}

/// A value of this type, whose scalars from number `first` on are what `scalar` says.
fn built(module: &Module, ty: Handle<Type>, first: usize, scalar: &dyn Fn(usize) -> String) -> String {
    let parts: Vec<String> = match &module.types[ty].inner {
        TypeInner::Struct { members, .. } => {
            members.iter().map(|m| built(module, m.ty, first + m.offset as usize / 4, scalar)).collect()
        }
        TypeInner::Vector { size, .. } => (0..*size as usize).map(|k| scalar(first + k)).collect(),
        _ => return scalar(first),
    };
    format!("{}({})", type_name(module, ty), parts.join(", "))
}

/// The expressions of all scalars of a value.
fn take_apart(module: &Module, ty: Handle<Type>, first: usize, value: &str, scalars: &mut [String]) {
    match &module.types[ty].inner {
        TypeInner::Struct { members, .. } => members.iter().for_each(|m| {
            let name = m.name.as_deref().unwrap_or_default();
            take_apart(module, m.ty, first + m.offset as usize / 4, &format!("{value}.{name}"), scalars);
        }),
        TypeInner::Vector { size, .. } => {
            (0..*size as usize).for_each(|k| scalars[first + k] = format!("{value}[{k}]"))
        }
        _ => scalars[first] = value.to_owned(),
    }
}

/// Turn every access to these arrays into a call; the functions are those of [`declaration`].
pub fn redirect(module: &mut Module, arrays: &[Binding]) {
    let function = |name: String| {
        let found = module.functions.iter().find(|(_, f)| f.name.as_ref() == Some(&name));
        found.expect("declared with the image").0
    };
    let variables = module.global_variables.iter();
    let images = variables.filter_map(|(handle, v)| {
        let name = name(arrays.iter().find(|array| v.name.as_ref() == Some(&array.name))?);
        Some((handle, Image { load: function(format!("{name}_load")), store: function(format!("{name}_store")) }))
    });
    let images: HashMap<_, _> = images.collect();
    let functions = module.functions.iter_mut().map(|(_, f)| f);
    functions.chain(module.entry_points.iter_mut().map(|e| &mut e.function)).for_each(|f| redirect_in(f, &images));
}

#[derive(Clone, Copy)]
struct Image {
    load: Handle<Function>,
    store: Handle<Function>,
}

/// An element that a function points at.
#[derive(Clone, Copy)]
struct Element {
    image: Image,
    index: Handle<Expression>,
}

fn redirect_in(function: &mut Function, images: &HashMap<Handle<GlobalVariable>, Image>) {
    let mut elements: HashMap<Handle<Expression>, Element> = HashMap::new();
    // Calls to make where an expression is evaluated, and pointers that are not needed any more.
    let mut calls = HashMap::new();
    let mut members = HashMap::new();
    for (handle, expression) in function.expressions.iter() {
        match *expression {
            Expression::Access { base, index } => {
                let Expression::GlobalVariable(variable) = function.expressions[base] else { continue };
                let Some(&image) = images.get(&variable) else { continue };
                elements.insert(handle, Element { image, index });
            }
            Expression::AccessIndex { base, .. } if elements.contains_key(&base) || members.contains_key(&base) => {
                members.insert(handle, *members.get(&base).unwrap_or(&base));
            }
            Expression::Load { pointer } => {
                // A whole element is the result of the call; for a member, the pointer becomes the element's value.
                let whole = elements.contains_key(&pointer).then_some((handle, pointer));
                let of_member = members.get(&pointer).map(|&element| (element, element));
                if let Some((result, element)) = whole.or(of_member) {
                    calls.insert(result, elements[&element]);
                }
            }
            _ => {}
        }
    }
    for (&handle, element) in &calls {
        *function.expressions.get_mut(handle) = Expression::CallResult(element.image.load);
    }
    for pointer in elements.keys().filter(|pointer| !calls.contains_key(pointer)) {
        *function.expressions.get_mut(*pointer) = Expression::Literal(naga::Literal::U32(0));
    }
    let loads: Vec<_> = function.expressions.iter().map(|(handle, e)| (handle, e.clone())).collect();
    for (handle, expression) in loads {
        if let Expression::Load { pointer } = expression
            && members.contains_key(&pointer)
        {
            *function.expressions.get_mut(handle) = function.expressions[pointer].clone();
        }
    }
    let body = std::mem::take(&mut function.body);
    function.body = redirected(body, &elements, &calls);
}

fn redirected(
    block: Block,
    elements: &HashMap<Handle<Expression>, Element>,
    calls: &HashMap<Handle<Expression>, Element>,
) -> Block {
    let again = |block| redirected(block, elements, calls);
    let mut new = Block::new();
    for statement in block.iter().cloned() {
        let statement = match statement {
            Statement::Emit(range) => {
                emit(range, elements, calls, &mut new);
                continue;
            }
            Statement::Store { pointer, value } if elements.contains_key(&pointer) => {
                let Element { image, index } = elements[&pointer];
                Statement::Call { function: image.store, arguments: vec![index, value], result: None }
            }
            Statement::Block(block) => Statement::Block(again(block)),
            Statement::If { condition, accept, reject } => {
                Statement::If { condition, accept: again(accept), reject: again(reject) }
            }
            Statement::Switch { selector, cases } => {
                let cases = cases.into_iter().map(|case| naga::SwitchCase { body: again(case.body), ..case });
                Statement::Switch { selector, cases: cases.collect() }
            }
            Statement::Loop { body, continuing, break_if } => {
                Statement::Loop { body: again(body), continuing: again(continuing), break_if }
            }
            other => other,
        };
        new.push(statement, Span::UNDEFINED);
    }
    new
}

/// Evaluate a range of expressions, calls among them.
fn emit(
    range: Range<Expression>,
    elements: &HashMap<Handle<Expression>, Element>,
    calls: &HashMap<Handle<Expression>, Element>,
    block: &mut Block,
) {
    let mut run: Option<(Handle<Expression>, Handle<Expression>)> = None;
    let flush = |run: &mut Option<_>, block: &mut Block| {
        if let Some((first, last)) = run.take() {
            block.push(Statement::Emit(Range::new_from_bounds(first, last)), Span::UNDEFINED);
        }
    };
    for handle in range {
        if let Some(element) = calls.get(&handle) {
            flush(&mut run, block);
            let (function, arguments) = (element.image.load, vec![element.index]);
            block.push(Statement::Call { function, arguments, result: Some(handle) }, Span::UNDEFINED);
        } else if elements.contains_key(&handle) {
            flush(&mut run, block);
        } else {
            run = Some((run.map_or(handle, |(first, _)| first), handle));
        }
    }
    flush(&mut run, block);
}
