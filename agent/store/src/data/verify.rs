//! Whether a data folder is whole: every file that the catalogue knows is there with its digest, every committed view is
//! captured, every blob has its content, the logs of reviews and accounts are what was written, and the database is sound.

use super::folder::digest;
use super::{DataFolder, SqliteAccounts};
use crate::StoreError;
use semascan_captures::CaptureReader;
use semascan_inspection::ports::{Blobs, Catalogue, InspectionFilter, InspectionState};

/// Something that is missing or damaged.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Fault {
    /// The file, relative to the data folder.
    pub file: String,
    /// What is wrong with it.
    pub reason: String,
}

/// What was looked at, and what is wrong.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Verified {
    /// Inspections that were looked at.
    pub inspections: u64,
    /// Files of theirs whose digest was compared.
    pub files: u64,
    /// Captured views that were read.
    pub views: u64,
    /// Entries of the log of reviews that were compared with their hashes.
    pub reviews: u64,
    /// Entries of the log of accounts that were compared with their hashes.
    pub account_entries: u64,
    /// Blobs whose content was compared with their digest.
    pub blobs: u64,
    /// What is missing or damaged.
    pub faults: Vec<Fault>,
}

impl DataFolder {
    /// Reads everything in the folder.
    ///
    /// # Errors
    /// [`StoreError`] if the database cannot be read at all.
    pub fn verify(&self) -> Result<Verified, StoreError> {
        let mut verified = Verified::default();
        let mut faults = Vec::new();
        let database = super::folder::DATABASE;
        faults.extend(self.catalogue().faults()?.into_iter().map(|reason| Fault { file: database.into(), reason }));
        let audited = self.catalogue().audit(None)?;
        verified.reviews = audited.entries;
        let accounts = SqliteAccounts::open(self.path())?.audit(None)?;
        verified.account_entries = accounts.entries;
        for (log, fault) in [("reviews", audited.fault), ("accounts", accounts.fault)] {
            faults.extend(fault.map(|bad| Fault {
                file: database.into(),
                reason: format!("entry {} of the log of {log} {}", bad.sequence, bad.reason),
            }));
        }
        for row in self.catalogue().inspections(&InspectionFilter::default())? {
            verified.inspections += 1;
            for known in self.catalogue().files(row.id)? {
                verified.files += 1;
                let reason = match digest(&self.path().join(&known.name), known.name.clone()) {
                    Ok(found) if found == known => continue,
                    Ok(found) if found.bytes != known.bytes => {
                        format!("holds {} bytes, and {} were written", found.bytes, known.bytes)
                    }
                    Ok(_) => "is damaged: its content does not have its digest".to_owned(),
                    Err(StoreError::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
                        "is missing".to_owned()
                    }
                    Err(error) => error.to_string(),
                };
                faults.push(Fault { file: known.name, reason });
            }
            // The rows of a view follow its capture: the capture has them all, and more while it runs.
            let file = format!("captures/{}.mcap", row.id);
            let (views, damage) = match CaptureReader::open(&self.path().join(&file)) {
                Ok(mut reader) => {
                    let (mut views, mut damage) = (0, None);
                    while let Some(view) = reader.next_view() {
                        match view {
                            Ok(_) => views += 1,
                            Err(error) => damage = Some(error.to_string()),
                        }
                    }
                    (views, damage)
                }
                Err(error) => (0, Some(error.to_string())),
            };
            verified.views += u64::from(views);
            let kept_nothing = row.views == 0 && row.state != InspectionState::Finished;
            if views < row.views {
                let reason = format!("holds {views} of the {} views that were committed", row.views);
                faults.push(Fault { file, reason });
            } else if let Some(reason) = damage.filter(|_| !kept_nothing && row.state != InspectionState::Running) {
                faults.push(Fault { file, reason });
            }
        }
        for blob in self.blobs().list()? {
            verified.blobs += 1;
            if let Err(error) = self.blobs().get(&blob) {
                let name = blob.to_string();
                faults.push(Fault { file: format!("blobs/{}/{name}", &name[..2]), reason: error.reason });
            }
        }
        verified.faults = faults;
        Ok(verified)
    }
}
