//! Model: the choices a scene implies, one enum per slot. It alone decides which WGSL files are composed and which
//! arrays exist; nothing the scene does not need is modelled, allocated or computed.

use crate::{
    cd::Solver,
    scene::{Assembly, Dashpot as DashpotLaw, Method as Solve},
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
    /// Width of `Real` on the device; single precision owns the residues of the positions. The CPU engine computes in f64 whatever stands here.
    Precision in "precision" { Single = "single", Double = "double" }
);
impl Precision {
    /// The file that says what `Real` is, relative to `shaders/`: all that kernels which know no positions need.
    pub fn scalar_file(self) -> &'static str {
        match self {
            Precision::Single => "scalar/single.wgsl",
            Precision::Double => "scalar/double.wgsl",
        }
    }
}

slot!(
    /// Disks in a plane or spheres in space.
    Dimension in "dimension" { Plane = "plane", Space = "space" }
);
slot!(
    /// Whether any axis is periodic.
    Boundary in "boundary" { Open = "open", Periodic = "periodic" }
);
slot!(
    /// How contacts act, and with them a step.
    Method in "method" { DiscreteElements = "dem", ContactDynamics = "cd" }
);
slot!(
    /// Normal contact law.
    Normal in "normal" { Hooke = "hooke", Rigid = "rigid" }
);
slot!(
    /// Normal dashpot.
    Dashpot in "dashpot" { None = "none", Restitution = "restitution", MassScaled = "mass_scaled" }
);
slot!(
    /// Tangential contact law; owns what a contact remembers: its spring, or in contact dynamics its impulse, friction or not.
    Friction in "friction" { None = "none", Coulomb = "coulomb" }
);
slot!(
    /// Spin of the grains; owns spin and torque.
    Rotation in "rotation" { None = "none", Sphere = "sphere" }
);
slot!(
    /// What a grain is: a body, or a rigid clump of bodies; owns the clumps.
    Grains in "grains" { Spheres = "spheres", Clumps = "clumps" }
);
slot!(
    /// Whether products of angular velocities act on clumps, which contact dynamics may leave out; on spheres there are none.
    Gyration in "gyration" { Dropped = "dropped", Kept = "kept" }
);
slot!(
    /// One set of contact parameters, or a table by material.
    Materials in "materials" { One = "one", Many = "many" }
);
slot!(
    /// Walls, or none.
    Walls in "walls" { None = "none", Some = "some" }
);

/// One choice per slot, and which optional stages the plan has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Model {
    pub precision: Precision,
    pub dimension: Dimension,
    pub boundary: Boundary,
    pub method: Method,
    pub normal: Normal,
    pub dashpot: Dashpot,
    pub friction: Friction,
    pub rotation: Rotation,
    pub grains: Grains,
    pub gyration: Gyration,
    pub materials: Materials,
    pub walls: Walls,
    /// Optional stage: a wall translates, so that walls are integrated too.
    pub moving_walls: bool,
    /// Optional stages: contact dynamics updates contacts colour by colour, and not all at once.
    pub coloured: bool,
}

impl Model {
    /// What the scene needs, and no more.
    pub fn of(assembly: &Assembly, precision: Precision) -> Model {
        let pairs = &assembly.pairs;
        let (method, gyroscopic, by_colours) = match assembly.solver.method {
            Solve::DiscreteElements => (Method::DiscreteElements, true, false),
            Solve::ContactDynamics(r) => {
                (Method::ContactDynamics, r.gyroscopic, r.solver == Solver::ColouredAccelerated)
            }
        };
        let rigid = method == Method::ContactDynamics;
        let frictional = pairs.iter().any(|p| p.friction > 0.0);
        let clumped = !assembly.clumps.is_empty();
        let spinning = clumped || assembly.grains.iter().any(|g| g.spin != glam::DVec3::ZERO);
        Model {
            precision,
            dimension: if assembly.dimension == 2 { Dimension::Plane } else { Dimension::Space },
            boundary: if assembly.domain.periodic.contains(&true) { Boundary::Periodic } else { Boundary::Open },
            method,
            normal: if rigid { Normal::Rigid } else { Normal::Hooke },
            dashpot: match pairs.iter().map(|p| p.dashpot).find(|d| *d != DashpotLaw::None) {
                None | Some(DashpotLaw::None) => Dashpot::None,
                Some(DashpotLaw::Restitution(_)) => Dashpot::Restitution,
                Some(DashpotLaw::MassScaled(_)) => Dashpot::MassScaled,
            },
            friction: if frictional || rigid { Friction::Coulomb } else { Friction::None },
            rotation: if frictional || spinning { Rotation::Sphere } else { Rotation::None },
            grains: if clumped { Grains::Clumps } else { Grains::Spheres },
            gyration: if clumped && gyroscopic { Gyration::Kept } else { Gyration::Dropped },
            materials: if pairs.windows(2).all(|w| w[0] == w[1]) { Materials::One } else { Materials::Many },
            walls: if assembly.walls.is_empty() { Walls::None } else { Walls::Some },
            moving_walls: assembly.walls.iter().any(|w| w.velocity != glam::DVec3::ZERO),
            coloured: by_colours,
        }
    }

    /// Spatial dimension, 2 or 3.
    pub fn dims(&self) -> usize {
        match self.dimension {
            Dimension::Plane => 2,
            Dimension::Space => 3,
        }
    }

    /// The slots as (slot, alternative), for people.
    pub fn slots(&self) -> [(&'static str, &'static str); 12] {
        [
            ("precision", self.precision.label()),
            ("dimension", self.dimension.label()),
            ("boundary", self.boundary.label()),
            ("method", self.method.label()),
            ("normal", self.normal.label()),
            ("dashpot", self.dashpot.label()),
            ("friction", self.friction.label()),
            ("rotation", self.rotation.label()),
            ("grains", self.grains.label()),
            ("gyration", self.gyration.label()),
            ("materials", self.materials.label()),
            ("walls", self.walls.label()),
        ]
    }

    /// The WGSL files every kernel of this model is composed with, relative to `shaders/`.
    pub fn files(&self) -> Vec<&'static str> {
        let mut files = vec![
            self.precision.scalar_file(),
            self.precision.file(),
            self.dimension.file(),
            "dispatch.wgsl",
            "params.wgsl",
            "bodies.wgsl",
            "lists.wgsl",
            self.boundary.file(),
            "grid.wgsl",
            "touch.wgsl",
            self.normal.file(),
            self.dashpot.file(),
            self.friction.file(),
            self.rotation.file(),
            self.grains.file(),
            self.materials.file(),
            self.walls.file(),
            "contact.wgsl",
            self.method.file(),
        ];
        files.extend(match (self.method, self.grains) {
            (Method::DiscreteElements, Grains::Spheres) => &["leapfrog.wgsl"][..],
            (Method::DiscreteElements, Grains::Clumps) => &["leapfrog.wgsl", "predictor_corrector.wgsl"],
            (Method::ContactDynamics, Grains::Spheres) => &["answer/spheres.wgsl"],
            (Method::ContactDynamics, Grains::Clumps) => &["answer/clumps.wgsl"],
        });
        if self.method == Method::ContactDynamics && self.grains == Grains::Clumps {
            files.push(self.gyration.file());
        }
        if self.coloured {
            files.push("colours.wgsl");
        }
        files
    }

    /// Every combination of slots: what the twin tests walk.
    pub fn all(precision: Precision) -> Vec<Model> {
        use Grains::{Clumps, Spheres};
        use Method::{ContactDynamics, DiscreteElements};
        let surfaces = [
            (DiscreteElements, Friction::None, Rotation::None, Spheres),
            (DiscreteElements, Friction::None, Rotation::Sphere, Spheres),
            (DiscreteElements, Friction::None, Rotation::Sphere, Clumps),
            (DiscreteElements, Friction::Coulomb, Rotation::Sphere, Spheres),
            (DiscreteElements, Friction::Coulomb, Rotation::Sphere, Clumps),
            (ContactDynamics, Friction::Coulomb, Rotation::None, Spheres),
            (ContactDynamics, Friction::Coulomb, Rotation::Sphere, Spheres),
            (ContactDynamics, Friction::Coulomb, Rotation::Sphere, Clumps),
        ];
        let mut models = Vec::new();
        for &dimension in Dimension::ALL {
            for &boundary in Boundary::ALL {
                for (method, friction, rotation, grains) in surfaces {
                    let rigid = method == ContactDynamics;
                    for &dashpot in if rigid { &[Dashpot::None] } else { Dashpot::ALL } {
                        // Smooth rigid grains are all alike.
                        let alike = rigid && rotation == Rotation::None;
                        for &materials in if alike { &[Materials::One] } else { Materials::ALL } {
                            for (walls, moving_walls) in
                                [(Walls::None, false), (Walls::Some, false), (Walls::Some, true)]
                            {
                                for &(coloured, gyration) in variants(method, grains) {
                                    models.push(Model {
                                        precision,
                                        dimension,
                                        boundary,
                                        method,
                                        normal: if rigid { Normal::Rigid } else { Normal::Hooke },
                                        dashpot,
                                        friction,
                                        rotation,
                                        grains,
                                        gyration,
                                        materials,
                                        walls,
                                        moving_walls,
                                        coloured,
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

/// Colours or not, and what becomes of the products of angular velocities.
fn variants(method: Method, grains: Grains) -> &'static [(bool, Gyration)] {
    use Gyration::{Dropped, Kept};
    match (method, grains) {
        (Method::DiscreteElements, Grains::Spheres) => &[(false, Dropped)],
        (Method::DiscreteElements, Grains::Clumps) => &[(false, Kept)],
        (Method::ContactDynamics, Grains::Spheres) => &[(false, Dropped), (true, Dropped)],
        (Method::ContactDynamics, Grains::Clumps) => &[(false, Dropped), (false, Kept), (true, Dropped), (true, Kept)],
    }
}
