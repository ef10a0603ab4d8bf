//! Why something cannot be kept or found, and whether that is a state of the machine that may be over later.

use std::error::Error;
use std::io;

/// A state of the machine that keeps things from being kept. It may be over later: whoever can wait tries again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// There is no space: the disk is full, or a quota is used up.
    Space,
    /// The disk or folder cannot be written.
    ReadOnly,
    /// The process or the system has too many files open.
    OpenFiles,
}

impl Obstacle {
    /// The obstacle that `error` or one of its causes speaks of; `None` where it is none.
    pub fn of(error: &(dyn Error + 'static)) -> Option<Self> {
        let mut cause = Some(error);
        while let Some(error) = cause {
            if let Some(error) = error.downcast_ref::<PortError>() {
                return error.obstacle;
            }
            // An error of I/O passes over what it wraps as its source, not the wrapped one itself.
            if let Some(error) = error.downcast_ref::<io::Error>() {
                let inner = error.get_ref().and_then(|inner| Self::of(inner));
                return inner.or_else(|| Self::of_io(error));
            }
            cause = error.source();
        }
        None
    }

    fn of_io(error: &io::Error) -> Option<Self> {
        use io::ErrorKind::{FileTooLarge, PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
        match error.kind() {
            StorageFull | QuotaExceeded | FileTooLarge => Some(Self::Space),
            ReadOnlyFilesystem | PermissionDenied => Some(Self::ReadOnly),
            _ if has_too_many_files(error) => Some(Self::OpenFiles),
            _ => None,
        }
    }
}

/// ENFILE or EMFILE, which have these numbers on Linux, macOS and the BSDs, and no kind of their own.
#[cfg(unix)]
fn has_too_many_files(error: &io::Error) -> bool {
    matches!(error.raw_os_error(), Some(23 | 24))
}

/// ERROR_TOO_MANY_OPEN_FILES.
#[cfg(not(unix))]
fn has_too_many_files(error: &io::Error) -> bool {
    error.raw_os_error() == Some(4)
}

/// Why something cannot be kept or found: the file, table or object, and the reason.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {reason}")]
pub struct PortError {
    /// What could not be used: a file, a table, an object.
    pub place: String,
    /// Why.
    pub reason: String,
    /// The state of the machine that is the reason; `None` where it is none, or nobody knows.
    pub obstacle: Option<Obstacle>,
}

impl PortError {
    /// An error about `place`.
    pub fn new(place: impl ToString, reason: impl ToString) -> Self {
        Self { place: place.to_string(), reason: reason.to_string(), obstacle: None }
    }

    /// The error `cause` about `place`.
    pub fn of(place: impl ToString, cause: &(dyn Error + 'static)) -> Self {
        Self { obstacle: Obstacle::of(cause), ..Self::new(place, cause) }
    }

    /// The same because of `obstacle`.
    pub fn because_of(self, obstacle: Option<Obstacle>) -> Self {
        Self { obstacle, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("a file: {source}")]
    struct Wrapped {
        source: io::Error,
    }

    #[test]
    fn an_obstacle_is_found_behind_what_wraps_it() {
        for (error, expected) in [
            (io::Error::from(io::ErrorKind::StorageFull), Some(Obstacle::Space)),
            (io::Error::from(io::ErrorKind::FileTooLarge), Some(Obstacle::Space)),
            (io::Error::from(io::ErrorKind::ReadOnlyFilesystem), Some(Obstacle::ReadOnly)),
            (io::Error::from(io::ErrorKind::PermissionDenied), Some(Obstacle::ReadOnly)),
            (io::Error::from(io::ErrorKind::NotFound), None),
            (io::Error::other(io::Error::from(io::ErrorKind::StorageFull)), Some(Obstacle::Space)),
            (io::Error::other(PortError::new("x", "y").because_of(Some(Obstacle::Space))), Some(Obstacle::Space)),
        ] {
            assert_eq!(Obstacle::of(&error), expected, "{error:?}");
            let wrapped = Wrapped { source: error };
            assert_eq!(PortError::of("place", &wrapped).obstacle, expected, "{wrapped:?}");
        }
        if cfg!(unix) {
            let many = Wrapped { source: io::Error::from_raw_os_error(24) };
            assert_eq!(Obstacle::of(&many), Some(Obstacle::OpenFiles));
        }
        assert_eq!(Obstacle::of(&PortError::new("x", "the disk is full")), None, "words alone are none");
    }
}
