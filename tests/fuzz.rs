//! Parsers and bytes that nobody has written on purpose: each ends, with what it has read or with an error in a
//! sentence. No panic, no hang, no memory that only a number in a header asks for.

use packstone::{
    Error,
    container::{Column, Container},
    io::{Record, problem, read_rows, summary::Surroundings},
    scene::Scene,
    simulation::{Checkpoint, EngineChoice, Options, Simulation},
};
use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use std::{
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    process::exit,
    sync::{Arc, Mutex},
    thread,
    time::{Duration, Instant},
};

/// An input that takes as long as this hangs, on the slowest machine.
const HANG: Duration = Duration::from_secs(30);
/// The longest message, in bytes.
const LONGEST_MESSAGE: usize = 1500;
/// Memory that no input of these sizes may need, bytes.
const MOST_MEMORY: u64 = 400 << 20;

/// A parser, and what it is given.
struct Subject<'a> {
    name: &'a str,
    /// Valid inputs, which are altered.
    seeds: Vec<Vec<u8>>,
    inputs: usize,
    /// Makes a file of an altered input.
    file: &'a dyn Fn(&[u8]) -> Vec<u8>,
    /// Whether what has been altered can still be read.
    read: &'a dyn Fn(&Path) -> Result<(), Error>,
}

fn as_it_is(bytes: &[u8]) -> Vec<u8> {
    bytes.to_vec()
}

/// Read so many altered inputs.
fn fuzz(subject: &Subject) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("input");
    let name = subject.name;
    let read = |bytes: &[u8]| {
        fs::write(&path, (subject.file)(bytes)).unwrap();
        catch_unwind(AssertUnwindSafe(|| (subject.read)(&path)))
    };
    for seed in &subject.seeds {
        read(seed).unwrap().unwrap_or_else(|error| panic!("{name}: the seed is not valid: {error}"));
    }
    let begun = Arc::new(Mutex::new(Some((Instant::now(), Vec::new()))));
    let watched = begun.clone();
    let watch = {
        let name = name.to_owned();
        thread::spawn(move || {
            loop {
                thread::sleep(Duration::from_millis(200));
                match &*watched.lock().unwrap() {
                    None => return,
                    Some((at, input)) if at.elapsed() > HANG => {
                        eprintln!("{name}: hangs at {}", shown(input));
                        exit(1);
                    }
                    Some(_) => {}
                }
            }
        })
    };
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let (mut good, mut slowest) = (0, Duration::ZERO);
    let mut faults = Vec::new();
    for _ in 0..subject.inputs {
        let input = altered(&subject.seeds, &mut rng);
        let (before, at) = (most_memory(), Instant::now());
        *begun.lock().unwrap() = Some((at, input.clone()));
        let outcome = read(&input);
        slowest = slowest.max(at.elapsed());
        if let (Some(before), Some(after)) = (before, most_memory())
            && after > before + MOST_MEMORY
        {
            faults.push(format!("takes {} MB for {}", (after - before) >> 20, shown(&input)));
        }
        match outcome {
            Err(_) => faults.push(format!("panics at {}", shown(&input))),
            Ok(Ok(())) => good += 1,
            Ok(Err(error)) => {
                let message = error.to_string();
                if message.len() > LONGEST_MESSAGE || message.contains('\n') {
                    let begin: String = message.chars().take(300).collect();
                    faults.push(format!("says, in {} bytes, {begin:?} of {}", message.len(), shown(&input)));
                }
            }
        }
    }
    *begun.lock().unwrap() = None;
    watch.join().unwrap();
    println!("{name}: {} inputs, {good} of them valid, the slowest in {slowest:?}", subject.inputs);
    assert!(
        faults.is_empty(),
        "{name}: {} faults, such as\n{}",
        faults.len(),
        faults[..faults.len().min(5)].join("\n")
    );
    assert!(good < subject.inputs, "{name}: nothing has been altered");
}

fn shown(input: &[u8]) -> String {
    let text = input.escape_ascii().to_string();
    format!("{} bytes: {}", input.len(), text.chars().take(6000).collect::<String>())
}

/// The most that this process has ever asked for, bytes, where the system tells.
fn most_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:"))?;
    Some(line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()? << 10)
}

const NUMBERS: [&str; 20] = [
    "0",
    "-1",
    "1",
    "2",
    "nan",
    "-inf",
    "1e308",
    "-1.7976931348623157e308",
    "1e-308",
    "5e-324",
    "1e400",
    "18446744073709551615",
    "9223372036854775807",
    "4294967296",
    "99999999999999999999",
    "1_000",
    "0x7f",
    "1,5",
    "1e",
    "",
];
const WORDS: [&str; 16] =
    ["é", "𝔊", "\u{202e}", "\u{feff}", "\0", "\u{1b}[31m", "\"", "[", "]", "{ ", "}", "#", ",", ";", "\t", "\r\n"];

/// One of the seeds, with one to four alterations.
fn altered(seeds: &[Vec<u8>], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = seeds.choose(rng).unwrap().clone();
    for _ in 0..rng.random_range(1..=4) {
        alter(&mut bytes, seeds, rng);
    }
    bytes
}

fn alter(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], rng: &mut ChaCha8Rng) {
    if bytes.is_empty() {
        return bytes.push(rng.random());
    }
    let at = rng.random_range(0..bytes.len());
    let near = |rng: &mut ChaCha8Rng| (at + rng.random_range(0..=40)).min(bytes.len());
    match rng.random_range(0..12) {
        0 => bytes[at] ^= 1 << rng.random_range(0..8),
        1 => bytes.truncate(at),
        2 => {
            let end = near(rng);
            drop(bytes.drain(at..end));
        }
        3 => {
            let word = *WORDS.choose(rng).unwrap();
            drop(bytes.splice(at..at, word.bytes()));
        }
        4 => {
            let piece = seeds.choose(rng).unwrap();
            let from = rng.random_range(0..=piece.len());
            let to = (from + rng.random_range(0..200)).min(piece.len());
            drop(bytes.splice(at..at, piece[from..to].iter().copied()));
        }
        5 => {
            let end = (at + 4).min(bytes.len());
            let number: u32 = *[0, 1, u32::MAX, 1 << 31, 1 << 24].choose(rng).unwrap();
            drop(bytes.splice(at..end, number.to_le_bytes()));
        }
        6 => {
            let word = *[b"a", b"9", b"-"].choose(rng).unwrap();
            let long = word.repeat(*[300, 5000].choose(rng).unwrap());
            drop(bytes.splice(at..at, long));
        }
        7 | 8 => lines(bytes, rng),
        _ => number(bytes, rng),
    }
}

/// Remove a line, repeat it, or give it another place.
fn lines(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let mut lines: Vec<Vec<u8>> = bytes.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
    let line = lines.remove(rng.random_range(0..lines.len()));
    let times = *[0, 0, 1, 2, 20].choose(rng).unwrap();
    let at = rng.random_range(0..=lines.len());
    lines.splice(at..at, std::iter::repeat_n(line, times));
    *bytes = lines.concat();
}

/// Put another number in the place of one.
fn number(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b".+-eE_".contains(byte);
    let begins: Vec<usize> = (0..bytes.len())
        .filter(|k| bytes[*k].is_ascii_digit() && (*k == 0 || !is_part(&bytes[k - 1]) || bytes[k - 1] == b'-'))
        .collect();
    let Some(&begin) = begins.choose(rng) else { return };
    let end = bytes[begin..].iter().position(|byte| !is_part(byte)).map_or(bytes.len(), |length| begin + length);
    let other = match rng.random_range(0..8) {
        0 => "7".repeat(300),
        1 => rng.random_range(0..40).to_string(),
        _ => NUMBERS.choose(rng).unwrap().to_string(),
    };
    bytes.splice(begin..end, other.into_bytes());
}

const MATERIALS: &str = "[material.glass]\ndensity = 2500\nnormal_stiffness = 1e5\nfriction = 0.3\n[material.steel]\ndensity = 7800\nnormal_stiffness = 3e5\n";

/// A scene with every kind of wall, shape, radius and placement, and few grains.
fn small_scene() -> String {
    format!(
        r#"dimension = 3
title = "all of it"
gravity = [0, 0, -9.81]
seed = 7
{MATERIALS}restitution = 0.6
[[pair]]
materials = ["glass", "steel"]
friction = 0.2
[domain]
lower = [-1, -1, -1]
upper = [3, 3, 9]
boundary = ["open", "open", "open"]
[[wall]]
kind = "box"
name = "bin"
material = "steel"
lower = [0, 0, 0]
upper = [2, 2, 8]
faces = ["x-", "x+", "y-", "y+", "z-"]
[[wall]]
kind = "cylinder"
material = "glass"
center = [1, 1]
radius = 1.2
spin = 0.5
[[wall]]
kind = "plane"
material = "glass"
point = [0, 0, 7]
normal = [0.1, 0, -1]
velocity = [0, 0, 0.1]
[[shape]]
name = "stone"
members = [{{ center = [0, 0, 0], radius = 1 }}, {{ center = [1, 0, 0], radius = 0.5 }}]
[[shape]]
name = "heavy"
kind = "rod"
count = 4
distance = 0.5
volume = 3
center = [0, 0, 0]
inertia = [1, 2, 2, 0, 0, 0]
[[grain]]
position = [1, 1, 0.2]
radius = 0.1
material = "steel"
velocity = [0, 0, 1]
spin = [1, 2, 3]
[[grain]]
position = [1, 1.4, 0.2]
radius = 0.1
shape = "stone"
orientation = {{ euler = [0.1, 0.2, 0.3] }}
material = "glass"
[[population]]
material = "glass"
count = 20
radius = {{ normal = {{ mean = 0.05, std = 0.01 }} }}
shape = {{ stone = 2, heavy = 1, sphere = 1 }}
region = {{ lower = [0, 0, 1], upper = [2, 2, 4] }}
[[population]]
material = "steel"
count = 12
radius = {{ log_normal = {{ mean = 0.05, std = 0.02, max = 0.1 }}, by = "volume" }}
placement = "random"
velocity_spread = 0.1
region = {{ lower = [0, 0, 4], upper = [2, 2, 5] }}
[[population]]
material = "steel"
count = 12
radius = {{ sieve = {{ radius = [0.02, 0.04, 0.06], passing = [0, 0.4, 1] }} }}
gap = 0.2
region = {{ lower = [0, 0, 5], upper = [2, 2, 6] }}
[solver]
method = "cd"
tolerance = 1e-4
max_iterations = 50
[stop]
time = 0.5
equilibrium = 1e-4
[output]
history = 0.1
snapshots = 0.1
formats = ["csv", "bin", "vtp"]
"#
    )
}

/// Scenes that ask for many grains are asked for them on purpose.
fn is_small(text: &str) -> bool {
    const MANY: i64 = 2000;
    let Ok(table) = text.parse::<toml::Table>() else { return true };
    let few = |key: &str, count: &str| {
        let list = table.get(key).and_then(|list| list.as_array()).cloned().unwrap_or_default();
        list.iter().all(|part| part.get(count).and_then(toml::Value::as_integer).is_none_or(|count| count <= MANY))
    };
    few("population", "count") && few("shape", "spheres")
}

fn read_scene(path: &Path) -> Result<(), Error> {
    let scene = Scene::load(path, &[])?;
    match is_small(&fs::read_to_string(path).unwrap()) {
        true => scene.assemble()?.validate(),
        false => Ok(()),
    }
}

/// The examples, with few grains of each kind.
fn examples() -> Vec<Vec<u8>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
    let folders = [root.clone(), root.join("hard")];
    let files = folders.iter().flat_map(|folder| fs::read_dir(folder).unwrap()).map(|file| file.unwrap().path());
    let mut files: Vec<PathBuf> =
        files.filter(|file| file.extension().is_some_and(|ending| ending == "toml")).collect();
    files.sort();
    let few = |line: &str| match line.strip_prefix("count = ") {
        Some(count) => {
            format!("count = {}\n", count.replace('_', "").parse::<usize>().map_or(20, |count| count.min(20)))
        }
        None => format!("{line}\n"),
    };
    let text = |file: &PathBuf| fs::read_to_string(file).unwrap().lines().map(few).collect::<String>();
    // Few grains do not grow to fill as much.
    let text = |file: &PathBuf| text(file).replace("packing_fraction = 0.66", "packing_fraction = 0.1");
    // Those that read other files have their own subjects.
    let alone = |text: &String| !text.contains("file = ") && !text.contains("mesh = ");
    files.iter().map(text).filter(alone).map(String::into_bytes).collect()
}

#[test]
fn scenes() {
    let seeds: Vec<_> = examples().into_iter().chain([small_scene().into_bytes()]).collect();
    assert!(seeds.len() > 20, "{}", seeds.len());
    fuzz(&Subject { name: "scenes", seeds, inputs: 2000, file: &as_it_is, read: &read_scene });
    let seeds = vec![small_scene().into_bytes()];
    fuzz(&Subject { name: "a scene with all of it", seeds, inputs: 2000, file: &as_it_is, read: &read_scene });
}

#[test]
fn overrides() {
    let seed = "solver.max_iterations=20\npopulation.0.count=30\nmaterial.glass.density=1e3\nwall.0.upper=[2,2,7]\n\
                population.1.radius={uniform=[0.01,0.02]}\nshape.0.members.1.radius=0.7\ntitle=\"a \\\"b\\\"\"\n\
                gravity.2=-1\noutput.formats=[\"bin\"]\nmaterial.\"glass\".friction = 0.5\n";
    let read = |path: &Path| {
        // Arguments are text.
        let text = String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
        let set: Vec<String> = text.lines().map(str::to_owned).collect();
        let scene = Scene::parse(&small_scene(), "all.toml", Path::new(""), &set)?;
        match is_small(&scene.text(&[]).unwrap()) {
            true => scene.assemble().map(drop),
            false => Ok(()),
        }
    };
    fuzz(&Subject { name: "--set", seeds: vec![seed.into()], inputs: 1500, file: &as_it_is, read: &read });
}

/// Reads the input as the file that stands in place of `FILE` in a part of a scene.
fn read_in(part: &str, path: &Path) -> Result<(), Error> {
    let file = path.file_name().unwrap().to_str().unwrap();
    let text = format!("dimension = 3\nstop.steps = 1\n{MATERIALS}{}", part.replace("FILE", file));
    Scene::parse(&text, "scene.toml", path.parent().unwrap(), &[])?.assemble().map(drop)
}

#[test]
fn tables_and_files_of_other_codes() {
    let csv = "# grains\nid,x,y,z,radius,vx,vy,vz,wx,wy,wz,material,shape,qw,qx,qy,qz\n\
               0,1,2,3,0.5,0,0,0,1,1,1,steel,,1,0,0,0\n1,4,5,6,0.5,0,0,1,0,0,0,,dimer,0.6,0.8,0,0\n2,8,8,8,0.5,0,0,0,0,0,0,glass,cube,1,0,0,0\n";
    let short = "x;y;z;diameter\n1;2;3;0.5\n4;5;6;0.25\n7;8;9;1\n";
    let data = "LAMMPS data file, units = si\n\n2 atoms\n1 atom types\n\n0 4 xlo xhi\n0 5 ylo yhi\n-1 6 zlo zhi\n0 0 0 xy xz yz\n\nMasses\n\n1 1\n\n\
                Atoms # sphere\n\n2 1 0.5 2500 1 1 3 0 0 0\n1 1 1.0 2500 1 1 1 0 0 1\n\nVelocities\n\n1 2 3 4 5 6 7\n2 0 0 0 0 0 0\n";
    let dump = "ITEM: UNITS\nsi\nITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp ff\n0 1\n0 1\n0 1\n\
                ITEM: ATOMS id x y z radius\n1 0.5 0.5 0.5 0.1\nITEM: TIMESTEP\n1\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS xy xz yz pp pp ff\n0 1 0\n0 1 0\n0 1 0\n\
                ITEM: ATOMS id type diameter xs ys zs vx vy vz omegax omegay omegaz\n1 1 0.1 0.5 0.5 0.5 1 2 3 4 5 6\n2 1 0.1 0.7 0.5 0.5 1 2 3 4 5 6\n";
    let xyz = "1\nany\nglass 1 2 3\n2\nLattice=\"4 0 0 0 5 0 0 0 6\" Origin=\"0 0 0\" Properties=species:S:1:pos:R:3:radius:R:1:force:R:3:velo:R:3 Time=1\n\
               glass 1 2 3 0.5 0 0 0 1 1 1\nsteel 2 3 4 0.5 0 0 0 1 1 1\n";
    let lammps = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/lammps");
    let [bed, settled] = ["bed.data", "bed.dump"].map(|name| fs::read(lammps.join(name)).unwrap());
    let named = |path: &Path| read_in("[[population]]\nfile = \"FILE\"\nmaterial = \"glass\"\n", path);
    for (name, seeds, inputs) in [
        ("tables", vec![csv, short], 1500),
        ("LAMMPS data", vec![data], 1200),
        ("LAMMPS dump", vec![dump], 1200),
        ("XYZ", vec![xyz], 1200),
    ] {
        let seeds = seeds.into_iter().map(|seed| seed.as_bytes().to_vec()).collect();
        fuzz(&Subject { name, seeds, inputs, file: &as_it_is, read: &named });
    }
    fuzz(&Subject { name: "files of LAMMPS", seeds: vec![bed, settled], inputs: 300, file: &as_it_is, read: &named });
    let shape = "[[shape]]\nname = \"stone\"\nfile = \"FILE\"\n[[grain]]\nshape = \"stone\"\nposition = [0, 0, 0]\nradius = 1\nmaterial = \"glass\"\n";
    let members = |path: &Path| read_in(shape, path);
    let seeds = vec![b"x,y,z,radius\n0,0,0,1\n0.5,0,0,0.7\n0,1.5,0,0.5\n".to_vec(), short.into()];
    fuzz(&Subject { name: "members", seeds, inputs: 600, file: &as_it_is, read: &members });
    let curve = "[[population]]\nmaterial = \"glass\"\ncount = 20\nradius = { sieve = \"FILE\", by = \"volume\" }\nregion = { lower = [0, 0, 0], upper = [9, 9, 9] }\n";
    let sieve = |path: &Path| read_in(curve, path);
    let seeds = vec![b"radius,passing\n0.1,0\n0.2,30\n0.3,100\n".to_vec()];
    fuzz(&Subject { name: "sieves", seeds, inputs: 600, file: &as_it_is, read: &sieve });
    let rows = |path: &Path| read_rows(path).map(drop);
    let seeds = vec![csv.into(), short.replace(';', ",").replace("diameter", "radius").into()];
    fuzz(&Subject { name: "tables for pictures", seeds, inputs: 500, file: &as_it_is, read: &rows });
}

/// The surface of a tetrahedron.
fn tetrahedron() -> [[[f32; 3]; 3]; 4] {
    let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    [[a, c, b], [a, b, d], [b, c, d], [a, d, c]]
}

#[test]
fn meshes() {
    let mut binary = vec![0; 80];
    binary.extend(4_u32.to_le_bytes());
    let mut text = "solid stone\n".to_owned();
    for facet in tetrahedron() {
        binary.extend([0_u8; 12]);
        binary.extend(facet.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        binary.extend([0; 2]);
        let vertices: String = facet.iter().map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).collect();
        text += &format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n");
    }
    text += "endsolid stone\n";
    let shape = "[[shape]]\nname = \"stone\"\nmesh = \"FILE\"\nspheres = 3\n[[grain]]\nshape = \"stone\"\nposition = [0, 0, 0]\nradius = 1\nmaterial = \"glass\"\n";
    let read = |path: &Path| read_in(shape, path);
    fuzz(&Subject { name: "meshes", seeds: vec![binary, text.into()], inputs: 400, file: &as_it_is, read: &read });
}

/// Grains, as `final.bin` has them: the header, and the bytes of the columns without their checksums.
fn grain_file() -> (Vec<u8>, Vec<Vec<u8>>) {
    let about = serde_json::json!({
        "kind": "grains", "version": "0.1.0", "dimension": 3, "step": 7, "time": 0.5,
        "materials": ["glass", "steel"], "shapes": ["dimer", "sphere"],
    });
    let rows = [0_u32, 1];
    let place = |k: &u32| [3.0 * f64::from(*k), 0.0, 0.0];
    let columns = [
        Column::new("position", "m", &rows, place),
        Column::new("velocity", "m/s", &rows, place),
        Column::new("angular_velocity", "rad/s", &rows, place),
        Column::new("radius", "m", &rows, |_| [0.5]),
        Column::new("material", "", &rows, |k| [*k]),
        Column::new("fixed", "", &rows, |k| [*k]),
        Column::new("shape", "", &rows, |k| [*k]),
        Column::new("orientation", "", &rows, |_| [0.6, 0.0, 0.0, 0.8]),
    ];
    let mut file = Vec::new();
    packstone::container::write(&mut file, &about, &columns).unwrap();
    let header = 16 + u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    let mut at = header + 4;
    let column = |bytes: usize| {
        let column = file[at..at + bytes].to_vec();
        at += bytes + 4;
        column
    };
    let columns = [48, 48, 48, 16, 8, 8, 8, 64].map(column).to_vec();
    (file[16..header].to_vec(), columns)
}

/// A file with these parts whose checksums are right.
fn sealed(header: &[u8], columns: &[Vec<u8>]) -> Vec<u8> {
    let mut file = vec![0x89, b'P', b'A', b'C', b'K', 13, 10, 26, 1, 0, 0, 0];
    file.extend((header.len() as u32).to_le_bytes());
    file.extend(header);
    file.extend(crc32fast::hash(&file).to_le_bytes());
    for column in columns {
        file.extend(column);
        file.extend(crc32fast::hash(column).to_le_bytes());
    }
    file
}

#[test]
fn binary_files() {
    let (header, columns) = grain_file();
    let grains = |path: &Path| read_in("[[population]]\nfile = \"FILE\"\n", path);
    let whole = sealed(&header, &columns);
    fuzz(&Subject { name: "grains", seeds: vec![whole.clone()], inputs: 1000, file: &as_it_is, read: &grains });
    let with_columns = |header: &[u8]| sealed(header, &columns);
    fuzz(&Subject { name: "headers", seeds: vec![header.clone()], inputs: 1000, file: &with_columns, read: &grains });
    let with_header = |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        bytes.resize(columns.iter().map(Vec::len).sum(), 0xff);
        let mut rest = &bytes[..];
        let part = |column: &Vec<u8>| {
            let (part, after) = rest.split_at(column.len());
            rest = after;
            part.to_vec()
        };
        sealed(&header, &columns.iter().map(part).collect::<Vec<_>>())
    };
    fuzz(&Subject { name: "columns", seeds: vec![columns.concat()], inputs: 1000, file: &with_header, read: &grains });
    let any = |path: &Path| {
        let file = Container::<serde_json::Value>::open(path)?;
        let names: Vec<String> = file.descriptions().map(|column| column.name.clone()).collect();
        let mut file = file;
        names.iter().try_for_each(|name| file.read_pieces(name, 1000, |_, _| Ok(())))
    };
    fuzz(&Subject { name: "containers", seeds: vec![header.clone()], inputs: 500, file: &with_columns, read: &any });
    let rows = |path: &Path| read_rows(path).map(drop);
    fuzz(&Subject {
        name: "binary pictures",
        seeds: vec![header.clone()],
        inputs: 500,
        file: &with_columns,
        read: &rows,
    });
}

#[test]
fn checkpoints() {
    let scene = format!(
        "dimension = 3\nstop.steps = 9\n{MATERIALS}[[grain]]\nposition = [0, 0, 0]\nradius = 0.5\nmaterial = \"glass\"\n\
         [[grain]]\nposition = [0, 0, 0.99]\nradius = 0.5\nmaterial = \"glass\"\n"
    );
    let assembly = Scene::parse(&scene, "two.toml", Path::new(""), &[]).unwrap().assemble().unwrap();
    let options = Options { engine: EngineChoice::Cpu, ..Options::default() };
    let mut simulation = Simulation::new(assembly.clone(), options).unwrap();
    simulation.advance_chunk(3).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint.bin");
    simulation.save(&path, &serde_json::json!({ "rows": 3 })).unwrap();
    let whole = fs::read(&path).unwrap();
    let resume = |path: &Path| {
        let mut checkpoint = Checkpoint::open(path)?;
        Simulation::resume(assembly.clone(), options, &mut checkpoint)?;
        Ok(())
    };
    fuzz(&Subject { name: "checkpoints", seeds: vec![whole.clone()], inputs: 500, file: &as_it_is, read: &resume });
    let end = 16 + u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
    let with_body = |header: &[u8]| [sealed(header, &[]), whole[end + 4..].to_vec()].concat();
    let header = vec![whole[16..end].to_vec()];
    fuzz(&Subject { name: "their headers", seeds: header, inputs: 1000, file: &with_body, read: &resume });
}

#[test]
fn contact_problems() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/problems");
    let files = |names: &[&str]| names.iter().map(|name| fs::read(folder.join(name)).unwrap()).collect::<Vec<_>>();
    let small = b"2\n1\n0\n2 2\n2 2\n1 0 0 1\n-1 0.5\n0.3\n".to_vec();
    let read = |path: &Path| problem::read(path).map(drop);
    fuzz(&Subject { name: "a small problem", seeds: vec![small], inputs: 1000, file: &as_it_is, read: &read });
    let texts =
        files(&["NESpheres_10_1.dat", "gfc2d_granularflowonwall_00069_00350.dat", "BoxesStack1-i100000-32.hdf5.dat"]);
    fuzz(&Subject { name: "problems", seeds: texts, inputs: 400, file: &as_it_is, read: &read });
    if cfg!(feature = "fclib") {
        let binary = files(&["local_problem_test.hdf5", "Box_Stacks-i0122-82-5.hdf5"]);
        fuzz(&Subject { name: "FCLIB", seeds: binary, inputs: 1000, file: &as_it_is, read: &read });
    }
}

#[test]
fn records_and_summaries() {
    let record = serde_json::json!({
        "packstone": "0.1.0", "command": ["run", "a.toml"], "scene": "a.toml", "scene_as_run": "scene.toml", "seed": 1,
        "inputs": [{ "key": "population.0.file", "path": "inputs/bed.csv", "bytes": 7, "crc32": "00000000" }],
        "machine": null, "start": "2026-01-01T00:00:00Z", "end": null, "ended": null, "complete": true,
        "resumed": [], "files": { "final.csv": { "bytes": 7, "crc32": "00000000" } },
    });
    let read = |path: &Path| {
        let folder = tempfile::tempdir().unwrap();
        fs::copy(path, folder.path().join("run.json")).unwrap();
        let record = Record::read(folder.path());
        // What is none is none of packstone's.
        let known = record.map(|record| record.files_in(folder.path()).count());
        known.map(drop).ok_or_else(|| Error::Folder("no record".to_owned()))
    };
    let seeds = vec![serde_json::to_vec_pretty(&record).unwrap()];
    fuzz(&Subject { name: "run.json", seeds, inputs: 800, file: &as_it_is, read: &read });
    let summary = serde_json::json!({
        "dimension": 3, "domain": { "lower": [0, null, 0], "upper": [1, null, 1], "periodic": [true, false, false] },
        "walls": [{ "name": "floor", "kind": "plane", "point": [0, 0, 0], "normal": [0, 0, 1], "velocity": [0, 0, 0],
                    "spin": 0, "material": "glass" }],
    });
    let read = |path: &Path| {
        let around = Surroundings::read(path)?;
        around.walls();
        around.domain();
        Ok(())
    };
    let seeds = vec![serde_json::to_vec_pretty(&summary).unwrap()];
    fuzz(&Subject { name: "summary.json", seeds, inputs: 800, file: &as_it_is, read: &read });
}

/// What a file that was named by mistake holds is nobody's business.
#[test]
fn messages_do_not_tell_what_other_files_hold() {
    let secret = "root:$6$Xyzzy$KQ8fVt0aYb7sSECRETwVnC3e:19700:0:99999:7:::\nmallory:$6$SECRET:19700:0:::\n";
    let key = "-----BEGIN PRIVATE KEY-----\nSECRETx9fK2mQv7Zr1tYb4\n-----END PRIVATE KEY-----\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("input");
    let mesh = "[[shape]]\nname = \"stone\"\nmesh = \"FILE\"\n";
    let members = "[[shape]]\nname = \"stone\"\nfile = \"FILE\"\n";
    let sieve = "[[population]]\nmaterial = \"glass\"\ncount = 2\nradius = { sieve = \"FILE\" }\n";
    let population = "[[population]]\nmaterial = \"glass\"\nfile = \"FILE\"\n";
    type Reader<'a> = &'a dyn Fn(&Path) -> Result<(), Error>;
    let readers: [Reader; 8] = [
        &|path| read_in(mesh, path),
        &|path| read_in(members, path),
        &|path| read_in(sieve, path),
        &|path| read_in(population, path),
        &|path| Scene::load(path, &[]).map(drop),
        &|path| problem::read(path).map(drop),
        &|path| Checkpoint::open(path).map(drop),
        &|path| read_rows(path).map(drop),
    ];
    for text in [secret, key] {
        fs::write(&path, text).unwrap();
        for (k, read) in readers.iter().enumerate() {
            let message = read(&path).unwrap_err().to_string();
            assert!(!message.contains("SECRET"), "reader {k}: {message}");
            assert!(message.contains("input"), "reader {k}: {message}");
        }
    }
}
