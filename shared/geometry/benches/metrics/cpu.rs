//! CPU time, which other work on the machine changes little.

use std::time::Instant;

/// Seconds that something took.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub(crate) struct Seconds {
    /// CPU time of all threads, where the system tells.
    pub(crate) cpu_s: f64,
    /// Time on the wall.
    pub(crate) wall_s: f64,
}

/// What one run took, and its result.
pub(crate) fn measure<T>(run: impl FnOnce() -> T) -> (Seconds, T) {
    let (start, clock) = (cpu_seconds(), Instant::now());
    let result = run();
    let wall_s = clock.elapsed().as_secs_f64();
    let cpu_s = start.zip(cpu_seconds()).map_or(wall_s, |(start, end)| end - start);
    (Seconds { cpu_s, wall_s }, result)
}

/// The cheapest of `runs` runs, and the last result.
pub(crate) fn cheapest<T>(runs: u32, mut run: impl FnMut() -> T) -> (Seconds, T) {
    let (mut best, mut result) = measure(&mut run);
    for _ in 1..runs {
        let (seconds, next) = measure(&mut run);
        best = best.min(seconds);
        result = next;
    }
    (best, result)
}

impl Seconds {
    /// The smaller of each.
    pub(crate) fn min(self, other: Self) -> Self {
        Self { cpu_s: self.cpu_s.min(other.cpu_s), wall_s: self.wall_s.min(other.wall_s) }
    }
}

/// CPU time of every thread that this process has; they live as long as the benchmark.
fn cpu_seconds() -> Option<f64> {
    let mut sum = 0.0;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let stat = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        sum += stat.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9;
    }
    Some(sum)
}
