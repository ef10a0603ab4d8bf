//! A source whose labels come from elsewhere: the same views, under the classes of whoever labels them.

use crate::planning::SteeredCamera;
use crate::source::{CaptureTrigger, Source, SourceError, SourceInfo, TrueMesh};
use crate::stop::StopSwitch;
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
        let view = self.source.next_view();
        self.info.follow_settings(self.source.info());
        view
    }

    fn rewind(&mut self) -> bool {
        self.source.rewind()
    }

    fn end_with(&mut self, stop: &StopSwitch) {
        self.source.end_with(stop);
    }

    fn capture_trigger(&self) -> Option<CaptureTrigger> {
        self.source.capture_trigger()
    }

    fn steered(&mut self) -> Option<&mut dyn SteeredCamera> {
        self.source.steered()
    }

    fn truth(&self) -> Option<&TrueMesh> {
        self.source.truth()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::fixtures::Counting;
    use crate::source::{KeyframeRule, Keyframes, TurntableSource};
    use crate::spec::TurntableSpec;

    #[test]
    fn what_a_source_says_of_itself_later_is_passed_on_by_every_wrapper() {
        let other = || Taxonomy::from_names(&["gear"], &[]);
        let wrapped: [Box<dyn Source>; 3] = [
            Box::new(WithTaxonomy::new(Box::new(Counting::default()), other())),
            Box::new(Keyframes::new(Box::new(Counting::default()), KeyframeRule::default())),
            TurntableSource::wrap(Box::new(Counting::default()), TurntableSpec::Known { axis: None, step: None })
                .expect("its views come again"),
        ];
        for mut source in wrapped {
            let views = std::iter::from_fn(|| source.next_view()).count();
            let said = source.info().settings.iter().filter(|(key, _)| key == Counting::SETTING).collect::<Vec<_>>();
            assert_eq!(said, [&(Counting::SETTING.to_owned(), views.to_string())]);
        }
        assert_eq!(WithTaxonomy::new(Box::new(Counting::default()), other()).info().taxonomy, other());
    }
}
