//! The folder that exports are written into: one writer at a time, no file of another inspection beside them, and never the
//! file that they are made of.

use crate::contents::{Contents, MODEL_FILES, RECORD};
use crate::lock::{FolderLock, same_file};
use crate::write::remove_temporary_files;
use crate::{StoreError, write_file};
use semascan_formats::{WriteError, regular_file};
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// A folder that exports are written into. Its lock is held until this is dropped.
#[derive(Debug)]
pub struct ExportFolder {
    folder: PathBuf,
    source: fs::Metadata,
    source_path: PathBuf,
    _lock: FolderLock,
}

/// Why a file is not exported there.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The file would overwrite what it is made of.
    #[error("{}: would overwrite its source; name a folder with --out", path.display())]
    OwnSource {
        /// The file.
        path: PathBuf,
    },
    /// The file would replace one of an inspection.
    #[error("{}: is a file of the inspection in this folder; name another folder with --out", path.display())]
    OfInspection {
        /// The file.
        path: PathBuf,
    },
    /// The folder holds another inspection.
    #[error("{}: holds another inspection, with which the export would be mixed; name another folder", path.display())]
    OtherInspection {
        /// The folder.
        path: PathBuf,
    },
    /// The folder cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl ExportFolder {
    /// Begins to write what is made of the file `source` into `folder`, which is made if need be.
    ///
    /// # Errors
    /// [`ExportError`] if the folder is none, cannot be written, is another inspection's, or another process writes into it.
    pub fn begin(folder: &Path, source: &Path) -> Result<Self, ExportError> {
        regular_file::check(source).map_err(StoreError::io(source))?;
        let metadata = fs::metadata(source).map_err(StoreError::io(source))?;
        Contents::of(folder)?;
        fs::create_dir_all(folder).map_err(StoreError::io(folder))?;
        let absolute = folder.canonicalize().map_err(StoreError::io(folder))?;
        let source_path = source.canonicalize().map_err(StoreError::io(source))?;
        if absolute.join(RECORD).exists() && source_path.parent() != Some(&absolute) {
            return Err(ExportError::OtherInspection { path: folder.to_owned() });
        }
        let lock = FolderLock::acquire(&absolute)?;
        remove_temporary_files(&absolute)?;
        tried(&absolute)?;
        Ok(Self { folder: folder.to_owned(), source: metadata, source_path, _lock: lock })
    }

    /// Where the file `name` will stand, if it may.
    ///
    /// # Errors
    /// [`ExportError`] if it would overwrite its source or a file of an inspection.
    pub fn place(&self, name: &str) -> Result<PathBuf, ExportError> {
        let path = self.folder.join(name);
        let is_source = fs::canonicalize(&path).is_ok_and(|existing| existing == self.source_path)
            || (cfg!(unix) && same_file(&self.source, &path));
        if is_source {
            return Err(ExportError::OwnSource { path });
        }
        if MODEL_FILES.contains(&name) && self.folder.join(RECORD).exists() {
            return Err(ExportError::OfInspection { path });
        }
        Ok(path)
    }

    /// Writes the file `name` whole or not at all. Returns where.
    ///
    /// # Errors
    /// [`ExportError`] naming the file; what stood there before then stays.
    pub fn write(
        &self,
        name: &str,
        content: impl FnOnce(&mut BufWriter<File>) -> Result<(), WriteError>,
    ) -> Result<PathBuf, ExportError> {
        let path = self.place(name)?;
        write_file(&path, content)?;
        Ok(path)
    }
}

/// Tries whether files can be made in `folder`.
fn tried(folder: &Path) -> Result<(), StoreError> {
    let path = folder.join(format!(".test.semascan-{}", uuid::Uuid::now_v7()));
    File::create(&path).map_err(StoreError::io(folder))?;
    fs::remove_file(&path).map_err(StoreError::io(&path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_source_is_never_overwritten_whatever_it_is_called() {
        let root = tempfile::tempdir().expect("a folder");
        let source = root.path().join("mesh.ply");
        fs::write(&source, "ply").expect("written");
        let other = root.path().join("other");
        fs::create_dir(&other).expect("made");
        fs::hard_link(&source, other.join("mesh.ply")).expect("linked");
        for folder in [root.path(), &other, &other.join("..")] {
            let out = ExportFolder::begin(folder, &source).expect("a folder");
            assert!(matches!(out.place("mesh.ply"), Err(ExportError::OwnSource { .. })), "{}", folder.display());
            out.write("mesh.obj", |file| Ok(file.write_all(b"#")?)).expect("written");
        }
        fs::write(other.join(RECORD), "{}").expect("written");
        assert!(matches!(ExportFolder::begin(&other, &source), Err(ExportError::OtherInspection { .. })));
        let own = ExportFolder::begin(&other, &other.join("mesh.ply")).expect("its own folder");
        assert!(matches!(own.place("cloud.ply"), Err(ExportError::OfInspection { .. })));
    }
}
