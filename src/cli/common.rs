//! What the commands share: exit codes, arguments that say what to run, output.

use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use packstone::{
    Error,
    gpu::{Arrays, Checks, Restrictions},
    model::Precision,
    scene::{Assembly, Scene},
    simulation::{EngineChoice, Options},
};
use std::{
    fmt::Display,
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering},
    },
};

/// Exit codes; 2 is also clap's for wrong usage.
pub const DONE: u8 = 0;
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
    if let [first, _, ..] = scene.stages() {
        note(format!("{}: has stages; this is about the first one, {}", path.display(), first.name));
    }
    let assembly = scene.assemble()?;
    assembly.notices.iter().for_each(note);
    Ok((scene, assembly))
}

/// An error that has to do with a scene says with which.
pub fn about(scene: &Path, error: anyhow::Error) -> anyhow::Error {
    let name = scene.display().to_string();
    let of_scene = matches!(error.downcast_ref(), Some(Error::Scene(_) | Error::Lacking(_)));
    if of_scene && !error.to_string().starts_with(&name) { anyhow::anyhow!("{name}: {error}") } else { error }
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

/// Whether only results, what makes them doubtful, and errors are said.
static QUIET: AtomicBool = AtomicBool::new(false);

pub fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// What is said, without anything that a terminal would obey: titles, names and paths may have escape sequences in them.
/// They are written as in scenes and in JSON.
fn printable(text: impl Display) -> String {
    let obeyed = |c: char| c.is_control() && c != '\n';
    let text = text.to_string();
    if !text.contains(obeyed) {
        return text;
    }
    text.chars().map(|c| if obeyed(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() }).collect()
}

/// A result: a line, or several, on the standard output.
pub fn say(line: impl Display) {
    show(format!("{}\n", printable(line)).as_bytes());
}

/// A text of packstone's own on the standard output, as it is.
pub fn show(text: &[u8]) {
    match io::stdout().lock().write_all(text) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => drop(UNSAID.set(error)),
        _ => {}
    }
}

/// Why what was said has not been heard.
pub fn unsaid() -> Option<&'static io::Error> {
    UNSAID.get()
}

/// How far a command is, on the standard error.
pub fn tell(line: impl Display) {
    if !is_quiet() {
        write_error("", line);
    }
}

pub fn complain(error: impl Display) {
    write_error("error: ", error);
}

/// What makes a result doubtful.
pub fn warn(doubt: impl Display) {
    write_error("warning: ", doubt);
}

/// What is good to know.
pub fn note(notice: impl Display) {
    if !is_quiet() {
        write_error("note: ", notice);
    }
}

/// On one line of the standard error; where nobody hears it, nobody can be told so.
fn write_error(kind: &str, text: impl Display) {
    let line = text.to_string().lines().map(str::trim).collect::<Vec<_>>().join(" ");
    let _ = writeln!(io::stderr().lock(), "{kind}{}", printable(line));
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

#[cfg(test)]
mod tests {
    use super::printable;

    #[test]
    fn terminals_have_nothing_to_obey() {
        for (text, printed) in [
            ("\u{1b}[31mred\u{7}", "\\u001b[31mred\\u0007"),
            ("a\rb\tc\u{7f}d\u{9b}31m", "a\\u000db\\u0009c\\u007fd\\u009b31m"),
            ("two\nlines, 3 µm, 砂", "two\nlines, 3 µm, 砂"),
        ] {
            assert_eq!(printable(text), printed);
        }
        // What JSON leaves as it is says the same afterwards.
        let json = serde_json::to_string("\u{7f}\u{9b}").unwrap();
        assert_eq!(serde_json::from_str::<String>(&printable(json)).unwrap(), "\u{7f}\u{9b}");
    }
}
