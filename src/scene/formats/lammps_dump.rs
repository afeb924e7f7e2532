//! Dump files of LAMMPS, written by `dump custom`. Of several frames the last one counts.

use glam::DVec3;

use crate::scene::rows::{Separator, quoted};
use crate::scene::sheet::{Fault, Found, Rows, Sheet, TILTED, cut_off, numbers, whole};

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
    let (mut count, mut corners) = (None, None);
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
            return Ok(Sheet { corners, notices: notices(text), ..Sheet::foreign(rows) });
        }
        if let Some(bounds) = item.strip_prefix("BOX BOUNDS") {
            corners = Some(box_of(bounds, &mut lines).ok_or_else(early)??);
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

/// The corners of the box in the next three lines, if they are there.
fn box_of<'a>(bounds: &str, lines: &mut impl Iterator<Item = (&'a str, usize)>) -> Option<Found<[DVec3; 2]>> {
    let [mut low, mut high] = [DVec3::ZERO; 2];
    for axis in 0..3 {
        let (line, at) = lines.next()?;
        match numbers(line, at).as_deref() {
            Ok([lower, upper]) => (low[axis], high[axis]) = (*lower, *upper),
            // The bounds of a box that could be tilted.
            Ok([lower, upper, tilt]) if *tilt == 0.0 => (low[axis], high[axis]) = (*lower, *upper),
            Ok([_, _, _] | [_, _, _, _]) => return Some(Err((at, TILTED.to_owned()))),
            Ok(_) => {
                let message = format!("must be the bounds of an axis (BOX BOUNDS{}), two numbers", quoted(bounds));
                return Some(Err((at, message)));
            }
            Err((at, message)) => return Some(Err((*at, message.clone()) as Fault)),
        }
    }
    Some(Ok([low, high]))
}

/// LAMMPS may calculate in other units than SI.
fn notices(text: &str) -> Vec<String> {
    let units = text.trim_start().strip_prefix("ITEM: UNITS").and_then(|rest| rest.split_whitespace().next());
    crate::scene::sheet::units(units).into_iter().collect()
}
