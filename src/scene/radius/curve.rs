//! Sieve curves: which part of the grains passes a radius.

use std::path::Path;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::scene::check::{Check, TOO_WIDE, show, show_list};
use crate::scene::origin::read_text;
use crate::scene::rows::{Separator, lines, number};
use crate::scene::schema::{Curve, Sieve};
use crate::{Error, Result};

/// Radii, m, and what passes them, rising from 0; linear in between.
pub struct Classes {
    radius: Vec<f64>,
    passing: Vec<f64>,
}

/// A curve that is one.
pub fn of(sieve: &Sieve, key: &str, check: &Check) -> Result<Classes> {
    let (Curve { radius, passing }, key) = match sieve {
        Sieve::Curve(curve) => (curve.clone(), key.to_owned()),
        Sieve::File(file) => {
            let path = check.origin.directory.join(file);
            (read(&path)?, format!("{key} = \"{file}\""))
        }
    };
    if radius.len() != passing.len() || radius.len() < 2 {
        let message = format!(
            "must have as many numbers in passing as in radius, two or more, and has {} and {}",
            passing.len(),
            radius.len()
        );
        return Err(check.origin.wrong(&key, message));
    }
    let rises = |values: &[f64]| values.windows(2).all(|pair| pair[0] < pair[1]);
    if !(radius[0] > 0.0 && rises(&radius)) {
        let rule = "must be positive numbers of m, each larger than the one before";
        return Err(check.origin.bad(&format!("{key}.radius"), show_list(&radius), rule));
    }
    let falls = passing.windows(2).any(|pair| !(pair[0] <= pair[1]));
    if passing[0] != 0.0 || falls || !(passing[passing.len() - 1] > 0.0) {
        let rule = "must start at 0 and never fall; the last number is all of the grains";
        return Err(check.origin.bad(&format!("{key}.passing"), show_list(&passing), rule));
    }
    if !(radius[0] * radius[0]).is_normal() || !radius[radius.len() - 1].powi(2).is_normal() {
        return Err(check.origin.bad(&format!("{key}.radius"), show(radius[0]), TOO_WIDE));
    }
    Ok(Classes { radius, passing })
}

/// From a CSV file with the columns `radius` and `passing`.
fn read(path: &Path) -> Result<Curve> {
    let text = read_text(path, "a sieve curve")?;
    let fault = |line: usize, message: String| Error::Scene(format!("{}:{line}: {message}", path.display()));
    let mut lines = lines(&text);
    let mut values = Vec::new();
    let (header, line) = lines.next().ok_or_else(|| fault(1, "has no header line".to_owned()))?;
    let separator = Separator::of(header);
    separator.split(header, &mut values);
    let columns = match values[..] {
        ["radius", "passing"] => [0, 1],
        ["passing", "radius"] => [1, 0],
        _ => return Err(fault(line, "the columns must be \"radius\" (m) and \"passing\"".to_owned())),
    };
    let mut curve = Curve::default();
    for (row, line) in lines {
        separator.split(row, &mut values);
        if values.len() != 2 {
            return Err(fault(line, separator.unequal(values.len(), 2)));
        }
        let [radius, passing] = columns.map(|column| number(&values, column));
        curve.radius.push(radius.map_err(|message| fault(line, message))?);
        curve.passing.push(passing.map_err(|message| fault(line, message))?);
    }
    Ok(curve)
}

impl Classes {
    /// Radii, m, of a curve whose shares, over this power of the radius, are those of the number.
    pub fn draw(&self, power: i32, count: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let classes = self.radius.windows(2).zip(self.passing.windows(2));
        let sums: Vec<f64> = classes
            .scan(0.0, |sum, (radius, passing)| {
                *sum += (passing[1] - passing[0]) * mean_inverse(radius[0], radius[1], power, self.radius[0]);
                Some(*sum)
            })
            .collect();
        let last = sums.len() - 1;
        let draw = |_| {
            let share = sums[last] * rng.random::<f64>();
            let k = sums.partition_point(|sum| *sum <= share).min(last);
            between(self.radius[k], self.radius[k + 1], power, rng)
        };
        (0..count).map(draw).collect()
    }
}

/// The mean of (unit/r)^power between two radii: 0 or at least 2.
fn mean_inverse(low: f64, high: f64, power: i32, unit: f64) -> f64 {
    if power == 0 {
        return 1.0;
    }
    let (q, ratio) = (power - 1, high / low);
    (unit / low).powi(power) * (1.0 - ratio.powi(-q)) / (f64::from(q) * (ratio - 1.0))
}

/// A radius between two, with a density that falls with this power, 0 or at least 2.
pub fn between(low: f64, high: f64, power: i32, rng: &mut ChaCha8Rng) -> f64 {
    let u = rng.random::<f64>();
    if power == 0 {
        return low + u * (high - low);
    }
    let q = power - 1;
    let inverse = 1.0 + u * ((high / low).powi(-q) - 1.0);
    (low * inverse.powf(-1.0 / f64::from(q))).clamp(low, high)
}
