//! Dump files of LAMMPS, written by `dump custom`. Of several frames the last one counts.

use glam::DVec3;

use crate::scene::rows::{Separator, quoted};
use crate::scene::sheet::{Bounds, Found, Rows, Sheet, cut_off, numbers, whole};

/// Columns, and what they are here. Others say nothing of the grains.
const COLUMNS: [(&str, &str); 22] = [
    ("id", "id"),
    ("type", "material"),
    ("x", "x"),
    ("y", "y"),
    ("z", "z"),
    ("xu", "x"),
    ("yu", "y"),
    ("zu", "z"),
    ("xs", "xs"),
    ("ys", "ys"),
    ("zs", "zs"),
    ("xsu", "xs"),
    ("ysu", "ys"),
    ("zsu", "zs"),
    ("radius", "radius"),
    ("diameter", "diameter"),
    ("vx", "vx"),
    ("vy", "vy"),
    ("vz", "vz"),
    ("omegax", "wx"),
    ("omegay", "wy"),
    ("omegaz", "wz"),
];

/// How a frame begins.
const FRAME: &str = "ITEM: TIMESTEP";

pub fn is(text: &str) -> bool {
    text.trim_start().starts_with("ITEM:")
}

pub fn parse(text: &str) -> Found<Sheet<'_>> {
    let start = text.rfind(FRAME).unwrap_or(0);
    let first = text[..start].matches('\n').count() + 1;
    let mut lines = text[start..].lines().zip(first..);
    let early = || (first, "the last frame, which begins here, is cut off; remove it".to_owned());
    let (mut count, mut bounds) = (None, None);
    while let Some((line, at)) = lines.next() {
        let item = line.trim().strip_prefix("ITEM:").map(str::trim);
        let item = item.ok_or_else(|| (at, "must be a line with ITEM:".to_owned()))?;
        if let Some(columns) = item.strip_prefix("ATOMS") {
            let count = count.ok_or_else(|| (at, "the number of atoms must come before them".to_owned()))?;
            let ours = |name| COLUMNS.iter().find(|(theirs, _)| *theirs == name).map_or("", |(_, ours)| ours);
            let columns: Vec<&str> = columns.split_whitespace().map(ours).collect();
            let rows: Vec<_> = lines.filter(|(row, _)| !row.trim().is_empty()).collect();
            // Frames of dumps with times end with the time of the next one.
            let rows: Vec<_> = rows.into_iter().take_while(|(row, _)| !row.starts_with("ITEM:")).collect();
            if rows.len() != count {
                return Err(cut_off(first, "the last frame, which begins here, has", rows.len(), count));
            }
            let mut rows = Rows { columns, separator: Separator::Blanks, header: at, lines: rows };
            rows.sort()?;
            return Ok(Sheet { bounds, notices: notices(text), ..Sheet::foreign(rows) });
        }
        if let Some(kind) = item.strip_prefix("BOX BOUNDS") {
            bounds = Some(box_of(kind, &mut lines).ok_or_else(early)??);
            continue;
        }
        let (value, at) = match item {
            "TIMESTEP" | "TIME" | "UNITS" | "NUMBER OF ATOMS" => lines.next().ok_or_else(early)?,
            _ => return Err((at, format!("ITEM: {} is nothing that packstone knows", quoted(item)))),
        };
        if item == "NUMBER OF ATOMS" {
            count = Some(whole(value.trim(), at)?);
        }
    }
    Err(early())
}

/// The box in the next three lines, if they are there: two ends each, of a tilted box those of the box around it and a tilt
/// (xy, xz and yz), of a general one an edge and a component of its corner.
fn box_of<'a>(kind: &str, lines: &mut impl Iterator<Item = (&'a str, usize)>) -> Option<Found<Bounds>> {
    let rows = [lines.next()?, lines.next()?, lines.next()?];
    let line = rows[0].1;
    let wanted = match kind.split_whitespace().next() {
        Some("xy") => 3,
        Some("abc") => 4,
        _ => 2,
    };
    let read = |(text, at): (&str, usize)| match numbers(text, at)? {
        // Of a box that could be tilted.
        found if found.len() == wanted || wanted == 2 && matches!(found[..], [_, _, 0.0]) => Ok(found),
        _ => Err((at, format!("must be the bounds of an axis (BOX BOUNDS{}), {wanted} numbers", quoted(kind)))),
    };
    let found = rows.map(read).into_iter().collect::<Found<Vec<Vec<f64>>>>();
    Some(found.and_then(|rows| {
        let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
        if wanted == 4 {
            return Bounds::of_edges(column(3), [0, 1, 2].map(|k| DVec3::from_slice(&rows[k])), line);
        }
        let (low, high) = (column(0), column(1));
        let tilts = if wanted == 3 { column(2) } else { DVec3::ZERO };
        let DVec3 { x: xy, y: xz, z: yz } = tilts;
        let (along_x, along_y) = ([0.0, xy, xz, xy + xz], [0.0, yz]);
        let least = |shifts: &[f64]| shifts.iter().copied().fold(0.0, f64::min);
        let most = |shifts: &[f64]| shifts.iter().copied().fold(0.0, f64::max);
        let lower = low - DVec3::new(least(&along_x), least(&along_y), 0.0);
        let upper = high - DVec3::new(most(&along_x), most(&along_y), 0.0);
        Ok(Bounds { lower, lengths: upper - lower, tilt: DVec3::new(yz, xz, xy) })
    }))
}

/// LAMMPS may calculate in other units than SI.
fn notices(text: &str) -> Vec<String> {
    let units = text.trim_start().strip_prefix("ITEM: UNITS").and_then(|rest| rest.split_whitespace().next());
    crate::scene::sheet::units(units).into_iter().collect()
}
