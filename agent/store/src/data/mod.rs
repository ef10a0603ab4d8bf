//! The data folder: everything that an agent keeps of its inspections.
//!
//! ```text
//! DIR/semascan.db                SQLite: parts, inspections, views, events, findings, reviews, digests,
//!                                messages that wait, users and what was done with them
//! DIR/captures/<id>.mcap         the views as they came
//! DIR/inspections/<id>/          the record and the model
//! DIR/blobs/<aa>/<sha256>        large immutable things by their digest
//! ```

mod accounts;
mod archive;
mod backup;
mod blobs;
mod captures;
mod catalogue;
mod chained;
mod connection;
mod folder;
mod migrations;
mod retention;
mod reviews;
mod trends;
mod verify;

pub use accounts::SqliteAccounts;
pub use backup::Backup;
pub use blobs::LocalBlobs;
pub use captures::CaptureFile;
pub use catalogue::SqliteCatalogue;
pub use chained::{Audited, BadEntry};
pub use folder::{DataFolder, Interrupted, KeptInspection};
pub use retention::{Removed, Retention};
pub use verify::{Fault, Verified};
