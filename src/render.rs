//! Off-screen pictures of packings: spheres in a lit scene in three dimensions, flat disks in two.
//!
//! The picture is rendered with twice the samples in each direction and averaged, in tiles where it is larger than a
//! texture may be. Nothing in it is random: the same [`Picture`] on the same device gives the same bytes.

use glam::DVec3;
use std::path::Path;

use crate::{Error, Result};

mod camera;
mod color;
mod cull;
mod neighbours;
mod passes;
mod picture;
mod stage;

pub use camera::View;
pub use color::{ColorBy, colors, colors_between, ramp, range};
pub use picture::{Picture, Rod, SHADER};

/// Draws a picture and waits for it: `width * height` pixels of 4 bytes, sRGB with alpha 255, top row first.
pub fn draw(device: &wgpu::Device, queue: &wgpu::Queue, picture: &Picture) -> Result<Vec<u8>> {
    picture.check()?;
    let stage = stage::Stage::new(picture);
    passes::draw(device, queue, &stage, picture.width, picture.height)
}

/// Two corners of the box that the grains of a picture, and the walls near them, take up, m. None without grains.
pub fn extent(picture: &Picture) -> Option<[DVec3; 2]> {
    stage::Stage::new(&Picture { extent: None, ..picture.clone() }).extent()
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
