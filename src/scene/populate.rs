//! Populations: many grains from a table, on a lattice or at random.

use std::{
    f64::consts::{PI, TAU},
    iter::repeat_n,
};

use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::apportion::apportioned;
use super::bodies::{Bodies, Placed, Pose, orientation};
use super::check::{AXES, Check, show, show_vector};
use super::neighbours::Neighbours;
use super::outlet;
use super::schema::{self, Mixture, Placement, Population, Radius};
use super::shape::{Shape, Shapes};
use super::table::{self, Materials};
use super::{Domain, Grain, Insertion, Region, Surface, Wall, grain_file, radius};
use crate::{Result, container::is_container, memory};

/// Trials per grain of random insertion.
const ATTEMPTS: usize = 10_000;

/// Everything that stands before a population is placed.
pub struct Site<'a> {
    pub domain: &'a Domain,
    pub walls: &'a [Wall],
    /// m/s²; the lattice is filled against it.
    pub gravity: DVec3,
    pub seed: u64,
}

/// Adds population number `number` to `bodies`: at once, or as grains that come in over time.
pub fn populate(
    population: &Population,
    number: usize,
    site: &Site,
    bodies: &mut Bodies,
    check: &Check,
) -> Result<Option<Insertion>> {
    let key = format!("population.{number}");
    // Spread out, so that neighbouring seeds share no population.
    let seed = site.seed ^ (number as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    // The seed is part of the scene, so the generator is one whose stream no version of a library changes.
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    refuse_foreign_keys(population, &key, check)?;
    let spread = population.velocity_spread;
    check.not_negative(&format!("{key}.velocity_spread"), spread, " of m/s")?;
    if population.fixed && spread > 0.0 {
        let rule = "must be 0 with fixed = true; each fixed grain would drift on its own for ever";
        return Err(check.origin.bad(&format!("{key}.velocity_spread"), show(spread), rule));
    }
    let mut insertion = None;
    let mut placed = if let Some(file) = &population.file {
        let options = table::Options {
            scale: check.positive(&format!("{key}.scale"), population.scale.unwrap_or(1.0), "")?,
            count: population.count,
            materials: materials(population, &key, check)?,
            radius: radius_of_all(population, &key, check)?,
            domain: site.domain,
        };
        let path = check.origin.directory.join(file);
        let mut placed = if is_container(&path) {
            grain_file::read(&path, &options, &mut bodies.shapes, check)?
        } else {
            table::read(&path, &options, &mut bodies.shapes, &mut bodies.notices, check)?
        };
        placed.grains.iter_mut().for_each(|grain| grain.radius *= check.initial[grain.material as usize]);
        placed
    } else {
        let (placed, over_time) = place(population, &key, site, bodies, &mut rng, check)?;
        insertion = over_time.map(|insertion| Insertion { seed, ..insertion });
        placed
    };
    let velocity = check.vector_or_zero(&format!("{key}.velocity"), population.velocity.as_deref())?;
    for grain in &mut placed.grains {
        grain.fixed |= population.fixed;
        grain.velocity += velocity;
        if spread > 0.0 {
            for axis in 0..check.dimension {
                let sample: f64 = StandardNormal.sample(&mut rng);
                grain.velocity[axis] += spread * sample;
            }
        }
    }
    bodies.append(placed);
    Ok(insertion)
}

fn refuse_foreign_keys(population: &Population, key: &str, check: &Check) -> Result<()> {
    let from_file = population.file.is_some();
    let placing = [
        ("shape", population.shape.is_some()),
        ("orientation", population.orientation.is_some()),
        ("placement", population.placement.is_some()),
        ("gap", population.gap.is_some()),
        ("region", population.region.is_some()),
        ("insertion", population.insertion.is_some()),
    ];
    if let Some((field, _)) = placing.iter().find(|(_, set)| *set && from_file) {
        let message = "does not go with `file`, which gives every position, radius and shape";
        return Err(check.origin.wrong(&format!("{key}.{field}"), message));
    }
    if population.scale.is_some() && !from_file {
        let message = "goes with `file` only";
        return Err(check.origin.wrong(&format!("{key}.scale"), message));
    }
    if population.orientation.is_some() && population.shape.is_none() {
        return Err(check.origin.wrong(&format!("{key}.orientation"), "goes with `shape` only"));
    }
    let random = population.placement == Some(Placement::Random);
    if population.gap.is_some() && random {
        let message = "goes with placement = \"lattice\" only";
        return Err(check.origin.wrong(&format!("{key}.gap"), message));
    }
    let not_over_time =
        [("placement", population.placement.is_some()), ("gap", population.gap.is_some()), ("fixed", population.fixed)];
    if let Some((field, _)) = not_over_time.iter().find(|(_, set)| *set && population.insertion.is_some()) {
        let message = "does not go with `insertion`: grains that come in over time are placed at random, and are free";
        return Err(check.origin.wrong(&format!("{key}.{field}"), message));
    }
    if population.count == Some(0) {
        return Err(check.origin.bad(&format!("{key}.count"), 0, "must be at least 1"));
    }
    Ok(())
}

/// What the grains of a file are made of.
fn materials<'a>(population: &'a Population, key: &str, check: &Check) -> Result<Materials<'a>> {
    let key = format!("{key}.material");
    let types = match &population.material {
        None => return Ok(Materials::Named),
        Some(schema::Materials::All(name)) => return Ok(Materials::All(check.material(&key, name)?)),
        Some(schema::Materials::Types(types)) => types,
    };
    let of_type =
        |(kind, name): (&'a String, &String)| Ok((kind.as_str(), check.material(&format!("{key}.{kind}"), name)?));
    Ok(Materials::Types(types.iter().map(of_type).collect::<Result<_>>()?))
}

/// The radius of the grains of a file that has none, m.
fn radius_of_all(population: &Population, key: &str, check: &Check) -> Result<Option<f64>> {
    let key = format!("{key}.radius");
    match &population.radius {
        None => Ok(None),
        Some(Radius::Constant(radius)) => Ok(Some(check.positive(&key, *radius, " of m")?)),
        Some(Radius::Distribution(_)) => {
            Err(check.origin.wrong(&key, "must be one number with `file`, for files that have no radii"))
        }
    }
}

fn place(
    population: &Population,
    key: &str,
    site: &Site,
    earlier: &mut Bodies,
    rng: &mut ChaCha8Rng,
    check: &Check,
) -> Result<(Placed, Option<Insertion>)> {
    let missing = |field: &str| {
        let message = format!("missing key `{field}`; a population needs `file`, or `material`, `count` and `radius`");
        check.origin.wrong(key, message)
    };
    let material = match materials(population, key, check)? {
        Materials::All(material) => material,
        Materials::Named => return Err(missing("material")),
        Materials::Types(_) => {
            let message = "a table of types goes with `file` only; a population is of one material";
            return Err(check.origin.wrong(&format!("{key}.material"), message));
        }
    };
    let count = population.count.ok_or_else(|| missing("count"))?;
    memory::check_host(memory::of_grains(count as u64))?;
    let law = population.radius.as_ref().ok_or_else(|| missing("radius"))?;
    let radius::Drawn { mut radii, notices } = radius::draw(law, &format!("{key}.radius"), count, rng, check)?;
    earlier.notices.extend(notices);
    radii.iter_mut().for_each(|radius| *radius *= check.initial[material as usize]);
    if let Some(radius) = radii.par_iter().find_first(|radius| check.fault_of_body(**radius, material).is_some()) {
        check.body(&format!("{key}.radius"), *radius, material)?;
    }
    let gap = population.gap.unwrap_or(0.05);
    check.not_negative(&format!("{key}.gap"), gap, " (a fraction of the diameter)")?;

    let poses = poses(population, key, count, &mut earlier.shapes, rng, check)?;
    let shapes = &earlier.shapes.all;
    let members = poses.iter().flatten().map(|pose| shapes[pose.shape as usize].members.len() as u64).sum::<u64>();
    memory::check_host(memory::of_grains(members))?;
    let grain = |radius: &f64| Grain {
        position: DVec3::ZERO,
        velocity: DVec3::ZERO,
        spin: DVec3::ZERO,
        radius: *radius,
        material,
        fixed: false,
    };
    let mut grains = Vec::new();
    memory::reserve(&mut grains, count)?;
    grains.extend(radii.iter().map(grain));
    let mut placed = Placed { grains, poses, numbers: None };
    let reaches = match &placed.poses {
        None => radii,
        Some(poses) => radii.iter().zip(poses).map(|(r, pose)| r * shapes[pose.shape as usize].reach()).collect(),
    };

    let bounds = bounds(site, check);
    let Region { lower, upper, around } = region(population, key, bounds, check)?;
    let largest = reaches.iter().copied().fold(0.0, f64::max);
    if let Some(given) = &population.insertion {
        let flat = |x: DVec3| if check.dimension == 2 { x.with_z(0.0) } else { x };
        let space = Region { lower: flat(lower), upper: flat(upper), around };
        let insertion = Insertion::read(given, key, space, largest, check)?;
        // How far they may go is all that is known of their places.
        let known = |(bound, x): (DVec3, DVec3)| flat(DVec3::select(bound.is_finite_mask(), bound, x));
        let ends = [(bounds.0, lower), (bounds.1, upper)].map(known);
        for (grain, end) in placed.grains.iter_mut().zip(ends.into_iter().cycle()) {
            grain.position = end;
        }
        return Ok((placed, Some(insertion)));
    }
    let known = earlier.grains.iter().map(|grain| grain.radius);
    let mut neighbours = Neighbours::new(*site.domain, check.dimension, known.fold(largest, f64::max));
    for grain in &earlier.grains {
        neighbours.insert(grain.position, grain.radius);
    }
    let mut job = Job { key, site, check, shapes, lower, upper, around, largest, neighbours };
    let positions = match population.placement.unwrap_or(Placement::Lattice) {
        Placement::Lattice => job.lattice(&reaches, gap, rng)?,
        Placement::Random => job.random(&placed, &reaches, rng)?,
    };
    placed.grains.iter_mut().zip(positions).for_each(|(grain, position)| grain.position = position);
    Ok((placed, None))
}

/// Shape and orientation of every grain; none of a population of spheres.
fn poses(
    population: &Population,
    key: &str,
    count: usize,
    shapes: &mut Shapes,
    rng: &mut ChaCha8Rng,
    check: &Check,
) -> Result<Option<Vec<Pose>>> {
    let key_of = |field: &str| format!("{key}.{field}");
    let shares = match &population.shape {
        None => return Ok(None),
        Some(Mixture::All(name)) => vec![(shapes.named(|| key_of("shape"), name)?, 1.0)],
        Some(Mixture::Shares(table)) => {
            let share = |(name, share): (&String, &f64)| {
                let key = format!("{key}.shape.{name}");
                check.not_negative(&key, *share, ", the share of a shape")?;
                Ok((shapes.named(|| key.clone(), name)?, *share))
            };
            table.iter().map(share).collect::<Result<Vec<_>>>()?
        }
    };
    let total: f64 = shares.iter().map(|(_, share)| share).sum();
    if !(total > 0.0 && total.is_finite()) {
        return Err(check.origin.wrong(&key_of("shape"), "the shares must add up to a positive number"));
    }
    let fixed = match &population.orientation {
        Some(given) => orientation(given, &key_of("orientation"), check)?,
        None => None,
    };
    let weights: Vec<f64> = shares.iter().map(|(_, share)| *share).collect();
    let counts = apportioned(&weights, count);
    let mut shapes: Vec<u32> = shares.iter().zip(counts).flat_map(|((shape, _), n)| repeat_n(*shape, n)).collect();
    if shares.len() > 1 {
        shapes.shuffle(rng);
    }
    let pose = |shape| Pose { shape, orientation: fixed.unwrap_or_else(|| random_orientation(check.dimension, rng)) };
    Ok(Some(shapes.into_iter().map(pose).collect()))
}

/// Uniform on SO(3): the direction of a normal vector of four components. In the plane any angle.
fn random_orientation(dimension: usize, rng: &mut ChaCha8Rng) -> DQuat {
    if dimension == 2 {
        return DQuat::from_rotation_z(TAU * rng.random::<f64>());
    }
    loop {
        let [x, y, z, w]: [f64; 4] = std::array::from_fn(|_| StandardNormal.sample(rng));
        let q = DQuat::from_xyzw(x, y, z, w);
        if q.length() > 1e-6 {
            return q.normalize();
        }
    }
}

/// Corners of the space between upright walls, in the domain.
fn bounds(site: &Site, check: &Check) -> (DVec3, DVec3) {
    let (mut lower, mut upper) = (site.domain.lower, site.domain.upper);
    for wall in site.walls {
        match wall.surface {
            Surface::Plane { point, normal } => {
                for axis in 0..check.dimension {
                    if normal[axis] > 1.0 - 1e-12 {
                        lower[axis] = lower[axis].max(point[axis]);
                    } else if normal[axis] < -1.0 + 1e-12 {
                        upper[axis] = upper[axis].min(point[axis]);
                    }
                }
            }
            Surface::Cylinder { center, radius } => {
                for axis in 0..2 {
                    lower[axis] = lower[axis].max(center[axis] - radius);
                    upper[axis] = upper[axis].min(center[axis] + radius);
                }
            }
        }
    }
    (lower, upper)
}

/// The space a population may fill: what `region` has of it.
fn region(population: &Population, key: &str, (lower, upper): (DVec3, DVec3), check: &Check) -> Result<Region> {
    let Some(given) = &population.region else { return Ok(Region { lower, upper, around: None }) };
    let region = outlet::region(given, &format!("{key}.region"), check)?;
    Ok(Region { lower: lower.max(region.lower), upper: upper.min(region.upper), ..region })
}

/// One population on its way to its places.
struct Job<'a> {
    key: &'a str,
    site: &'a Site<'a>,
    check: &'a Check<'a>,
    shapes: &'a [Shape],
    lower: DVec3,
    upper: DVec3,
    /// A cylinder that it is in.
    around: Option<Surface>,
    /// Largest radius of the population, of clumps that of the ball around them, m.
    largest: f64,
    /// Grains placed so far.
    neighbours: Neighbours,
}

/// Lattice points along one axis.
struct Row {
    /// First point, m.
    start: f64,
    /// To the next point, m; negative if the row runs down the axis.
    step: f64,
    /// Points in the row; None if it never ends.
    count: Option<usize>,
    /// Each point moves by at most this, m.
    jitter: f64,
}

impl Job<'_> {
    /// Fills a jittered lattice from the bottom up and returns the positions in the order of `radii`.
    fn lattice(&self, radii: &[f64], gap: f64, rng: &mut ChaCha8Rng) -> Result<Vec<DVec3>> {
        let dimension = self.check.dimension;
        let (up, sign) = up(self.site.gravity, dimension);
        let mut rows = Vec::new();
        for axis in (0..dimension).filter(|&axis| axis != up) {
            self.need_bounds(axis, true, true)?;
            rows.push((axis, self.row(axis, gap)));
        }
        self.need_bounds(up, sign > 0.0, sign < 0.0)?;
        let layer: usize = rows.iter().filter_map(|(_, row)| row.count).fold(1, usize::saturating_mul);
        let column = self.column(up, sign, gap);
        let layers = column.count.unwrap_or(usize::MAX);
        rows.push((up, column));
        // Walls that leave no room must not keep an endless column busy for ever.
        let trials = layer.saturating_mul(layers).min(1_000_000 + 100 * radii.len());

        let mut positions = Vec::new();
        memory::reserve(&mut positions, radii.len())?;
        for trial in 0..trials {
            let Some(&radius) = radii.get(positions.len()) else {
                break;
            };
            let position = lattice_point(&rows, trial, rng);
            if self.is_free(position, radius) {
                positions.push(position);
            }
        }
        if positions.len() < radii.len() {
            let spacing = 2.0 * self.largest * (1.0 + gap);
            let detail = format!("on a lattice of spacing {} m", show(spacing));
            return Err(self.too_small(positions.len(), radii.len(), &detail, &self.ways_to_fit(radii, gap)));
        }
        Ok(positions)
    }

    /// Lattice points along an axis with two bounds, centred between them.
    fn row(&self, axis: usize, gap: f64) -> Row {
        let extent = self.upper[axis] - self.lower[axis];
        let (count, jitter) = self.fit(axis, extent, gap);
        let step = 2.0 * self.largest * (1.0 + gap);
        let middle = 0.5 * (self.lower[axis] + self.upper[axis]);
        Row { start: middle - 0.5 * step * (count as f64 - 1.0), step, count: Some(count), jitter }
    }

    /// Lattice points upwards, starting at the bottom.
    fn column(&self, axis: usize, sign: f64, gap: f64) -> Row {
        let extent = self.upper[axis] - self.lower[axis];
        let (count, jitter) = self.fit(axis, extent, gap);
        let bottom = if sign > 0.0 { self.lower } else { self.upper }[axis];
        Row {
            start: bottom + sign * (self.largest + jitter),
            step: sign * 2.0 * self.largest * (1.0 + gap),
            count: extent.is_finite().then_some(count),
            jitter,
        }
    }

    /// How many of the largest grains fit side by side, and how far each may be moved.
    fn fit(&self, axis: usize, extent: f64, gap: f64) -> (usize, f64) {
        let diameter = 2.0 * self.largest;
        let count = (extent / (diameter * (1.0 + gap)) * (1.0 + 1e-12)).floor();
        let jitter = gap * self.largest;
        // A slit narrower than the spacing still takes one grain.
        let slit = count < 1.0 && extent >= diameter * (1.0 - 1e-12);
        if slit && !self.wraps(axis) {
            return (1, jitter.min(0.5 * (extent - diameter)).max(0.0));
        }
        (count.max(0.0) as usize, jitter)
    }

    /// Random sequential insertion, the largest grains first because they need the most room. What a clump needs is
    /// what its members do, as it is turned.
    fn random(&mut self, placed: &Placed, reaches: &[f64], rng: &mut ChaCha8Rng) -> Result<Vec<DVec3>> {
        for axis in 0..self.check.dimension {
            self.need_bounds(axis, true, true)?;
        }
        let mut order: Vec<usize> = (0..reaches.len()).collect();
        order.sort_by(|&a, &b| reaches[b].total_cmp(&reaches[a]));
        let mut positions = memory::filled(DVec3::ZERO, reaches.len())?;
        let mut members = Vec::new();
        for (done, &index) in order.iter().enumerate() {
            placed.spheres(index, self.shapes, &mut members);
            let free = |position: DVec3| members.iter().all(|m| self.is_free(position + m.position, m.radius));
            // Members are asked for their place in the region one by one where the clump is not a ball.
            let inset = if members.len() == 1 { reaches[index] } else { 0.0 };
            let inside = |position: DVec3| members.len() == 1 || self.holds(position, &members);
            let mut trials = (0..ATTEMPTS).filter_map(|_| self.random_point(inset, rng));
            let Some(position) = trials.find(|&position| inside(position) && free(position)) else {
                return Err(self.too_small(done, reaches.len(), "at random", ""));
            };
            members.iter().for_each(|m| self.neighbours.insert(position + m.position, m.radius));
            positions[index] = position;
        }
        Ok(positions)
    }

    /// Whether all members of a clump at this position are inside the region.
    fn holds(&self, position: DVec3, members: &[Grain]) -> bool {
        (0..self.check.dimension).filter(|axis| !self.wraps(*axis)).all(|axis| {
            members.iter().all(|m| {
                let x = position[axis] + m.position[axis];
                x - m.radius >= self.lower[axis] && x + m.radius <= self.upper[axis]
            })
        })
    }

    /// A point for a grain that lies inside the region as a whole; None if the region is too narrow for it.
    fn random_point(&self, radius: f64, rng: &mut ChaCha8Rng) -> Option<DVec3> {
        let mut point = DVec3::ZERO;
        for axis in 0..self.check.dimension {
            let inset = if self.wraps(axis) { 0.0 } else { radius };
            let (low, high) = (self.lower[axis] + inset, self.upper[axis] - inset);
            if low > high {
                return None;
            }
            point[axis] = low + (high - low) * rng.random::<f64>();
        }
        Some(point)
    }

    /// Whether a grain touches neither a wall nor a grain placed earlier.
    fn is_free(&self, position: DVec3, radius: f64) -> bool {
        let clear = radius * (1.0 - 1e-9);
        let mut surfaces = self.site.walls.iter().map(|wall| &wall.surface).chain(&self.around);
        surfaces.all(|surface| surface.distance(position) >= clear)
            && self.neighbours.find_overlap(position, radius, false, |_, _| true).is_none()
    }

    /// Whether the region reaches around the domain along a periodic axis.
    fn wraps(&self, axis: usize) -> bool {
        let domain = self.site.domain;
        domain.periodic[axis] && self.lower[axis] == domain.lower[axis] && self.upper[axis] == domain.upper[axis]
    }

    fn need_bounds(&self, axis: usize, below: bool, above: bool) -> Result<()> {
        let bounded = |needed: bool, bound: f64| !needed || bound.is_finite();
        if bounded(below, self.lower[axis]) && bounded(above, self.upper[axis]) {
            return Ok(());
        }
        let message = format!(
            "the space along {} has no bounds; give `region = {{ lower, upper }}`, a [domain] or walls",
            AXES[axis]
        );
        Err(self.check.origin.wrong(self.key, message))
    }

    /// What would let grains fit that a lattice has no room for.
    fn ways_to_fit(&self, radii: &[f64], gap: f64) -> String {
        let dimension = self.check.dimension;
        let extents: Vec<f64> = (0..dimension).map(|axis| self.upper[axis] - self.lower[axis]).collect();
        let width = 2.0 * self.largest;
        if let Some(axis) = (0..dimension).find(|axis| extents[*axis] < width) {
            return format!(
                "along {} the space is {} m wide, and the largest grain {} m: ",
                AXES[axis],
                show(extents[axis]),
                show(width)
            );
        }
        let mut ways = String::new();
        if self.random_fits(radii, &extents) {
            ways += "take placement = \"random\", which needs no room for the largest at every place, ";
        }
        let sites: f64 = extents.iter().map(|extent| (extent / width).floor()).product();
        if gap > 0.0 && sites >= radii.len() as f64 {
            ways += "take gap = 0, ";
        }
        ways
    }

    /// Whether they are few enough for random insertion.
    fn random_fits(&self, radii: &[f64], extents: &[f64]) -> bool {
        /// Where insertion becomes hopeless, in two and three dimensions.
        const FULL: [f64; 2] = [0.5, 0.3];
        let dimension = extents.len();
        let ball = if dimension == 2 { PI } else { 4.0 / 3.0 * PI };
        let grains: f64 = radii.iter().map(|r| ball * r.powi(dimension as i32)).sum();
        let room: f64 = extents.iter().product();
        room.is_finite() && grains < FULL[dimension - 2] * room
    }

    fn too_small(&self, fit: usize, count: usize, detail: &str, ways: &str) -> crate::Error {
        let dimension = self.check.dimension;
        let message = format!(
            "only {fit} of count = {count} grains fit {detail} between {} and {}; {ways}take a larger region, fewer or smaller grains",
            show_vector(self.lower, dimension),
            show_vector(self.upper, dimension)
        );
        self.check.origin.wrong(self.key, message)
    }
}

/// The axis that points most against gravity and the direction along it. Without gravity: the last axis.
fn up(gravity: DVec3, dimension: usize) -> (usize, f64) {
    let mut up = dimension - 1;
    for axis in 0..dimension {
        if gravity[axis].abs() > gravity[up].abs() {
            up = axis;
        }
    }
    (up, if gravity[up] > 0.0 { -1.0 } else { 1.0 })
}

/// Point number `index` of a lattice whose first row runs fastest.
fn lattice_point(rows: &[(usize, Row)], mut index: usize, rng: &mut ChaCha8Rng) -> DVec3 {
    let mut point = DVec3::ZERO;
    for (axis, row) in rows {
        let count = row.count.unwrap_or(usize::MAX);
        let shift = row.jitter * (2.0 * rng.random::<f64>() - 1.0);
        point[*axis] = row.start + row.step * (index % count) as f64 + shift;
        index /= count;
    }
    point
}
