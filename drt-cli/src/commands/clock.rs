//! Wall time and processor time.

use std::time::Instant;

/// Measures from its start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    start: Instant,
    cpu: Option<f64>,
}

impl Clock {
    pub(super) fn start() -> Self {
        Self { start: Instant::now(), cpu: cpu_seconds() }
    }

    /// Wall time since the start.
    pub(super) fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Processor time of all threads since the start; the wall time where it is not known.
    pub(super) fn cpu_seconds(&self) -> f64 {
        match (self.cpu, cpu_seconds()) {
            (Some(start), Some(now)) => now - start,
            _ => self.seconds(),
        }
    }
}

/// Processor time of this process so far, user and system; `None` where Linux's account is missing.
fn cpu_seconds() -> Option<f64> {
    /// Clock ticks per second in this file, whatever the kernel counts inside.
    const USER_HZ: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is the program's name in parentheses and may contain anything.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut fields = rest.split_whitespace().skip(11);
    let user: f64 = fields.next()?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    Some((user + system) / USER_HZ)
}
