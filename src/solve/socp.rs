//! Cone programs by an interior point method, and Coulomb's law as their fixed point.
//!
//! With s = μ‖u_T‖ given, `K* ∋ u + s n ⟂ r ∈ K_μ` is the optimality of `min ½ rᵀW r + (q + s n)ᵀ r, r ∈ K_μ`, which is
//! convex. Solved again and again with the s of its own solution (Cadoux 2009), it ends at Coulomb's law. With s = 0 it
//! is the associated problem, whose sliding contacts open: another answer to another question.

use crate::solve::{
    contact::tangent,
    operator::Operator,
    options::Options,
    problem::Problem,
    residual::{associated, contacts, measured},
    solution::{Record, Solution},
};
use clarabel::{
    algebra::CscMatrix,
    solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SupportedConeT},
};
use glam::DVec3;
use std::time::Instant;

/// Of the interior point method, in the scaled problem. Forces at a cone's edge are as exact as the root of the gap; a
/// feasibility much below 1e-9 instead ends the method early, for lack of progress, where forces are not unique.
const GAP: f64 = 1e-14;
const FEASIBILITY: f64 = 1e-9;

/// Cone programs without any improvement after which the fixed point is not attained.
const PATIENCE: usize = 50;

pub fn solve(problem: &Problem, options: &Options) -> Solution {
    let started = Instant::now();
    let contacts = contacts(problem);
    let (n, dims, reference) = (problem.len(), problem.dims(), problem.reference());
    let (mut r, mut u, mut slip) = (vec![DVec3::ZERO; n], problem.q().to_vec(), vec![0.0; n]);
    let measure = |r: &[DVec3], u: &[DVec3]| {
        if options.associated { associated(&contacts, r, u, reference) } else { measured(problem, &contacts, r, u) }
    };
    let mut best = (measure(&r, &u), r.clone(), u.clone());
    let mut history = vec![Record { pass: 0, residual: best.0, seconds: 0.0 }];
    let (mut passes, mut programs, mut best_program) = (0, 0, 0);

    // One scale per contact, so that cones stay cones, and impulses of order 1.
    let scale: Vec<f64> = contacts.iter().map(|c| c.lambda.sqrt().recip()).collect();
    let unit = (0..n).map(|k| (problem.q()[k] * scale[k]).length_squared()).sum::<f64>().sqrt();
    let triplets: Vec<(usize, usize, f64)> = (0..n)
        .flat_map(|i| problem.row(i).map(move |(j, block)| (i, j, block)))
        .flat_map(|(i, j, block)| (0..dims * dims).map(move |k| (i, j, k % dims, k / dims, block)))
        .map(|(i, j, a, b, block)| (i * dims + a, j * dims + b, block.col(b)[a] * scale[i] * scale[j]))
        .filter(|&(i, j, value)| i <= j && value != 0.0)
        .collect();
    let matrix = |m: usize, columns: usize, entries: &[(usize, usize, f64)]| {
        let (i, (j, value)) =
            entries.iter().map(|&(i, j, value)| (i, (j, value))).unzip::<_, _, Vec<_>, (Vec<_>, Vec<_>)>();
        CscMatrix::new_from_triplets(m, columns, i, j, value)
    };
    let w = matrix(n * dims, n * dims, &triplets);
    // −A r within the cone: (μ r_n, r_T) in a circular one; without friction r_n ≥ 0 and r_T = 0.
    let stretch = |k: usize| if problem.mu(k) > 0.0 { problem.mu(k) } else { 1.0 };
    let cone: Vec<(usize, usize, f64)> =
        (0..n * dims).map(|i| (i, i, if i % dims == 0 { -stretch(i / dims) } else { -1.0 })).collect();
    let a = matrix(n * dims, n * dims, &cone);
    let cones: Vec<SupportedConeT<f64>> = (0..n)
        .flat_map(|k| match problem.mu(k) > 0.0 {
            true => vec![SupportedConeT::SecondOrderConeT(dims)],
            false => vec![SupportedConeT::NonnegativeConeT(1), SupportedConeT::ZeroConeT(dims - 1)],
        })
        .collect();
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .presolve_enable(false)
        .tol_gap_abs(GAP)
        .tol_gap_rel(GAP)
        .tol_feas(FEASIBILITY)
        .build()
        .expect("the settings are valid");

    while best.0 > options.tolerance && programs < options.max_iterations.min(best_program + PATIENCE) {
        programs += 1;
        let linear: Vec<f64> = (0..n)
            .flat_map(|k| {
                let q = (problem.q()[k] + DVec3::X * slip[k]) * (scale[k] / unit);
                q.to_array().into_iter().take(dims)
            })
            .collect();
        let Ok(mut solver) = DefaultSolver::new(&w, &linear, &a, &vec![0.0; n * dims], &cones, settings.clone()) else {
            break;
        };
        solver.solve();
        passes += solver.solution.iterations as usize;
        for (k, part) in solver.solution.x.chunks(dims).enumerate() {
            r[k] = DVec3::new(part[0], part[1], part.get(2).copied().unwrap_or(0.0)) * (scale[k] * unit);
        }
        problem.set(&mut u, &r);
        let residual = measure(&r, &u);
        history.push(Record { pass: passes, residual, seconds: started.elapsed().as_secs_f64() });
        if !residual.is_finite() {
            break;
        }
        if residual < best.0 {
            best = (residual, r.clone(), u.clone());
            best_program = programs;
        }
        if options.associated {
            break;
        }
        for k in 0..n {
            slip[k] = problem.mu(k) * tangent(u[k]).length();
        }
    }
    let (residual, r, u) = best;
    let converged = residual <= options.tolerance;
    Solution { r, u, passes, other_passes: programs, residual, converged, local_failures: 0, history }
}
