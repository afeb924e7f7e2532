//! `packstone study`

use super::{
    common::{INTERRUPTED, STOPPED, note, say, tell, warn},
    run::{interrupted, listen},
};
use anyhow::{Context, anyhow, bail};
use packstone::{io, scene::Scene};
use serde::Deserialize;
use std::{
    collections::BTreeMap,
    fmt::Write as _,
    fs,
    io::Write as _,
    path::{Path, PathBuf},
    process::{Command, ExitCode, Stdio},
};

/// Run a scene for several values and several seeds, and write a table of means with errors beside published values
///
/// Each run has a folder of its own in that of the study; those that are there already are not done again, so that a study
/// can be interrupted and goes on where it was.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  packstone study friction\n  \
                        packstone study friction triaxial --seeds 2 --out out/quick\n  \
                        packstone study my_study.toml\n\n\
                        What a study file consists of is told in docs/studies.md.")]
pub struct StudyArgs {
    /// Studies that packstone has, or files [default: all that it has]
    #[arg(value_name = "NAME|FILE")]
    studies: Vec<String>,
    /// Seeds of each case [default: what the study says]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    seeds: Option<u64>,
    /// Change a value of the scenes, such as population.0.count=500; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for the runs
    #[arg(long, value_name = "DIR", default_value = "out/studies")]
    out: PathBuf,
    /// Where the tables go, as a page in Markdown [default: packings.md in the folder]
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Write the page from the runs that are there, and run nothing
    #[arg(long)]
    only_page: bool,
    /// What the runs compute on: auto, gpu or cpu
    #[arg(long, default_value = "auto")]
    engine: String,
}

/// What packstone comes with.
const SHIPPED: [(&str, &str); 5] = [
    ("jamming_2d", include_str!("../../examples/studies/jamming_2d.toml")),
    ("jamming_3d", include_str!("../../examples/studies/jamming_3d.toml")),
    ("friction", include_str!("../../examples/studies/friction.toml")),
    ("triaxial", include_str!("../../examples/studies/triaxial.toml")),
    ("shear", include_str!("../../examples/studies/shear.toml")),
];

/// A study as its file has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Study {
    title: String,
    /// Paragraphs above the table.
    text: String,
    /// How many seeds each case has.
    seeds: u64,
    /// What is run, as a scene file has it.
    scene: toml::Table,
    #[serde(rename = "case")]
    cases: Vec<Case>,
    #[serde(rename = "column")]
    columns: Vec<Column>,
}

/// A row of the table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    name: String,
    /// Values of the scene, by the keys of `--set`.
    #[serde(default)]
    set: BTreeMap<String, toml::Value>,
    /// By the titles of columns: what others have found, and who.
    #[serde(default)]
    published: BTreeMap<String, String>,
}

/// A quantity, averaged over the seeds.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Column {
    title: String,
    /// Of a scene with stages.
    stage: Option<String>,
    /// A number of the summary, such as `stress.0.0`.
    summary: Option<String>,
    /// A column of the history, alone or over another one.
    history: Option<String>,
    over: Option<String>,
    /// Which of the rows.
    #[serde(default)]
    rows: Rows,
    /// What is made of the number.
    #[serde(default)]
    shown: Shown,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Rows {
    #[default]
    Last,
    /// The largest magnitude.
    Peak,
    /// Mean of the last third.
    MeanOfEnd,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Shown {
    #[default]
    AsIs,
    Opposite,
    /// Of q/p in triaxial compression, the angle of friction in degrees: sin φ = 3 (q/p)/(6 + q/p).
    TriaxialAngle,
}

/// What has come of a run.
enum Outcome {
    Values(Vec<f64>),
    /// Why its values are none.
    Missed(String),
    /// It has not been run.
    Absent,
}

pub fn study(args: &StudyArgs) -> anyhow::Result<ExitCode> {
    let named: Vec<String> = match &args.studies[..] {
        [] => SHIPPED.iter().map(|(name, _)| (*name).to_owned()).collect(),
        studies => studies.to_vec(),
    };
    let studies = named.iter().map(|name| Ok((stem(name), read(name)?))).collect::<anyhow::Result<Vec<_>>>()?;
    listen()?;
    let mut failed = 0;
    let mut page =
        "# Packings\n\nMade by `packstone study`. Values are means over seeds ± their standard errors.\n".to_owned();
    for (name, study) in &studies {
        let folder = args.out.join(name);
        if !args.only_page {
            failed += run_all(args, study, &folder)?;
        }
        let section = section(args, study, &folder)?;
        tell(&section);
        write!(page, "\n{section}")?;
    }
    let file = args.page.clone().unwrap_or_else(|| args.out.join("packings.md"));
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    io::write(&file, |out| out.write_all(page.as_bytes()))?;
    say(file.display());
    Ok(match () {
        () if interrupted() => ExitCode::from(INTERRUPTED),
        () if failed > 0 => ExitCode::from(STOPPED),
        () => ExitCode::SUCCESS,
    })
}

fn stem(name: &str) -> String {
    Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// A study of a file, or one that packstone has.
fn read(name: &str) -> anyhow::Result<Study> {
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
    for Column { title, summary, history, .. } in &study.columns {
        if summary.is_some() == history.is_some() {
            bail!("{name}: column {title:?}: must have one of summary and history");
        }
    }
    // All scenes are checked before the first one is run.
    for case in &study.cases {
        let scene = Scene::parse(&study.scene_text()?, name, Path::new("."), &case.overrides(1));
        scene.and_then(|scene| scene.assemble()).map_err(|error| anyhow!("{error} (case {:?})", case.name))?;
    }
    Ok(study)
}

impl Study {
    fn scene_text(&self) -> anyhow::Result<String> {
        Ok(toml::to_string(&self.scene)?)
    }
}

impl Case {
    /// Values of `--set`.
    fn overrides(&self, seed: u64) -> Vec<String> {
        let values = self.set.iter().map(|(key, value)| format!("{key}={value}"));
        values.chain([format!("seed={seed}")]).collect()
    }

    /// Where its runs are.
    fn folder(&self, study: &Path, seed: u64) -> PathBuf {
        let name: String = self.name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        study.join(name).join(format!("seed_{seed}"))
    }
}

/// Do the runs that are not there yet; returns how many failed.
fn run_all(args: &StudyArgs, study: &Study, folder: &Path) -> anyhow::Result<usize> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let scene = folder.join("scene.toml");
    let text = study.scene_text()?;
    io::write(&scene, |out| out.write_all(text.as_bytes()))?;
    let mut failed = 0;
    let seeds = args.seeds.unwrap_or(study.seeds);
    for (seed, case) in (1..=seeds).flat_map(|seed| study.cases.iter().map(move |case| (seed, case))) {
        let place = case.folder(folder, seed);
        if place.join("summary.json").exists() {
            continue;
        }
        if interrupted() {
            break;
        }
        note(format!("{}, seed {seed} of {seeds}", case.name));
        let mut command = Command::new(std::env::current_exe()?);
        // Where it was interrupted, it goes on.
        match place.join("partial").exists() {
            true => command.args(["--quiet", "run", "--resume"]).arg(&place),
            false => {
                command.args(["--quiet", "run"]).arg(&scene).arg("--out").arg(&place).args(["--engine", &args.engine])
            }
        };
        if !place.join("partial").exists() {
            let set = [case.overrides(seed), args.set.clone()].concat();
            command.args(set.iter().flat_map(|set| ["--set", set]));
        }
        let status = command.stdout(Stdio::null()).status()?;
        if !status.success() && !interrupted() {
            warn(format!("{}, seed {seed}: the run has failed ({status}); see {}", case.name, place.display()));
            failed += 1;
        }
    }
    Ok(failed)
}

/// Title, text and table.
fn section(args: &StudyArgs, study: &Study, folder: &Path) -> anyhow::Result<String> {
    let Study { title, text, columns, .. } = study;
    let mut out = format!("## {title}\n\n{}\n\n", text.trim());
    if !args.set.is_empty() {
        write!(out, "With other values than that: `{}`.\n\n", args.set.join("`, `"))?;
    }
    out.push_str("|  |");
    let is_published = |column: &Column| study.cases.iter().any(|case| case.published.contains_key(&column.title));
    let titles =
        columns.iter().flat_map(|column| [Some(&column.title[..]), is_published(column).then_some("published")]);
    let titles: Vec<&str> = titles.flatten().chain(["runs"]).collect();
    writeln!(out, " {} |\n|---|{}", titles.join(" | "), "---|".repeat(titles.len()))?;
    let mut missed = Vec::new();
    for case in &study.cases {
        let seeds = args.seeds.unwrap_or(study.seeds);
        let mut rows = Vec::new();
        for seed in 1..=seeds {
            match outcome(&case.folder(folder, seed), columns)? {
                Outcome::Values(values) => rows.push(values),
                Outcome::Missed(why) => {
                    // The first reason of several.
                    let why = why.split("; ").next().unwrap_or_default();
                    missed.push(format!("{}, seed {seed}: {why}", case.name));
                }
                Outcome::Absent => {}
            }
        }
        write!(out, "| {} |", case.name)?;
        for (k, column) in columns.iter().enumerate() {
            let values: Vec<f64> = rows.iter().map(|row| row[k]).collect();
            write!(out, " {} |", with_error(&values))?;
            if is_published(column) {
                write!(out, " {} |", case.published.get(&column.title).map_or("", String::as_str))?;
            }
        }
        writeln!(out, " {} of {seeds} |", rows.len())?;
    }
    for why in missed {
        write!(out, "\nNot counted: {why}.\n")?;
    }
    Ok(out)
}

/// Mean ± standard error, to the digits that the error leaves.
fn with_error(values: &[f64]) -> String {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    match values {
        [] => "".to_owned(),
        [only] => format!("{only:.4}"),
        _ => {
            let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
            let error = (variance / n).sqrt();
            // Two digits of the error.
            let digits = if error > 0.0 { (1.0 - error.log10().floor()).clamp(0.0, 9.0) as usize } else { 4 };
            format!("{mean:.digits$} ± {error:.digits$}")
        }
    }
}

/// The values of a run.
fn outcome(run: &Path, columns: &[Column]) -> anyhow::Result<Outcome> {
    if !run.join("summary.json").exists() {
        return Ok(Outcome::Absent);
    }
    let mut values = Vec::new();
    for column in columns {
        let folder = column.stage.as_ref().map_or_else(|| run.to_owned(), |stage| run.join("stages").join(stage));
        let file = folder.join("summary.json");
        let text = fs::read(&file).with_context(|| file.display().to_string())?;
        let summary: serde_json::Value = serde_json::from_slice(&text).with_context(|| file.display().to_string())?;
        if let Some(why) = summary["missed"].as_str() {
            return Ok(Outcome::Missed(why.to_owned()));
        }
        let value = match &column.summary {
            Some(key) => {
                let found = summary.pointer(&format!("/{}", key.replace('.', "/"))).and_then(|value| value.as_f64());
                found.with_context(|| format!("{}: has no number {key}", file.display()))?
            }
            None => of_history(&folder.join("history.csv"), column)?,
        };
        values.push(column.shown.of(value));
    }
    Ok(Outcome::Values(values))
}

/// A number of the rows of a history.
fn of_history(file: &Path, column: &Column) -> anyhow::Result<f64> {
    let text = fs::read_to_string(file).with_context(|| file.display().to_string())?;
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

impl Shown {
    fn of(self, value: f64) -> f64 {
        match self {
            Shown::AsIs => value,
            Shown::Opposite => -value,
            Shown::TriaxialAngle => (3.0 * value / (6.0 + value)).asin().to_degrees(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_studies_are_sound() {
        for (name, _) in SHIPPED {
            let study = read(name).unwrap_or_else(|error| panic!("{error:#}"));
            assert!(study.seeds >= 5, "{name}");
        }
    }

    #[test]
    fn means_have_the_digits_of_their_errors() {
        assert_eq!(with_error(&[0.61, 0.63]), "0.620 ± 0.010");
        assert_eq!(with_error(&[4.0; 3]), "4.0000 ± 0.0000");
        assert_eq!(with_error(&[]), "");
    }
}
