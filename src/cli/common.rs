//! What the commands share: exit codes, arguments that say what to run, output.

use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use packstone::{
    gpu::{Arrays, Checks, Restrictions},
    model::Precision,
    scene::{Assembly, Scene},
    simulation::{EngineChoice, Options},
};
use std::{
    fmt::Display,
    io::{self, Write},
    path::{Path, PathBuf},
    sync::OnceLock,
};

/// Exit codes besides 0; 2 is also clap's for wrong usage.
pub const STOPPED: u8 = 1;
pub const BAD_INPUT: u8 = 2;
/// A solver has not reached its tolerance, or a result is doubtful.
pub const UNSURE: u8 = 3;
pub const INTERRUPTED: u8 = 130;

/// What it takes to read a scene.
#[derive(Args)]
pub struct SceneArgs {
    /// Scene file
    pub scene: PathBuf,
    /// Change a value of the scene, such as solver.dt=1e-6; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// How it is computed.
#[derive(Args)]
pub struct DeviceArgs {
    /// Arithmetic of the GPU; the CPU always computes in double
    #[arg(long, default_value = "single", value_parser = precisions())]
    pub precision: Precision,
    /// Where arrays lie on the device
    #[arg(long, value_enum, default_value_t)]
    pub arrays: Arrays,
    /// Whether kernels check their indices and the ends of loops
    #[arg(long, value_enum, default_value_t)]
    pub checks: Checks,
    /// Take this away from what the device has, to try how a lesser one fares: any of binding-bytes=N, storage-buffers=N,
    /// no-timestamps, no-subgroups and lost-after=N submissions, with commas between them
    #[arg(long, value_name = "LIST")]
    pub restrict: Option<Restrictions>,
}

impl DeviceArgs {
    /// How to run a scene, as far as the command line says so here.
    pub fn options(&self) -> Options {
        let DeviceArgs { precision, arrays, checks, .. } = *self;
        Options { precision, arrays, checks, restrictions: self.restrict.unwrap_or_default(), ..Options::default() }
    }
}

impl SceneArgs {
    /// The scene with `--set` and `more` of the kind applied, and what it comes down to.
    pub fn load(&self, more: &[String]) -> anyhow::Result<(Scene, Assembly)> {
        load(&self.scene, &[&self.set, more].concat())
    }
}

/// A scene and what it comes down to; what is not as it asks for is said on the standard error.
pub fn load(path: &Path, set: &[String]) -> anyhow::Result<(Scene, Assembly)> {
    let scene = Scene::load(path, set)?;
    let assembly = scene.assemble()?;
    assembly.notices.iter().for_each(note);
    Ok((scene, assembly))
}

pub fn precisions() -> impl TypedValueParser<Value = Precision> {
    PossibleValuesParser::new(Precision::ALL.iter().map(|p| p.label()))
        .map(|label| *Precision::ALL.iter().find(|p| p.label() == label).expect("clap lets only labels through"))
}

/// Those of "auto", "gpu" and "cpu" that a command knows.
pub fn engines<const N: usize>(names: [&'static str; N]) -> impl TypedValueParser<Value = EngineChoice> {
    PossibleValuesParser::new(names).map(|name| match name.as_str() {
        "gpu" => EngineChoice::Gpu,
        "cpu" => EngineChoice::Cpu,
        _ => EngineChoice::Auto,
    })
}

/// The first line that could not be written to the standard output, other than by nobody reading it any more (`| head`).
static UNSAID: OnceLock<io::Error> = OnceLock::new();

/// A line on the standard output.
pub fn say(line: impl Display) {
    match writeln!(io::stdout().lock(), "{line}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => drop(UNSAID.set(error)),
        _ => {}
    }
}

/// Why what was said has not been heard.
pub fn unsaid() -> Option<&'static io::Error> {
    UNSAID.get()
}

/// A line on the standard error; where nobody hears it, nobody can be told so.
pub fn tell(line: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// An error, on one line.
pub fn complain(error: impl Display) {
    let line = error.to_string().lines().map(str::trim).collect::<Vec<_>>().join(" ");
    tell(format!("error: {line}"));
}

/// What makes a result doubtful.
pub fn warn(doubt: impl Display) {
    tell(format!("warning: {doubt}"));
}

/// What is good to know.
pub fn note(notice: impl Display) {
    tell(format!("note: {notice}"));
}

/// A number of bytes for people.
pub fn size(bytes: u64) -> String {
    let units = [(1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let bytes = bytes as f64;
    let found = units.into_iter().find(|(unit, _)| bytes >= *unit);
    found.map_or(format!("{bytes} bytes"), |(unit, name)| format!("{:.1} {name}", bytes / unit))
}

/// The name of a file without folder and ending.
pub fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
