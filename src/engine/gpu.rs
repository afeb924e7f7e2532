//! The device engine: every stage of the plan as a compute pipeline, every array of the state as a buffer or an image.

use super::{
    Engine, Times,
    aliases::{Aliases, total},
    arrays::DeviceArrays,
    placements::{Places, Possible},
    programs::{Layouts, bound, bytes, layouts_of, programs, programs_with},
    within,
};
use crate::{
    error::{Error, Result},
    gpu::{Binding, Device, Placement, Program, Resource, Stopwatch, folded, workgroups},
    memory,
    model::Model,
    plan::Op,
    plans::Plans,
    stage::{Dispatch, Stage},
    state::{ARRAYS, Array, Column, Counters, Element, Params, Sizes, State, array, present},
    units::Quantity,
};
use std::{
    any::Any,
    collections::{HashMap, VecDeque},
    mem,
    ops::Range,
    slice,
    time::{Duration, Instant},
};
use wgpu::ComputePassTimestampWrites;

/// Runs the WGSL kernels.
pub struct Gpu {
    device: Device,
    model: Model,
    /// What arrays were made for, and the bodies and clumps that there are now.
    sizes: Sizes,
    now: Sizes,
    compiled: Compiled,
    arrays: DeviceArrays,
    /// The unit of each lane of an element of an array, in SI units, and of the parameters.
    units: HashMap<&'static Array, Vec<f64>>,
    params_units: Vec<f64>,
    params: wgpu::Buffer,
    times: Option<Times>,
    /// What was executed last, until it has been encoded again.
    last: Vec<Op>,
    /// What is expected next, encoded while the device works: pieces in order, whose exchanges of arrays are done already.
    ahead: VecDeque<(Vec<Op>, wgpu::CommandBuffer)>,
    ahead_work: Ahead,
}

/// What was encoded while the device was working.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ahead {
    pub time: Duration,
    /// Operations, and those of them that came as expected.
    pub operations: u64,
    pub used: u64,
}

/// Operations of a piece: chunks of steps are similar, but not of the same length.
const PIECE: usize = 128;
/// Operations of a submission, times bodies: less than half a second of a slow device. After some seconds systems think
/// that a device hangs, and take it away.
const SUBMISSION: usize = 1 << 28;

/// The stages of a model.
#[derive(Clone)]
struct Compiled {
    stages: Vec<&'static Stage>,
    kernels: HashMap<&'static Stage, Kernel>,
    /// Arrays that each writes.
    written: HashMap<&'static Stage, Vec<&'static Array>>,
    /// Where else arrays could lie.
    possible: Possible,
}

#[derive(Clone)]
struct Kernel {
    pipeline: wgpu::ComputePipeline,
    /// In binding order.
    variables: Vec<Variable>,
    /// One for each way in which its arrays have been bound: those that take turns are bound in two.
    groups: Vec<(Vec<u64>, wgpu::BindGroup)>,
}

/// A variable of a kernel, and the arrays that it stands for.
#[derive(Clone)]
struct Variable {
    resource: Resource,
    arrays: Vec<Option<&'static Array>>,
}

impl Gpu {
    /// Compile the plans' kernels and allocate the model's arrays: as `state` has them, or zero where it has none.
    ///
    /// # Errors
    /// [`Error::Lacking`] if the arrays do not fit, [`Error::Shader`] if a kernel does not compile.
    pub fn new(device: Device, plans: &Plans, state: &State) -> Result<Gpu> {
        let model = &state.model;
        let stages = plans.stages();
        let programs: Vec<_> = stages.iter().copied().zip(programs(model, &stages)?).collect();
        let layouts = layouts_of(model.dims(), &programs)?;
        let possible = Possible::of(plans, &programs);
        let places = possible.choose(&device, model, &programs, &layouts, &state.sizes)?;
        check_memory(&device, model, &layouts, &places, &state.sizes)?;
        let kernels = compiled(&device, model, &stages, &places.0)?;
        let of_stage = |(stage, program): &(&'static Stage, Program)| {
            let written = program.bindings.iter().filter(|b| b.written);
            (*stage, written.filter_map(|b| stage.array(&b.name)).collect())
        };
        let written = programs.iter().map(of_stage).collect();
        Gpu::filled(device, Compiled { stages, written, kernels, possible }, layouts, places, state)
    }

    /// Another one on the same device, with the same kernels if that can be, filled with the content of another state of
    /// the model. Each of its arrays has memory of its own, so that nobody has to know whose content matters.
    ///
    /// # Errors
    /// [`Error::Lacking`] if the arrays do not fit.
    pub fn beside(&self, state: &State) -> Result<Gpu> {
        let Gpu { device, arrays, .. } = self;
        let mut compiled = self.compiled.clone();
        compiled.possible.liveness = None;
        let mut placements = arrays.placements().clone();
        for array in arrays.aliases().keys() {
            let len = state.sizes.of(array.length);
            let own = compiled.possible.suited(device, arrays.layouts(), array, len, Placement::Buffer);
            placements.insert(array, own);
        }
        if placements == *arrays.placements() {
            compiled.kernels.values_mut().for_each(|kernel| kernel.groups.clear());
        } else {
            compiled.kernels = self::compiled(device, &self.model, &compiled.stages, &placements)?;
        }
        Gpu::filled(device.clone(), compiled, arrays.layouts().clone(), (placements, Aliases::new()), state)
    }

    fn filled(device: Device, compiled: Compiled, layouts: Layouts, places: Places, state: &State) -> Result<Gpu> {
        let model = state.model;
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let params = device.buffer("params", layouts.params.stride as u64, usage)?;
        let of = |quantities: Vec<Quantity>| quantities.into_iter().map(|q| state.units.of(q)).collect::<Vec<_>>();
        let needed = present(&model, ARRAYS);
        let total = total(&model, &layouts, &places.1, &state.sizes);
        let of_total = |e| match e {
            Error::Lacking(e) => Error::Lacking(format!("scene too large, it needs {total} bytes in all: {e}")),
            other => other,
        };
        let mut gpu = Gpu {
            arrays: DeviceArrays::new(&device, layouts, places, &needed, &state.sizes).map_err(of_total)?,
            device,
            model,
            sizes: state.sizes,
            now: state.sizes,
            compiled,
            units: ARRAYS.iter().map(|array| (*array, of(state.quantities(array)))).collect(),
            params_units: of(Params::quantities(Quantity::Number, model.dims())),
            params,
            times: None,
            last: Vec::new(),
            ahead: VecDeque::new(),
            ahead_work: Ahead::default(),
        };
        for array in needed {
            match state.column(array).len() {
                0 => {}
                len => {
                    if len != gpu.arrays.len(array) {
                        gpu.resize(&[array], len)?;
                    }
                    // What aliases hold is nobody's, and where something else may be.
                    if !gpu.aliases().contains_key(array) {
                        gpu.write(&[array], 0, state)?;
                    }
                }
            }
        }
        Ok(gpu)
    }

    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Where an array lies.
    pub fn placement(&self, array: &Array) -> Placement {
        self.arrays.placements().get(array).copied().unwrap_or_default()
    }

    /// Arrays that lie in the memory of others, and so hold nothing between plans.
    pub fn aliases(&self) -> &Aliases {
        self.arrays.aliases()
    }

    /// Bytes of all arrays together.
    pub fn bytes(&self) -> u64 {
        self.arrays.bytes()
    }

    /// Arrays that a stage writes.
    pub fn written(&self, stage: &Stage) -> &[&'static Array] {
        &self.compiled.written[stage]
    }

    /// The number of the bind group of a stage with the arrays as they are bound now; made if it is not there yet.
    fn group(&mut self, stage: &'static Stage) -> usize {
        let Gpu { device, compiled, arrays, params, .. } = self;
        let kernel = compiled.kernels.get_mut(stage).expect("the plans' stages are compiled");
        let bound = || kernel.variables.iter().flat_map(|v| &v.arrays).flatten().flat_map(|a| arrays.serials_of(a));
        if let Some(known) = kernel.groups.iter().position(|(known, _)| known.iter().copied().eq(bound())) {
            return known;
        }
        let begins = kernel.variables.iter().find(|v| matches!(v.resource, Resource::PackedAt(_))).map(|v| {
            let begin = |array: &Option<&Array>| array.and_then(|a| arrays.begin_in_pack(a)).unwrap_or(0) as u32;
            let mut begins: Vec<u8> = v.arrays.iter().map(begin).flat_map(u32::to_ne_bytes).collect();
            begins.resize(begins.len().next_multiple_of(16), 0);
            device.uniform("packed_at", &begins)
        });
        let resource = |v: &Variable| match (&v.resource, v.arrays.first().copied().flatten()) {
            (Resource::PackedAt(_), _) => begins.as_ref().expect("made above").as_entire_binding(),
            (Resource::Pack(pack), _) => arrays.pack(*pack),
            (resource, Some(array)) => arrays.resource(array, resource),
            (_, None) => params.as_entire_binding(),
        };
        let group = device.group(stage.name, &kernel.pipeline, kernel.variables.iter().map(resource));
        let serials = bound().collect();
        kernel.groups.push((serials, group));
        kernel.groups.len() - 1
    }

    /// Bind groups keep alive what they name.
    fn forget_groups(&mut self, serials: &[u64]) {
        for kernel in self.compiled.kernels.values_mut() {
            kernel.groups.retain(|(bound, _)| !bound.iter().any(|serial| serials.contains(serial)));
        }
    }

    fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        ops: &[Op],
        timed: Option<ComputePassTimestampWrites<'_>>,
    ) {
        let descriptor = wgpu::ComputePassDescriptor { label: None, timestamp_writes: timed };
        let mut pass: Option<wgpu::ComputePass<'static>> = None;
        for op in ops {
            match *op {
                Op::Run(stage) => {
                    let group = self.group(stage);
                    let pass = pass.get_or_insert_with(|| encoder.begin_compute_pass(&descriptor).forget_lifetime());
                    let kernel = &self.compiled.kernels[stage];
                    let (x, y) = groups(&stage.dispatch, &self.now);
                    pass.set_pipeline(&kernel.pipeline);
                    pass.set_bind_group(0, &kernel.groups[group].1, &[]);
                    pass.dispatch_workgroups(x, y, 1);
                }
                Op::Clear(array) => {
                    pass = None;
                    self.arrays.clear(encoder, array);
                }
                Op::Swap(a, b) => self.arrays.swap(a, b),
            }
        }
    }

    /// Encode what was executed last once more, since chunks of steps are alike. To be called while the device works.
    fn encode_ahead(&mut self) {
        let start = Instant::now();
        for ops in mem::take(&mut self.last).chunks(self.piece()) {
            self.ahead_work.operations += ops.len() as u64;
            let commands = self.commands(ops);
            self.ahead.push_back((ops.to_vec(), commands));
        }
        self.ahead_work.time += start.elapsed();
    }

    /// Operations that are encoded together.
    fn piece(&self) -> usize {
        (SUBMISSION / self.now.bodies.max(1)).clamp(1, PIECE)
    }

    fn commands(&mut self, ops: &[Op]) -> wgpu::CommandBuffer {
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        self.encode(&mut encoder, ops, None);
        encoder.finish()
    }

    /// Take pieces that operations begin with from what was encoded ahead, and forget the others: the commands, and the
    /// operations that are left.
    fn encoded<'a>(&mut self, mut ops: &'a [Op]) -> (Vec<wgpu::CommandBuffer>, &'a [Op]) {
        let mut commands = Vec::new();
        while let Some((piece, _)) = self.ahead.front()
            && let Some(rest) = ops.strip_prefix(&piece[..])
        {
            self.ahead_work.used += piece.len() as u64;
            ops = rest;
            commands.extend(self.ahead.pop_front().map(|(_, encoded)| encoded));
        }
        self.forget_ahead();
        (commands, ops)
    }

    /// Arrays are again what they are after the last operations that were executed.
    fn forget_ahead(&mut self) {
        while let Some((ops, _)) = self.ahead.pop_back() {
            for op in ops.iter().rev() {
                if let Op::Swap(a, b) = *op {
                    self.arrays.swap(a, b);
                }
            }
        }
    }

    /// What was encoded ahead so far.
    pub fn ahead(&self) -> Ahead {
        self.ahead_work
    }

    /// Run operations with a pass for every stage, by the device's clock.
    fn time(&mut self, watch: &Stopwatch, ops: &[Op], times: &mut Times) -> Result<()> {
        for ops in ops.chunks(Stopwatch::PASSES) {
            let mut encoder = self.device.device.create_command_encoder(&Default::default());
            let mut stages = Vec::new();
            for op in ops {
                let timed = matches!(op, Op::Run(_)).then(|| watch.pass(stages.len()));
                self.encode(&mut encoder, slice::from_ref(op), timed);
                stages.extend(op.stage());
            }
            let seconds = watch.read(&self.device, encoder, stages.len())?;
            stages.into_iter().zip(seconds).for_each(|(stage, seconds)| times.add(stage, seconds));
        }
        Ok(())
    }

    /// The same by the host's clock, from submitting to having waited.
    fn time_from_host(&mut self, ops: &[Op], times: &mut Times) -> Result<()> {
        self.device.wait()?;
        for op in ops {
            let start = Instant::now();
            let mut encoder = self.device.device.create_command_encoder(&Default::default());
            self.encode(&mut encoder, slice::from_ref(op), None);
            self.device.submit(encoder);
            self.device.wait()?;
            if let Some(stage) = op.stage() {
                times.add(stage, start.elapsed().as_secs_f64());
            }
        }
        Ok(())
    }
}

impl Kernel {
    fn new(device: &Device, stage: &'static Stage, program: Program) -> Result<Kernel> {
        let variable = |Binding { name, resource, .. }: &Binding| {
            let arrays = match resource {
                Resource::PackedAt(names) => names.iter().map(|name| stage.array(name)).collect(),
                Resource::Pack(_) => Vec::new(),
                _ => vec![bound(stage, name)?],
            };
            Ok(Variable { resource: resource.clone(), arrays })
        };
        let variables = program.bindings.iter().map(variable).collect::<Result<_>>()?;
        Ok(Kernel { pipeline: device.pipeline(stage.name, program)?, variables, groups: Vec::new() })
    }
}

/// The kernels of stages with arrays where they are to lie.
fn compiled(
    device: &Device,
    model: &Model,
    stages: &[&'static Stage],
    placements: &HashMap<&'static Array, Placement>,
) -> Result<HashMap<&'static Stage, Kernel>> {
    let programs = programs_with(model, stages, placements)?;
    stages.iter().zip(programs).map(|(stage, program)| Ok((*stage, Kernel::new(device, stage, program)?))).collect()
}

/// Workgroups of a dispatch.
fn groups(dispatch: &Dispatch, sizes: &Sizes) -> (u32, u32) {
    match dispatch {
        Dispatch::OneGroup => (1, 1),
        Dispatch::GroupEach(items) => folded(items(sizes)),
        Dispatch::Items(items) => workgroups(items(sizes)),
    }
}

/// Whether the device takes arrays as long as these, and the host's memory what is of them there.
fn check_memory(
    device: &Device,
    model: &Model,
    layouts: &Layouts,
    (placements, aliases): &Places,
    sizes: &Sizes,
) -> Result<()> {
    let limit = device.summary.max_array_bytes;
    let total = |sizes: &Sizes| total(model, layouts, aliases, sizes);
    let in_buffer = |array: &Array| placements.get(array).copied().unwrap_or_default() == Placement::Buffer;
    let mut buffers = bytes(model, layouts, sizes).filter(|(array, _)| in_buffer(array));
    if let Some((array, need)) = buffers.find(|(_, b)| *b > limit) {
        return Err(Error::Lacking(format!(
            "scene too large: array `{}` needs {need} bytes of {} in all, but {} allows {limit} bytes per array; use \
             fewer grains or --engine cpu",
            array.name,
            total(sizes),
            device.summary.name
        )));
    }
    let of_device = if device.software { total(&sizes.of_dense_packing()) } else { 0 };
    memory::check_host(u128::from(of_device) + memory::beside_grains(sizes.bodies as u64))
}

impl Engine for Gpu {
    fn name(&self) -> &'static str {
        "gpu"
    }

    fn adapter(&self) -> String {
        format!("{} ({})", self.device.summary.name, self.device.summary.backend)
    }

    fn execute(&mut self, params: &Params, ops: &[Op]) -> Result<()> {
        let dims = self.model.dims();
        let len = |array: &Array| self.arrays.len(array) as u32;
        let params = Params {
            entries: len(&array::NEIGHBOUR),
            history: len(&array::HISTORY_OTHER),
            colors: len(&array::COLOR_COUNT),
            ..*params
        };
        let bytes =
            self.arrays.layouts().params.encode(1, &self.params_units, |sink| params.put(dims, &mut |x| sink(x)));
        self.device.queue.write_buffer(&self.params, 0, &bytes);
        if self.times.is_some() {
            self.forget_ahead();
            let watch = Stopwatch::new(&self.device)?;
            let mut times = self.times.take().unwrap_or_default();
            let done = match watch {
                Some(watch) => self.time(&watch, ops, &mut times),
                None => self.time_from_host(ops, &mut times),
            };
            self.times = Some(times);
            return done;
        }
        let (mut commands, rest) = self.encoded(ops);
        if ops.len().saturating_mul(self.now.bodies) <= SUBMISSION {
            commands.push(self.commands(rest));
            self.device.submit_all(commands);
        } else {
            commands.into_iter().for_each(|commands| self.device.submit_all([commands]));
            for ops in rest.chunks(self.piece()) {
                let commands = self.commands(ops);
                self.device.submit_all([commands]);
            }
        }
        self.last = ops.to_vec();
        Ok(())
    }

    fn counters(&mut self) -> Result<Counters> {
        self.device.check()?;
        self.encode_ahead();
        let layout = self.arrays.layout(&array::COUNTERS).expect("kernels count");
        let bytes = self.arrays.read(&self.device, &array::COUNTERS, 0..1)?;
        Ok(Counters::take(self.model.dims(), &mut layout.decode(&bytes, &self.units[&array::COUNTERS])))
    }

    fn count(&mut self, sizes: &Sizes) -> Result<()> {
        self.forget_ahead();
        self.last.clear();
        self.now = Sizes { bodies: sizes.bodies, large: sizes.large, clumps: sizes.clumps, ..self.now };
        Ok(())
    }

    fn resize(&mut self, resized: &[&'static Array], len: usize) -> Result<()> {
        self.forget_ahead();
        let Gpu { device, arrays, model, sizes, compiled: Compiled { stages, kernels, possible, .. }, .. } = self;
        let sizes = Sizes { history: len, ..*sizes };
        let (placements, aliases) = possible.moved(device, model, arrays, resized, (len, &sizes));
        let moved = placements != *arrays.placements();
        arrays.place(placements, aliases);
        if moved {
            *kernels = compiled(device, model, stages, arrays.placements())?;
        }
        let old = arrays.serials();
        arrays.allocate(device, resized, len)?;
        let gone: Vec<u64> = old.difference(&arrays.serials()).copied().collect();
        self.forget_groups(&gone);
        Ok(())
    }

    fn write(&mut self, arrays: &[&'static Array], first: usize, state: &State) -> Result<()> {
        self.forget_ahead();
        let dims = self.model.dims();
        for &array in arrays {
            let Some(layout) = self.arrays.layout(array) else { continue };
            let column = state.column(array);
            let bytes = layout.encode(column.len(), &self.units[array], |sink| column.lanes(dims, sink));
            self.arrays.write(&self.device, array, first, &bytes);
        }
        // What is written waits in memory until then.
        self.device.queue.submit([]);
        self.device.wait()
    }

    fn read(&mut self, arrays: &[&'static Array], elements: Range<usize>, state: &mut State) -> Result<()> {
        self.forget_ahead();
        for &array in arrays {
            let len = match array.length.is_of_grains() {
                true => self.now.of(array.length).min(self.arrays.len(array)),
                false => self.arrays.len(array),
            };
            let elements = within(&elements, len);
            let Some(layout) = self.arrays.layout(array).filter(|_| self.arrays.len(array) > 0) else { continue };
            let bytes = self.arrays.read(&self.device, array, elements.clone())?;
            let column: &mut dyn Column = state.column_mut(array);
            column.resize(elements.len());
            column.fill(self.model.dims(), &mut layout.decode(&bytes, &self.units[array]));
        }
        Ok(())
    }

    fn times(&mut self) -> &mut Option<Times> {
        &mut self.times
    }

    fn clock(&self) -> &'static str {
        if self.device.summary.timestamps { "device" } else { "host, around submission and wait" }
    }

    fn stride(&self, array: &'static Array) -> usize {
        self.arrays.layouts().stride(array)
    }
}

impl dyn Engine {
    /// The device engine, if it is that.
    pub fn gpu(&self) -> Option<&Gpu> {
        (self as &dyn Any).downcast_ref()
    }
}
