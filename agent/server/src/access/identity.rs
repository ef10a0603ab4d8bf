//! Who a request comes from, and what that one may do.

use semascan_inspection::ports::SecretDigest;
use semascan_model::Role;

/// Who a request comes from. Handlers get it as an [`axum::Extension`]; on public routes there is none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// The name, under which what is done is recorded.
    pub name: String,
    /// What may be done.
    pub role: Role,
    pub(crate) credential: Credential,
}

/// By what it is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Credential {
    /// Nothing: whoever reaches the agent is let in.
    Reach,
    /// A session's cookie.
    Session(SecretDigest),
    /// A token.
    Token(SecretDigest),
}

impl Credential {
    /// How it is called in `/api/v1/me`.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Reach => "none",
            Self::Session(_) => "session",
            Self::Token(_) => "token",
        }
    }

    /// Whether a browser adds it to requests by itself, so that a page from elsewhere could use it.
    pub(crate) fn comes_by_itself(self) -> bool {
        !matches!(self, Self::Token(_))
    }
}
