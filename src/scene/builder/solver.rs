//! Methods.

use crate::{
    scene::{Twist, schema, setters::setters},
    solve,
};

/// A method with its numbers.
#[derive(Clone, Debug)]
pub struct SolverBuilder(pub(super) schema::Solver);

impl SolverBuilder {
    /// The discrete element method: springs and dashpots.
    pub fn discrete_elements() -> SolverBuilder {
        SolverBuilder(schema::Solver::default())
    }

    /// Contact dynamics: rigid grains, restitution 0.
    pub fn contact_dynamics() -> SolverBuilder {
        SolverBuilder(schema::Solver { method: schema::Method::Cd, ..schema::Solver::default() })
    }

    /// Time step, s. Default: chosen from the stability bound and the shortest collision.
    #[must_use]
    pub fn dt(mut self, dt: f64) -> Self {
        self.0.dt = schema::TimeStep::Seconds(dt);
        self
    }

    /// Global damping that adapts itself to the motion, to find a state of rest.
    #[must_use]
    pub fn adaptive_damping(mut self) -> Self {
        self.0.damping = schema::Damping::Word("adaptive".to_owned());
        self
    }

    /// Contact dynamics: how the contacts of a step are solved. Default: [`solve::Solver::JacobiAccelerated`].
    #[must_use]
    pub fn relaxation(mut self, solver: solve::Solver) -> Self {
        self.0.relaxation = Some(solver.label().to_owned());
        self
    }

    /// Contact dynamics: the order of the contacts in a sweep of [`solve::Solver::GaussSeidel`]. Default: as they are
    /// numbered.
    #[must_use]
    pub fn order(mut self, order: solve::Order) -> Self {
        self.0.order = Some(order.label().to_owned());
        self
    }

    /// Contact dynamics: contacts give way as the springs and dashpots of their materials do. Default: they are rigid.
    #[must_use]
    pub fn compliant(mut self) -> Self {
        self.0.compliance = Some(schema::Compliance::Word("stiffness".to_owned()));
        self
    }

    /// Contact dynamics: what all contacts give way by, m/N; across by 7/2 of it. Default: 0, they are rigid.
    #[must_use]
    pub fn compliance(mut self, compliance: f64) -> Self {
        self.0.compliance = Some(schema::Compliance::Constant(compliance));
        self
    }

    setters! {
        /// Of a time step that is chosen: fraction of the stability bound, in (0, 1]. Default: 0.15.
        dt_fraction: f64;
        /// Whether a time step above the bound is accepted. Default: false.
        allow_unstable: bool;
        /// Whether overlaps of more than 10 % of the radius are accepted at the start. Default: false.
        allow_overlap: bool;
        /// Global damping ξ, 1/s. Default: 0.
        damping: f64;
        /// Margin of the neighbour lists, mean radii, from 0.001 to 10. Default: 0.2, in contact dynamics 1.
        margin: f64;
        /// Whether springs follow the twist of their contact about its normal. Default: [`Twist::Ignored`].
        twist: Twist;
        /// Contact dynamics: relative residual at which a step is solved. Default: 1e-3.
        tolerance: f64;
        /// Contact dynamics: passes after which a step goes on unsolved. Default: 1000.
        max_iterations: u32;
        /// Contact dynamics: at most this fast an overlap opens, m/s. Default: a tenth of what gravity gives in a step,
        /// or a thousandth of the mean radius per step without.
        max_correction_velocity: f64;
        /// Contact dynamics: whether free clumps keep their angular momentum, and not their angular velocity. Default:
        /// false.
        gyroscopic: bool;
    }
}
