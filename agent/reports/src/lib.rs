//! What an inspection found, for people and for quality systems.
//!
//! | file | what |
//! |---|---|
//! | `pictures.rs` | the model from fixed views, each finding from its best direction |
//! | `photograph.rs` | the part of a view's picture that shows a finding, with its outline |
//! | `figure.rs` | figures with their uncertainty, as they are printed |
//! | `described.rs` | findings, lines of verdicts and stages in words |
//! | `html/` | `report.html` |
//! | `pdf/` | the same as a PDF file, with the feature `pdf` |
//! | `carried.rs` | photographs that an earlier report of the same model holds |
//! | `characteristics.rs` | what quality systems call characteristics: name, unit, value, limit |
//! | `tables.rs` | tables of findings, components and measurements (RFC 4180) |
//! | `dfq.rs` | Q-DAS ASCII transfer format |
//! | `qif.rs` | QIF 3.0 results |
//!
//! The record, `inspection.json`, is the whole; everything here is made of it, of the mesh and of the views' pictures.

mod calibration;
mod carried;
mod characteristics;
mod described;
mod dfq;
mod figure;
#[cfg(test)]
mod fixtures;
#[cfg(test)]
mod foreign;
mod html;
#[cfg(feature = "pdf")]
mod pdf;
mod photograph;
mod pictures;
mod qif;
mod tables;

pub use calibration::{
    CalibrationReport, CameraFigures, ShownCapture, ShownPicture, VerifiedCapture, calibration_html,
};
pub use carried::carried_photographs;
pub use dfq::dfq;
pub use html::html;
#[cfg(feature = "pdf")]
pub use pdf::pdf;
pub use photograph::{Photograph, ProjectedOutline, ViewPicture, photograph};
pub use pictures::{FIXED_VIEWS, FindingPicture, ModelPicture, Pictures};
pub use qif::qif;
pub use tables::{components_csv, findings_csv, measurements_csv};

use semascan_model::Taxonomy;
use semascan_model::finding::{Finding, FindingId, FindingView};
use semascan_model::record::InspectionRecord;
use semascan_model::review::{ReviewEntry, ReviewedState};
use std::collections::BTreeMap;

/// Findings that have pictures in a report; of more the largest.
pub const MOST_PICTURED: usize = 24;
/// Photographs of a finding.
pub const PHOTOGRAPHS: usize = 2;
/// Least share of its area that a further view of a finding saw, weighted by the cosine of incidence, as a part of the best one's.
const LEAST_WORTH: f64 = 0.2;
/// JPEG quality of photographs.
const PHOTOGRAPH_QUALITY: u8 = 88;

/// Why a report cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A table could not be written.
    #[error("CSV: {0}")]
    Csv(#[from] ::csv::Error),
    /// XML could not be written.
    #[error("QIF: {0}")]
    Xml(#[from] std::io::Error),
    /// A report could not be typeset.
    #[cfg(feature = "pdf")]
    #[error("PDF: {0}")]
    Pdf(String),
    /// There is nothing that the format could hold.
    #[error("{format}: {reason}")]
    Nothing {
        /// The format.
        format: &'static str,
        /// Why.
        reason: String,
    },
}

/// Photographs of findings, the best view first.
#[derive(Clone, Debug, Default)]
pub struct Photographs {
    /// By finding.
    pub of: BTreeMap<FindingId, Vec<Photograph>>,
    /// Why there are none, or not all.
    pub missing: Option<String>,
}

/// What people decided about an inspection after it was made.
#[derive(Clone, Debug)]
pub struct Reviewed {
    /// The entries about it in the log of reviews, in their order.
    pub entries: Vec<ReviewEntry>,
    /// What they come to.
    pub state: ReviewedState,
    /// What was found when the whole log was checked.
    pub audit: Audit,
}

/// Whether a log of reviews is what was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Audit {
    /// Every entry is.
    Good {
        /// Entries of the log, also of other inspections.
        entries: u64,
        /// Hash of the last one, hexadecimal.
        head: String,
    },
    /// An entry is not.
    Broken {
        /// Its place in the log.
        sequence: u64,
        /// What is wrong with it.
        reason: String,
    },
}

/// Everything that a report is made of.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// The record.
    pub record: &'a InspectionRecord,
    /// The classes, for their colours.
    pub taxonomy: &'a Taxonomy,
    /// Drawn pictures.
    pub pictures: &'a Pictures,
    /// Photographs.
    pub photographs: &'a Photographs,
    /// What people decided; `None` where no log of reviews is kept.
    pub reviewed: Option<&'a Reviewed>,
}

/// The findings of a record.
pub fn findings(record: &InspectionRecord) -> &[Finding] {
    record.findings.as_ref().map_or(&[], |findings| &findings.list)
}

/// The findings that get pictures: those that have a place, the largest first, [`MOST_PICTURED`] of them.
pub fn pictured(record: &InspectionRecord) -> Vec<FindingId> {
    let mut placed: Vec<&Finding> = findings(record).iter().filter(|f| f.region.is_some()).collect();
    let area = |finding: &Finding| finding.area().map_or(0.0, |area| area.value);
    placed.sort_by(|a, b| area(b).total_cmp(&area(a)));
    placed.into_iter().take(MOST_PICTURED).map(|finding| finding.id).collect()
}

/// The views that photographs of a finding are taken from, the best first: those that saw much less of it show nothing.
pub fn photographed_views(finding: &Finding) -> &[FindingView] {
    let views = finding.region.as_ref().map_or(&[][..], |region| &region.views);
    let worth = |view: &FindingView| view.share * view.cosine;
    let least = views.first().map_or(0.0, worth) * LEAST_WORTH;
    let good = views.iter().take(PHOTOGRAPHS).take_while(|view| worth(view) >= least).count();
    &views[..good]
}

/// Takes the photographs of the findings that get pictures, view by view: `pictures` gives those of a view by its place in
/// the capture order, or says why it cannot.
pub fn take_photographs<'a>(
    record: &InspectionRecord,
    mut pictures: impl FnMut(u32) -> Result<ViewPicture<'a>, String>,
) -> Photographs {
    let pictured = pictured(record);
    // Each view is asked for once: it may have to be unpacked, or read.
    let mut wanted: BTreeMap<u32, Vec<(&Finding, &FindingView, usize)>> = BTreeMap::new();
    for finding in findings(record).iter().filter(|finding| pictured.contains(&finding.id)) {
        for (rank, view) in photographed_views(finding).iter().enumerate() {
            wanted.entry(view.view).or_default().push((finding, view, rank));
        }
    }
    let tolerance = (2.0 * record.voxel.unwrap_or(0.0)).max(1e-3);
    let mut taken: BTreeMap<FindingId, Vec<(usize, Photograph)>> = BTreeMap::new();
    let mut missing = Vec::new();
    for (index, shots) in wanted {
        let picture = match pictures(index) {
            Ok(picture) => picture,
            Err(reason) => {
                missing.push(format!("view {index}: {reason}"));
                continue;
            }
        };
        for (finding, view, rank) in shots {
            let outlines = finding.region.as_ref().map_or(&[][..], |region| &region.outlines);
            match photograph(&picture, view, outlines, tolerance, PHOTOGRAPH_QUALITY) {
                Some(photograph) => taken.entry(finding.id).or_default().push((rank, photograph)),
                None => missing.push(format!("view {index}: its picture does not hold the place of a finding")),
            }
        }
    }
    let of = taken.into_iter().map(|(id, mut list)| {
        list.sort_by_key(|(rank, _)| *rank);
        (id, list.into_iter().map(|(_, photograph)| photograph).collect())
    });
    missing.dedup();
    Photographs { of: of.collect(), missing: (!missing.is_empty()).then(|| missing.join("; ")) }
}
