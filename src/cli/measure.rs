//! `packstone measure`

use super::{
    common::{note, say},
    last::{CHECKPOINTS, Last, last},
};
use anyhow::bail;
use glam::DVec3;
use packstone::{
    Error,
    io::{Export, MeasureFiles, folder},
    measure::{Asked, Measures, Packing, micromechanics::equilibrium::Energies},
    scene::{Assembly, Domain},
    simulation::Simulation,
};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Stress, contacts, coordination, distributions, profiles and equilibrium of the state of a run
#[derive(clap::Args, Default)]
#[command(after_help = "Examples:\n  packstone measure out/heap_2d\n  \
                        packstone measure out/heap_2d --json\n  \
                        packstone measure out/heap_2d --box -0.01,0,0.01,0.02 --axis x --width 0.002 --out measures\n  \
                        packstone measure out/heap_2d --export contacts.csv --export heap.npz\n\n\
                        Everything is computed on the host in double precision, from the last checkpoint of the run, \
                        whatever it ran on.")]
pub struct MeasureArgs {
    /// Folder of a run, or a checkpoint in one
    #[arg(value_name = "DIR_OR_STATE")]
    state: PathBuf,
    /// Print all measures as JSON instead of words
    #[arg(long)]
    json: bool,
    /// Print single measures as lines of CSV instead of words
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Write all measures to this folder too: measures.json, measures.csv, grains.csv, contacts.csv, distributions.csv,
    /// profile.csv and radial_distribution.csv
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write grains and contacts to a file, by its ending: .csv and .vtp contacts alone, .npz, .xyz (extended XYZ) and
    /// .dump (LAMMPS) grains; may be repeated
    #[arg(long, value_name = "FILE")]
    export: Vec<PathBuf>,
    /// Measure what is in a box, too: its lower and its upper corner, m, one number per axis each
    #[arg(long = "box", value_name = "X,Y[,Z],X,Y[,Z]", value_delimiter = ',', allow_hyphen_values = true)]
    bounds: Option<Vec<f64>>,
    /// Axis of the profile [default: that of gravity, or the last one]
    #[arg(long, value_parser = ["x", "y", "z"])]
    axis: Option<String>,
    /// Width of the slabs that the profile is averaged over, m [default: two mean diameters]
    #[arg(long, value_name = "M")]
    width: Option<f64>,
    /// What is left of forces and moments on a grain in equilibrium, over its weight or the mean contact force [default:
    /// stop.equilibrium of the scene, or 1e-3]
    #[arg(long, value_name = "RATIO")]
    tolerance: Option<f64>,
}

/// Width of slabs over the mean radius: thinner ones would be many, and hold nothing.
const THINNEST: f64 = 1e-3;
/// Of equilibrium, where nothing says otherwise.
const TOLERANCE: f64 = 1e-3;

pub fn measure(args: &MeasureArgs) -> anyhow::Result<ExitCode> {
    let exports = args.export.iter().map(|path| Export::of(path)).collect::<packstone::Result<Vec<_>>>()?;
    with_measures(args, |files, simulation| {
        for export in &exports {
            export.write(files.packing, files.step, files.time)?;
        }
        if let Some(folder) = &args.out {
            files.write(folder)?;
        }
        match () {
            () if args.json => say(serde_json::to_string_pretty(&files.json())?),
            () if args.csv => say(files.csv()?.trim_end()),
            () => say(words(files.measures, simulation)),
        }
        Ok(ExitCode::SUCCESS)
    })
}

/// Single numbers of the last state of a run, by their names.
pub fn numbers(run: &Path) -> anyhow::Result<Vec<(String, String)>> {
    let args = MeasureArgs { state: run.to_owned(), ..MeasureArgs::default() };
    with_measures(&args, |files, _| Ok(files.numbers()))
}

/// Do something with the measures of a state.
fn with_measures<T>(
    args: &MeasureArgs,
    use_them: impl FnOnce(&MeasureFiles, &Simulation) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let mut simulation = state(&args.state)?;
    let domain = simulation.domain()?;
    let asked = asked(args, &simulation, &domain)?;
    let sample = simulation.sample()?;
    let energies =
        Energies { kinetic: sample.kinetic_energy, elastic: sample.elastic_energy, of_step: sample.step_energy };
    let (grains, clumps, walls) = (simulation.grains()?, simulation.clumps()?, simulation.walls()?);
    let contacts = simulation.contacts()?;
    let assembly = simulation.assembly_in(domain);
    let packing = Packing::new(&assembly, &grains, &clumps, &walls, &contacts);
    let measures = Measures::of(&packing, energies, &asked);
    let (step, time) = (simulation.step(), simulation.time());
    use_them(&MeasureFiles { packing: &packing, measures: &measures, step, time }, &simulation)
}

/// The state of a run, on the host: the result, or where there is none, what there is of a partial one.
pub fn state(path: &Path) -> anyhow::Result<Simulation> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let named = [name.as_str()];
    let (folders, names) = match path.is_file() {
        true if CHECKPOINTS.contains(&named[0]) => {
            (vec![path.parent().unwrap_or(Path::new(".")).to_owned()], &named[..])
        }
        true => {
            let message = "is no state with contacts; name the folder of a run, or a checkpoint.bin in one";
            return Err(Error::Folder(format!("{}: {message}", path.display())).into());
        }
        false => {
            // Of a run in stages that of the last one.
            let folders = folder::resumable(path)?.into_iter().rev();
            (folders.map(|folder| folder::last_stage(&folder).unwrap_or(folder)).collect(), &CHECKPOINTS[..])
        }
    };
    let view = |_: &Path, mut checkpoint, assembly: &Assembly| Simulation::view(assembly.clone(), &mut checkpoint);
    let Last { from, state: simulation, .. } = last(&folders, names, &[], view)?;
    if from != *path && !path.is_file() {
        note(format!("measured is {}", from.display()));
    }
    Ok(simulation)
}

/// What the arguments come down to in a scene.
fn asked(args: &MeasureArgs, simulation: &Simulation, domain: &Domain) -> anyhow::Result<Asked> {
    let assembly = simulation.assembly();
    let dims = assembly.dimension;
    let bounds = match args.bounds.as_deref() {
        None => None,
        Some(numbers) if numbers.len() == 2 * dims => {
            let corner = |k: usize| [0, 1, 2].map(|axis| if axis < dims { numbers[k * dims + axis] } else { 0.0 });
            let [lower, upper] = [0, 1].map(|k| DVec3::from_array(corner(k)));
            if let Some(axis) = (0..dims).find(|axis| !(lower[*axis] < upper[*axis])) {
                bail!(
                    "--box: its upper corner must be above the lower one, but along {} it is not",
                    ["x", "y", "z"][axis]
                );
            }
            let period = |axis: usize| domain.upper[axis] - domain.lower[axis];
            let is_longer = |axis: usize| upper[axis] - lower[axis] > (1.0 + 1e-12) * period(axis);
            if let Some(axis) = (0..dims).find(|axis| domain.periodic[*axis] && is_longer(*axis)) {
                let (name, period) = (["x", "y", "z"][axis], period(axis));
                bail!("--box: must be no longer than the period along {name}, which is {period:e} m");
            }
            Some([lower, upper])
        }
        Some(numbers) => bail!("--box: must be {} numbers in {dims} dimensions, not {}", 2 * dims, numbers.len()),
    };
    let g = assembly.gravity;
    let upright = (0..dims).rev().max_by(|a, b| g[*a].abs().total_cmp(&g[*b].abs())).filter(|_| g != DVec3::ZERO);
    let axis = match args.axis.as_deref() {
        None => upright.unwrap_or(dims - 1),
        Some(name) => ["x", "y", "z"].iter().position(|axis| *axis == name).expect("clap lets only axes through"),
    };
    if axis >= dims {
        bail!("--axis z: the scene has dimension = 2");
    }
    let thinnest = THINNEST * assembly.mean_radius();
    if let Some(width) = args.width.filter(|width| !(*width >= thinnest && width.is_finite())) {
        bail!("--width {width}: must be a number of m, and at least {thinnest:e}, a thousandth of the mean radius");
    }
    let tolerance = args.tolerance.or(assembly.stop.equilibrium).unwrap_or(TOLERANCE);
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        bail!("--tolerance {tolerance}: must be a positive number");
    }
    Ok(Asked { bounds, axis, width: args.width, tolerance })
}

/// The single measures in lines.
fn words(measures: &Measures, simulation: &Simulation) -> String {
    let Measures { free, solid_fraction, coordination, stress, walls, equilibrium, distributions, .. } = measures;
    let mut lines = vec![format!("step {}, t = {:e} s: {free} free grains", simulation.step(), simulation.time())];
    let mut line = |name: &str, text: String| lines.push(format!("{name:<22}{text}"));
    let number = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.6}"));
    let fraction = |f: Option<packstone::measure::PackingFraction>| match f {
        Some(f) if f.error > 0.0 => format!("{:.6} ± {:.1e}", f.value, f.error),
        other => number(other.map(|f| f.value)),
    };
    line(
        "solid fraction",
        format!(
            "{} in the cell, {} overall, {} inside",
            number(solid_fraction.cell),
            fraction(solid_fraction.overall),
            fraction(solid_fraction.inside)
        ),
    );
    if let Some(part) = &measures.part {
        line(
            "in the box",
            format!("solid fraction {:.6}, pressure {:.6e} Pa", part.solid_fraction, part.stress.pressure),
        );
    }
    line(
        "coordination",
        format!(
            "{:.4}, {} without {} rattlers; {} contacts, isostatic excess {}",
            coordination.coordination_number,
            number(coordination.coordination_without_rattlers),
            coordination.rattlers,
            coordination.contacts,
            coordination.isostatic_excess
        ),
    );
    if let Some(stress) = stress {
        line("pressure", format!("{:.6e} Pa, deviator {:.6e} Pa", stress.pressure, stress.deviator));
        for row in &stress.total[..simulation.assembly().dimension] {
            let row: Vec<_> = row[..simulation.assembly().dimension].iter().map(|x| format!("{x:>14.6e}")).collect();
            line("stress (Pa)", row.join(" "));
        }
    }
    for wall in walls {
        let [f, m] = [wall.force, wall.moment];
        line(
            &format!("wall {}", wall.name),
            format!(
                "force {:.4e} {:.4e} {:.4e} N, moment {:.4e} {:.4e} {:.4e} N m, {} contacts",
                f.x, f.y, f.z, m.x, m.y, m.z, wall.contacts
            ),
        );
    }
    if let Some(force) = &distributions.normal_force {
        line("normal force", format!("mean {:.4e} N, largest {:.4e} N", force.mean, force.most));
    }
    if let Some(overlap) = &distributions.overlap_over_radius {
        line("overlap", format!("mean {:.2e} radii, largest {:.2e}", overlap.mean, overlap.most));
    }
    if let Some(sliding) = distributions.sliding_fraction {
        line("sliding", format!("{:.4} of the contacts with friction", sliding));
    }
    if let Some(slope) = &measures.slope {
        let (angle, error) = (slope.angle.to_degrees(), slope.error.to_degrees());
        line("slope of the heap", format!("{angle:.1}° ± {error:.1}°, of {} columns", slope.columns));
    }
    let worst = equilibrium.residual_force_ratio.as_ref();
    let particle = if simulation.assembly().clumps.is_empty() { "grain" } else { "clump" };
    line(
        "equilibrium",
        format!(
            "{}: residual force up to {} of the larger of weight and mean contact force{}, {} floppy grains, Coulomb margin {}",
            if equilibrium.certified { "yes" } else { "no" },
            worst.map_or("-".to_owned(), |worst| format!("{:.1e}", worst.worst)),
            worst.map_or(String::new(), |worst| format!(" ({particle} {})", worst.particle)),
            equilibrium.floppy,
            equilibrium
                .coulomb_margin
                .map_or("-".to_owned(), |margin| format!("{:.3}", (1e3 * margin).round() / 1e3 + 0.0))
        ),
    );
    lines.join("\n")
}
