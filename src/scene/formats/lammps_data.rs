//! Data files of LAMMPS, which `read_data` and `write_data` have: a header, then sections.

use glam::DVec3;

use crate::scene::rows::{Separator, quoted};
use crate::scene::sheet::{Bounds, Found, Rows, Sheet, cut_off, numbers, units, whole};

/// What a line of the section `Atoms` has in each style, image flags aside. Of columns without a name nothing is read:
/// molecules, charges, and densities, which materials have here.
const STYLES: [(&str, &[&str]); 8] = [
    ("sphere", &["id", "material", "diameter", "", "x", "y", "z"]),
    ("bpm/sphere", &["id", "", "material", "diameter", "", "x", "y", "z"]),
    ("atomic", &["id", "material", "x", "y", "z"]),
    ("charge", &["id", "material", "", "x", "y", "z"]),
    ("bond", &["id", "", "material", "x", "y", "z"]),
    ("angle", &["id", "", "material", "x", "y", "z"]),
    ("molecular", &["id", "", "material", "x", "y", "z"]),
    ("full", &["id", "", "material", "", "x", "y", "z"]),
];
/// The numbers of periods that an atom has passed.
const FLAGS: usize = 3;
const VELOCITIES: [&str; 7] = ["id", "vx", "vy", "vz", "wx", "wy", "wz"];

/// The header is in the first lines.
pub fn is(text: &str) -> bool {
    let announces = |line: &str| {
        let mut words = line.split_whitespace();
        words.next().is_some_and(|word| word.parse::<u64>().is_ok()) && words.next() == Some("atoms")
    };
    text.lines().take(50).any(announces)
}

pub fn parse(text: &str) -> Found<Sheet<'_>> {
    let title = text.lines().next().unwrap_or_default();
    let mut notices: Vec<String> =
        units(title.split_once("units = ").map(|(_, units)| units.trim())).into_iter().collect();
    let (mut count, mut bounds) = (0, None);
    // The heading of the section at hand, and what each of the two that are read has.
    let mut section = "";
    let (mut atoms, mut velocities) = (None, None);
    // The first line is a comment, whatever it says, unless it announces the atoms.
    for (whole_line, at) in text.lines().zip(1..).skip(usize::from(!is(title))) {
        let (line, comment) = whole_line.split_once('#').unwrap_or((whole_line, ""));
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        if line.starts_with(char::is_alphabetic) {
            section = line;
            let part = match line {
                "Atoms" => &mut atoms,
                "Velocities" => &mut velocities,
                _ => continue,
            };
            if part.is_some() {
                return Err((at, format!("a second section {}", quoted(line))));
            }
            *part = Some((comment.trim(), at, Vec::new()));
            continue;
        }
        match (section, &mut atoms, &mut velocities) {
            ("", ..) => header(line, at, &mut count, &mut bounds)?,
            ("Atoms", Some((_, _, lines)), _) | ("Velocities", _, Some((_, _, lines))) => lines.push((line, at)),
            _ => {}
        }
    }
    let (style, at, lines) = atoms.ok_or_else(|| (1, "has no section Atoms".to_owned()))?;
    if lines.len() != count {
        return Err(cut_off(at, "the header announces", lines.len(), count));
    }
    let columns = columns(style, lines.first().map_or("", |(line, _)| line), at, &mut notices)?;
    let mut rows = Rows { columns, separator: Separator::Blanks, header: at, lines };
    let ids = rows.sort()?;
    let velocities = match velocities {
        None => None,
        Some((_, at, lines)) => {
            let values = lines.first().map_or(0, |(line, _)| line.split_whitespace().count());
            let spins = values > 4;
            let columns = VELOCITIES[..if spins { 7 } else { 4 }].to_vec();
            let mut rows = Rows { columns, separator: Separator::Blanks, header: at, lines };
            if rows.sort()? != ids {
                return Err((at, "Velocities must have the ids of Atoms, each once".to_owned()));
            }
            Some(rows)
        }
    };
    Ok(Sheet { velocities, bounds, notices, ..Sheet::foreign(rows) })
}

/// A line before the first section.
fn header(line: &str, at: usize, count: &mut usize, bounds: &mut Option<Bounds>) -> Found<()> {
    let words: Vec<&str> = line.split_whitespace().collect();
    if let [number, "atoms"] = words[..] {
        *count = whole(number, at)?;
    }
    if let [.., "xy", "xz", "yz"] = words[..] {
        let &[xy, xz, yz] = &numbers(&words[..words.len() - 3].join(" "), at)?[..] else {
            return Err((at, "must have three numbers before xy xz yz".to_owned()));
        };
        bounds.get_or_insert_default().tilt = DVec3::new(yz, xz, xy);
        return Ok(());
    }
    if let [.., "avec" | "bvec" | "cvec"] | [.., "abc", "origin"] = words[..] {
        return Err((at, "the box has edges of its own (avec); only such with lengths and tilts are read".to_owned()));
    }
    if let [lower, upper, low, _] = words[..]
        && let Some(axis) = ["xlo", "ylo", "zlo"].iter().position(|name| *name == low)
    {
        let ends = numbers(&[lower, upper].join(" "), at)?;
        let bounds = bounds.get_or_insert_default();
        (bounds.lower[axis], bounds.lengths[axis]) = (ends[0], ends[1] - ends[0]);
    }
    Ok(())
}

/// What the lines of `Atoms` have, of which one is given.
fn columns(style: &str, line: &str, at: usize, notices: &mut Vec<String>) -> Found<Vec<&'static str>> {
    let values = line.split_whitespace().count();
    let fits = |columns: &[&str]| values == columns.len() || values == columns.len() + FLAGS;
    let (sphere, of_sphere) = STYLES[0];
    let known = STYLES.iter().find(|(name, _)| *name == style).map(|(_, columns)| *columns);
    let columns = match known {
        Some(columns) if fits(columns) => columns,
        None if style.is_empty() && fits(of_sphere) => {
            notices.push(format!("line {at}: Atoms names no style, and is taken for `Atoms # {sphere}`"));
            of_sphere
        }
        Some(columns) => {
            let message = format!(
                "atoms of the style {style} have {} values, or {} with image flags; these have {values}",
                columns.len(),
                columns.len() + FLAGS
            );
            return Err((at, message));
        }
        None => {
            let names = STYLES.map(|(name, _)| name).join(", ");
            let given = if style.is_empty() { "no style".to_owned() } else { format!("the style {}", quoted(style)) };
            return Err((at, format!("Atoms has {given}; write `Atoms # {sphere}`, or one of {names}")));
        }
    };
    Ok(columns.iter().copied().chain([""; FLAGS]).take(values).collect())
}
