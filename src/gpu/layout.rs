//! What a kernel is bound to, and how its elements lie in memory.

/// A variable that an entry point uses.
#[derive(Clone, Debug)]
pub struct Binding {
    pub name: String,
    pub resource: Resource,
    /// Whether the kernel reads it.
    pub read: bool,
    /// Whether the kernel writes it.
    pub written: bool,
    /// An array of which elements are loaded, whole or member by member, and stored whole; nothing else.
    pub elementwise: bool,
    pub layout: Layout,
}

impl Binding {
    /// As WGSL has it.
    pub fn access(&self) -> &'static str {
        match (self.read, self.written) {
            (true, true) => "read_write",
            (true, false) => "read",
            _ => "write",
        }
    }
}

/// What a variable is bound to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Resource {
    /// The uniform buffer.
    Uniform,
    /// A storage buffer with the array of that name.
    Buffer,
    /// A storage image with it.
    Image,
    /// A storage buffer with this part of it.
    Part(usize),
    /// A storage buffer that packed arrays share.
    Pack(Pack),
    /// The uniform buffer that says where these begin there, in elements of the buffer.
    PackedAt(Vec<String>),
}

impl Resource {
    pub fn is_storage_buffer(&self) -> bool {
        matches!(self, Resource::Buffer | Resource::Part(_) | Resource::Pack(_))
    }
}

/// The buffers that packed arrays share. An element of an array is one of theirs, or several.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pack {
    /// Of 16 bytes, for arrays whose elements are as many of these.
    Quadruples,
    /// Of 4 bytes, for all others.
    Words,
}

impl Pack {
    pub const ALL: [Pack; 2] = [Pack::Quadruples, Pack::Words];

    /// For elements of so many bytes.
    pub fn of(stride: usize) -> Pack {
        if stride.is_multiple_of(16) { Pack::Quadruples } else { Pack::Words }
    }

    /// Bytes of an element.
    pub fn stride(self) -> usize {
        if self == Pack::Quadruples { 16 } else { 4 }
    }

    /// The variable.
    pub fn name(self) -> &'static str {
        if self == Pack::Quadruples { "packed_quadruples" } else { "packed_words" }
    }

    /// The type of an element.
    pub fn element(self) -> &'static str {
        if self == Pack::Quadruples { "vec4<u32>" } else { "u32" }
    }
}

/// How elements lie in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// Bytes from one element to the next, or the size of a single value.
    pub stride: usize,
    /// Scalars of an element in declaration order.
    pub lanes: Vec<Lane>,
    /// Member names if the element is a struct.
    pub names: Vec<String>,
}

/// A scalar inside an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lane {
    pub offset: usize,
    pub kind: LaneKind,
}

/// Type of a scalar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LaneKind {
    F32,
    F64,
    U32,
}

impl Layout {
    /// Bytes of the lanes that `write` feeds, element by element, over the units of these. What is beyond all numbers of
    /// a lane becomes the largest: infinities are not safe on every device.
    pub fn encode(&self, elements: usize, units: &[f64], write: impl FnOnce(&mut dyn FnMut(f64))) -> Vec<u8> {
        let mut bytes = vec![0; (elements * self.stride).next_multiple_of(4)];
        let (mut base, mut k) = (0, 0);
        write(&mut |x| {
            let Lane { offset, kind } = self.lanes[k];
            let at = base + offset;
            let x = x / units[k];
            match kind {
                LaneKind::F32 => {
                    bytes[at..at + 4].copy_from_slice(&(x as f32).clamp(f32::MIN, f32::MAX).to_ne_bytes());
                }
                LaneKind::F64 => bytes[at..at + 8].copy_from_slice(&x.clamp(f64::MIN, f64::MAX).to_ne_bytes()),
                LaneKind::U32 => bytes[at..at + 4].copy_from_slice(&(x as u32).to_ne_bytes()),
            }
            k += 1;
            if k == self.lanes.len() {
                (base, k) = (base + self.stride, 0);
            }
        });
        bytes
    }

    /// The lanes in these bytes, one per call, times the units of these.
    pub fn decode<'a>(&'a self, bytes: &'a [u8], units: &'a [f64]) -> impl FnMut() -> f64 + 'a {
        let (mut base, mut k) = (0, 0);
        move || {
            let Lane { offset, kind } = self.lanes[k];
            let at = base + offset;
            let four = || bytes[at..at + 4].try_into().expect("four bytes");
            let value = units[k]
                * match kind {
                    LaneKind::F32 => f64::from(f32::from_ne_bytes(four())),
                    LaneKind::F64 => f64::from_ne_bytes(bytes[at..at + 8].try_into().expect("eight bytes")),
                    LaneKind::U32 => f64::from(u32::from_ne_bytes(four())),
                };
            k += 1;
            if k == self.lanes.len() {
                (base, k) = (base + self.stride, 0);
            }
            value
        }
    }
}
