//! Pours a hundred glass beads into a box and lets them come to rest. The floor then carries their weight.
//!
//! `cargo run --release --example first_packing`

use packstone::prelude::*;

const RADIUS: f64 = 1e-3; // m
const DENSITY: f64 = 2500.0; // kg/m³

fn main() -> packstone::Result<()> {
    let glass = MaterialBuilder::new(DENSITY).normal_stiffness(2e3).friction(0.4).restitution(0.5);
    let faces = [Side::XLower, Side::XUpper, Side::YLower, Side::YUpper, Side::ZLower];
    let assembly = Scene::builder(3)
        .title("first packing")
        .material("glass", glass)
        .wall(WallBuilder::box_between("glass", [0.0; 3], [0.01, 0.01, 0.1]).faces(faces))
        .population(PopulationBuilder::new("glass", 100, RADIUS).velocity_spread(0.05))
        .solver(SolverBuilder::discrete_elements().damping(20.0))
        .stop_time(0.5)
        .assemble()?;
    let count = assembly.grains.len();

    let mut simulation = Simulation::new(assembly, Options { engine: EngineChoice::Cpu, ..Options::default() })?;
    println!("{}, {count} beads, steps of {:.2e} s", simulation.notice(), simulation.dt());
    simulation.advance((0.5 / simulation.dt()) as u64)?;

    let sample = simulation.sample()?;
    let beads = simulation.columns()?;
    let top = beads.position.iter().map(|x| x.z + RADIUS).fold(0.0, f64::max);
    println!("{:.1} mm high, {:.2} contacts per bead", 1e3 * top, sample.coordination_number);

    // Every force between beads has its opposite, so what is left of the sum is what floor and walls do.
    let carried: f64 = simulation.forces()?.iter().map(|(force, _)| force.z).sum();
    let weight = count as f64 * DENSITY * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3) * 9.81;
    println!("floor and walls carry {:.4} of the weight", carried / weight);
    assert!((carried / weight - 1.0).abs() < 1e-2, "the packing is not at rest");
    Ok(())
}
