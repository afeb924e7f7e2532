//! What there is to say of steps and output, and of stages before anything has run.

use super::super::{common::size, table::table};
use super::estimate::{Estimate, PER_STEPS, duration};
use packstone::{
    io::schedule::{Forecast, Schedule},
    scene::{Assembly, Scene, Stage},
    simulation::{Options, Setup},
};
use serde_json::{Value, json};

/// How many steps there are, and what a run writes.
pub fn steps_and_output(assembly: &Assembly, schedule: &Schedule) -> (String, String) {
    let amount = |steps| {
        let Forecast { rows, snapshots, all, .. } = Forecast::new(assembly, schedule, steps);
        format!("{rows} rows of history, {snapshots} snapshots; about {} files, {}", all.files, size(all.bytes))
    };
    let or_rest = if assembly.stop.equilibrium.is_some() { ", or until equilibrium" } else { "" };
    match schedule.end {
        Some(end) => (format!("{end}{or_rest}"), amount(end)),
        None => ("until equilibrium".to_owned(), format!("per million steps {}", amount(PER_STEPS))),
    }
}

/// What of a run that writes so much there is to say in JSON.
pub fn output(assembly: &Assembly, schedule: &Schedule) -> Value {
    let steps = schedule.end.unwrap_or(PER_STEPS);
    let Forecast { rows, snapshots, all, .. } = Forecast::new(assembly, schedule, steps);
    json!({ "steps": steps, "rows": rows, "snapshots": snapshots, "files": all.files, "bytes": all.bytes })
}

/// A stage as far as it is known before anything has run.
pub struct StageOutline {
    name: String,
    required: bool,
    assembly: Assembly,
    schedule: Schedule,
    dt: f64,
}

/// The stages of a scene; every one is looked at as a run does before it begins.
pub fn outlines(scene: &Scene, first: &Assembly, options: Options) -> packstone::Result<Vec<StageOutline>> {
    let outline = |(stage, assembly): (&Stage, packstone::Result<Assembly>)| {
        let assembly = assembly?;
        let dt = Setup::new(&assembly, &options)?.state.params.dt;
        let schedule = Schedule::new(&assembly, dt);
        Ok(StageOutline { name: stage.name.clone(), required: stage.required, assembly, schedule, dt })
    };
    scene.stages().iter().zip(scene.outlines(first)).map(outline).collect()
}

impl StageOutline {
    /// If its steps take as long as the first ones of the first stage.
    fn seconds(&self, estimate: Option<&Estimate>) -> Option<f64> {
        estimate.zip(self.schedule.end).map(|(estimate, end)| estimate.seconds_per_step * end as f64)
    }

    pub fn table(stages: &[StageOutline], estimate: Option<&Estimate>) -> String {
        let row = |stage: &StageOutline| {
            let (steps, output) = steps_and_output(&stage.assembly, &stage.schedule);
            let time = stage.seconds(estimate).map_or("-".to_owned(), duration);
            vec![stage.name.clone(), format!("{:e}", stage.dt), time, steps, output]
        };
        table(&["name", "time step, s", "wall time", "steps", "output"], &stages.iter().map(row).collect::<Vec<_>>())
    }

    pub fn json(&self, estimate: Option<&Estimate>) -> Value {
        json!({
            "name": self.name,
            "required": self.required,
            "dt": self.dt,
            "steps": self.schedule.end,
            "equilibrium": self.assembly.stop.equilibrium,
            "output": output(&self.assembly, &self.schedule),
            "wall_seconds": self.seconds(estimate),
        })
    }
}
