//! Where the arrays of a model lie on a device. The kernels know nothing of it: they are written for an array per
//! buffer. What they do to the elements of an array that lies elsewhere becomes a call of `…_load` or `…_store`, and
//! here is the WGSL of these.

use super::{
    images,
    layout::{Binding, LaneKind, Pack, Resource},
    values::{built, scalars_of, type_name},
};
use naga::{Handle, Module, Type, TypeInner};
use std::{collections::BTreeMap, ops::Range};

/// Where an array lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Placement {
    /// In a storage buffer of its own.
    #[default]
    Buffer,
    /// In a storage image, see `gpu/images.rs`.
    Image,
    /// In several storage buffers, because it is longer than a kernel may see of one.
    Parts(Parts),
    /// With others in one storage buffer, because a kernel may see few of them.
    Packed,
}

/// An array in several buffers: all but the last have so many elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Parts {
    pub count: usize,
    pub len: usize,
}

impl Parts {
    /// Of an array in one buffer.
    pub const ONE: Parts = Parts { count: 1, len: usize::MAX };

    /// For so many elements, if they are too many for one buffer of at most `limit` bytes: powers of two, by which kernels
    /// divide fast.
    pub fn of(len: usize, stride: usize, limit: u64) -> Option<Parts> {
        let fits = usize::try_from(limit / stride as u64).unwrap_or(usize::MAX).max(1);
        let of_part = 1 << fits.ilog2();
        (len > fits).then(|| Parts { count: len.div_ceil(of_part), len: of_part })
    }

    /// Elements of a part of an array that has so many; never 0, since a device has no empty buffers.
    pub fn len(self, part: usize, all: usize) -> usize {
        all.saturating_sub(part * self.len).clamp(1, self.len)
    }

    /// The parts that these elements of the array are in, and which of each they are.
    pub fn of_range(self, elements: Range<usize>) -> impl Iterator<Item = (usize, Range<usize>)> {
        let parts = elements.start / self.len..elements.end.div_ceil(self.len);
        parts.map(move |part| {
            let begin = part * self.len;
            (part, elements.start.max(begin) - begin..(elements.end - begin).min(self.len))
        })
    }
}

impl Placement {
    pub fn name(self) -> &'static str {
        match self {
            Placement::Buffer => "buffer",
            Placement::Image => "image",
            Placement::Parts(_) => "parts",
            Placement::Packed => "packed",
        }
    }

    /// Whether a kernel can do what it does with this array where it lies.
    pub fn is_possible(self, binding: &Binding) -> bool {
        match self {
            Placement::Buffer => true,
            Placement::Image => images::possible(binding),
            Placement::Parts(_) => binding.elementwise,
            Placement::Packed => binding.elementwise && binding.layout.lanes.iter().all(|l| l.kind != LaneKind::F64),
        }
    }

    /// The functions that take the place of an array begin with this.
    pub(super) fn prefix(self, binding: &Binding) -> String {
        let Binding { name, .. } = binding;
        let access = binding.access();
        match self {
            Placement::Buffer => name.clone(),
            Placement::Image => format!("{name}_{access}_image"),
            Placement::Parts(parts) => format!("{name}_{access}_{}_parts", parts.count),
            Placement::Packed => format!("{name}_packed"),
        }
    }
}

/// The WGSL of the arrays that lie elsewhere, for kernels that are parsed together.
#[derive(Default)]
pub struct Declarations {
    texts: BTreeMap<String, String>,
    /// What the variables there are bound to.
    resources: BTreeMap<String, (Binding, Resource)>,
    /// The packed arrays.
    packed: Vec<String>,
}

impl Declarations {
    pub fn is_empty(&self) -> bool {
        self.texts.is_empty()
    }

    pub fn add(&mut self, module: &Module, binding: &Binding, placement: Placement) {
        let prefix = placement.prefix(binding);
        if placement == Placement::Buffer || self.texts.contains_key(&prefix) {
            return;
        }
        let array = module.global_variables.iter().find(|(_, v)| v.name.as_ref() == Some(&binding.name));
        let TypeInner::Array { base, .. } = module.types[array.expect("bound").1.ty].inner else {
            unreachable!("`{}` is no array", binding.name);
        };
        let text = match placement {
            Placement::Buffer => unreachable!("handled above"),
            Placement::Image => {
                self.resources.insert(prefix.clone(), (binding.clone(), Resource::Image));
                images::declaration(module, binding, base, &prefix)
            }
            Placement::Parts(parts) => {
                for part in 0..parts.count {
                    self.resources.insert(format!("{prefix}{part}"), (binding.clone(), Resource::Part(part)));
                }
                in_parts(module, binding, base, &prefix, parts)
            }
            Placement::Packed => {
                self.packed.push(binding.name.clone());
                packed(module, binding, base, &prefix, self.packed.len() - 1)
            }
        };
        self.texts.insert(prefix, text);
    }

    pub fn text(&self) -> String {
        let mut text: String = self.texts.values().map(String::as_str).collect();
        if !self.packed.is_empty() {
            for pack in Pack::ALL {
                text += &format!("var<storage, read_write> {}: array<{}>;\n", pack.name(), pack.element());
            }
            text += &format!("var<uniform> packed_at: array<vec4<u32>, {}>;\n", self.packed.len().div_ceil(4));
        }
        text
    }

    /// What the variables of a kernel are bound to.
    pub fn bound(&self, bindings: Vec<Binding>) -> Vec<Binding> {
        let resource = |binding: Binding| {
            if let Some((array, resource)) = self.resources.get(&binding.name) {
                return Binding { resource: resource.clone(), ..array.clone() };
            }
            let resource = match Pack::ALL.into_iter().find(|pack| pack.name() == binding.name) {
                Some(pack) => Resource::Pack(pack),
                None if binding.name == "packed_at" => Resource::PackedAt(self.packed.clone()),
                None => return binding,
            };
            Binding { resource, ..binding }
        };
        bindings.into_iter().map(resource).collect()
    }
}

/// The parts of an array, and the functions that choose one by the index.
fn in_parts(module: &Module, binding: &Binding, base: Handle<Type>, prefix: &str, parts: Parts) -> String {
    let ty = type_name(module, base);
    let access = if binding.written { "read_write" } else { "read" };
    let last = parts.count - 1;
    let choice = |act: &dyn Fn(usize) -> String| {
        let cases = (0..last).map(|part| format!("case {part}u: {{ {} }}\n", act(part)));
        let part = match parts.len.is_power_of_two() {
            true => format!("i >> {}u", parts.len.ilog2()),
            false => format!("i / {}u", parts.len),
        };
        format!("switch {part} {{\n{}default: {{ {} }}\n}}\n", cases.collect::<String>(), act(last))
    };
    let at = |part: usize| format!("{prefix}{part}[i - {}u]", part * parts.len);
    let mut text: String =
        (0..parts.count).map(|part| format!("var<storage, {access}> {prefix}{part}: array<{ty}>;\n")).collect();
    let load = choice(&|part| format!("return {};", at(part)));
    text += &format!("fn {prefix}_load(i: u32) -> {ty} {{\n{load}}}\n");
    // What the kernel does not do, functions that it does not call may still ask for.
    let store = if binding.written { choice(&|part| format!("{} = v;", at(part))) } else { String::new() };
    text + &format!("fn {prefix}_store(i: u32, v: {ty}) {{\n{store}}}\n")
}

/// The functions that find an array among the packed ones: `slot` is its number there.
fn packed(module: &Module, binding: &Binding, base: Handle<Type>, prefix: &str, slot: usize) -> String {
    let (ty, stride) = (type_name(module, base), binding.layout.stride);
    let pack = Pack::of(stride);
    let (name, elements) = (pack.name(), stride / pack.stride());
    let words = pack.stride() / 4;
    let begin = format!("let at = packed_at[{}u][{}u] + i * {elements}u;\n", slot / 4, slot % 4);
    let loads: String = (0..elements).map(|k| format!("let t{k} = {name}[at + {k}u];\n")).collect();
    let float = |offset: usize| binding.layout.lanes.iter().any(|l| l.offset == 4 * offset && l.kind == LaneKind::F32);
    let whole = built(module, base, 0, &|scalar| {
        let word = if words == 1 { format!("t{scalar}") } else { format!("t{}[{}]", scalar / 4, scalar % 4) };
        if float(scalar) { format!("bitcast<f32>({word})") } else { word }
    });
    let scalars: Vec<String> = scalars_of(module, base, "v", stride / 4)
        .into_iter()
        .enumerate()
        .map(|(k, scalar)| if float(k) { format!("bitcast<u32>({scalar})") } else { scalar })
        .collect();
    let values = scalars.chunks(words).map(|of_element| of_element.join(", "));
    let stores = values.enumerate().map(|(k, value)| format!("{name}[at + {k}u] = {}({value});\n", pack.element()));
    format!("fn {prefix}_load(i: u32) -> {ty} {{\n{begin}{loads}return {whole};\n}}\n")
        + &format!("fn {prefix}_store(i: u32, v: {ty}) {{\n{begin}{}}}\n", stores.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_hold_all_elements_and_no_buffer_is_too_long() {
        for (len, stride, limit) in [
            (1usize << 31, 12usize, (1u64 << 31) - 1),
            (1 << 32, 4, (1 << 31) - 1),
            (400_000_000, 16, 1 << 27),
            (9, 4, 8),
        ] {
            let parts = Parts::of(len, stride, limit).unwrap();
            let lens: Vec<usize> = (0..parts.count).map(|part| parts.len(part, len)).collect();
            assert_eq!(lens.iter().sum::<usize>(), len);
            assert!(lens.iter().all(|l| (l * stride) as u64 <= limit), "{lens:?}");
            assert!(lens[..parts.count - 1].iter().all(|l| *l == parts.len));
        }
        assert_eq!(Parts::of(100, 12, 1200), None);
        let parts = Parts { count: 4, len: 8 };
        let pieces = |range: Range<usize>| parts.of_range(range).collect::<Vec<_>>();
        assert_eq!(pieces(5..18), [(0, 5..8), (1, 0..8), (2, 0..2)]);
        assert_eq!(pieces(9..11), [(1, 1..3)]);
        assert_eq!(pieces(8..8), []);
    }
}
