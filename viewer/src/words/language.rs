//! The languages there are, which one is spoken, and how a person chooses another.

use super::words;
use std::collections::BTreeMap;
use std::sync::LazyLock;

static LANGUAGES: LazyLock<BTreeMap<String, String>> =
    LazyLock::new(|| serde_json::from_str(include_str!("../../../www/messages/languages.json")).unwrap_or_default());

/// The languages there are, by their codes: what each calls itself.
pub fn languages() -> &'static BTreeMap<String, String> {
    &LANGUAGES
}

/// Code of the language that is spoken.
pub fn language() -> &'static str {
    &words().language
}

#[cfg(target_arch = "wasm32")]
mod browser {
    use super::super::{WORDS, Words, words};
    use super::language;
    use js_sys::{Object, Reflect};
    use wasm_bindgen::prelude::*;
    use web_sys::{Storage, UrlSearchParams, Window};

    /// Where `www/messages.js` looks for the person's choice.
    const LANGUAGE_KEY: &str = "semascan.language";

    /// Speaks another language than English from here on. Before the viewer or one of its workers starts; later it is too late.
    ///
    /// * `language`: its code, such as `de`.
    /// * `file`: its file, `messages/de.json`.
    ///
    /// # Errors
    /// If the file is broken; then the page stays English.
    #[wasm_bindgen]
    pub fn speak(language: &str, file: &str) -> Result<(), JsValue> {
        let words = Words::translated(language, file).map_err(|error| JsValue::from(error.to_string()))?;
        // Who came too late speaks as before.
        let _ = WORDS.set(words);
        Ok(())
    }

    /// Adds the language to what a worker is started with: it is a program of its own and speaks English else.
    ///
    /// # Errors
    /// Those of a page that is no page.
    pub fn hand_over(start: &Object) -> Result<(), JsValue> {
        if !words().file.is_empty() {
            Reflect::set(start, &"language".into(), &language().into())?;
            Reflect::set(start, &"messages".into(), &words().file.as_str().into())?;
        }
        Ok(())
    }

    /// Keeps the person's choice and loads the page again in that language.
    ///
    /// # Errors
    /// Those of a page that is being left anyway.
    pub fn choose(window: &Window, language: &str) -> Result<(), JsValue> {
        let storage: Option<Storage> = window.local_storage().ok().flatten();
        let is_kept = storage.is_some_and(|storage| storage.set_item(LANGUAGE_KEY, language).is_ok());
        let location = window.location();
        let query = UrlSearchParams::new_with_str(&location.search()?)?;
        // What the address asks for counts more than what was chosen; where nothing is kept it has to ask.
        match (query.has("language"), is_kept) {
            (false, true) => location.reload(),
            (_, true) => {
                query.delete("language");
                location.set_search(&query.to_string().as_string().unwrap_or_default())
            }
            (_, false) => {
                query.set("language", language);
                location.set_search(&query.to_string().as_string().unwrap_or_default())
            }
        }
    }
}

#[cfg(target_arch = "wasm32")]
pub use browser::{choose, hand_over, speak};
