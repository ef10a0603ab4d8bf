//! Why a result cannot be written.

use semascan_formats::WriteError;
use semascan_inspection::ports::Obstacle;
use semascan_perception::fuse::FuseError;
use std::io;
use std::path::{Path, PathBuf};

/// Why an inspection or an export could not be written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The folder or one of its files could not be written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The underlying I/O error.
        source: io::Error,
    },
    /// What is named as a folder is none.
    #[error("{}: is no folder; name a folder to write into", path.display())]
    NoFolder {
        /// What was named.
        path: PathBuf,
    },
    /// The folder holds an inspection already.
    #[error("{}: holds {found} already; name another folder, or replace it with --overwrite", path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
        /// One of the things in it.
        found: String,
    },
    /// The folder holds a file that no inspection wrote. It is never removed.
    #[error(
        "{}: holds {found}, which is no file of an inspection; move it elsewhere, or name another folder",
        path.display()
    )]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// The file.
        found: String,
    },
    /// The folder that a data set should replace is none.
    #[error("{}: holds {found} and is no data set of semascan; it is not replaced, name another folder", path.display())]
    ForeignData {
        /// The folder.
        path: PathBuf,
        /// A file in it.
        found: String,
    },
    /// Somebody else writes into the folder.
    #[error("{}: another process writes into this folder (it holds the lock {})", path.display(), lock.display())]
    Locked {
        /// The folder.
        path: PathBuf,
        /// The lock file.
        lock: PathBuf,
    },
    /// An export failed.
    #[error("{}: {source}", path.display())]
    Export {
        /// The file.
        path: PathBuf,
        /// Why.
        source: WriteError,
    },
    /// The database or a blob could not be used.
    #[error(transparent)]
    Port(semascan_inspection::ports::PortError),
    /// A capture could not be written or read.
    #[error(transparent)]
    Capture(#[from] semascan_captures::CaptureError),
    /// A kept view cannot be read back.
    #[error(transparent)]
    View(#[from] FuseError),
}

impl StoreError {
    /// The state of the machine that is the reason; `None` where it is none.
    pub fn obstacle(&self) -> Option<Obstacle> {
        match self {
            Self::Port(error) => error.obstacle,
            error => Obstacle::of(error),
        }
    }

    /// An I/O error with the file that it is about.
    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }
}
