//! The catalogue in SQLite.

use super::connection::{self, folded};
use jiff::Timestamp;
use rusqlite::{Connection, OptionalExtension, Row, Transaction, params};
use semascan_inspection::ports::{
    Bus, BusMessage, Catalogue, Commit, EventRow, FindingRow, InspectionFilter, InspectionRow, InspectionState,
    PortError, ResultRow, ResultRows, Trends, ViewRow,
};
use semascan_model::InspectionId;
use semascan_model::verdict::Decision;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The catalogue of a data folder.
#[derive(Debug)]
pub struct SqliteCatalogue {
    path: PathBuf,
    connection: Mutex<Connection>,
}

/// A file of an inspection as the catalogue knows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct FileRow {
    /// Its name in the inspection's folder.
    pub(super) name: String,
    /// Digest of its content, hexadecimal.
    pub(super) sha256: String,
    /// Its length.
    pub(super) bytes: u64,
}

impl SqliteCatalogue {
    /// Opens the database at `path`, which is made if it is not there.
    ///
    /// # Errors
    /// [`PortError`] naming the file: it cannot be opened, is none of semascan, or was made by a newer version.
    pub fn open(path: &Path) -> Result<Self, PortError> {
        Ok(Self { path: path.to_owned(), connection: Mutex::new(connection::open(path, true)?) })
    }

    /// Opens the database at `path`, which must be there.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_existing(path: &Path) -> Result<Self, PortError> {
        Ok(Self { path: path.to_owned(), connection: Mutex::new(connection::open(path, false)?) })
    }

    /// The database.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn connection(&self) -> MutexGuard<'_, Connection> {
        // A transaction that a panic cut off was rolled back.
        self.connection.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn error(&self) -> impl Fn(rusqlite::Error) -> PortError {
        |error| connection::failed(&self.path, &error)
    }

    pub(super) fn in_transaction(
        &self,
        work: impl FnOnce(&Transaction<'_>) -> rusqlite::Result<()>,
    ) -> Result<(), PortError> {
        let mut connection = self.connection();
        let transaction = connection.transaction().map_err(self.error())?;
        work(&transaction).map_err(self.error())?;
        transaction.commit().map_err(self.error())
    }

    /// What SQLite finds wrong with the file and its references; nothing where all is well.
    pub(super) fn faults(&self) -> Result<Vec<String>, PortError> {
        let connection = self.connection();
        let mut check = connection.prepare("PRAGMA integrity_check").map_err(self.error())?;
        let said = check.query_map([], |row| row.get::<_, String>(0)).map_err(self.error())?;
        let mut said = said.collect::<rusqlite::Result<Vec<_>>>().map_err(self.error())?;
        said.retain(|line| line != "ok");
        let mut check = connection.prepare("PRAGMA foreign_key_check").map_err(self.error())?;
        let rows = check.query_map([], |row| row.get::<_, String>(0)).map_err(self.error())?;
        for table in rows {
            said.push(format!("a row of {} belongs to nothing", table.map_err(self.error())?));
        }
        Ok(said)
    }

    /// Writes a copy of the database as it is now to `target`, which must not be there. Nobody is logged in where it is used.
    pub(super) fn copy_to(&self, target: &Path) -> Result<(), PortError> {
        let name = target.to_str().ok_or_else(|| PortError::new(target.display(), "the name is no UTF-8"))?;
        // An empty file is taken as one that is not there.
        connection::make_private(target).map_err(|error| PortError::of(target.display(), &error))?;
        self.connection().execute("VACUUM INTO ?1", [name]).map_err(self.error())?;
        let copy = connection::open(target, false)?;
        copy.execute("DELETE FROM sessions", []).map_err(|error| connection::failed(target, &error))?;
        Ok(())
    }

    /// The files of an inspection, by name.
    pub(super) fn files(&self, id: InspectionId) -> Result<Vec<FileRow>, PortError> {
        let connection = self.connection();
        let sql = "SELECT name, sha256, bytes FROM files WHERE inspection = ?1 ORDER BY name";
        let mut select = connection.prepare(sql).map_err(self.error())?;
        let rows = select.query_map([id.to_string()], |row| {
            Ok(FileRow { name: row.get(0)?, sha256: row.get(1)?, bytes: row.get(2)? })
        });
        rows.and_then(Iterator::collect).map_err(self.error())
    }

    /// Notes the files of an inspection; those that it had before are forgotten.
    pub(super) fn set_files(&self, id: InspectionId, files: &[FileRow]) -> Result<(), PortError> {
        self.in_transaction(|transaction| {
            transaction.execute("DELETE FROM files WHERE inspection = ?1", [id.to_string()])?;
            for file in files {
                transaction.execute(
                    "INSERT INTO files (inspection, name, sha256, bytes) VALUES (?1, ?2, ?3, ?4)",
                    params![id.to_string(), file.name, file.sha256, file.bytes],
                )?;
            }
            Ok(())
        })
    }

    /// The first `limit` messages that wait for a bus, in the order in which they were published.
    ///
    /// # Errors
    /// [`PortError`] naming the database.
    pub fn waiting(&self, limit: u32) -> Result<Vec<BusMessage>, PortError> {
        let connection = self.connection();
        let sql = "SELECT id, subject, payload FROM outbox ORDER BY place LIMIT ?1";
        let mut select = connection.prepare(sql).map_err(self.error())?;
        let rows = select
            .query_map([limit], |row| Ok(BusMessage { id: row.get(0)?, subject: row.get(1)?, payload: row.get(2)? }));
        rows.and_then(Iterator::collect).map_err(self.error())
    }

    /// Forgets messages that were delivered.
    ///
    /// # Errors
    /// [`PortError`] naming the database.
    pub fn delivered(&self, ids: &[&str]) -> Result<(), PortError> {
        self.in_transaction(|transaction| {
            ids.iter().try_for_each(|id| transaction.execute("DELETE FROM outbox WHERE id = ?1", [id]).map(drop))
        })
    }
}

impl Bus for SqliteCatalogue {
    fn publish(&self, messages: &[BusMessage]) -> Result<(), PortError> {
        self.in_transaction(|transaction| post(transaction, messages))
    }
}

/// Puts messages into the outbox; one that is there already is left out.
pub(super) fn post(transaction: &Transaction<'_>, messages: &[BusMessage]) -> rusqlite::Result<()> {
    for BusMessage { id, subject, payload } in messages {
        transaction.execute(
            "INSERT INTO outbox (id, subject, payload) VALUES (?1, ?2, ?3) ON CONFLICT (id) DO NOTHING",
            params![id, subject, payload],
        )?;
    }
    Ok(())
}

const INSPECTION: &str = "SELECT inspections.id, parts.name, source, spec, began, ended, state, reason, held, views, \
                          decision, automatic, conflicts, findings \
                          FROM inspections JOIN parts ON parts.id = inspections.part";

impl Catalogue for SqliteCatalogue {
    fn begin(&self, row: &InspectionRow) -> Result<(), PortError> {
        self.in_transaction(|transaction| {
            transaction.execute("INSERT INTO parts (name) VALUES (?1) ON CONFLICT (name) DO NOTHING", [&row.part])?;
            transaction.execute(
                "INSERT INTO inspections (id, part, source, spec, began, ended, state, reason, held, views) \
                 VALUES (?1, (SELECT id FROM parts WHERE name = ?2), ?3, ?4, ?5, ?6, ?7, ?8, ?9, 0)",
                params![
                    row.id.to_string(),
                    row.part,
                    row.source,
                    row.spec,
                    row.began.to_string(),
                    row.ended.map(|t| t.to_string()),
                    row.state.name(),
                    row.reason,
                    row.held,
                ],
            )?;
            Ok(())
        })
    }

    fn commit(&self, id: InspectionId, commit: &Commit) -> Result<(), PortError> {
        let id = id.to_string();
        self.in_transaction(|transaction| {
            for EventRow { sequence, time, kind } in &commit.events {
                transaction.execute(
                    "INSERT INTO events (inspection, sequence, time, kind) VALUES (?1, ?2, ?3, ?4)",
                    params![id, sequence, time.to_string(), kind],
                )?;
            }
            if let Some(ViewRow { index, accepted, record }) = &commit.view {
                transaction.execute(
                    "INSERT INTO views (inspection, number, accepted, record) VALUES (?1, ?2, ?3, ?4) \
                     ON CONFLICT DO UPDATE SET accepted = excluded.accepted, record = excluded.record",
                    params![id, index, accepted, record],
                )?;
                transaction
                    .execute("UPDATE inspections SET views = max(views, ?2 + 1) WHERE id = ?1", params![id, index])?;
            }
            post(transaction, &commit.messages)
        })
    }

    fn close(
        &self,
        id: InspectionId,
        ended: Timestamp,
        state: InspectionState,
        reason: Option<&str>,
    ) -> Result<(), PortError> {
        self.in_transaction(|transaction| {
            let changed = transaction.execute(
                "UPDATE inspections SET ended = ?2, state = ?3, reason = ?4 WHERE id = ?1",
                params![id.to_string(), ended.to_string(), state.name(), reason],
            )?;
            if changed == 0 { Err(rusqlite::Error::QueryReturnedNoRows) } else { Ok(()) }
        })
    }

    fn inspection(&self, id: InspectionId) -> Result<Option<InspectionRow>, PortError> {
        let sql = format!("{INSPECTION} WHERE inspections.id = ?1");
        self.connection().query_row(&sql, [id.to_string()], inspection).optional().map_err(self.error())
    }

    fn inspections(&self, filter: &InspectionFilter) -> Result<Vec<InspectionRow>, PortError> {
        let (conditions, values) = conditions(filter);
        let sql = format!("{INSPECTION} {conditions} ORDER BY inspections.id DESC LIMIT {}", filter.limit);
        let connection = self.connection();
        let mut select = connection.prepare(&sql).map_err(self.error())?;
        let rows = select.query_map(rusqlite::params_from_iter(values), inspection);
        rows.and_then(Iterator::collect).map_err(self.error())
    }

    fn trends(&self, filter: &InspectionFilter) -> Result<Trends, PortError> {
        self.count_trends(filter)
    }

    fn set_result(&self, id: InspectionId, result: &ResultRows) -> Result<(), PortError> {
        self.in_transaction(|transaction| note_result(transaction, id, result))
    }

    fn without_result(&self) -> Result<Vec<InspectionId>, PortError> {
        let connection = self.connection();
        let sql = "SELECT id FROM inspections WHERE listed = 0 AND state <> 'running' ORDER BY id";
        let mut select = connection.prepare(sql).map_err(self.error())?;
        let rows = select.query_map([], |row| parsed(row, 0));
        rows.and_then(Iterator::collect).map_err(self.error())
    }

    fn views(&self, id: InspectionId) -> Result<Vec<ViewRow>, PortError> {
        let connection = self.connection();
        let sql = "SELECT number, accepted, record FROM views WHERE inspection = ?1 ORDER BY number";
        let mut select = connection.prepare(sql).map_err(self.error())?;
        let rows = select.query_map([id.to_string()], |row| {
            Ok(ViewRow { index: row.get(0)?, accepted: row.get(1)?, record: row.get(2)? })
        });
        rows.and_then(Iterator::collect).map_err(self.error())
    }

    fn events(&self, id: InspectionId, from: u64, limit: u32) -> Result<Vec<EventRow>, PortError> {
        let connection = self.connection();
        let sql = "SELECT sequence, time, kind FROM events WHERE inspection = ?1 AND sequence >= ?2 \
                   ORDER BY sequence LIMIT ?3";
        let mut select = connection.prepare(sql).map_err(self.error())?;
        let rows = select.query_map(params![id.to_string(), from, limit], |row| {
            Ok(EventRow { sequence: row.get(0)?, time: parsed(row, 1)?, kind: row.get(2)? })
        });
        rows.and_then(Iterator::collect).map_err(self.error())
    }

    fn next_event(&self, id: InspectionId) -> Result<u64, PortError> {
        let sql = "SELECT coalesce(max(sequence) + 1, 0) FROM events WHERE inspection = ?1";
        self.connection().query_row(sql, [id.to_string()], |row| row.get(0)).map_err(self.error())
    }

    fn hold(&self, id: InspectionId, held: bool) -> Result<(), PortError> {
        self.in_transaction(|transaction| {
            let changed =
                transaction.execute("UPDATE inspections SET held = ?2 WHERE id = ?1", params![id.to_string(), held])?;
            if changed == 0 { Err(rusqlite::Error::QueryReturnedNoRows) } else { Ok(()) }
        })
    }

    fn remove(&self, id: InspectionId) -> Result<(), PortError> {
        self.in_transaction(|transaction| {
            transaction.execute("DELETE FROM inspections WHERE id = ?1", [id.to_string()])?;
            transaction.execute("DELETE FROM parts WHERE id NOT IN (SELECT part FROM inspections)", [])?;
            Ok(())
        })
    }
}

/// What a filter asks for, as a clause of SQL and its values. Only what is asked for stands in it, so that an index is used.
pub(super) fn conditions(filter: &InspectionFilter) -> (String, Vec<String>) {
    let InspectionFilter { state, part, decision, in_conflict, component, defect, from, until, before, limit: _ } =
        filter;
    let mut clauses: Vec<String> = Vec::new();
    let mut values: Vec<String> = Vec::new();
    let mut ask = |clause: &str, given: &[&str]| {
        let mut clause = clause.to_owned();
        for value in given {
            values.push((*value).to_owned());
            clause = clause.replacen("{}", &format!("?{}", values.len()), 1);
        }
        clauses.push(clause);
    };
    if let Some(state) = state {
        ask("state = {}", &[state.name()]);
    }
    if let Some(part) = part {
        ask("inspections.part IN (SELECT id FROM parts WHERE holds(name, {}))", &[&folded(part)]);
    }
    if let Some(decision) = decision {
        ask("decision = {}", &[decision.name()]);
    }
    if *in_conflict {
        ask("conflicts > 0", &[]);
    }
    // The time that an inspection began at is the first part of its identifier.
    let first_at = |time: &Timestamp| {
        let millis = u64::try_from(time.as_millisecond()).unwrap_or(0);
        InspectionId::new(millis, &[0; 10]).to_string()
    };
    if let Some(from) = from {
        ask("inspections.id >= {}", &[&first_at(from)]);
    }
    if let Some(until) = until {
        ask("inspections.id < {}", &[&first_at(until)]);
    }
    if let Some(before) = before {
        ask("inspections.id < {}", &[&before.to_string()]);
    }
    // Asked of each inspection from the latest down: a page of a common class is full soon.
    let with = |condition: &str| {
        format!("EXISTS (SELECT 1 FROM findings WHERE {condition} AND findings.inspection = inspections.id)")
    };
    match (component, defect) {
        (None, None) => {}
        (Some(component), None) => ask(&with("component = {}"), &[component]),
        (None, Some(defect)) => ask(&with("defect = {}"), &[defect]),
        (Some(component), Some(defect)) => ask(&with("defect = {} AND component = {}"), &[defect, component]),
    }
    let text = if clauses.is_empty() { String::new() } else { format!("WHERE {}", clauses.join(" AND ")) };
    (text, values)
}

/// Puts what is listed of an inspection in place of what was listed before.
fn note_result(transaction: &Transaction<'_>, id: InspectionId, result: &ResultRows) -> rusqlite::Result<()> {
    note_row(transaction, id, &result.row)?;
    note_findings(transaction, id, &result.findings)?;
    let listed = "UPDATE inspections SET listed = 1, confidence = ?2 WHERE id = ?1";
    transaction.execute(listed, params![id.to_string(), result.confidence]).map(drop)
}

/// Notes in short what an inspection comes to.
pub(super) fn note_row(transaction: &Transaction<'_>, id: InspectionId, row: &ResultRow) -> rusqlite::Result<()> {
    let ResultRow { decision, automatic, conflicts, findings } = row;
    let changed = transaction.execute(
        "UPDATE inspections SET decision = ?2, automatic = ?3, conflicts = ?4, findings = ?5 WHERE id = ?1",
        params![id.to_string(), decision.map(Decision::name), automatic.map(Decision::name), conflicts, findings],
    )?;
    if changed == 0 { Err(rusqlite::Error::QueryReturnedNoRows) } else { Ok(()) }
}

/// Puts the findings of an inspection in place of those that were listed before.
pub(super) fn note_findings(
    transaction: &Transaction<'_>,
    id: InspectionId,
    findings: &[FindingRow],
) -> rusqlite::Result<()> {
    let id = id.to_string();
    transaction.execute("DELETE FROM findings WHERE inspection = ?1", [&id])?;
    let mut insert = transaction.prepare(
        "INSERT INTO findings (inspection, id, kind, component, defect, area) VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
    )?;
    for FindingRow { id: finding, kind, component, defect, area } in findings {
        insert.execute(params![id, finding, kind, component, defect, area])?;
    }
    Ok(())
}

fn inspection(row: &Row<'_>) -> rusqlite::Result<InspectionRow> {
    let decision = |column: usize| -> rusqlite::Result<Option<Decision>> {
        let name: Option<String> = row.get(column)?;
        Ok(name.as_deref().and_then(Decision::from_name))
    };
    Ok(InspectionRow {
        id: parsed(row, 0)?,
        part: row.get(1)?,
        source: row.get(2)?,
        spec: row.get(3)?,
        began: parsed(row, 4)?,
        ended: row.get::<_, Option<String>>(5)?.map(|_| parsed(row, 5)).transpose()?,
        state: parsed(row, 6)?,
        reason: row.get(7)?,
        held: row.get(8)?,
        views: row.get(9)?,
        result: ResultRow {
            decision: decision(10)?,
            automatic: decision(11)?,
            conflicts: row.get(12)?,
            findings: row.get(13)?,
        },
    })
}

/// A column of text that stands for something else.
fn parsed<T: FromStr>(row: &Row<'_>, column: usize) -> rusqlite::Result<T>
where
    T::Err: Display,
{
    let text: String = row.get(column)?;
    text.parse().map_err(|error: T::Err| {
        let reason = format!("{text:?}: {error}");
        rusqlite::Error::FromSqlConversionFailure(column, rusqlite::types::Type::Text, reason.into())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(millis: u64, part: &str) -> InspectionRow {
        InspectionRow {
            id: InspectionId::new(millis, &[3; 10]),
            part: part.into(),
            source: "virtual:starter-motor".into(),
            spec: "{}".into(),
            began: Timestamp::from_millisecond(millis as i64).expect("in range"),
            ended: None,
            state: InspectionState::Running,
            reason: None,
            held: false,
            views: 0,
            result: ResultRow::default(),
        }
    }

    fn event(sequence: u64) -> EventRow {
        EventRow { sequence, time: Timestamp::UNIX_EPOCH, kind: format!("{{\"n\":{sequence}}}") }
    }

    #[test]
    fn what_was_committed_is_there_after_opening_again_and_a_half_commit_is_not() {
        let root = tempfile::tempdir().expect("a folder");
        let path = root.path().join("semascan.db");
        let first = row(1_700_000_000_000, "motor 'x\"; DROP TABLE parts");
        let message = |n: u64| BusMessage { id: n.to_string(), subject: "inspection".into(), payload: "{}".into() };
        let commit = |index: u32| Commit {
            events: vec![event(2 * u64::from(index)), event(2 * u64::from(index) + 1)],
            view: Some(ViewRow { index, accepted: index != 1, record: format!("{{\"index\":{index}}}") }),
            messages: vec![message(index.into())],
        };
        {
            let catalogue = SqliteCatalogue::open(&path).expect("opens");
            assert_eq!(catalogue.next_event(first.id), Ok(0));
            catalogue.begin(&first).expect("begun");
            assert!(catalogue.begin(&first).is_err(), "there is one already");
            (0..3).for_each(|index| catalogue.commit(first.id, &commit(index)).expect("committed"));
            // An event that is there already: nothing of this commit is taken, its view neither.
            let refused = Commit { view: Some(ViewRow { index: 9, accepted: true, record: "{}".into() }), ..commit(2) };
            let error = catalogue.commit(first.id, &refused).expect_err("twice");
            assert!(error.to_string().contains("semascan.db"), "{error}");
            assert!(catalogue.commit(row(5, "").id, &commit(0)).is_err(), "of no inspection");
            catalogue.publish(&[message(0), message(7)]).expect("published");
        }
        let catalogue = SqliteCatalogue::open_existing(&path).expect("opens");
        assert_eq!(catalogue.inspection(first.id), Ok(Some(InspectionRow { views: 3, ..first.clone() })));
        let views = catalogue.views(first.id).expect("reads");
        assert_eq!(views.iter().map(|v| (v.index, v.accepted)).collect::<Vec<_>>(), [(0, true), (1, false), (2, true)]);
        assert_eq!(catalogue.events(first.id, 1, 3), Ok(vec![event(1), event(2), event(3)]));
        assert_eq!(catalogue.next_event(first.id), Ok(6));
        let waiting = catalogue.waiting(10).expect("reads");
        assert_eq!(waiting.iter().map(|m| m.id.as_str()).collect::<Vec<_>>(), ["0", "1", "2", "7"], "each once");
        catalogue.delivered(&["0", "2"]).expect("forgotten");
        assert_eq!(catalogue.waiting(1).expect("reads")[0].id, "1");
        // A view that is made again replaces its row.
        let again = Commit {
            events: vec![],
            view: Some(ViewRow { index: 1, accepted: true, record: "{}".into() }),
            messages: vec![],
        };
        catalogue.commit(first.id, &again).expect("committed");
        assert!(catalogue.views(first.id).expect("reads")[1].accepted);
        assert_eq!(catalogue.faults(), Ok(vec![]));
        catalogue.remove(first.id).expect("removed");
        assert_eq!(catalogue.views(first.id), Ok(vec![]));
        assert_eq!(catalogue.events(first.id, 0, 9), Ok(vec![]));
    }

    #[test]
    fn inspections_are_listed_latest_first_by_state_and_part_and_page() {
        let root = tempfile::tempdir().expect("a folder");
        let catalogue = SqliteCatalogue::open(&root.path().join("semascan.db")).expect("opens");
        for n in 0..6 {
            catalogue.begin(&row(1000 + n, if n % 2 == 0 { "even" } else { "odd" })).expect("begun");
        }
        let id = |n: u64| row(1000 + n, "").id;
        catalogue.close(id(4), Timestamp::UNIX_EPOCH, InspectionState::Failed, Some("no view")).expect("closed");
        assert!(catalogue.close(id(40), Timestamp::UNIX_EPOCH, InspectionState::Failed, None).is_err());
        catalogue.hold(id(2), true).expect("held");
        let list = |filter: InspectionFilter| {
            let rows = catalogue.inspections(&filter).expect("reads");
            rows.into_iter().map(|row| row.id).collect::<Vec<_>>()
        };
        let all = InspectionFilter::default;
        assert_eq!(list(all()), [5, 4, 3, 2, 1, 0].map(id));
        assert_eq!(list(InspectionFilter { part: Some("even".into()), ..all() }), [4, 2, 0].map(id));
        assert_eq!(list(InspectionFilter { state: Some(InspectionState::Failed), ..all() }), [id(4)]);
        assert_eq!(list(InspectionFilter { before: Some(id(3)), limit: 2, ..all() }), [2, 1].map(id));
        let time = |millis: i64| Timestamp::from_millisecond(millis).expect("in range");
        assert_eq!(
            list(InspectionFilter { from: Some(time(1002)), until: Some(time(1005)), ..all() }),
            [4, 3, 2].map(id)
        );
        let failed = catalogue.inspection(id(4)).expect("reads").expect("there");
        assert_eq!((failed.ended, failed.reason.as_deref()), (Some(Timestamp::UNIX_EPOCH), Some("no view")));
        assert!(catalogue.inspection(id(2)).expect("reads").expect("there").held);
    }

    #[test]
    fn a_part_is_found_by_a_piece_of_its_name_whatever_its_case() {
        let root = tempfile::tempdir().expect("a folder");
        let catalogue = SqliteCatalogue::open(&root.path().join("semascan.db")).expect("opens");
        for (n, name) in (0..).zip(["Gear 7", "GEARBOX", "Öl-Pumpe", "100 % shell", "shell_2"]) {
            catalogue.begin(&row(1000 + n, name)).expect("begun");
        }
        let found = |piece: &str| {
            let filter = InspectionFilter { part: Some(piece.into()), ..InspectionFilter::default() };
            let rows = catalogue.inspections(&filter).expect("reads");
            rows.into_iter().map(|row| row.part).collect::<Vec<_>>()
        };
        assert_eq!(found("gear"), ["GEARBOX", "Gear 7"]);
        assert_eq!(found("EAR 7"), ["Gear 7"]);
        assert_eq!(found("ÖL-P"), ["Öl-Pumpe"]);
        assert_eq!(found("öl"), ["Öl-Pumpe"]);
        // Marks that mean something to LIKE mean themselves.
        assert_eq!((found("%"), found("_"), found("'")), (vec!["100 % shell".into()], vec!["shell_2".into()], vec![]));
        assert_eq!(found("").len(), 5);
        // The agent and a command beside it read the same database.
        let beside = SqliteCatalogue::open_existing(&root.path().join("semascan.db")).expect("opens");
        let filter = InspectionFilter { part: Some("BOX".into()), ..InspectionFilter::default() };
        assert_eq!(beside.inspections(&filter).expect("reads").len(), 1);
    }

    fn found(component: &str, defect: &str, area: f64) -> FindingRow {
        let id = InspectionId::new(area as u64, &[9; 10]).to_string();
        FindingRow { id, kind: "defect", component: component.into(), defect: Some(defect.into()), area: Some(area) }
    }

    fn result(decision: Decision, conflicts: u32, findings: &[FindingRow]) -> ResultRows {
        let row = ResultRow {
            decision: Some(decision),
            automatic: Some(Decision::Reject),
            conflicts,
            findings: Some(findings.len() as u32),
        };
        ResultRows { row, findings: findings.to_vec(), confidence: None }
    }

    #[test]
    fn inspections_are_listed_by_verdict_conflict_and_class() {
        let root = tempfile::tempdir().expect("a folder");
        let catalogue = SqliteCatalogue::open(&root.path().join("semascan.db")).expect("opens");
        let id = |n: u64| row(1000 + n, "").id;
        for n in 0..4 {
            catalogue.begin(&row(1000 + n, "motor")).expect("begun");
            catalogue.close(id(n), Timestamp::UNIX_EPOCH, InspectionState::Finished, None).expect("closed");
        }
        assert_eq!(catalogue.without_result().expect("reads"), [0, 1, 2, 3].map(id));
        assert_eq!(catalogue.inspection(id(0)).expect("reads").expect("there").result, ResultRow::default());
        catalogue.set_result(id(0), &result(Decision::Accept, 0, &[])).expect("noted");
        let rusty = [found("gear", "corrosion", 1.0), found("shell", "wear", 2.0)];
        catalogue.set_result(id(1), &result(Decision::Reject, 0, &rusty)).expect("noted");
        catalogue.set_result(id(2), &result(Decision::Person, 2, &[found("gear", "wear", 3.0)])).expect("noted");
        assert!(catalogue.set_result(id(9), &result(Decision::Accept, 0, &[])).is_err(), "there is none");
        assert_eq!(catalogue.without_result().expect("reads"), [id(3)]);
        let all = InspectionFilter::default;
        let list = |filter: InspectionFilter| {
            let rows = catalogue.inspections(&filter).expect("reads");
            rows.into_iter().map(|row| row.id).collect::<Vec<_>>()
        };
        let some = |text: &str| Some(text.to_owned());
        assert_eq!(list(InspectionFilter { decision: Some(Decision::Reject), ..all() }), [id(1)]);
        assert_eq!(list(InspectionFilter { in_conflict: true, ..all() }), [id(2)]);
        assert_eq!(list(InspectionFilter { component: some("gear"), ..all() }), [2, 1].map(id));
        assert_eq!(list(InspectionFilter { defect: some("wear"), ..all() }), [2, 1].map(id));
        // The component and the defect of one finding, not of two.
        let both = InspectionFilter { component: some("gear"), defect: some("wear"), ..all() };
        assert_eq!(list(both.clone()), [id(2)]);
        assert_eq!(list(InspectionFilter { part: some("other"), ..both }), []);
        let noted = catalogue.inspection(id(1)).expect("reads").expect("there").result;
        assert_eq!(noted, result(Decision::Reject, 0, &rusty).row);
        catalogue.set_result(id(1), &result(Decision::Accept, 0, &rusty[..1])).expect("noted again");
        assert_eq!(list(InspectionFilter { defect: some("wear"), ..all() }), [id(2)]);
        catalogue.remove(id(2)).expect("removed");
        assert_eq!(list(InspectionFilter { defect: some("wear"), ..all() }), []);
        assert_eq!(catalogue.faults(), Ok(vec![]));
    }

    #[test]
    fn a_newer_database_and_what_is_none_are_refused_by_name_and_left_alone() {
        let root = tempfile::tempdir().expect("a folder");
        let path = root.path().join("semascan.db");
        drop(SqliteCatalogue::open(&path).expect("made"));
        let connection = Connection::open(&path).expect("opens");
        connection.pragma_update(None, "user_version", 99).expect("set");
        drop(connection);
        let before = std::fs::read(&path).expect("reads");
        let said = SqliteCatalogue::open(&path).expect_err("newer").to_string();
        assert!(said.contains("semascan.db") && said.contains("schema 99"), "{said}");
        assert_eq!(std::fs::read(&path).expect("reads"), before);
        let text = root.path().join("text.db");
        std::fs::write(&text, "this is no database, but a text that is long enough for a header of one".repeat(9))
            .expect("writes");
        let said = SqliteCatalogue::open(&text).expect_err("no database").to_string();
        assert!(said.contains("text.db"), "{said}");
        assert!(SqliteCatalogue::open_existing(&root.path().join("none.db")).is_err());
    }
}
