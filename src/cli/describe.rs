//! `packstone describe`

mod estimate;
mod json;
mod stages;

use super::common::{SceneArgs, about, engines, load, say};
use super::from::From;
use super::table::table;
use estimate::estimate;
use glam::UVec3;
use json::kernels;
use packstone::{
    engine::{aliases::total, placements::layouts_and_aliases, programs::bytes},
    io::schedule::Schedule,
    measure::{Percentiles, Sizes},
    scene::{Assembly, Scene},
    simulation::{EngineChoice, Options, Setup, Simulation, engine_of},
};
use stages::{StageOutline, outlines, steps_and_output};
use std::{path::PathBuf, process::ExitCode};

/// Show what a scene comes down to: model, plan, kernels, arrays, memory, time step
#[derive(clap::Args)]
#[command(after_help = "Example:\n  packstone describe examples/scenes/heap_2d.toml --set material.wood.friction=0")]
pub struct DescribeArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Arrays of as many grains of the same kind, of which every listed pair is in contact
    #[arg(long, value_name = "GRAINS", value_parser = clap::value_parser!(u32).range(1..))]
    count: Option<u32>,
    /// Describe what a run would do that begins with the grains of the result in DIR
    #[arg(long, value_name = "DIR")]
    from: Option<PathBuf>,
    /// Do the first steps, and tell from these how long a run takes
    #[arg(long)]
    estimate: bool,
    /// What it would run on; auto takes what a run would take here
    #[arg(long, default_value = "auto", value_parser = engines(["auto", "gpu", "cpu"]))]
    pub engine: EngineChoice,
    /// Print it as JSON, but for the plans
    #[arg(long)]
    json: bool,
}

pub fn describe(args: &DescribeArgs) -> anyhow::Result<ExitCode> {
    show(args).map_err(|error| about(&args.scene.scene, error))
}

fn show(args: &DescribeArgs) -> anyhow::Result<ExitCode> {
    let SceneArgs { scene: file, set, device } = &args.scene;
    let from = args.from.as_ref().map(|from| From::read(&Scene::load(file, set)?, from)).transpose()?;
    let (scene, assembly) = match &from {
        Some(from) => (from.scene().clone(), from.assembly().clone()),
        None => load(file, set)?,
    };
    let options = Options { engine: args.engine, ..device.options() };
    let engine = match args.engine {
        // It is not needed to tell what it would have to do.
        EngineChoice::Gpu => EngineChoice::Gpu,
        _ => engine_of(&assembly, &options)?,
    };
    let setup = Setup::new(&assembly, &Options { engine, ..options })?;
    // With what comes in over time.
    let whole = assembly.whole();
    // Where a run would refuse a grain, it is said here, too.
    setup.fill(&assembly, &mut |_, _, _| Ok(()))?;
    let schedule = Schedule::new(&assembly, setup.state.params.dt);
    let start = || match &from {
        Some(from) => from.simulation(options),
        None => Simulation::new(assembly.clone(), options),
    };
    let estimate = args.estimate.then(|| estimate(start, &schedule)).transpose()?;
    let stages = outlines(&scene, &assembly, options)?;
    if args.json {
        let mut json = json::json(&scene, &whole, &setup, &schedule, args.count, estimate.as_ref())?;
        json["stages"] = stages.iter().map(|stage| stage.json(estimate.as_ref())).collect();
        say(serde_json::to_string_pretty(&json)?);
        return Ok(ExitCode::SUCCESS);
    }
    say(contents(&scene, &whole, &setup));
    say(output(&whole, &schedule));
    estimate.iter().for_each(say);
    if !stages.is_empty() {
        say(format!("\nStages\n{}", indent(&StageOutline::table(&stages, estimate.as_ref()))));
    }
    say(format!("\nModel\n{}", indent(&model(&setup))));
    say(format!("\nPlans\n{}", indent(&setup.plans.to_string())));
    say(format!("\nWGSL\n{}", indent(&files(&setup))));
    say(format!("\nArrays\n{}", indent(&arrays(&setup, args.count)?)));
    Ok(ExitCode::SUCCESS)
}

fn contents(scene: &Scene, assembly: &Assembly, setup: &Setup) -> String {
    let dimension = assembly.dimension;
    let fixed = assembly.grains.iter().filter(|g| g.fixed).count();
    let (grains, walls, materials) = (assembly.grains.len(), assembly.walls.len(), assembly.materials.len());
    let waiting = match assembly.waiting {
        0 => String::new(),
        waiting => format!(", {waiting} of them come in over time"),
    };
    let product =
        |cells: UVec3| cells.to_array()[..dimension].iter().map(u32::to_string).collect::<Vec<_>>().join(" x ");
    let cells = setup.state.level.iter().map(|level| product(level.cells)).collect::<Vec<_>>();
    let (dt, bound) = (setup.state.params.dt, setup.dt_bound);
    let bound = if bound.is_finite() { format!("bound {bound:e} s") } else { "no bound".to_owned() };
    format!(
        "{}: {dimension} dimensions\ngrains     {grains}, {fixed} of them fixed{waiting}\n{}{}walls      {walls}\n\
         materials  {materials}\ncells      {} = {}\ntime step  {dt:e} s, {bound}",
        scene.name(),
        diameters(assembly),
        clumps(assembly),
        setup.state.sizes.cells,
        cells.join(" + "),
    )
}

/// How many steps there are, and what a run writes.
fn output(assembly: &Assembly, schedule: &Schedule) -> String {
    let (steps, output) = steps_and_output(assembly, schedule);
    format!("steps      {steps}\noutput     {output}")
}

/// The sizes of the free grains; nothing where there are none.
fn diameters(assembly: &Assembly) -> String {
    let line = |p: &Percentiles| format!("d10 {:.4e}, d50 {:.4e}, d90 {:.4e} m", p.d10, p.d50, p.d90);
    let lines = |s: Sizes| {
        format!("diameters  {} by number\n           {} by volume\n", line(&s.by_number), line(&s.by_volume))
    };
    Sizes::of(assembly).map_or(String::new(), lines)
}

/// How many clumps of which shapes there are; nothing in a scene without.
fn clumps(assembly: &Assembly) -> String {
    if assembly.clumps.is_empty() {
        return String::new();
    }
    let mut text = format!("clumps     {}, whose members the grains are\n", assembly.clumps.len());
    for (k, shape) in assembly.shapes.iter().enumerate() {
        let count = assembly.clumps.iter().filter(|c| c.shape as usize == k).count();
        let g = shape.gyration.to_array();
        let moments =
            if assembly.dimension == 2 { format!("{:.6}", g[2]) } else { g.map(|j| format!("{j:.6}")).join(", ") };
        let error = if shape.error == 0.0 { "as given".to_owned() } else { format!("error below {:.0e}", shape.error) };
        let fit = shape.misfit.map_or(String::new(), |misfit| {
            format!("; the mesh is {:.4} R away on average, {:.4} R at most", misfit.mean, misfit.max)
        });
        text += &format!(
            "  {:<12} {count} clumps of {} members, reach {:.4} R, J / m R² = {moments} ({error}){fit}\n",
            shape.name,
            shape.members.len(),
            shape.reach()
        );
    }
    text
}

fn model(setup: &Setup) -> String {
    let rows = setup.state.model.slots().into_iter().map(|(slot, choice)| vec![slot.to_owned(), choice.to_owned()]);
    table(&["slot", "choice"], &rows.collect::<Vec<_>>())
}

/// What all kernels share, then the kernels.
fn files(setup: &Setup) -> String {
    let kernels: Vec<String> = kernels(setup).iter().map(|kernel| format!("{kernel}.wgsl")).collect();
    format!("shared   {}\nkernels  {}", setup.state.model.files().join(", "), kernels.join(", "))
}

fn arrays(setup: &Setup, count: Option<u32>) -> packstone::Result<String> {
    let state = &setup.state;
    let sizes = count.map_or(state.sizes, |count| state.sizes.for_bodies(count as usize));
    let (layouts, aliases) = layouts_and_aliases(&state.model, &setup.plans, &sizes)?;
    let per_particle = |bytes: u64| format!("{:.1}", bytes as f64 / sizes.bodies as f64);
    let arrays: Vec<_> = bytes(&state.model, &layouts, &sizes).collect();
    let total = total(&state.model, &layouts, &aliases, &sizes);
    let row = |(array, bytes): &(&packstone::state::Array, u64)| {
        let elements = sizes.of(array.length).to_string();
        let (bytes, per_particle) = match aliases.get(array) {
            None => (bytes.to_string(), per_particle(*bytes)),
            Some(rooms) => {
                let hosts: Vec<&str> = rooms.iter().map(|room| room.host.name).collect();
                (format!("in {}", hosts.join(", ")), "-".to_owned())
            }
        };
        vec![array.name.to_owned(), elements, bytes, per_particle, state.unit_text(array)]
    };
    let mut rows: Vec<_> = arrays.iter().map(row).collect();
    rows.push(vec!["total".to_owned(), "-".to_owned(), total.to_string(), per_particle(total), String::new()]);
    let table = table(&["array", "elements", "bytes", "bytes/particle", "unit"], &rows);
    let (longest, most) = arrays.iter().max_by_key(|(_, bytes)| *bytes).expect("every model has arrays");
    let largest =
        format!("The largest array, {}, needs {:.3} GB of {:.3} GB.", longest.name, gigabytes(*most), gigabytes(total));
    Ok(format!("{table}\n{largest} The arrays of neighbours grow if a packing needs more."))
}

fn gigabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e9
}

fn indent(text: &str) -> String {
    text.lines().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n")
}
