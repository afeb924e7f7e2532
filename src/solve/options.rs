//! What a problem is to be solved with.

use crate::error::{Error, Result};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// The single-contact update swept over all contacts.
    GaussSeidel,
    /// All contacts from the same iterate, with a step that cannot diverge.
    Jacobi,
    /// The same with momentum and two tests for its restart.
    JacobiAccelerated,
    /// Gauss-Seidel colour by colour with that momentum.
    ColouredAccelerated,
    /// Cone programs with De Saxcé's correction as a fixed point.
    Socp,
    /// Complementary pivoting; exact, for small problems in the plane.
    Lemke,
}

impl Solver {
    pub const ALL: [Solver; 6] = [
        Solver::GaussSeidel,
        Solver::Jacobi,
        Solver::JacobiAccelerated,
        Solver::ColouredAccelerated,
        Solver::Socp,
        Solver::Lemke,
    ];

    /// Whether this build has it.
    ///
    /// # Errors
    /// [`Error::Problem`] with the cargo feature that is missing.
    pub fn check_built(self) -> Result<()> {
        match self {
            Solver::Socp if cfg!(not(feature = "socp")) => Err(Error::Problem(
                "packstone was built without the cargo feature `socp`, which the solver needs".into(),
            )),
            _ => Ok(()),
        }
    }

    /// Whether contacts of a scene are solved by the host alone, not by passes of an engine.
    pub fn is_of_host(self) -> bool {
        matches!(self, Solver::GaussSeidel | Solver::Socp | Solver::Lemke)
    }

    pub fn label(self) -> &'static str {
        match self {
            Solver::GaussSeidel => "gauss-seidel",
            Solver::Jacobi => "jacobi",
            Solver::JacobiAccelerated => "jacobi-accelerated",
            Solver::ColouredAccelerated => "coloured-accelerated",
            Solver::Socp => "socp",
            Solver::Lemke => "lemke",
        }
    }
}

impl std::str::FromStr for Solver {
    type Err = Error;

    fn from_str(name: &str) -> Result<Solver> {
        let all = Solver::ALL.map(Solver::label).join(", ");
        let found = Solver::ALL.into_iter().find(|solver| solver.label() == name);
        found.ok_or_else(|| Error::Problem(format!("solver = \"{name}\" must be one of {all}")))
    }
}

/// The order of the contacts in a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Each once, in a fresh order every sweep.
    RandomSweep,
    /// As many as there are, drawn with replacement.
    RandomSequential,
    /// Each once, in a random order that all sweeps share.
    ShuffledOnce,
    /// Each once, as they are numbered.
    #[default]
    Fixed,
}

impl Order {
    pub const ALL: [Order; 4] = [Order::RandomSweep, Order::RandomSequential, Order::ShuffledOnce, Order::Fixed];

    pub fn label(self) -> &'static str {
        match self {
            Order::RandomSweep => "random-sweep",
            Order::RandomSequential => "random-sequential",
            Order::ShuffledOnce => "shuffled-once",
            Order::Fixed => "fixed",
        }
    }
}

impl std::str::FromStr for Order {
    type Err = Error;

    fn from_str(name: &str) -> Result<Order> {
        let all = Order::ALL.map(Order::label).join(", ");
        let found = Order::ALL.into_iter().find(|order| order.label() == name);
        found.ok_or_else(|| Error::Problem(format!("order = \"{name}\" must be one of {all}")))
    }
}

#[derive(Clone, Debug)]
pub struct Options {
    /// Relative residual to reach, see [`super::residual::residual`].
    pub tolerance: f64,
    /// Passes at most; for `socp` cone programs, for `lemke` pivots.
    pub max_iterations: usize,
    /// Of `gauss-seidel`.
    pub order: Order,
    /// Of the random orders.
    pub seed: u64,
    /// Solve the associated (convex, dilatant) problem: `K* ∋ u ⟂ r ∈ K_μ` without De Saxcé's term. Only `socp` does.
    pub associated: bool,
    /// Asked after every pass: whether to end with what there is.
    pub interrupted: fn() -> bool,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            tolerance: 1e-4,
            max_iterations: 10_000,
            order: Order::default(),
            seed: 1,
            associated: false,
            interrupted: || false,
        }
    }
}

impl Options {
    pub fn check(&self, solver: Solver) -> Result<()> {
        solver.check_built()?;
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return Err(Error::Problem(format!("tolerance = {} must be finite and positive", self.tolerance)));
        }
        if self.associated && solver != Solver::Socp {
            let solver = solver.label();
            return Err(Error::Problem(format!("{solver} cannot solve the associated problem, but socp can")));
        }
        Ok(())
    }
}
