//! Model: the choices a scene implies, one enum per slot. It alone decides which WGSL files are composed and which
//! arrays exist; nothing the scene does not need is modelled, allocated or computed.

use crate::{
    scene::{self, Assembly, Dashpot, Method as Solve},
    solve::Solver,
};

/// Declares a slot: an enum whose variants are the files of one folder of `shaders/`.
macro_rules! slot {
    ($(#[$meta:meta])* $name:ident in $folder:literal { $($(#[$vmeta:meta])* $variant:ident = $file:literal),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name { $($(#[$vmeta])* $variant),* }

        impl $name {
            /// Every alternative of the slot.
            pub const ALL: &'static [$name] = &[$($name::$variant),*];

            /// The file of this alternative, relative to `shaders/`.
            pub fn file(self) -> &'static str {
                match self { $($name::$variant => concat!($folder, "/", $file, ".wgsl")),* }
            }

            /// The name of this alternative: its file's stem.
            pub fn label(self) -> &'static str {
                match self { $($name::$variant => $file),* }
            }
        }
    };
}

slot!(
    /// Width of `Real` on the device; single precision owns the low parts of the positions. The CPU engine computes in
    /// f64 whatever stands here.
    Precision in "space/precision" { Single = "single", Double = "double" }
);
impl Precision {
    /// Unit round-off.
    pub fn epsilon(self) -> f64 {
        match self {
            Precision::Single => f64::from(f32::EPSILON),
            Precision::Double => f64::EPSILON,
        }
    }

    /// The file that says what `Real` is, relative to `shaders/`: all that kernels which know no positions need.
    pub fn scalar_file(self) -> &'static str {
        match self {
            Precision::Single => "space/scalar/single.wgsl",
            Precision::Double => "space/scalar/double.wgsl",
        }
    }
}

slot!(
    /// Disks in a plane or spheres in space.
    Dimension in "space/dimension" { Plane = "plane", Space = "space" }
);
slot!(
    /// Whether any axis is periodic, and whether the cell between periodic faces deforms, or is tilted; owns that cell.
    Boundary in "space/boundary" { Open = "open", Periodic = "periodic", Deforming = "deforming" }
);
/// How contacts act, and with them a step: the chapters `dem` and `nscd`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Method {
    DiscreteElements,
    ContactDynamics,
}

impl Method {
    /// As scene files have it.
    pub fn label(self) -> &'static str {
        match self {
            Method::DiscreteElements => "dem",
            Method::ContactDynamics => "cd",
        }
    }
}

slot!(
    /// Normal contact law.
    Normal in "contact/normal" { Hooke = "hooke", Hertz = "hertz", Rigid = "rigid" }
);
slot!(
    /// Normal dashpot.
    Damping in "contact/damping" { None = "none", Restitution = "restitution", MassScaled = "mass_scaled" }
);
slot!(
    /// Whether contacts remember anything; what, those say who own it.
    History in "contact/history" { None = "none", Kept = "kept" }
);
slot!(
    /// Rolling resistance.
    Rolling in "contact/rolling" { None = "none", ElasticPlastic = "elastic_plastic" }
);
slot!(
    /// Whether springs follow the twist of their contact about its normal; in a plane there is none.
    Twist in "contact/twist" { Ignored = "ignored", Followed = "followed" }
);
slot!(
    /// Attraction of surfaces.
    Cohesion in "contact/cohesion" { None = "none" }
);
slot!(
    /// Tangential contact law; owns the tangential force.
    Tangential in "contact/tangential" { None = "none", Coulomb = "coulomb", Mindlin = "mindlin" }
);
slot!(
    /// Whether radii change over time.
    Growth in "contact/growth" { None = "none", Some = "some" }
);
slot!(
    /// Spin of the grains; owns spin and torque.
    Rotation in "body/rotation" { None = "none", Sphere = "sphere" }
);
slot!(
    /// What a grain is: a body, or a rigid clump of bodies; owns the clumps.
    Grains in "body/grains" { Spheres = "spheres", Clumps = "clumps" }
);
slot!(
    /// Whether products of angular velocities act on clumps, which contact dynamics may leave out; on spheres there are
    /// none.
    Gyroscopic in "nscd/gyroscopic" { Dropped = "dropped", Kept = "kept" }
);
slot!(
    /// Whether contacts of contact dynamics are rigid, or give way as springs and dashpots do.
    Compliance in "nscd/compliance" { None = "none", Stiffness = "stiffness" }
);
slot!(
    /// One set of contact parameters, or a table by material.
    Materials in "contact/materials" { One = "one", Many = "many" }
);
slot!(
    /// Grains of like size, or of many sizes, for each of which the grid has a level.
    Levels in "neighbours/levels" { One = "one", Several = "several" }
);
slot!(
    /// Walls, or none.
    Walls in "space/walls" { None = "none", Some = "some" }
);
slot!(
    /// Whether walls turn, or cylinders about their axes.
    Turning in "space/turning" { None = "none", Some = "some" }
);

/// One choice per slot, and which optional stages the plan has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Model {
    pub precision: Precision,
    pub dimension: Dimension,
    pub boundary: Boundary,
    pub method: Method,
    pub normal: Normal,
    pub damping: Damping,
    pub tangential: Tangential,
    pub rolling: Rolling,
    pub twist: Twist,
    pub cohesion: Cohesion,
    pub growth: Growth,
    pub history: History,
    pub rotation: Rotation,
    pub grains: Grains,
    pub gyroscopic: Gyroscopic,
    pub compliance: Compliance,
    pub materials: Materials,
    pub walls: Walls,
    pub turning: Turning,
    pub levels: Levels,
    /// Optional stages: some grains are so large that workgroups serve them, one each.
    pub large_grains: bool,
    /// Optional stage: a wall translates, so that walls are integrated too.
    pub moving_walls: bool,
    /// Optional stage instead: one moves otherwise, so that all walls are where the host says.
    pub guided_walls: bool,
    /// Optional stages: servos move walls, so that what presses on them comes to a target.
    pub driven_walls: bool,
    /// Optional stages: a servo brings the stress of the cell to a target.
    pub servo: bool,
    /// Optional stages: global damping that adapts itself to the motion.
    pub adaptive_damping: bool,
    /// Optional stages: dissipation and works are added up in every step.
    pub works: bool,
    /// Optional stages: contact dynamics updates contacts colour by colour, and not all at once.
    pub colored: bool,
    /// In place of passes: the host solves the contacts of contact dynamics.
    pub solved_on_host: bool,
}

impl Model {
    /// What the scene needs, and no more.
    pub fn of(assembly: &Assembly, precision: Precision) -> Model {
        let pairs = &assembly.pairs;
        let (method, gyroscopic, compliant, solver) = match assembly.solver.method {
            Solve::DiscreteElements => (Method::DiscreteElements, true, false, None),
            Solve::ContactDynamics(r) => (Method::ContactDynamics, r.gyroscopic, r.compliant, Some(r.solver)),
        };
        let rigid = method == Method::ContactDynamics;
        let frictional = pairs.iter().any(|p| p.friction > 0.0);
        let clumped = !assembly.clumps.is_empty();
        let rolling = !rigid && pairs.iter().any(|p| p.rolling.is_some());
        let spinning = clumped || assembly.grains.iter().any(|g| g.spin != glam::DVec3::ZERO);
        Model {
            precision,
            dimension: if assembly.dimension == 2 { Dimension::Plane } else { Dimension::Space },
            boundary: match () {
                () if assembly.deforms() => Boundary::Deforming,
                () if assembly.domain.periodic.contains(&true) => Boundary::Periodic,
                () => Boundary::Open,
            },
            method,
            normal: match pairs[0].hertz {
                _ if rigid => Normal::Rigid,
                Some(_) => Normal::Hertz,
                None => Normal::Hooke,
            },
            damping: match pairs.iter().map(|p| p.dashpot).find(|d| *d != Dashpot::None) {
                None | Some(Dashpot::None) => Damping::None,
                Some(Dashpot::Restitution(_)) => Damping::Restitution,
                Some(Dashpot::MassScaled(_)) => Damping::MassScaled,
            },
            tangential: match pairs[0].hertz {
                _ if !frictional && !rigid => Tangential::None,
                Some(_) if !rigid => Tangential::Mindlin,
                _ => Tangential::Coulomb,
            },
            rolling: if rolling { Rolling::ElasticPlastic } else { Rolling::None },
            twist: match assembly.solver.twist {
                scene::Twist::Followed if assembly.dimension == 3 && !rigid && (frictional || rolling) => {
                    Twist::Followed
                }
                _ => Twist::Ignored,
            },
            cohesion: Cohesion::None,
            growth: if assembly.grows() { Growth::Some } else { Growth::None },
            history: if frictional || rolling || rigid { History::Kept } else { History::None },
            rotation: if frictional || rolling || spinning { Rotation::Sphere } else { Rotation::None },
            grains: if clumped { Grains::Clumps } else { Grains::Spheres },
            gyroscopic: if clumped && gyroscopic { Gyroscopic::Kept } else { Gyroscopic::Dropped },
            compliance: if compliant { Compliance::Stiffness } else { Compliance::None },
            materials: match pairs.windows(2).all(|w| w[0] == w[1]) && assembly.growth.windows(2).all(|w| w[0] == w[1])
            {
                true => Materials::One,
                false => Materials::Many,
            },
            walls: if assembly.walls.is_empty() { Walls::None } else { Walls::Some },
            turning: if assembly.walls.iter().any(scene::Wall::turns) { Turning::Some } else { Turning::None },
            levels: if assembly.size_levels().len() == 1 { Levels::One } else { Levels::Several },
            large_grains: assembly.large_grains() > 0,
            moving_walls: assembly.walls.iter().any(scene::Wall::moves),
            guided_walls: assembly.walls.iter().any(scene::Wall::is_guided),
            driven_walls: assembly.walls.iter().any(|wall| wall.servo.is_some()),
            servo: assembly.cell.stress != [None; 6],
            adaptive_damping: assembly.solver.adaptive_damping,
            works: assembly.output.works && !rigid,
            colored: solver == Some(Solver::ColouredAccelerated),
            solved_on_host: solver.is_some_and(Solver::is_of_host),
        }
    }

    /// Spatial dimension, 2 or 3.
    pub fn dims(&self) -> usize {
        match self.dimension {
            Dimension::Plane => 2,
            Dimension::Space => 3,
        }
    }

    /// The slots as (slot, alternative), for people. Rigid grains have no law of contact, those that give way its springs and
    /// dashpots.
    pub fn slots(&self) -> Vec<(&'static str, &'static str)> {
        let law = [
            ("normal", self.normal.label()),
            ("damping", self.damping.label()),
            ("tangential", self.tangential.label()),
            ("rolling", self.rolling.label()),
            ("twist", self.twist.label()),
            ("cohesion", self.cohesion.label()),
        ];
        let law = match (self.method, self.compliance) {
            (Method::DiscreteElements, _) => &law[..],
            (Method::ContactDynamics, Compliance::Stiffness) => &law[1..2],
            (Method::ContactDynamics, Compliance::None) => &[],
        };
        let before = [
            ("precision", self.precision.label()),
            ("dimension", self.dimension.label()),
            ("boundary", self.boundary.label()),
            ("method", self.method.label()),
        ];
        let after = [
            ("history", self.history.label()),
            ("rotation", self.rotation.label()),
            ("grains", self.grains.label()),
            ("growth", self.growth.label()),
            ("gyroscopic", self.gyroscopic.label()),
            ("compliance", self.compliance.label()),
            ("materials", self.materials.label()),
            ("walls", self.walls.label()),
            ("turning", self.turning.label()),
            ("levels", self.levels.label()),
        ];
        [&before, law, &after].concat()
    }

    /// The WGSL files every kernel of this model is composed with, relative to `shaders/`.
    pub fn files(&self) -> Vec<&'static str> {
        let mut files = vec![
            self.precision.scalar_file(),
            self.precision.file(),
            self.dimension.file(),
            "gpu/pipeline.wgsl",
            "state.wgsl",
            "body/bodies.wgsl",
            self.boundary.file(),
            "neighbours/grid.wgsl",
            self.levels.file(),
            "neighbours/entries.wgsl",
            "contact/geometry.wgsl",
            self.history.file(),
            self.rotation.file(),
            self.grains.file(),
            self.materials.file(),
            self.growth.file(),
            self.walls.file(),
            "contact/contacts.wgsl",
            "measure/sums.wgsl",
            "measure/body_sums.wgsl",
        ];
        if self.walls == Walls::Some {
            files.push(self.turning.file());
        }
        match self.method {
            Method::DiscreteElements => files.extend([
                "contact/law.wgsl",
                "contact/history/lanes.wgsl",
                self.normal.file(),
                self.damping.file(),
                self.tangential.file(),
                self.rolling.file(),
                self.twist.file(),
                self.cohesion.file(),
                "dem/leapfrog.wgsl",
            ]),
            Method::ContactDynamics => files.extend([
                if self.large_grains { "neighbours/lists/shared.wgsl" } else { "neighbours/lists/alone.wgsl" },
                "solve/natural_map.wgsl",
                "solve/momentum.wgsl",
                "solve/sums.wgsl",
                "nscd/contact.wgsl",
                self.compliance.file(),
            ]),
        }
        if self.walls == Walls::Some {
            files.push("measure/wall_sums.wgsl");
        }
        if self.method == Method::DiscreteElements && self.tangential != Tangential::None {
            files.push("contact/tangential/spring.wgsl");
        }
        files.extend(match (self.method, self.grains) {
            (Method::DiscreteElements, Grains::Spheres) => &["measure/energies/spheres.wgsl"][..],
            (Method::DiscreteElements, Grains::Clumps) => {
                &["dem/predictor_corrector.wgsl", "measure/energies/clumps.wgsl"]
            }
            (Method::ContactDynamics, Grains::Spheres) => {
                &["nscd/response/spheres.wgsl", "measure/energies/spheres.wgsl"]
            }
            (Method::ContactDynamics, Grains::Clumps) => &["nscd/response/clumps.wgsl", "measure/energies/clumps.wgsl"],
        });
        if self.method == Method::ContactDynamics && self.grains == Grains::Clumps {
            files.push(self.gyroscopic.file());
        }
        if self.compliance == Compliance::Stiffness {
            files.push(self.damping.file());
        }
        if self.colored {
            files.push("nscd/coloring/priority.wgsl");
        }
        files
    }

    /// Every combination of slots: what the twin tests walk.
    pub fn all(precision: Precision) -> Vec<Model> {
        use Grains::{Clumps, Spheres};
        use Method::{ContactDynamics, DiscreteElements};
        let (dem, cd, free) = (DiscreteElements, ContactDynamics, Rolling::None);
        let twists = |dimension: Dimension, method: Method, tangential: Tangential, rolling: Rolling| {
            let springs = tangential != Tangential::None || rolling != Rolling::None;
            let all = dimension == Dimension::Space && method == DiscreteElements && springs;
            if all { Twist::ALL } else { &[Twist::Ignored] }
        };
        let laws = [
            (dem, Normal::Hooke, Tangential::None, free, Rotation::None, Spheres),
            (dem, Normal::Hooke, Tangential::None, free, Rotation::Sphere, Spheres),
            (dem, Normal::Hooke, Tangential::None, free, Rotation::Sphere, Clumps),
            (dem, Normal::Hooke, Tangential::Coulomb, free, Rotation::Sphere, Spheres),
            (dem, Normal::Hooke, Tangential::Coulomb, free, Rotation::Sphere, Clumps),
            (dem, Normal::Hertz, Tangential::None, free, Rotation::None, Spheres),
            (dem, Normal::Hertz, Tangential::Mindlin, free, Rotation::Sphere, Spheres),
            (dem, Normal::Hertz, Tangential::Mindlin, free, Rotation::Sphere, Clumps),
            (dem, Normal::Hooke, Tangential::Coulomb, Rolling::ElasticPlastic, Rotation::Sphere, Spheres),
            (dem, Normal::Hooke, Tangential::Coulomb, Rolling::ElasticPlastic, Rotation::Sphere, Clumps),
            (dem, Normal::Hooke, Tangential::None, Rolling::ElasticPlastic, Rotation::Sphere, Spheres),
            (dem, Normal::Hertz, Tangential::Mindlin, Rolling::ElasticPlastic, Rotation::Sphere, Spheres),
            (cd, Normal::Rigid, Tangential::Coulomb, free, Rotation::None, Spheres),
            (cd, Normal::Rigid, Tangential::Coulomb, free, Rotation::Sphere, Spheres),
            (cd, Normal::Rigid, Tangential::Coulomb, free, Rotation::Sphere, Clumps),
        ];
        let mut models = Vec::new();
        for &dimension in Dimension::ALL {
            for &boundary in Boundary::ALL {
                for (method, normal, tangential, rolling, rotation, grains) in laws {
                    if normal == Normal::Hertz && dimension == Dimension::Plane {
                        continue; // disks have no such contact
                    }
                    let rigid = method == ContactDynamics;
                    for &(damping, compliance) in dampings(method) {
                        // Smooth rigid grains are all alike.
                        let alike = rigid && rotation == Rotation::None;
                        for &materials in if alike { &[Materials::One] } else { Materials::ALL } {
                            // The grid, and what moves walls, know nothing of a law.
                            let one_law = damping == Damping::None && materials == Materials::One;
                            let drives = if one_law && !rigid { &[false, true][..] } else { &[false] };
                            let some = Walls::Some;
                            let moving = drives
                                .iter()
                                .flat_map(|driven| [(some, true, false, *driven), (some, true, true, *driven)]);
                            let walls = [(Walls::None, false, false, false), (some, false, false, false)];
                            for (walls, moving_walls, guided_walls, driven_walls) in walls.into_iter().chain(moving) {
                                // What gives way knows nothing of how walls move, nor a dashpot of where grains are.
                                let bare = boundary == Boundary::Open && walls == Walls::None;
                                if compliance != Compliance::None && (moving_walls || damping != Damping::None && !bare)
                                {
                                    continue;
                                }
                                let twists = twists(dimension, method, tangential, rolling);
                                let variants = variants(method, grains);
                                let sizes = if one_law { SIZES } else { &SIZES[..1] };
                                // Nor how walls move, or how many levels there are, of radii that change.
                                let still = walls == Walls::Some && !moving_walls;
                                let grow = still && !rigid && grains == Spheres;
                                let growths = if grow { Growth::ALL } else { &[Growth::None] };
                                let both = twists
                                    .iter()
                                    .flat_map(|twist| variants.iter().map(move |variant| (*twist, *variant)))
                                    .flat_map(|(twist, variant)| {
                                        sizes.iter().map(move |sizes| (twist, variant, *sizes))
                                    })
                                    .flat_map(|all| growths.iter().map(move |growth| (all, *growth)))
                                    .filter(|((twist, _, (levels, large)), growth)| {
                                        let plain = *twist == Twist::Ignored && (*levels == Levels::Several) == *large;
                                        plain || *growth == Growth::None
                                    });
                                for ((twist, (colored, gyroscopic), (levels, large_grains)), growth) in both {
                                    models.push(Model {
                                        precision,
                                        dimension,
                                        boundary,
                                        method,
                                        normal,
                                        damping,
                                        tangential,
                                        rolling,
                                        twist,
                                        cohesion: Cohesion::None,
                                        growth,
                                        history: if rigid || tangential != Tangential::None || rolling != free {
                                            History::Kept
                                        } else {
                                            History::None
                                        },
                                        rotation,
                                        grains,
                                        gyroscopic,
                                        compliance,
                                        materials,
                                        walls,
                                        turning: if moving_walls && boundary == Boundary::Open {
                                            Turning::Some
                                        } else {
                                            Turning::None
                                        },
                                        levels,
                                        large_grains,
                                        moving_walls,
                                        guided_walls,
                                        driven_walls,
                                        servo: boundary == Boundary::Deforming && walls == Walls::None && !rigid,
                                        // As works of it are not added up, where nothing else is looked at between steps.
                                        adaptive_damping: adapts(boundary, walls, method, grains),
                                        works: !rigid && !adapts(boundary, walls, method, grains),
                                        colored,
                                        solved_on_host: false,
                                    });
                                }
                            }
                        }
                    }
                }
            }
        }
        models
    }
}

/// Dashpots, and whether contacts of contact dynamics give way: rigid ones have none.
fn dampings(method: Method) -> &'static [(Damping, Compliance)] {
    use Compliance::Stiffness;
    const RIGID: Compliance = Compliance::None;
    match method {
        Method::DiscreteElements => {
            &[(Damping::None, RIGID), (Damping::Restitution, RIGID), (Damping::MassScaled, RIGID)]
        }
        Method::ContactDynamics => &[
            (Damping::None, RIGID),
            (Damping::None, Stiffness),
            (Damping::Restitution, Stiffness),
            (Damping::MassScaled, Stiffness),
        ],
    }
}

/// Whether damping is adaptive.
fn adapts(boundary: Boundary, walls: Walls, method: Method, grains: Grains) -> bool {
    boundary == Boundary::Periodic
        && walls == Walls::None
        && method == Method::DiscreteElements
        && grains == Grains::Spheres
}

/// Levels of the grid, and whether some grains are large.
const SIZES: &[(Levels, bool)] = &[(Levels::One, false), (Levels::Several, false), (Levels::Several, true)];

/// Colors or not, and what becomes of the products of angular velocities.
fn variants(method: Method, grains: Grains) -> &'static [(bool, Gyroscopic)] {
    use Gyroscopic::{Dropped, Kept};
    match (method, grains) {
        (Method::DiscreteElements, Grains::Spheres) => &[(false, Dropped)],
        (Method::DiscreteElements, Grains::Clumps) => &[(false, Kept)],
        (Method::ContactDynamics, Grains::Spheres) => &[(false, Dropped), (true, Dropped)],
        (Method::ContactDynamics, Grains::Clumps) => &[(false, Dropped), (false, Kept), (true, Dropped), (true, Kept)],
    }
}
