//! The ports through which an inspection is kept: rows ([`Catalogue`]), large immutable things ([`Blobs`]), messages to
//! others ([`Bus`]), captured views ([`Captures`]), what people decide ([`ReviewLog`]), and all of it read back ([`Archive`],
//! [`Remake`], [`Reports`]); and those who may use an agent ([`Accounts`]). They are narrow, so that a fleet can have other databases, object
//! stores and message buses than one machine; `agent/store` implements them for one data folder.

mod accounts;
mod archive;
mod blobs;
mod bus;
mod captures;
mod catalogue;
mod error;
mod reviews;

pub use accounts::{Accounts, Login, SecretDigest, SessionRow, TokenRow, UserRow};
pub use archive::{Archive, ArchivedFile, ArchivedView, PixelLabels, Remake, Reports};
pub use blobs::{BlobDigest, Blobs, InvalidDigest};
pub use bus::{Bus, BusMessage};
pub use captures::Captures;
pub use catalogue::{
    Catalogue, ClassTrend, Commit, DayTrend, EventRow, FindingRow, InspectionFilter, InspectionRow, InspectionState,
    ResultRow, ResultRows, Trends, ViewRow,
};
pub use error::{Obstacle, PortError};
pub use reviews::{LoggedReview, ReviewLog, ReviewResult};
