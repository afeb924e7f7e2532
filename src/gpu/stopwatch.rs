//! Times of compute passes by the device's own clock.

use super::Device;
use crate::error::Result;
use wgpu::{BufferUsages, CommandEncoder, ComputePassTimestampWrites, QUERY_SIZE, QuerySet};

/// Times passes: each is begun with what [`Stopwatch::pass`] gives, and all are read at once.
pub struct Stopwatch {
    /// Beginning and end of each pass.
    queries: QuerySet,
    ticks: wgpu::Buffer,
}

impl Stopwatch {
    /// Passes that one stopwatch can time.
    pub const PASSES: usize = wgpu::QUERY_SET_MAX_QUERIES as usize / 2;

    /// None if the device has no timestamps.
    ///
    /// # Errors
    /// [`crate::Error::Lacking`] if there is no memory for the times.
    pub fn new(device: &Device) -> Result<Option<Stopwatch>> {
        if !device.summary.timestamps {
            return Ok(None);
        }
        let count = 2 * Stopwatch::PASSES as u32;
        let queries = device.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("stopwatch"),
            ty: wgpu::QueryType::Timestamp,
            count,
        });
        let usage = BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC;
        let ticks = device.buffer("stopwatch", u64::from(count * QUERY_SIZE), usage)?;
        Ok(Some(Stopwatch { queries, ticks }))
    }

    /// What the pass of this number begins with.
    pub fn pass(&self, number: usize) -> ComputePassTimestampWrites<'_> {
        ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * number as u32),
            end_of_pass_write_index: Some(2 * number as u32 + 1),
        }
    }

    /// Submit the commands, wait, and say how long each of the first passes took, s.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device does not answer.
    pub fn read(&self, device: &Device, mut encoder: CommandEncoder, passes: usize) -> Result<Vec<f64>> {
        let count = 2 * passes as u32;
        if count == 0 {
            device.submit(encoder);
            return Ok(Vec::new());
        }
        encoder.resolve_query_set(&self.queries, 0..count, &self.ticks, 0);
        device.submit(encoder);
        let bytes = device.read(&self.ticks, 0, u64::from(count * QUERY_SIZE))?;
        let tick = |b: &[u8]| u64::from_ne_bytes(b.try_into().expect("eight bytes"));
        let seconds = 1e-9 * f64::from(device.queue.get_timestamp_period());
        let (pairs, size) = (bytes.chunks_exact(2 * QUERY_SIZE as usize), QUERY_SIZE as usize);
        Ok(pairs.map(|pair| seconds * tick(&pair[size..]).saturating_sub(tick(&pair[..size])) as f64).collect())
    }
}
