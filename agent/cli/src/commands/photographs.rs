//! The photographs of a kept inspection: of its capture, or of its source, which is opened again.

use super::Failure;
use super::recorded_views::{RecordedViews, table_from_camera};
use super::report_html;
use anyhow::anyhow;
use semascan_model::record::{InspectionRecord, ViewRecord};
use semascan_texture::Photograph;
use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

/// The views that a model was made of, at the poses that its record has for them.
pub(super) struct InspectedPhotographs {
    /// Where they are.
    uri: String,
    /// Those with a pose, in order.
    views: Vec<ViewRecord>,
    opened: RecordedViews,
    /// Number in the source of the next view that `opened` gives.
    next: u32,
}

impl InspectedPhotographs {
    /// Those of the inspection in `folder`, in `source` where that is named.
    ///
    /// # Errors
    /// [`Failure::Call`] if there are none.
    pub(super) fn open(folder: &Path, record: &InspectionRecord, source: Option<&str>) -> Result<Self, Failure> {
        let kept = || report_html::capture(folder, record);
        let uri = source.map(str::to_owned).or_else(kept).unwrap_or_else(|| record.source.clone());
        let none = |reason: String| {
            let way = "name where they are with --photographs SOURCE, or keep captures with --data DIR";
            Failure::Call(anyhow!("{}: its photographs are not there: {reason}; {way}", folder.display()))
        };
        let views: Vec<ViewRecord> =
            record.views.iter().filter(|view| view.accepted && view.pose.is_some()).cloned().collect();
        if views.is_empty() {
            return Err(none("no view of the record has a pose".into()));
        }
        let opened = RecordedViews::open(&uri).map_err(none)?;
        Ok(Self { uri, views, opened, next: 0 })
    }

    /// How many there are.
    pub(super) fn len(&self) -> u32 {
        u32::try_from(self.views.len()).unwrap_or(u32::MAX)
    }

    /// Photograph `number`, or why it cannot be had. In order they are had fastest.
    pub(super) fn photograph(&mut self, number: u32) -> Result<Photograph<'static>, String> {
        let recorded = self.views.get(number as usize).ok_or("there is no such view")?;
        let pose = recorded.pose.as_ref().ok_or("has no pose in the record")?;
        let table_from_camera = table_from_camera(pose).ok_or("has no whole pose in the record")?;
        if recorded.index < self.next {
            self.opened = RecordedViews::open(&self.uri)?;
        }
        self.next = recorded.index + 1;
        let view = self.opened.view(recorded)?;
        Ok(Photograph {
            rgb: Arc::clone(&view.rgb),
            depth: Cow::Owned(view.depth.metres.clone()),
            intrinsics: view.intrinsics,
            table_from_camera,
        })
    }
}
