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
    let header =
        ["", "name", "kind", "backend", "driver", "f64", "timestamps", "subgroup", "bytes/array", "arrays/kernel"];
    // If only one is seen, it has its number all the same.
    let first = gpu::selected().unwrap_or(0);
    let rows: Vec<_> = adapters.iter().zip(first..).map(|(adapter, number)| row(number, adapter)).collect();
    say(table(&header, &rows));
    say(
        "\n--engine gpu takes the first one, --precision double the first one with f64, --adapter any by its number or name.",
    );
    Ok(ExitCode::SUCCESS)
}

fn row(number: usize, adapter: &AdapterSummary) -> Vec<String> {
    let yes = |has: bool| if has { "yes" } else { "no" }.to_owned();
    vec![
        number.to_string(),
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
