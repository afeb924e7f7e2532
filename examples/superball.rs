//! Oblique bounce of a sphere with k_T = 2/7 k_N, in steps: below a ratio of 3.5 between tangential and (friction times)
//! normal speed the contact point's velocity is reversed without any loss; above, the contact slides all the time and
//! keeps 7 of it less. Prints both, then checks itself against that closed form.
//!
//! `cargo run --release --example superball`

use packstone::{
    scene::Scene,
    simulation::{EngineChoice, Options, Simulation},
};

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
    let text = format!(
        r#"
        dimension = 3
        gravity = [0, 0, 0]
        [material.rubber]
        density = 1000
        normal_stiffness = 1e5
        friction = {friction}
        [[wall]]
        kind = "plane"
        material = "rubber"
        point = [0, 0, 0]
        normal = [0, 0, 1]
        [[grain]]
        position = [0, 0, 0.01]
        velocity = [{v_t}, 0, -{v_n}]
        radius = 0.01
        material = "rubber"
        [solver]
        dt = 1e-6
        [stop]
        time = 2e-3
        "#,
        v_t = psi * friction * v_n,
    );
    let assembly = Scene::parse(&text, "superball", ".".as_ref(), &[])?.assemble()?;
    let options = Options { engine: EngineChoice::Cpu, ..Options::default() };
    let mut simulation = Simulation::new(assembly, options)?;
    simulation.advance(2000)?;
    let grain = simulation.grains()?[0];
    // Contact point: v + ω × (-R e_z).
    let slip = grain.velocity.x - grain.spin.y * grain.radius;
    Ok(slip / (friction * v_n))
}
