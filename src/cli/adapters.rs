//! `packstone adapters`

use super::common::say;
use super::table::table;
use packstone::gpu::{self, AdapterSummary, Device, DeviceOptions};
use std::process::ExitCode;

/// List the GPU adapters of this machine, best first
#[derive(clap::Args)]
#[command(after_help = "Example:\n  packstone adapters")]
pub struct AdaptersArgs {}

pub fn adapters() -> anyhow::Result<ExitCode> {
    let adapters = gpu::adapters();
    if adapters.is_empty() {
        // Opening says how to get one.
        Device::open(DeviceOptions::default())?;
    }
    let header = ["name", "kind", "backend", "driver", "f64", "timestamps", "subgroup", "bytes/array", "arrays/kernel"];
    say(table(&header, &adapters.iter().map(row).collect::<Vec<_>>()));
    say("\n--engine gpu takes the first one; --precision double the first one with f64.");
    Ok(ExitCode::SUCCESS)
}

fn row(adapter: &AdapterSummary) -> Vec<String> {
    let yes = |has: bool| if has { "yes" } else { "no" }.to_owned();
    vec![
        adapter.name.clone(),
        adapter.kind.clone(),
        adapter.backend.clone(),
        adapter.driver.clone(),
        yes(adapter.double),
        yes(adapter.timestamps),
        adapter.subgroup.map_or("-".to_owned(), |(least, most)| format!("{least} to {most}")),
        adapter.max_array_bytes.to_string(),
        adapter.max_arrays.to_string(),
    ]
}
