//! What the columns of a study have of a run.

use super::super::measure::numbers;
use super::file::{Column, Exponent, Rows};
use anyhow::Context;
use packstone::{io::names, protocol::jamming::RelaxedState};
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// What has come of a run.
pub enum Outcome {
    Values(Vec<f64>),
    /// Why its values are none.
    Missed(String),
    /// It has not been run.
    Absent,
}

impl Outcome {
    /// Of the run in a folder.
    pub fn of(run: &Path, columns: &[Column]) -> anyhow::Result<Outcome> {
        match Progress::of(run)? {
            Progress::Absent => return Ok(Outcome::Absent),
            Progress::Interrupted => return Ok(Outcome::Missed("has not come to its end".to_owned())),
            Progress::Ended => {}
        }
        let mut values = Vec::new();
        for column in columns {
            let stage = Stage::of(run, column.stage.as_deref())?;
            // The first reason of several.
            let missed = stage.summary["missed"].as_str().and_then(|why| why.split("; ").next());
            let missed = stage.summary["stopped"].as_str().or(missed);
            if let Some(why) = missed {
                return Ok(Outcome::Missed(why.to_owned()));
            }
            let value = match column {
                Column { summary: Some(key), .. } => stage.of_summary(key)?,
                Column { measure: Some(key), .. } => stage.of_measures(key)?,
                Column { exponent: Some(exponent), .. } => match stage.of_states(exponent)? {
                    Some(value) => value,
                    None => {
                        return Ok(Outcome::Missed(format!("has fewer than {FEWEST} states for {:?}", column.title)));
                    }
                },
                _ => stage.of_history(column)?,
            };
            values.push(column.shown.of(value / column.unit.unwrap_or(1.0)));
        }
        Ok(Outcome::Values(values))
    }
}

/// How far a run is.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    Absent,
    /// Ended early, by Ctrl-C say: it can go on.
    Interrupted,
    Ended,
}

impl Progress {
    pub fn of(run: &Path) -> anyhow::Result<Progress> {
        let partial = if run.join("partial").exists() { Progress::Interrupted } else { Progress::Absent };
        if !run.join(names::SUMMARY).exists() {
            return Ok(partial);
        }
        let interrupted = Stage::of(run, None)?.summary["ended"] == "interrupted";
        Ok(if interrupted { Progress::Interrupted } else { Progress::Ended })
    }
}

/// States that a line goes through at least.
const FEWEST: usize = 3;

/// The result of a run, or of one of its stages.
struct Stage {
    folder: PathBuf,
    summary: Value,
}

impl Stage {
    fn of(run: &Path, stage: Option<&str>) -> anyhow::Result<Stage> {
        let folder = stage.map_or_else(|| run.to_owned(), |stage| run.join("stages").join(stage));
        let file = folder.join(names::SUMMARY);
        let text = fs::read(&file).with_context(|| file.display().to_string())?;
        let summary = serde_json::from_slice(&text).with_context(|| file.display().to_string())?;
        Ok(Stage { folder, summary })
    }

    fn of_summary(&self, key: &str) -> anyhow::Result<f64> {
        let found = self.summary.pointer(&format!("/{}", key.replace('.', "/"))).and_then(Value::as_f64);
        found.with_context(|| format!("{}: has no number {key}", self.folder.join(names::SUMMARY).display()))
    }

    fn of_measures(&self, key: &str) -> anyhow::Result<f64> {
        let found = numbers(&self.folder)?.into_iter().find(|(name, _)| name == key);
        let found = found.and_then(|(_, value)| value.parse().ok());
        found.with_context(|| format!("{}: packstone measure has no number {key} of it", self.folder.display()))
    }

    /// A number of the rows of the history.
    fn of_history(&self, column: &Column) -> anyhow::Result<f64> {
        let file = self.folder.join(names::HISTORY);
        let text = fs::read_to_string(&file).with_context(|| file.display().to_string())?;
        let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let header = lines.next().unwrap_or_default();
        let rows: Vec<Vec<&str>> = lines.collect();
        let read = |name: &String| -> anyhow::Result<Vec<f64>> {
            let at = header.iter().position(|title| title == name);
            let at = at.with_context(|| format!("{}: has no column {name}", file.display()))?;
            Ok(rows.iter().filter_map(|row| row.get(at)?.parse().ok()).collect())
        };
        let mut values = column.history.iter().map(read).next().context("a column of the history")??;
        if let Some(over) = &column.over {
            values = values.iter().zip(read(over)?).map(|(a, b)| a / b).filter(|x| x.is_finite()).collect();
        }
        let found = match column.rows {
            Rows::Last => values.last().copied(),
            Rows::Peak => values.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())),
            Rows::MeanOfEnd => {
                let end = &values[values.len() - values.len().div_ceil(3)..];
                Some(end.iter().sum::<f64>() / end.len() as f64)
            }
        };
        found.with_context(|| format!("{}: has no rows", file.display()))
    }

    /// An exponent of the states at rest of a decompression; None of too few in its range.
    fn of_states(&self, exponent: &Exponent) -> anyhow::Result<Option<f64>> {
        let file = self.folder.join(names::JAMMING);
        let jammed_at = self.of_summary("jamming_fraction")?;
        let mut reader = csv::Reader::from_path(&file).with_context(|| file.display().to_string())?;
        let header = reader.headers()?.clone();
        let at = header.iter().position(|title| title == exponent.of);
        let at = at.with_context(|| format!("{}: has no column {}", file.display(), exponent.of))?;
        let mut states = Vec::new();
        for row in reader.records() {
            let row = row?;
            let state: RelaxedState = row.deserialize(Some(&header))?;
            states.push((state, row[at].parse().unwrap_or(f64::NAN)));
        }
        // From the most compressed one on.
        let fraction = |k: &usize| states[*k].0.packing_fraction;
        let first = (0..states.len()).max_by(|a, b| fraction(a).total_cmp(&fraction(b))).unwrap_or(0);
        let [from, to] = exponent.range;
        let points = states[first..].iter().filter(|(state, _)| state.converged && state.jammed);
        let points = points.map(|(state, value)| (state.packing_fraction - jammed_at, value - exponent.at_jamming));
        let points = points.filter(|(beyond, value)| (from..=to).contains(beyond) && *value > 0.0);
        Ok(slope(&points.map(|(beyond, value)| (beyond.ln(), value.ln())).collect::<Vec<_>>()))
    }
}

/// Of the line of least squares.
fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let xx: f64 = points.iter().map(|point| (point.0 - x).powi(2)).sum();
    let xy: f64 = points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum();
    (points.len() >= FEWEST).then_some(xy / xx)
}
