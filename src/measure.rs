//! Measurements: sums over grains, contact forces, velocities at the time of the positions; and quantities of the field
//! from them.

mod add_wall_loads;
mod add_works;
mod add_works_of_clumps;
mod analysis;
pub(crate) mod blocks;
mod body_sums;
mod clip;
mod contact_forces;
pub(crate) mod contacts;
pub(crate) mod energies;
#[expect(clippy::module_inception, reason = "the kernel is called so")]
mod measure;
mod measure_clumps;
pub(crate) mod measure_for_servo;
pub mod micromechanics;
mod packing;
pub(crate) mod plan;
mod servo;
mod servo_walls;
mod sizes;
mod skyline;
mod slope;
pub(crate) mod sums;
mod synchronise;
mod synchronise_clumps;
mod wall_loads;
mod wall_loads_for_servo;
mod wall_sums;

pub use analysis::{
    CellSample, GrowthSample, OpeningsSample, Sample, angular_momentum, angular_momentum_of_clumps, backbone,
    mass_of_clump, masses, momentum, momentum_of_clumps,
};
pub use micromechanics::{Asked, Contact, Measures, Other, Packing};
pub use packing::{PackingFraction, overall_packing_fraction, packing_fraction};

pub use sizes::{Percentiles, Sizes};
pub use slope::{Slope, slope};

use contacts::contact_of;

use crate::{
    body::rotation::spin_of,
    contact::{
        kicks::{kicks_of_bodies, kicks_of_clumps},
        overlap::{largest_force, largest_torque},
    },
    model::Method,
    space::dimension::volume_of,
    stage::*,
    state::{self, Cell, Element, PartialSums, Spin, State, WALL_PARTS, Wall, WallLoad, Works, array},
};
use glam::DVec3;

/// Grains at rest: what contacts do one by one.
const FLOORS: &[Floor] = &[
    (&[&array::FORCE], largest_force),
    (&[&array::TORQUE], largest_torque),
    (&[&array::VELOCITY_NEXT], |s| kicks_of_bodies(s, contact_of)[0]),
    (&[&array::SPIN_NEXT], |s| kicks_of_bodies(s, contact_of)[1]),
    (&[&array::CLUMP_VELOCITY_NEXT], |s| kicks_of_clumps(s, contact_of)[0]),
    (&[&array::CLUMP_SPIN_NEXT], |s| kicks_of_clumps(s, contact_of)[1]),
];

/// Grains at rest balance.
const SUM_FLOORS: &[MemberFloors] = &[(&array::PARTIAL_SUMS, sums_at_rest)];

/// The energy, J, that single forces give the heaviest grain in a step, what damping takes of it, W, the contact forces
/// that balance, N, and overlaps that are none.
fn sums_at_rest(s: &State) -> Vec<f64> {
    at_rest(s).lanes(s.model.dims())
}

fn at_rest(s: &State) -> PartialSums {
    let lightest = s.velocity.iter().map(|m| m.inverse_mass).filter(|m| *m > 0.0).fold(f64::INFINITY, f64::min);
    let gravity = s.params.dt * s.params.gravity.length();
    let kinetic = 0.5 * gravity.max(kicks_of_bodies(s, contact_of)[0]).powi(2) / lightest;
    let net_force = s.partial_sums.iter().map(|part| part.contact_force).fold(0.0, f64::max);
    let dissipation = 2.0 * kinetic * s.params.damping.max(1.0 / s.params.dt);
    // Of rigid grains those within the band that is taken for contact.
    let smallest = s.position.iter().map(|here| here.radius).fold(f64::INFINITY, f64::min);
    let overlap = if s.model.method == Method::ContactDynamics { s.params.gap_band / smallest } else { 0.0 };
    let largest = s.position.iter().map(|here| here.radius).fold(0.0, f64::max);
    // Of a tensor all components have the rounding of the largest.
    let flux = s.partial_sums.iter().map(|part| part.flux.max_element()).fold(2.0 * kinetic, f64::max);
    let virial = net_force * largest;
    PartialSums {
        kinetic,
        net_force,
        dissipation,
        sliding: dissipation,
        overlap,
        virial: DVec3::splat(virial),
        virial_above: Spin(DVec3::splat(virial)),
        flux: DVec3::splat(flux),
        flux_above: Spin(DVec3::splat(flux)),
        ..PartialSums::default()
    }
}

/// Forces on walls, and their moments, that may cancel.
const WALL_FLOORS: &[MemberFloors] = &[(&array::WALL_LOAD_SUMS, loads_at_rest), (&array::WALL_LOAD, loads_at_rest)];

fn loads_at_rest(s: &State) -> Vec<f64> {
    let force = largest_force(s);
    let arm = |w: &Wall| s.position.iter().map(|p| (p.x - w.point).length() + p.radius).fold(0.0, f64::max);
    let moment = force * s.wall.iter().map(arm).fold(0.0, f64::max);
    let floors = WallLoad {
        force: DVec3::splat(force),
        moment: Spin(DVec3::splat(moment)),
        normal_force: force,
        ..WallLoad::default()
    };
    floors.lanes(s.model.dims())
}

fn parts_of_walls(sizes: &state::Sizes) -> usize {
    WALL_PARTS * sizes.walls
}

/// The same of works: what a step does at least to a grain that balances.
const WORK_FLOORS: &[MemberFloors] = &[(&array::WORKS, works_at_rest)];

fn works_at_rest(s: &State) -> Vec<f64> {
    let force = largest_force(s);
    let speed = |v: f64, spin: f64, radius: f64| v + spin.abs() * radius;
    let walls = s.wall.iter().map(|w| speed(w.velocity.length(), w.spin.0.length(), w.radius)).fold(0.0, f64::max);
    let fixed = |i: &usize| s.velocity[*i].inverse_mass == 0.0;
    let fastest = |i: usize| speed(s.velocity[i].v.length(), spin_of(s, i).length(), s.position[i].radius);
    let fixed = (0..s.sizes.bodies).filter(fixed).map(fastest).fold(0.0, f64::max);
    let dt = s.params.dt;
    let largest = s.position.iter().map(|here| here.radius).fold(0.0, f64::max);
    let flow = s.cell.first().map_or(0.0, |cell| 2.0 * largest * cell.largest_rate);
    let growth = s.growth_rate.iter().map(|rate| rate.abs()).fold(0.0, f64::max);
    let swelling = 2.0 * largest * growth;
    let works = Works {
        dissipated: dt * at_rest(s).dissipation,
        walls: dt * force * walls,
        fixed: dt * force * fixed,
        cell: dt * force * flow,
        growth: dt * (force * swelling + at_rest(s).kinetic * growth),
    };
    works.lanes(s.model.dims())
}

/// Sums over grains.
pub static MEASURE: Stage = Stage {
    check: Check { member_floors: SUM_FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "measure", measure::measure, state::Sizes::partial_sums)
};

/// The same before every so many steps.
pub static MEASURE_FOR_SERVO: Stage = Stage {
    check: Check { member_floors: SUM_FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "measure_for_servo", measure_for_servo::measure_for_servo, state::Sizes::partial_sums)
};

/// The servo of the cell.
pub static SERVO: Stage = Stage {
    dispatch: Dispatch::OneGroup,
    check: Check { member_floors: &[(&array::CELL, floors_of_servo)], ..Check::ROUNDING },
    ..Stage::new("measure", "servo", servo::servo, |_| 1)
};

/// Stresses may cancel, of those that are there or asked for.
fn floors_of_servo(s: &State) -> Vec<f64> {
    let (p, cell) = (&s.params, &s.cell[0]);
    let most = |of: fn(&PartialSums) -> f64| s.partial_sums.iter().map(of).sum::<f64>();
    let virial = most(|row| row.virial.abs().max_element());
    let stress = virial / volume_of(s.model.dimension, cell.length);
    let splat = |x: f64| DVec3::splat(x);
    let floors = Cell {
        rate_next: splat(p.most_rate),
        shear_rate_next: Spin(splat(p.most_rate)),
        steady_rate: splat(p.most_rate),
        steady_shear_rate: Spin(splat(p.most_rate)),
        stress: splat(stress),
        stress_above: Spin(splat(stress)),
        ..Cell::default()
    };
    floors.lanes(s.model.dims())
}

/// What grains do to walls, row by row.
pub static WALL_LOADS: Stage = Stage {
    check: Check { member_floors: WALL_FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "wall_loads", wall_loads::wall_loads, state::Sizes::partial_sums)
};

/// The same before every so many steps.
pub static WALL_LOADS_FOR_SERVO: Stage = Stage {
    check: Check { member_floors: WALL_FLOORS, ..Check::FORCES },
    ..Stage::new(
        "measure",
        "wall_loads_for_servo",
        wall_loads_for_servo::wall_loads_for_servo,
        state::Sizes::partial_sums,
    )
};

/// The servo of walls.
pub static SERVO_WALLS: Stage = Stage {
    dispatch: Dispatch::OneGroup,
    check: Check { member_floors: &[(&array::WALL, floors_of_wall_servo)], ..Check::ROUNDING },
    ..Stage::new("measure", "servo_walls", servo_walls::servo_walls, |_| 1)
};

/// Forces may cancel that are there or asked for.
fn floors_of_wall_servo(s: &State) -> Vec<f64> {
    let speed = |w: usize| {
        let now = servo_walls::pressing(s, w);
        servo_walls::target(s, w).max(now.normal_force) / servo_walls::resistance(s, w, &now)
    };
    let driven = (0..s.sizes.walls).filter(|w| s.wall[*w].driven != 0);
    let speed = driven.map(speed).fold(0.0, f64::max);
    let floors = Wall { velocity_next: DVec3::splat(speed), growth_next: speed, ..Wall::default() };
    floors.lanes(s.model.dims())
}

/// Sums of rows of loads.
pub static ADD_WALL_LOADS: Stage = Stage {
    check: Check { member_floors: WALL_FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "add_wall_loads", add_wall_loads::add_wall_loads, parts_of_walls)
};

/// Velocities at the time of the positions.
pub static SYNCHRONISE: Stage = Stage {
    check: Check { floors: FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "synchronise", synchronise::synchronise, bodies)
};

/// Sums over clumps.
pub static MEASURE_CLUMPS: Stage = Stage {
    check: Check { member_floors: SUM_FLOORS, ..Check::FORCES_ON_CLUMPS },
    ..Stage::new("measure", "measure_clumps", measure_clumps::measure_clumps, state::Sizes::partial_sums)
};

/// Dissipation and works of a step.
pub static ADD_WORKS: Stage = Stage {
    check: Check { member_floors: WORK_FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "add_works", add_works::add_works, bodies)
};

/// The same of clumps.
pub static ADD_WORKS_OF_CLUMPS: Stage = Stage {
    check: Check { member_floors: WORK_FLOORS, ..Check::FORCES_ON_CLUMPS },
    ..Stage::new("measure", "add_works_of_clumps", add_works_of_clumps::add_works_of_clumps, clumps)
};

/// Velocities of clumps at the time of the positions.
pub static SYNCHRONISE_CLUMPS: Stage = Stage {
    check: Check { floors: FLOORS, ..Check::FORCES_ON_CLUMPS },
    ..Stage::new("measure", "synchronise_clumps", synchronise_clumps::synchronise_clumps, clumps)
};

/// Contact forces and moments.
pub static CONTACT_FORCES: Stage = Stage {
    check: Check { floors: FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "contact_forces", contact_forces::contact_forces, bodies)
};
