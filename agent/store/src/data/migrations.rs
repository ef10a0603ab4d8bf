//! The schema of the database, made by numbered SQL files. `PRAGMA user_version` holds the number of the last one.

use rusqlite::{Connection, TransactionBehavior};

/// The files in order; a released one never changes.
const MIGRATIONS: &[&str] = &[
    include_str!("../../migrations/0001_inspections.sql"),
    include_str!("../../migrations/0002_reviews.sql"),
    include_str!("../../migrations/0003_access.sql"),
    include_str!("../../migrations/0004_account_log.sql"),
    include_str!("../../migrations/0005_provider_identities.sql"),
    include_str!("../../migrations/0006_confidence.sql"),
];

/// Why the schema cannot be brought up to date.
#[derive(Debug, thiserror::Error)]
pub(super) enum MigrationError {
    /// A newer program made it.
    #[error("has schema {found}, and this version of semascan knows {known}: use a newer one")]
    Newer {
        /// Its schema.
        found: i64,
        /// The newest known.
        known: usize,
    },
    /// A file could not be run.
    #[error(transparent)]
    Sqlite(#[from] rusqlite::Error),
}

/// Runs the files that the database has not seen, each in a transaction of its own.
pub(super) fn migrate(connection: &mut Connection) -> Result<(), MigrationError> {
    loop {
        // Two programs may open it at once: the version is read when nobody else can change it.
        let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
        let found: i64 = transaction.query_row("PRAGMA user_version", [], |row| row.get(0))?;
        let done = usize::try_from(found).map_err(|_| MigrationError::Newer { found, known: MIGRATIONS.len() })?;
        if done > MIGRATIONS.len() {
            return Err(MigrationError::Newer { found, known: MIGRATIONS.len() });
        }
        let Some(next) = MIGRATIONS.get(done) else { return Ok(()) };
        transaction.execute_batch(next)?;
        transaction.pragma_update(None, "user_version", found + 1)?;
        transaction.commit()?;
    }
}
