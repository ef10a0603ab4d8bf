//! What a developer reads while a task runs: headings, notes, a closing table of steps. All on stderr.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Prints the heading of a step.
pub(crate) fn heading(title: &str) {
    if std::io::stderr().is_terminal() {
        eprintln!("\n\x1b[1;36m== {title}\x1b[0m");
    } else {
        eprintln!("\n== {title}");
    }
}

/// Prints one line that says what is being done and why.
pub(crate) fn note(text: impl AsRef<str>) {
    eprintln!("   {}", text.as_ref());
}

/// Prints why the task ended early, cause by cause.
pub(crate) fn failure(error: &anyhow::Error) {
    eprintln!("\nerror: {error}");
    for cause in error.chain().skip(1) {
        eprintln!("  because {cause}");
    }
}

/// A duration as people read it: `0.42 s`, `12.3 s`, `3 min 07 s`.
pub(crate) fn seconds(duration: Duration) -> String {
    let total = duration.as_secs_f64();
    match total {
        t if t < 1.0 => format!("{t:.2} s"),
        t if t < 60.0 => format!("{t:.1} s"),
        t => format!("{} min {:02} s", (t / 60.0) as u64, (t % 60.0) as u64),
    }
}

/// How a step ended.
enum Outcome {
    Passed,
    Failed(String),
    Skipped(String),
}

/// The steps of a task, each run under a heading, with a table of outcomes and durations at the end.
#[derive(Default)]
pub(crate) struct Steps {
    done: Vec<(&'static str, Outcome, Duration)>,
}

impl Steps {
    /// Runs one step; a failure is kept for the table and does not stop the steps after it. What only a person can
    /// fix ([`crate::packages::NeedsYou`]) is passed on at once.
    pub(crate) fn run(
        &mut self,
        name: &'static str,
        step: impl FnOnce() -> anyhow::Result<()>,
    ) -> anyhow::Result<bool> {
        heading(name);
        let start = Instant::now();
        let outcome = match step() {
            Ok(()) => Outcome::Passed,
            Err(error) if error.is::<crate::packages::NeedsYou>() => return Err(error),
            Err(error) => {
                failure(&error);
                Outcome::Failed(error.to_string())
            }
        };
        let passed = matches!(outcome, Outcome::Passed);
        self.done.push((name, outcome, start.elapsed()));
        Ok(passed)
    }

    /// Records a step that is left out, and why.
    pub(crate) fn skip(&mut self, name: &'static str, why: impl Into<String>) {
        self.done.push((name, Outcome::Skipped(why.into()), Duration::ZERO));
    }

    /// Prints the table; an error names the steps that failed.
    pub(crate) fn finish(self) -> anyhow::Result<()> {
        heading("Summary");
        let mut failed = Vec::new();
        for (name, outcome, duration) in &self.done {
            let (word, remark) = match outcome {
                Outcome::Passed => ("passed", ""),
                Outcome::Failed(why) => {
                    failed.push(*name);
                    ("FAILED", why.as_str())
                }
                Outcome::Skipped(why) => ("skipped", why.as_str()),
            };
            let line = format!("{name:<24} {word:<8} {:>12}  {remark}", seconds(*duration));
            note(line.trim_end());
        }
        if failed.is_empty() { Ok(()) } else { Err(anyhow::anyhow!("failed: {}", failed.join(", "))) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_read_well() {
        assert_eq!(seconds(Duration::from_millis(420)), "0.42 s");
        assert_eq!(seconds(Duration::from_millis(12_340)), "12.3 s");
        assert_eq!(seconds(Duration::from_secs(187)), "3 min 07 s");
    }

    #[test]
    fn a_failed_step_fails_the_task_and_lets_the_next_one_run() {
        let mut steps = Steps::default();
        assert!(!steps.run("first", || anyhow::bail!("broken")).expect("kept for the table"));
        assert!(steps.run("second", || Ok(())).expect("runs"));
        let error = steps.finish().expect_err("one step failed");
        assert_eq!(error.to_string(), "failed: first");
    }
}
