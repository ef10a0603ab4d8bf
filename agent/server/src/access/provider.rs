//! Identity providers: what the agent asks one for, and what it makes of the answer. How one is spoken to is an implementation of
//! [`IdentityProvider`]: OpenID Connect is the feature `oidc`.
//!
//! What a person may do follows from the groups that the provider names, at every login anew. Whom a user stands for is the
//! provider's issuer and its subject, never a name: names can be chosen and given again (OpenID Connect Core 1.0, section 5.7).

use crate::guard::{AccessRule, host_name, is_authority, is_loopback};
use semascan_model::Role;
use semascan_model::account_log::ProviderIdentity;
use std::collections::BTreeMap;
use std::fmt;
use std::pin::Pin;
use std::sync::Arc;

/// Path to which a provider sends browsers back.
pub(crate) const CALLBACK: &str = "/api/v1/oidc/callback";
/// Most characters of the name of a provider.
const LONGEST_NAME: usize = 40;

/// What an identity provider answers some time.
pub type ProviderAnswer<'a, T> = Pin<Box<dyn Future<Output = Result<T, ProviderError>> + Send + 'a>>;

/// An identity provider. Each method ends within a bounded time.
pub trait IdentityProvider: Send + Sync {
    /// The address that a browser is sent to so that its user logs in there.
    fn authorization<'a>(&'a self, challenge: &'a Challenge) -> ProviderAnswer<'a, String>;

    /// The person for whom the provider gave out `code` after it was asked with `challenge`.
    fn person<'a>(&'a self, challenge: &'a Challenge, code: String) -> ProviderAnswer<'a, Person>;
}

/// What ties the answer of a provider to the browser that was sent there. Each is 43 characters of the URL-safe base64 alphabet
/// that nobody but the agent can compute.
pub struct Challenge {
    /// Comes back with the browser (RFC 6749, section 10.12).
    pub state: String,
    /// Stands in the ID token (OpenID Connect Core 1.0, section 15.5.2).
    pub nonce: String,
    /// Shows that who asks for the token has sent the browser (RFC 7636).
    pub verifier: String,
}

/// Somebody who logged in at a provider.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Person {
    /// Who it is.
    pub identity: ProviderIdentity,
    /// What the person is called, the best first; none of them is unique.
    pub names: Vec<String>,
    /// Groups that the person belongs to.
    pub groups: Vec<String>,
}

/// Why a provider did not say who somebody is.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ProviderError {
    /// It does not answer, or not what a provider answers; whom it is asked about does not matter.
    #[error("{0}")]
    Unavailable(String),
    /// What it says of the person cannot be believed.
    #[error("{0}")]
    Rejected(String),
}

/// A provider, and what its people may do here.
pub struct Provider {
    pub(super) name: String,
    pub(super) address: PublicAddress,
    pub(super) port: Arc<dyn IdentityProvider>,
    roles: BTreeMap<String, Role>,
}

impl Provider {
    /// The provider behind `port`, which people know as `name`. It sends browsers back to `address`; who belongs to one of the
    /// groups in `roles` has the role there, the highest where there are several.
    ///
    /// # Errors
    /// [`ProviderSettingError`].
    pub fn new(
        name: String,
        address: PublicAddress,
        roles: BTreeMap<String, Role>,
        port: Arc<dyn IdentityProvider>,
    ) -> Result<Self, ProviderSettingError> {
        let is_plain = |c: char| c.is_alphanumeric() || matches!(c, ' ' | '.' | '-' | '_');
        if name.trim() != name || name.is_empty() || name.chars().count() > LONGEST_NAME || !name.chars().all(is_plain)
        {
            return Err(ProviderSettingError::Name(name));
        }
        if roles.is_empty() {
            return Err(ProviderSettingError::NoRoles);
        }
        Ok(Self { name, address, port, roles })
    }

    /// What people call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where it sends browsers back to.
    pub fn callback(&self) -> String {
        self.address.callback()
    }

    /// Whether browsers that the provider sends back are let in by `rule`, and `secure` where all connections are encrypted.
    ///
    /// # Errors
    /// [`ProviderSettingError`].
    pub(crate) fn check(&self, rule: &AccessRule, secure: bool) -> Result<(), ProviderSettingError> {
        if !rule.is_own(host_name(self.address.authority())) {
            return Err(ProviderSettingError::Host(self.address.to_string()));
        }
        if secure && !self.address.is_secure {
            return Err(ProviderSettingError::Plain(self.address.to_string()));
        }
        Ok(())
    }

    /// What who belongs to `groups` may do here; `None` means nothing.
    pub(super) fn role(&self, groups: &[String]) -> Option<Role> {
        groups.iter().filter_map(|group| self.roles.get(group)).max().copied()
    }
}

impl fmt::Debug for Provider {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Provider").field("name", &self.name).field("address", &self.address).finish_non_exhaustive()
    }
}

/// The address under which browsers reach the agent: a scheme, a host and perhaps a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PublicAddress {
    origin: String,
    is_secure: bool,
}

impl PublicAddress {
    /// Reads one: `https://HOST[:PORT]`, on loopback also `http://`.
    ///
    /// # Errors
    /// [`ProviderSettingError::Address`].
    pub fn parse(text: &str) -> Result<Self, ProviderSettingError> {
        let wrong = |reason| ProviderSettingError::Address { address: text.to_owned(), reason };
        // As browsers write it: small letters, no port that the scheme has anyway (WHATWG URL, section 4.5).
        let origin = text.strip_suffix('/').unwrap_or(text).to_ascii_lowercase();
        let (authority, is_secure, default) = match (origin.strip_prefix("https://"), origin.strip_prefix("http://")) {
            (Some(authority), _) => (authority, true, ":443"),
            (_, Some(authority)) => (authority, false, ":80"),
            _ => return Err(wrong("it begins with https://")),
        };
        if !is_authority(authority) {
            return Err(wrong("it is https://HOST[:PORT], without a path"));
        }
        if !is_secure && !is_loopback(host_name(authority)) {
            return Err(wrong("only loopback may do without TLS: it begins with https://"));
        }
        let origin = origin.strip_suffix(default).unwrap_or(&origin).to_owned();
        Ok(Self { origin, is_secure })
    }

    /// Where the provider sends browsers back to: the redirect URI that is registered there.
    pub fn callback(&self) -> String {
        format!("{self}{CALLBACK}")
    }

    /// Host and port, as the `Host` header of a request has them.
    pub(crate) fn authority(&self) -> &str {
        self.origin.split_once("://").map_or("", |(_, authority)| authority)
    }
}

impl fmt::Display for PublicAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.origin)
    }
}

/// What is said of a provider and cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ProviderSettingError {
    /// It cannot be called that.
    #[error("{0:?} is no name for an identity provider: it has 1 to {LONGEST_NAME} letters, digits, spaces and . - _")]
    Name(String),
    /// The agent's own address is none.
    #[error("the address {address} under which browsers reach this agent: {reason}")]
    Address {
        /// What was given.
        address: String,
        /// Why it is none.
        reason: &'static str,
    },
    /// Browsers that come back would be refused.
    #[error("browsers would come back to {0}, which is not this machine: allow it with --allow-host")]
    Host(String),
    /// Browsers would come back without TLS to an agent that speaks nothing else.
    #[error("browsers would come back to {0}, and this agent speaks HTTPS only")]
    Plain(String),
    /// No group may do anything.
    #[error("no group has a role, so that nobody could log in with the identity provider")]
    NoRoles,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_an_origin_over_tls_or_of_loopback() {
        for (text, origin) in [
            ("https://cell-3.plant.example:8787", "https://cell-3.plant.example:8787"),
            ("https://Cell.example/", "https://cell.example"),
            ("https://cell.example:443", "https://cell.example"),
            ("http://127.0.0.1:8787", "http://127.0.0.1:8787"),
            ("http://localhost:80", "http://localhost"),
            ("http://[::1]:8787", "http://[::1]:8787"),
        ] {
            let address = PublicAddress::parse(text).expect(text);
            assert_eq!((address.to_string().as_str(), address.callback()), (origin, format!("{origin}{CALLBACK}")));
            assert_eq!(address.authority(), origin.split_once("://").expect("a scheme").1);
        }
        for wrong in [
            "",
            "cell.example",
            "https://",
            "https://cell/path",
            "https://cell?x",
            "https://user@cell",
            "https://cell:x",
            "http://cell.example",
            "http://10.0.0.7:8787",
            "http://localhost.evil.example",
            "ftp://cell",
        ] {
            assert!(matches!(PublicAddress::parse(wrong), Err(ProviderSettingError::Address { .. })), "{wrong}");
        }
    }
}
