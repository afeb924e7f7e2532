//! How grains are drawn: options of the command line, and what a view comes down to with them.

use super::{
    bar::{self, Bar},
    color::Color,
    view::View,
};
use anyhow::bail;
use glam::DVec3;
use packstone::{
    gpu::Device,
    io,
    render::{self, ColorBy, Picture, Rod, colors_between, range, write_png},
};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Options of whatever draws grains.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize)]
pub struct Look {
    /// What the colours show [default: radius]; force, stress and coordination take what contacts remember
    #[arg(long, value_enum)]
    pub color: Option<Color>,
    /// What the two ends of the map of colours stand for [default: what there is]
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    color_range: Option<Vec<f64>>,
    /// Draw contacts as rods, as thick as their normal force is large, in place of the grains; with --color besides these,
    /// on disks and between smaller spheres
    #[arg(long)]
    pub chains: bool,
    /// Where the eye is, seen from the middle: degrees around the upright axis and above the horizon. Disks are seen
    /// straight on
    #[arg(long, value_name = "AROUND,ABOVE", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    camera: Option<Vec<f32>>,
    /// Which way is up, a vector [default: against gravity, or z, of disks y]
    #[arg(long, value_name = "X,Y[,Z]", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    up: Option<Vec<f64>>,
    /// Draw no bar that tells what the colours stand for
    #[arg(long)]
    no_bar: bool,
    /// Pixels [default: 1280]
    #[arg(long)]
    width: Option<u32>,
    /// Pixels [default: 3/4 of the width; for disks what their extent asks for]
    #[arg(long)]
    height: Option<u32>,
}

/// What pictures of a series have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scales {
    /// What the ends of the map of colours stand for; None where every value has a colour of its own.
    colors: Option<[f64; 2]>,
    /// Normal force of the thickest rod, N, and its radius, m.
    force: f64,
    thickest: f64,
    /// The box that is shown, m.
    extent: Option<[DVec3; 2]>,
}

impl Scales {
    /// Of two pictures together.
    pub fn with(self, other: Scales) -> Scales {
        let wider = |of: fn(&Scales) -> Option<[f64; 2]>| match (of(&self), of(&other)) {
            (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
            (a, b) => a.or(b),
        };
        Scales {
            colors: wider(|scales| scales.colors),
            force: self.force.max(other.force),
            thickest: self.thickest.max(other.thickest),
            extent: match (self.extent, other.extent) {
                (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
                (a, b) => a.or(b),
            },
        }
    }
}

/// Of the largest normal force: contacts with less are not drawn as rods.
const THIN: f64 = 0.02;
/// Radius of the thickest rod over that of the mean grain: in place of spheres, and between them.
const THICKEST: f64 = 0.45;
const THICKEST_BETWEEN: f64 = 0.2;
/// Of spheres with rods between them, over their own radius.
const SHRUNK: f64 = 0.5;
/// Of rods beside grains, whose colours show something else.
const DARK: [f32; 3] = [0.13, 0.12, 0.14];
/// Pixels, if nothing else is asked for.
const WIDTH: u32 = 1280;

impl Look {
    pub fn color(&self) -> Color {
        self.color.unwrap_or(Color::Radius)
    }

    /// Whether it takes contacts.
    pub fn has_contacts(&self) -> bool {
        self.chains || self.color().has_contacts()
    }

    fn draws_grains(&self) -> bool {
        !self.chains || self.color.is_some()
    }

    /// # Errors
    /// For options that make no sense in any scene.
    pub fn check(&self) -> anyhow::Result<()> {
        self.eye()?;
        self.up(DVec3::ZERO, 3)?;
        match self.color_range.as_deref() {
            None => Ok(()),
            Some(_) if !self.draws_grains() => bail!("--color-range: is of the colours of grains; give --color, too"),
            Some(_) if self.color().by() == ColorBy::Id => {
                bail!("--color-range: there is no range of colours where each has one of its own")
            }
            Some([low, high]) if low < high && low.is_finite() && high.is_finite() => Ok(()),
            Some(_) => bail!("--color-range: must be two numbers, the second above the first"),
        }
    }

    fn eye(&self) -> anyhow::Result<(f32, f32)> {
        match self.camera.as_deref() {
            None => Ok(Picture::EYE),
            Some(&[around, above]) if around.is_finite() && (-90.0..=90.0).contains(&above) => Ok((around, above)),
            Some(_) => bail!("--camera: must be two numbers of degrees, the second from -90 to 90"),
        }
    }

    fn up(&self, gravity: DVec3, dimension: usize) -> anyhow::Result<DVec3> {
        match self.up.as_deref() {
            None if gravity != DVec3::ZERO => Ok(-gravity),
            None => Ok(DVec3::AXES[dimension - 1]),
            Some(numbers @ ([_, _] | [_, _, _])) => {
                Ok(DVec3::new(numbers[0], numbers[1], numbers.get(2).copied().unwrap_or(0.0)))
            }
            Some(_) => bail!("--up: must be two or three numbers"),
        }
    }

    /// What a view asks for; for pictures of a series, which fit each other, the box that is shown included.
    pub fn scales(&self, view: &View, of_series: bool) -> anyhow::Result<Scales> {
        let View { radii, values, rods, surroundings, .. } = view;
        let mean = if radii.is_empty() { 0.0 } else { radii.iter().sum::<f64>() / radii.len() as f64 };
        let (color, by) = (self.color(), self.color().by());
        // Slower than that, grains take a thousand times as long for their diameter as they would fall: no flow.
        let slow = 1e-3 * (surroundings.gravity().length() * 2.0 * mean).sqrt();
        let colors = range(by, values, if color == Color::Speed { slow } else { f64::NEG_INFINITY });
        let asked = self.color_range.as_deref().map(|range| [range[0], range[1]]);
        let between = self.draws_grains() && surroundings.dimension == 3;
        let extent = if of_series { render::extent(&self.picture(view)?) } else { None };
        Ok(Scales {
            colors: colors.map(|colors| asked.unwrap_or(colors)),
            force: rods.iter().map(|(_, force)| *force).filter(|force| force.is_finite()).fold(0.0, f64::max),
            thickest: mean * if between { THICKEST_BETWEEN } else { THICKEST },
            extent,
        })
    }

    /// All grains, without colours and rods.
    fn picture(&self, view: &View) -> anyhow::Result<Picture> {
        let View { centers, radii, surroundings, .. } = view;
        let dimension = surroundings.dimension;
        Ok(Picture {
            dimension,
            centers: centers.clone(),
            radii: radii.clone(),
            colors: vec![DARK; centers.len()],
            rods: Vec::new(),
            eye: self.eye()?,
            up: self.up(surroundings.gravity(), dimension)?,
            walls: surroundings.walls(),
            domain: surroundings.domain(),
            extent: None,
            width: self.width.unwrap_or(WIDTH),
            height: 0,
        })
    }

    /// Draw a view to a PNG file.
    pub fn draw(&self, device: &Device, view: &View, scales: &Scales, path: &Path) -> anyhow::Result<()> {
        let View { values, rods, .. } = view;
        let mut picture = self.picture(view)?;
        let dimension = picture.dimension;
        picture.extent = scales.extent;
        let shown = scales.extent.or_else(|| box_of(&picture));
        picture.height = self.height.unwrap_or_else(|| {
            // Encoders of films want even numbers.
            (f64::from(picture.width) * shown.map_or(0.75, |shown| aspect(shown, dimension))) as u32 & !1
        });
        let by = self.color().by();
        let drawn = rods.iter().filter(|(_, force)| self.chains && *force > THIN * scales.force);
        let radius = |force: f64| scales.thickest * force / scales.force;
        let mut bars = Vec::new();
        if self.draws_grains() {
            picture.colors = colors_between(by, values, scales.colors);
            picture.rods = drawn.map(|&(ends, force)| Rod { ends, radius: radius(force), color: DARK }).collect();
            bars.extend(scales.colors.map(|range| Bar::Colors { title: self.color().title(), range }));
            if self.chains {
                bars.push(Bar::Rods { title: "normal force (N)", most: scales.force });
            }
            if self.chains && dimension == 3 {
                picture.radii.iter_mut().for_each(|radius| *radius *= SHRUNK);
            }
        } else {
            let drawn: Vec<_> = drawn.collect();
            let forces: Vec<f64> = drawn.iter().map(|(_, force)| *force).collect();
            let range = [0.0, scales.force];
            let colors = colors_between(ColorBy::Size, &forces, Some(range));
            let rod = |(&&(ends, force), color): (&&_, _)| Rod { ends, radius: radius(force), color };
            picture.rods = drawn.iter().zip(colors).map(rod).collect();
            (picture.centers, picture.radii, picture.colors) = (Vec::new(), Vec::new(), Vec::new());
            bars.push(Bar::Colors { title: "normal force (N)", range });
        }
        let mut pixels = render::draw(&device.device, &device.queue, &picture)?;
        if !self.no_bar {
            bar::draw(&mut pixels, (picture.width, picture.height), &bars)?;
        }
        Ok(io::replace(path, |part| write_png(part, picture.width, picture.height, &pixels))?)
    }
}

/// The box that the grains of a picture take up, m.
fn box_of(picture: &Picture) -> Option<[DVec3; 2]> {
    let grains = picture.centers.iter().zip(&picture.radii).filter(|(center, _)| center.is_finite());
    let boxes = grains.map(|(center, radius)| [*center - *radius, *center + *radius]);
    boxes.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

/// Height over width that suits a box.
fn aspect([low, high]: [DVec3; 2], dimension: usize) -> f64 {
    let size = high - low;
    if dimension == 3 { 0.75 } else { (0.1 + size.y / size.x).clamp(0.25, 1.5) }
}
