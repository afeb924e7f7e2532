//! The kernels of a model, composed, and how its arrays lie as they see them.

use crate::{
    error::{Error, Result},
    gpu::{Binding, Layout, Placement, Program, compose, images},
    model::{Model, Precision},
    plans::Plans,
    shaders,
    stage::Stage,
    state::{ARRAYS, Array, Element, Params, Sizes, State},
};
use std::collections::HashMap;

/// How the arrays of a model, and `params`, lie on a device.
#[derive(Clone)]
pub struct Layouts {
    pub params: Layout,
    arrays: HashMap<&'static Array, Layout>,
}

impl Layouts {
    /// How an array's elements lie, if kernels use it.
    pub fn of(&self, array: &Array) -> Option<&Layout> {
        self.arrays.get(array)
    }

    /// Texels of an element, if it is one of an image.
    pub fn texels(&self, array: &Array) -> usize {
        self.of(array).map_or(1, images::texels)
    }

    /// Bytes from one element of an array to the next.
    pub fn stride(&self, array: &'static Array) -> usize {
        self.arrays.get(array).map_or(4, |l| l.stride)
    }
}

/// The kernels of stages, composed for a model.
pub fn programs(model: &Model, stages: &[&Stage]) -> Result<Vec<Program>> {
    programs_with(model, stages, &HashMap::new())
}

/// The same with arrays where they are to lie.
pub fn programs_with(
    model: &Model,
    stages: &[&Stage],
    placements: &HashMap<&'static Array, Placement>,
) -> Result<Vec<Program>> {
    let shared: Vec<_> = model.files().into_iter().map(shaders::file).collect();
    let kernels = stages.iter().map(|stage| (stage.kernel, shaders::file(&stage.file())));
    let placement = |k: usize, binding: &Binding| {
        stages[k].array(&binding.name).and_then(|array| placements.get(array)).copied().unwrap_or_default()
    };
    compose(&shared, &kernels.collect::<Vec<_>>(), placement)
}

/// Layout of every array that the stages of a model touch, and of `params`, read from the composed kernels.
///
/// # Errors
/// [`Error::Shader`] if a kernel does not compose, or if a struct differs between Rust and WGSL.
pub fn layouts(model: &Model, plans: &Plans) -> Result<Layouts> {
    let stages = plans.stages();
    let programs = programs(model, &stages)?;
    layouts_of(model.dims(), &stages.into_iter().zip(programs).collect::<Vec<_>>())
}

pub fn layouts_of(dims: usize, programs: &[(&'static Stage, Program)]) -> Result<Layouts> {
    let (mut arrays, mut params) = (HashMap::new(), None);
    let empty = State::new(Model::all(Precision::Single)[0], Sizes::default(), Params::default());
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
pub fn bound(stage: &Stage, name: &str) -> Result<Option<&'static Array>> {
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

/// Bytes of each array the model needs, from the layouts of its kernels.
pub fn bytes<'a>(
    model: &'a Model,
    layouts: &'a Layouts,
    sizes: &'a Sizes,
) -> impl Iterator<Item = (&'static Array, u64)> + Clone + 'a {
    let needed = ARRAYS.iter().filter(|a| (a.needed)(model));
    needed.map(|array| (*array, (sizes.of(array.length) * layouts.stride(array)) as u64))
}
