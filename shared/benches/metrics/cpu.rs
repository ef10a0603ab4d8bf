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

/// The cheapest of `runs` runs, and the last result.
pub(crate) fn cheapest<T>(runs: u32, mut run: impl FnMut() -> T) -> (Seconds, T) {
    let mut measure = || {
        let (start, clock) = (cpu_seconds(), Instant::now());
        let result = run();
        let wall_s = clock.elapsed().as_secs_f64();
        let cpu_s = start.zip(cpu_seconds()).map_or(wall_s, |(start, end)| end - start);
        (Seconds { cpu_s, wall_s }, result)
    };
    let (mut best, mut result) = measure();
    for _ in 1..runs {
        let (seconds, next) = measure();
        best = Seconds { cpu_s: best.cpu_s.min(seconds.cpu_s), wall_s: best.wall_s.min(seconds.wall_s) };
        result = next;
    }
    (best, result)
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
