//! The cases, and what they have in common.

mod contact;
mod fast;
mod gas;
mod places;
mod rest;
mod sizes;
mod steps;

use crate::common::{Bench, engines};
use packstone::scene::{Assembly, Scene};
use std::path::{Path, PathBuf};

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

/// A case: measures its figures on an engine.
pub struct Case {
    pub name: &'static str,
    /// Where the expected values are from: rows of the verification suite, or a formula.
    pub source: &'static str,
    /// Files of `examples/scenes/hard` without their ending.
    pub scenes: &'static [&'static str],
    pub run: fn(Bench, Length) -> Vec<Figure>,
}

impl Case {
    /// The engines to measure on: f64 on the device repeats the CPU's figures, so long cases leave it out.
    pub fn benches(&self) -> Vec<Bench> {
        let long_ones = ["gas", "resting_pyramid", "collapsed", "size_ratio", "mass_ratio", "fast_grain"];
        let long = long_ones.contains(&self.name);
        engines().into_iter().filter(|bench| !(long && bench.name == "gpu double")).collect()
    }
}

/// Makes the list, and a test of every entry.
macro_rules! cases {
    ($($module:ident::$name:ident: $source:literal, [$($scene:literal),*];)*) => {
        pub const ALL: &[Case] = &[$(Case {
            name: stringify!($name),
            source: $source,
            scenes: &[$($scene),*],
            run: $module::$name,
        }),*];
        $(#[test]
        fn $name() {
            check(stringify!($name));
        })*
    };
}

cases! {
    steps::confined_sphere: "S1", ["confined_sphere"];
    steps::close_packing: "2a, S2: FCC, k_T = k_N", [];
    steps::random_packing: "2a: random, k_T = 2/7 k_N", [];
    contact::stiff_contacts: "N8, N3: m g/k_N, v/ω", ["stiff_contacts"];
    contact::initial_overlap: "C12: ½ k_N δ² comes out", ["overlap"];
    contact::fast_spin: "CO6, CO7: gross slip", ["spin"];
    contact::grazing_impact: "energy of an elastic contact", ["corner"];
    sizes::size_ratio: "S5: brute force", ["size_ratio"];
    sizes::mass_ratio: "two-body impact", ["mass_ratio"];
    sizes::collapsed: "ends, or says why not", [];
    fast::fast_grain: "refused, or bounces", ["fast_grain"];
    places::far_from_origin: "C9: same as at the origin", ["far_from_origin"];
    places::wide_domain: "C9, C11: same as at the origin", ["wide_domain"];
    places::slow_creep: "v t", [];
    rest::column: "N8: (N − i + 1) m g/k_N", ["column_100"];
    rest::resting_pyramid: "R5: stands; nothing grows", ["resting_pyramid"];
    gas::gas: "Σ m v", ["gas"];
}

#[cfg(test)]
fn check(name: &str) {
    let case = ALL.iter().find(|case| case.name == name).expect("a case");
    let mut bad = Vec::new();
    for bench in case.benches() {
        for f in (case.run)(bench, Length::Short).iter().filter(|f| !f.holds()) {
            bad.push(format!(
                "{} {}: {:.6e}, expected {:.6e} within {:.1e}",
                bench.name, f.what, f.found, f.expected, f.allowed
            ));
        }
    }
    assert!(bad.is_empty(), "{name}: {}\n{}", case.source, bad.join("\n"));
}

pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/hard")
}

/// A scene of the folder.
fn scene(name: &str) -> Assembly {
    let path = folder().join(format!("{name}.toml"));
    Scene::load(&path, &[]).and_then(|scene| scene.assemble()).unwrap_or_else(|e| panic!("{e}"))
}

/// The larger one; NaN stays.
fn worse(a: f64, b: f64) -> f64 {
    if b <= a { a } else { b }
}
