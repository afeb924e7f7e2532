//! A picture turned into geometry: grains, walls cut to the part worth showing, and their edges, all in units of the
//! scene's size about its centre, so that f32 is enough from here on.

use std::collections::HashSet;

use glam::{DVec2, DVec3, Vec4};

use super::picture::{Picture, Rod};
use crate::scene::{Domain, Surface};

/// A cylinder is drawn with this many flat faces.
const STRIPS: usize = 128;
/// Free space around the grains, as a fraction of their extent.
const PADDING: f64 = 0.12;

/// A flat side of the space where grains may be; grains are where `normal · x >= offset`.
#[derive(Clone, Copy, Debug)]
struct Side {
    normal: DVec3,
    offset: f64,
    /// Axis and radius of the cylinder it approximates.
    round: Option<(DVec2, f64)>,
    /// A face of a periodic domain, of which only the edges are drawn.
    periodic: bool,
}

/// A visible piece of a wall.
#[derive(Clone, Debug)]
pub struct Face {
    /// Unit normal pointing to the grains, and `normal · x` on the face.
    pub plane: Vec4,
    /// Axis x and y, 0, and radius of a cylinder; zero for planes.
    pub round: Vec4,
    /// Convex outline.
    pub outline: Vec<DVec3>,
}

/// A line of a wall; see `thin_line` and `thick_line` in the shader for what the fourth components hold.
pub type Line = [Vec4; 2];

/// What the camera looks at. Lengths are in units of `size`.
#[derive(Clone, Debug, Default)]
pub struct Stage {
    pub dimension: usize,
    /// As in the picture, `up` of unit length.
    pub eye: (f32, f32),
    pub up: DVec3,
    /// Centre and radius.
    pub balls: Vec<Vec4>,
    /// sRGB, 8 bits a channel, red lowest.
    pub colors: Vec<u32>,
    /// Walls, in three dimensions only.
    pub faces: Vec<Face>,
    /// Edges of walls (three dimensions) or the walls themselves (two).
    pub lines: Vec<Line>,
    /// Everything that must be in the picture besides the grains.
    pub outline: Vec<DVec3>,
    /// Corners of the box that is shown; none where it is what all of the above takes up.
    pub corners: Vec<DVec3>,
    /// The middle and half of the size of the scene, m: what its units are.
    origin: DVec3,
    size: f64,
}

impl Stage {
    /// Centres, scales and cuts.
    pub fn new(picture: &Picture) -> Self {
        let drawn: Vec<usize> = (0..picture.centers.len())
            .filter(|&i| picture.centers[i].is_finite() && picture.radii[i].is_finite() && picture.radii[i] > 0.0)
            .collect();
        let up = if picture.dimension == 2 { picture.up.with_z(0.0) } else { picture.up };
        let (eye, up) = (picture.eye, up.normalize());
        let mut stage = Self { dimension: picture.dimension, eye, up, ..Self::default() };
        let tilted = picture.domain.tilt != DVec3::ZERO;
        let place = |x: DVec3| if tilted { picture.domain.in_tilted_cell(x) } else { x };
        let rods = picture.rods.iter().map(|rod| {
            let [from, to] = rod.ends;
            Rod { ends: [place(from), place(from) + (to - from)], ..*rod }
        });
        let rods: Vec<Rod> = rods.collect();
        let balls = drawn.iter().map(|&i| (place(picture.centers[i]), picture.radii[i]));
        let balls: Vec<(DVec3, f64)> = balls.collect();
        let asked = picture.extent.map(|[low, high]| (low, high));
        let Some((low, high)) = asked.or_else(|| bounds(&balls, &rods, picture.dimension)) else { return stage };
        let origin = 0.5 * (low + high);
        let size = (0.5 * (high - low)).max_element();
        let local = |x: DVec3| (x - origin) / size;
        (stage.origin, stage.size) = (origin, size);
        stage.balls =
            balls.iter().map(|&(center, radius)| local(center).as_vec3().extend((radius / size) as f32)).collect();
        stage.colors = drawn.iter().map(|&i| packed(picture.colors[i])).collect();
        for rod in &rods {
            let radius = (rod.radius / size) as f32;
            let before = stage.balls.len();
            stage.balls.extend(rod.balls().map(|x| local(x).as_vec3().extend(radius)));
            stage.colors.resize(stage.colors.len() + stage.balls.len() - before, packed(rod.color) & !RIM);
        }
        let sides = sides(picture, origin, size);
        let (low, high) = (local(low), local(high));
        let frame = match picture.extent {
            Some(_) => {
                let corner = |k: usize| DVec3::from_array([0, 1, 2].map(|axis| [low, high][k >> axis & 1][axis]));
                stage.corners = (0..8).map(corner).collect();
                thickened((low, high), picture.dimension)
            }
            None => frame(low, high, &sides, &picture.domain, picture.dimension, &local),
        };
        stage.add_walls(&sides, frame);
        stage
    }

    /// What must be in the picture: balls, and points as balls of radius 0.
    pub fn shown(&self) -> impl Iterator<Item = Vec4> {
        let (balls, points) = match &self.corners[..] {
            [] => (&self.balls[..], &self.outline),
            _ => (&[][..], &self.corners),
        };
        balls.iter().copied().chain(points.iter().map(|point| point.as_vec3().extend(0.0)))
    }

    /// The box that holds balls and outline, m.
    pub fn extent(&self) -> Option<[DVec3; 2]> {
        let of_balls = self.balls.iter().map(|ball| {
            let (center, radius) = (ball.truncate().as_dvec3(), f64::from(ball.w));
            [center - radius, center + radius]
        });
        // With all their digits, or a box would end before the walls that it ends with.
        let all = of_balls.chain(self.outline.iter().map(|point| [*point; 2]));
        let all = all.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])?.map(|corner| self.origin + self.size * corner);
        Some(if self.dimension == 2 { all.map(|corner| corner.with_z(0.0)) } else { all })
    }

    fn add_walls(&mut self, sides: &[Side], frame: (DVec3, DVec3)) {
        let mut edges = Edges::default();
        for side in sides {
            let outline = piece(side, sides, frame);
            if outline.len() < 3 {
                continue;
            }
            self.outline.extend_from_slice(&outline);
            if self.dimension == 2 {
                self.lines.extend(wall_line(side, &outline, frame));
                continue;
            }
            self.lines.extend(edges.new_ones(side, &outline));
            if !side.periodic {
                let round = side
                    .round
                    .map_or(Vec4::ZERO, |(axis, radius)| Vec4::new(axis.x as f32, axis.y as f32, 0.0, radius as f32));
                self.faces.push(Face { plane: side.normal.as_vec3().extend(side.offset as f32), round, outline });
            }
        }
    }
}

/// Bounding box of the drawn grains, or without any of the rods, m.
fn bounds(balls: &[(DVec3, f64)], rods: &[Rod], dimension: usize) -> Option<(DVec3, DVec3)> {
    let spread = |radius: f64| match dimension {
        2 => DVec3::new(radius, radius, 0.0),
        _ => DVec3::splat(radius),
    };
    let boxes = balls.iter().map(|&(center, radius)| (center - spread(radius), center + spread(radius)));
    let rods = rods.iter().filter(|rod| rod.ends.iter().all(|end| end.is_finite()));
    let ends = rods.flat_map(|rod| rod.ends.map(|end| (end - rod.radius, end + rod.radius)));
    let ends = ends.map(|(low, high)| if dimension == 2 { (low.with_z(0.0), high.with_z(0.0)) } else { (low, high) });
    boxes.chain(ends).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// The part of a packed colour that says that a disk has a rim.
const RIM: u32 = 255 << 24;

fn packed(color: [f32; 3]) -> u32 {
    let [r, g, b] = color.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u32);
    r | g << 8 | b << 16 | RIM
}

/// Walls and periodic faces of the domain as half-spaces, in units of the stage.
fn sides(picture: &Picture, origin: DVec3, size: f64) -> Vec<Side> {
    let plane = |point: DVec3, normal: DVec3, periodic| {
        let offset = normal.dot((point - origin) / size);
        Side { normal, offset, round: None, periodic }
    };
    let mut sides = Vec::new();
    for wall in &picture.walls {
        match wall.surface {
            Surface::Plane { point, normal } => sides.push(plane(point, normal, false)),
            Surface::Cylinder { center, radius } => {
                sides.extend(strips((center - origin).truncate() / size, radius / size));
            }
        }
    }
    let domain = &picture.domain;
    let edge = |axis: usize| if domain.periodic[axis] { domain.edge(axis) } else { DVec3::AXES[axis] };
    for axis in (0..picture.dimension).filter(|axis| domain.periodic[*axis]) {
        let normal = edge((axis + 1) % 3).cross(edge((axis + 2) % 3)).normalize();
        sides.push(plane(domain.corner(), normal, true));
        sides.push(plane(domain.corner() + edge(axis), -normal, true));
    }
    sides
}

/// Tangent planes around a vertical cylinder.
fn strips(axis: DVec2, radius: f64) -> impl Iterator<Item = Side> {
    (0..STRIPS).map(move |k| {
        let angle = std::f64::consts::TAU * k as f64 / STRIPS as f64;
        let normal = -DVec2::from_angle(angle);
        let offset = normal.dot(axis) - radius;
        Side { normal: normal.extend(0.0), offset, round: Some((axis, radius)), periodic: false }
    })
}

/// The box to which walls are cut: grains with some padding, stretched to the walls and the domain where these are
/// not so far that the grains would look lost, and never beyond the domain.
fn frame(
    low: DVec3,
    high: DVec3,
    sides: &[Side],
    domain: &Domain,
    dimension: usize,
    local: &impl Fn(DVec3) -> DVec3,
) -> (DVec3, DVec3) {
    let extent = (high - low).max_element();
    let up = dimension - 1;
    let rim = PADDING * (high - low)[up] + 0.03 * extent;
    let [domain_low, domain_high] = domain.bounds().map(local);
    let mut frame = (low, high);
    let mut padding = PADDING * extent;
    // The vertical first: below grains high over a floor, the floor must be wide enough for their shadow.
    for axis in (0..dimension).rev() {
        let unit = DVec3::AXES[axis];
        let mut lower = vec![low[axis] - padding];
        let mut upper = vec![high[axis] + if axis == up { rim } else { padding }];
        if axis != up {
            lower.extend(Some(domain_low[axis]).filter(|x| low[axis] - x < 0.5 * extent));
            upper.extend(Some(domain_high[axis]).filter(|x| x - high[axis] < 0.5 * extent));
        }
        let reach_down = if axis == up { 4.0 * extent } else { 1.5 * extent };
        if domain.periodic[axis] {
            lower.push(domain_low[axis]);
            upper.push(domain_high[axis]);
        }
        for side in sides.iter().filter(|side| !side.periodic) {
            let facing = side.normal.dot(unit);
            if facing > 0.999 && low[axis] - side.offset < reach_down {
                lower.push(side.offset);
            }
            if facing < -0.999 && -side.offset - high[axis] < 1.5 * extent {
                upper.push(-side.offset);
            }
        }
        frame.0[axis] = lower.into_iter().fold(f64::INFINITY, f64::min).max(domain_low[axis].min(low[axis]));
        frame.1[axis] = upper.into_iter().fold(f64::NEG_INFINITY, f64::max).min(domain_high[axis].max(high[axis]));
        if axis == up {
            padding += 0.9 * (low[axis] - frame.0[axis] - padding).max(0.0);
        }
    }
    thickened(frame, dimension)
}

/// Of disks, with some thickness.
fn thickened((low, high): (DVec3, DVec3), dimension: usize) -> (DVec3, DVec3) {
    if dimension == 2 { (low.with_z(-1e-3), high.with_z(1e-3)) } else { (low, high) }
}

/// The part of a side that bounds the space inside all other sides and the frame; empty if there is none.
fn piece(side: &Side, sides: &[Side], frame: (DVec3, DVec3)) -> Vec<DVec3> {
    let (x, y) = side.normal.any_orthonormal_pair();
    let middle = 0.5 * (frame.0 + frame.1);
    let foot = middle - (side.normal.dot(middle) - side.offset) * side.normal;
    let half = 2.0 * (frame.1 - frame.0).length() + 2.0 * (foot - middle).length();
    let mut outline: Vec<DVec3> = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .iter()
        .map(|&(a, b)| foot + half * (a * x + b * y))
        .collect();
    for axis in DVec3::AXES {
        outline = cut(&outline, axis, axis.dot(frame.0));
        outline = cut(&outline, -axis, -axis.dot(frame.1));
    }
    for other in sides {
        outline = cut(&outline, other.normal, other.offset);
    }
    outline
}

/// The part of a convex polygon where `normal · x >= offset`.
fn cut(outline: &[DVec3], normal: DVec3, offset: f64) -> Vec<DVec3> {
    // Rounding must not let a plane cut away a polygon that lies in it.
    const SLACK: f64 = 1e-9;
    let height = |x: DVec3| normal.dot(x) - offset;
    let mut kept = Vec::with_capacity(outline.len() + 1);
    for (k, &from) in outline.iter().enumerate() {
        let to = outline[(k + 1) % outline.len()];
        let (a, b) = (height(from), height(to));
        if a >= -SLACK {
            kept.push(from);
        }
        if (a < -SLACK) != (b < -SLACK) {
            kept.push(from + (to - from) * (a / (a - b)).clamp(0.0, 1.0));
        }
    }
    kept
}

/// The line of a wall of a two-dimensional scene: its two ends, the width and whether the ends stick out, the normal.
fn wall_line(side: &Side, outline: &[DVec3], frame: (DVec3, DVec3)) -> Option<Line> {
    let along = DVec3::new(side.normal.y, -side.normal.x, 0.0);
    let by_place = |a: &&DVec3, b: &&DVec3| along.dot(**a).total_cmp(&along.dot(**b));
    let (start, end) = (outline.iter().min_by(by_place)?, outline.iter().max_by(by_place)?);
    let width = if side.periodic { 0.003 } else { 0.009 } * (frame.1 - frame.0).max_element();
    let overhang = if side.round.is_none() { 1.0 } else { 0.3 };
    Some([
        Vec4::new(start.x as f32, start.y as f32, overhang, width as f32),
        Vec4::new(end.x as f32, end.y as f32, side.normal.x as f32, side.normal.y as f32),
    ])
}

/// Edges seen so far, by their midpoints on a fine lattice, so that one shared by two faces is drawn once.
#[derive(Default)]
struct Edges(HashSet<[i64; 3]>);

impl Edges {
    fn new_ones(&mut self, side: &Side, outline: &[DVec3]) -> Vec<Line> {
        let mut lines = Vec::new();
        for (k, &from) in outline.iter().enumerate() {
            let to = outline[(k + 1) % outline.len()];
            // The seams between the strips of a cylinder are no edges.
            let seam = side.round.is_some() && (to - from).truncate().length() < 1e-6;
            let key = (0.5e6 * (from + to)).round().as_i64vec3().to_array();
            if !seam && (to - from).length() > 1e-6 && self.0.insert(key) {
                lines.push([from.as_vec3().extend(0.0), to.as_vec3().extend(0.0)]);
            }
        }
        lines
    }
}
