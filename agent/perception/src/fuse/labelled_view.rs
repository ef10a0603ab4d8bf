//! One posed, labelled view: what fusion takes in, and as a semantic point cloud of its own (the semantic point cloud of a
//! keyframe [Wang 2023]).

use crate::organized::OrganizedCloud;
use crate::segment::{ClassField, Segmentation};
use image::RgbImage;
use nalgebra::{Isometry3, Vector3};
use semascan_model::{PointFlags, SemanticCloud, SemanticPoint};
use std::sync::Arc;

/// Everything fusion needs of one view.
#[derive(Clone, Debug)]
pub struct LabelledView {
    /// Position in the capture order.
    pub index: u32,
    /// Points and normals in the camera frame.
    pub cloud: OrganizedCloud,
    /// Colour.
    pub rgb: Arc<RgbImage>,
    /// Class membership of every pixel.
    pub segmentation: Segmentation,
    /// Camera pose.
    pub table_from_camera: Isometry3<f64>,
}

impl LabelledView {
    /// Every pixel with depth as a point in the table frame, as captured: nothing is merged or smoothed.
    pub fn semantic_cloud(&self) -> SemanticCloud {
        let turn = self.table_from_camera.rotation;
        let point = |i: usize| {
            let p = (self.table_from_camera * self.cloud.point(i)?).cast::<f32>();
            let n = turn * Vector3::from(self.cloud.normals[i]).cast::<f64>();
            let color = self.rgb.as_raw().get(i * 3..i * 3 + 3).and_then(|c| c.try_into().ok()).unwrap_or([0; 3]);
            let (components, defects) = (&self.segmentation.components, &self.segmentation.defects);
            let (label, confidence) = best(components, i);
            let (defect, defect_confidence) = best(defects, i);
            let flying = self.cloud.flying.get(i).copied().unwrap_or(false);
            Some(SemanticPoint {
                position: p.into(),
                normal: n.cast::<f32>().into(),
                color,
                label,
                confidence,
                defect,
                defect_confidence,
                sigma: components.sigma(i),
                defect_sigma: defects.sigma(i),
                instance: self.segmentation.instances.get(i).copied().unwrap_or(0),
                views: 1,
                flags: PointFlags(if flying { PointFlags::EDGE } else { 0 }),
            })
        };
        (0..self.cloud.depth.len()).filter_map(point).collect()
    }
}

/// Most probable class of pixel `i` and its probability.
fn best(field: &ClassField, i: usize) -> (u16, f32) {
    let class = field.best(i);
    let mut share = vec![0.0; usize::from(class) + 1];
    field.add_evidence(i, 1.0, &mut share);
    (class, share[usize::from(class)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{DepthImage, Intrinsics};
    use image::Rgb;

    #[test]
    fn pixels_become_points_of_the_table_frame() {
        let k = Intrinsics { width: 2, height: 1, fx: 100.0, fy: 100.0, cx: 0.0, cy: 0.0 };
        let depth = DepthImage { width: 2, height: 1, metres: vec![0.0, 0.5] };
        let probabilities = vec![255, 0, 51, 204];
        let soft = ClassField::Soft { classes: 2, probabilities, sigma: vec![0, 51], model_sigma: Vec::new() };
        let view = LabelledView {
            index: 0,
            cloud: OrganizedCloud::new(k, &depth, None),
            rgb: std::sync::Arc::new(RgbImage::from_pixel(2, 1, Rgb([9, 8, 7]))),
            segmentation: Segmentation {
                components: soft,
                defects: ClassField::Hard(vec![0, 3]),
                instances: vec![0, 5],
                network: None,
            },
            table_from_camera: Isometry3::translation(0.0, 0.0, 1.0),
        };
        let cloud = view.semantic_cloud();
        assert_eq!(cloud.len(), 1, "a pixel without depth is no point");
        let p = cloud.get(0).expect("a point");
        assert!((p.position[0] - 0.005).abs() < 1e-6 && (p.position[2] - 1.5).abs() < 1e-6, "{:?}", p.position);
        assert_eq!((p.label, p.defect, p.instance, p.color), (1, 3, 5, [9, 8, 7]));
        assert!((p.confidence - 0.8).abs() < 1e-6 && (p.sigma - 0.2).abs() < 1e-6 && p.defect_confidence == 1.0);
    }
}
