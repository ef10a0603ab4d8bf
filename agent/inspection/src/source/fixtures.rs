//! A source for tests of what is put around sources.

use super::{Source, SourceError, SourceInfo};
use image::RgbImage;
use nalgebra::Isometry3;
use semascan_model::Taxonomy;
use semascan_perception::view::{DepthImage, Intrinsics, PoseEvidence, View, covariance_of_prior};
use std::sync::Arc;

/// Views of a wall by a camera that moves along it; how many were given so far is a setting.
pub(crate) struct Counting {
    info: SourceInfo,
    next: u32,
}

impl Counting {
    /// The setting that counts.
    pub(crate) const SETTING: &str = "given";
    /// Views that there are.
    const VIEWS: u32 = 3;
}

impl Default for Counting {
    fn default() -> Self {
        let info = SourceInfo {
            uri: "wall".into(),
            part: "wall".into(),
            taxonomy: Taxonomy::from_names(&["wall"], &[]),
            view_count: Some(Self::VIEWS),
            turntable: None,
            volume: None,
            no_labels: None,
            settings: Vec::new(),
        };
        Self { info, next: 0 }
    }
}

impl Source for Counting {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let index = self.next;
        if index == Self::VIEWS {
            return None;
        }
        self.next += 1;
        self.info.settings = vec![(Self::SETTING.to_owned(), self.next.to_string())];
        let (width, height) = (96, 72);
        Some(Ok(View {
            index,
            stamp: None,
            intrinsics: Intrinsics { width, height, fx: 80.0, fy: 80.0, cx: 47.5, cy: 35.5 },
            rgb: Arc::new(RgbImage::new(width, height)),
            depth: Arc::new(DepthImage { width, height, metres: vec![0.5; (width * height) as usize] }),
            pose: PoseEvidence::World {
                table_from_camera: Isometry3::translation(0.2 * f64::from(index), 0.0, 0.0),
                covariance: covariance_of_prior(0.01, 0.001),
            },
            labels: None,
            truth: None,
        }))
    }

    fn rewind(&mut self) -> bool {
        self.next = 0;
        true
    }
}
