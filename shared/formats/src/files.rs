//! The files that a file names: buffers and pictures of glTF, material libraries and pictures of OBJ.
//!
//! A reader asks its caller for them. On disk only regular files in the folder of the file or below it are opened, wherever
//! links lead: a file from somewhere else must not make this computer read what it likes. In a browser there is nothing to
//! open. What all of them hold together is bounded, because one file can be named many times.

use std::cell::Cell;
use std::io;

/// Gives the bytes of a file by the name that another file calls it; names have `/` between folders.
pub type Resolver<'a> = &'a dyn Fn(&str) -> io::Result<Vec<u8>>;

/// Most bytes of all files together that a file names, each counted as often as it is named.
const MAX_NAMED: usize = 1 << 30;

/// A resolver that has no files.
///
/// # Errors
/// Always.
pub fn no_files(name: &str) -> io::Result<Vec<u8>> {
    Err(io::Error::new(io::ErrorKind::NotFound, format!("{name} is another file, and only this one is at hand")))
}

/// Counts what is left of [`MAX_NAMED`].
pub(crate) struct Allowance {
    left: Cell<usize>,
}

impl Allowance {
    pub(crate) fn new() -> Self {
        Self { left: Cell::new(MAX_NAMED) }
    }

    /// Takes `bytes` of it.
    pub(crate) fn take(&self, bytes: usize) -> io::Result<()> {
        let left = self.left.get().checked_sub(bytes).ok_or_else(|| {
            let reason = format!("the files that it names hold more than {MAX_NAMED} bytes together");
            io::Error::new(io::ErrorKind::FileTooLarge, reason)
        })?;
        self.left.set(left);
        Ok(())
    }
}

/// Reads a file from disk, by the ending of its name, with the files that it names.
///
/// # Errors
/// [`ReadError`](crate::ReadError) with the path as the name of the file.
#[cfg(not(target_arch = "wasm32"))]
pub fn read_file(path: &std::path::Path) -> Result<crate::Geometry, crate::ReadError> {
    use crate::regular_file;
    let file = path.display().to_string();
    let bytes = regular_file::read(path).map_err(|source| crate::ReadError::Io { file: file.clone(), source })?;
    let folder = path.parent().unwrap_or(std::path::Path::new("."));
    crate::Geometry::read(&file, &bytes, &|name| {
        let path = regular_file::inside(folder, name)?;
        regular_file::read_at_most(&path, MAX_NAMED as u64)
            .map_err(|e| io::Error::new(e.kind(), format!("{name}: {e}")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_named_many_times_is_bounded() {
        let allowance = Allowance::new();
        assert!(allowance.take(MAX_NAMED / 2).is_ok() && allowance.take(MAX_NAMED / 2).is_ok());
        let error = allowance.take(1).expect_err("all is taken").to_string();
        assert!(error.contains("1073741824"), "{error}");
    }
}
