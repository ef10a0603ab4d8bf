//! Running other programs: shown before they start, an error that quotes the command line, an optional time limit.

use anyhow::{Context, Result, bail};
use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// The command line as a person would type it (arguments with blanks are quoted; variables set for it come first).
pub(crate) fn line(command: &Command) -> String {
    let quoted = |text: &std::ffi::OsStr| {
        let text = text.to_string_lossy().into_owned();
        let plain = !text.is_empty() && !text.contains(|c: char| c.is_whitespace() || "\"'*?&;|<>$[]".contains(c));
        if plain { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
    };
    let variables = command
        .get_envs()
        .filter_map(|(name, value)| value.map(|value| format!("{}={}", name.to_string_lossy(), quoted(value))));
    variables.chain([quoted(command.get_program())]).chain(command.get_args().map(quoted)).collect::<Vec<_>>().join(" ")
}

/// Shows and runs a command to its end.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    eprintln!("   $ {}", line(command));
    let status = command.status().with_context(|| format!("cannot start `{}`", line(command)))?;
    if !status.success() {
        bail!("`{}` ended with {status}", line(command));
    }
    Ok(())
}

/// Shows and runs a command; past `limit` it is ended and counts as failed.
pub(crate) fn run_within(command: &mut Command, limit: Duration) -> Result<()> {
    eprintln!("   $ {}", line(command));
    let mut child =
        command.stdin(Stdio::null()).spawn().with_context(|| format!("cannot start `{}`", line(command)))?;
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            if status.success() {
                return Ok(());
            }
            bail!("`{}` ended with {status}", line(command));
        }
        if start.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            bail!("`{}` did not end within {} s", line(command), limit.as_secs());
        }
        sleep(Duration::from_millis(50));
    }
}

/// Shows and runs a command to its end; each line that it writes on stdout is passed to `read`, which says whether it is
/// shown.
pub(crate) fn run_reading(command: &mut Command, mut read: impl FnMut(&str) -> bool) -> Result<()> {
    eprintln!("   $ {}", line(command));
    let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
    let mut child = child.with_context(|| format!("cannot start `{}`", line(command)))?;
    let stdout = child.stdout.take().context("the command has no stdout")?;
    for bytes in BufReader::new(stdout).split(b'\n') {
        let bytes = bytes?;
        let text = String::from_utf8_lossy(&bytes);
        if read(text.trim_end_matches('\r')) {
            let mut ours = std::io::stdout().lock();
            ours.write_all(&bytes)?;
            ours.write_all(b"\n")?;
        }
    }
    let status = child.wait()?;
    if !status.success() {
        bail!("`{}` ended with {status}", line(command));
    }
    Ok(())
}

/// Runs a command quietly and gives back what it wrote on stdout, trimmed.
pub(crate) fn capture(command: &mut Command) -> Result<String> {
    let output = command.output().with_context(|| format!("cannot start `{}`", line(command)))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        bail!("`{}` ended with {}: {}", line(command), output.status, said.trim());
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Whether a program can be started at all (`program --version` runs).
pub(crate) fn exists(program: &str) -> bool {
    Command::new(program)
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|s| s.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_can_be_pasted_into_a_shell() {
        let mut command = Command::new("cargo");
        command.env("RUSTFLAGS", "-C a -C b").args(["build", "--config", "x=[\"y\"]"]);
        assert_eq!(line(&command), "RUSTFLAGS='-C a -C b' cargo build --config 'x=[\"y\"]'");
    }

    #[test]
    fn what_a_command_writes_is_read_line_by_line() {
        let mut lines = Vec::new();
        let mut read = |line: &str| {
            lines.push(line.to_owned());
            false
        };
        run_reading(Command::new("printf").arg("one\\ntwo\\n"), &mut read).expect("ends well");
        assert!(run_reading(Command::new("false").arg("x"), &mut read).is_err());
        assert_eq!(lines, ["one", "two"]);
    }

    #[test]
    fn a_command_past_its_limit_is_an_error() {
        let error = run_within(Command::new("sleep").arg("20"), Duration::from_millis(100)).expect_err("too slow");
        assert!(error.to_string().contains("did not end within"), "{error}");
    }

    #[test]
    fn a_program_that_is_not_there_is_named() {
        let error = capture(&mut Command::new("no-such-program-anywhere")).expect_err("not there");
        assert!(error.to_string().contains("no-such-program-anywhere"), "{error}");
    }
}
