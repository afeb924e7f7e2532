//! Walls.

use super::keys::{PerAxis, per_axis};
use crate::scene::{schema, setters::setters};

/// A face of a box of walls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The face at the lower x.
    XLower,
    /// The face at the upper x.
    XUpper,
    /// The face at the lower y.
    YLower,
    /// The face at the upper y.
    YUpper,
    /// The face at the lower z.
    ZLower,
    /// The face at the upper z.
    ZUpper,
}

impl Side {
    /// The word for it in scene files and in the names of walls.
    pub fn label(self) -> &'static str {
        match self {
            Side::XLower => "x-",
            Side::XUpper => "x+",
            Side::YLower => "y-",
            Side::YUpper => "y+",
            Side::ZLower => "z-",
            Side::ZUpper => "z+",
        }
    }
}

/// A wall.
#[derive(Clone, Debug)]
pub struct WallBuilder(pub(super) schema::Wall);

impl WallBuilder {
    fn empty(kind: schema::WallKind, material: &str) -> schema::Wall {
        schema::Wall {
            kind,
            name: None,
            material: material.to_owned(),
            velocity: None,
            point: None,
            normal: None,
            lower: None,
            upper: None,
            faces: None,
            center: None,
            radius: None,
            spin: None,
        }
    }

    /// A half-space: any point of the plane, m, and a normal of any length but 0 that points to the side where the
    /// grains are.
    pub fn plane(material: &str, point: impl Into<PerAxis>, normal: impl Into<PerAxis>) -> WallBuilder {
        WallBuilder(schema::Wall {
            point: Some(per_axis(point)),
            normal: Some(per_axis(normal)),
            ..WallBuilder::empty(schema::WallKind::Plane, material)
        })
    }

    /// A box between two corners, m, with the grains inside. It is split into planes named after it, `box 0 z-` for
    /// example.
    pub fn box_between(material: &str, lower: impl Into<PerAxis>, upper: impl Into<PerAxis>) -> WallBuilder {
        WallBuilder(schema::Wall {
            lower: Some(per_axis(lower)),
            upper: Some(per_axis(upper)),
            ..WallBuilder::empty(schema::WallKind::Box, material)
        })
    }

    /// A cylinder along z with the grains inside, in two dimensions a circle: x and y of the axis, and the radius, m.
    pub fn cylinder(material: &str, center: [f64; 2], radius: f64) -> WallBuilder {
        WallBuilder(schema::Wall {
            center: Some(center.to_vec()),
            radius: Some(radius),
            ..WallBuilder::empty(schema::WallKind::Cylinder, material)
        })
    }

    /// Name in messages and results. Default: kind and number, such as `plane 0`.
    #[must_use]
    pub fn name(mut self, name: &str) -> Self {
        self.0.name = Some(name.to_owned());
        self
    }

    /// Constant translation, m/s. Default: 0.
    #[must_use]
    pub fn velocity(mut self, velocity: impl Into<PerAxis>) -> Self {
        self.0.velocity = Some(per_axis(velocity));
        self
    }

    /// The faces that a box has. Default: all of the dimension.
    #[must_use]
    pub fn faces(mut self, faces: impl IntoIterator<Item = Side>) -> Self {
        self.0.faces = Some(faces.into_iter().map(|side| side.label().to_owned()).collect());
        self
    }

    setters! {
        /// Rotation of a cylinder about its axis, rad/s. Default: 0.
        spin: f64;
    }
}
