//! Append-only logs in SQLite whose entries are chained by hashes: the log of reviews and that of accounts. Triggers refuse every
//! change of an entry; the chain shows what was done to the file behind the database's back.

use rusqlite::{Connection, OptionalExtension, Row, Transaction, params_from_iter};
use semascan_inspection::chain::{self, Chained, FIRST, Link};
use std::marker::PhantomData;

/// What a log came to when it was read from its beginning to its end.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Audited {
    /// Entries that were read, the bad one included.
    pub entries: u64,
    /// Hash of the last good entry, hexadecimal; who notes it elsewhere can tell later whether entries behind it are missing.
    pub head: String,
    /// The first bad entry; absent where all are good.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<BadEntry>,
}

/// An entry that is not what was written.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct BadEntry {
    /// Its place in the log.
    pub sequence: u64,
    /// What it is found by, as the log has it: the name of a review. Empty in a log whose entries have their place alone.
    pub id: String,
    /// What is wrong with it.
    pub reason: String,
}

/// A log of entries `T`: its table, the columns of what they are found by, and what people call it.
pub(super) struct ChainedLog<T> {
    table: &'static str,
    keys: &'static [&'static str],
    pub(super) name: &'static str,
    entries: PhantomData<fn() -> T>,
}

impl<T: Chained> ChainedLog<T> {
    pub(super) const fn new(table: &'static str, keys: &'static [&'static str], name: &'static str) -> Self {
        Self { table, keys, name, entries: PhantomData }
    }

    /// Begins of a query for whole rows, which [`link`](Self::link) reads.
    pub(super) fn select(&self) -> String {
        let keys: String = self.keys.iter().map(|key| format!(", {key}")).collect();
        format!("SELECT sequence, entry, previous, hash{keys} FROM {}", self.table)
    }

    /// A row of such a query.
    pub(super) fn link(&self, row: &Row<'_>) -> rusqlite::Result<Link> {
        let keys = (4..4 + self.keys.len()).map(|column| row.get(column)).collect::<rusqlite::Result<_>>()?;
        Ok(Link { sequence: row.get(0)?, keys, entry: row.get(1)?, previous: row.get(2)?, hash: row.get(3)? })
    }

    /// An entry whose hash is checked, so that what was changed behind the database's back is not taken for what was written.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub(super) fn read(&self, link: &Link) -> Result<T, String> {
        let wrong = |reason| {
            let id = link.keys.first().map_or(String::new(), |id| format!(" ({id})"));
            format!("entry {} of {}{id} {reason}", link.sequence, self.name)
        };
        chain::read(link, link.sequence, &link.previous).map_err(wrong)
    }

    /// Place of the last entry; 0 where there is none.
    pub(super) fn last(&self, connection: &Connection) -> rusqlite::Result<u64> {
        let sql = format!("SELECT coalesce(max(sequence), 0) FROM {}", self.table);
        connection.query_row(&sql, [], |row| row.get(0))
    }

    /// Appends an entry, whose place is the next one; its hash.
    pub(super) fn append(&self, transaction: &Transaction<'_>, entry: &T) -> rusqlite::Result<String> {
        let text = chain::canonical(entry).map_err(|error| rusqlite::Error::ToSqlConversionFailure(error.into()))?;
        let sql = format!("SELECT hash FROM {} ORDER BY sequence DESC LIMIT 1", self.table);
        let previous: Option<String> = transaction.query_row(&sql, [], |row| row.get(0)).optional()?;
        let previous = previous.unwrap_or_else(|| FIRST.to_owned());
        let hash = chain::hash(&previous, &text);
        let keys: String = self.keys.iter().map(|key| format!(", {key}")).collect();
        let places: String = (5..5 + self.keys.len()).map(|place| format!(", ?{place}")).collect();
        let sql = format!(
            "INSERT INTO {} (sequence, entry, previous, hash{keys}) VALUES (CAST(?1 AS INTEGER), ?2, ?3, ?4{places})",
            self.table
        );
        let values = [entry.sequence().to_string(), text, previous, hash.clone()].into_iter().chain(entry.keys());
        transaction.execute(&sql, params_from_iter(values))?;
        Ok(hash)
    }

    /// Reads the whole log and compares every entry with its hash and with the one before it. Where `noted` is given, the hash
    /// of an entry that was noted earlier, that entry must still be there.
    pub(super) fn audit(&self, connection: &Connection, noted: Option<&str>) -> rusqlite::Result<Audited> {
        let mut select = connection.prepare(&format!("{} ORDER BY sequence", self.select()))?;
        let mut rows = select.query([])?;
        let (mut entries, mut head) = (0, FIRST.to_owned());
        let mut is_noted = noted.is_none_or(|noted| noted == FIRST);
        while let Some(row) = rows.next()? {
            let link = self.link(row)?;
            entries += 1;
            if let Err(reason) = chain::read::<T>(&link, entries, &head) {
                let id = link.keys.into_iter().next().unwrap_or_default();
                let fault = Some(BadEntry { sequence: link.sequence, id, reason });
                return Ok(Audited { entries, head, fault });
            }
            is_noted |= noted == Some(link.hash.as_str());
            head = link.hash;
        }
        let missing = || BadEntry {
            sequence: entries + 1,
            id: String::new(),
            reason: format!(
                "is missing: the log ends here, and the entry that was noted ({}) is not in it",
                noted.unwrap_or_default()
            ),
        };
        Ok(Audited { entries, head, fault: (!is_noted).then(missing) })
    }
}
