//! Scenes in code: the same scenes as files, refused in the same words; assemblies made by hand are checked as well.

use packstone::{
    prelude::*,
    scene::{Dashpot, Hertz, Kind, Method, Rolling, Surface, TimeStep},
    solve,
};

fn glass() -> MaterialBuilder {
    MaterialBuilder::new(2500.0).normal_stiffness(1e5).friction(0.3).restitution(0.81)
}

fn steel() -> MaterialBuilder {
    MaterialBuilder::new(7800.0).normal_stiffness(3e5).tangential_stiffness(1e5).friction(0.5)
}

/// Two materials and a stop.
fn base(dimension: usize) -> SceneBuilder {
    Scene::builder(dimension).material("glass", glass()).material("steel", steel()).stop_steps(10)
}

fn bead() -> GrainBuilder {
    GrainBuilder::new("glass", [0.0, 0.0, 1.0], 0.1)
}

/// `base` in a file.
const BASE: &str = r#"
dimension = 3
stop.steps = 10
[material.glass]
density = 2500
normal_stiffness = 1e5
friction = 0.3
restitution = 0.81
[material.steel]
density = 7800
normal_stiffness = 3e5
tangential_stiffness = 1e5
friction = 0.5
"#;

/// `bead` in a file.
const BEAD: &str = "[[grain]]\nposition = [0, 0, 1]\nradius = 0.1\nmaterial = \"glass\"\n";

/// A file that messages call `scene`, as they do a builder's.
fn file(text: &str) -> packstone::Result<Assembly> {
    Scene::parse(text, "scene", ".".as_ref(), &[])?.assemble()
}

fn message<T>(outcome: packstone::Result<T>) -> String {
    match outcome {
        Err(Error::Scene(message)) => message,
        Err(other) => panic!("not a scene error: {other}"),
        Ok(_) => panic!("accepted"),
    }
}

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

/// Each kind of bad value: the same sentence as in a file.
#[test]
fn bad_values_are_refused_in_the_words_of_files() {
    let one = || base(3).grain(bead());
    let with = |text: &str| format!("{BASE}{BEAD}{text}\n");
    let material = |key: &str, value: &str| with("").replace(&format!("{key} = "), &format!("{key} = {value} # "));
    let glass_with = |changed: MaterialBuilder| {
        Scene::builder(3).material("glass", changed).material("steel", steel()).stop_steps(10).grain(bead())
    };
    let wall = |text: &str| with(&format!("[[wall]]\nmaterial = \"glass\"\n{text}"));
    let population = |text: &str| with(&format!("[[population]]\nmaterial = \"glass\"\n{text}"));
    let many = |radius: Radii| PopulationBuilder::new("glass", 3, radius).region([0.0; 3], [9.0; 3]);
    let solver = |solver: SolverBuilder| base(3).grain(bead()).solver(solver);
    let dem = SolverBuilder::discrete_elements;
    let cd = SolverBuilder::contact_dynamics;
    let region = "region = { lower = [0, 0, 0], upper = [9, 9, 9] }";
    let cases = [
        (base(3), BASE.to_owned()),
        (Scene::builder(4).grain(bead()).stop_steps(1), "dimension = 4\nstop.steps = 1\n".to_owned() + BEAD),
        (base(2).grain(bead()), with("").replace("dimension = 3", "dimension = 2")),
        (one().gravity([0.0, f64::NAN, 0.0]), format!("gravity = [0, nan, 0]{}", with(""))),
        (one().gravity([0.0, 1.0]), format!("gravity = [0, 1]{}", with(""))),
        (one().stop_steps(0), with("").replace("steps = 10", "steps = 0")),
        (one().stop_time(-1.0), with("[stop]\ntime = -1").replace("stop.steps = 10", "")),
        (one().stop_equilibrium(0.0), with("[stop]\nequilibrium = 0").replace("stop.steps = 10", "")),
        (
            Scene::builder(3).material("glass", glass()).material("steel", steel()).grain(bead()),
            with("").replace("stop.steps = 10", ""),
        ),
        (one().output_history(0.0), with("[output]\nhistory = 0")),
        (one().output_snapshots(f64::INFINITY), with("[output]\nsnapshots = inf")),
        (
            one().domain([0.0; 3], [1.0, 1.0, f64::INFINITY], Face::Open),
            with("[domain]\nlower = [0, 0, 0]\nupper = [1, 1, inf]"),
        ),
        (one().domain([0.0; 3], [1.0, 0.0, 2.0], Face::Open), with("[domain]\nlower = [0, 0, 0]\nupper = [1, 0, 2]")),
        (
            one().domain([0.5; 3], [1.0, 1.0, 2.0], Face::Open),
            with("[domain]\nlower = [0.5, 0.5, 0.5]\nupper = [1, 1, 2]"),
        ),
        (
            one().domain([0.0; 3], [1.0; 3], [Face::Open; 2]),
            with("[domain]\nlower = [0, 0, 0]\nupper = [1, 1, 1]\nboundary = [\"open\", \"open\"]"),
        ),
        (
            one().domain([0.0; 3], [0.3, 1.0, 2.0], Face::Periodic),
            with("[domain]\nlower = [0, 0, 0]\nupper = [0.3, 1, 2]\nboundary = \"periodic\""),
        ),
        (glass_with(MaterialBuilder::new(-1.0).normal_stiffness(1e5)), material("density", "-1")),
        (glass_with(MaterialBuilder::new(f64::NAN).normal_stiffness(1e5)), material("density", "nan")),
        (glass_with(MaterialBuilder::new(2500.0)), with("").replace("normal_stiffness = 1e5", "")),
        (glass_with(glass().normal_stiffness(0.0)), with("").replace("normal_stiffness = 1e5", "normal_stiffness = 0")),
        (
            glass_with(glass().tangential_stiffness(-1.0)),
            with("").replace("friction = 0.3", "tangential_stiffness = -1"),
        ),
        (glass_with(glass().friction(f64::INFINITY)), with("").replace("friction = 0.3", "friction = inf")),
        (glass_with(glass().restitution(1.5)), with("").replace("restitution = 0.81", "restitution = 1.5")),
        (glass_with(glass().normal_damping(3.0)), with("").replace("friction = 0.3", "normal_damping = 3")),
        (one().material("a,b", glass()), with("[material.\"a,b\"]\ndensity = 2500\nnormal_stiffness = 1e5")),
        (one().pair(PairBuilder::new("glass", "tin")), with("[[pair]]\nmaterials = [\"glass\", \"tin\"]")),
        (
            one().pair(PairBuilder::new("glass", "steel").normal_stiffness(-1.0)),
            with("[[pair]]\nmaterials = [\"glass\", \"steel\"]\nnormal_stiffness = -1"),
        ),
        (
            one().wall(WallBuilder::plane("glass", [0.0; 3], [0.0; 3])),
            wall("kind = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 0, 0]"),
        ),
        (
            one().wall(WallBuilder::plane("tin", [0.0; 3], [0.0, 0.0, 1.0])),
            wall("kind = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]")
                .replace("[[wall]]\nmaterial = \"glass\"", "[[wall]]\nmaterial = \"tin\""),
        ),
        (
            one().wall(WallBuilder::plane("glass", [0.0, 0.0, 2.0], [0.0, 0.0, 1.0])),
            wall("kind = \"plane\"\npoint = [0, 0, 2]\nnormal = [0, 0, 1]"),
        ),
        (
            one().wall(WallBuilder::plane("glass", [0.0; 3], [0.0, 0.0, 1.0]).spin(1.0)),
            wall("kind = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nspin = 1"),
        ),
        (
            one().wall(WallBuilder::cylinder("glass", [0.0; 2], -1.0)),
            wall("kind = \"cylinder\"\ncenter = [0, 0]\nradius = -1"),
        ),
        (
            one().wall(WallBuilder::cylinder("glass", [0.0; 2], 1.0).velocity([f64::NAN; 3])),
            wall("kind = \"cylinder\"\ncenter = [0, 0]\nradius = 1\nvelocity = [nan, nan, nan]"),
        ),
        (
            one().wall(WallBuilder::box_between("glass", [0.0; 3], [1.0; 2])),
            wall("kind = \"box\"\nlower = [0, 0, 0]\nupper = [1, 1]"),
        ),
        (
            base(3).grain(GrainBuilder::new("glass", [0.0, 0.0, 1.0], -0.1)),
            with("").replace("radius = 0.1", "radius = -0.1"),
        ),
        (
            base(3).grain(GrainBuilder::new("glass", [0.0, 0.0, 1.0], f64::NAN)),
            with("").replace("radius = 0.1", "radius = nan"),
        ),
        (
            base(3).grain(GrainBuilder::new("glass", [0.0, 0.0, 1.0], 1e-200)),
            with("").replace("radius = 0.1", "radius = 1e-200"),
        ),
        (
            base(3).grain(GrainBuilder::new("tin", [0.0, 0.0, 1.0], 0.1)),
            with("").replace("material = \"glass\"", "material = \"tin\""),
        ),
        (base(3).grain(bead().spin(3.0)), with("spin = 3.0")),
        (base(3).grain(bead().velocity([1.0, 2.0])), with("velocity = [1, 2]")),
        (base(3).grain(bead().velocity([f64::NEG_INFINITY, 0.0, 0.0])), with("velocity = [-inf, 0, 0]")),
        (base(3).grain(bead().shape("bean")), with("shape = \"bean\"")),
        (base(3).grain(bead().orientation(Orientation::Angle(1.0))), with("orientation = 1")),
        (
            base(3).grain(bead().shape("dimer").orientation(Orientation::Random)),
            with("shape = \"dimer\"\norientation = \"random\""),
        ),
        (
            base(3).grain(
                bead().shape("dimer").orientation(Orientation::Quaternion(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0))),
            ),
            with("shape = \"dimer\"\norientation = { quaternion = [0, 0, 0, 0] }"),
        ),
        (one().grain(bead()), with(BEAD)),
        (one().shape(ShapeBuilder::of_kind("rod", Kind::Rod)), with("[[shape]]\nname = \"rod\"\nkind = \"rod\"")),
        (
            one().shape(ShapeBuilder::of_kind("r", Kind::Rod).distance(3.0)),
            with("[[shape]]\nname = \"r\"\nkind = \"rod\"\ndistance = 3"),
        ),
        (
            one().shape(ShapeBuilder::of_members("r", [([0.0; 3], -1.0)])),
            with("[[shape]]\nname = \"r\"\nmembers = [{ center = [0, 0, 0], radius = -1 }]"),
        ),
        (
            one().population(many(0.1.into()).gap(-1.0)),
            population(&format!("count = 3\nradius = 0.1\ngap = -1\n{region}")),
        ),
        (
            one().population(many(Radii::uniform(0.2, 0.1))),
            population(&format!("count = 3\nradius = {{ uniform = [0.2, 0.1] }}\n{region}")),
        ),
        (
            one().population(many(Radii::normal(0.2, f64::NAN))),
            population(&format!("count = 3\nradius = {{ normal = {{ mean = 0.2, std = nan }} }}\n{region}")),
        ),
        (
            one().population(many(Radii::truncated_log_normal(0.2, 0.1, 0.3, 0.2))),
            population(&format!(
                "count = 3\nradius = {{ log_normal = {{ mean = 0.2, std = 0.1, min = 0.3, max = 0.2 }} }}\n{region}"
            )),
        ),
        (
            one().population(many(Radii::list([]))),
            population(&format!("count = 3\nradius = {{ list = [] }}\n{region}")),
        ),
        (one().population(many(0.1.into()).count(0)), population(&format!("count = 0\nradius = 0.1\n{region}"))),
        (
            one().population(many(0.1.into()).scale(2.0)),
            population(&format!("count = 3\nradius = 0.1\nscale = 2\n{region}")),
        ),
        (
            one().population(many(0.1.into()).velocity_spread(-1.0)),
            population(&format!("count = 3\nradius = 0.1\nvelocity_spread = -1\n{region}")),
        ),
        (one().population(PopulationBuilder::new("glass", 3, 0.1)), population("count = 3\nradius = 0.1")),
        (
            one().population(many(0.1.into()).shapes([("dimer", -1.0)])),
            population(&format!("count = 3\nradius = 0.1\nshape = {{ dimer = -1 }}\n{region}")),
        ),
        (solver(dem().dt(-1.0)), with("[solver]\ndt = -1")),
        (solver(dem().dt(f64::NAN)), with("[solver]\ndt = nan")),
        (solver(dem().dt_fraction(2.0)), with("[solver]\ndt_fraction = 2")),
        (solver(dem().damping(-1.0)), with("[solver]\ndamping = -1")),
        (solver(dem().margin(20.0)), with("[solver]\nmargin = 20")),
        (solver(dem().tolerance(1e-3)), with("[solver]\ntolerance = 1e-3")),
        (solver(dem().relaxation(solve::Solver::Jacobi)), with("[solver]\nrelaxation = \"jacobi\"")),
        (solver(cd().tolerance(0.0)), with("[solver]\nmethod = \"cd\"\ntolerance = 0")),
        (solver(cd().max_iterations(0)), with("[solver]\nmethod = \"cd\"\nmax_iterations = 0")),
        (solver(cd().max_correction_velocity(-1.0)), with("[solver]\nmethod = \"cd\"\nmax_correction_velocity = -1")),
    ];
    for (scene, text) in cases {
        let found = message(scene.assemble());
        assert_eq!(found, message(file(&text)), "{text}");
        assert!(!found.contains('\n') && found.starts_with("scene: "), "{found}");
    }
}

/// What a builder can be given and a file cannot.
#[test]
fn what_no_file_can_hold_is_refused() {
    let twice = message(base(3).material("glass", glass()).grain(bead()).assemble());
    assert_eq!(twice, "scene: material.glass: duplicate key `glass`; a key may appear once in a table");
    let seed = message(base(3).seed(u64::MAX).grain(bead()).assemble());
    assert_eq!(seed, "scene: a whole number is above 9223372036854775807, the largest that a scene can hold");
}

/// A floor and three beads, as a user of the structure itself might have it.
fn by_hand() -> Assembly {
    let beads = (0..3).map(|k| GrainBuilder::new("glass", [0.25 * f64::from(k), 0.0, 0.1], 0.1));
    let floor = WallBuilder::plane("steel", [0.0; 3], [0.0, 0.0, 1.0]);
    base(3).wall(floor).grains(beads).assemble().unwrap()
}

fn start(assembly: Assembly) -> packstone::Result<Simulation> {
    Simulation::new(assembly, Options { engine: EngineChoice::Cpu, ..Options::default() })
}

/// A change, and what is said of it.
type Fault = (fn(&mut Assembly), &'static str);

fn refused(good: &Assembly, faults: &[Fault]) {
    good.validate().unwrap();
    for (change, words) in faults {
        let mut assembly = good.clone();
        change(&mut assembly);
        let found = message(assembly.validate());
        assert!(found.starts_with(&format!("assembly: {words}")), "{found}, not {words}");
        assert_eq!(message(start(assembly)), found);
    }
}

#[test]
fn assemblies_made_by_hand_are_checked() {
    refused(
        &by_hand(),
        &[
            (|a| a.dimension = 1, "dimension = 1: must be 2 or 3"),
            (|a| a.gravity.y = f64::NAN, "gravity.1 = NaN: must be a finite number"),
            (|a| a.grains[1].radius = f64::NAN, "grain.1.radius = NaN: must be a finite number"),
            (|a| a.grains[1].radius = -1.0, "grain.1.radius = -1: must be a positive number of m"),
            (|a| a.grains[1].radius = 1e-200, "grain.1.radius = 1e-200: with the density 2500 kg/m³ of \"glass\""),
            (|a| a.grains[2].position.x = f64::INFINITY, "grain.2.position.0 = inf: must be a finite number"),
            (|a| a.grains[2].velocity.y = f64::NAN, "grain.2.velocity.1 = NaN: must be a finite number"),
            (|a| a.grains[2].spin.z = f64::NAN, "grain.2.spin.2 = NaN: must be a finite number"),
            (|a| a.grains[0].material = 2, "grain.0.material = 2: is no material; there are 2"),
            (|a| a.grains.clear(), "grain: the scene has no grains"),
            (|a| a.grains[1].position.x = 0.1, "grain: grains 0 and 1 overlap by 0.1 m"),
            (
                |a| a.grains[1].position.z = 0.01,
                "wall: grain 1 at [0.25, 0, 0.01] overlaps the wall \"plane 0\" by 0.09 m",
            ),
            (|a| a.grains[1].position.z = -1.0, "wall: grain 1 at [0.25, 0, -1] is beyond the wall \"plane 0\" by 1 m"),
            (
                |a| a.domain.upper.x = 0.3,
                "domain: grain 2 at [0.5, 0, 0.1] is outside the domain: x must be from -inf to 0.3",
            ),
            (|a| a.domain.periodic[0] = true, "domain.lower.0 = -inf: must be a finite number"),
            (|a| a.domain.lower.x = f64::NAN, "domain.lower.0 = NaN: must be a finite number"),
            (
                |a| (a.domain.lower.y, a.domain.upper.y) = (1.0, -1.0),
                "domain.upper = [inf, -1, inf]: must be above lower",
            ),
            (
                |a| (a.domain.lower.x, a.domain.upper.x, a.domain.periodic[0]) = (-0.05, 0.3, true),
                "domain: the periodic axis x is 0.35 m long, must be at least 4 largest radii, 0.4 m",
            ),
            (
                |a| (a.domain.lower.z, a.domain.upper.z, a.domain.periodic[2]) = (-1.0, 1.0, true),
                "wall.0: a wall cannot stand across the periodic axis z",
            ),
            (|a| a.materials[0].density = 0.0, "material.0.density = 0: must be a positive number"),
            (|a| a.pairs.truncate(3), "pair: has 3 entries, must be 2² for 2 materials"),
            (|a| a.pairs[0].normal_stiffness = 0.0, "pair.0.normal_stiffness = 0: must be a positive number of N/m"),
            (|a| a.pairs[3].tangential_stiffness = -1.0, "pair.3.tangential_stiffness = -1: must be 0 or a positive"),
            (|a| a.pairs[0].friction = f64::NAN, "pair.0.friction = NaN: must be a finite number"),
            (
                |a| a.pairs[0].dashpot = Dashpot::Restitution(0.0),
                "pair.0.restitution = 0: must be above 0 and at most 1",
            ),
            (|a| a.pairs[1].friction = 0.9, "pair.1: differs from the pair"),
            (|a| a.pairs[0].dashpot = Dashpot::MassScaled(1.0), "pair: some have restitution and some normal_damping"),
            (
                |a| a.pairs[0].hertz = Some(Hertz::of_material(7e10, 0.2)),
                "pair: some are of elastic spheres (hertz) and some have linear springs",
            ),
            (
                |a| a.pairs.iter_mut().for_each(|p| p.hertz = Some(Hertz { youngs_modulus: 0.0, shear_modulus: 1.0 })),
                "pair.0.hertz.youngs_modulus = 0: must be a positive number of Pa",
            ),
            (
                |a| a.pairs[0].rolling = Some(Rolling { friction: f64::NAN, stiffness: 1.0, damping: 0.0 }),
                "pair.0.rolling_friction = NaN: must be a finite number",
            ),
            (
                |a| {
                    a.pairs
                        .iter_mut()
                        .for_each(|p| p.rolling = Some(Rolling { friction: 0.1, stiffness: 1.0, damping: 0.0 }));
                    a.solver.method = rigid_method();
                },
                "pair.0.rolling_friction = 0.1: rolling resistance needs method = \"dem\"",
            ),
            (|a| a.walls[0].material = 9, "wall.0.material = 9: is no material"),
            (|a| a.walls[0].velocity.x = f64::NAN, "wall.0.velocity.0 = NaN: must be a finite number"),
            (|a| a.walls[0].spin = 1.0, "wall.0.spin = 1: must be 0, because the wall is a plane"),
            (
                |a| a.walls[0].surface = Surface::Plane { point: DVec3::ZERO, normal: DVec3::new(0.0, 0.0, 2.0) },
                "wall.0.normal = [0, 0, 2]: must be a unit vector",
            ),
            (
                |a| a.walls[0].surface = Surface::Cylinder { center: DVec3::ZERO, radius: f64::NAN },
                "wall.0.radius = NaN: must be a finite number",
            ),
            (|a| a.solver.dt = TimeStep::Fixed(f64::NAN), "solver.dt = NaN: must be a finite number"),
            (|a| a.solver.damping = -1.0, "solver.damping = -1: must be 0 or a positive number of 1/s"),
            (|a| a.solver.margin = 0.0, "solver.margin = 0: must be from 0.001 to 10 mean radii"),
            (|a| a.stop.steps = Some(0), "stop.steps = 0: must be at least 1"),
            (|a| a.output.history = Some(-1.0), "output.history = -1: must be a positive number of s"),
        ],
    );
}

#[test]
fn clumps_and_disks_made_by_hand_are_checked() {
    let pair = || GrainBuilder::new("glass", [0.0; 3], 0.1).shape("dimer");
    let clumps = base(3).grain(pair()).grain(bead()).assemble().unwrap();
    refused(
        &clumps,
        &[
            (|a| a.clumps[1].shape = 7, "clump.1.shape = 7: is no shape; there are 2"),
            (|a| a.clumps[1].first = 1, "clump.1.first = 1: must be 2, with 1 members"),
            (|a| a.clumps[0].orientation = DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0), "clump.0.orientation"),
            (|a| a.clumps[0].radius = f64::NAN, "clump.0.radius = NaN: must be a finite number"),
            (|a| a.clumps[0].position.x = 0.01, "grain.0: is not what shape, place and size of clump 0 make of it"),
            (|a| a.grains[1].fixed = true, "grain.1: is not what shape, place and size of clump 0 make of it"),
            (|a| a.grains.push(a.grains[2]), "clump: have 3 members, must have all 4 grains"),
            (|a| a.shapes[0].members.clear(), "shape.0.members: must have at least one"),
            (|a| a.shapes[0].gyration.x = 0.0, "shape.0.gyration = [0, "),
        ],
    );
    let disks = base(2).grain(GrainBuilder::new("glass", [0.0, 1.0], 0.1)).assemble().unwrap();
    refused(
        &disks,
        &[
            (|a| a.grains[0].position.z = 1.0, "grain.0.position.2 = 1: must be 0 (dimension = 2)"),
            (|a| a.grains[0].spin.x = 1.0, "grain.0.spin: must be about z alone (dimension = 2)"),
            (|a| a.gravity.z = 1.0, "gravity.2 = 1: must be 0 (dimension = 2)"),
        ],
    );
}

fn rigid_method() -> Method {
    base(3).grain(bead()).solver(SolverBuilder::contact_dynamics()).assemble().unwrap().solver.method
}

/// What the scene allows is allowed, and the two ends of a period are one place.
#[test]
fn good_assemblies_made_by_hand_run() {
    let mut close = by_hand();
    close.grains[1].position.x = 0.1;
    close.solver.allow_overlap = true;
    start(close).unwrap();
    let mut rigid = by_hand();
    rigid.solver.method = rigid_method();
    rigid.pairs.iter_mut().for_each(|pair| pair.normal_stiffness = 0.0);
    assert!(matches!(rigid.solver.method, Method::ContactDynamics(_)));
    start(rigid).unwrap();
    let mut periodic = by_hand();
    (periodic.domain.lower.x, periodic.domain.upper.x, periodic.domain.periodic[0]) = (-0.5, 0.5, true);
    assert_eq!(start(periodic).unwrap().assembly().grains[2].position.x, -0.5);
}

#[test]
fn a_simulation_can_go_to_another_thread() {
    fn is_send<T: Send>() {}
    is_send::<Simulation>();
    let mut simulation = start(by_hand()).unwrap();
    let there = std::thread::spawn(move || simulation.advance(10).map(|()| simulation.step()));
    assert_eq!(there.join().unwrap().unwrap(), 10);
}

#[test]
fn columns_are_the_grains() {
    let mut assembly = by_hand();
    assembly.grains[1].velocity.x = 0.2;
    assembly.grains[2].spin.y = 3.0;
    (assembly.grains[0].fixed, assembly.grains[0].material) = (true, 1);
    let mut simulation = start(assembly).unwrap();
    simulation.advance(100).unwrap();
    let (grains, columns) = (simulation.grains().unwrap(), simulation.columns().unwrap());
    assert_eq!((columns.len(), columns.is_empty()), (3, false));
    for (k, grain) in grains.iter().enumerate() {
        let row = Grain {
            position: columns.position[k],
            velocity: columns.velocity[k],
            spin: columns.spin[k],
            radius: columns.radius[k],
            material: columns.material[k],
            fixed: columns.fixed[k],
        };
        assert_eq!(row, *grain);
    }
    assert!(columns.velocity[1].x > 0.0 && columns.fixed[0]);
}
