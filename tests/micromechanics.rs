//! Contacts one by one, and what follows from them: against engines, closed forms and the laws of mechanics.

mod common;

use common::*;
use glam::{DMat3, DVec3};
use packstone::{
    measure::{
        Asked, Contact, Measures, Other, Packing, Slope, masses,
        micromechanics::{
            Cell,
            coordination::{Coordination, carrying, fabric},
            equilibrium::{Energies, Equilibrium},
            packing::{outer, rows},
            profile,
            stress::{stress, stress_of_particles, virial},
        },
        slope,
    },
    scene::{Assembly, Clump, Domain, Grain, Pair, Rolling, Scene, Wall},
    simulation::{Checkpoint, Simulation},
};
use std::{fs, path::Path, process::Command};

/// A simulation as it is read off.
struct State {
    assembly: Assembly,
    grains: Vec<Grain>,
    clumps: Vec<Clump>,
    walls: Vec<Wall>,
    contacts: Vec<Contact>,
    energies: Energies,
}

impl State {
    fn of(simulation: &mut Simulation) -> State {
        let sample = simulation.sample().unwrap();
        let (kinetic, elastic, of_step) = (sample.kinetic_energy, sample.elastic_energy, sample.step_energy);
        let state = State {
            grains: simulation.grains().unwrap(),
            clumps: simulation.clumps().unwrap(),
            walls: simulation.walls().unwrap(),
            contacts: simulation.contacts().unwrap(),
            energies: Energies { kinetic, elastic, of_step },
            assembly: simulation.assembly().clone(),
        };
        assert_eq!(state.contacts.len() as u64, sample.contacts, "as the sample counts them");
        state
    }

    fn packing(&self) -> Packing<'_> {
        Packing::new(&self.assembly, &self.grains, &self.clumps, &self.walls, &self.contacts)
    }
}

/// Walls around a box from the origin on.
fn walls_of(size: DVec3, dimension: usize) -> Vec<Wall> {
    let axes = DVec3::AXES.into_iter().take(dimension).enumerate();
    axes.flat_map(|(k, axis)| {
        let named = |wall: Wall, name: &str| Wall { name: format!("{}{name}", ["x", "y", "z"][k]), ..wall };
        [named(plane(DVec3::ZERO, axis), "-"), named(plane(size[k] * axis, -axis), "+")]
    })
    .collect()
}

/// Grains of several sizes that a box squeezes, with friction, on the way to rest.
fn squeezed(dimension: usize, gravity: f64) -> Assembly {
    let side = if dimension == 2 { 6 } else { 4 };
    let mut scene = blank(dimension);
    scene.grains = cloud(dimension, side, 0.0, 7);
    scene.grains.iter_mut().for_each(|g| g.radius *= 1.18);
    scene.walls = walls_of(DVec3::splat(side as f64 * SPACING), dimension);
    scene.pairs = vec![law(0.3)];
    scene.gravity = -gravity * up(dimension);
    let frequency = (KN / mass(dimension, R)).sqrt();
    scene.solver.dt = packstone::scene::TimeStep::Fixed(0.1 / frequency);
    scene.solver.damping = 0.05 * frequency;
    scene
}

/// Disks on a floor between walls, without a lid, which come down from where they overlap nobody.
fn bed() -> Assembly {
    let mut scene = squeezed(2, G);
    scene.walls.retain(|wall| wall.name != "y+");
    scene.grains.iter_mut().for_each(|g| g.radius /= 1.18);
    scene.solver.damping /= 5.0;
    scene
}

/// The same of clumps of two.
fn squeezed_clumps() -> Assembly {
    let mut scene = blank(3);
    let shape = packstone::scene::Shape::of_union("rod", &members(&[DVec3::ZERO, DVec3::X]), 3);
    let side = 3;
    let mut random = Random(3);
    let spots = (0..side * side * side)
        .map(|k| DVec3::new((k % side) as f64, (k / side % side) as f64, (k / side / side) as f64));
    let clumps = spots.map(|at| Clump {
        position: 2.5 * R * (at + 0.5),
        orientation: glam::DQuat::from_euler(glam::EulerRot::XYZ, random.sign(), random.sign(), 3.0 * random.sign()),
        radius: 1.3 * R,
        ..clump(0)
    });
    let clumps = clumps.collect();
    set_clumps(&mut scene, vec![shape], clumps);
    scene.walls = walls_of(DVec3::splat(2.5 * R * side as f64), 3);
    scene.pairs = vec![law(0.3)];
    let frequency = (KN / mass(3, R)).sqrt();
    scene.solver.dt = packstone::scene::TimeStep::Fixed(0.05 / frequency);
    scene.solver.damping = 0.05 * frequency;
    scene
}

fn at_rest(scene: &Assembly, steps: u64) -> State {
    let mut simulation = CPU.start(scene);
    simulation.advance(steps).unwrap();
    let state = State::of(&mut simulation);
    println!("{} contacts, {:?}", state.contacts.len(), state.energies);
    state
}

/// The sum over walls of what they do, at the points where they do it: Gauss' theorem for a packing at rest.
fn virial_of_walls(packing: &Packing) -> DMat3 {
    let at_walls = packing.contacts.iter().filter(|contact| matches!(contact.other, Other::Wall(_)));
    let sum = at_walls.fold(DMat3::ZERO, |sum, c| sum - outer(c.force, packing.point(c)));
    let weights = packing.free().map(|k| outer(packing.mass(k) * packing.assembly.gravity, packing.center(k)));
    weights.fold(sum, |sum, weight| sum - weight)
}

#[track_caller]
fn same(what: &str, found: DMat3, expected: DMat3, tolerance: f64) {
    let size = |m: DMat3| rows(m).iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
    let error = size(found - expected) / size(expected);
    println!("{what}: off by {error:.1e}");
    assert!(error <= tolerance, "{what}: {found}, expected {expected}, off by {error:e}");
}

#[test]
fn virial_is_what_walls_do_at_rest() {
    for (what, scene, steps) in [
        ("disks", squeezed(2, 0.0), 40_000),
        ("spheres", squeezed(3, 0.0), 40_000),
        ("disks with weight", squeezed(2, G), 40_000),
        ("a bed", bed(), 200_000),
        ("clumps", squeezed_clumps(), 40_000),
    ] {
        let state = at_rest(&scene, steps);
        let packing = state.packing();
        same(what, virial(&packing), virial_of_walls(&packing), 1e-10);
        // Walls carry each other and the weight.
        let force: f64 = packing.contacts.iter().map(|contact| contact.force.length()).sum();
        let weight: DVec3 = packing.free().map(|k| packing.mass(k) * scene.gravity).sum();
        let on_walls: DVec3 = packing.loads_on_walls().iter().map(|load| load.force).sum();
        close(what, (on_walls - weight).length() / force, 0.0, 1.0, 1e-12);
        let cell = Cell::of(&packing).unwrap();
        let lengths: Vec<f64> = cell.lengths().collect();
        close(what, lengths[0], scene.walls[1].surface.reference().x, lengths[0], 1e-12);
        let found = stress(&packing, cell.volume());
        assert!(found.pressure > 0.0, "pressure is positive");
        // Grains have it all.
        let of_particles = stress_of_particles(&packing);
        let sum =
            |a: usize, b: usize| of_particles.iter().enumerate().map(|(k, s)| packing.volume(k) * s[a][b]).sum::<f64>();
        close(what, sum(0, 0), rows(virial(&packing))[0][0], sum(0, 0), 1e-12);
    }
}

#[test]
fn a_bed_at_rest_is_certified_and_another_is_not() {
    let mut simulation = CPU.start(&squeezed(2, G));
    let moving = State::of(&mut simulation);
    let certificate = |state: &State| Equilibrium::of(&state.packing(), state.energies, 1e-9);
    let found = certificate(&moving);
    assert!(!found.certified, "{found:?}");
    assert!(found.residual_force_ratio.unwrap().worst > 1e-3);
    simulation.advance(40_000).unwrap();
    let resting = State::of(&mut simulation);
    let found = certificate(&resting);
    println!("{found:?}");
    assert!(found.certified, "{found:?}");
    assert!(found.coulomb_margin.unwrap() >= -1e-12);
    // A push and nothing else.
    let pushed = State { energies: Energies { kinetic: resting.energies.elastic, ..resting.energies }, ..resting };
    assert!(!certificate(&pushed).certified);
    // Without a contact nothing holds anybody.
    let mut alone = blank(3);
    alone.grains = vec![grain(0.0, 0.0, 0.0)];
    let mut state = State::of(&mut CPU.start(&alone));
    state.assembly.numbers.grains = vec![7];
    let found = certificate(&state);
    assert!(!found.certified && found.floppy == 1);
    // It is called as outside.
    let worst = found.residual_force_ratio.unwrap();
    assert_eq!((worst.worst, worst.particle), (0.0, 7));
}

/// A grain in a corner between two walls, with and without friction, and one on the floor alone.
#[test]
fn floppy_grains_are_those_that_nothing_holds() {
    let floppy = |friction: f64, grains: Vec<Grain>| {
        let mut scene = blank(2);
        scene.pairs = vec![law(friction)];
        scene.walls = vec![plane(DVec3::ZERO, DVec3::X), plane(DVec3::ZERO, DVec3::Y)];
        scene.grains = grains;
        let state = State::of(&mut CPU.start(&scene));
        Equilibrium::of(&state.packing(), state.energies, 1e-3).floppy
    };
    let (corner, middle) = (grain(0.99 * R, 0.99 * R, 0.0), grain(5.0 * R, 0.99 * R, 0.0));
    assert_eq!(floppy(0.0, vec![corner]), 0);
    assert_eq!(floppy(0.0, vec![corner, middle]), 1);
    // With friction a grain may roll on one wall, and not on two.
    assert_eq!(floppy(0.5, vec![corner]), 0);
    assert_eq!(floppy(0.5, vec![corner, middle]), 1);
}

/// Grains on a lattice with these edges, repeated n times, in a periodic cell.
fn lattice(dimension: usize, edges: DVec3, n: usize, basis: &[DVec3]) -> Assembly {
    let mut scene = blank(dimension);
    let deep = if dimension == 2 { 1 } else { n };
    let cells = (0..n * n * deep).map(|k| DVec3::new((k % n) as f64, (k / n % n) as f64, (k / n / n) as f64));
    let size = edges * n as f64;
    let (mut lower, mut upper) = (DVec3::ZERO, size);
    if dimension == 2 {
        (lower.z, upper.z) = (f64::NEG_INFINITY, f64::INFINITY);
    }
    scene.domain = Domain { lower, upper, periodic: [true, true, dimension == 3], ..Domain::default() };
    for cell in cells {
        for b in basis {
            let x = (cell + *b) * edges;
            scene.grains.push(grain(x.x, x.y, if dimension == 2 { 0.0 } else { x.z }));
        }
    }
    scene
}

#[test]
fn stress_of_strained_lattices_is_that_of_their_springs() {
    let half = 0.5;
    let fcc = [DVec3::ZERO, DVec3::new(half, half, 0.0), DVec3::new(half, 0.0, half), DVec3::new(0.0, half, half)];
    let a = 2.0 * 2.0_f64.sqrt() * R;
    for (what, dimension, edges, basis, neighbours) in [
        ("square", 2, DVec3::new(1.98 * R, 1.95 * R, 0.0), &fcc[..1], vec![DVec3::X, DVec3::Y]),
        ("fcc", 3, a * DVec3::new(0.99, 0.98, 0.985), &fcc[..], {
            let pairs = [(1.0, 1.0), (1.0, -1.0)];
            let along = |f: fn(f64, f64) -> DVec3| pairs.iter().map(move |(s, t)| half * f(*s, *t));
            let all = along(|s, t| DVec3::new(s, t, 0.0)).chain(along(|s, t| DVec3::new(s, 0.0, t)));
            all.chain(along(|s, t| DVec3::new(0.0, s, t))).collect()
        }),
    ] {
        let scene = lattice(dimension, edges, 4, basis);
        let state = State::of(&mut CPU.start(&scene));
        let packing = state.packing();
        let of_cell: f64 = (0..dimension).map(|k| edges[k]).product();
        // Half of the neighbours of every grain of a cell of the lattice.
        let expected = neighbours.iter().fold(DMat3::ZERO, |sum, b| {
            let l = *b * edges;
            let force = KN * (2.0 * R - l.length());
            sum + outer(force * l.normalize(), l) * (basis.len() as f64 / of_cell)
        });
        let cell = Cell::of(&packing).unwrap();
        let found = stress(&packing, cell.volume());
        let total = DMat3::from_cols_array_2d(&found.total).transpose();
        same(what, total, expected, 1e-9);
        close(
            what,
            found.pressure,
            (0..dimension).map(|k| rows(expected)[k][k]).sum::<f64>() / dimension as f64,
            found.pressure,
            1e-9,
        );
        // Any box that repeats with the lattice has the same, and so has a stack of slabs.
        let asked = profile::of_box(&packing, 0.25 * edges, 2.25 * edges);
        same("box", DMat3::from_cols_array_2d(&asked.stress.total).transpose(), expected, 1e-9);
        let solid = basis.len() as f64 * if dimension == 2 { 1.0 } else { R / 0.75 } * std::f64::consts::PI * R * R;
        assert!(
            (asked.solid_fraction - solid / of_cell).abs() < 0.02,
            "{asked:?}, without overlaps {}",
            solid / of_cell
        );
        for part in profile::profile(&packing, &cell, 1, edges.y) {
            same("slab", DMat3::from_cols_array_2d(&part.stress.total).transpose(), expected, 1e-9);
            close(
                "slab",
                part.solid_fraction,
                asked.solid_fraction,
                1.0,
                1e-9 + asked.solid_fraction_error + part.solid_fraction_error,
            );
        }
        // Which way contacts point, and how many there are too many.
        let f = fabric(&packing).unwrap();
        close(what, f[0][0] + f[1][1] + f[2][2], 1.0, 1.0, 1e-12);
        let found = Coordination::of(&packing, &carrying(&packing));
        let (n, z) = (scene.grains.len(), 2 * neighbours.len());
        assert_eq!((found.contacts, found.rattlers), (n * z / 2, 0));
        assert_eq!(found.coordination_without_rattlers, Some(z as f64));
        assert_eq!(found.isostatic_excess, (n * z / 2) as i64 - (dimension * n - dimension) as i64);
    }
}

/// A lattice that has been sheared has the same stress everywhere: in a box of any place that is as large as the cell, in
/// the mean over slabs of any width, and in every slab that repeats with it.
#[test]
fn boxes_and_slabs_of_a_tilted_cell_have_all_of_it() {
    for (dimension, tilt) in [(2, DVec3::new(0.0, 0.0, 0.7)), (3, DVec3::new(0.6, -1.1, 0.7))] {
        let n = 4;
        let edge = 1.97 * R;
        let mut scene =
            lattice(dimension, DVec3::new(edge, edge, if dimension == 2 { 0.0 } else { edge }), n, &[DVec3::ZERO]);
        let length = n as f64 * edge;
        scene.domain.tilt = tilt * R;
        let slopes = scene.domain.tilt / length;
        for g in &mut scene.grains {
            let DVec3 { x, y, z } = g.position;
            g.position = DVec3::new(x + slopes.z * y + slopes.y * z, y + slopes.x * z, z);
            scene.domain.fold(&mut g.position);
            g.velocity = 0.01 * DVec3::X;
        }
        let state = State::of(&mut CPU.start(&scene));
        let packing = state.packing();
        let steps = [DVec3::X, DVec3::new(slopes.z, 1.0, 0.0), DVec3::new(slopes.y, slopes.x, 1.0)];
        let volume = edge.powi(dimension as i32);
        let all = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k].map(f64::from))));
        let branches = all.map(|k| (0..dimension).map(|axis| k[axis] * edge * steps[axis]).sum::<DVec3>());
        let touching = branches.filter(|l| l.length() > 0.0 && l.length() < 2.0 * R);
        let touching: Vec<DVec3> = if dimension == 2 { touching.step_by(3).collect() } else { touching.collect() };
        let expected = touching.iter().fold(DMat3::ZERO, |sum, l| {
            sum + outer(0.5 * KN * (2.0 * R - l.length()) * l.normalize(), *l) * (1.0 / volume)
        });
        let contact = |part: &profile::Part| DMat3::from_cols_array_2d(&part.stress.contact).transpose();
        let cell = Cell::of(&packing).unwrap();
        same("cell", DMat3::from_cols_array_2d(&stress(&packing, cell.volume()).contact).transpose(), expected, 1e-12);
        let lower =
            R * DVec3::new(-3.3, 1.7, 0.9) * if dimension == 2 { DVec3::new(1.0, 1.0, 0.0) } else { DVec3::ONE };
        let whole = profile::of_box(&packing, lower, lower + length);
        same("box", contact(&whole), expected, 1e-12);
        let grains = scene.grains.len() as f64;
        let mut solid = grains
            * if dimension == 2 {
                std::f64::consts::PI * R * R
            } else {
                4.0 / 0.75 * 0.25 * std::f64::consts::PI * R.powi(3)
            };
        solid /= cell.volume();
        close("fraction", whole.solid_fraction, solid, 1.0, 0.02);
        for axis in 0..dimension {
            for width in [edge, 0.37 * edge] {
                let parts = profile::profile(&packing, &cell, axis, width);
                let of_all = |of: &dyn Fn(&profile::Part) -> f64| {
                    parts.iter().map(|part| part.volume * of(part)).sum::<f64>() / cell.volume()
                };
                close("slabs", of_all(&|part| part.solid_fraction), whole.solid_fraction, 1.0, 1e-12);
                let mean =
                    parts.iter().fold(DMat3::ZERO, |sum, part| sum + contact(part) * (part.volume / cell.volume()));
                same("slabs", mean, expected, 1e-12);
                if width == edge && axis + 1 == dimension {
                    for part in &parts {
                        same("slab", contact(part), expected, 1e-12);
                        close("slab", part.velocity.unwrap().x, 0.01, 0.01, 1e-12);
                    }
                }
            }
        }
    }
}

/// - V σ : dε is what the elastic energy gains, as pressure is positive, of springs and of elastic spheres.
#[test]
fn work_of_stress_is_the_change_of_elastic_energy() {
    for (dimension, hertz) in [(2, false), (3, false), (3, true)] {
        let side = if dimension == 2 { 6 } else { 4 };
        let strained = |strain: DVec3| {
            let mut scene = blank(dimension);
            scene.grains = cloud(dimension, side, 0.0, 11);
            let size = SPACING * side as f64 * (DVec3::ONE + strain);
            let open = if dimension == 2 { f64::INFINITY } else { size.z };
            let lower = if dimension == 2 { DVec3::new(0.0, 0.0, -open) } else { DVec3::ZERO };
            scene.domain =
                Domain { lower, upper: size.with_z(open), periodic: [true, true, dimension == 3], ..Domain::default() };
            for g in &mut scene.grains {
                g.radius *= 1.2;
                g.position *= DVec3::ONE + strain;
            }
            if hertz {
                let (youngs_modulus, shear_modulus) = (1e9, 4e8);
                scene.pairs[0].hertz = Some(packstone::scene::Hertz { youngs_modulus, shear_modulus });
            }
            scene.solver.dt = packstone::scene::TimeStep::Auto { fraction: 0.1 };
            State::of(&mut CPU.start(&scene))
        };
        let state = strained(DVec3::ZERO);
        let found = rows(virial(&state.packing()));
        let h = 1e-6;
        for (axis, row) in found.iter().enumerate().take(dimension) {
            let energy = |h: f64| strained(h * DVec3::AXES[axis]).energies.elastic;
            let slope = (energy(h) - energy(-h)) / (2.0 * h);
            close(&format!("{dimension} {hertz} {axis}"), row[axis], -slope, slope, 1e-6);
        }
    }
}

/// A cloud that collides, with friction and rolling resistance, on a floor.
fn colliding(dimension: usize) -> Assembly {
    let mut scene = blank(dimension);
    scene.grains = cloud(dimension, if dimension == 2 { 8 } else { 5 }, 1.0, 5);
    scene.walls = walls_of(DVec3::splat(if dimension == 2 { 8.0 } else { 5.0 } * SPACING), dimension);
    let rolling = Rolling { friction: 0.1, stiffness: 0.5, damping: 0.2 };
    scene.pairs = vec![Pair { rolling: Some(rolling), ..law(0.1) }];
    scene.pairs[0].dashpot = packstone::scene::Dashpot::Restitution(0.5);
    scene.gravity = -G * up(dimension);
    scene
}

/// What contacts do to both of their grains adds up to the forces that the engine finds for each grain by itself, and
/// there is nothing left.
#[test]
fn contacts_add_up_to_the_forces_of_the_engine() {
    for bench in engines() {
        for (what, scene) in [("disks", colliding(2)), ("spheres", colliding(3)), ("clumps", squeezed_clumps())] {
            let mut simulation = bench.start(&scene);
            simulation.advance(800).unwrap();
            let forces = simulation.forces().unwrap();
            let state = State::of(&mut simulation);
            let packing = state.packing();
            let scale = state.contacts.iter().map(|c| c.force.length()).fold(0.0, f64::max);
            assert!(
                state.contacts.len() > 10 && state.contacts.iter().any(|c| c.sliding),
                "{what}: {}",
                state.contacts.len()
            );
            let mut expected = vec![DVec3::ZERO; packing.particles()];
            (0..).zip(&forces).for_each(|(k, (force, _))| expected[packing.particle_of(k)] += *force);
            for (load, expected) in packing.loads().iter().zip(&expected) {
                close(what, (load.force - *expected).length(), 0.0, scale, bench.pick(1e-12, 1e-4));
            }
            if scene.clumps.is_empty() {
                for (load, (_, moment)) in packing.loads().iter().zip(&forces) {
                    close(what, (load.moment - *moment).length(), 0.0, scale * R, bench.pick(1e-12, 1e-4));
                }
            }
            // Third law: grains and walls have no force in all.
            let grains: DVec3 = packing.loads().iter().map(|load| load.force).sum();
            let walls: DVec3 = packing.loads_on_walls().iter().map(|load| load.force).sum();
            close(what, (grains + walls).length(), 0.0, scale, 1e-12);
        }
    }
}

/// What engines add up for the history is what contacts do to walls, wherever these are and however they move.
#[test]
fn loads_on_walls_are_those_of_contacts() {
    for bench in engines() {
        for (what, mut scene) in [("disks", colliding(2)), ("spheres", colliding(3)), ("clumps", squeezed_clumps())] {
            scene.walls[0].velocity = 0.01 * DVec3::X;
            let mut simulation = bench.start(&scene);
            simulation.advance(800).unwrap();
            let found = simulation.wall_loads().unwrap();
            let state = State::of(&mut simulation);
            let expected = state.packing().loads_on_walls();
            let largest = expected.iter().map(|load| load.force.length()).fold(0.0, f64::max);
            assert!(largest > 0.0, "{what}: nothing touches a wall");
            for (found, expected) in found.iter().zip(&expected) {
                let tolerance = bench.pick(1e-12, 1e-4);
                close(what, (found.force - expected.force).length(), 0.0, largest, tolerance);
                close(what, (found.moment - expected.moment).length(), 0.0, largest * 10.0 * R, tolerance);
            }
        }
    }
}

/// Contact dynamics knows the mean forces of its last step.
#[test]
fn rigid_grains_have_contacts_too() {
    let mut scene = rigid(3, 1e-4, 0.3, 1e-10);
    scene.gravity = -G * DVec3::Z;
    scene.walls = vec![floor(3)];
    scene.grains = vec![grain(0.0, 0.0, R), grain(0.0, 0.0, 3.0 * R), grain(3.0 * R, 0.0, R)];
    let state = at_rest(&scene, 20);
    let packing = state.packing();
    let weight = mass(3, R) * G;
    let forces: Vec<f64> = state.contacts.iter().map(|contact| contact.normal_force() / weight).collect();
    println!("{forces:?}");
    assert_eq!(forces.len(), 3);
    [1.0, 2.0, 1.0].into_iter().zip(&forces).for_each(|(expected, found)| close("force", *found, expected, 1.0, 1e-6));
    close("floor", packing.loads_on_walls()[0].force.z, -3.0 * weight, weight, 1e-6);
    assert!(Equilibrium::of(&packing, state.energies, 1e-4).certified);
}

/// A run on a device is looked at without one, to the bit, and both engines have the same contacts.
#[test]
fn a_checkpoint_of_any_engine_has_the_same_contacts_on_the_host() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint.bin");
    let mut rigid_bed = rigid(3, 1e-4, 0.3, 1e-6);
    rigid_bed.gravity = -G * DVec3::Z;
    rigid_bed.walls = walls_of(DVec3::splat(4.0 * SPACING), 3);
    rigid_bed.grains = cloud(3, 4, 0.1, 5);
    for (what, scene, steps) in [
        ("disks", colliding(2), 600),
        ("spheres", colliding(3), 600),
        ("clumps", squeezed_clumps(), 600),
        ("rigid", rigid_bed, 60),
    ] {
        let mut reference: Option<State> = None;
        for bench in engines() {
            let mut simulation = bench.start(&scene);
            simulation.advance(steps).unwrap();
            simulation.save(&path, &()).unwrap();
            let here = State::of(&mut simulation);
            let mut checkpoint = Checkpoint::open(&path).unwrap();
            let mut on_host = Simulation::view(scene.clone(), &mut checkpoint).unwrap();
            assert_eq!(on_host.engine().name(), "cpu");
            let there = State::of(&mut on_host);
            assert_eq!(here.contacts, there.contacts, "{what} on {}", bench.name);
            assert_eq!(here.walls, there.walls);
            let speed = here.grains.iter().map(|g| g.velocity.length()).fold(0.0, f64::max);
            for (a, b) in here.grains.iter().zip(&there.grains) {
                assert_eq!((a.position, a.radius), (b.position, b.radius));
                close(what, (a.velocity - b.velocity).length(), 0.0, speed, bench.pick(1e-12, 1e-5));
            }
            assert!(here.contacts.len() > 10, "{what}: {}", here.contacts.len());
            let Some(reference) = &reference else {
                reference = Some(here);
                continue;
            };
            let scale = reference.contacts.iter().map(|c| c.force.length()).fold(0.0, f64::max);
            let forces = |s: &State| s.contacts.iter().map(|c| ((c.grain, c.other), c.force)).collect::<Vec<_>>();
            let (ours, theirs) = (forces(&here), forces(reference));
            let found = |key| ours.iter().find(|(other, _)| *other == key).map_or(DVec3::ZERO, |(_, force)| *force);
            // Steps of rigid grains are solved to their tolerance, and forces need not be unique.
            if what != "rigid" {
                for (key, force) in theirs {
                    close(what, (found(key) - force).length(), 0.0, scale, bench.pick(1e-6, 2e-3));
                }
            }
        }
    }
}

/// Weights of all grains and the forces of the table on each add up to nothing at rest.
#[test]
fn the_table_of_contacts_balances_at_rest() {
    let state = at_rest(&squeezed(2, G), 40_000);
    let packing = state.packing();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("contacts.csv");
    packstone::io::Export::of(&path).unwrap().write(&packing, 0, 0.0).unwrap();
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut forces: Vec<DVec3> = masses(&state.assembly).iter().map(|m| m * state.assembly.gravity).collect();
    let (mut largest, mut on_walls) = (0.0_f64, DVec3::ZERO);
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        let field = |name: &str| fields[names.iter().position(|n| *n == name).unwrap()];
        let vector = |name: &str| ["x", "y", "z"].map(|axis| field(&format!("{name}_{axis}")).parse::<f64>().unwrap());
        let force = DVec3::from_array(vector("normal")) + DVec3::from_array(vector("tangential"));
        largest = largest.max(force.length());
        forces[field("grain").parse::<usize>().unwrap()] += force;
        match field("other") {
            "" => {
                assert!(state.walls.iter().any(|wall| wall.name == field("wall")), "{line}");
                on_walls -= force;
            }
            other => forces[other.parse::<usize>().unwrap()] -= force,
        }
    }
    let worst = forces.iter().map(|force| force.length()).fold(0.0, f64::max);
    println!("largest force {largest:e}, worst balance {worst:e}");
    assert!(worst < 1e-11 * largest, "{worst:e} of {largest:e}");
    let weight: DVec3 = masses(&state.assembly).iter().map(|m| *m * state.assembly.gravity).sum();
    close("walls", (on_walls - weight).length(), 0.0, largest, 1e-11);
}

/// A column of grains, by everything at once.
#[test]
fn all_measures_of_a_column() {
    let mut scene = blank(2);
    scene.pairs = vec![bed_law(2, 0.0)];
    scene.gravity = -G * DVec3::Y;
    scene.walls = walls_of(DVec3::new(2.0 * R, 20.0 * R, 0.0), 2);
    scene.solver.dt = packstone::scene::TimeStep::Auto { fraction: 0.1 };
    scene.solver.damping = 200.0;
    scene.grains = (0..4).map(|k| grain(R, (2.0 * f64::from(k) + 1.0) * R, 0.0)).collect();
    let mut simulation = CPU.start(&scene);
    simulation.advance(100_000).unwrap();
    let state = State::of(&mut simulation);
    let asked = Asked {
        bounds: Some([DVec3::ZERO, DVec3::new(2.0 * R, 4.0 * R, 0.0)]),
        axis: 1,
        width: Some(2.0 * R),
        tolerance: 1e-6,
    };
    let found = Measures::of(&state.packing(), state.energies, &asked);
    let weight = mass(2, R) * G;
    println!("{found:#?}");
    assert!(found.equilibrium.certified);
    close("floor", found.walls[2].force.y, -4.0 * weight, weight, 1e-6);
    assert_eq!((found.walls[2].contacts, found.walls[3].contacts), (1, 0));
    // The lid is far above and does not count: nearly four disks in four squares.
    let cell = found.cell.unwrap();
    close("height", cell.upper.y, 8.0 * R, R, 2e-3);
    close("fraction", found.solid_fraction.cell.unwrap(), std::f64::consts::PI / 4.0, 1.0, 1e-3);
    assert_eq!(found.profile.len(), 4);
    // Slab k carries the grains above it and half of its own on average.
    for (k, part) in found.profile.iter().enumerate() {
        let carried = (3.0 - k as f64 + 0.5) * weight / (2.0 * R);
        close(&format!("slab {k}"), part.stress.total[1][1], carried, weight / R, 2e-3);
    }
    close("in the box", found.part.unwrap().stress.total[1][1], 3.0 * weight / (2.0 * R), weight / R, 2e-3);
    assert_eq!(found.fabric.unwrap()[1][1], 1.0);
}

/// The components of a tensor.
fn components(tensor: &serde_json::Value) -> impl Iterator<Item = f64> {
    let rows = tensor.as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
    rows.map(|x| x.as_f64().unwrap()).collect::<Vec<_>>().into_iter()
}

fn packstone(args: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_packstone")).args(args).output().unwrap()
}

const SCENE: &str = r#"
    dimension = 3
    [domain]
    lower = [0, 0, 0]
    upper = [0.02, 0.02, 1]
    boundary = ["periodic", "periodic", "open"]
    [material.glass]
    density = 2500
    normal_stiffness = 1e4
    friction = 0.4
    restitution = 0.5
    [[wall]]
    name = "floor"
    kind = "plane"
    material = "glass"
    point = [0, 0, 0]
    normal = [0, 0, 1]
    [[population]]
    material = "glass"
    count = 300
    radius = { uniform = [0.8e-3, 1e-3] }
    region = { lower = [0, 0, 0.001], upper = [0.02, 0.02, 0.03] }
    [solver]
    damping = 20
    [stop]
    time = 0.06
    [output]
    formats = ["csv"]
"#;

/// `measure` says of a run what its summary says, whatever it ran on, and writes what was asked for.
#[test]
fn measure_reads_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    fs::write(path("bed.toml"), SCENE).unwrap();
    for bench in engines().iter().filter(|bench| bench.name != "gpu double") {
        let engine = bench.name.split(' ').next().unwrap();
        let out = path(engine);
        let run = packstone(&["run", &path("bed.toml"), "--engine", engine, "--out", &out]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let text = fs::read_to_string(path(&format!("{engine}/summary.json"))).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
        let (exports, tables) =
            ([path("c.csv"), path("c.vtp"), path("c.npz"), path("c.xyz"), path("c.dump")], path("tables"));
        let mut args = vec!["measure", &out, "--json", "--out", &tables, "--box", "0,0,0.002,0.02,0.02,0.008"];
        exports.iter().for_each(|export| args.extend(["--export", export]));
        let measured = packstone(&args);
        assert!(measured.status.success(), "{}", String::from_utf8_lossy(&measured.stderr));
        let measures: serde_json::Value = serde_json::from_slice(&measured.stdout).unwrap();
        assert_eq!(measures["step"], summary["steps"]);
        for key in ["contacts", "coordination_without_rattlers", "rattlers"] {
            assert_eq!(measures[key], summary[key], "{key}");
        }
        // A device knows the velocities of the kinetic part in its precision.
        let pressure = summary["pressure"].as_f64().unwrap();
        close("pressure", measures["stress"]["pressure"].as_f64().unwrap(), pressure, pressure, 1e-6);
        for (found, expected) in components(&measures["stress"]["total"]).zip(components(&summary["stress"])) {
            close("stress", found, expected, pressure, 1e-6);
        }
        assert_eq!(measures["walls"][0]["force"], summary["walls"][0]["force"]);
        assert_eq!(measures["walls"][0]["moment"], summary["walls"][0]["moment"]);
        // The last row of the history has the same loads.
        let history = fs::read_to_string(path(&format!("{engine}/history.csv"))).unwrap();
        let rows: Vec<Vec<&str>> = history.lines().map(|line| line.split(',').collect()).collect();
        let column = rows[0].iter().position(|name| *name == "walls.floor.force.z").unwrap();
        assert!(rows.iter().all(|row| row.len() == rows[0].len() && row.len() > column));
        let (last, now) =
            (rows.last().unwrap()[column].parse::<f64>().unwrap(), summary["walls"][0]["force"][2].as_f64().unwrap());
        close("history", last, now, now.abs(), 1e-4);
        assert!(summary["walls"][0]["force"][2].as_f64().unwrap() < 0.0 && summary["pressure"].as_f64().unwrap() > 0.0);
        for name in [
            "measures.json",
            "measures.csv",
            "grains.csv",
            "contacts.csv",
            "distributions.csv",
            "profile.csv",
            "radial_distribution.csv",
        ] {
            assert!(fs::metadata(path(&format!("tables/{name}"))).unwrap().len() > 20, "{name}");
        }
        let table = fs::read(&exports[0]).unwrap();
        assert_eq!(table, fs::read(path("tables/contacts.csv")).unwrap());
        // What packstone writes for others it can read.
        for export in &exports[3..] {
            // Types of LAMMPS are numbers.
            let names = if export.ends_with("dump") { "material = { 1 = \"glass\" }" } else { "" };
            let again = format!(
                "dimension = 3\nmaterial.glass.density = 2500\nmaterial.glass.normal_stiffness = 1e4\n\
                 stop.steps = 1\n[[population]]\nfile = \"{export}\"\n{names}\n"
            );
            fs::write(path("again.toml"), again).unwrap();
            let described = packstone(&["describe", &path("again.toml")]);
            assert!(described.status.success(), "{export}: {}", String::from_utf8_lossy(&described.stderr));
        }
        let words = packstone(&["measure", &path(&format!("{engine}/checkpoint.bin"))]);
        assert!(String::from_utf8_lossy(&words.stdout).contains("wall floor"), "{words:?}");
        let table = packstone(&["measure", &out, "--csv"]);
        assert!(String::from_utf8_lossy(&table.stdout).contains("\nwalls.floor.force.z,-"), "{table:?}");
    }
    for (args, part) in [
        (vec!["--box", "0,0,1"], "must be 6 numbers"),
        (vec!["--box", "0,0,1,1,1,0"], "along z it is not"),
        (vec!["--export", "x.txt"], "must be one of .csv"),
        (vec!["--width", "0"], "a thousandth of the mean radius"),
    ] {
        let refused = packstone(&[&["measure", &path("cpu")][..], &args].concat());
        assert_eq!(refused.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&refused.stderr).contains(part), "{refused:?}");
    }
}

/// The slope of grains on a square grid, as high as a height says of their place, without a domain or with one.
fn slope_of(domain: &str, height: impl Fn(f64, f64) -> f64) -> Option<Slope> {
    let side = || (-24..=24).map(f64::from);
    let grain = |(x, y): (f64, f64)| {
        let z = height(x, y).max(0.0);
        format!("[[grain]]\nmaterial = \"sand\"\nradius = 0.45\nposition = [{x}, {y}, {z}]\n")
    };
    let grains: String = side().flat_map(|x| side().map(move |y| (x, y))).map(grain).collect();
    let text = format!(
        "dimension = 3\n[material.sand]\ndensity = 1000\nnormal_stiffness = 1e5\n[stop]\nsteps = 1\n{domain}\n{grains}"
    );
    let assembly = Scene::parse(&text, "heap", Path::new("."), &[]).unwrap().assemble().unwrap();
    slope(&assembly, &assembly.grains)
}

#[test]
fn slopes_of_heaps_of_known_shape() {
    let slot =
        "[domain]\nlower = [-30, -24.5, -1]\nupper = [30, 24.5, 30]\nboundary = [\"open\", \"periodic\", \"open\"]";
    for (angle, domain) in [(0.3_f64, ""), (0.5, ""), (0.3, slot), (0.5, slot)] {
        // A cone, and a wedge along the axis that repeats.
        let distance = |x: f64, y: f64| if domain.is_empty() { x.hypot(y) } else { x.abs() };
        let found = slope_of(domain, |x, y| (20.0 - distance(x, y)) * angle.tan()).expect("a heap");
        println!("{angle}: {found:?}");
        // As far as grains are not in the middles of the columns.
        assert!((found.angle - angle).abs() < 0.02 && found.error < 0.01, "{angle}: {found:?}");
    }
    // A bed and a step have no flanks.
    assert_eq!(slope_of("", |_, _| 3.0), None);
    assert_eq!(slope_of("", |x, _| if x > 0.0 { 3.0 } else { 0.0 }), None);
}
