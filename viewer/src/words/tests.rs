//! Code, pages and languages know the same keys, and a text gets the values that it asks for.

use super::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

type File = BTreeMap<String, Message>;

fn messages(language: &str) -> File {
    let path = pages().join("messages").join(format!("{language}.json"));
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn pages() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../www")
}

fn sources(folder: &Path, ending: &str) -> Vec<(String, String)> {
    let mut list = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if path.is_dir() && name != "dist" {
            list.extend(sources(&path, ending));
        } else if name.ends_with(ending) && !path.ends_with("words/tests.rs") {
            list.push((name, fs::read_to_string(&path).expect("a text")));
        }
    }
    list
}

/// What stands between the quotes after each `before` that is no end of a longer name, and what follows.
fn quoted<'a>(text: &'a str, before: &'a str) -> impl Iterator<Item = (&'a str, &'a str)> {
    let is_whole = |at: usize| !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
    let places = text.match_indices(before).filter(move |(at, _)| is_whole(*at));
    places.filter_map(|(at, _)| text[at + before.len()..].trim_start().strip_prefix('"')?.split_once('"'))
}

fn placeholders(message: &Message) -> BTreeSet<&str> {
    let of = |text| quoted_in_braces(text).collect();
    match message {
        Message::Text(text) => of(text),
        Message::Counted { other, .. } => of(other),
    }
}

fn quoted_in_braces(text: &str) -> impl Iterator<Item = &str> {
    text.split('{').skip(1).filter_map(|rest| Some(rest.split_once('}')?.0))
}

/// Names of the values that a macro is given: `a, b = c(d, e))` gives `a` and `b`.
fn given(arguments: &str) -> BTreeSet<String> {
    let (mut depth, mut whole) = (0, String::new());
    for letter in arguments.chars() {
        match letter {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            _ => {}
        }
        if depth < 0 {
            break;
        }
        // What is nested names nothing.
        whole.push(if depth > 0 { ' ' } else { letter });
    }
    let names = whole.split(',').map(|one| one.split('=').next().unwrap_or_default().trim().to_owned());
    names.filter(|name| !name.is_empty()).collect()
}

/// Keys that pages and their scripts use.
fn keys_of_pages() -> BTreeSet<String> {
    let mut keys = BTreeSet::new();
    for (_, text) in sources(&pages(), ".html") {
        for before in ["data-message=", "data-message-label=", "data-message-title=", "data-message-placeholder="] {
            keys.extend(quoted(&text, before).map(|(key, _)| key.to_owned()));
        }
    }
    for (_, text) in sources(&pages(), ".js") {
        keys.extend(quoted(&text, "t(").map(|(key, _)| key.to_owned()));
    }
    keys
}

#[test]
fn every_key_is_there_and_none_is_left_over() {
    let english = messages("en");
    let mut used = keys_of_pages();
    for (file, text) in sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), ".rs") {
        for (key, rest) in quoted(&text, "t!(") {
            let message = english.get(key).unwrap_or_else(|| panic!("{file}: en.json has no {key}"));
            let wanted: BTreeSet<String> = placeholders(message).into_iter().map(str::to_owned).collect();
            assert_eq!(given(rest), wanted, "{file}: values for {key}");
            used.insert(key.to_owned());
        }
    }
    let there: BTreeSet<String> = english.keys().cloned().collect();
    assert_eq!(used.difference(&there).collect::<Vec<_>>(), Vec::<&String>::new(), "not in en.json");
    assert_eq!(there.difference(&used).collect::<Vec<_>>(), Vec::<&String>::new(), "in en.json, and nothing uses it");
}

#[test]
fn every_language_has_the_same_keys_and_placeholders() {
    let english = messages("en");
    assert!(languages().contains_key("en") && languages().contains_key("de"), "{:?}", languages());
    for language in languages().keys() {
        let file = messages(language);
        assert_eq!(file.keys().collect::<Vec<_>>(), english.keys().collect::<Vec<_>>(), "{language}");
        for (key, message) in &file {
            assert_eq!(placeholders(message), placeholders(&english[key]), "{language}: {key}");
            let (one, other) = match message {
                Message::Text(text) => (text, text),
                Message::Counted { one, other } => (one, other),
            };
            assert!(!one.trim().is_empty() && !other.trim().is_empty(), "{language}: {key} is empty");
            assert_eq!(
                text_edges(other),
                text_edges(english[key].last()),
                "{language}: {key} begins or ends with a space"
            );
        }
    }
}

impl Message {
    fn last(&self) -> &str {
        match self {
            Self::Text(text) | Self::Counted { other: text, .. } => text,
        }
    }
}

/// Pieces of sentences are joined: where one has a space at an end, the other needs it, too.
fn text_edges(text: &str) -> [bool; 2] {
    [text.starts_with(' '), text.ends_with(' ')]
}

#[test]
fn pages_say_in_english_what_the_file_says() {
    let english = messages("en");
    let said = |key: &str| english.get(key).unwrap_or_else(|| panic!("en.json has no {key}")).last().to_owned();
    for (file, text) in sources(&pages(), ".html") {
        for (key, rest) in quoted(&text, "data-message=") {
            let shown = rest.split_once('>').and_then(|(_, rest)| rest.split_once('<')).map_or("", |(text, _)| text);
            assert_eq!(shown, said(key), "{file}: {key}");
        }
        for (attribute, own) in [("label", "aria-label="), ("title", "title="), ("placeholder", "placeholder=")] {
            for tag in text.split('<').filter(|tag| tag.contains(&format!(" data-message-{attribute}="))) {
                let tag = tag.split('>').next().unwrap_or_default();
                let before = format!("data-message-{attribute}=");
                let key = quoted(tag, &before).next().map_or("", |(key, _)| key);
                let shown = quoted(tag, own).next().map_or("", |(text, _)| text);
                assert_eq!(shown, said(key), "{file}: {key}");
            }
        }
    }
}

#[test]
fn another_language_is_spoken_key_by_key() {
    let file = r#"{"common.close":"Zu","measure.keep":{"one":"Eine","other":"{count} davon"},"number.decimal":","}"#;
    let german = Words::translated("de", file).expect("a sound file");
    let count = |count: &str| german.filled("measure.keep", &[("count", &count)]);
    assert_eq!((german.text("common.close"), german.text("common.cancel")), ("Zu", "Cancel"));
    assert_eq!(
        (count("1"), count("0"), count("1\u{202f}000")),
        ("Eine".into(), "0 davon".into(), "1\u{202f}000 davon".into())
    );
    assert_eq!((german.language.as_str(), german.file.as_str()), ("de", file));
    assert!(Words::translated("de", "{").is_err() && Words::translated("de", r#"{"common.close":3}"#).is_err());
}

#[test]
fn english_needs_nobody_to_choose_it() {
    assert_eq!((language(), t!("common.close"), t!("common.class", number = 7)), ("en", "Close", "class 7".to_owned()));
    assert_eq!(
        (decimal(-1.25, 2), signed(1.0f32, 1), decimal(0.5, 0)),
        ("\u{2212}1.25".into(), "+1.0".into(), "0".into())
    );
    assert_eq!(text("no.such.key"), "no.such.key");
}
