//! Hard cases for DEM (`packstone bench hard`). Each is a function that measures figures on one engine, with what
//! theory expects and how far rounding or the scheme's order lets it be off. `tests/hard` makes each a test on all
//! engines; [`print()`] makes of the same figures the table of `docs/hard-cases.md`.

mod agreement;
pub(super) mod clumps;
#[doc(hidden)] // for the tests
pub mod common;
mod contact;
mod fast;
mod figure;
mod gas;
mod places;
mod range;
mod rest;
mod rigid_columns;
mod rigid_crowds;
mod rigid_statics;
mod scenes;
mod sizes;
mod slow;
mod steps;
#[doc(hidden)] // for the tests
pub mod stiffness;

pub use figure::{Figure, Length};
pub use scenes::folder;

use crate::error::{Error, Result};
use common::Bench;
use std::io::Write;

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
    /// Those of the engines to measure on: f64 on the device repeats the CPU's figures, so long cases leave it out.
    pub fn benches(&self, engines: Vec<Bench>) -> Vec<Bench> {
        let long_ones = [
            "gas",
            "resting_pyramid",
            "collapsed",
            "size_ratio",
            "mass_ratio",
            "fast_grain",
            "slow_changes",
            "rigid_friction",
            "rigid_settling_2d",
            "rigid_settling_3d",
        ];
        let long = long_ones.contains(&self.name);
        // Passes are a matter of the algorithm, and packings of the method.
        let counts = ["rigid_passes", "dimer_bed"].contains(&self.name) || self.name.starts_with("agreement");
        let left_out = |bench: &Bench| (long && bench.name == "gpu double") || (counts && bench.name != "cpu");
        engines.into_iter().filter(|bench| !left_out(bench)).collect()
    }
}

/// Makes the list.
macro_rules! cases {
    ($($module:ident::$name:ident: $source:literal, [$($scene:literal),*];)*) => {
        pub const ALL: &[Case] = &[$(Case {
            name: stringify!($name),
            source: $source,
            scenes: &[$($scene),*],
            run: $module::$name,
        }),*];
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
    range::curved_walls: "k_N δ", [];
    range::oblique_planes: "k_N δ", [];
    range::carried_pair: "same as at rest", [];
    range::units: "the same bits", [];
    slow::slow_changes: "closed forms of what changes", [];
    rest::column: "N8: (N − i + 1) m g/k_N", ["column_100"];
    rest::resting_pyramid: "R5: stands; nothing grows", ["resting_pyramid"];
    gas::gas: "Σ m v", ["gas"];
    clumps::free_body: "A1, A3: nothing acts", [];
    clumps::dimer_bed: "Baule et al. 2013; sphere packings: P1", ["dimer_bed"];
    rigid_columns::rigid_column: "N8: Σ m g above", ["rigid_column"];
    rigid_columns::rigid_heavy_top: "Σ m g above", ["rigid_heavy_top"];
    rigid_columns::rigid_passes: "2b: modes of a chain", [];
    rigid_statics::rigid_wedge: "C2: N + T = m g/√2", ["rigid_wedge"];
    rigid_statics::rigid_arch: "R5, C5: statics", ["rigid_arch"];
    rigid_statics::rigid_incline: "R2: tan θ = c μ", ["rigid_incline"];
    rigid_statics::rigid_layer: "m g each", ["rigid_layer"];
    rigid_statics::rigid_squeezed: "told, and ends", ["rigid_squeezed"];
    rigid_crowds::rigid_overlap: "C3: opens at the speed allowed", ["rigid_overlap"];
    rigid_crowds::rigid_friction: "0 and 10", ["rigid_friction"];
    rigid_crowds::rigid_settling_2d: "comes to rest", ["rigid_settling_2d"];
    rigid_crowds::rigid_settling_3d: "comes to rest", ["rigid_settling_3d"];
    agreement::agreement_smooth: "DEM, μ = 0", [];
    agreement::agreement_rough: "DEM, μ = 0.5", ["agreement_bed"];
    agreement::agreement_collapse: "P12: DEM", ["agreement_collapse"];
}

/// The case of this name.
///
/// # Errors
/// [`Error::Scene`] if there is none.
pub fn named(name: &str) -> Result<&'static Case> {
    let all = || ALL.iter().map(|case| case.name).collect::<Vec<_>>().join(", ");
    let found = ALL.iter().find(|case| case.name == name);
    found.ok_or_else(|| Error::Scene(format!("there is no hard case `{name}`; there are {}", all())))
}

/// Writes the table of these cases, row by row, on every engine there is. The last column says what is out of its
/// limits.
///
/// # Errors
/// Those of the writer.
pub fn print<'a>(
    cases: impl IntoIterator<Item = &'a Case>,
    length: Length,
    out: &mut impl Write,
) -> std::io::Result<()> {
    writeln!(
        out,
        "| case | figure | expected | cpu f64 | gpu f32 | gpu f64 | |\n| --- | --- | --- | --- | --- | --- | --- |"
    )?;
    cases.into_iter().try_for_each(|case| rows(case, length, out))
}

fn rows(case: &Case, length: Length, out: &mut impl Write) -> std::io::Result<()> {
    let measured: Vec<(&str, Vec<Figure>)> =
        case.benches(common::engines()).into_iter().map(|bench| (bench.name, (case.run)(bench, length))).collect();
    for (row, figure) in measured[0].1.iter().enumerate() {
        let of = |name: &str| measured.iter().find(|(n, _)| *n == name).and_then(|(_, figures)| figures.get(row));
        let columns = ["cpu", "gpu single", "gpu double"].map(of);
        let cell =
            |f: Option<&Figure>| f.map_or(String::new(), |f| format!("{} (± {})", number(f.found), number(f.allowed)));
        let missed = columns.iter().flatten().filter(|f| !f.holds()).count();
        let head = match row {
            0 => format!("`{}`: {}", case.name, case.source),
            1 if !case.scenes.is_empty() => format!("{}.toml", case.scenes.join(".toml, ")),
            _ => String::new(),
        };
        writeln!(
            out,
            "| {head} | {} | {} | {} | {} | {} | {} |",
            figure.what,
            number(figure.expected),
            cell(columns[0]),
            cell(columns[1]),
            cell(columns[2]),
            if missed > 0 { "**missed**" } else { "" }
        )?;
    }
    Ok(())
}

/// Five digits, or two for an error.
fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if x.fract() == 0.0 && size < 1e7 {
        format!("{x}")
    } else if (1e-2..1e5).contains(&size) {
        let digits = (4 - size.log10().floor() as i32).max(0) as usize;
        format!("{x:.digits$}")
    } else {
        format!("{x:.1e}")
    }
}
