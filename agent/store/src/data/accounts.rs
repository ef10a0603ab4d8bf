//! Users, sessions and tokens in the database of a data folder, over a connection of their own: a login waits for no
//! inspection, and users can be changed while an agent runs.

use super::connection;
use super::folder::DATABASE;
use crate::StoreError;
use jiff::Timestamp;
use rusqlite::types::Type;
use rusqlite::{Connection, OptionalExtension, Row, Transaction, TransactionBehavior, params};
use semascan_inspection::ports::{Accounts, PortError, SecretDigest, SessionRow, TokenRow, UserRow};
use semascan_model::Role;
use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The users, sessions and tokens of a data folder.
#[derive(Debug)]
pub struct SqliteAccounts {
    path: PathBuf,
    connection: Mutex<Connection>,
}

impl SqliteAccounts {
    /// Opens those of the data folder `folder`, which must be there; an agent may hold it meanwhile.
    ///
    /// # Errors
    /// [`StoreError`]: there is none, or its database cannot be used.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        let path = folder.join(DATABASE);
        fs::metadata(&path).map_err(StoreError::io(&path))?;
        let connection = Mutex::new(connection::open(&path, false)?);
        Ok(Self { path, connection })
    }

    fn connection(&self) -> MutexGuard<'_, Connection> {
        // A transaction that a panic cut off was rolled back.
        self.connection.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn error(&self) -> impl Fn(rusqlite::Error) -> PortError {
        |error| connection::failed(&self.path, &error)
    }

    /// The rows that `sql` selects.
    fn select<T>(&self, sql: &str, read: impl Fn(&Row<'_>) -> rusqlite::Result<T>) -> Result<Vec<T>, PortError> {
        let connection = self.connection();
        let mut select = connection.prepare(sql).map_err(self.error())?;
        let rows = select.query_map([], read);
        rows.and_then(Iterator::collect).map_err(self.error())
    }

    /// Does `work` as a whole or not at all; whether it changed anything.
    fn change(&self, work: impl FnOnce(&Transaction<'_>) -> rusqlite::Result<usize>) -> Result<bool, PortError> {
        let mut connection = self.connection();
        // Immediate: another process may write, and waiting for it is only possible before the first statement.
        let begun = connection.transaction_with_behavior(TransactionBehavior::Immediate);
        let transaction = begun.map_err(self.error())?;
        let changed = work(&transaction).map_err(self.error())?;
        transaction.commit().map_err(self.error())?;
        Ok(changed > 0)
    }
}

const USER: &str = "SELECT name, role, password, created, password_set, removed FROM users";
const TOKEN: &str = "SELECT name, role, digest, created, expires, revoked FROM tokens";

impl Accounts for SqliteAccounts {
    fn add_user(&self, row: &UserRow) -> Result<bool, PortError> {
        self.change(|transaction| {
            transaction.execute(
                "INSERT INTO users (name, role, password, created, password_set, removed) \
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6) ON CONFLICT (name) DO NOTHING",
                params![
                    row.name,
                    row.role.name(),
                    row.password,
                    seconds(row.created),
                    seconds(row.password_set),
                    row.removed.map(seconds)
                ],
            )
        })
    }

    fn user(&self, name: &str) -> Result<Option<UserRow>, PortError> {
        let connection = self.connection();
        connection.query_row(&format!("{USER} WHERE name = ?1"), [name], user).optional().map_err(self.error())
    }

    fn users(&self) -> Result<Vec<UserRow>, PortError> {
        self.select(&format!("{USER} ORDER BY name"), user)
    }

    fn set_password(&self, name: &str, password: &str, time: Timestamp) -> Result<bool, PortError> {
        self.change(|transaction| {
            transaction.execute("DELETE FROM sessions WHERE user = ?1", [name])?;
            transaction.execute(
                "UPDATE users SET password = ?2, password_set = ?3 WHERE name = ?1 AND removed IS NULL",
                params![name, password, seconds(time)],
            )
        })
    }

    fn set_role(&self, name: &str, role: Role) -> Result<bool, PortError> {
        self.change(|transaction| {
            transaction
                .execute("UPDATE users SET role = ?2 WHERE name = ?1 AND removed IS NULL", params![name, role.name()])
        })
    }

    fn remove_user(&self, name: &str, time: Timestamp) -> Result<bool, PortError> {
        self.change(|transaction| {
            transaction.execute("DELETE FROM sessions WHERE user = ?1", [name])?;
            transaction.execute(
                "UPDATE users SET removed = ?2, password = '' WHERE name = ?1 AND removed IS NULL",
                params![name, seconds(time)],
            )
        })
    }

    fn begin_session(&self, row: &SessionRow, most: u32) -> Result<(), PortError> {
        let begun = self.change(|transaction| {
            transaction.execute(
                "INSERT INTO sessions (digest, user, began, used) VALUES (?1, ?2, ?3, ?4)",
                params![row.digest, row.user, seconds(row.began), seconds(row.used)],
            )?;
            transaction.execute(
                "DELETE FROM sessions WHERE user = ?1 AND digest NOT IN \
                 (SELECT digest FROM sessions WHERE user = ?1 ORDER BY digest = ?2 DESC, used DESC LIMIT ?3)",
                params![row.user, row.digest, most],
            )
        });
        begun.map(drop)
    }

    fn session(&self, digest: &SecretDigest) -> Result<Option<(SessionRow, UserRow)>, PortError> {
        let connection = self.connection();
        let sql = "SELECT users.name, role, password, created, password_set, removed, digest, began, used \
                   FROM sessions JOIN users ON users.name = sessions.user WHERE digest = ?1";
        let mut select = connection.prepare(sql).map_err(self.error())?;
        let row = select.query_row([digest], |row| {
            let user = user(row)?;
            let session = SessionRow {
                digest: row.get(6)?,
                user: user.name.clone(),
                began: parsed(row, 7)?,
                used: parsed(row, 8)?,
            };
            Ok((session, user))
        });
        row.optional().map_err(self.error())
    }

    fn use_session(&self, digest: &SecretDigest, time: Timestamp) -> Result<(), PortError> {
        let used = self.change(|transaction| {
            transaction.execute("UPDATE sessions SET used = ?2 WHERE digest = ?1", params![digest, seconds(time)])
        });
        used.map(drop)
    }

    fn end_session(&self, digest: &SecretDigest) -> Result<bool, PortError> {
        self.change(|transaction| transaction.execute("DELETE FROM sessions WHERE digest = ?1", [digest]))
    }

    fn forget_sessions(&self, began: Timestamp, used: Timestamp) -> Result<(), PortError> {
        let forgotten = self.change(|transaction| {
            let times = params![seconds(began), seconds(used)];
            transaction.execute("DELETE FROM sessions WHERE began < ?1 OR used < ?2", times)
        });
        forgotten.map(drop)
    }

    fn add_token(&self, row: &TokenRow) -> Result<bool, PortError> {
        self.change(|transaction| {
            transaction.execute(
                "INSERT INTO tokens (name, role, digest, created, expires, revoked) \
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6) ON CONFLICT (name) DO NOTHING",
                params![
                    row.name,
                    row.role.name(),
                    row.digest,
                    seconds(row.created),
                    row.expires.map(seconds),
                    row.revoked.map(seconds)
                ],
            )
        })
    }

    fn token(&self, digest: &SecretDigest) -> Result<Option<TokenRow>, PortError> {
        let connection = self.connection();
        let mut select = connection.prepare(&format!("{TOKEN} WHERE digest = ?1")).map_err(self.error())?;
        select.query_row([digest], token).optional().map_err(self.error())
    }

    fn tokens(&self) -> Result<Vec<TokenRow>, PortError> {
        self.select(&format!("{TOKEN} ORDER BY name"), token)
    }

    fn revoke_token(&self, name: &str, time: Timestamp) -> Result<bool, PortError> {
        self.change(|transaction| {
            transaction.execute(
                "UPDATE tokens SET revoked = ?2 WHERE name = ?1 AND revoked IS NULL",
                params![name, seconds(time)],
            )
        })
    }

    fn signing_key(&self, proposed: [u8; 32]) -> Result<[u8; 32], PortError> {
        self.change(|transaction| {
            let sql = "INSERT INTO signing_key (id, key) VALUES (1, ?1) ON CONFLICT (id) DO NOTHING";
            transaction.execute(sql, [proposed])
        })?;
        self.connection().query_row("SELECT key FROM signing_key", [], |row| row.get(0)).map_err(self.error())
    }
}

/// A time as the tables have it: in whole seconds.
fn seconds(time: Timestamp) -> String {
    Timestamp::from_second(time.as_second()).unwrap_or(time).to_string()
}

fn user(row: &Row<'_>) -> rusqlite::Result<UserRow> {
    Ok(UserRow {
        name: row.get(0)?,
        role: parsed(row, 1)?,
        password: row.get(2)?,
        created: parsed(row, 3)?,
        password_set: parsed(row, 4)?,
        removed: row.get::<_, Option<String>>(5)?.map(|_| parsed(row, 5)).transpose()?,
    })
}

fn token(row: &Row<'_>) -> rusqlite::Result<TokenRow> {
    Ok(TokenRow {
        name: row.get(0)?,
        role: parsed(row, 1)?,
        digest: row.get(2)?,
        created: parsed(row, 3)?,
        expires: row.get::<_, Option<String>>(4)?.map(|_| parsed(row, 4)).transpose()?,
        revoked: row.get::<_, Option<String>>(5)?.map(|_| parsed(row, 5)).transpose()?,
    })
}

/// A column of text that stands for something else.
fn parsed<T: FromStr>(row: &Row<'_>, column: usize) -> rusqlite::Result<T>
where
    T::Err: Display,
{
    let text: String = row.get(column)?;
    text.parse().map_err(|error: T::Err| {
        rusqlite::Error::FromSqlConversionFailure(column, Type::Text, format!("{text:?}: {error}").into())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::DataFolder;

    fn at(second: i64) -> Timestamp {
        Timestamp::from_second(1_700_000_000 + second).expect("in range")
    }

    fn anna() -> UserRow {
        UserRow {
            name: "anna".into(),
            role: Role::Reviewer,
            password: "$argon2id$x".into(),
            created: at(0),
            password_set: at(0),
            removed: None,
        }
    }

    fn session(number: u8, used: i64) -> SessionRow {
        SessionRow { digest: [number; 32], user: "anna".into(), began: at(0), used: at(used) }
    }

    /// Accounts beside a folder that an agent holds, with one user.
    fn accounts() -> (tempfile::TempDir, DataFolder, SqliteAccounts) {
        let root = tempfile::tempdir().expect("a folder");
        let held = DataFolder::open(root.path()).expect("opens");
        let accounts = SqliteAccounts::open(root.path()).expect("opens beside");
        assert_eq!(accounts.add_user(&anna()), Ok(true));
        (root, held, accounts)
    }

    #[test]
    fn a_name_stays_with_its_user_and_sessions_end_with_what_they_rest_on() {
        let (root, _held, accounts) = accounts();
        assert_eq!(accounts.add_user(&UserRow { role: Role::Admin, ..anna() }), Ok(false));
        assert_eq!(accounts.user("anna"), Ok(Some(anna())));
        assert_eq!(accounts.user("Anna"), Ok(None));
        accounts.begin_session(&session(1, 0), 9).expect("begun");
        assert_eq!(accounts.session(&[1; 32]), Ok(Some((session(1, 0), anna()))));
        assert_eq!(accounts.set_role("anna", Role::Operator), Ok(true));
        let role = |digest| accounts.session(&digest).expect("reads").map(|(_, user)| user.role);
        assert_eq!(role([1; 32]), Some(Role::Operator), "at once");
        assert_eq!(accounts.set_password("anna", "$other", at(5)), Ok(true));
        assert_eq!(role([1; 32]), None, "a new password ends sessions");
        accounts.begin_session(&session(2, 0), 9).expect("begun");
        assert_eq!(accounts.remove_user("anna", at(7)), Ok(true));
        assert_eq!(role([2; 32]), None);
        // Another process sees the same.
        let accounts = SqliteAccounts::open(root.path()).expect("opens");
        let gone = accounts.user("anna").expect("reads").expect("kept");
        assert_eq!((gone.removed, gone.password.as_str()), (Some(at(7)), ""));
        assert_eq!(accounts.add_user(&anna()), Ok(false), "nobody else gets the name");
        assert_eq!(accounts.remove_user("anna", at(9)), Ok(false));
        assert_eq!(accounts.set_password("anna", "$x", at(9)), Ok(false));
        assert_eq!(accounts.set_role("anna", Role::Admin), Ok(false));
        assert_eq!(accounts.set_role("otto", Role::Admin), Ok(false));
        assert!(accounts.begin_session(&SessionRow { user: "otto".into(), ..session(3, 0) }, 9).is_err());
    }

    #[test]
    fn sessions_are_bounded_and_forgotten() {
        let (_root, _held, accounts) = accounts();
        (0..5).for_each(|n| accounts.begin_session(&session(n, 10 * i64::from(n)), 3).expect("begun"));
        let there = |n: u8| accounts.session(&[n; 32]).expect("reads").is_some();
        assert_eq!([0, 1, 2, 3, 4].map(there), [false, false, true, true, true]);
        // The one that begins stays, however long ago the others say that it was.
        accounts.begin_session(&session(9, -50), 3).expect("begun");
        assert_eq!([2, 3, 4, 9].map(there), [false, true, true, true]);
        accounts.use_session(&[3; 32], at(100)).expect("used");
        accounts.forget_sessions(at(0), at(40)).expect("forgotten");
        assert_eq!([3, 4, 9].map(there), [true, true, false]);
        accounts.forget_sessions(at(1), at(0)).expect("forgotten");
        assert_eq!([3, 4].map(there), [false, false]);
        accounts.begin_session(&session(7, 0), 3).expect("begun");
        assert_eq!((accounts.end_session(&[7; 32]), accounts.end_session(&[7; 32])), (Ok(true), Ok(false)));
    }

    #[test]
    fn tokens_are_revoked_once_and_for_good_and_the_key_stays() {
        let (root, _held, accounts) = accounts();
        let row = TokenRow {
            name: "dashboard".into(),
            role: Role::Viewer,
            digest: [5; 32],
            created: at(0),
            expires: Some(at(60)),
            revoked: None,
        };
        assert_eq!(accounts.add_token(&row), Ok(true));
        assert_eq!(accounts.add_token(&TokenRow { digest: [6; 32], ..row.clone() }), Ok(false));
        assert_eq!(accounts.token(&[5; 32]), Ok(Some(row.clone())));
        assert_eq!(accounts.token(&[6; 32]), Ok(None));
        assert_eq!(accounts.revoke_token("dashboard", at(1)), Ok(true));
        assert_eq!(accounts.revoke_token("dashboard", at(2)), Ok(false));
        assert_eq!(accounts.tokens(), Ok(vec![TokenRow { revoked: Some(at(1)), ..row }]));
        assert_eq!(accounts.signing_key([1; 32]), Ok([1; 32]));
        let beside = SqliteAccounts::open(root.path()).expect("opens");
        assert_eq!(beside.signing_key([2; 32]), Ok([1; 32]));
    }

    #[test]
    fn a_copy_of_the_folder_has_the_users_and_nobody_logged_in() {
        let (root, held, accounts) = accounts();
        accounts.begin_session(&session(1, 0), 9).expect("begun");
        let target = root.path().join("copy");
        held.back_up(&target).expect("copied");
        let copied = SqliteAccounts::open(&target).expect("opens");
        assert_eq!((copied.user("anna"), copied.session(&[1; 32])), (Ok(Some(anna())), Ok(None)));
        assert!(accounts.session(&[1; 32]).expect("reads").is_some());
    }

    #[cfg(unix)]
    #[test]
    fn nobody_else_may_read_the_database_or_its_copy() {
        use std::os::unix::fs::PermissionsExt;
        let (root, held, _accounts) = accounts();
        held.back_up(&root.path().join("copy")).expect("copied");
        for name in ["semascan.db", "semascan.db-wal", "semascan.db-shm", "copy/semascan.db"] {
            let mode = fs::metadata(root.path().join(name)).expect(name).permissions().mode();
            assert_eq!(mode & 0o777, 0o600, "{name}");
        }
        // One that an earlier version made is closed to others when it is opened.
        let path = root.path().join("semascan.db");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).expect("set");
        drop(held);
        drop(DataFolder::open(root.path()).expect("opens"));
        assert_eq!(fs::metadata(&path).expect("there").permissions().mode() & 0o777, 0o600);
    }
}
