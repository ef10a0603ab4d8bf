//! Files that are read: regular ones only, of a size that memory can hold.
//!
//! A path comes from a person or from another file, and may lead to a named pipe, a device or a socket: opening the first
//! waits for ever, reading the second never ends. So what a path leads to is looked at before it is opened, and once more
//! when it is open, because it may have been exchanged between.

use std::fs::{File, FileType, Metadata};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

/// Most bytes of a file that is read as a whole.
pub const LARGEST: u64 = 4 << 30;

/// What a path leads to where that is neither a file nor a folder: within the errors of this module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("is {0} and not a regular file")]
pub struct NotRegular(&'static str);

/// Whether `error` says that a path leads to something else than a regular file.
pub fn is_not_regular(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::IsADirectory | io::ErrorKind::NotADirectory)
        || error.get_ref().is_some_and(|inner| inner.is::<NotRegular>())
}

/// Whether a regular file at `path` can be read, or another one put in its place; links are followed.
///
/// # Errors
/// The system's, or one that says what the path leads to where that is no regular file.
pub fn check(path: &Path) -> io::Result<()> {
    check_kind(&std::fs::metadata(path)?)
}

/// Whether there is a folder at `path`; links are followed.
///
/// # Errors
/// The system's, or one that says what the path leads to where that is no folder.
pub fn check_folder(path: &Path) -> io::Result<()> {
    let about = std::fs::metadata(path)?;
    if about.is_dir() {
        return Ok(());
    }
    let what = if about.is_file() { "a file" } else { kind(about.file_type()) };
    Err(io::Error::new(io::ErrorKind::NotADirectory, format!("is {what} and not a folder")))
}

/// Opens a regular file; links are followed.
///
/// # Errors
/// The system's, or one that says what the path leads to where that is no regular file.
pub fn open(path: &Path) -> io::Result<File> {
    check(path)?;
    let file = File::open(path)?;
    check_kind(&file.metadata()?)?;
    Ok(file)
}

/// The content of a regular file of at most [`LARGEST`] bytes.
///
/// # Errors
/// As [`open`], and one that names the limit.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    read_at_most(path, LARGEST)
}

/// The content of a regular file of at most `limit` bytes.
///
/// # Errors
/// As [`open`], and one that names the limit.
pub fn read_at_most(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let length = file.metadata()?.len();
    let too_large = |length: u64| {
        let reason = format!("holds {length} bytes or more; {limit} are the most that are read");
        io::Error::new(io::ErrorKind::FileTooLarge, reason)
    };
    if length > limit {
        return Err(too_large(length));
    }
    let mut bytes = Vec::new();
    let expected = usize::try_from(length).map_err(|_| too_large(length))?;
    bytes.try_reserve_exact(expected).map_err(|e| io::Error::new(io::ErrorKind::OutOfMemory, e))?;
    // It may grow while it is read.
    file.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(too_large(bytes.len() as u64)) } else { Ok(bytes) }
}

/// The content of a regular file of at most [`LARGEST`] bytes as UTF-8 text.
///
/// # Errors
/// As [`read`], and [`io::ErrorKind::InvalidData`] where it is no such text.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path)?).map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e.utf8_error()))
}

/// The path of the regular file that is called `name` (with `/` between folders) by a file in `folder`, in it or below it,
/// wherever links lead.
///
/// # Errors
/// [`io::ErrorKind::PermissionDenied`] where it does not lie there, the system's where it is not there, and as [`open`].
pub fn inside(folder: &Path, name: &str) -> io::Result<PathBuf> {
    let relative = Path::new(name);
    let outside = || {
        let reason = format!("{name} does not lie in the folder of the file that names it");
        io::Error::new(io::ErrorKind::PermissionDenied, reason)
    };
    if scheme(name).is_some() {
        let reason = format!("{name} is an address: only files in the folder of the file that names it are read");
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, reason));
    }
    let goes_down = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !goes_down || name.contains('\\') {
        return Err(outside());
    }
    let named = |e: io::Error| io::Error::new(e.kind(), format!("{name}: {e}"));
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = folder.join(relative).canonicalize().map_err(named)?;
    if !path.starts_with(folder.canonicalize().map_err(named)?) {
        return Err(outside());
    }
    check(&path).map_err(named)?;
    Ok(path)
}

/// The scheme of an address (RFC 3986, section 3.1), or the letter of a drive.
fn scheme(name: &str) -> Option<&str> {
    let (scheme, _) = name.split_once(':')?;
    let is_scheme = scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'));
    is_scheme.then_some(scheme)
}

fn check_kind(about: &Metadata) -> io::Result<()> {
    if about.is_file() {
        return Ok(());
    }
    if about.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder and not a file"));
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, NotRegular(kind(about.file_type()))))
}

#[cfg(unix)]
fn kind(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match kind {
        kind if kind.is_fifo() => "a named pipe",
        kind if kind.is_socket() => "a socket",
        kind if kind.is_char_device() || kind.is_block_device() => "a device",
        _ => "something else",
    }
}

#[cfg(not(unix))]
fn kind(_: FileType) -> &'static str {
    "something else"
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
        let path = inside(&folder, "./maps/a.png").expect("inside");
        assert_eq!(read(&path).expect("a file"), b"inside");
        let absolute = root.path().join("b.png").display().to_string();
        for outside in [
            "../b.png",
            "maps/../../b.png",
            &absolute,
            "http://127.0.0.1/b.png",
            "file:///etc/passwd",
            "C:/b.png",
            "maps\\a.png",
        ] {
            let error = inside(&folder, outside).expect_err(outside);
            assert_eq!(error.kind(), io::ErrorKind::PermissionDenied, "{outside}");
            assert!(error.to_string().contains(outside), "{error}");
        }
        assert_eq!(inside(&folder, "c.png").expect_err("missing").kind(), io::ErrorKind::NotFound);
        assert_eq!(inside(&folder, "maps").expect_err("a folder").kind(), io::ErrorKind::IsADirectory);
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_no_further_than_paths() {
        use std::os::unix::fs::symlink;
        let root = tempfile::tempdir().expect("a folder");
        let folder = root.path().join("part");
        std::fs::create_dir_all(&folder).expect("made");
        std::fs::write(root.path().join("b.png"), b"outside").expect("written");
        std::fs::write(folder.join("a.png"), b"inside").expect("written");
        symlink("../b.png", folder.join("out.png")).expect("links");
        symlink("..", folder.join("up")).expect("links");
        symlink("a.png", folder.join("in.png")).expect("links");
        // The folder itself may be reached through a link.
        symlink(&folder, root.path().join("link")).expect("links");
        for name in ["out.png", "up/b.png"] {
            assert_eq!(inside(&folder, name).expect_err(name).kind(), io::ErrorKind::PermissionDenied, "{name}");
        }
        for folder in [folder.clone(), root.path().join("link")] {
            assert_eq!(read(&inside(&folder, "in.png").expect("inside")).expect("a file"), b"inside");
        }
    }

    #[cfg(unix)]
    #[test]
    fn pipes_devices_sockets_and_folders_are_not_opened() {
        let root = tempfile::tempdir().expect("a folder");
        let (pipe, socket) = (root.path().join("pipe.ply"), root.path().join("socket.ply"));
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("runs");
        assert!(made.success());
        let listener = std::os::unix::net::UnixListener::bind(&socket).expect("binds");
        let device = root.path().join("device.ply");
        std::os::unix::fs::symlink("/dev/zero", &device).expect("links");
        for (path, word) in [(&pipe, "named pipe"), (&socket, "socket"), (&device, "device")] {
            let error = read(path).expect_err(word);
            assert!(error.to_string().contains(word) && is_not_regular(&error), "{error}");
        }
        assert!(!is_not_regular(&read(&root.path().join("missing")).expect_err("missing")));
        assert_eq!(read(root.path()).expect_err("a folder").kind(), io::ErrorKind::IsADirectory);
        assert!(check_folder(root.path()).is_ok());
        let error = check_folder(&pipe).expect_err("a pipe");
        assert!(error.to_string().contains("named pipe") && is_not_regular(&error), "{error}");
        drop(listener);
    }

    #[test]
    fn a_file_over_the_limit_is_refused() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), b"12345").expect("written");
        assert_eq!(read_at_most(file.path(), 5).expect("fits"), b"12345");
        let error = read_at_most(file.path(), 4).expect_err("too large").to_string();
        assert!(error.contains("5 bytes") && error.contains("4 are the most"), "{error}");
        // A hole takes no space on the disk.
        file.as_file().set_len(1 << 40).expect("set");
        assert_eq!(read(file.path()).expect_err("too large").kind(), io::ErrorKind::FileTooLarge);
    }
}
