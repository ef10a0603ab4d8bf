//! People's text on stderr, which must never stop the work: a closed stderr, a full disk behind it, or a pipe that nobody
//! reads costs the text and nothing else.
//!
//! What could not be written is counted, and said as soon as something can be written again.

use std::io::{self, Write};
use std::time::Duration;

/// Bytes that a pipe takes at once without waiting, where it says that it takes any (POSIX: `PIPE_BUF` is 512 at least, on
/// Linux 4096).
const AT_ONCE: usize = 512;
/// How long a reader that was reading is waited for.
const PATIENCE: Duration = Duration::from_millis(100);

/// A writer to stderr that always succeeds.
#[derive(Debug)]
pub(crate) struct Stderr<W = io::Stderr> {
    out: W,
    lost: u64,
}

impl Default for Stderr {
    fn default() -> Self {
        Self { out: io::stderr(), lost: 0 }
    }
}

impl<W: Write + Ready> Stderr<W> {
    /// Whether all of `text` was written.
    fn put(&mut self, text: &[u8]) -> bool {
        // Who has not read for that long is not waited for again before it reads.
        let patience = if self.lost > 0 { Duration::ZERO } else { PATIENCE };
        text.chunks(AT_ONCE).all(|piece| self.out.is_ready(patience) && self.out.write_all(piece).is_ok())
    }
}

impl<W: Write + Ready> Write for Stderr<W> {
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        if self.lost > 0 {
            let note = format!("... {} pieces of text are missing here: they could not be written\n", self.lost);
            if self.put(note.as_bytes()) {
                self.lost = 0;
            }
        }
        // What belongs together comes together: after a gap that is still open nothing is written.
        if self.lost > 0 || !self.put(text) {
            self.lost += 1;
        }
        Ok(text.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        // Stderr has no buffer of its own.
        Ok(())
    }
}

/// Says whether a write would be taken at once.
pub(crate) trait Ready {
    /// Waits for it, but no longer than `patience`.
    fn is_ready(&self, patience: Duration) -> bool;
}

impl Ready for io::Stderr {
    #[cfg(unix)]
    fn is_ready(&self, patience: Duration) -> bool {
        is_ready(self, patience)
    }

    /// Other systems do not say it.
    #[cfg(not(unix))]
    fn is_ready(&self, _patience: Duration) -> bool {
        true
    }
}

/// Whether a write to `file` would be taken at once, or fail at once.
#[cfg(unix)]
fn is_ready(file: &impl std::os::fd::AsFd, patience: Duration) -> bool {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let timeout = Timespec { tv_sec: 0, tv_nsec: patience.subsec_nanos().into() };
    let mut files = [PollFd::new(file, PollFlags::OUT)];
    // An error of poll is one that the write will have, too.
    poll(&mut files, Some(&timeout)).map_or(true, |ready| ready > 0)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::fs::File;
    use std::io::Read;
    use std::time::Instant;

    impl Ready for File {
        fn is_ready(&self, patience: Duration) -> bool {
            is_ready(self, patience)
        }
    }

    fn pipe() -> (File, Stderr<File>) {
        let (reader, writer) = io::pipe().expect("a pipe");
        let file = |end: std::os::fd::OwnedFd| File::from(end);
        (file(reader.into()), Stderr { out: file(writer.into()), lost: 0 })
    }

    #[test]
    fn a_pipe_that_nobody_reads_stops_nothing_and_the_gap_is_said() {
        let (mut reader, mut stderr) = pipe();
        let begun = Instant::now();
        let line = format!("{}\n", "x".repeat(199));
        (0..5000).for_each(|_| stderr.write_all(line.as_bytes()).expect("succeeds"));
        assert!(begun.elapsed() < Duration::from_secs(5), "it did not wait for each line");
        let lost = stderr.lost;
        assert!(lost > 3000 && lost < 5000, "a pipe holds some of it: {lost} are lost");
        let mut held = vec![0; 1 << 20];
        let read = reader.read(&mut held).expect("reads");
        assert!(read > 0);
        stderr.write_all(b"read again\n").expect("succeeds");
        drop(stderr);
        let mut rest = held[..read].to_vec();
        reader.read_to_end(&mut rest).expect("reads");
        let rest = String::from_utf8(rest).expect("text");
        assert!(rest.ends_with("could not be written\nread again\n"), "{}", &rest[rest.len() - 200..]);
        assert!(rest.contains(&format!("... {lost} pieces")));
    }

    #[test]
    fn a_closed_pipe_and_a_full_disk_are_no_errors() {
        let (reader, mut stderr) = pipe();
        drop(reader);
        assert!(writeln!(stderr, "to nobody").is_ok());
        assert!(stderr.lost > 0);
        if let Ok(full) = File::options().write(true).open("/dev/full") {
            let mut stderr = Stderr { out: full, lost: 0 };
            assert!(writeln!(stderr, "to a full disk").is_ok());
            assert!(stderr.lost > 0);
        }
    }
}
