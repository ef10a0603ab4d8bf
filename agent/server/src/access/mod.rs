//! Who may do what with the agent.
//!
//! On loopback whoever reaches the agent is its administrator, unless a login is asked for. On any other interface there are
//! users, who log in with a name and a password and then have a session, and machines, which have a token. An identity provider
//! may vouch for more people. Each of them has a role; `routes.rs` says which role each route and each message needs, in one
//! table, and what is not in it is refused.
//!
//! | file | what |
//! |---|---|
//! | `routes.rs` | the role that each route and message needs |
//! | `identity.rs` | who a request comes from |
//! | `entry.rs` | who is let in, and whether an agent may start like that |
//! | `password.rs`, `secret.rs` | passwords and their hashes; secrets, tokens and signed cookies |
//! | `attempts.rs` | how often a login may fail |
//! | `listing.rs` | how many logins are listed in the log of accounts |
//! | `login.rs` | the routes `login`, `logout` and `me` |
//! | `provider.rs` | the port to an identity provider |
//! | `sign_in/` | logging in there: `ticket.rs` what a browser keeps meanwhile, `routes.rs`, `page.rs` |
//! | `refusal.rs` | how a request is refused |

mod attempts;
mod entry;
mod identity;
mod listing;
pub(crate) mod login;
mod password;
mod provider;
mod refusal;
pub(crate) mod routes;
mod secret;
pub(crate) mod sign_in;
#[cfg(test)]
mod tests;

pub use entry::{Entry, OpenError};
pub(crate) use identity::Credential;
pub use identity::Identity;
pub use password::{PasswordError, hash_password};
pub(crate) use provider::CALLBACK;
pub use provider::{
    Challenge, IdentityProvider, Person, Provider, ProviderAnswer, ProviderError, ProviderSettingError, PublicAddress,
};
pub(crate) use refusal::refusal;
pub use secret::{RandomError, Secret};

use crate::limits::{Limits, seconds};
use attempts::Attempts;
use axum::http::{HeaderMap, HeaderName, header};
use jiff::Timestamp;
use listing::{Admission, Listing};
use password::Verifier;
use secret::Signer;
use semascan_inspection::ports::{Accounts, Login, PortError, SecretDigest, SessionRow, TokenRow, UserRow};
use semascan_model::Role;
use semascan_model::account_log::{AccountAction, Actor, LoginMethod, Unlisted};
use sign_in::SignIns;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::Semaphore;

/// Sessions that a user may have at once; the one that was not used for longest ends.
const SESSIONS: u32 = 32;
/// Passwords that are hashed at once; each takes 19 MiB.
const HASHED_AT_ONCE: usize = 2;
/// Logins that may wait for that.
const WAITING: usize = 32;
/// The use of a session is noted so often.
const NOTED: Duration = Duration::from_secs(60);
/// Cookies of our name that are looked at.
const COOKIES: usize = 4;
/// Headers by which a proxy says for whom it asks.
const FORWARDED: [HeaderName; 3] =
    [HeaderName::from_static("forwarded"), HeaderName::from_static("x-forwarded-for"), HeaderName::from_static("via")];

/// Why a request has no identity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Denied {
    /// Nobody is logged in, or not any more.
    Unknown(&'static str),
    /// A proxy asks for others, to whom the rule for loopback does not apply.
    Forwarded,
    /// Who it is cannot be found out now.
    Unavailable(PortError),
}

/// Why somebody cannot log in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum LoginDenied {
    /// Name or password is wrong.
    Wrong,
    /// There were too many attempts; the next may be made after that time.
    TooMany(Duration),
    /// Too many log in at this moment.
    Busy,
    /// Nobody can log in here.
    NoLogin,
    /// The session cannot be begun now.
    Unavailable(String),
}

/// Finds out who requests come from.
#[derive(Debug)]
pub(crate) struct Access {
    entry: Entry,
    signer: Option<Signer>,
    attempts: Attempts,
    listing: Listing,
    passwords: Arc<Verifier>,
    hashing: Arc<Semaphore>,
    waiting: Semaphore,
    sign_ins: SignIns,
    idle: Duration,
    longest: Duration,
    cookie: String,
    secure: bool,
}

impl Access {
    /// Who is let in at `port`, `secure` where all connections are encrypted.
    ///
    /// # Errors
    /// [`PortError`] where the key that signs cookies cannot be had.
    pub(crate) fn new(entry: Entry, limits: &Limits, secure: bool, port: u16) -> Result<Self, PortError> {
        let signer = match &entry {
            Entry::Accounts { accounts, .. } => {
                let proposed = Secret::draw().map_err(|error| PortError::new("the key of sessions", error))?;
                Some(Signer::new(accounts.signing_key(proposed.digest())?))
            }
            Entry::Local | Entry::Watch => None,
        };
        // Cookies do not tell ports apart: agents on one host have names of their own.
        let prefix = if secure { "__Host-" } else { "" };
        Ok(Self {
            entry,
            signer,
            attempts: Attempts::default(),
            listing: Listing::default(),
            passwords: Arc::default(),
            hashing: Arc::new(Semaphore::new(HASHED_AT_ONCE)),
            waiting: Semaphore::new(WAITING),
            sign_ins: SignIns::new(seconds(limits.sign_in_s)).map_err(|e| PortError::new("the key of logins", e))?,
            idle: seconds(limits.session_idle_s),
            longest: seconds(limits.session_s),
            cookie: format!("{prefix}semascan-{port}"),
            secure,
        })
    }

    /// Whether users log in here.
    pub(crate) fn has_login(&self) -> bool {
        matches!(self.entry, Entry::Accounts { .. })
    }

    /// The users who log in here; `None` where nobody does.
    pub(crate) fn accounts(&self) -> Option<Arc<dyn Accounts>> {
        match &self.entry {
            Entry::Accounts { accounts, .. } => Some(Arc::clone(accounts)),
            Entry::Local | Entry::Watch => None,
        }
    }

    /// Who the request with `headers` comes from.
    pub(crate) async fn identify(&self, headers: &HeaderMap) -> Result<Identity, Denied> {
        let accounts = match &self.entry {
            Entry::Local if FORWARDED.iter().any(|name| headers.contains_key(name)) => return Err(Denied::Forwarded),
            Entry::Local => return Ok(reached("local", Role::Admin)),
            Entry::Watch => return Ok(reached("anyone", Role::Viewer)),
            Entry::Accounts { accounts, .. } => accounts,
        };
        if let Some(authorization) = headers.get(header::AUTHORIZATION) {
            let given = authorization.to_str().ok().and_then(bearer).and_then(Secret::of_token);
            let digest = given.ok_or(Denied::Unknown("this is no token of this agent"))?.digest();
            return look_up(accounts, move |accounts| token_identity(accounts, &digest, Timestamp::now())).await;
        }
        let given =
            self.cookies(headers, &self.cookie).filter_map(|value| self.signer.as_ref()?.verified(value)).next();
        let digest = given.ok_or(Denied::Unknown("nobody is logged in"))?.digest();
        self.session(accounts, digest).await
    }

    /// Whether `identity` may still do what it may, and what that is by now.
    pub(crate) async fn still(&self, identity: &Identity) -> Result<Identity, Denied> {
        match (&self.entry, identity.credential) {
            (Entry::Accounts { accounts, .. }, Credential::Session(digest)) => self.session(accounts, digest).await,
            (Entry::Accounts { accounts, .. }, Credential::Token(digest)) => {
                look_up(accounts, move |accounts| token_identity(accounts, &digest, Timestamp::now())).await
            }
            _ => Ok(identity.clone()),
        }
    }

    async fn session(&self, accounts: &Arc<dyn Accounts>, digest: SecretDigest) -> Result<Identity, Denied> {
        let (idle, longest) = (self.idle, self.longest);
        look_up(accounts, move |accounts| session_identity(accounts, &digest, idle, longest, Timestamp::now())).await
    }

    /// The values of cookies that are called `name`.
    fn cookies<'a>(&self, headers: &'a HeaderMap, name: &'a str) -> impl Iterator<Item = &'a str> + use<'a> {
        let texts = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
        let pairs = texts.flat_map(|text| text.split(';')).filter_map(|pair| pair.trim().split_once('='));
        pairs.filter(move |(given, _)| *given == name).map(|(_, value)| value).take(COOKIES)
    }

    /// Logs `name` in from `address`: who that is, and the cookie that shows it. The log of accounts has it, whatever comes of it.
    pub(crate) async fn log_in(
        self: &Arc<Self>,
        address: IpAddr,
        name: &str,
        password: String,
    ) -> Result<(Identity, String), LoginDenied> {
        let (Entry::Accounts { accounts, .. }, Some(signer)) = (&self.entry, &self.signer) else {
            return Err(LoginDenied::NoLogin);
        };
        let name = name.to_ascii_lowercase();
        let begun = Instant::now();
        let Ok(_place) = self.waiting.try_acquire() else {
            self.refused_early(address, Some(name), LoginMethod::Password, "too many at once").await;
            return Err(LoginDenied::Busy);
        };
        if let Err(wait) = self.attempts.begin(address, Some(&name), begun) {
            self.refused_early(address, Some(name), LoginMethod::Password, "too many attempts").await;
            return Err(LoginDenied::TooMany(wait));
        }
        let unavailable = |reason: &dyn std::fmt::Display| LoginDenied::Unavailable(reason.to_string());
        // The permit goes with the work, which goes on where the client does not wait for it.
        let permit = Arc::clone(&self.hashing).acquire_owned().await.map_err(|error| unavailable(&error))?;
        let secret = Secret::draw().map_err(|error| unavailable(&error))?;
        let cookie = self.set_cookie(&signer.signed(&secret), self.longest);
        let digest = secret.digest();
        let (access, accounts, user) = (Arc::clone(self), Arc::clone(accounts), name.clone());
        let work = move || {
            let _permit = permit;
            let row = accounts.user(&user)?;
            // Who has no password here cannot have the right one.
            let valid = row.as_ref().filter(|row| row.removed.is_none() && row.identity.is_none());
            if !access.passwords.is_right(valid.map(|row| row.password.as_str()), &password) {
                let user = row.map(|row| row.name);
                access.note_refused(
                    accounts.as_ref(),
                    address,
                    user,
                    LoginMethod::Password,
                    "name or password is wrong",
                );
                return Ok(None);
            }
            let Some(row) = row else { return Ok(None) };
            access.begin_session(accounts.as_ref(), &row.name, digest, address, LoginMethod::Password)?;
            Ok::<_, PortError>(Some(row))
        };
        let done = tokio::task::spawn_blocking(work).await.map_err(|error| unavailable(&error))?;
        let row = done.map_err(|error| unavailable(&error))?.ok_or(LoginDenied::Wrong)?;
        self.attempts.succeeded(address, Some(&name), begun);
        Ok((Identity { name: row.name, role: row.role, credential: Credential::Session(digest) }, cookie))
    }

    /// Begins a session of `user`, who logged in from `address`.
    fn begin_session(
        &self,
        accounts: &dyn Accounts,
        user: &str,
        digest: SecretDigest,
        address: IpAddr,
        method: LoginMethod,
    ) -> Result<(), PortError> {
        let now = Timestamp::now();
        accounts.forget_sessions(earlier(now, self.longest), earlier(now, self.idle))?;
        let session = SessionRow { digest, user: user.to_owned(), began: now, used: now };
        let by = Actor::User { name: user.to_owned(), address: Some(address) };
        let is_listed = self.admit(accounts, &Unlisted::Logins { user: user.to_owned() });
        accounts.begin_session(&session, SESSIONS, is_listed.then_some(Login { by, method }).as_ref())
    }

    /// Notes a login that is refused before it is known whose it is; `name` is what was given. A flood of them costs no access to
    /// the disk.
    async fn refused_early(
        self: &Arc<Self>,
        address: IpAddr,
        name: Option<String>,
        method: LoginMethod,
        reason: &'static str,
    ) {
        let Some(accounts) = self.accounts() else { return };
        let access = Arc::clone(self);
        let admission = self.listing.admit(&Unlisted::Refused, Instant::now());
        if !admission.is_listed && admission.remarks.is_empty() {
            return;
        }
        let note = move || {
            // Of a name that nobody has nothing is written.
            let user = name.and_then(|name| accounts.user(&name).ok().flatten()).map(|row| row.name);
            access.note_admitted(accounts.as_ref(), admission, address, user, method, reason);
        };
        if let Err(error) = tokio::task::spawn_blocking(note).await {
            tracing::error!("a refused login was not noted: {error}");
        }
    }

    /// Notes that a login from `address` is refused.
    fn note_refused(
        &self,
        accounts: &dyn Accounts,
        address: IpAddr,
        user: Option<String>,
        method: LoginMethod,
        reason: &str,
    ) {
        let admission = self.listing.admit(&Unlisted::Refused, Instant::now());
        self.note_admitted(accounts, admission, address, user, method, reason);
    }

    fn note_admitted(
        &self,
        accounts: &dyn Accounts,
        Admission { is_listed, remarks }: Admission,
        address: IpAddr,
        user: Option<String>,
        method: LoginMethod,
        reason: &str,
    ) {
        note_remarks(accounts, &remarks);
        if is_listed {
            let action = AccountAction::LoginRefused { user, method, reason: reason.to_owned() };
            if let Err(error) = accounts.note(Timestamp::now(), &Actor::Unknown { address }, &action) {
                tracing::error!("a refused login was not noted: {error}");
            }
        }
    }

    /// Whether something of this kind is an entry of its own.
    fn admit(&self, accounts: &dyn Accounts, what: &Unlisted) -> bool {
        let Admission { is_listed, remarks } = self.listing.admit(what, Instant::now());
        note_remarks(accounts, &remarks);
        is_listed
    }

    /// Notes how many logins were not listed in the windows of time that are over; with `is_end`, in those that are not, too.
    pub(crate) async fn note_counts(&self, is_end: bool) {
        let remarks = if is_end { self.listing.all() } else { self.listing.over(Instant::now()) };
        let Some(accounts) = self.accounts().filter(|_| !remarks.is_empty()) else { return };
        if let Err(error) = tokio::task::spawn_blocking(move || note_remarks(accounts.as_ref(), &remarks)).await {
            tracing::error!("the number of logins was not noted: {error}");
        }
    }

    /// Ends the session of `identity`, who asks from `address`; the cookie that takes the place of its own.
    pub(crate) async fn log_out(self: &Arc<Self>, identity: &Identity, address: IpAddr) -> Result<String, Denied> {
        if let (Entry::Accounts { accounts, .. }, Credential::Session(digest)) = (&self.entry, identity.credential) {
            let (access, name) = (Arc::clone(self), identity.name.clone());
            let end = move |accounts: &dyn Accounts| {
                let is_listed = access.admit(accounts, &Unlisted::Logins { user: name.clone() });
                let by = Actor::User { name, address: Some(address) };
                accounts.end_session(&digest, is_listed.then(|| (Timestamp::now(), &by))).map(|_| Some(()))
            };
            look_up(accounts, end).await?;
        }
        Ok(self.set_cookie("", Duration::ZERO))
    }

    fn set_cookie(&self, value: &str, age: Duration) -> String {
        let secure = if self.secure { "; Secure" } else { "" };
        format!("{}={value}; Path=/; Max-Age={}; HttpOnly; SameSite=Strict{secure}", self.cookie, age.as_secs())
    }
}

/// Notes what the agent itself has to say.
fn note_remarks(accounts: &dyn Accounts, remarks: &[AccountAction]) {
    for remark in remarks {
        if let Err(error) = accounts.note(Timestamp::now(), &Actor::Agent, remark) {
            tracing::error!("the number of logins was not noted: {error}");
        }
    }
}

fn reached(name: &str, role: Role) -> Identity {
    Identity { name: name.to_owned(), role, credential: Credential::Reach }
}

/// The token in the value of an `Authorization` header (RFC 6750).
fn bearer(authorization: &str) -> Option<&str> {
    let (scheme, token) = authorization.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then_some(token.trim())
}

/// Asks the rows on a thread that may wait for the disk; `None` means that nobody is known by what was given.
async fn look_up<T: Send + 'static>(
    accounts: &Arc<dyn Accounts>,
    ask: impl FnOnce(&dyn Accounts) -> Result<Option<T>, PortError> + Send + 'static,
) -> Result<T, Denied> {
    let accounts = Arc::clone(accounts);
    let unavailable = |reason: String| Denied::Unavailable(PortError::new("users", reason));
    match tokio::task::spawn_blocking(move || ask(&*accounts)).await {
        Ok(Ok(Some(found))) => Ok(found),
        Ok(Ok(None)) => Err(Denied::Unknown("the login has ended, or the token is not valid any more")),
        Ok(Err(error)) => Err(Denied::Unavailable(error)),
        Err(error) => Err(unavailable(error.to_string())),
    }
}

/// Who has the token with `digest`, while it is valid.
fn token_identity(
    accounts: &dyn Accounts,
    digest: &SecretDigest,
    now: Timestamp,
) -> Result<Option<Identity>, PortError> {
    let valid = |row: &TokenRow| row.revoked.is_none() && row.expires.is_none_or(|expires| now < expires);
    let row = accounts.token(digest)?.filter(valid);
    Ok(row.map(|row| Identity {
        name: format!("token {}", row.name),
        role: row.role,
        credential: Credential::Token(*digest),
    }))
}

/// Who has the session with `digest`, while it is neither idle for longer than `idle` nor older than `longest`.
fn session_identity(
    accounts: &dyn Accounts,
    digest: &SecretDigest,
    idle: Duration,
    longest: Duration,
    now: Timestamp,
) -> Result<Option<Identity>, PortError> {
    let valid = |(session, user): &(SessionRow, UserRow)| {
        user.removed.is_none() && session.began >= earlier(now, longest) && session.used >= earlier(now, idle)
    };
    let Some((session, user)) = accounts.session(digest)?.filter(valid) else { return Ok(None) };
    if session.used < earlier(now, NOTED)
        && let Err(error) = accounts.use_session(digest, now)
    {
        // It ends earlier than it should, which a full disk must not make at once.
        tracing::debug!("the use of a session was not noted: {error}");
    }
    Ok(Some(Identity { name: user.name, role: user.role, credential: Credential::Session(*digest) }))
}

/// `time` before `now`.
fn earlier(now: Timestamp, time: Duration) -> Timestamp {
    now.checked_sub(time).unwrap_or(Timestamp::MIN)
}
