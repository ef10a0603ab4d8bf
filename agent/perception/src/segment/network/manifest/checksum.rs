//! Whether a model's files are those that its manifest names: its networks, and the files that these keep weights in. All
//! of them are regular files in the model's folder, wherever links lead.

use super::external::weight_files;
use super::{Manifest, ManifestError, NetworkFile};
use semascan_formats::regular_file;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::path::Path;

impl Manifest {
    /// Compares the networks' bytes, and those of the weights that they keep elsewhere, with their checksums.
    ///
    /// # Errors
    /// [`ManifestError`] naming the first file that is missing, is not what the manifest says, or has no checksum.
    pub fn verify(&self, folder: &Path) -> Result<(), ManifestError> {
        for (i, network) in self.networks.iter().enumerate() {
            check(folder, network)
                .map_err(|(key, reason)| ManifestError::new(folder, format!("network[{i}].{key}"), reason))?;
        }
        Ok(())
    }
}

/// Checks a network; what is wrong comes as (key, reason).
fn check(folder: &Path, network: &NetworkFile) -> Result<(), (String, String)> {
    let named = |e: std::io::Error, file: &str| {
        let reason = e.to_string();
        if reason.starts_with(file) { reason } else { format!("{file}: {reason}") }
    };
    let bytes = regular_file::inside(folder, &network.file)
        .and_then(|path| regular_file::read(&path))
        .map_err(|e| ("file".to_owned(), named(e, &network.file)))?;
    let found = hexadecimal(&Sha256::digest(&bytes));
    if !found.eq_ignore_ascii_case(&network.sha256) {
        return Err(("sha256".to_owned(), format!("{}: the file's checksum is {found}", network.file)));
    }
    for (k, weights) in network.weights.iter().enumerate() {
        let found =
            sha256_of(folder, &weights.file).map_err(|e| (format!("weights[{k}].file"), named(e, &weights.file)))?;
        if !found.eq_ignore_ascii_case(&weights.sha256) {
            let reason = format!("{}: the file's checksum is {found}", weights.file);
            return Err((format!("weights[{k}].sha256"), reason));
        }
    }
    let files = weight_files(&bytes).map_err(|e| ("file".to_owned(), format!("{}: {e}", network.file)))?;
    for file in files {
        if network.weights.iter().any(|weights| weights.file == file) {
            continue;
        }
        let now = match sha256_of(folder, &file) {
            Ok(found) => format!("add it as [[network.weights]] with file and sha256 (now {found})"),
            Err(error) => format!("and it cannot be read: {error}"),
        };
        let reason = format!("{} keeps weights in {file}, of which the manifest has no checksum: {now}", network.file);
        return Err(("weights".to_owned(), reason));
    }
    Ok(())
}

/// SHA-256 of the bytes of a file in `folder`, hexadecimal.
fn sha256_of(folder: &Path, name: &str) -> std::io::Result<String> {
    let mut file = regular_file::open(&regular_file::inside(folder, name)?)?;
    let mut hash = Sha256::new();
    std::io::copy(&mut file, &mut HashWriter(&mut hash))?;
    Ok(hexadecimal(&hash.finalize()))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(64), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
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
