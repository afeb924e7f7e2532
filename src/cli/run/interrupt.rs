//! Ctrl-C.

use super::super::common::INTERRUPTED;
use std::{
    sync::{
        Once,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

static CTRL_C: AtomicBool = AtomicBool::new(false);
static LISTENING: Once = Once::new();

/// Signals that come sooner after the first are taken for the same: some programs send one to the process and one to its
/// group.
const SAME_SIGNAL: Duration = Duration::from_secs(1);

/// Take note of Ctrl-C; a second one ends the program at once.
pub fn listen() -> anyhow::Result<()> {
    let mut first: Option<Instant> = None;
    let mut listening = Ok(());
    LISTENING.call_once(|| {
        listening = ctrlc::set_handler(move || {
            CTRL_C.store(true, Ordering::Relaxed);
            if first.get_or_insert_with(Instant::now).elapsed() > SAME_SIGNAL {
                std::process::exit(INTERRUPTED.into());
            }
        });
    });
    Ok(listening?)
}

/// Whether there was a Ctrl-C.
pub fn interrupted() -> bool {
    CTRL_C.load(Ordering::Relaxed)
}
