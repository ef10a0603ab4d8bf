//! One point in place of two.

use crate::vector::unit;
use semascan_model::SemanticPoint;

/// A point at `position` with the values of `a` and `b` mixed, `share` (0..1) of `b`. What cannot be mixed comes from the
/// one with the larger share, `a` where they are equal.
pub(super) fn blend(a: &SemanticPoint, b: &SemanticPoint, share: f64, position: [f64; 3]) -> SemanticPoint {
    let t = share.clamp(0.0, 1.0) as f32;
    let mix = |x: f32, y: f32| x + t * (y - x);
    let nearer = if t <= 0.5 { a } else { b };
    let normal: [f32; 3] = std::array::from_fn(|k| mix(a.normal[k], b.normal[k]));
    SemanticPoint {
        position: position.map(|c| c as f32),
        normal: unit(normal, 1e-3).unwrap_or(nearer.normal),
        color: std::array::from_fn(|k| mix(a.color[k].into(), b.color[k].into()).round().clamp(0.0, 255.0) as u8),
        confidence: mix(a.confidence, b.confidence),
        defect_confidence: if a.defect == b.defect {
            mix(a.defect_confidence, b.defect_confidence)
        } else {
            nearer.defect_confidence
        },
        sigma: mix(a.sigma, b.sigma),
        defect_sigma: mix(a.defect_sigma, b.defect_sigma),
        views: mix(a.views.into(), b.views.into()).round() as u16,
        ..*nearer
    }
}
