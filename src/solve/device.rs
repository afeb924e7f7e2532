//! Jacobi's relaxation of a [`Problem`] on a device: the kernels of `shaders/solve/`, whose twin is [`super::jacobi`].
//!
//! The kernels that relax scenes cannot serve. They apply W by way of the bodies in neighbour lists, and know of its
//! blocks what spheres make of them, two numbers for a contact. Here W is a matrix with any blocks, and there are no
//! bodies.
//!
//! A pass is a step of all contacts, a product with W, and a decision on step length and momentum, none of which asks
//! the host. It reads residuals once in `BATCH` passes, finds L beforehand (reading W from a file takes longer than 40
//! products), and believes no residual that it has not computed itself in f64.

use crate::solve::{
    contact::Contact,
    jacobi::initial_state,
    momentum::{MomentumLimits, NONE_YET, POWER_ITERATIONS, ROUNDING_DOUBLE, ROUNDING_SINGLE, SolverState},
    operator::{Operator, velocities},
    options::{Options, Solver},
    problem::Problem,
    residual::{contacts, relative},
    solution::{DIVERGED, Record, Solution},
};
use crate::{
    error::{Error, Result},
    gpu::{Arrays, Device, DeviceOptions, Layout, Placement, Program, compose, workgroups},
    record::Element,
    shaders,
};
use glam::DVec3;
use std::{collections::HashMap, time::Instant};
use wgpu::BufferUsages;

/// Passes between two looks of the host. Those that are not needed any more do nothing.
const BATCH: usize = 64;
/// The device's residual has round-off in it: from this multiple of the tolerance on the host looks for itself.
const NEAR: f64 = 10.0;
/// The kernels of a pass; the first one also puts by the best iterate of all passes before.
const PASS: [&str; 3] = ["disc_pass", "apply_delassus", "momentum_restart"];
/// What single precision bears: the part of the largest scale of W that each of a contact's own must be, and μ.
const SINGLE: (f64, f64) = (1e-15, 1e9);

/// `jacobi` or `jacobi-accelerated` on an open device.
pub struct Jacobi {
    device: Device,
    solver: Solver,
    double: bool,
}

impl Jacobi {
    /// Open the best device.
    ///
    /// # Errors
    /// [`Error::Problem`] if the solver runs on the CPU only, [`Error::Device`] if there is no such device.
    pub fn open(solver: Solver, double: bool) -> Result<Jacobi> {
        if !matches!(solver, Solver::Jacobi | Solver::JacobiAccelerated) {
            let reason = "runs with --engine cpu only; on the GPU there are jacobi and jacobi-accelerated";
            return Err(Error::Problem(format!("{} {reason}", solver.label())));
        }
        Ok(Jacobi {
            device: Device::open(DeviceOptions { double, arrays: Arrays::Buffers, ..DeviceOptions::default() })?,
            solver,
            double,
        })
    }

    /// Solve from r = 0. Residuals in the history are those of the device, except for what is called a solution.
    ///
    /// # Errors
    /// [`Error::Problem`] where numbers do not suit single precision, [`Error::Device`] where W does not fit.
    pub fn solve(&self, problem: &Problem, options: &Options) -> Result<Solution> {
        options.check(self.solver)?;
        let started = Instant::now();
        let contacts = contacts(problem);
        let mut evaluator = Evaluator { problem, contacts: &contacts, evaluations: 0 };
        let mut found = evaluator.evaluate(vec![DVec3::ZERO; problem.len()]);
        let record = |pass, residual| Record { pass, residual, seconds: started.elapsed().as_secs_f64() };
        let mut history = vec![record(0, found.residual)];
        let (mut passes, mut goal, mut seen) = (0, options.tolerance, f64::INFINITY);
        let relaxation = Relaxation::new(self, problem, &contacts, options.tolerance)?;
        while found.residual > options.tolerance && passes < options.max_iterations {
            let limit = options.max_iterations.min(passes + BATCH);
            let (state, least, residuals) = relaxation.advance(limit - passes, limit, goal)?;
            let (done, residual) = (state.passes as usize, state.residual_estimate);
            history.extend((passes..done).map(|pass| record(pass + 1, residuals[pass % BATCH])));
            // The device compares in its own precision, and may be content with what the host is not.
            let content = residual <= goal || done == passes;
            passes = done;
            // Written so that NaN stops. At 0 nothing would change any more.
            let going = residual > 0.0 && residual <= DIVERGED * least && passes < options.max_iterations;
            if !going || least <= NEAR * options.tolerance && least < seen {
                let best = evaluator.evaluate(relaxation.best()?);
                if best.residual <= options.tolerance && least == residual {
                    *history.last_mut().expect("a pass was recorded") = record(passes, best.residual);
                }
                if best.residual < found.residual {
                    found = best;
                }
                seen = least;
            }
            if content {
                goal = 0.9 * residual; // what the device takes for a solution may be none
            }
            if !going {
                break;
            }
        }
        Ok(Solution {
            converged: found.residual <= options.tolerance,
            passes,
            other_passes: POWER_ITERATIONS as usize + 1 + evaluator.evaluations,
            history,
            ..found
        })
    }
}

/// Residuals by the host.
struct Evaluator<'a> {
    problem: &'a Problem,
    contacts: &'a [Contact],
    evaluations: usize,
}

impl Evaluator<'_> {
    /// These impulses as a solution.
    fn evaluate(&mut self, r: Vec<DVec3>) -> Solution {
        self.evaluations += 1;
        let mut u = vec![DVec3::ZERO; r.len()];
        velocities(self.problem, &mut self.problem.free(), &r, &mut u);
        let residual = relative(self.contacts, &r, &u, self.problem.reference());
        Solution { r, u, residual, ..Solution::default() }
    }
}

/// A problem on a device.
struct Relaxation<'a> {
    device: &'a Device,
    contacts: usize,
    dims: usize,
    limits: MomentumLimits,
    /// What the device counts impulses in.
    unit: f64,
    /// Of a pass, with their workgroups.
    kernels: Vec<(wgpu::ComputePipeline, wgpu::BindGroup, (u32, u32))>,
    layouts: HashMap<String, Layout>,
    buffers: HashMap<String, wgpu::Buffer>,
}

impl<'a> Relaxation<'a> {
    fn new(jacobi: &'a Jacobi, problem: &Problem, contacts: &[Contact], tolerance: f64) -> Result<Relaxation<'a>> {
        let Jacobi { device, solver, double } = jacobi;
        let (n, dims, blocks) = (problem.len(), problem.dims(), problem.blocks());
        let weight = contacts.iter().map(|c| c.lambda).fold(0.0, f64::max);
        if !double {
            check_range(contacts, weight)?;
        }
        let floor = if *double { ROUNDING_DOUBLE } else { ROUNDING_SINGLE };
        let programs = programs(dims, *double)?;
        let bindings = programs.iter().flat_map(|program| &program.bindings);
        let mut relaxation = Relaxation {
            device,
            contacts: n,
            dims,
            limits: MomentumLimits::of_problem(*solver == Solver::JacobiAccelerated, tolerance, floor),
            unit: problem.reference() / weight,
            layouts: bindings.map(|binding| (binding.name.clone(), binding.layout.clone())).collect(),
            buffers: HashMap::new(),
            kernels: Vec::new(),
        };
        let (x, y) = workgroups(n);
        let rows = [("row_start", n + 1), ("column", blocks), ("w", blocks * dims), ("contact", n)];
        let iterates = ["x", "y", "next", "u_next", "best"].map(|name| (name, n));
        let sums = [("pass_sums", (x * y) as usize), ("residuals", BATCH)];
        let states = [("solver_state", 1), ("best_pass", 1), ("rule", 1)];
        for (name, length) in [&rows[..], &iterates, &sums, &states].concat() {
            relaxation.allocate(name, length)?;
        }
        relaxation.fill(problem, contacts, weight);
        for program in programs {
            let label = program.entry.clone();
            let names: Vec<String> = program.bindings.iter().map(|binding| binding.name.clone()).collect();
            let pipeline = device.pipeline(&label, program)?;
            let resources = names.iter().map(|name| relaxation.buffers[name].as_entire_binding());
            let group = device.group(&label, &pipeline, resources);
            let size = if label == "momentum_restart" { (1, 1) } else { (x, y) };
            relaxation.kernels.push((pipeline, group, size));
        }
        Ok(relaxation)
    }

    /// An array of zeros.
    fn allocate(&mut self, name: &str, length: usize) -> Result<()> {
        let usage = if name == "rule" { BufferUsages::UNIFORM } else { BufferUsages::STORAGE };
        let bytes = (length * self.layouts[name].stride) as u64;
        let buffer = self.device.buffer(name, bytes, usage | BufferUsages::COPY_DST | BufferUsages::COPY_SRC);
        let buffer = buffer.map_err(|e| Error::Device(format!("problem too large: {e}")))?;
        self.buffers.insert(name.to_owned(), buffer);
        Ok(())
    }

    /// The problem, and the iterate r = 0.
    fn fill(&self, problem: &Problem, contacts: &[Contact], weight: f64) {
        let n = contacts.len();
        let q: Vec<DVec3> = problem.q().iter().map(|q| *q / problem.reference()).collect();
        let put = |v: DVec3, sink: Sink| v.to_array()[..self.dims].iter().for_each(|&x| sink(x));
        self.write("contact", n, |sink| {
            for (q, c) in q.iter().zip(contacts) {
                put(*q, sink);
                [c.mu, c.lambda / weight, c.scales.normal / weight, c.scales.tangential / weight]
                    .into_iter()
                    .for_each(&mut *sink);
            }
        });
        self.write("u_next", n, |sink| q.iter().for_each(|q| put(*q, sink)));
        let ends = (0..n).scan(0, |end, k| {
            *end += problem.row(k).count();
            Some(*end)
        });
        self.write("row_start", n + 1, |sink| [0].into_iter().chain(ends).for_each(|start| sink(start as f64)));
        let rows = || (0..n).flat_map(|k| problem.row(k));
        self.write("column", problem.blocks(), |sink| rows().for_each(|(j, _)| sink(j as f64)));
        self.write("w", problem.blocks() * self.dims, |sink| {
            rows().for_each(|(_, block)| (0..self.dims).for_each(|axis| put(block.col(axis) / weight, sink)));
        });
        // No pass has been yet.
        let state = SolverState { scale: 1.0, residual_estimate: NONE_YET, ..initial_state(problem, contacts) };
        self.write("solver_state", 1, |sink| state.put(self.dims, &mut |lane| sink(lane)));
        self.write_record("best_pass", &[("residual", NONE_YET)]);
    }

    fn write(&self, name: &str, length: usize, values: impl FnOnce(Sink)) {
        let layout = &self.layouts[name];
        let bytes = layout.encode(length, &vec![1.0; layout.lanes.len()], values);
        self.device.queue.write_buffer(&self.buffers[name], 0, &bytes);
    }

    /// A struct of numbers; those that are not named are 0.
    fn write_record(&self, name: &str, fields: &[(&str, f64)]) {
        let value = |name: &String| fields.iter().find(|(field, _)| field == name).map_or(0.0, |(_, value)| *value);
        self.write(name, 1, |sink| self.layouts[name].names.iter().for_each(|name| sink(value(name))));
    }

    fn read(&self, name: &str, length: usize) -> Result<Vec<f64>> {
        let layout = &self.layouts[name];
        let bytes = self.device.read(&self.buffers[name], 0, (length * layout.stride) as u64)?;
        let units = vec![1.0; layout.lanes.len()];
        let mut next = layout.decode(&bytes, &units);
        Ok((0..length * layout.lanes.len()).map(|_| next()).collect())
    }

    /// So many passes, but none after the one whose number is `limit` or whose residual is at most `goal`: the state
    /// after them, the least residual, and the residuals of the latest, by turns.
    fn advance(&self, passes: usize, limit: usize, goal: f64) -> Result<(SolverState, f64, Vec<f64>)> {
        let count = |value: usize| value as f64;
        self.write_record(
            "rule",
            &[
                ("contacts", count(self.contacts)),
                ("limit", count(limit)),
                ("goal", goal),
                ("max_momentum", self.limits.max_momentum),
                ("rounding", self.limits.rounding),
            ],
        );
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        let mut compute = encoder.begin_compute_pass(&Default::default());
        for k in 0..passes * self.kernels.len() + 1 {
            let (pipeline, group, (x, y)) = &self.kernels[k % self.kernels.len()];
            compute.set_pipeline(pipeline);
            compute.set_bind_group(0, group, &[]);
            compute.dispatch_workgroups(*x, *y, 1);
        }
        drop(compute);
        self.device.submit(encoder);
        self.device.check()?;
        let mut lanes = self.read("solver_state", 1)?.into_iter();
        let state = SolverState::take(self.dims, &mut || lanes.next().expect("the kernels have the same record"));
        let [_improved, least] = self.read("best_pass", 1)?[..] else { unreachable!("two numbers") };
        Ok((state, least, self.read("residuals", BATCH)?))
    }

    /// Impulses of the best pass.
    fn best(&self) -> Result<Vec<DVec3>> {
        let numbers = self.read("best", self.contacts)?;
        let vector = |r: &[f64]| self.unit * DVec3::new(r[0], r[1], r.get(2).copied().unwrap_or(0.0));
        Ok(numbers.chunks(self.dims).map(vector).collect())
    }
}

type Sink<'a> = &'a mut dyn FnMut(f64);

/// The kernels of a pass.
fn programs(dims: usize, double: bool) -> Result<Vec<Program>> {
    let scalar = if double { "space/scalar/double.wgsl" } else { "space/scalar/single.wgsl" };
    let dimension = if dims == 2 { "space/dimension/plane.wgsl" } else { "space/dimension/space.wgsl" };
    let shared = ["gpu/pipeline", "solve/natural_map", "solve/momentum", "solve/sums", "solve/relaxation"]
        .map(|name| shaders::file(&format!("{name}.wgsl")));
    let shared: Vec<_> = [scalar, dimension].map(shaders::file).into_iter().chain(shared).collect();
    let kernels = PASS.map(|kernel| (kernel, shaders::file(&format!("solve/{kernel}.wgsl"))));
    compose(&shared, &kernels, |_, _| Placement::Buffer)
}

/// Whether single precision can tell the contacts apart from nothing.
fn check_range(contacts: &[Contact], weight: f64) -> Result<()> {
    let (least, steepest) = SINGLE;
    let refuse = |k: usize, what: String| {
        let advice = "use --precision double or --engine cpu";
        Err(Error::Problem(format!("contact {k}: {what}, beyond single precision; {advice}")))
    };
    for (k, c) in contacts.iter().enumerate() {
        let part = c.scales.normal.min(c.scales.tangential) / weight;
        if part < least {
            return refuse(k, format!("W is {part:e} of the largest"));
        }
        if c.mu > steepest {
            return refuse(k, format!("mu = {:e}", c.mu));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::Matrix;

    #[test]
    fn what_does_not_fit_is_refused() {
        let w = Matrix { rows: 40, columns: 40, entries: (0..40).map(|i| (i, i, 1.0)).collect() };
        let problem = Problem::local(2, &w, &[-1.0; 40], &[0.5; 20]).unwrap();
        let Ok(mut jacobi) = Jacobi::open(Solver::Jacobi, false) else { return };
        jacobi.device.summary.max_array_bytes = 160;
        let said = jacobi.solve(&problem, &Options::default()).unwrap_err().to_string();
        assert!(
            said.contains("problem too large: array `w` needs 320 bytes") && said.contains("--engine cpu"),
            "{said}"
        );
        jacobi.device.summary.max_arrays = 4;
        jacobi.device.summary.max_array_bytes = 1 << 20;
        let said = jacobi.solve(&problem, &Options::default()).unwrap_err().to_string();
        assert!(said.contains("uses") && said.contains("storage buffers"), "{said}");
    }
}
