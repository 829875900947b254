//! How much memory there is.

/// Refuses what takes more memory than there is, before it is asked for. Where nobody knows how much that is, everything
/// passes.
///
/// # Errors
/// Says how much it takes and how much there is, as the end of a sentence.
pub(crate) fn check(bytes: u128) -> Result<(), String> {
    match available() {
        Some(there) if bytes > u128::from(there) => {
            Err(format!("take {}, and there is {} of memory", size(bytes), size(there.into())))
        }
        _ => Ok(()),
    }
}

/// Refuses a header that claims more bytes than a file of this length can hold, whatever its compression: deflate makes at most
/// 1032 of one.
///
/// # Errors
/// Names both lengths.
pub(crate) fn plausible(claimed: u64, length: u64) -> Result<(), String> {
    const MOST: u64 = 1032;
    // Headers and tables are not compressed, and what is nearly empty may be a little over.
    if claimed <= MOST.saturating_mul(length.saturating_add(64)) {
        return Ok(());
    }
    Err(format!("its header claims {claimed} bytes, which a file of {length} bytes cannot hold"))
}

/// Bytes that the program may still ask for, as far as Linux tells: what is free, within the limit of the process.
fn available() -> Option<u64> {
    let swap = field("/proc/meminfo", "SwapFree:").unwrap_or(0);
    let free = field("/proc/meminfo", "MemAvailable:")? + swap;
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let limit = limits.lines().find_map(|l| l.strip_prefix("Max address space"));
    let limit = limit.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok());
    let used = field("/proc/self/status", "VmSize:").unwrap_or(0);
    Some(limit.map_or(free, |limit| free.min(limit.saturating_sub(used))))
}

/// A number of kilobytes in a file of such lines, in bytes.
fn field(file: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix(name))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
}

fn size(bytes: u128) -> String {
    match bytes as f64 / 1e9 {
        gigabytes if gigabytes < 0.1 => format!("{:.0} MB", 1e3 * gigabytes),
        gigabytes => format!("{gigabytes:.1} GB"),
    }
}
