//! What builders refuse.

use crate::{BASE, BEAD, base, bead, file, glass, message, steel};
use packstone::{prelude::*, scene::Kind, solve};

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
