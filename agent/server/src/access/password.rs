//! Passwords: Argon2id with the parameters that OWASP recommends (19 MiB, two passes), and the same work for a user whom
//! nobody knows, so that the time of a refusal does not say which names there are.

use argon2::Argon2;
use argon2::password_hash::phc::PasswordHash;
use argon2::password_hash::{PasswordHasher, PasswordVerifier};

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

/// Whether `password` is the one of `hash`; where there is no hash it is not, after the same work.
pub(super) fn is_right(hash: Option<&str>, password: &str) -> bool {
    if password.len() > LONGEST {
        return false;
    }
    let known = hash.and_then(|hash| PasswordHash::new(hash).ok());
    let is_known = known.is_some();
    let Some(compared) = known.or_else(|| PasswordHash::new(OF_NOBODY).ok()) else { return false };
    // Compares in constant time.
    let is_right = Argon2::default().verify_password(password.as_bytes(), &compared).is_ok();
    is_right && is_known
}

#[cfg(test)]
mod tests {
    use super::*;
    use argon2::Params;
    use std::time::{Duration, Instant};

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
        for hash in [None, Some(""), Some("correct horse")] {
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
        let quickest = |hash: Option<&str>| {
            let once = |_| {
                let begun = Instant::now();
                assert!(!is_right(hash, "wrong"));
                begun.elapsed()
            };
            (0..5).map(once).min().unwrap_or(Duration::ZERO)
        };
        // A machine that is busy must not fail this, one that skips the work must: it is a thousand times quicker.
        let ratio = quickest(None).as_secs_f64() / quickest(Some(&hash)).as_secs_f64();
        assert!((0.2..5.0).contains(&ratio), "{ratio}");
    }
}
