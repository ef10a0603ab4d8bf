//! What a calibration's report says and holds.

use super::*;
use semascan_model::calibration::{CALIBRATION_SCHEMA, CalibrationCapture};

fn record() -> CalibrationRecord {
    let capture = CalibrationCapture {
        is_used: true,
        residual_deg: 0.0123,
        residual_mm: 0.0456,
        left_out_deg: Some(0.02),
        left_out_mm: None,
    };
    CalibrationRecord {
        schema: CALIBRATION_SCHEMA,
        made: Some(jiff::Timestamp::UNIX_EPOCH),
        valid_days: Some(90),
        temperature_c: None,
        temperature_range_k: None,
        ee_from_camera: None,
        base_from_tablebase: None,
        captures: vec![capture],
        warnings: Vec::new(),
    }
}

fn report(record: &CalibrationRecord) -> CalibrationReport<'_> {
    let picture = ShownPicture {
        name: "<script>.png".into(),
        jpeg: Some(vec![1, 2, 3]),
        size: (640, 480),
        corners: vec![([100.0, 50.0], [0.1, -0.2])],
        left_out: vec![[5.0, 6.0]],
        sigma: 0.05,
    };
    CalibrationReport {
        name: "captures.json",
        software: "semascan 0",
        record,
        hand_eye_covariance: None,
        turntable_covariance: Some(std::array::from_fn(|k| std::array::from_fn(|l| if k == l { 1e-8 } else { 0.0 }))),
        captures: vec![ShownCapture { number: 3, picture: Some(picture), distance: 0.5, tilt_deg: 20.0 }],
        said: &[],
        camera: None,
        verified: Vec::new(),
        next: vec!["tilt it".into()],
    }
}

#[test]
fn it_needs_nothing_from_outside_and_names_are_escaped() {
    let record = record();
    let page = calibration_html(&report(&record));
    assert!(page.contains("default-src 'none'") && !page.contains("<script") && !page.contains("http://"));
    assert!(page.contains("&lt;script&gt;.png") && page.contains("data:image/jpeg;base64,AQID"));
    // A residual is drawn a hundred times as long: from (100, 50) to (110, 30).
    assert!(page.contains(r#"x2="110.0" y2="30.0""#));
    assert!(page.contains("0.0123") && page.contains("tilt it") && page.contains("1970-01-01"));
}

#[test]
fn the_seal_says_the_worst() {
    let mut record = record();
    assert!(calibration_html(&report(&record)).contains("Not verified yet"));
    let verified = |is_within| vec![VerifiedCapture { number: 0, deg: 0.01, mm: 0.1, is_within }];
    let good = CalibrationReport { verified: verified(true), ..report(&record) };
    assert!(calibration_html(&good).contains("<strong>Verified</strong>"));
    record.warnings.push("few".into());
    let weak = CalibrationReport { verified: verified(true), ..report(&record) };
    assert!(calibration_html(&weak).contains("<strong>Weak</strong>"));
    let bad = CalibrationReport { verified: verified(false), ..report(&record) };
    assert!(calibration_html(&bad).contains("1 of 1 verification captures are beyond the limits"));
}
