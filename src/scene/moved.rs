//! Where walls are at a time.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::motion::{Motion, Turning};
use super::{Surface, Wall};

/// A wall that has moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    pub surface: Surface,
    /// Of all of it, m/s.
    velocity: DVec3,
    /// And about a point, rad/s and m.
    turning: DVec3,
    center: DVec3,
    /// With that of a cylinder about its own axis, rad/s.
    pub spin: DVec3,
}

impl Moved {
    /// The velocity of its point that is here, but for what a cylinder's own spin adds, m/s.
    pub fn velocity_at(&self, point: DVec3) -> DVec3 {
        self.velocity + self.turning.cross(point - self.center)
    }
}

impl Wall {
    /// Whether it moves otherwise than with a velocity and a spin that never change.
    pub fn is_guided(&self) -> bool {
        self.motion != Motion::default()
    }

    /// Whether points of its surface may move unlike each other: it turns at any time, spins about its own axis, or changes
    /// its radius.
    pub fn turns(&self) -> bool {
        let grows = self.servo.is_some() && matches!(self.surface, Surface::Cylinder { .. });
        self.spin != 0.0 || self.motion.turning.is_some() || grows
    }

    /// Whether it does not stay where it is.
    pub fn moves(&self) -> bool {
        self.velocity != DVec3::ZERO || self.is_guided() || self.servo.is_some()
    }

    /// Where it is at a time, and how it has moved, on the mean, in the time `dt` before, s.
    pub fn at(&self, time: f64, dt: f64) -> Moved {
        let (before, now) = (self.motion.lasted(time - dt), self.motion.lasted(time));
        let deviation = self.motion.deviation(now);
        let displacement = now * self.velocity + deviation;
        let part = (now - before) / dt;
        let turning = self.motion.turning.unwrap_or(Turning { point: DVec3::ZERO, axis: DVec3::Z, rate: 0.0 });
        let turn = DQuat::from_axis_angle(turning.axis, (turning.rate * now) % TAU);
        let place = |x: DVec3| match self.motion.turning {
            Some(Turning { point, .. }) => point + turn * (x - point) + displacement,
            None => x + displacement,
        };
        let turned = |normal: DVec3| if turning.rate == 0.0 { normal } else { (turn * normal).normalize() };
        Moved {
            surface: match self.surface {
                Surface::Plane { point, normal } => Surface::Plane { point: place(point), normal: turned(normal) },
                Surface::Cylinder { center, radius } => Surface::Cylinder { center: place(center), radius },
            },
            velocity: part * self.velocity + (deviation - self.motion.deviation(before)) / dt,
            turning: part * turning.rate * turning.axis,
            center: turning.point + displacement,
            spin: part * (turning.rate * turning.axis + self.spin * DVec3::Z),
        }
    }

    /// The speed that it has nowhere where grains are, which are up to `extent` away from the origin, m/s; but for a
    /// cylinder's own spin.
    pub fn top_speed(&self, extent: f64) -> f64 {
        let turning = self.motion.turning.map_or(0.0, |turning| turning.rate.abs() * (extent + turning.distance()));
        self.velocity.length() + self.motion.top_speed() + turning + self.servo_speed()
    }

    /// The most that its servo moves it with, m/s.
    fn servo_speed(&self) -> f64 {
        self.servo.map_or(0.0, |servo| servo.max_speed)
    }

    /// The same of the speed with which it comes nearer: what turns about its own normal or axis does not.
    pub fn approach_speed(&self, extent: f64) -> f64 {
        let turning = self.motion.turning.map_or(0.0, |turning| {
            let arm = match self.surface {
                Surface::Plane { normal, .. } => turning.axis.cross(normal).length() * (extent + turning.distance()),
                Surface::Cylinder { center, .. } => (center - turning.point).truncate().length(),
            };
            turning.rate.abs() * arm
        });
        self.velocity.length() + self.motion.top_speed() + turning + self.servo_speed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Oscillation;

    fn wall(velocity: DVec3, motion: Motion) -> Wall {
        let surface = Surface::Plane { point: DVec3::X, normal: DVec3::X };
        Wall { name: "wall".to_owned(), surface, velocity, spin: 0.0, motion, servo: None, material: 0 }
    }

    fn plane(wall: &Wall, time: f64) -> (DVec3, DVec3) {
        match wall.at(time, 1e-3).surface {
            Surface::Plane { point, normal } => (point, normal),
            Surface::Cylinder { .. } => unreachable!("it is a plane"),
        }
    }

    #[test]
    fn motions_are_functions_of_time() {
        let close = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-12, "{a} {b}");
        let late = wall(DVec3::Y, Motion { start: 1.0, stop: 3.0, ..Motion::default() });
        for (time, way) in [(0.5, 0.0), (1.0, 0.0), (2.5, 1.5), (3.0, 2.0), (9.0, 2.0)] {
            close(plane(&late, time).0, DVec3::new(1.0, way, 0.0));
        }
        assert_eq!((late.at(0.9, 0.1).velocity, late.at(9.0, 0.1).velocity), (DVec3::ZERO, DVec3::ZERO));
        let taps = Oscillation { amplitude: DVec3::Z, frequency: 4.0, interval: Some(1.0) };
        let taps = wall(DVec3::ZERO, Motion { oscillation: Some(taps), ..Motion::default() });
        for (time, height) in [(0.0625, 1.0), (0.1875, -1.0), (0.25, 0.0), (0.9, 0.0), (1e6 + 0.0625, 1.0)] {
            close(plane(&taps, time).0, DVec3::new(1.0, 0.0, height));
        }
        let table = vec![(1.0, DVec3::ZERO), (2.0, DVec3::Z), (4.0, -DVec3::Z)];
        let guided = wall(DVec3::ZERO, Motion { table, ..Motion::default() });
        for (time, height) in [(0.5, 0.0), (1.5, 0.5), (2.0, 1.0), (3.5, -0.5), (7.0, -1.0)] {
            close(plane(&guided, time).0, DVec3::new(1.0, 0.0, height));
        }
        let turning = Some(Turning { point: DVec3::ZERO, axis: DVec3::Z, rate: TAU / 4.0 });
        let mut turned = wall(DVec3::ZERO, Motion { turning, ..Motion::default() });
        close(plane(&turned, 1.0).0, DVec3::Y);
        close(plane(&turned, 1.0).1, DVec3::Y);
        // Away from the axis it moves as a body does.
        turned.motion.turning = Some(Turning { point: DVec3::new(0.5, 0.0, 0.0), axis: DVec3::Z, rate: 2.0 });
        let there = DVec3::new(0.2, 0.7, 0.0);
        let now = turned.at(0.3, 1e-3).velocity_at(there);
        close(now, 2.0 * DVec3::Z.cross(there - DVec3::new(0.5, 0.0, 0.0)));
        // Its axis is half a metre from the origin, and across its normal.
        assert_eq!((turned.top_speed(3.0), turned.approach_speed(3.0), guided.top_speed(0.0)), (7.0, 7.0, 1.0));
        turned.motion.turning = Some(Turning { point: DVec3::ZERO, axis: DVec3::X, rate: 2.0 });
        assert_eq!((turned.top_speed(3.0), turned.approach_speed(3.0)), (6.0, 0.0));
    }
}
