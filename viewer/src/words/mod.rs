//! The page's texts in the language that was chosen, looked up by keys.
//!
//! A language is one flat file, `www/messages/CODE.json`: key to text with `{name}` placeholders; where a count decides
//! between singular and plural, to `{"one": .., "other": ..}`, chosen by the placeholder `count`. English is compiled in, so
//! that the page waits for nothing and works without a server; another language is handed over by the page's script before
//! the viewer starts (`speak`), and what it lacks stays English.
//!
//! The texts are one constant of the program, set once before anything is shown: the language of a page changes only by
//! loading it again, and so whoever needs a text looks it up by `t!` and is handed nothing.
//!
//! | file | what |
//! |---|---|
//! | `mod.rs` | texts by keys |
//! | `numbers` | numbers with the language's decimal separator |
//! | `language` | the languages there are, which one is spoken, how it is chosen |
//! | `tests` | every key that is used exists, in every language, with the same placeholders |

mod language;
mod numbers;
#[cfg(test)]
mod tests;

#[cfg(target_arch = "wasm32")]
pub use language::{choose, hand_over, speak};
pub use language::{language, languages};
pub use numbers::{decimal, localized, signed};

use serde::Deserialize;
use std::collections::HashMap;
use std::fmt::{Display, Write};
use std::sync::OnceLock;

const ENGLISH: &str = include_str!("../../../www/messages/en.json");

static WORDS: OnceLock<Words> = OnceLock::new();

/// The texts of a language.
#[derive(Debug, Default)]
struct Words {
    /// Its code, such as `de`.
    language: String,
    /// Its file, for the workers, which are programs of their own; empty for English.
    #[cfg_attr(not(target_arch = "wasm32"), allow(dead_code))] // There are no workers outside of a browser.
    file: String,
    messages: HashMap<String, Message>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Message {
    Text(String),
    Counted { one: String, other: String },
}

impl Words {
    fn english() -> Self {
        // That the file is whole is tested; a broken one would show keys in the place of texts.
        let messages = serde_json::from_str(ENGLISH).unwrap_or_default();
        Self { language: "en".to_owned(), file: String::new(), messages }
    }

    /// English, with the texts of `file` over it.
    #[cfg(any(test, target_arch = "wasm32"))]
    fn translated(language: &str, file: &str) -> Result<Self, serde_json::Error> {
        let mut words = Self::english();
        words.messages.extend(serde_json::from_str::<HashMap<String, Message>>(file)?);
        Ok(Self { language: language.to_owned(), file: file.to_owned(), ..words })
    }

    fn text<'a>(&'a self, key: &'a str) -> &'a str {
        match self.messages.get(key) {
            Some(Message::Text(text) | Message::Counted { other: text, .. }) => text,
            None => key,
        }
    }

    fn filled(&self, key: &str, values: &[(&str, &dyn Display)]) -> String {
        let value = |name: &str| values.iter().find(|(own, _)| *own == name).map(|(_, value)| value);
        let mut rest = match self.messages.get(key) {
            Some(Message::Counted { one, .. }) if value("count").is_some_and(|count| count.to_string() == "1") => one,
            _ => self.text(key),
        };
        let mut text = String::with_capacity(rest.len());
        while let Some((before, (name, after))) =
            rest.split_once('{').and_then(|(before, after)| Some((before, after.split_once('}')?)))
        {
            text.push_str(before);
            if let Some(value) = value(name) {
                // Writing to a string does not fail.
                let _ = write!(text, "{value}");
            }
            rest = after;
        }
        text + rest
    }
}

fn words() -> &'static Words {
    WORDS.get_or_init(Words::english)
}

/// The text of a key without placeholders. Write `t!`.
pub fn text(key: &'static str) -> &'static str {
    words().text(key)
}

/// The text of a key with its placeholders filled. Write `t!`.
pub fn filled(key: &str, values: &[(&str, &dyn Display)]) -> String {
    words().filled(key, values)
}

/// The text of a key in the chosen language: `t!("measure.panel")` as a `&'static str`; with values for its placeholders
/// as a `String`: `t!("measure.keep", count = loose)`, or `t!("measure.keep", count)` for a variable of that name.
///
/// The key is a literal, so that the tests find the keys that are used.
macro_rules! t {
    (@value $name:ident) => { &$name };
    (@value $name:ident $value:expr) => { &$value };
    ($key:literal) => { $crate::words::text($key) };
    ($key:literal, $($name:ident $(= $value:expr)?),+ $(,)?) => {
        $crate::words::filled($key, &[$((stringify!($name), $crate::words::t!(@value $name $($value)?))),+])
    };
}
pub(crate) use t;
