//! A login at an identity provider that was begun in a browser: what the browser keeps until it comes back, in a cookie that only
//! the agent can make, so that nobody else's answer can be slipped under (login CSRF: RFC 6819, section 4.4.1.8). The agent itself
//! keeps nothing of a login that was only begun.

use super::super::provider::Challenge;
use super::super::secret::{LENGTH, RandomError, Secret, Signer};
use base64::Engine;
use base64::prelude::BASE64_URL_SAFE_NO_PAD as BASE64;
use jiff::Timestamp;
use semascan_inspection::ports::SecretDigest;
use std::time::Duration;

/// What signatures of tickets begin with.
const TICKET: &[u8] = b"semascan sign-in 1";
const STATE: &[u8] = b"semascan state 1";
const NONCE: &[u8] = b"semascan nonce 1";
const VERIFIER: &[u8] = b"semascan verifier 1";
/// Bytes of a time.
const TIME: usize = 8;
/// Most bytes of the path to go to.
const LONGEST_PATH: usize = 512;
/// The path of the viewer.
const HOME: &str = "/";

/// A login that was begun.
pub(super) struct Ticket {
    secret: Secret,
    /// Seconds since 1970.
    begun: i64,
    /// Where to go afterwards: a path of this agent.
    pub(super) next: String,
}

impl Ticket {
    /// A login that begins now. Afterwards the browser goes to `next` if that is a path of this agent, else to the viewer.
    ///
    /// # Errors
    /// [`RandomError`].
    pub(super) fn begin(next: &str, now: Timestamp) -> Result<Self, RandomError> {
        let next = if is_local(next) { next } else { HOME }.to_owned();
        Ok(Self { secret: Secret::draw()?, begun: now.as_second(), next })
    }

    /// It as the value of a cookie.
    pub(super) fn sealed(&self, signer: &Signer) -> String {
        let bytes = [self.secret.bytes().as_slice(), &self.begun.to_be_bytes(), self.next.as_bytes()].concat();
        signer.sealed(TICKET, &bytes)
    }

    /// The ticket in the value of a cookie; `None` if `signer` did not sign it, or it was begun longer than `lifetime` before
    /// `now`.
    pub(super) fn opened(value: &str, signer: &Signer, lifetime: Duration, now: Timestamp) -> Option<Self> {
        let bytes = signer.opened(TICKET, value, LENGTH + TIME + LONGEST_PATH)?;
        let (secret, rest) = bytes.split_first_chunk::<LENGTH>()?;
        let (begun, next) = rest.split_first_chunk::<TIME>()?;
        let begun = i64::from_be_bytes(*begun);
        let age = u64::try_from(now.as_second().checked_sub(begun)?).ok()?;
        let next = String::from_utf8(next.to_vec()).ok()?;
        (age <= lifetime.as_secs()).then_some(Self { secret: Secret::of_bytes(*secret), begun, next })
    }

    /// What the provider is asked with.
    pub(super) fn challenge(&self, signer: &Signer) -> Challenge {
        let text = |purpose| BASE64.encode(signer.derived(purpose, self.secret.bytes()));
        Challenge { state: text(STATE), nonce: text(NONCE), verifier: text(VERIFIER) }
    }

    /// Whether `state` is that of this ticket. Compares in constant time.
    pub(super) fn has_state(&self, state: &str, signer: &Signer) -> bool {
        signer.is_derived(STATE, self.secret.bytes(), state)
    }

    /// By what it is known once it was used.
    pub(super) fn digest(&self) -> SecretDigest {
        self.secret.digest()
    }
}

/// Whether a browser that is sent to `path` stays with this agent: it begins with one slash, and has nothing that browsers read
/// as another one or leave out (WHATWG URL, section 4.4).
fn is_local(path: &str) -> bool {
    let mut bytes = path.bytes();
    let begins = bytes.next() == Some(b'/') && !matches!(bytes.next(), Some(b'/' | b'\\'));
    begins && path.len() <= LONGEST_PATH && path.bytes().all(|byte| byte.is_ascii_graphic() && byte != b'\\')
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIFETIME: Duration = Duration::from_secs(600);

    fn at(second: i64) -> Timestamp {
        Timestamp::from_second(1_700_000_000 + second).expect("in range")
    }

    #[test]
    fn a_ticket_is_believed_as_it_was_signed_and_for_its_time() {
        let signer = Signer::new([7; LENGTH]);
        let ticket = Ticket::begin("/inspections.html?part=a", at(0)).expect("random numbers");
        let value = ticket.sealed(&signer);
        let opened = |value: &str, signer: &Signer, second| Ticket::opened(value, signer, LIFETIME, at(second));
        let back = opened(&value, &signer, 600).expect("its own");
        assert_eq!((back.digest(), back.next.as_str()), (ticket.digest(), "/inspections.html?part=a"));
        assert!(opened(&value, &signer, 601).is_none() && opened(&value, &signer, -1).is_none());
        assert!(opened(&value, &Signer::new([8; LENGTH]), 0).is_none(), "another agent's");
        for at in 0..value.len() {
            let mut forged = value.clone().into_bytes();
            forged[at] = if forged[at] == b'A' { b'B' } else { b'A' };
            assert!(opened(&String::from_utf8(forged).expect("text"), &signer, 0).is_none(), "{at}");
        }
        // A session's cookie is signed too, and is none.
        assert!(opened(&signer.signed(&Secret::draw().expect("random numbers")), &signer, 0).is_none());
    }

    #[test]
    fn a_challenge_is_of_its_ticket_and_its_texts_are_told_apart() {
        let signer = Signer::new([7; LENGTH]);
        let [ticket, other] = [0, 0].map(|second| Ticket::begin("/", at(second)).expect("random numbers"));
        let challenge = ticket.challenge(&signer);
        assert!(ticket.has_state(&challenge.state, &signer) && challenge.verifier.len() == 43);
        for wrong in ["", &challenge.nonce, &challenge.verifier, &other.challenge(&signer).state, &challenge.state[1..]]
        {
            assert!(!ticket.has_state(wrong, &signer), "{wrong}");
        }
    }

    #[test]
    fn a_path_leads_to_this_agent() {
        for good in ["/", "/?inspection=1#view", "/inspections.html?part=a%20b&x=https://a//b", "/a//b"] {
            assert!(is_local(good), "{good}");
        }
        let long = format!("/{}", "x".repeat(LONGEST_PATH));
        for wrong in [
            "",
            "x",
            "//evil.example",
            "/\\evil.example",
            "\\\\evil.example",
            "/\t/evil.example",
            "/\n/evil.example",
            "\t//evil.example",
            "https://evil.example",
            "https:evil.example",
            "javascript:alert(1)",
            " /",
            "/ä",
            &long,
        ] {
            assert!(!is_local(wrong), "{wrong}");
            assert_eq!(Ticket::begin(wrong, at(0)).expect("random numbers").next, "/");
        }
    }

    proptest! {
        #[test]
        fn whatever_a_cookie_says_is_looked_at(value in ".{0,200}", bytes in prop::collection::vec(any::<u8>(), 0..700)) {
            let signer = Signer::new([7; LENGTH]);
            prop_assert!(Ticket::opened(&value, &signer, LIFETIME, at(0)).is_none());
            // Well signed by a key that leaked: still no panic.
            let _ = Ticket::opened(&signer.sealed(TICKET, &bytes), &signer, LIFETIME, at(0));
        }
    }
}
