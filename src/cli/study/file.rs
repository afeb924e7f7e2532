//! What a study file consists of.

use anyhow::{Context, anyhow, bail};
use packstone::scene::Scene;
use serde::Deserialize;
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

/// What packstone comes with.
pub const SHIPPED: [(&str, &str); 7] = [
    ("jamming_2d", include_str!("../../../examples/studies/jamming_2d.toml")),
    ("jamming_3d", include_str!("../../../examples/studies/jamming_3d.toml")),
    ("friction", include_str!("../../../examples/studies/friction.toml")),
    ("triaxial", include_str!("../../../examples/studies/triaxial.toml")),
    ("shear", include_str!("../../../examples/studies/shear.toml")),
    ("silo", include_str!("../../../examples/studies/silo.toml")),
    ("repose", include_str!("../../../examples/studies/repose.toml")),
];

/// A study as its file has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    pub title: String,
    /// Paragraphs above the table.
    pub text: String,
    /// How many seeds each case has.
    pub seeds: u64,
    /// What is run, as a scene file has it.
    scene: toml::Table,
    #[serde(rename = "case")]
    pub cases: Vec<Case>,
    #[serde(rename = "column")]
    pub columns: Vec<Column>,
}

/// A row of the table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    pub name: String,
    /// Values of the scene, by the keys of `--set`.
    #[serde(default)]
    set: BTreeMap<String, toml::Value>,
    /// By the titles of columns: what others have found, and who.
    #[serde(default)]
    pub published: BTreeMap<String, String>,
}

/// A quantity, averaged over the seeds.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    pub title: String,
    /// Of a scene with stages.
    pub stage: Option<String>,
    /// A number of the summary, such as `stress.0.0`.
    pub summary: Option<String>,
    /// A number of `packstone measure --csv`, such as `walls.floor.normal_force`.
    pub measure: Option<String>,
    /// A column of the history, alone or over another one.
    pub history: Option<String>,
    pub over: Option<String>,
    /// Which of the rows.
    #[serde(default)]
    pub rows: Rows,
    /// Of the states of a search for the jamming fraction.
    pub exponent: Option<Exponent>,
    /// The number is told in this unit.
    pub unit: Option<f64>,
    /// What is made of the number.
    #[serde(default)]
    pub shown: Shown,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rows {
    #[default]
    Last,
    /// The largest magnitude.
    Peak,
    /// Mean of the last third.
    MeanOfEnd,
}

/// How a column of `jamming.csv` grows with the packing fraction beyond jamming: slope of the line through their logarithms.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exponent {
    pub of: String,
    /// What it is at jamming.
    pub at_jamming: f64,
    /// Packing fractions beyond jamming that count.
    pub range: [f64; 2],
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shown {
    #[default]
    AsIs,
    Opposite,
    /// Of an angle in radians.
    Degrees,
    /// Of q/p in triaxial compression, the angle of friction in degrees: sin φ = 3 (q/p)/(6 + q/p).
    TriaxialAngle,
}

impl Shown {
    pub fn of(self, value: f64) -> f64 {
        match self {
            Shown::AsIs => value,
            Shown::Opposite => -value,
            Shown::Degrees => value.to_degrees(),
            Shown::TriaxialAngle => (3.0 * value / (6.0 + value)).asin().to_degrees(),
        }
    }
}

impl Study {
    /// A study of a file, or one that packstone has.
    pub fn read(name: &str) -> anyhow::Result<Study> {
        let shipped = SHIPPED.iter().find(|(known, _)| *known == name);
        let text = match shipped {
            Some((_, text)) => (*text).to_owned(),
            None => fs::read_to_string(name).with_context(|| {
                let known = SHIPPED.map(|(name, _)| name).join(", ");
                format!("{name}: is no file, and none of the studies {known}")
            })?,
        };
        let study: Study = toml::from_str(&text).map_err(|error| anyhow!("{name}: {error}"))?;
        for case in &study.cases {
            if let Some(title) =
                case.published.keys().find(|title| study.columns.iter().all(|column| column.title != **title))
            {
                bail!("{name}: case {:?}: published has {title:?}, which is no title of a column", case.name);
            }
        }
        study.columns.iter().try_for_each(|column| column.check(name))?;
        // All scenes are checked before the first one is run.
        for case in &study.cases {
            let scene = Scene::parse(&study.scene_text()?, name, Path::new("."), &case.overrides(1));
            scene.and_then(|scene| scene.assemble()).map_err(|error| anyhow!("{error} (case {:?})", case.name))?;
        }
        Ok(study)
    }

    pub fn scene_text(&self) -> anyhow::Result<String> {
        Ok(toml::to_string(&self.scene)?)
    }
}

impl Column {
    fn check(&self, file: &str) -> anyhow::Result<()> {
        let Column { title, summary, measure, history, over, exponent, unit, .. } = self;
        let sources = [summary.is_some(), measure.is_some(), history.is_some(), exponent.is_some()];
        if sources.iter().filter(|given| **given).count() != 1 {
            bail!("{file}: column {title:?}: must have one of summary, measure, history and exponent");
        }
        if over.is_some() && history.is_none() {
            bail!("{file}: column {title:?}: over goes with history");
        }
        if unit.is_some_and(|unit| !(unit.is_finite() && unit != 0.0)) {
            bail!("{file}: column {title:?}: unit must be a number other than 0");
        }
        if let Some(Exponent { range: [from, to], .. }) = exponent
            && !(0.0 < *from && from < to)
        {
            bail!("{file}: column {title:?}: exponent.range must be two numbers above 0, the smaller one first");
        }
        Ok(())
    }
}

impl Case {
    /// Values of `--set`.
    pub fn overrides(&self, seed: u64) -> Vec<String> {
        let values = self.set.iter().map(|(key, value)| format!("{key}={value}"));
        values.chain([format!("seed={seed}")]).collect()
    }

    /// Where its runs are.
    pub fn folder(&self, study: &Path, seed: u64) -> PathBuf {
        let name: String = self.name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        study.join(name).join(format!("seed_{seed}"))
    }
}
