//! XYZ files: a number of atoms, a line with anything, and the atoms, frame by frame, of which the last one counts.
//! In extended XYZ the second line says `Properties=species:S:1:pos:R:3:radius:R:1` and the like.

use glam::DVec3;

use crate::scene::rows::{Separator, quoted};
use crate::scene::sheet::{Bounds, Found, Rows, Sheet, cut_off, numbers, whole};

/// Properties, in lower case, and what they are here. Others say nothing of the grains.
const PROPERTIES: [(&str, &[&str]); 13] = [
    ("id", &["id"]),
    ("species", &["material"]),
    ("pos", &["x", "y", "z"]),
    ("radius", &["radius"]),
    ("radii", &["radius"]),
    ("diameter", &["diameter"]),
    ("velo", &["vx", "vy", "vz"]),
    ("vel", &["vx", "vy", "vz"]),
    ("velocity", &["vx", "vy", "vz"]),
    ("velocities", &["vx", "vy", "vz"]),
    ("omega", &["wx", "wy", "wz"]),
    ("spin", &["wx", "wy", "wz"]),
    ("angular_velocity", &["wx", "wy", "wz"]),
];

const PLAIN: [&str; 4] = ["material", "x", "y", "z"];

pub fn is(text: &str) -> bool {
    text.lines().next().is_some_and(|line| line.trim().parse::<u64>().is_ok())
}

pub fn parse(text: &str) -> Found<Sheet<'_>> {
    let lines: Vec<(&str, usize)> = text.trim_end().lines().zip(1..).collect();
    let (mut at, mut last) = (0, None);
    while let Some((line, number)) = lines.get(at) {
        let count = whole(line.trim(), *number)?;
        let left = lines.len().saturating_sub(at + 2);
        if left < count {
            return Err(cut_off(*number, "this frame announces", left, count));
        }
        last = Some((at, count));
        at += 2 + count;
    }
    let (at, count) = last.filter(|(at, _)| at + 1 < lines.len()).ok_or((1, "has no atoms".to_owned()))?;
    let (comment, number) = lines[at + 1];
    let lines = lines[at + 2..][..count].to_vec();
    let columns = match value(comment, "Properties") {
        Some(properties) => columns(properties, number)?,
        None => PLAIN.to_vec(),
    };
    let values = lines.first().map_or(columns.len(), |(line, _)| line.split_whitespace().count());
    if values != columns.len() {
        let message = format!(
            "atoms have {values} values, and {} are expected; say what they are, as in \
             Properties=species:S:1:pos:R:3:radius:R:1",
            columns.len()
        );
        return Err((number, message));
    }
    let mut rows = Rows { columns, separator: Separator::Blanks, header: number, lines };
    rows.sort()?;
    Ok(Sheet { bounds: bounds(comment, number)?, ..Sheet::foreign(rows) })
}

/// The value of `key=value` or `key="value"` in a line.
fn value<'a>(comment: &'a str, key: &str) -> Option<&'a str> {
    let begins = |at: &usize| comment[..*at].chars().next_back().is_none_or(char::is_whitespace);
    let at = comment.match_indices(key).map(|(at, _)| at).find(begins)?;
    let value = comment[at + key.len()..].strip_prefix('=')?;
    match value.strip_prefix('"') {
        Some(quoted) => quoted.split('"').next(),
        None => value.split_whitespace().next(),
    }
}

/// The columns that properties, each with a type and a number, have.
fn columns(properties: &str, line: usize) -> Found<Vec<&'static str>> {
    // More than any property has, and few enough to count.
    const MOST: usize = 1000;
    let words: Vec<&str> = properties.split(':').collect();
    let mut columns = Vec::new();
    for property in words.chunks(3) {
        let &[name, _, count] = property else {
            return Err((line, "Properties must be names with a type and a number each, as in pos:R:3".to_owned()));
        };
        let count = whole(count, line)?;
        if count > MOST {
            return Err((line, format!("Properties: {} has {count} values; at most {MOST} are read", quoted(name))));
        }
        let known = PROPERTIES.iter().find(|(theirs, ours)| name.eq_ignore_ascii_case(theirs) && count == ours.len());
        columns.extend(known.map_or(&[][..], |(_, ours)| ours).iter().copied().chain([""; MOST]).take(count));
    }
    Ok(columns)
}

/// The box, from `Lattice="ax ay az bx by bz cx cy cz"` and `Origin="x y z"`.
fn bounds(comment: &str, line: usize) -> Found<Option<Bounds>> {
    let Some(lattice) = value(comment, "Lattice") else { return Ok(None) };
    let numbers_of_edges = numbers(lattice, line)?;
    if numbers_of_edges.len() != 9 {
        return Err((line, "Lattice must have nine numbers".to_owned()));
    }
    let edges = [0, 3, 6].map(|k| DVec3::from_slice(&numbers_of_edges[k..]));
    let origin = match value(comment, "Origin").map(|origin| numbers(origin, line)).transpose()?.as_deref() {
        None => DVec3::ZERO,
        Some(&[x, y, z]) => DVec3::new(x, y, z),
        Some(_) => return Err((line, "Origin must have three numbers".to_owned())),
    };
    Bounds::of_edges(origin, edges, line).map(Some)
}
