//! An entry of the log of reviews, any text: it may be refused, it may not panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_model::review::ReviewEntry;

fuzz_target!(|text: &str| {
    if let Ok(entry) = serde_json::from_str::<ReviewEntry>(text) {
        let again = serde_json::to_string(&entry).expect("an entry is plain data");
        assert_eq!(serde_json::from_str::<ReviewEntry>(&again).ok(), Some(entry));
    }
});
