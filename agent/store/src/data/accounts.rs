//! Users, sessions and tokens in the database of a data folder, over a connection of their own: a login waits for no
//! inspection, and users can be changed while an agent runs. What is done with them is noted in a log in the same transaction.

use super::chained::{Audited, ChainedLog};
use super::connection;
use super::folder::DATABASE;
use crate::StoreError;
use jiff::Timestamp;
use rusqlite::types::Type;
use rusqlite::{Connection, OptionalExtension, Row, Transaction, TransactionBehavior, params};
use semascan_inspection::chain::Link;
use semascan_inspection::ports::{Accounts, Login, PortError, SecretDigest, SessionRow, TokenRow, UserRow};
use semascan_model::Role;
use semascan_model::account_log::{AccountAction, AccountEntry, Actor, ProviderIdentity};
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

const LOG: ChainedLog<AccountEntry> = ChainedLog::new("account_log", &[], "the log of accounts");

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

    /// Reads the whole log of accounts and compares every entry with its hash and with the one before it. Where `noted` is given,
    /// the hash of an entry that was noted earlier, that entry must still be there.
    ///
    /// # Errors
    /// [`PortError`] naming the database where it cannot be read.
    pub fn audit(&self, noted: Option<&str>) -> Result<Audited, PortError> {
        LOG.audit(&self.connection(), noted).map_err(self.error())
    }
}

/// Appends to the log what `by` does.
fn note(transaction: &Transaction<'_>, at: Timestamp, by: &Actor, action: AccountAction) -> rusqlite::Result<()> {
    let entry = AccountEntry { sequence: LOG.last(transaction)? + 1, at: whole(at), by: by.clone(), action };
    LOG.append(transaction, &entry).map(drop)
}

const USER: &str = "SELECT name, role, password, created, password_set, removed, issuer, subject FROM users";
const TOKEN: &str = "SELECT name, role, digest, created, expires, revoked FROM tokens";

impl Accounts for SqliteAccounts {
    fn add_user(&self, row: &UserRow, by: &Actor) -> Result<bool, PortError> {
        self.change(|transaction| {
            let added = transaction.execute(
                "INSERT INTO users (name, role, password, created, password_set, removed, issuer, subject) \
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8) ON CONFLICT DO NOTHING",
                params![
                    row.name,
                    row.role.name(),
                    row.password,
                    seconds(row.created),
                    seconds(row.password_set),
                    row.removed.map(seconds),
                    row.identity.as_ref().map(|identity| &identity.issuer),
                    row.identity.as_ref().map(|identity| &identity.subject)
                ],
            )?;
            if added > 0 {
                let UserRow { name, role, identity, .. } = row.clone();
                let action = AccountAction::UserAdded { user: name, role, identity };
                note(transaction, row.created, by, action)?;
            }
            Ok(added)
        })
    }

    fn user(&self, name: &str) -> Result<Option<UserRow>, PortError> {
        let connection = self.connection();
        connection.query_row(&format!("{USER} WHERE name = ?1"), [name], user).optional().map_err(self.error())
    }

    fn user_of(&self, identity: &ProviderIdentity) -> Result<Option<UserRow>, PortError> {
        let connection = self.connection();
        let sql = format!("{USER} WHERE issuer = ?1 AND subject = ?2");
        connection.query_row(&sql, [&identity.issuer, &identity.subject], user).optional().map_err(self.error())
    }

    fn users(&self) -> Result<Vec<UserRow>, PortError> {
        self.select(&format!("{USER} ORDER BY name"), user)
    }

    fn set_password(&self, name: &str, password: &str, time: Timestamp, by: &Actor) -> Result<bool, PortError> {
        self.change(|transaction| {
            let changed = transaction.execute(
                "UPDATE users SET password = ?2, password_set = ?3 \
                 WHERE name = ?1 AND removed IS NULL AND issuer IS NULL",
                params![name, password, seconds(time)],
            )?;
            if changed > 0 {
                let sessions_ended = end_sessions(transaction, name)?;
                note(transaction, time, by, AccountAction::PasswordSet { user: name.to_owned(), sessions_ended })?;
            }
            Ok(changed)
        })
    }

    fn set_role(&self, name: &str, role: Role, time: Timestamp, by: &Actor) -> Result<bool, PortError> {
        self.change(|transaction| {
            let sql = "SELECT role FROM users WHERE name = ?1 AND removed IS NULL";
            let before: Option<Role> = transaction.query_row(sql, [name], |row| parsed(row, 0)).optional()?;
            let Some(before) = before else { return Ok(0) };
            if before != role {
                transaction.execute("UPDATE users SET role = ?2 WHERE name = ?1", params![name, role.name()])?;
                note(transaction, time, by, AccountAction::RoleSet { user: name.to_owned(), before, role })?;
            }
            Ok(1)
        })
    }

    fn remove_user(&self, name: &str, time: Timestamp, by: &Actor) -> Result<bool, PortError> {
        self.change(|transaction| {
            let changed = transaction.execute(
                "UPDATE users SET removed = ?2, password = '' WHERE name = ?1 AND removed IS NULL",
                params![name, seconds(time)],
            )?;
            if changed > 0 {
                let sessions_ended = end_sessions(transaction, name)?;
                note(transaction, time, by, AccountAction::UserRemoved { user: name.to_owned(), sessions_ended })?;
            }
            Ok(changed)
        })
    }

    fn begin_session(&self, row: &SessionRow, most: u32, login: Option<&Login>) -> Result<(), PortError> {
        let begun = self.change(|transaction| {
            transaction.execute(
                "INSERT INTO sessions (digest, user, began, used) VALUES (?1, ?2, ?3, ?4)",
                params![row.digest, row.user, seconds(row.began), seconds(row.used)],
            )?;
            let ended = transaction.execute(
                "DELETE FROM sessions WHERE user = ?1 AND digest NOT IN \
                 (SELECT digest FROM sessions WHERE user = ?1 ORDER BY digest = ?2 DESC, used DESC LIMIT ?3)",
                params![row.user, row.digest, most],
            )?;
            if let Some(Login { by, method }) = login {
                let (user, sessions_ended) = (row.user.clone(), ended as u64);
                note(transaction, row.began, by, AccountAction::LoggedIn { user, method: *method, sessions_ended })?;
            }
            Ok(ended)
        });
        begun.map(drop)
    }

    fn session(&self, digest: &SecretDigest) -> Result<Option<(SessionRow, UserRow)>, PortError> {
        let connection = self.connection();
        let sql = "SELECT users.name, role, password, created, password_set, removed, issuer, subject, digest, began, used \
                   FROM sessions JOIN users ON users.name = sessions.user WHERE digest = ?1";
        let mut select = connection.prepare(sql).map_err(self.error())?;
        let row = select.query_row([digest], |row| {
            let user = user(row)?;
            let session = SessionRow {
                digest: row.get(8)?,
                user: user.name.clone(),
                began: parsed(row, 9)?,
                used: parsed(row, 10)?,
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

    fn end_session(&self, digest: &SecretDigest, noted: Option<(Timestamp, &Actor)>) -> Result<bool, PortError> {
        self.change(|transaction| {
            let sql = "DELETE FROM sessions WHERE digest = ?1 RETURNING user";
            let user: Option<String> = transaction.query_row(sql, [digest], |row| row.get(0)).optional()?;
            let Some(user) = user else { return Ok(0) };
            if let Some((time, by)) = noted {
                note(transaction, time, by, AccountAction::LoggedOut { user })?;
            }
            Ok(1)
        })
    }

    fn forget_sessions(&self, began: Timestamp, used: Timestamp) -> Result<(), PortError> {
        let forgotten = self.change(|transaction| {
            let times = params![seconds(began), seconds(used)];
            transaction.execute("DELETE FROM sessions WHERE began < ?1 OR used < ?2", times)
        });
        forgotten.map(drop)
    }

    fn add_token(&self, row: &TokenRow, by: &Actor) -> Result<bool, PortError> {
        self.change(|transaction| {
            let added = transaction.execute(
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
            )?;
            if added > 0 {
                let TokenRow { name, role, created, expires, .. } = row;
                let expires = expires.map(whole);
                let action = AccountAction::TokenAdded { token: name.clone(), role: *role, expires };
                note(transaction, *created, by, action)?;
            }
            Ok(added)
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

    fn revoke_token(&self, name: &str, time: Timestamp, by: &Actor) -> Result<bool, PortError> {
        self.change(|transaction| {
            let revoked = transaction.execute(
                "UPDATE tokens SET revoked = ?2 WHERE name = ?1 AND revoked IS NULL",
                params![name, seconds(time)],
            )?;
            if revoked > 0 {
                note(transaction, time, by, AccountAction::TokenRevoked { token: name.to_owned() })?;
            }
            Ok(revoked)
        })
    }

    fn note(&self, time: Timestamp, by: &Actor, action: &AccountAction) -> Result<(), PortError> {
        self.change(|transaction| note(transaction, time, by, action.clone()).map(|()| 1)).map(drop)
    }

    fn log(&self, before: Option<u64>, limit: u32) -> Result<Vec<AccountEntry>, PortError> {
        let links: Vec<Link> = {
            let connection = self.connection();
            let sql = format!("{} WHERE sequence < ?1 ORDER BY sequence DESC LIMIT ?2", LOG.select());
            let mut select = connection.prepare(&sql).map_err(self.error())?;
            // SQLite counts up to that.
            let before = before.and_then(|place| i64::try_from(place).ok()).unwrap_or(i64::MAX);
            let rows = select.query_map(params![before, limit], |row| LOG.link(row));
            rows.and_then(Iterator::collect).map_err(self.error())?
        };
        let wrong = |reason| PortError::new(self.path.display(), reason);
        links.iter().map(|link| LOG.read(link).map_err(wrong)).collect()
    }

    fn signing_key(&self, proposed: [u8; 32]) -> Result<[u8; 32], PortError> {
        self.change(|transaction| {
            let sql = "INSERT INTO signing_key (id, key) VALUES (1, ?1) ON CONFLICT (id) DO NOTHING";
            transaction.execute(sql, [proposed])
        })?;
        self.connection().query_row("SELECT key FROM signing_key", [], |row| row.get(0)).map_err(self.error())
    }
}

/// Ends the sessions of a user; how many there were.
fn end_sessions(transaction: &Transaction<'_>, user: &str) -> rusqlite::Result<u64> {
    transaction.execute("DELETE FROM sessions WHERE user = ?1", [user]).map(|ended| ended as u64)
}

/// A time as the tables have it: in whole seconds.
fn seconds(time: Timestamp) -> String {
    whole(time).to_string()
}

fn whole(time: Timestamp) -> Timestamp {
    Timestamp::from_second(time.as_second()).unwrap_or(time)
}

fn user(row: &Row<'_>) -> rusqlite::Result<UserRow> {
    Ok(UserRow {
        name: row.get(0)?,
        role: parsed(row, 1)?,
        password: row.get(2)?,
        created: parsed(row, 3)?,
        password_set: parsed(row, 4)?,
        removed: row.get::<_, Option<String>>(5)?.map(|_| parsed(row, 5)).transpose()?,
        identity: row
            .get::<_, Option<String>>(6)?
            .zip(row.get(7)?)
            .map(|(issuer, subject)| ProviderIdentity { issuer, subject }),
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
    use semascan_model::account_log::LoginMethod;

    const SHELL: Actor = Actor::CommandLine { uid: Some(7) };

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
            identity: None,
        }
    }

    fn identity(subject: &str) -> ProviderIdentity {
        ProviderIdentity { issuer: "https://id.plant".into(), subject: subject.into() }
    }

    fn session(number: u8, used: i64) -> SessionRow {
        SessionRow { digest: [number; 32], user: "anna".into(), began: at(0), used: at(used) }
    }

    /// Accounts beside a folder that an agent holds, with one user.
    fn accounts() -> (tempfile::TempDir, DataFolder, SqliteAccounts) {
        let root = tempfile::tempdir().expect("a folder");
        let held = DataFolder::open(root.path()).expect("opens");
        let accounts = SqliteAccounts::open(root.path()).expect("opens beside");
        assert_eq!(accounts.add_user(&anna(), &SHELL), Ok(true));
        (root, held, accounts)
    }

    #[test]
    fn a_name_stays_with_its_user_and_sessions_end_with_what_they_rest_on() {
        let (root, _held, accounts) = accounts();
        assert_eq!(accounts.add_user(&UserRow { role: Role::Admin, ..anna() }, &SHELL), Ok(false));
        assert_eq!(accounts.user("anna"), Ok(Some(anna())));
        assert_eq!(accounts.user("Anna"), Ok(None));
        accounts.begin_session(&session(1, 0), 9, None).expect("begun");
        assert_eq!(accounts.session(&[1; 32]), Ok(Some((session(1, 0), anna()))));
        assert_eq!(accounts.set_role("anna", Role::Operator, at(3), &SHELL), Ok(true));
        let role = |digest| accounts.session(&digest).expect("reads").map(|(_, user)| user.role);
        assert_eq!(role([1; 32]), Some(Role::Operator), "at once");
        assert_eq!(accounts.set_password("anna", "$other", at(5), &SHELL), Ok(true));
        assert_eq!(role([1; 32]), None, "a new password ends sessions");
        accounts.begin_session(&session(2, 0), 9, None).expect("begun");
        assert_eq!(accounts.remove_user("anna", at(7), &SHELL), Ok(true));
        assert_eq!(role([2; 32]), None);
        // Another process sees the same.
        let accounts = SqliteAccounts::open(root.path()).expect("opens");
        let gone = accounts.user("anna").expect("reads").expect("kept");
        assert_eq!((gone.removed, gone.password.as_str()), (Some(at(7)), ""));
        assert_eq!(accounts.add_user(&anna(), &SHELL), Ok(false), "nobody else gets the name");
        assert_eq!(accounts.remove_user("anna", at(9), &SHELL), Ok(false));
        assert_eq!(accounts.set_password("anna", "$x", at(9), &SHELL), Ok(false));
        assert_eq!(accounts.set_role("anna", Role::Admin, at(3), &SHELL), Ok(false));
        assert_eq!(accounts.set_role("otto", Role::Admin, at(3), &SHELL), Ok(false));
        assert!(accounts.begin_session(&SessionRow { user: "otto".into(), ..session(3, 0) }, 9, None).is_err());
    }

    #[test]
    fn who_a_provider_vouches_for_is_found_by_identity_and_has_no_password() {
        let (_root, _held, accounts) = accounts();
        let row = |name: &str, subject| UserRow {
            name: name.into(),
            password: String::new(),
            identity: Some(identity(subject)),
            ..anna()
        };
        assert_eq!(accounts.user_of(&identity("7f")), Ok(None));
        assert_eq!(accounts.add_user(&row("anna", "7f"), &SHELL), Ok(false), "a user of that name is not taken over");
        assert_eq!(accounts.add_user(&row("anna (Plant)", "7f"), &SHELL), Ok(true));
        assert_eq!(accounts.add_user(&row("anna 2 (Plant)", "7f"), &SHELL), Ok(false), "one person is one user");
        assert_eq!(accounts.add_user(&row("anna 2 (Plant)", "80"), &SHELL), Ok(true));
        assert_eq!(accounts.user_of(&identity("7f")), Ok(Some(row("anna (Plant)", "7f"))));
        let elsewhere = ProviderIdentity { issuer: "https://id.elsewhere".into(), ..identity("7f") };
        assert_eq!(accounts.user_of(&elsewhere), Ok(None));
        assert_eq!(accounts.set_password("anna (Plant)", "$x", at(1), &SHELL), Ok(false));
        let session = SessionRow { user: "anna (Plant)".into(), ..session(1, 0) };
        accounts.begin_session(&session, 9, None).expect("begun");
        assert_eq!(accounts.session(&[1; 32]), Ok(Some((session, row("anna (Plant)", "7f")))));
        assert_eq!(accounts.remove_user("anna (Plant)", at(2), &SHELL), Ok(true));
        let removed = accounts.user_of(&identity("7f")).expect("reads").expect("kept");
        assert_eq!(removed.removed, Some(at(2)), "who was removed is known by the same identity");
        assert_eq!(
            logged(&accounts)[1],
            "2: user anna (Plant) added as reviewer, for 7f of https://id.plant by command line (uid 7)"
        );
    }

    #[test]
    fn sessions_are_bounded_and_forgotten() {
        let (_root, _held, accounts) = accounts();
        (0..5).for_each(|n| accounts.begin_session(&session(n, 10 * i64::from(n)), 3, None).expect("begun"));
        let there = |n: u8| accounts.session(&[n; 32]).expect("reads").is_some();
        assert_eq!([0, 1, 2, 3, 4].map(there), [false, false, true, true, true]);
        // The one that begins stays, however long ago the others say that it was.
        accounts.begin_session(&session(9, -50), 3, None).expect("begun");
        assert_eq!([2, 3, 4, 9].map(there), [false, true, true, true]);
        accounts.use_session(&[3; 32], at(100)).expect("used");
        accounts.forget_sessions(at(0), at(40)).expect("forgotten");
        assert_eq!([3, 4, 9].map(there), [true, true, false]);
        accounts.forget_sessions(at(1), at(0)).expect("forgotten");
        assert_eq!([3, 4].map(there), [false, false]);
        accounts.begin_session(&session(7, 0), 3, None).expect("begun");
        assert_eq!((accounts.end_session(&[7; 32], None), accounts.end_session(&[7; 32], None)), (Ok(true), Ok(false)));
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
        assert_eq!(accounts.add_token(&row, &SHELL), Ok(true));
        assert_eq!(accounts.add_token(&TokenRow { digest: [6; 32], ..row.clone() }, &SHELL), Ok(false));
        assert_eq!(accounts.token(&[5; 32]), Ok(Some(row.clone())));
        assert_eq!(accounts.token(&[6; 32]), Ok(None));
        assert_eq!(accounts.revoke_token("dashboard", at(1), &SHELL), Ok(true));
        assert_eq!(accounts.revoke_token("dashboard", at(2), &SHELL), Ok(false));
        assert_eq!(accounts.tokens(), Ok(vec![TokenRow { revoked: Some(at(1)), ..row }]));
        assert_eq!(accounts.signing_key([1; 32]), Ok([1; 32]));
        let beside = SqliteAccounts::open(root.path()).expect("opens");
        assert_eq!(beside.signing_key([2; 32]), Ok([1; 32]));
    }

    #[test]
    fn a_copy_of_the_folder_has_the_users_and_nobody_logged_in() {
        let (root, held, accounts) = accounts();
        accounts.begin_session(&session(1, 0), 9, None).expect("begun");
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

    /// What the log says, the earliest first.
    fn logged(accounts: &SqliteAccounts) -> Vec<String> {
        let entries = accounts.log(None, 99).expect("reads");
        entries.iter().rev().map(|entry| format!("{}: {} by {}", entry.sequence, entry.action, entry.by)).collect()
    }

    #[test]
    fn every_change_is_noted_with_who_made_it_and_nothing_that_changed_nothing() {
        let (_root, _held, accounts) = accounts();
        let anna = Actor::User { name: "anna".into(), address: Some([10, 0, 0, 7].into()) };
        let login = Login { by: anna.clone(), method: LoginMethod::Password };
        for number in 1..=3 {
            accounts.begin_session(&session(number, i64::from(number)), 2, Some(&login)).expect("begun");
        }
        accounts.begin_session(&session(4, 0), 9, None).expect("begun");
        assert_eq!(accounts.end_session(&[2; 32], Some((at(1), &anna))), Ok(true));
        assert_eq!(accounts.end_session(&[2; 32], Some((at(1), &anna))), Ok(false));
        assert_eq!(accounts.set_role("anna", Role::Operator, at(2), &SHELL), Ok(true));
        assert_eq!(accounts.set_role("anna", Role::Operator, at(2), &SHELL), Ok(true), "has it already");
        assert_eq!(accounts.set_role("otto", Role::Operator, at(2), &SHELL), Ok(false));
        assert_eq!(accounts.set_password("anna", "$argon2id$secret", at(3), &SHELL), Ok(true));
        let token = TokenRow {
            name: "dashboard".into(),
            role: Role::Viewer,
            digest: [5; 32],
            created: at(4),
            expires: None,
            revoked: None,
        };
        assert_eq!(accounts.add_token(&token, &SHELL), Ok(true));
        assert_eq!(accounts.add_token(&token, &SHELL), Ok(false));
        assert_eq!(accounts.revoke_token("dashboard", at(5), &SHELL), Ok(true));
        assert_eq!(accounts.revoke_token("dashboard", at(5), &SHELL), Ok(false));
        assert_eq!(accounts.remove_user("anna", at(6), &SHELL), Ok(true));
        assert_eq!(
            logged(&accounts),
            [
                "1: user anna added as reviewer by command line (uid 7)",
                "2: anna logged in by anna from 10.0.0.7",
                "3: anna logged in by anna from 10.0.0.7",
                "4: anna logged in, 1 session ended by anna from 10.0.0.7",
                "5: anna logged out by anna from 10.0.0.7",
                "6: role of anna set to operator (was reviewer) by command line (uid 7)",
                "7: password of anna set, 2 sessions ended by command line (uid 7)",
                "8: token dashboard made as viewer by command line (uid 7)",
                "9: token dashboard revoked by command line (uid 7)",
                "10: user anna removed by command line (uid 7)",
            ]
        );
        let sequences = |before, limit| -> Vec<u64> {
            accounts.log(before, limit).expect("reads").iter().map(|entry| entry.sequence).collect()
        };
        assert_eq!((sequences(None, 3), sequences(Some(8), 2)), (vec![10, 9, 8], vec![7, 6]));
        assert_eq!((sequences(Some(1), 2), sequences(Some(u64::MAX), 1)), (vec![], vec![10]));
        let text = format!("{:?}", accounts.log(None, 99));
        assert!(!text.contains("argon2"), "nothing secret: {text}");
        assert_eq!(accounts.audit(None).expect("reads").entries, 10);
    }

    #[test]
    fn the_log_is_never_changed_and_shows_what_was_done_behind_it() {
        let (root, _held, accounts) = accounts();
        (1..=5).for_each(|n| accounts.note(at(n), &Actor::Agent, &refused(n)).expect("noted"));
        let head = accounts.audit(None).expect("reads").head;
        let beside = Connection::open(root.path().join(DATABASE)).expect("opens");
        for (sql, word) in [
            ("UPDATE account_log SET entry = '{}' WHERE sequence = 3", "never changed"),
            ("DELETE FROM account_log WHERE sequence = 6", "nothing is removed"),
            ("INSERT OR REPLACE INTO account_log SELECT * FROM account_log WHERE sequence = 6", "follows the last"),
        ] {
            let said = beside.execute(sql, []).expect_err(sql).to_string();
            assert!(said.contains(word), "{sql}: {said}");
        }
        let triggers = "DROP TRIGGER account_log_is_not_changed; DROP TRIGGER account_log_is_not_removed;";
        beside.execute_batch(triggers).expect("dropped");
        assert_eq!(beside.execute("DELETE FROM account_log WHERE sequence = 6", []), Ok(1));
        assert_eq!(accounts.audit(None).expect("reads").fault, None, "the chain alone cannot tell");
        let missing = accounts.audit(Some(&head)).expect("reads").fault.expect("the noted one is gone");
        assert!(missing.sequence == 6 && missing.reason.contains("is missing"), "{missing:?}");
        let sql = "UPDATE account_log SET entry = replace(entry, 'wrong', 'right') WHERE sequence = 4";
        assert_eq!(beside.execute(sql, []), Ok(1));
        assert_eq!(accounts.audit(None).expect("reads").fault.expect("changed").sequence, 4);
        let said = accounts.log(None, 9).expect_err("is no answer").to_string();
        assert!(said.contains("entry 4 of the log of accounts was changed"), "{said}");
        assert_eq!(accounts.log(Some(4), 9).expect("before it").len(), 3);
    }

    fn refused(number: i64) -> AccountAction {
        let reason = format!("wrong {number}");
        AccountAction::LoginRefused { user: Some("anna".into()), method: LoginMethod::Password, reason }
    }
}
