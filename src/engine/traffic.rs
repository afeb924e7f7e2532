//! Bytes that a stage has to move, counted from what its kernel is seen to read and to write.

use super::gpu::program;
use crate::{
    error::Result,
    kernels::Stage,
    model::Model,
    state::{Array, Sizes},
};

/// Bytes of one run of a stage on arrays of these sizes: each array it reads once, and each that it writes once more.
///
/// # Errors
/// [`crate::Error::Shader`] if the kernel does not compose.
pub fn bytes(model: &Model, stage: &Stage, sizes: &Sizes, stride: impl Fn(&str) -> usize) -> Result<u64> {
    let program = program(model, stage)?;
    let arrays = program.bindings.iter().filter(|b| !b.uniform);
    let of = |array: &Array| sizes.of(array.length) * stride(array.name);
    let moved = arrays.map(|b| (usize::from(b.read) + usize::from(b.written)) * of(Array::named(stage.array(&b.name))));
    Ok(moved.sum::<usize>() as u64)
}
