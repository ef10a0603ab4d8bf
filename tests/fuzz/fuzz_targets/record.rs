//! `inspection.json`, any text: it may be refused, it may not panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_model::record::InspectionRecord;

fuzz_target!(|text: &str| {
    if let Ok(record) = InspectionRecord::from_json(text) {
        let again = serde_json::to_string(&record).expect("a record is plain data");
        assert!(InspectionRecord::from_json(&again).is_ok());
    }
});
