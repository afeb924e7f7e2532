//! Shapes of clumps, and how clumps are turned.

use glam::DQuat;

use super::keys::{PerAxis, per_axis};
use crate::scene::{Kind, schema, setters::setters};

/// A shape that clumps can have: a rigid set of spheres (disks), in any unit.
#[derive(Clone, Debug)]
pub struct ShapeBuilder(pub(super) schema::Shape);

impl ShapeBuilder {
    fn empty(name: &str) -> schema::Shape {
        schema::Shape {
            name: name.to_owned(),
            members: None,
            file: None,
            kind: None,
            mesh: None,
            spheres: None,
            distance: None,
            count: None,
            seed: None,
            volume: None,
            center: None,
            inertia: None,
        }
    }

    /// The spheres (disks) themselves: centre and radius.
    pub fn of_members<C: Into<PerAxis>>(name: &str, members: impl IntoIterator<Item = (C, f64)>) -> ShapeBuilder {
        let member = |(center, radius): (C, f64)| schema::Member { center: per_axis(center), radius };
        let members = Some(members.into_iter().map(member).collect());
        ShapeBuilder(schema::Shape { members, ..ShapeBuilder::empty(name) })
    }

    /// The spheres (disks) of a CSV table with the columns x, y, z (not in two dimensions) and radius.
    pub fn of_file(name: &str, path: &str) -> ShapeBuilder {
        ShapeBuilder(schema::Shape { file: Some(path.to_owned()), ..ShapeBuilder::empty(name) })
    }

    /// By a rule of the library. Scenes have all of them under their own names already, with the defaults.
    pub fn of_kind(name: &str, kind: Kind) -> ShapeBuilder {
        ShapeBuilder(schema::Shape { kind: Some(kind.label().to_owned()), ..ShapeBuilder::empty(name) })
    }

    /// A closed surface of triangles in an STL file, filled by spheres (three dimensions).
    pub fn of_mesh(name: &str, path: &str) -> ShapeBuilder {
        ShapeBuilder(schema::Shape { mesh: Some(path.to_owned()), ..ShapeBuilder::empty(name) })
    }

    /// Mass properties at density 1: volume, centre of mass, and the inertia about it as `[Jxx, Jyy, Jzz, Jxy, Jxz,
    /// Jyz]`, in two dimensions `[Jzz]`. Default: computed.
    #[must_use]
    pub fn mass_properties<const N: usize>(
        mut self,
        volume: f64,
        center: impl Into<PerAxis>,
        inertia: [f64; N],
    ) -> Self {
        (self.0.volume, self.0.center, self.0.inertia) = (Some(volume), Some(per_axis(center)), Some(inertia.to_vec()));
        self
    }

    setters! {
        /// Of a rule: between the centres of neighbouring members, in their radii, from 0.001 to 2. Default: 1.
        distance: f64;
        /// Members of a rod or of a random shape. Default: 3; 5.
        count: usize;
        /// Of a random shape. Default: 1.
        seed: u64;
        /// Spheres that fill a mesh, at most. Default: 30.
        spheres: usize;
    }
}

/// How a clump is turned: from the axes of its shape to those of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Orientation {
    /// Counterclockwise, rad; two dimensions.
    Angle(f64),
    /// Of any length but 0; three dimensions.
    Quaternion(DQuat),
    /// About z by ψ, then about x by θ, then about z by φ, all axes those of the scene, rad; three dimensions.
    Euler { phi: f64, theta: f64, psi: f64 },
    /// All orientations alike; populations only.
    Random,
}

impl Orientation {
    pub(super) fn key(self) -> schema::Orientation {
        match self {
            Orientation::Angle(angle) => schema::Orientation::Plane(angle),
            Orientation::Quaternion(DQuat { x, y, z, w }) => {
                schema::Orientation::Space(schema::Rotation::Quaternion([w, x, y, z]))
            }
            Orientation::Euler { phi, theta, psi } => {
                schema::Orientation::Space(schema::Rotation::Euler([phi, theta, psi]))
            }
            Orientation::Random => schema::Orientation::Word("random".to_owned()),
        }
    }
}
