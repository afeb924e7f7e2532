//! Where the camera and the key light stand.

use encase::ShaderType;
use glam::{DVec3, Mat4, Quat, UVec2, Vec2, Vec3, Vec4, Vec4Swizzles};

use super::stage::Stage;

/// Samples per pixel in each direction.
pub const SUPERSAMPLING: u32 = 2;
/// Tangent of half the angle of view along the shorter side of the picture.
const HALF_VIEW: f32 = 0.268;
/// Free border of the picture, as a fraction of its size.
const MARGIN: f32 = 0.045;
/// Direction from the scene to the key light, degrees from the x axis and above the horizon: over the left shoulder of the viewer.
const LIGHT: (f32, f32) = (-110.0, 52.0);

/// A ball as an eye sees it: lengths across in cells of the coarse picture, depths in any unit.
#[derive(Clone, Copy, Debug)]
pub struct Disk {
    pub center: Vec2,
    /// Radius of a circle that the ball covers, and depth of the farthest point of what covers it.
    pub covered: f32,
    pub middle: f32,
    /// Radius of a circle that holds all of the ball, and depth of its nearest point.
    pub touched: f32,
    pub near: f32,
}

/// The uniform of every pass; see `shaders/render.wgsl`, whose struct of this name has the same layout.
#[derive(Clone, Copy, Debug, Default, ShaderType)]
pub struct View {
    pub view_proj: Mat4,
    pub shadow_proj: Mat4,
    pub eye: Vec3,
    pub line_width: f32,
    pub ray: Vec3,
    pub penumbra: f32,
    pub ray_x: Vec3,
    pub shadow_offset: f32,
    pub ray_y: Vec3,
    pub tile_low: f32,
    pub light: Vec3,
    pub tile_high: f32,
    pub light_x: Vec3,
    pub rim: f32,
    pub light_y: Vec3,
    pub samples: Vec2,
}

/// A rectangle of the picture, pixels from its upper left corner.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

/// A camera fitted to a stage.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    perspective: bool,
    pub eye: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    /// Half width and height of the picture: at unit distance with perspective, at any distance without.
    half: Vec2,
    near: f32,
    far: f32,
    size: Vec2,
}

impl Camera {
    /// Closest camera that has all of the stage in a picture of this many pixels.
    pub fn new(stage: &Stage, width: u32, height: u32) -> Self {
        let points: Vec<Vec4> = stage.shown().collect();
        let size = Vec2::new(width as f32, height as f32);
        match stage.dimension {
            2 => Self::flat(&points, size, stage.up),
            _ => Self::solid(&points, size, stage),
        }
    }

    fn flat(points: &[Vec4], size: Vec2, up: DVec3) -> Self {
        let up = up.as_vec3();
        let right = up.cross(Vec3::Z);
        let ends = |axis: Vec3| {
            let low = points.iter().map(|p| p.xyz().dot(axis) - p.w).fold(f32::INFINITY, f32::min);
            let high = points.iter().map(|p| p.xyz().dot(axis) + p.w).fold(f32::NEG_INFINITY, f32::max);
            if low <= high { (low, high) } else { (-1.0, 1.0) }
        };
        let (x, y) = (ends(right), ends(up));
        let wanted = Vec2::new(x.1 - x.0, y.1 - y.0) / (2.0 - 4.0 * MARGIN);
        let half = size * (wanted / size).max_element();
        Self {
            perspective: false,
            eye: 0.5 * (x.0 + x.1) * right + 0.5 * (y.0 + y.1) * up + Vec3::Z,
            right,
            up,
            forward: -Vec3::Z,
            half,
            near: 0.0,
            far: 2.0,
            size,
        }
    }

    fn solid(points: &[Vec4], size: Vec2, stage: &Stage) -> Self {
        let upright = stage.up.as_vec3();
        let forward = -upright_to(upright, direction(stage.eye));
        // Straight from above or below the picture's upper edge is that of the north.
        let right = forward.cross(upright).try_normalize().unwrap_or_else(|| upright_to(upright, Vec3::X));
        let up = right.cross(forward);
        let half = HALF_VIEW * size / size.min_element();
        let sideways = snug(points, right, forward, half.x * (1.0 - 2.0 * MARGIN));
        let upward = snug(points, up, forward, half.y * (1.0 - 2.0 * MARGIN));
        let back = sideways.1.min(upward.1);
        let eye = sideways.0 * right + upward.0 * up + back * forward;
        let depths = |sign: f32| points.iter().map(move |p| (p.xyz() - eye).dot(forward) + sign * p.w);
        let near = depths(-1.0).fold(f32::INFINITY, f32::min).max(1e-3) * 0.95;
        let far = depths(1.0).fold(2.0 * near, f32::max) * 1.05;
        Self { perspective: true, eye, right, up, forward, half, near, far, size }
    }

    /// A ball as this camera sees it, in a picture of `size` cells.
    pub fn disk(&self, ball: Vec4, size: UVec2) -> Disk {
        let place = ball.xyz() - self.eye;
        let depth = place.dot(self.forward);
        let across = Vec2::new(place.dot(self.right), -place.dot(self.up)) / depth;
        let cells = 0.5 * size.as_vec2() / self.half;
        // The section through the centre parallel to the picture is a circle in the picture, and all of it is covered;
        // the outline is an ellipse that reaches farther.
        let outline = ball.w * (1.0 + across.length_squared()).sqrt() / (depth - ball.w).max(1e-3 * ball.w);
        Disk {
            center: 0.5 * size.as_vec2() + cells * across,
            covered: cells.min_element() * ball.w / depth,
            middle: depth,
            touched: cells.max_element() * outline,
            near: depth - ball.w,
        }
    }

    /// The uniform for a tile, without the light.
    pub fn view(&self, tile: Tile) -> View {
        let corner = Vec2::new(tile.x as f32, tile.y as f32);
        let extent = Vec2::new(tile.width as f32, tile.height as f32);
        let middle = (2.0 * corner + extent) / self.size - 1.0;
        let middle = Vec2::new(middle.x, -middle.y);
        let share = extent / self.size;
        View {
            view_proj: self.projection(middle, share),
            eye: self.eye,
            ray: self.forward + middle.x * self.half.x * self.right + middle.y * self.half.y * self.up,
            ray_x: share.x * self.half.x * self.right,
            ray_y: share.y * self.half.y * self.up,
            tile_low: 1.0 - (corner.y + extent.y) / self.size.y,
            tile_high: 1.0 - corner.y / self.size.y,
            line_width: SUPERSAMPLING as f32 * (0.0011 * self.size.max_element()).clamp(0.6, 4.0),
            rim: SUPERSAMPLING as f32 * (0.0018 * self.size.max_element()).clamp(0.7, 6.0),
            samples: SUPERSAMPLING as f32 * extent,
            ..View::default()
        }
    }

    /// World to clip space of the part of the picture with centre `middle` (of -1 to 1) and size `share` (of 1).
    fn projection(&self, middle: Vec2, share: Vec2) -> Mat4 {
        let row = |axis: Vec3| axis.extend(-axis.dot(self.eye));
        let depth = row(self.forward);
        let w = if self.perspective { depth } else { Vec4::W };
        let x = (row(self.right) / self.half.x - middle.x * w) / share.x;
        let y = (row(self.up) / self.half.y - middle.y * w) / share.y;
        let scale = if self.perspective { self.far } else { 1.0 };
        let z = (depth - self.near * Vec4::W) * (scale / (self.far - self.near));
        Mat4::from_cols(x, y, z, w).transpose()
    }
}

/// A direction that was meant with z upright.
fn upright_to(up: Vec3, direction: Vec3) -> Vec3 {
    Quat::from_rotation_arc(Vec3::Z, up) * direction
}

/// Sets the key light of `view`, with a shadow map of `texels` squared fitted to the stage.
pub fn add_light(view: &mut View, stage: &Stage, texels: u32) {
    let upright = stage.up.as_vec3();
    let light = upright_to(upright, direction(LIGHT));
    let x = light.cross(upright).normalize();
    let y = x.cross(light);
    let points: Vec<Vec4> = stage.shown().collect();
    let row = |axis: Vec3| {
        let low = points.iter().map(|p| axis.dot(p.xyz()) - p.w).fold(f32::INFINITY, f32::min);
        let high = points.iter().map(|p| axis.dot(p.xyz()) + p.w).fold(f32::NEG_INFINITY, f32::max);
        (low, high, axis)
    };
    let unit =
        |(low, high, axis): (f32, f32, Vec3)| (axis.extend(-0.5 * (low + high)) * 2.0 / (high - low), high - low);
    let ((to_x, width), (to_y, height), (to_z, _)) = (unit(row(x)), unit(row(y)), unit(row(-light)));
    let texel = width.max(height) / texels as f32;
    let mean = stage.balls.iter().map(|ball| ball.w).sum::<f32>() / stage.balls.len().max(1) as f32;
    view.shadow_proj = Mat4::from_cols(to_x, to_y, 0.5 * (to_z + Vec4::W), Vec4::W).transpose();
    (view.light, view.light_x, view.light_y) = (light, x, y);
    view.penumbra = (0.22 * mean).min(0.03).max(1.5 * texel) / width.max(height);
    view.shadow_offset = (1.2 * texel).max(0.02 * mean);
}

/// A ball as the key light of `view` sees it, in a shadow map of `cells` squared.
pub fn lit_disk(view: &View, ball: Vec4, cells: u32) -> Disk {
    let place = view.shadow_proj * ball.xyz().extend(1.0);
    let half = 0.5 * cells as f32;
    // The map may be stretched: cells per length differ along its two axes, and depth has a scale of its own.
    let scale = |row: usize| ball.w * view.shadow_proj.row(row).xyz().length();
    Disk {
        center: half * (place.xy() + 1.0),
        covered: half * scale(0).min(scale(1)),
        middle: place.z,
        touched: half * scale(0).max(scale(1)),
        near: place.z - scale(2),
    }
}

/// Unit vector at (azimuth, elevation) in degrees.
fn direction((azimuth, elevation): (f32, f32)) -> Vec3 {
    let (sin, cos) = azimuth.to_radians().sin_cos();
    let (z, flat) = elevation.to_radians().sin_cos();
    Vec3::new(flat * cos, flat * sin, z)
}

/// Coordinates of the eye along `axis` and `forward` such that the balls just fill the wedge of half-width `slope`
/// (at unit distance): each of its two planes touches the ball that reaches farthest out.
fn snug(balls: &[Vec4], axis: Vec3, forward: Vec3, slope: f32) -> (f32, f32) {
    let slant = (1.0 + slope * slope).sqrt();
    let farthest = |sign: f32| {
        let reach = |ball: &Vec4| sign * axis.dot(ball.xyz()) + slant * ball.w - slope * forward.dot(ball.xyz());
        balls.iter().map(reach).reduce(f32::max).unwrap_or(1.0)
    };
    let (plus, minus) = (farthest(1.0), farthest(-1.0));
    (0.5 * (plus - minus), -0.5 * (plus + minus) / slope)
}
