//! Tests of data association.

use super::*;
use crate::segment::ClassField;
use crate::view::{DepthImage, Intrinsics};
use nalgebra::Vector3;
use proptest::prelude::*;

fn square(instance: u16, class: u16, x: f32) -> ObjectCloud {
    let points = (0..400).map(|i| [x + (i % 20) as f32 * 1e-3, (i / 20) as f32 * 1e-3, 0.0]).collect();
    ObjectCloud { instance, class, points }
}

#[test]
fn the_nearest_gravity_centre_of_the_same_class_is_taken() {
    let model = [square(1, 4, 0.0), square(2, 4, 0.1), square(3, 5, 0.011)];
    let view = [square(1, 4, 0.0995), square(2, 4, 0.0005), square(3, 6, 0.0)];
    let association = by_gravity_centre(&view, &model, 4, &GravityCentre::default());
    assert_eq!(association.model_instance, BTreeMap::from([(1, 2), (2, 1), (3, 4)]));
    assert_eq!(association.begun, [4], "no object of class 6 yet");
    assert_eq!(association.renumber(&[0, 3, 1, 9]), [0, 4, 2, 0]);
}

#[test]
fn too_few_close_points_are_a_misidentification() {
    let model = [square(7, 4, 0.0)];
    // Half of the square and 2 mm are beyond; a little nearer, more than half is close.
    let far = by_gravity_centre(&[square(1, 4, 0.013)], &model, 8, &GravityCentre::default());
    assert!(far.model_instance.is_empty() && far.begun.is_empty());
    assert_eq!((far.misidentified[0].instance, far.misidentified[0].against), (1, 7));
    assert!((0.4..=0.5).contains(&far.misidentified[0].share), "{far:?}");
    let near = by_gravity_centre(&[square(1, 4, 0.010)], &model, 8, &GravityCentre::default());
    assert_eq!(near.model_instance, BTreeMap::from([(1, 7)]));
}

const K: Intrinsics = Intrinsics { width: 80, height: 60, fx: 80.0, fy: 80.0, cx: 39.5, cy: 29.5 };

/// A wall at 0.5 m with two objects side by side, `shift` pixels to the right; `cut` columns on the left see nothing.
fn wall(shift: usize, cut: usize, ids: [u16; 2], classes: [u16; 2]) -> (OrganizedCloud, Segmentation) {
    let at = |i: usize| match ((i % 80).wrapping_sub(shift), i / 80) {
        (10..30, 15..45) => Some(0),
        (40..60, 15..45) => Some(1),
        _ => None,
    };
    let pick = |of: [u16; 2]| (0..4800).map(|i| at(i).map_or(0, |k: usize| of[k])).collect::<Vec<u16>>();
    let metres = (0..4800).map(|i| if i % 80 < cut { 0.0 } else { 0.5 }).collect();
    let cloud = OrganizedCloud::new(K, &DepthImage { width: 80, height: 60, metres }, None);
    let segmentation = Segmentation {
        components: ClassField::Hard(pick(classes)),
        defects: ClassField::Hard(vec![0; 4800]),
        instances: pick(ids),
        network: None,
    };
    (cloud, segmentation)
}

fn model_of((cloud, segmentation): &(OrganizedCloud, Segmentation), pose: &Isometry3<f64>) -> ModelView {
    let point = |i: usize| cloud.point(i).map_or([0.0; 3], |p| p.coords.cast::<f32>().into());
    ModelView {
        intrinsics: K,
        table_from_camera: *pose,
        points: (0..4800).map(point).collect(),
        normals: vec![[0.0, 0.0, -1.0]; 4800],
        labels: (0..4800).map(|i| segmentation.components.best(i)).collect(),
        instances: segmentation.instances.clone(),
    }
}

#[test]
fn overlap_finds_the_object_again_from_elsewhere() {
    let pose = Isometry3::new(Vector3::new(0.3, -0.1, 0.2), Vector3::new(0.1, 0.7, -0.3));
    let model = model_of(&wall(0, 0, [5, 9], [1, 2]), &pose);
    // The camera moved 5 pixels' worth to the left, so the wall appears 5 pixels to the right.
    let moved = pose * Isometry3::translation(-5.0 / 80.0 * 0.5, 0.0, 0.0);
    let (cloud, segmentation) = wall(5, 0, [1, 2], [1, 2]);
    let association = by_overlap(&cloud, &segmentation, &moved, &model, 10, &Overlap::default());
    assert_eq!(association.model_instance, BTreeMap::from([(1, 5), (2, 9)]));
    assert!(association.misidentified.is_empty() && association.begun.is_empty());
}

#[test]
fn a_partial_view_still_overlaps() {
    let pose = Isometry3::identity();
    let model = model_of(&wall(0, 0, [5, 9], [1, 2]), &pose);
    // Three quarters of the first object are out of sight: gravity centres are 7 pixels apart, the overlap is whole.
    let (cloud, segmentation) = wall(0, 25, [1, 2], [1, 2]);
    let association = by_overlap(&cloud, &segmentation, &pose, &model, 10, &Overlap::default());
    assert_eq!(association.model_instance, BTreeMap::from([(1, 5), (2, 9)]));
}

#[test]
fn another_class_is_reported_and_another_place_begins_anew() {
    let pose = Isometry3::identity();
    let model = model_of(&wall(0, 0, [5, 9], [1, 2]), &pose);
    let (cloud, segmentation) = wall(0, 0, [1, 2], [1, 3]);
    let flipped = by_overlap(&cloud, &segmentation, &pose, &model, 10, &Overlap::default());
    assert_eq!(flipped.model_instance, BTreeMap::from([(1, 5), (2, 9)]));
    let found = &flipped.misidentified[0];
    assert_eq!((found.instance, found.class, found.against, found.model_class), (2, 3, 9, 2));
    assert!(found.share > 0.9);
    // 15 pixels beside: no object overlaps any of the model by more than a quarter.
    let (cloud, segmentation) = wall(15, 0, [1, 2], [1, 2]);
    let elsewhere = by_overlap(&cloud, &segmentation, &pose, &model, 10, &Overlap::default());
    assert_eq!(elsewhere.begun, [10, 11]);
    // In front of the model: not the same surface.
    let nearer = Isometry3::translation(0.0, 0.0, -0.02);
    let (cloud, segmentation) = wall(0, 0, [1, 2], [1, 2]);
    let in_front = by_overlap(&cloud, &segmentation, &nearer, &model, 10, &Overlap::default());
    assert_eq!(in_front.begun, [10, 11]);
}

proptest! {
    #[test]
    fn any_clouds_are_associated(points in prop::collection::vec(prop::array::uniform3(prop::num::f32::ANY), 0..20)) {
        let object = |instance| ObjectCloud { instance, class: 1, points: points.clone() };
        let association = by_gravity_centre(&[object(1)], &[object(2)], 3, &GravityCentre::default());
        prop_assert!(association.model_instance.len() + association.misidentified.len() <= 1);
    }
}
