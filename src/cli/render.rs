//! `packstone render`

mod bar;

use super::{
    common::{note, say},
    measure::state,
};
use anyhow::bail;
use glam::DVec3;
use packstone::{
    gpu::{Device, DeviceOptions},
    io::{
        self, Record,
        contacts::ends,
        csv::GrainRow,
        names::{CHECKPOINT, FINAL, FINAL_BIN, MEMBERS, PREVIOUS, SUMMARY, snapshot, snapshot_number},
        read_rows,
        summary::Surroundings,
    },
    measure::{Packing, micromechanics::stress::stress_of_particles},
    render::{ColorBy, Picture, Rod, colors_between, draw, range, write_png},
};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Draw the last state of a run, a snapshot, or any table of grains
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  packstone render out/heap_2d --color speed\n  \
                        packstone render out/heap_2d --chains\n  \
                        packstone render out/bed --color force --camera 30,10 -o bed.png\n  \
                        packstone render out/bed/snapshot_000010.bin\n  \
                        packstone render grains.csv -o grains.png --width 800 --height 800")]
pub struct RenderArgs {
    /// Folder of a run, a binary file of one, or a CSV file with the columns x, y, z and radius
    #[arg(value_name = "DIR_OR_STATE")]
    state: PathBuf,
    /// What the colours show; force, stress and coordination take the last checkpoint of a run
    #[arg(long, value_enum, default_value_t = Color::Radius)]
    color: Color,
    /// Draw the contacts of the last checkpoint as rods in place of the grains, as thick as their normal force is large
    #[arg(long, conflicts_with = "color")]
    chains: bool,
    /// Where the eye is, seen from the middle: degrees around the upright axis and above the horizon. Disks are seen
    /// straight on
    #[arg(long, value_name = "AROUND,ABOVE", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    camera: Option<Vec<f32>>,
    /// Which way is up, a vector [default: against gravity, or z, of disks y]
    #[arg(long, value_name = "X,Y[,Z]", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    up: Option<Vec<f64>>,
    /// Draw no bar that tells what the colours stand for
    #[arg(long)]
    no_bar: bool,
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

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Color {
    Radius,
    Speed,
    Id,
    /// A hue for each material
    Material,
    /// Sum of the contact forces on a grain, N
    Force,
    /// Mean pressure in a grain, Pa
    Stress,
    /// Contacts of a grain
    Coordination,
}

impl Color {
    fn by(self) -> ColorBy {
        match self {
            Color::Radius => ColorBy::Radius,
            Color::Speed => ColorBy::Speed,
            Color::Id | Color::Material => ColorBy::Id,
            Color::Force | Color::Stress | Color::Coordination => ColorBy::Size,
        }
    }

    fn title(self) -> &'static str {
        match self {
            Color::Radius => "radius (m)",
            Color::Speed => "speed (m/s)",
            Color::Id => "number",
            Color::Material => "material",
            Color::Force => "sum of forces (N)",
            Color::Stress => "pressure (Pa)",
            Color::Coordination => "contacts",
        }
    }

    /// Whether it takes contacts.
    fn has_contacts(self) -> bool {
        matches!(self, Color::Force | Color::Stress | Color::Coordination)
    }
}

/// What there is to draw.
struct View {
    grains: Vec<GrainRow>,
    surroundings: Surroundings,
    /// What is asked for of contacts, grain by grain.
    of_contacts: Vec<f64>,
    /// Ends and normal forces, N, of contacts.
    contacts: Vec<([DVec3; 2], f64)>,
}

pub fn render(args: &RenderArgs) -> anyhow::Result<ExitCode> {
    let view = if args.chains || args.color.has_contacts() {
        with_contacts(args)?
    } else {
        let (grains, surroundings) = read(&args.state)?;
        View { grains, surroundings, of_contacts: Vec::new(), contacts: Vec::new() }
    };
    let (picture, title, range) = picture(args, &view)?;
    let device = Device::open(DeviceOptions::default())?;
    let mut pixels = draw(&device.device, &device.queue, &picture)?;
    if let Some(range) = range.filter(|_| !args.no_bar) {
        bar::draw(&mut pixels, (picture.width, picture.height), title, range)?;
    }
    let path = args.output.clone().unwrap_or_else(|| default_path(&args.state));
    io::replace(&path, |part| write_png(part, picture.width, picture.height, &pixels))?;
    say(path.display());
    Ok(ExitCode::SUCCESS)
}

/// The last checkpoint of a run.
fn with_contacts(args: &RenderArgs) -> anyhow::Result<View> {
    let mut simulation = state(&args.state)?;
    let (grains, clumps, walls) = (simulation.grains()?, simulation.clumps()?, simulation.walls()?);
    let contacts = simulation.contacts()?;
    let domain = simulation.domain()?;
    let assembly = simulation.assembly_in(domain);
    let packing = Packing::new(&assembly, &grains, &clumps, &walls, &contacts);
    let mut of_particles = vec![0.0; packing.particles()];
    match args.color {
        Color::Stress => {
            let dims = assembly.dimension;
            let pressure = |s: [[f64; 3]; 3]| (0..dims).map(|k| s[k][k]).sum::<f64>() / dims as f64;
            of_particles = stress_of_particles(&packing).into_iter().map(pressure).collect();
        }
        color => packing.all_actions().for_each(|action| {
            of_particles[action.particle] += if color == Color::Force { action.force.length() } else { 1.0 };
        }),
    }
    Ok(View {
        of_contacts: (0..grains.len()).map(|grain| of_particles[packing.particle_of(grain as u32)]).collect(),
        contacts: contacts.iter().map(|contact| (ends(&packing, contact), contact.normal_force())).collect(),
        grains: grains.iter().enumerate().map(|(id, grain)| GrainRow::new(id, grain, &assembly.materials)).collect(),
        surroundings: Surroundings::new(&assembly, &walls),
    })
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

/// Of the normal force, the largest being 1: contacts with less are not drawn as rods.
const THIN: f64 = 0.02;
/// Radius of the thickest rod over that of the mean grain.
const THICKEST: f64 = 0.45;

/// What is drawn, what its colours show, and what the ends of their map stand for.
fn picture(args: &RenderArgs, view: &View) -> anyhow::Result<(Picture, &'static str, Option<[f64; 2]>)> {
    let View { grains, surroundings, of_contacts, contacts } = view;
    let dimension = surroundings.dimension;
    let mean = grains.iter().map(|grain| grain.radius).sum::<f64>() / grains.len() as f64;
    let gravity = surroundings.gravity();
    let names: BTreeSet<&str> = grains.iter().map(|grain| grain.material.as_str()).collect();
    let value = |(row, grain): (usize, &GrainRow)| match args.color {
        Color::Radius => grain.radius,
        Color::Speed => grain.velocity().length(),
        Color::Id => grain.id.unwrap_or(row as u64) as f64,
        Color::Material => names.range(..grain.material.as_str()).count() as f64,
        Color::Force | Color::Stress | Color::Coordination => of_contacts[row],
    };
    let values: Vec<f64> = grains.iter().enumerate().map(value).collect();
    // Slower than that, grains take a thousand times as long for their diameter as they would fall: no flow.
    let slow = 1e-3 * (gravity.length() * 2.0 * mean).sqrt();
    let by = args.color.by();
    let scale = range(by, &values, if args.color == Color::Speed { slow } else { f64::NEG_INFINITY });
    let up = match args.up.as_deref() {
        None if gravity != DVec3::ZERO => -gravity,
        None => DVec3::AXES[dimension - 1],
        Some(numbers @ ([_, _] | [_, _, _])) => {
            DVec3::new(numbers[0], numbers[1], numbers.get(2).copied().unwrap_or(0.0))
        }
        Some(_) => bail!("--up: must be two or three numbers"),
    };
    let eye = match args.camera.as_deref() {
        None => Picture::EYE,
        Some(&[around, above]) if around.is_finite() && (-90.0..=90.0).contains(&above) => (around, above),
        Some(_) => bail!("--camera: must be two numbers of degrees, the second from -90 to 90"),
    };
    let mut picture = Picture {
        dimension,
        centers: grains.iter().map(GrainRow::position).collect(),
        radii: grains.iter().map(|g| g.radius).collect(),
        colors: colors_between(by, &values, scale),
        rods: Vec::new(),
        eye,
        up,
        walls: surroundings.walls(),
        domain: surroundings.domain(),
        width: args.width,
        height: args.height.unwrap_or_else(|| (f64::from(args.width) * aspect(grains, dimension)) as u32),
    };
    if !args.chains {
        return Ok((picture, args.color.title(), scale));
    }
    let forces: Vec<f64> = contacts.iter().map(|(_, force)| *force).collect();
    let scale = range(ColorBy::Size, &forces, f64::NEG_INFINITY);
    let largest = scale.map_or(0.0, |[_, largest]| largest);
    let rods = contacts.iter().zip(colors_between(ColorBy::Size, &forces, scale));
    let rods = rods.filter(|((_, force), _)| *force > THIN * largest);
    let rod = |(&(ends, force), color)| Rod { ends, radius: THICKEST * mean * force / largest, color };
    picture.rods = rods.map(rod).collect();
    if picture.rods.is_empty() {
        bail!("{}: has no contact that presses", args.state.display());
    }
    (picture.centers, picture.radii, picture.colors) = (Vec::new(), Vec::new(), Vec::new());
    Ok((picture, "normal force (N)", scale))
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
