//! What test runners report, read from their output: how many tests passed and failed, and which were skipped and why.
//!
//! Three runners are understood: cargo test (libtest), pytest, and Node's `spec` reporter. Skipped is what the runner
//! calls ignored, skipped or deselected. A Rust test that cannot do its work on this machine has no such word in
//! libtest: it prints a line `SKIPPED: why` and returns, and is counted as passed and listed as skipped.

/// Results of one or more test runs.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    /// Tests that passed.
    pub(crate) passed: usize,
    /// Tests that failed.
    pub(crate) failed: usize,
    /// Tests that were not run, or not to their end, in the order of the output.
    pub(crate) skipped: Vec<Skipped>,
}

/// A test, or several, that did not run.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Skipped {
    /// Its name, or how many there are where the runner gives no names.
    pub(crate) test: String,
    /// The reason that the runner or the test gives.
    pub(crate) why: String,
}

impl Tally {
    fn skip(&mut self, test: &str, why: &str) {
        self.skipped.push(Skipped { test: test.trim().to_owned(), why: why.trim().to_owned() });
    }

    /// `412 passed, 1 failed, 3 skipped`; what is zero is left out. Empty if no test ran.
    pub(crate) fn words(&self) -> String {
        let counts = [(self.passed, "passed"), (self.failed, "failed"), (self.skipped.len(), "skipped")];
        let words = counts.iter().filter(|(count, _)| *count > 0).map(|(count, word)| format!("{count} {word}"));
        words.collect::<Vec<_>>().join(", ")
    }
}

/// Reads cargo test's output line by line. It must be run with `--show-output`, so that what passed tests print can be
/// looked through for their `SKIPPED:` lines; the rest of that is not shown.
#[derive(Default)]
pub(crate) struct CargoTest {
    /// Inside the section that repeats what passed tests printed.
    in_successes: bool,
    /// The test whose output is being read.
    test: String,
}

impl CargoTest {
    /// Counts one line; says whether it is to be shown.
    pub(crate) fn read(&mut self, line: &str, tally: &mut Tally) -> bool {
        if let Some(counts) = line.strip_prefix("test result: ") {
            self.in_successes = false;
            tally.passed += count_before(counts, "passed");
            tally.failed += count_before(counts, "failed");
        } else if line == "successes:" {
            self.in_successes = true;
        } else if line == "failures:" {
            self.in_successes = false;
        } else if self.in_successes {
            if let Some(name) = line.strip_prefix("---- ").and_then(|rest| rest.strip_suffix(" stdout ----")) {
                name.clone_into(&mut self.test);
            } else if let Some((_, why)) = line.split_once("SKIPPED: ") {
                tally.skip(&self.test, why);
            }
        } else if let Some((name, why)) = line.strip_prefix("test ").and_then(|rest| rest.split_once(" ... ignored")) {
            tally.skip(name, why.trim_start_matches([',', ' ']));
        }
        !self.in_successes
    }
}

/// Reads one line of pytest's output, which must be asked for skipped tests (`-rs`).
pub(crate) fn read_pytest(line: &str, tally: &mut Tally) {
    if let Some(rest) = line.strip_prefix("SKIPPED [") {
        // SKIPPED [1] tests/with_torch/test_train.py:8: needs PyTorch
        if let Some((place, why)) = rest.split_once("] ").and_then(|(_, rest)| rest.split_once(": ")) {
            let file = place.rsplit_once(':').map_or(place, |(file, _)| file);
            tally.skip(file, why);
        }
        return;
    }
    // 29 passed, 5 skipped, 6 deselected in 0.81s
    let Some((counts, _)) = line.trim_matches(['=', ' ']).split_once(" in ") else { return };
    if !counts.starts_with(|c: char| c.is_ascii_digit()) {
        return;
    }
    tally.passed += count_before(counts, "passed");
    tally.failed += count_before(counts, "failed") + count_before(counts, "error");
    let deselected = count_before(counts, "deselected");
    if deselected > 0 {
        tally.skip(&format!("{deselected} tests"), "slow: `python -m pytest -m slow` runs them");
    }
}

/// Reads one line of the `spec` reporter of Node's test runner.
pub(crate) fn read_node(line: &str, tally: &mut Tally) {
    let line = line.trim();
    if let Some(rest) = line.strip_prefix("ℹ ") {
        match rest.split_once(' ') {
            Some(("pass", count)) => tally.passed += count.parse().unwrap_or(0),
            Some(("fail" | "cancelled", count)) => tally.failed += count.parse().unwrap_or(0),
            _ => {}
        }
    } else if let Some(rest) = line.strip_prefix("﹣ ") {
        // ﹣ name (0.1ms) # why
        let (name, why) = rest.split_once(" # ").unwrap_or((rest, "skipped"));
        tally.skip(name.rsplit_once(" (").map_or(name, |(name, _)| name), why);
    }
}

/// The number before a word, as in `12 passed; 1 failed`; 0 where the word is not there. Plurals count too.
fn count_before(text: &str, word: &str) -> usize {
    let words: Vec<&str> = text.split([' ', ',', ';']).filter(|word| !word.is_empty()).collect();
    let pair = words.windows(2).find(|pair| pair[1].trim_end_matches('s') == word);
    pair.and_then(|pair| pair[0].parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn skipped(test: &str, why: &str) -> Skipped {
        Skipped { test: test.to_owned(), why: why.to_owned() }
    }

    #[test]
    fn cargo_test_is_counted_and_what_passed_tests_print_is_not_shown() {
        let output = "\
running 3 tests
test a ... ok
test b::needs_data ... ignored, SEMASCAN_DATA is not set
test c ... ok

successes:

---- c stdout ----
SKIPPED: there is no ONNX Runtime
something else

successes:
    a
    c

test result: ok. 2 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.00s
test d ... FAILED

failures:

---- d stdout ----
this is why

failures:
    d

test result: FAILED. 0 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s";
        let (mut reader, mut tally) = (CargoTest::default(), Tally::default());
        let shown: Vec<&str> = output.lines().filter(|line| reader.read(line, &mut tally)).collect();
        assert_eq!((tally.passed, tally.failed), (2, 1));
        let expected = [skipped("b::needs_data", "SEMASCAN_DATA is not set"), skipped("c", "there is no ONNX Runtime")];
        assert_eq!(tally.skipped, expected);
        assert!(
            shown.contains(&"this is why") && shown.iter().filter(|line| line.starts_with("test result")).count() == 2
        );
        assert!(!shown.contains(&"something else"));
    }

    #[test]
    fn pytest_is_counted() {
        let mut tally = Tally::default();
        for line in [
            "......ss [100%]",
            "SKIPPED [1] tests/with_torch/test_train.py:8: needs PyTorch",
            "== 1 failed, 29 passed, 1 skipped, 6 deselected, 1 error in 0.81s ==",
        ] {
            read_pytest(line, &mut tally);
        }
        assert_eq!((tally.passed, tally.failed), (29, 2));
        assert_eq!(tally.skipped[0], skipped("tests/with_torch/test_train.py", "needs PyTorch"));
        assert_eq!(tally.skipped[1].test, "6 tests");
        assert_eq!(tally.words(), "29 passed, 2 failed, 2 skipped");
    }

    #[test]
    fn nodes_runner_is_counted() {
        let mut tally = Tally::default();
        for line in ["✔ draws (12.1ms)", "  ﹣ on a GPU (0.1ms) # there is none", "ℹ tests 3", "ℹ pass 1", "ℹ fail 1"]
        {
            read_node(line, &mut tally);
        }
        assert_eq!((tally.passed, tally.failed), (1, 1));
        assert_eq!(tally.skipped, [skipped("on a GPU", "there is none")]);
    }
}
