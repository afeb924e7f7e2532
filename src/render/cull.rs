//! Leaves out grains that can not be seen, so that a deep packing costs little more than its surface. The result is
//! conservative: the picture is the same with and without it.

use std::ops::Range;

use glam::{UVec2, Vec2, Vec4};

use super::camera::{self, Camera, Disk, View};
use super::neighbours::{REACH, near_wall};
use super::stage::{Face, Stage};

/// Longer side of the coarse picture by which hidden grains are found.
const CULL_CELLS: u32 = 1024;

/// For each cell, the smallest depth at which all of it is covered by some ball.
pub struct Curtain {
    size: UVec2,
    depth: Vec<f32>,
}

/// Half the diagonal of a cell.
const HALF_CELL: f32 = std::f32::consts::FRAC_1_SQRT_2;

impl Curtain {
    /// A curtain of `size` cells from everything that may hide something.
    pub fn new(size: UVec2, disks: impl Iterator<Item = Disk>) -> Self {
        let mut curtain = Self { size, depth: vec![f32::INFINITY; (size.x * size.y) as usize] };
        for disk in disks {
            for cell in cells(size, disk.center, disk.covered - HALF_CELL) {
                curtain.depth[cell] = curtain.depth[cell].min(disk.middle);
            }
        }
        curtain
    }

    /// Whether some of the ball may be in front of the curtain.
    pub fn shows(&self, disk: &Disk) -> bool {
        cells(self.size, disk.center, disk.touched + HALF_CELL).any(|cell| self.depth[cell] >= disk.near)
    }
}

/// Indices of the cells whose centres are within `radius` of a point.
fn cells(size: UVec2, center: Vec2, radius: f32) -> impl Iterator<Item = usize> {
    let span = |middle: f32, reach: f32, size: u32| {
        let first = (middle - reach - 0.5).ceil().clamp(0.0, size as f32) as usize;
        let last = (middle + reach - 0.5).floor().clamp(-1.0, size as f32 - 1.0);
        first..((last + 1.0) as usize).max(first)
    };
    let rows = if radius > 0.0 { span(center.y, radius, size.y) } else { 0..0 };
    rows.flat_map(move |y| {
        let rise = y as f32 + 0.5 - center.y;
        let reach = (radius * radius - rise * rise).max(0.0).sqrt();
        span(center.x, reach, size.x).map(move |x| y * size.x as usize + x)
    })
}

/// Which vertices of the list of drawn grains belong to which pass, six for a grain.
#[derive(Clone, Default)]
pub struct Parts {
    pub seen: Range<u32>,
    pub lit: Range<u32>,
    pub near_walls: Range<u32>,
}

/// The list of grains to draw, and its parts.
pub fn drawn(stage: &Stage, camera: &Camera, walls: &[&Face], (width, height): (u32, u32)) -> (Vec<u32>, Parts) {
    let size = (UVec2::new(width, height).as_vec2() * (CULL_CELLS as f32 / width.max(height) as f32)).ceil().as_uvec2();
    let curtain = Curtain::new(size, stage.balls.iter().map(|&ball| camera.disk(ball, size)));
    let mut view = View::default();
    camera::add_light(&mut view, stage, CULL_CELLS);
    let lit_disk = |ball| camera::lit_disk(&view, ball, CULL_CELLS);
    let lit_curtain = Curtain::new(UVec2::splat(CULL_CELLS), stage.balls.iter().map(|&ball| lit_disk(ball)));

    let mut list = Vec::new();
    let mut part = |wanted: &dyn Fn(Vec4) -> bool| {
        let start = 6 * list.len() as u32;
        list.extend((0..).zip(&stage.balls).filter(|&(_, &ball)| wanted(ball)).map(|(i, _)| i));
        start..6 * list.len() as u32
    };
    let widened = |ball: Vec4| ball.truncate().extend(REACH * ball.w);
    let parts = Parts {
        seen: part(&|ball| curtain.shows(&camera.disk(ball, size))),
        lit: part(&|ball| lit_curtain.shows(&lit_disk(ball))),
        near_walls: part(&|ball| {
            near_wall(ball, walls.iter().copied()) && curtain.shows(&camera.disk(widened(ball), size))
        }),
    };
    (list, parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_wholly_behind_is_hidden() {
        let disk = |x: f32, radius: f32, depth: f32| Disk {
            center: Vec2::new(x, 20.0),
            covered: radius,
            middle: depth,
            touched: radius,
            near: depth - radius,
        };
        let front = disk(20.0, 10.0, 50.0);
        let curtain = Curtain::new(UVec2::new(40, 40), [front].into_iter());
        assert!(curtain.shows(&front));
        assert!(!curtain.shows(&disk(21.0, 5.0, 100.0)));
        assert!(curtain.shows(&disk(27.0, 5.0, 100.0)), "peeps out at the side");
        assert!(curtain.shows(&disk(21.0, 5.0, 30.0)), "is in front");
    }
}
