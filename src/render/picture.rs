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
    /// Walls where they are at the time of the picture.
    pub walls: Vec<Wall>,
    /// Walls and floor are drawn no farther than it reaches; periodic axes are framed by thin lines.
    pub domain: Domain,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

impl Picture {
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
        if !matches!(self.dimension, 2 | 3) {
            return Err(Error::Scene(format!("picture: dimension {}; it must be 2 or 3", self.dimension)));
        }
        Ok(())
    }
}
