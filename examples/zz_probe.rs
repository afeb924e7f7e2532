use packstone::{scene::*, simulation::*};
fn main() {
    let text = std::fs::read_to_string("src/bench/scenes/rough.toml").unwrap();
    for set in [vec![], vec!["material.glass.restitution=1".to_string()], vec!["solver.damping=0".to_string()], vec!["material.glass.friction=0".to_string()],
        vec!["material.glass.friction=0".to_string(), "solver.damping=0".to_string()], vec!["solver.damping=0".to_string(), "material.glass.restitution=1".to_string()] ] {
    for factor in [2.0, 1.0, 0.5, 0.25] {
        let mut a = Scene::parse(&text, "rough", ".".as_ref(), &set).unwrap().assemble().unwrap();
        let auto = packstone::bench::trial::automatic_step(&a).unwrap();
        a.solver.dt = TimeStep::Fixed(factor * auto);
        let mut s = Simulation::new(a, Options { engine: EngineChoice::Cpu, ..Options::default() }).unwrap();
        let e = |s: &packstone::measure::Sample| s.kinetic_energy + s.potential_energy + s.elastic_energy;
        let first = e(&s.sample().unwrap());
        let (mut work, mut worst, mut last) = (0.0, 0.0f64, 0.0);
        for _ in 0..(1000.0 / factor) as u64 {
            s.advance(1).unwrap();
            let x = s.sample().unwrap();
            work += x.dissipation * s.dt();
            worst = worst.max((e(&x) + work - first).abs());
            last = e(&x) + work - first;
        }
        let x = s.sample().unwrap();
        println!("{set:?} × {factor}: work {work:.4e} of kin {first:.3e}, lost {:.4e} worst/work {:.3e} end {:.3e}, contacts {}", first - e(&x), worst / work, last / work, x.contacts);
    }
    }
}
