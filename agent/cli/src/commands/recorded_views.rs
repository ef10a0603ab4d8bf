//! The views of an inspection, read again from its source.

use super::source;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use semascan_inspection::source::Source;
use semascan_inspection::spec::{InspectionSpec, LabelSource};
use semascan_model::record::{PoseRecord, ViewRecord};
use semascan_perception::view::View;

/// The views of a source, asked for in their order.
pub(super) struct RecordedViews {
    source: Box<dyn Source>,
    next: u32,
}

impl RecordedViews {
    /// Opens the source `uri` again.
    pub(super) fn open(uri: &str) -> Result<Self, String> {
        let spec = InspectionSpec { labels: LabelSource::None, ..InspectionSpec::default() };
        let source = source::open(uri, &spec).map_err(|error| format!("the source cannot be opened again: {error}"))?;
        Ok(Self { source, next: 0 })
    }

    /// Corners of the measuring volume that the source knows, least and greatest, in the table frame, metres.
    pub(super) fn volume(&self) -> Option<(Point3<f64>, Point3<f64>)> {
        self.source.info().volume
    }

    /// The view that was inspected as `recorded`, or why the source does not have it.
    pub(super) fn view(&mut self, recorded: &ViewRecord) -> Result<View, String> {
        if recorded.index < self.next {
            return Err("is asked for after a later one".into());
        }
        loop {
            let view = self.source.next_view().ok_or("the source has no such view any more")?;
            self.next += 1;
            if self.next > recorded.index {
                let view = view.map_err(|error| error.to_string())?;
                check_same(&view, recorded)?;
                view.check_sizes().map_err(|error| error.to_string())?;
                return Ok(view);
            }
        }
    }
}

/// Whether a source still gives the view that was inspected, as far as times can tell.
pub(super) fn check_same(view: &View, recorded: &ViewRecord) -> Result<(), String> {
    match (view.stamp, recorded.stamp) {
        (Some(a), Some(b)) if (a - b).abs() > 1e-6 => {
            Err(format!("the source has another view in its place now, of time {a} s and not {b} s"))
        }
        _ => Ok(()),
    }
}

/// A recorded pose; `None` where it is none.
pub(super) fn table_from_camera(pose: &PoseRecord) -> Option<Isometry3<f64>> {
    let q = pose.rotation;
    let rotation = UnitQuaternion::try_new(Quaternion::new(q.w, q.x, q.y, q.z), 1e-6)?;
    let [x, y, z] = pose.translation;
    [x, y, z].iter().all(|c| c.is_finite()).then(|| Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}
