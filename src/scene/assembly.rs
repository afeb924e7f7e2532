//! What a validated scene comes down to: numbers in SI units, grains in input order, materials by index.
//! Everything below `scene` in the crate reads this and nothing else of the scene file.

use super::cell::{COMPONENTS, Cell};
use super::growth::Growth;
use super::law::Pair;
use super::motion::Motion;
use super::schema::Twist;
use super::servo::Servo;
use super::shape::Shape;
use crate::{memory, solve};
use glam::{DQuat, DVec3};
use std::{borrow::Cow, f64::consts::PI, ops::Range};

/// A scene with every default filled in, every population placed and every value checked. One that is changed or made
/// by hand is checked by [`Assembly::validate`] when a simulation starts. In two dimensions all `z` components are 0
/// and spins have only a `z` component.
#[derive(Clone, Debug, PartialEq)]
pub struct Assembly {
    /// 2 (disks in the plane z = 0, unit thickness) or 3 (spheres).
    pub dimension: usize,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// Where grains may be, and what happens at its faces.
    pub domain: Domain,
    /// How the cell between periodic faces deforms.
    pub cell: Cell,
    /// Materials in the order of their names; everything else refers to them by index.
    pub materials: Vec<Material>,
    /// Contact parameters of each pair of materials, row-major `materials.len()`².
    pub pairs: Vec<Pair>,
    /// Walls; a box of the scene file is already split into its planes.
    pub walls: Vec<Wall>,
    /// Grains in input order; the index is the grain's id everywhere. The members of a clump are grains that follow
    /// each other.
    pub grains: Vec<Grain>,
    /// Shapes that clumps have.
    pub shapes: Vec<Shape>,
    /// Empty, or all grains are members of clumps, in order: single spheres among clumps are clumps of one member.
    pub clumps: Vec<Clump>,
    /// What comes in over time, and is not among the grains yet.
    pub insertions: Vec<Insertion>,
    /// Where grains leave.
    pub outlets: Vec<Outlet>,
    /// How radii change, material by material; none if they stay as they are.
    pub growth: Vec<Growth>,
    /// Grains, members of clumps among them, that are not there yet, so that their places mean nothing: the last ones of
    /// [`Assembly::whole`].
    pub waiting: usize,
    /// Numbers of grains and clumps where some have come in over time or left.
    pub numbers: Numbers,
    /// Numbers of the method.
    pub solver: Solver,
    /// When to stop.
    pub stop: Stop,
    /// What to write.
    pub output: Output,
    /// Where the grains are not what the scene asks for, and what they are instead.
    pub notices: Vec<String>,
}

/// Axis-aligned domain, but for tilts. An axis without bounds has `lower = -inf, upper = inf`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Domain {
    /// Lower corner, m.
    pub lower: DVec3,
    /// Upper corner, m.
    pub upper: DVec3,
    /// Which axes are periodic; the others are open.
    pub periodic: [bool; 3],
    /// Through which of the open ones grains leave; others must not.
    pub outlet: [bool; 3],
    /// Of a cell that has been sheared, m: how far the third edge leads along y and along x, and the second along x.
    pub tilt: DVec3,
}

impl Domain {
    /// The edge of the cell along a periodic axis, m.
    pub fn edge(&self, axis: usize) -> DVec3 {
        let length = self.upper[axis] - self.lower[axis];
        match axis {
            0 => DVec3::new(length, 0.0, 0.0),
            1 => DVec3::new(self.tilt.z, length, 0.0),
            _ => DVec3::new(self.tilt.y, self.tilt.x, length),
        }
    }

    /// What the tilts are over the lengths.
    fn slopes(&self) -> DVec3 {
        let length = self.upper - self.lower;
        self.tilt / DVec3::new(length.z, length.z, length.y)
    }

    /// A place in the cell, as it would be without tilts, m from the lower corner.
    pub fn sheared_back(&self, x: DVec3) -> DVec3 {
        let slopes = self.slopes();
        let y = x.y - slopes.x * x.z;
        DVec3::new(x.x - (slopes.z * y + slopes.y * x.z), y, x.z)
    }

    /// How far places as they would be without tilts can be from each other that are no further than this, m.
    pub fn sheared_reach(&self, reach: f64) -> DVec3 {
        let slopes = self.slopes();
        let x = DVec3::new(1.0, slopes.z, slopes.y - slopes.z * slopes.x);
        reach * DVec3::new(x.length(), 1.0_f64.hypot(slopes.x), 1.0)
    }

    /// The lower corner, m; 0 along axes without bounds.
    pub fn corner(&self) -> DVec3 {
        DVec3::select(self.lower.is_finite_mask(), self.lower, DVec3::ZERO)
    }

    /// A position brought into the tilted cell, where [`fold`](Domain::fold) leaves it in the box of the lengths.
    pub fn in_tilted_cell(&self, position: DVec3) -> DVec3 {
        let straight = self.sheared_back(position - self.corner());
        let periods = (0..3).filter(|axis| self.periodic[*axis]);
        periods.fold(position, |x, axis| {
            let edge = self.edge(axis);
            x - edge * (straight[axis] / edge[axis]).floor()
        })
    }

    /// The box around the cell, m.
    pub fn bounds(&self) -> [DVec3; 2] {
        let edges = (0..3).filter(|axis| self.periodic[*axis]).map(|axis| self.edge(axis) * (1.0 - DVec3::AXES[axis]));
        edges.fold([self.lower, self.upper], |[lower, upper], edge| {
            [lower + edge.min(DVec3::ZERO), upper + edge.max(DVec3::ZERO)]
        })
    }

    /// The minimum image of a difference of positions: the shortest that periods make of it, if that is within half of
    /// them.
    pub fn nearest(&self, mut difference: DVec3) -> DVec3 {
        for axis in (0..3).rev().filter(|axis| self.periodic[*axis]) {
            let edges = (difference[axis] / (self.upper[axis] - self.lower[axis])).round();
            if edges != 0.0 {
                difference -= edges * self.edge(axis);
            }
        }
        difference
    }

    /// Bring a position back into the periods.
    pub fn fold(&self, position: &mut DVec3) {
        for axis in (0..3).rev().filter(|axis| self.periodic[*axis]) {
            let (low, high) = (self.lower[axis], self.upper[axis]);
            if position[axis] < low || position[axis] >= high {
                let inside = low + (position[axis] - low).rem_euclid(high - low);
                let inside = if inside < high { inside } else { low };
                let edge = self.edge(axis);
                *position -= edge * ((position[axis] - inside) / edge[axis]).round();
                position[axis] = inside;
            }
        }
    }
}

/// A material as the scene gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    pub name: String,
    /// kg/m³; in two dimensions kg/m³ at unit thickness.
    pub density: f64,
}

/// The surface of a wall at time 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Half-space; `normal` is a unit vector pointing to the side where grains are.
    Plane { point: DVec3, normal: DVec3 },
    /// Inside of a vertical (z) cylinder; in two dimensions the inside of a circle. `center.z` is 0.
    Cylinder { center: DVec3, radius: f64 },
}

impl Surface {
    /// The point that moments on a wall are about, m: of a plane its point, of a cylinder its centre.
    pub fn reference(&self) -> DVec3 {
        match *self {
            Surface::Plane { point, .. } => point,
            Surface::Cylinder { center, .. } => center,
        }
    }

    /// Where it is, m: of a plane how far from the origin along its normal, of a cylinder its radius.
    pub fn position(&self) -> f64 {
        match *self {
            Surface::Plane { point, normal } => point.dot(normal),
            Surface::Cylinder { radius, .. } => radius,
        }
    }

    /// Distance of a point from the surface, m; negative beyond it.
    pub fn distance(&self, x: DVec3) -> f64 {
        match *self {
            Surface::Plane { point, normal } => (x - point).dot(normal),
            Surface::Cylinder { center, radius } => radius - (x - center).truncate().length(),
        }
    }
}

/// A wall.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// Name for messages and pictures, such as `floor` or `box z-`.
    pub name: String,
    pub surface: Surface,
    /// Translation, m/s, constant.
    pub velocity: DVec3,
    /// Spin of a cylinder about its axis, rad/s; 0 for planes.
    pub spin: f64,
    /// What else there is of its motion.
    pub motion: Motion,
    /// What moves it besides its velocity, if grains are to press on it with a target force or pressure.
    pub servo: Option<Servo>,
    /// Index into `materials`.
    pub material: u32,
}

/// A grain at time 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// m
    pub position: DVec3,
    /// m/s
    pub velocity: DVec3,
    /// rad/s
    pub spin: DVec3,
    /// m
    pub radius: f64,
    /// Index into `materials`.
    pub material: u32,
    /// A fixed grain keeps its velocity and spin, whatever pushes it.
    pub fixed: bool,
}

const _: () = assert!(size_of::<Grain>() as u64 == memory::GRAIN);

/// A rigid clump at time 0: a shape of some size. Its members are grains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clump {
    /// Index into `shapes`.
    pub shape: u32,
    /// The first of its members in `grains`; as many follow as the shape has.
    pub first: u32,
    /// Centre of mass, m.
    pub position: DVec3,
    /// Rotates from the axes in which the shape was given to those of the scene.
    pub orientation: DQuat,
    /// Of the centre of mass, m/s.
    pub velocity: DVec3,
    /// Along the axes of the scene, rad/s.
    pub spin: DVec3,
    /// Radius of the sphere (disk) of the same volume, m.
    pub radius: f64,
    /// Index into `materials`.
    pub material: u32,
    /// A fixed clump keeps its velocity and spin, whatever pushes it.
    pub fixed: bool,
}

impl Clump {
    /// Its members, as long as no period moves them.
    pub fn members<'a>(&self, shape: &'a Shape) -> impl Iterator<Item = Grain> + use<'a> {
        let clump = *self;
        let principal = clump.orientation * shape.frame;
        shape.members.iter().map(move |member| {
            let arm = clump.radius * (principal * member.arm);
            Grain {
                position: clump.position + arm,
                velocity: clump.velocity + clump.spin.cross(arm),
                spin: clump.spin,
                radius: clump.radius * member.radius,
                material: clump.material,
                fixed: clump.fixed,
            }
        })
    }
}

/// A box, or what a vertical cylinder (a circle) has of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Corners, m.
    pub lower: DVec3,
    pub upper: DVec3,
    /// A cylinder.
    pub around: Option<Surface>,
}

/// How fast grains come in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rate {
    /// 1/s
    Number(f64),
    /// kg/s
    Mass(f64),
}

/// Grains that come in over time, one after the other: wherever there is room for them in a region.
#[derive(Clone, Debug, PartialEq)]
pub struct Insertion {
    /// Key of the population.
    pub name: String,
    pub region: Region,
    /// Of the region, m/s.
    pub region_velocity: DVec3,
    pub rate: Rate,
    /// No more than that comes in, kg.
    pub most_mass: f64,
    /// s
    pub start: f64,
    pub stop: f64,
    /// From one batch to the next, s; None: [`Insertion::interval`].
    pub interval: Option<f64>,
    pub seed: u64,
    /// What comes in, in this order, as at time 0. Members of clumps are counted here.
    pub grains: Vec<Grain>,
    pub clumps: Vec<Clump>,
    /// Numbers of the first of these.
    pub first_grain: u32,
    pub first_clump: u32,
}

/// What takes grains away whose centres, of clumps those of mass, are there.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlet {
    pub name: String,
    pub place: Place,
    /// s
    pub start: f64,
    pub stop: f64,
    /// From one look to the next, s; None: so many steps as [`Outlet::interval`] says.
    pub interval: Option<f64>,
}

/// Where that is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    Inside(Region),
    /// The side of a plane that its normal points away from.
    Behind {
        point: DVec3,
        normal: DVec3,
    },
    /// Beyond the faces of the domain that are outlets.
    OutsideDomain,
}

/// What grains and clumps are called, by their place in the assembly. None: by that place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Numbers {
    pub grains: Vec<u32>,
    pub clumps: Vec<u32>,
}

impl Numbers {
    pub fn of_grain(&self, place: usize) -> u32 {
        self.grains.get(place).copied().unwrap_or(place as u32)
    }

    pub fn of_clump(&self, place: usize) -> u32 {
        self.clumps.get(place).copied().unwrap_or(place as u32)
    }
}

impl Assembly {
    /// With all that will have come in, wherever it will do so, and the largest radii that grains will have.
    pub fn whole(&self) -> Cow<'_, Assembly> {
        if self.insertions.is_empty() {
            return self.with_largest_radii();
        }
        let mut whole = self.clone();
        for Insertion { grains, clumps, .. } in std::mem::take(&mut whole.insertions) {
            let first = whole.grains.len() as u32;
            whole.waiting += grains.len();
            whole.grains.extend(grains);
            whole.clumps.extend(clumps.into_iter().map(|clump| Clump { first: clump.first + first, ..clump }));
        }
        Cow::Owned(whole)
    }

    /// Whether grains may come or go.
    pub fn changes(&self) -> bool {
        !(self.insertions.is_empty() && self.outlets.is_empty())
    }

    /// Of a sphere (disk), m³ (m²).
    pub fn volume_of(&self, radius: f64) -> f64 {
        match self.dimension {
            2 => PI * radius * radius,
            _ => 4.0 / 3.0 * PI * radius.powi(3),
        }
    }

    /// Of a sphere (disk), kg.
    pub fn mass_of(&self, radius: f64, material: u32) -> f64 {
        self.materials[material as usize].density * self.volume_of(radius)
    }

    /// Indices of the members of clump k in `grains`.
    pub fn members(&self, k: usize) -> Range<usize> {
        let end = self.clumps.get(k + 1).map_or(self.grains.len(), |next| next.first as usize);
        self.clumps[k].first as usize..end
    }

    /// How far the farthest grain is from the origin, m.
    pub fn extent(&self) -> f64 {
        self.grains.iter().map(|grain| grain.position.length() + grain.radius).fold(0.0, f64::max)
    }

    /// The clump of every grain; empty in a scene without clumps.
    pub fn owners(&self) -> Vec<u32> {
        (0..self.clumps.len()).flat_map(|k| self.members(k).map(move |_| k as u32)).collect()
    }
}

impl Assembly {
    /// The same in this domain.
    pub fn within(&self, domain: Domain) -> Cow<'_, Assembly> {
        match domain == self.domain {
            true => Cow::Borrowed(self),
            false => Cow::Owned(Assembly { domain, ..self.clone() }),
        }
    }

    /// A checksum of everything that a step may depend on: not of when to stop and what to write.
    pub fn checksum(&self) -> u32 {
        let Assembly {
            dimension,
            gravity,
            domain,
            cell,
            materials,
            pairs,
            walls,
            shapes,
            solver,
            insertions,
            outlets,
            growth,
            ..
        } = self;
        let Assembly { grains, clumps, .. } = &*self.whole();
        let mut hasher = crc32fast::Hasher::new();
        let rest = (dimension, gravity, domain, cell, materials, pairs, walls, shapes, solver);
        hasher.update(format!("{rest:?}").as_bytes());
        for of in insertions {
            let limits = (of.most_mass, of.start, of.stop, of.interval, of.seed);
            hasher.update(format!("{:?}", (&of.name, of.region, of.region_velocity, of.rate, limits)).as_bytes());
        }
        if let Some(law) = self.growth_law() {
            hasher.update(format!("{:?}", (growth, law.ends)).as_bytes());
        }
        outlets.iter().for_each(|outlet| hasher.update(format!("{outlet:?}").as_bytes()));
        let mut numbers = |numbers: &[f64]| numbers.iter().for_each(|x| hasher.update(&x.to_le_bytes()));
        for Grain { position, velocity, spin, radius, material, fixed } in grains {
            [position, velocity, spin].into_iter().for_each(|v| numbers(&v.to_array()));
            numbers(&[*radius, f64::from(*material), f64::from(u8::from(*fixed))]);
        }
        for Clump { shape, first, position, orientation, velocity, spin, radius, material, fixed } in clumps {
            [position, velocity, spin].into_iter().for_each(|v| numbers(&v.to_array()));
            numbers(&orientation.to_array());
            numbers(&[*radius, f64::from(u8::from(*fixed))]);
            [shape, first, material].into_iter().for_each(|k| numbers(&[f64::from(*k)]));
        }
        hasher.finalize()
    }
}

/// Time step as the scene asks for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeStep {
    /// This fraction of the computed bound.
    Auto { fraction: f64 },
    /// Seconds.
    Fixed(f64),
}

/// How contacts act.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Springs and dashpots.
    DiscreteElements,
    /// Rigid grains, restitution 0.
    ContactDynamics(Relaxation),
}

/// How contact dynamics finds the impulses of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation {
    pub solver: solve::Solver,
    /// Of `gauss-seidel`.
    pub order: solve::Order,
    /// Relative residual of the natural map at which a step is solved.
    pub tolerance: f64,
    /// Passes after which a step goes on unsolved, which is counted.
    pub max_iterations: u32,
    /// At most this fast an overlap opens, m/s. None: a tenth of what gravity
    /// gives in a step, or a thousandth of the mean radius per step without.
    pub max_correction_velocity: Option<f64>,
    /// Whether contacts give way by the springs and dashpots of their pairs, and are not rigid. Then overlaps open by
    /// themselves.
    pub compliant: bool,
    /// Whether free clumps keep their angular momentum, and not their angular velocity as in the source chapter.
    pub gyroscopic: bool,
}

/// Numbers of the method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solver {
    pub method: Method,
    pub dt: TimeStep,
    /// Accept a time step above the bound.
    pub allow_unstable: bool,
    /// Accept more than 10 % overlap at the start.
    pub allow_overlap: bool,
    /// Global damping ξ, 1/s.
    pub damping: f64,
    /// Damping that adapts itself to the motion, to find a state of rest; `damping` is 0 then.
    pub adaptive_damping: bool,
    /// Neighbour-list margin in units of the mean radius.
    pub margin: f64,
    /// Whether springs follow the twist of their contact about its normal.
    pub twist: Twist,
}

/// Stop conditions; the first one reached ends the run. At least one is set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// s
    pub time: Option<f64>,
    pub steps: Option<u64>,
    /// Unbalanced-force ratio below which the scene is at rest.
    pub equilibrium: Option<f64>,
    /// Strains of the cell, component by component as [`Cell::strain_rate`].
    pub strain: [Option<f64>; COMPONENTS.len()],
    /// Of the cell: volumes of grains over its own.
    pub packing_fraction: Option<f64>,
    /// Of the cell, Pa (N/m).
    pub pressure: Option<f64>,
    /// Find the fraction at which the packing jams.
    pub jamming: Option<JammingProtocol>,
}

/// How the jamming fraction of a packing is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JammingProtocol {
    /// By how much the packing fraction grows from one state to the next until a state is jammed.
    pub step: f64,
    /// How close the last state comes to zero pressure, as a packing fraction.
    pub tolerance: f64,
    /// Mean total force over mean contact force below which a state is at rest.
    pub residual: f64,
    /// Steps after which a state that is not at rest is left as it is.
    pub relaxation_steps: u64,
}

impl Default for JammingProtocol {
    fn default() -> JammingProtocol {
        JammingProtocol { step: 0.005, tolerance: 1e-4, residual: 1e-5, relaxation_steps: 200_000 }
    }
}

/// What a run writes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Output {
    /// Simulated time between rows of `history.csv`, s. None: 100 rows over the run (or every 1,000 steps).
    pub history: Option<f64>,
    /// Simulated time between snapshots, s. None: only the last state.
    pub snapshots: Option<f64>,
    /// Wall time between checkpoints, s; there is one at the end, too. 0: none.
    pub checkpoint: f64,
    /// Add up dissipation and works in every step, for `history.csv`.
    pub works: bool,
    /// Write `final.csv`.
    pub csv: bool,
    /// Write `final.bin`, and snapshots like it.
    pub bin: bool,
    /// Write `.vtp` and `.pvd`.
    pub vtp: bool,
    /// Write contacts in tables and as lines, and packings for NumPy, as extended XYZ and as dumps of LAMMPS.
    pub contacts_csv: bool,
    pub contacts_vtp: bool,
    pub npz: bool,
    pub xyz: bool,
    pub dump: bool,
}
