//! Rows of tables, and what other files have in common with them.

use glam::DQuat;

/// A value, or what is wrong with it.
pub type Parsed<T> = std::result::Result<T, String>;

/// What stands between the values of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Separator {
    Character(char),
    /// Any number of spaces and tabs.
    Blanks,
}

impl Separator {
    /// What stands between the names of this header line.
    pub fn of(header: &str) -> Separator {
        let is_there = |separator: &char| match separator {
            '\t' => header.contains('\t') && !header.trim().contains(' '),
            other => header.contains(*other),
        };
        [',', ';', '\t'].into_iter().find(is_there).map_or(Separator::Blanks, Separator::Character)
    }

    /// The values of a line, without spaces and quotes around them.
    pub fn split<'a>(self, line: &'a str, values: &mut Vec<&'a str>) {
        let bare = |value: &'a str| value.trim().trim_matches('"');
        values.clear();
        match self {
            Separator::Character(separator) => values.extend(line.split(separator).map(bare)),
            Separator::Blanks => values.extend(line.split_whitespace().map(bare)),
        }
    }

    /// What is wrong with a row that has another number of values than there are columns.
    pub fn unequal(self, values: usize, columns: usize) -> String {
        let hint = match self {
            Separator::Character(',') if values > columns => "; commas separate values: write 0.5, not 0,5",
            _ => "",
        };
        format!("has {values} values, must have one for each of {columns} columns{hint}")
    }
}

/// The lines of a table that say something, with their numbers.
pub fn lines(text: &str) -> impl Iterator<Item = (&str, usize)> {
    text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty() && !line.starts_with('#'))
}

/// A number that a row has in this column.
pub fn number(row: &[&str], column: usize) -> Parsed<f64> {
    let text = row[column];
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => {
            let hint = if is_number(&text.replacen(',', ".", 1)) { ", with a point and no comma" } else { "" };
            Err(format!("value {} = {}: must be a finite number{hint}", column + 1, quoted(text)))
        }
    }
}

fn is_number(text: &str) -> bool {
    text.parse::<f64>().is_ok_and(f64::is_finite)
}

/// A word of a file as messages have it: no longer than a line, without control characters.
pub fn quoted(text: &str) -> String {
    const LONGEST: usize = 30;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{:?} ...", &text[..end]),
        None => format!("{text:?}"),
    }
}

/// Of length 1; what is that to rounding keeps its bits, so that a state that was written is read as it was.
pub fn unit(q: DQuat) -> DQuat {
    if (q.length_squared() - 1.0).abs() <= 4.0 * f64::EPSILON { q } else { q.normalize() }
}
