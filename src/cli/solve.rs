//! `packstone solve`

use super::common::{UNSURE, engines, precisions, say};
use glam::DVec3;
use packstone::{
    Error, io,
    model::Precision,
    simulation::EngineChoice,
    solve::{
        self, Operator, Options, Order, Problem, Solution, Solver,
        device::Jacobi,
        residual::{self, Report, contacts},
    },
};
use serde_json::json;
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

/// Solve a frictional contact problem from a file
#[derive(clap::Args)]
#[command(after_help = "Solvers:\n  \
    gauss-seidel          one contact after the other; see --order\n  \
    jacobi                all contacts from the same iterate; also with --engine gpu\n  \
    jacobi-accelerated    the same with momentum; also with --engine gpu\n  \
    coloured-accelerated  Gauss-Seidel colour by colour with momentum\n  \
    socp                  cone programs by an interior point method, to a fixed point\n  \
    lemke                 complementary pivoting; small problems in the plane\n\n\
    Files: .dat (text) or .hdf5 (FCLIB), see docs/contact-problems.md. Exit code 3: the tolerance was not reached.\n\n\
    Example:\n  packstone solve tests/problems/NESpheres_10_1.dat --solver jacobi-accelerated --tolerance 1e-8")]
pub struct SolveArgs {
    /// File of the problem
    problem: PathBuf,
    /// See below [default: coloured-accelerated; on the GPU jacobi-accelerated]
    #[arg(long, value_name = "NAME")]
    solver: Option<Solver>,
    /// What to compute on
    #[arg(long, default_value = "cpu", value_parser = engines(["cpu", "gpu"]))]
    pub engine: EngineChoice,
    /// Arithmetic of the GPU; the CPU always computes in double
    #[arg(long, default_value = "single", value_parser = precisions())]
    precision: Precision,
    /// Order of gauss-seidel: random-sweep, random-sequential, shuffled-once or fixed [default: fixed]
    #[arg(long, value_name = "NAME")]
    order: Option<Order>,
    /// Seed of the random orders
    #[arg(long, default_value_t = Options::default().seed)]
    seed: u64,
    /// Relative residual to reach
    #[arg(long, value_name = "RESIDUAL", default_value_t = Options::default().tolerance, allow_negative_numbers = true)]
    tolerance: f64,
    /// Passes at most; cone programs of socp, pivots of lemke
    #[arg(long, value_name = "COUNT", default_value_t = Options::default().max_iterations)]
    max_iterations: usize,
    /// Solve the associated problem instead, in which sliding contacts open (socp only)
    #[arg(long)]
    associated: bool,
    /// File for pass, residual and seconds of each pass
    #[arg(long, value_name = "FILE.csv")]
    history: Option<PathBuf>,
    /// Judge the impulses in this file (numbers, contact by contact) by the same measures, instead of solving
    #[arg(long, value_name = "FILE", conflicts_with_all = ["solver", "engine", "precision", "order", "seed", "associated", "history", "max_iterations"])]
    judge: Option<PathBuf>,
    /// Print everything as JSON, forces and velocities included
    #[arg(long)]
    json: bool,
}

impl SolveArgs {
    fn solver(&self) -> Solver {
        let default = if self.on_gpu() { Solver::JacobiAccelerated } else { Solver::ColouredAccelerated };
        self.solver.unwrap_or(default)
    }

    fn on_gpu(&self) -> bool {
        self.engine == EngineChoice::Gpu
    }

    /// What the answer is by.
    fn author(&self) -> String {
        let solver = self.solver().label();
        match () {
            () if self.judge.is_some() => "the answer given".to_owned(),
            () if self.on_gpu() => format!("{solver} on the GPU in {} precision", self.precision.label()),
            () => solver.to_owned(),
        }
    }
}

pub fn solve(args: &SolveArgs) -> anyhow::Result<ExitCode> {
    if args.order.is_some() && args.solver() != Solver::GaussSeidel {
        let solver = args.solver().label();
        return Err(Error::Problem(format!("--order is for gauss-seidel, and {solver} has none")).into());
    }
    let problem = io::problem::read(&args.problem)?;
    let options = Options {
        tolerance: args.tolerance,
        max_iterations: args.max_iterations,
        order: args.order.unwrap_or_default(),
        seed: args.seed,
        associated: args.associated,
        ..Options::default()
    };
    let started = Instant::now();
    let solution = match &args.judge {
        Some(path) => judge(&problem, path, args.tolerance)?,
        None if args.on_gpu() => {
            Jacobi::open(args.solver(), args.precision == Precision::Double)?.solve(&problem, &options)?
        }
        None => solve::solve(&problem, args.solver(), &options)?,
    };
    let seconds = started.elapsed().as_secs_f64();
    if let Some(path) = &args.history {
        write_history(path, &solution)?;
    }
    let contacts = contacts(&problem);
    let siconos = residual::siconos(&contacts, &solution.r, &solution.u, problem.reference());
    let report = residual::report(&contacts, &solution.r, &solution.u);
    if args.json {
        say(serde_json::to_string_pretty(&as_json(args, &problem, &solution, siconos, &report, seconds))?);
    } else {
        print(args, &problem, &solution, siconos, &report, seconds);
    }
    Ok(if solution.converged { ExitCode::SUCCESS } else { ExitCode::from(UNSURE) })
}

/// The answer of somebody else, as if it were ours.
fn judge(problem: &Problem, path: &Path, tolerance: f64) -> anyhow::Result<Solution> {
    let bytes = packstone::input::read(path)?;
    let text = String::from_utf8_lossy(&bytes);
    let numbers = text.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>();
    let (dims, n) = (problem.dims(), problem.len());
    let Some(numbers) = numbers.ok().filter(|x| x.len() == n * dims && x.iter().all(|x| x.is_finite())) else {
        let reason = format!("{}: must be {} finite numbers, {dims} for each contact", path.display(), n * dims);
        return Err(Error::Problem(reason).into());
    };
    let third = |r: &[f64]| r.get(2).copied().unwrap_or(0.0);
    let r: Vec<DVec3> = numbers.chunks(dims).map(|r| DVec3::new(r[0], r[1], third(r))).collect();
    let mut u = vec![DVec3::ZERO; n];
    solve::velocities(problem, &mut problem.free(), &r, &mut u);
    let residual = residual::residual(problem, &r);
    let converged = residual <= tolerance;
    Ok(Solution { r, u, passes: 0, other_passes: 2, residual, converged, local_failures: 0, history: Vec::new() })
}

fn print(args: &SolveArgs, problem: &Problem, solution: &Solution, siconos: f64, report: &Report, seconds: f64) {
    let Solution { passes, other_passes, residual, local_failures, .. } = solution;
    let Report { open, stick, slip, penetration_velocity, coulomb_excess } = report;
    let (n, dims, blocks) = (problem.len(), problem.dims(), problem.blocks());
    let author = args.author();
    let what = if args.associated { " of the ASSOCIATED problem, which is not Coulomb's law" } else { "" };
    say(format!("problem      {n} contacts in {dims}D, {blocks} blocks"));
    if problem.asymmetry() > 1e-8 {
        say(format!(
            "warning      W is not quite symmetric ({:.1e} of its norm); the mean with its transpose is solved",
            problem.asymmetry()
        ));
    }
    say(format!("residual     {residual:.3e} of ‖q‖{what}; {siconos:.3e} in the norm of Siconos"));
    say(format!("contacts     {open} open, {stick} stick, {slip} slip"));
    say(format!("worst        penetration velocity {penetration_velocity:.3e}, Coulomb excess {coulomb_excess:.3e}"));
    say(format!("cost         {seconds:.3e} s, {passes} {}, {other_passes} others", unit(args.solver())));
    if *local_failures > 0 {
        say(format!("warning      {local_failures} updates of single contacts found no solution"));
    }
    say(match solution.converged {
        true => format!("converged    {author} reached {:e}", args.tolerance),
        false => format!("UNCONVERGED  {author} did not reach {:e}", args.tolerance),
    });
}

fn unit(solver: Solver) -> &'static str {
    match solver {
        Solver::Socp => "interior point steps",
        Solver::Lemke => "pivots",
        _ => "passes",
    }
}

fn as_json(
    args: &SolveArgs,
    problem: &Problem,
    solution: &Solution,
    siconos: f64,
    report: &Report,
    seconds: f64,
) -> serde_json::Value {
    let vectors = |v: &[DVec3]| v.iter().map(|v| v.to_array()[..problem.dims()].to_vec()).collect::<Vec<_>>();
    json!({
        "problem": args.problem,
        "contacts": problem.len(),
        "dims": problem.dims(),
        "blocks": problem.blocks(),
        "asymmetry": problem.asymmetry(),
        "solver": args.judge.is_none().then(|| args.solver().label()),
        "engine": args.judge.is_none().then(|| if args.on_gpu() { "gpu" } else { "cpu" }),
        "precision": args.on_gpu().then(|| args.precision.label()),
        "order": (args.judge.is_none() && args.solver() == Solver::GaussSeidel).then(|| args.order.unwrap_or_default().label()),
        "associated": args.associated,
        "tolerance": args.tolerance,
        "converged": solution.converged,
        "residual": solution.residual,
        "residual_siconos": siconos,
        "report": report,
        "passes": solution.passes,
        "other_passes": solution.other_passes,
        "local_failures": solution.local_failures,
        "seconds": seconds,
        "r": vectors(&solution.r),
        "u": vectors(&solution.u),
    })
}

fn write_history(path: &Path, solution: &Solution) -> anyhow::Result<()> {
    io::replace(path, |part| {
        let at = |source: csv::Error| Error::Io { path: path.to_owned(), source: source.into() };
        let mut file = csv::Writer::from_path(part).map_err(at)?;
        file.write_record(["pass", "residual", "seconds"]).map_err(at)?;
        for record in &solution.history {
            let (pass, residual) = (record.pass.to_string(), format!("{:e}", record.residual));
            file.write_record([pass, residual, format!("{:e}", record.seconds)]).map_err(at)?;
        }
        file.flush().map_err(|source| Error::Io { path: path.to_owned(), source })
    })?;
    Ok(())
}
