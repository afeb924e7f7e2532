//! Pictures of a run in the course of time.
//!
//! They are drawn while it goes, in view and colours of what there was so far. What they show is kept in files until the
//! run is over; then those are drawn anew that view and colours of all would have had otherwise.

use super::super::common::{note, warn};
use super::super::render::{Look, Scales, View};
use packstone::{
    Error,
    gpu::{Device, DeviceOptions},
    io::{
        names::{FRAMES, FRAMES_RECORD, frame, frame_number},
        schedule::{Clock, Schedule},
        write,
    },
    simulation::Simulation,
};
use serde::{Deserialize, Serialize};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Options of a run that draws them.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct FrameArgs {
    /// Draw so many pictures while the run goes, equally spaced in time, to frames/frame_0001.png and so on in the folder of
    /// the result (of each stage). Where the end is not known it is from N to 2N
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000), conflicts_with = "resume")]
    frames: Option<u64>,
    #[command(flatten)]
    look: Look,
}

/// Steps that no run has.
const NEVER: f64 = 1e18;

/// `frames.json`
#[derive(Serialize, Deserialize)]
struct Series {
    look: Look,
    /// So many are asked for.
    frames: u64,
    /// Its ticks are frames; the last state, which may not be on time, is one in any case.
    clock: Clock,
    /// Whether the end is not known: where there are twice as many as asked for, every second one goes.
    thinned: bool,
    /// Whether the run has come to its end: what they show is not kept any more, and view and colours stay as they are.
    complete: bool,
    scales: Scales,
    shown: Vec<Shown>,
}

#[derive(Serialize, Deserialize)]
struct Shown {
    tick: u64,
    step: u64,
    /// s
    time: f64,
    /// In which view and colours.
    scales: Scales,
}

pub struct Frames {
    device: Device,
    folder: PathBuf,
    series: Series,
}

impl FrameArgs {
    /// What would stop them from being drawn, before anything is on the disk.
    ///
    /// # Errors
    /// If there is no device that draws, and for options that make no sense.
    pub fn check(&self) -> anyhow::Result<()> {
        match self.frames {
            Some(_) => {
                self.look.check()?;
                Ok(Device::open(DeviceOptions::default()).map(drop)?)
            }
            None if self.look != Look::default() => Err(Error::Lacking(
                "--color, --chains, --camera and the like say how pictures look; give --frames N, too, or use packstone render"
                    .to_owned(),
            )
            .into()),
            None => Ok(()),
        }
    }

    /// As they were asked for in one of these results; without one there are none.
    pub fn as_in(results: &[PathBuf]) -> FrameArgs {
        let read = |result: &PathBuf| {
            let text = fs::read(result.join(FRAMES).join(FRAMES_RECORD)).ok()?;
            let Series { frames, look, .. } = serde_json::from_slice(&text).ok()?;
            Some(FrameArgs { frames: Some(frames), look })
        };
        results.iter().find_map(read).unwrap_or_default()
    }

    /// Those of a run that begins, in the folder of its result.
    pub fn begin(&self, result: &Path, schedule: &Schedule) -> anyhow::Result<Option<Frames>> {
        let Some(count) = self.frames else { return Ok(None) };
        let folder = result.join(FRAMES);
        let made = fs::create_dir(&folder);
        made.map_err(|source| Error::Io { path: folder.clone(), source })?;
        let interval = match schedule.end {
            // The last state alone.
            _ if count == 1 => NEVER,
            Some(end) => end as f64 / (count - 1) as f64,
            None => schedule.history.interval,
        };
        let series = Series {
            look: self.look.clone(),
            frames: count,
            clock: Clock { ticks: u64::from(count == 1), ..Clock::new(interval) },
            thinned: schedule.end.is_none(),
            complete: false,
            scales: Scales::default(),
            shown: Vec::new(),
        };
        Ok(Some(Frames { device: Device::open(DeviceOptions::default())?, folder, series }))
    }
}

impl Frames {
    /// Those of a run that goes on from a step, if it has any.
    pub fn resume(result: &Path, step: u64) -> anyhow::Result<Option<Frames>> {
        let folder = result.join(FRAMES);
        let record = folder.join(FRAMES_RECORD);
        let Ok(text) = fs::read(&record) else { return Ok(None) };
        let open = || -> anyhow::Result<(Series, Device)> {
            Ok((serde_json::from_slice(&text)?, Device::open(DeviceOptions::default())?))
        };
        let (series, device) = match open() {
            Ok(opened) => opened,
            Err(error) => {
                warn(format!("{}: {error}; there will be no more frames", record.display()));
                return Ok(None);
            }
        };
        let at = |tick: u64| Clock { ticks: tick, ..series.clock }.next();
        let due = series.shown.iter().take_while(|shown| shown.step <= step && shown.step == at(shown.tick)).count();
        let mut frames = Frames { device, folder, series };
        let kept = (0..due).take_while(|number| frames.is_there(*number)).count();
        if kept < due {
            warn(format!("{}: frames from {} to {due} are gone", frames.folder.display(), kept + 1));
        }
        let series = &mut frames.series;
        series.shown.truncate(kept);
        series.clock.ticks = series.shown.last().map_or(0, |last| last.tick + 1);
        while series.clock.next() <= step {
            series.clock.ticks += 1;
        }
        frames.remove(|number, _| number >= kept)?;
        frames.record()?;
        Ok(Some(frames))
    }

    /// The step of the next one.
    pub fn next(&self) -> u64 {
        self.series.clock.next()
    }

    /// One that is due, of the state now.
    pub fn add(&mut self, simulation: &mut Simulation) -> anyhow::Result<()> {
        self.take(simulation)?;
        if self.series.thinned && self.series.shown.len() as u64 >= 2 * self.series.frames {
            self.thin()?;
        }
        Ok(self.record()?)
    }

    fn take(&mut self, simulation: &mut Simulation) -> anyhow::Result<()> {
        let (step, number) = (simulation.step(), self.series.shown.len());
        let series = &mut self.series;
        let view = View::of_state(simulation, series.look.color(), series.look.chains)?;
        if !series.complete {
            series.scales = series.scales.with(series.look.scales(&view, true)?);
            view.write(&self.folder.join(frame(number + 1, "bin")), step)?;
        }
        let scales = series.scales;
        series.look.draw(&self.device, &view, &scales, &self.folder.join(frame(number + 1, "png")))?;
        series.shown.push(Shown { tick: series.clock.ticks, step, time: simulation.time(), scales });
        series.clock.ticks += 1;
        Ok(())
    }

    /// The last state is one, and all of them get the view and the colours of all.
    pub fn finish(&mut self, simulation: &mut Simulation, is_over: bool) -> anyhow::Result<()> {
        if self.series.shown.last().is_none_or(|last| last.step < simulation.step()) {
            self.take(simulation)?;
        }
        let Series { look, scales, shown, .. } = &mut self.series;
        for (number, shown) in (1..).zip(shown).filter(|(_, shown)| shown.scales != *scales) {
            let (_, view) = View::read(&self.folder.join(frame(number, "bin")))?;
            look.draw(&self.device, &view, scales, &self.folder.join(frame(number, "png")))?;
            shown.scales = *scales;
        }
        self.series.complete |= is_over;
        self.record()?;
        if is_over {
            self.remove(|_, ending| ending == "bin")?;
            note(format!("{} frames are in {FRAMES}", self.series.shown.len()));
        }
        Ok(())
    }

    /// Whether a frame is on the disk as it is in the record.
    fn is_there(&self, number: usize) -> bool {
        let file = |ending| self.folder.join(frame(number + 1, ending));
        let Series { complete, shown, .. } = &self.series;
        let is_of_step = |(step, _): (u64, View)| step == shown[number].step;
        file("png").is_file() && (*complete || View::read(&file("bin")).is_ok_and(is_of_step))
    }

    /// Every second one goes, and the others close up.
    fn thin(&mut self) -> packstone::Result<()> {
        let Series { shown, clock, .. } = &mut self.series;
        let mut kept = 0;
        let mut number = 0;
        let mut moved = Vec::new();
        shown.retain_mut(|shown| {
            let stays = shown.tick.is_multiple_of(2);
            if stays {
                shown.tick /= 2;
                moved.push((number, kept));
                kept += 1;
            }
            number += 1;
            stays
        });
        *clock = Clock { interval: 2.0 * clock.interval, ticks: clock.ticks.div_ceil(2) };
        for (from, to) in moved {
            // Of a run that had come to an end before there are pictures alone.
            for ending in ["png", "bin"].iter().take(if self.series.complete { 1 } else { 2 }) {
                let [from, to] = [from, to].map(|number| self.folder.join(frame(number + 1, ending)));
                fs::rename(&from, &to).map_err(|source| Error::Io { path: to, source })?;
            }
        }
        self.remove(|number, _| number >= kept)
    }

    /// Remove those of its files for whose number, counted from 0, and ending that is said.
    fn remove(&self, goes: impl Fn(usize, &str) -> bool) -> packstone::Result<()> {
        let io = |path: &Path| {
            let path = path.to_owned();
            move |source| Error::Io { path, source }
        };
        for entry in fs::read_dir(&self.folder).map_err(io(&self.folder))? {
            let path = entry.map_err(io(&self.folder))?.path();
            let number = path.file_name().and_then(|name| frame_number(name.to_str()?));
            let ending = path.extension().unwrap_or_default().to_string_lossy();
            if number.is_some_and(|number| number == 0 || goes(number - 1, &ending)) {
                fs::remove_file(&path).map_err(io(&path))?;
            }
        }
        Ok(())
    }

    fn record(&self) -> packstone::Result<()> {
        write(&self.folder.join(FRAMES_RECORD), |file| Ok(serde_json::to_writer_pretty(file, &self.series)?))
    }
}
