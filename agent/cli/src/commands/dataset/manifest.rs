//! `manifest.json`: what a data set was made of, what was left out, and why.

use super::Format;
use super::input::{LeftOut, LogRecord};
use semascan_labelling::{Contradiction, PixelCounts, Selection, WithoutEffect};
use semascan_model::InspectionId;
use semascan_model::record::SoftwareRecord;
use semascan_model::review::NetworkVersion;
use serde::Serialize;

/// Version of the file's layout.
pub(super) const SCHEMA: u32 = 1;

/// The file.
#[derive(Debug, Serialize)]
pub(super) struct Manifest {
    pub(super) schema: u32,
    /// By which the folder is known as a data set.
    pub(super) kind: &'static str,
    pub(super) software: SoftwareRecord,
    pub(super) format: Format,
    pub(super) include_uncorrected: bool,
    pub(super) selection: Selection,
    /// Whether pixels along silhouettes are labelled by the picture, too.
    pub(super) gaps_closed: bool,
    /// Names of the component classes, `none` first.
    pub(super) classes: Vec<String>,
    /// Names of the defect classes, `none` first.
    pub(super) defects: Vec<String>,
    /// Label of the pixels of which nothing is known.
    pub(super) ignore: u16,
    /// Views in all.
    pub(super) views: u64,
    pub(super) inspections: Vec<InspectionEntry>,
    /// Inspections that are not in it.
    pub(super) left_out: Vec<LeftOut>,
}

/// An inspection in the data set.
#[derive(Debug, Serialize)]
pub(super) struct InspectionEntry {
    pub(super) inspection: InspectionId,
    /// What was named on the command line.
    pub(super) from: String,
    pub(super) part: String,
    /// The number that its folder or its pictures begin with.
    pub(super) scene: String,
    /// Generation of the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) model: Option<String>,
    /// What made the model.
    pub(super) inspected_with: SoftwareRecord,
    /// The networks that labelled its views.
    pub(super) networks: Vec<NetworkVersion>,
    /// The log of reviews; absent where the inspection lies in no data folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) log: Option<LogRecord>,
    /// Entries about this inspection, and the last of them.
    pub(super) entries: u64,
    pub(super) last_entry: u64,
    /// Entries that labelled surface.
    pub(super) applied: u64,
    /// Those that were made on another generation of the model.
    pub(super) of_other_model: u64,
    /// Vertices, and those that people gave another class.
    pub(super) vertices: u64,
    pub(super) changed: u64,
    pub(super) contradictions: Vec<Contradiction>,
    pub(super) without_effect: Vec<WithoutEffect>,
    /// Views in the data set.
    pub(super) views: u64,
    /// What became of their pixels before edges were refined.
    pub(super) pixels: PixelCounts,
    /// Pixels whose component is left open.
    pub(super) open: u64,
    /// Views that are not in it.
    pub(super) left_out: Vec<ViewLeftOut>,
}

/// A view that is not in the data set.
#[derive(Debug, Serialize)]
pub(super) struct ViewLeftOut {
    pub(super) view: u32,
    pub(super) reason: String,
}
