//! Whether a view looks as the model says it must from a pose: what overlap alone cannot decide.
//!
//! A round part lies on itself in many poses. But a camera sees through no surface: where the model stands before what
//! was measured, the pose is wrong, and where the two lie together they must be of one component. Surface that was
//! measured before the model's is no contradiction, for the model is not complete.

use super::model_view::ModelView;
use super::registration::RegistrationInput;
use nalgebra::Point3;
use semascan_geometry::vector::{dot, length};

/// Cosine of incidence from which on a surface is too slanted for its depth to be judged.
const GRAZING: f32 = 0.2;
/// Where a pixel of the model is looked up in the view, in halves of its width: its middle and its border, for the
/// model's outline is not known any better.
const PATCH: [(f64, f64); 9] =
    [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];

/// Pixels of a rendering of the model, by what the view has there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Visibility {
    /// The same surface.
    pub(super) confirmed: u32,
    /// Something behind it, or a surface of another component at its place.
    pub(super) contradicted: u32,
    /// Something before it.
    pub(super) hidden: u32,
    /// Nothing.
    pub(super) unmeasured: u32,
}

impl Visibility {
    /// Compares `input` with the pixels of `model` whose class `wanted` agrees to. Depths up to `tolerance` metres apart
    /// are the same.
    pub(super) fn of(
        input: &RegistrationInput<'_>,
        model: &ModelView,
        wanted: &dyn Fn(u16) -> bool,
        tolerance: f32,
    ) -> Self {
        let mut out = Self::default();
        let camera = &input.cloud.intrinsics;
        let reach = 0.5 * camera.fx / model.intrinsics.fx;
        for ((point, normal), label) in model.points.iter().zip(&model.normals).zip(&model.labels) {
            if *point == [0.0; 3] || !wanted(*label) {
                continue;
            }
            let Some((u, v)) = camera.project(&Point3::from(*point).cast()) else { continue };
            let cosine = -dot(*point, *normal) / length(*point);
            let tolerance = tolerance / cosine.max(GRAZING);
            let (mut nearest, mut inside, mut same) = (f32::INFINITY, false, false);
            for (du, dv) in PATCH {
                let Some(i) = camera.pixel(u + du * reach, v + dv * reach) else { continue };
                inside = true;
                let z = input.cloud.depth[i];
                if z <= 0.0 {
                    continue;
                }
                nearest = nearest.min(z);
                same |= (z - point[2]).abs() <= tolerance && input.segmentation.components.best(i) == *label;
            }
            if !inside {
                continue;
            }
            let count = if same {
                &mut out.confirmed
            } else if nearest == f32::INFINITY {
                &mut out.unmeasured
            } else if nearest < point[2] - tolerance {
                &mut out.hidden
            } else {
                &mut out.contradicted
            };
            *count += 1;
        }
        out
    }

    /// Share of what the view can speak of that it contradicts.
    pub(super) fn contradiction(&self) -> f64 {
        f64::from(self.contradicted) / f64::from((self.confirmed + self.contradicted).max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::organized::OrganizedCloud;
    use crate::segment::{ClassField, Segmentation};
    use crate::view::{DepthImage, Intrinsics, PoseEvidence, View};
    use image::RgbImage;
    use nalgebra::Isometry3;
    use std::sync::Arc;

    const CAMERA: Intrinsics = Intrinsics { width: 4, height: 1, fx: 10.0, fy: 10.0, cx: 1.5, cy: 0.0 };

    #[test]
    fn a_view_confirms_contradicts_or_cannot_tell() {
        let depth = DepthImage { width: 4, height: 1, metres: vec![1.0, 1.0, 0.0, 1.0] };
        let view = View {
            index: 0,
            stamp: None,
            intrinsics: CAMERA,
            rgb: Arc::new(RgbImage::new(4, 1)),
            depth: Arc::new(depth.clone()),
            pose: PoseEvidence::None,
            labels: None,
            truth: None,
        };
        let segmentation = Segmentation {
            components: ClassField::Hard(vec![1, 2, 1, 1]),
            defects: ClassField::Hard(vec![0; 4]),
            instances: vec![0; 4],
            network: None,
        };
        let cloud = OrganizedCloud::new(CAMERA, &depth, None);
        let input = RegistrationInput { view: &view, cloud: &cloud, segmentation: &segmentation, model: None };
        // What the model shows along each pixel's ray, all of class 1.
        let count = |depths: [f64; 4]| {
            let at = |(u, z): (usize, f64)| CAMERA.unproject(u as f64, 0.0, z).cast().into();
            let model = ModelView {
                intrinsics: CAMERA.scaled(4.0),
                table_from_camera: Isometry3::identity(),
                points: depths.into_iter().enumerate().map(at).collect(),
                normals: vec![[0.0; 3]; 4],
                labels: vec![1; 4],
                instances: vec![0; 4],
            };
            Visibility::of(&input, &model, &|class| class == 1, 0.01)
        };
        let close = count([1.005, 0.995, 1.0, 0.9]);
        assert_eq!(close, Visibility { confirmed: 1, contradicted: 2, hidden: 0, unmeasured: 1 });
        assert!((close.contradiction() - 2.0 / 3.0).abs() < 1e-12);
        let behind = count([1.1, 1.1, 1.1, 0.0]);
        assert_eq!(behind, Visibility { confirmed: 0, contradicted: 0, hidden: 2, unmeasured: 1 });
        assert_eq!(behind.contradiction(), 0.0);
    }
}
