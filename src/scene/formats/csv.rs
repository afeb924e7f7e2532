//! Tables: names of columns in the first line, a row in each of the others.

use crate::scene::rows::{Separator, lines, quoted};
use crate::scene::sheet::{COLUMNS, Found, Rows, Sheet};

pub fn parse(text: &str) -> Found<Sheet<'_>> {
    let mut lines = lines(text);
    let (header, line) = lines.next().ok_or((1, "has no header line".to_owned()))?;
    let (separator, mut columns) = (Separator::of(header), Vec::new());
    separator.split(header, &mut columns);
    let is_known = |name: &str| COLUMNS.contains(&name) || name == "diameter";
    if !columns.iter().any(|name| is_known(name)) {
        let message = "is no header of a grain table, as none of its words is the name of a column; packstone reads \
                       tables (CSV), data and dump files of LAMMPS, XYZ and its own binary files";
        return Err((line, message.to_owned()));
    }
    for (at, name) in columns.iter().enumerate() {
        if !is_known(name) {
            let message = format!("unknown column {}; allowed are {}, diameter", quoted(name), COLUMNS.join(", "));
            return Err((line, message));
        }
        if columns[..at].contains(name) {
            return Err((line, format!("column \"{name}\" appears twice")));
        }
    }
    if columns.contains(&"radius") && columns.contains(&"diameter") {
        return Err((line, "has columns for both radius and diameter; leave one out".to_owned()));
    }
    let rows = Rows { columns, separator, header: line, lines: lines.collect() };
    Ok(Sheet { rows, velocities: None, foreign: false, bounds: None, notices: Vec::new() })
}
