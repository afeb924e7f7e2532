//! The host's memory, asked before anything large is allocated.

use crate::error::{Error, Result};
use std::{fs, path::Path};

/// Bytes of a grain as the scene has it.
pub const GRAIN: u64 = 88;
/// Bytes per grain that the host needs besides these and the arrays of an engine, at the end of a run: grains once more as
/// results have them, what is read to find contacts, and who touches whom, or a grid of neighbours. Files of contacts have
/// these one by one, which is 400 more.
const BESIDE_GRAIN: u64 = 250;

/// What so many grains need on the host, bytes: a number that nobody has room for may be beyond 64 bits.
pub fn of_grains(count: u64) -> u128 {
    u128::from(count) * u128::from(GRAIN) + beside_grains(count)
}

/// The same once the scene's grains are there.
pub fn beside_grains(count: u64) -> u128 {
    u128::from(count) * u128::from(BESIDE_GRAIN)
}

/// Refuse what the host's memory cannot hold. Where the system does not tell, everything passes.
///
/// # Errors
/// [`Error::Lacking`] with both numbers of bytes.
pub fn check_host(need: impl Into<u128>) -> Result<()> {
    let need = need.into();
    match available() {
        Some(available) if need > u128::from(available) => Err(Error::Lacking(format!(
            "scene too large: it needs {need} bytes, but {available} bytes of memory are available"
        ))),
        _ => Ok(()),
    }
}

/// Make room for so many more elements.
///
/// # Errors
/// [`Error::Lacking`] where the system gives none.
pub fn reserve<T>(elements: &mut Vec<T>, more: usize) -> Result<()> {
    elements.try_reserve_exact(more).map_err(|_| {
        let need = more as u128 * size_of::<T>() as u128;
        Error::Lacking(format!("scene too large: the system has no room for {need} bytes more"))
    })
}

/// So many elements, all the same.
///
/// # Errors
/// As [`reserve`].
pub fn filled<T: Clone>(element: T, count: usize) -> Result<Vec<T>> {
    let mut elements = Vec::new();
    reserve(&mut elements, count)?;
    elements.resize(count, element);
    Ok(elements)
}

/// The same once more.
///
/// # Errors
/// As [`reserve`].
pub fn copied<T: Clone>(elements: &[T]) -> Result<Vec<T>> {
    let mut copy = Vec::new();
    reserve(&mut copy, elements.len())?;
    copy.extend_from_slice(elements);
    Ok(copy)
}

/// Memory that can be had without swapping, bytes, where the system tells: that of the machine, or what control groups
/// and limits of the process (`ulimit`) leave of it.
pub fn available() -> Option<u64> {
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let machine = entry(&read("/proc/meminfo"), "MemAvailable:").map(|kilobytes| kilobytes * 1024);
    let groups = of_groups(Path::new("/sys/fs/cgroup"), &read("/proc/self/cgroup"));
    let limits = of_limits(&read("/proc/self/limits"), &read("/proc/self/status"));
    [machine, groups, limits].into_iter().flatten().min()
}

/// Limits of a process, as they are called in `/proc/self/limits`, and what counts for them, in `/proc/self/status`.
const LIMITS: [[&str; 2]; 2] = [["Max address space", "VmSize:"], ["Max data size", "VmData:"]];

/// What they leave, bytes.
fn of_limits(limits: &str, status: &str) -> Option<u64> {
    let left = |[limit, used]: [&str; 2]| -> Option<u64> {
        // The first is the one that holds; `unlimited` is no number.
        let limit = limits.lines().find_map(|line| line.strip_prefix(limit))?;
        let limit: u64 = limit.split_whitespace().next()?.parse().ok()?;
        Some(limit.saturating_sub(entry(status, used)? * 1024))
    };
    LIMITS.into_iter().filter_map(left).min()
}

/// The number after a name in a file of names and numbers.
fn entry(text: &str, name: &str) -> Option<u64> {
    let words = text.lines().map(str::split_whitespace);
    let mut values = words.filter_map(|mut words| (words.next() == Some(name)).then(|| words.next()));
    values.next()??.parse().ok()
}

/// A control group of memory: its hierarchy, the files with the limit and with what is used, and in `memory.stat` the
/// part of the latter that is given back for the asking.
const FILES: [[&str; 4]; 2] = [
    ["", "memory.max", "memory.current", "inactive_file"],
    ["memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"],
];

/// What the groups of a process leave it, bytes, given where they are mounted and what `/proc/self/cgroup` says. Limits of
/// the groups above hold too, and in a container these may be all that one sees.
fn of_groups(mount: &Path, own: &str) -> Option<u64> {
    let left = |folder: &Path, [_, limit, used, reclaimable]: [&str; 4]| -> Option<u64> {
        let read = |name: &str| fs::read_to_string(folder.join(name)).ok();
        // `max` is no number.
        let [limit, used] = [read(limit)?.trim().parse::<u64>().ok()?, read(used)?.trim().parse().ok()?];
        let reclaimable = read("memory.stat").and_then(|stat| entry(&stat, reclaimable)).unwrap_or(0);
        Some(limit.saturating_sub(used.saturating_sub(reclaimable)))
    };
    let mut least = None;
    // A line is `number:controllers:/path`.
    for (controllers, path) in own.lines().filter_map(|line| line.split_once(':')?.1.split_once(':')) {
        for files in FILES.into_iter().filter(|files| controllers.split(',').any(|name| name == files[0])) {
            let folders =
                Path::new(path.trim_start_matches('/')).ancestors().map(|path| mount.join(files[0]).join(path));
            least = folders.filter_map(|folder| left(&folder, files)).chain(least).min();
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(folder: &Path, files: &[(&str, &str)]) {
        fs::create_dir_all(folder).unwrap();
        files.iter().for_each(|(name, text)| fs::write(folder.join(name), text).unwrap());
    }

    #[test]
    fn the_strictest_limit_counts() {
        let status = "Name:\tpackstone\nVmSize:\t    3000 kB\nVmData:\t    1000 kB\n";
        let limits = |space: &str, data: &str| {
            format!(
                "Limit                     Soft Limit           Hard Limit           Units     \n\
                 Max data size             {data:<21}unlimited            bytes     \n\
                 Max address space         {space:<21}unlimited            bytes     \n"
            )
        };
        assert_eq!(of_limits(&limits("unlimited", "unlimited"), status), None);
        assert_eq!(of_limits(&limits("4096000", "unlimited"), status), Some(1_024_000));
        assert_eq!(of_limits(&limits("4096000", "1536000"), status), Some(512_000));
        assert_eq!(of_limits(&limits("1024", "unlimited"), status), Some(0));
        assert_eq!(of_limits("", ""), None);
    }

    /// More than can be numbered.
    #[test]
    fn no_number_of_grains_is_too_large_to_be_refused() {
        let of_each = u128::from(GRAIN + BESIDE_GRAIN);
        assert_eq!(of_grains(1_000_000_000_000_000_000), 1_000_000_000_000_000_000 * of_each);
        assert!(of_grains(u64::MAX) > of_grains(u64::MAX - 1));
        if available().is_some() {
            let message = check_host(of_grains(u64::MAX)).unwrap_err().to_string();
            let needed = format!("too large: it needs {} bytes", u128::from(u64::MAX) * of_each);
            assert!(message.contains(&needed), "{message}");
        }
        let message = filled(0_u64, usize::MAX / 16).unwrap_err().to_string();
        assert!(message.contains("no room for 9223372036854775800 bytes"), "{message}");
    }

    #[test]
    fn the_strictest_control_group_counts() {
        let folder = tempfile::tempdir().unwrap();
        let mount = folder.path();
        assert_eq!(of_groups(mount, "0::/a/b\n"), None);
        let stat = "anon 700\ninactive_file 250\nactive_file 50\n";
        group(&mount.join("a/b"), &[("memory.max", "max\n"), ("memory.current", "900\n")]);
        assert_eq!(of_groups(mount, "0::/a/b\n"), None);
        group(&mount.join("a"), &[("memory.max", "1500\n"), ("memory.current", "1000\n"), ("memory.stat", stat)]);
        assert_eq!(of_groups(mount, "0::/a/b\n"), Some(750));
        group(&mount.join("a/b"), &[("memory.max", "1200\n")]);
        assert_eq!(of_groups(mount, "0::/a/b\n"), Some(300));
        // More is in use than a limit that was lowered later allows.
        group(&mount.join("a/b"), &[("memory.max", "800\n")]);
        assert_eq!(of_groups(mount, "0::/a/b\n"), Some(0));
    }

    /// The older kind of groups, in a container that sees its own group as the root.
    #[test]
    fn older_control_groups_count_too() {
        let folder = tempfile::tempdir().unwrap();
        let files = [
            ("memory.limit_in_bytes", "4000\n"),
            ("memory.usage_in_bytes", "3000\n"),
            ("memory.stat", "inactive_file 1\ntotal_inactive_file 500\n"),
        ];
        group(&folder.path().join("memory"), &files);
        let own = "5:cpu,cpuacct:/docker/1\n4:hugetlb,memory:/docker/1\n0::/\n";
        assert_eq!(of_groups(folder.path(), own), Some(1500));
        assert_eq!(of_groups(folder.path(), "5:cpu,cpuacct:/docker/1\n"), None);
    }
}
