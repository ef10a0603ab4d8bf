//! What the targets share.

/// Stands between two files in the input of a target.
const BETWEEN: &[u8] = b"\n-- next file --\n";

/// The two files of an input; the second is empty where nothing separates them.
pub fn two_files(bytes: &[u8]) -> (&[u8], &[u8]) {
    match bytes.windows(BETWEEN.len()).position(|window| window == BETWEEN) {
        Some(at) => (&bytes[..at], &bytes[at + BETWEEN.len()..]),
        None => (bytes, &[]),
    }
}
