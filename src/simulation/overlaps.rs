//! Overlaps that are too deep for grains.

use crate::measure::Other;

/// An overlap, in radii of the smaller grain, beyond which grains are not what their contact law was made for.
pub const DEEP_OVERLAP: f64 = 0.1;

/// The next overlap that is looked at is so many times as deep, so that grains that go on into each other do not end a
/// chunk with every step.
pub const DEEPER: f64 = 1.25;

/// The deepest overlap that a run has had, over the smaller radius, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct DeepOverlap {
    pub over_radius: f64,
    pub step: u64,
    /// The number of the grain, and what it overlaps; None if they have parted before anybody looked.
    pub pair: Option<(u32, Other)>,
}
