//! What a command was asked for on stdout: it is there as a whole, or the command says that it is not and fails. People's text
//! goes to stderr ([`crate::stderr`]), where it may be lost.

use crate::commands::Failure;
use anyhow::anyhow;
use serde::Serialize;
use std::io::{self, Write};

/// Prints `value` as one JSON object and a line's end.
///
/// # Errors
/// [`Failure::Work`] if it could not be written as a whole: the reader has closed the pipe, the disk is full.
pub(crate) fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    let mut text = serde_json::to_vec(value)?;
    text.push(b'\n');
    print(&text)
}

/// [`print_json`] on many lines, for people too.
///
/// # Errors
/// As [`print_json`].
pub(crate) fn print_pretty_json(value: &impl Serialize) -> Result<(), Failure> {
    let mut text = serde_json::to_vec_pretty(value)?;
    text.push(b'\n');
    print(&text)
}

/// Prints `text`.
///
/// # Errors
/// As [`print_json`].
pub(crate) fn print(text: &[u8]) -> Result<(), Failure> {
    write(&mut io::stdout().lock(), text)
}

fn write(out: &mut impl Write, text: &[u8]) -> Result<(), Failure> {
    // Without a flush an error of the last bytes would show at the end of the process, and nobody would see it.
    let written = out.write_all(text).and_then(|()| out.flush());
    written.map_err(|error| Failure::Work(anyhow!("stdout could not be written: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::BufWriter;

    /// A place that takes nothing.
    struct Full;

    impl Write for Full {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(io::ErrorKind::StorageFull.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn what_a_buffer_took_and_could_not_pass_on_is_an_error() {
        let failure = write(&mut BufWriter::new(Full), b"{}\n").expect_err("nothing was written");
        assert!(failure.reason().contains("stdout"), "{}", failure.reason());
        assert_eq!(failure.into_parts().0, 1);
    }
}
