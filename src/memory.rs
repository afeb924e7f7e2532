//! The host's memory, asked before anything large is allocated.

use crate::error::{Error, Result};

/// Bytes per grain that the host needs besides the arrays of an engine: grains as the scene has them, once more as results
/// have them, and a grid in which their neighbours are found.
pub const BYTES_PER_GRAIN: u64 = 250;

/// What so many grains need.
pub fn of_grains(count: u64) -> u64 {
    count.saturating_mul(BYTES_PER_GRAIN)
}

/// Refuse what the host's memory cannot hold. Where the system does not tell, everything passes.
///
/// # Errors
/// [`Error::Device`] with both numbers of bytes.
pub fn check_host(need: u64) -> Result<()> {
    match available() {
        Some(available) if need > available => Err(Error::Device(format!(
            "scene too large: it needs {need} bytes, but {available} bytes of memory are available"
        ))),
        _ => Ok(()),
    }
}

/// Memory that can be had without swapping, bytes, where the system tells.
pub fn available() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("MemAvailable:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}
