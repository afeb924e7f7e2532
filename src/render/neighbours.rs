//! Which grains darken which: the lists behind the ambient light.

use glam::{DVec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;

use super::stage::Face;
use crate::scene::{self, Domain};

/// A grain darkens nothing farther from its centre than this many of its radii; the shader has the same number.
pub const REACH: f32 = 2.4;

/// Lists of grains per grain: those of grain i are `list[starts[i]..starts[i + 1]]`.
pub struct Neighbours {
    pub starts: Vec<u32>,
    pub list: Vec<u32>,
}

impl Neighbours {
    /// Every grain whose reach touches the surface of another, in order of index; none at all if there would be more
    /// than `capacity` (the picture then only lacks the darkening of gaps).
    pub fn new(balls: &[Vec4], capacity: usize) -> Self {
        let reach = |ball: &Vec4| f64::from(REACH * ball.w);
        let space = Domain { lower: DVec3::NEG_INFINITY, upper: DVec3::INFINITY, ..Domain::default() };
        let mut spheres = scene::Neighbours::new(space, 3, balls.iter().map(reach).fold(0.0, f64::max));
        balls.iter().for_each(|ball| spheres.insert(ball.xyz().as_dvec3(), reach(ball)));
        let around = |i: usize| {
            let mut found = Vec::new();
            spheres.find_overlap(balls[i].xyz().as_dvec3(), balls[i].w.into(), false, |j, _| {
                found.push(j as u32);
                false
            });
            // Cells that share a bucket name its spheres twice.
            found.sort_unstable();
            found.dedup();
            found.retain(|j| *j as usize != i);
            found
        };
        let lists: Vec<Vec<u32>> = (0..balls.len()).into_par_iter().map(around).collect();
        if lists.iter().map(Vec::len).sum::<usize>() > capacity {
            return Self { starts: vec![0; balls.len() + 1], list: Vec::new() };
        }
        let mut starts = vec![0];
        starts.extend(lists.iter().scan(0, |sum, list| {
            *sum += list.len() as u32;
            Some(*sum)
        }));
        Self { starts, list: lists.concat() }
    }
}

/// Whether the reach of a ball touches one of the faces' planes.
pub fn near_wall<'a>(ball: Vec4, mut faces: impl Iterator<Item = &'a Face>) -> bool {
    faces.any(|face| face.plane.xyz().dot(ball.xyz()) - face.plane.w < REACH * ball.w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shader_has_the_same_reach() {
        assert!(crate::render::picture::SHADER.contains(&format!("const REACH: f32 = {REACH:?};")));
    }

    #[test]
    fn lists_hold_the_grains_in_reach_and_no_others() {
        let ball = |x: f32, radius: f32| Vec4::new(x, 0.0, 0.0, radius);
        let balls = [ball(0.0, 0.1), ball(0.3, 0.1), ball(0.7, 0.1), ball(1.05, 0.3)];
        let lists = Neighbours::new(&balls, 100);
        let of = |i: usize| &lists.list[lists.starts[i] as usize..lists.starts[i + 1] as usize];
        // The big ball reaches the second one, but not the other way round.
        assert_eq!([of(0), of(1), of(2), of(3)], [&[1][..], &[0, 3], &[3], &[2]]);
        let none = Neighbours::new(&balls, 1);
        assert!(none.list.is_empty() && none.starts == [0; 5]);
    }
}
