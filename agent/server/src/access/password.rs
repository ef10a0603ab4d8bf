//! Passwords: Argon2id with the parameters that OWASP recommends (19 MiB, two passes), and the same work for a user whom
//! nobody knows, so that the time of a refusal does not say which names there are.

use argon2::password_hash::PasswordHasher;
use argon2::password_hash::phc::{Output, PasswordHash};
use argon2::{Algorithm, Argon2, Block, Params, Version};
use std::sync::{Mutex, PoisonError};

/// Fewest characters of a password.
const SHORTEST: usize = 8;
/// Most bytes of a password: what is longer is not hashed.
const LONGEST: usize = 1024;
/// Hash of a password that nobody has, computed with the same parameters: its salt and output were drawn.
const OF_NOBODY: &str =
    "$argon2id$v=19$m=19456,t=2,p=1$cm9ad2lJYkpyb1pvVGx4Zw$3bTq2pY3zWmVw0bN6zXk1o0F7lqv3mY1b5m2yqRr0uE";

/// Why a password cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PasswordError {
    /// It has too few characters.
    #[error("the password has fewer than {SHORTEST} characters")]
    Short,
    /// It has too many bytes.
    #[error("the password has more than {LONGEST} bytes")]
    Long,
    /// It is easily guessed.
    #[error("the password is easily guessed: it is the user's name, or one character again and again")]
    Guessed,
    /// It could not be hashed.
    #[error("the password could not be hashed: {0}")]
    Hash(String),
}

/// The hash of a new password of user `name`, as a PHC string.
///
/// # Errors
/// [`PasswordError`] where it is too weak or too long.
pub fn hash_password(name: &str, password: &str) -> Result<String, PasswordError> {
    if password.chars().count() < SHORTEST {
        return Err(PasswordError::Short);
    }
    if password.len() > LONGEST {
        return Err(PasswordError::Long);
    }
    let first = password.chars().next();
    if password.eq_ignore_ascii_case(name) || password.chars().all(|c| Some(c) == first) {
        return Err(PasswordError::Guessed);
    }
    let hash = Argon2::default().hash_password(password.as_bytes());
    hash.map(|hash| hash.to_string()).map_err(|error| PasswordError::Hash(error.to_string()))
}

/// Compares passwords with their hashes. The memory that this takes is kept for the next time: an allocator that gets and gives
/// back 19 MiB on every thread keeps as much for each of them.
#[derive(Debug, Default)]
pub(super) struct Verifier {
    memory: Mutex<Vec<Vec<Block>>>,
}

impl Verifier {
    /// Whether `password` is the one of `hash`; where there is no hash it is not, after the same work.
    pub(super) fn is_right(&self, hash: Option<&str>, password: &str) -> bool {
        if password.len() > LONGEST {
            return false;
        }
        let known =
            hash.and_then(|hash| PasswordHash::new(hash).ok()).filter(|hash| hash.algorithm.as_str() == "argon2id");
        let is_known = known.is_some();
        let Some(compared) = known.or_else(|| PasswordHash::new(OF_NOBODY).ok()) else { return false };
        let Some(computed) = self.compute(&compared, password) else { return false };
        // Two outputs are compared in constant time.
        let is_right = compared.hash.is_some_and(|expected| expected == computed);
        is_right && is_known
    }

    /// The hash of `password` with the salt and parameters of `like`.
    fn compute(&self, like: &PasswordHash, password: &str) -> Option<Output> {
        let parameters = Params::try_from(like).ok()?;
        let (salt, length) = (like.salt?, like.hash?.len());
        let blocks = parameters.block_count();
        let kept = self.memory.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut memory = kept.unwrap_or_default();
        memory.resize(blocks, Block::new());
        let mut computed = vec![0; length];
        let argon2 = Argon2::new(Algorithm::Argon2id, Version::V0x13, parameters);
        let done = argon2.hash_password_into_with_memory(password.as_bytes(), &salt, &mut computed, &mut memory[..]);
        self.memory.lock().unwrap_or_else(PoisonError::into_inner).push(memory);
        done.ok()?;
        Output::new(&computed).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    fn is_right(hash: Option<&str>, password: &str) -> bool {
        Verifier::default().is_right(hash, password)
    }

    #[test]
    fn memory_is_kept_and_what_the_library_says_is_said() {
        use argon2::password_hash::PasswordVerifier;
        let verifier = Verifier::default();
        let hash = hash_password("anna", "correct horse").expect("hashed");
        let parsed = PasswordHash::new(&hash).expect("can be read");
        for password in ["correct horse", "wrong horse", "correct horse"] {
            let expected = Argon2::default().verify_password(password.as_bytes(), &parsed).is_ok();
            assert_eq!(verifier.is_right(Some(&hash), password), expected);
            assert!(!verifier.is_right(None, password));
        }
        let kept = verifier.memory.lock().expect("whole");
        assert_eq!(kept.iter().map(Vec::len).collect::<Vec<_>>(), [19 * 1024]);
    }

    #[test]
    fn a_password_is_told_from_others_and_hashed_with_a_salt() {
        let hash = hash_password("anna", "correct horse").expect("hashed");
        assert!(hash.starts_with("$argon2id$v=19$m=19456,t=2,p=1$"), "{hash}");
        assert_ne!(hash, hash_password("anna", "correct horse").expect("hashed"));
        assert!(is_right(Some(&hash), "correct horse"));
        for wrong in ["correct horsf", "", "Correct horse", "correct horse "] {
            assert!(!is_right(Some(&hash), wrong), "{wrong}");
        }
        // A user who was removed has an empty hash.
        let other = hash.replacen("argon2id", "argon2i", 1);
        for hash in [None, Some(""), Some("correct horse"), Some(&other)] {
            assert!(!is_right(hash, "correct horse"));
        }
        assert!(!is_right(Some(&hash), &"x".repeat(LONGEST + 1)));
    }

    #[test]
    fn weak_passwords_are_refused_with_the_reason() {
        assert_eq!(hash_password("anna", "seven77"), Err(PasswordError::Short));
        assert_eq!(hash_password("anna", &"xy".repeat(LONGEST)), Err(PasswordError::Long));
        assert_eq!(hash_password("annabella", "AnnaBella"), Err(PasswordError::Guessed));
        assert_eq!(hash_password("anna", "oooooooo"), Err(PasswordError::Guessed));
        assert!(hash_password("anna", "äöüß€äöü").is_ok(), "characters are counted, not bytes");
    }

    #[test]
    fn an_unknown_user_costs_the_same_work() {
        let nobody = PasswordHash::new(OF_NOBODY).expect("can be read");
        let of_nobody = Params::try_from(&nobody).expect("parameters");
        let parameters = |p: &Params| (p.m_cost(), p.t_cost(), p.p_cost());
        assert_eq!(parameters(&of_nobody), parameters(&Params::default()));
        assert!(nobody.salt.is_some_and(|salt| salt.len() == 16) && nobody.hash.is_some_and(|hash| hash.len() == 32));
        let hash = hash_password("anna", "correct horse").expect("hashed");
        let verifier = Verifier::default();
        let quickest = |hash: Option<&str>| {
            let once = |_| {
                let begun = Instant::now();
                assert!(!verifier.is_right(hash, "wrong"));
                begun.elapsed()
            };
            (0..5).map(once).min().unwrap_or(Duration::ZERO)
        };
        // A machine that is busy must not fail this, one that skips the work must: it is a thousand times quicker.
        let ratio = quickest(None).as_secs_f64() / quickest(Some(&hash)).as_secs_f64();
        assert!((0.2..5.0).contains(&ratio), "{ratio}");
    }
}
