//! Large immutable things, named by their content.

use super::PortError;
use std::fmt;
use std::str::FromStr;

/// Names a blob: the SHA-256 digest of its content, so that a blob never changes and damage shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BlobDigest(pub [u8; 32]);

/// What is no digest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("is no SHA-256 digest: 64 hexadecimal digits are expected")]
pub struct InvalidDigest;

impl fmt::Display for BlobDigest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl FromStr for BlobDigest {
    type Err = InvalidDigest;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut digest = [0; 32];
        if text.len() != 64 || !text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b)) {
            return Err(InvalidDigest);
        }
        for (byte, digits) in digest.iter_mut().zip(text.as_bytes().chunks(2)) {
            let digits = std::str::from_utf8(digits).map_err(|_| InvalidDigest)?;
            *byte = u8::from_str_radix(digits, 16).map_err(|_| InvalidDigest)?;
        }
        Ok(Self(digest))
    }
}

/// A store of blobs. A blob is there whole or not at all, and durable once `put` returns.
pub trait Blobs: Send + Sync {
    /// Keeps `content`; keeping it twice is harmless.
    ///
    /// # Errors
    /// [`PortError`] naming the store and the reason.
    fn put(&self, content: &[u8]) -> Result<BlobDigest, PortError>;

    /// The content of a blob, checked against its digest; `None` where there is none.
    ///
    /// # Errors
    /// [`PortError`] naming the blob that cannot be read or is damaged.
    fn get(&self, digest: &BlobDigest) -> Result<Option<Vec<u8>>, PortError>;

    /// Every blob, in the order of the digests.
    ///
    /// # Errors
    /// [`PortError`] naming the store and the reason.
    fn list(&self) -> Result<Vec<BlobDigest>, PortError>;

    /// Removes a blob; one that is not there is no error.
    ///
    /// # Errors
    /// [`PortError`] naming the blob and the reason.
    fn remove(&self, digest: &BlobDigest) -> Result<(), PortError>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_is_written_and_read_back_and_nothing_else_is_one() {
        let digest = BlobDigest(std::array::from_fn(|i| (7 * i) as u8));
        assert_eq!(digest.to_string().parse(), Ok(digest));
        for wrong in ["", "00", &"0".repeat(63), &"G".repeat(64), &"A".repeat(64), &"é".repeat(32)] {
            assert_eq!(wrong.parse::<BlobDigest>(), Err(InvalidDigest), "{wrong}");
        }
    }
}
