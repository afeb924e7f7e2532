//! What is to be drawn, and the shader that draws it.

use glam::DVec3;

use crate::scene::{Domain, Wall};
use crate::{Error, Result};

/// The shader of every pass.
pub const SHADER: &str = include_str!("../../shaders/render.wgsl");

/// What is to be drawn. `centers`, `radii` and `colors` have one entry per grain; a grain with a position or radius
/// that is not finite is left out.
#[derive(Clone, Debug)]
pub struct Picture {
    /// 2 (disks, seen straight on) or 3 (spheres, seen from above, in front and to the right).
    pub dimension: usize,
    /// m
    pub centers: Vec<DVec3>,
    /// m
    pub radii: Vec<f64>,
    /// sRGB, 0 to 1.
    pub colors: Vec<[f32; 3]>,
    /// Rods, drawn as rows of balls so close that they look smooth.
    pub rods: Vec<Rod>,
    /// Where the eye is, seen from the middle: degrees around the upright axis and above the horizon. Disks are seen
    /// straight on.
    pub eye: (f32, f32),
    /// Which way is up; of disks one of their plane.
    pub up: DVec3,
    /// Walls where they are at the time of the picture.
    pub walls: Vec<Wall>,
    /// Walls and floor are drawn no farther than it reaches; periodic axes are framed by thin lines.
    pub domain: Domain,
    /// Two corners of the box that is shown, m, which pictures of a series have in common. Without one it is what the
    /// grains, and the walls near them, take up: [`extent`](super::extent).
    pub extent: Option<[DVec3; 2]>,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

/// A rod with round ends.
#[derive(Clone, Copy, Debug)]
pub struct Rod {
    /// m
    pub ends: [DVec3; 2],
    /// m
    pub radius: f64,
    /// sRGB, 0 to 1.
    pub color: [f32; 3],
}

impl Rod {
    /// Of the radius: balls so far apart leave ripples that nobody sees.
    const SPACING: f64 = 0.12;
    /// Of a rod, which is thinner than a pixel or two if more would be needed.
    const MOST_BALLS: f64 = 256.0;

    /// The centres of its balls.
    pub(super) fn balls(&self) -> impl Iterator<Item = DVec3> + use<> {
        let Rod { ends: [from, to], radius, .. } = *self;
        let count = ((to - from).length() / (Rod::SPACING * radius)).ceil();
        let count = count.clamp(1.0, Rod::MOST_BALLS) as usize;
        (0..=count).map(move |k| from + (to - from) * (k as f64 / count as f64))
    }
}

impl Picture {
    /// Where the eye is if nothing else is asked for.
    pub const EYE: (f32, f32) = (-60.0, 24.0);

    /// Whether it can be drawn.
    pub(super) fn check(&self) -> Result<()> {
        let (count, radii, colors) = (self.centers.len(), self.radii.len(), self.colors.len());
        if radii != count || colors != count {
            return Err(Error::Scene(format!(
                "picture: {count} centers, {radii} radii and {colors} colors; there must be one of each per grain"
            )));
        }
        let (width, height) = (self.width, self.height);
        if width == 0 || height == 0 || width > 32768 || height > 32768 {
            return Err(Error::Scene(format!("picture: {width} x {height} pixels; each must be from 1 to 32768")));
        }
        if !(self.up.is_finite() && self.up.length() > 0.0) || self.dimension == 2 && self.up.truncate().length() == 0.0
        {
            return Err(Error::Scene(format!("picture: {} is no way up; it must have a length", self.up)));
        }
        if !matches!(self.dimension, 2 | 3) {
            return Err(Error::Scene(format!("picture: dimension {}; it must be 2 or 3", self.dimension)));
        }
        Ok(())
    }
}
