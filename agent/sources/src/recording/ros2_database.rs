//! ROS 2 bags in SQLite files (`.db3`), as rosbag2 and RealSense's recorder write them: a table of topics and one of messages.
//!
//! The file comes from outside. It is opened to be read only; the tables must be plain ones, so that asking for a row runs
//! nothing that the file brings along.

use super::container::{Channel, Container, End, Found, Place, Visit, format_error, io_error};
use crate::messages::Stamp;
use rusqlite::config::DbConfig;
use rusqlite::{Connection, OpenFlags, OptionalExtension};
use semascan_formats::regular_file;
use semascan_inspection::source::SourceError;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The first bytes of an SQLite file.
pub(crate) const MAGIC: &[u8] = b"SQLite format 3\0";
/// The first bytes of what zstd compressed, which no CDR message begins with: bags may compress each message.
const ZSTD: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];
/// Most bytes of a compressed message's content.
const LARGEST_MESSAGE: u64 = 256 << 20;

/// A ROS 2 bag in an SQLite file.
pub(crate) struct Ros2Database {
    path: PathBuf,
    database: Connection,
    /// Bytes of the file; no message is longer.
    length: u64,
}

impl Ros2Database {
    pub(crate) fn open(path: &Path) -> Result<Self, SourceError> {
        let file = regular_file::open(path).map_err(io_error(path))?;
        let length = file.metadata().map_err(io_error(path))?.len();
        drop(file);
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let database = Connection::open_with_flags(path, flags).map_err(|error| failed(path, &error))?;
        let bag = Self { path: path.to_owned(), database, length };
        bag.database.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true).map_err(|error| bag.failed(&error))?;
        bag.database
            .set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)
            .map_err(|error| bag.failed(&error))?;
        for (table, columns) in
            [("topics", &["id", "name", "type"][..]), ("messages", &["id", "topic_id", "timestamp", "data"])]
        {
            bag.check_table(table, columns)?;
        }
        Ok(bag)
    }

    /// Whether a table is there, is no view, and has plain columns of these names.
    fn check_table(&self, table: &str, columns: &[&str]) -> Result<(), SourceError> {
        let kind = self
            .database
            .query_row("SELECT type FROM sqlite_schema WHERE name = ?1 AND sql NOT LIKE '%VIRTUAL%'", [table], |row| {
                row.get::<_, String>(0)
            })
            .optional()
            .map_err(|error| self.failed(&error))?;
        if kind.as_deref() != Some("table") {
            let reason = format!("is no ROS 2 bag: it has no table {table:?}");
            return Err(format_error(&self.path, reason));
        }
        let mut found = BTreeMap::new();
        let mut statement = self
            .database
            .prepare("SELECT name, hidden FROM pragma_table_xinfo(?1)")
            .map_err(|error| self.failed(&error))?;
        let rows = statement
            .query_map([table], |row| Ok((row.get::<_, String>(0)?, row.get::<_, i64>(1)?)))
            .map_err(|error| self.failed(&error))?;
        for row in rows {
            let (name, hidden) = row.map_err(|error| self.failed(&error))?;
            found.insert(name, hidden);
        }
        for column in columns {
            if found.get(*column) != Some(&0) {
                let reason = format!("is no ROS 2 bag: its table {table:?} has no plain column {column:?}");
                return Err(format_error(&self.path, reason));
            }
        }
        Ok(())
    }

    fn channels(&self) -> Result<BTreeMap<i64, Channel>, SourceError> {
        // The encoding of all of them is CDR where the column is not there, as in the oldest bags.
        let has_encoding = self.check_table("topics", &["serialization_format"]).is_ok();
        let encoding = if has_encoding { "serialization_format" } else { "'cdr'" };
        let mut statement = self
            .database
            .prepare(&format!("SELECT id, name, type, {encoding} FROM topics"))
            .map_err(|error| self.failed(&error))?;
        let rows = statement
            .query_map([], |row| {
                let text = |column| row.get::<_, String>(column);
                Ok((row.get::<_, i64>(0)?, Channel::new(&text(1)?, &text(2)?, &text(3)?)))
            })
            .map_err(|error| self.failed(&error))?;
        rows.collect::<Result<_, _>>().map_err(|error| self.failed(&error))
    }

    fn failed(&self, error: &rusqlite::Error) -> SourceError {
        failed(&self.path, error)
    }

    /// The message as it was before it was compressed.
    fn decompressed(message: Vec<u8>) -> Result<Vec<u8>, String> {
        if !message.starts_with(ZSTD) {
            return Ok(message);
        }
        let mut content = Vec::new();
        let decoder = zstd::stream::read::Decoder::new(message.as_slice()).map_err(|error| error.to_string())?;
        std::io::Read::read_to_end(&mut std::io::Read::take(decoder, LARGEST_MESSAGE), &mut content)
            .map_err(|error| error.to_string())?;
        Ok(content)
    }
}

fn failed(path: &Path, error: &rusqlite::Error) -> SourceError {
    format_error(path, format!("SQLite: {error}"))
}

impl Container for Ros2Database {
    fn path(&self) -> &Path {
        &self.path
    }

    fn scan(&mut self, visit: &mut Visit<'_>) -> Result<End, SourceError> {
        let channels = self.channels()?;
        let wanted: BTreeMap<_, _> = channels.iter().filter(|(_, channel)| channel.decoded.is_some()).collect();
        let mut statement = self
            .database
            .prepare("SELECT id, topic_id, timestamp, data FROM messages WHERE length(data) <= ?1 ORDER BY id")
            .map_err(|error| self.failed(&error))?;
        let mut rows =
            statement.query([i64::try_from(self.length).unwrap_or(i64::MAX)]).map_err(|error| self.failed(&error))?;
        loop {
            // A page that is damaged or was never written ends the bag.
            let row = match rows.next() {
                Ok(Some(row)) => row,
                Ok(None) => return Ok(End::Whole),
                Err(error) => return Ok(End::Cut(error.to_string())),
            };
            let read = |row: &rusqlite::Row<'_>| {
                let (id, topic, nanoseconds) = (row.get::<_, i64>(0)?, row.get::<_, i64>(1)?, row.get::<_, i64>(2)?);
                let is_wanted = wanted.contains_key(&topic);
                Ok((id, topic, nanoseconds, if is_wanted { row.get::<_, Vec<u8>>(3)? } else { Vec::new() }))
            };
            let (id, topic, nanoseconds, message) = match read(row) {
                Ok(read) => read,
                Err(error) => {
                    let error: rusqlite::Error = error;
                    return Ok(End::Cut(error.to_string()));
                }
            };
            if let Some(channel) = wanted.get(&topic) {
                let Ok(message) = Self::decompressed(message) else { continue };
                let place = Place { block: id.cast_unsigned(), offset: 0, length: message.len() };
                visit(channel, Found { logged: Stamp { nanoseconds }, place, message: &message });
            }
        }
    }

    fn read(&mut self, place: Place) -> Result<Vec<u8>, SourceError> {
        let message = self
            .database
            .query_row("SELECT data FROM messages WHERE id = ?1", [place.block.cast_signed()], |row| {
                row.get::<_, Vec<u8>>(0)
            })
            .map_err(|error| self.failed(&error))?;
        Self::decompressed(message).map_err(|reason| format_error(&self.path, reason))
    }
}
