//! Members of a shape from a text file.

use std::path::Path;

use super::member::Member;
use crate::scene::check::Check;
use crate::scene::formats;
use crate::scene::origin::read_text;
use crate::scene::sheet::Fault;
use crate::{Error, Result};

/// Reads the members of a shape: columns x, y, z (in the plane no z) and radius, in any unit.
pub fn read(path: &Path, check: &Check) -> Result<Vec<Member>> {
    let text = read_text(path, "a table of members")?;
    let fault = |(line, message): Fault| Error::Scene(format!("{}:{line}: {message}", path.display()));
    let sheet = formats::parse(&text).map_err(fault)?;
    let at_header = |message: String| fault((sheet.rows.header, message));
    let geometry = sheet.geometry(check.dimension).map_err(at_header)?;
    let others = |name: &&&str| !["x", "y", "z", "radius", "diameter"].contains(*name);
    if let Some(name) = sheet.rows.columns.iter().find(others).filter(|_| !sheet.foreign) {
        return Err(at_header(format!("column \"{name}\": members have positions and radii only")));
    }
    let mut values = Vec::new();
    let mut members = Vec::new();
    for (row, line) in &sheet.rows.lines {
        let mut member = || {
            sheet.rows.split(row, &mut values)?;
            let arm = geometry.position(&values, check.dimension == 2)?;
            let radius = geometry.radius(&values)?.ok_or("lacks the column \"radius\" (or \"diameter\")")?;
            Ok(Member { arm, radius })
        };
        members.push(member().map_err(|message| fault((*line, message)))?);
    }
    match members.is_empty() {
        true => Err(at_header("has no rows below its header line".to_owned())),
        false => Ok(members),
    }
}
