//! What builders are made of.

/// Setters of keys that hold a number or a truth value, one line each: documentation, key, type.
macro_rules! setters {
    ($($(#[$doc:meta])* $key:ident: $type:ty;)*) => {$(
        $(#[$doc])*
        #[must_use]
        pub fn $key(mut self, $key: $type) -> Self {
            self.0.$key = $key.into();
            self
        }
    )*};
}

pub(super) use setters;
