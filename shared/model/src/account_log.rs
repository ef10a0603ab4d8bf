//! What was done with users, tokens and logins: an append-only log. Plain data, and nothing secret: no password, token or
//! cookie, and of a name that nobody has, not even the name, because people type their password there, too.

use crate::Role;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::net::IpAddr;

/// An entry of the log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AccountEntry {
    /// Place in the log, from 1 without gaps.
    pub sequence: u64,
    /// When (RFC 3339, UTC).
    #[cfg_attr(feature = "schema", schemars(with = "String", extend("format" = "date-time")))]
    pub at: Timestamp,
    /// Who did it.
    pub by: Actor,
    /// What was done.
    pub action: AccountAction,
}

/// Who does something with accounts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Actor {
    /// Somebody at the command line of the machine that keeps the accounts.
    CommandLine {
        /// The number of that person's account on the machine; absent where the system has none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        uid: Option<u32>,
    },
    /// A user who logs in, or is logged in.
    User {
        /// The name.
        name: String,
        /// The address that the user comes from; absent where it is not known.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
        address: Option<IpAddr>,
    },
    /// Somebody who is not logged in.
    Unknown {
        /// The address that the request came from.
        #[cfg_attr(feature = "schema", schemars(with = "String"))]
        address: IpAddr,
    },
    /// An identity provider that says who somebody is and what that one may do.
    Provider {
        /// Its issuer identifier, a URL.
        issuer: String,
    },
    /// The agent itself.
    Agent,
}

/// Whom an identity provider means: never given to anybody else, whatever the person is called (OpenID Connect Core 1.0,
/// section 2).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ProviderIdentity {
    /// The provider's issuer identifier, a URL.
    pub issuer: String,
    /// The provider's own name for the person.
    pub subject: String,
}

/// How somebody shows who it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum LoginMethod {
    /// By name and password.
    Password,
    /// By an identity provider (OpenID Connect).
    Oidc,
}

/// What is done with accounts. Sessions that end with it are counted in it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum AccountAction {
    /// A user is added.
    UserAdded {
        /// The name.
        user: String,
        /// What the user may do.
        role: Role,
        /// Whom it stands for, where an identity provider vouches for the user; absent for a user with a password.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        identity: Option<ProviderIdentity>,
    },
    /// A user has another password.
    PasswordSet {
        /// The name.
        user: String,
        /// Sessions that ended with it.
        sessions_ended: u64,
    },
    /// A user has another role.
    RoleSet {
        /// The name.
        user: String,
        /// The role of before.
        before: Role,
        /// The role from now on.
        role: Role,
    },
    /// A user is removed for good; nobody else gets the name.
    UserRemoved {
        /// The name.
        user: String,
        /// Sessions that ended with it.
        sessions_ended: u64,
    },
    /// A token is made for a machine.
    TokenAdded {
        /// What it is called.
        token: String,
        /// What it may do.
        role: Role,
        /// From when on it is not valid any more; absent where it has no end.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[cfg_attr(feature = "schema", schemars(with = "Option<String>", extend("format" = "date-time")))]
        expires: Option<Timestamp>,
    },
    /// A token is revoked.
    TokenRevoked {
        /// What it is called.
        token: String,
    },
    /// A user logs in.
    LoggedIn {
        /// The name.
        user: String,
        /// How.
        method: LoginMethod,
        /// Older sessions of the user that ended because there were too many.
        sessions_ended: u64,
    },
    /// A login is refused.
    LoginRefused {
        /// The user whose name was given; absent where nobody has that name.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        user: Option<String>,
        /// How.
        method: LoginMethod,
        /// Why, in words.
        reason: String,
    },
    /// A user logs out: the session is revoked.
    LoggedOut {
        /// The name.
        user: String,
    },
    /// There were too many logins to list each: the rest of a window of time is counted.
    NotListed {
        /// What is counted.
        what: Unlisted,
        /// How many were not listed; absent where counting begins.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        count: Option<u64>,
    },
}

/// What is counted where there are too many to list.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Unlisted {
    /// Logins that were refused, whoever tried.
    Refused,
    /// Logins and logouts of one user.
    Logins {
        /// The name.
        user: String,
    },
}

impl fmt::Display for Actor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::CommandLine { uid: Some(uid) } => write!(f, "command line (uid {uid})"),
            Self::CommandLine { uid: None } => f.write_str("command line"),
            Self::User { name, address: Some(address) } => write!(f, "{name} from {address}"),
            Self::User { name, address: None } => f.write_str(name),
            Self::Unknown { address } => write!(f, "somebody from {address}"),
            Self::Provider { issuer } => write!(f, "the identity provider {issuer}"),
            Self::Agent => f.write_str("the agent"),
        }
    }
}

impl fmt::Display for AccountAction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ended = |f: &mut fmt::Formatter<'_>, count: &u64| match count {
            0 => Ok(()),
            1 => f.write_str(", 1 session ended"),
            count => write!(f, ", {count} sessions ended"),
        };
        match self {
            Self::UserAdded { user, role, identity: None } => write!(f, "user {user} added as {role}"),
            Self::UserAdded { user, role, identity: Some(ProviderIdentity { issuer, subject }) } => {
                write!(f, "user {user} added as {role}, for {subject} of {issuer}")
            }
            Self::PasswordSet { user, sessions_ended } => {
                write!(f, "password of {user} set")?;
                ended(f, sessions_ended)
            }
            Self::RoleSet { user, before, role } => write!(f, "role of {user} set to {role} (was {before})"),
            Self::UserRemoved { user, sessions_ended } => {
                write!(f, "user {user} removed")?;
                ended(f, sessions_ended)
            }
            Self::TokenAdded { token, role, expires: None } => write!(f, "token {token} made as {role}"),
            Self::TokenAdded { token, role, expires: Some(expires) } => {
                write!(f, "token {token} made as {role}, until {expires}")
            }
            Self::TokenRevoked { token } => write!(f, "token {token} revoked"),
            Self::LoggedIn { user, method, sessions_ended } => {
                write!(f, "{user} logged in{}", method.in_words())?;
                ended(f, sessions_ended)
            }
            Self::LoginRefused { user, method, reason } => {
                let user = user.as_deref().unwrap_or("an unknown user");
                write!(f, "login of {user}{} refused: {reason}", method.in_words())
            }
            Self::LoggedOut { user } => write!(f, "{user} logged out"),
            Self::NotListed { what, count: None } => write!(f, "too many {what} to list: the next are counted"),
            Self::NotListed { what, count: Some(count) } => write!(f, "{count} {what} not listed"),
        }
    }
}

impl fmt::Display for Unlisted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused => f.write_str("refused logins"),
            Self::Logins { user } => write!(f, "logins and logouts of {user}"),
        }
    }
}

impl LoginMethod {
    fn in_words(self) -> &'static str {
        match self {
            Self::Password => "",
            Self::Oidc => " by the identity provider",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_is_read_as_it_was_written_and_said_in_words() {
        let action = AccountAction::LoginRefused {
            user: None,
            method: LoginMethod::Password,
            reason: "name or password is wrong".into(),
        };
        let by = Actor::Unknown { address: [10, 0, 0, 7].into() };
        let entry = AccountEntry { sequence: 3, at: Timestamp::UNIX_EPOCH, by, action };
        let text = serde_json::to_string(&entry).expect("plain data");
        assert!(text.contains(r#""by":{"kind":"unknown","address":"10.0.0.7"}"#), "{text}");
        assert!(text.contains(r#""type":"login_refused""#), "{text}");
        assert_eq!(serde_json::from_str::<AccountEntry>(&text).expect("its own"), entry);
        assert_eq!(entry.action.to_string(), "login of an unknown user refused: name or password is wrong");
        assert_eq!(entry.by.to_string(), "somebody from 10.0.0.7");
        let identity = ProviderIdentity { issuer: "https://id.plant".into(), subject: "7f".into() };
        let added = AccountAction::UserAdded { user: "otto".into(), role: Role::Viewer, identity: None };
        let text = serde_json::to_string(&added).expect("plain data");
        assert_eq!(text, r#"{"type":"user_added","user":"otto","role":"viewer"}"#, "as before there were providers");
        let added =
            AccountAction::UserAdded { user: "anna (Plant)".into(), role: Role::Viewer, identity: Some(identity) };
        assert_eq!(added.to_string(), "user anna (Plant) added as viewer, for 7f of https://id.plant");
        let removed = AccountAction::UserRemoved { user: "anna".into(), sessions_ended: 2 };
        assert_eq!(removed.to_string(), "user anna removed, 2 sessions ended");
    }
}
