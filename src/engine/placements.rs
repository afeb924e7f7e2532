//! Which arrays of a model lie where on a device.

use super::gpu::Layouts;
use crate::{
    error::{Error, Result},
    gpu::{Arrays, Binding, Device, Parts, Placement, Program, images},
    plan::Op,
    plans::Plans,
    stage::Stage,
    state::{ARRAYS, Array, Length, Sizes},
};
use std::collections::{HashMap, HashSet};

/// What kernels, and the plan, could do with arrays elsewhere than in a buffer of their own.
#[derive(Clone)]
pub struct Possible {
    images: HashSet<&'static Array>,
    parts: HashSet<&'static Array>,
    packed: HashSet<&'static Array>,
    /// Most storage buffers of a kernel, if each array has its own.
    storage_buffers: u32,
}

/// Any number of parts is as good.
const IN_PARTS: Placement = Placement::Parts(Parts { count: 2, shift: 0 });

impl Possible {
    /// With kernels that are composed for an array per buffer. Arrays can be exchanged only if they lie alike, so what is
    /// now and what comes next go together.
    pub fn of(plans: &Plans, programs: &[(&'static Stage, Program)]) -> Possible {
        let mut bindings: HashMap<&str, Vec<&Binding>> = HashMap::new();
        for (stage, program) in programs {
            for binding in &program.bindings {
                let Some(array) = stage.array(&binding.name) else { continue };
                bindings.entry(array.original()).or_default().push(binding);
            }
        }
        let used = |array: &Array| bindings.get(array.original());
        let all = |placement: Placement| {
            let possible = |a: &&'static Array| used(a).is_some_and(|all| all.iter().all(|b| placement.is_possible(b)));
            ARRAYS.iter().copied().filter(possible).collect::<HashSet<_>>()
        };
        let ops = plans.ops();
        let cleared: HashSet<&str> =
            ops.iter().filter_map(|op| if let Op::Clear(array) = op { Some(array.original()) } else { None }).collect();
        let mut images = all(Placement::Image);
        images.retain(|array| !cleared.contains(array.original()));
        let buffers = |program: &Program| program.bindings.iter().filter(|b| b.resource.is_storage_buffer()).count();
        Possible {
            images,
            parts: all(IN_PARTS),
            packed: all(Placement::Packed),
            storage_buffers: programs.iter().map(|(_, p)| buffers(p) as u32).max().unwrap_or(0),
        }
    }

    /// Where the arrays are to lie on a device.
    ///
    /// # Errors
    /// [`Error::Device`] if images are asked for that it cannot have.
    pub fn choose(
        &self,
        device: &Device,
        programs: &[(&'static Stage, Program)],
        layouts: &Layouts,
        sizes: &Sizes,
    ) -> Result<HashMap<&'static Array, Placement>> {
        let all = |arrays: &HashSet<&'static Array>, placement| arrays.iter().map(|a| (*a, placement)).collect();
        let images = || {
            fit(device, programs, layouts, &self.images, sizes)?;
            Ok(all(&self.images, Placement::Image))
        };
        let few = self.storage_buffers > device.summary.max_arrays;
        let mut placements: HashMap<&'static Array, Placement> = match device.options.arrays {
            Arrays::Buffers => HashMap::new(),
            Arrays::Images => images()?,
            Arrays::Packed => all(&self.packed, Placement::Packed),
            Arrays::Auto => match device.images.then(images) {
                Some(Ok(placements)) => placements,
                _ if few => all(&self.packed, Placement::Packed),
                _ => HashMap::new(),
            },
        };
        for array in ARRAYS {
            if let Some(placement) = self.in_parts(device, layouts, array, sizes.of(array.length), &placements) {
                placements.insert(array, placement);
            }
        }
        Ok(placements)
    }

    /// The placement of an array that is not elsewhere and would be too long for a buffer.
    fn in_parts(
        &self,
        device: &Device,
        layouts: &Layouts,
        array: &'static Array,
        len: usize,
        placements: &HashMap<&'static Array, Placement>,
    ) -> Option<Placement> {
        let parts = Parts::of(len, layouts.stride(array), device.summary.max_array_bytes)?;
        match placements.get(array).copied().unwrap_or_default() {
            Placement::Buffer if self.parts.contains(array) => Some(Placement::Parts(parts)),
            Placement::Parts(known) if known.count < parts.count => Some(Placement::Parts(parts)),
            _ => None,
        }
    }

    /// Those of arrays of a kind of length that have to change, if they become so long.
    pub fn changes(
        &self,
        device: &Device,
        layouts: &Layouts,
        kind: Length,
        len: usize,
        placements: &HashMap<&'static Array, Placement>,
    ) -> Vec<(&'static Array, Placement)> {
        let of_kind = ARRAYS.iter().filter(|array| array.length == kind);
        of_kind.filter_map(|array| Some((*array, self.in_parts(device, layouts, array, len, placements)?))).collect()
    }
}

/// Whether a device has room for these arrays as images.
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
    arrays.try_for_each(|a| {
        let texels = layouts.of(a).map_or(0, images::texels);
        device.check_image(a.name, sizes.of(a.length) * texels)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        engine::gpu::{programs, programs_with},
        model::{Grains, Model, Precision},
    };

    /// WebGPU's default for kernels.
    const STORAGE_BUFFERS: usize = 8;

    #[test]
    fn packed_kernels_of_spheres_run_where_few_buffers_are_allowed() {
        for model in Model::all(Precision::Single).into_iter().filter(|m| m.grains == Grains::Spheres) {
            let plans = Plans::new(&model);
            let stages = plans.stages();
            let plain: Vec<_> = stages.iter().copied().zip(programs(&model, &stages).unwrap()).collect();
            let possible = Possible::of(&plans, &plain);
            let packed = possible.packed.iter().map(|a| (*a, Placement::Packed)).collect();
            for (stage, program) in stages.iter().zip(programs_with(&model, &stages, &packed).unwrap()) {
                let bound: Vec<_> =
                    program.bindings.iter().filter(|b| b.resource.is_storage_buffer()).map(|b| &b.name).collect();
                println!("{} {}", bound.len(), stage.name);
                assert!(bound.len() <= STORAGE_BUFFERS, "{model:?}, {}: {bound:?}", stage.name);
            }
        }
    }
}
