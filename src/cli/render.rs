//! `packstone render`

mod bar;
mod color;
mod look;
mod view;

use super::{
    common::{note, say},
    measure::state,
};
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
};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

pub use look::{Look, Scales};
pub use view::View;

/// Draw the last state of a run, a snapshot, or any table of grains
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  packstone render out/heap_2d --color speed\n  \
                        packstone render out/heap_2d --chains\n  \
                        packstone render out/heap_2d --chains --color coordination\n  \
                        packstone render out/bed --color force --camera 30,10 -o bed.png\n  \
                        packstone render out/bed/snapshot_000010.bin\n  \
                        packstone render grains.csv -o grains.png --width 800 --height 800\n\n\
                        What takes contacts is drawn from the last checkpoint of the run.")]
pub struct RenderArgs {
    /// Folder of a run, a binary file of one, or a CSV file with the columns x, y, z and radius
    #[arg(value_name = "DIR_OR_STATE")]
    state: PathBuf,
    #[command(flatten)]
    look: Look,
    /// The picture [default: picture.png in the folder, or next to the file]
    #[arg(short, long, value_name = "PNG")]
    output: Option<PathBuf>,
}

pub fn render(args: &RenderArgs) -> anyhow::Result<ExitCode> {
    let RenderArgs { state: path, look, output } = args;
    look.check()?;
    let view = if look.has_contacts() {
        View::of_state(&mut state(path)?, look.color(), look.chains)?
    } else {
        let (grains, surroundings) = read(path)?;
        View::of_rows(&grains, surroundings, look.color())
    };
    if look.chains && !view.rods.iter().any(|(_, force)| *force > 0.0) {
        bail!("{}: has no contact that presses", path.display());
    }
    let device = Device::open(DeviceOptions::default())?;
    let output = output.clone().unwrap_or_else(|| default_path(path));
    look.draw(&device, &view, &look.scales(&view, false)?, &output)?;
    say(output.display());
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
