//! A source whose views lost their pose evidence.

use semascan_inspection::source::{Source, SourceError, SourceInfo, TrueMesh};
use semascan_perception::view::{PoseEvidence, View};

/// Another source, of whose views those that `lost` names come without any evidence of their pose.
pub struct Unposed<S> {
    /// The source itself.
    pub source: S,
    /// Whether the pose of a view (by its index) is lost.
    pub lost: fn(u32) -> bool,
}

impl<S: Source> Source for Unposed<S> {
    fn info(&self) -> &SourceInfo {
        self.source.info()
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let mut view = self.source.next_view()?;
        if let Ok(view) = &mut view
            && (self.lost)(view.index)
        {
            view.pose = PoseEvidence::None;
        }
        Some(view)
    }

    fn truth(&self) -> Option<&TrueMesh> {
        self.source.truth()
    }
}
