//! Lemke's pivoting for contacts in the plane, where the friction cone is a polygon and the complementarity problem
//! exact. Every contact has four pairs (Stewart and Trinkle 1996):
//!
//! `0 ≤ r_n ⟂ u_n ≥ 0`, `0 ≤ β₊ ⟂ s + u_t ≥ 0`, `0 ≤ β₋ ⟂ s − u_t ≥ 0`, `0 ≤ s ⟂ μ r_n − β₊ − β₋ ≥ 0`,
//!
//! with `r_t = β₊ − β₋` and the sliding speed s. The matrix is copositive, so that the method ends at a solution unless
//! the problem has none; ties are broken by the lexicographic rule, so that it cannot cycle.

use crate::error::{Error, Result};
use crate::solve::{
    operator::Operator,
    options::Options,
    problem::Problem,
    residual::{contacts, measured},
    solution::{Record, Solution},
};
use glam::DVec3;
use std::{cmp::Ordering, time::Instant};

/// The tableau is dense, 32 n² numbers for n contacts: 64 MB here.
pub const MOST_CONTACTS: usize = 500;

/// Pivots smaller than this are round-off.
const SMALLEST: f64 = 1e-11;

pub fn solve(problem: &Problem, options: &Options) -> Result<Solution> {
    let n = problem.len();
    if problem.dims() != 2 {
        return Err(Error::Problem(
            "lemke solves problems in the plane only, but this one has three dimensions".into(),
        ));
    }
    if n > MOST_CONTACTS {
        return Err(Error::Problem(format!("lemke is dense and takes at most {MOST_CONTACTS} contacts, not {n}")));
    }
    let started = Instant::now();
    let contacts = contacts(problem);
    // Scaled like the relaxations: pairs of order 1.
    let (normal, tangent): (Vec<f64>, Vec<f64>) =
        contacts.iter().map(|c| (c.scales.normal.sqrt().recip(), c.scales.tangential.sqrt().recip())).unzip();
    let unit = (0..n).map(|k| (problem.q()[k].x * normal[k]).abs().max((problem.q()[k].y * tangent[k]).abs()));
    let unit = unit.fold(f64::MIN_POSITIVE, f64::max);
    let mut m = vec![vec![0.0; 4 * n]; 4 * n];
    let mut constant = vec![0.0; 4 * n];
    for i in 0..n {
        for (j, w) in problem.row(i) {
            let nn = w.x_axis.x * normal[i] * normal[j];
            let nt = w.y_axis.x * normal[i] * tangent[j];
            let tn = w.x_axis.y * tangent[i] * normal[j];
            let tt = w.y_axis.y * tangent[i] * tangent[j];
            m[4 * i][4 * j..4 * j + 3].copy_from_slice(&[nn, nt, -nt]);
            m[4 * i + 1][4 * j..4 * j + 3].copy_from_slice(&[tn, tt, -tt]);
            m[4 * i + 2][4 * j..4 * j + 3].copy_from_slice(&[-tn, -tt, tt]);
        }
        m[4 * i + 1][4 * i + 3] = 1.0;
        m[4 * i + 2][4 * i + 3] = 1.0;
        let mu = problem.mu(i) * normal[i] / tangent[i];
        m[4 * i + 3][4 * i..4 * i + 3].copy_from_slice(&[mu, -1.0, -1.0]);
        let q = problem.q()[i] / unit;
        let (q_n, q_t) = (q.x * normal[i], q.y * tangent[i]);
        constant[4 * i..4 * i + 3].copy_from_slice(&[q_n, q_t, -q_t]);
    }
    let (z, passes) = pivot(&m, &constant, options.max_iterations);
    let r: Vec<DVec3> = (0..n)
        .map(|k| unit * DVec3::new(z[4 * k] * normal[k], (z[4 * k + 1] - z[4 * k + 2]) * tangent[k], 0.0))
        .collect();
    let mut u = problem.free();
    problem.set(&mut u, &r);
    let residual = measured(problem, &contacts, &r, &u);
    let seconds = started.elapsed().as_secs_f64();
    Ok(Solution {
        converged: residual <= options.tolerance,
        r,
        u,
        passes,
        other_passes: 1,
        residual,
        local_failures: 0,
        history: vec![Record { pass: passes, residual, seconds }],
    })
}

/// z with `0 ≤ z ⟂ M z + q ≥ 0`, as far as `most` pivots lead, and how many it took.
///
/// Rows of the tableau: `w − M z − z₀ = q`, columns w, z, z₀, q. Columns of w always hold the inverse of the basis, of
/// which the lexicographic rule takes its tie breaks.
fn pivot(m: &[Vec<f64>], q: &[f64], most: usize) -> (Vec<f64>, usize) {
    let n = q.len();
    let (artificial, constant) = (2 * n, 2 * n + 1);
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut row = vec![0.0; 2 * n + 2];
            row[i] = 1.0;
            for (entry, m) in row[n..2 * n].iter_mut().zip(&m[i]) {
                *entry = -m;
            }
            (row[artificial], row[constant]) = (-1.0, q[i]);
            row
        })
        .collect();
    let mut basis: Vec<usize> = (0..n).collect();
    let mut pivots = 0;
    let mut entering = artificial;
    // The first row to leave is the one most negative; z₀ then makes all others feasible.
    let mut leaving = (0..n).min_by(|&a, &b| q[a].total_cmp(&q[b])).filter(|&row| q[row] < 0.0);
    while let Some(row) = leaving {
        if pivots == most {
            break;
        }
        pivots += 1;
        exchange(&mut rows, row, entering);
        let left = std::mem::replace(&mut basis[row], entering);
        if left == artificial {
            break;
        }
        entering = if left < n { left + n } else { left - n };
        leaving = ratio_test(&rows, &basis, entering);
    }
    let mut z = vec![0.0; n];
    for (row, &variable) in basis.iter().enumerate() {
        if (n..2 * n).contains(&variable) {
            z[variable - n] = rows[row][constant].max(0.0);
        }
    }
    (z, pivots)
}

/// Make the column the unit vector of the row.
fn exchange(rows: &mut [Vec<f64>], row: usize, column: usize) {
    let mut own = std::mem::take(&mut rows[row]);
    let factor = 1.0 / own[column];
    own.iter_mut().for_each(|x| *x *= factor);
    own[column] = 1.0;
    let filled: Vec<(usize, f64)> = own.iter().copied().enumerate().filter(|&(_, x)| x != 0.0).collect();
    for other in rows.iter_mut().filter(|other| !other.is_empty()) {
        let factor = other[column];
        if factor != 0.0 {
            for &(k, x) in &filled {
                other[k] -= factor * x;
            }
            other[column] = 0.0;
        }
    }
    rows[row] = own;
}

/// The row that limits the entering column: lexicographically smallest (q, B⁻¹) over the pivot, with z₀ first of equals
/// because it ends the search. None: a ray, on which the problem may have no solution.
fn ratio_test(rows: &[Vec<f64>], basis: &[usize], column: usize) -> Option<usize> {
    let n = rows.len();
    let compare = |a: usize, b: usize| {
        let (p, q) = (rows[a][column], rows[b][column]);
        let (first, second) = (rows[a][2 * n + 1].max(0.0) / p, rows[b][2 * n + 1].max(0.0) / q);
        let tie = (first - second).abs() <= 1e-13 * (1.0 + first.abs());
        if !tie {
            return first.total_cmp(&second);
        }
        match (basis[a] == 2 * n, basis[b] == 2 * n) {
            (true, _) => Ordering::Less,
            (_, true) => Ordering::Greater,
            _ => (0..n)
                .map(|k| (rows[a][k] / p, rows[b][k] / q))
                .find(|(x, y)| (x - y).abs() > 1e-12)
                .map_or(Ordering::Equal, |(x, y)| x.total_cmp(&y)),
        }
    };
    (0..n).filter(|&i| rows[i][column] > SMALLEST).reduce(|a, b| if compare(b, a) == Ordering::Less { b } else { a })
}
