//! Contact dynamics and DEM of the same scenes: packings and a collapse.

use super::common::*;
use super::figure::{Figure, Length};
use super::scenes::{changed_scene, compliant};
use crate::{
    body::bodies::body,
    contact::contacts::closed_contacts,
    measure::{backbone, contacts::contact_of},
    scene::{Assembly, Dashpot},
    simulation::Simulation,
    state::{array::*, present},
};
use std::f64::consts::PI;

/// Contacts by the numbers of the grains, walls after them.
fn pairs(simulation: &mut Simulation) -> Vec<(u32, u32)> {
    simulation.sample().unwrap(); // lists that reach
    let model = *simulation.model();
    let arrays = [
        &POSITION,
        &POSITION_LOW,
        &VELOCITY,
        &SPIN,
        &ID,
        &LIST_START,
        &NEIGHBOUR,
        &TANGENTIAL_FORCE,
        &IMPULSE,
        &WALL,
        &MATERIAL,
    ];
    let s = simulation.read(&present(&model, &arrays)).unwrap();
    let of = |i: usize| closed_contacts(s, i, &body(s, i), contact_of).map(move |(j, _)| (i, j)).collect::<Vec<_>>();
    let inner = (0..s.sizes.bodies).flat_map(of).filter(|(i, j)| i < j);
    inner.map(|(i, j)| (s.id[i], s.id.get(j).copied().unwrap_or(j as u32))).collect()
}

/// Volume of a sphere below a height, m³.
fn below(grain: &crate::scene::Grain, height: f64) -> f64 {
    let t = (height - grain.position.z + grain.radius).clamp(0.0, 2.0 * grain.radius);
    PI / 3.0 * t * t * (3.0 * grain.radius - t)
}

/// Packing fraction between 20 % and 80 % of the bed's height, and mean number of contacts of the grains there that are
/// no rattlers.
fn packing(simulation: &mut Simulation, least: usize) -> (f64, f64) {
    let pairs = pairs(simulation);
    let grains = simulation.grains().unwrap();
    let domain = simulation.assembly().domain;
    let area = (domain.upper - domain.lower).truncate();
    // The middle of the grains, twice: one grain on top of the bed must not count.
    let height = 2.0 * grains.iter().map(|g| g.position.z).sum::<f64>() / grains.len() as f64;
    let (low, high) = (0.2 * height, 0.8 * height);
    let solid: f64 = grains.iter().map(|g| below(g, high) - below(g, low)).sum();
    let inside: Vec<bool> = grains.iter().map(|g| (low..high).contains(&g.position.z)).collect();
    let carries = backbone(&inside, &pairs, least);
    let mut contacts = vec![0_u32; grains.len()];
    for (i, j) in pairs.into_iter().map(|(i, j)| (i as usize, j as usize)) {
        if carries[i] && carries.get(j).is_none_or(|carries| *carries) {
            contacts[i] += 1;
            contacts.get_mut(j).into_iter().for_each(|count| *count += 1);
        }
    }
    let counted: Vec<u32> = (0..grains.len()).filter(|i| inside[*i] && carries[*i]).map(|i| contacts[i]).collect();
    (solid / (area.x * area.y * (high - low)), f64::from(counted.iter().sum::<u32>()) / counted.len() as f64)
}

/// Mean and its standard error.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (mean, (variance / n).sqrt())
}

/// Springs that this many weights compress by 1e-4 R, and that hardly rebound.
fn stiff(rigid: &Assembly, weights: f64) -> Assembly {
    let stiffness = weights * mass(rigid.dimension, R) * G / (1e-4 * R);
    let mut scene =
        compliant(rigid, stiffness, 0.03 * (mass(rigid.dimension, R) / stiffness).sqrt(), rigid.solver.damping);
    scene.pairs.iter_mut().for_each(|pair| pair.dashpot = Dashpot::Restitution(0.05));
    scene
}

/// At the end of a scene.
fn finished(bench: Bench, scene: &Assembly) -> Simulation {
    let mut simulation = bench.start(scene);
    let steps = (scene.stop.time.expect("an end") / simulation.dt()).round();
    simulation.advance(steps as u64).unwrap();
    simulation
}

/// How the short cases are solved: what a packing is does not depend on it, and this takes a third of the passes.
const QUICK: &str = "solver.relaxation=coloured-accelerated";

pub fn agreement_smooth(bench: Bench, length: Length) -> Vec<Figure> {
    // Nothing but collisions stops them, and the last ones are slow.
    beds(bench, length, 0.0, 4, 0.6)
}

pub fn agreement_rough(bench: Bench, length: Length) -> Vec<Figure> {
    beds(bench, length, 0.5, 3, 0.2)
}

/// Beds of several seeds that both methods settle from the same state. Rattlers are grains with fewer contacts than can
/// hold a grain: 4 without friction, 3 with. The small beds of the tests differ by chance: the difference of two beds
/// of 400 grains has a standard deviation of 0.005 in the fraction and 0.15 in the number of contacts, of which three
/// are allowed.
fn beds(bench: Bench, length: Length, friction: f64, least: usize, time: f64) -> Vec<Figure> {
    let full = length == Length::Full;
    let (seeds, weights) = if full { (1..=3, 80.0) } else { (1..=2, 8.0) };
    let (mut fractions, mut contacts) = ([vec![], vec![]], [vec![], vec![]]);
    let (mut overlap, mut unsolved, mut steps, mut grains) = (0.0, 0, 0, 0);
    for seed in seeds {
        let set = [
            format!("seed={seed}"),
            format!("material.glass.friction={friction}"),
            format!("stop.time={time}"),
            "population.0.count=200".to_owned(),
            "domain.upper=[0.01, 0.01, 0.2]".to_owned(),
            QUICK.to_owned(),
        ];
        let set: Vec<&str> = set[..if full { 3 } else { 6 }].iter().map(String::as_str).collect();
        let given = changed_scene("agreement_bed", &set);
        grains = given.grains.len();
        let mut rigid = finished(bench, &given);
        let solved = *rigid.solver_statistics().unwrap();
        (unsolved, steps) = (unsolved + solved.unconverged, steps + solved.steps);
        let mut springs = finished(bench, &stiff(&given, weights));
        overlap = f64::max(overlap, springs.sample().unwrap().max_overlap_over_radius);
        for (k, simulation) in [&mut rigid, &mut springs].into_iter().enumerate() {
            let (fraction, z) = packing(simulation, least);
            fractions[k].push(fraction);
            contacts[k].push(z);
        }
    }
    let mut figures = Vec::new();
    for (what, of, target, chance) in
        [("packing fraction", fractions, 0.005, 0.005), ("coordination number", contacts, 0.15, 0.15)]
    {
        let [rigid, springs] = &of;
        let differences: Vec<f64> = rigid.iter().zip(springs).map(|(a, b)| a - b).collect();
        let ((rigid, _), (springs, _), (difference, error)) = (mean(rigid), mean(springs), mean(&differences));
        let chance = chance * (400.0 / grains as f64 / differences.len() as f64).sqrt();
        let limit = if full { target } else { target + 3.0 * chance };
        figures.push(Figure::new(format!("CD: {what}"), springs, limit, rigid));
        figures.push(Figure::zero(format!("CD − DEM: {what}"), limit, difference));
        figures.push(Figure::zero(format!("standard error of that, {} beds", differences.len()), limit, error));
    }
    figures.push(Figure::zero("DEM: overlap over R at most", 1e-4 * 80.0 / weights, overlap));
    figures.push(Figure::new(
        format!("CD: of {steps} steps, not solved"),
        0.5 * steps as f64,
        0.5 * steps as f64,
        unsolved as f64,
    ));
    figures
}

/// A column of disks that collapses on a rough floor: the mean distance from the middle, and those within which 90 %
/// and 99 % of the disks end. The last are single disks that roll on, and differ from column to column.
pub fn agreement_collapse(bench: Bench, length: Length) -> Vec<Figure> {
    let full = length == Length::Full;
    let mut ratios = [vec![], vec![], vec![]];
    let fewer = [
        "population.1.count=200",
        "population.1.region.lower=[-0.0115, 0.00205]",
        "population.1.region.upper=[0.0115, 1]",
        "stop.time=0.3",
        QUICK,
    ];
    for seed in if full { 1..=6 } else { 1..=3 } {
        let seed = format!("seed={seed}");
        let set = [&[seed.as_str()][..], if full { &[] } else { &fewer }].concat();
        let given = changed_scene("agreement_collapse", &set);
        let [rigid, springs] = [given.clone(), stiff(&given, 4.0)].map(|scene| {
            let grains = finished(bench, &scene).grains().unwrap();
            let mut away: Vec<f64> = grains.iter().filter(|g| !g.fixed).map(|g| g.position.x.abs() / R).collect();
            away.sort_by(f64::total_cmp);
            let n = away.len();
            [away.iter().sum::<f64>() / n as f64, away[n * 90 / 100], away[n * 99 / 100]]
        });
        ratios.iter_mut().zip(rigid.iter().zip(springs)).for_each(|(ratios, (a, b))| ratios.push(a / b));
    }
    let what = ["mean distance", "90 % within", "99 % within"];
    // Standard deviations of the ratio of two columns of 500 disks, measured.
    let chances = [0.023, 0.015, 0.057];
    let figures = what.iter().zip(&ratios).zip(chances).flat_map(|((what, ratios), chance)| {
        let (ratio, error) = mean(ratios);
        let chance = chance * (500.0 / 200.0 / ratios.len() as f64).sqrt();
        let limit = if full { 0.05 } else { 0.05 + 3.0 * chance };
        [
            Figure::new(format!("CD over DEM: {what}"), 1.0, limit, ratio),
            Figure::zero(format!("standard error of that, {} columns", ratios.len()), limit, error),
        ]
    });
    figures.collect()
}
