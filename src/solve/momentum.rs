//! Nesterov's momentum with the two restarts that friction needs. Twin of `shaders/solve/steer.wgsl`.
//!
//! Information about a force travels one contact per pass, and without momentum it diffuses: a stack of N grains takes
//! of the order of N² passes. With momentum it takes of the order of N.

/// A restart when the residual exceeds the best since the last one by this factor. The test of gradients does not see
/// the stall that it ends, which comes with μ ≥ 0.3 on dense beds.
const WORSE: f64 = 1.5;

pub struct Momentum {
    theta: f64,
    best: f64,
}

impl Default for Momentum {
    fn default() -> Momentum {
        Momentum { theta: 1.0, best: f64::INFINITY }
    }
}

impl Momentum {
    /// β, by which to go on beyond the new iterate x⁺, `y = x⁺ + β (x⁺ − x)`; 0 at a restart.
    ///
    /// `uphill` is `(y − x⁺)·(x⁺ − x)` in the scales of the step, > 0 where the momentum leads away from where the step
    /// went; `residual` that of x⁺.
    pub fn next(&mut self, uphill: f64, residual: f64) -> f64 {
        let worse = residual > WORSE * self.best;
        self.best = if worse { residual } else { self.best.min(residual) };
        if worse || uphill > 0.0 {
            self.theta = 1.0;
            return 0.0;
        }
        // θ₊² = (1 − θ₊) θ²
        let square = self.theta * self.theta;
        let next = 0.5 * ((square * square + 4.0 * square).sqrt() - square);
        let beta = self.theta * (1.0 - self.theta) / (square + next);
        self.theta = next;
        beta
    }

    /// Begin again: the step has changed.
    pub fn reset(&mut self) {
        self.theta = 1.0;
    }
}
