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
            start: None,
            stop: None,
            oscillation: None,
            turning: None,
            table: None,
            target_force: None,
            target_pressure: None,
            area: None,
            gain: None,
            max_speed: None,
            inertial_number: None,
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

    /// To and fro: amplitude × sin(2π frequency t), m and 1/s; one period in every `interval`, s, if that is given.
    #[must_use]
    pub fn oscillation(mut self, amplitude: impl Into<PerAxis>, frequency: f64, interval: Option<f64>) -> Self {
        self.0.oscillation = Some(schema::Oscillation { amplitude: per_axis(amplitude), frequency, interval });
        self
    }

    /// Turning about an axis through a point, m, with this rate, rad/s; in two dimensions the axis is that out of the plane.
    #[must_use]
    pub fn turning(mut self, point: impl Into<PerAxis>, axis: Option<[f64; 3]>, rate: f64) -> Self {
        self.0.turning = Some(schema::Turning { point: per_axis(point), axis: axis.map(|axis| axis.to_vec()), rate });
        self
    }

    /// A CSV file with the columns time, s, and x, y, z: how far it is from where it began, m.
    #[must_use]
    pub fn table(mut self, file: &str) -> Self {
        self.0.table = Some(file.to_owned());
        self
    }

    setters! {
        /// Rotation of a cylinder about its axis, rad/s. Default: 0.
        spin: f64;
        /// When all of its motion begins, s. Default: 0.
        start: f64;
        /// When it ends, s. Default: never.
        stop: f64;
        /// Force of the grains on a plane along its normal, N, to which a servo brings it.
        target_force: f64;
        /// The same over the area, Pa (in two dimensions N/m); of a cylinder, whose radius the servo changes.
        target_pressure: f64;
        /// That the pressure acts on, m² (m). Default: what other walls and periodic faces leave of the wall.
        area: f64;
        /// Part of a missing force that the servo adds in a step, in (0, 1]. Default: 1e-2.
        gain: f64;
        /// Most of the speed of the servo, m/s.
        max_speed: f64;
        /// Instead: the inertial number of the bed up to which the servo goes.
        inertial_number: f64;
    }
}
