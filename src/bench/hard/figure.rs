//! What a case measures.

/// One measured number.
pub struct Figure {
    pub what: String,
    pub expected: f64,
    /// How far `found` may be from `expected`.
    pub allowed: f64,
    pub found: f64,
}

impl Figure {
    pub fn new(what: impl Into<String>, expected: f64, allowed: f64, found: f64) -> Figure {
        Figure { what: what.into(), expected, allowed, found }
    }

    /// An error, or anything else that ought to be 0.
    pub fn zero(what: impl Into<String>, allowed: f64, found: f64) -> Figure {
        Figure::new(what, 0.0, allowed, found)
    }

    /// NaN does not hold.
    pub fn holds(&self) -> bool {
        (self.found - self.expected).abs() <= self.allowed
    }
}

/// How long the long runs are: what the table states, or a twentieth of it, which a test can afford.
#[derive(Clone, Copy, PartialEq)]
pub enum Length {
    Full,
    Short,
}

impl Length {
    pub fn of(self, full: u64) -> u64 {
        if self == Length::Full { full } else { full / 20 }
    }
}

/// The larger one; NaN stays.
pub fn worse(a: f64, b: f64) -> f64 {
    if b <= a { a } else { b }
}
