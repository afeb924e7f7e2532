//! Scene files: what is refused and in which words, and what good scenes come down to.

use std::path::Path;

use glam::DVec3;
use packstone::Error;
use packstone::scene::{Assembly, Dashpot, Scene, Surface, TimeStep};

/// Two materials and a stop; tests append grains and more.
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

const ONE: &str = "[[grain]]\nposition = [0, 0, 1]\nradius = 0.1\nmaterial = \"glass\"\n";

fn sets(set: &[&str]) -> Vec<String> {
    set.iter().map(|set| set.to_string()).collect()
}

fn assemble_in(directory: &Path, text: &str, set: &[&str]) -> packstone::Result<Assembly> {
    Scene::parse(text, "heap.toml", directory, &sets(set))?.assemble()
}

fn assemble(text: &str, set: &[&str]) -> packstone::Result<Assembly> {
    assemble_in(Path::new("."), text, set)
}

fn good(text: &str) -> Assembly {
    assemble(text, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The message with which a scene is refused.
fn refusal(text: &str, set: &[&str]) -> String {
    match assemble(text, set) {
        Err(Error::Scene(message)) => message,
        Err(other) => panic!("not a scene error: {other}\n{text}"),
        Ok(_) => panic!("accepted, with {set:?}:\n{text}"),
    }
}

fn expect(text: &str, set: &[&str], fragments: &[&str]) {
    let message = refusal(text, set);
    assert!(!message.contains('\n'), "one sentence, but: {message}");
    for fragment in fragments {
        assert!(message.contains(fragment), "`{fragment}` is not in: {message}");
    }
}

#[derive(serde::Deserialize)]
struct Cases {
    case: Vec<Case>,
}

/// What is appended to `BASE` and `ONE`, and what the message must say.
#[derive(serde::Deserialize)]
struct Case {
    scene: String,
    says: Vec<String>,
}

#[test]
fn bad_scenes_are_refused_in_clear_words() {
    let cases: Cases = toml::from_str(include_str!("bad/scenes.toml")).unwrap();
    for Case { scene, says } in &cases.case {
        let says: Vec<&str> = says.iter().map(String::as_str).collect();
        expect(&format!("{BASE}{ONE}{scene}\n"), &[], &says);
    }
}

#[test]
fn scenes_without_their_essentials_are_refused() {
    expect(BASE, &[], &["no grains", "[[population]]"]);
    let scene = format!("{BASE}{ONE}");
    expect(&scene.replace("stop.steps = 10", ""), &[], &["stop", "time, steps, equilibrium"]);
    expect(&scene.replace("dimension = 3", ""), &[], &["heap.toml:", "missing key `dimension`"]);
    expect(&scene.replace("dimension = 3", "dimension = 4"), &[], &["dimension = 4", "2 or 3"]);
    expect(&scene.replace("dimension = 3", "dimension = 2"), &[], &["grain.0.position", "2 numbers"]);
    expect(&scene.replace("steps = 10", "steps = 0"), &[], &["stop.steps = 0", "at least 1"]);
    expect(&scene.replace("steps = 10", "steps = 1.5"), &[], &["heap.toml:3:", "whole number"]);
    let missing = Scene::load(Path::new("no/such/heap.toml"), &[]).unwrap_err();
    assert!(matches!(missing, Error::Io { .. }));
    assert!(missing.to_string().contains("no/such/heap.toml"));
}

#[test]
fn messages_stay_short_for_extreme_numbers() {
    for text in ["velocity = 1e300", "velocity = [1e300, 1e300]", "fixed = 1e300", "radius = -1e300"] {
        let scene = format!("{BASE}{}", ONE.replace("radius = 0.1\n", ""));
        let radius = if text.starts_with("radius") { "" } else { "radius = 0.1\n" };
        let message = refusal(&format!("{scene}{radius}{text}\n"), &[]);
        assert!(message.len() < 250 && message.contains("1e300"), "{message}");
    }
}

#[test]
fn folders_and_bytes_that_are_no_text_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let refusal_of = |path: &Path| match Scene::load(path, &[]) {
        Err(Error::Scene(message)) => message,
        other => panic!("{other:?}"),
    };
    let folder = refusal_of(directory.path());
    assert!(folder.starts_with(&directory.path().display().to_string()), "{folder}");
    assert!(folder.ends_with(": is a folder, not a scene file"), "{folder}");
    let file = directory.path().join("latin.toml");
    std::fs::write(&file, b"dimension = 3\ntitle = \"K\xf6rner\"\n").unwrap();
    assert!(refusal_of(&file).ends_with("latin.toml:2: is not UTF-8 text"));

    std::fs::write(directory.path().join("x.csv"), b"x,y,z,radius\n0,0,0,1\n# gr\xf6sser\n").unwrap();
    let scene = |file: &str| format!("{BASE}[[population]]\nmaterial = \"glass\"\nfile = \"{file}\"\n");
    let refusal = |file: &str| assemble_in(directory.path(), &scene(file), &[]).unwrap_err().to_string();
    assert!(refusal("x.csv").ends_with("x.csv:3: is not UTF-8 text"), "{}", refusal("x.csv"));
    assert!(refusal(".").ends_with("is a folder, not a grain table"), "{}", refusal("."));
}

#[test]
fn overrides_that_make_bad_material_names_are_blamed() {
    let set = ["seed=4", "material.\"a,b\"={density=1,normal_stiffness=1}"];
    expect(&format!("{BASE}{ONE}"), &set, &["(--set material.", "material.a,b: the name of a material"]);
}

/// Pinned, so that no update of a library changes what a seed means unnoticed.
#[test]
fn a_seed_gives_the_same_grains_in_every_build() {
    let scene = format!(
        "{BASE}[[population]]\nmaterial = \"glass\"\ncount = 2\nradius = {{ uniform = [0.1, 0.2] }}\nplacement = \"random\"\nvelocity_spread = 1\nregion = {{ lower = [0,0,0], upper = [1,1,1] }}\n"
    );
    let numbers = |grain: &packstone::scene::Grain| {
        format!("{:.12} {:.12} {:.12}", grain.radius, grain.position.x, grain.velocity.z)
    };
    let grains: Vec<String> = good(&scene).grains.iter().map(numbers).collect();
    assert_eq!(
        grains,
        ["0.140248566366 0.569475327046 -0.620370177655", "0.108038370893 0.793799604124 0.838869071942"]
    );
}

#[test]
fn overrides_are_applied_and_named_in_refusals() {
    let scene = format!("{BASE}{ONE}");
    let set = [
        "solver.dt=1e-6",
        "grain.0.radius = 2e-3",
        "grain.0.position.2=7",
        "material.glass.friction=0.25",
        "title=a heap",
        "output.formats=[\"csv\"]",
    ];
    let scene_set = Scene::parse(&scene, "heap.toml", Path::new("."), &sets(&set)).unwrap();
    assert_eq!(scene_set.name(), "a heap");
    let assembly = scene_set.assemble().unwrap();
    assert_eq!(assembly.solver.dt, TimeStep::Fixed(1e-6));
    assert_eq!(assembly.grains[0].radius, 2e-3);
    assert_eq!(assembly.grains[0].position, DVec3::new(0.0, 0.0, 7.0));
    assert_eq!(assembly.pairs[0].friction, 0.25);
    assert!(assembly.output.csv && !assembly.output.vtp);

    let cases: &[(&[&str], &[&str])] = &[
        (&["solver.dt"], &["--set solver.dt", "key=value"]),
        (&["grain.1.radius=1"], &["--set grain.1.radius=1", "no entry `1`", "it has 1"]),
        (&["grain.first.radius=1"], &["no entry `first`"]),
        (&["grain.0=1"], &["name a key in it"]),
        (&["dimension.x=1"], &["dimension is a value and has no key `x`"]),
        (&["seed=4", "solver.dtt=1"], &["(--set solver.dtt=1)", "unknown key `dtt`", "dt_fraction"]),
        (&["grain.0.radius=-1"], &["(--set grain.0.radius=-1)", "grain.0.radius = -1"]),
        (&["grain.0.radius=nan"], &["(--set grain.0.radius=nan)", "finite"]),
        (&["grain.0.radius=big"], &["(--set grain.0.radius=big)", "expected a number"]),
        (&["solver.dt=[1"], &["--set solver.dt=[1", "no TOML value"]),
        (&["stop={}"], &["(--set stop={})", "never ends"]),
    ];
    for (set, fragments) in cases {
        expect(&scene, set, fragments);
    }
    // The file's own fault stays the file's, with its own line.
    let broken = format!("{scene}colour = 1\n");
    expect(&broken, &["solver.damping=1"], &["heap.toml:18:1: unknown key `colour`"]);
}

#[test]
fn name_is_the_title_or_the_file_stem() {
    let scene = Scene::parse("dimension = 2", "a/heap.toml", Path::new("a"), &[]).unwrap();
    assert_eq!(scene.name(), "heap");
    let scene = Scene::parse("dimension = 2\ntitle = \"T\"", "heap.toml", Path::new(""), &[]);
    assert_eq!(scene.unwrap().name(), "T");
}

#[test]
fn materials_mix_by_the_stated_rule() {
    let assembly = good(&format!("{BASE}{ONE}"));
    assert_eq!(assembly.materials[1].name, "steel");
    let [glass, mixed, other, steel] = assembly.pairs.as_slice() else {
        panic!("two materials make four pairs");
    };
    assert_eq!(mixed, other);
    assert_eq!(glass.normal_stiffness, 1e5);
    assert_eq!(glass.tangential_stiffness, 2.0 / 7.0 * 1e5);
    assert_eq!(mixed.normal_stiffness, 1.5e5);
    assert_eq!(mixed.friction, 0.3);
    // Steel has no dashpot: it counts as restitution 1, and says so because all pairs need one kind.
    assert_eq!(glass.dashpot, Dashpot::Restitution(0.81));
    assert_eq!(mixed.dashpot, Dashpot::Restitution(0.9));
    assert_eq!(steel.dashpot, Dashpot::Restitution(1.0));

    let pair = "[[pair]]\nmaterials = [\"steel\", \"glass\"]\nfriction = 0.9\nrestitution = 0.2\n";
    let over = good(&format!("{BASE}{ONE}{pair}"));
    assert_eq!((over.pairs[1].friction, over.pairs[2].friction), (0.9, 0.9));
    assert_eq!(over.pairs[1].dashpot, Dashpot::Restitution(0.2));
    assert_eq!(over.pairs[1].normal_stiffness, 1.5e5);

    let damped = BASE.replace("restitution = 0.81", "normal_damping = 30");
    let damped = good(&format!("{damped}{ONE}"));
    let kinds: Vec<Dashpot> = damped.pairs.iter().map(|pair| pair.dashpot).collect();
    let expected = [30.0, 15.0, 15.0, 0.0].map(Dashpot::MassScaled);
    assert_eq!(kinds, expected);

    let elastic = BASE.replace("restitution = 0.81", "restitution = 1");
    let elastic = good(&format!("{elastic}{ONE}"));
    assert!(elastic.pairs.iter().all(|pair| pair.dashpot == Dashpot::None));
}

#[test]
fn boxes_become_planes_and_defaults_are_filled_in() {
    let wall = "[[wall]]\nkind = \"box\"\nname = \"bin\"\nmaterial = \"steel\"\nlower = [-1,-1,0]\nupper = [1,1,2]\nfaces = [\"z-\", \"x-\", \"x+\"]\n";
    let assembly = good(&format!("{BASE}{ONE}{wall}"));
    let names: Vec<&str> = assembly.walls.iter().map(|wall| wall.name.as_str()).collect();
    assert_eq!(names, ["bin x-", "bin x+", "bin z-"]);
    let normals: Vec<DVec3> = assembly
        .walls
        .iter()
        .map(|wall| match wall.surface {
            Surface::Plane { normal, .. } => normal,
            Surface::Cylinder { .. } => panic!("a box has no cylinder"),
        })
        .collect();
    assert_eq!(normals, [DVec3::X, DVec3::NEG_X, DVec3::Z]);
    assert!(assembly.walls.iter().all(|wall| wall.material == 1));
    assert_eq!(assembly.gravity, DVec3::new(0.0, 0.0, -9.81));
    assert_eq!(assembly.solver.dt, TimeStep::Auto { fraction: 0.15 });
    assert_eq!(assembly.solver.margin, 0.2);
    assert!(assembly.output.csv && assembly.output.vtp);
    assert_eq!(assembly.domain.upper, DVec3::INFINITY);
    assert_eq!(assembly.stop.steps, Some(10));
}

/// A lid that leaves the floor, and planes that face each other, are no doubles.
#[test]
fn walls_that_part_or_face_each_other_are_two() {
    let wall = |normal: &str, velocity: &str| {
        format!(
            "[[wall]]\nkind = \"plane\"\nmaterial = \"steel\"\npoint = [0,0,0]\nnormal = {normal}\nvelocity = {velocity}\n"
        )
    };
    let pairs = [("[0, 0, 1]", "[0, 0, -1]"), ("[0, 1e-6, 1]", "[0, 0, 0]")];
    for (normal, velocity) in pairs {
        let scene = format!("{BASE}{ONE}{}{}", wall("[0, 0, 1]", "[0, 0, 0]"), wall(normal, velocity));
        assert_eq!(good(&scene).walls.len(), 2);
    }
    let scene = format!(
        "{BASE}{}{}{}",
        ONE.replace("[0, 0, 1]", "[0, 0, 0]"),
        wall("[0, 0, 1]", "[0, 0, 0]"),
        wall("[0, 0, -1]", "[0, 0, 0]")
    );
    assert_eq!(assemble(&scene, &["solver.allow_overlap=true"]).unwrap().walls.len(), 2);
}

#[test]
fn two_dimensions_fill_z_with_zero() {
    let scene = BASE.replace("dimension = 3", "dimension = 2")
        + "[[grain]]\nposition = [1, 2]\nradius = 0.1\nmaterial = \"glass\"\nspin = 4\nvelocity = [5, 6]\n";
    let assembly = good(&scene);
    let grain = assembly.grains[0];
    assert_eq!(grain.position, DVec3::new(1.0, 2.0, 0.0));
    assert_eq!(grain.spin, DVec3::new(0.0, 0.0, 4.0));
    assert_eq!(grain.velocity, DVec3::new(5.0, 6.0, 0.0));
    assert_eq!(assembly.gravity, DVec3::new(0.0, -9.81, 0.0));
    expect(&scene.replace("spin = 4", "spin = [0, 0, 4]"), &[], &["grain.0.spin", "one number"]);
}

#[test]
fn overlaps_are_seen_across_periods_and_sizes() {
    let domain = "[domain]\nlower = [-1,-1,0]\nupper = [1,1,4]\nboundary = [\"periodic\",\"open\",\"open\"]\n";
    let grain = |x: f64, z: f64, radius: f64, more: &str| {
        format!("[[grain]]\nposition = [{x}, 0, {z}]\nradius = {radius}\nmaterial = \"glass\"\n{more}\n")
    };
    let scene = |a: &str, b: &str| format!("{BASE}{domain}{a}{b}");
    let left = grain(-0.95, 1.0, 0.1, "");
    expect(&scene(&left, &grain(0.95, 1.0, 0.1, "")), &[], &["grains 0 and 1 overlap by 0.1"]);
    good(&scene(&left, &grain(0.8, 1.0, 0.1, "")));
    // A hundred times smaller, just inside the surface of the large one.
    let large = grain(0.0, 1.0, 0.5, "");
    expect(&scene(&large, &grain(0.0, 1.5, 0.005, "")), &[], &["grains 0 and 1 overlap by 0.005"]);
    expect(&scene(&grain(0.0, 1.5, 0.005, ""), &large), &[], &["grains 0 and 1"]);
    good(&scene(&large, &grain(0.0, 1.505, 0.005, "")));
    // Two fixed grains may overlap, so may all if the scene says so.
    good(&scene(&grain(0.0, 1.0, 0.1, "fixed = true"), &grain(0.1, 1.0, 0.1, "fixed = true")));
    let close = scene(&grain(0.0, 1.0, 0.1, ""), &grain(0.1, 1.0, 0.1, ""));
    assert!(assemble(&close, &["solver.allow_overlap=true"]).is_ok());
    // The upper end of a period is its lower end.
    assert_eq!(good(&scene(&grain(1.0, 1.0, 0.1, ""), "")).grains[0].position.x, -1.0);
}

/// Slow and sure: every pair, by the nearest image.
fn deepest_overlap(assembly: &Assembly) -> f64 {
    let mut deepest = 0.0_f64;
    let length = assembly.domain.upper - assembly.domain.lower;
    for (i, a) in assembly.grains.iter().enumerate() {
        for b in &assembly.grains[..i] {
            let mut delta = a.position - b.position;
            for axis in 0..3 {
                if assembly.domain.periodic[axis] {
                    delta[axis] -= length[axis] * (delta[axis] / length[axis]).round();
                }
            }
            deepest = deepest.max(a.radius + b.radius - delta.length());
        }
    }
    deepest
}

const RANDOM: &str = r#"
[domain]
lower = [0, 0, 0]
upper = [1, 1, 1]
boundary = ["periodic", "open", "open"]
[[wall]]
kind = "plane"
material = "steel"
point = [0, 0.1, 0]
normal = [0, 1, 0]
[[grain]]
position = [0.5, 0.5, 0.5]
radius = 0.2
material = "steel"
[[population]]
material = "glass"
count = 300
radius = { log_normal = { mean = 0.03, std = 0.01 } }
placement = "random"
velocity = [1, 0, 0]
velocity_spread = 0.1
[[population]]
material = "glass"
count = 500
radius = { uniform = [0.005, 0.01] }
placement = "random"
"#;

#[test]
fn random_insertion_overlaps_nothing_and_repeats() {
    let scene = format!("{BASE}{RANDOM}");
    let assembly = good(&scene);
    assert_eq!(assembly.grains.len(), 801);
    assert!(deepest_overlap(&assembly) <= 1e-12);
    for grain in &assembly.grains {
        assert!(grain.position.y >= 0.1 + grain.radius - 1e-9);
        assert!(grain.position.z >= grain.radius && grain.position.z <= 1.0 - grain.radius);
    }
    // Along the periodic axis grains may reach through the faces.
    assert!(assembly.grains.iter().any(|grain| grain.position.x < grain.radius));
    let mean = assembly.grains[1..301].iter().map(|grain| grain.velocity.x).sum::<f64>() / 300.0;
    assert!((mean - 1.0).abs() < 0.03, "{mean}");

    assert_eq!(assembly.grains, good(&scene).grains);
    assert_ne!(assembly.grains, assemble(&scene, &["seed=2"]).unwrap().grains);
}

#[test]
fn lattice_fills_a_cylinder_from_the_bottom() {
    let scene = format!(
        "{BASE}{}",
        r#"
[[wall]]
kind = "cylinder"
material = "steel"
center = [0.5, 0]
radius = 0.2
[[wall]]
kind = "plane"
material = "steel"
point = [0, 0, -1]
normal = [0, 0, 2]
[[population]]
material = "glass"
count = 2000
radius = { normal = { mean = 0.01, std = 0.002 } }
gap = 0.1
"#
    );
    let assembly = good(&scene);
    assert!(deepest_overlap(&assembly) <= 1e-12);
    let mut top = -1.0_f64;
    for grain in &assembly.grains {
        let x = grain.position - DVec3::new(0.5, 0.0, 0.0);
        assert!(x.truncate().length() <= 0.2 - grain.radius + 1e-9);
        assert!(grain.position.z >= -1.0 + grain.radius);
        assert!((0.004..=0.016).contains(&grain.radius));
        top = top.max(grain.position.z);
    }
    // About 120 sites a layer of at most 0.0352 m.
    assert!(top < -0.2, "{top}");
    assert_eq!(assembly.grains, good(&scene).grains);
}

#[test]
fn second_lattice_goes_above_the_first() {
    let population = "[[population]]\nmaterial = \"glass\"\ncount = 30\nradius = 0.1\n";
    let region = "[[wall]]\nkind = \"box\"\nmaterial = \"steel\"\nlower = [0,0,0]\nupper = [1,1,1]\nfaces = [\"x-\",\"x+\",\"y-\",\"y+\",\"z-\"]\n";
    let assembly = good(&format!("{BASE}{region}{population}{population}"));
    assert_eq!(assembly.grains.len(), 60);
    assert!(deepest_overlap(&assembly) <= 1e-12);
}

#[test]
fn lattice_rises_against_gravity() {
    let scene = format!(
        "{BASE}[domain]\nlower = [0,0,0]\nupper = [1,1,1]\n[[population]]\nmaterial = \"glass\"\ncount = 16\nradius = 0.1\n"
    );
    let down = assemble(&scene, &["gravity=[3, 0, 0]"]).unwrap();
    assert!(down.grains.iter().all(|grain| grain.position.x > 0.7));
}

#[test]
fn csv_tables_are_read() {
    let directory = tempfile::tempdir().unwrap();
    let write = |text: &str| std::fs::write(directory.path().join("x.csv"), text).unwrap();
    let base = BASE.replace("dimension = 3", "dimension = 2");
    let scene = format!("{base}[[population]]\nmaterial = \"glass\"\nfile = \"x.csv\"\nscale = 0.5\n");
    let read = |set: &[&str]| assemble_in(directory.path(), &scene, set);

    write(
        "# a comment\nx, y, z, radius, wz, material\n0, 1, 0, 0.1, 3, steel\n# another\n1,2,0,0.2,0,\n\n5,5,0,1,0,glass\n",
    );
    let assembly = read(&[]).unwrap();
    assert_eq!(assembly.grains.len(), 3);
    assert_eq!(assembly.grains[0].position, DVec3::new(0.0, 0.5, 0.0));
    assert_eq!(assembly.grains[0].radius, 0.05);
    assert_eq!(assembly.grains[0].spin, DVec3::new(0.0, 0.0, 3.0));
    let materials: Vec<u32> = assembly.grains.iter().map(|grain| grain.material).collect();
    assert_eq!(materials, [1, 0, 0]);
    assert_eq!(read(&["population.0.count=2"]).unwrap().grains.len(), 2);

    let cases: &[(&str, &[&str])] = &[
        ("x,y,radius\n0,0,1\n# c\n0,zero,1\n", &["x.csv:4", "value 2 = \"zero\"", "finite"]),
        ("x,y,radius\n0,0,nan\n", &["x.csv:2", "value 3", "finite"]),
        ("x,y,radius\n0,0,-1\n", &["x.csv:2", "radius = -1", "positive"]),
        ("x,y,radius\n0,0\n", &["x.csv:2", "2 values", "3 columns"]),
        ("x,y,z,radius\n0,0,1,1\n", &["x.csv:2", "0 or missing in two dimensions"]),
        ("x,y\n0,0\n", &["x.csv:1", "lacks the column \"radius\""]),
        ("# c\nx,y,r\n0,0,1\n", &["x.csv:2", "unknown column \"r\"", "radius"]),
        ("x,y,x,radius\n", &["x.csv:1", "twice"]),
        ("x,y,radius\n", &["x.csv", "no rows"]),
        ("x,y,radius\n0,0,1e-200\n", &["x.csv:2: radius = 5e-201", "density 2500 kg/m³", "double precision"]),
        ("x,y,radius,material\n0,0,1,tin\n", &["x.csv:2", "\"tin\"", "glass, steel"]),
    ];
    for (text, fragments) in cases {
        write(text);
        let message = read(&[]).unwrap_err().to_string();
        for fragment in *fragments {
            assert!(message.contains(fragment), "`{fragment}` is not in: {message}");
        }
    }
    write("x,y,radius\n0,0,1\n");
    let message = read(&["population.0.count=2"]).unwrap_err().to_string();
    assert!(message.contains("has 1 rows") && message.contains("count = 2"), "{message}");
    let missing = read(&["population.0.file=no.csv"]).unwrap_err().to_string();
    assert!(missing.starts_with("heap.toml: ") && missing.contains("no.csv: No such file"), "{missing}");
}

#[test]
fn the_documented_example_works() {
    let page = include_str!("../docs/scene.md");
    let example = page.split("```").nth(1).unwrap().trim_start_matches("toml");
    let assembly = good(example);
    assert_eq!(assembly.grains.len(), 2000);
    assert_eq!(assembly.pairs[1].friction, 0.2);
}

/// Generous limits: they catch a quadratic slip, not a slow machine.
#[test]
fn large_scenes_are_placed() {
    let scene = format!(
        "{BASE}[domain]\nlower = [0,0,0]\nupper = [1,1,2]\n[[population]]\nmaterial = \"glass\"\ncount = 100_000\nradius = {{ uniform = [0.006, 0.008] }}\n"
    );
    let assembly = good(&scene);
    assert_eq!(assembly.grains.len(), 100_000);

    let directory = tempfile::tempdir().unwrap();
    let mut table = String::from("x,y,z,radius\n");
    for copy in 0..10 {
        for grain in &assembly.grains {
            let [x, y, z] = grain.position.to_array();
            table += &format!("{x},{y},{},{}\n", z + 2.0 * copy as f64, grain.radius);
        }
    }
    std::fs::write(directory.path().join("x.csv"), table).unwrap();
    let scene = format!("{BASE}[[population]]\nmaterial = \"glass\"\nfile = \"x.csv\"\n");
    let count = assemble_in(directory.path(), &scene, &[]).unwrap().grains.len();
    assert_eq!(count, 1_000_000);
}

/// Moduli of two materials mix by their compliances, rolling resistance by the weaker one and springs in series; a pair
/// replaces what it names and no more.
#[test]
fn elastic_and_rolling_parameters_mix() {
    let scene = |pair: &str| {
        let text = format!(
            "dimension = 3\nstop.steps = 10\n\
             [material.a]\ndensity = 1\nyoungs_modulus = 1e9\npoissons_ratio = 0.2\nrolling_friction = 0.3\nrolling_stiffness = 0.5\n\
             [material.b]\ndensity = 1\nyoungs_modulus = 3e9\npoissons_ratio = 0.4\nrolling_friction = 0.1\nrolling_damping = 0.4\n\
             {pair}{}",
            ONE.replace("glass", "a")
        );
        good(&text).pairs[1]
    };
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
    let mixed = scene("");
    let hertz = mixed.hertz.unwrap();
    near(1.0 / hertz.youngs_modulus, (1.0 - 0.04) / 1e9 + (1.0 - 0.16) / 3e9);
    near(1.0 / hertz.shear_modulus, 2.0 * 1.8 * 1.2 / 1e9 + 2.0 * 1.6 * 1.4 / 3e9);
    let rolling = mixed.rolling.unwrap();
    near(rolling.friction, 0.1);
    near(rolling.stiffness, 2.0 * 0.5 * 0.0225 / 0.5225);
    near(rolling.damping, 0.2);
    let named = scene("[[pair]]\nmaterials = [\"b\", \"a\"]\nrolling_friction = 0.2\n").rolling.unwrap();
    assert_eq!((named.friction, named.stiffness, named.damping), (0.2, rolling.stiffness, rolling.damping));
}

/// Counts whose bytes no number holds are refused like those that no machine holds.
#[cfg(target_os = "linux")] // where the system tells what it has
#[test]
fn more_grains_than_memory_are_refused_before_they_are_made() {
    for count in ["1_000_000_000_000", "9_000_000_000_000_000_000"] {
        let region = "{ lower = [0, 0, 0], upper = [1, 1, 1] }";
        let population = format!("material = \"glass\"\ncount = {count}\nradius = 1e-3\nregion = {region}");
        let scene = format!("{BASE}[[population]]\n{population}\n");
        let refusal =
            Scene::parse(&scene, "heap.toml", Path::new(""), &[]).unwrap().assemble().unwrap_err().to_string();
        assert!(refusal.contains("scene too large: it needs") && refusal.contains("are available"), "{refusal}");
    }
}

/// Walls in one place that part again, or face each other, are none that act twice.
#[test]
fn walls_in_one_plane_may_part_or_face_each_other() {
    let plane = |z: f64, up: i32, speed: f64| {
        format!(
            "[[wall]]\nkind = \"plane\"\nmaterial = \"glass\"\npoint = [0, 0, {z}]\nnormal = [0, 0, {up}]\nvelocity = [0, 0, {speed}]\n"
        )
    };
    let scene = |walls: [String; 2]| format!("{BASE}{ONE}{}", walls.concat());
    good(&scene([plane(0.0, 1, 0.0), plane(0.0, 1, 0.1)]));
    good(&scene([plane(0.0, 1, 0.0), plane(2.0, -1, 0.0)]));
    good(&scene([plane(0.0, 1, 0.0), plane(-1e-2, 1, 0.0)]));
    // A grain of 0.1 m that leans on the one feels the other, too.
    let floor =
        "[[wall]]\nkind = \"box\"\nname = \"bin\"\nmaterial = \"steel\"\nlower = [-1, -1, -5e-5]\nupper = [1, 1, 2]\n";
    expect(&scene([plane(0.0, 1, 0.0), floor.to_owned()]), &[], &["\"plane 0\" and \"bin z-\" have the same surface"]);
    expect(&scene([plane(2.0, 1, 0.0), plane(2.0, -1, 0.0)]), &[], &["beyond the wall"]);
}
