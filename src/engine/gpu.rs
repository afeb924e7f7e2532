//! The device engine: every stage of the plan as a compute pipeline, every array of the state as a buffer or an image.

use super::{Engine, Times, within};
use crate::{
    error::{Error, Result},
    gpu::{Arrays, Binding, Device, Layout, Program, Stopwatch, compose, folded, images, workgroups},
    memory,
    model::Model,
    plan::Op,
    plans::Plans,
    shaders,
    stage::{Dispatch, Stage},
    state::{ARRAYS, Array, Column, Counters, Element, Params, Sizes, State, array, present},
    units::Quantity,
};
use std::{
    any::Any,
    collections::{HashMap, HashSet},
    ops::Range,
    slice,
    time::Instant,
};
use wgpu::ComputePassTimestampWrites;

/// Runs the WGSL kernels.
pub struct Gpu {
    device: Device,
    dims: usize,
    sizes: Sizes,
    kernels: HashMap<&'static Stage, Kernel>,
    layouts: Layouts,
    /// The unit of each lane of an element of an array, in SI units, and of the parameters.
    units: HashMap<&'static Array, Vec<f64>>,
    params_units: Vec<f64>,
    /// Arrays that are images.
    images: HashSet<&'static Array>,
    buffers: HashMap<&'static Array, Buffer>,
    params: wgpu::Buffer,
    /// Buffers made so far.
    serial: u64,
    times: Option<Times>,
}

#[derive(Clone)]
struct Kernel {
    pipeline: wgpu::ComputePipeline,
    /// In binding order; None for `params`.
    arrays: Vec<Option<&'static Array>>,
    written: Vec<&'static Array>,
    /// One for each way in which its arrays have been bound: buffers that take turns are bound in two.
    groups: Vec<(Vec<u64>, wgpu::BindGroup)>,
}

struct Buffer {
    memory: Memory,
    /// No other buffer ever has this number.
    serial: u64,
    len: usize,
}

enum Memory {
    Buffer(wgpu::Buffer),
    Image(wgpu::Texture, wgpu::TextureView),
}

/// How the arrays of a model, and `params`, lie on a device.
#[derive(Clone)]
pub struct Layouts {
    params: Layout,
    arrays: HashMap<&'static Array, Layout>,
}

impl Layouts {
    /// Bytes from one element of an array to the next.
    pub fn stride(&self, array: &'static Array) -> usize {
        self.arrays.get(array).map_or(4, |l| l.stride)
    }
}

/// The kernels of stages, composed for a model.
pub fn programs(model: &Model, stages: &[&Stage]) -> Result<Vec<Program>> {
    programs_with_images(model, stages, &HashSet::new())
}

/// The same with images in place of these arrays.
fn programs_with_images(model: &Model, stages: &[&Stage], images: &HashSet<&'static Array>) -> Result<Vec<Program>> {
    let shared: Vec<_> = model.files().into_iter().map(shaders::file).collect();
    let kernels = stages.iter().map(|stage| (stage.kernel, shaders::file(&stage.file())));
    let image = |k: usize, binding: &Binding| stages[k].array(&binding.name).is_some_and(|a| images.contains(a));
    compose(&shared, &kernels.collect::<Vec<_>>(), image)
}

/// Arrays with which all kernels, and the plan, do only what can be done with images. Buffers and images cannot be
/// exchanged, so what is now and what comes next go together.
fn imageable(plans: &Plans, programs: &[(&'static Stage, Program)]) -> HashSet<&'static Array> {
    let bindings = || programs.iter().flat_map(|(stage, p)| p.bindings.iter().map(|b| (stage.array(&b.name), b)));
    let ops = plans.ops();
    let is_cleared = |op: &Op, array: &Array| matches!(op, Op::Clear(a) if a.original() == array.original());
    let cleared = |array: &Array| ops.iter().any(|op| is_cleared(op, array));
    let of = |array: &'static Array| {
        bindings().filter(|(bound, _)| bound.is_some_and(|bound| bound.original() == array.original()))
    };
    let possible = |a: &&'static Array| !cleared(a) && of(a).count() > 0 && of(a).all(|(_, b)| images::possible(b));
    ARRAYS.iter().copied().filter(possible).collect()
}

/// Layout of every array that the stages of a model touch, and of `params`, read from the composed kernels.
///
/// # Errors
/// [`Error::Shader`] if a kernel does not compose, or if a struct differs between Rust and WGSL.
pub fn layouts(model: &Model, plans: &Plans) -> Result<Layouts> {
    let stages = plans.stages();
    let programs = programs(model, &stages)?;
    collect_layouts(model.dims(), &stages.into_iter().zip(programs).collect::<Vec<_>>())
}

fn collect_layouts(dims: usize, programs: &[(&'static Stage, Program)]) -> Result<Layouts> {
    let (mut arrays, mut params) = (HashMap::new(), None);
    let empty =
        State::new(crate::model::Model::all(crate::model::Precision::Single)[0], Sizes::default(), Params::default());
    for (stage, program) in programs {
        for binding in &program.bindings {
            let array = bound(stage, &binding.name)?;
            let names = array.map_or_else(|| Params::names(dims), |array| empty.column(array).names(dims));
            let known = array.map_or(params.as_ref(), |array| arrays.get(array));
            let same = binding.layout.names.iter().eq(names);
            if !same || known.is_some_and(|l| *l != binding.layout) {
                return Err(Error::Shader {
                    file: stage.file(),
                    line: 1,
                    message: format!(
                        "`{}` has members {:?}, its Rust twin {names:?}",
                        binding.name, binding.layout.names
                    ),
                });
            }
            match array {
                Some(array) => drop(arrays.insert(array, binding.layout.clone())),
                None => params = Some(binding.layout.clone()),
            }
        }
    }
    for &array in ARRAYS {
        let original = Array::named(array.original()).and_then(|original| arrays.get(original));
        if let Some(layout) = original.cloned() {
            arrays.entry(array).or_insert(layout);
        }
    }
    Ok(Layouts { params: params.expect("every kernel knows `params`"), arrays })
}

/// The array that a binding of a stage stands for; None for `params`.
fn bound(stage: &Stage, name: &str) -> Result<Option<&'static Array>> {
    let array = stage.array(name);
    if array.is_some() || name == "params" {
        return Ok(array);
    }
    Err(Error::Shader {
        file: stage.file(),
        line: 1,
        message: format!("`{name}` is not in the dictionary of arrays (src/state.rs)"),
    })
}

impl Gpu {
    /// Compile the plans' kernels and allocate the model's arrays: as `state` has them, or zero where it has none.
    ///
    /// # Errors
    /// [`Error::Device`] if the arrays do not fit, [`Error::Shader`] if a kernel does not compile.
    pub fn new(device: Device, plans: &Plans, state: &State) -> Result<Gpu> {
        let model = &state.model;
        let programs = |images: &HashSet<_>| -> Result<Vec<_>> {
            let stages = plans.stages();
            let programs = programs_with_images(model, &stages, images)?;
            Ok(stages.into_iter().zip(programs).collect())
        };
        let mut composed = programs(&HashSet::new())?;
        let layouts = collect_layouts(model.dims(), &composed)?;
        let mut images = HashSet::new();
        if device.arrays != Arrays::Buffers {
            images = imageable(plans, &composed);
            match fit(&device, &composed, &layouts, &images, &state.sizes) {
                Ok(()) => composed = programs(&images)?,
                Err(_) if device.arrays == Arrays::Auto => images.clear(),
                Err(e) => return Err(e),
            }
        }
        check_memory(&device, model, &layouts, &images, &state.sizes)?;
        let mut kernels = HashMap::new();
        for (stage, program) in composed {
            kernels.insert(stage, Kernel::new(&device, stage, program)?);
        }
        Gpu::filled(device, kernels, layouts, images, state)
    }

    /// Another one on the same device and with the same kernels, filled with the content of another state of the model.
    ///
    /// # Errors
    /// [`Error::Device`] if the arrays do not fit.
    pub fn beside(&self, state: &State) -> Result<Gpu> {
        let kernels =
            self.kernels.iter().map(|(stage, kernel)| (*stage, Kernel { groups: Vec::new(), ..kernel.clone() }));
        Gpu::filled(self.device.clone(), kernels.collect(), self.layouts.clone(), self.images.clone(), state)
    }

    fn filled(
        device: Device,
        kernels: HashMap<&'static Stage, Kernel>,
        layouts: Layouts,
        images: HashSet<&'static Array>,
        state: &State,
    ) -> Result<Gpu> {
        let model = &state.model;
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let params = device.buffer("params", layouts.params.stride as u64, usage)?;
        let dims = model.dims();
        let of = |quantities: Vec<Quantity>| quantities.into_iter().map(|q| state.units.of(q)).collect::<Vec<_>>();
        let mut gpu = Gpu {
            device,
            dims,
            units: ARRAYS.iter().map(|array| (*array, of(state.quantities(array)))).collect(),
            params_units: of(Params::quantities(Quantity::Number, dims)),
            sizes: state.sizes,
            kernels,
            layouts,
            images,
            buffers: HashMap::new(),
            params,
            serial: 0,
            times: None,
        };
        let total: u64 = bytes(model, &gpu.layouts, &state.sizes).map(|(_, b)| b).sum();
        for array in present(model, ARRAYS) {
            let of_total = |e| Error::Device(format!("scene too large, it needs {total} bytes in all: {e}"));
            match state.column(array).len() {
                0 => gpu.resize(array, state.sizes.of(array.length)).map_err(of_total)?,
                len => {
                    gpu.resize(array, len).map_err(of_total)?;
                    gpu.write(&[array], 0, state)?;
                }
            }
        }
        Ok(gpu)
    }

    /// Arrays that a stage writes.
    pub fn written(&self, stage: &Stage) -> &[&'static Array] {
        &self.kernels[stage].written
    }

    /// The number of the bind group of a stage with the arrays as they are bound now; made if it is not there yet.
    fn group(&mut self, stage: &'static Stage) -> usize {
        let kernel = self.kernels.get_mut(stage).expect("the plans' stages are compiled");
        let bound = |array: &Option<&Array>| array.and_then(|array| self.buffers.get(array)).map_or(0, |b| b.serial);
        let serials = || kernel.arrays.iter().map(bound);
        if let Some(known) = kernel.groups.iter().position(|(known, _)| known.iter().copied().eq(serials())) {
            return known;
        }
        let resource = |array: &Option<&Array>| match array {
            None => self.params.as_entire_binding(),
            Some(array) => match &self.buffers[*array].memory {
                Memory::Buffer(buffer) => buffer.as_entire_binding(),
                Memory::Image(_, view) => wgpu::BindingResource::TextureView(view),
            },
        };
        let group = self.device.group(stage.name, &kernel.pipeline, kernel.arrays.iter().map(resource));
        let serials = serials().collect();
        kernel.groups.push((serials, group));
        kernel.groups.len() - 1
    }

    /// Elements of an array.
    fn fetch(&self, array: &Buffer, elements: Range<usize>, layout: &Layout) -> Result<Vec<u8>> {
        let (begin, bytes) = ((elements.start * layout.stride) as u64, (elements.len() * layout.stride) as u64);
        match &array.memory {
            Memory::Buffer(buffer) => self.device.read(buffer, begin, bytes),
            Memory::Image(image, _) => self.device.read_image(image, begin, bytes),
        }
    }

    /// Bind groups that name a buffer keep it alive.
    fn forget_groups(&mut self, serial: u64) {
        for kernel in self.kernels.values_mut() {
            kernel.groups.retain(|(serials, _)| !serials.contains(&serial));
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
                    let kernel = &self.kernels[stage];
                    let (x, y) = groups(&stage.dispatch, &self.sizes);
                    pass.set_pipeline(&kernel.pipeline);
                    pass.set_bind_group(0, &kernel.groups[group].1, &[]);
                    pass.dispatch_workgroups(x, y, 1);
                }
                Op::Clear(array) => {
                    pass = None;
                    match &self.buffers[array].memory {
                        Memory::Buffer(buffer) => encoder.clear_buffer(buffer, 0, None),
                        Memory::Image(..) => unreachable!("`{array:?}` is cleared, so it is no image"),
                    }
                }
                Op::Swap(a, b) => {
                    let first = self.buffers.remove(a).expect("an array of the model");
                    let second = self.buffers.insert(b, first).expect("an array of the model");
                    self.buffers.insert(a, second);
                }
            }
        }
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
            self.device.queue.submit([encoder.finish()]);
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
        let arrays = program.bindings.iter().map(|b| bound(stage, &b.name)).collect::<Result<Vec<_>>>()?;
        let written = program.bindings.iter().zip(&arrays).filter(|(b, _)| b.written).filter_map(|(_, a)| *a).collect();
        Ok(Kernel { pipeline: device.pipeline(stage.name, program)?, arrays, written, groups: Vec::new() })
    }
}

/// Workgroups of a dispatch.
fn groups(dispatch: &Dispatch, sizes: &Sizes) -> (u32, u32) {
    match dispatch {
        Dispatch::OneGroup => (1, 1),
        Dispatch::GroupEach(items) => folded(items(sizes)),
        Dispatch::Items(items) => workgroups(items(sizes)),
    }
}

/// Bytes of each array the model needs, from the layouts of its kernels.
pub fn bytes<'a>(
    model: &'a Model,
    layouts: &'a Layouts,
    sizes: &'a Sizes,
) -> impl Iterator<Item = (&'static Array, u64)> + Clone + 'a {
    let needed = ARRAYS.iter().filter(|a| (a.needed)(model));
    needed.map(|array| (*array, (sizes.of(array.length) * layouts.stride(array)) as u64))
}

/// Whether a device has room for these arrays as images.
///
/// # Errors
/// [`Error::Device`] if there are too many in a kernel, or one is too long.
fn fit(
    device: &Device,
    programs: &[(&'static Stage, Program)],
    layouts: &Layouts,
    images: &HashSet<&'static Array>,
    sizes: &Sizes,
) -> Result<()> {
    let limits = device.device.limits();
    for (stage, program) in programs {
        let used =
            program.bindings.iter().filter(|b| stage.array(&b.name).is_some_and(|a| images.contains(a))).count() as u32;
        let allowed = limits.max_storage_textures_per_shader_stage;
        if used > allowed {
            return Err(Error::Device(format!(
                "kernel `{}` uses {used} images, but {} allows {allowed}; use --arrays buffers",
                stage.name, device.summary.name
            )));
        }
    }
    let mut arrays = ARRAYS.iter().filter(|a| images.contains(**a));
    arrays.try_for_each(|a| device.check_image(a.name, sizes.of(a.length) * images::texels(&layouts.arrays[*a])))
}

/// Whether the device takes arrays as long as these, and the host's memory what is of them there.
fn check_memory(
    device: &Device,
    model: &Model,
    layouts: &Layouts,
    images: &HashSet<&'static Array>,
    sizes: &Sizes,
) -> Result<()> {
    let limit = device.summary.max_array_bytes;
    let total = |sizes: &Sizes| bytes(model, layouts, sizes).map(|(_, bytes)| bytes).sum::<u64>();
    let mut buffers = bytes(model, layouts, sizes).filter(|(array, _)| !images.contains(*array));
    if let Some((array, need)) = buffers.find(|(_, b)| *b > limit) {
        return Err(Error::Device(format!(
            "scene too large: array `{}` needs {need} bytes of {} in all, but {} allows {limit} bytes per array; use \
             fewer grains or --engine cpu",
            array.name,
            total(sizes),
            device.summary.name
        )));
    }
    let of_device = if device.software { total(&sizes.of_dense_packing()) } else { 0 };
    memory::check_host(of_device + memory::of_grains(sizes.bodies as u64))
}

impl Engine for Gpu {
    fn name(&self) -> &'static str {
        "gpu"
    }

    fn adapter(&self) -> String {
        format!("{} ({})", self.device.summary.name, self.device.summary.backend)
    }

    fn execute(&mut self, params: &Params, ops: &[Op]) -> Result<()> {
        let len = |array: &Array| self.buffers.get(array).map_or(0, |b| b.len as u32);
        let params = Params {
            entries: len(&array::NEIGHBOUR),
            history: len(&array::HISTORY_OTHER),
            colors: len(&array::COLOR_COUNT),
            ..*params
        };
        let bytes = self.layouts.params.encode(1, &self.params_units, |sink| params.put(self.dims, &mut |x| sink(x)));
        self.device.queue.write_buffer(&self.params, 0, &bytes);
        if self.times.is_some() {
            let watch = Stopwatch::new(&self.device)?;
            let mut times = self.times.take().unwrap_or_default();
            let done = match watch {
                Some(watch) => self.time(&watch, ops, &mut times),
                None => self.time_from_host(ops, &mut times),
            };
            self.times = Some(times);
            return done;
        }
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        self.encode(&mut encoder, ops, None);
        self.device.queue.submit([encoder.finish()]);
        Ok(())
    }

    fn counters(&mut self) -> Result<Counters> {
        self.device.check()?;
        let layout = &self.layouts.arrays[&array::COUNTERS];
        let bytes = self.fetch(&self.buffers[&array::COUNTERS], 0..1, layout)?;
        Ok(Counters::take(self.dims, &mut layout.decode(&bytes, &self.units[&array::COUNTERS])))
    }

    fn resize(&mut self, array: &'static Array, len: usize) -> Result<()> {
        let layout = self.layouts.arrays.get(array);
        let format = layout.filter(|_| self.images.contains(array)).and_then(images::format);
        let memory = if let (Some(layout), Some(format)) = (layout, format) {
            let image = self.device.image(array.name, len * images::texels(layout), format)?;
            let view = image.create_view(&Default::default());
            Memory::Image(image, view)
        } else {
            let stride = self.layouts.stride(array);
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
            Memory::Buffer(self.device.buffer(array.name, (len * stride) as u64, usage)?)
        };
        self.serial += 1;
        let old = self.buffers.insert(array, Buffer { memory, serial: self.serial, len });
        if let Some(old) = old {
            self.forget_groups(old.serial);
        }
        Ok(())
    }

    fn write(&mut self, arrays: &[&'static Array], first: usize, state: &State) -> Result<()> {
        for &array in arrays {
            let Some(layout) = self.layouts.arrays.get(array) else { continue };
            let column = state.column(array);
            let bytes = layout.encode(column.len(), &self.units[array], |sink| column.lanes(self.dims, sink));
            let begin = (first * layout.stride) as u64;
            match &self.buffers[array].memory {
                Memory::Buffer(buffer) => self.device.queue.write_buffer(buffer, begin, &bytes),
                Memory::Image(image, _) => self.device.write_image(image, begin, &bytes),
            }
        }
        // What is written waits in memory until then.
        self.device.queue.submit([]);
        self.device.wait()
    }

    fn read(&mut self, arrays: &[&'static Array], elements: Range<usize>, state: &mut State) -> Result<()> {
        for &array in arrays {
            let (Some(layout), Some(buffer)) = (self.layouts.arrays.get(array), self.buffers.get(array)) else {
                continue;
            };
            let elements = within(&elements, buffer.len);
            let bytes = self.fetch(buffer, elements.clone(), layout)?;
            let column: &mut dyn Column = state.column_mut(array);
            column.resize(elements.len());
            column.fill(self.dims, &mut layout.decode(&bytes, &self.units[array]));
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
        self.layouts.stride(array)
    }
}

impl dyn Engine {
    /// The device engine, if it is that.
    pub fn gpu(&self) -> Option<&Gpu> {
        (self as &dyn Any).downcast_ref()
    }
}
