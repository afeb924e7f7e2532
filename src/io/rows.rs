//! Grains of any file that has some.

use super::csv::{self, GrainRow};
use crate::{
    container::{Container, is_container},
    error::Result,
};
use std::path::Path;

/// Reads the spheres of a table or of a binary file; of clumps in a binary file the members.
///
/// # Errors
/// As [`csv::read_grains`] and [`Container::open`].
pub fn read_rows(path: &Path) -> Result<Vec<GrainRow>> {
    if !is_container(path) {
        return csv::read_grains(path);
    }
    let mut file = Container::<serde_json::Value>::open(path)?;
    let prefix = if file.rows("member_position").is_some() { "member_" } else { "" };
    let mut rows = Vec::new();
    file.read(&format!("{prefix}position"), |k, [x, y, z]| {
        rows.push(GrainRow { id: Some(k as u64), x, y, z, ..GrainRow::default() });
    })?;
    file.read(&format!("{prefix}radius"), |k, [radius]| {
        if let Some(row) = rows.get_mut(k) {
            row.radius = radius;
        }
    })?;
    file.read(&format!("{prefix}velocity"), |k, [x, y, z]| {
        if let Some(row) = rows.get_mut(k) {
            (row.vx, row.vy, row.vz) = (x, y, z);
        }
    })?;
    Ok(rows)
}
