//! The parts of the benchmark of a GPU, each as its own process runs it.

use super::{Case, CheckFinding, CheckRow, Finding, Part, RUNS, Speed, Stage, Variant};
use crate::{
    bench::{copy, machine::Machine, traffic},
    check,
    error::{Error, Result},
    gpu::{Arrays, Checks, Device, Placement, Restrictions, adapter_facts},
    memory,
    model::Precision,
    scene::Assembly,
    simulation::{EngineChoice, LISTS_ABREAST, Options, Simulation},
    state::{ARRAYS, array::POSITION, present},
};
use std::{collections::BTreeMap, time::Instant};

/// Grains of the scenes that are checked; few, since the host does it all too.
const CHECKED: usize = 1000;
/// Steps that are compared, and over which balances are drawn up.
const COMPARED: u64 = 5;
const BALANCED: u64 = 50;
/// Steps of runs whose bits are compared.
const REPEATED: u64 = 200;
/// Steps of contact dynamics, which are longer: before kernels are compared, and of runs whose bits are.
const RIGID: u64 = 10;
const REPEATED_RIGID: u64 = 20;
/// Steps before kernels are compared, and before anything is timed.
const SETTLED: u64 = 100;
const WARM: u64 = 20;
/// Steps that take in lists being made as often as they are in a long run.
const LIFE: u64 = 50;
/// A measurement takes so long at least, s, and is the median of so many.
const STRETCH: f64 = 0.3;
const REPEATS: usize = 3;
/// Steps whose stages are timed at least: lists are made in them.
const PROFILED: u64 = 75;
/// Grains up to which warps are replayed on the host.
const REPLAYED: usize = 150_000;

/// Bytes of memory that every host has that has a GPU: no more is asked for where the system does not tell what is there.
const PRESUMED: u64 = 4 << 30;

/// Measure a part of the benchmark; `say` gets every finding as it comes.
///
/// # Errors
/// Whatever ends the part. What it has said by then stands.
pub fn measure(part: Part, restrictions: Restrictions, say: &mut dyn FnMut(Finding)) -> Result<()> {
    let options = Options { engine: EngineChoice::Gpu, restrictions, ..Options::default() };
    match part {
        Part::Adapter => adapter(&options, say),
        Part::Copies => copies(&options, say),
        Part::Check { case, double } => check(case, double, options, say),
        Part::Repeat { case, grains, process } => repeat(case, grains, process, options, say),
        Part::Speed { case, grains } => speed(case, grains, options, say),
        Part::Variants { grains } => variants(grains, options, say),
    }
}

fn adapter(options: &Options, say: &mut dyn FnMut(Finding)) -> Result<()> {
    let machine = Machine::here();
    let memory = memory::available().map_or("unknown".to_owned(), |bytes| format!("{:.1} GB", 1e-9 * bytes as f64));
    let rows = [
        ("processor", machine.cpu),
        ("threads", machine.cores.to_string()),
        ("memory available", memory),
        ("system", machine.system),
    ];
    let rows = rows.map(|(name, value)| (name.to_owned(), value));
    say(Finding::Facts { of: "machine".to_owned(), rows: rows.into() });
    for (k, rows) in adapter_facts().into_iter().enumerate() {
        say(Finding::Facts { of: format!("adapter {}", k + 1), rows });
    }
    let device = Device::open(options.device())?;
    let adapter = &device.summary;
    let yes = |has: bool| if has { "yes" } else { "no" }.to_owned();
    let rows = [
        ("name", adapter.name.clone()),
        ("kind", adapter.kind.clone()),
        ("backend", adapter.backend.clone()),
        ("driver", adapter.driver.clone()),
        ("software driver", yes(device.software)),
        ("f64 in kernels", yes(adapter.double)),
        ("timestamps", yes(adapter.timestamps)),
        ("subgroups", adapter.subgroup.map_or("no".to_owned(), |(least, most)| format!("{least} to {most}"))),
        ("bytes that a kernel sees of a buffer", adapter.max_array_bytes.to_string()),
        ("buffers that a kernel sees", adapter.max_arrays.to_string()),
        ("arrays as images", yes(device.images)),
    ];
    let rows = rows.map(|(name, value)| (name.to_owned(), value));
    say(Finding::Facts { of: "device".to_owned(), rows: rows.into() });
    Ok(())
}

fn copies(options: &Options, say: &mut dyn FnMut(Finding)) -> Result<()> {
    let mut found = |what: &str, bytes_per_second| say(Finding::Copy { what: what.to_owned(), bytes_per_second });
    let [own, by_kernel] = copy::of_device(options.device())?;
    found("device, its own copy", own);
    found("device, a kernel that copies", by_kernel);
    found("processor, all threads", copy::of_host()?);
    Ok(())
}

fn check(case: Case, double: bool, options: Options, say: &mut dyn FnMut(Finding)) -> Result<()> {
    let precision = if double { Precision::Double } else { Precision::Single };
    let options = Options { precision, ..options };
    let assembly = case.assembly(CHECKED)?;
    let after = match case {
        Case::Rigid => RIGID,
        Case::Rods => WARM,
        _ => SETTLED,
    };
    let report = check::check(&assembly, options, after, COMPARED, BALANCED)?;
    let rows = report.rows.iter().map(|row| CheckRow {
        stage: row.stage.to_owned(),
        array: row.array.to_owned(),
        worst: finite(row.worst),
        tolerance: row.tolerance,
        passed: row.passed,
    });
    say(Finding::Check(CheckFinding {
        case,
        precision: report.precision.to_owned(),
        grains: assembly.grains.len(),
        contacts: report.contacts,
        passed: report.passed,
        trajectory: finite(report.trajectory),
        rows: rows.collect(),
    }));
    Ok(())
}

fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

/// As large as asked, if the host has memory for it.
fn filled(case: Case, grains: usize) -> Result<Assembly> {
    check_room(memory::of_grains(grains as u64), memory::available())?;
    case.assembly(grains)
}

/// Whether there is memory for so many bytes, given what the system tells.
fn check_room(need: impl Into<u128>, available: Option<u64>) -> Result<()> {
    let need = need.into();
    let (room, how) = available.map_or((PRESUMED, "taken for granted"), |bytes| (bytes, "available"));
    if need > u128::from(room) {
        return Err(Error::Lacking(format!("it needs {need} bytes of memory, and {room} are {how}")));
    }
    Ok(())
}

fn repeat(case: Case, grains: usize, process: u32, options: Options, say: &mut dyn FnMut(Finding)) -> Result<()> {
    let steps = if case == Case::Rigid { REPEATED_RIGID } else { REPEATED };
    let assembly = filled(case, grains)?;
    for time in RUNS {
        let mut simulation = Simulation::new(assembly.clone(), options)?;
        simulation.advance(steps)?;
        say(Finding::Bits {
            run: format!("{} {grains}, {steps} steps", case.name()),
            place: format!("process {process}, {time} run"),
            hash: format!("{:016x}", bits(&mut simulation)?),
        });
    }
    Ok(())
}

/// A hash (FNV-1a) of where all grains are and how they move.
fn bits(simulation: &mut Simulation) -> Result<u64> {
    let grains = simulation.grains()?;
    let numbers = grains.iter().flat_map(|g| [g.position, g.velocity, g.spin].map(|x| x.to_array())).flatten();
    let bytes = numbers.flat_map(|x| x.to_bits().to_le_bytes());
    Ok(bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)))
}

/// What steps cost, s: wall time, of it what the host does besides waiting, and of that submissions and what it does while
/// the device works.
#[derive(Clone, Copy)]
struct Cost {
    wall: f64,
    host: f64,
    submissions: f64,
    ahead: f64,
}

fn cost(simulation: &mut Simulation, steps: u64) -> Result<Cost> {
    let spent = |s: &Simulation| {
        let gpu = s.engine().gpu().expect("a simulation on the device");
        let [submissions, waiting] = gpu.device().spent();
        [submissions, waiting, gpu.ahead().time].map(|time| time.as_secs_f64())
    };
    let (start, before) = (Instant::now(), spent(simulation));
    simulation.advance(steps)?;
    let (wall, after) = (start.elapsed().as_secs_f64(), spent(simulation));
    let [submissions, waiting, ahead] = std::array::from_fn(|k| after[k] - before[k]);
    Ok(Cost { wall, host: wall - waiting, submissions, ahead })
}

/// As many steps as take long enough to be timed; whole lives of lists.
fn enough_steps(simulation: &mut Simulation) -> Result<u64> {
    let seconds = cost(simulation, LIFE)?.wall;
    Ok(LIFE * (STRETCH / seconds).ceil().clamp(1.0, 100.0) as u64)
}

/// That with the median wall time.
fn median(mut costs: Vec<Cost>) -> Cost {
    costs.sort_by(|a, b| a.wall.total_cmp(&b.wall));
    costs[costs.len() / 2]
}

fn speed(case: Case, grains: usize, options: Options, say: &mut dyn FnMut(Finding)) -> Result<()> {
    let assembly = filled(case, grains)?;
    let start = Instant::now();
    let mut simulation = Simulation::new(assembly, options)?;
    simulation.advance(1)?;
    let setup_seconds = start.elapsed().as_secs_f64();
    // As many as there are, not as were asked for.
    let grains = simulation.assembly().grains.len();
    simulation.advance(WARM)?;
    let steps = enough_steps(&mut simulation)?;
    let costs = (0..REPEATS).map(|_| cost(&mut simulation, steps)).collect::<Result<Vec<_>>>()?;
    let Cost { wall, host, submissions, ahead } = median(costs);
    say(Finding::Speed(Speed {
        case,
        grains,
        steps,
        setup_seconds,
        ms_per_step: 1e3 * wall / steps as f64,
        host_ms_per_step: 1e3 * host / steps as f64,
        submission_ms_per_step: 1e3 * submissions / steps as f64,
        ahead_ms_per_step: 1e3 * ahead / steps as f64,
        particle_steps_per_second: (grains as u64 * steps) as f64 / wall,
        bytes_per_grain: simulation.bytes_per_particle()?,
        placements: placements(&simulation),
    }));
    let profile = simulation.profile(PROFILED.max(steps / 10))?;
    let rows = profile.stages.iter().map(|stage| Stage {
        stage: stage.name.to_owned(),
        calls: stage.calls,
        ms_per_call: 1e3 * stage.seconds / stage.calls as f64,
        share: stage.seconds / profile.wall_seconds,
        bytes: stage.bytes,
    });
    say(Finding::Stages { case, grains, clock: profile.clock.to_owned(), rows: rows.collect() });
    if grains <= REPLAYED {
        let model = *simulation.model();
        let rows = traffic::rows(&model, &mut simulation)?;
        if !rows.is_empty() {
            say(Finding::Traffic { case, grains, rows });
        }
    }
    Ok(())
}

/// Where the arrays lie, and how many.
fn placements(simulation: &Simulation) -> BTreeMap<String, usize> {
    let gpu = simulation.engine().gpu().expect("a simulation on the device");
    let mut counts = BTreeMap::new();
    for array in present(simulation.model(), ARRAYS) {
        *counts.entry(gpu.placement(array).name().to_owned()).or_default() += 1;
    }
    counts
}

/// Each setting beside the default ones, in turn.
fn variants(grains: usize, options: Options, say: &mut dyn FnMut(Finding)) -> Result<()> {
    let settings = [
        ("--checks off", Options { checks: Checks::Off, ..options }),
        ("--arrays buffers", Options { arrays: Arrays::Buffers, ..options }),
        ("--arrays images", Options { arrays: Arrays::Images, ..options }),
        ("--arrays packed", Options { arrays: Arrays::Packed, ..options }),
        ("lists one after the other", Options { lists_abreast: Some(1), ..options }),
        ("32 lists side by side", Options { lists_abreast: Some(32), ..options }),
        ("64 lists side by side", Options { lists_abreast: Some(64), ..options }),
        ("--precision double", Options { precision: Precision::Double, ..options }),
    ];
    let assembly = filled(Case::Spheres, grains)?;
    let mut default = Simulation::new(assembly.clone(), options)?;
    default.advance(WARM)?;
    let steps = enough_steps(&mut default)?;
    let gpu = default.engine().gpu().expect("a simulation on the device");
    let (placement, software) = (gpu.placement(&POSITION), gpu.device().software);
    let is_default = |setting: &Options| {
        let lists = setting.lists_abreast == Some(if software { 1 } else { LISTS_ABREAST });
        let arrays = match setting.arrays {
            Arrays::Buffers => matches!(placement, Placement::Buffer | Placement::Parts(_)),
            Arrays::Images => placement == Placement::Image,
            Arrays::Packed => placement == Placement::Packed,
            Arrays::Auto => false,
        };
        lists || arrays
    };
    for (name, setting) in settings.into_iter().filter(|(_, setting)| !is_default(setting)) {
        let mut compared = || {
            let mut other = Simulation::new(assembly.clone(), setting)?;
            default.rewind()?;
            for simulation in [&mut default, &mut other] {
                simulation.advance(WARM)?;
            }
            let (mut costs, mut other_costs) = (Vec::new(), Vec::new());
            for _ in 0..REPEATS {
                costs.push(cost(&mut default, steps)?);
                other_costs.push(cost(&mut other, steps)?);
            }
            let same_bits = match setting.precision == options.precision {
                true => Some(bits(&mut default)? == bits(&mut other)?),
                false => None,
            };
            let ms = |costs| 1e3 * median(costs).wall / steps as f64;
            Ok(Variant {
                name: name.to_owned(),
                grains: assembly.grains.len(),
                ms_per_step: ms(other_costs),
                default_ms_per_step: ms(costs),
                same_bits,
            })
        };
        say(match compared() {
            Ok(variant) => Finding::Variant(variant),
            Err(Error::Lacking(why)) => Finding::Lacking { what: name.to_owned(), why },
            Err(error) => Finding::Failed { what: name.to_owned(), why: error.to_string() },
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_memory_is_little() {
        assert!(check_room(PRESUMED, None).is_ok() && check_room(2 * PRESUMED, Some(2 * PRESUMED)).is_ok());
        for available in [None, Some(PRESUMED)] {
            assert!(matches!(check_room(PRESUMED + 1, available), Err(Error::Lacking(_))), "{available:?}");
        }
    }
}
