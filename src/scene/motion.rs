//! How walls move: translation, oscillation, along a table, and turning, each a function of time that is evaluated in f64.

use std::f64::consts::TAU;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::check::{Check, show};
use super::origin::read_text;
use super::rows::{Separator, lines, number};
use super::schema::{self, WallKind};
use crate::{Error, Result};

/// How a wall moves besides its constant velocity and spin. All of it, and these, take place from `start` until `stop`.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// s
    pub start: f64,
    pub stop: f64,
    pub oscillation: Option<Oscillation>,
    pub turning: Option<Turning>,
    /// Times since the start, s, ascending, and how far the wall is then from where it began, m; linear in between.
    pub table: Vec<(f64, DVec3)>,
}

/// amplitude × sin(2π frequency t), over and over, or one period in every `interval`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oscillation {
    /// m
    pub amplitude: DVec3,
    /// 1/s
    pub frequency: f64,
    /// s
    pub interval: Option<f64>,
}

/// About an axis through a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turning {
    pub point: DVec3,
    /// Of length 1.
    pub axis: DVec3,
    /// rad/s
    pub rate: f64,
}

impl Default for Motion {
    fn default() -> Motion {
        Motion { start: 0.0, stop: f64::INFINITY, oscillation: None, turning: None, table: Vec::new() }
    }
}

impl Oscillation {
    fn at(&self, time: f64) -> DVec3 {
        let phase = match self.interval {
            Some(interval) => ((time % interval) * self.frequency).min(1.0),
            // Whole periods change nothing but the digits.
            None => (time * self.frequency).fract(),
        };
        (TAU * phase).sin() * self.amplitude
    }
}

impl Motion {
    /// For how long there has been motion at this time, s.
    pub fn lasted(&self, time: f64) -> f64 {
        (time.min(self.stop) - self.start).max(0.0)
    }

    /// How far the wall is from where it began, after it has moved for so long, m; not by its velocity or by turning.
    pub fn deviation(&self, lasted: f64) -> DVec3 {
        let next = self.table.partition_point(|(time, _)| *time <= lasted);
        let of_table = match (next.checked_sub(1).map(|k| self.table[k]), self.table.get(next)) {
            (Some((time, from)), Some((end, to))) => from.lerp(*to, (lasted - time) / (end - time)),
            (Some((_, at)), None) | (None, Some(&(_, at))) => at,
            (None, None) => DVec3::ZERO,
        };
        self.oscillation.map_or(DVec3::ZERO, |oscillation| oscillation.at(lasted)) + of_table
    }

    /// The largest speed of that, m/s.
    pub fn top_speed(&self) -> f64 {
        let slope = |pair: &[(f64, DVec3)]| (pair[1].1 - pair[0].1).length() / (pair[1].0 - pair[0].0);
        self.oscillation.map_or(0.0, |o| TAU * o.frequency * o.amplitude.length())
            + self.table.windows(2).map(slope).fold(0.0, f64::max)
    }
}

impl Turning {
    /// How far the axis is from the origin, m.
    pub fn distance(&self) -> f64 {
        self.point.reject_from_normalized(self.axis).length()
    }
}

/// The motion of a wall of the scene file, called `key`.
pub fn motion(wall: &schema::Wall, key: &str, check: &Check) -> Result<Motion> {
    let at = |field: &str| format!("{key}.{field}");
    let start = check.not_negative(&at("start"), wall.start.unwrap_or(0.0), " of s")?;
    if let Some(stop) = wall.stop.filter(|stop| !(*stop > start)) {
        return Err(check.origin.bad(&at("stop"), show(stop), "must be a number of s above that of start"));
    }
    let oscillation = wall.oscillation.as_ref().map(|given| {
        let at = |field: &str| format!("{key}.oscillation.{field}");
        let frequency = check.positive(&at("frequency"), given.frequency, " of 1/s")?;
        if let Some(interval) = given.interval.filter(|interval| !(interval * frequency >= 1.0)) {
            return Err(check.origin.bad(
                &at("interval"),
                show(interval),
                "must be at least one period, 1/frequency, in s",
            ));
        }
        let amplitude = check.vector(&at("amplitude"), &given.amplitude)?;
        Ok(Oscillation { amplitude, frequency, interval: given.interval })
    });
    let table = wall.table.as_ref().map(|file| {
        let path = check.origin.directory.join(file);
        read(&path, check.dimension).map_err(|error| check.origin.about(error))
    });
    Ok(Motion {
        start,
        stop: wall.stop.unwrap_or(f64::INFINITY),
        oscillation: oscillation.transpose()?,
        turning: wall.turning.as_ref().map(|given| turning(given, wall.kind, key, check)).transpose()?,
        table: table.transpose()?.unwrap_or_default(),
    })
}

fn turning(given: &schema::Turning, kind: WallKind, key: &str, check: &Check) -> Result<Turning> {
    let at = |field: &str| format!("{key}.turning.{field}");
    if kind == WallKind::Box {
        return Err(check
            .origin
            .wrong(&format!("{key}.turning"), "is for planes and cylinders; give its faces as planes"));
    }
    let axis = match (&given.axis, check.dimension) {
        (None, 2) => DVec3::Z,
        (Some(_), 2) => {
            return Err(check.origin.wrong(&at("axis"), "is that out of the plane (dimension = 2); leave it out"));
        }
        (None, _) => return Err(check.origin.wrong(&format!("{key}.turning"), "missing key `axis`")),
        (Some(axis), _) => check.vector(&at("axis"), axis)?.try_normalize().ok_or_else(|| {
            check.origin.wrong(&at("axis"), "must not be zero; the wall turns about it by the rule of the right hand")
        })?,
    };
    if kind == WallKind::Cylinder && axis.truncate() != DVec2::ZERO {
        return Err(check.origin.wrong(&at("axis"), "must be along z, as a cylinder stays upright"));
    }
    if !given.rate.is_finite() {
        return Err(check.origin.bad(&at("rate"), given.rate, "must be a finite number of rad/s"));
    }
    Ok(Turning { point: check.vector(&at("point"), &given.point)?, axis, rate: given.rate })
}

/// From a CSV file with the columns `time` and some of `x`, `y` and `z`.
fn read(path: &Path, dimension: usize) -> Result<Vec<(f64, DVec3)>> {
    let text = read_text(path, "a table of times and places")?;
    let fault = |line: usize, message: String| Error::Scene(format!("{}:{line}: {message}", path.display()));
    let mut lines = lines(&text);
    let mut values = Vec::new();
    let (header, line) = lines.next().ok_or_else(|| fault(1, "has no header line".to_owned()))?;
    let separator = Separator::of(header);
    separator.split(header, &mut values);
    let names: Vec<String> = values.iter().map(|name| (*name).to_owned()).collect();
    let axes = &["x", "y", "z"][..dimension];
    let known = |name: &String| name == "time" || axes.contains(&name.as_str());
    let twice = |(k, name): (usize, &String)| names[..k].contains(name);
    let time = names.iter().position(|name| name == "time");
    let Some(time) =
        time.filter(|_| names.len() > 1 && names.iter().all(known) && !names.iter().enumerate().any(twice))
    else {
        return Err(fault(line, format!("the columns must be \"time\" (s) and some of {} (m)", axes.join(", "))));
    };
    let mut table: Vec<(f64, DVec3)> = Vec::new();
    for (row, line) in lines {
        separator.split(row, &mut values);
        if values.len() != names.len() {
            return Err(fault(line, separator.unequal(values.len(), names.len())));
        }
        let number = |column: usize| number(&values, column).map_err(|message| fault(line, message));
        let of =
            |axis: usize| names.iter().position(|name| axes.get(axis) == Some(&name.as_str())).map_or(Ok(0.0), number);
        let (time, at) = (number(time)?, DVec3::new(of(0)?, of(1)?, of(2)?));
        if table.last().map_or(time < 0.0, |(before, _)| time <= *before) {
            return Err(fault(
                line,
                format!("time = {}: must be 0 or more, and above that of the row before", show(time)),
            ));
        }
        table.push((time, at));
    }
    let Some(&(_, first)) = table.first() else { return Err(fault(line, "has no rows".to_owned())) };
    // The wall begins where the scene has it.
    table.iter_mut().for_each(|(_, at)| *at -= first);
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_read_or_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("way.csv");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read(&path, 2).map_err(|error| error.to_string())
        };
        let way = read("# of the shaker\ntime; y\n0.5; 1\n2; 1.5\n").unwrap();
        assert_eq!(way, [(0.5, DVec3::ZERO), (2.0, DVec3::Y * 0.5)]);
        for (text, words) in [
            ("time\n1\n", "way.csv:1: the columns must be \"time\" (s) and some of x, y (m)"),
            ("time,z\n1,2\n", "the columns must be"),
            ("time,x,x\n1,2,3\n", "the columns must be"),
            ("time,x\n1,2\n1,3\n", "way.csv:3: time = 1: must be 0 or more, and above"),
            ("time,x\n-1,2\n", "way.csv:2: time = -1"),
            ("time,x\n1\n", "way.csv:2: has 1 values"),
            ("time,x\n1,a\n", "way.csv:2: value 2"),
            ("time,x\n", "way.csv:1: has no rows"),
        ] {
            let message = read(text).unwrap_err();
            assert!(message.contains(words), "{text}: {message}");
        }
    }
}
