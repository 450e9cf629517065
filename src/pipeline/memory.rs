//! Refusal of results that exceed the machine's memory.

use std::fs;

use super::Error;

/// Results of at least this size are announced.
const LARGE: u64 = 256 << 20;

/// Results up to this size are allowed without asking the system.
const SMALL: u64 = 16 << 20;

/// Results above this size exceed any machine's memory.
const LARGEST: u64 = 1 << 46;

/// Refuses, before any computing, results that exceed the machine's memory. Returns a note on the
/// size of large ones.
///
/// # Errors
///
/// [`Error::Memory`] if less memory is free.
pub fn refuse_memory(bytes: u64) -> Result<Option<String>, Error> {
    if bytes <= SMALL {
        return Ok(None);
    }
    let (megabytes, available) = (|bytes: u64| bytes >> 20, available());
    let available = available.or((bytes > LARGEST).then_some(LARGEST));
    let (needed, free) = (megabytes(bytes), available.map(megabytes));
    if let Some(available) = free.filter(|&free| needed > free) {
        return Err(Error::Memory { needed, available });
    }
    Ok((bytes >= LARGE).then(|| {
        let of = free.map_or(String::new(), |free| format!(" of {free} MB that are free"));
        format!("the results take about {needed} MB of memory{of}")
    }))
}

/// Free memory in bytes according to the system, within the limits of the control group and of this
/// process; `None` if unknown.
fn available() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let free = 1024 * line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?;
    let number = |name: &str| -> Option<u64> {
        let text = fs::read_to_string(format!("/sys/fs/cgroup/{name}")).ok()?;
        text.trim().parse().ok()
    };
    let group = number("memory.max").zip(number("memory.current"));
    let left = [group.map(|(most, used)| most.saturating_sub(used)), left_of_limit()];
    Some(left.into_iter().flatten().fold(free, u64::min))
}

/// Bytes that this process may still map, if it has a limit (`ulimit -v`).
fn left_of_limit() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let most: u64 = line.split_whitespace().next()?.parse().ok()?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmSize:"))?;
    let used = 1024 * line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?;
    Some(most.saturating_sub(used))
}
