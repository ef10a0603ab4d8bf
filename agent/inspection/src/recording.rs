//! A source whose views are kept as they come, and one that goes on where an earlier run was cut off.

use crate::journal::SharedCaptures;
use crate::planning::SteeredCamera;
use crate::source::{CaptureTrigger, Source, SourceError, SourceInfo, TrueMesh};
use crate::stop::StopSwitch;
use semascan_perception::view::View;
use std::sync::PoisonError;

/// The views of a source, each kept when it comes for the first time: what lies around this source may look at them again.
pub struct Recording {
    source: Box<dyn Source>,
    captures: SharedCaptures,
    /// Place of the next view.
    next: u32,
    /// Why views are not kept any more.
    broken: Option<String>,
}

impl Recording {
    /// `source`, whose views go into `captures` but for those that these hold already.
    pub fn new(source: Box<dyn Source>, captures: SharedCaptures) -> Self {
        Self { source, captures, next: 0, broken: None }
    }
}

impl Source for Recording {
    fn info(&self) -> &SourceInfo {
        self.source.info()
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let view = self.source.next_view()?;
        let place = self.next;
        self.next += 1;
        let mut captures = self.captures.lock().unwrap_or_else(PoisonError::into_inner);
        if place < captures.views() {
            return Some(view);
        }
        // One that is missing would leave the views after it in the wrong place.
        if self.broken.is_none()
            && let Err(error) = captures.append(&view, &self.source.info().settings)
        {
            self.broken = Some(error.to_string());
        }
        if let Some(reason) = &self.broken {
            let uri = self.source.info().uri.clone();
            return Some(Err(SourceError::Uri { uri, reason: format!("the view cannot be kept: {reason}") }));
        }
        // The journal tries again before it acknowledges the view.
        if let Err(error) = captures.sync() {
            tracing::warn!("the view waits to be kept: {error}");
        }
        Some(view)
    }

    fn rewind(&mut self) -> bool {
        let rewound = self.source.rewind();
        if rewound {
            self.next = 0;
        }
        rewound
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

/// The recorded views of a source, and then the source itself from the view after them on.
pub struct Continued {
    recorded: Box<dyn Source>,
    source: Box<dyn Source>,
    views: u32,
    next: u32,
    /// Whether `source` stands behind the recorded views.
    is_behind: bool,
}

/// Why a source cannot go on after views that were recorded from it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CannotContinue {
    /// The source has fewer views now.
    #[error("the source ends after {found} views, and {recorded} were recorded from it")]
    Shorter {
        /// Views that it has.
        found: u32,
        /// Views that were recorded.
        recorded: u32,
    },
    /// A view is another one now.
    #[error("view {index} of the source is not the one that was recorded from it")]
    Changed {
        /// Its place.
        index: u32,
    },
    /// The recording cannot be read again.
    #[error("the recording cannot be read from its beginning again")]
    Recording,
}

impl Continued {
    /// `source` after its first `views` views, which `recorded` holds. Every one of them is compared with the source's own.
    ///
    /// # Errors
    /// [`CannotContinue`] with the view at fault.
    pub fn new(mut recorded: Box<dyn Source>, mut source: Box<dyn Source>, views: u32) -> Result<Self, CannotContinue> {
        for index in 0..views {
            let Some(own) = source.next_view() else {
                return Err(CannotContinue::Shorter { found: index, recorded: views });
            };
            let same = match (recorded.next_view(), own) {
                (Some(Ok(kept)), Ok(own)) => is_same(&kept, &own),
                (Some(Err(_)), Err(_)) => true,
                _ => false,
            };
            if !same {
                return Err(CannotContinue::Changed { index });
            }
        }
        if views > 0 && !recorded.rewind() {
            return Err(CannotContinue::Recording);
        }
        Ok(Self { recorded, source, views, next: 0, is_behind: true })
    }
}

impl Source for Continued {
    fn info(&self) -> &SourceInfo {
        self.source.info()
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let place = self.next;
        self.next += 1;
        if place < self.views {
            return self.recorded.next_view();
        }
        if !self.is_behind {
            (0..self.views).for_each(|_| drop(self.source.next_view()));
            self.is_behind = true;
        }
        self.source.next_view()
    }

    fn rewind(&mut self) -> bool {
        if !self.source.rewind() || !self.recorded.rewind() {
            return false;
        }
        (self.next, self.is_behind) = (0, false);
        true
    }

    fn end_with(&mut self, stop: &StopSwitch) {
        self.source.end_with(stop);
    }

    fn capture_trigger(&self) -> Option<CaptureTrigger> {
        self.source.capture_trigger()
    }

    fn truth(&self) -> Option<&TrueMesh> {
        self.source.truth()
    }
}

/// Whether two views are the same, bit for bit.
fn is_same(a: &View, b: &View) -> bool {
    let same_labels = match (&a.labels, &b.labels) {
        (Some(a), Some(b)) => a == b,
        (None, None) => true,
        _ => false,
    };
    a.rgb == b.rgb
        && a.depth == b.depth
        && a.intrinsics == b.intrinsics
        && a.pose == b.pose
        && a.stamp == b.stamp
        && a.truth == b.truth
        && same_labels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::ProcessedView;
    use crate::ports::{Captures, PortError};
    use crate::source::fixtures::Counting;
    use std::sync::{Arc, Mutex};

    /// Captures in memory, of which the disk is full for the first `full` times.
    #[derive(Default)]
    struct InMemory {
        kept: Vec<u32>,
        durable: usize,
        full: u32,
    }

    impl Captures for InMemory {
        fn views(&self) -> u32 {
            self.kept.len() as u32
        }

        fn append(&mut self, view: &Result<View, SourceError>, _: &[(String, String)]) -> Result<(), PortError> {
            self.kept.push(view.as_ref().map_or(u32::MAX, |view| view.index));
            Ok(())
        }

        fn append_segmentation(&mut self, _: u32, _: &ProcessedView) -> Result<(), PortError> {
            Ok(())
        }

        fn sync(&mut self) -> Result<(), PortError> {
            if self.full > 0 {
                self.full -= 1;
                return Err(PortError::new("x.mcap", "no space left"));
            }
            self.durable = self.kept.len();
            Ok(())
        }

        fn finish(&mut self) -> Result<(), PortError> {
            self.sync()
        }
    }

    fn indices(source: &mut dyn Source) -> Vec<u32> {
        std::iter::from_fn(|| source.next_view()).map(|view| view.expect("a view").index).collect()
    }

    #[test]
    fn each_view_is_kept_once_however_often_it_is_looked_at_and_although_the_disk_is_full_at_first() {
        let captures = Arc::new(Mutex::new(InMemory { full: 2, ..InMemory::default() }));
        let mut source = Recording::new(Box::new(Counting::default()), captures.clone());
        assert!(source.next_view().is_some());
        assert_eq!(captures.lock().expect("whole").durable, 0);
        assert!(source.rewind());
        assert_eq!(indices(&mut source), [0, 1, 2]);
        let captures = captures.lock().expect("whole");
        assert_eq!((captures.kept.as_slice(), captures.durable), ([0, 1, 2].as_slice(), 3));
    }

    #[test]
    fn a_source_is_continued_behind_what_was_recorded_from_it_also_when_it_is_looked_at_twice() {
        let boxed = || -> Box<dyn Source> { Box::new(Counting::default()) };
        for views in 0..=3 {
            let mut source = Continued::new(boxed(), boxed(), views).expect("the same");
            for _ in 0..3 {
                assert_eq!(indices(&mut source), [0, 1, 2], "{views} recorded");
                assert!(source.rewind());
            }
        }
        assert_eq!(Continued::new(boxed(), boxed(), 4).err(), Some(CannotContinue::Shorter { found: 3, recorded: 4 }));
        // Another view in its place.
        let mut ahead = boxed();
        let _ = ahead.next_view();
        assert_eq!(Continued::new(boxed(), ahead, 2).err(), Some(CannotContinue::Changed { index: 0 }));
    }
}
