//! The live stream, the API, the viewer's files, and who may use them, on one port.
//!
//! [`LiveModel`] holds what every client shall end up with; [`LiveStream`] feeds it from a running inspection; each
//! client's task walks it at its own speed. Nothing is queued per client: a slow one skips revisions, not the result.
//! [`Limits`] bound what clients may take of the agent, however many come and whatever they do.

mod access;
pub mod api;
mod client;
mod client_log;
mod connections;
mod foxglove;
mod guard;
mod health;
mod limits;
mod live;
mod live_stream;
mod messages;
mod metrics;
#[cfg(feature = "oidc")]
mod oidc;
mod past;
mod plain_answer;
mod replay;
mod request_rate;
mod saved;
mod server;
mod thumbnail;
mod tls;
mod transport;
mod web;
mod wire;

pub use access::{
    Challenge, Entry, Identity, IdentityProvider, OpenError, PasswordError, Person, Provider, ProviderAnswer,
    ProviderError, ProviderSettingError, PublicAddress, RandomError, Secret, hash_password,
};
pub use guard::AccessRule;
pub use limits::{LimitError, Limits};
pub use live::{LiveModel, StreamTotals};
pub use live_stream::LiveStream;
#[cfg(feature = "oidc")]
pub use oidc::{Oidc, OidcError, OidcSettings};
pub use past::Past;
pub use saved::{SavedError, publish_saved};
pub use server::{ServeError, Server, ServerConfig};
pub use tls::{Tls, TlsError, TlsFiles, own_certificate};
pub use web::{EmbeddedFiles, WebFiles, WebFolder};
