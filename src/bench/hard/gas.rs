//! A gas without gravity, for long.

use super::common::*;
use super::figure::{Figure, Length};
use super::scenes::scene;
use crate::measure::{masses, momentum};

/// Elastic spheres in a periodic box until they have collided 10^6 times: an elastic collision lasts π √(m*/k_N), so
/// the number of contacts, averaged over the run, counts them.
pub fn gas(bench: Bench, length: Length) -> Vec<Figure> {
    let scene = scene("gas");
    let masses = masses(&scene);
    let scale: f64 = scene.grains.iter().zip(&masses).map(|(g, m)| m * g.velocity.length()).sum();
    let mut simulation = bench.start(&scene);
    let before = simulation.sample().unwrap();
    let contact = std::f64::consts::PI * (0.5 * masses[0] / scene.pairs[0].normal_stiffness).sqrt();
    let wanted = length.of(1_000_000) as f64;
    let mut collisions = 0.0;
    while collisions < wanted {
        let start = simulation.time();
        simulation.advance(50).unwrap();
        let sample = simulation.sample().unwrap();
        assert!(sample.contacts > 0 || collisions > 0.0 || simulation.step() < 10_000, "nothing collides");
        collisions += sample.contacts as f64 * (simulation.time() - start) / contact;
    }
    let after = simulation.sample().unwrap();
    let moved = momentum(&simulation.grains().unwrap(), &masses) - momentum(&scene.grains, &masses);
    let energy = (after.kinetic_energy + after.elastic_energy) / (before.kinetic_energy + before.elastic_energy);
    // A touch between two steps gives or takes up to (ω Δt)²/4 of a pair's energy, at random.
    let touch = (std::f64::consts::PI * simulation.dt() / contact).powi(2) / 4.0;
    let heating = touch * wanted.sqrt() / (0.5 * scene.grains.len() as f64);
    vec![
        Figure::new("collisions", 1.01 * wanted, 0.01 * wanted, collisions),
        Figure::zero("change of momentum over Σ m v", bench.pick(1e-13, 1e-6), moved.length() / scale),
        Figure::new("energy over that of the start", 1.0, heating, energy),
    ]
}
