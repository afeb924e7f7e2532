//! Checkpoints: a file with everything that the next steps depend on, so that a run goes on from it as if nothing had
//! happened, to the bit. `docs/output.md` has what is in it.
//!
//! It has the arrays whose lifetime is [`Lifetime::State`], as they lie in the engine, and what the host knows: parameters,
//! the schedule of the neighbour lists, sums so far. All else follows from the scene. Numbers of a device in single
//! precision are converted to SI units by powers of two, so that no bit is lost.

use super::{
    Options, Setup, Simulation, Stepper, filled, lists::resize, openings::Progress, options::EngineChoice,
    works::Totals,
};
use crate::{
    container::{Container, Description, Number, Writer},
    engine::{Cpu, PIECE},
    error::{Error, Result},
    memory,
    model::Precision,
    record::Element,
    scene::{Assembly, Numbers},
    state::{
        ARRAYS, Array, Length, Lifetime, Sizes, State,
        array::{CELL, WALL},
        present,
    },
};
use serde::{Deserialize, Serialize};
use std::{
    fmt::Display,
    fs::File,
    io::{BufWriter, Write},
    path::Path,
};

/// What such a file says of itself.
const KIND: &str = "checkpoint";
/// Of what is in it.
const FORMAT: u32 = 1;

/// What a checkpoint says besides its columns.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct About {
    kind: String,
    format: u32,
    /// Of packstone.
    pub version: String,
    /// `cpu` or `gpu`, and what it ran on.
    pub engine: String,
    pub adapter: String,
    /// `single` or `double`.
    pub precision: String,
    pub step: u64,
    /// s
    pub time: f64,
    pub grains: usize,
    /// What [`Assembly::checksum`] says of the scene.
    scene: u32,
    /// Choices of the model, as text.
    model: String,
    /// Of [`Options`].
    lists_abreast: u32,
    longest_chunk: u32,
    /// Whether contacts remembered something at the start.
    remembering: bool,
    /// Whether they remember this step already, see [`Runner`](super::Runner).
    #[serde(default)]
    springs_of_now: bool,
    /// Of contact dynamics by colours, as in [`Sizes`].
    contacts: usize,
    colors: usize,
    /// What has come in and left, where grains do.
    #[serde(default)]
    openings: Option<Progress>,
    /// What whoever has written it adds.
    pub run: serde_json::Value,
}

/// Of the parameters of kernels, the neighbour lists, the works and the solver of contacts: a row each.
const PARAMS: &str = "params";
const LISTS: &str = "lists";
const WORKS: &str = "works_so_far";
const SOLVER: &str = "solver_statistics";

/// Numbers of the grains and clumps, by their place, where some come in and leave.
const NUMBERS: [&str; 2] = ["number", "clump_number"];

/// A checkpoint whose header has been read.
#[derive(Debug)]
pub struct Checkpoint(Container<About>);

impl Checkpoint {
    /// # Errors
    /// [`Error::Io`] if it cannot be read, [`Error::Scene`] if it is none, is cut off, altered, or of another format.
    pub fn open(path: &Path) -> Result<Checkpoint> {
        // Files of other kinds say other things.
        #[derive(Deserialize)]
        struct Kind {
            kind: Option<String>,
            format: Option<u32>,
            version: Option<String>,
        }
        let wrong = |message: String| Error::Scene(format!("{}: {message}", path.display()));
        let Kind { kind, format, version } = Container::open(path)?.about;
        match kind.as_deref() {
            Some(KIND) if format == Some(FORMAT) => Ok(Checkpoint(Container::open(path)?)),
            Some(KIND) => Err(wrong(format!(
                "is a checkpoint of packstone {}, which this packstone ({}) cannot read",
                version.as_deref().unwrap_or("of unknown version"),
                env!("CARGO_PKG_VERSION")
            ))),
            other => Err(wrong(format!("holds {}, and is no checkpoint", other.unwrap_or("something else")))),
        }
    }

    pub fn about(&self) -> &About {
        &self.0.about
    }

    /// How the simulation ran that it is of, on whatever device.
    ///
    /// # Errors
    /// [`Error::Scene`] if it says what this packstone does not know.
    pub fn options(&self, options: Options) -> Result<Options> {
        let About { engine, precision, lists_abreast, longest_chunk, .. } = self.about();
        let engine = match &**engine {
            "cpu" => EngineChoice::Cpu,
            "gpu" => EngineChoice::Gpu,
            other => return Err(self.wrong(format!("is of an engine \"{other}\""))),
        };
        let known = Precision::ALL.iter().find(|known| known.label() == precision);
        let precision = *known.ok_or_else(|| self.wrong(format!("is in precision \"{precision}\"")))?;
        let (lists_abreast, longest_chunk) = (Some(*lists_abreast), *longest_chunk);
        Ok(Options { engine, precision, lists_abreast, longest_chunk, ..options })
    }

    fn wrong(&self, message: impl Display) -> Error {
        self.0.wrong(message.to_string())
    }

    /// A column of numbers of grains; none if it is not there.
    fn numbers(&mut self, name: &str) -> Result<Vec<u32>> {
        let mut all = Vec::new();
        if self.0.descriptions().any(|column| column.name == name) {
            self.0.read_pieces(name, PIECE, |_, numbers| {
                all.extend(numbers.iter().map(|number| *number as u32));
                Ok(())
            })?;
        }
        Ok(all)
    }

    /// The only row of a column.
    fn one<T: Element>(&mut self, name: &str, dims: usize) -> Result<T> {
        let mut row = None;
        self.0.read_pieces(name, 1, |_, numbers| {
            if numbers.len() == T::width(dims) {
                let mut numbers = numbers.iter().copied();
                row = Some(T::take(dims, &mut || numbers.next().unwrap_or(0.0)));
            }
            Ok(())
        })?;
        row.ok_or_else(|| self.wrong(format!("column \"{name}\" has another number of components")))
    }
}

impl Simulation {
    /// Write a checkpoint to a new file, with what the caller has to add; it is on the disk when this returns. Nothing of
    /// the simulation changes.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be written, [`Error::Device`] if the device is lost.
    pub fn save(&mut self, path: &Path, run: &impl Serialize) -> Result<()> {
        let failed = |source| Error::Io { path: path.to_owned(), source };
        let about = self.about(serde_json::to_value(run).map_err(|e| failed(e.into()))?);
        let s = &self.runner.state;
        let (model, params, dims) = (s.model, s.params, s.model.dims());
        let (arrays, sizes) = (kept(s), self.sizes());
        let rows = [
            Some(row(PARAMS, &params, dims)),
            Some(row(LISTS, &self.lists.state, dims)),
            self.works.as_ref().map(|works| row(WORKS, works, dims)),
            self.solver_statistics().map(|solved| row(SOLVER, solved, dims)),
        ];
        let (mut columns, mut rows): (Vec<_>, Vec<_>) = rows.into_iter().flatten().unzip();
        let numbers = &self.assembly.numbers;
        for (name, numbers) in NUMBERS.into_iter().zip([&numbers.grains, &numbers.clumps]) {
            if self.openings.is_some() && !numbers.is_empty() {
                let (mut description, mut bytes) = (row(name, &0_u32, dims).0, Vec::new());
                (description.number, description.rows) = (u32::TYPE.to_owned(), numbers.len() as u64);
                numbers.iter().for_each(|number| number.encode(&mut bytes));
                columns.push(description);
                rows.push(bytes);
            }
        }
        columns.extend(arrays.iter().map(|array| description(s, array, sizes.of(array.length))));
        let mut out = BufWriter::with_capacity(1 << 20, File::create(path).map_err(failed)?);
        let mut file = Writer::begin(&mut out, &about, columns).map_err(failed)?;
        for row in rows {
            file.bytes(&row).and_then(|()| file.end_column()).map_err(failed)?;
        }
        // Not the host's mirror, which stays as it is.
        let mut piece = State::bare(model, sizes, params);
        let mut bytes = Vec::new();
        for array in arrays {
            let len = sizes.of(array.length);
            for first in (0..len).step_by(PIECE) {
                self.runner.engine.read(&[array], first..(first + PIECE).min(len), &mut piece)?;
                bytes.clear();
                let column = piece.column(array);
                match column.integer() {
                    true => column.lanes(dims, &mut |x| (x as u32).encode(&mut bytes)),
                    false => column.lanes(dims, &mut |x| x.encode(&mut bytes)),
                }
                file.bytes(&bytes).map_err(failed)?;
            }
            file.end_column().map_err(failed)?;
            piece.release(&[array]);
        }
        out.flush().and_then(|()| out.get_ref().sync_all()).map_err(failed)
    }

    /// Go on from a checkpoint of the same scene, on the engine and in the precision that it is of: see
    /// [`Checkpoint::options`].
    ///
    /// # Errors
    /// [`Error::Scene`] if it is of another scene, or is damaged, and as [`Simulation::new`].
    pub fn resume(assembly: Assembly, options: Options, checkpoint: &mut Checkpoint) -> Result<Simulation> {
        let mut simulation = Simulation::build(assembly, checkpoint.options(options)?)?;
        let engine = simulation.engine().name();
        if checkpoint.about().engine != engine {
            return Err(checkpoint.wrong(format!("is of another engine: {}, not {engine}", checkpoint.about().engine)));
        }
        simulation.load(checkpoint)?;
        Ok(simulation)
    }

    /// The state of a checkpoint on the host, whatever engine it is of: to be looked at, with the numbers that it has and
    /// in f64. Whoever wants to go on with it takes [`Simulation::resume`].
    ///
    /// # Errors
    /// As [`Simulation::resume`], but for what a device may lack.
    pub fn view(mut assembly: Assembly, checkpoint: &mut Checkpoint) -> Result<Simulation> {
        assembly.validate()?;
        assembly.fold_ends();
        let options = checkpoint.options(Options::default())?;
        // Its arrays are those of the precision that it is of.
        let setup = Setup::new(&assembly, &options)?;
        memory::check_host(setup.state.bytes(&setup.state.sizes.of_dense_packing()))?;
        // What it does not have, such as moments of inertia, follows from the scene.
        let engine = filled(&assembly, &setup, Box::new(Cpu::new(setup.state.clone())?))?;
        let mut simulation = Simulation::of_parts(assembly, options, setup, engine, String::new())?;
        simulation.load(checkpoint)?;
        Ok(simulation)
    }

    fn load(&mut self, checkpoint: &mut Checkpoint) -> Result<()> {
        let (about, own) = (checkpoint.about().clone(), self.about(serde_json::Value::Null));
        let same_grains = about.grains == own.grains || own.openings.is_some();
        if (about.scene, &about.model, true) != (own.scene, &own.model, same_grains) {
            return Err(Error::Folder(format!(
                "{}: is of another scene, or the scene beside it, or what that reads, has been changed since; undo that, or \
                 begin another run with --from",
                checkpoint.0.path().display()
            )));
        }
        if let Some(progress) = about.openings.clone() {
            let [grains, clumps] = [checkpoint.numbers(NUMBERS[0])?, checkpoint.numbers(NUMBERS[1])?];
            if grains.len() != about.grains {
                return Err(checkpoint.wrong("lacks the numbers of its grains"));
            }
            self.resume_openings(progress, Numbers { grains, clumps })?;
        }
        let dims = self.model().dims();
        (self.runner.step, self.runner.remembering) = (about.step, about.remembering);
        self.runner.springs_of_now = about.springs_of_now;
        self.runner.state.params = checkpoint.one(PARAMS, dims)?;
        let old = self.sizes();
        self.lists.state = checkpoint.one(LISTS, dims)?;
        (self.runner.state.sizes.contacts, self.runner.state.sizes.colors) = (about.contacts, about.colors);
        if self.model().works {
            self.works = Some(checkpoint.one::<Totals>(WORKS, dims)?);
        }
        if let Stepper::Nscd(nscd) = &mut self.stepper {
            nscd.statistics = checkpoint.one(SOLVER, dims)?;
        }
        let sizes = self.sizes();
        let s = &self.runner.state;
        let arrays = kept(s);
        for array in &arrays {
            let expected = description(s, array, sizes.of(array.length));
            if checkpoint.0.descriptions().find(|column| column.name == array.name) != Some(&expected) {
                return Err(checkpoint.wrong(format!("lacks the array {}, or has it in another form", array.name)));
            }
        }
        // The file has no arrays of these lengths; they are a few times those that it has, whose bytes are there.
        // Some are those of all grains that have been and will be there.
        let others = self.openings.as_ref().map_or(0, |openings| openings.start.0.len());
        let waiting: usize = self.assembly.insertions.iter().map(|insertion| insertion.grains.len()).sum();
        let most = 16 * (sizes.bodies + others + waiting + sizes.entries);
        if sizes.history > most || sizes.contacts > most {
            return Err(checkpoint.wrong("has lengths that do not go together"));
        }
        for kind in [Length::Entries, Length::History, Length::Contacts, Length::Colors] {
            if sizes.of(kind) != old.of(kind) {
                resize(&mut self.runner, kind, sizes.of(kind))?;
            }
        }
        let (s, engine) = (&self.runner.state, &mut self.runner.engine);
        let mut piece = State::bare(s.model, sizes, s.params);
        for array in arrays {
            checkpoint.0.read_pieces(array.name, PIECE, |first, numbers| {
                let column = piece.column_mut(array);
                column.resize(numbers.len() / column.widths(dims).iter().sum::<usize>());
                let mut numbers = numbers.iter().copied();
                column.fill(dims, &mut || numbers.next().unwrap_or(0.0));
                engine.write(&[array], first, &piece)
            })?;
            piece.release(&[array]);
        }
        // The mirror has them at all times.
        self.runner.read(&present(&self.runner.state.model, &[&WALL, &CELL]))?;
        Ok(())
    }

    fn about(&self, run: serde_json::Value) -> About {
        let Sizes { slice_shift, contacts, colors, .. } = self.runner.state.sizes;
        About {
            kind: KIND.to_owned(),
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            engine: self.engine().name().to_owned(),
            adapter: self.engine().adapter(),
            precision: self.model().precision.label().to_owned(),
            step: self.step(),
            time: self.time(),
            grains: self.assembly.grains.len(),
            scene: self.openings.as_ref().map_or_else(|| self.assembly.checksum(), |openings| openings.checksum),
            model: format!("{:?}", self.model()),
            lists_abreast: 1 << slice_shift,
            longest_chunk: self.lists.most_steps(),
            remembering: self.runner.remembering,
            springs_of_now: self.runner.springs_of_now,
            contacts,
            colors,
            openings: self.openings.as_ref().map(|openings| openings.progress.clone()),
            run,
        }
    }
}

/// The arrays of a checkpoint.
fn kept(s: &State) -> Vec<&'static Array> {
    present(&s.model, ARRAYS).into_iter().filter(|array| array.lifetime == Lifetime::State).collect()
}

fn description(s: &State, array: &Array, rows: usize) -> Description {
    let (column, dims) = (s.column(array), s.model.dims());
    Description {
        name: array.name.to_owned(),
        number: if column.integer() { u32::TYPE } else { f64::TYPE }.to_owned(),
        components: column.widths(dims).iter().sum::<usize>() as u64,
        rows: rows as u64,
        unit: s.unit_text(array),
    }
}

/// A column of one row: what there is to say of it, and its bytes.
fn row<T: Element>(name: &str, value: &T, dims: usize) -> (Description, Vec<u8>) {
    let description = Description {
        name: name.to_owned(),
        number: f64::TYPE.to_owned(),
        components: T::width(dims) as u64,
        rows: 1,
        unit: T::names(dims).join(", "),
    };
    let mut bytes = Vec::new();
    value.put(dims, &mut |x| x.encode(&mut bytes));
    (description, bytes)
}
