//! Many rigid grains, and springs beside them.

use super::common::*;
use super::figure::{Figure, Length, worse};
use super::scenes::{changed_scene, compliant, relaxation, scene, solved_to};
use crate::{
    measure::{Sample, masses},
    scene::{Assembly, Dashpot, Grain},
};

/// Kinetic energy of translation, J.
fn kinetic(grains: &[Grain], masses: &[f64]) -> f64 {
    grains.iter().zip(masses).map(|(g, m)| 0.5 * m * g.velocity.length_squared()).sum()
}

/// A square of 9 grains and a cube of 27 that overlap by 20 %. Along every row of three the overlaps open at the speed
/// allowed, so that the outer two leave at that speed: ½ m v² for two of three grains along each axis.
pub fn rigid_overlap(bench: Bench, _: Length) -> Vec<Figure> {
    let cube = solved_to(scene("rigid_overlap"), bench.pick(1e-8, 1e-5));
    let speed = relaxation(&mut cube.clone()).max_correction_velocity.expect("a speed");
    let mut square = cube.clone();
    square.dimension = 2;
    square.grains.retain(|g| g.position.z == 0.0);
    let mut figures = Vec::new();
    for given in [square, cube] {
        let dimension = given.dimension;
        let masses = masses(&given);
        let (n, rows) = (masses.len() as f64, masses.len() as f64 / 3.0 * dimension as f64);
        let allowed = 2.0 / 3.0 * n * dimension as f64 * 0.5 * masses[0] * speed * speed;
        let mut simulation = bench.start(&given);
        let (mut least, mut most) = (f64::INFINITY, 0.0);
        for _ in 0..8 {
            simulation.advance(1).unwrap();
            let energy = kinetic(&simulation.grains().unwrap(), &masses) / allowed;
            (least, most) = (energy.min(least), worse(most, energy));
        }
        let unsolved = simulation.solver_statistics().unwrap().unconverged as f64;
        let grains = simulation.grains().unwrap();
        let overlap = 2.0 - (grains[1].position - grains[0].position).length() / R;
        let limit = bench.pick(1e-6, 1e-4);
        let what = format!("CD, {dimension}D: kinetic energy over that of the speed allowed");
        figures.extend([
            Figure::new(format!("{what}, least"), 1.0, limit, least),
            Figure::new(format!("{what}, most"), 1.0, limit, most),
            Figure::zero(format!("CD, {dimension}D: steps not solved"), 0.0, unsolved),
            // Eight steps of v Δt, from 0.2 R; what is less than 1e-4 R is none.
            Figure::new(
                format!("CD, {dimension}D: overlap left over R"),
                0.2 - 8.0 * speed * 1e-3 / R,
                1.01e-4,
                overlap,
            ),
        ]);
        // Two contacts in each row.
        let stored = 2.0 * rows * 0.5 * KN * (0.2 * R).powi(2);
        let dt = 0.03 * (masses[0] / KN).sqrt();
        let energy = kinetic(&bench.after(&compliant(&given, KN, dt, 0.0), 300), &masses);
        figures.extend([
            // (ω Δt)², up to 3 ω² = 3 k_N/m.
            Figure::new(
                format!("DEM, {dimension}D: kinetic energy over that of the springs"),
                1.0,
                2e-3,
                energy / stored,
            ),
            Figure::new(
                format!("DEM, {dimension}D: kinetic energy over that of the speed allowed"),
                stored / allowed,
                2e-3 * stored / allowed,
                energy / allowed,
            ),
        ]);
    }
    figures
}

/// The end of a fall into a box.
fn fallen(what: &str, sample: &Sample, lost: u64, height: f64, overlap: f64) -> Vec<Figure> {
    vec![
        Figure::zero(format!("{what}: contacts whose history is lost"), 0.0, lost as f64),
        Figure::new(format!("{what}: contacts of a grain, mean"), 3.5, 2.5, sample.coordination_number),
        Figure::zero(format!("{what}: overlap over the smaller R, largest"), overlap, sample.max_overlap_over_radius),
        Figure::zero(format!("{what}: kinetic energy over that of a fall by R"), 0.1, sample.kinetic_energy / height),
    ]
}

/// Energy of all grains that fall by the smallest radius, J.
fn fall(scene: &Assembly) -> f64 {
    let smallest = scene.grains.iter().map(|g| g.radius).fold(f64::INFINITY, f64::min);
    masses(scene).iter().sum::<f64>() * G * smallest
}

/// Springs that the weight of a grain of radius R compresses by 1e-4 R, with a restitution of 0.1.
fn soft(rigid: &Assembly) -> Assembly {
    let mut scene = compliant(rigid, mass(rigid.dimension, R) * G / (1e-4 * R), 5e-6, 0.0);
    scene.pairs.iter_mut().for_each(|pair| pair.dashpot = Dashpot::Restitution(0.1));
    scene
}

/// Without friction, and with more than any real surface has. The latter is hard: relaxations of all kinds leave many
/// steps unsolved (they are counted), but no grain is lost, nothing flies off and overlaps stay small.
pub fn rigid_friction(bench: Bench, _: Length) -> Vec<Figure> {
    let mut figures = Vec::new();
    for mu in [0.0, 10.0] {
        let mut given = scene("rigid_friction");
        given.pairs.iter_mut().for_each(|pair| pair.friction = mu);
        if mu == 0.0 {
            relaxation(&mut given).max_iterations = 1000;
        }
        let mut simulation = bench.start(&given);
        simulation.advance(60).unwrap();
        let (solved, sample) = (*simulation.solver_statistics().unwrap(), simulation.sample().unwrap());
        let unsolved = if mu == 0.0 { (0.0, 0.0) } else { (30.0, 30.0) };
        figures.push(Figure::new(
            format!("CD, μ = {mu}: of 60 steps, not solved"),
            unsolved.0,
            unsolved.1,
            solved.unconverged as f64,
        ));
        let overlap = if mu == 0.0 { 0.01 } else { 0.05 };
        figures.extend(fallen(&format!("CD, μ = {mu}"), &sample, simulation.lost_contacts(), fall(&given), overlap));
        let mut simulation = bench.start(&soft(&given));
        simulation.advance((0.06 / simulation.dt()) as u64).unwrap();
        let sample = simulation.sample().unwrap();
        figures.extend(fallen(&format!("DEM, μ = {mu}"), &sample, simulation.lost_contacts(), fall(&given), 0.01));
    }
    figures
}

/// 10,000 grains, or the few hundred that a test can afford.
pub fn rigid_settling_2d(bench: Bench, length: Length) -> Vec<Figure> {
    let fewer = [
        "population.0.count=2",
        "population.1.count=198",
        "wall.0.upper=[0.05, 2]",
        "population.0.region.upper=[0.05, 0.05]",
    ];
    settling(bench, changed_scene("rigid_settling_2d", if length == Length::Full { &[] } else { &fewer }))
}

pub fn rigid_settling_3d(bench: Bench, length: Length) -> Vec<Figure> {
    let fewer = [
        "population.0.count=2",
        "population.1.count=498",
        "wall.0.upper=[0.025, 0.025, 2]",
        "population.0.region.upper=[0.025, 0.025, 0.05]",
        "stop.time=0.08",
    ];
    settling(bench, changed_scene("rigid_settling_3d", if length == Length::Full { &[] } else { &fewer }))
}

/// Grains of two sizes, 1:10, fall into a box until they are at rest. How many steps end unsolved is told, not judged:
/// relaxations need many passes where one grain is a thousand times as heavy as those that carry it.
fn settling(bench: Bench, given: Assembly) -> Vec<Figure> {
    let time = given.stop.time.expect("an end");
    let mut simulation = bench.start(&given);
    let steps = (time / simulation.dt()).round();
    simulation.advance(steps as u64).unwrap();
    let (solved, sample) = (*simulation.solver_statistics().unwrap(), simulation.sample().unwrap());
    let unsolved = solved.unconverged as f64;
    let mut figures = vec![
        Figure::new(format!("CD: of {steps} steps, not solved"), 0.5 * steps, 0.5 * steps, unsolved),
        Figure::new("CD: passes of a step, mean", 500.0, 500.0, solved.iterations as f64 / steps),
    ];
    figures.extend(fallen("CD", &sample, simulation.lost_contacts(), fall(&given), 0.01));
    let mut simulation = bench.start(&soft(&given));
    simulation.advance((time / simulation.dt()).round() as u64).unwrap();
    let sample = simulation.sample().unwrap();
    figures.extend(fallen("DEM", &sample, simulation.lost_contacts(), fall(&given), 0.1));
    figures
}
