//! The space that a packing takes up.

use super::packing::Packing;
use crate::scene::Surface;
use glam::DVec3;
use std::f64::consts::TAU;

/// Periods whole; along other axes from wall to wall, and where there is no wall, up to the outermost free grain. A wall
/// overhead that nothing touches does not count. In two dimensions it is one unit thick.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Corners of the box around it, m.
    pub lower: DVec3,
    pub upper: DVec3,
    faces: Vec<Vec<DVec3>>,
    dims: usize,
}

/// A cylinder is a prism of so many sides, of the same section.
const SIDES: usize = 720;

/// Of what is as good as one.
const ALONG_AN_AXIS: f64 = 1.0 - 1e-12;

impl Cell {
    /// None without a free grain.
    pub fn of(packing: &Packing) -> Option<Cell> {
        let (dims, domain) = (packing.dims(), &packing.assembly.domain);
        let free = packing.grains.iter().filter(|grain| !grain.fixed);
        let (mut lower, mut upper) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        free.for_each(|g| (lower, upper) = (lower.min(g.position - g.radius), upper.max(g.position + g.radius)));
        if !(lower.x <= upper.x) {
            return None;
        }
        if dims == 2 {
            (lower.z, upper.z) = (0.0, 1.0);
        }
        let bounds = |w: usize| match packing.walls[w].surface {
            Surface::Plane { normal, .. } => {
                packing.totals.walls[w].contacts > 0 || !(normal.dot(packing.assembly.gravity) > 0.0)
            }
            Surface::Cylinder { .. } => true,
        };
        let walls: Vec<Surface> =
            (0..packing.walls.len()).filter(|w| bounds(*w)).map(|w| packing.walls[w].surface).collect();
        let mut base = None;
        // A wall is where the grains end, even if it is a little beyond them, or they beyond it.
        let (mut low_walls, mut high_walls) = (DVec3::NEG_INFINITY, DVec3::INFINITY);
        for wall in &walls {
            match *wall {
                Surface::Plane { point, normal } => {
                    for axis in (0..dims).filter(|axis| normal[*axis].abs() >= ALONG_AN_AXIS) {
                        match normal[axis] > 0.0 {
                            true => low_walls[axis] = low_walls[axis].max(point[axis]),
                            false => high_walls[axis] = high_walls[axis].min(point[axis]),
                        }
                    }
                }
                Surface::Cylinder { center, radius } => {
                    base = Some((center, radius));
                    for axis in 0..2 {
                        low_walls[axis] = low_walls[axis].max(center[axis] - radius);
                        high_walls[axis] = high_walls[axis].min(center[axis] + radius);
                    }
                }
            }
        }
        for axis in 0..dims {
            if domain.periodic[axis] {
                (lower[axis], upper[axis]) = (domain.lower[axis], domain.upper[axis]);
                continue;
            }
            if low_walls[axis].is_finite() {
                lower[axis] = low_walls[axis];
            }
            if high_walls[axis].is_finite() {
                upper[axis] = high_walls[axis];
            }
        }
        let mut cell = Cell { lower, upper, faces: prism(base, lower, upper), dims };
        for wall in walls {
            if let Surface::Plane { point, normal } = wall
                && normal.abs().max_element() < ALONG_AN_AXIS
            {
                cell.cut(normal, normal.dot(point));
            }
        }
        Some(cell)
    }

    /// m³ (m² in two dimensions)
    pub fn volume(&self) -> f64 {
        let Some(apex) = self.faces.first().and_then(|face| face.first()) else { return 0.0 };
        // Cones over the faces of a convex body.
        let cone = |face: &Vec<DVec3>| {
            let fan = face.windows(2).skip(1).map(|edge| (edge[0] - face[0]).cross(edge[1] - face[0]));
            (fan.sum::<DVec3>().dot(face[0] - apex) / 6.0).abs()
        };
        self.faces.iter().map(cone).sum()
    }

    /// The part of it between two heights along an axis, m³.
    pub fn slab(&self, axis: usize, low: f64, high: f64) -> f64 {
        let mut slab = self.clone();
        slab.cut(DVec3::AXES[axis], low);
        slab.cut(-DVec3::AXES[axis], -high);
        slab.volume()
    }

    /// Along axes that exist.
    pub fn lengths(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.dims).map(|axis| self.upper[axis] - self.lower[axis])
    }

    /// Keep what is where `normal · x >= offset`.
    fn cut(&mut self, normal: DVec3, offset: f64) {
        let height = |x: DVec3| normal.dot(x) - offset;
        let mut edge: Vec<DVec3> = Vec::new();
        for face in &mut self.faces {
            let mut kept = Vec::with_capacity(face.len() + 1);
            for (k, &here) in face.iter().enumerate() {
                let there = face[(k + 1) % face.len()];
                let (h, next) = (height(here), height(there));
                if h >= 0.0 {
                    kept.push(here);
                }
                if (h >= 0.0) != (next >= 0.0) {
                    let crossing = here + (h / (h - next)) * (there - here);
                    kept.push(crossing);
                    edge.push(crossing);
                }
            }
            *face = kept;
        }
        self.faces.retain(|face| face.len() > 2);
        if edge.len() > 2 {
            let middle = edge.iter().sum::<DVec3>() / edge.len() as f64;
            let x = normal.any_orthonormal_vector();
            let y = normal.cross(x);
            let angle = |p: &DVec3| (*p - middle).dot(y).atan2((*p - middle).dot(x));
            edge.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
            self.faces.push(edge);
        }
    }
}

/// A box, or what a cylinder (a disk) has of it.
fn prism(base: Option<(DVec3, f64)>, lower: DVec3, upper: DVec3) -> Vec<Vec<DVec3>> {
    let outline: Vec<DVec3> = match base {
        None => [(lower.x, lower.y), (upper.x, lower.y), (upper.x, upper.y), (lower.x, upper.y)]
            .map(|(x, y)| DVec3::new(x, y, 0.0))
            .to_vec(),
        Some((center, radius)) => {
            let step = TAU / SIDES as f64;
            let radius = radius * (step / step.sin()).sqrt();
            let at = |k: usize| DVec3::new((step * k as f64).cos(), (step * k as f64).sin(), 0.0);
            (0..SIDES).map(|k| DVec3::new(center.x, center.y, 0.0) + radius * at(k)).collect()
        }
    };
    let at = |z: f64| outline.iter().map(move |p| p.with_z(z)).collect::<Vec<_>>();
    let (floor, lid) = (at(lower.z), at(upper.z));
    let next = |k: usize| (k + 1) % outline.len();
    let sides = (0..outline.len()).map(|k| vec![floor[k], floor[next(k)], lid[next(k)], lid[k]]);
    let mut faces: Vec<_> = sides.collect();
    faces.extend([floor, lid]);
    let mut prism = Cell { lower, upper, faces, dims: 3 };
    if let Some((center, radius)) = base {
        // Walls beside the axis cut it.
        for axis in 0..2 {
            if lower[axis] > center[axis] - radius {
                prism.cut(DVec3::AXES[axis], lower[axis]);
            }
            if upper[axis] < center[axis] + radius {
                prism.cut(-DVec3::AXES[axis], -upper[axis]);
            }
        }
    }
    prism.faces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(base: Option<(DVec3, f64)>, upper: DVec3) -> Cell {
        Cell { lower: DVec3::ZERO, upper, faces: prism(base, DVec3::ZERO, upper), dims: 3 }
    }

    #[test]
    fn volumes_are_those_of_geometry() {
        let close = |found: f64, expected: f64, tolerance: f64| {
            assert!((found / expected - 1.0).abs() < tolerance, "{found}, expected {expected}");
        };
        let mut brick = cell(None, DVec3::new(2.0, 3.0, 4.0));
        close(brick.volume(), 24.0, 1e-14);
        close(brick.slab(2, 1.0, 1.5), 3.0, 1e-14);
        // A corner off: a tetrahedron with edges of 1.
        brick.cut(DVec3::ONE.normalize(), 1.0 / 3.0_f64.sqrt());
        close(brick.volume(), 24.0 - 1.0 / 6.0, 1e-14);
        let (center, radius) = (DVec3::new(1.0, 1.0, 0.0), 1.0);
        let tube = cell(Some((center, radius)), DVec3::new(2.0, 2.0, 5.0));
        close(tube.volume(), 5.0 * std::f64::consts::PI, 1e-12);
        close(tube.slab(0, 0.0, 1.0), 2.5 * std::f64::consts::PI, 1e-4);
        let half = cell(Some((center, radius)), DVec3::new(1.0, 2.0, 5.0));
        close(half.volume(), 2.5 * std::f64::consts::PI, 1e-4);
        assert_eq!(tube.slab(2, 6.0, 7.0), 0.0);
    }
}
