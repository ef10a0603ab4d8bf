//! The lock that a writer of a folder holds: two writers at once would mix their files.
//!
//! The lock is taken with the operating system (`flock`) on a file beside the folder, `.NAME.semascan-lock`, because the
//! folder itself is exchanged as a whole. Where the parent folder cannot be written, it lies in the folder. The operating
//! system releases it when the process ends, however that ends.

use crate::StoreError;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// A held lock; dropping it releases it.
#[derive(Debug)]
pub struct FolderLock {
    path: PathBuf,
    _file: File,
}

impl FolderLock {
    /// Takes the lock of `folder`, without waiting. The folder need not exist, its parent must.
    ///
    /// # Errors
    /// [`StoreError::Locked`] if another writer holds it, [`StoreError::Io`] if the lock file cannot be made.
    pub fn acquire(folder: &Path) -> Result<Self, StoreError> {
        let inside = folder.join(".semascan-lock");
        let Some(beside) = beside(folder, "lock") else { return Self::at(folder, inside) };
        match Self::at(folder, beside) {
            Err(StoreError::Io { source, .. })
                if folder.is_dir()
                    && matches!(source.kind(), io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem) =>
            {
                Self::at(folder, inside)
            }
            result => result,
        }
    }

    fn at(folder: &Path, path: PathBuf) -> Result<Self, StoreError> {
        loop {
            let opened = File::options().create(true).truncate(false).write(true).open(&path);
            let file = opened.map_err(StoreError::io(&path))?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    return Err(StoreError::Locked { path: folder.to_owned(), lock: path });
                }
                Err(TryLockError::Error(source)) => return Err(StoreError::Io { path, source }),
            }
            // The last holder removes the file: a lock on a file that has no name any more keeps nobody out.
            if same_file(&file.metadata().map_err(StoreError::io(&path))?, &path) {
                return Ok(Self { path, _file: file });
            }
        }
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // Removed while it is held, so that nobody else's is removed. Elsewhere than on Unix an open file keeps its name.
        if cfg!(unix) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Whether `path` is the very file of which `metadata` speaks; where files have no numbers, that is taken for granted.
#[cfg(unix)]
pub(crate) fn same_file(metadata: &fs::Metadata, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).is_ok_and(|other| (other.dev(), other.ino()) == (metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
pub(crate) fn same_file(_: &fs::Metadata, _: &Path) -> bool {
    true
}

/// `.NAME.semascan-WHAT` beside `folder`; `None` if the folder has no name, as the root of a file system.
pub(crate) fn beside(folder: &Path, what: &str) -> Option<PathBuf> {
    let name = folder.file_name()?.to_string_lossy();
    Some(folder.with_file_name(format!(".{name}.semascan-{what}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_writer_at_a_time_and_no_lock_is_left() {
        let root = tempfile::tempdir().expect("a folder");
        let folder = root.path().join("out");
        let held = FolderLock::acquire(&folder).expect("free");
        let refused = FolderLock::acquire(&folder).expect_err("held");
        assert!(matches!(&refused, StoreError::Locked { path, .. } if *path == folder), "{refused}");
        assert!(refused.to_string().contains("another process"), "{refused}");
        FolderLock::acquire(&root.path().join("other")).expect("another folder is free");
        drop(held);
        FolderLock::acquire(&folder).expect("free again");
        assert_eq!(fs::read_dir(root.path()).expect("reads").count(), 0);
    }
}
