//! The log of reviews in SQLite.

use super::SqliteCatalogue;
use super::catalogue::{note_findings, note_row, post};
use super::chained::{Audited, ChainedLog};
use rusqlite::{OptionalExtension, params};
use semascan_inspection::chain::Link;
use semascan_inspection::ports::{BusMessage, LoggedReview, PortError, ReviewLog, ReviewResult};
use semascan_model::InspectionId;
use semascan_model::review::{ReviewEntry, ReviewId};

const LOG: ChainedLog<ReviewEntry> = ChainedLog::new("reviews", &["id", "inspection"], "the log of reviews");

impl SqliteCatalogue {
    /// Reads the whole log of reviews and compares every entry with its hash and with the one before it. Where `noted` is given,
    /// the hash of an entry that was noted earlier, that entry must still be there.
    ///
    /// # Errors
    /// [`PortError`] naming the database where it cannot be read.
    pub fn audit(&self, noted: Option<&str>) -> Result<Audited, PortError> {
        LOG.audit(&self.connection(), noted).map_err(self.error())
    }
}

impl ReviewLog for SqliteCatalogue {
    fn entries(&self, inspection: InspectionId, first: u64, limit: u32) -> Result<Vec<LoggedReview>, PortError> {
        let links: Vec<Link> = {
            let connection = self.connection();
            let sql = format!("{} WHERE inspection = ?1 AND sequence >= ?2 ORDER BY sequence LIMIT ?3", LOG.select());
            let mut select = connection.prepare(&sql).map_err(self.error())?;
            let rows = select.query_map(params![inspection.to_string(), first, limit], |row| LOG.link(row));
            rows.and_then(Iterator::collect).map_err(self.error())?
        };
        links.into_iter().map(|link| Ok(LoggedReview { entry: self.read(&link)?, hash: link.hash })).collect()
    }

    fn entry(&self, review: ReviewId) -> Result<Option<ReviewEntry>, PortError> {
        let sql = format!("{} WHERE id = ?1", LOG.select());
        let link = self.connection().query_row(&sql, [review.to_string()], |row| LOG.link(row)).optional();
        link.map_err(self.error())?.map(|link| self.read(&link)).transpose()
    }

    fn last(&self) -> Result<u64, PortError> {
        LOG.last(&self.connection()).map_err(self.error())
    }

    fn append(&self, entry: &ReviewEntry, result: &ReviewResult, message: &BusMessage) -> Result<String, PortError> {
        let mut hash = String::new();
        self.in_transaction(|transaction| {
            hash = LOG.append(transaction, entry)?;
            note_row(transaction, entry.inspection, &result.row)?;
            if let Some(findings) = &result.findings {
                note_findings(transaction, entry.inspection, findings)?;
            }
            post(transaction, std::slice::from_ref(message))
        })?;
        Ok(hash)
    }
}

impl SqliteCatalogue {
    fn read(&self, link: &Link) -> Result<ReviewEntry, PortError> {
        LOG.read(link).map_err(|reason| PortError::new(self.path().display(), reason))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::Timestamp;
    use rusqlite::Connection;
    use semascan_inspection::chain;
    use semascan_inspection::ports::{Catalogue, InspectionRow, InspectionState, ResultRow};
    use semascan_model::record::SoftwareRecord;
    use semascan_model::review::{Review, ReviewAction, ReviewedVersions, Subject};
    use semascan_model::verdict::Decision;
    use std::path::{Path, PathBuf};
    use uuid::Uuid;

    fn inspection(millis: u64) -> InspectionId {
        InspectionId::new(millis, &[3; 10])
    }

    fn entry(sequence: u64) -> ReviewEntry {
        let software = SoftwareRecord { name: "semascan".into(), version: "1".into() };
        ReviewEntry {
            sequence,
            inspection: inspection(1 + sequence % 2),
            at: Timestamp::UNIX_EPOCH,
            versions: ReviewedVersions {
                software: software.clone(),
                inspected_with: software,
                model: Some("g".into()),
                networks: Vec::new(),
                criteria: None,
            },
            conflicts_with: Vec::new(),
            drawn: None,
            review: Review {
                id: ReviewId(Uuid::from_u128(u128::from(sequence))),
                subject: Subject::Component { component: "gear \"1\"".into() },
                seen: 0,
                model: None,
                action: ReviewAction::Accept,
                person: "Ä. Reviewer".into(),
                reason: "0.1 mm is fine".into(),
                resolves: Vec::new(),
            },
        }
    }

    fn append(catalogue: &SqliteCatalogue, sequence: u64) -> Result<(), PortError> {
        let row = ResultRow { decision: Some(Decision::Accept), conflicts: 3, ..ResultRow::default() };
        let message = BusMessage { id: format!("review:{sequence}"), subject: "reviewed".into(), payload: "{}".into() };
        catalogue.append(&entry(sequence), &ReviewResult { row, findings: None }, &message).map(drop)
    }

    /// A database with two inspections and a log of ten entries.
    fn database(root: &Path) -> PathBuf {
        let path = root.join("semascan.db");
        let catalogue = SqliteCatalogue::open(&path).expect("opens");
        for millis in [1, 2] {
            let row = InspectionRow {
                id: inspection(millis),
                part: "motor".into(),
                source: "scene".into(),
                spec: "{}".into(),
                began: Timestamp::UNIX_EPOCH,
                ended: None,
                state: InspectionState::Running,
                reason: None,
                held: false,
                views: 0,
                result: ResultRow::default(),
            };
            catalogue.begin(&row).expect("begun");
        }
        (1..=10).for_each(|sequence| append(&catalogue, sequence).expect("appended"));
        path
    }

    #[test]
    fn entries_come_back_as_they_were_appended_and_an_inspection_is_listed_with_its_decision() {
        let root = tempfile::tempdir().expect("a folder");
        let catalogue = SqliteCatalogue::open(&database(root.path())).expect("opens");
        let entries = |id: InspectionId, first: u64, limit: u32| {
            let logged = catalogue.entries(id, first, limit).expect("reads");
            logged.into_iter().map(|logged| logged.entry).collect::<Vec<_>>()
        };
        assert_eq!(entries(inspection(2), 0, u32::MAX), [1, 3, 5, 7, 9].map(entry));
        assert_eq!(entries(inspection(2), 4, 2), [5, 7].map(entry));
        assert_eq!(entries(inspection(2), 7, 9), [7, 9].map(entry));
        assert_eq!(catalogue.entry(entry(4).review.id), Ok(Some(entry(4))));
        assert_eq!(catalogue.entry(ReviewId(Uuid::from_u128(99))), Ok(None));
        assert_eq!(catalogue.last(), Ok(10));
        let listed = catalogue.inspection(inspection(1)).expect("reads").expect("there").result;
        assert_eq!((listed.decision, listed.conflicts), (Some(Decision::Accept), 3));
        assert_eq!(catalogue.waiting(99).expect("reads").len(), 10);
        let audited = catalogue.audit(None).expect("reads");
        assert_eq!((audited.entries, &audited.fault), (10, &None));
        // What was noted after five entries is still there after ten.
        assert_eq!(catalogue.audit(Some(&audited.head)).expect("reads").fault, None);
        let lost = catalogue.audit(Some(&"ab".repeat(32))).expect("reads").fault.expect("not in it");
        assert!(lost.sequence == 11 && lost.reason.contains("abab"), "{lost:?}");
        // The log outlives the inspections that it speaks of.
        catalogue.remove(inspection(1)).expect("removed");
        assert_eq!(entries(inspection(1), 0, u32::MAX).len(), 5);
        assert!(append(&catalogue, 12).is_err(), "there is a gap");
        assert!(append(&catalogue, 11).is_ok() && append(&catalogue, 12).is_err(), "its inspection is gone");
        assert_eq!(catalogue.last(), Ok(11));
        assert_eq!(catalogue.waiting(99).expect("reads").len(), 11, "nothing of what was refused");
    }

    #[test]
    fn the_database_refuses_every_change_of_the_log() {
        let root = tempfile::tempdir().expect("a folder");
        let connection = Connection::open(database(root.path())).expect("opens");
        for (sql, word) in [
            ("UPDATE reviews SET entry = '{}' WHERE sequence = 3", "never changed"),
            ("UPDATE OR REPLACE reviews SET sequence = 4 WHERE sequence = 3", "never changed"),
            ("DELETE FROM reviews WHERE sequence = 10", "nothing is removed"),
            ("DELETE FROM reviews", "nothing is removed"),
            ("INSERT OR REPLACE INTO reviews SELECT * FROM reviews WHERE sequence = 10", "follows the last"),
            (
                "INSERT INTO reviews SELECT 11, 'x', inspection, entry, previous, 'y' FROM reviews WHERE sequence = 10",
                "follows the last",
            ),
            (
                "INSERT OR REPLACE INTO reviews SELECT 11, id, inspection, entry, hash, 'y' FROM reviews WHERE sequence = 10",
                "follows the last",
            ),
        ] {
            let said = connection.execute(sql, []).expect_err(sql).to_string();
            assert!(said.contains(word), "{sql}: {said}");
        }
        drop(connection);
        let catalogue = SqliteCatalogue::open(&root.path().join("semascan.db")).expect("opens");
        assert_eq!(catalogue.audit(None).expect("reads").fault, None);
    }

    #[test]
    fn the_first_entry_that_was_changed_behind_the_database_is_named() {
        let rehash = "UPDATE reviews SET entry = replace(entry, 'fine', 'bad') WHERE sequence = 4";
        for (sql, bad) in [
            ("UPDATE reviews SET entry = replace(entry, 'fine', 'good') WHERE sequence = 4", 4),
            (rehash, 4),
            ("UPDATE reviews SET entry = entry || ' ' WHERE sequence = 10", 10),
            ("UPDATE reviews SET id = '00000000-0000-0000-0000-0000000000ff' WHERE sequence = 6", 6),
            ("UPDATE reviews SET inspection = 'elsewhere' WHERE sequence = 1", 1),
            ("UPDATE reviews SET hash = 'ab' WHERE sequence = 7", 7),
            ("UPDATE reviews SET previous = hash WHERE sequence = 7", 7),
            ("DELETE FROM reviews WHERE sequence = 5", 6),
            ("DELETE FROM reviews WHERE sequence = 1", 2),
        ] {
            let root = tempfile::tempdir().expect("a folder");
            let path = database(root.path());
            let connection = Connection::open(&path).expect("opens");
            let triggers = "DROP TRIGGER reviews_are_not_changed; DROP TRIGGER reviews_are_not_removed;";
            connection.execute_batch(triggers).expect("dropped");
            assert_eq!(connection.execute(sql, []).expect(sql), 1);
            if sql == rehash {
                // Whoever changes an entry and its hash breaks the link of the next one.
                let entry: String = connection
                    .query_row("SELECT entry FROM reviews WHERE sequence = 4", [], |row| row.get(0))
                    .expect("reads");
                let previous: String = connection
                    .query_row("SELECT previous FROM reviews WHERE sequence = 4", [], |row| row.get(0))
                    .expect("reads");
                let hash = chain::hash(&previous, &entry);
                connection.execute("UPDATE reviews SET hash = ?1 WHERE sequence = 4", [hash]).expect("changed");
            }
            drop(connection);
            let catalogue = SqliteCatalogue::open(&path).expect("opens");
            let fault = catalogue.audit(None).expect("reads").fault.expect(sql);
            assert_eq!(fault.sequence, if sql == rehash { 5 } else { bad }, "{sql}: {fault:?}");
            // And it is not taken for what was decided: an entry that is not what it was is an error, not an answer.
            if sql.contains("'good'") {
                assert!(catalogue.entry(entry(4).review.id).is_err());
            }
        }
    }
}
