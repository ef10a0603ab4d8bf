//! Files that are whole or not there: each is written under a temporary name, brought to the disk, and then renamed.

use crate::StoreError;
use crate::lock::beside;
use semascan_formats::{WriteError, regular_file};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a file under a temporary name of its own and renames it when it is whole and on the disk.
///
/// # Errors
/// [`StoreError`] naming the file; what stood there before then stays.
pub fn write_file(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> Result<(), WriteError>,
) -> Result<(), StoreError> {
    check_place(path)?;
    let io_error = |source| StoreError::Io { path: path.to_owned(), source };
    let temporary = beside(path, &uuid::Uuid::now_v7().to_string())
        .ok_or_else(|| io_error(io::Error::from(io::ErrorKind::InvalidFilename)))?;
    let result = write_new(&temporary, path, content).and_then(|()| fs::rename(&temporary, path).map_err(io_error));
    if result.is_err() {
        let _ = fs::remove_file(&temporary);
        return result;
    }
    sync_folder(path.parent().unwrap_or(Path::new(".")))
}

/// Whether a file can be put at `path`: nothing or a regular file stands there, in a folder. A pipe or device would be gone
/// after the renaming.
///
/// # Errors
/// [`StoreError`] naming the file, or the folder that is not there.
pub fn check_place(path: &Path) -> Result<(), StoreError> {
    let io_error = |source| StoreError::Io { path: path.to_owned(), source };
    match regular_file::check(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        result => return result.map_err(io_error),
    }
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let about = fs::metadata(folder).map_err(StoreError::io(folder))?;
    if about.is_dir() { Ok(()) } else { Err(StoreError::NoFolder { path: folder.to_owned() }) }
}

/// Writes the file `path` and brings it to the disk; errors speak of `shown`, the name that it will have.
pub(crate) fn write_new(
    path: &Path,
    shown: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> Result<(), WriteError>,
) -> Result<(), StoreError> {
    let io_error = |source| StoreError::Io { path: shown.to_owned(), source };
    let mut out = BufWriter::new(File::create(path).map_err(io_error)?);
    content(&mut out).map_err(|source| StoreError::Export { path: shown.to_owned(), source })?;
    out.flush().map_err(io_error)?;
    out.get_ref().sync_all().map_err(io_error)
}

/// Brings the names in a folder to the disk, where the system can.
pub(crate) fn sync_folder(folder: &Path) -> Result<(), StoreError> {
    if !cfg!(unix) {
        return Ok(());
    }
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        // Some network file systems cannot, and keep names in order themselves.
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => Ok(()),
        result => result.map_err(StoreError::io(folder)),
    }
}

/// Removes the temporary files that killed writers left in `folder`; called by who holds the folder's lock.
///
/// # Errors
/// [`StoreError`] naming the file.
pub(crate) fn remove_temporary_files(folder: &Path) -> Result<(), StoreError> {
    for path in temporaries(folder, None)? {
        if path.is_file() {
            fs::remove_file(&path).map_err(StoreError::io(&path))?;
        }
    }
    Ok(())
}

/// Entries of `folder` with a temporary name, `.NAME.semascan-UUID`, of any or one `name`.
pub(crate) fn temporaries(folder: &Path, name: Option<&str>) -> Result<Vec<PathBuf>, StoreError> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(StoreError::io(folder))? {
        let path = entry.map_err(StoreError::io(folder))?.path();
        let file_name = path.file_name().unwrap_or_default().to_string_lossy();
        let parts = file_name.strip_prefix('.').and_then(|rest| rest.rsplit_once(".semascan-"));
        let is_temporary = parts.is_some_and(|(of, id)| {
            name.is_none_or(|name| name == of) && id.len() == 36 && uuid::Uuid::try_parse(id).is_ok()
        });
        if is_temporary {
            found.push(path);
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_what_was_there_and_leftovers_are_known() {
        let root = tempfile::tempdir().expect("a folder");
        let path = root.path().join("mesh.ply");
        write_file(&path, |out| Ok(out.write_all(b"first")?)).expect("written");
        let failed = write_file(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::from(io::ErrorKind::StorageFull).into())
        });
        assert!(failed.expect_err("full").to_string().contains("mesh.ply"));
        assert_eq!(fs::read(&path).expect("there"), b"first");
        assert_eq!(fs::read_dir(root.path()).expect("reads").count(), 1, "no temporary file");
        let leftover = beside(&path, &uuid::Uuid::now_v7().to_string()).expect("a name");
        fs::write(&leftover, "half").expect("written");
        fs::write(root.path().join(".mine.semascan-notes"), "mine").expect("written");
        assert_eq!(temporaries(root.path(), Some("mesh.ply")).expect("reads"), [leftover.as_path()]);
        assert!(temporaries(root.path(), Some("cloud.ply")).expect("reads").is_empty());
        remove_temporary_files(root.path()).expect("removed");
        assert!(!leftover.exists() && root.path().join(".mine.semascan-notes").exists());
    }
}
