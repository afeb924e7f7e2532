//! Members of a shape from a CSV table.

use std::path::Path;

use glam::DVec3;

use super::member::Member;
use crate::scene::check::{Check, show};
use crate::scene::origin::read_text;
use crate::scene::rows::{lines, number, split};
use crate::{Error, Result};

/// Reads the members of a shape: columns x, y, z (in the plane no z) and radius, in any unit.
pub fn read(path: &Path, check: &Check) -> Result<Vec<Member>> {
    let text = read_text(path, "a table of members")?;
    let line_error = |line: usize, message: String| Error::Scene(format!("{}:{line}: {message}", path.display()));
    let mut lines = lines(&text);
    let names = &["x", "y", "z"][..check.dimension];
    let wanted: Vec<&str> = names.iter().copied().chain(["radius"]).collect();
    let mut values = Vec::new();
    let (header, line) = lines.next().ok_or_else(|| line_error(1, "has no header line".to_owned()))?;
    split(header, &mut values);
    let column = |name: &&str| values.iter().position(|value| value == name);
    let columns: Option<Vec<usize>> = wanted.iter().map(column).collect();
    let columns = columns
        .filter(|columns| columns.len() == values.len())
        .ok_or_else(|| line_error(line, format!("must have the columns {} and no others", wanted.join(", "))))?;
    let mut members = Vec::new();
    for (row, line) in lines {
        let mut values = Vec::new();
        split(row, &mut values);
        if values.len() != columns.len() {
            let message = format!("has {} values, the header line {} columns", values.len(), columns.len());
            return Err(line_error(line, message));
        }
        let mut lanes = [0.0; 4];
        for (lane, column) in lanes.iter_mut().zip(&columns) {
            *lane = number(&values, *column).map_err(|message| line_error(line, message))?;
        }
        let [x, y, z, radius] = if check.dimension == 2 { [lanes[0], lanes[1], 0.0, lanes[2]] } else { lanes };
        if radius <= 0.0 {
            return Err(line_error(line, format!("radius = {}: must be positive", show(radius))));
        }
        members.push(Member { arm: DVec3::new(x, y, z), radius });
    }
    match members.is_empty() {
        true => Err(line_error(line, "has no rows below its header line".to_owned())),
        false => Ok(members),
    }
}
