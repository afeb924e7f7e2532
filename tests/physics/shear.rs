//! A cell that Lees and Edwards shear, against a bulk between rough walls that slide past each other.

use packstone::{
    measure::{Packing, micromechanics::Cell, micromechanics::profile},
    prelude::*,
};

/// N/m, 1/s, and the sides of the space at the start, m.
const PRESSURE: f64 = 10.0;
const RATE: f64 = 1.6;
const LENGTH: f64 = 0.04;
const HEIGHT: f64 = 0.047;
/// How high they stand when dense, m, without the layers that stick to walls.
const DENSE: f64 = 0.021;

/// Disks with friction, under the same pressure across the shear.
fn scene(boundary: &str, stop: &str, rest: &str) -> Simulation {
    let text = format!(
        r#"
dimension = 2
seed = 2
gravity = [0, 0]
{stop}
[domain]
lower = [0, 0]
upper = [{LENGTH}, {HEIGHT}]
boundary = ["periodic", "{boundary}"]
[material.beads]
density = 2500
normal_stiffness = 2e3
friction = 0.4
restitution = 0.5
[material.wall]
density = 2500
normal_stiffness = 2e3
friction = 0.4
restitution = 0.5
[[pair]]
materials = ["wall", "beads"]
friction = 2
rolling_friction = 2
[[population]]
material = "beads"
count = 250
radius = {{ uniform = [0.8e-3, 1.2e-3] }}
placement = "random"
region = {{ lower = [0, 0], upper = [{LENGTH}, {HEIGHT}] }}
{rest}"#
    );
    let assembly = Scene::parse(&text, "shear", ".".as_ref(), &[]).and_then(|scene| scene.assemble());
    let options = Options { engine: EngineChoice::Cpu, ..Options::default() };
    Simulation::new(assembly.unwrap_or_else(|error| panic!("{error}")), options).unwrap()
}

/// Over the strains from 3 to 7, of what is seen every 0.05.
fn mean<const N: usize>(simulation: &mut Simulation, mut see: impl FnMut(&mut Simulation) -> [f64; N]) -> [f64; N] {
    let steps = |strain: f64| (strain / RATE / simulation.dt()) as u64;
    let (before, between) = (steps(3.0), steps(0.05));
    simulation.advance(before).unwrap();
    let mut sum = [0.0; N];
    const SEEN: usize = 80;
    for _ in 0..SEEN {
        simulation.advance(between).unwrap();
        sum.iter_mut().zip(see(simulation)).for_each(|(sum, x)| *sum += x / SEEN as f64);
    }
    sum
}

#[test]
fn a_periodic_cell_has_the_friction_of_a_bulk_between_walls() {
    let cell =
        format!("[cell]\nstrain_rate.xy = {RATE}\nstress.yy = {PRESSURE}\ninertial_number = 0.05\ngain = 1e-2\n");
    let mut periodic = scene("periodic", "stop.strain.xy = 100", &cell);
    let [shear, pressure, fraction] = mean(&mut periodic, |simulation| {
        let sample = simulation.sample().unwrap();
        let cell = sample.cell.unwrap();
        [-cell.stress_xy.unwrap(), cell.stress_yy.unwrap(), cell.solid_fraction.unwrap()]
    });
    let walls = [("bottom", 0.0, 1.0, -1.0), ("top", HEIGHT, -1.0, 1.0)].map(|(name, y, normal, sense)| {
        let target = if sense > 0.0 { format!("target_pressure = {PRESSURE}\nmax_speed = 0.02") } else { String::new() };
        let speed = sense * 0.5 * RATE * DENSE;
        format!(
            "[[wall]]\nkind = \"plane\"\nname = \"{name}\"\nmaterial = \"wall\"\npoint = [0, {y}]\nnormal = [0, {normal}]\nvelocity = [{speed}, 0]\n{target}\n"
        )
    });
    let mut between = scene("open", "stop.time = 100", &walls.concat());
    let [slide, load, sliding, compression, rate, bulk] = mean(&mut between, |simulation| {
        let loads = simulation.wall_loads().unwrap();
        let (grains, walls) = (simulation.grains().unwrap(), simulation.walls().unwrap());
        let contacts = simulation.contacts().unwrap();
        let packing = Packing::new(simulation.assembly(), &grains, &[], &walls, &contacts);
        let cell = Cell::of(&packing).unwrap();
        let slabs = profile::profile(&packing, &cell, 1, cell.upper.y / 8.0);
        let sum = |of: &dyn Fn(&profile::Part) -> f64| slabs[2..6].iter().map(of).sum::<f64>() / 4.0;
        let speed = |k: usize| slabs[k].velocity.unwrap().x;
        let rate = (speed(5) + speed(4) - speed(3) - speed(2)) / (cell.upper.y / 2.0);
        let bulk = [
            -sum(&|part| part.stress.total[0][1]),
            sum(&|part| part.stress.total[1][1]),
            rate,
            sum(&|part| part.solid_fraction),
        ];
        let on_top = [-loads[1].force.x, loads[1].normal_force].map(|force| force / LENGTH);
        [on_top[0], on_top[1], bulk[0], bulk[1], bulk[2], bulk[3]]
    });
    let (friction, of_walls, of_bulk) = (shear / pressure, slide / load, sliding / compression);
    println!("cell: {friction} of {pressure}, fraction {fraction}");
    println!("walls: {of_walls} of {load}, bulk {of_bulk} of {compression} at {rate}, fraction {bulk}");
    assert!((0.7..1.2).contains(&(rate / RATE)), "the bulk is sheared");
    let near = |found: f64, expected: f64, part: f64| (found / expected - 1.0).abs() < part;
    assert!(near(sliding, slide, 0.05) && near(compression, load, 0.05), "the bulk carries what the walls do");
    assert!(near(pressure, PRESSURE, 0.05) && near(of_bulk, friction, 0.1));
    assert!((bulk - fraction).abs() < 0.02);
}
