//! One interface for all solvers.

use crate::error::Result;
#[cfg(feature = "socp")]
use crate::solve::socp;
use crate::solve::{
    gauss_seidel, jacobi, lemke,
    operator::Operator,
    options::{Options, Solver},
    problem::Problem,
    solution::Solution,
};
use glam::DVec3;

/// Solve from r = 0.
///
/// # Errors
/// [`Error::Problem`](crate::Error::Problem) where the solver is not made for the problem. Not to converge is no error.
pub fn solve(problem: &Problem, solver: Solver, options: &Options) -> Result<Solution> {
    options.check(solver)?;
    let start = vec![DVec3::ZERO; problem.len()];
    match solver {
        Solver::GaussSeidel => Ok(gauss_seidel::solve(problem, start, options)),
        Solver::Jacobi => Ok(jacobi::solve(problem, start, false, options)),
        Solver::JacobiAccelerated => Ok(jacobi::solve(problem, start, true, options)),
        Solver::ColouredAccelerated => Ok(gauss_seidel::colored(problem, start, options)),
        #[cfg(feature = "socp")]
        Solver::Socp => Ok(socp::solve(problem, options)),
        #[cfg(not(feature = "socp"))]
        Solver::Socp => unreachable!("check_built has refused it"),
        Solver::Lemke => lemke::solve(problem, options),
    }
}
