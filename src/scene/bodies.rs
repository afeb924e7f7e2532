//! Spheres and clumps on their way into the assembly.

use glam::DQuat;

use super::check::Check;
use super::schema::{self, Orientation, Rotation};
use super::shape::{Shape, Shapes};
use super::{Assembly, Clump, Domain, Grain, Numbers};
use crate::Result;

/// A shape, and how it is turned: from its own axes to those of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    pub shape: u32,
    pub orientation: DQuat,
}

/// The orientation; None: random. Euler angles are those of (2.34)-(2.37), Rz(φ) Rx(θ) Rz(ψ); a quaternion is (w, x, y,
/// z), which are q4, q2, -q1, q3 of the chapter.
pub fn orientation(given: &schema::Orientation, key: &str, check: &Check) -> Result<Option<DQuat>> {
    let wrong = |message: &str| Err(check.origin.wrong(key, message));
    match (check.dimension, given) {
        (_, Orientation::Word(word)) if word == "random" => Ok(None),
        (_, Orientation::Word(word)) => {
            Err(check.origin.bad(key, format!("\"{word}\""), "must be \"random\", an angle or a table of one"))
        }
        (2, Orientation::Plane(angle)) => Ok(Some(DQuat::from_rotation_z(*angle))),
        (3, Orientation::Space(Rotation::Euler([phi, theta, psi]))) => {
            Ok(Some(DQuat::from_rotation_z(*phi) * DQuat::from_rotation_x(*theta) * DQuat::from_rotation_z(*psi)))
        }
        (3, Orientation::Space(Rotation::Quaternion([w, x, y, z]))) => {
            let q = DQuat::from_xyzw(*x, *y, *z, *w);
            if q.length() > 1e-150 && q.length() < 1e150 {
                return Ok(Some(q.normalize()));
            }
            wrong("the quaternion must have a length other than 0")
        }
        (2, _) => wrong("must be a number of radians, or \"random\" (dimension = 2)"),
        _ => {
            wrong("must be { quaternion = [w, x, y, z] }, { euler = [phi, theta, psi] }, or \"random\" (dimension = 3)")
        }
    }
}

/// Grains of a population: spheres (disks), or clumps whose centres of mass, velocities, spins and sizes (that of the
/// sphere of the same volume) the grains have.
pub struct Placed {
    pub grains: Vec<Grain>,
    pub poses: Option<Vec<Pose>>,
    /// What a file calls the grains, or the clumps and their members.
    pub numbers: Option<Numbers>,
}

impl Placed {
    /// The spheres that number k consists of.
    pub fn spheres(&self, k: usize, shapes: &[Shape], spheres: &mut Vec<Grain>) {
        spheres.clear();
        match &self.poses {
            None => spheres.push(self.grains[k]),
            Some(poses) => {
                let clump = clump(&self.grains[k], &poses[k], 0);
                spheres.extend(clump.members(&shapes[clump.shape as usize]));
            }
        }
    }
}

/// The clump that a grain and a pose make; `first` is the number of its first member.
fn clump(grain: &Grain, pose: &Pose, first: usize) -> Clump {
    let Grain { position, velocity, spin, radius, material, fixed } = *grain;
    let Pose { shape, orientation } = *pose;
    Clump { shape, first: first as u32, position, orientation, velocity, spin, radius, material, fixed }
}

/// Everything that has been placed.
pub struct Bodies<'a> {
    pub shapes: Shapes<'a>,
    domain: Domain,
    pub grains: Vec<Grain>,
    clumps: Vec<Clump>,
    /// Of files that have them, with the place of their first grain.
    pub numbers: Vec<(usize, Numbers)>,
    /// What a user should know of how populations came out.
    pub notices: Vec<String>,
}

impl<'a> Bodies<'a> {
    pub fn new(shapes: Shapes<'a>, domain: Domain) -> Bodies<'a> {
        Bodies { shapes, domain, grains: Vec::new(), clumps: Vec::new(), numbers: Vec::new(), notices: Vec::new() }
    }

    pub fn append(&mut self, mut placed: Placed) {
        self.numbers.extend(placed.numbers.take().map(|numbers| (self.grains.len(), numbers)));
        let Some(poses) = &placed.poses else {
            match self.grains.is_empty() {
                true => self.grains = placed.grains,
                false => self.grains.append(&mut placed.grains),
            }
            return;
        };
        placed.grains.iter().zip(poses).for_each(|(grain, pose)| self.push(grain, pose));
    }

    /// A clump.
    fn push(&mut self, grain: &Grain, pose: &Pose) {
        let clump = clump(grain, pose, self.grains.len());
        let domain = self.domain;
        let within = |axis: usize| (domain.lower[axis]..=domain.upper[axis]).contains(&clump.position[axis]);
        let inside = (0..3).filter(|axis| domain.periodic[*axis]).all(within);
        let members = clump.members(&self.shapes.all[clump.shape as usize]).map(|mut member| {
            // The centre is in the domain, or an error later on; its members may stand out.
            if inside {
                domain.fold(&mut member.position);
            }
            member
        });
        self.grains.extend(members);
        self.clumps.push(clump);
    }

    /// Shapes, grains and clumps; among clumps, spheres are clumps too.
    pub fn finish(mut self) -> (Vec<Shape>, Vec<Grain>, Vec<Clump>) {
        if self.clumps.is_empty() {
            return (Vec::new(), self.grains, Vec::new());
        }
        let mut clumps = Vec::with_capacity(self.clumps.len());
        let mut at = 0;
        let end = (self.grains.len(), 0);
        let places = self.clumps.iter().map(|c| (c.first as usize, self.shapes.all[c.shape as usize].members.len()));
        let places: Vec<(usize, usize)> = places.chain([end]).collect();
        for (k, (first, members)) in places.into_iter().enumerate() {
            for (sphere, grain) in (at..first).zip(&self.grains[at..first]) {
                let pose = Pose { shape: self.shapes.sphere(), orientation: DQuat::IDENTITY };
                clumps.push(clump(grain, &pose, sphere));
            }
            clumps.extend(self.clumps.get(k));
            at = first + members;
        }
        (self.shapes.all, self.grains, clumps)
    }
}

/// All that others have comes behind what is there, at places that are not known yet.
pub fn add_waiting(assembly: &mut Assembly, mut others: Assembly) {
    if assembly.clumps.is_empty() != others.clumps.is_empty() {
        make_clumps(assembly);
        make_clumps(&mut others);
    }
    let (first, shape) = (assembly.grains.len() as u32, assembly.shapes.len() as u32);
    let behind = |clump: Clump| Clump { first: clump.first + first, shape: clump.shape + shape, ..clump };
    assembly.waiting += others.grains.len();
    assembly.clumps.extend(others.clumps.into_iter().map(behind));
    assembly.shapes.append(&mut others.shapes);
    assembly.grains.append(&mut others.grains);
}

/// Among clumps, spheres are clumps of one member.
fn make_clumps(assembly: &mut Assembly) {
    if assembly.clumps.is_empty() {
        let pose = Pose { shape: 0, orientation: DQuat::IDENTITY };
        assembly.shapes = vec![Shape::sphere(assembly.dimension)];
        assembly.clumps = assembly.grains.iter().enumerate().map(|(k, grain)| clump(grain, &pose, k)).collect();
    }
}

/// What grains and clumps are called, some of which, from these places on, have numbers of their own: counted from the
/// largest number before them on. None do: all by their place.
pub fn numbers(known: &[(usize, Numbers)], grains: usize, clumps: &[Clump]) -> Numbers {
    if known.is_empty() {
        return Numbers::default();
    }
    let place = |first: usize| clumps.partition_point(|clump| (clump.first as usize) < first);
    let of_grains: Vec<_> = known.iter().map(|(first, of)| (*first, of.grains.clone())).collect();
    let of_clumps: Vec<_> = known.iter().map(|(first, of)| (place(*first), of.clumps.clone())).collect();
    Numbers { grains: numbered(grains, &of_grains), clumps: numbered(clumps.len(), &of_clumps) }
}

/// Numbers of so many, some of which, from these places on, have numbers of their own.
fn numbered(count: usize, known: &[(usize, Vec<u32>)]) -> Vec<u32> {
    let mut all: Vec<u32> = Vec::with_capacity(count);
    let mut next = 0;
    for (first, numbers) in known {
        all.extend((next..).take(first.saturating_sub(all.len())));
        next = all.iter().max().map_or(0, |last| last + 1);
        all.extend(numbers.iter().map(|number| next + number));
        next = all.iter().max().map_or(0, |last| last + 1);
    }
    all.extend((next..).take(count.saturating_sub(all.len())));
    all
}
