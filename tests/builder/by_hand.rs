//! Assemblies that a user of the structure itself makes.

use crate::{base, bead, message};
use packstone::{
    prelude::*,
    scene::{Dashpot, Hertz, Method, Rolling, Surface, TimeStep},
};

/// A floor and three beads, as a user of the structure itself might have it.
fn by_hand() -> Assembly {
    let beads = (0..3).map(|k| GrainBuilder::new("glass", [0.25 * f64::from(k), 0.0, 0.1], 0.1));
    let floor = WallBuilder::plane("steel", [0.0; 3], [0.0, 0.0, 1.0]);
    base(3).wall(floor).grains(beads).assemble().unwrap()
}

fn start(assembly: Assembly) -> packstone::Result<Simulation> {
    Simulation::new(assembly, Options { engine: EngineChoice::Cpu, ..Options::default() })
}

/// A change, and what is said of it.
type Fault = (fn(&mut Assembly), &'static str);

fn refused(good: &Assembly, faults: &[Fault]) {
    good.validate().unwrap();
    for (change, words) in faults {
        let mut assembly = good.clone();
        change(&mut assembly);
        let found = message(assembly.validate());
        assert!(found.starts_with(&format!("assembly: {words}")), "{found}, not {words}");
        assert_eq!(message(start(assembly)), found);
    }
}

#[test]
fn assemblies_made_by_hand_are_checked() {
    refused(
        &by_hand(),
        &[
            (|a| a.dimension = 1, "dimension = 1: must be 2 or 3"),
            (|a| a.gravity.y = f64::NAN, "gravity.1 = NaN: must be a finite number"),
            (|a| a.grains[1].radius = f64::NAN, "grain.1.radius = NaN: must be a finite number"),
            (|a| a.grains[1].radius = -1.0, "grain.1.radius = -1: must be a positive number of m"),
            (|a| a.grains[1].radius = 1e-200, "grain.1.radius = 1e-200: with the density 2500 kg/m³ of \"glass\""),
            (|a| a.grains[2].position.x = f64::INFINITY, "grain.2.position.0 = inf: must be a finite number"),
            (|a| a.grains[2].velocity.y = f64::NAN, "grain.2.velocity.1 = NaN: must be a finite number"),
            (|a| a.grains[2].spin.z = f64::NAN, "grain.2.spin.2 = NaN: must be a finite number"),
            (|a| a.grains[0].material = 2, "grain.0.material = 2: is no material; there are 2"),
            (|a| a.grains.clear(), "grain: the scene has no grains"),
            (|a| a.grains[1].position.x = 0.1, "grain: grains 0 and 1 overlap by 0.1 m"),
            (
                |a| a.grains[1].position.z = 0.01,
                "wall: grain 1 at [0.25, 0, 0.01] overlaps the wall \"plane 0\" by 0.09 m",
            ),
            (|a| a.grains[1].position.z = -1.0, "wall: grain 1 at [0.25, 0, -1] is beyond the wall \"plane 0\" by 1 m"),
            (
                |a| a.domain.upper.x = 0.3,
                "domain: grain 2 at [0.5, 0, 0.1] is outside the domain: x must be from -inf to 0.3",
            ),
            (|a| a.domain.periodic[0] = true, "domain.lower.0 = -inf: must be a finite number"),
            (|a| a.domain.lower.x = f64::NAN, "domain.lower.0 = NaN: must be a finite number"),
            (
                |a| (a.domain.lower.y, a.domain.upper.y) = (1.0, -1.0),
                "domain.upper = [inf, -1, inf]: must be above lower",
            ),
            (
                |a| (a.domain.lower.x, a.domain.upper.x, a.domain.periodic[0]) = (-0.05, 0.3, true),
                "domain: the periodic axis x is 0.35 m long, must be at least 4 largest radii, 0.4 m",
            ),
            (
                |a| (a.domain.lower.z, a.domain.upper.z, a.domain.periodic[2]) = (-1.0, 1.0, true),
                "wall.0: a wall cannot stand across the periodic axis z",
            ),
            (|a| a.materials[0].density = 0.0, "material.0.density = 0: must be a positive number"),
            (|a| a.pairs.truncate(3), "pair: has 3 entries, must be 2² for 2 materials"),
            (|a| a.pairs[0].normal_stiffness = 0.0, "pair.0.normal_stiffness = 0: must be a positive number of N/m"),
            (|a| a.pairs[3].tangential_stiffness = -1.0, "pair.3.tangential_stiffness = -1: must be 0 or a positive"),
            (|a| a.pairs[0].friction = f64::NAN, "pair.0.friction = NaN: must be a finite number"),
            (
                |a| a.pairs[0].dashpot = Dashpot::Restitution(0.0),
                "pair.0.restitution = 0: must be above 0 and at most 1",
            ),
            (|a| a.pairs[1].friction = 0.9, "pair.1: differs from the pair"),
            (|a| a.pairs[0].dashpot = Dashpot::MassScaled(1.0), "pair: some have restitution and some normal_damping"),
            (
                |a| a.pairs[0].hertz = Some(Hertz::of_material(7e10, 0.2)),
                "pair: some are of elastic spheres (hertz) and some have linear springs",
            ),
            (
                |a| a.pairs.iter_mut().for_each(|p| p.hertz = Some(Hertz { youngs_modulus: 0.0, shear_modulus: 1.0 })),
                "pair.0.hertz.youngs_modulus = 0: must be a positive number of Pa",
            ),
            (
                |a| a.pairs[0].rolling = Some(Rolling { friction: f64::NAN, stiffness: 1.0, damping: 0.0 }),
                "pair.0.rolling_friction = NaN: must be a finite number",
            ),
            (
                |a| {
                    a.pairs
                        .iter_mut()
                        .for_each(|p| p.rolling = Some(Rolling { friction: 0.1, stiffness: 1.0, damping: 0.0 }));
                    a.solver.method = rigid_method();
                },
                "pair.0.rolling_friction = 0.1: rolling resistance needs method = \"dem\"",
            ),
            (|a| a.walls[0].material = 9, "wall.0.material = 9: is no material"),
            (|a| a.walls[0].velocity.x = f64::NAN, "wall.0.velocity.0 = NaN: must be a finite number"),
            (|a| a.walls[0].spin = 1.0, "wall.0.spin = 1: must be 0, because the wall is a plane"),
            (
                |a| a.walls[0].surface = Surface::Plane { point: DVec3::ZERO, normal: DVec3::new(0.0, 0.0, 2.0) },
                "wall.0.normal = [0, 0, 2]: must be a unit vector",
            ),
            (
                |a| a.walls[0].surface = Surface::Cylinder { center: DVec3::ZERO, radius: f64::NAN },
                "wall.0.radius = NaN: must be a finite number",
            ),
            (|a| a.solver.dt = TimeStep::Fixed(f64::NAN), "solver.dt = NaN: must be a finite number"),
            (|a| a.solver.damping = -1.0, "solver.damping = -1: must be 0 or a positive number of 1/s"),
            (|a| a.solver.margin = 0.0, "solver.margin = 0: must be from 0.001 to 10 mean radii"),
            (|a| a.stop.steps = Some(0), "stop.steps = 0: must be at least 1"),
            (|a| a.output.history = Some(-1.0), "output.history = -1: must be a positive number of s"),
        ],
    );
}

#[test]
fn clumps_and_disks_made_by_hand_are_checked() {
    let pair = || GrainBuilder::new("glass", [0.0; 3], 0.1).shape("dimer");
    let clumps = base(3).grain(pair()).grain(bead()).assemble().unwrap();
    refused(
        &clumps,
        &[
            (|a| a.clumps[1].shape = 7, "clump.1.shape = 7: is no shape; there are 2"),
            (|a| a.clumps[1].first = 1, "clump.1.first = 1: must be 2, with 1 members"),
            (|a| a.clumps[0].orientation = DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0), "clump.0.orientation"),
            (|a| a.clumps[0].radius = f64::NAN, "clump.0.radius = NaN: must be a finite number"),
            (|a| a.clumps[0].position.x = 0.01, "grain.0: is not what shape, place and size of clump 0 make of it"),
            (|a| a.grains[1].fixed = true, "grain.1: is not what shape, place and size of clump 0 make of it"),
            (|a| a.grains.push(a.grains[2]), "clump: have 3 members, must have all 4 grains"),
            (|a| a.shapes[0].members.clear(), "shape.0.members: must have at least one"),
            (|a| a.shapes[0].gyration.x = 0.0, "shape.0.gyration = [0, "),
        ],
    );
    let disks = base(2).grain(GrainBuilder::new("glass", [0.0, 1.0], 0.1)).assemble().unwrap();
    refused(
        &disks,
        &[
            (|a| a.grains[0].position.z = 1.0, "grain.0.position.2 = 1: must be 0 (dimension = 2)"),
            (|a| a.grains[0].spin.x = 1.0, "grain.0.spin: must be about z alone (dimension = 2)"),
            (|a| a.gravity.z = 1.0, "gravity.2 = 1: must be 0 (dimension = 2)"),
        ],
    );
}

fn rigid_method() -> Method {
    base(3).grain(bead()).solver(SolverBuilder::contact_dynamics()).assemble().unwrap().solver.method
}

/// What the scene allows is allowed, and the two ends of a period are one place.
#[test]
fn good_assemblies_made_by_hand_run() {
    let mut close = by_hand();
    close.grains[1].position.x = 0.1;
    close.solver.allow_overlap = true;
    start(close).unwrap();
    let mut rigid = by_hand();
    rigid.solver.method = rigid_method();
    rigid.pairs.iter_mut().for_each(|pair| pair.normal_stiffness = 0.0);
    assert!(matches!(rigid.solver.method, Method::ContactDynamics(_)));
    start(rigid).unwrap();
    let mut periodic = by_hand();
    (periodic.domain.lower.x, periodic.domain.upper.x, periodic.domain.periodic[0]) = (-0.5, 0.5, true);
    assert_eq!(start(periodic).unwrap().assembly().grains[2].position.x, -0.5);
}

#[test]
fn a_simulation_can_go_to_another_thread() {
    fn is_send<T: Send>() {}
    is_send::<Simulation>();
    let mut simulation = start(by_hand()).unwrap();
    let there = std::thread::spawn(move || simulation.advance(10).map(|()| simulation.step()));
    assert_eq!(there.join().unwrap().unwrap(), 10);
}

#[test]
fn columns_are_the_grains() {
    let mut assembly = by_hand();
    assembly.grains[1].velocity.x = 0.2;
    assembly.grains[2].spin.y = 3.0;
    (assembly.grains[0].fixed, assembly.grains[0].material) = (true, 1);
    let mut simulation = start(assembly).unwrap();
    simulation.advance(100).unwrap();
    let (grains, columns) = (simulation.grains().unwrap(), simulation.columns().unwrap());
    assert_eq!((columns.len(), columns.is_empty()), (3, false));
    for (k, grain) in grains.iter().enumerate() {
        let row = Grain {
            position: columns.position[k],
            velocity: columns.velocity[k],
            spin: columns.spin[k],
            radius: columns.radius[k],
            material: columns.material[k],
            fixed: columns.fixed[k],
        };
        assert_eq!(row, *grain);
    }
    assert!(columns.velocity[1].x > 0.0 && columns.fixed[0]);
}
