//! The device engine: every stage of the plan as a compute pipeline, every array of the state as a buffer or an image.

use super::{Engine, Times};
use crate::{
    error::{Error, Result},
    gpu::{Arrays, Device, Layout, Program, Stopwatch, compose, images, workgroups},
    kernels::{Dispatch, Stage},
    memory,
    model::Model,
    plan::{Op, Plan},
    shaders,
    state::{ARRAYS, Array, Column, Counters, Element, Params, Sizes, State, original},
};
use std::{
    collections::{HashMap, HashSet},
    slice,
    time::Instant,
};
use wgpu::ComputePassTimestampWrites;

/// Runs the WGSL kernels.
pub struct Gpu {
    device: Device,
    dims: usize,
    sizes: Sizes,
    kernels: HashMap<&'static str, Kernel>,
    layouts: HashMap<&'static str, Layout>,
    /// Arrays that are images.
    images: HashSet<&'static str>,
    buffers: HashMap<&'static str, Buffer>,
    params: wgpu::Buffer,
    params_layout: Layout,
    /// Whether anything has run, so that buffers may hold something.
    dirty: bool,
    /// Buffers made so far.
    serial: u64,
    times: Option<Times>,
}

#[derive(Clone)]
struct Kernel {
    pipeline: wgpu::ComputePipeline,
    /// Array names in binding order; `params` for the uniform.
    arrays: Vec<&'static str>,
    written: Vec<&'static str>,
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

/// The kernels of stages, composed for a model.
pub fn programs(model: &Model, stages: &[&Stage]) -> Result<Vec<Program>> {
    programs_with_images(model, stages, &HashSet::new())
}

/// The same with images in place of these arrays.
fn programs_with_images(model: &Model, stages: &[&Stage], images: &HashSet<&'static str>) -> Result<Vec<Program>> {
    let shared: Vec<_> = model.files().into_iter().map(shaders::file).collect();
    let kernels = stages.iter().map(|stage| (stage.kernel, shaders::file(&format!("{}.wgsl", stage.kernel))));
    compose(&shared, &kernels.collect::<Vec<_>>(), |k, binding| images.contains(stages[k].array(&binding.name)))
}

/// Arrays with which all kernels, and the plan, do only what can be done with images. Buffers and images cannot be
/// exchanged, so what is now and what comes next go together.
fn imageable(plan: &Plan, programs: &[(&'static Stage, Program)]) -> HashSet<&'static str> {
    let bindings = || programs.iter().flat_map(|(stage, p)| p.bindings.iter().map(|b| (stage.array(&b.name), b)));
    let is_cleared = |op: &Op, array: &Array| matches!(op, Op::Clear(a) if original(a) == array.original());
    let cleared = |array: &Array| plan.parts().iter().any(|(_, ops)| ops.iter().any(|op| is_cleared(op, array)));
    let of = |a: &'static Array| bindings().filter(|(name, _)| original(name) == a.original());
    let possible = |a: &&'static Array| !cleared(a) && of(a).count() > 0 && of(a).all(|(_, b)| images::possible(b));
    ARRAYS.iter().filter(possible).map(|a| a.name).collect()
}

/// Layout of every array that the stages of a plan touch, and of `params`, read from the composed kernels.
///
/// # Errors
/// [`Error::Shader`] if a kernel does not compose, or if a struct differs between Rust and WGSL.
pub fn layouts(model: &Model, plan: &Plan) -> Result<HashMap<&'static str, Layout>> {
    let stages = plan.stages();
    let programs = programs(model, &stages)?;
    collect_layouts(model.dims(), &stages.into_iter().zip(programs).collect::<Vec<_>>())
}

fn collect_layouts(dims: usize, programs: &[(&'static Stage, Program)]) -> Result<HashMap<&'static str, Layout>> {
    let mut layouts = HashMap::new();
    let empty =
        State::new(crate::model::Model::all(crate::model::Precision::Single)[0], Sizes::default(), Params::default());
    for (stage, program) in programs {
        for binding in &program.bindings {
            let name = known(stage.array(&binding.name), stage)?;
            let names = if name == "params" { Params::names(dims) } else { empty.column(name).names(dims) };
            let same = binding.layout.names.iter().eq(names);
            if !same || layouts.get(name).is_some_and(|l| *l != binding.layout) {
                return Err(Error::Shader {
                    file: format!("{}.wgsl", stage.kernel),
                    line: 1,
                    message: format!("`{name}` has members {:?}, its Rust twin {names:?}", binding.layout.names),
                });
            }
            layouts.insert(name, binding.layout.clone());
        }
    }
    for array in ARRAYS {
        if let Some(layout) = layouts.get(array.original()).cloned() {
            layouts.entry(array.name).or_insert(layout);
        }
    }
    Ok(layouts)
}

/// The dictionary's own copy of a name.
fn known(name: &str, stage: &Stage) -> Result<&'static str> {
    if name == "params" {
        return Ok("params");
    }
    ARRAYS.iter().find(|a| a.name == name).map(|a| a.name).ok_or_else(|| Error::Shader {
        file: format!("{}.wgsl", stage.kernel),
        line: 1,
        message: format!("`{name}` is not in the dictionary of arrays (src/state.rs)"),
    })
}

impl Gpu {
    /// Compile the plan's kernels and allocate the model's arrays, as long as in `state`, filled with its content.
    ///
    /// # Errors
    /// [`Error::Device`] if the arrays do not fit, [`Error::Shader`] if a kernel does not compile.
    pub fn new(device: Device, plan: &Plan, state: &State) -> Result<Gpu> {
        let model = &state.model;
        let programs = |images: &HashSet<_>| -> Result<Vec<_>> {
            let stages = plan.stages();
            let programs = programs_with_images(model, &stages, images)?;
            Ok(stages.into_iter().zip(programs).collect())
        };
        let mut composed = programs(&HashSet::new())?;
        let layouts = collect_layouts(model.dims(), &composed)?;
        let mut images = HashSet::new();
        if device.arrays != Arrays::Buffers {
            images = imageable(plan, &composed);
            match fit(&device, &composed, &layouts, &images, &state.sizes) {
                Ok(()) => composed = programs(&images)?,
                Err(_) if device.arrays == Arrays::Auto => images.clear(),
                Err(e) => return Err(e),
            }
        }
        check_memory(&device, bytes(model, &layouts, &state.sizes), &images)?;
        let mut kernels = HashMap::new();
        for (stage, program) in composed {
            kernels.insert(stage.name, Kernel::new(&device, stage, program)?);
        }
        Gpu::filled(device, kernels, layouts, images, state)
    }

    /// Another one on the same device and with the same kernels, filled with the content of another state of the model.
    ///
    /// # Errors
    /// [`Error::Device`] if the arrays do not fit.
    pub fn beside(&self, state: &State) -> Result<Gpu> {
        let kernels =
            self.kernels.iter().map(|(name, kernel)| (*name, Kernel { groups: Vec::new(), ..kernel.clone() }));
        Gpu::filled(self.device.clone(), kernels.collect(), self.layouts.clone(), self.images.clone(), state)
    }

    fn filled(
        device: Device,
        kernels: HashMap<&'static str, Kernel>,
        layouts: HashMap<&'static str, Layout>,
        images: HashSet<&'static str>,
        state: &State,
    ) -> Result<Gpu> {
        let model = &state.model;
        let params_layout = layouts["params"].clone();
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let params = device.buffer("params", params_layout.stride as u64, usage)?;
        let mut gpu = Gpu {
            device,
            dims: model.dims(),
            sizes: state.sizes,
            kernels,
            layouts,
            images,
            buffers: HashMap::new(),
            params,
            params_layout,
            dirty: false,
            serial: 0,
            times: None,
        };
        let total: u64 = bytes(model, &gpu.layouts, &state.sizes).map(|(_, b)| b).sum();
        for array in ARRAYS.iter().filter(|a| (a.needed)(model)) {
            let of_total = |e| Error::Device(format!("scene too large, it needs {total} bytes in all: {e}"));
            gpu.resize(array.name, state.sizes.of(array.length)).map_err(of_total)?;
            gpu.write(&[array.name], state)?;
        }
        Ok(gpu)
    }

    /// Arrays that a stage writes.
    pub fn written(&self, stage: &Stage) -> &[&'static str] {
        &self.kernels[stage.name].written
    }

    /// The number of the bind group of a stage with the arrays as they are bound now; made if it is not there yet.
    fn group(&mut self, stage: &'static Stage) -> usize {
        let kernel = self.kernels.get_mut(stage.name).expect("the plan's stages are compiled");
        let bound = |name: &&str| self.buffers.get(*name).map_or(0, |b| b.serial);
        let serials = || kernel.arrays.iter().map(bound);
        if let Some(known) = kernel.groups.iter().position(|(known, _)| known.iter().copied().eq(serials())) {
            return known;
        }
        let resource = |name: &&str| match *name {
            "params" => self.params.as_entire_binding(),
            array => match &self.buffers[array].memory {
                Memory::Buffer(buffer) => buffer.as_entire_binding(),
                Memory::Image(_, view) => wgpu::BindingResource::TextureView(view),
            },
        };
        let group = self.device.group(stage.name, &kernel.pipeline, kernel.arrays.iter().map(resource));
        let serials = serials().collect();
        kernel.groups.push((serials, group));
        kernel.groups.len() - 1
    }

    /// The content of an array.
    fn fetch(&self, array: &Buffer, layout: &Layout) -> Result<Vec<u8>> {
        let bytes = (array.len * layout.stride) as u64;
        match &array.memory {
            Memory::Buffer(buffer) => self.device.read(buffer, bytes),
            Memory::Image(image, _) => self.device.read_image(image, bytes),
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
        times: u32,
        timed: Option<ComputePassTimestampWrites<'_>>,
    ) {
        let descriptor = wgpu::ComputePassDescriptor { label: None, timestamp_writes: timed };
        let mut pass: Option<wgpu::ComputePass<'static>> = None;
        for op in (0..times).flat_map(|_| ops) {
            match *op {
                Op::Run(stage) => {
                    let group = self.group(stage);
                    let pass = pass.get_or_insert_with(|| encoder.begin_compute_pass(&descriptor).forget_lifetime());
                    let kernel = &self.kernels[stage.name];
                    let (x, y) = groups(&stage.dispatch, &self.sizes);
                    pass.set_pipeline(&kernel.pipeline);
                    pass.set_bind_group(0, &kernel.groups[group].1, &[]);
                    pass.dispatch_workgroups(x, y, 1);
                }
                Op::Clear(array) => {
                    pass = None;
                    match &self.buffers[array].memory {
                        Memory::Buffer(buffer) => encoder.clear_buffer(buffer, 0, None),
                        Memory::Image(..) => unreachable!("`{array}` is cleared, so it is no image"),
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
    fn time(&mut self, watch: &Stopwatch, ops: &mut dyn Iterator<Item = &Op>, times: &mut Times) -> Result<()> {
        let mut ops = ops.peekable();
        while ops.peek().is_some() {
            let mut encoder = self.device.device.create_command_encoder(&Default::default());
            let mut stages = Vec::new();
            for op in ops.by_ref().take(Stopwatch::PASSES) {
                let timed = matches!(op, Op::Run(_)).then(|| watch.pass(stages.len()));
                self.encode(&mut encoder, slice::from_ref(op), 1, timed);
                stages.extend(op.stage());
            }
            let seconds = watch.read(&self.device, encoder, stages.len())?;
            stages.into_iter().zip(seconds).for_each(|(stage, seconds)| times.add(stage, seconds));
        }
        Ok(())
    }

    /// The same by the host's clock, from submitting to having waited.
    fn time_from_host(&mut self, ops: &mut dyn Iterator<Item = &Op>, times: &mut Times) -> Result<()> {
        self.device.wait()?;
        for op in ops {
            let start = Instant::now();
            let mut encoder = self.device.device.create_command_encoder(&Default::default());
            self.encode(&mut encoder, slice::from_ref(op), 1, None);
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
        let names = |written: bool| -> Result<Vec<&'static str>> {
            let bindings = program.bindings.iter().filter(|b| !written || b.written);
            bindings.map(|b| known(stage.array(&b.name), stage)).collect()
        };
        let (arrays, written) = (names(false)?, names(true)?);
        Ok(Kernel { pipeline: device.pipeline(stage.name, program)?, arrays, written, groups: Vec::new() })
    }
}

/// Workgroups of a dispatch.
fn groups(dispatch: &Dispatch, sizes: &Sizes) -> (u32, u32) {
    match dispatch {
        Dispatch::OneGroup => (1, 1),
        Dispatch::Items(items) => workgroups(items(sizes)),
    }
}

/// Bytes of each array the model needs, from the layouts of its kernels.
pub fn bytes<'a>(
    model: &'a Model,
    layouts: &'a HashMap<&'static str, Layout>,
    sizes: &'a Sizes,
) -> impl Iterator<Item = (&'static Array, u64)> + Clone + 'a {
    ARRAYS.iter().filter(|a| (a.needed)(model)).map(|array| {
        let stride = layouts.get(array.name).map_or(4, |l| l.stride);
        (array, (sizes.of(array.length) * stride) as u64)
    })
}

/// Whether a device has room for these arrays as images.
///
/// # Errors
/// [`Error::Device`] if there are too many in a kernel, or one is too long.
fn fit(
    device: &Device,
    programs: &[(&'static Stage, Program)],
    layouts: &HashMap<&'static str, Layout>,
    images: &HashSet<&'static str>,
    sizes: &Sizes,
) -> Result<()> {
    let limits = device.device.limits();
    for (stage, program) in programs {
        let used = program.bindings.iter().filter(|b| images.contains(stage.array(&b.name))).count() as u32;
        let allowed = limits.max_storage_textures_per_shader_stage;
        if used > allowed {
            return Err(Error::Device(format!(
                "kernel `{}` uses {used} images, but {} allows {allowed}; use --arrays buffers",
                stage.name, device.summary.name
            )));
        }
    }
    let mut arrays = ARRAYS.iter().filter(|a| images.contains(a.name));
    arrays.try_for_each(|a| device.check_image(a.name, sizes.of(a.length) * images::texels(&layouts[a.name])))
}

fn check_memory<'a>(
    device: &Device,
    bytes: impl Iterator<Item = (&'a Array, u64)> + Clone,
    images: &HashSet<&'static str>,
) -> Result<()> {
    let limit = device.summary.max_array_bytes;
    let total: u64 = bytes.clone().map(|(_, b)| b).sum();
    let mut buffers = bytes.filter(|(array, _)| !images.contains(array.name));
    if let Some((array, need)) = buffers.find(|(_, b)| *b > limit) {
        return Err(Error::Device(format!(
            "scene too large: array `{}` needs {need} bytes of {total} in all, but {} allows {limit} bytes per array; use \
             fewer grains or --engine cpu",
            array.name, device.summary.name
        )));
    }
    if device.software {
        memory::check_host(total)?;
    }
    Ok(())
}

impl Engine for Gpu {
    fn name(&self) -> &'static str {
        "gpu"
    }

    fn adapter(&self) -> String {
        format!("{} ({})", self.device.summary.name, self.device.summary.backend)
    }

    fn execute(&mut self, params: &Params, sequences: &[(&[Op], u32)]) -> Result<()> {
        self.dirty = true;
        let len = |array: &str| self.buffers.get(array).map_or(0, |b| b.len as u32);
        let params =
            Params { slots: len("neighbour"), history: len("history_other"), colours: len("painted"), ..*params };
        let bytes = self.params_layout.encode(1, |sink| params.put(self.dims, &mut |x| sink(x)));
        self.device.queue.write_buffer(&self.params, 0, &bytes);
        if self.times.is_some() {
            let watch = Stopwatch::new(&self.device)?;
            let mut times = self.times.take().unwrap_or_default();
            let mut ops = sequences.iter().flat_map(|(ops, times)| (0..*times).flat_map(|_| *ops));
            let done = match watch {
                Some(watch) => self.time(&watch, &mut ops, &mut times),
                None => self.time_from_host(&mut ops, &mut times),
            };
            self.times = Some(times);
            return done;
        }
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        for (ops, times) in sequences {
            self.encode(&mut encoder, ops, *times, None);
        }
        self.device.queue.submit([encoder.finish()]);
        Ok(())
    }

    fn counters(&mut self) -> Result<Counters> {
        self.device.check()?;
        let layout = &self.layouts["counters"];
        let bytes = self.fetch(&self.buffers["counters"], layout)?;
        Ok(Counters::take(self.dims, &mut layout.decode(&bytes)))
    }

    fn resize(&mut self, array: &'static str, len: usize) -> Result<()> {
        let layout = self.layouts.get(array);
        let format = layout.filter(|_| self.images.contains(array)).and_then(images::format);
        let memory = if let (Some(layout), Some(format)) = (layout, format) {
            let image = self.device.image(array, len * images::texels(layout), format)?;
            let view = image.create_view(&Default::default());
            Memory::Image(image, view)
        } else {
            let stride = layout.map_or(4, |l| l.stride);
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
            Memory::Buffer(self.device.buffer(array, (len * stride) as u64, usage)?)
        };
        self.serial += 1;
        let old = self.buffers.insert(array, Buffer { memory, serial: self.serial, len });
        if let Some(old) = old {
            self.forget_groups(old.serial);
        }
        Ok(())
    }

    fn write(&mut self, arrays: &[&'static str], state: &State) -> Result<()> {
        for array in arrays {
            let column = state.column(array);
            if self.buffers[array].len != column.len() {
                self.resize(array, column.len())?;
            }
            let Some(layout) = self.layouts.get(array) else { continue };
            let mut zero = true;
            column.lanes(self.dims, &mut |x| zero &= x == 0.0);
            if zero && !self.dirty {
                continue; // new buffers are zero
            }
            let bytes = layout.encode(column.len(), |sink| column.lanes(self.dims, sink));
            match &self.buffers[array].memory {
                Memory::Buffer(buffer) => self.device.queue.write_buffer(buffer, 0, &bytes),
                Memory::Image(image, _) => self.device.write_image(image, bytes),
            }
        }
        Ok(())
    }

    fn read(&mut self, arrays: &[&'static str], state: &mut State) -> Result<()> {
        for array in arrays {
            let (Some(layout), Some(buffer)) = (self.layouts.get(array), self.buffers.get(array)) else { continue };
            let bytes = self.fetch(buffer, layout)?;
            let column: &mut dyn Column = state.column_mut(array);
            column.resize(buffer.len);
            column.fill(self.dims, &mut layout.decode(&bytes));
        }
        Ok(())
    }

    fn times(&mut self) -> &mut Option<Times> {
        &mut self.times
    }

    fn clock(&self) -> &'static str {
        if self.device.summary.timestamps { "device" } else { "host, around submission and wait" }
    }

    fn stride(&self, array: &str) -> usize {
        self.layouts.get(array).map_or(4, |l| l.stride)
    }

    fn gpu(&self) -> Option<&Gpu> {
        Some(self)
    }
}
