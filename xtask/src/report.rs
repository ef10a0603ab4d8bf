//! What a developer reads while a task runs: headings, notes, a closing table of steps. All on stderr.

use crate::tally::{Skipped, Tally};
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

/// Names of skipped tests that the summary gives for one reason; the rest are counted.
const NAMED: usize = 4;

/// One step of a task.
struct Step {
    name: &'static str,
    outcome: Outcome,
    duration: Duration,
    tally: Tally,
}

/// The steps of a task, each run under a heading, with a table of outcomes and durations at the end.
#[derive(Default)]
pub(crate) struct Steps {
    done: Vec<Step>,
}

impl Steps {
    /// Runs one step, which may count tests; a failure is kept for the table and does not stop the steps after it. What
    /// only a person can fix ([`crate::packages::NeedsYou`]) is passed on at once.
    pub(crate) fn run(
        &mut self,
        name: &'static str,
        step: impl FnOnce(&mut Tally) -> anyhow::Result<()>,
    ) -> anyhow::Result<bool> {
        heading(name);
        let start = Instant::now();
        let mut tally = Tally::default();
        let outcome = match step(&mut tally) {
            Ok(()) => Outcome::Passed,
            Err(error) if error.is::<crate::packages::NeedsYou>() => return Err(error),
            Err(error) => {
                failure(&error);
                Outcome::Failed(error.to_string())
            }
        };
        let passed = matches!(outcome, Outcome::Passed);
        self.done.push(Step { name, outcome, duration: start.elapsed(), tally });
        Ok(passed)
    }

    /// Records a step that is left out, and why.
    pub(crate) fn skip(&mut self, name: &'static str, why: impl Into<String>) {
        let outcome = Outcome::Skipped(why.into());
        self.done.push(Step { name, outcome, duration: Duration::ZERO, tally: Tally::default() });
    }

    /// Prints the table and what was skipped; an error names the steps that failed.
    pub(crate) fn finish(self) -> anyhow::Result<()> {
        heading("Summary");
        for step in &self.done {
            note(step.row());
        }
        let total = self.done.iter().map(|step| step.duration).sum();
        note(format!("{:<24} {:<8} {:>12}", "in all", "", seconds(total)));
        let lines: Vec<String> = self.done.iter().flat_map(Step::skipped).collect();
        if !lines.is_empty() {
            heading("Skipped tests");
            lines.iter().for_each(note);
        }
        let failed: Vec<&str> = self.done.iter().filter(|step| step.failed()).map(|step| step.name).collect();
        if failed.is_empty() { Ok(()) } else { Err(anyhow::anyhow!("failed: {}", failed.join(", "))) }
    }
}

impl Step {
    fn failed(&self) -> bool {
        matches!(self.outcome, Outcome::Failed(_))
    }

    /// Name, outcome, duration, and what there is to say of it.
    fn row(&self) -> String {
        let (word, why) = match &self.outcome {
            Outcome::Passed => ("passed", ""),
            Outcome::Failed(why) => ("FAILED", why.as_str()),
            Outcome::Skipped(why) => ("skipped", why.as_str()),
        };
        let counts = self.tally.words();
        let between = if counts.is_empty() || why.is_empty() { "" } else { ": " };
        let row = format!("{:<24} {word:<8} {:>12}  {counts}{between}{why}", self.name, seconds(self.duration));
        row.trim_end().to_owned()
    }

    /// A line for each reason for which tests of this step were skipped.
    fn skipped(&self) -> Vec<String> {
        let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
        for Skipped { test, why } in &self.tally.skipped {
            match reasons.iter_mut().find(|(reason, _)| reason == why) {
                Some((_, tests)) => tests.push(test),
                None => reasons.push((why, vec![test])),
            }
        }
        let line = |(why, tests): (&str, Vec<&str>)| {
            let more = tests.len().saturating_sub(NAMED);
            let names = tests[..tests.len() - more].join(", ");
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let why = if why.is_empty() { "no reason is given" } else { why };
            format!("{}: {} ({why}): {names}{more}", self.name, tests.len())
        };
        reasons.into_iter().map(line).collect()
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
        assert!(!steps.run("first", |_| anyhow::bail!("broken")).expect("kept for the table"));
        assert!(steps.run("second", |_| Ok(())).expect("runs"));
        let error = steps.finish().expect_err("one step failed");
        assert_eq!(error.to_string(), "failed: first");
    }

    #[test]
    fn skipped_tests_are_listed_by_reason() {
        let skipped = |test: &str, why: &str| Skipped { test: test.to_owned(), why: why.to_owned() };
        let many = ["a", "b", "c", "d", "e", "f"].map(|test| skipped(test, "no data"));
        let tally = Tally { passed: 9, failed: 0, skipped: many.into_iter().chain([skipped("x", "")]).collect() };
        let step = Step { name: "rust tests", outcome: Outcome::Passed, duration: Duration::from_secs(61), tally };
        assert_eq!(step.row(), "rust tests               passed     1 min 01 s  9 passed, 7 skipped");
        let lines = step.skipped();
        assert_eq!(lines[0], "rust tests: 6 (no data): a, b, c, d and 2 more");
        assert_eq!(lines[1], "rust tests: 1 (no reason is given): x");
    }
}
