//! Why a run has to stop: what is known of the grain that cannot be followed, in words.

use crate::{
    body::grains::same_grain,
    model::{Compliance, Grains, Method},
    scene::{Assembly, Numbers},
    space::{
        boundary::{approach, nearest_image},
        dimension::outside,
        precision::position_low_of,
        turning::wall_velocity,
        walls::wall_separation,
    },
    state::State,
};
use glam::DVec3;

/// What messages say of the scene, beyond the state.
pub struct Known {
    walls: Vec<String>,
    /// What grains and clumps are called.
    pub numbers: Numbers,
    /// s, of the time step.
    dt_bound: f64,
}

impl Known {
    pub fn of(assembly: &Assembly, dt_bound: f64) -> Known {
        Known {
            walls: assembly.walls.iter().map(|wall| wall.name.clone()).collect(),
            numbers: assembly.numbers.clone(),
            dt_bound,
        }
    }
}

/// An overlap of this part of the smaller radius is no contact of grains any more, but a force that throws them apart.
const DEEP: f64 = 0.5;

/// Why grain `lost` ends the run, with a way out.
pub fn reason(s: &State, lost: u32, known: &Known) -> String {
    let p = &s.params;
    let at = s.id.iter().position(|id| *id == lost).unwrap_or(0);
    let number = known.numbers.of_grain(lost as usize);
    let who = match s.model.grains {
        Grains::Spheres => format!("grain {number}"),
        Grains::Clumps => {
            let clump = known.numbers.of_clump(s.clump_of_id[lost as usize] as usize);
            format!("clump {clump} (its member, grain {number})")
        }
    };
    let (x, radius) = (s.position[at].x, s.position[at].radius);
    let speed = s.velocity[at].v.length();
    let spin = s.spin.get(at).map_or(0.0, |spin| spin.0.length());
    let (stride, turn) = (approach(s, s.model.boundary, speed * p.dt, radius), spin * p.dt);
    if !(x.is_finite() && stride.is_finite() && turn.is_finite()) {
        return format!("{who} has no position any more (not a number){}", step_or(s, known, at, ""));
    }
    if s.model.grains == Grains::Clumps && turn > p.turn_limit {
        let way_out =
            format!("; with this spin of {spin:.4e} rad/s solver.dt must be below {:.4e} s", p.turn_limit / spin);
        let cause = step_or(s, known, at, &way_out);
        return format!("{who} turns by {turn:.4e} rad in one step; at most {} can be followed{cause}", p.turn_limit);
    }
    if stride > p.step_limit {
        let way_out =
            format!("; at its speed of {speed:.4e} m/s solver.dt must be below {:.4e} s", p.step_limit / speed);
        return format!(
            "{who} moves {stride:.4e} m in one step, {:.2} of its radius; at most {:e} m can be followed safely (half of solver.margin, or \
             of the smallest radius){}",
            stride / radius,
            p.step_limit,
            step_or(s, known, at, &way_out)
        );
    }
    if x.abs().max_element() >= s.range {
        let range = s.range;
        return format!(
            "{who} is at {x} m: beyond {range:e} m from the origin single precision loses digits of its contacts; use \
             --precision double or --engine cpu, or faces of the domain through which grains leave"
        );
    }
    if outside(x, p.lower, p.upper) {
        return format!(
            "{who} has left the domain at {x} m through its open {} face, at {speed:.4e} m/s; hold grains by a wall, give them a \
             larger domain, or let them leave by domain.boundary = \"outlet\"",
            face(s, x)
        );
    }
    beyond_wall(s, at, &who, known)
}

/// The cause of what is too fast, if that is the time step or an overlap; what to say if not.
fn step_or(s: &State, known: &Known, at: usize, otherwise: &str) -> String {
    let dt = s.params.dt;
    if dt > known.dt_bound {
        return format!("; the time step, {dt:e} s, is above the bound of {:e} s", known.dt_bound);
    }
    match deepest_overlap(s, known, at) {
        Some((other, part)) if part > DEEP => {
            format!("; it overlaps grain {other} by {part:.2} of the smaller radius, which throws them apart")
        }
        _ => otherwise.to_owned(),
    }
}

/// With which grain a grain overlaps most, and by how much of the smaller radius.
fn deepest_overlap(s: &State, known: &Known, at: usize) -> Option<(u32, f64)> {
    let here = &s.position[at];
    let part = |j: usize| {
        let there = &s.position[j];
        let distance = nearest_image(s, here.x, there.x, DVec3::ZERO).x.length();
        (here.radius + there.radius - distance) / here.radius.min(there.radius)
    };
    let others = (0..s.sizes.bodies)
        .filter(|j| *j != at && !same_grain(s, at, *j))
        .map(|j| (known.numbers.of_grain(s.id[j] as usize), part(j)));
    others.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// The face of the domain through which a grain has left.
fn face(s: &State, x: DVec3) -> String {
    let name = |axis: usize| ["x", "y", "z"][axis];
    let below = (0..3).find(|axis| x[*axis] < s.params.lower[*axis]).map(|axis| format!("lower {}", name(axis)));
    let above = (0..3).find(|axis| x[*axis] > s.params.upper[*axis]).map(|axis| format!("upper {}", name(axis)));
    below.or(above).unwrap_or_default()
}

/// A centre that has come beyond a wall further than any impact of the scene drives it: what has pressed it there.
fn beyond_wall(s: &State, at: usize, who: &str, known: &Known) -> String {
    let (here, low) = (&s.position[at], position_low_of(s, at));
    let touch = |w: &usize| wall_separation(&s.wall[*w], here, low);
    let walls = || 0..s.sizes.walls;
    let Some(crossed) = walls().min_by(|a, b| touch(a).gap.total_cmp(&touch(b).gap)) else {
        return format!("{who} is lost at {} m", here.x);
    };
    let closing = |w: &usize| -touch(w).n.dot(wall_velocity(s, &s.wall[*w], here.x));
    let cause = match walls().find(|w| closing(w) > 0.0) {
        Some(w) => {
            format!("the wall \"{}\" comes at {:.4e} m/s and the grains cannot give way", known.walls[w], closing(&w))
        }
        None if s.model.method == Method::ContactDynamics && s.model.compliance == Compliance::None => {
            "the contacts of its steps are not solved".to_owned()
        }
        None => format!(
            "what presses it, at {:.4e} m/s now, is more than its springs can hold: give materials a larger normal_stiffness \
             (youngs_modulus)",
            s.velocity[at].v.length()
        ),
    };
    format!("the centre of {who} is beyond the wall \"{}\" at {} m: {cause}", known.walls[crossed], here.x)
}
