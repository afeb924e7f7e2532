//! A scene that goes on from the last state of another one.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use glam::DVec3;
use serde::Serialize;

use super::check::AXES;
use super::origin::GoingOn;
use super::schema::{self, Population, Tilt, WallKind};
use super::{Domain, Scene, Surface, Wall, walls};
use crate::{Error, Result};

/// How far a wall of an [`Assembly`](super::Assembly) has moved, m.
#[derive(Clone, Debug, PartialEq)]
pub struct Shift {
    pub wall: String,
    pub by: DVec3,
    /// Of a plane that has turned.
    pub normal: Option<DVec3>,
    /// Of a cylinder whose radius has changed, m.
    pub radius: Option<f64>,
}

impl Shift {
    /// From where a wall was to where it is.
    pub fn between(before: &Wall, now: &Wall) -> Shift {
        let mut radius = None;
        let (by, normal) = match (before.surface, now.surface) {
            (Surface::Plane { point, normal }, Surface::Plane { point: to, normal: turned }) => {
                let along = (to - point).dot(normal);
                match () {
                    () if (turned - normal).length() > ROUNDING => (to - point, Some(turned)),
                    // Planes have no place along themselves.
                    () if along.abs() <= ROUNDING * point.length() => (DVec3::ZERO, None),
                    () => (along * normal, None),
                }
            }
            (Surface::Cylinder { center, radius: before }, Surface::Cylinder { center: to, radius: now }) => {
                radius = (now != before).then_some(now);
                (to - center, None)
            }
            _ => unreachable!("a wall stays what it is"),
        };
        Shift { wall: before.name.clone(), by, normal, radius }
    }
}

/// Parts of a coordinate that nothing has moved by.
const ROUNDING: f64 = 1e-14;

/// A scene with the grains of another one.
#[derive(Clone, Debug)]
pub struct Continued {
    pub scene: Scene,
    /// Single grains and clumps that come before those of the other scene.
    pub singles: usize,
    pub walls: KeptWalls,
    /// What is as it was there, and what is not.
    pub notices: Vec<String>,
}

/// The walls that two scenes have in common: their names there and here. A box stands for its planes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeptWalls(Vec<[String; 2]>);

impl KeptWalls {
    /// What a wall of the other scene is called in this one, if it is there.
    pub fn now(&self, name: &str) -> Option<String> {
        // What is behind the name of a box is its face.
        let face = |before: &String| {
            name.strip_prefix(before.as_str()).filter(|face| face.is_empty() || face.starts_with(' '))
        };
        self.0.iter().find_map(|[before, now]| Some(format!("{now}{}", face(before)?)))
    }
}

impl Continued {
    /// The periodic cell of the other run, which was given the scene `given`, has become this one. A scene with the same
    /// domain goes on with it, or the grains would not fit.
    pub fn follow_cell(&mut self, given: &Scene, now: &Domain) {
        let Some(domain) = &mut self.scene.file.domain else { return };
        if Some(&*domain) != given.file.domain.as_ref() {
            let what =
                "is as the scene says, where it was given elsewhere, and not as the cell of the run before has become";
            self.notices.push(format!("the domain {what}"));
            return;
        }
        for (axis, upper) in domain.upper.iter_mut().enumerate().filter(|(axis, _)| now.periodic[*axis]) {
            *upper = now.upper[axis];
        }
        let DVec3 { x: yz, y: xz, z: xy } = now.tilt;
        domain.tilt = Some(Tilt { yz, xz, xy });
        self.notices.push("the cell has deformed, and goes on from what it is".to_owned());
    }
}

impl Scene {
    /// This scene with the grains of a binary file, in which are all of another run as they are now. That run was given
    /// the scene `given`, and has run it as `old`. Single grains and populations that are given in both are in that file,
    /// and not made anew. Walls that are given in both, whatever their velocity and material, are where they have moved
    /// to; those without a name are known by their place.
    ///
    /// # Errors
    /// [`Error::Scene`] if a single grain or population was given otherwise, so that it cannot be told whether it is to be
    /// added, or the name of the file is no text.
    pub fn continued(&self, given: &Scene, old: &Scene, start: &Path, shifts: &[Shift]) -> Result<Continued> {
        let mut file = self.file.clone();
        // Grains go on with the radii that they have.
        file.growth.iter_mut().for_each(|growth| growth.initial = None);
        let mut notices = Vec::new();
        let (grains, populations) = self.all_added(given)?;
        let mut added = grains.into_iter();
        file.grain.retain(|_| added.next().unwrap_or(true));
        let added = populations;
        for (number, added) in added.iter().enumerate() {
            let what = match &file.population[number].insertion {
                _ if *added => "is added",
                Some(_) => "is there already as far as it has come in, and no more of it comes",
                None => "is there already",
            };
            notices.push(format!("population.{number} {what}"));
        }
        let mut added = added.into_iter();
        file.population.retain(|_| added.next().unwrap_or(true));
        // Overlaps that have come about are none that somebody has made by mistake, and where packstone places grains
        // there are none.
        let placed = file.population.iter().all(|population| population.file.is_none());
        file.solver.allow_overlap |= file.grain.is_empty() && placed;
        if !file.grain.is_empty() {
            notices.push(format!("{} single grains are added", file.grain.len()));
        }
        let mut left: Vec<Option<&schema::Wall>> = given.file.wall.iter().map(Some).collect();
        let mut kept = KeptWalls::default();
        for (number, wall) in file.wall.iter_mut().enumerate() {
            let mut name = walls::name(wall, number);
            let stays = |other: &schema::Wall| place(other) == place(wall);
            let same = |other: &schema::Wall| other.name == wall.name && (wall.name.is_some() || stays(other));
            let known = left.iter().position(|other| other.is_some_and(same));
            let there = known.and_then(|k| left[k].take().zip(old.file.wall.get(k)));
            let stays = there.is_some_and(|(given, _)| stays(given));
            let before = known.map(|k| walls::name(&given.file.wall[k], k)).unwrap_or_default();
            if there.is_some() {
                kept.0.push([before.clone(), name.clone()]);
            }
            if there.is_some() && wall.name.is_none() {
                name += &format!(", which has no name and is known by its place as {before} of the run before,");
            }
            let what = match there.filter(|_| stays) {
                Some((_, old)) if carry(wall, old, &before, shifts) => "has moved, and goes on from where it is",
                Some(_) => "has not moved",
                None => "is new, or was given elsewhere: it is as the scene says",
            };
            notices.push(format!("wall {name} {what}"));
        }
        for (number, wall) in left.into_iter().enumerate().filter_map(|(k, wall)| Some((k, wall?))) {
            let by = if wall.name.is_some() { "of that name" } else { "in its place, and it had no name" };
            let name = walls::name(wall, number);
            notices.push(format!("wall {name} of the run before is gone: the scene has none {by}"));
        }
        let path = start.to_str().ok_or_else(|| Error::Scene(format!("{}: is no text", start.display())))?;
        let grains = toml::Table::from_iter([("file".to_owned(), path.into())]);
        let grains: Population = grains.try_into().expect("a population may be a file");
        file.population.insert(0, grains);
        let singles = file.grain.len();
        let made = SystemTime::now();
        let going_on = Some(GoingOn { start: start.to_owned(), given: self.text(&[])? });
        let scene =
            Scene { file, text: None, made, going_on, origin: self.origin.clone(), stages: Vec::new(), common: None };
        Ok(Continued { scene, singles, walls: kept, notices })
    }

    /// The file with those grains alone that were not given to the run before.
    pub(super) fn file_added(&self, given: &Scene) -> Result<schema::File> {
        let mut file = self.file.clone();
        let (grains, populations) = self.all_added(given)?;
        let (mut grains, mut populations) = (grains.into_iter(), populations.into_iter());
        file.grain.retain(|_| grains.next().unwrap_or(true));
        file.population.retain(|_| populations.next().unwrap_or(true));
        file.growth.iter_mut().for_each(|growth| growth.initial = None);
        Ok(file)
    }

    /// Which single grains, and which populations, were not given to the run before.
    fn all_added(&self, given: &Scene) -> Result<(Vec<bool>, Vec<bool>)> {
        let (mut grains, mut populations) = (&given.file.grain[..], &given.file.population[..]);
        if let Some((of_grains, of_populations)) = self.common {
            grains = &grains[..of_grains.min(grains.len())];
            populations = &populations[..of_populations.min(populations.len())];
        }
        let grains = self.added("grain", &self.file.grain, grains)?;
        Ok((grains, self.added("population", &self.file.population, populations)?))
    }

    /// Which parts of a kind are not among those that were given before, of which each counts once. One that is given
    /// otherwise in the same place is refused.
    fn added<T: Serialize>(&self, kind: &str, parts: &[T], given: &[T]) -> Result<Vec<bool>> {
        let [parts, given] = [parts, given].map(|parts| parts.iter().map(table).collect::<Vec<_>>());
        let mut left: Vec<Option<&toml::Value>> = given.iter().map(Some).collect();
        let mut added = Vec::new();
        for part in &parts {
            let same = left.iter_mut().find(|other| **other == Some(part));
            added.push(same.map(Option::take).is_none());
        }
        for (number, part) in parts.iter().enumerate().filter(|(number, _)| added[*number]) {
            if let Some(Some(other)) = left.get(number) {
                return Err(Error::Scene(format!(
                    "{}: {kind}.{number}: {} not as given to the run before, whose grains are there already; leave it as it was, \
                     or take it out, and put what is to be added behind",
                    self.origin.name,
                    differences(part, other)
                )));
            }
        }
        Ok(added)
    }

    /// The file that was made for this scene, and that nobody else keeps.
    pub fn start(&self) -> Option<&PathBuf> {
        self.going_on.as_ref().map(|going_on| &going_on.start)
    }

    /// The scene as it was given, with all overrides in it.
    ///
    /// # Errors
    /// As [`Scene::text`].
    pub fn given(&self) -> Result<String> {
        self.going_on.as_ref().map_or_else(|| self.text(&[]), |going_on| Ok(going_on.given.clone()))
    }
}

fn table(part: &impl Serialize) -> toml::Value {
    toml::Value::try_from(part).expect("it was a table of a scene")
}

/// The keys with another value, as a subject.
fn differences(part: &toml::Value, other: &toml::Value) -> String {
    let keys =
        |part: &toml::Value| part.as_table().into_iter().flat_map(toml::Table::keys).cloned().collect::<Vec<_>>();
    let all: BTreeSet<String> = [part, other].into_iter().flat_map(keys).collect();
    let different: Vec<_> = all.into_iter().filter(|key| part.get(key) != other.get(key)).collect();
    format!("{} {}", different.join(", "), if different.len() == 1 { "is" } else { "are" })
}

/// A wall without what may change while it stays where it is.
fn place(wall: &schema::Wall) -> toml::Value {
    table(&schema::Wall {
        material: String::new(),
        velocity: None,
        spin: None,
        start: None,
        stop: None,
        oscillation: None,
        turning: None,
        table: None,
        target_force: None,
        target_pressure: None,
        area: None,
        gain: None,
        max_speed: None,
        inertial_number: None,
        ..wall.clone()
    })
}

/// Bring a wall to where `old` has moved to: whether it has.
fn carry(wall: &mut schema::Wall, old: &schema::Wall, name: &str, shifts: &[Shift]) -> bool {
    let of = |name: &str| shifts.iter().find(|shift| shift.wall == name).map(|shift| shift.by);
    let shift = shifts.iter().find(|shift| shift.wall == name);
    let (turned, grown) = (shift.and_then(|shift| shift.normal), shift.and_then(|shift| shift.radius));
    let add = |point: &mut Option<Vec<f64>>, by: DVec3| {
        point.iter_mut().flatten().zip(by.to_array()).for_each(|(x, by)| *x += by);
    };
    let before = table(wall);
    (wall.point, wall.center) = (old.point.clone(), old.center.clone());
    (wall.lower, wall.upper) = (old.lower.clone(), old.upper.clone());
    wall.radius = grown.or(old.radius);
    match wall.kind {
        WallKind::Plane => {
            wall.normal = old.normal.clone();
            if let Some((normal, turned)) = wall.normal.as_mut().zip(turned) {
                normal.iter_mut().zip(turned.to_array()).for_each(|(x, now)| *x = now);
            }
            add(&mut wall.point, of(name).unwrap_or_default());
        }
        WallKind::Cylinder => add(&mut wall.center, of(name).unwrap_or_default()),
        WallKind::Box => {
            // A face that is not there moves with the one opposite.
            let side = |signs: [&str; 2]| {
                let face = |axis: usize| {
                    signs.iter().find_map(|sign| of(&format!("{name} {}{sign}", AXES[axis]))).map_or(0.0, |by| by[axis])
                };
                DVec3::new(face(0), face(1), face(2))
            };
            let (lower, upper) = (side(["-", "+"]), side(["+", "-"]));
            add(&mut wall.lower, lower);
            add(&mut wall.upper, upper);
        }
    }
    table(wall) != before
}

#[cfg(test)]
mod tests {
    use super::*;

    const OLD: &str = r#"
dimension = 3
[material.glass]
density = 2500
normal_stiffness = 1e3
[[wall]]
kind = "box"
name = "box"
material = "glass"
lower = [0, 0, 0]
upper = [1, 1, 1]
faces = ["z-", "x+"]
[[wall]]
kind = "plane"
name = "lid"
material = "glass"
point = [0, 0, 2]
normal = [0, 0, -1]
velocity = [0, 0, -1]
[[population]]
material = "glass"
count = 5
radius = 0.1
"#;

    fn scene(text: &str) -> Scene {
        Scene::parse(text, "scene", Path::new(""), &[]).unwrap()
    }

    #[test]
    fn what_both_have_goes_on_and_the_rest_is_new() {
        let new = OLD.replace("velocity = [0, 0, -1]", "velocity = [0, 0, 0]").replace("1e3", "2e3")
            + "[[population]]\nmaterial = \"glass\"\ncount = 2\nradius = 0.2\n\
               [[grain]]\nmaterial = \"glass\"\nposition = [0.5, 0.5, 0.5]\nradius = 0.1\n";
        let shift = |wall: &str, by| Shift { wall: wall.to_owned(), by, normal: None, radius: None };
        let shifts = [shift("box z-", DVec3::new(0.0, 0.0, 0.25)), shift("lid", DVec3::new(0.0, 0.0, -0.5))];
        let Continued { scene, singles, notices, .. } =
            scene(&new).continued(&scene(OLD), &scene(OLD), Path::new("/start.bin"), &shifts).unwrap();
        let file = &scene.file;
        assert_eq!(file.population.iter().map(|p| p.count).collect::<Vec<_>>(), [None, Some(2)]);
        assert_eq!(file.population[0].file.as_deref(), Some("/start.bin"));
        assert_eq!((singles, file.grain.len()), (1, 1));
        assert_eq!(file.wall[0].lower, Some(vec![0.0, 0.0, 0.25]));
        // That there is no upper face.
        assert_eq!(file.wall[0].upper, Some(vec![1.0, 1.0, 1.25]));
        assert_eq!(file.wall[1].point, Some(vec![0.0, 0.0, 1.5]));
        let said = [
            "population.0 is there already",
            "population.1 is added",
            "1 single grains are added",
            "wall box has moved, and goes on from where it is",
            "wall lid has moved, and goes on from where it is",
        ];
        assert_eq!(notices, said);
        let elsewhere = OLD.replace("point = [0, 0, 2]", "point = [0, 0, 3]");
        let old = super::tests::scene(OLD);
        let start = Path::new("/start.bin");
        let other = super::tests::scene(&elsewhere).continued(&old, &old, start, &shifts).unwrap();
        assert_eq!(other.scene.file.wall[1].point, Some(vec![0.0, 0.0, 3.0]));
        assert_eq!(other.notices[2], "wall lid is new, or was given elsewhere: it is as the scene says");
        // What could be meant either way.
        let faster = super::tests::scene(&OLD.replace("radius = 0.1", "radius = 0.1\nvelocity = [0, 1, 0]"));
        let message = faster.continued(&old, &old, start, &shifts).unwrap_err().to_string();
        assert!(message.contains("population.0: velocity is not as given"), "{message}");
        let renamed = super::tests::scene(&OLD.replace("\"lid\"", "\"piston\""));
        let notices = renamed.continued(&old, &old, start, &shifts).unwrap().notices;
        assert!(notices.last().unwrap().starts_with("wall lid of the run before is gone"), "{notices:?}");
        // Without a name it is its place that counts, and not its number.
        let nameless = super::tests::scene(&OLD.replace("name = \"lid\"\n", ""));
        let first =
            "[[wall]]\nkind = \"plane\"\nmaterial = \"glass\"\npoint = [0, 0, -1]\nnormal = [0, 0, 1]\n[[wall]]";
        let shifted = super::tests::scene(&OLD.replace("name = \"lid\"\n", "").replacen("[[wall]]", first, 1));
        let moved = [shift("plane 1", DVec3::new(0.0, 0.0, -0.5))];
        let Continued { scene: other, walls, notices, .. } =
            shifted.continued(&nameless, &nameless, start, &moved).unwrap();
        assert_eq!(other.file.wall[2].point, Some(vec![0.0, 0.0, 1.5]));
        assert_eq!(walls.now("plane 1").as_deref(), Some("plane 2"));
        assert_eq!(walls.now("box x+").as_deref(), Some("box x+"));
        assert_eq!(walls.now("plane 10"), None);
        let said = "wall plane 2, which has no name and is known by its place as plane 1 of the run before, has moved, \
                    and goes on from where it is";
        assert!(notices.iter().any(|notice| notice == said), "{notices:?}");
        // Once more: the lid goes on from where it had gone on from.
        let given = super::tests::scene(&scene.given().unwrap());
        let third = super::tests::scene(&new).continued(&given, &scene, start, &shifts[1..]).unwrap();
        assert_eq!(third.scene.file.population.len(), 1);
        assert_eq!(third.scene.file.wall[1].point, Some(vec![0.0, 0.0, 1.0]));
        assert_eq!(third.scene.file.wall[0].lower, Some(vec![0.0, 0.0, 0.25]));
    }
}
