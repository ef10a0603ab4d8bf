//! Who is let in, and whether an agent may start like that: what other machines can reach has TLS and users.

use super::provider::Provider;
use semascan_inspection::ports::{Accounts, PortError};
use std::fmt;
use std::net::SocketAddr;
use std::sync::Arc;

/// Who is let in.
#[derive(Clone, Default)]
pub enum Entry {
    /// Whoever reaches the agent, as an administrator: on loopback that is who sits at the machine.
    #[default]
    Local,
    /// Whoever reaches the agent, as a viewer.
    Watch,
    /// Users who log in, and machines with a token.
    Accounts {
        /// The users and tokens that are known.
        accounts: Arc<dyn Accounts>,
        /// Who vouches for people besides them.
        provider: Option<Arc<Provider>>,
    },
}

impl fmt::Debug for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Local => "Local",
            Self::Watch => "Watch",
            Self::Accounts { provider: None, .. } => "Accounts",
            Self::Accounts { provider: Some(_), .. } => "Accounts and a provider",
        })
    }
}

/// An agent that must not be started like that.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// Other machines reach it, and nobody would have to log in.
    #[error(
        "other machines can reach {0}, so that users must log in. Add the first with\n  \
         semascan user add NAME --role admin --data DIR\nand start the agent with --data DIR (or --users DIR); or name \
         --anyone-may-watch where everybody may watch and nobody needs to do more"
    )]
    NoUsers(SocketAddr),
    /// Users are to log in, and there are none.
    #[error(
        "nobody could log in: there are no users. Add the first with\n  semascan user add NAME --role admin --data DIR"
    )]
    NobodyKnown,
    /// Passwords would go over a network as they are.
    #[error(
        "other machines can reach {0}, and passwords would go there as plain text: name a certificate with --tls-cert FILE \
         --tls-key FILE, or a data folder, in which one is made"
    )]
    NoTls(SocketAddr),
    /// The users cannot be read.
    #[error(transparent)]
    Port(#[from] PortError),
}

impl Entry {
    /// Whether an agent that lets these in may listen on `address`, `secure` where connections are encrypted.
    ///
    /// # Errors
    /// [`OpenError`] that says what to do instead.
    pub(crate) fn check(&self, address: SocketAddr, secure: bool) -> Result<(), OpenError> {
        let is_open = !address.ip().to_canonical().is_loopback();
        match self {
            Self::Local if is_open => Err(OpenError::NoUsers(address)),
            Self::Local | Self::Watch => Ok(()),
            Self::Accounts { .. } if is_open && !secure => Err(OpenError::NoTls(address)),
            // The provider has people.
            Self::Accounts { provider: Some(_), .. } => Ok(()),
            Self::Accounts { accounts, provider: None } => {
                let known = accounts.users()?.iter().any(|user| user.removed.is_none());
                if known { Ok(()) } else { Err(OpenError::NobodyKnown) }
            }
        }
    }
}
