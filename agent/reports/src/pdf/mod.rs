//! The report as a PDF file, typeset by [typst](https://typst.app): the page of [`crate::html()`], element by element, so that both
//! say the same. It is PDF/A-2b (ISO 19005-2), which archives keep, and PDF/UA-1 (ISO 14289-1), which screen readers read.
//!
//! | file | what |
//! |---|---|
//! | `page.rs` | the elements of the page as typst reads them |
//! | `report.typ` | how they are typeset |
//! | `world.rs` | what typst may read |

mod page;
mod world;

use crate::{Report, ReportError, html};
use jiff::Timestamp;
use jiff::tz::Offset;
use page::Page;
use typst::diag::SourceDiagnostic;
use typst::foundations::{Datetime, Smart};
use typst_layout::PagedDocument;
use typst_pdf::{PdfOptions, PdfStandard, PdfStandards};
use world::ReportWorld;

/// The report as a PDF file, made at `made`.
///
/// # Errors
/// [`ReportError::Pdf`] if it cannot be typeset.
pub fn pdf(report: &Report<'_>, made: Timestamp) -> Result<Vec<u8>, ReportError> {
    let record = report.record;
    let software = format!("{} {}", record.software.name, record.software.version);
    let title = format!("Inspection report: {}", record.part);
    let world = ReportWorld::new(Page::read(&html(report))?, &title, &software)?;
    let document = typst::compile::<PagedDocument>(&world).output;
    // What typst remembers from one document to the next is of no use for another inspection.
    typst::comemo::evict(0);
    let document = document.map_err(|errors| refused(&errors))?;
    let standards = PdfStandards::new(&[PdfStandard::A_2b, PdfStandard::Ua_1])
        .map_err(|error| ReportError::Pdf(error.message().to_string()))?;
    let options = PdfOptions {
        ident: Smart::Custom(record.id.to_string()),
        creator: Smart::Custom(Some(software)),
        timestamp: timestamp(made),
        standards,
        ..PdfOptions::default()
    };
    typst_pdf::pdf(&document, &options).map_err(|errors| refused(&errors))
}

fn refused(errors: &[SourceDiagnostic]) -> ReportError {
    ReportError::Pdf(errors.iter().map(|error| error.message.to_string()).collect::<Vec<_>>().join("; "))
}

fn timestamp(at: Timestamp) -> Option<typst_pdf::Timestamp> {
    let at = Offset::UTC.to_datetime(at);
    let [month, day, hour, minute, second] =
        [at.month(), at.day(), at.hour(), at.minute(), at.second()].map(|part| u8::try_from(part).unwrap_or_default());
    let datetime = Datetime::from_ymd_hms(at.year().into(), month, day, hour, minute, second)?;
    Some(typst_pdf::Timestamp::new_utc(datetime))
}

#[cfg(test)]
mod tests;
