//! The port through which views come: a [`Source`] yields [`View`]s in capture order: colour, organized depth, intrinsics,
//! and the evidence for the camera's pose. Simulated and recorded input take the same way through the system as a camera
//! does.

mod capture_trigger;
mod error;
#[cfg(test)]
pub(crate) mod fixtures;
mod keyframes;
mod tracked;
mod turntable;
mod with_taxonomy;

pub use capture_trigger::CaptureTrigger;
pub use error::SourceError;
pub use keyframes::{KeyframeRule, Keyframes};
pub use tracked::TrackedSource;
pub use turntable::TurntableSource;
pub use with_taxonomy::WithTaxonomy;

use crate::planning::SteeredCamera;
use crate::stop::StopSwitch;
use nalgebra::Point3;
use semascan_model::Taxonomy;
use semascan_perception::view::View;
use serde::{Deserialize, Serialize};

/// A stream of views of one part.
pub trait Source: Send {
    /// What this source is and which classes its labels use.
    fn info(&self) -> &SourceInfo;

    /// The next view, `None` after the last.
    ///
    /// # Errors
    /// A bad view (corrupt file, missing depth ...) is an error that names the file or field; the next call goes on
    /// with the view after it.
    fn next_view(&mut self) -> Option<Result<View, SourceError>>;

    /// Begins again with the first view, for what must look at all views before the first is inspected. `false` where the
    /// source cannot: a camera's views come once.
    fn rewind(&mut self) -> bool {
        false
    }

    /// Told before the first view what ends the inspection early: a source that waits long for its next view looks at it, and
    /// has no more views once it is set.
    fn end_with(&mut self, _stop: &StopSwitch) {}

    /// What a view can be asked for with at any time; `None` where its views come when they come.
    fn capture_trigger(&self) -> Option<CaptureTrigger> {
        None
    }

    /// The camera, where it can be sent to viewpoints; `None` where views come as they come. One that is sent nowhere takes
    /// its views as ever.
    fn steered(&mut self) -> Option<&mut dyn SteeredCamera> {
        None
    }

    /// The true surface, where the source knows it.
    fn truth(&self) -> Option<&TrueMesh> {
        None
    }
}

/// The true surface in the table frame, with labels and defects per vertex.
#[derive(Clone, Debug, Default)]
pub struct TrueMesh {
    /// Vertices in metres, table frame.
    pub vertices: Vec<[f32; 3]>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Component class of each vertex.
    pub labels: Vec<u16>,
    /// Defect class of each vertex; 0 = none.
    pub defects: Vec<u16>,
    /// Classes the labels refer to.
    pub taxonomy: Option<Taxonomy>,
}

/// The disc the part stands on, in the table frame: centred on +z, surface at `height`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Turntable {
    /// Metres.
    pub radius: f64,
    /// Metres.
    pub height: f64,
}

/// What a source is.
#[derive(Clone, Debug)]
pub struct SourceInfo {
    /// The URI or path it was opened from.
    pub uri: String,
    /// The part, for people: `starter motor 7`.
    pub part: String,
    /// Classes its labels use.
    pub taxonomy: Taxonomy,
    /// Number of views if known.
    pub view_count: Option<u32>,
    /// The turntable, if there is one.
    pub turntable: Option<Turntable>,
    /// The measuring volume in the table frame (min, max corner, metres); points outside are background.
    pub volume: Option<(Point3<f64>, Point3<f64>)>,
    /// Why its views carry no recorded labels, or have none that were read; `None` if they carry some.
    pub no_labels: Option<String>,
    /// Seeds and settings that make the run repeatable, as `key = value`. A source may add to them as it goes.
    pub settings: Vec<(String, String)>,
}

impl SourceInfo {
    /// Takes over the settings of the source that this one is made of, as they are by now; those of its own stay.
    fn follow_settings(&mut self, of_inner: &Self) {
        for (key, value) in &of_inner.settings {
            match self.settings.iter_mut().find(|(own, _)| own == key) {
                Some((_, own)) => own.clone_from(value),
                None => self.settings.push((key.clone(), value.clone())),
            }
        }
    }
}
