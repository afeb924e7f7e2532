//! The arrays of a model on a device, wherever they lie.

use super::programs::Layouts;
use crate::{
    error::{Error, Result},
    gpu::{Device, Layout, Pack, Parts, Placement, Resource, images},
    state::{Array, Sizes},
};
use std::{
    collections::{HashMap, HashSet},
    ops::Range,
};
use wgpu::BufferUsages;

/// What an array, or arrays in common, may be used for.
const USAGE: BufferUsages = BufferUsages::STORAGE.union(BufferUsages::COPY_SRC).union(BufferUsages::COPY_DST);

/// Arrays, with their content.
pub struct DeviceArrays {
    layouts: Layouts,
    placements: HashMap<&'static Array, Placement>,
    held: HashMap<&'static Array, Held>,
    packs: HashMap<Pack, wgpu::Buffer>,
    /// Serial numbers given so far.
    serial: u64,
}

struct Held {
    memory: Memory,
    /// No other memory ever has this number.
    serial: u64,
    len: usize,
}

enum Memory {
    Buffer(wgpu::Buffer),
    Image(wgpu::Texture, wgpu::TextureView),
    Parts(Parts, Vec<wgpu::Buffer>),
    /// From this element of the pack on.
    Packed(Pack, usize),
}

impl DeviceArrays {
    /// Arrays of zeros.
    ///
    /// # Errors
    /// [`Error::Lacking`] if one exceeds a limit or the memory of the device.
    pub fn new(
        device: &Device,
        layouts: Layouts,
        placements: HashMap<&'static Array, Placement>,
        arrays: &[&'static Array],
        sizes: &Sizes,
    ) -> Result<DeviceArrays> {
        let (held, packs) = (HashMap::new(), HashMap::new());
        let mut all = DeviceArrays { layouts, placements, held, packs, serial: 0 };
        for &array in arrays {
            let len = sizes.of(array.length);
            if all.placement(array) == Placement::Packed {
                let memory = Memory::Packed(Pack::of(all.layouts.stride(array)), 0);
                all.hold(array, memory, len);
            } else {
                all.allocate_alone(device, array, len)?;
            }
        }
        Pack::ALL.into_iter().try_for_each(|pack| all.repack(device, pack, &[], 0))?;
        Ok(all)
    }

    pub fn layouts(&self) -> &Layouts {
        &self.layouts
    }

    pub fn placements(&self) -> &HashMap<&'static Array, Placement> {
        &self.placements
    }

    /// Where arrays are to lie from when they are given a length.
    pub fn place(&mut self, placements: impl IntoIterator<Item = (&'static Array, Placement)>) {
        self.placements.extend(placements);
    }

    fn placement(&self, array: &Array) -> Placement {
        self.placements.get(array).copied().unwrap_or_default()
    }

    /// Elements of an array; 0 if the model has none of that name.
    pub fn len(&self, array: &Array) -> usize {
        self.held.get(array).map_or(0, |held| held.len)
    }

    /// What tells the memory of an array from all other memory that there is or was.
    pub fn serial(&self, array: &Array) -> u64 {
        self.held.get(array).map_or(0, |held| held.serial)
    }

    /// The numbers of all memory there is.
    pub fn serials(&self) -> HashSet<u64> {
        self.held.values().map(|held| held.serial).collect()
    }

    fn hold(&mut self, array: &'static Array, memory: Memory, len: usize) {
        self.serial += 1;
        self.held.insert(array, Held { memory, serial: self.serial, len });
    }

    /// Give arrays another length; their content is lost.
    ///
    /// # Errors
    /// As [`DeviceArrays::new`].
    pub fn allocate(&mut self, device: &Device, arrays: &[&'static Array], len: usize) -> Result<()> {
        arrays.iter().try_for_each(|array| self.allocate_alone(device, array, len))?;
        Pack::ALL.into_iter().try_for_each(|pack| {
            let of_pack = |array: &&&'static Array| self.packed_in(array) == Some(pack);
            let resized: Vec<_> = arrays.iter().filter(of_pack).copied().collect();
            if resized.is_empty() { Ok(()) } else { self.repack(device, pack, &resized, len) }
        })
    }

    /// Of one that is not packed.
    fn allocate_alone(&mut self, device: &Device, array: &'static Array, len: usize) -> Result<()> {
        if len > u32::MAX as usize {
            let name = array.name;
            return Err(Error::Lacking(format!("array `{name}` needs {len} elements; 2^32 - 1 can be told apart")));
        }
        let stride = self.layouts.stride(array);
        let buffer = |len: usize| device.buffer(array.name, (len * stride) as u64, USAGE);
        let memory = match self.placement(array) {
            Placement::Buffer => Memory::Buffer(buffer(len)?),
            Placement::Image => {
                let layout = self.layouts.of(array).expect("images are of arrays that kernels use");
                let format = images::format(layout).expect("asked for before it was placed");
                let image = device.image(array.name, len * self.layouts.texels(array), format)?;
                let view = image.create_view(&Default::default());
                Memory::Image(image, view)
            }
            Placement::Parts(parts) => {
                let buffers = (0..parts.count).map(|part| buffer(parts.len(part, len)));
                Memory::Parts(parts, buffers.collect::<Result<_>>()?)
            }
            Placement::Packed => return Ok(()),
        };
        self.hold(array, memory, len);
        Ok(())
    }

    /// The pack that an array lies in.
    fn packed_in(&self, array: &Array) -> Option<Pack> {
        match self.held.get(array)?.memory {
            Memory::Packed(pack, _) => Some(pack),
            _ => None,
        }
    }

    /// The arrays of a pack one after the other again, some of them with another length; the content of these is lost.
    fn repack(&mut self, device: &Device, pack: Pack, resized: &[&'static Array], new_len: usize) -> Result<()> {
        let packed = self.held.iter().filter(|(array, _)| self.packed_in(array) == Some(pack));
        let mut arrays: Vec<(&'static Array, usize)> = packed.map(|(array, held)| (*array, held.len)).collect();
        arrays.sort_by_key(|(array, _)| array.name);
        let mut end = 0;
        let mut begins = Vec::new();
        for (array, len) in &mut arrays {
            *len = if resized.contains(array) { new_len } else { *len };
            begins.push(end);
            end += *len * self.layouts.stride(array) / pack.stride();
        }
        let bytes = |elements: usize| (elements * pack.stride()) as u64;
        if end > u32::MAX as usize {
            return Err(Error::Lacking(format!(
                "`{}` needs {} bytes, more than kernels can find their way in; use --arrays buffers",
                pack.name(),
                bytes(end)
            )));
        }
        if end == 0 {
            return Ok(());
        }
        let buffer = device.buffer(pack.name(), bytes(end), USAGE)?;
        let old = self.packs.insert(pack, buffer.clone());
        let mut encoder = device.device.create_command_encoder(&Default::default());
        for ((array, len), begin) in arrays.into_iter().zip(begins) {
            if let (Some(old), false) = (&old, resized.contains(&array))
                && let Memory::Packed(_, from) = self.held[array].memory
            {
                let size = (len * self.layouts.stride(array)) as u64;
                encoder.copy_buffer_to_buffer(old, bytes(from), &buffer, bytes(begin), size);
            }
            self.hold(array, Memory::Packed(pack, begin), len);
        }
        device.submit(encoder);
        Ok(())
    }

    pub fn swap(&mut self, a: &'static Array, b: &'static Array) {
        let first = self.held.remove(a).expect("an array of the model");
        let second = self.held.insert(b, first).expect("an array of the model");
        self.held.insert(a, second);
    }

    pub fn clear(&self, encoder: &mut wgpu::CommandEncoder, array: &'static Array) {
        let Held { memory, len, .. } = &self.held[array];
        match memory {
            Memory::Buffer(buffer) => encoder.clear_buffer(buffer, 0, None),
            Memory::Parts(_, buffers) => buffers.iter().for_each(|buffer| encoder.clear_buffer(buffer, 0, None)),
            Memory::Packed(pack, begin) => {
                let bytes = (len * self.layouts.stride(array)) as u64;
                encoder.clear_buffer(&self.packs[pack], (begin * pack.stride()) as u64, Some(bytes));
            }
            Memory::Image(..) => unreachable!("`{array:?}` is cleared, so it is no image"),
        }
    }

    /// Overwrite elements of an array, from number `first` on.
    pub fn write(&self, device: &Device, array: &'static Array, first: usize, bytes: &[u8]) {
        let stride = self.layouts.stride(array);
        let begin = (first * stride) as u64;
        match &self.held[array].memory {
            Memory::Buffer(buffer) => device.queue.write_buffer(buffer, begin, bytes),
            Memory::Image(image, _) => device.write_image(image, begin, bytes),
            Memory::Parts(parts, buffers) => {
                for (part, elements) in parts.of_range(first..first + bytes.len() / stride) {
                    let from = (part << parts.shift) + elements.start - first;
                    let bytes = &bytes[from * stride..(from + elements.len()) * stride];
                    device.queue.write_buffer(&buffers[part], (elements.start * stride) as u64, bytes);
                }
            }
            Memory::Packed(pack, at) => {
                device.queue.write_buffer(&self.packs[pack], (at * pack.stride()) as u64 + begin, bytes);
            }
        }
    }

    /// Elements of an array.
    ///
    /// # Errors
    /// [`Error::Device`] if the device is lost, [`Error::Lacking`] if it has no memory for a copy.
    pub fn read(&self, device: &Device, array: &'static Array, elements: Range<usize>) -> Result<Vec<u8>> {
        let stride = self.layouts.stride(array);
        let (begin, bytes) = ((elements.start * stride) as u64, (elements.len() * stride) as u64);
        match &self.held[array].memory {
            Memory::Buffer(buffer) => device.read(buffer, begin, bytes),
            Memory::Image(image, _) => device.read_image(image, begin, bytes),
            Memory::Parts(parts, buffers) => {
                let mut content = Vec::with_capacity(bytes as usize);
                for (part, elements) in parts.of_range(elements) {
                    let (begin, bytes) = (elements.start * stride, elements.len() * stride);
                    content.extend(device.read(&buffers[part], begin as u64, bytes as u64)?);
                }
                Ok(content)
            }
            Memory::Packed(pack, at) => device.read(&self.packs[pack], (at * pack.stride()) as u64 + begin, bytes),
        }
    }

    /// What a variable of a kernel that stands for an array is bound to.
    pub fn resource(&self, array: &'static Array, resource: &Resource) -> wgpu::BindingResource<'_> {
        match (&self.held[array].memory, resource) {
            (Memory::Buffer(buffer), Resource::Buffer) => buffer.as_entire_binding(),
            (Memory::Image(_, view), Resource::Image) => wgpu::BindingResource::TextureView(view),
            (Memory::Parts(_, buffers), Resource::Part(part)) => buffers[*part].as_entire_binding(),
            _ => unreachable!("`{array:?}` does not lie where kernels look for it"),
        }
    }

    pub fn pack(&self, pack: Pack) -> wgpu::BindingResource<'_> {
        self.packs[&pack].as_entire_binding()
    }

    /// The first element of a packed array, in elements of its pack.
    pub fn begin_in_pack(&self, array: &Array) -> Option<usize> {
        match self.held.get(array)?.memory {
            Memory::Packed(_, begin) => Some(begin),
            _ => None,
        }
    }

    /// How an array's elements lie.
    pub fn layout(&self, array: &'static Array) -> Option<&Layout> {
        self.layouts.of(array)
    }
}
