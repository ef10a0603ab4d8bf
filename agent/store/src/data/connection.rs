//! How the database of a data folder is opened: a write-ahead log with `synchronous = FULL`, so that what is committed survives
//! a loss of power, and readers do not wait for the writer. Only its owner may read it: it holds hashes of passwords.

use super::migrations::migrate;
use rusqlite::functions::FunctionFlags;
use rusqlite::{Connection, ErrorCode, OpenFlags};
use semascan_inspection::ports::{Obstacle, PortError};
use std::fmt::Display;
use std::path::Path;
use std::time::Duration;

/// How long a writer waits for another one.
const BUSY: Duration = Duration::from_secs(10);

/// Opens the database at `path`, which is made where `create` says so, and brings its schema up to date.
///
/// # Errors
/// [`PortError`] naming the file: it cannot be opened, is none of semascan, or was made by a newer version.
pub(super) fn open(path: &Path, create: bool) -> Result<Connection, PortError> {
    let error = |error: rusqlite::Error| failed(path, &error);
    let other = |error: &dyn Display| PortError::new(path.display(), error);
    if create {
        make_private(path).map_err(|e| PortError::of(path.display(), &e))?;
    }
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let mut connection = Connection::open_with_flags(path, flags).map_err(error)?;
    connection.busy_timeout(BUSY).map_err(error)?;
    let mode: String =
        connection.pragma_update_and_check(None, "journal_mode", "WAL", |row| row.get(0)).map_err(error)?;
    if mode != "wal" {
        return Err(other(&format!("its journal is {mode}; a write-ahead log is needed")));
    }
    connection.pragma_update(None, "synchronous", "FULL").map_err(error)?;
    connection.pragma_update(None, "foreign_keys", "ON").map_err(error)?;
    add_functions(&connection).map_err(error)?;
    migrate(&mut connection).map_err(|e| other(&e))?;
    Ok(connection)
}

/// Adds what SQLite does not have: `holds(text, piece)`, whether a text holds a piece that [`folded`] made, whatever its case.
fn add_functions(connection: &Connection) -> rusqlite::Result<()> {
    let flags = FunctionFlags::SQLITE_UTF8 | FunctionFlags::SQLITE_DETERMINISTIC | FunctionFlags::SQLITE_INNOCUOUS;
    connection.create_scalar_function("holds", 2, flags, |arguments| {
        let (text, piece) = (arguments.get_raw(0).as_str()?, arguments.get_raw(1).as_str()?);
        Ok(folded(text).contains(piece))
    })
}

/// A text without the difference of case, letter by letter, so that a piece of a text is a piece of what becomes of it.
pub(super) fn folded(text: &str) -> String {
    text.chars().flat_map(char::to_lowercase).collect()
}

/// `error` of the database at `path`.
pub(super) fn failed(path: &Path, error: &rusqlite::Error) -> PortError {
    let obstacle = match error.sqlite_error_code() {
        Some(ErrorCode::DiskFull) => Some(Obstacle::Space),
        Some(ErrorCode::ReadOnly) => Some(Obstacle::ReadOnly),
        _ => None,
    };
    PortError::new(path.display(), error).because_of(obstacle)
}

/// Makes the file at `path` if it is not there, and keeps others than its owner from reading it. SQLite gives its other files
/// the same rights.
#[cfg(unix)]
pub(super) fn make_private(path: &Path) -> std::io::Result<()> {
    use std::fs::{OpenOptions, Permissions};
    use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
    let file = OpenOptions::new().append(true).create(true).mode(0o600).open(path)?;
    if file.metadata()?.permissions().mode() & 0o077 != 0 {
        file.set_permissions(Permissions::from_mode(0o600))?;
    }
    Ok(())
}

/// Makes the file at `path` if it is not there.
#[cfg(not(unix))]
pub(super) fn make_private(path: &Path) -> std::io::Result<()> {
    std::fs::OpenOptions::new().append(true).create(true).open(path).map(drop)
}
