//! Arrays that lie in the memory of others while nothing is asked of these: aliases.

use super::{
    liveness::Liveness,
    programs::{Layouts, bytes},
};
use crate::{
    gpu::{Parts, Placement},
    model::Model,
    state::{ARRAYS, Array, Length, Sizes, present},
};
use std::{
    cmp::Reverse,
    collections::{HashMap, HashSet},
};

/// A buffer of another array: part of it, or all. Where arrays are exchanged, that is the one that has the name then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    pub host: &'static Array,
    pub part: usize,
}

/// The rooms of the arrays that are aliases.
pub type Aliases = HashMap<&'static Array, Vec<Room>>;

/// Bytes of all arrays that the model needs, without those that lie in the memory of others.
pub fn total(model: &Model, layouts: &Layouts, aliases: &Aliases, sizes: &Sizes) -> u64 {
    bytes(model, layouts, sizes).filter(|(array, _)| !aliases.contains_key(array)).map(|(_, bytes)| bytes).sum()
}

/// Whether arrays of this kind of length are as long as there are grains, or cells for them, and stay so.
fn is_of_grains(length: Length) -> bool {
    use Length::*;
    matches!(
        length,
        Bodies | BodiesPlusOne | BodiesAndWalls | Clumps | ClumpsPlusOne | CellsPlusOne | Tiles | SlicesPlusOne
    )
}

fn has_buffers(placement: Placement) -> bool {
    matches!(placement, Placement::Buffer | Placement::Parts(_))
}

/// What decides which arrays can be aliases.
pub struct Choice<'a> {
    pub model: &'a Model,
    pub liveness: &'a Liveness,
    pub layouts: &'a Layouts,
    /// Arrays that can lie in parts.
    pub parts: &'a HashSet<&'static Array>,
    /// Buffers that a kernel may have more than it has now.
    pub spare_buffers: usize,
}

impl Choice<'_> {
    /// Make aliases of some of the arrays, which are so long or longer: the longest first.
    pub fn make(
        &self,
        arrays: &[&'static Array],
        sizes: &Sizes,
        placements: &mut HashMap<&'static Array, Placement>,
        aliases: &mut Aliases,
    ) {
        let bytes = |array: &'static Array| needed(array.length, sizes) * self.layouts.stride(array);
        let mut arrays = arrays.to_vec();
        arrays.sort_by_key(|array| Reverse(bytes(array)));
        let mut spare = self.spare_buffers;
        for array in arrays {
            let in_buffers = has_buffers(placements.get(array).copied().unwrap_or_default());
            if !in_buffers || !self.can_be_alias(array, aliases) {
                continue;
            }
            let mut rooms = self.free_rooms(array, sizes, placements, aliases);
            rooms.sort_by_key(|(_, bytes)| *bytes);
            let stride = self.layouts.stride(array);
            if let Some((room, _)) = rooms.iter().find(|(_, room)| *room >= bytes(array)) {
                placements.insert(array, Placement::Buffer);
                aliases.insert(array, vec![*room]);
                continue;
            }
            // Kernels of a step had better not look for the part.
            if array.length != Length::History || !self.parts.contains(array) {
                continue;
            }
            // In as few rooms as will do, of which the smallest says how long a part is.
            let several = (2..=rooms.len().min(1 + spare)).find_map(|count| {
                let chosen = &rooms[rooms.len() - count..];
                let len = chosen[0].1 / stride;
                let fits = len > 0 && count * len >= needed(array.length, sizes);
                fits.then(|| (Parts { count, len }, chosen.iter().map(|(room, _)| *room).collect()))
            });
            if let Some((parts, rooms)) = several {
                spare -= parts.count - 1;
                placements.insert(array, Placement::Parts(parts));
                aliases.insert(array, rooms);
            }
        }
    }

    /// Whether what an array holds is never looked at between plans, when it may be written over, and it is no host.
    fn can_be_alias(&self, array: &'static Array, aliases: &Aliases) -> bool {
        let is_host = aliases.values().flatten().any(|room| room.host == array);
        let kind = is_of_grains(array.length) || array.length == Length::History;
        kind && !is_host && !aliases.contains_key(array) && self.liveness.is_scratch(array)
    }

    /// Buffers that an array can be put in, with their bytes.
    fn free_rooms(
        &self,
        array: &'static Array,
        sizes: &Sizes,
        placements: &HashMap<&'static Array, Placement>,
        aliases: &Aliases,
    ) -> Vec<(Room, usize)> {
        // Those that get another length lose their content at any time.
        let hosts = present(self.model, ARRAYS).into_iter().filter(|host| {
            let has_rooms = is_of_grains(host.length) && !aliases.contains_key(host);
            let placement = placements.get(host).copied().unwrap_or_default();
            has_rooms && has_buffers(placement) && *host != array && self.liveness.are_apart(array, host)
        });
        let rooms = hosts.flat_map(|host| {
            let parts = if let Some(Placement::Parts(parts)) = placements.get(host) { *parts } else { Parts::ONE };
            let (len, stride) = (sizes.of(host.length), self.layouts.stride(host));
            (0..parts.count).map(move |part| (Room { host, part }, parts.len(part, len) * stride))
        });
        let is_free = |(room, _): &(Room, usize)| {
            let mut others = aliases.iter().filter(|(_, rooms)| rooms.contains(room));
            others.all(|(other, _)| self.liveness.are_apart(array, other))
        };
        rooms.filter(is_free).collect()
    }
}

/// How many elements there should be room for. The history grows from nothing to one of every other entry, as a rule.
fn needed(length: Length, sizes: &Sizes) -> usize {
    match length {
        Length::History => sizes.history.max(sizes.entries / 2),
        other => sizes.of(other),
    }
}
