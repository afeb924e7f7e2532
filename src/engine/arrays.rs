//! The arrays of a model on a device, wherever they lie.

use super::{
    aliases::{Aliases, Room},
    programs::Layouts,
};
use crate::{
    error::{Error, Result},
    gpu::{Device, Layout, Pack, Parts, Placement, Resource, images},
    state::{Array, Sizes},
};
use std::{
    collections::{HashMap, HashSet},
    num::NonZeroU64,
    ops::Range,
};
use wgpu::BufferUsages;

/// What an array, or arrays in common, may be used for.
const USAGE: BufferUsages = BufferUsages::STORAGE.union(BufferUsages::COPY_SRC).union(BufferUsages::COPY_DST);

/// Arrays, with their content.
pub struct DeviceArrays {
    layouts: Layouts,
    placements: HashMap<&'static Array, Placement>,
    aliases: Aliases,
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
    Buffers(Parts, Vec<wgpu::Buffer>),
    /// Buffers of other arrays.
    Alias(Parts, Vec<Room>),
    Image(wgpu::Texture, wgpu::TextureView),
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
        (placements, aliases): (HashMap<&'static Array, Placement>, Aliases),
        arrays: &[&'static Array],
        sizes: &Sizes,
    ) -> Result<DeviceArrays> {
        let (held, packs) = (HashMap::new(), HashMap::new());
        let mut all = DeviceArrays { layouts, placements, aliases, held, packs, serial: 0 };
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

    /// Those that lie in the memory of others.
    pub fn aliases(&self) -> &Aliases {
        &self.aliases
    }

    /// Where arrays are to lie from when they are given a length.
    pub fn place(&mut self, placements: HashMap<&'static Array, Placement>, aliases: Aliases) {
        (self.placements, self.aliases) = (placements, aliases);
    }

    fn placement(&self, array: &Array) -> Placement {
        self.placements.get(array).copied().unwrap_or_default()
    }

    /// Elements of an array; 0 if the model has none of that name.
    pub fn len(&self, array: &Array) -> usize {
        self.held.get(array).map_or(0, |held| held.len)
    }

    /// What tells the memory of an array from all other memory that there is or was: its own number, and those of the
    /// arrays that it lies in.
    pub fn serials_of(&self, array: &Array) -> impl Iterator<Item = u64> {
        let held = self.held.get(array);
        let rooms = held.and_then(|held| if let Memory::Alias(_, rooms) = &held.memory { Some(rooms) } else { None });
        let of_hosts = rooms.into_iter().flatten().map(|room| self.held[room.host].serial);
        [held.map_or(0, |held| held.serial)].into_iter().chain(of_hosts)
    }

    /// Whether an array is an alias whose rooms have so many elements.
    pub fn has_room(&self, array: &'static Array, len: usize) -> bool {
        let parts = match self.placement(array) {
            Placement::Parts(parts) => parts,
            _ => Parts::ONE,
        };
        let stride = self.layouts.stride(array);
        let fits = |(part, room): (usize, &Room)| (parts.len(part, len) * stride) as u64 <= self.buffer_of(room).size();
        let rooms = self.aliases.get(array);
        rooms.is_some_and(|rooms| len <= parts.len.saturating_mul(parts.count) && rooms.iter().enumerate().all(fits))
    }

    /// Bytes of all memory that there is.
    pub fn bytes(&self) -> u64 {
        let of = |(array, held): (&&'static Array, &Held)| match &held.memory {
            Memory::Buffers(_, buffers) => buffers.iter().map(wgpu::Buffer::size).sum(),
            Memory::Image(..) => (held.len * self.layouts.stride(array)) as u64,
            Memory::Alias(..) | Memory::Packed(..) => 0,
        };
        self.held.iter().map(of).sum::<u64>() + self.packs.values().map(wgpu::Buffer::size).sum::<u64>()
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
        let buffers = |parts: Parts| -> Result<Memory> {
            if let Some(rooms) = self.aliases.get(array) {
                return Ok(Memory::Alias(parts, rooms.clone()));
            }
            let buffer = |part| device.buffer(array.name, (parts.len(part, len) * stride) as u64, USAGE);
            Ok(Memory::Buffers(parts, (0..parts.count).map(buffer).collect::<Result<_>>()?))
        };
        let memory = match self.placement(array) {
            Placement::Buffer => buffers(Parts::ONE)?,
            Placement::Parts(parts) => buffers(parts)?,
            Placement::Image => {
                let layout = self.layouts.of(array).expect("images are of arrays that kernels use");
                let format = images::format(layout).expect("asked for before it was placed");
                let image = device.image(array.name, len * self.layouts.texels(array), format)?;
                let view = image.create_view(&Default::default());
                Memory::Image(image, view)
            }
            Placement::Packed => return Ok(()),
        };
        self.hold(array, memory, len);
        Ok(())
    }

    fn buffer_of(&self, room: &Room) -> &wgpu::Buffer {
        match &self.held[room.host].memory {
            Memory::Buffers(_, buffers) => &buffers[room.part],
            _ => unreachable!("`{:?}` has no buffers of its own", room.host),
        }
    }

    /// The buffers of an array, with the elements in each.
    fn buffers(&self, array: &'static Array) -> Option<(Parts, Vec<(&wgpu::Buffer, usize)>)> {
        let Held { memory, len, .. } = &self.held[array];
        let (parts, buffers): (Parts, Vec<_>) = match memory {
            Memory::Buffers(parts, buffers) => (*parts, buffers.iter().collect()),
            Memory::Alias(parts, rooms) => (*parts, rooms.iter().map(|room| self.buffer_of(room)).collect()),
            _ => return None,
        };
        let lens = (0..).map(|part| parts.len(part, *len));
        Some((parts, buffers.into_iter().zip(lens).collect()))
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
        let stride = self.layouts.stride(array);
        if let Some((_, buffers)) = self.buffers(array) {
            let clear = |(buffer, len)| encoder.clear_buffer(buffer, 0, Some((len * stride) as u64));
            return buffers.into_iter().for_each(clear);
        }
        let Held { memory, len, .. } = &self.held[array];
        match memory {
            Memory::Packed(pack, begin) => {
                let bytes = (len * stride) as u64;
                encoder.clear_buffer(&self.packs[pack], (begin * pack.stride()) as u64, Some(bytes));
            }
            _ => unreachable!("`{array:?}` is cleared, so it is no image"),
        }
    }

    /// Overwrite elements of an array, from number `first` on.
    pub fn write(&self, device: &Device, array: &'static Array, first: usize, bytes: &[u8]) {
        let stride = self.layouts.stride(array);
        let begin = (first * stride) as u64;
        if let Some((parts, buffers)) = self.buffers(array) {
            for (part, elements) in parts.of_range(first..first + bytes.len() / stride) {
                let from = part * parts.len + elements.start - first;
                let bytes = &bytes[from * stride..(from + elements.len()) * stride];
                device.queue.write_buffer(buffers[part].0, (elements.start * stride) as u64, bytes);
            }
            return;
        }
        match &self.held[array].memory {
            Memory::Image(image, _) => device.write_image(image, begin, bytes),
            Memory::Packed(pack, at) => {
                device.queue.write_buffer(&self.packs[pack], (at * pack.stride()) as u64 + begin, bytes);
            }
            _ => unreachable!("it has no buffers"),
        }
    }

    /// Elements of an array.
    ///
    /// # Errors
    /// [`Error::Device`] if the device is lost, [`Error::Lacking`] if it has no memory for a copy.
    pub fn read(&self, device: &Device, array: &'static Array, elements: Range<usize>) -> Result<Vec<u8>> {
        let stride = self.layouts.stride(array);
        let (begin, bytes) = ((elements.start * stride) as u64, (elements.len() * stride) as u64);
        if let Some((parts, buffers)) = self.buffers(array) {
            let mut content = Vec::with_capacity(bytes as usize);
            for (part, elements) in parts.of_range(elements) {
                let (begin, bytes) = (elements.start * stride, elements.len() * stride);
                content.extend(device.read(buffers[part].0, begin as u64, bytes as u64)?);
            }
            return Ok(content);
        }
        match &self.held[array].memory {
            Memory::Image(image, _) => device.read_image(image, begin, bytes),
            Memory::Packed(pack, at) => device.read(&self.packs[pack], (at * pack.stride()) as u64 + begin, bytes),
            _ => unreachable!("it has no buffers"),
        }
    }

    /// What a variable of a kernel that stands for an array is bound to.
    pub fn resource(&self, array: &'static Array, resource: &Resource) -> wgpu::BindingResource<'_> {
        let part = if let Resource::Part(part) = resource { *part } else { 0 };
        match (&self.held[array].memory, resource) {
            (Memory::Buffers(_, buffers), Resource::Buffer | Resource::Part(_)) => buffers[part].as_entire_binding(),
            (Memory::Alias(parts, rooms), Resource::Buffer | Resource::Part(_)) => {
                let bytes = parts.len(part, self.held[array].len) * self.layouts.stride(array);
                let buffer = self.buffer_of(&rooms[part]);
                let size = NonZeroU64::new(bytes as u64);
                wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size })
            }
            (Memory::Image(_, view), Resource::Image) => wgpu::BindingResource::TextureView(view),
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
