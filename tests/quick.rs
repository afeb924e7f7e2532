use packstone::{
    engine::gpu::{layouts, program},
    model::{Model, Precision},
    plan::plan,
};
#[test]
fn compose_all() {
    for p in [Precision::Single, Precision::Double] {
        let mut n = 0;
        for m in Model::all(p) {
            let pl = plan(&m);
            if let Err(e) = layouts(&m, &pl) {
                panic!("{m:?}\n{e}");
            }
            n += 1;
        }
        println!("{n} models");
    }
    let _ = program;
}

use glam::DVec3;
use packstone::{scene::*, simulation::*};
fn bed(n: usize) -> Assembly {
    let mut grains = vec![];
    let k = (n as f64).cbrt().round() as usize;
    for i in 0..n {
        let (x, y, z) = (i % k, (i / k) % k, i / (k * k));
        let j = |a: usize| ((i * 7919 + a * 104729) % 1000) as f64 * 1e-7;
        grains.push(Grain {
            position: DVec3::new(
                x as f64 * 2.2e-3 + 1.1e-3 + j(1),
                y as f64 * 2.2e-3 + 1.1e-3 + j(2),
                z as f64 * 2.2e-3 + 1.1e-3 + j(3),
            ),
            velocity: DVec3::ZERO,
            spin: DVec3::ZERO,
            radius: 1e-3,
            material: 0,
            fixed: false,
        });
    }
    let l = k as f64 * 2.2e-3 + 0.2e-3;
    Assembly {
        dimension: 3,
        gravity: DVec3::new(0., 0., -9.81),
        domain: Domain {
            lower: DVec3::new(0., 0., f64::NEG_INFINITY),
            upper: DVec3::new(l, l, f64::INFINITY),
            periodic: [true, true, false],
        },
        materials: vec![Material { name: "g".into(), density: 2500. }],
        pairs: vec![Pair {
            normal_stiffness: 2000.,
            tangential_stiffness: 571.43,
            friction: 0.5,
            dashpot: Dashpot::MassScaled(8660.),
        }],
        walls: vec![Wall {
            name: "floor".into(),
            surface: Surface::Plane { point: DVec3::ZERO, normal: DVec3::Z },
            velocity: DVec3::ZERO,
            spin: 0.,
            material: 0,
        }],
        grains,
        solver: Solver {
            dt: TimeStep::Auto { fraction: 0.15 },
            allow_unstable: false,
            allow_overlap: false,
            damping: 0.,
            margin: 0.2,
        },
        stop: Stop { time: Some(0.1), ..Default::default() },
        output: Output { history: None, snapshots: None, csv: true, vtp: true },
    }
}
#[test]
fn bed_runs() {
    for (engine, precision) in [
        (EngineChoice::Cpu, Precision::Double),
        (EngineChoice::Gpu, Precision::Single),
        (EngineChoice::Gpu, Precision::Double),
    ] {
        let mut s = Simulation::new(bed(8000), Options { engine, precision, ..Default::default() }).unwrap();
        println!("{} dt {:e} bound {:e} bytes {}", s.notice(), s.dt(), s.dt_bound(), s.bytes_per_particle().unwrap());
        for _ in 0..4 {
            let t = std::time::Instant::now();
            s.advance(2000).unwrap();
            println!(
                "{:?} {:?} rate {:.3e} replays {} lost {}",
                s.sample().unwrap(),
                t.elapsed(),
                8000. * 2000. / t.elapsed().as_secs_f64(),
                s.replayed_chunks(),
                s.lost_contacts()
            );
        }
    }
}
