//! A view that labels are projected into: its pictures, where it was taken from and how well that is known.

use crate::EmptySpace;
use image::RgbImage;
use nalgebra::{Isometry3, Matrix6};
use semascan_model::record::ViewRecord;
use semascan_perception::view::{Intrinsics, View};

/// How well the pose of a view is known: one standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseUncertainty {
    /// Of the rotation, radians.
    pub rotation: f64,
    /// Of the translation, metres.
    pub translation: f64,
}

impl PoseUncertainty {
    /// The largest deviations of a recorded pose; `None` where the record does not say them.
    pub fn of(recorded: &ViewRecord) -> Option<Self> {
        let rows = recorded.covariance?;
        let covariance = Matrix6::from_fn(|row, column| rows[row][column]);
        let largest = |first: usize| covariance.fixed_view::<3, 3>(first, first).symmetric_eigenvalues().max();
        Some(Self { rotation: largest(0).max(0.0).sqrt(), translation: largest(3).max(0.0).sqrt() })
    }
}

/// A view that labels are projected into.
#[derive(Clone, Copy, Debug)]
pub struct CapturedView<'a> {
    /// Colour.
    pub rgb: &'a RgbImage,
    /// Depth in metres, row-major; 0 where nothing was measured.
    pub depth: &'a [f32],
    /// The camera, for both.
    pub intrinsics: Intrinsics,
    /// Its final pose.
    pub table_from_camera: Isometry3<f64>,
    /// How well that is known; `None` where it is not said.
    pub uncertainty: Option<PoseUncertainty>,
    /// Where the part can be, and what of it all views saw to be empty; `None` where nobody says where it can be.
    pub space: Option<&'a EmptySpace>,
}

impl<'a> CapturedView<'a> {
    /// `view` at the pose that the inspection found for it.
    pub fn of(
        view: &'a View,
        table_from_camera: Isometry3<f64>,
        recorded: &ViewRecord,
        space: Option<&'a EmptySpace>,
    ) -> Self {
        Self {
            rgb: &view.rgb,
            depth: &view.depth.metres,
            intrinsics: view.intrinsics,
            table_from_camera,
            uncertainty: PoseUncertainty::of(recorded),
            space,
        }
    }
}
