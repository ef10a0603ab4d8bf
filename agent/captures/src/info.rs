//! What the source of a capture is: the metadata record `semascan` of the file, in front of the first view.

use nalgebra::Point3;
use semascan_inspection::source::{SourceInfo, TrueMesh, Turntable};
use semascan_model::Taxonomy;
use serde::{Deserialize, Serialize};

/// Version of this layout of a capture; a newer one is refused.
pub(crate) const VERSION: u32 = 1;
/// The name of the metadata record, and the key of its only entry.
pub(crate) const INFO: (&str, &str) = ("semascan", "source");

/// What the source of a capture is: [`SourceInfo`] as it is kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaptureInfo {
    /// Version of the layout.
    pub version: u32,
    /// URI or path of the source.
    pub uri: String,
    /// The part, for people.
    pub part: String,
    /// Classes of the labels.
    pub taxonomy: Taxonomy,
    /// Number of views that the source had, if known.
    pub view_count: Option<u32>,
    /// The turntable, if there is one.
    pub turntable: Option<Turntable>,
    /// The measuring volume in the table frame: min and max corner, metres.
    pub volume: Option<[[f64; 3]; 2]>,
    /// Why its views carry no labels.
    pub no_labels: Option<String>,
    /// Seeds and settings.
    pub settings: Vec<(String, String)>,
    /// Whether there is a message with the true surface.
    pub has_truth: bool,
    /// Classes of the true surface, where it has its own.
    pub truth_taxonomy: Option<Taxonomy>,
}

impl CaptureInfo {
    /// What is kept of a source and its truth.
    pub fn new(info: &SourceInfo, truth: Option<&TrueMesh>) -> Self {
        Self {
            version: VERSION,
            uri: info.uri.clone(),
            part: info.part.clone(),
            taxonomy: info.taxonomy.clone(),
            view_count: info.view_count,
            turntable: info.turntable,
            volume: info.volume.map(|(low, high)| [low.into(), high.into()]),
            no_labels: info.no_labels.clone(),
            settings: info.settings.clone(),
            has_truth: truth.is_some(),
            truth_taxonomy: truth.and_then(|truth| truth.taxonomy.clone()),
        }
    }

    /// The source again, as one that is called `uri`.
    pub fn source_info(&self, uri: &str) -> SourceInfo {
        SourceInfo {
            uri: uri.to_owned(),
            part: self.part.clone(),
            taxonomy: self.taxonomy.clone(),
            view_count: self.view_count,
            turntable: self.turntable,
            volume: self.volume.map(|[low, high]| (Point3::from(low), Point3::from(high))),
            no_labels: self.no_labels.clone(),
            settings: self.settings.clone(),
        }
    }

    /// Whether every field can be used; the name of the first that cannot, and why.
    pub(crate) fn check(&self) -> Result<(), (&'static str, String)> {
        if self.version > VERSION {
            let reason = format!("is {}, and this version reads up to {VERSION}: use a newer semascan", self.version);
            return Err(("version", reason));
        }
        let dense = |classes: &[semascan_model::ClassDef]| {
            !classes.is_empty() && classes.iter().enumerate().all(|(i, class)| usize::from(class.id) == i)
        };
        if !dense(&self.taxonomy.components) || !dense(&self.taxonomy.defects) {
            return Err(("taxonomy", "must number its classes 0, 1, 2 ... with `none` first".to_owned()));
        }
        if self
            .volume
            .is_some_and(|[low, high]| !(0..3).all(|i| low[i].is_finite() && low[i] < high[i] && high[i].is_finite()))
        {
            return Err(("volume", "its first corner must lie below its second".to_owned()));
        }
        if self.turntable.is_some_and(|t| !(t.radius > 0.0 && t.radius.is_finite() && t.height.is_finite())) {
            return Err(("turntable", "must have a radius above 0 and a height, in metres".to_owned()));
        }
        Ok(())
    }
}
