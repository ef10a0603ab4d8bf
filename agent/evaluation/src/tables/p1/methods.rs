//! The four methods that [Eye-in-hand 2020] compares (section 4.3), run over the same views with the same spoiled
//! masks.

use super::objects::TableObject;
use super::stitching::Stitched;
use semascan_perception::fuse::{FuseError, LabelledView, MapConfig, SemanticMap, voxel_for};
use semascan_perception::organized::OrganizedCloud;
use semascan_perception::register::{
    IcpConfig, IcpRegistrar, KinematicRegistrar, Method as PoseMethod, ModelSurface, RegisterError, Registrar,
    RegistrationInput, Selection,
};
use semascan_perception::segment::geometric::PatchMethod;
use semascan_perception::segment::geometric::fusion_segmentation::FusionConfig;
use semascan_perception::segment::{ClassField, GeometricSegmenter, RecordedSegmenter, Segmentation};
use semascan_perception::view::View;
use serde::Serialize;

/// The paper, section 4.3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The network's mask, poses from kinematics.
    MaskOnly,
    /// The network's mask, poses by ICP of the whole view.
    MaskIcp,
    /// Masks fitted to superpixels, poses by ICP of the whole view.
    SlicIcp,
    /// Masks fitted to LCCCP segments, poses by ICP of the object.
    LcccpSicp,
}

impl Method {
    /// In the paper's order.
    pub const ALL: [Self; 4] = [Self::MaskOnly, Self::MaskIcp, Self::SlicIcp, Self::LcccpSicp];

    /// The paper's name for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::MaskOnly => "mask only",
            Self::MaskIcp => "mask + ICP",
            Self::SlicIcp => "SLIC + ICP",
            Self::LcccpSicp => "LCCCP + SICP",
        }
    }

    fn patches(self) -> Option<PatchMethod> {
        match self {
            Self::MaskOnly | Self::MaskIcp => None,
            Self::SlicIcp => Some(PatchMethod::SLIC),
            Self::LcccpSicp => Some(PatchMethod::LCCCP),
        }
    }

    fn registrar(self) -> Box<dyn Registrar> {
        // Plain ICP knows no labels.
        let icp = |same_label, selection| {
            Box::new(IcpRegistrar::new(IcpConfig { same_label, ..IcpConfig::default() }, selection))
        };
        match self {
            Self::MaskOnly => Box::new(KinematicRegistrar),
            Self::MaskIcp | Self::SlicIcp => icp(false, Selection::Everything),
            Self::LcccpSicp => icp(true, Selection::Object),
        }
    }
}

/// Why a method could not be run.
#[derive(Debug, thiserror::Error)]
pub enum MethodError {
    /// A view could not be posed.
    #[error(transparent)]
    Register(#[from] RegisterError),
    /// A view could not be fused.
    #[error(transparent)]
    Fuse(#[from] FuseError),
}

/// A view with its true and its spoiled labels.
pub(super) struct Capture {
    pub(super) view: View,
    pub(super) truth: Vec<u16>,
    pub(super) mask: Segmentation,
}

/// What a method made of an object.
#[derive(Clone, Debug, Default)]
pub(super) struct Reconstruction {
    /// The object's points, table frame, metres.
    pub(super) points: Vec<[f32; 3]>,
    /// Mean IoU of the masks over views and classes.
    pub(super) mask_iou: f64,
    /// Views whose object was taken for a misidentification.
    pub(super) misidentified: u32,
    /// Views that ICP moved.
    pub(super) aligned: u32,
    /// CPU milliseconds a view.
    pub(super) segmentation_ms: f64,
    /// CPU milliseconds a view.
    pub(super) mapping_ms: f64,
}

/// Runs `method` over the views.
pub(super) fn reconstruct(
    method: Method,
    object: &TableObject,
    captures: &[Capture],
) -> Result<Reconstruction, MethodError> {
    let fitter = method.patches().map(|patches| GeometricSegmenter {
        fusion: FusionConfig::PAPER,
        ..GeometricSegmenter::new(RecordedSegmenter, patches)
    });
    let mut registrar = method.registrar();
    let mut map: Option<SemanticMap> = None;
    let mut stitched = Stitched::default();
    let mut out = Reconstruction::default();
    let (mut segmentation_s, mut mapping_s) = (0.0, 0.0);
    for capture in captures {
        let start = cpu_seconds();
        let segmentation =
            fitter.as_ref().map_or_else(|| capture.mask.clone(), |f| f.fit(&capture.view, &capture.mask));
        segmentation_s += cpu_seconds() - start;
        out.mask_iou += mean_iou(&segmentation, &capture.truth) / captures.len() as f64;

        let start = cpu_seconds();
        let view = &capture.view;
        let cloud = OrganizedCloud::new(view.intrinsics, &view.depth, None);
        let model = map.as_ref().map(|m| m as &dyn ModelSurface);
        let registration =
            registrar.register(&RegistrationInput { view, cloud: &cloud, segmentation: &segmentation, model })?;
        registrar.accepted();
        out.aligned += u32::from(matches!(registration.method, PoseMethod::Icp(_)));
        let pose = registration.table_from_camera;
        stitched.add(&object_points(&cloud, &segmentation, object.class, &pose));
        if method != Method::MaskOnly {
            if map.is_none() {
                let voxel = voxel_for(&cloud).unwrap_or(semascan_perception::fuse::SMALLEST_VOXEL);
                map = Some(SemanticMap::new(MapConfig::new(voxel, usize::from(object.classes()), 1))?);
            }
            if let Some(map) = &mut map {
                let (index, rgb) = (view.index, view.rgb.clone());
                map.integrate(&LabelledView { index, cloud, rgb, segmentation, table_from_camera: pose })?;
            }
        }
        mapping_s += cpu_seconds() - start;
    }
    let views = captures.len().max(1) as f64;
    out.misidentified = stitched.misidentified;
    out.points = stitched.into_points();
    out.segmentation_ms = segmentation_s * 1e3 / views;
    out.mapping_ms = mapping_s * 1e3 / views;
    Ok(out)
}

/// Points of the pixels that are labelled as the object (class 0: any class), table frame.
fn object_points(
    cloud: &OrganizedCloud,
    segmentation: &Segmentation,
    class: u16,
    table_from_camera: &nalgebra::Isometry3<f64>,
) -> Vec<[f32; 3]> {
    let is_object = |i: usize| match segmentation.components.best(i) {
        0 => false,
        label => class == 0 || label == class,
    };
    let pixels = (0..cloud.depth.len()).filter(|&i| is_object(i));
    pixels.filter_map(|i| cloud.point(i)).map(|p| (table_from_camera * p).coords.cast::<f32>().into()).collect()
}

/// Mean over the classes that `truth` has of the intersection over union of the mask.
fn mean_iou(segmentation: &Segmentation, truth: &[u16]) -> f64 {
    let classes = usize::from(truth.iter().copied().max().unwrap_or(0)) + 1;
    let (mut both, mut either, mut present) = (vec![0_u32; classes], vec![0_u32; classes], vec![false; classes]);
    for (i, &t) in truth.iter().enumerate() {
        let (t, given) = (usize::from(t), usize::from(segmentation.components.best(i)));
        present[t] = true;
        either[t] += 1;
        if t == given {
            both[t] += 1;
        } else if given < classes {
            either[given] += 1;
        }
    }
    let seen: Vec<usize> = (1..classes).filter(|&c| present[c]).collect();
    let sum: f64 = seen.iter().map(|&c| f64::from(both[c]) / f64::from(either[c])).sum();
    if seen.is_empty() { 1.0 } else { sum / seen.len() as f64 }
}

/// A segmentation of hard component labels; instances are the classes.
pub(super) fn hard(labels: &[u16]) -> Segmentation {
    Segmentation {
        components: ClassField::Hard(labels.to_vec()),
        defects: ClassField::Hard(vec![0; labels.len()]),
        instances: labels.to_vec(),
        network: None,
    }
}

/// CPU time of this thread: the runs have thread pools of one thread each. 0 where the system does not tell.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    stat.split_whitespace().next().and_then(|n| n.parse::<f64>().ok()).unwrap_or(0.0) * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn iou_is_averaged_over_the_true_classes() {
        let truth = [1, 1, 1, 1, 2, 2, 0, 0];
        // Class 1: 3 of 4 and one too many; class 2: 1 of 2 and one too many; class 3 does not exist.
        let iou = mean_iou(&hard(&[1, 1, 1, 2, 2, 3, 1, 0]), &truth);
        assert!((iou - 0.5 * (3.0 / 5.0 + 1.0 / 3.0)).abs() < 1e-12, "{iou}");
        assert!((mean_iou(&hard(&truth), &truth) - 1.0).abs() < 1e-12);
    }
}
