//! What single precision loses: the tables of `docs/precision.md`.

use super::{drift, log::Log, results::Effort};

pub fn run(log: &mut Log) {
    let decades = match log.effort {
        Effort::Quick => 1,
        Effort::Full => 2,
        Effort::Long => 4,
    };
    drift::run(log, decades);
}
