//! What a scene implies before an engine is chosen: parameters, grid, state at time 0, plans.

use super::{
    grid,
    lists::{LEAST_LENGTH, wall_displacement},
    options::{EngineChoice, Options},
    overlaps::DEEP_OVERLAP,
    start::{self, Piece, Put, anchor, middle},
};
use crate::{
    body::blocks::BLOCK,
    contact::{blocks, cohesion, materials::parameters},
    error::Result,
    memory,
    model::{self, Boundary, Model, Precision},
    plans::Plans,
    scene::{Assembly, Clump, Grain, Method, Numbers},
    solve,
    space::precision::{QUANTA_OF_SLACK, extent_of, quantised, quantum, set_quantum, split},
    state::{Level, Params, Sizes, Spin, State},
    time_step,
    units::{Quantity, Units, power_of_two},
};
use glam::DVec3;

/// Everything a scene implies before an engine is chosen: the state at time 0, its plans, and the time step's bound.
pub struct Setup {
    /// Without grains, which [`Setup::fill`] hands out.
    pub state: State,
    pub plans: Plans,
    pub dt_bound: f64,
}

impl Setup {
    /// Arrays, parameters and plans of a scene: those of all grains that will ever come in, of which [`Setup::fill`] and
    /// `counted` have those that are there.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) if the time step is above its bound or too long for a wall, [`Error::Device`](crate::Error::Device) if the host's memory cannot hold it.
    pub fn new(assembly: &Assembly, options: &Options) -> Result<Setup> {
        let (growth, assembly) = (assembly.growth_law(), &*assembly.whole());
        let (dt, dt_bound) = time_step::choose(assembly)?;
        // The CPU engine has only f64.
        let precision = if options.engine == EngineChoice::Cpu { Precision::Double } else { options.precision };
        let model = Model::of(assembly, precision);
        let (mut params, level) = params(assembly, &model, dt);
        wall_displacement(assembly, &params)?;
        params.slice_shift =
            options.lists_abreast.unwrap_or(1).clamp(1, BLOCK as u32).next_power_of_two().trailing_zeros();
        let units = units(assembly, &model, dt, dt_bound);
        let bodies = assembly.grains.len();
        let guess = bodies * if assembly.dimension == 2 { 4 } else { 6 };
        let sizes = Sizes {
            bodies,
            large: params.large as usize,
            slice_shift: params.slice_shift,
            clumps: assembly.clumps.len(),
            walls: assembly.walls.len(),
            materials: assembly.materials.len(),
            levels: level.len(),
            cells: params.cells as usize,
            entries: options.entries.unwrap_or(guess).max(LEAST_LENGTH),
            history: LEAST_LENGTH,
            contacts: (guess / 2).max(LEAST_LENGTH),
            colors: LEAST_LENGTH,
        };
        params.partial_sums_len = sizes.partial_sums() as u32;
        let range = range(&params, &model, assembly);
        let mut state = State { units, range, ..State::bare(model, sizes, params) };
        if options.engine == EngineChoice::Cpu {
            let dense = sizes.of_dense_packing();
            let of_blocks = dense.entries as u64 * blocks::BYTES_PER_ENTRY;
            let of_arrays = u128::from(state.bytes(&dense)) + u128::from(of_blocks);
            memory::check_host(of_arrays + memory::beside_grains(bodies as u64))?;
        }
        state.level = level;
        if precision == Precision::Single {
            // As the grains on it have it.
            state.level.iter_mut().for_each(|l| l.radius = state.units.rounded(Quantity::Length, l.radius));
        }
        start::fill_small(&mut state, assembly, growth);
        if precision == Precision::Single {
            start::check_range(&state, &Numbers::default(), &Piece::default())?;
        }
        Ok(Setup { plans: Plans::new(&model), state, dt_bound })
    }

    /// Hand out the grains at time 0, piece by piece: arrays, the number of the first element, and a state with these
    /// alone.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) for what single precision cannot hold, and what `put` says.
    pub fn fill(&self, assembly: &Assembly, put: &mut Put) -> Result<()> {
        start::fill(&self.state, assembly, put)
    }

    /// The state at time 0 with all arrays that the model needs.
    ///
    /// # Errors
    /// As [`Setup::fill`].
    pub fn whole(&self, assembly: &Assembly) -> Result<State> {
        let mut state = self.state.clone();
        state.complete()?;
        self.fill(assembly, &mut |arrays, first, piece| {
            arrays.iter().for_each(|array| state.column_mut(array).overwrite(first, piece.column(array)));
            Ok(())
        })?;
        Ok(state)
    }
}

/// Sizes and parameters with the grains of this assembly, of the larger one that they were made for; those above the
/// radius are large.
pub fn counted(present: &Assembly, large: f64, sizes: &Sizes, params: &Params) -> (Sizes, Params) {
    let bodies = present.grains.len();
    let large = present.grains.iter().filter(|grain| grain.radius > large).count();
    let sizes = Sizes { bodies, large, clumps: present.clumps.len(), ..*sizes };
    let params = Params {
        bodies: bodies as u32,
        large: large as u32,
        clumps: sizes.clumps as u32,
        partial_sums_len: sizes.partial_sums() as u32,
        ..*params
    };
    (sizes, params)
}

/// Gaps and overlaps that are none, in radii of the smallest grain: what a step leaves within its tolerance must not
/// cost the next one passes.
const GAP_BAND: f64 = 1e-4;

/// The part of the loads of its two grains that the residual of a contact is relative to: far less than the loads,
/// because the errors of a chain of contacts add up.
const LOAD_FRACTION: f64 = 5e-5;
/// The same without gravity, where loads are all that acts on a contact inside of what collides or is squeezed, and no
/// weight adds up from grain to grain.
const WEIGHTLESS_LOAD_FRACTION: f64 = 0.1;
/// Units in the last place of the loads of two grains below which the residual of their contact may be rounding.
const LOAD_ROUNDINGS: f64 = 4.0;

/// What a device computes in: the mean radius, the mean mass and the step up to which contacts are stable, or the step
/// where none is, or that is not stable.
fn units(assembly: &Assembly, model: &Model, dt: f64, dt_bound: f64) -> Units {
    let grains = assembly.grains.len() as f64;
    let mass = |g: &Grain| time_step::mass(model.dimension, assembly.materials[g.material as usize].density, g.radius);
    let mean_mass = assembly.grains.iter().map(mass).sum::<f64>() / grains;
    let rigid = model.method == model::Method::ContactDynamics;
    Units {
        length: power_of_two(assembly.mean_radius()),
        mass: power_of_two(mean_mass),
        time: power_of_two(if rigid || !dt_bound.is_finite() { dt } else { dt_bound.max(dt) }),
        flat: assembly.dimension == 2,
        elastic: model.normal == model::Normal::Hertz,
        rates: model.damping == model::Damping::MassScaled,
        rigid,
    }
}

fn params(assembly: &Assembly, model: &Model, dt: f64) -> (Params, Vec<Level>) {
    let grains = &assembly.grains;
    let mean_radius = assembly.mean_radius();
    let smallest = assembly.with_smallest_radii().grains.iter().map(|g| g.radius).fold(f64::INFINITY, f64::min);
    let largest = grains.iter().map(|g| g.radius).fold(0.0, f64::max);
    let margin = assembly.solver.margin * mean_radius;
    let reach = cohesion::reach(assembly);
    // Of contact distances, and not of the lists' reach, which must not change a bit.
    let unit = split(2.0 * largest + reach);
    let mut p = Params {
        gravity: assembly.gravity,
        lower: DVec3::NEG_INFINITY,
        upper: DVec3::INFINITY,
        dt,
        history_dt: dt,
        length_unit: unit,
        inverse_length_unit: 1.0 / unit,
        damping: assembly.solver.damping,
        reach,
        margin: reach + margin,
        displacement_limit: 0.5 * margin,
        step_limit: 0.5 * margin.min(smallest),
        narrowest: assembly.narrowest(),
        wall_depth: time_step::depth_beyond_walls(assembly),
        deep_overlap: DEEP_OVERLAP,
        turn_limit: time_step::MOST_TURN,
        gap_band: GAP_BAND * smallest,
        pair: parameters(&assembly.pairs[0]),
        bodies: grains.len() as u32,
        large: assembly.large_grains() as u32,
        clumps: assembly.clumps.len() as u32,
        walls: assembly.walls.len() as u32,
        materials: assembly.materials.len() as u32,
        ..Params::default()
    };
    set_servo(&mut p, assembly);
    set_relaxation(&mut p, assembly, model.precision, mean_radius);
    set_quanta(&mut p, assembly, model, largest);
    let range = range(&p, model, assembly);
    set_domain(&mut p, assembly, model, range);
    let levels = grid::levels(&mut p, assembly, model, range);
    (p, levels)
}

/// Steps from one look of the servo of the cell to the next: few beside the time in which grains answer.
const SERVO_STEPS: u32 = 10;

/// Where stresses begin to settle, and steady rates to hold them: over the largest target.
const CLOSE_STRESS: f64 = 0.05;

/// Time in which the servo makes up for what other components do to a stress, over that in which it makes up for what is
/// missing, if the packing is as stiff as it is taken for. The stress goes beyond its target by [`CLOSE_STRESS`] over this
/// number and over the stiffness that the packing has in truth, which is 1/20 near jamming.
const INTEGRAL_TIME: f64 = 200.0;

/// Rates over their limit that the servo still tells apart: there is hardly a contact then.
const STEEPEST_APPROACH: f64 = 1e3;

/// Of the servo of the cell.
fn set_servo(p: &mut Params, assembly: &Assembly) {
    let stress = assembly.cell.stress.map(Option::unwrap_or_default);
    let controlled = assembly.cell.stress.map(|stress| f64::from(u8::from(stress.is_some())));
    let halves = |x: [f64; 6]| (DVec3::new(x[0], x[1], x[2]), Spin(DVec3::new(x[3], x[4], x[5])));
    (p.stress, p.stress_above) = halves(stress);
    (p.controlled, p.controlled_above) = halves(controlled);
    p.servo_time = p.dt / assembly.cell.gain;
    p.servo_recall = f64::from(SERVO_STEPS) * assembly.cell.gain / INTEGRAL_TIME;
    p.servo_band = CLOSE_STRESS * assembly.cell.largest_stress();
    p.most_rate = assembly.most_rate();
    p.least_rigidity = assembly.cell.largest_stress() / (STEEPEST_APPROACH * p.most_rate).max(f64::MIN_POSITIVE);
    p.servo_steps = SERVO_STEPS;
}

/// Of contact dynamics.
fn set_relaxation(p: &mut Params, assembly: &Assembly, precision: Precision, mean_radius: f64) {
    if let Method::ContactDynamics(relaxation) = assembly.solver.method {
        p.tolerance = relaxation.tolerance;
        let weightless = assembly.gravity == DVec3::ZERO;
        p.load_fraction = if weightless { WEIGHTLESS_LOAD_FRACTION } else { LOAD_FRACTION };
        p.load_rounding = LOAD_ROUNDINGS * precision.epsilon() / relaxation.tolerance;
        p.max_momentum = if relaxation.solver == solve::Solver::Jacobi { 0.0 } else { 1.0 };
        // Slower than what gravity takes away in a step, so that nothing flies up; without gravity something small.
        let gained = assembly.gravity.length() * p.dt;
        let gentle = if gained > 0.0 { 0.1 * gained } else { 1e-3 * mean_radius / p.dt };
        p.max_correction_velocity = relaxation.max_correction_velocity.unwrap_or(gentle);
    }
}

/// What single precision keeps positions and arms as multiples of.
fn set_quanta(p: &mut Params, assembly: &Assembly, model: &Model, largest: f64) {
    let single = model.precision == Precision::Single;
    let arm = |c: &Clump| c.radius * assembly.shapes[c.shape as usize].reach();
    let longest = assembly.clumps.iter().map(arm).fold(0.0, f64::max);
    p.arm_unit = quantum(if longest > 0.0 { longest } else { largest });
    p.inverse_arm_unit = 1.0 / p.arm_unit;
    let reach = landmarks(assembly).map(|x| x.abs().max_element()).fold(0.0, f64::max);
    set_quantum(p, reach + largest, f64::INFINITY);
    p.position_slack = 1e-5 * largest + if single { QUANTA_OF_SLACK * p.quantum } else { 0.0 };
}

/// Radii of the smallest grain from the origin up to which its overlaps have all digits that they need in single
/// precision, 3e-11 of its radius.
const FAR: f64 = 16384.0;

/// How far from the origin grains may go.
fn range(p: &Params, model: &Model, assembly: &Assembly) -> f64 {
    let smallest = assembly.grains.iter().map(|g| g.radius).fold(f64::INFINITY, f64::min);
    match model.precision {
        Precision::Single => extent_of(p.quantum).max(FAR * smallest),
        Precision::Double => f64::INFINITY,
    }
}

/// Faces or periods.
fn set_domain(p: &mut Params, assembly: &Assembly, model: &Model, range: f64) {
    let domain = &assembly.domain;
    for axis in 0..model.dims() {
        let (lower, upper) = (domain.lower[axis], domain.upper[axis]);
        if domain.periodic[axis] {
            p.period[axis] = upper - lower;
            p.inverse_period[axis] = 1.0 / p.period[axis];
            if model.precision == Precision::Single && model.boundary == Boundary::Periodic {
                let whole = quantised(p, p.period)[axis];
                (p.period_low[axis], p.period[axis]) = (p.period[axis] - whole, whole);
            }
            p.cell_origin[axis] = lower;
        } else {
            // What leaves through an outlet is taken away before anybody minds.
            let (lower, upper) = if domain.outlet[axis] { (-range, range) } else { (lower, upper) };
            p.lower[axis] = lower.max(-range);
            p.upper[axis] = upper.min(range);
            p.cell_origin[axis] = assembly.grains.iter().map(|g| g.position[axis]).fold(f64::INFINITY, f64::min);
        }
    }
}

/// Positions of grains, finite corners of the domain and points of walls: how far coordinates go.
fn landmarks(assembly: &Assembly) -> impl Iterator<Item = DVec3> {
    let finite = |x: DVec3| DVec3::select(x.is_finite_mask(), x, DVec3::ZERO);
    let corners = [assembly.domain.lower, assembly.domain.upper].map(finite);
    let middle = middle(assembly);
    let walls = assembly.walls.iter().map(move |wall| anchor(&wall.surface, middle));
    assembly.grains.iter().map(|g| g.position).chain(corners).chain(walls)
}
