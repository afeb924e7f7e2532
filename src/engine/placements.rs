//! Which arrays of a model lie where on a device.

use super::{
    aliases::{Aliases, Choice},
    arrays::DeviceArrays,
    liveness::Liveness,
    programs::{Layouts, layouts_of, programs},
};
use crate::{
    error::{Error, Result},
    gpu::{Arrays, Binding, Device, Pack, Parts, Placement, Program},
    model::Model,
    plan::Op,
    plans::Plans,
    stage::Stage,
    state::{ARRAYS, Array, Sizes, present},
};
use std::collections::{HashMap, HashSet};

/// What kernels, and the plan, could do with arrays elsewhere than in a buffer of their own.
#[derive(Clone)]
pub struct Possible {
    images: HashSet<&'static Array>,
    parts: HashSet<&'static Array>,
    packed: HashSet<&'static Array>,
    /// The arrays of each kernel.
    kernels: Vec<(&'static Stage, Vec<&'static Array>)>,
    /// None: no arrays lie in the memory of others.
    pub liveness: Option<Liveness>,
}

/// Where arrays lie, and those of them that lie in the memory of others.
pub type Places = (HashMap<&'static Array, Placement>, Aliases);

/// How arrays lie, and which in the memory of others, where every array is a buffer as long as it likes.
///
/// # Errors
/// As [`layouts_of`].
pub fn layouts_and_aliases(model: &Model, plans: &Plans, sizes: &Sizes) -> Result<(Layouts, Aliases)> {
    let stages = plans.stages();
    let programs: Vec<_> = stages.iter().copied().zip(programs(model, &stages)?).collect();
    let layouts = layouts_of(model.dims(), &programs)?;
    let (mut placements, mut aliases) = (HashMap::new(), Aliases::new());
    let possible = Possible::of(plans, &programs);
    possible.share(model, &layouts, usize::MAX, (&present(model, ARRAYS), sizes), (&mut placements, &mut aliases));
    Ok((layouts, aliases))
}

/// Any number of parts is as good.
const IN_PARTS: Placement = Placement::Parts(Parts { count: 2, len: 1 });

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
        let arrays = |(stage, program): &(&'static Stage, Program)| {
            (*stage, program.bindings.iter().filter_map(|b| stage.array(&b.name)).collect())
        };
        Possible {
            images,
            parts: all(IN_PARTS),
            packed: all(Placement::Packed),
            kernels: programs.iter().map(arrays).collect(),
            liveness: Some(Liveness::of(plans, programs)),
        }
    }

    /// Where the arrays are to lie on a device.
    ///
    /// # Errors
    /// [`Error::Lacking`] if images, or more buffers, are asked for than it can have.
    pub fn choose(
        &self,
        device: &Device,
        model: &Model,
        programs: &[(&'static Stage, Program)],
        layouts: &Layouts,
        sizes: &Sizes,
    ) -> Result<Places> {
        let all = |arrays: &HashSet<&'static Array>, placement| arrays.iter().map(|a| (*a, placement)).collect();
        let images = || {
            check_images(device, programs, &self.images)?;
            Ok(all(&self.images, Placement::Image))
        };
        let (needed, allowed) = (self.most_buffers(&HashMap::new()).1 as u32, device.summary.max_arrays);
        if needed > allowed && device.options.arrays == Arrays::Buffers {
            return Err(Error::Lacking(format!(
                "kernels need up to {needed} storage buffers, but {} allows {allowed}; use --arrays packed",
                device.summary.name
            )));
        }
        let mut placements: HashMap<&'static Array, Placement> = match device.options.arrays {
            Arrays::Buffers => HashMap::new(),
            Arrays::Images => images()?,
            Arrays::Packed => all(&self.packed, Placement::Packed),
            Arrays::Auto if needed > allowed => all(&self.packed, Placement::Packed),
            Arrays::Auto => device.images.then(images).and_then(Result::ok).unwrap_or_default(),
        };
        for array in ARRAYS {
            let known = placements.get(array).copied().unwrap_or_default();
            placements.insert(array, self.suited(device, layouts, array, sizes.of(array.length), known));
        }
        let (kernel, needed) = self.most_buffers(&placements);
        if needed > allowed as usize {
            return Err(Error::Lacking(format!(
                "kernel `{kernel}` needs {needed} storage buffers of at most {} bytes, but {} allows {allowed}; use fewer \
                 grains or --engine cpu",
                device.summary.max_array_bytes, device.summary.name
            )));
        }
        let mut aliases = Aliases::new();
        let arrays = present(model, ARRAYS);
        self.share(model, layouts, allowed as usize, (&arrays, sizes), (&mut placements, &mut aliases));
        Ok((placements, aliases))
    }

    /// Let arrays lie in the memory of others if that is possible, and kernels have so many buffers at most.
    fn share(
        &self,
        model: &Model,
        layouts: &Layouts,
        most_buffers: usize,
        (arrays, sizes): (&[&'static Array], &Sizes),
        (placements, aliases): (&mut HashMap<&'static Array, Placement>, &mut Aliases),
    ) {
        let spare_buffers = most_buffers.saturating_sub(self.most_buffers(placements).1);
        if let Some(liveness) = &self.liveness {
            let choice = Choice { model, liveness, layouts, parts: &self.parts, spare_buffers };
            choice.make(arrays, sizes, placements, aliases);
        }
    }

    /// Where arrays are to lie that get this length: none of them is an alias any more that its room is too small for.
    pub fn moved(
        &self,
        device: &Device,
        model: &Model,
        arrays: &DeviceArrays,
        resized: &[&'static Array],
        (len, sizes): (usize, &Sizes),
    ) -> Places {
        let (mut placements, mut aliases) = (arrays.placements().clone(), arrays.aliases().clone());
        let leaving: Vec<_> = resized.iter().copied().filter(|array| !arrays.has_room(array, len)).collect();
        for &array in &leaving {
            let known = if aliases.remove(array).is_some() { Placement::Buffer } else { placements[array] };
            placements.insert(array, self.suited(device, arrays.layouts(), array, len, known));
        }
        let most_buffers = device.summary.max_arrays as usize;
        self.share(model, arrays.layouts(), most_buffers, (&leaving, sizes), (&mut placements, &mut aliases));
        (placements, aliases)
    }

    /// The kernel that needs most storage buffers with arrays where they lie, and how many.
    fn most_buffers(&self, placements: &HashMap<&'static Array, Placement>) -> (&'static str, usize) {
        let buffers = |array: &&'static Array| match placements.get(array).copied().unwrap_or_default() {
            Placement::Image | Placement::Packed => 0,
            Placement::Buffer => 1,
            Placement::Parts(parts) => parts.count,
        };
        let packs = if placements.values().any(|p| *p == Placement::Packed) { Pack::ALL.len() } else { 0 };
        let of_kernel = |(stage, arrays): &(&'static Stage, Vec<&'static Array>)| {
            (stage.name, packs + arrays.iter().map(buffers).sum::<usize>())
        };
        self.kernels.iter().map(of_kernel).max_by_key(|(_, buffers)| *buffers).unwrap_or(("", 0))
    }

    /// Where an array can lie that would be too long for where it lies now.
    pub fn suited(
        &self,
        device: &Device,
        layouts: &Layouts,
        array: &'static Array,
        len: usize,
        known: Placement,
    ) -> Placement {
        let parts = Parts::of(len, layouts.stride(array), device.summary.max_array_bytes);
        match (known, parts) {
            (Placement::Packed, _) => known,
            (Placement::Image, _) if device.check_image(array.name, len * layouts.texels(array)).is_ok() => known,
            (Placement::Parts(present), needed) if needed.is_none_or(|needed| needed.count <= present.count) => known,
            (_, Some(needed)) if self.parts.contains(array) => Placement::Parts(needed),
            _ => Placement::Buffer,
        }
    }
}

/// Whether a device allows so many images.
fn check_images(
    device: &Device,
    programs: &[(&'static Stage, Program)],
    images: &HashSet<&'static Array>,
) -> Result<()> {
    let allowed = device.device.limits().max_storage_textures_per_shader_stage;
    for (stage, program) in programs {
        let is_image = |b: &&Binding| stage.array(&b.name).is_some_and(|a| images.contains(a));
        let used = program.bindings.iter().filter(is_image).count() as u32;
        if used > allowed {
            return Err(Error::Lacking(format!(
                "kernel `{}` uses {used} images, but {} allows {allowed}; use --arrays buffers",
                stage.name, device.summary.name
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        engine::{aliases::total, programs::programs_with},
        model::{Boundary, Dimension, Grains, Levels, Materials, Model, Normal, Precision, Rolling, Tangential, Walls},
        state::{Length, present},
    };

    /// WebGPU's default for kernels.
    const STORAGE_BUFFERS: usize = 8;

    fn has_most_arrays(m: &Model) -> bool {
        let bounded = m.boundary == Boundary::Periodic && m.walls == Walls::Some;
        bounded && m.dimension == Dimension::Space && m.materials == Materials::Many
    }

    /// What has to lie in one buffer of 2^31 - 1 bytes at most is so short that memory ends first.
    #[test]
    fn long_arrays_can_lie_in_parts() {
        for model in Model::all(Precision::Single).into_iter().filter(has_most_arrays) {
            let plans = Plans::new(&model);
            let stages = plans.stages();
            let programs: Vec<_> = stages.iter().copied().zip(programs(&model, &stages).unwrap()).collect();
            let layouts = layouts_of(model.dims(), &programs).unwrap();
            let possible = Possible::of(&plans, &programs);
            let whole = present(&model, ARRAYS).into_iter().filter(|a| !possible.parts.contains(a));
            for array in whole.filter(|array| layouts.of(array).is_some()) {
                let listed = matches!(array.length, Length::Entries | Length::History | Length::Contacts);
                assert!(!listed, "{model:?}: {array:?}");
                let of_grains = !matches!(array.length, Length::One | Length::Walls | Length::Groups);
                assert!(!of_grains || layouts.stride(array) <= 8, "{model:?}: {array:?}");
            }
        }
    }

    #[test]
    fn packed_kernels_of_spheres_run_where_few_buffers_are_allowed() {
        let spheres = |m: &Model| m.grains == Grains::Spheres && has_most_arrays(m);
        for model in Model::all(Precision::Single).into_iter().filter(spheres) {
            let plans = Plans::new(&model);
            let stages = plans.stages();
            let plain: Vec<_> = stages.iter().copied().zip(programs(&model, &stages).unwrap()).collect();
            let possible = Possible::of(&plans, &plain);
            let packed = possible.packed.iter().map(|a| (*a, Placement::Packed)).collect();
            for (stage, program) in stages.iter().zip(programs_with(&model, &stages, &packed).unwrap()) {
                let bound: Vec<_> =
                    program.bindings.iter().filter(|b| b.resource.is_storage_buffer()).map(|b| &b.name).collect();
                assert!(bound.len() <= STORAGE_BUFFERS, "{model:?}, {}: {bound:?}", stage.name);
            }
        }
    }

    /// In rooms of which each is a part of another array, since none of them may be longer than kernels can see.
    #[test]
    fn aliases_fit_where_arrays_are_in_parts() {
        const LIMIT: u64 = (1 << 31) - 1;
        let rough = |m: &Model| {
            let spheres = m.grains == Grains::Spheres && m.levels == Levels::One;
            let remembers = (m.normal, m.tangential, m.rolling) == (Normal::Hooke, Tangential::Coulomb, Rolling::None);
            has_most_arrays(m) && spheres && remembers
        };
        let model = Model::all(Precision::Single).into_iter().find(rough).unwrap();
        let model = Model { works: false, ..model };
        let plans = Plans::new(&model);
        let stages = plans.stages();
        let programs: Vec<_> = stages.iter().copied().zip(programs(&model, &stages).unwrap()).collect();
        let layouts = layouts_of(model.dims(), &programs).unwrap();
        let possible = Possible::of(&plans, &programs);
        let sizes = Sizes { slice_shift: 5, walls: 5, materials: 2, levels: 1, ..Sizes::default() };
        let (bodies, cells, entries) = (400_000_000, 300_000_000, 2_400_000_000);
        let sizes = Sizes { bodies, cells, entries, history: entries / 2, ..sizes };
        let in_parts = possible.parts.iter().filter_map(|array| {
            let parts = Parts::of(sizes.of(array.length), layouts.stride(array), LIMIT)?;
            Some((*array, Placement::Parts(parts)))
        });
        let (mut placements, mut aliases): (HashMap<_, _>, _) = (in_parts.collect(), Aliases::new());
        let arrays = present(&model, ARRAYS);
        possible.share(&model, &layouts, 1000, (&arrays, &sizes), (&mut placements, &mut aliases));
        let parts_of = |array: &Array| match placements.get(array) {
            Some(Placement::Parts(parts)) => *parts,
            _ => Parts::ONE,
        };
        let bytes = |array: &'static Array, part| {
            parts_of(array).len(part, sizes.of(array.length)) as u64 * layouts.stride(array) as u64
        };
        assert!(
            aliases.values().any(|rooms| rooms.len() > 10 && rooms.iter().any(|room| room.part > 0)),
            "{aliases:?}"
        );
        for (alias, rooms) in &aliases {
            let parts = parts_of(alias);
            assert!(parts.len.saturating_mul(rooms.len()) >= sizes.of(alias.length), "{alias:?}: {parts:?}");
            for (part, room) in rooms.iter().enumerate() {
                assert!(bytes(alias, part) <= bytes(room.host, room.part), "{alias:?} {part} in {room:?}");
                let lodgers = aliases.iter().filter(|(other, rooms)| *other != alias && rooms.contains(room));
                assert!(
                    lodgers.into_iter().all(|(other, _)| possible.liveness.as_ref().unwrap().are_apart(alias, other)),
                    "{room:?}"
                );
            }
        }
        // The start of the history, of which kernels ask how long it is, fits into no part.
        let total = total(&model, &layouts, &aliases, &sizes) / bodies as u64;
        assert!((282..=292).contains(&total), "{total} bytes per sphere: {aliases:#?}");
    }
}
