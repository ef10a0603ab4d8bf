//! Who may use an agent: users, their sessions, and tokens of machines, as rows. No secret is ever kept: of a password there is
//! a hash that is slow to compute, of sessions and tokens the SHA-256 digest of 256 random bits. What is done with them is
//! noted in a log, with who does it, in one step with the change itself.

use super::PortError;
use jiff::Timestamp;
use semascan_model::Role;
use semascan_model::account_log::{AccountAction, AccountEntry, Actor, LoginMethod, ProviderIdentity};

/// The SHA-256 digest of the secret of a session or a token, by which it is found.
pub type SecretDigest = [u8; 32];

/// A user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UserRow {
    /// The name, which is never given to anybody else, so that what a user did stays that user's.
    pub name: String,
    /// What the user may do.
    pub role: Role,
    /// Hash of the password as a PHC string; empty where there is none.
    pub password: String,
    /// When the user was added.
    pub created: Timestamp,
    /// When the password was set.
    pub password_set: Timestamp,
    /// When the user was removed.
    pub removed: Option<Timestamp>,
    /// Whom it stands for, where an identity provider vouches for the user, who has no password then.
    pub identity: Option<ProviderIdentity>,
}

/// A session: a user who is logged in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SessionRow {
    /// Digest of its secret.
    pub digest: SecretDigest,
    /// The user.
    pub user: String,
    /// When it began.
    pub began: Timestamp,
    /// When it was last used, to the minute.
    pub used: Timestamp,
}

/// A token with which a machine shows who it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TokenRow {
    /// What it is called, for people; never given again.
    pub name: String,
    /// What it may do.
    pub role: Role,
    /// Digest of its secret.
    pub digest: SecretDigest,
    /// When it was made.
    pub created: Timestamp,
    /// From when on it is not valid any more.
    pub expires: Option<Timestamp>,
    /// When it was revoked.
    pub revoked: Option<Timestamp>,
}

/// A login, as it is noted with the session that begins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Login {
    /// Who logs in, and from where.
    pub by: Actor,
    /// How.
    pub method: LoginMethod,
}

/// Rows of users, sessions and tokens. What a method has returned from is durable, and holds for every process that uses the
/// same rows. Every method fails with a [`PortError`] that names the database and the reason.
#[allow(clippy::missing_errors_doc)]
pub trait Accounts: Send + Sync {
    /// Adds a user; `false` where the name is taken, by one who was removed, too, or where somebody stands for the same identity.
    fn add_user(&self, row: &UserRow, by: &Actor) -> Result<bool, PortError>;

    /// A user, also one who was removed.
    fn user(&self, name: &str) -> Result<Option<UserRow>, PortError>;

    /// The user who stands for `identity`, also one who was removed.
    fn user_of(&self, identity: &ProviderIdentity) -> Result<Option<UserRow>, PortError>;

    /// All users by name, also those who were removed.
    fn users(&self) -> Result<Vec<UserRow>, PortError>;

    /// Gives a user another password and ends the user's sessions; `false` where there is no such user, or an identity provider
    /// vouches for the user.
    fn set_password(&self, name: &str, password: &str, time: Timestamp, by: &Actor) -> Result<bool, PortError>;

    /// Gives a user another role, in sessions that are open, too; `false` where there is no such user. Who has the role already
    /// keeps it, and nothing is noted.
    fn set_role(&self, name: &str, role: Role, time: Timestamp, by: &Actor) -> Result<bool, PortError>;

    /// Removes a user and ends the user's sessions; `false` where there is no such user.
    fn remove_user(&self, name: &str, time: Timestamp, by: &Actor) -> Result<bool, PortError>;

    /// Begins a session. Of those of its user the `most` that were used last stay. Without `login` it is not noted.
    fn begin_session(&self, row: &SessionRow, most: u32, login: Option<&Login>) -> Result<(), PortError>;

    /// A session and its user.
    fn session(&self, digest: &SecretDigest) -> Result<Option<(SessionRow, UserRow)>, PortError>;

    /// Notes that a session is used.
    fn use_session(&self, digest: &SecretDigest, time: Timestamp) -> Result<(), PortError>;

    /// Ends a session; `false` where there is none. Without `noted`, when and who, it is not noted.
    fn end_session(&self, digest: &SecretDigest, noted: Option<(Timestamp, &Actor)>) -> Result<bool, PortError>;

    /// Forgets sessions that began before `began` or were last used before `used`.
    fn forget_sessions(&self, began: Timestamp, used: Timestamp) -> Result<(), PortError>;

    /// Adds a token; `false` where the name is taken, by one that was revoked, too.
    fn add_token(&self, row: &TokenRow, by: &Actor) -> Result<bool, PortError>;

    /// A token, also one that is not valid any more.
    fn token(&self, digest: &SecretDigest) -> Result<Option<TokenRow>, PortError>;

    /// All tokens by name.
    fn tokens(&self) -> Result<Vec<TokenRow>, PortError>;

    /// Revokes a token; `false` where there is no valid one of that name.
    fn revoke_token(&self, name: &str, time: Timestamp, by: &Actor) -> Result<bool, PortError>;

    /// Appends something that changes no row to the log.
    fn note(&self, time: Timestamp, by: &Actor, action: &AccountAction) -> Result<(), PortError>;

    /// The last `limit` entries of the log that stand before place `before` (all of them where it is absent), the latest first.
    fn log(&self, before: Option<u64>, limit: u32) -> Result<Vec<AccountEntry>, PortError>;

    /// The key that signs cookies; `proposed` becomes it where there is none yet.
    fn signing_key(&self, proposed: [u8; 32]) -> Result<[u8; 32], PortError>;
}
