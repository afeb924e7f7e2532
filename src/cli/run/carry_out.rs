//! A run from its beginning to the last word.

use super::super::common::{DONE, INTERRUPTED, STOPPED, UNSURE, complain, note, say, tell, warn};
use super::begin::{Begun, RunArgs};
use super::drive::{End, Written, flood};
use packstone::{
    Error,
    gpu::selected,
    io::summary::{Relaxation, Summary},
};
use std::path::{Path, PathBuf};

/// What has come of a run, or of a stage.
pub struct Outcome {
    /// Exit code.
    pub code: u8,
    /// None if it could not be written.
    pub summary: Option<Summary>,
    /// The folder with the result.
    pub place: PathBuf,
    /// Whether the run came to its end, and all of it was written where it should be.
    pub complete: bool,
}

/// Run it to its end, and write and say what has come of it; of a `stage` of several but what is its own.
///
/// # Errors
/// For what is none of a run: that is said here.
pub fn carry_out(begun: Begun, args: &RunArgs, stage: Option<&str>) -> anyhow::Result<Outcome> {
    let Begun { scene, folder, mut run } = begun;
    tell(run.simulation.notice());
    if selected().is_some() && run.simulation.engine().name() == "cpu" {
        warn("--adapter is not used: the run is on the cpu engine");
    }
    run.results.notices().iter().for_each(note);
    if stage.is_none() {
        flood(run.simulation.assembly(), &run.schedule).iter().for_each(note);
    }
    let end = run.drive()?;
    let nothing = |place: PathBuf| Outcome { code: STOPPED, summary: None, place, complete: false };
    if let End::Stopped(error @ Error::Device(_)) = end {
        // Nothing can be asked of it any more.
        complain(format!("{error}; {}", run.way_on(&folder)));
        return Ok(nothing(folder));
    }
    let Written { summary, end, place, spoilt } = match run.write(&scene, end) {
        Err(error @ Error::Io { .. }) => {
            complain(format!("{error}; the last state could not be written anywhere"));
            return Ok(nothing(folder));
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
    match (stage, args.json) {
        (None, true) => say(json(&summary, &place)?),
        (None, false) => {
            say(verdict(&summary));
            say(format!("results in {}", place.display()));
        }
        // The run as a whole has a summary of all stages.
        (Some(_), true) => {}
        (Some(stage), false) => say(format!("stage {stage}: {}", verdict(&summary))),
    }
    if place != folder && spoilt.is_none() && stage.is_none() {
        note(format!("{} keeps the older result, as this run did not come to its end", folder.display()));
    }
    if let Some(error) = &spoilt {
        complain(format!("{error}; the last state is in {}", place.display()));
    }
    let complete = spoilt.is_none() && matches!(end, End::Reached(_));
    let code = match end {
        End::Stopped(error) => {
            // If that was the error, it has been said.
            if spoilt.is_none() || !matches!(error, Error::Io { .. }) {
                complain(format!("{}: {error}", scene.file()));
            }
            STOPPED
        }
        _ if spoilt.is_some() => STOPPED,
        End::Reached(_) if args.strict && !summary.doubts.is_empty() => UNSURE,
        End::Reached(_) => DONE,
        End::Interrupted => INTERRUPTED,
    };
    Ok(Outcome { code, summary: Some(summary), place, complete })
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
