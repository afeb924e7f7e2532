//! What a builder gives is what a file gives.

use crate::{BASE, base, file};
use packstone::{prelude::*, scene::Kind, solve};

/// Debug output has every digit of every number.
fn assert_same(built: packstone::Result<Assembly>, text: &str) {
    let read = file(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let built = built.unwrap();
    assert_eq!(built, read);
    assert_eq!(format!("{built:?}"), format!("{read:?}"));
}

#[test]
fn a_builder_gives_what_the_file_gives() {
    let tube = WallBuilder::cylinder("steel", [0.5, 0.5], 0.5).name("tube").spin(2.0).velocity([0.0, 0.0, 0.1]);
    let bin = WallBuilder::box_between("glass", [0.0; 3], [1.0, 1.0, 9.0]).faces([Side::XLower, Side::ZLower]);
    let scene =
        base(3)
            .title("all of it")
            .gravity([0.0, 1.0, -9.0])
            .seed(7)
            .domain([-1.0; 3], [2.0, 2.0, 10.0], Face::Open)
            .pair(PairBuilder::new("steel", "glass").friction(0.9).restitution(0.2).tangential_stiffness(3e4))
            .wall(tube)
            .wall(bin)
            .wall(WallBuilder::plane("glass", [0.0, 0.0, -0.5], DVec3::new(0.0, 0.0, 2.0)))
            .shape(ShapeBuilder::of_members("pair", [([0.0, 0.0, 0.0], 1.0), ([1.5, 0.0, 0.0], 0.7)]))
            .shape(ShapeBuilder::of_kind("long", Kind::Rod).count(4).distance(1.2))
            .grain(
                GrainBuilder::new("glass", [0.3, 0.3, 1.0], 0.1)
                    .velocity([1.0, 2.0, 3.0])
                    .spin([0.1, 0.2, 0.3])
                    .fixed(true),
            )
            .grain(
                GrainBuilder::new("steel", DVec3::new(0.5, 0.5, 3.0), 0.05)
                    .shape("pair")
                    .orientation(Orientation::Euler { phi: 0.1, theta: 0.2, psi: 0.3 }),
            )
            .population(
                PopulationBuilder::new("glass", 20, Radii::truncated_normal(0.03, 0.01, 0.02, 0.04))
                    .placement(Placement::Random)
                    .shapes([("pair", 2.0), ("long", 1.0), ("sphere", 1.0)])
                    .orientation(Orientation::Quaternion(DQuat::from_xyzw(0.1, 0.2, 0.3, 0.9)))
                    .region([0.2, 0.2, 4.0], [0.8, 0.8, 6.0])
                    .velocity([0.0, 0.0, -1.0])
                    .velocity_spread(0.1),
            )
            .population(PopulationBuilder::new("steel", 5, Radii::uniform(0.02, 0.03)).gap(0.2).shape("dimer"))
            .solver(
                SolverBuilder::contact_dynamics()
                    .dt(1e-3)
                    .relaxation(solve::Solver::GaussSeidel)
                    .order(solve::Order::ShuffledOnce)
                    .tolerance(1e-6)
                    .max_iterations(50)
                    .max_correction_velocity(0.01)
                    .gyroscopic(true)
                    .margin(0.5),
            )
            .stop_time(2.0)
            .stop_equilibrium(1e-4)
            .output_history(0.1)
            .output_snapshots(0.2)
            .output_checkpoint(30.0)
            .output_works(true)
            .output_formats([Format::Csv]);
    let text = format!(
        r#"
title = "all of it"
gravity = [0, 1, -9]
seed = 7
stop.time = 2
stop.equilibrium = 1e-4
output = {{ history = 0.1, snapshots = 0.2, checkpoint = 30, works = true, formats = ["csv"] }}
{BASE}
[domain]
lower = [-1, -1, -1]
upper = [2, 2, 10]
[[pair]]
materials = ["steel", "glass"]
friction = 0.9
restitution = 0.2
tangential_stiffness = 3e4
[[wall]]
kind = "cylinder"
material = "steel"
name = "tube"
center = [0.5, 0.5]
radius = 0.5
spin = 2
velocity = [0, 0, 0.1]
[[wall]]
kind = "box"
material = "glass"
lower = [0, 0, 0]
upper = [1, 1, 9]
faces = ["x-", "z-"]
[[wall]]
kind = "plane"
material = "glass"
point = [0, 0, -0.5]
normal = [0, 0, 2]
[[shape]]
name = "pair"
members = [{{ center = [0, 0, 0], radius = 1 }}, {{ center = [1.5, 0, 0], radius = 0.7 }}]
[[shape]]
name = "long"
kind = "rod"
count = 4
distance = 1.2
[[grain]]
material = "glass"
position = [0.3, 0.3, 1]
radius = 0.1
velocity = [1, 2, 3]
spin = [0.1, 0.2, 0.3]
fixed = true
[[grain]]
material = "steel"
position = [0.5, 0.5, 3]
radius = 0.05
shape = "pair"
orientation = {{ euler = [0.1, 0.2, 0.3] }}
[[population]]
material = "glass"
count = 20
radius = {{ normal = {{ mean = 0.03, std = 0.01, min = 0.02, max = 0.04 }} }}
placement = "random"
shape = {{ pair = 2, long = 1, sphere = 1 }}
orientation = {{ quaternion = [0.9, 0.1, 0.2, 0.3] }}
region = {{ lower = [0.2, 0.2, 4], upper = [0.8, 0.8, 6] }}
velocity = [0, 0, -1]
velocity_spread = 0.1
[[population]]
material = "steel"
count = 5
radius = {{ uniform = [0.02, 0.03] }}
gap = 0.2
shape = "dimer"
[solver]
method = "cd"
dt = 1e-3
relaxation = "gauss-seidel"
order = "shuffled-once"
tolerance = 1e-6
max_iterations = 50
max_correction_velocity = 0.01
gyroscopic = true
margin = 0.5
"#
    );
    assert_eq!(scene.clone().build().unwrap().name(), "all of it");
    assert_same(scene.assemble(), &text);
}

#[test]
fn small_scenes_are_equal_to_the_last_digit() {
    let gas = base(3)
        .domain([0.0; 3], [1.0; 3], [Face::Periodic, Face::Open, Face::Periodic])
        .population(PopulationBuilder::new("glass", 50, Radii::log_normal(0.03, 0.01)).placement(Placement::Random))
        .population(PopulationBuilder::new("steel", 20, Radii::list([0.01, 0.02])).gap(0.1).velocity_spread(0.3))
        .population(PopulationBuilder::new("steel", 20, Radii::shares([(0.01, 2.0), (0.02, 1.0)]).by_volume()))
        .population(PopulationBuilder::new("steel", 20, Radii::sieve([(0.01, 0.0), (0.02, 1.0)])))
        .solver(SolverBuilder::discrete_elements().dt_fraction(0.1).damping(3.0));
    let text = format!(
        r#"{BASE}
[domain]
lower = [0, 0, 0]
upper = [1, 1, 1]
boundary = ["periodic", "open", "periodic"]
[[population]]
material = "glass"
count = 50
radius = {{ log_normal = {{ mean = 0.03, std = 0.01 }} }}
placement = "random"
[[population]]
material = "steel"
count = 20
radius = {{ list = [0.01, 0.02] }}
gap = 0.1
velocity_spread = 0.3
[[population]]
material = "steel"
count = 20
radius = {{ list = [0.01, 0.02], shares = [2, 1], by = "volume" }}
[[population]]
material = "steel"
count = 20
radius = {{ sieve = {{ radius = [0.01, 0.02], passing = [0, 1] }} }}
[solver]
dt_fraction = 0.1
damping = 3
"#
    );
    assert_same(gas.assemble(), &text);

    let disks = base(2)
        .grain(GrainBuilder::new("glass", [1.0, 2.0], 0.1).spin(4.0).velocity(DVec2::new(5.0, 6.0)))
        .grain(GrainBuilder::new("steel", [3.0, 2.0], 0.1).shape("dimer").orientation(Orientation::Angle(0.4)));
    let text = BASE.replace("dimension = 3", "dimension = 2")
        + r#"
[[grain]]
position = [1, 2]
radius = 0.1
material = "glass"
spin = 4
velocity = [5, 6]
[[grain]]
position = [3, 2]
radius = 0.1
material = "steel"
shape = "dimer"
orientation = 0.4
"#;
    assert_same(disks.assemble(), &text);

    let wedge = base(3)
        .wall(WallBuilder::box_between("glass", [0.0; 3], [1.0, 1.0, 9.0]).faces([Side::XLower, Side::ZLower]))
        .wall(WallBuilder::cylinder("steel", [0.5, 0.5], 0.7).name("tube").spin(2.0).velocity([0.0, 0.0, 0.1]))
        .shape(ShapeBuilder::of_members("pair", [([0.0, 0.0, 0.0], 1.0), ([1.5, 0.0, 0.0], 0.7)]))
        .grains((1..4).map(|k| GrainBuilder::new("glass", [0.5, 0.5, f64::from(k)], 0.1)))
        .population(
            PopulationBuilder::new("glass", 10, 0.05)
                .shapes([("pair", 2.0), ("sphere", 1.0)])
                .orientation(Orientation::Quaternion(DQuat::from_xyzw(0.1, 0.2, 0.3, 0.9)))
                .region([0.2, 0.2, 4.0], [0.8, 0.8, 6.0]),
        );
    let grain = |k: u32| format!("[[grain]]\nposition = [0.5, 0.5, {k}]\nradius = 0.1\nmaterial = \"glass\"\n");
    let text = format!(
        r#"{BASE}
[[wall]]
kind = "box"
material = "glass"
lower = [0, 0, 0]
upper = [1, 1, 9]
faces = ["x-", "z-"]
[[wall]]
kind = "cylinder"
material = "steel"
name = "tube"
center = [0.5, 0.5]
radius = 0.7
spin = 2
velocity = [0, 0, 0.1]
[[shape]]
name = "pair"
members = [{{ center = [0, 0, 0], radius = 1 }}, {{ center = [1.5, 0, 0], radius = 0.7 }}]
{}{}{}
[[population]]
material = "glass"
count = 10
radius = 0.05
shape = {{ pair = 2, sphere = 1 }}
orientation = {{ quaternion = [0.9, 0.1, 0.2, 0.3] }}
region = {{ lower = [0.2, 0.2, 4], upper = [0.8, 0.8, 6] }}
"#,
        grain(1),
        grain(2),
        grain(3)
    );
    assert_same(wedge.assemble(), &text);
}
