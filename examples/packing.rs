//! Pours spheres into a box with and without friction and compares the packings: friction makes them looser.
//!
//! `cargo run --release --example packing`

use packstone::prelude::*;

fn main() -> packstone::Result<()> {
    let (smooth, rough) = (packing(0.0)?, packing(0.5)?);
    assert!(smooth.0 > rough.0 + 0.02, "friction must loosen the packing: {smooth:?} {rough:?}");
    assert!((0.55..0.66).contains(&smooth.0) && (0.52..0.62).contains(&rough.0), "{smooth:?} {rough:?}");
    assert!(smooth.1 > rough.1, "friction must lower the coordination number");
    Ok(())
}

/// Packing fraction and coordination number of 800 spheres at rest, periodic sideways.
fn packing(friction: f64) -> packstone::Result<(f64, f64)> {
    let glass = MaterialBuilder::new(2500.0).normal_stiffness(2000.0).friction(friction).restitution(0.3);
    let assembly = Scene::builder(3)
        .domain([0.0; 3], [0.016, 0.016, 0.3], [Face::Periodic, Face::Periodic, Face::Open])
        .material("glass", glass)
        .wall(WallBuilder::plane("glass", [0.0; 3], [0.0, 0.0, 1.0]))
        .population(PopulationBuilder::new("glass", 800, Radii::uniform(0.9e-3, 1.1e-3)).velocity_spread(0.1))
        .solver(SolverBuilder::discrete_elements().damping(20.0))
        .stop_time(0.15)
        .assemble()?;
    let mut simulation = Simulation::new(assembly, Options { engine: EngineChoice::Cpu, ..Options::default() })?;
    if friction == 0.0 {
        println!("{}", simulation.notice());
    }
    simulation.advance((0.15 / simulation.dt()) as u64)?;
    let sample = simulation.sample()?;
    let grains = simulation.grains()?;
    let fraction = packing_fraction(simulation.assembly(), &grains, &simulation.assembly().walls)
        .expect("800 grains have an inside")
        .value;
    println!("friction {friction}: packing fraction {fraction:.4}, coordination {:.3}", sample.coordination_number);
    Ok((fraction, sample.coordination_number))
}
