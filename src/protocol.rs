//! Protocols: what is asked of a packing from one rest to the next, and what comes of it.

pub mod jamming;
