//! Figures of a finding that a person drew: the surface of the model within the curve is measured as that of findings that were
//! found. Labels say nothing of its rim, which the person drew: what is measured is the surface within the curve as it is.

use super::evidence::Evidence;
use super::regions::connected;
use super::surface::Surface;
use super::uncertainty::KnownPose;
use super::{figures_of, instances};
use nalgebra::Matrix6;
use semascan_geometry::measure::PatchSurface;
use semascan_model::SemanticMesh;
use semascan_model::record::InspectionRecord;
use semascan_model::review::DrawnFigures;
use semascan_perception::fuse::KeptDepth;
use std::collections::{BTreeMap, BTreeSet};

/// Pieces that are not connected with the largest one and have less than this share of its area are not worth a word.
const WORTH_A_WORD: f64 = 0.01;

/// What a person drew on.
pub(crate) struct DrawnOn<'a> {
    /// The mesh of the model.
    pub(crate) mesh: &'a SemanticMesh,
    /// Edge of the voxels that it was made of, metres.
    pub(crate) voxel: f64,
    /// The record, for the poses of its views.
    pub(crate) record: &'a InspectionRecord,
}

/// Figures of the surface within `curve` (metres, table frame) of a finding with these classes of component and defect (0 is none).
/// `depths` hands the depth of each view that the model was made of to its argument, or says why there is none.
///
/// # Errors
/// That of `depths`.
pub(crate) fn measure_drawn<E>(
    on: &DrawnOn<'_>,
    curve: &[[f64; 3]],
    (component, defect): (u16, u16),
    depths: impl FnOnce(&mut dyn FnMut(&KeptDepth<'_>)) -> Result<Option<String>, E>,
) -> Result<DrawnFigures, E> {
    let DrawnOn { mesh, voxel, record } = on;
    let within: BTreeSet<u32> = PatchSurface::new(mesh).within_curve(curve).into_iter().collect();
    let surface = Surface::new(mesh, *voxel);
    let mut pieces = connected(&surface, |v| within.contains(&v).then_some((component, defect)));
    // The earlier one of equals, so that it does not depend on anything else.
    pieces.sort_by(|a, b| b.area(&surface).total_cmp(&a.area(&surface)).then(a.vertices[0].cmp(&b.vertices[0])));
    let mut pieces = pieces.into_iter();
    let Some(region) = pieces.next() else {
        let note = Some("no surface of the model lies within the curve".to_owned());
        return Ok(DrawnFigures { note, ..DrawnFigures::default() });
    };
    let area = region.area(&surface);
    let others: Vec<f64> = pieces.map(|piece| piece.area(&surface)).filter(|own| *own > WORTH_A_WORD * area).collect();
    let mut evidence = Evidence::none(&region);
    let missing = depths(&mut |view| evidence.add_depth(&surface, &region, view))?;
    evidence.sort();
    let left_out = (!others.is_empty()).then(|| {
        let area = 1e6 * others.iter().sum::<f64>();
        let count = others.len();
        format!(
            "{count} smaller pieces of surface within the curve, {area:.1} mm2, are not connected with it and not in it"
        )
    });
    let no_views = missing.map(|reason| format!("which views saw it is not known: {reason}"));
    let notes: Vec<String> = left_out.into_iter().chain(no_views).collect();
    Ok(DrawnFigures {
        instances: instances(&surface, region.vertices.iter().copied()),
        region: Some(figures_of(&surface, &region, 0.0, evidence, &poses(record))),
        note: (!notes.is_empty()).then(|| notes.join("; ")),
    })
}

/// The poses of the record whose covariance is known.
fn poses(record: &InspectionRecord) -> BTreeMap<u32, KnownPose> {
    let known = record.views.iter().filter(|view| view.accepted).filter_map(|view| {
        let table_from_camera = crate::record::isometry(view.pose.as_ref()?);
        let covariance = Matrix6::from_fn(|row, column| view.covariance.map_or(f64::NAN, |c| c[row][column]));
        let is_known = covariance.iter().all(|value| value.is_finite());
        is_known.then_some((view.index, KnownPose { table_from_camera, covariance }))
    });
    known.collect()
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{grid, with_defect};
    use super::super::region_figures;
    use super::super::regions::defect_regions;
    use super::*;
    use crate::verdict::tests::record as any_record;
    use nalgebra::{Isometry3, Point3, Vector3};
    use semascan_perception::view::Intrinsics;
    use std::convert::Infallible;

    /// A circle on the plane, points a degree apart; millimetres.
    fn circle(x: f64, y: f64, radius: f64) -> Vec<[f64; 3]> {
        let at = |degrees: i32| {
            let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
            [1e-3 * (x + radius * cosine), 1e-3 * (y + radius * sine), 0.0]
        };
        (0..360).map(at).collect()
    }

    fn measured(mesh: &SemanticMesh, curve: &[[f64; 3]], views: &[KeptDepth<'_>]) -> DrawnFigures {
        let record = any_record(Vec::new());
        let on = DrawnOn { mesh, voxel: 1e-3, record: &record };
        let depths = |each: &mut dyn FnMut(&KeptDepth<'_>)| {
            views.iter().for_each(each);
            Ok::<_, Infallible>(views.is_empty().then(|| "the capture is gone".to_owned()))
        };
        measure_drawn(&on, curve, (1, 1), depths).expect("cannot fail")
    }

    #[test]
    fn a_curve_around_a_region_has_the_figures_of_that_region() {
        let pit = |x: u32, y: u32| if (x as f32 - 30.0).hypot(y as f32 - 30.0) < 7.5 { -1e-3 } else { 0.0 };
        let bare = grid(61, 61, pit);
        let labelled = with_defect(bare.clone(), |x, y| (x - 30.0).hypot(y - 30.0) < 10.3);
        let surface = Surface::new(&labelled, 1e-3);
        let region = &defect_regions(&surface)[0];
        let expected = region_figures(&surface, region, Evidence::none(region), &BTreeMap::new());
        let drawn = measured(&bare, &circle(30.0, 30.0, 10.3), &[]);
        assert_eq!(drawn.note.as_deref(), Some("which views saw it is not known: the capture is gone"));
        let found = drawn.region.expect("measured");
        assert_eq!((found.area, found.length, found.width), (expected.area, expected.length, expected.width));
        assert_eq!((&found.outlines, found.perimeter), (&expected.outlines, expected.perimeter));
        assert_eq!(found.depth.fitted, expected.depth.fitted);
        assert!((found.depth.fitted.expect("surrounded").value - 1e-3).abs() < 1e-4);
        let flat = std::f64::consts::PI * 10.3 * 10.3 * 1e-6;
        assert!((found.area.value / flat - 1.0).abs() < 0.05, "{:?}", found.area);
        assert_eq!(found.area.expanded, None, "nobody knows how well the poses are known");
    }

    #[test]
    fn views_that_saw_it_are_named_and_labels_do_not_make_it_uncertain() {
        let mut mesh = grid(61, 61, |_, _| 0.0);
        mesh.vertices.defect_sigma.fill(0.4);
        mesh.vertices.defect_confidence.fill(0.6);
        let intrinsics = Intrinsics { width: 160, height: 120, fx: 300.0, fy: 300.0, cx: 80.0, cy: 60.0 };
        let table_from_camera = Isometry3::face_towards(
            &Point3::new(0.03, 0.03, 0.3),
            &Point3::new(0.03, 0.03, 0.0),
            &Vector3::new(0.0, -1.0, 0.0),
        );
        let depth = |index: u32, metres: f32| KeptDepth {
            index,
            intrinsics,
            metres: vec![metres; 160 * 120].into(),
            table_from_camera,
        };
        let drawn = measured(&mesh, &circle(30.0, 30.0, 6.0), &[depth(4, 0.3), depth(5, 0.2), depth(6, 0.0)]);
        let region = drawn.region.expect("measured");
        assert_eq!(region.views.iter().map(|view| view.view).collect::<Vec<_>>(), [4], "what stood before it hid it");
        assert!((region.views[0].share - 1.0).abs() < 1e-9);
        assert!((region.confidence.mean - 0.6).abs() < 1e-6 && (region.sigma.all.mean - 0.4).abs() < 1e-6);
        assert_eq!((region.sigma.data, region.area_budget.labels), (None, 0.0));
        assert_eq!(drawn.note, None);
    }

    #[test]
    fn what_lies_beside_the_model_is_not_measured_and_a_second_piece_is_said() {
        let mut mesh = grid(61, 61, |_, _| 0.0);
        let beside = measured(&mesh, &circle(200.0, 200.0, 5.0), &[]);
        assert_eq!((beside.region, beside.instances), (None, vec![]));
        assert!(beside.note.expect("a reason").contains("no surface"));
        // A gap of the surface runs through the curve.
        let gap = |v: u32| (28..=29).contains(&(v % 61));
        mesh.triangles.retain(|t| !t.iter().any(|v| gap(*v)));
        let split = measured(&mesh, &circle(31.0, 30.0, 8.0), &[]);
        assert!(split.region.is_some_and(|region| region.position[0] > 0.03), "the larger one");
        let note = split.note.expect("a reason");
        assert!(note.contains("pieces of surface within the curve") && note.contains("mm2"), "{note}");
    }
}
