//! The adapters of a machine: which there are, which is the best, and which one is asked for.

use super::restrictions::Restrictions;
use crate::error::{Error, Result};
use std::sync::OnceLock;
use wgpu::{DeviceType, Features};

/// What is worth knowing of an adapter before choosing it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct AdapterSummary {
    pub name: String,
    pub kind: String,
    pub backend: String,
    pub driver: String,
    /// f64 in shaders: `--precision double`.
    pub double: bool,
    /// Per-stage timings.
    pub timestamps: bool,
    /// Smallest and largest subgroup, if the device has subgroup operations.
    pub subgroup: Option<(u32, u32)>,
    /// Largest array a kernel can see, bytes.
    pub max_array_bytes: u64,
    /// Arrays a kernel can see.
    pub max_arrays: u32,
}

fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::PRIMARY,
        // Where the driver tells its budget, refuse what exceeds it instead of swapping or losing the device.
        memory_budget_thresholds: wgpu::MemoryBudgetThresholds {
            for_resource_creation: Some(95),
            for_device_loss: None,
        },
        ..wgpu::InstanceDescriptor::new_without_display_handle_from_env()
    })
}

/// The number, among all adapters, of the only one that this process sees.
static SELECTED: OnceLock<usize> = OnceLock::new();

/// From now on this process sees only one adapter, whatever is opened: the one with this number in [`adapters`], or the
/// one whose name has this part, in capitals or not.
///
/// # Errors
/// [`Error::Lacking`] with all there are, if none or several are meant, or another one has been selected before.
pub fn select(wanted: &str) -> Result<()> {
    let names: Vec<String> = adapters().into_iter().map(|adapter| adapter.name).collect();
    let number = find(&names, wanted).map_err(Error::Lacking)?;
    match *SELECTED.get_or_init(|| number) == number {
        true => Ok(()),
        false => Err(Error::Lacking("another adapter has been selected before".to_owned())),
    }
}

/// The number of the adapter that was selected.
pub fn selected() -> Option<usize> {
    SELECTED.get().copied()
}

/// The number of the adapter that is meant by a number or a part of its name.
fn find(names: &[String], wanted: &str) -> std::result::Result<usize, String> {
    if let Some(number) = wanted.parse().ok().filter(|number| *number < names.len()) {
        return Ok(number);
    }
    let part = wanted.to_lowercase();
    let named = |number: &usize| names[*number].to_lowercase().contains(&part);
    let found: Vec<usize> = (0..names.len()).filter(named).collect();
    let list = |numbers: &[usize]| {
        let entries: Vec<String> = numbers.iter().map(|number| format!("{number} {}", names[*number])).collect();
        entries.join(", ")
    };
    match found[..] {
        [number] => Ok(number),
        [] if names.is_empty() => Err(format!("adapter {wanted}: there is no adapter at all")),
        [] => {
            let all: Vec<usize> = (0..names.len()).collect();
            Err(format!("adapter {wanted}: there is none of that number or name; there are {}", list(&all)))
        }
        _ => Err(format!("adapter {wanted}: several have that in their names, {}; give the number", list(&found))),
    }
}

/// A smaller one is better.
fn rank(kind: DeviceType) -> u32 {
    match kind {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}

/// Whether it is the host's processor.
pub(super) fn is_software(adapter: &wgpu::Adapter) -> bool {
    adapter.get_info().device_type == DeviceType::Cpu
}

/// All adapters that this process sees, best first: discrete, integrated, virtual, software.
pub(super) fn candidates() -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::PRIMARY));
    adapters.sort_by_key(|adapter| rank(adapter.get_info().device_type));
    match selected() {
        Some(number) => adapters.into_iter().skip(number).take(1).collect(),
        None => adapters,
    }
}

/// Of these, best first, the number of the best that can do what is asked: those before it have no f64.
pub(super) fn best(all: &[AdapterSummary], double: bool) -> Option<usize> {
    all.iter().position(|adapter| adapter.double || !double)
}

pub(super) fn summary(adapter: &wgpu::Adapter, restrictions: &Restrictions) -> AdapterSummary {
    let info = adapter.get_info();
    let features = restrictions.features(adapter.features());
    let limits = restrictions.limits(adapter.limits());
    AdapterSummary {
        name: info.name,
        kind: format!("{:?}", info.device_type),
        backend: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        double: features.contains(Features::SHADER_F64),
        timestamps: features.contains(Features::TIMESTAMP_QUERY),
        subgroup: features.contains(Features::SUBGROUP).then_some((info.subgroup_min_size, info.subgroup_max_size)),
        max_array_bytes: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
        max_arrays: limits.max_storage_buffers_per_shader_stage,
    }
}

/// All adapters that this process sees, best first.
pub fn adapters() -> Vec<AdapterSummary> {
    candidates().iter().map(|adapter| summary(adapter, &Restrictions::default())).collect()
}

/// All of them, best first, with the names and values of what they say of themselves.
pub fn adapter_facts() -> Vec<Vec<(String, String)>> {
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let of = |adapter: &wgpu::Adapter| {
        let (info, limits) = (adapter.get_info(), adapter.limits());
        let mut facts = vec![
            fact("name", info.name),
            fact("kind", format!("{:?}", info.device_type)),
            fact("backend", info.backend.to_string()),
            fact("driver", format!("{} {}", info.driver, info.driver_info)),
            fact("vendor, device", format!("{:#06x}, {:#06x}", info.vendor, info.device)),
            fact("subgroups", format!("{} to {}", info.subgroup_min_size, info.subgroup_max_size)),
            fact("features", adapter.features().iter_names().map(|(name, _)| name).collect::<Vec<_>>().join(", ")),
        ];
        // `name: value,` on a line each.
        let limits = format!("{limits:#?}");
        let lines = limits.lines().filter_map(|line| line.trim().trim_end_matches(',').split_once(": "));
        facts.extend(lines.map(|(name, value)| fact(name, value.to_owned())));
        facts
    };
    candidates().iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(name: &str, double: bool) -> AdapterSummary {
        let [kind, backend, driver] = [(); 3].map(|()| String::new());
        let (name, timestamps, subgroup, max_array_bytes, max_arrays) = (name.to_owned(), false, None, 0, 0);
        AdapterSummary { name, kind, backend, driver, double, timestamps, subgroup, max_array_bytes, max_arrays }
    }

    /// In whatever order the system lists them.
    #[test]
    fn software_comes_last() {
        use DeviceType::{Cpu, DiscreteGpu, IntegratedGpu, Other, VirtualGpu};
        let mut kinds = [Cpu, Other, IntegratedGpu, VirtualGpu, DiscreteGpu];
        kinds.sort_by_key(|kind| rank(*kind));
        assert_eq!(kinds, [DiscreteGpu, IntegratedGpu, VirtualGpu, Other, Cpu]);
    }

    #[test]
    fn the_best_adapter_has_what_is_asked_for() {
        let all = [adapter("fast", false), adapter("slow", true), adapter("slower", true)];
        assert_eq!((best(&all, false), best(&all, true), best(&all[..1], true)), (Some(0), Some(1), None));
    }

    #[test]
    fn adapters_are_found_by_number_and_by_part_of_the_name() {
        let names = ["NVIDIA L4", "Intel Arc A770", "llvmpipe (LLVM 15.0.6, 256 bits)"].map(str::to_owned);
        for (wanted, number) in [("0", 0), ("2", 2), ("nvidia", 0), ("ARC", 1), ("770", 1), ("LLVMpipe", 2)] {
            assert_eq!(find(&names, wanted), Ok(number), "{wanted}");
        }
        let several = find(&names, "l").unwrap_err();
        assert!(several.contains("0 NVIDIA L4, 1 Intel Arc A770, 2 llvmpipe"), "{several}");
        for wanted in ["3", "-1", "radeon"] {
            let none = find(&names, wanted).unwrap_err();
            assert!(none.starts_with(&format!("adapter {wanted}: there is none")), "{none}");
            assert!(none.contains("0 NVIDIA L4, 1 Intel"), "{none}");
        }
        assert!(find(&[], "0").unwrap_err().contains("no adapter at all"));
    }
}
