//! `packstone run`

mod begin;
mod drive;

use super::common::{INTERRUPTED, STOPPED, UNSURE, about, complain, note, say, tell, warn};
use begin::Begun;
use drive::{End, Written};
use packstone::{
    Error,
    io::summary::{Relaxation, Summary},
};
use std::{path::Path, process::ExitCode};

pub use begin::{CHECKPOINTS, Last, RunArgs, last};
pub use drive::{interrupted, listen};

pub fn run(args: &RunArgs) -> anyhow::Result<ExitCode> {
    let named = args.scene.as_ref().or(args.resume.as_ref());
    let of_scene = |error| named.map_or_else(|| unreachable!("clap asks for one of them"), |name| about(name, error));
    let Begun { scene, folder, mut run } = begin::begin(args).map_err(of_scene)?;
    tell(run.simulation.notice());
    run.results.notices().iter().for_each(note);
    if let Some(flood) = run.schedule.end.and_then(|end| run.flood(end)) {
        note(flood);
    }
    let end = run.drive()?;
    if let End::Stopped(error @ Error::Device(_)) = end {
        // Nothing can be asked of it any more.
        complain(format!("{error}; {}", run.way_on(&folder)));
        return Ok(ExitCode::from(STOPPED));
    }
    let Written { summary, end, place, spoilt } = match run.write(&scene, end) {
        Err(error @ Error::Io { .. }) => {
            complain(format!("{error}; the last state could not be written anywhere"));
            return Ok(ExitCode::from(STOPPED));
        }
        written => written?,
    };
    if let Some(Relaxation { force_balance_max: Some(worst), force_balance_grain: Some(grain), .. }) =
        summary.relaxation
        && !args.json
    {
        say(format!("forces on a grain balance to {worst:.1e} of its weight or more (grain {grain})"));
    }
    summary.doubts.iter().for_each(warn);
    if args.json {
        say(json(&summary, &place)?);
    } else {
        say(verdict(&summary));
        say(format!("results in {}", place.display()));
    }
    if place != folder && spoilt.is_none() {
        note(format!("{} keeps the older result, as this run did not come to its end", folder.display()));
    }
    if let Some(error) = &spoilt {
        complain(format!("{error}; the last state is in {}", place.display()));
    }
    Ok(match end {
        End::Stopped(error) => {
            // If that was the error, it has been said.
            if spoilt.is_none() || !matches!(error, Error::Io { .. }) {
                complain(format!("{}: {error}", scene.file()));
            }
            ExitCode::from(STOPPED)
        }
        _ if spoilt.is_some() => ExitCode::from(STOPPED),
        End::Reached | End::AtRest if args.strict && !summary.doubts.is_empty() => ExitCode::from(UNSURE),
        End::Reached | End::AtRest => ExitCode::SUCCESS,
        End::Interrupted => ExitCode::from(INTERRUPTED),
    })
}

/// How a run has ended, in a line.
fn verdict(summary: &Summary) -> String {
    let Summary { ended, steps, time, deepest_overlap, .. } = summary;
    let deepest = deepest_overlap.as_ref().map_or(0.0, |deepest| deepest.over_radius);
    let unsolved = summary.relaxation.as_ref().map(|relaxation| match relaxation.unconverged_steps {
        0 => ", all steps solved".to_owned(),
        unsolved => format!(", {unsolved} steps not solved"),
    });
    let doubts = match summary.doubts.len() {
        0 => "no doubts",
        1 => "a doubt, see above",
        _ => "doubts, see above",
    };
    format!(
        "ended: {ended} (step {steps}, t = {time:.4e} s), deepest overlap {deepest:.1e} radii{}; {doubts}",
        unsolved.unwrap_or_default()
    )
}

/// The summary, with the folder that it is in.
fn json(summary: &Summary, place: &Path) -> anyhow::Result<String> {
    let mut json = serde_json::to_value(summary)?;
    json["folder"] = place.to_string_lossy().into();
    Ok(serde_json::to_string_pretty(&json)?)
}
