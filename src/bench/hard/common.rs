//! What the cases and the physics tests share: small assemblies, the engines to run them on, comparisons without units.

use crate::{
    gpu::adapters,
    model::Precision,
    scene::{
        Assembly, Cell, Clump, Domain, Grain, Material, Member, Method, Motion, Numbers, Output, Pair, Relaxation,
        Shape, Solver, Stop, Surface, TimeStep, Twist, Wall,
    },
    simulation::{EngineChoice, Options, Simulation},
    solve,
};
use glam::{DQuat, DVec3};

/// Radius of the default grain, m.
pub const R: f64 = 1e-3;
/// Density of the default material, kg/m³.
pub const RHO: f64 = 2500.0;
/// Normal stiffness of the default material, N/m.
pub const KN: f64 = 1e4;
pub const G: f64 = 9.81;

/// An engine with a precision.
#[derive(Clone, Copy, Debug)]
pub struct Bench {
    pub name: &'static str,
    pub engine: EngineChoice,
    pub precision: Precision,
}

pub const CPU: Bench = Bench { name: "cpu", engine: EngineChoice::Cpu, precision: Precision::Double };
pub const GPU_SINGLE: Bench = Bench { name: "gpu single", engine: EngineChoice::Gpu, precision: Precision::Single };
pub const GPU_DOUBLE: Bench = Bench { name: "gpu double", engine: EngineChoice::Gpu, precision: Precision::Double };

/// The engines that this machine has: cpu (f64), gpu in f32, gpu in f64.
pub fn engines() -> Vec<Bench> {
    let found = adapters();
    let mut benches = vec![CPU];
    benches.extend((!found.is_empty()).then_some(GPU_SINGLE));
    benches.extend(found.iter().any(|a| a.double).then_some(GPU_DOUBLE));
    benches
}

impl Bench {
    pub fn is_single(&self) -> bool {
        self.precision == Precision::Single
    }

    /// The tolerance for this precision.
    pub fn pick<T>(&self, double: T, single: T) -> T {
        if self.is_single() { single } else { double }
    }

    pub fn options(&self) -> Options {
        Options { engine: self.engine, precision: self.precision, ..Options::default() }
    }

    pub fn start(&self, assembly: &Assembly) -> Simulation {
        self.start_with(assembly, self.options())
    }

    pub fn start_with(&self, assembly: &Assembly, options: Options) -> Simulation {
        Simulation::new(assembly.clone(), options).unwrap_or_else(|e| panic!("{}: {e}", self.name))
    }

    /// All grains after so many steps.
    pub fn after(&self, assembly: &Assembly, steps: u64) -> Vec<Grain> {
        let mut simulation = self.start(assembly);
        simulation.advance(steps).unwrap_or_else(|e| panic!("{}: {e}", self.name));
        simulation.grains().unwrap()
    }
}

/// No grains, no walls, no gravity, unbounded, one frictionless elastic material, dt = 1 μs.
pub fn blank(dimension: usize) -> Assembly {
    Assembly {
        dimension,
        gravity: DVec3::ZERO,
        domain: Domain { lower: DVec3::NEG_INFINITY, upper: DVec3::INFINITY, ..Domain::default() },
        cell: Cell::default(),
        materials: vec![Material { name: "default".to_owned(), density: RHO }],
        pairs: vec![law(0.0)],
        walls: vec![],
        grains: vec![],
        shapes: vec![],
        clumps: vec![],
        insertions: vec![],
        outlets: vec![],
        growth: vec![],
        waiting: 0,
        numbers: Numbers::default(),
        solver: Solver {
            method: Method::DiscreteElements,
            dt: TimeStep::Fixed(1e-6),
            allow_unstable: false,
            allow_overlap: true,
            damping: 0.0,
            adaptive_damping: false,
            margin: 0.2,
            twist: Twist::Ignored,
        },
        stop: Stop::default(),
        output: Output::default(),
        notices: vec![],
    }
}

/// `blank` with another time step.
pub fn blank_dt(dimension: usize, dt: f64) -> Assembly {
    let mut assembly = blank(dimension);
    assembly.solver.dt = TimeStep::Fixed(dt);
    assembly
}

/// `blank` for rigid grains with this friction, solved to this tolerance.
pub fn rigid(dimension: usize, dt: f64, friction: f64, tolerance: f64) -> Assembly {
    let mut assembly = blank_dt(dimension, dt);
    assembly.solver.margin = 1.0;
    assembly.solver.method = Method::ContactDynamics(Relaxation {
        solver: solve::Solver::JacobiAccelerated,
        order: solve::Order::default(),
        tolerance,
        max_iterations: 2_000,
        max_correction_velocity: None,
        compliant: false,
        gyroscopic: false,
    });
    assembly.pairs = vec![Pair { friction, ..Pair::default() }];
    assembly
}

/// Both methods: the scene, and the same with rigid grains.
pub fn rigid_too(scene: Assembly) -> [Assembly; 2] {
    let Method::ContactDynamics(mut relaxation) = rigid(3, 1.0, 0.0, 1e-6).solver.method else { unreachable!() };
    relaxation.gyroscopic = true;
    let mut second = scene.clone();
    second.solver.method = Method::ContactDynamics(relaxation);
    second.pairs.iter_mut().for_each(|pair| *pair = Pair { friction: pair.friction, ..Pair::default() });
    [scene, second]
}

/// The scene with everything, walls too, carried along: to whoever goes with it nothing changes.
pub fn carried(scene: &Assembly, by: DVec3) -> Assembly {
    let mut scene = scene.clone();
    scene.grains.iter_mut().for_each(|grain| grain.velocity += by);
    scene.clumps.iter_mut().for_each(|clump| clump.velocity += by);
    scene.walls.iter_mut().for_each(|wall| wall.velocity += by);
    scene
}

/// The default material against itself.
pub fn law(friction: f64) -> Pair {
    Pair { normal_stiffness: KN, tangential_stiffness: 2.0 / 7.0 * KN, friction, ..Pair::default() }
}

/// A law so stiff that a grain's weight makes an overlap of 1e-4 R in two and three dimensions.
pub fn bed_law(dimension: usize, friction: f64) -> Pair {
    let kn = mass(dimension, R) * G / (1e-4 * R);
    Pair { normal_stiffness: kn, tangential_stiffness: 2.0 / 7.0 * kn, friction, ..Pair::default() }
}

/// Several materials of one density; the contact of a and b follows `laws[max(a, b)]`, so that material 0 can be the
/// wall that every grain meets with its own law.
pub fn set_laws(assembly: &mut Assembly, laws: &[Pair]) {
    let n = laws.len();
    assembly.materials = (0..n).map(|k| Material { name: format!("m{k}"), density: RHO }).collect();
    assembly.pairs = (0..n * n).map(|k| laws[(k / n).max(k % n)]).collect();
}

pub fn grain(x: f64, y: f64, z: f64) -> Grain {
    Grain {
        position: DVec3::new(x, y, z),
        velocity: DVec3::ZERO,
        spin: DVec3::ZERO,
        radius: R,
        material: 0,
        fixed: false,
    }
}

/// A clump of this shape (an index into the scene's) at rest at the origin, along the axes of its shape, of size `R`.
pub fn clump(shape: u32) -> Clump {
    Clump {
        shape,
        first: 0,
        position: DVec3::ZERO,
        orientation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        spin: DVec3::ZERO,
        radius: R,
        material: 0,
        fixed: false,
    }
}

/// Put clumps into a scene, in place of all its grains.
pub fn set_clumps(assembly: &mut Assembly, shapes: Vec<Shape>, clumps: Vec<Clump>) {
    assembly.grains.clear();
    assembly.clumps = clumps;
    for clump in &mut assembly.clumps {
        clump.first = assembly.grains.len() as u32;
        assembly.grains.extend(clump.members(&shapes[clump.shape as usize]));
    }
    assembly.shapes = shapes;
}

/// Members of radius 1 at these points.
pub fn members(centers: &[DVec3]) -> Vec<Member> {
    centers.iter().map(|arm| Member { arm: *arm, radius: 1.0 }).collect()
}

/// Of four spheres round a corner, no two of its moments the same.
pub fn corner(dimension: usize) -> Shape {
    let centers = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X, 1.5 * DVec3::Y];
    Shape::of_union("corner", &members(&centers), dimension)
}

pub fn up(dimension: usize) -> DVec3 {
    DVec3::AXES[dimension - 1]
}

pub fn floor(dimension: usize) -> Wall {
    plane(DVec3::ZERO, up(dimension))
}

pub fn plane(point: DVec3, normal: DVec3) -> Wall {
    wall("plane", Surface::Plane { point, normal: normal.normalize() })
}

pub fn cylinder(radius: f64) -> Wall {
    wall("cylinder", Surface::Cylinder { center: DVec3::ZERO, radius })
}

fn wall(name: &str, surface: Surface) -> Wall {
    let (velocity, motion) = (DVec3::ZERO, Motion::default());
    Wall { name: name.to_owned(), surface, velocity, spin: 0.0, motion, servo: None, material: 0 }
}

/// Mass of the default material, kg.
pub fn mass(dimension: usize, radius: f64) -> f64 {
    use std::f64::consts::PI;
    if dimension == 2 { RHO * PI * radius * radius } else { RHO * PI * radius.powi(3) / 0.75 }
}

/// J / m R².
pub fn gyration(dimension: usize) -> f64 {
    if dimension == 2 { 1.0 / 2.0 } else { 2.0 / 5.0 }
}

/// Compare two numbers on a scale that says what size a difference matters at.
#[track_caller]
pub fn close(what: &str, found: f64, expected: f64, scale: f64, tolerance: f64) {
    let error = (found - expected).abs() / scale;
    assert!(
        error <= tolerance,
        "{what}: found {found:e}, expected {expected:e}, error {error:.3e} of {scale:e}, allowed {tolerance:e}"
    );
}

/// Largest difference of two states of the same grains: positions in radii (shifted images count as equal), velocities
/// and surface speeds in units of the fastest grain's speed.
pub fn distance(assembly: &Assembly, a: &[Grain], b: &[Grain]) -> f64 {
    assert_eq!(a.len(), b.len());
    let speed = b.iter().map(|g| g.velocity.length().max(g.spin.length() * g.radius)).fold(1e-300, f64::max);
    let of = |a: &Grain, b: &Grain| {
        let parts = [
            assembly.domain.nearest(a.position - b.position).length() / b.radius,
            (a.velocity - b.velocity).length() / speed,
            (a.spin - b.spin).length() * b.radius / speed,
        ];
        // NaN must not pass for small.
        parts.into_iter().fold(0.0, |worst, part| if part <= worst { worst } else { part })
    };
    a.iter().zip(b).map(|(a, b)| of(a, b)).fold(0.0, |worst, d| if d <= worst { worst } else { d })
}

/// A small generator of its own (splitmix64), so that scenes are the same everywhere.
pub struct Random(pub u64);

impl Random {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [-1, 1).
    pub fn sign(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    pub fn vector(&mut self, dimension: usize) -> DVec3 {
        let (x, y, z) = (self.sign(), self.sign(), self.sign());
        DVec3::new(x, y, if dimension == 2 { 0.0 } else { z })
    }
}

/// Spacing of `cloud`, m.
pub const SPACING: f64 = 2.12 * R;

/// A jittered lattice of `side`^dimension grains with corner at the origin, radii 0.8 to 1 R, random velocities of up
/// to `speed` per component and spins of the same surface speed. Nothing overlaps.
pub fn cloud(dimension: usize, side: usize, speed: f64, seed: u64) -> Vec<Grain> {
    let mut random = Random(seed);
    let count = side.pow(dimension as u32);
    let at = |k: usize| DVec3::new((k % side) as f64, (k / side % side) as f64, (k / side / side) as f64);
    (0..count)
        .map(|k| {
            let half = if dimension == 2 { DVec3::new(0.5, 0.5, 0.0) } else { DVec3::splat(0.5) };
            let spin = speed / R * random.vector(3);
            Grain {
                position: SPACING * (at(k) + half) + 0.05 * R * random.vector(dimension),
                velocity: speed * random.vector(dimension),
                spin: if dimension == 2 { DVec3::Z * spin.z } else { spin },
                radius: R * (0.8 + 0.2 * random.unit()),
                material: 0,
                fixed: false,
            }
        })
        .collect()
}
