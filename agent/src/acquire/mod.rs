//! Where views come from: one file a source.
//!
//! A [`Source`] yields [`View`]s in capture order: colour, organized depth, intrinsics, and the evidence for the
//! camera's pose. Simulated and recorded input take the same way through the system as a camera does.

pub mod bop;
pub mod camera_mask;
pub mod depth_map;
mod error;
mod keyframes;
pub mod mesh_file;
mod open;
pub mod pcd;
mod percent;
pub mod training_set;
mod view;
pub mod virtual_cell;
mod with_taxonomy;

pub use error::AcquireError;
pub use keyframes::{KeyframeRule, Keyframes};
pub use open::open;
pub use view::{
    Chain, DepthImage, Intrinsics, PoseEvidence, RecordedLabels, SourceInfo, Turntable, View, ViewTruth,
    covariance_of_prior,
};
pub use with_taxonomy::WithTaxonomy;

use semascan_shared::model::Taxonomy;

/// A stream of views of one part.
pub trait Source: Send {
    /// What this source is and which classes its labels use.
    fn info(&self) -> &SourceInfo;

    /// The next view, `None` after the last.
    ///
    /// # Errors
    /// A bad view (corrupt file, missing depth ...) is an error that names the file or field; the next call goes on
    /// with the view after it.
    fn next_view(&mut self) -> Option<Result<View, AcquireError>>;

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
