//! Hard cases for DEM, those of `packstone bench hard`: each is a test on all engines, the long ones a twentieth as
//! long.

#[path = "../common/mod.rs"]
mod common;

use packstone::bench::hard;

/// Makes a test of every case, and a list of them.
macro_rules! cases {
    ($($name:ident)*) => {
        const TESTED: &[&str] = &[$(stringify!($name)),*];
        $(#[test]
        fn $name() {
            check(stringify!($name));
        })*
    };
}

cases! {
    confined_sphere
    close_packing
    random_packing
    stiff_contacts
    initial_overlap
    fast_spin
    grazing_impact
    size_ratio
    mass_ratio
    collapsed
    fast_grain
    far_from_origin
    wide_domain
    slow_creep
    curved_walls
    oblique_planes
    carried_pair
    units
    slow_changes
    column
    resting_pyramid
    gas
    free_body
    dimer_bed
    rigid_column
    rigid_heavy_top
    rigid_passes
    rigid_wedge
    rigid_arch
    rigid_incline
    rigid_layer
    rigid_squeezed
    rigid_overlap
    rigid_friction
    rigid_settling_2d
    rigid_settling_3d
    agreement_smooth
    agreement_rough
    agreement_collapse
}

fn check(name: &str) {
    let case = hard::named(name).unwrap();
    let mut bad = Vec::new();
    for bench in case.benches(common::engines()) {
        for f in (case.run)(bench, hard::Length::Short).iter().filter(|f| !f.holds()) {
            bad.push(format!(
                "{} {}: {:.6e}, expected {:.6e} within {:.1e}",
                bench.name, f.what, f.found, f.expected, f.allowed
            ));
        }
    }
    assert!(bad.is_empty(), "{name}: {}\n{}", case.source, bad.join("\n"));
}

#[test]
fn every_case_is_tested() {
    let all: Vec<&str> = hard::ALL.iter().map(|case| case.name).collect();
    assert_eq!(all, TESTED);
}

/// A scene that nobody runs proves nothing.
#[test]
fn every_hard_scene_is_a_case() {
    for entry in std::fs::read_dir(hard::folder()).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let used = hard::ALL.iter().any(|case| case.scenes.contains(&stem.as_str()));
        assert!(used, "{stem} belongs to no case");
    }
}
