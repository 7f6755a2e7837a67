//! How much memory there is, and how much was used.

use std::fs;
use std::path::Path;

use crate::error::JobError;

/// Bytes that may still be taken: what the system has left, or the control group or the limit of the process's
/// address space (`ulimit -v`) if that is less. `None` where the system does not say.
pub fn available() -> Option<u64> {
    let system = kibibytes(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:");
    let own = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let path = own.lines().find_map(|line| line.strip_prefix("0::")).unwrap_or("/");
    let group = group_room(Path::new("/sys/fs/cgroup"), path);
    [system, group, address_room()].into_iter().flatten().min()
}

/// Bytes that the samples of an image may take: what is available, but for an eighth that is left to all else.
pub(crate) fn room() -> Option<u64> {
    available().map(|bytes| bytes / 8 * 7)
}

/// What is left of the address space that this process may have.
fn address_room() -> Option<u64> {
    let limit = address_limit(&fs::read_to_string("/proc/self/limits").ok()?)?;
    let used = kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmSize:")?;
    Some(limit.saturating_sub(used))
}

/// The soft limit of the address space, in bytes, of a table of limits; none if there is none.
fn address_limit(limits: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// The most bytes that this process has held at once.
pub fn peak() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// The value of a line such as `VmHWM:  1234 kB`, in bytes.
fn kibibytes(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// The least room left in a control group and those around it. Files that the system would drop
/// from memory count as room.
fn group_room(root: &Path, own: &str) -> Option<u64> {
    let mut room = None;
    let own = root.join(own.trim_start_matches('/'));
    for folder in own.ancestors().take_while(|folder| folder.starts_with(root)) {
        let number = |name: &str| -> Option<u64> {
            fs::read_to_string(folder.join(name)).ok()?.trim().parse().ok()
        };
        let (Some(limit), Some(used)) = (number("memory.max"), number("memory.current")) else {
            continue;
        };
        let stat = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let inactive = stat.lines().find_map(|line| line.strip_prefix("inactive_file "));
        let dropped = inactive.and_then(|n| n.trim().parse::<u64>().ok()).unwrap_or(0);
        let left = limit.saturating_sub(used.saturating_sub(dropped));
        room = Some(room.map_or(left, |r: u64| r.min(left)));
    }
    room
}

/// A number of bytes for people.
pub fn text(bytes: u64) -> String {
    let mib = bytes as f64 / (1 << 20) as f64;
    if mib < 1024.0 { format!("{mib:.0} MiB") } else { format!("{:.1} GiB", mib / 1024.0) }
}

/// The memory available, if that is less than what is needed.
fn lack(needed: u64) -> Option<u64> {
    available().filter(|&available| needed > available)
}

/// Refuses a file that is larger than the memory available.
pub(crate) fn check_file(path: &Path) -> Result<(), JobError> {
    let bytes = path.metadata().map_or(0, |m| m.len());
    let Some(available) = lack(bytes) else { return Ok(()) };
    let (bytes, available) = (text(bytes), text(available));
    let message = format!("holds {bytes}; expected less than the {available} of memory left");
    Err(JobError::memory(message).about(path))
}

/// Refuses an image whose potential, so many bytes a sample with what it is made of, does not fit; `verb` is what may be
/// done to a part of it.
pub(crate) fn check_potential(
    sample_count: usize,
    bytes_each: f64,
    verb: &str,
) -> Result<(), JobError> {
    let needed = (bytes_each * sample_count as f64) as u64;
    let Some(available) = lack(needed) else { return Ok(()) };
    let (needed, available) = (text(needed), text(available));
    let message = format!("the potential needs {needed} of memory; {available} are left");
    let advice = format!("{verb} a box of interest by --crop, or resample the image");
    Err(JobError::memory(message).advise(advice))
}

/// Refuses equations of flow that do not fit.
pub(crate) fn check_equations(needed: u64) -> Result<(), JobError> {
    let Some(available) = lack(needed) else { return Ok(()) };
    let (needed, available) = (text(needed), text(available));
    let message = format!("the equations need some {needed} of memory; {available} are left");
    Err(JobError::memory(message).advise("choose a lower --order, or a greater --size"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_proc_are_in_kibibytes() {
        let text = "MemTotal:       100 kB\nMemAvailable:    64 kB\n";
        assert_eq!(kibibytes(text, "MemAvailable:"), Some(65_536));
        assert_eq!(kibibytes(text, "VmHWM:"), None);
        assert_eq!(kibibytes("VmHWM: x kB", "VmHWM:"), None);
    }

    #[test]
    fn limits_of_the_address_space_are_in_bytes_or_unlimited() {
        let table = |soft: &str| {
            format!(
                "Limit                     Soft Limit           Hard Limit           Units     \n\
                 Max locked memory         8388608              8388608              bytes     \n\
                 Max address space         {soft:<20} unlimited            bytes     \n"
            )
        };
        assert_eq!(address_limit(&table("4096000000")), Some(4_096_000_000));
        assert_eq!(address_limit(&table("unlimited")), None);
        assert_eq!(address_limit(""), None);
    }

    #[test]
    fn the_tightest_group_counts_and_files_in_memory_are_room() {
        let root = tempfile::tempdir().unwrap();
        let inner = root.path().join("a/b");
        fs::create_dir_all(&inner).unwrap();
        assert_eq!(group_room(root.path(), "/a/b"), None);
        fs::write(inner.join("memory.max"), "max\n").unwrap();
        fs::write(inner.join("memory.current"), "5\n").unwrap();
        assert_eq!(group_room(root.path(), "/a/b"), None);
        let outer = root.path().join("a");
        fs::write(outer.join("memory.max"), "100\n").unwrap();
        fs::write(outer.join("memory.current"), "80\n").unwrap();
        fs::write(outer.join("memory.stat"), "anon 50\ninactive_file 30\n").unwrap();
        assert_eq!(group_room(root.path(), "/a/b"), Some(50));
        assert_eq!(group_room(root.path(), "/"), None);
    }
}
