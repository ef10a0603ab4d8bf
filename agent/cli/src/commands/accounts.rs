//! `semascan user | token`: who may use an agent. Also while it runs: what is changed holds from the next request on.

use super::{Failure, password};
use crate::stdout::{print, print_json};
use anyhow::{Context, anyhow};
use clap::{Args, Subcommand};
use jiff::{SignedDuration, Timestamp};
use semascan_inspection::ports::{Accounts, TokenRow, UserRow};
use semascan_model::Role;
use semascan_model::account_log::{Actor, ProviderIdentity};
use semascan_server::{Secret, hash_password};
use semascan_store::data::SqliteAccounts;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Most characters of a name.
const LONGEST_NAME: usize = 64;

/// Where users and tokens are kept.
#[derive(Debug, Args)]
pub(crate) struct In {
    /// The data folder that keeps them
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
}

impl In {
    fn open(&self) -> Result<SqliteAccounts, Failure> {
        let hint = || format!("{}: is no data folder; `semascan init` makes one", self.data.display());
        match SqliteAccounts::open(&self.data) {
            Err(error @ semascan_store::StoreError::Io { .. }) => Err(anyhow::Error::new(error).context(hint()).into()),
            opened => Ok(opened?),
        }
    }
}

/// Arguments of `semascan user`.
#[derive(Debug, Args)]
pub(crate) struct UserArgs {
    #[command(subcommand)]
    action: UserAction,
}

#[derive(Debug, Subcommand)]
enum UserAction {
    /// Add a user; the password is typed, or the first line of stdin
    Add {
        /// The name: small letters, digits and . _ - @
        #[arg(value_parser = name)]
        name: String,
        /// What the user may do: viewer, reviewer (decides), operator (runs inspections), admin
        #[arg(long, default_value = "viewer")]
        role: Role,
        #[command(flatten)]
        place: In,
    },
    /// List users and their roles
    List {
        /// Print them as one JSON object on stdout
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        place: In,
    },
    /// Give a user another password, which is typed, or the first line of stdin; the user's sessions end
    Password {
        /// The name
        name: String,
        #[command(flatten)]
        place: In,
    },
    /// Give a user another role
    Role {
        /// The name
        name: String,
        /// The role: viewer, reviewer, operator, admin
        role: Role,
        #[command(flatten)]
        place: In,
    },
    /// Remove a user; sessions end, what the user did stays, and nobody else gets the name
    Remove {
        /// The name
        name: String,
        #[command(flatten)]
        place: In,
    },
}

/// Arguments of `semascan token`.
#[derive(Debug, Args)]
pub(crate) struct TokenArgs {
    #[command(subcommand)]
    action: TokenAction,
}

#[derive(Debug, Subcommand)]
enum TokenAction {
    /// Make a token for a machine and print it on stdout, once: it cannot be shown again
    Add {
        /// What it is called: small letters, digits and . _ - @
        #[arg(value_parser = name)]
        name: String,
        /// What it may do: viewer, reviewer, operator, admin
        #[arg(long, default_value = "viewer")]
        role: Role,
        /// Days after which it is not valid any more; without it, until it is revoked
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=36500))]
        days: Option<u32>,
        #[command(flatten)]
        place: In,
    },
    /// List tokens and their roles
    List {
        /// Print them as one JSON object on stdout
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        place: In,
    },
    /// Revoke a token
    Revoke {
        /// What it is called
        #[arg(value_parser = name)]
        name: String,
        #[command(flatten)]
        place: In,
    },
}

/// A user as the list has it.
#[derive(Serialize)]
struct User {
    name: String,
    role: Role,
    created: Timestamp,
    password_set: Timestamp,
    #[serde(skip_serializing_if = "Option::is_none")]
    removed: Option<Timestamp>,
    /// Whom an identity provider means; absent for a user with a password.
    #[serde(skip_serializing_if = "Option::is_none")]
    identity: Option<ProviderIdentity>,
}

/// A token as the list has it.
#[derive(Serialize)]
struct Token {
    name: String,
    role: Role,
    created: Timestamp,
    #[serde(skip_serializing_if = "Option::is_none")]
    expires: Option<Timestamp>,
    #[serde(skip_serializing_if = "Option::is_none")]
    revoked: Option<Timestamp>,
}

impl UserArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.action {
            UserAction::Add { name, role, place } => {
                let accounts = place.open()?;
                // Before a password is typed for nothing.
                if let Some(row) = accounts.user(&name)? {
                    return Err(taken(&row));
                }
                add_user(&accounts, &name, role, &password::read_new(&name)?)
            }
            UserAction::List { json, place } => {
                let users: Vec<User> = place.open()?.users()?.into_iter().map(User::from).collect();
                if json {
                    return print_json(&serde_json::json!({ "users": users }));
                }
                let mut text = String::new();
                for User { name, role, created, removed, identity, .. } in users {
                    let from = identity.map_or(String::new(), |identity| format!(", of {}", identity.issuer));
                    let state = removed.map_or(String::new(), |time| format!(", removed {time}"));
                    let _ = writeln!(text, "{name:<24} {:<10} since {created}{from}{state}", role.name());
                }
                print(text.as_bytes())
            }
            UserAction::Password { name, place } => {
                let accounts = place.open()?;
                own(&accounts, &name)?;
                let hash = hash_password(&name, &password::read_new(&name)?).map_err(|e| Failure::Call(e.into()))?;
                changed(accounts.set_password(&name, &hash, Timestamp::now(), &whoever_calls())?, &name)?;
                tracing::info!("{name} has another password, and is logged out everywhere");
                Ok(())
            }
            UserAction::Role { name, role, place } => {
                let accounts = place.open()?;
                own(&accounts, &name)?;
                changed(accounts.set_role(&name, role, Timestamp::now(), &whoever_calls())?, &name)?;
                tracing::info!("{name} has the role {role}");
                Ok(())
            }
            UserAction::Remove { name, place } => {
                changed(place.open()?.remove_user(&name, Timestamp::now(), &whoever_calls())?, &name)?;
                tracing::info!("{name} is removed");
                Ok(())
            }
        }
    }
}

impl TokenArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self.action {
            TokenAction::Add { name, role, days, place } => {
                let accounts = place.open()?;
                let secret = Secret::draw().context("no token could be made")?;
                let now = Timestamp::now();
                let expires = days.map(|days| now.checked_add(SignedDuration::from_hours(24 * i64::from(days))));
                let row = TokenRow {
                    name: name.clone(),
                    role,
                    digest: secret.digest(),
                    created: now,
                    expires: expires.transpose()?,
                    revoked: None,
                };
                if !accounts.add_token(&row, &whoever_calls())? {
                    return Err(Failure::Call(anyhow!("there is, or was, a token {name} already: take another name")));
                }
                tracing::info!("token {name} ({role}): keep it now, it cannot be shown again");
                print(format!("{}\n", secret.token()).as_bytes())
            }
            TokenAction::List { json, place } => {
                let tokens: Vec<Token> = place.open()?.tokens()?.into_iter().map(Token::from).collect();
                if json {
                    return print_json(&serde_json::json!({ "tokens": tokens }));
                }
                let mut text = String::new();
                for Token { name, role, created, expires, revoked } in tokens {
                    let until = expires.map_or(String::new(), |time| format!(", until {time}"));
                    let state = revoked.map_or(until, |time| format!(", revoked {time}"));
                    let _ = writeln!(text, "{name:<24} {:<10} since {created}{state}", role.name());
                }
                print(text.as_bytes())
            }
            TokenAction::Revoke { name, place } => {
                if !place.open()?.revoke_token(&name, Timestamp::now(), &whoever_calls())? {
                    return Err(Failure::Call(anyhow!("there is no token {name} that is valid")));
                }
                tracing::info!("token {name} is revoked");
                Ok(())
            }
        }
    }
}

/// Adds user `name`.
///
/// # Errors
/// [`Failure::Call`] where the name is taken or the password too weak.
pub(super) fn add_user(accounts: &dyn Accounts, name: &str, role: Role, password: &str) -> Result<(), Failure> {
    let password = hash_password(name, password).map_err(|error| Failure::Call(error.into()))?;
    let now = Timestamp::now();
    let name = name.to_owned();
    let row = UserRow { name, role, password, created: now, password_set: now, removed: None, identity: None };
    if !accounts.add_user(&row, &whoever_calls())? {
        return Err(taken(&row));
    }
    tracing::info!("{} ({role}) is added", row.name);
    Ok(())
}

/// Who runs this program, as the log of accounts has it.
fn whoever_calls() -> Actor {
    #[cfg(unix)]
    let uid = Some(rustix::process::getuid().as_raw());
    #[cfg(not(unix))]
    let uid = None;
    Actor::CommandLine { uid }
}

fn taken(row: &UserRow) -> Failure {
    let was = if row.removed.is_some() { "was a user, and what a user did stays under the name" } else { "is a user" };
    Failure::Call(anyhow!("{} {was} already: take another name", row.name))
}

/// Whether there is a user `name` whose password and role are said here.
fn own(accounts: &dyn Accounts, name: &str) -> Result<(), Failure> {
    let row = accounts.user(name)?.filter(|row| row.removed.is_none());
    match row.as_ref().and_then(|row| row.identity.as_ref()) {
        Some(ProviderIdentity { issuer, .. }) => Err(Failure::Call(anyhow!(
            "{name} logs in at {issuer}, which has the password and says the groups that make the role"
        ))),
        None => changed(row.is_some(), name),
    }
}

fn changed(changed: bool, name: &str) -> Result<(), Failure> {
    if changed { Ok(()) } else { Err(Failure::Call(anyhow!("there is no user {name}"))) }
}

/// A name of a user or token. It stands in logs and records, and must mean one thing there.
pub(super) fn name(text: &str) -> Result<String, String> {
    let inner = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '.' | '_' | '-' | '@');
    let first = text.chars().next().is_some_and(|c| c.is_ascii_lowercase() || c.is_ascii_digit());
    if first && text.len() <= LONGEST_NAME && text.chars().all(inner) {
        return Ok(text.to_owned());
    }
    Err(format!("a name has 1 to {LONGEST_NAME} small letters, digits and . _ - @, and begins with a letter or digit"))
}

impl From<UserRow> for User {
    fn from(row: UserRow) -> Self {
        let UserRow { name, role, created, password_set, removed, identity, password: _ } = row;
        Self { name, role, created, password_set, removed, identity }
    }
}

impl From<TokenRow> for Token {
    fn from(row: TokenRow) -> Self {
        let TokenRow { name, role, created, expires, revoked, digest: _ } = row;
        Self { name, role, created, expires, revoked }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain() {
        for good in ["anna", "a", "anna.b-c_d@plant", "7"] {
            assert_eq!(name(good).as_deref(), Ok(good));
        }
        for wrong in ["", "Anna", "-anna", "a b", "ä", "a\n", "token:x", &"a".repeat(65)] {
            assert!(name(wrong).is_err(), "{wrong:?}");
        }
    }
}
