//! Rows of CSV tables, and what other files have in common with them.

use glam::DQuat;

/// A value, or what is wrong with it.
pub type Parsed<T> = std::result::Result<T, String>;

/// The lines of a table that say something, with their numbers.
pub fn lines(text: &str) -> impl Iterator<Item = (&str, usize)> {
    text.trim_start_matches('\u{feff}')
        .lines()
        .zip(1..)
        .filter(|(line, _)| !line.trim().is_empty() && !line.starts_with('#'))
}

/// The values of a line, without spaces and quotes around them.
pub fn split<'a>(line: &'a str, values: &mut Vec<&'a str>) {
    values.clear();
    values.extend(line.split(',').map(|value| value.trim().trim_matches('"')));
}

/// A number that a row has in this column.
pub fn number(row: &[&str], column: usize) -> Parsed<f64> {
    let text = row[column];
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("value {} = \"{text}\": must be a finite number", column + 1)),
    }
}

/// Of length 1; what is that to rounding keeps its bits, so that a state that was written is read as it was.
pub fn unit(q: DQuat) -> DQuat {
    if (q.length_squared() - 1.0).abs() <= 4.0 * f64::EPSILON { q } else { q.normalize() }
}
