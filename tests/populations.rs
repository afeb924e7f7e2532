//! Populations have the sizes that scenes ask for.

use packstone::{
    measure::{Percentiles, Sizes},
    scene::{Assembly, Scene},
};
use std::path::Path;

/// So many grains of these radii, and what is said of them.
fn population(dimension: usize, count: usize, radius: &str) -> Assembly {
    population_in(Path::new("."), dimension, count, radius)
}

fn population_in(directory: &Path, dimension: usize, count: usize, radius: &str) -> Assembly {
    let corner = |x: f64| format!("[{}]", vec![x.to_string(); dimension].join(", "));
    let text = format!(
        "dimension = {dimension}\nstop.steps = 1\n[material.m]\ndensity = 2500\nnormal_stiffness = 1e5\n[[population]]\n\
         material = \"m\"\ncount = {count}\nradius = {radius}\nregion = {{ lower = {}, upper = {} }}\n",
        corner(0.0),
        corner(1e4)
    );
    Scene::parse(&text, "sizes.toml", directory, &[]).unwrap().assemble().unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn radii(assembly: &Assembly) -> Vec<f64> {
    assembly.grains.iter().map(|grain| grain.radius).collect()
}

/// Mean and standard deviation of the radii, weighted by this power of them.
fn moments(radii: &[f64], power: i32) -> (f64, f64) {
    let total: f64 = radii.iter().map(|r| r.powi(power)).sum();
    let mean = radii.iter().map(|r| r.powi(power) * r).sum::<f64>() / total;
    (mean, (radii.iter().map(|r| r.powi(power) * (r - mean).powi(2)).sum::<f64>() / total).sqrt())
}

fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    println!("{what}: {found}, expected {expected}");
    assert!((found - expected).abs() <= tolerance, "{what}: {found}, expected {expected} to {tolerance}");
}

/// Four standard errors of 20,000 radii: of the mean 0.14; of the standard deviation, whose kurtosis is 41, 0.44; the
/// mean cube has a relative deviation of 22 per radius. Cut at 3 standard deviations, as it once was, they were 4.56,
/// 3.53 and 0.34 of the cube.
#[test]
fn a_log_normal_distribution_has_its_moments() {
    let assembly = population(3, 20_000, "{ log_normal = { mean = 5, std = 5 } }");
    assert!(assembly.notices.is_empty());
    let radii = radii(&assembly);
    let (mean, std) = moments(&radii, 0);
    near("mean", mean, 5.0, 0.14);
    near("std", std, 5.0, 0.44);
    let cube = radii.iter().map(|r| r.powi(3)).sum::<f64>() / 20_000.0;
    near("mean R³ over that asked", cube / (8.0 * 125.0), 1.0, 0.6);
}

/// Four standard errors, the kurtosis of cut distributions being below 4: mean 4 std/√n, std 4 std √(3/4n).
#[test]
fn moments_are_those_between_the_limits() {
    let n = 40_000_f64;
    for (law, mean, std, min, max) in [
        ("normal = { mean = 2, std = 0.3 }", 2.0, 0.3, 1.1, 2.9),
        ("normal = { mean = 2, std = 0.9 }", 2.0, 0.9, 0.2, 4.7),
        ("normal = { mean = 2, std = 0.5, min = 1.2, max = 4 }", 2.0, 0.5, 1.2, 4.0),
        ("log_normal = { mean = 5, std = 4, min = 1, max = 30 }", 5.0, 4.0, 1.0, 30.0),
        ("log_normal = { mean = 5, std = 2, max = 12 }", 5.0, 2.0, 0.0, 12.0),
        ("normal = { mean = 2, std = 0.3, min = 1e-200, max = 1e200 }", 2.0, 0.3, 0.0, 9.0),
        ("log_normal = { mean = 5, std = 2, min = 1e-200, max = 1e200 }", 5.0, 2.0, 0.0, 99.0),
    ] {
        let assembly = population(3, n as usize, &format!("{{ {law} }}"));
        assert!(assembly.notices.is_empty(), "{law}: {:?}", assembly.notices);
        let radii = radii(&assembly);
        assert!(radii.iter().all(|r| (min..=max).contains(r)), "{law}");
        let found = moments(&radii, 0);
        near(law, found.0, mean, 4.0 * std / n.sqrt());
        near(law, found.1, std, 4.0 * std * (0.75 / n).sqrt());
    }
}

/// No normal distribution in a window of 1 has a standard deviation above 1/√12, that of the uniform one. What is drawn
/// instead, and what is said of it: the distribution without limits cut there, uniform but for 2 %.
#[test]
fn moments_out_of_reach_are_told() {
    let assembly = population(3, 20_000, "{ normal = { mean = 2, std = 1, min = 1.5, max = 2.5 } }");
    let [notice] = &assembly.notices[..] else { panic!("{:?}", assembly.notices) };
    let (mean, std) = moments(&radii(&assembly), 0);
    near("std", std, 12.0_f64.sqrt().recip(), 0.01);
    for part in ["population.0.radius.normal", "between 1.5 and 2.5 m", "mean 2 ", "deviation 1;", "mean R^3 of 0.6"] {
        assert!(notice.contains(part), "no `{part}` in {notice}");
    }
    let told = |x: f64| format!("{:.4}", x);
    assert!(notice.contains(&told(mean)[..5]) && notice.contains(&told(std)[..5]), "{mean}, {std} in {notice}");
}

/// Weighted by volume; the weights of n radii amount to n/(1 + ν²) equal ones, ν being those weights' relative deviation,
/// below 2 here. Four standard errors, as above.
#[test]
fn distributions_by_volume_are_of_the_volume() {
    for dimension in [2, 3] {
        let (power, n) = (dimension as i32, 40_000_f64);
        let effective = n / 5.0;
        for (law, mean, std) in [
            ("uniform = [1, 2]", 1.5, 12.0_f64.sqrt().recip()),
            ("normal = { mean = 2, std = 0.3 }", 2.0, 0.3),
            ("normal = { mean = 2, std = 0.5, min = 1.2, max = 4 }", 2.0, 0.5),
            ("log_normal = { mean = 5, std = 1.5 }", 5.0, 1.5),
            ("sieve = { radius = [1, 2], passing = [0, 100] }", 1.5, 12.0_f64.sqrt().recip()),
        ] {
            let radii = radii(&population(dimension, n as usize, &format!("{{ {law}, by = \"volume\" }}")));
            let found = moments(&radii, power);
            near(law, found.0, mean, 4.0 * std / effective.sqrt());
            near(law, found.1, std, 4.0 * std * (0.75 / effective).sqrt());
        }
    }
}

/// 1,000 grains in 3 : 2 : 2: 428.57, 285.71, 285.71. By volume, radii 1 and 2 with equal shares: 8 : 1.
#[test]
fn shares_of_a_list_are_met_exactly() {
    let counts = |dimension: usize, count: usize, law: &str, list: &[f64]| -> Vec<usize> {
        let radii = radii(&population(dimension, count, law));
        list.iter().map(|wanted| radii.iter().filter(|r| *r == wanted).count()).collect()
    };
    let three = "{ list = [1, 2, 3], shares = [3, 2, 2] }";
    assert_eq!(counts(3, 1000, three, &[1.0, 2.0, 3.0]), [428, 286, 286]);
    assert_eq!(counts(3, 7, "{ list = [1, 2] }", &[1.0, 2.0]), [4, 3]);
    let halves = "{ list = [1, 2], shares = [1, 1], by = \"volume\" }";
    assert_eq!(counts(3, 900, halves, &[1.0, 2.0]), [800, 100]);
    assert_eq!(counts(2, 900, halves, &[1.0, 2.0]), [720, 180]);
    // In no order.
    let radii = radii(&population(3, 1000, three));
    assert!(radii[..500].contains(&3.0) && radii[500..].contains(&1.0));
    let rare = population(3, 10, "{ list = [1, 2], shares = [1000, 1] }");
    assert!(rare.notices[0].contains("no grain has the radius 2 m"), "{:?}", rare.notices);
}

/// And so are those of shapes.
#[test]
fn shares_of_shapes_are_met_exactly() {
    let text = "dimension = 3\nstop.steps = 1\n[material.m]\ndensity = 2500\nnormal_stiffness = 1e5\n[[population]]\n\
                material = \"m\"\ncount = 100\nradius = 1\nshape = { dimer = 2, rod = 1 }\n\
                region = { lower = [0, 0, 0], upper = [100, 100, 100] }\n";
    let assembly = Scene::parse(text, "shapes.toml", Path::new("."), &[]).unwrap().assemble().unwrap();
    let count = |name: &str| {
        let of_shape = |c: &&packstone::scene::Clump| assembly.shapes[c.shape as usize].name == name;
        assembly.clumps.iter().filter(of_shape).count()
    };
    assert_eq!([count("dimer"), count("rod")], [67, 33]);
    assert!(assembly.clumps[..50].iter().any(|c| c.shape != assembly.clumps[0].shape), "in no order");
}

/// What passes the radii of the curve, inline and from a file.
#[test]
fn sieve_curves_are_followed() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("curve.csv"), "# a sand\npassing,radius\n0,1\n25,2\n25,3\n100,4\n").unwrap();
    let inline = "{ sieve = { radius = [1, 2, 3, 4], passing = [0, 0.25, 0.25, 1] }, by = \"volume\" }";
    let from_file = "{ sieve = \"curve.csv\", by = \"volume\" }";
    let [inline, from_file] = [inline, from_file].map(|law| radii(&population_in(directory.path(), 3, 40_000, law)));
    assert!(inline.iter().zip(&from_file).all(|(a, b)| (a - b).abs() < 1e-12));
    let volume = |low: f64, high: f64| {
        let share = |r: &&f64| (low..high).contains(*r);
        inline.iter().filter(share).map(|r| r.powi(3)).sum::<f64>()
    };
    let all = volume(0.0, 9.0);
    near("passing 2", volume(0.0, 2.0) / all, 0.25, 0.01);
    assert_eq!(volume(2.001, 2.999), 0.0);
    near("passing 3.5", volume(0.0, 3.5) / all, 0.625, 0.01);

    std::fs::write(directory.path().join("bad.csv"), "radius,passing\n1,0\n2,x\n").unwrap();
    let text = "dimension = 3\nstop.steps = 1\n[material.m]\ndensity = 1\nnormal_stiffness = 1\n[[population]]\n\
                material = \"m\"\ncount = 1\nradius = { sieve = \"bad.csv\" }\n";
    let refused = Scene::parse(text, "sizes.toml", directory.path(), &[]).unwrap().assemble().unwrap_err().to_string();
    assert!(refused.contains("bad.csv:3: value 2 = \"x\""), "{refused}");
}

/// Eight grains of radius 1 and two of 2: 8 of the volume 24 are small.
#[test]
fn percentiles_are_of_diameters() {
    let assembly = population(3, 10, "{ list = [1, 2], shares = [8, 2] }");
    let sizes = Sizes::of(&assembly).unwrap();
    assert_eq!(sizes.by_number, Percentiles { d10: 2.0, d50: 2.0, d90: 4.0 });
    assert_eq!(sizes.by_volume, Percentiles { d10: 2.0, d50: 4.0, d90: 4.0 });
    let mut all_fixed = assembly;
    all_fixed.grains.iter_mut().for_each(|grain| grain.fixed = true);
    assert_eq!(Sizes::of(&all_fixed), None);
}
