//! `report.html`: one file with everything in it, for people who decide about a part. It needs no network, runs no script, and
//! prints on A4.
//!
//! | file | what |
//! |---|---|
//! | `style.css` | how it looks on screens and on paper |
//! | `drawings.css` | how its drawings look |
//! | `summary.rs` | what was inspected and what follows |
//! | `verdict.rs` | every criterion with its reason |
//! | `model.rs` | pictures of the model, tables of components and defects |
//! | `findings.rs` | every finding with its pictures and figures |
//! | `measurements.rs` | what people measured |
//! | `uncertainty.rs` | where uncertainties come from |
//! | `reviews.rs` | what people decided, and whether the log of that is whole |
//! | `views.rs` | poses, times, agreement with the pictures |
//! | `left_out.rs` | what was left out, and why |
//! | `provenance.rs` | versions, networks, seeds, settings, files |
//!
//! Text from outside (names of parts, classes, networks, people) goes through [`maud`], which escapes it; a content security
//! policy forbids scripts besides.

mod findings;
mod left_out;
mod measurements;
mod model;
mod provenance;
mod reviews;
mod summary;
mod uncertainty;
mod verdict;
mod views;

use crate::Report;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// How it looks.
pub(crate) const STYLE: &str = concat!(include_str!("style.css"), include_str!("drawings.css"));

/// What a browser may load: pictures and styles that are in the file, and nothing else.
pub(crate) const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'";

/// The report as one HTML file.
pub fn html(report: &Report<'_>) -> String {
    let record = report.record;
    let generation = record.files.as_ref().map(|files| &files.generation);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content=(format!("{} {}", record.software.name, record.software.version));
                @if let Some(generation) = generation {
                    meta name="generation" content=(generation);
                }
                meta name="inspection" content=(record.id);
                title { "Inspection report: " (record.part) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                (summary::summary(report))
                main {
                    (verdict::verdict(report))
                    (reviews::reviews(report))
                    (model::model(report))
                    (findings::findings(report))
                    (measurements::measurements(report))
                    (uncertainty::uncertainty(record))
                    (views::views(record))
                    (left_out::left_out(report))
                    (provenance::provenance(record))
                }
            }
        }
    };
    page.into_string()
}

/// A JPEG in the file itself.
pub(crate) fn data_url(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg))
}

/// A coloured square before the name of a class.
fn swatch(color: [u8; 3]) -> Markup {
    let [r, g, b] = color;
    html! { span.swatch style=(format!("background:#{r:02x}{g:02x}{b:02x}")) {} }
}

/// A cell that is empty says so.
pub(crate) fn or_dash(text: Option<String>) -> Markup {
    html! { @if let Some(text) = text { (text) } @else { span.none { "–" } } }
}

#[cfg(test)]
mod tests;
