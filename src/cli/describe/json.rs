//! What `packstone describe` says, as JSON.

use super::estimate::Estimate;
use super::stages::output;
use packstone::{
    engine::{aliases::total, placements::layouts_and_aliases, programs::bytes},
    io::schedule::Schedule,
    measure::Sizes,
    scene::{Assembly, Scene},
    simulation::Setup,
};
use serde_json::{Map, Value, json};

/// Each once, in the order of the plans.
pub fn kernels(setup: &Setup) -> Vec<&'static str> {
    let mut kernels = Vec::new();
    for stage in setup.plans.stages() {
        if !kernels.contains(&stage.kernel) {
            kernels.push(stage.kernel);
        }
    }
    kernels
}

/// Keys are those of `summary.json` where that has the same.
pub fn json(
    scene: &Scene,
    assembly: &Assembly,
    setup: &Setup,
    schedule: &Schedule,
    count: Option<u32>,
    estimate: Option<&Estimate>,
) -> packstone::Result<Value> {
    let state = &setup.state;
    let slots = state.model.slots().into_iter().map(|(slot, choice)| (slot.to_owned(), choice.into()));
    let sizes = count.map_or(state.sizes, |count| state.sizes.for_bodies(count as usize));
    let (layouts, aliases) = layouts_and_aliases(&state.model, &setup.plans, &sizes)?;
    let arrays: Vec<_> = bytes(&state.model, &layouts, &sizes).collect();
    let total = total(&state.model, &layouts, &aliases, &sizes);
    let array = |(array, bytes): &(&packstone::state::Array, u64)| {
        // What lies in the memory of others needs none.
        let hosts: Vec<&str> = aliases.get(array).into_iter().flatten().map(|room| room.host.name).collect();
        let bytes = if hosts.is_empty() { *bytes } else { 0 };
        json!({
            "name": array.name,
            "elements": sizes.of(array.length),
            "bytes": bytes,
            "in": hosts,
            "unit": state.unit_text(array),
        })
    };
    Ok(json!({
        "scene": scene.name(),
        "file": scene.file(),
        "dimension": assembly.dimension,
        "particles": assembly.grains.len(),
        "inserted": assembly.waiting,
        "fixed": assembly.grains.iter().filter(|grain| grain.fixed).count(),
        "clumps": assembly.clumps.len(),
        "walls": assembly.walls.len(),
        "materials": assembly.materials.len(),
        "diameters": Sizes::of(assembly),
        "dt": state.params.dt,
        "dt_bound": setup.dt_bound,
        "steps": schedule.end,
        "equilibrium": assembly.stop.equilibrium,
        "output": output(assembly, schedule),
        "wall_time": estimate,
        "model": slots.collect::<Map<String, Value>>(),
        "kernels": kernels(setup),
        "arrays": arrays.iter().map(array).collect::<Vec<_>>(),
        "bytes": total,
        "bytes_per_particle": total as f64 / sizes.bodies as f64,
    }))
}
