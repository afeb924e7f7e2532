//! Bytes that a stage has to move, counted from what its kernel is seen to read and to write.

use super::programs::programs;
use crate::{
    error::Result,
    model::Model,
    stage::Stage,
    state::{Array, Sizes},
};

/// Bytes of one run of a stage on arrays of these sizes: each array it reads once, and each that it writes once more.
///
/// # Errors
/// [`crate::Error::Shader`] if the kernel does not compose.
pub fn bytes(model: &Model, stage: &Stage, sizes: &Sizes, stride: impl Fn(&'static Array) -> usize) -> Result<u64> {
    let programs = programs(model, &[stage])?;
    let bindings = programs.iter().flat_map(|program| &program.bindings);
    let arrays = bindings.filter_map(|b| Some((b, stage.array(&b.name)?)));
    let of = |array: &'static Array| sizes.of(array.length) * stride(array);
    let moved = arrays.map(|(b, array)| (usize::from(b.read) + usize::from(b.written)) * of(array));
    Ok(moved.sum::<usize>() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        dem::ADVANCE,
        engine::programs::layouts,
        model::Precision,
        plans::Plans,
        scene::Scene,
        state::{Params, State},
    };
    use std::path::Path;

    fn model(friction: f64, dimension: usize, precision: Precision) -> Model {
        let text = format!(
            "dimension = {dimension}\ngravity = [0, 0{}]\n[material.glass]\ndensity = 1\nnormal_stiffness = 1\n\
             friction = {friction}\n[[grain]]\nposition = [0, 0{}]\nradius = 1\nmaterial = \"glass\"\n[stop]\ntime = 1\n",
            if dimension == 2 { "" } else { ", 0" },
            if dimension == 2 { "" } else { ", 0" },
        );
        Model::of(&Scene::parse(&text, "two", Path::new("."), &[]).unwrap().assemble().unwrap(), precision)
    }

    /// Ten grains with 60 list entries and the numbers that all share: list_start has one more, `halt` is read,
    /// `halt_next` and the ten counters are read and written.
    fn advance(per_grain: u64, per_entry: u64) -> u64 {
        10 * per_grain + 60 * per_entry + 4 + (4 + 2 * 4) + 2 * 10 * 4
    }

    #[test]
    fn advance_moves_what_is_counted_by_hand() {
        let sizes = Sizes { bodies: 10, entries: 60, ..Sizes::default() };
        let on_device = |model: &Model| {
            let layouts = layouts(model, &Plans::new(model)).unwrap();
            bytes(model, &ADVANCE, &sizes, |array| layouts.stride(array)).unwrap()
        };
        // Smooth disks, f32: position and velocity, each with its low part, of 16 bytes read and written, displacement too, id and
        // list_start read; neighbour read.
        assert_eq!(on_device(&model(0.0, 2, Precision::Single)), advance(2 * (4 * 16 + 4) + 4 + 4, 4));
        // Rough spheres, f32: a spin besides; neighbour and a history of 12 bytes read and written.
        assert_eq!(on_device(&model(0.5, 3, Precision::Single)), advance(2 * (5 * 16 + 4) + 4 + 4, 2 * (4 + 12)));
        // Smooth disks on the host: position and velocity of 32 bytes.
        let model = model(0.0, 2, Precision::Double);
        let state = State::new(model, sizes, Params::default());
        let on_host = bytes(&model, &ADVANCE, &sizes, |array| state.column(array).stride()).unwrap();
        assert_eq!(on_host, advance(2 * (2 * 32 + 8) + 4 + 4, 4));
    }
}
