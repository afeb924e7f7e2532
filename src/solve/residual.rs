//! How far impulses are from obeying the laws of contact: one measure for all solvers, tests and answers of others.

use crate::solve::{
    contact::{Contact, Status, tangent},
    natural_map::natural_map,
    operator::{Operator, velocities},
};
use glam::DVec3;

/// All contacts of an operator, prepared.
pub fn contacts<O: Operator>(operator: &O) -> Vec<Contact> {
    let make = if operator.dims() == 2 { Contact::planar } else { Contact::new };
    (0..operator.len()).map(|k| make(operator.block(k), operator.mu(k))).collect()
}

/// `‖F‖ / ‖q‖` where `F_k = λ (r_k − P_K(r_k − (u_k + μ‖u_T‖ n)/λ))`, `λ = λmax(W_kk)`, `u = W r + q`: the natural map
/// in velocities, so that neither units nor masses matter. The divisor is [`Operator::reference`].
pub fn residual<O: Operator>(operator: &O, r: &[DVec3]) -> f64 {
    let mut u = vec![DVec3::ZERO; r.len()];
    velocities(operator, &mut operator.free(), r, &mut u);
    relative(&contacts(operator), r, &u, operator.reference())
}

/// How far impulses are from a solution in the measure of the operator, where contacts and velocities are known already.
pub fn measured<O: Operator>(operator: &O, contacts: &[Contact], r: &[DVec3], u: &[DVec3]) -> f64 {
    let Some(speeds) = operator.speeds() else { return relative(contacts, r, u, operator.reference()) };
    let of = |k: usize| contacts[k].natural_map(r[k], u[k]).length() / speeds[k];
    // NaN must not pass for small.
    (0..r.len()).map(of).fold(0.0, |worst, part| if part <= worst { worst } else { part })
}

/// The same as a norm over a reference.
pub fn relative(contacts: &[Contact], r: &[DVec3], u: &[DVec3], reference: f64) -> f64 {
    let sum: f64 = contacts.iter().zip(r).zip(u).map(|((c, &r), &u)| c.natural_map(r, u).length_squared()).sum();
    sum.sqrt() / reference
}

/// The same for the associated problem, `K* ∋ u ⟂ r ∈ K_μ`: no De Saxcé term, so sliding opens contacts.
pub fn associated(contacts: &[Contact], r: &[DVec3], u: &[DVec3], reference: f64) -> f64 {
    // The natural map adds μ‖u_T‖ n itself.
    let without = |c: &Contact, u: DVec3| u - DVec3::X * (c.mu * tangent(u).length());
    let u: Vec<DVec3> = contacts.iter().zip(u).map(|(c, &u)| without(c, u)).collect();
    relative(contacts, r, &u, reference)
}

/// What Siconos reports: the natural map with ρ = 1 whatever the units, relative to the larger of ‖q‖ and ‖r‖. It reads
/// up to 130 times smaller than [`residual`] and is here for comparison only.
pub fn siconos(contacts: &[Contact], r: &[DVec3], u: &[DVec3], reference: f64) -> f64 {
    let norm = |v: &mut dyn Iterator<Item = DVec3>| v.map(|v| v.length_squared()).sum::<f64>().sqrt();
    let error = norm(&mut contacts.iter().zip(r).zip(u).map(|((c, &r), &u)| natural_map(&c.at(u), r, 1.0)));
    error / norm(&mut r.iter().copied()).max(reference)
}

/// What an answer means to the contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Report {
    /// Contacts that transmit nothing, less than the Coulomb limit, and all of it.
    pub open: usize,
    pub stick: usize,
    pub slip: usize,
    /// Largest −u_n: the speed at which bodies enter each other, in the velocity of the problem.
    pub penetration_velocity: f64,
    /// Largest ‖r_T‖ − μ r_n, in the impulse of the problem.
    pub coulomb_excess: f64,
}

pub fn report(contacts: &[Contact], r: &[DVec3], u: &[DVec3]) -> Report {
    let mut report = Report::default();
    for ((contact, &r), &u) in contacts.iter().zip(r).zip(u) {
        match contact.status(r, u) {
            Status::Open => report.open += 1,
            Status::Stick => report.stick += 1,
            Status::Slip => report.slip += 1,
        }
        report.penetration_velocity = report.penetration_velocity.max(-u.x);
        report.coulomb_excess = report.coulomb_excess.max(tangent(r).length() - contact.mu * r.x);
    }
    report
}
