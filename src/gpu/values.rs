//! Values of WGSL, put together of scalars and taken apart.

use naga::{Handle, Module, Type, TypeInner};

/// As WGSL names a type.
pub fn type_name(module: &Module, ty: Handle<Type>) -> String {
    let ty = &module.types[ty];
    match (&ty.name, &ty.inner) {
        (Some(name), _) => name.clone(),
        (None, TypeInner::Vector { size, scalar }) => format!("vec{}<{}>", *size as u8, scalar_name(*scalar)),
        (None, TypeInner::Scalar(scalar)) => scalar_name(*scalar).to_owned(),
        (None, other) => unreachable!("elements are no {other:?}"),
    }
}

fn scalar_name(scalar: naga::Scalar) -> &'static str {
    match (scalar.kind, scalar.width) {
        (naga::ScalarKind::Float, 8) => "f64",
        (naga::ScalarKind::Float, _) => "f32",
        _ => "u32",
    }
}

/// A value of this type, whose scalars from number `first` on are what `scalar` says.
pub fn built(module: &Module, ty: Handle<Type>, first: usize, scalar: &dyn Fn(usize) -> String) -> String {
    let parts: Vec<String> = match &module.types[ty].inner {
        TypeInner::Struct { members, .. } => {
            members.iter().map(|m| built(module, m.ty, first + m.offset as usize / 4, scalar)).collect()
        }
        TypeInner::Vector { size, .. } => (0..*size as usize).map(|k| scalar(first + k)).collect(),
        _ => return scalar(first),
    };
    format!("{}({})", type_name(module, ty), parts.join(", "))
}

/// The expressions of all scalars of a value of so many words; 0 is what there is between members.
pub fn scalars_of(module: &Module, ty: Handle<Type>, value: &str, words: usize) -> Vec<String> {
    let mut scalars = vec!["0".to_owned(); words];
    take_apart(module, ty, 0, value, &mut scalars);
    scalars
}

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
