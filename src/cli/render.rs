//! `packstone render`

use super::common::{note, say};
use anyhow::bail;
use packstone::{
    gpu::{Device, DeviceOptions},
    io::{
        self, Record,
        csv::GrainRow,
        names::{CHECKPOINT, FINAL, FINAL_BIN, MEMBERS, PREVIOUS, SUMMARY, snapshot, snapshot_number},
        read_rows,
        summary::Surroundings,
    },
    render::{ColorBy, Picture, colors, draw, write_png},
};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Draw the last state of a run, or any table of grains
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  packstone render out/heap_2d --color speed\n  \
                        packstone render grains.csv -o grains.png --width 800 --height 800")]
pub struct RenderArgs {
    /// Folder of a run, a binary file of one, or a CSV file with the columns x, y, z and radius
    #[arg(value_name = "DIR_OR_STATE")]
    state: PathBuf,
    /// What the colours show
    #[arg(long, value_enum, default_value_t = Color::Radius)]
    color: Color,
    /// The picture [default: picture.png in the folder, or next to the file]
    #[arg(short, long, value_name = "PNG")]
    output: Option<PathBuf>,
    /// Pixels
    #[arg(long, default_value_t = 1280)]
    width: u32,
    /// Pixels [default: 3/4 of the width; for disks what their extent asks for]
    #[arg(long)]
    height: Option<u32>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Color {
    Radius,
    Speed,
    Id,
}

pub fn render(args: &RenderArgs) -> anyhow::Result<ExitCode> {
    let (grains, surroundings) = read(&args.state)?;
    let picture = picture(args, &grains, &surroundings);
    let device = Device::open(DeviceOptions::default())?;
    let pixels = draw(&device.device, &device.queue, &picture)?;
    let path = args.output.clone().unwrap_or_else(|| default_path(&args.state));
    io::replace(&path, |part| write_png(part, picture.width, picture.height, &pixels))?;
    say(path.display());
    Ok(ExitCode::SUCCESS)
}

/// Grains and what is around them: a folder knows its walls.
fn read(state: &Path) -> anyhow::Result<(Vec<GrainRow>, Surroundings)> {
    if !state.is_dir() {
        let grains = read_rows(state)?;
        let surroundings = without_walls(&grains);
        return Ok((grains, surroundings));
    }
    let (folder, notice) = io::folder::find(state)?;
    notice.iter().for_each(note);
    // Of clumps the members are drawn; a run that was killed has no last state, but may have snapshots.
    let files = [MEMBERS, FINAL, FINAL_BIN].map(|name| folder.join(name)).into_iter();
    let Some(file) = files.chain(last_snapshot(&folder)).find(|file| file.exists()) else {
        bail!("{}", why_nothing(state, &folder));
    };
    let grains = read_rows(&file)?;
    let summary = folder.join(SUMMARY);
    if !summary.exists() {
        note(format!("drawn is {}, without walls", file.display()));
        let surroundings = without_walls(&grains);
        return Ok((grains, surroundings));
    }
    Ok((grains, Surroundings::read(&summary)?))
}

/// Why there are no grains to draw in the folder of a result.
fn why_nothing(state: &Path, folder: &Path) -> String {
    let unfinished = Record::read(folder).is_some_and(|record| record.end.is_none());
    let checkpoint = [CHECKPOINT, PREVIOUS].iter().any(|name| folder.join(name).exists());
    let (state, folder) = (state.display(), folder.display());
    match () {
        () if unfinished && checkpoint => format!(
            "{folder}: the run goes on, or was interrupted, and has written no grains yet; if it was, packstone run --resume \
             {state} goes on with it"
        ),
        () if unfinished => format!(
            "{folder}: the run goes on, or was interrupted, and has written neither grains nor a checkpoint yet; if it was, \
             run its scene anew"
        ),
        () => format!(
            "{state}: has no {FINAL} and no {FINAL_BIN}; is it the folder of a run with \"csv\" or \"bin\" in output.formats?"
        ),
    }
}

/// A table only knows whether it is flat.
fn without_walls(grains: &[GrainRow]) -> Surroundings {
    Surroundings::empty(if grains.iter().all(|g| g.z == 0.0) { 2 } else { 3 })
}

fn last_snapshot(folder: &Path) -> Option<PathBuf> {
    let names = std::fs::read_dir(folder).ok()?.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    let numbered = names.filter(|name| name.ends_with(".bin")).filter_map(|name| snapshot_number(&name));
    numbered.max().map(|number| folder.join(snapshot(number, "bin")))
}

fn default_path(state: &Path) -> PathBuf {
    if state.is_dir() { state.join("picture.png") } else { state.with_extension("png") }
}

fn picture(args: &RenderArgs, grains: &[GrainRow], surroundings: &Surroundings) -> Picture {
    let by = match args.color {
        Color::Radius => ColorBy::Radius,
        Color::Speed => ColorBy::Speed,
        Color::Id => ColorBy::Id,
    };
    let value = |(row, grain): (usize, &GrainRow)| match by {
        ColorBy::Radius => grain.radius,
        ColorBy::Speed => grain.velocity().length(),
        ColorBy::Id => grain.id.unwrap_or(row as u64) as f64,
    };
    let values: Vec<f64> = grains.iter().enumerate().map(value).collect();
    Picture {
        dimension: surroundings.dimension,
        centers: grains.iter().map(GrainRow::position).collect(),
        radii: grains.iter().map(|g| g.radius).collect(),
        colors: colors(by, &values),
        walls: surroundings.walls(),
        domain: surroundings.domain(),
        width: args.width,
        height: args.height.unwrap_or_else(|| (f64::from(args.width) * aspect(grains, surroundings.dimension)) as u32),
    }
}

/// Height over width that suits the grains.
fn aspect(grains: &[GrainRow], dimension: usize) -> f64 {
    let extent = |of: fn(&GrainRow) -> f64| {
        let ends = grains.iter().map(|g| (of(g) - g.radius, of(g) + g.radius));
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        high - low
    };
    if dimension == 3 { 0.75 } else { (0.1 + extent(|g| g.y) / extent(|g| g.x)).clamp(0.25, 1.5) }
}
