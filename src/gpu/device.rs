//! Adapters and devices.

use super::{
    adapters::{AdapterSummary, best, candidates, is_software, selected, summary},
    checks::Checks,
    images::ROW,
    restrictions::Restrictions,
};
use crate::error::{Error, Result};
use std::{
    ops::Range,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};
use wgpu::{Features, TextureUsages};

/// What arrays are on a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Arrays {
    /// Images on software drivers that are faster with them; packed where kernels may not see as many buffers as they
    /// have arrays; otherwise buffers.
    #[default]
    Auto,
    /// A storage buffer each; several where one would be longer than a kernel may see.
    Buffers,
    /// Storage images where the kernels allow it; on software drivers only.
    Images,
    /// In two storage buffers that all share, where the kernels allow it; with checks, indices are held within these.
    Packed,
}

/// How to open a device.
#[derive(Clone, Copy, Debug, Default)]
pub struct DeviceOptions {
    /// f64 in kernels.
    pub double: bool,
    /// What arrays may be; images only in as far as the kernels and the limits allow.
    pub arrays: Arrays,
    /// Of all kernels.
    pub checks: Checks,
    /// What the adapter is taken not to have.
    pub restrictions: Restrictions,
}

/// An open device; a clone is the same one.
#[derive(Clone)]
pub struct Device {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub summary: AdapterSummary,
    /// Runs on the host's processor and memory.
    pub software: bool,
    /// Whether it is the one that was asked for by [`select`](super::select).
    pub selected: bool,
    /// Better adapters, which have no f64.
    pub passed_over: Vec<String>,
    /// How it was opened.
    pub options: DeviceOptions,
    /// Whether kernels may have images, and should where the options leave it open.
    pub images: bool,
    /// The first error nobody was waiting for. wgpu's device knows this, so nothing here may know wgpu's device.
    failure: Arc<Mutex<Option<String>>>,
    shared: Arc<Shared>,
}

/// What all clones of a device have together.
#[derive(Default)]
struct Shared {
    /// Where small reads arrive, so that a run makes no buffer from chunk to chunk.
    staging: Mutex<Option<wgpu::Buffer>>,
    submissions: AtomicU64,
    /// Time spent in [`Device::submit`] and in [`Device::wait`], ns.
    submitting: AtomicU64,
    waiting: AtomicU64,
}

/// Add the time since then.
fn count(to: &AtomicU64, since: Instant) {
    to.fetch_add(since.elapsed().as_nanos() as u64, Ordering::Relaxed);
}

/// Reads up to this many bytes share a buffer.
const KEPT_STAGING: u64 = 1 << 16;

/// Whether loads from buffers are slow: lavapipe's are a loop over lanes before Mesa 25, and with images the published
/// bed steps about twice as fast; from then on buffers are as fast.
fn loads_lane_by_lane(driver: &str) -> bool {
    let version = driver.split_once("Mesa ").and_then(|(_, version)| version.split('.').next()?.parse::<u32>().ok());
    version.is_some_and(|major| major < 25)
}

impl Device {
    /// Open the best adapter that can do what is asked.
    ///
    /// # Errors
    /// [`Error::Lacking`] if there is none, [`Error::Device`] if it cannot be opened.
    pub fn open(options: DeviceOptions) -> Result<Device> {
        let DeviceOptions { double, arrays, restrictions, .. } = options;
        let all = candidates();
        if all.is_empty() {
            return Err(Error::Lacking(
                "no GPU adapter found: install a Vulkan, Metal or DX12 driver (on Debian or Ubuntu, mesa-vulkan-drivers \
                 gives a software one), or use --engine cpu"
                    .to_owned(),
            ));
        }
        let wanted = Features::SHADER_F64;
        let mut summaries: Vec<_> = all.iter().map(|adapter| summary(adapter, &restrictions)).collect();
        let names = |of: &[AdapterSummary]| of.iter().map(|a| a.name.clone()).collect::<Vec<_>>();
        let number = best(&summaries, double).ok_or_else(|| {
            Error::Lacking(format!(
                "--precision double needs the feature SHADER_F64, which no adapter has ({}); use --precision single or \
                 --engine cpu",
                names(&summaries).join(", ")
            ))
        })?;
        let (adapter, passed_over) = (&all[number], names(&summaries[..number]));
        let (summary, software) = (summaries.swap_remove(number), is_software(adapter));
        let wide = Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES;
        // Only Vulkan promises that an invocation reads back what it wrote to an image, and only on software drivers do
        // barriers of buffers hold for images too.
        let vulkan = adapter.get_info().backend == wgpu::Backend::Vulkan;
        let able = software && vulkan && adapter.features().contains(wide);
        let images = match arrays {
            Arrays::Auto => able && loads_lane_by_lane(&summary.driver),
            Arrays::Images if !able => {
                let message = format!("{} has no images for arrays; use --arrays buffers", summary.name);
                return Err(Error::Lacking(message));
            }
            other => other == Arrays::Images,
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("packstone"),
            required_features: [(double, wanted), (images, wide), (summary.timestamps, Features::TIMESTAMP_QUERY)]
                .into_iter()
                .filter(|(needed, _)| *needed)
                .fold(Features::empty(), |all, (_, feature)| all | feature),
            required_limits: restrictions.limits(adapter.limits()),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| Error::Device(format!("{} cannot be opened: {e}", summary.name)))?;
        let failure = Arc::new(Mutex::new(None));
        let first = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            if let Ok(mut slot) = first.lock() {
                slot.get_or_insert_with(|| e.to_string());
            }
        }));
        // Calls to a lost device fail without a word, or with errors that come of it.
        let lost = Arc::clone(&failure);
        device.set_device_lost_callback(move |_, why| {
            if let Ok(mut slot) = lost.lock() {
                *slot = Some(format!("the device is lost {why}").trim_end().to_owned());
            }
        });
        let shared = Arc::default();
        let selected = selected().is_some();
        Ok(Device { device, queue, summary, software, selected, passed_over, options, images, failure, shared })
    }

    /// Create a buffer of zeros.
    ///
    /// # Errors
    /// [`Error::Lacking`] with the number of bytes if it exceeds a limit or the memory of the device.
    pub fn buffer(&self, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
        if bytes > self.summary.max_array_bytes {
            return Err(Error::Lacking(format!(
                "array `{label}` needs {bytes} bytes, but {} allows {} per array; use --engine cpu",
                self.summary.name, self.summary.max_array_bytes
            )));
        }
        self.allocate(label, bytes, usage)
    }

    fn allocate(&self, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.next_multiple_of(4).max(4),
            usage,
            mapped_at_creation: false,
        });
        match pollster::block_on(scope.pop()) {
            None => Ok(buffer),
            Some(e) => {
                Err(Error::Lacking(format!("{}: no memory for `{label}`, {bytes} bytes: {e}", self.summary.name)))
            }
        }
    }

    /// Create an image of zeros, in rows of `ROW` texels.
    ///
    /// # Errors
    /// As for [`Device::buffer`].
    pub fn image(&self, label: &str, texels: usize, format: wgpu::TextureFormat) -> Result<wgpu::Texture> {
        self.check_image(label, texels)?;
        let rows = texels.div_ceil(ROW).max(1) as u32;
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let image = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: ROW as u32, height: rows, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        match pollster::block_on(scope.pop()) {
            None => Ok(image),
            Some(e) => Err(Error::Lacking(format!("{}: no memory for `{label}`: {e}", self.summary.name))),
        }
    }

    /// Whether an image may have so many texels.
    ///
    /// # Errors
    /// [`Error::Lacking`] with the number of rows if it may not.
    pub fn check_image(&self, label: &str, texels: usize) -> Result<()> {
        let (rows, most) = (texels.div_ceil(ROW), self.device.limits().max_texture_dimension_2d);
        if rows > most as usize {
            return Err(Error::Lacking(format!(
                "array `{label}` needs {rows} rows of {ROW} texels, but {} allows {most}; use fewer grains, --arrays buffers \
                 or --engine cpu",
                self.summary.name
            )));
        }
        Ok(())
    }

    /// Whether everything so far went well.
    ///
    /// # Errors
    /// [`Error::Device`] with the first error of the device.
    pub fn check(&self) -> Result<()> {
        match self.failure.lock().ok().and_then(|slot| slot.clone()) {
            None => Ok(()),
            Some(e) => Err(Error::Device(format!("{}: {e}", self.summary.name))),
        }
    }

    /// Have the device do these commands.
    pub fn submit(&self, commands: wgpu::CommandEncoder) {
        self.submit_all([commands.finish()]);
    }

    /// Have the device do these commands, one after the other.
    pub fn submit_all(&self, commands: impl IntoIterator<Item = wgpu::CommandBuffer>) {
        let before = self.shared.submissions.fetch_add(1, Ordering::Relaxed);
        if self.options.restrictions.lost_after.is_some_and(|most| before >= most) {
            self.device.destroy();
        }
        let start = Instant::now();
        self.queue.submit(commands);
        count(&self.shared.submitting, start);
    }

    /// Wait for everything submitted.
    ///
    /// # Errors
    /// [`Error::Device`] if the device is lost.
    pub fn wait(&self) -> Result<()> {
        let start = Instant::now();
        // wgpu panics where a driver reports that its device is lost.
        let done = catch_unwind(AssertUnwindSafe(|| self.device.poll(wgpu::PollType::wait_indefinitely())));
        count(&self.shared.waiting, start);
        let stopped = |why: String| Error::Device(format!("{} stopped answering: {why}", self.summary.name));
        match done {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(e)) => Err(stopped(e.to_string())),
            Err(_) => self.check().and(Err(stopped("the device is lost".to_owned()))),
        }
    }

    /// What the host has spent so far on submissions, which is when software drivers compute, and on waiting.
    pub fn spent(&self) -> [Duration; 2] {
        [&self.shared.submitting, &self.shared.waiting].map(|time| Duration::from_nanos(time.load(Ordering::Relaxed)))
    }

    /// A uniform buffer with this content, whose length is a multiple of 4.
    pub fn uniform(&self, label: &str, content: &[u8]) -> wgpu::Buffer {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: content.len() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, content);
        buffer
    }

    /// Copy so many bytes of a buffer, from `begin` on, to the host.
    pub fn read(&self, buffer: &wgpu::Buffer, begin: u64, bytes: u64) -> Result<Vec<u8>> {
        self.fetch(bytes, 0..bytes, |encoder, staging| {
            encoder.copy_buffer_to_buffer(buffer, begin, staging, 0, bytes.next_multiple_of(4));
        })
    }

    /// Copy so many bytes of an image, from `begin` on, to the host.
    ///
    /// # Errors
    /// [`Error::Lacking`] if there is no memory for the copy, [`Error::Device`] if the device is lost.
    pub fn read_image(&self, image: &wgpu::Texture, begin: u64, bytes: u64) -> Result<Vec<u8>> {
        let (layout, row) = (image_layout(image), row_bytes(image));
        // Rows as wholes: parts of them would have to be aligned.
        let rows = (begin / row) as u32..(begin + bytes).div_ceil(row) as u32;
        let begin = begin - u64::from(rows.start) * row;
        self.fetch(rows.len() as u64 * row, begin..begin + bytes, |encoder, staging| {
            let to = wgpu::TexelCopyBufferInfo { buffer: staging, layout };
            let size = wgpu::Extent3d { height: rows.len() as u32, ..image.size() };
            encoder.copy_texture_to_buffer(from_texel(image, 0, rows.start), to, size);
        })
    }

    /// Overwrite texels of an image, those from byte `begin` on.
    pub fn write_image(&self, image: &wgpu::Texture, mut begin: u64, mut bytes: &[u8]) {
        let (layout, row) = (image_layout(image), row_bytes(image));
        // What is left of a row, rows as wholes, and the beginning of one.
        while !bytes.is_empty() {
            let (in_row, len) = (begin % row, bytes.len() as u64);
            let now = if in_row > 0 || len < row { len.min(row - in_row) } else { len - len % row };
            let size = match now < row {
                true => wgpu::Extent3d { width: (now / (row / ROW as u64)) as u32, height: 1, ..image.size() },
                false => wgpu::Extent3d { height: (now / row) as u32, ..image.size() },
            };
            let texel = from_texel(image, (in_row / (row / ROW as u64)) as u32, (begin / row) as u32);
            let (piece, rest) = bytes.split_at(now as usize);
            self.queue.write_texture(texel, piece, layout, size);
            (begin, bytes) = (begin + now, rest);
        }
    }

    /// Those of the `size` bytes that are copied to the staging buffer which lie in `range`.
    fn fetch(
        &self,
        size: u64,
        range: Range<u64>,
        copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer),
    ) -> Result<Vec<u8>> {
        let small = size <= KEPT_STAGING;
        let kept = self.shared.staging.lock().ok().filter(|_| small).and_then(|mut kept| kept.take());
        let staging = match kept {
            Some(kept) => kept,
            None => {
                let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
                // No kernel sees it, so it may be longer than an array.
                self.allocate("staging", if small { KEPT_STAGING } else { size }, usage)?
            }
        };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        copy(&mut encoder, &staging);
        self.submit(encoder);
        let lost = |e: String| Error::Device(format!("{}: reading back failed: {e}", self.summary.name));
        let (sender, receiver) = std::sync::mpsc::channel();
        staging.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            let _ = sender.send(result);
        });
        self.wait()?;
        self.check()?; // what failed has left an older content
        receiver.recv().map_err(|e| lost(e.to_string()))?.map_err(|e| lost(e.to_string()))?;
        let view = staging.slice(..).get_mapped_range().map_err(|e| lost(e.to_string()))?;
        let content = view[range.start as usize..range.end as usize].to_vec();
        drop(view);
        if let (true, Ok(mut kept)) = (small, self.shared.staging.lock()) {
            staging.unmap();
            *kept = Some(staging);
        }
        Ok(content)
    }
}

/// How the rows of an image follow each other in a buffer.
fn image_layout(image: &wgpu::Texture) -> wgpu::TexelCopyBufferLayout {
    let texel = image.format().block_copy_size(None).expect("images of arrays have a plain format");
    wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(ROW as u32 * texel), rows_per_image: None }
}

fn row_bytes(image: &wgpu::Texture) -> u64 {
    u64::from(image_layout(image).bytes_per_row.unwrap_or_default())
}

/// An image from a texel on.
fn from_texel(image: &wgpu::Texture, x: u32, y: u32) -> wgpu::TexelCopyTextureInfo<'_> {
    wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x, y, z: 0 }, ..image.as_image_copy() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Another holder of wgpu's device would keep it, its memory and its threads for ever.
    #[test]
    fn devices_end() {
        let Ok(device) = Device::open(DeviceOptions::default()) else { return };
        let usage = wgpu::BufferUsages::COPY_SRC;
        let buffer = device.buffer("read", 16, usage).unwrap();
        // Leaves a staging buffer.
        assert_eq!(device.read(&buffer, 0, 16).unwrap(), [0; 16]);
        drop(buffer);
        let known = Arc::downgrade(&device.failure);
        drop(device);
        assert!(known.upgrade().is_none(), "wgpu's device is kept by something");
    }

    #[test]
    fn only_old_drivers_load_lane_by_lane() {
        assert!(loads_lane_by_lane("llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"));
        assert!(!loads_lane_by_lane("llvmpipe Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)"));
        assert!(!loads_lane_by_lane("SwiftShader driver 5.0.0"));
    }
}
