//! Text files with a sphere or disk in every row: tables of our own, and files of particle codes.

use glam::DVec3;

use super::check::show;
use super::rows::{Parsed, Separator, number, quoted};

/// The columns of grains, those of a `diameter` in place of a `radius` and `xs`, `ys`, `zs` in place of `x`, `y`, `z`
/// aside.
pub const COLUMNS: [&str; 17] =
    ["id", "x", "y", "z", "radius", "vx", "vy", "vz", "wx", "wy", "wz", "material", "shape", "qw", "qx", "qy", "qz"];

/// In which line something is wrong, and what.
pub type Fault = (usize, String);
pub type Found<T> = std::result::Result<T, Fault>;

/// Rows with the same columns.
pub struct Rows<'a> {
    /// Their names; in files of particle codes those of columns that say nothing here are empty.
    pub columns: Vec<&'a str>,
    pub separator: Separator,
    /// The line that says so.
    pub header: usize,
    /// The rows themselves, with the numbers of their lines.
    pub lines: Vec<(&'a str, usize)>,
}

/// A file, in parts.
pub struct Sheet<'a> {
    pub rows: Rows<'a>,
    /// Velocities of the same grains, in the same order, in rows of their own.
    pub velocities: Option<Rows<'a>>,
    /// Whether a particle code wrote it. Its grains may stand out of their periods.
    pub foreign: bool,
    /// Its box, of which `xs`, `ys` and `zs` are parts.
    pub bounds: Option<Bounds>,
    pub notices: Vec<String>,
}

/// The box of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Its corner.
    pub lower: DVec3,
    /// Lengths along the axes.
    pub lengths: DVec3,
    /// How far the third edge leads along y and along x, and the second along x.
    pub tilt: DVec3,
}

impl Bounds {
    /// From its edges, which must be one along x, one in the plane x-y, and one beyond.
    pub fn of_edges(lower: DVec3, [a, b, c]: [DVec3; 3], line: usize) -> Found<Bounds> {
        if [a.y, a.z, b.z] != [0.0; 3] {
            let message = "the box is turned: its first edge must be along x, its second one in the plane x-y";
            return Err((line, message.to_owned()));
        }
        Ok(Bounds { lower, lengths: DVec3::new(a.x, b.y, c.z), tilt: DVec3::new(c.y, c.x, b.x) })
    }

    pub fn edges(&self) -> [DVec3; 3] {
        let Bounds { lengths, tilt, .. } = self;
        [DVec3::X * lengths.x, DVec3::new(tilt.z, lengths.y, 0.0), DVec3::new(tilt.y, tilt.x, lengths.z)]
    }
}

impl<'a> Sheet<'a> {
    /// One of a particle code.
    pub fn foreign(rows: Rows<'a>) -> Sheet<'a> {
        Sheet { rows, velocities: None, foreign: true, bounds: None, notices: Vec::new() }
    }

    /// Where the rows have positions and radii.
    pub fn geometry(&self, dimension: usize) -> Parsed<Geometry> {
        let rows = &self.rows;
        let find = |name: &str| rows.find(name);
        let scaled = ["xs", "ys", "zs"].map(find);
        let (position, box_) = match self.bounds {
            Some(bounds) if find("x").is_none() && scaled[0].is_some() => (scaled, Some(bounds)),
            _ => (["x", "y", "z"].map(find), None),
        };
        if let Some(axis) = (0..dimension).find(|axis| position[*axis].is_none()) {
            return Err(format!("lacks the column \"{}\"", ["x", "y", "z"][axis]));
        }
        let radius = match (find("radius"), find("diameter")) {
            (Some(column), _) => Some((column, 1.0)),
            (None, Some(column)) => Some((column, 0.5)),
            (None, None) => None,
        };
        Ok(Geometry { position, box_, radius })
    }
}

impl<'a> Rows<'a> {
    pub fn find(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| *column == name)
    }

    /// The values of a row, which are as many as the columns.
    pub fn split(&self, line: &'a str, values: &mut Vec<&'a str>) -> Parsed<()> {
        self.separator.split(line, values);
        match values.len() == self.columns.len() {
            true => Ok(()),
            false => Err(self.separator.unequal(values.len(), self.columns.len())),
        }
    }

    /// Put the rows in the order of their ids, each of which there is once, and return these; none without ids.
    pub fn sort(&mut self) -> Found<Vec<u64>> {
        let Some(column) = self.find("id") else { return Ok(Vec::new()) };
        let mut values = Vec::new();
        let mut rows = Vec::with_capacity(self.lines.len());
        for (row, line) in &self.lines {
            self.split(row, &mut values).map_err(|message| (*line, message))?;
            rows.push((whole(values[column], *line)? as u64, (*row, *line)));
        }
        rows.sort_by_key(|(id, _)| *id);
        if let Some(pair) = rows.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err((pair[1].1.1, format!("the id {} is that of line {}, too", pair[1].0, pair[0].1.1)));
        }
        self.lines = rows.iter().map(|(_, line)| *line).collect();
        Ok(rows.into_iter().map(|(id, _)| id).collect())
    }
}

/// Where a row has its position and its radius.
pub struct Geometry {
    position: [Option<usize>; 3],
    /// What positions are parts of.
    box_: Option<Bounds>,
    /// The column, and what one there is of a radius. None: the file has no radii.
    pub radius: Option<(usize, f64)>,
}

impl Geometry {
    pub fn position(&self, row: &[&str], flat: bool) -> Parsed<DVec3> {
        let position = vector(row, self.position, [false, false, flat && self.box_.is_none()])?;
        let Some(bounds) = self.box_ else { return Ok(position) };
        let parts = bounds.edges().into_iter().zip(position.to_array());
        let mut position = parts.fold(bounds.lower, |x, (edge, part)| x + part * edge);
        if flat {
            position.z = 0.0;
        }
        Ok(position)
    }

    /// The radius, if rows have one.
    pub fn radius(&self, row: &[&str]) -> Parsed<Option<f64>> {
        let Some((column, part)) = self.radius else { return Ok(None) };
        let radius = part * number(row, column)?;
        match radius > 0.0 {
            true => Ok(Some(radius)),
            false => Err(format!("radius = {}: must be a positive number of m", show(radius))),
        }
    }
}

/// Three components; missing columns are 0, and so must be those that do not exist in two dimensions.
pub fn vector(row: &[&str], columns: [Option<usize>; 3], must_be_zero: [bool; 3]) -> Parsed<DVec3> {
    let mut vector = DVec3::ZERO;
    for axis in 0..3 {
        let Some(column) = columns[axis] else {
            continue;
        };
        vector[axis] = number(row, column)?;
        if must_be_zero[axis] && vector[axis] != 0.0 {
            let value = quoted(row[column]);
            return Err(format!("value {} = {value}: must be 0 or missing in two dimensions", column + 1));
        }
    }
    Ok(vector)
}

/// A whole number, 0 or more, that stands in a line.
pub fn whole(word: &str, line: usize) -> Found<usize> {
    word.parse().map_err(|_| (line, format!("{}: must be a whole number, 0 or more", quoted(word))))
}

/// The finite numbers of a line.
pub fn numbers(text: &str, line: usize) -> Found<Vec<f64>> {
    let words: Vec<&str> = text.split_whitespace().collect();
    (0..words.len()).map(|k| number(&words, k)).collect::<Parsed<_>>().map_err(|message| (line, message))
}

/// What is said of a file whose units are not those of scenes.
pub fn units(units: Option<&str>) -> Option<String> {
    let units = units.filter(|units| !units.is_empty() && *units != "si")?;
    Some(format!("its units are {}, and its numbers are taken for SI units; `scale` changes lengths", quoted(units)))
}

/// What is said of a file that ends too early.
pub fn cut_off(line: usize, what: &str, found: usize, wanted: usize) -> Fault {
    (line, format!("{what} {wanted} atoms, and {found} follow: the file is cut off, or was edited"))
}
