//! Values made of scalars, as arrays of the CPU and of a device hold them.

use crate::units::Quantity;
use glam::{DVec3, UVec3};

/// A value made of scalars ("lanes") in the order in which WGSL declares them.
pub trait Element: Clone + Default + Send + Sync + 'static {
    /// Member names of a record in `dims` dimensions, empty for a plain value.
    fn names(_dims: usize) -> &'static [&'static str] {
        &[]
    }
    /// Feed the lanes in `dims` dimensions.
    fn put(&self, dims: usize, sink: &mut impl FnMut(f64));
    /// Build from lanes.
    fn take(dims: usize, source: &mut impl FnMut() -> f64) -> Self;
    /// The lanes in `dims` dimensions.
    fn lanes(&self, dims: usize) -> Vec<f64> {
        let mut lanes = Vec::new();
        self.put(dims, &mut |x| lanes.push(x));
        lanes
    }
    /// How many they are.
    fn width(dims: usize) -> usize {
        Self::default().lanes(dims).len()
    }
    /// Number of lanes of each member of a record; anything else is one member.
    fn widths(dims: usize) -> Vec<usize> {
        vec![Self::width(dims)]
    }
    /// What the lanes measure; a plain value measures what it is said to, `of`.
    fn quantities(of: Quantity, dims: usize) -> Vec<Quantity> {
        vec![of; Self::width(dims)]
    }
    /// Whether this is a whole number.
    const INTEGER: bool = false;
}

impl Element for f64 {
    fn put(&self, _: usize, sink: &mut impl FnMut(f64)) {
        sink(*self);
    }
    fn take(_: usize, source: &mut impl FnMut() -> f64) -> f64 {
        source()
    }
}

macro_rules! whole {
    ($($type:ty),*) => {
        $(impl Element for $type {
            const INTEGER: bool = true;
            fn put(&self, _: usize, sink: &mut impl FnMut(f64)) {
                sink(*self as f64);
            }
            fn take(_: usize, source: &mut impl FnMut() -> f64) -> $type {
                source() as $type
            }
        })*
    };
}

whole!(u32, u64, usize);

impl Element for bool {
    const INTEGER: bool = true;
    fn put(&self, _: usize, sink: &mut impl FnMut(f64)) {
        sink(f64::from(u8::from(*self)));
    }
    fn take(_: usize, source: &mut impl FnMut() -> f64) -> bool {
        source() != 0.0
    }
}

impl Element for UVec3 {
    fn put(&self, _: usize, sink: &mut impl FnMut(f64)) {
        self.to_array().iter().for_each(|c| sink(f64::from(*c)));
    }
    fn take(_: usize, source: &mut impl FnMut() -> f64) -> UVec3 {
        UVec3::from_array(std::array::from_fn(|_| source() as u32))
    }
}

impl Element for DVec3 {
    fn put(&self, dims: usize, sink: &mut impl FnMut(f64)) {
        self.to_array()[..dims].iter().for_each(|c| sink(*c));
    }
    fn take(dims: usize, source: &mut impl FnMut() -> f64) -> DVec3 {
        let mut v = [0.0; 3];
        v[..dims].iter_mut().for_each(|c| *c = source());
        v.into()
    }
}

/// Declares the Rust side of a WGSL struct: same name, same members, same order, each with what it measures; without
/// that it is a number or a record.
macro_rules! record {
    (@quantity) => { $crate::units::Quantity::Number };
    (@quantity $quantity:ident) => { $crate::units::Quantity::$quantity };
    ($(#[$meta:meta])* $name:ident { $($(#[$fmeta:meta])* $field:ident: $ty:ty $([$quantity:ident])?),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name { $($(#[$fmeta])* pub $field: $ty),* }

        impl $crate::record::Element for $name {
            const INTEGER: bool = true $(&& <$ty as $crate::record::Element>::INTEGER)*;
            fn names(_: usize) -> &'static [&'static str] {
                &[$(stringify!($field)),*]
            }
            fn widths(dims: usize) -> Vec<usize> {
                vec![$(<$ty as $crate::record::Element>::width(dims)),*]
            }
            fn quantities(_: $crate::units::Quantity, dims: usize) -> Vec<$crate::units::Quantity> {
                [$(<$ty as $crate::record::Element>::quantities(record!(@quantity $($quantity)?), dims)),*].concat()
            }
            fn put(&self, dims: usize, sink: &mut impl FnMut(f64)) {
                $($crate::record::Element::put(&self.$field, dims, sink);)*
            }
            fn take(dims: usize, source: &mut impl FnMut() -> f64) -> Self {
                $name { $($field: $crate::record::Element::take(dims, source)),* }
            }
        }
    };
}
pub(crate) use record;
