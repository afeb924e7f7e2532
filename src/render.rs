//! Off-screen pictures of packings: spheres in a lit scene in three dimensions, flat disks in two.
//!
//! The picture is rendered with twice the samples in each direction and averaged, in tiles where it is larger than a
//! texture may be. Nothing in it is random: the same [`Picture`] on the same device gives the same bytes.

use std::path::Path;

use glam::DVec3;

use crate::scene::{Domain, Wall};
use crate::{Error, Result};

mod camera;
mod color;
mod cull;
mod neighbours;
mod passes;
mod stage;

pub use camera::View;
pub use color::{ColorBy, colors};

/// The shader of every pass.
pub const SHADER: &str = include_str!("../shaders/render.wgsl");

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

/// Draws a picture and waits for it: `width * height` pixels of 4 bytes, sRGB with alpha 255, top row first.
pub fn draw(device: &wgpu::Device, queue: &wgpu::Queue, picture: &Picture) -> Result<Vec<u8>> {
    check(picture)?;
    let stage = stage::Stage::new(picture);
    passes::draw(device, queue, &stage, picture.width, picture.height)
}

fn check(picture: &Picture) -> Result<()> {
    let (count, radii, colors) = (picture.centers.len(), picture.radii.len(), picture.colors.len());
    if radii != count || colors != count {
        return Err(Error::Scene(format!(
            "picture: {count} centers, {radii} radii and {colors} colors; there must be one of each per grain"
        )));
    }
    let (width, height) = (picture.width, picture.height);
    if width == 0 || height == 0 || width > 32768 || height > 32768 {
        return Err(Error::Scene(format!("picture: {width} x {height} pixels; each must be from 1 to 32768")));
    }
    if !matches!(picture.dimension, 2 | 3) {
        return Err(Error::Scene(format!("picture: dimension {}; it must be 2 or 3", picture.dimension)));
    }
    Ok(())
}

/// Writes pixels as [`draw`] returns them to a PNG file.
pub fn write_png(path: &Path, width: u32, height: u32, rgba: &[u8]) -> Result<()> {
    encode_png(path, width, height, rgba).map_err(|error| Error::Io {
        path: path.to_path_buf(),
        source: match error {
            png::EncodingError::IoError(source) => source,
            other => std::io::Error::other(other),
        },
    })
}

fn encode_png(path: &Path, width: u32, height: u32, rgba: &[u8]) -> std::result::Result<(), png::EncodingError> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgba)?;
    writer.finish()
}
