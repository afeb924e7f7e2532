//! Contact dynamics: rigid grains with Signorini's and Coulomb's laws, as one problem for all contacts.
//!
//! Find impulses r and relative velocities u of the contacts with `u = W r + q` and
//! `K* ∋ u + μ‖u_T‖ n ⟂ r ∈ K_μ`, where `K_μ = {‖r_T‖ ≤ μ r_n}` and K* is its dual cone. The term with μ is De Saxcé's:
//! it makes of the cone program, whose slip dilates, Coulomb's law, and of a convex problem one that is not.
//!
//! An [`Operator`] says what W is; solvers know no more of it. [`Problem`] is the one with W as a matrix.

pub mod contact;
pub mod device;
pub mod gauss_seidel;
pub mod jacobi;
pub mod lemke;
pub mod momentum;
pub mod natural_map;
pub mod operator;
pub mod options;
pub mod problem;
pub mod residual;
#[cfg(feature = "socp")]
pub mod socp;
pub mod solution;
pub mod solver;

pub use operator::{Operator, velocities};
pub use options::{Options, Order, Solver};
pub use problem::{Matrix, Problem};
pub use solution::{Record, Solution};
pub use solver::solve;
