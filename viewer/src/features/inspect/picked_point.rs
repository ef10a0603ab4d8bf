//! A point of the surface that a person picked, and all that the model knows of it.

use crate::words::t;
use semascan_model::{PointFlags, SemanticPoint};

/// A place on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickedPoint {
    /// Where, metres, table frame: the centre of a point, or a place on a triangle of the mesh.
    pub position: [f32; 3],
    /// Unit normal of the surface, outward, table frame; zero where it is not known.
    pub normal: [f32; 3],
    /// Component class; 0 = none.
    pub component: u16,
    /// Share of the component, 0..=1; `None` without evidence for one.
    pub confidence: Option<f32>,
    /// Uncertainty of the component, 0..=1; `None` where nobody estimated it.
    pub sigma: Option<f32>,
    /// Defect class; 0 = none.
    pub defect: u16,
    /// Share of the defect, 0..=1.
    pub defect_confidence: f32,
    /// Number of the object among those of its class; 0 where objects are not told apart.
    pub instance: u16,
    /// How many views saw it.
    pub views: u16,
    /// Its marks.
    pub flags: PointFlags,
    /// Signed distance from the reference, metres; `None` where it was not compared.
    pub deviation: Option<f32>,
    /// Whether it lies on the mesh.
    pub on_mesh: bool,
    /// Voxel edge of the model, metres.
    pub voxel: f32,
}

impl PickedPoint {
    /// What `point` says of itself.
    ///
    /// * `voxel`: voxel edge of the model, metres.
    /// * `has_sigma`: whether anybody estimated uncertainties for the model's labels; where nobody did, they are all 0.
    pub fn of(point: &SemanticPoint, voxel: f32, has_sigma: bool) -> Self {
        let known = point.label != 0;
        Self {
            position: point.position,
            normal: point.normal,
            component: point.label,
            // A class that was judged has a share: files of others say a class and no share.
            confidence: (known && point.confidence > 0.0).then_some(point.confidence),
            sigma: (known && has_sigma).then_some(point.sigma),
            defect: point.defect,
            defect_confidence: point.defect_confidence,
            instance: point.instance,
            views: point.views,
            flags: point.flags,
            deviation: None,
            on_mesh: false,
            voxel,
        }
    }

    /// What its marks say; `None` where it is plain surface.
    pub fn mark(&self) -> Option<&'static str> {
        let has = |bits| self.flags.has(bits);
        match () {
            () if has(PointFlags::BACKGROUND) => Some(t!("inspect.mark.background")),
            () if has(PointFlags::OUTLIER) => Some(t!("inspect.mark.outlier")),
            () if has(PointFlags::UNCERTAIN) => Some(t!("inspect.mark.uncertain")),
            () => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_estimated_is_not_known() {
        let point = SemanticPoint { label: 2, confidence: 0.75, sigma: 0.0, views: 3, ..SemanticPoint::UNKNOWN };
        let of = |point: &SemanticPoint, has_sigma| PickedPoint::of(point, 1e-3, has_sigma);
        assert_eq!((of(&point, true).sigma, of(&point, false).sigma), (Some(0.0), None));
        assert_eq!((of(&point, true).confidence, of(&point, true).views), (Some(0.75), 3));
        let nothing = of(&SemanticPoint { label: 0, ..point }, true);
        assert_eq!((nothing.sigma, nothing.confidence), (None, None));
    }

    #[test]
    fn marks_are_said() {
        let of = |bits| {
            PickedPoint::of(&SemanticPoint { flags: PointFlags(bits), ..SemanticPoint::UNKNOWN }, 1e-3, true).mark()
        };
        assert_eq!((of(0), of(PointFlags::UNLABELLED)), (None, None));
        assert_eq!(of(PointFlags::EDGE), Some("an outlier"));
        assert_eq!(of(PointFlags::BACKGROUND | PointFlags::EDGE), Some("outside the measuring volume"));
    }
}
