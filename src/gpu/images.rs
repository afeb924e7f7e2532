//! Arrays as storage images, for software drivers: lavapipe loads from a buffer lane by lane in a loop, but from an
//! image with one gather, which takes a tenth of the time.
//!
//! Four floats are a texel; a smaller element is as many texels of one scalar, because only those can be both read and
//! written by a kernel. The bytes are those of the buffer, in rows of [`ROW`] texels.

use super::{
    layout::{Binding, LaneKind, Layout},
    values::{built, scalars_of, type_name},
};
use naga::{Handle, Module, Type};
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

/// WGSL of the image that takes the place of an array of `base`, and of the functions that load and store an element.
pub fn declaration(module: &Module, binding: &Binding, base: Handle<Type>, name: &str) -> String {
    let (ty, texels) = (type_name(module, base), texels(&binding.layout));
    let (format, vector) = match format(&binding.layout) {
        Some(TextureFormat::Rgba32Float) => ("rgba32float", "vec4<f32>"),
        Some(TextureFormat::Rgba32Uint) => ("rgba32uint", "vec4<u32>"),
        Some(TextureFormat::R32Uint) => ("r32uint", "vec4<u32>"),
        _ => ("r32float", "vec4<f32>"),
    };
    let access = binding.access();
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
        let scalars = scalars_of(module, base, "v", binding.layout.stride / 4);
        let values = scalars.chunks(scalars.len() / texels).map(|of_texel| of_texel.join(", "));
        let stores =
            values.enumerate().map(|(k, value)| format!("textureStore({name}, {}, {vector}({value}));\n", texel(k)));
        text += &format!("fn {name}_store(i: u32, v: {ty}) {{\n{}}}\n", stores.collect::<String>());
    }
    text
}
