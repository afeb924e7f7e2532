//! Grains from files: tables with whatever separates their values, data and dump files of LAMMPS, XYZ.

use glam::DVec3;
use packstone::{
    io::Export,
    measure::Packing,
    scene::{Assembly, Grain, Scene},
    simulation::{EngineChoice, Options, Simulation},
};
use std::{fs, path::Path};

const BASE: &str = r#"
dimension = 3
gravity = [0, 0, 0]
stop.steps = 10
[material.glass]
density = 2500
normal_stiffness = 1e5
[material.steel]
density = 7800
normal_stiffness = 3e5
"#;

/// A population of glass, unless `keys` say something else.
fn assemble_as(keys: &str, text: impl AsRef<[u8]>) -> packstone::Result<Assembly> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("bed"), text).unwrap();
    let scene = format!("{BASE}[[population]]\nfile = \"bed\"\n{keys}\n");
    Scene::parse(&scene, "heap.toml", folder.path(), &[])?.assemble()
}

const GLASS: &str = "material = \"glass\"";

fn good(keys: &str, text: &str) -> Assembly {
    assemble_as(keys, text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// What is said of a file, after its name.
fn refusal(keys: &str, text: impl AsRef<[u8]>) -> String {
    let message = assemble_as(keys, text).unwrap_err().to_string();
    message.split_once("/bed").expect("the name of the file").1.to_owned()
}

fn refuse(keys: &str, text: impl AsRef<[u8]>, parts: &[&str]) {
    let message = refusal(keys, text);
    assert!(!message.contains('\n') && message.len() < 400, "{message}");
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

/// Positions, radii and materials.
fn content(assembly: &Assembly) -> Vec<(DVec3, f64, &str)> {
    let name = |k: u32| assembly.materials[k as usize].name.as_str();
    assembly.grains.iter().map(|g| (g.position, g.radius, name(g.material))).collect()
}

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

#[test]
fn tables_have_the_separators_that_spreadsheets_write() {
    let table = "x,y,z,radius,material,vx\n1,2,3,0.5,steel,0\n4,5,6,0.25,,7\n";
    let wanted = good(GLASS, table);
    assert_eq!(content(&wanted), [(v(1.0, 2.0, 3.0), 0.5, "steel"), (v(4.0, 5.0, 6.0), 0.25, "glass")]);
    for separator in [";", "\t", " , ", " ;"] {
        assert_eq!(good(GLASS, &table.replace(',', separator)), wanted, "{separator:?}");
    }
    assert_eq!(good(GLASS, &format!("\u{feff}{}", table.replace('\n', "\r\n"))), wanted);
    let blanks = "  x y   z\tradius material vx \n 1 2 3 0.5 steel 0\n4 5 6 0.25  glass  7";
    assert_eq!(good("", blanks), wanted);
    let diameters = table.replace("radius", "diameter").replace("0.5", "1").replace("0.25", "0.5");
    assert_eq!(good(GLASS, &diameters), wanted);
    let one_radius = good("material = \"glass\"\nradius = 0.25\nscale = 2", "x;y;z\n1;2;3\n");
    assert_eq!(content(&one_radius), [(v(2.0, 4.0, 6.0), 0.25, "glass")]);
}

#[test]
fn tables_that_cannot_be_read_say_what_to_do() {
    let cases: &[(&str, &[&str])] = &[
        ("x;y;z;radius\n0,5;1;1;1\n", &[":2: value 1 = \"0,5\"", "with a point and no comma"]),
        ("x,y,z,radius\n0,5,1,1,1,0,5\n", &[":2: has 7 values", "4 columns", "write 0.5, not 0,5"]),
        ("x,y,z,radius,diameter\n1,1,1,1,1\n", &[":1: has columns for both"]),
        ("x,y,z\n1,1,1\n", &[":1: lacks the column \"radius\"", "the key `radius`"]),
        ("root:x:0:0:root:/root:/bin/bash\n", &[":1: is no header of a grain table", "LAMMPS", "XYZ"]),
        ("<?xml version=\"1.0\"?>\n<VTKFile>\n", &[":1: is no header of a grain table"]),
        ("x,y,z,radius\n1,1,1,\u{1b}[31m\n", &[":2: value 4 = \"\\u{1b}[31m\""]),
    ];
    for (text, parts) in cases {
        refuse(GLASS, text, parts);
    }
    let message = refusal(GLASS, "root:x:0:0:root:/root:/bin/bash\n");
    assert!(!message.contains("bash"), "{message}");
    refuse(GLASS, format!("x,y,z,radius\n1,1,1,{}\n", "9".repeat(400)), &["99\" ...: must be a finite number"]);
    refuse(GLASS, b"\xff\xfex\0,\0", &[": is UTF-16 text; save it as UTF-8"]);
    refuse(GLASS, b"\x1f\x8b\x08", &[": is compressed; unpack it first"]);
    refuse("material = \"glass\"\nradius = 1", "x,y,z,radius\n1,1,1,1\n", &["must not have the key `radius`"]);
}

const DATA: &str = "LAMMPS data file via write_data, version 29 Aug 2024, timestep = 7, units = si

3 atoms
2 atom types

0 4 xlo xhi
0 5 ylo yhi
-1 6 zlo zhi

Masses

1 1
2 1

Atoms  # sphere

3 1 0.5 2500 1 1 3 0 0 0 # the last one
1 1 1.0 2500 1 1 1 0 0 1
2 2 0.5 2500 4.5 3 1 1 0 0

Velocities

2 1 2 3 4 5 6
3 0 0 0 0 0 0
1 0 0 9 0 0 0
";

#[test]
fn lammps_data_is_read() {
    let types = "material = { 1 = \"glass\", 2 = \"steel\" }\nscale = 0.1";
    let bed = good(types, DATA);
    let wanted =
        [(v(1.0, 1.0, 1.0), 0.5, "glass"), (v(4.5, 3.0, 1.0), 0.25, "steel"), (v(1.0, 1.0, 3.0), 0.25, "glass")];
    assert_eq!(content(&bed), wanted.map(|(x, r, name)| (x * 0.1, r * 0.1, name)));
    assert_eq!((bed.grains[1].velocity, bed.grains[1].spin), (v(1.0, 2.0, 3.0), v(4.0, 5.0, 6.0)));
    assert_eq!(bed.grains[0].velocity, v(0.0, 0.0, 9.0));
    // No domain is another than this box, too.
    assert_eq!(bed.notices.len(), 1);
    assert!(
        bed.notices[0].ends_with(
            "bed: its box, from [0, 0, -0.1] to [0.4, 0.5, 0.6] m, is not the domain of the scene along x, y, z"
        ),
        "{:?}",
        bed.notices
    );
    let first = good(&format!("{types}\ncount = 1"), DATA);
    assert_eq!(first.grains[..], bed.grains[..1]);

    let periodic = "[domain]\nlower = [0, 0, -1]\nupper = [4, 5, 6]\nboundary = [\"periodic\", \"open\", \"open\"]";
    let folded = good(&format!("{GLASS}\n{periodic}"), DATA);
    assert_eq!(folded.grains[1].position, v(0.5, 3.0, 1.0));
    assert!(folded.notices.is_empty(), "{:?}", folded.notices);

    let in_lj = good(GLASS, &DATA.replace("units = si", "units = lj"));
    assert!(in_lj.notices[0].contains("its units are \"lj\", and its numbers are taken for SI"), "{:?}", in_lj.notices);
    let unnamed = good(GLASS, &DATA.replace("  # sphere", ""));
    assert_eq!(unnamed.grains[1].radius, 0.25);
    assert!(
        unnamed.notices[0].ends_with("line 15: Atoms names no style, and is taken for `Atoms # sphere`"),
        "{:?}",
        unnamed.notices
    );
}

#[test]
fn lammps_data_of_points_takes_a_radius() {
    for (style, columns) in
        [("atomic", "1 2"), ("charge", "1 2 -0.5"), ("molecular", "1 9 2"), ("full", "1 9 2 -0.5"), ("bond", "1 9 2")]
    {
        let text = format!("points\n1 atoms\n\nAtoms # {style}\n\n{columns} 1 2 3\n");
        let bed = good("material = { 2 = \"steel\" }\nradius = 0.5", &text);
        assert_eq!(content(&bed), [(v(1.0, 2.0, 3.0), 0.5, "steel")], "{style}");
        refuse("material = { 2 = \"steel\" }", &text, &[":4: lacks the column \"radius\"", "key `radius`"]);
    }
    let bpm = good(GLASS, "beam\n1 atoms\nAtoms # bpm/sphere\n\n1 9 2 0.5 2500 1 2 3\n");
    assert_eq!(content(&bpm), [(v(1.0, 2.0, 3.0), 0.25, "glass")]);
}

#[test]
fn lammps_data_that_makes_no_sense_is_refused() {
    let cases: &[(&str, &str, &[&str])] = &[
        ("3 atoms", "4 atoms", &[":15: the header announces 4 atoms, and 3 follow", "cut off"]),
        ("3 atoms", "18446744073709551615 atoms", &["and 3 follow"]),
        ("# sphere", "# ellipsoid", &[":15: Atoms has the style \"ellipsoid\"; write `Atoms # sphere`"]),
        ("# sphere", "# atomic", &[":15: atoms of the style atomic have 5 values, or 8"]),
        ("2 2 0.5", "3 2 0.5", &[":19: the id 3 is that of line 17, too"]),
        ("2 1 2 3 4", "7 1 2 3 4", &[":21: Velocities must have the ids of Atoms"]),
        ("4.5 3 1", "nan 3 1", &[":19: value 5 = \"nan\""]),
        ("2 2 0.5", "2 2 -1", &[":19: radius = -0.5: must be a positive number"]),
        ("2 2 0.5", "2.5 2 0.5", &[":19: \"2.5\": must be a whole number"]),
        (
            "Masses",
            "0.1 0 0 xy xz yz\n\nMasses",
            &[": its box, from [0, 0, -1]", "xy = 0.1 m, is not the cell of the scene"],
        ),
        ("Masses", "0.1 0 xy xz yz\n\nMasses", &[":10: must have three numbers"]),
        ("Masses", "4 0 0 avec\n\nMasses", &[":10: the box has edges of its own"]),
        ("Velocities", "Atoms", &[":21: a second section \"Atoms\""]),
        ("1 1 1.0 2500 1 1 1 0 0 1", "1 1 1.0 2500 1 1 1", &["7 values", "10 columns"]),
    ];
    for (from, to, parts) in cases {
        refuse(GLASS, DATA.replacen(from, to, 1), parts);
    }
    refuse("", DATA, &["material = \"1\": is no material", "say what types are, as in material = { 1 = \"glass\" }"]);
    refuse("material = { 1 = \"glass\" }", DATA, &[":19: \"2\": the key `material` of the population has only 1"]);
}

/// Two frames; the second has its time before it, as `dump_modify time yes` has it.
const DUMP: &str = "ITEM: UNITS
si
ITEM: TIMESTEP
0
ITEM: NUMBER OF ATOMS
1
ITEM: BOX BOUNDS pp pp ff
0 1
0 1
0 1
ITEM: ATOMS id type radius x y z
1 1 0.1 0.5 0.5 0.5
ITEM: TIME
0.5
ITEM: TIMESTEP
100
ITEM: NUMBER OF ATOMS
2
ITEM: BOX BOUNDS pp pp ff
0 2
-1 1
0 4
ITEM: ATOMS id type diameter xs ys zs vx vy vz omegax omegay omegaz c_work[1]
2 2 0.5 0.25 0.5 1 1 2 3 4 5 6 -1
1 1 1 0.75 1.25 0.5 0 0 0 0 0 0 inf
";

#[test]
fn the_last_frame_of_a_lammps_dump_is_read() {
    let types = "material = { 1 = \"glass\", 2 = \"steel\" }";
    let bed = good(types, DUMP);
    assert_eq!(content(&bed), [(v(1.5, 1.5, 2.0), 0.5, "glass"), (v(0.5, 0.0, 4.0), 0.25, "steel")]);
    assert_eq!((bed.grains[1].velocity, bed.grains[1].spin), (v(1.0, 2.0, 3.0), v(4.0, 5.0, 6.0)));
    assert_eq!(bed.notices.len(), 1);
    let frames = DUMP.split("ITEM: TIME\n").next().unwrap();
    assert_eq!(content(&good(types, frames)), [(v(0.5, 0.5, 0.5), 0.1, "glass")]);
    let again = good(types, &format!("{DUMP}ITEM: TIME\n1"));
    assert_eq!(again.grains, bed.grains);

    let cases: &[(&str, &str, &[&str])] = &[
        ("ATOMS\n2", "ATOMS\n3", &[":15: the last frame, which begins here, has 3 atoms, and 2 follow"]),
        ("ATOMS\n2", "ATOMS\n-2", &[":18: \"-2\": must be a whole number"]),
        ("pp ff\n0 2\n", "pp ff\n0 2 0.1\n", &[":20: must be the bounds of an axis"]),
        ("pp ff\n0 2\n", "pp ff\n0\n", &[":20: must be the bounds of an axis"]),
        ("diameter xs", "diameter q", &[":23: lacks the column \"x\""]),
        ("diameter xs", "mass xs", &[":23: lacks the column \"radius\""]),
        ("0.75 1.25", "0.75", &[":25: has 12 values", "13 columns"]),
        ("ITEM: NUMBER OF ATOMS\n2\n", "ITEM: ATOM COUNT\n2\n", &[":17: ITEM: \"ATOM COUNT\" is nothing"]),
        ("ITEM: NUMBER OF ATOMS\n2\n", "", &[":21: the number of atoms must come before them"]),
    ];
    for (from, to, parts) in cases {
        refuse(types, DUMP.replace(from, to), parts);
    }
    refuse(types, DUMP.split("ITEM: ATOMS id type diameter").next().unwrap(), &[":15: the last frame", "is cut off"]);
}

#[test]
fn xyz_is_read() {
    let plain = "2\nsand\nglass 1 2 3\nsteel 4 5 6\n";
    let wanted = [(v(1.0, 2.0, 3.0), 0.25, "glass"), (v(4.0, 5.0, 6.0), 0.25, "steel")];
    assert_eq!(content(&good("radius = 0.25", plain)), wanted);
    let elements = plain.replace("glass", "Si").replace("steel", "Fe");
    assert_eq!(content(&good("radius = 0.25\nmaterial = { Si = \"glass\", Fe = \"steel\" }", &elements)), wanted);
    refuse(GLASS, plain, &[":2: lacks the column \"radius\"", "key `radius`"]);
    refuse(GLASS, plain.replace("2 3", "2 3 0.1"), &[":2: atoms have 5 values, and 4 are expected", "Properties="]);

    let frame = |properties: &str, atom: &str| {
        format!("1\nLattice=\"4 0 0 0 5 0 0 0 6\" Origin=\"0 0 -1\" Properties={properties} Time=0.5\n{atom}\n")
    };
    let first = frame("species:S:1:pos:R:3", "glass 0 0 0");
    let last = frame(
        "id:I:1:species:S:1:pos:R:3:Radius:R:1:force:R:3:velo:R:3:omega:R:3",
        "7 steel 1 2 3 0.5 0 0 0 1 2 3 4 5 6",
    );
    let bed = good("", &format!("{first}{last}\n\n"));
    assert_eq!(content(&bed), [(v(1.0, 2.0, 3.0), 0.5, "steel")]);
    assert_eq!((bed.grains[0].velocity, bed.grains[0].spin), (v(1.0, 2.0, 3.0), v(4.0, 5.0, 6.0)));
    assert!(bed.notices[0].contains("its box, from [0, 0, -1] to [4, 5, 5] m"), "{:?}", bed.notices);

    let cases: &[(&str, &str, &[&str])] = &[
        ("1\n", "2\n", &[":1: this frame announces 2 atoms, and 1 follow"]),
        ("1\n", "18446744073709551615\n", &[":1: this frame announces"]),
        ("4 0 0 0", "4 1 0 0", &[":2: the box is turned"]),
        ("4 0 0 0", "4 0 0 1", &[": its box, from [0, 0, -1]", "xy = 1 m, is not the cell of the scene"]),
        ("4 0 0 0", "4 0 0", &[":2: Lattice must have nine numbers"]),
        ("pos:R:3", "pos:R", &[":2: \"Radius\": must be a whole number"]),
        ("omega:R:3", "omega:R", &[":2: Properties must be names"]),
        ("force:R:3", "force:R:99999999999", &[":2: Properties: \"force\" has 99999999999 values"]),
        ("pos:R:3", "position:R:3", &[":2: lacks the column \"x\""]),
    ];
    for (from, to, parts) in cases {
        refuse("", last.replacen(from, to, 1), parts);
    }
}

/// A cell that has been sheared, as packstone writes it for others, is the same again in the domain that it was in, and
/// refused in any other.
#[test]
fn tilted_cells_are_read_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    for dimension in [2, 3] {
        let (zeros, ones) = (["0"; 3][..dimension].join(", "), ["0.02"; 3][..dimension].join(", "));
        let materials = BASE.replace("dimension = 3", &format!("dimension = {dimension}"));
        let materials = materials.replace("gravity = [0, 0, 0]", &format!("gravity = [{zeros}]"));
        let scene = |upper: &str, tilt: &str, rest: &str| {
            let domain = format!("lower = [{zeros}]\nupper = [{upper}]\nboundary = \"periodic\"\ntilt = {tilt}");
            let text = format!("{materials}[domain]\n{domain}\n{rest}");
            Scene::parse(&text, "cell.toml", folder.path(), &[])
        };
        let rates = if dimension == 2 { "xy = 40" } else { "xy = 40, yz = -30, xz = 20, zz = -5" };
        let grains = "[[population]]\nmaterial = \"steel\"\ncount = 30\nradius = { uniform = [8e-4, 1e-3] }\nvelocity_spread = 0.1\n";
        let sheared = scene(&ones, "{}", &format!("[cell]\nstrain_rate = {{ {rates} }}\n{grains}"));
        let assembly = sheared.unwrap().assemble().unwrap();
        let options = Options { engine: EngineChoice::Cpu, ..Options::default() };
        let mut simulation = Simulation::new(assembly, options).unwrap();
        simulation.advance((0.01 / simulation.dt()) as u64).unwrap();
        let (grains, walls, domain) =
            (simulation.grains().unwrap(), simulation.walls().unwrap(), simulation.domain().unwrap());
        assert!(domain.tilt.z.abs() > 1e-3, "{domain:?}");
        let assembly = simulation.assembly_in(domain);
        let packing = Packing::new(&assembly, &grains, &[], &walls, &[]);
        let upper =
            domain.upper.to_array()[..dimension].iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", ");
        let DVec3 { x: yz, y: xz, z: xy } = domain.tilt;
        for name in ["bed.xyz", "bed.dump"] {
            let export = Export::of(&folder.path().join(name)).unwrap();
            export.write(&packing, simulation.step(), simulation.time()).unwrap();
            let types = if name == "bed.dump" { "material = { 2 = \"steel\" }" } else { "" };
            let population = format!("[[population]]\nfile = \"{name}\"\n{types}\n");
            let again = |tilt: &str| scene(&upper, tilt, &population).unwrap().assemble();
            let read = again(&format!("{{ yz = {yz:?}, xz = {xz:?}, xy = {xy:?} }}")).unwrap();
            assert!(read.notices.is_empty(), "{:?}", read.notices);
            let bits = |grains: &[Grain]| grains.iter().map(|g| (g.position, g.velocity, g.radius)).collect::<Vec<_>>();
            assert_eq!(bits(&read.grains), bits(&grains), "{name}");
            assert_eq!((read.domain.upper, read.domain.tilt), (domain.upper, domain.tilt));
            for other in ["{}", "{ xy = -1e-3 }"] {
                let refused = again(other).unwrap_err().to_string();
                assert!(refused.contains(name) && refused.contains("is not the cell of the scene"), "{refused}");
            }
        }
    }
}

/// Of a shape too.
#[test]
fn members_may_be_of_any_format() {
    let folder = tempfile::tempdir().unwrap();
    let members = |text: &str| {
        fs::write(folder.path().join("stone"), text).unwrap();
        let scene = format!(
            "{BASE}[[shape]]\nname = \"stone\"\nfile = \"stone\"\n[[grain]]\nshape = \"stone\"\nposition = [0, 0, 0]\nradius = 1\nmaterial = \"glass\"\n"
        );
        Scene::parse(&scene, "heap.toml", folder.path(), &[])?.assemble().map(|assembly| assembly.shapes)
    };
    let wanted = members("x,y,z,radius\n0,0,0,1\n1,0,0,0.5\n").unwrap();
    assert_eq!(wanted[0].members.len(), 2);
    for text in [
        "radius;z;y;x\n1;0;0;0\n0.5;0;0;1\n",
        "2\nProperties=pos:R:3:radius:R:1\n0 0 0 1\n1 0 0 0.5\n",
        "stone\n2 atoms\nAtoms # sphere\n\n1 1 2 1 0 0 0\n2 1 1 1 1 0 0\n",
    ] {
        assert_eq!(members(text).unwrap(), wanted, "{text}");
    }
    let refused = members("x,y,z,radius,vx\n0,0,0,1,0\n").unwrap_err().to_string();
    assert!(refused.contains("stone:1: column \"vx\""), "{refused}");
}

/// A bed as LAMMPS has written it, and the same after it has settled.
#[test]
fn examples_of_other_codes_are_read() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/lammps");
    let scene = |file: &str| {
        let domain = "[domain]\nlower = [0, 0, 0]\nupper = [0.01, 0.01, 0.02]\nboundary = [\"periodic\", \"periodic\", \"open\"]\n";
        let text = format!("{BASE}{domain}[[population]]\nfile = \"{file}\"\nmaterial = {{ 1 = \"glass\" }}\n");
        Scene::parse(&text, "heap.toml", &data, &[]).unwrap().assemble().unwrap()
    };
    let (written, dumped) = (scene("bed.data"), scene("bed.dump"));
    assert_eq!(written.grains.len(), dumped.grains.len());
    for (a, b) in written.grains.iter().zip(&dumped.grains) {
        assert_eq!(a.radius, b.radius);
        assert!(a.position.distance(b.position) < 1e-9 && a.velocity.distance(b.velocity) < 1e-9, "{a:?} {b:?}");
        assert!(a.spin.distance(b.spin) < 1e-6, "{a:?} {b:?}");
    }
    assert!(written.notices.is_empty() && dumped.notices.is_empty(), "{:?} {:?}", written.notices, dumped.notices);
}
