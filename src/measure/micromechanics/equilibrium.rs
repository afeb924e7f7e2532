//! Whether a packing is in static equilibrium, grain by grain.

use super::{distribution::Distribution, packing::Packing};
use glam::DVec3;
use serde::Serialize;

/// A certificate: what is left of forces and moments on free particles, and how far contacts are from sliding.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Equilibrium {
    /// Whether residuals are within the tolerance, friction is within its limit, and nothing moves that counts.
    pub certified: bool,
    pub tolerance: f64,
    /// Mean size of contact forces, N: what residuals are measured by.
    pub mean_contact_force: f64,
    /// |ΣF + m g| of a free particle, N, and over its weight or the mean contact force, if that is more.
    pub residual_force: Option<Worst>,
    pub residual_force_ratio: Option<Worst>,
    /// |ΣM| about its centre of mass, N m, and over that force times its radius.
    pub residual_moment: Option<Worst>,
    pub residual_moment_ratio: Option<Worst>,
    /// The least of 1 - |f_t| / (μ f_n): 0 at the Coulomb limit, negative beyond it. None without friction.
    pub coulomb_margin: Option<f64>,
    /// Free particles that could move without any contact noticing at first: as if all others were held.
    pub floppy: usize,
    /// Kinetic energy of free particles, J, beyond what their residual force gives them in a step, which is nothing at rest.
    pub kinetic_energy: f64,
    /// J, in the springs of contacts; 0 in contact dynamics.
    pub elastic_energy: f64,
}

/// Numbers of all free particles, and whose is the largest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Worst {
    pub worst: f64,
    /// What the grain, or the clump, is called.
    pub particle: u32,
    pub distribution: Distribution,
}

impl Worst {
    fn of(packing: &Packing, values: &[(usize, f64)]) -> Option<Worst> {
        let (particle, worst) = values.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let particle = packing.number(particle);
        Some(Worst { worst, particle, distribution: Distribution::of(values.iter().map(|(_, value)| *value))? })
    }
}

/// Energies that a sample knows, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energies {
    pub kinetic: f64,
    pub elastic: f64,
    /// In contact dynamics: what gravity or the mean contact force would give in a step.
    pub of_step: f64,
}

impl Equilibrium {
    pub fn of(packing: &Packing, energies: Energies, tolerance: f64) -> Equilibrium {
        let contacts = packing.contacts;
        let sum: f64 = contacts.iter().map(|contact| contact.force.length()).sum();
        let mean = if contacts.is_empty() { 0.0 } else { sum / contacts.len() as f64 };
        let gravity = packing.assembly.gravity;
        let loads = packing.loads();
        let scale = |particle: usize| (packing.mass(particle) * gravity.length()).max(mean).max(f64::MIN_POSITIVE);
        let of_free = |of: &dyn Fn(usize) -> f64| packing.free().map(|k| (k, of(k))).collect::<Vec<_>>();
        let force = |k: usize| (loads[k].force + packing.mass(k) * gravity).length();
        let moment = |k: usize| loads[k].moment.length();
        let (forces, moments) = (of_free(&force), of_free(&moment));
        let force_ratios = of_free(&|k| force(k) / scale(k));
        let moment_ratios = of_free(&|k| moment(k) / (scale(k) * packing.radius(k)));
        let margin = contacts.iter().filter_map(|contact| contact.mobilised_friction()).map(|part| 1.0 - part);
        let margin = margin.reduce(f64::min);
        let balanced = |ratios: &[(usize, f64)]| ratios.iter().all(|(_, ratio)| *ratio <= tolerance);
        let still = energies.kinetic <= tolerance * energies.elastic.max(energies.of_step);
        Equilibrium {
            certified: !contacts.is_empty()
                && balanced(&force_ratios)
                && balanced(&moment_ratios)
                && margin.is_none_or(|margin| margin >= -tolerance)
                && still,
            tolerance,
            mean_contact_force: mean,
            residual_force: Worst::of(packing, &forces),
            residual_force_ratio: Worst::of(packing, &force_ratios),
            residual_moment: Worst::of(packing, &moments),
            residual_moment_ratio: Worst::of(packing, &moment_ratios),
            coulomb_margin: margin,
            floppy: floppy(packing),
            kinetic_energy: energies.kinetic,
            elastic_energy: energies.elastic,
        }
    }
}

/// Motions of a particle: three of its centre, and three turns times its radius.
type Motion = [f64; 6];

/// Directions that a rank must not miss, less than this part of the largest.
const RANK: f64 = 1e-9;

/// How many free particles have a motion that changes no contact: along the normal, and of rough contacts that do not
/// slide along the tangents too. Turns of grains whose contacts all lack friction do not count.
fn floppy(packing: &Packing) -> usize {
    let dims = packing.dims();
    let turning = !packing.clumps.is_empty() || packing.contacts.iter().any(|contact| contact.friction > 0.0);
    let axes: &[usize] = match (dims, turning) {
        (2, false) => &[0, 1],
        (2, true) => &[0, 1, 5],
        (_, false) => &[0, 1, 2],
        (_, true) => &[0, 1, 2, 3, 4, 5],
    };
    // Sums of products of what contacts notice.
    let mut noticed = vec![[[0.0; 6]; 6]; packing.particles()];
    for contact in packing.contacts {
        let rough = contact.friction > 0.0 && !contact.sliding;
        let tangents = match dims {
            2 => [Some(DVec3::Z.cross(contact.normal)), None],
            _ => {
                let one = contact.normal.any_orthonormal_vector();
                [Some(one), Some(contact.normal.cross(one))]
            }
        };
        let directions = [Some(contact.normal)].into_iter().chain(tangents.into_iter().filter(|_| rough)).flatten();
        for action in packing.actions(contact).into_iter().flatten() {
            for direction in directions.clone() {
                let turn = action.arm.cross(direction) / packing.radius(action.particle);
                let motion: Motion = [direction.x, direction.y, direction.z, turn.x, turn.y, turn.z];
                let of_particle = &mut noticed[action.particle];
                for (row, a) in of_particle.iter_mut().zip(motion) {
                    row.iter_mut().zip(motion).for_each(|(sum, b)| *sum += a * b);
                }
            }
        }
    }
    packing.free().filter(|particle| rank(noticed[*particle], axes) < axes.len()).count()
}

/// Of the rows and columns of a symmetric positive matrix, by elimination with the largest pivot.
fn rank(mut matrix: [Motion; 6], axes: &[usize]) -> usize {
    let mut left: Vec<usize> = axes.to_vec();
    let largest = axes.iter().map(|k| matrix[*k][*k]).fold(0.0, f64::max);
    while let Some((at, &pivot)) =
        left.iter().enumerate().max_by(|a, b| matrix[*a.1][*a.1].total_cmp(&matrix[*b.1][*b.1]))
    {
        let size = matrix[pivot][pivot];
        if !(size > RANK * largest) {
            break;
        }
        left.swap_remove(at);
        for &row in &left {
            let factor = matrix[row][pivot] / size;
            for &column in &left {
                matrix[row][column] -= factor * matrix[pivot][column];
            }
        }
    }
    axes.len() - left.len()
}
