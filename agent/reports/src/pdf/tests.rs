//! The PDF of a small record.

use super::*;
use crate::fixtures::{record, taxonomy, worn_plate};
use crate::{Photographs, Pictures, findings, pictured};
use semascan_model::record::InspectionRecord;
use serde_json::Value;
use typst::layout::{Frame, FrameItem};

/// Calls `made` with the report of `record`, which has drawn pictures and one photograph of its own.
fn with_report<T>(record: &InspectionRecord, made: impl FnOnce(&Report<'_>) -> T) -> T {
    let taxonomy = taxonomy();
    let pictures = Pictures::draw(&worn_plate(), &taxonomy, 1e-3, findings(record), &pictured(record));
    let photographs = Photographs { missing: Some("none were kept".into()), ..Photographs::default() };
    made(&Report { record, taxonomy: &taxonomy, pictures: &pictures, photographs: &photographs, reviewed: None })
}

fn made() -> Timestamp {
    Timestamp::from_second(1_790_000_100).expect("in range")
}

/// Letters and digits of a text: how lines break and spaces run is the typesetter's.
fn letters(text: &str) -> String {
    text.chars().filter(|c| c.is_alphanumeric()).collect()
}

/// The text of an element of the page and of all below it.
fn text_of(element: &Value, text: &mut String) {
    match element {
        Value::String(piece) => text.push_str(piece),
        element => {
            element["children"].as_array().into_iter().flatten().for_each(|child| text_of(child, text));
            text.push(' ');
        }
    }
}

/// The text that a page of the document shows.
fn shown(frame: &Frame, text: &mut String) {
    for (_, item) in frame.items() {
        match item {
            FrameItem::Group(group) => shown(&group.frame, text),
            FrameItem::Text(piece) => text.push_str(&piece.text),
            _ => {}
        }
    }
}

#[test]
fn every_word_of_the_page_is_typeset_and_no_name_becomes_markup() {
    let mut record = record();
    record.part = "motor #eval(\"1\") *7* <script>&amp; $x$".into();
    record.software.name = "#read(\"/etc/passwd\")".into();
    let html = with_report(&record, html);
    let page = Page::read(&html).expect("a page");
    // The page holds what a browser shows, but for what is in pictures.
    let mut said = String::new();
    text_of(&page.body, &mut said);
    for words in
        ["motor #eval(\"1\") *7* <script>&amp; $x$", "area 400 +- 20 mm2 is more than 300 mm2", "28.0 ± 1.0 mm"]
    {
        assert!(said.contains(words), "{words} in {said}");
    }
    assert!(
        page.pictures.len() > 7,
        "the model, the finding, and the parts of its uncertainty: {}",
        page.pictures.len()
    );
    let world = ReportWorld::new(page, "title", "author").expect("a world");
    let compiled = typst::compile::<PagedDocument>(&world);
    let document = compiled.output.expect("typeset");
    let mut typeset = String::new();
    document.pages().iter().for_each(|page| shown(&page.frame, &mut typeset));
    // Tables and columns are read in another order: the same words, not the same sequence.
    let typeset = letters(&typeset);
    for word in said.split_whitespace().map(letters).filter(|word| !word.is_empty()) {
        assert!(typeset.contains(&word), "{word:?} is on the page and not in the document");
    }
}

#[test]
fn it_is_an_archived_document_and_the_same_one_each_time() {
    let record = record();
    let once = with_report(&record, |report| pdf(report, made())).expect("made");
    assert!(once.starts_with(b"%PDF-1."));
    let text = String::from_utf8_lossy(&once);
    assert!(text.contains("<pdfaid:part>2</pdfaid:part>") && text.contains("<pdfuaid:part>1</pdfuaid:part>"), "{text}");
    assert!(text.contains("Inspection report: starter motor 7"));
    assert_eq!(with_report(&record, |report| pdf(report, made())).expect("made"), once);
}

#[test]
fn a_link_to_a_finding_without_a_section_is_plain_text() {
    let html =
        "<body><p><a href=\"#finding-1\">one</a> <a href=\"#finding-9\">nine</a></p><p id=\"finding-1\">x</p></body>";
    let page = Page::read(html).expect("a page");
    let links = &page.body["children"][0]["children"];
    assert_eq!((links[0]["to"].as_str(), links[2]["to"].as_str()), (Some("finding-1"), None));
}

#[test]
fn what_is_no_page_is_refused() {
    for wrong in
        ["", "<html></html>", "<body><p>cut", "<body><div class=\"frame\"><img src=\"http://x/y.jpg\"></div></body>"]
    {
        assert!(matches!(Page::read(wrong), Err(ReportError::Pdf(_))), "{wrong}");
    }
}
