//! `packstone study`

mod file;
mod values;

use super::{
    common::{INTERRUPTED, STOPPED, note, say, tell, warn},
    run::{interrupted, listen},
};
use anyhow::Context;
use file::{Column, SHIPPED, Study};
use packstone::io;
use std::{
    fmt::Write as _,
    fs,
    io::Write as _,
    path::{Path, PathBuf},
    process::{Command, ExitCode, Stdio},
};
use values::{Outcome, Progress};

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

pub fn study(args: &StudyArgs) -> anyhow::Result<ExitCode> {
    let named: Vec<String> = match &args.studies[..] {
        [] => SHIPPED.iter().map(|(name, _)| (*name).to_owned()).collect(),
        studies => studies.to_vec(),
    };
    let studies = named.iter().map(|name| Ok((stem(name), Study::read(name)?))).collect::<anyhow::Result<Vec<_>>>()?;
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
        let progress = Progress::of(&place)?;
        if progress == Progress::Ended {
            continue;
        }
        if interrupted() {
            break;
        }
        note(format!("{}, seed {seed} of {seeds}", case.name));
        let mut command = Command::new(std::env::current_exe()?);
        match progress {
            Progress::Interrupted => command.args(["--quiet", "run", "--resume"]).arg(&place),
            _ => {
                let set = [case.overrides(seed), args.set.clone()].concat();
                command.args(["--quiet", "run"]).arg(&scene).arg("--out").arg(&place).args(["--engine", &args.engine]);
                command.args(set.iter().flat_map(|set| ["--set", set]))
            }
        };
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
            match Outcome::of(&case.folder(folder, seed), columns)? {
                Outcome::Values(values) => rows.push(values),
                Outcome::Missed(why) => missed.push(format!("{}, seed {seed}: {why}", case.name)),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_studies_are_sound() {
        for (name, _) in SHIPPED {
            let study = Study::read(name).unwrap_or_else(|error| panic!("{error:#}"));
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
