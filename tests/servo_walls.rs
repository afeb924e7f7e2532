//! Planes and cylinders that a servo moves until grains press on them with a target force or pressure.

mod common;

use common::*;
use glam::DVec3;
use packstone::{
    check::balance::balances,
    scene::{Assembly, Dashpot, Domain, Grain, Pair, Scene, Servo, Target, Wall},
    simulation::Simulation,
};
use serde_json::Value;
use std::{f64::consts::PI, fs, path::Path, process::Command};

/// How long a contact of two default grains takes, s.
fn contact(dimension: usize) -> f64 {
    PI / (2.0 * KN / mass(dimension, R)).sqrt()
}

/// In double precision a device does what the twins do, which `tests/twins.rs` sees to.
fn benches() -> Vec<Bench> {
    engines().into_iter().filter(|bench| bench.name != GPU_DOUBLE.name).collect()
}

/// With dashpots and damping.
fn still(dimension: usize) -> Assembly {
    let mut scene = blank_dt(dimension, 0.04 * contact(dimension));
    scene.pairs = vec![Pair { dashpot: Dashpot::Restitution(0.3), ..law(0.3) }];
    scene.solver.damping = 0.02 / contact(dimension);
    scene
}

fn driven(wall: Wall, target: Target, max_speed: f64) -> Wall {
    Wall { servo: Some(Servo { target, area: None, gain: 1e-2, max_speed, inertial_number: None }), ..wall }
}

/// What presses on a wall, N, and where it is, m.
fn on_wall(simulation: &mut Simulation, wall: usize) -> [f64; 2] {
    let load = simulation.wall_loads().unwrap()[wall];
    [load.normal_force, load.position]
}

/// A column of grains, one on the other, that a lid with a force comes down on, sliding along itself: it is where the
/// springs say, and never too low.
#[test]
fn a_lid_comes_to_where_springs_carry_it() {
    for dimension in [2, 3] {
        let up = if dimension == 2 { DVec3::Y } else { DVec3::Z };
        let (force, grains) = (2e-3 * KN * R, 5);
        let mut scene = still(dimension);
        scene.pairs[0].friction = 0.0;
        scene.grains =
            (0..grains).map(|k| Grain { position: f64::from(2 * k + 1) * R * up, ..grain(0.0, 0.0, 0.0) }).collect();
        let most = 0.01 * R / contact(dimension);
        let lid = plane(f64::from(2 * grains) * 1.001 * R * up, -up);
        let along = Wall { velocity: 0.1 * most * DVec3::X, ..lid };
        scene.walls = vec![plane(DVec3::ZERO, up), driven(along, Target::Force(force), most)];
        // Each contact gives way by the same, as k_N is that of two alike.
        let expected = -f64::from(2 * grains) * R + f64::from(grains + 1) * force / KN;
        for bench in benches() {
            let mut simulation = bench.start(&scene);
            let mut highest = 0.0_f64;
            for _ in 0..20 {
                simulation.advance(500).unwrap();
                highest = highest.max(on_wall(&mut simulation, 1)[0] / force);
            }
            let [pressing, position] = on_wall(&mut simulation, 1);
            let off = (position - expected).abs() / (force / KN);
            let slid = simulation.walls().unwrap()[1].surface.reference().x;
            println!("{dimension}D on {}: at most {highest:.5}, off by {off:.1e}", bench.name);
            assert!(highest < 1.01 && (pressing / force - 1.0).abs() < 1e-3, "{highest}, {pressing:e} of {force:e}");
            assert!(off < 6e-3, "{dimension}D on {}: {position:e}, expected {expected:e}", bench.name);
            close("slid along", slid, scene.walls[1].velocity.x * simulation.time(), slid, 1e-6);
        }
    }
}

/// Three grains in a tube whose radius a pressure changes, which is at last about this; and the pressure.
fn tube(dimension: usize) -> (Assembly, f64, f64) {
    let mut scene = still(dimension);
    scene.pairs[0].friction = 0.0;
    let ring = 2.0 * R / 3.0_f64.sqrt();
    let place = |k: usize| {
        let angle = 2.0 * PI * k as f64 / 3.0;
        1.001 * ring * DVec3::new(angle.cos(), angle.sin(), 0.0)
    };
    let middle = if dimension == 2 { DVec3::ZERO } else { 0.5 * HEIGHT * DVec3::Z };
    scene.grains = (0..3).map(|k| Grain { position: place(k) + middle, ..grain(0.0, 0.0, 0.0) }).collect();
    if dimension == 3 {
        let mut upper = DVec3::INFINITY;
        upper.z = HEIGHT;
        let lower = DVec3::NEG_INFINITY.with_z(0.0);
        scene.domain = Domain { lower, upper, periodic: [false, false, true], ..Domain::default() };
    }
    let outer = ring + R;
    let pressure = 3.0 * 1e-3 * KN * R / area_of_tube(dimension, outer);
    let wall = cylinder(1.01 * outer);
    scene.walls = vec![driven(wall, Target::Pressure(pressure), 1e-3 * R / contact(dimension))];
    (scene, outer, pressure)
}

/// m, of the tube, in space.
const HEIGHT: f64 = 5.0 * R;

fn area_of_tube(dimension: usize, radius: f64) -> f64 {
    2.0 * PI * radius * if dimension == 2 { 1.0 } else { HEIGHT }
}

/// Forces and radius follow from the triangle of the grains.
#[test]
fn a_tube_closes_around_its_grains() {
    for dimension in [2, 3] {
        let (scene, outer, pressure) = tube(dimension);
        let area = |radius: f64| area_of_tube(dimension, radius);
        // By a fixed point: the force on the wall, and what the three press on each other with.
        let mut radius = outer;
        for _ in 0..50 {
            let press = pressure * area(radius) / 3.0;
            let between = press / 3.0_f64.sqrt();
            radius = (2.0 * R - between / KN) / 3.0_f64.sqrt() + R - press / KN;
        }
        for bench in benches() {
            let mut simulation = bench.start(&scene);
            let mut highest = 0.0_f64;
            for _ in 0..12 {
                simulation.advance(500).unwrap();
                let [pressing, radius] = on_wall(&mut simulation, 0);
                highest = highest.max(pressing / (pressure * area(radius)));
            }
            let [pressing, found] = on_wall(&mut simulation, 0);
            let off = (found - radius).abs() / (outer - radius);
            println!("{dimension}D on {}: at most {highest:.5}, off by {off:.1e}", bench.name);
            assert!(highest < 1.01 && (pressing / (pressure * area(found)) - 1.0).abs() < 1e-3, "{highest}");
            assert!(off < 2e-3, "{dimension}D on {}: {found:e}, expected {radius:e}", bench.name);
            assert!(scene.missed_forces(&simulation.walls().unwrap(), [pressing]).is_empty());
        }
    }
}

/// Contacts see how a wall has come to where it is, and not where its servo will move it: no momentum is lost as it changes
/// its speed.
#[test]
fn momentum_balances_at_driven_walls() {
    for scene in [tube(2).0, tube(3).0, oedometer(2)] {
        for bench in benches() {
            let (mut simulation, lid) = (bench.start(&scene), scene.walls.len() - 1);
            let presses = |_: &i32| {
                simulation.advance(200).unwrap();
                on_wall(&mut simulation, lid)[0] > 0.0
            };
            assert!((0..100).find(presses).is_some(), "{}: nothing presses", bench.name);
            for balance in balances(&mut simulation, 40).unwrap() {
                println!("{}: {balance:?}", bench.name);
                assert!(balance.holds() && balance.of != "energy", "{}: {balance:?}", bench.name);
            }
        }
    }
}

/// A loose bed in a box whose lid has a pressure: an oedometer.
fn oedometer(dimension: usize) -> Assembly {
    let side = if dimension == 2 { 8 } else { 4 };
    let mut scene = still(dimension);
    scene.grains = cloud(dimension, side, 0.01, 5);
    scene.grains.iter_mut().enumerate().for_each(|(k, g)| g.radius *= [1.0, 0.8, 0.9][k % 3]);
    let edge = side as f64 * SPACING;
    let pressure = if dimension == 2 { 20.0 } else { 1e4 };
    let axes = &[DVec3::X, DVec3::Y, DVec3::Z][..dimension];
    scene.walls = axes.iter().flat_map(|n| [plane(DVec3::ZERO, *n), plane(edge * *n, -*n)]).collect();
    let lid = scene.walls.pop().unwrap();
    // An inertial number of 1e-2 for the whole height.
    let most = 1e-2 * (pressure / RHO).sqrt() / (2.0 * R) * edge;
    let servo =
        Servo { target: Target::Pressure(pressure), area: None, gain: 0.03, max_speed: most, inertial_number: None };
    scene.walls.push(Wall { servo: Some(servo), ..lid });
    scene
}

#[test]
fn a_bed_comes_to_its_pressure() {
    for dimension in [2, 3] {
        let scene = oedometer(dimension);
        let lid = scene.walls.len() - 1;
        let area = scene.area_of_wall(lid).unwrap().of(&scene.walls, dimension);
        let Some(Servo { target: Target::Pressure(pressure), .. }) = scene.walls[lid].servo else { unreachable!() };
        let target = pressure * area;
        let mut ends = Vec::new();
        // A software driver takes long for the other one.
        for bench in benches().into_iter().filter(|bench| dimension == 2 || bench.name == CPU.name) {
            let mut simulation = bench.start(&scene);
            let (mut highest, mut at) = (0.0_f64, None);
            for k in 0..60 {
                simulation.advance(500).unwrap();
                let [pressing, _] = on_wall(&mut simulation, lid);
                highest = highest.max(pressing / target);
                let there = (pressing / target - 1.0).abs() < 0.01 && simulation.sample().unwrap().at_rest(1e-2);
                at = at.or(there.then_some(k));
            }
            let [pressing, position] = on_wall(&mut simulation, lid);
            println!("{dimension}D on {}: at most {highest:.4}, there after {at:?}, lid at {position:e}", bench.name);
            assert!(highest < 1.01, "{dimension}D on {}: {highest}", bench.name);
            assert!(at.is_some() && (pressing / target - 1.0).abs() < 0.01, "{pressing:e} of {target:e}");
            assert_eq!(simulation.lost_contacts(), 0);
            ends.push(position);
        }
        // Beds are chaotic, and heights of small ones differ by a part of a grain.
        let apart = ends.iter().map(|end| (end - ends[0]).abs()).fold(0.0, f64::max);
        assert!(apart < R, "{ends:?}");
    }
}

/// A few spheres in a tube, that fall, are pressed by a piston, more and then less, and by the tube.
const PRESS: &str = r#"
dimension = 3
[material.glass]
density = 2500
normal_stiffness = 200
friction = 0.3
restitution = 0.3
[[wall]]
kind = "cylinder"
name = "tube"
material = "glass"
center = [0, 0]
radius = 0.005
[[wall]]
kind = "plane"
name = "bottom"
material = "glass"
point = [0, 0, 0]
normal = [0, 0, 1]
[[wall]]
kind = "plane"
name = "piston"
material = "glass"
point = [0, 0, 0.012]
normal = [0, 0, -1]
[[population]]
material = "glass"
count = 60
radius = { uniform = [0.9e-3, 1.1e-3] }
region = { lower = [-0.005, -0.005, 0], upper = [0.005, 0.005, 0.012] }
[solver]
damping = 50
[stop]
time = 0.6
equilibrium = 5e-3
[output]
formats = ["csv"]
history = 1e-3
[[stage]]
name = "settle"
[[stage]]
name = "load"
wall.piston = { target_pressure = 250, max_speed = 0.1 }
[[stage]]
name = "more"
wall.piston = { target_pressure = 1000, inertial_number = 0.02 }
[[stage]]
name = "less"
wall.piston = { target_force = 0.0125, max_speed = 0.1 }
[[stage]]
name = "around"
wall.tube = { target_pressure = 500, max_speed = 0.02 }
"#;

fn packstone(folder: &Path, arguments: &str, code: i32) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_packstone"));
    let output = command.current_dir(folder).args(arguments.split(' ')).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments}: {said}");
    said
}

fn summary(folder: &Path, stage: &str) -> Value {
    let path = folder.join(format!("out/stages/{stage}/summary.json"));
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// Every stage ends when its pressure is there and the bed rests, without having gone beyond it, and the next one goes on
/// with walls where they are.
#[test]
fn stages_change_targets() {
    let without_gpu = std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|v| v == "1");
    for engine in if without_gpu { &["cpu"][..] } else { &["cpu", "gpu"] } {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        fs::write(folder.join("press.toml"), PRESS).unwrap();
        packstone(folder, &format!("run press.toml --engine {engine} --out out"), 0);
        let area = |radius: f64| PI * radius * radius;
        let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{value}"));
        let mut before = 0.012;
        for (stage, wall, target) in
            [("load", 2, 250.0), ("more", 2, 1e3), ("less", 2, 0.0125 / area(5e-3)), ("around", 0, 500.0)]
        {
            let summary = summary(folder, stage);
            assert_eq!((&summary["ended"], &summary["missed"]), (&"at rest".into(), &Value::Null), "{stage}");
            let of = &summary["walls"][wall];
            let height = number(&summary["walls"][2]["point"][2]);
            let area = if wall == 2 { area(5e-3) } else { 2.0 * PI * number(&of["radius"]) * height };
            let pressure = number(&of["normal_force"]) / area;
            assert!((pressure / target - 1.0).abs() < 0.011, "{stage} on {engine}: {pressure} Pa, {target} Pa");
            let text = fs::read_to_string(folder.join(format!("out/stages/{stage}/history.csv"))).unwrap();
            let name = if wall == 2 { "piston" } else { "tube" };
            let column = |what: &str| {
                let name = format!("walls.{name}.{what}");
                let column = text.lines().next().unwrap().split(',').position(|column| column == name).unwrap();
                text.lines()
                    .skip(1)
                    .map(|row| row.split(',').nth(column).unwrap().parse().unwrap())
                    .collect::<Vec<f64>>()
            };
            let (forces, positions) = (column("normal_force"), column("position"));
            // As a load is taken off, a bed may give way by itself.
            if stage != "less" {
                let highest = forces.iter().copied().fold(0.0, f64::max) / (target * area);
                println!("{stage} on {engine}: at most {highest:.4} in {} rows", forces.len());
                assert!(highest < 1.01, "{stage} on {engine}: {highest}");
            }
            if wall == 2 {
                assert!((-positions[0] - before).abs() < 1e-9, "{stage} begins at {}, not {before}", -positions[0]);
                before = height;
            }
        }
        let [load, more, less] =
            ["load", "more", "less"].map(|stage| number(&summary(folder, stage)["walls"][2]["point"][2]));
        assert!(more < load && more < less && less < load, "{load} {more} {less}");
        // A tube goes on with its radius.
        let radius = number(&summary(folder, "around")["walls"][0]["radius"]);
        let one = PRESS.split("[[stage]]").next().unwrap();
        fs::write(folder.join("again.toml"), one.replace("radius = 0.005\n", "radius = 0.005\nspin = 1\n")).unwrap();
        let said = packstone(folder, &format!("run again.toml --engine {engine} --steps 5 --from out --out again"), 0);
        assert!(said.contains("wall tube has moved"), "{said}");
        let again: Value =
            serde_json::from_str(&fs::read_to_string(folder.join("again/summary.json")).unwrap()).unwrap();
        assert!((number(&again["walls"][0]["radius"]) / radius - 1.0).abs() < 1e-12, "{again}");
    }
}

/// A servo that finds nothing ends the run; one that has too little time is told of.
#[test]
fn what_cannot_be_reached_is_told() {
    for bench in benches() {
        // Nothing carries the grain.
        let mut scene = still(2);
        scene.grains = vec![grain(0.0, R, 0.0)];
        scene.walls = vec![driven(plane(2.5 * R * DVec3::Y, -DVec3::Y), Target::Force(1.0), 0.01 * R / contact(2))];
        let message = bench.start(&scene).advance(100_000).unwrap_err().to_string();
        assert!(
            message.contains("\"plane\" has moved it by") && message.contains("finds too little to press on"),
            "{message}"
        );
        // More than its target weighs on it.
        scene.solver.damping = 0.0;
        scene.gravity = -G * DVec3::Y;
        let weight = mass(2, R) * G;
        scene.walls = vec![driven(plane(DVec3::ZERO, DVec3::Y), Target::Force(0.5 * weight), 0.01 * R / contact(2))];
        let message = bench.start(&scene).advance(100_000).unwrap_err().to_string();
        assert!(message.contains("away from the bed"), "{message}");
        // A tube around a single grain.
        scene.gravity = DVec3::ZERO;
        scene.grains[0].fixed = true;
        scene.grains[0].position = DVec3::ZERO;
        scene.walls = vec![driven(cylinder(2.0 * R), Target::Pressure(1.0), 0.01 * R / contact(2))];
        let message = bench.start(&scene).advance(100_000).unwrap_err().to_string();
        assert!(message.contains("has changed its radius by") && message.contains("through all"), "{message}");
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let text = PRESS.replace("[[stage]]\nname = \"more\"", "stop.steps = 100\n[[stage]]\nname = \"more\"");
    fs::write(folder.join("press.toml"), &text).unwrap();
    let said = packstone(folder, "run press.toml --engine cpu --out out", 1);
    let words = "wall \"piston\": target_pressure = 2.5e2 Pa was not reached: it is 0.0000e0 Pa";
    assert!(said.contains(words) && said.contains("stage load"), "{said}");
    // Without rest to wait for it is a doubt, and no more.
    let doubtful = text.replace("equilibrium = 5e-3\n", "").replace("time = 0.6", "steps = 50");
    fs::write(folder.join("press.toml"), doubtful).unwrap();
    let said = packstone(folder, "run press.toml --engine cpu --out out", 0);
    assert!(said.contains(&format!("warning: {words}")), "{said}");
    assert_eq!(summary(folder, "load")["missed"], Value::Null);
}

/// What a servo cannot be asked for is said in a sentence.
#[test]
fn what_a_servo_cannot_do_is_told() {
    let refused = |set: &[&str], words: &[&str]| {
        let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
        let text = PRESS.split("[[stage]]").next().unwrap();
        let scene = Scene::parse(text, "press.toml", Path::new("."), &set).and_then(|scene| scene.assemble());
        let message = scene.map(|_| ()).expect_err(&format!("{set:?} is accepted")).to_string();
        words.iter().for_each(|word| assert!(message.contains(word), "{set:?}: {message}"));
    };
    let (force, pressure) = ("wall.piston.target_force=1", "wall.piston.target_pressure=1");
    let most = "wall.piston.max_speed=1";
    refused(&[force], &["wall.2", "missing key `max_speed`"]);
    refused(&[most], &["wall.2.max_speed", "goes with target_force or target_pressure"]);
    refused(&[force, pressure, most], &["wall.2.target_pressure", "target_force is given, too"]);
    let inertial = "wall.piston.inertial_number=1e-3";
    refused(&[inertial], &["wall.2.inertial_number", "goes with target_force or target_pressure"]);
    refused(&[force, most, inertial], &["wall.2.inertial_number", "max_speed is given, too"]);
    refused(&[force, "wall.piston.inertial_number=0"], &["wall.2.inertial_number = 0", "positive"]);
    let tilted = "wall.piston.normal=[0,0.1,-1]";
    refused(&[force, inertial, tilted], &["\"piston\" has an inertial_number", "give `area`"]);
    refused(&["wall.piston.target_force=-1", most], &["wall.2.target_force = -1", "positive"]);
    refused(&[force, most, "wall.piston.gain=2"], &["wall.2.gain = 2", "at most 1"]);
    refused(&[force, most, "wall.piston.area=1"], &["wall.2.area", "goes with target_pressure"]);
    refused(&[force, most, "solver.method=cd"], &["wall.2.target_force", "method = \"dem\""]);
    refused(&[force, most, "wall.piston.start=1"], &["wall.2.target_force", "not for a wall that a servo moves"]);
    refused(&[force, most, "wall.piston.velocity=[0,0,1]"], &["wall.2.velocity", "along the wall"]);
    refused(&[pressure, most, tilted], &["\"piston\" has a target_pressure", "give `area`"]);
    refused(&["wall.tube.target_force=1", "wall.tube.max_speed=1"], &["wall.0.target_force", "is for planes"]);
}

/// The most of a speed follows from the inertial number, the target and the bed.
#[test]
fn an_inertial_number_limits_the_speed() {
    let speed = |set: &[&str]| {
        let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
        let text = PRESS.split("[[stage]]").next().unwrap();
        let scene = Scene::parse(text, "press.toml", Path::new("."), &set).unwrap().assemble().unwrap();
        let mean = 2.0 * scene.grains.iter().map(|g| g.radius).sum::<f64>() / scene.grains.len() as f64;
        let ends = |of: &dyn Fn(&Grain, f64) -> f64| {
            scene.grains.iter().flat_map(|g| [-g.radius, g.radius].map(|r| of(g, r))).fold(f64::NEG_INFINITY, f64::max)
        };
        let depth = ends(&|g, r| g.position.z + r) + ends(&|g, r| r - g.position.z);
        let across = ends(&|g, r| g.position.truncate().length() + r);
        let rate = 1e-2 * (1000.0_f64 / 2500.0).sqrt() / mean;
        (scene.walls.iter().filter_map(|wall| wall.servo).next().unwrap().max_speed, rate * depth, rate * across)
    };
    let (found, expected, _) = speed(&["wall.piston.target_pressure=1000", "wall.piston.inertial_number=1e-2"]);
    close("of a pressure", found, expected, expected, 1e-12);
    let force = format!("wall.piston.target_force={}", 1000.0 * PI * 2.5e-5);
    let (found, expected, _) = speed(&[&force, "wall.piston.inertial_number=1e-2"]);
    close("of a force", found, expected, expected, 1e-12);
    let (found, _, expected) = speed(&["wall.tube.target_pressure=1000", "wall.tube.inertial_number=1e-2"]);
    close("of a tube", found, expected, expected, 1e-12);
}
