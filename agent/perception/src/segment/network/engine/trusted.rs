//! Whether a library may be loaded: it runs with all rights of the agent.
//!
//! Its path is absolute, so that neither the current folder nor the loader's own search decides. And nobody else can have
//! put it there: the file, its folder and the folders on the way to it are not open to everybody's writing. A folder above
//! that one may be, where only owners may rename and remove in it, as in `/tmp`.

use semascan_formats::regular_file;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The file that `path` leads to, if it may be loaded.
///
/// # Errors
/// Why it may not.
pub(super) fn trusted(path: &Path) -> Result<PathBuf, String> {
    if !path.is_absolute() {
        return Err("is not named by its whole path, and what lies in the current folder is not loaded".into());
    }
    // A name that is no file would send the loader through the system's folders.
    regular_file::check(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => "there is no such file".to_owned(),
        _ => error.to_string(),
    })?;
    let library = path.canonicalize().map_err(|e| e.to_string())?;
    // The way that was named, with its links, and the way to the file.
    for way in [path, &library] {
        for (above, part) in way.ancestors().enumerate() {
            if open_to_everybody(part, above).map_err(|e| format!("{}: {e}", part.display()))? {
                return Err(format!("{} can be written to by everybody, so it is not loaded", part.display()));
            }
        }
    }
    Ok(library)
}

/// Whether everybody can exchange the library by what they may write in `part`, which is it (0), its folder (1) or one above.
#[cfg(unix)]
fn open_to_everybody(part: &Path, above: usize) -> std::io::Result<bool> {
    use std::os::unix::fs::PermissionsExt;
    const OTHERS_WRITE: u32 = 0o002;
    const OWNERS_REMOVE: u32 = 0o1000;
    let mode = std::fs::metadata(part)?.permissions().mode();
    Ok(mode & OTHERS_WRITE != 0 && (above < 2 || mode & OWNERS_REMOVE == 0))
}

/// Access lists of other systems are not read.
#[cfg(not(unix))]
fn open_to_everybody(_: &Path, _: usize) -> std::io::Result<bool> {
    Ok(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_is_named_by_its_whole_path_and_is_there() {
        for (path, word) in
            [("libonnxruntime.so", "whole path"), ("./a.so", "whole path"), ("/nowhere/a.so", "no such file")]
        {
            assert!(trusted(Path::new(path)).expect_err(path).contains(word), "{path}");
        }
        assert!(trusted(Path::new("/")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn what_everybody_may_exchange_is_not_loaded() {
        use std::fs::{Permissions, create_dir, set_permissions, write};
        use std::os::unix::fs::{PermissionsExt, symlink};
        let root = tempfile::tempdir().expect("a folder");
        let (outer, folder) = (root.path().join("outer"), root.path().join("outer/lib"));
        create_dir(&outer).expect("made");
        create_dir(&folder).expect("made");
        let library = folder.join("libonnxruntime.so");
        write(&library, b"").expect("written");
        let set = |path: &Path, mode: u32| set_permissions(path, Permissions::from_mode(mode)).expect("set");
        set(&library, 0o644);
        assert_eq!(trusted(&library), library.canonicalize().map_err(|e| e.to_string()));
        for (part, usual, open, refused) in [
            (&library, 0o644, 0o666, true),
            (&folder, 0o755, 0o777, true),
            (&folder, 0o755, 0o1777, true),
            (&outer, 0o755, 0o777, true),
            (&outer, 0o755, 0o1777, false),
        ] {
            set(part, open);
            let found = trusted(&library);
            assert_eq!(found.is_err(), refused, "{} {open:o}", part.display());
            if let Err(reason) = found {
                assert!(reason.contains(&part.display().to_string()), "{reason}");
            }
            set(part, usual);
        }
        // A link that anybody may turn.
        let shared = root.path().join("shared");
        create_dir(&shared).expect("made");
        symlink(&library, shared.join("libonnxruntime.so")).expect("links");
        assert!(trusted(&shared.join("libonnxruntime.so")).is_ok());
        set(&shared, 0o777);
        assert!(trusted(&shared.join("libonnxruntime.so")).is_err());
    }
}
