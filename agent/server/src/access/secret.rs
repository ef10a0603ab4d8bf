//! Secrets of sessions and tokens: 256 random bits, of which the agent keeps the SHA-256 digest alone. What a cookie carries is
//! signed besides (HMAC-SHA-256, RFC 2104), so that a forged one is refused before anything is looked up. Each signature is for
//! one purpose, so that what was signed for one is nothing for another.

use base64::Engine;
use base64::prelude::BASE64_URL_SAFE_NO_PAD as BASE64;
use hmac::{Hmac, KeyInit, Mac};
use semascan_inspection::ports::SecretDigest;
use sha2::{Digest, Sha256};
use std::fmt;

/// Bytes of a secret.
pub(super) const LENGTH: usize = 32;
/// Bytes of a block of SHA-256.
const BLOCK: usize = 64;
/// What a token begins with, so that it is recognised where it does not belong.
const TOKEN: &str = "semascan_";
/// What signatures of sessions begin with.
const SESSION: &[u8] = b"semascan session 1";

/// The system gave no random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the system gives no random numbers: {0}")]
pub struct RandomError(getrandom::Error);

/// A secret. It is shown to its owner once and never written.
pub struct Secret([u8; LENGTH]);

impl Secret {
    /// A new one.
    ///
    /// # Errors
    /// [`RandomError`].
    pub fn draw() -> Result<Self, RandomError> {
        let mut bytes = [0; LENGTH];
        getrandom::fill(&mut bytes).map_err(RandomError)?;
        Ok(Self(bytes))
    }

    /// The key that signs what does not outlive this process.
    pub(super) fn signer(&self) -> Signer {
        Signer::new(self.0)
    }

    pub(super) fn of_bytes(bytes: [u8; LENGTH]) -> Self {
        Self(bytes)
    }

    pub(super) fn bytes(&self) -> &[u8; LENGTH] {
        &self.0
    }

    /// What is kept of it.
    pub fn digest(&self) -> SecretDigest {
        Sha256::digest(self.0).into()
    }

    /// It as a token for a machine.
    pub fn token(&self) -> String {
        format!("{TOKEN}{}", BASE64.encode(self.0))
    }

    /// The secret of a token; `None` if it is none.
    pub(super) fn of_token(token: &str) -> Option<Self> {
        decoded(token.strip_prefix(TOKEN)?, LENGTH)?.try_into().ok().map(Self)
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(..)")
    }
}

/// Signs the values of cookies.
pub(super) struct Signer([u8; LENGTH]);

impl Signer {
    pub(super) fn new(key: [u8; LENGTH]) -> Self {
        Self(key)
    }

    /// The value of the cookie that carries `secret`.
    pub(super) fn signed(&self, secret: &Secret) -> String {
        self.sealed(SESSION, &secret.0)
    }

    /// The secret in a cookie's value; `None` if this agent did not sign it. Compares in constant time.
    pub(super) fn verified(&self, value: &str) -> Option<Secret> {
        self.opened(SESSION, value, LENGTH)?.try_into().ok().map(Secret)
    }

    /// `bytes` and their signature for `purpose`, as the value of a cookie.
    pub(super) fn sealed(&self, purpose: &[u8], bytes: &[u8]) -> String {
        format!("{}.{}", BASE64.encode(bytes), BASE64.encode(self.derived(purpose, bytes)))
    }

    /// The bytes in a cookie's value, `most` at most; `None` if they were not signed for `purpose`. Compares in constant time.
    pub(super) fn opened(&self, purpose: &[u8], value: &str, most: usize) -> Option<Vec<u8>> {
        let (bytes, signature) = value.split_once('.')?;
        let bytes = decoded(bytes, most)?;
        self.is_derived(purpose, &bytes, signature).then_some(bytes)
    }

    /// What only this key makes of `bytes` for `purpose`.
    pub(super) fn derived(&self, purpose: &[u8], bytes: &[u8]) -> [u8; LENGTH] {
        self.mac(purpose, bytes).finalize().into_bytes().into()
    }

    /// Whether `text` is [`derived`](Self::derived), in base64. Compares in constant time.
    pub(super) fn is_derived(&self, purpose: &[u8], bytes: &[u8], text: &str) -> bool {
        decoded(text, LENGTH).is_some_and(|given| self.mac(purpose, bytes).verify_slice(&given).is_ok())
    }

    fn mac(&self, purpose: &[u8], bytes: &[u8]) -> Hmac<Sha256> {
        // A key that is shorter than a block is filled up with zeros (RFC 2104, section 2).
        let mut block = [0; BLOCK];
        block[..LENGTH].copy_from_slice(&self.0);
        let mut mac = <Hmac<Sha256> as KeyInit>::new(&block.into());
        mac.update(purpose);
        mac.update(bytes);
        mac
    }
}

impl fmt::Debug for Signer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Signer(..)")
    }
}

/// What `text` says in base64, `most` bytes at most. Longer texts are not even decoded.
fn decoded(text: &str, most: usize) -> Option<Vec<u8>> {
    (text.len() <= most.div_ceil(3) * 4).then(|| BASE64.decode(text).ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cookie_is_believed_only_as_it_was_signed() {
        let (signer, secret) = (Signer::new([7; 32]), Secret([9; 32]));
        let value = signer.signed(&secret);
        assert_eq!(signer.verified(&value).map(|s| s.digest()), Some(secret.digest()));
        assert!(Signer::new([8; 32]).verified(&value).is_none(), "another agent's");
        for at in 0..value.len() {
            let mut forged = value.clone().into_bytes();
            forged[at] = if forged[at] == b'A' { b'B' } else { b'A' };
            let forged = String::from_utf8(forged).expect("text");
            assert!(signer.verified(&forged).is_none(), "{at}: {forged}");
        }
        let (secret, _) = value.split_once('.').expect("two parts");
        for forged in ["", ".", secret, &format!("{secret}."), &format!("{value}A"), &"A".repeat(1 << 20)] {
            assert!(signer.verified(forged).is_none());
        }
    }

    #[test]
    fn a_token_is_read_back_and_says_nothing_when_it_is_printed() {
        let secret = Secret::draw().expect("random numbers");
        let token = secret.token();
        assert!(token.starts_with("semascan_") && token.len() == 52, "{}", token.len());
        assert_eq!(Secret::of_token(&token).map(|s| s.digest()), Some(secret.digest()));
        assert_ne!(secret.digest(), Secret::draw().expect("random numbers").digest());
        for wrong in ["", "semascan_", &token[1..], &token[..51], &format!("{token}A"), &token.to_uppercase()] {
            assert!(Secret::of_token(wrong).is_none(), "{wrong}");
        }
        assert!(!format!("{secret:?}").contains(&token[9..]));
    }
}
