//! Whether a model's files are those that its manifest names.

use super::{Manifest, ManifestError};
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::path::Path;

impl Manifest {
    /// Compares the networks' bytes with their checksums.
    ///
    /// # Errors
    /// [`ManifestError`] naming the first file that is missing or is not what the manifest says.
    pub fn verify(&self, folder: &Path) -> Result<(), ManifestError> {
        for (i, network) in self.networks.iter().enumerate() {
            let fail = |key: &str, reason: String| {
                Err(ManifestError::new(folder, format!("network[{i}].{key}"), format!("{}: {reason}", network.file)))
            };
            let found = match sha256_of(&folder.join(&network.file)) {
                Ok(found) => found,
                Err(e) => return fail("file", e.to_string()),
            };
            if !found.eq_ignore_ascii_case(&network.sha256) {
                return fail("sha256", format!("the file's checksum is {found}"));
            }
        }
        Ok(())
    }
}

/// SHA-256 of a file's bytes, hexadecimal.
fn sha256_of(path: &Path) -> std::io::Result<String> {
    let mut hash = Sha256::new();
    std::io::copy(&mut std::fs::File::open(path)?, &mut HashWriter(&mut hash))?;
    Ok(hash.finalize().iter().fold(String::with_capacity(64), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    }))
}

/// Feeds what is written to a hash.
struct HashWriter<'a>(&'a mut Sha256);

impl std::io::Write for HashWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
