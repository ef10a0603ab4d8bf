//! Logging in at an identity provider: the authorization code flow (OpenID Connect Core 1.0, section 3.1) as the agent has it,
//! whatever speaks to the provider.
//!
//! A page asks to begin and is told where to send the browser; a cookie ties the answer to it (`ticket.rs`), once and for some
//! minutes. The provider sends the browser back with a code, for which it says who that is. What follows is a session as after
//! any other login (`routes.rs`). Where it comes to nothing a page says why (`page.rs`).

mod page;
pub(crate) mod routes;
mod ticket;

use super::provider::{Challenge, Person, Provider, ProviderError};
use super::secret::{RandomError, Secret, Signer};
use super::{Access, Credential, Entry, Identity};
use axum::http::HeaderMap;
use jiff::Timestamp;
use semascan_inspection::ports::{Accounts, PortError, SecretDigest, UserRow};
use semascan_model::Role;
use semascan_model::account_log::{Actor, LoginMethod};
use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use ticket::Ticket;
use tokio::sync::Semaphore;

/// Logins about which the provider is asked at once.
const ASKED_AT_ONCE: usize = 32;
/// Tickets that are remembered because they were used; with more nobody logs in until some are out of time.
const USED: usize = 4096;
/// People who can have the same name.
const NAMESAKES: u32 = 1000;
/// Characters of a name that is recorded.
const LONGEST_NAME: usize = 64;

/// Logins at the provider that were begun.
#[derive(Debug)]
pub(super) struct SignIns {
    /// Signs tickets. Those of an earlier process are nobody's.
    signer: Signer,
    lifetime: Duration,
    used: Mutex<HashMap<SecretDigest, Instant>>,
    asked: Semaphore,
}

/// Why somebody cannot log in at the provider.
#[derive(Debug)]
pub(super) enum SignInDenied {
    /// There is no provider.
    NoProvider,
    /// The provider sends browsers back to another address.
    Elsewhere { name: String, address: String },
    /// The answer is for no login that was begun in this browser of late, or for one that is over.
    NotBegun,
    /// The provider says that the person does not log in; its error code.
    Declined(String),
    /// There were too many attempts; the next may be made after that time.
    TooMany(Duration),
    /// Too many log in at this moment.
    Busy,
    /// The provider does not say who it is.
    Provider(ProviderError),
    /// No group of the person has a role.
    NoRole { name: String, groups: Vec<String> },
    /// The user was removed from this agent.
    Removed(String),
    /// The session cannot be begun now.
    Unavailable(String),
}

/// A login that the provider vouches for.
#[derive(Debug)]
pub(super) struct SignedIn {
    pub(super) identity: Identity,
    /// The cookie of the session.
    pub(super) cookie: String,
    /// Where to go: a path of this agent.
    pub(super) next: String,
}

/// What a browser brings back from the provider.
#[derive(Debug)]
pub(super) struct Brought<'a> {
    pub(super) state: &'a str,
    /// The code, or the error code.
    pub(super) code: Result<&'a str, &'a str>,
}

impl SignInDenied {
    /// The reason as the log of accounts has it; `None` where it has it already, with the user, or it is no refusal.
    fn noted(&self) -> Option<&'static str> {
        match self {
            Self::NotBegun => Some("it was not begun in this browser, or is over"),
            Self::TooMany(_) => Some("too many attempts"),
            Self::Declined(_) => Some("the identity provider declined"),
            Self::Provider(ProviderError::Rejected(_)) => Some("what the identity provider said was not believed"),
            Self::NoRole { .. } | Self::Removed(_) | Self::Provider(ProviderError::Unavailable(_)) => None,
            Self::NoProvider | Self::Elsewhere { .. } | Self::Busy | Self::Unavailable(_) => None,
        }
    }
}

impl SignIns {
    /// None so far; one may take `lifetime`.
    ///
    /// # Errors
    /// [`RandomError`].
    pub(super) fn new(lifetime: Duration) -> Result<Self, RandomError> {
        let signer = Secret::draw()?.signer();
        Ok(Self { signer, lifetime, used: Mutex::default(), asked: Semaphore::new(ASKED_AT_ONCE) })
    }

    /// Uses a ticket up: nobody uses it again.
    fn use_up(&self, ticket: &Ticket, now: Instant) -> Result<(), SignInDenied> {
        let mut used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        if used.len() >= USED {
            used.retain(|_, then| now.duration_since(*then) <= self.lifetime);
        }
        if used.contains_key(&ticket.digest()) {
            return Err(SignInDenied::NotBegun);
        }
        if used.len() >= USED {
            return Err(SignInDenied::Busy);
        }
        used.insert(ticket.digest(), now);
        Ok(())
    }
}

impl Access {
    /// The provider, where there is one.
    pub(super) fn provider(&self) -> Option<&Arc<Provider>> {
        match &self.entry {
            Entry::Accounts { provider, .. } => provider.as_ref(),
            Entry::Local | Entry::Watch => None,
        }
    }

    /// Begins a login of a browser that asked `host` and wants to see `next` afterwards: the provider's address to send it to, and
    /// the cookie that ties the answer to it.
    pub(super) async fn begin_sign_in(&self, host: &str, next: &str) -> Result<(String, String), SignInDenied> {
        let provider = self.provider().ok_or(SignInDenied::NoProvider)?;
        // The cookie would not come back to another address.
        if !host.eq_ignore_ascii_case(provider.address.authority()) {
            let (name, address) = (provider.name.clone(), provider.address.to_string());
            return Err(SignInDenied::Elsewhere { name, address });
        }
        let ticket = Ticket::begin(next, Timestamp::now()).map_err(|e| SignInDenied::Unavailable(e.to_string()))?;
        let _asked = self.sign_ins.asked.try_acquire().map_err(|_| SignInDenied::Busy)?;
        let challenge = ticket.challenge(&self.sign_ins.signer);
        let location = provider.port.authorization(&challenge).await.map_err(SignInDenied::Provider)?;
        Ok((location, self.ticket_cookie(&ticket.sealed(&self.sign_ins.signer), self.sign_ins.lifetime)))
    }

    /// Ends the login that a browser comes back from with `brought`. The log of accounts has it, unless it could not be found out
    /// who that is.
    pub(super) async fn finish_sign_in(
        self: &Arc<Self>,
        address: IpAddr,
        headers: &HeaderMap,
        brought: Brought<'_>,
    ) -> Result<SignedIn, SignInDenied> {
        let begun = Instant::now();
        let done = self.come_back(address, headers, brought, begun).await;
        match &done {
            // Not the fault of who tried.
            Ok(_) | Err(SignInDenied::Provider(ProviderError::Unavailable(_)) | SignInDenied::Busy) => {
                self.attempts.succeeded(address, None, begun);
            }
            Err(denied) => {
                if let Some(reason) = denied.noted() {
                    self.refused_early(address, None, LoginMethod::Oidc, reason).await;
                }
            }
        }
        done
    }

    async fn come_back(
        self: &Arc<Self>,
        address: IpAddr,
        headers: &HeaderMap,
        brought: Brought<'_>,
        now: Instant,
    ) -> Result<SignedIn, SignInDenied> {
        let provider = self.provider().ok_or(SignInDenied::NoProvider)?;
        let ticket = self.ticket(headers, brought.state).ok_or(SignInDenied::NotBegun)?;
        self.attempts.begin(address, None, now).map_err(SignInDenied::TooMany)?;
        self.sign_ins.use_up(&ticket, now)?;
        let code = brought.code.map_err(|error| SignInDenied::Declined(error.to_owned()))?;
        let person = self.person(provider, &ticket.challenge(&self.sign_ins.signer), code).await?;
        let (identity, cookie) = self.admit_person(address, Arc::clone(provider), person).await?;
        Ok(SignedIn { identity, cookie, next: ticket.next })
    }

    /// Asks the provider who comes back with `code`.
    async fn person(&self, provider: &Provider, challenge: &Challenge, code: &str) -> Result<Person, SignInDenied> {
        let _asked = self.sign_ins.asked.try_acquire().map_err(|_| SignInDenied::Busy)?;
        provider.port.person(challenge, code.to_owned()).await.map_err(SignInDenied::Provider)
    }

    /// Begins a session of `person`, if that one may do anything here.
    async fn admit_person(
        self: &Arc<Self>,
        address: IpAddr,
        provider: Arc<Provider>,
        person: Person,
    ) -> Result<(Identity, String), SignInDenied> {
        let unavailable = |reason: &dyn std::fmt::Display| SignInDenied::Unavailable(reason.to_string());
        let (Some(accounts), Some(signer)) = (self.accounts(), &self.signer) else {
            return Err(SignInDenied::NoProvider);
        };
        let secret = Secret::draw().map_err(|error| unavailable(&error))?;
        let cookie = self.set_cookie(&signer.signed(&secret), self.longest);
        let (access, digest) = (Arc::clone(self), secret.digest());
        let admit = move || -> Result<_, SignInDenied> {
            let unavailable = |error: PortError| SignInDenied::Unavailable(error.to_string());
            let accounts = accounts.as_ref();
            let refused = |user, reason| access.note_refused(accounts, address, user, LoginMethod::Oidc, reason);
            let Some(role) = provider.role(&person.groups) else {
                let user = accounts.user_of(&person.identity).map_err(unavailable)?.map(|row| row.name);
                refused(user, "no group has a role");
                return Err(SignInDenied::NoRole {
                    name: recorded_name(&person, &provider.name, 1),
                    groups: person.groups,
                });
            };
            let row = row_of(accounts, &person, &provider.name, role).map_err(unavailable)?;
            if row.removed.is_some() {
                refused(Some(row.name.clone()), "the user was removed");
                return Err(SignInDenied::Removed(row.name));
            }
            access.begin_session(accounts, &row.name, digest, address, LoginMethod::Oidc).map_err(unavailable)?;
            Ok(row)
        };
        let row = tokio::task::spawn_blocking(admit).await.map_err(|error| unavailable(&error))??;
        Ok((Identity { name: row.name, role: row.role, credential: Credential::Session(digest) }, cookie))
    }

    /// The ticket among the cookies of a browser that comes back with `state`.
    fn ticket(&self, headers: &HeaderMap, state: &str) -> Option<Ticket> {
        let SignIns { signer, lifetime, .. } = &self.sign_ins;
        let name = self.ticket_name();
        let mut opened =
            self.cookies(headers, &name).filter_map(|v| Ticket::opened(v, signer, *lifetime, Timestamp::now()));
        opened.find(|ticket| ticket.has_state(state, signer))
    }

    /// The cookie that takes the place of a ticket.
    pub(super) fn no_ticket(&self) -> String {
        self.ticket_cookie("", Duration::ZERO)
    }

    fn ticket_name(&self) -> String {
        format!("{}-sign-in", self.cookie)
    }

    /// A cookie that comes along when another site sends the browser here, which one of a session does not.
    fn ticket_cookie(&self, value: &str, age: Duration) -> String {
        let secure = if self.secure { "; Secure" } else { "" };
        format!("{}={value}; Path=/; Max-Age={}; HttpOnly; SameSite=Lax{secure}", self.ticket_name(), age.as_secs())
    }
}

/// The user who stands for `person`, with the role that follows from the person's groups now; who is seen for the first time is
/// added.
fn row_of(accounts: &dyn Accounts, person: &Person, provider: &str, role: Role) -> Result<UserRow, PortError> {
    let (now, by) = (Timestamp::now(), Actor::Provider { issuer: person.identity.issuer.clone() });
    for number in 1..=NAMESAKES {
        if let Some(row) = accounts.user_of(&person.identity)? {
            if row.removed.is_none() && row.role != role {
                accounts.set_role(&row.name, role, now, &by)?;
            }
            return Ok(UserRow { role, ..row });
        }
        let row = UserRow {
            name: recorded_name(person, provider, number),
            role,
            password: String::new(),
            created: now,
            password_set: now,
            removed: None,
            identity: Some(person.identity.clone()),
        };
        if accounts.add_user(&row, &by)? {
            return Ok(row);
        }
    }
    Err(PortError::new("users", format!("{NAMESAKES} people are called {}", recorded_name(person, provider, 1))))
}

/// The name under which it is recorded what `person` does: what the person is called and who vouches for it. A user with a password
/// cannot be called so, and people who are called alike are numbered.
fn recorded_name(person: &Person, provider: &str, number: u32) -> String {
    let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '.' | '_' | '-' | '@' | '+');
    let is_name = |name: &String| (1..=LONGEST_NAME).contains(&name.len()) && name.chars().all(is_plain);
    let name = person.names.iter().map(|name| name.to_ascii_lowercase()).find(is_name);
    let name = name.unwrap_or_else(|| "person".to_owned());
    match number {
        1 => format!("{name} ({provider})"),
        _ => format!("{name} {number} ({provider})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::account_log::ProviderIdentity;

    #[test]
    fn a_recorded_name_is_plain_and_says_who_vouches_for_it() {
        let named = |names: &[&str], number| {
            let identity = ProviderIdentity { issuer: "https://id.plant".into(), subject: "7f".into() };
            let names = names.iter().map(|&name| name.to_owned()).collect();
            recorded_name(&Person { identity, names, groups: Vec::new() }, "Plant", number)
        };
        assert_eq!(named(&["Anna", "anna@plant.example"], 1), "anna (Plant)");
        assert_eq!(named(&["anna"], 2), "anna 2 (Plant)");
        for odd in ["", "anna (Plant)", "token x", "a\u{202e}b", "<b>", "аnna", "a\n", &"x".repeat(65)] {
            assert_eq!(named(&[odd, "anna+b@plant.example"], 1), "anna+b@plant.example (Plant)", "{odd}");
            assert_eq!(named(&[odd], 3), "person 3 (Plant)", "{odd}");
        }
    }

    #[test]
    fn a_ticket_is_used_once_and_those_that_are_remembered_are_bounded() {
        let sign_ins = SignIns::new(Duration::from_secs(600)).expect("random numbers");
        let (ticket, now) = (|| Ticket::begin("/", Timestamp::now()).expect("random numbers"), Instant::now());
        let first = ticket();
        assert!(sign_ins.use_up(&first, now).is_ok());
        assert!(matches!(sign_ins.use_up(&first, now), Err(SignInDenied::NotBegun)));
        (1..USED).for_each(|_| sign_ins.use_up(&ticket(), now).expect("there is room"));
        assert!(matches!(sign_ins.use_up(&ticket(), now), Err(SignInDenied::Busy)));
        assert!(matches!(sign_ins.use_up(&first, now), Err(SignInDenied::NotBegun)), "none is forgotten for others");
        assert!(sign_ins.use_up(&ticket(), now + Duration::from_secs(601)).is_ok());
    }
}
