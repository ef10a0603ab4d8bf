//! A source whose labels come from elsewhere: the same views, under the classes of whoever labels them.

use crate::source::{Source, SourceError, SourceInfo, TrueMesh};
use semascan_model::Taxonomy;
use semascan_perception::view::View;

/// The views of a source under another taxonomy. It must number the source's classes as the source does where truth is to
/// be compared with.
pub struct WithTaxonomy {
    source: Box<dyn Source>,
    info: SourceInfo,
}

impl WithTaxonomy {
    /// `source` under `taxonomy`.
    pub fn new(source: Box<dyn Source>, taxonomy: Taxonomy) -> Self {
        let info = SourceInfo { taxonomy, ..source.info().clone() };
        Self { source, info }
    }
}

impl Source for WithTaxonomy {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        self.source.next_view()
    }

    fn rewind(&mut self) -> bool {
        self.source.rewind()
    }

    fn truth(&self) -> Option<&TrueMesh> {
        self.source.truth()
    }
}
