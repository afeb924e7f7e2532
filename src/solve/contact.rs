//! One contact by itself: its cone, its natural map, and the three-way choice open, stick or slip (Algorithm 1).

use crate::solve::natural_map::{
    OrientedContact, UpdateScales, disc_update, largest_eigenvalue, natural_map, update_scales,
};
use glam::{DMat2, DMat3, DVec2, DVec3};

/// Couplings below this fraction of λmax are round-off: the closed form of spheres and disks then holds.
const ROUND_OFF: f64 = 1e-14;
/// Newton steps on the direction of slip before the whole circle is searched, and sectors of that search.
const NEWTON: usize = 12;
const SECTORS: usize = 64;

/// The normal as [`OrientedContact`] has it: r_n > 0 presses, and u_n > 0 opens.
const NORMAL: DVec3 = DVec3::NEG_X;

/// What a contact does: the normalised case distinction of Coulomb's law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    Open,
    Stick,
    Slip,
}

/// A contact's own block `W_kk` (velocity per impulse) and friction coefficient, prepared for many updates.
/// Components are (n, t1, t2).
#[derive(Clone, Debug)]
pub struct Contact {
    pub mu: f64,
    /// λmax(W_kk), by which the natural map is scaled.
    pub lambda: f64,
    /// Of the disc update, see [`UpdateScales`]; W_nn where the tangent cannot move.
    pub scales: UpdateScales,
    w: DMat3,
    /// λmax(W_tt)
    tangent: f64,
    isotropic: bool,
    /// Pseudo-inverse of the Schur complement `W_tt − W_tn W_nt / W_nn`, and the projection on its null space.
    schur_inverse: DMat2,
    schur_null: DMat2,
}

impl Contact {
    /// A contact in the plane: the second tangent, along which nothing ever happens, is as heavy as the first, so that
    /// the rest of the code need not know.
    pub fn planar(mut w: DMat3, mu: f64) -> Contact {
        w.z_axis = DVec3::Z * w.y_axis.y;
        Contact::new(w, mu)
    }

    pub fn new(w: DMat3, mu: f64) -> Contact {
        debug_assert!(w.x_axis.x > 0.0 && mu >= 0.0);
        let lambda = largest_eigenvalue(&w);
        let (w_tt, w_nt) = (tangential_block(&w), tangent(w.x_axis));
        let tangent = eigenvalues(&w_tt).1;
        let moves = tangent > ROUND_OFF * lambda;
        let coupling = w_nt.abs().max_element().max(w_tt.x_axis.y.abs());
        let uneven = (w_tt.x_axis.x - w_tt.y_axis.y).abs();
        let schur = w_tt - outer(w_nt, w_nt / w.x_axis.x);
        let (schur_inverse, schur_null) = pseudo_inverse(&schur, ROUND_OFF * lambda);
        Contact {
            mu,
            lambda,
            scales: match moves {
                true => update_scales(&w, NORMAL, mu),
                false => UpdateScales { normal: w.x_axis.x, tangential: w.x_axis.x },
            },
            w,
            tangent,
            isotropic: coupling.max(uneven) <= ROUND_OFF * lambda && moves,
            schur_inverse,
            schur_null,
        }
    }

    /// The contact at velocity u.
    pub fn at(&self, u: DVec3) -> OrientedContact {
        let UpdateScales { normal, tangential } = self.scales;
        OrientedContact { sign: 1.0, share: 1.0, n: NORMAL, normal, tangential, friction: self.mu, velocity: u }
    }

    /// See [`natural_map`](fn@natural_map); a velocity.
    pub fn natural_map(&self, r: DVec3, u: DVec3) -> DVec3 {
        natural_map(&self.at(u), r, self.lambda)
    }

    /// The velocity u without the part that the contact's own impulse r has in it.
    pub fn without(&self, r: DVec3, u: DVec3) -> DVec3 {
        u - self.w * r
    }

    /// The velocity with it.
    pub fn with(&self, r: DVec3, b: DVec3) -> DVec3 {
        self.w * r + b
    }

    /// The impulse that obeys the laws of contact with `u = W_kk r + b`, and whether one was found (it exists whenever
    /// W_kk is positive definite). The search for the direction of slip begins at `guess`; if nothing is found, that is
    /// relaxed a little.
    pub fn solve(&self, b: DVec3, guess: DVec3) -> (DVec3, bool) {
        if b.x >= 0.0 {
            return (DVec3::ZERO, true);
        }
        if self.isotropic {
            // `disc_update` is the same, but for the rounding of its reciprocals and of scales that are not quite W.
            let (p, t) = (-b.x / self.w.x_axis.x, -tangent(b) / self.tangent);
            let (length, limit) = (t.length(), self.mu * p);
            return (join(p, if length > limit { t * (limit / length) } else { t }), true);
        }
        let (stick, sticks) = self.stick(b);
        if sticks && tangent(stick).length() <= self.mu * stick.x {
            return (stick, true);
        }
        let start = [-tangent(guess), -tangent(stick), tangent(b)]
            .into_iter()
            .find_map(DVec2::try_normalize)
            .unwrap_or(DVec2::X);
        // Where a push hardly moves the contact off, the equation may have huge roots that solve nothing.
        let solves = |r: &DVec3| self.natural_map(*r, self.with(*r, b)).length() <= 1e-6 * b.length();
        match self.slip(b, start).filter(solves) {
            Some(r) => (r, true),
            None => (disc_update(&self.at(self.with(guess, b)), guess, 0.5), false),
        }
    }

    /// `r = −W⁻¹ b` by elimination of the normal row, of least length where W is singular, and whether it stops the
    /// contact altogether.
    fn stick(&self, b: DVec3) -> (DVec3, bool) {
        let w_nt = tangent(self.w.x_axis);
        let rest = tangent(b) - w_nt * (b.x / self.w.x_axis.x);
        let t = -(self.schur_inverse * rest);
        let sticks = (self.schur_null * rest).length() <= ROUND_OFF * b.length();
        (join((-b.x - w_nt.dot(t)) / self.w.x_axis.x, t), sticks)
    }

    /// Slip in the unit direction d: `u_n = 0`, `u_T = s d` with s ≥ 0 and `r = p (1, −μ d)` with p > 0.
    ///
    /// Eliminating `p = −b_n / D(d)`, `D = W_nn − μ W_nt·d`, leaves `c + B d ∥ d` with `c = W_nn b_t − b_n W_nt` and
    /// `B = μ (b_n W_tt − b_t W_ntᵀ)`: one trigonometric equation of degree 2, hence the quartic of Bonnefon and
    /// Daviet (2011), solved by Newton's method on the circle, from `start` and the direction opposite, and where that
    /// fails by looking at all of the circle.
    fn slip(&self, b: DVec3, start: DVec2) -> Option<DVec3> {
        let (w_nt, b_t) = (tangent(self.w.x_axis), tangent(b));
        let c = self.w.x_axis.x * b_t - b.x * w_nt;
        let matrix = (b.x * tangential_block(&self.w) - outer(b_t, w_nt)) * self.mu;
        let size = c.length() + matrix.x_axis.length() + matrix.y_axis.length();
        let off = |d: DVec2| d.perp().dot(c + matrix * d);
        let valid = |d: DVec2| {
            let (sliding, normal) = (d.dot(c + matrix * d), self.w.x_axis.x - self.mu * w_nt.dot(d));
            let holds = off(d).abs() <= 1e-13 * size && sliding >= -1e-13 * size && normal > 0.0;
            holds.then(|| {
                let p = -b.x / normal;
                join(p, -self.mu * p * d)
            })
        };
        let newton = |mut d: DVec2| {
            for _ in 0..NEWTON {
                let value = off(d);
                if value.abs() <= 1e-15 * size {
                    break;
                }
                let slope = d.perp().dot(matrix * d.perp()) - d.dot(c + matrix * d);
                // More than half a radian is no longer Newton's realm.
                d = (d + d.perp() * (-value / slope).clamp(-0.5, 0.5)).try_normalize().unwrap_or(d);
            }
            d
        };
        if let Some(r) = [start, -start].into_iter().find_map(|d| valid(newton(d))) {
            return Some(r);
        }
        let ray = |angle: f64| DVec2::from_angle(angle).rotate(start);
        (0..SECTORS).find_map(|k| {
            let sector = std::f64::consts::TAU / SECTORS as f64;
            let (mut low, mut high) = (k as f64 * sector, (k + 1) as f64 * sector);
            let sign = off(ray(low)) > 0.0;
            if sign == (off(ray(high)) > 0.0) {
                return None;
            }
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                *(if sign == (off(ray(middle)) > 0.0) { &mut low } else { &mut high }) = middle;
            }
            valid(newton(ray(low)))
        })
    }

    /// Whether the contact is open, or transmits less than the Coulomb limit, or all of it.
    pub fn status(&self, r: DVec3, u: DVec3) -> Status {
        match () {
            () if r.x <= 0.0 || self.lambda * r.x <= 1e-12 * u.length() => Status::Open,
            // Impulses may have been computed in single precision.
            () if tangent(r).length() >= self.mu * r.x * (1.0 - 1e-6) => Status::Slip,
            () => Status::Stick,
        }
    }
}

pub fn tangent(v: DVec3) -> DVec2 {
    DVec2::new(v.y, v.z)
}

fn join(n: f64, t: DVec2) -> DVec3 {
    DVec3::new(n, t.x, t.y)
}

fn tangential_block(w: &DMat3) -> DMat2 {
    DMat2::from_cols(tangent(w.y_axis), tangent(w.z_axis))
}

fn outer(a: DVec2, b: DVec2) -> DMat2 {
    DMat2::from_cols(a * b.x, a * b.y)
}

/// Smallest and largest eigenvalue of a symmetric 2×2 matrix.
fn eigenvalues(m: &DMat2) -> (f64, f64) {
    let mean = 0.5 * (m.x_axis.x + m.y_axis.y);
    let radius = (0.5 * (m.x_axis.x - m.y_axis.y)).hypot(m.x_axis.y);
    (mean - radius, mean + radius)
}

/// Pseudo-inverse of a symmetric positive semidefinite matrix, and the projection on its null space: what belongs to
/// eigenvalues up to `zero`.
fn pseudo_inverse(m: &DMat2, zero: f64) -> (DMat2, DMat2) {
    let (small, large) = eigenvalues(m);
    if small > zero {
        return (m.inverse(), DMat2::ZERO);
    }
    if large <= zero {
        return (DMat2::ZERO, DMat2::IDENTITY);
    }
    // m − small I is (large − small) d dᵀ for the unit eigenvector d of the large one.
    let onto = (*m - DMat2::from_diagonal(DVec2::splat(small))) * (1.0 / (large - small));
    (onto * (1.0 / large), DMat2::IDENTITY - onto)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A positive semidefinite block of the rank given, with entries of order 1.
    fn block(rng: &mut ChaCha8Rng, rank: usize) -> DMat3 {
        let mut w = DMat3::ZERO;
        for _ in 0..rank {
            let v = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
            w += DMat3::from_cols(v * v.x, v * v.y, v * v.z);
        }
        w
    }

    fn vector(rng: &mut ChaCha8Rng) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)))
    }

    #[test]
    fn any_positive_definite_block_is_solved() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut seen = [0; 3];
        for k in 0..20_000 {
            let w = block(&mut rng, 5) + DMat3::IDENTITY * 1e-6;
            let contact = Contact::new(w, [0.0, 0.1, 0.7, 3.0, 50.0][k % 5]);
            let (b, guess) = (vector(&mut rng), vector(&mut rng));
            let (r, found) = contact.solve(b, guess);
            let u = w * r + b;
            let error = contact.natural_map(r, u).length();
            assert!(found && error < 1e-9, "{w:?} {b:?} μ = {}: {error:e}", contact.mu);
            seen[contact.status(r, u) as usize] += 1;
        }
        assert!(seen.iter().all(|&n| n > 1000), "{seen:?}");
    }

    #[test]
    fn forces_in_the_plane_stay_there() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for k in 0..5_000 {
            let mut w = block(&mut rng, 4) + DMat3::IDENTITY * 1e-6;
            w.z_axis = DVec3::ZERO;
            (w.x_axis.z, w.y_axis.z) = (0.0, 0.0);
            let contact = Contact::planar(w, [0.0, 0.3, 2.0][k % 3]);
            let b = vector(&mut rng) * DVec3::new(1.0, 1.0, 0.0);
            let (r, found) = contact.solve(b, DVec3::ZERO);
            let error = contact.natural_map(r, w * r + b).length();
            assert!(found && error < 1e-10 && r.z == 0.0, "{w:?} {b:?}: {error:e}");
        }
    }

    #[test]
    fn spheres_have_a_closed_form() {
        let contact = Contact::new(DMat3::from_diagonal(DVec3::new(2.0, 7.0, 7.0)), 0.5);
        assert_eq!(contact.solve(DVec3::new(1.0, 3.0, 0.0), DVec3::ZERO).0, DVec3::ZERO);
        assert_eq!(contact.solve(DVec3::new(-2.0, 1.75, 0.0), DVec3::ZERO).0, DVec3::new(1.0, -0.25, 0.0));
        assert_eq!(contact.solve(DVec3::new(-2.0, 0.0, 70.0), DVec3::ZERO).0, DVec3::new(1.0, 0.0, -0.5));
        // The disc update is the same, wherever it sets out from.
        let (b, guess) = (DVec3::new(-2.0, 1.75, -1.0), DVec3::new(3.0, 0.5, 1.0));
        let updated = disc_update(&contact.at(contact.with(guess, b)), guess, 1.0);
        assert!((updated - contact.solve(b, guess).0).length() < 1e-15, "{updated}");
    }

    #[test]
    fn a_block_without_solution_is_reported() {
        // W has rank 1: a push also slides the contact, and friction that stops the sliding opens it. Nothing solves
        // this one.
        let v = DVec3::new(1.0, 10.0, 0.0);
        let contact = Contact::new(DMat3::from_cols(v * v.x, v * v.y, v * v.z), 5.0);
        let b = DVec3::new(-1.0, 3.0, 0.0);
        let (r, found) = contact.solve(b, DVec3::ZERO);
        assert!(!found && r.is_finite() && tangent(r).length() <= 5.0 * r.x, "{r:?}");
    }

    #[test]
    fn projection_obeys_moreau() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for k in 0..1000 {
            let (r, mu) = (vector(&mut rng), [0.0, 0.4, 2.0][k % 3]);
            // At rest the natural map is what the projection takes away.
            let p = r - Contact::new(DMat3::IDENTITY, mu).natural_map(r, DVec3::ZERO);
            let polar = r - p;
            assert!(p.dot(polar).abs() < 1e-14, "{r:?}");
            assert!(tangent(p).length() <= mu * p.x + 1e-14);
            assert!(mu * tangent(polar).length() <= -polar.x + 1e-14);
        }
        assert_eq!(Contact::new(DMat3::IDENTITY, 0.0).natural_map(-DVec3::X, DVec3::ZERO), -DVec3::X);
    }

    #[test]
    fn eigenvalues_bound_the_block() {
        let m = DMat3::from_cols(DVec3::new(2.0, 1.0, 0.0), DVec3::new(1.0, 2.0, 0.0), DVec3::new(0.0, 0.0, 0.5));
        assert!((largest_eigenvalue(&m) - 3.0).abs() < 1e-14);
        assert_eq!(largest_eigenvalue(&(DMat3::IDENTITY * 4.0)), 4.0);
    }
}
