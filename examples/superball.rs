//! Oblique bounce of a sphere with k_T = 2/7 k_N, in steps: below a ratio of 3.5 between tangential and (friction
//! times) normal speed the contact point's velocity is reversed without any loss; above, the contact slides all the
//! time and keeps 7 of it less. Prints both, then checks itself against that closed form.
//!
//! `cargo run --release --example superball`

use packstone::prelude::*;

fn main() -> packstone::Result<()> {
    let (friction, v_n) = (0.3, 0.005); // slow, so that the overlap stays far below the radius
    println!("psi in   psi out   closed form");
    for psi in [0.5, 1.5, 2.5, 3.4, 4.0, 6.0, 8.0] {
        let out = bounce(psi, friction, v_n)?;
        let exact = if psi < 3.5 { -psi } else { psi - 7.0 };
        println!("{psi:6.2} {out:9.4} {exact:13.4}");
        assert!((out - exact).abs() < 2e-3, "the contact law is wrong: {out} instead of {exact}");
    }
    Ok(())
}

/// Tangential velocity of the contact point after the bounce, in units of friction × normal speed.
fn bounce(psi: f64, friction: f64, v_n: f64) -> packstone::Result<f64> {
    let ball = GrainBuilder::new("rubber", [0.0, 0.0, 0.01], 0.01).velocity([psi * friction * v_n, 0.0, -v_n]);
    let assembly = Scene::builder(3)
        .gravity([0.0; 3])
        .material("rubber", MaterialBuilder::new(1000.0).normal_stiffness(1e5).friction(friction))
        .wall(WallBuilder::plane("rubber", [0.0; 3], [0.0, 0.0, 1.0]))
        .grain(ball)
        .solver(SolverBuilder::discrete_elements().dt(1e-6))
        .stop_time(2e-3)
        .assemble()?;
    let options = Options { engine: EngineChoice::Cpu, ..Options::default() };
    let mut simulation = Simulation::new(assembly, options)?;
    simulation.advance(2000)?;
    let grains = simulation.columns()?;
    // Contact point: v + ω × (-R e_z).
    let slip = grains.velocity[0].x - grains.spin[0].y * grains.radius[0];
    Ok(slip / (friction * v_n))
}
