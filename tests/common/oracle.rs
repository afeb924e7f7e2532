//! A second, slow implementation of the same equations, to compare trajectories with. It is written from
//! the theory, not from the crate, and shares neither formulas nor data structures with it:
//!
//! - all pairs and all 27 images are tried; there is no grid, no neighbour list, no chunk;
//! - velocities live at full steps (kick, drift, kick), not at half steps;
//! - the contact point is the middle of the two surface points; moments are taken from it;
//! - each contact stores its last normal, and its spring is turned by Rodrigues' formula;
//! - each contact is computed once, for both grains, and found in a map from (i, j).

use glam::DVec3;
use packstone::scene::{Assembly, Dashpot, Grain, Surface, TimeStep};
use std::collections::HashMap;
use std::f64::consts::PI;

struct Body {
    x: DVec3,
    v: DVec3,
    w: DVec3,
    radius: f64,
    mass: f64,
    inertia: f64,
    material: usize,
    fixed: bool,
    force: DVec3,
    moment: DVec3,
}

/// What a contact remembers.
struct Memory {
    spring: DVec3,
    normal: DVec3,
}

/// A contact as seen from body i; `other` is None for a wall.
struct Meeting {
    key: (usize, usize),
    normal: DVec3,
    gap: f64,
    point: DVec3,
    arm_j: DVec3,
}

pub struct Oracle {
    scene: Assembly,
    dt: f64,
    bodies: Vec<Body>,
    /// Where each wall's reference point is now.
    wall_at: Vec<DVec3>,
    memory: HashMap<(usize, usize), Memory>,
    /// Contacts that have ever begun.
    pub begun: usize,
    /// Contact-steps that slid and that stuck.
    pub slid: usize,
    pub stuck: usize,
}

impl Oracle {
    pub fn new(scene: &Assembly) -> Oracle {
        let TimeStep::Fixed(dt) = scene.solver.dt else { panic!("the oracle needs a fixed time step") };
        let body = |g: &Grain| {
            let density = scene.materials[g.material as usize].density;
            let r = g.radius;
            let (mass, gyration) = if scene.dimension == 2 {
                (density * PI * r * r, 0.5)
            } else {
                (density * 4.0 * PI / 3.0 * r * r * r, 0.4)
            };
            Body {
                x: g.position,
                v: g.velocity,
                w: g.spin,
                radius: r,
                mass,
                inertia: gyration * mass * r * r,
                material: g.material as usize,
                fixed: g.fixed,
                force: DVec3::ZERO,
                moment: DVec3::ZERO,
            }
        };
        let wall_at = |w: &packstone::scene::Wall| match w.surface {
            Surface::Plane { point, .. } => point,
            Surface::Cylinder { center, .. } => center,
        };
        let mut oracle = Oracle {
            dt,
            bodies: scene.grains.iter().map(body).collect(),
            wall_at: scene.walls.iter().map(wall_at).collect(),
            scene: scene.clone(),
            memory: HashMap::new(),
            begun: 0,
            slid: 0,
            stuck: 0,
        };
        oracle.forces(0.0); // a contact that exists at time 0 has an unstretched spring
        oracle
    }

    pub fn advance(&mut self, steps: usize) {
        for _ in 0..steps {
            self.step();
        }
    }

    fn step(&mut self) {
        let (dt, xi) = (self.dt, self.scene.solver.damping);
        for b in self.bodies.iter_mut() {
            if !b.fixed {
                b.v += 0.5 * dt * (b.force / b.mass + self.scene.gravity - xi * b.v);
                b.w += 0.5 * dt * (b.moment / b.inertia - xi * b.w);
            }
            b.x += dt * b.v;
            for axis in (0..3).filter(|k| self.scene.domain.periodic[*k]) {
                let (lower, upper) = (self.scene.domain.lower[axis], self.scene.domain.upper[axis]);
                while b.x[axis] < lower {
                    b.x[axis] += upper - lower;
                }
                while b.x[axis] >= upper {
                    b.x[axis] -= upper - lower;
                }
            }
        }
        for (at, wall) in self.wall_at.iter_mut().zip(&self.scene.walls) {
            *at += dt * wall.velocity;
        }
        self.forces(dt);
        // v(n+1) solves v = v(n+1/2) + dt/2 (a - xi v), one linear equation.
        for b in self.bodies.iter_mut().filter(|b| !b.fixed) {
            b.v = (b.v + 0.5 * dt * (b.force / b.mass + self.scene.gravity)) / (1.0 + 0.5 * dt * xi);
            b.w = (b.w + 0.5 * dt * b.moment / b.inertia) / (1.0 + 0.5 * dt * xi);
        }
    }

    /// Forces from positions now and velocities of the half step before (at time 0: of now), over an interval dt.
    fn forces(&mut self, dt: f64) {
        for b in &mut self.bodies {
            (b.force, b.moment) = (DVec3::ZERO, DVec3::ZERO);
        }
        let mut met = HashMap::new();
        for meeting in self.meetings() {
            let memory = self.resolve(&meeting, dt);
            met.insert(meeting.key, memory);
        }
        self.memory = met; // contacts that are open now are forgotten
    }

    fn meetings(&self) -> Vec<Meeting> {
        let mut all = Vec::new();
        for i in 0..self.bodies.len() {
            for j in i + 1..self.bodies.len() {
                if !(self.bodies[i].fixed && self.bodies[j].fixed) {
                    all.extend(self.meet_grain(i, j));
                }
            }
            if !self.bodies[i].fixed {
                all.extend((0..self.scene.walls.len()).filter_map(|w| self.meet_wall(i, w)));
            }
        }
        all
    }

    fn meet_grain(&self, i: usize, j: usize) -> Option<Meeting> {
        let (a, b) = (&self.bodies[i], &self.bodies[j]);
        let domain = &self.scene.domain;
        let images = |k: usize| if domain.periodic[k] { -1..=1 } else { 0..=0 };
        for (kx, ky, kz) in images(0).flat_map(|x| images(1).flat_map(move |y| images(2).map(move |z| (x, y, z)))) {
            let mut there = b.x;
            for (axis, k) in [kx, ky, kz].into_iter().enumerate().filter(|(_, k)| *k != 0) {
                there[axis] += f64::from(k) * (domain.upper[axis] - domain.lower[axis]);
            }
            let gap = a.x.distance(there) - a.radius - b.radius;
            if gap < 0.0 {
                let normal = (there - a.x).normalize();
                let point = 0.5 * ((a.x + a.radius * normal) + (there - b.radius * normal));
                return Some(Meeting { key: (i, j), normal, gap, point, arm_j: point - there });
            }
        }
        None
    }

    fn meet_wall(&self, i: usize, w: usize) -> Option<Meeting> {
        let b = &self.bodies[i];
        let (normal, surface) = match self.scene.walls[w].surface {
            Surface::Plane { normal, .. } => {
                let height = (b.x - self.wall_at[w]).dot(normal);
                (-normal, b.x - height * normal)
            }
            Surface::Cylinder { radius, .. } => {
                let mut outwards = b.x - self.wall_at[w];
                outwards.z = 0.0;
                let outwards = outwards.normalize();
                let mut axis = self.wall_at[w];
                axis.z = b.x.z;
                (outwards, axis + radius * outwards)
            }
        };
        let tip = b.x + b.radius * normal; // the grain's point that reaches deepest
        let gap = (surface - tip).dot(normal);
        let key = (i, self.bodies.len() + w);
        (gap < 0.0).then(|| Meeting { key, normal, gap, point: 0.5 * (surface + tip), arm_j: DVec3::ZERO })
    }

    /// Adds the forces of one contact and returns what it will remember.
    fn resolve(&mut self, meeting: &Meeting, dt: f64) -> Memory {
        let (i, j) = meeting.key;
        let n = meeting.normal;
        let a = &self.bodies[i];
        let arm_i = meeting.point - a.x;
        let surface_i = a.v + a.w.cross(arm_i);
        let (surface_j, material_j, mass_j) = match self.bodies.get(j) {
            Some(b) => (b.v + b.w.cross(meeting.arm_j), b.material, if b.fixed { f64::INFINITY } else { b.mass }),
            None => {
                let w = j - self.bodies.len();
                let wall = &self.scene.walls[w];
                let turning = DVec3::Z * wall.spin;
                let v = wall.velocity + turning.cross(meeting.point - self.wall_at[w]);
                (v, wall.material as usize, f64::INFINITY)
            }
        };
        let mass_i = if a.fixed { f64::INFINITY } else { a.mass };
        let reduced = if mass_j.is_infinite() {
            mass_i
        } else if mass_i.is_infinite() {
            mass_j
        } else {
            mass_i * mass_j / (mass_i + mass_j)
        };
        let law = &self.scene.pairs[a.material * self.scene.materials.len() + material_j];
        let relative = surface_i - surface_j;

        let closing = relative.dot(n);
        let viscosity = match law.dashpot {
            Dashpot::None => 0.0,
            // e = exp(-π tan a) for a damping ratio sin a
            Dashpot::Restitution(e) => 2.0 * (-e.ln() / PI).atan().sin() * (law.normal_stiffness * reduced).sqrt(),
            Dashpot::MassScaled(eta) => eta * reduced,
        };
        let pressing = law.normal_stiffness * -meeting.gap + viscosity * closing;

        let mut spring = DVec3::ZERO;
        match self.memory.get(&meeting.key) {
            Some(memory) => spring = turn(memory.spring, memory.normal, n),
            None => self.begun += 1,
        }
        if law.friction > 0.0 {
            let slip = relative - n * closing;
            spring -= law.tangential_stiffness * dt * slip;
            let most = law.friction * pressing.abs();
            if spring.length() > most {
                spring = spring.normalize() * most;
                self.slid += 1;
            } else {
                self.stuck += 1;
            }
        } else {
            spring = DVec3::ZERO;
        }

        let f = spring - pressing * n;
        let a = &mut self.bodies[i];
        a.force += f;
        a.moment += arm_i.cross(f);
        if let Some(b) = self.bodies.get_mut(j) {
            b.force -= f;
            b.moment -= meeting.arm_j.cross(f);
        }
        Memory { spring, normal: n }
    }

    pub fn grains(&self) -> Vec<Grain> {
        let now = |(g, b): (&Grain, &Body)| Grain { position: b.x, velocity: b.v, spin: b.w, ..*g };
        self.scene.grains.iter().zip(&self.bodies).map(now).collect()
    }
}

/// Rodrigues: the rotation about `from` × `to` that takes `from` to `to`, applied to f.
fn turn(f: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let axis = from.cross(to);
    let sine = axis.length();
    if sine == 0.0 {
        return f;
    }
    let k = axis / sine;
    let cosine = from.dot(to);
    f * cosine + k.cross(f) * sine + k * k.dot(f) * (1.0 - cosine)
}
