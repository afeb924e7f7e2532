// twin: src/state.rs
// Neighbour lists: grain i has the entries list_start[i] to list_start[i + 1], in ascending order of the neighbours' ids, then
// walls. An entry is the neighbour's index, or bodies + w for wall w; its top bit says that the contact has a spring.
var<storage, read_write> list_start: array<u32>; // N + 1
var<storage, read_write> neighbour: array<u32>;  // entries

/// Fills slots that were reserved and not needed.
const NONE = 0xffffffffu;
const INDEX = 0x7fffffffu;
const ACTIVE = 0x80000000u;
