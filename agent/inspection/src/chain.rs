//! Entries of append-only logs as bytes, and the hashes that chain them: the log of reviews and that of accounts.
//!
//! An entry is written as canonical JSON: keys in the order of their bytes, no white space, numbers with the fewest digits that
//! read back as the same number. Its hash is SHA-256 over the hash of the entry before it (64 hexadecimal digits; zeros in front
//! of the first) and this text. So an entry that is changed, moved, added or left out breaks the chain from there on. What a
//! chain cannot show by itself is that its last entries are missing: who notes the last hash elsewhere can tell that, too.

use semascan_model::account_log::AccountEntry;
use semascan_model::review::ReviewEntry;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use sha2::{Digest, Sha256};

/// The hash in front of the first entry.
pub const FIRST: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// `value` as canonical JSON.
///
/// # Errors
/// The error of serde where it is no plain data.
pub fn canonical(value: &impl Serialize) -> serde_json::Result<String> {
    let mut text = String::new();
    write(&serde_json::to_value(value)?, &mut text);
    Ok(text)
}

fn write(value: &Value, text: &mut String) {
    match value {
        Value::Object(map) => {
            let mut entries: Vec<_> = map.iter().collect();
            entries.sort_by(|a, b| a.0.as_bytes().cmp(b.0.as_bytes()));
            text.push('{');
            for (place, (key, value)) in entries.into_iter().enumerate() {
                if place > 0 {
                    text.push(',');
                }
                text.push_str(&Value::from(key.as_str()).to_string());
                text.push(':');
                write(value, text);
            }
            text.push('}');
        }
        Value::Array(list) => {
            text.push('[');
            for (place, value) in list.iter().enumerate() {
                if place > 0 {
                    text.push(',');
                }
                write(value, text);
            }
            text.push(']');
        }
        plain => text.push_str(&plain.to_string()),
    }
}

/// The hash of an entry with the text `entry` that follows one with the hash `previous`, hexadecimal.
pub fn hash(previous: &str, entry: &str) -> String {
    let digest = Sha256::new().chain_update(previous.as_bytes()).chain_update(entry.as_bytes()).finalize();
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// What a log has entries of.
pub trait Chained: Serialize + DeserializeOwned {
    /// Its place in the log, from 1 without gaps.
    fn sequence(&self) -> u64;

    /// What its row says of it beside its place, so that it is found; the same stands in its text.
    fn keys(&self) -> Vec<String>;
}

impl Chained for ReviewEntry {
    fn sequence(&self) -> u64 {
        self.sequence
    }

    /// The name of the review, and the inspection.
    fn keys(&self) -> Vec<String> {
        vec![self.review.id.to_string(), self.inspection.to_string()]
    }
}

impl Chained for AccountEntry {
    fn sequence(&self) -> u64 {
        self.sequence
    }

    fn keys(&self) -> Vec<String> {
        Vec::new()
    }
}

/// An entry as its log keeps it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Link {
    /// Its place.
    pub sequence: u64,
    /// What its row says of it beside that, as [`Chained::keys`].
    pub keys: Vec<String>,
    /// Its text.
    pub entry: String,
    /// The hash of the one before it.
    pub previous: String,
    /// Its hash.
    pub hash: String,
}

/// The entry of `link`, which should follow the `place - 1`-th entry with the hash `previous`.
///
/// # Errors
/// What is wrong with it, in words.
pub fn read<T: Chained>(link: &Link, place: u64, previous: &str) -> Result<T, String> {
    if link.sequence != place {
        return Err(format!("stands where entry {place} is expected: entries are missing or were moved"));
    }
    if link.previous != previous {
        return Err("does not follow the entry before it: that one, or the link to it, was changed".to_owned());
    }
    if link.hash != hash(&link.previous, &link.entry) {
        return Err("was changed: it does not have its hash".to_owned());
    }
    let entry: T = serde_json::from_str(&link.entry).map_err(|error| format!("cannot be read: {error}"))?;
    if entry.sequence() == link.sequence && entry.keys() == link.keys {
        Ok(entry)
    } else {
        Err("is listed under another place or name than it says".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn canonical_text_does_not_depend_on_the_order_of_keys_and_reads_back() {
        let value = json!({"b": [1, 0.1, 1e-3, -0.0, "ü\"\n"], "a": {"z": null, "é": true, "A": 1.5e300}});
        let text = canonical(&value).expect("plain data");
        assert_eq!(text, r#"{"a":{"A":1.5e+300,"z":null,"é":true},"b":[1,0.1,0.001,-0.0,"ü\"\n"]}"#);
        assert_eq!(serde_json::from_str::<Value>(&text).expect("JSON"), value);
        let again = canonical(&serde_json::from_str::<Value>(&text).expect("JSON")).expect("plain data");
        assert_eq!(again, text);
    }

    #[test]
    fn a_hash_is_that_of_the_hash_before_and_the_text() {
        // printf '%064d{}' 0 | sha256sum
        assert_eq!(hash(FIRST, "{}"), "5508d2b710e64bc470079e1b211d9c58e21011e59d0559e422345dc19d659a75");
        assert_ne!(hash(&hash(FIRST, "{}"), "{}"), hash(FIRST, "{}"));
    }
}
