//! The files that a file names: buffers and pictures of glTF, material libraries and pictures of OBJ.
//!
//! A reader asks its caller for them. On disk only what lies in the folder of the file or below it is opened: a file from
//! somewhere else must not make this computer read what it likes. In a browser there is nothing to open.

use std::io;

/// Gives the bytes of a file by the name that another file calls it; names have `/` between folders.
pub type Resolver<'a> = &'a dyn Fn(&str) -> io::Result<Vec<u8>>;

/// A resolver that has no files.
///
/// # Errors
/// Always.
pub fn no_files(name: &str) -> io::Result<Vec<u8>> {
    Err(io::Error::new(io::ErrorKind::NotFound, format!("{name} is another file, and only this one is at hand")))
}

#[cfg(not(target_arch = "wasm32"))]
mod disk {
    use crate::{Geometry, ReadError};
    use std::io;
    use std::path::{Component, Path};

    /// Reads a file from disk, by the ending of its name, with the files that it names.
    ///
    /// # Errors
    /// [`ReadError`] with the path as the name of the file.
    pub fn read_file(path: &Path) -> Result<Geometry, ReadError> {
        let file = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|source| ReadError::Io { file: file.clone(), source })?;
        let folder = path.parent().unwrap_or(Path::new("."));
        Geometry::read(&file, &bytes, &|name| below(folder, name))
    }

    /// Reads `name` in `folder` or below it.
    fn below(folder: &Path, name: &str) -> io::Result<Vec<u8>> {
        let relative = Path::new(name);
        if relative.components().any(|part| !matches!(part, Component::Normal(_) | Component::CurDir)) {
            let reason = format!("{name} does not lie in the folder of the file that names it");
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, reason));
        }
        std::fs::read(folder.join(relative)).map_err(|e| io::Error::new(e.kind(), format!("{name}: {e}")))
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn only_the_folder_of_the_file_is_open() {
            let root = tempfile::tempdir().expect("a folder");
            let folder = root.path().join("part");
            std::fs::create_dir_all(folder.join("maps")).expect("made");
            std::fs::write(folder.join("maps/a.png"), b"inside").expect("written");
            std::fs::write(root.path().join("b.png"), b"outside").expect("written");
            assert_eq!(below(&folder, "./maps/a.png").expect("inside"), b"inside");
            for outside in ["../b.png", "maps/../../b.png", &root.path().join("b.png").display().to_string()] {
                assert_eq!(below(&folder, outside).expect_err(outside).kind(), io::ErrorKind::PermissionDenied);
            }
        }
    }
}

#[cfg(not(target_arch = "wasm32"))]
pub use disk::read_file;
