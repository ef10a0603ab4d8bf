//! Keeps the instances of successive views apart and together: the way of `association` through an inspection.
//!
//! Instances that a network finds are numbered by view. Before a view is fused they get the model's numbers; what the
//! test refuses is reported as an event and fused without an instance.

use super::association::{
    Association, GravityCentre, Misidentification, ObjectCloud, Overlap, by_gravity_centre, by_overlap,
};
use super::map::SemanticMap;
use crate::organized::OrganizedCloud;
use crate::segment::Segmentation;
use nalgebra::{Isometry3, Point3};
use semascan_geometry::vote::most_frequent_of_each;
use std::collections::BTreeMap;

/// How objects of a view are found among those of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AssociationTest {
    /// Common surface, as the view sees it.
    Overlap(Overlap),
    /// The nearest gravity centre, as in [Eye-in-hand 2020].
    GravityCentre(GravityCentre),
}

/// Gives the instances of each view the model's numbers.
#[derive(Clone, Copy, Debug)]
pub struct Associator {
    test: AssociationTest,
    /// The number of the next new object.
    next: u16,
}

impl Associator {
    /// Begins with an empty model.
    pub fn new(test: AssociationTest) -> Self {
        Self { test, next: 1 }
    }

    /// Renumbers the instances of `segmentation`, whose view `cloud` was taken from `table_from_camera`, by the objects of
    /// `map`; returns what was refused.
    pub fn associate(
        &mut self,
        map: Option<&SemanticMap>,
        cloud: &OrganizedCloud,
        table_from_camera: &Isometry3<f64>,
        segmentation: &mut Segmentation,
    ) -> Vec<Misidentification> {
        let found = match self.test {
            AssociationTest::Overlap(config) => match (map, cloud.median_depth()) {
                (Some(map), Some(depth)) => {
                    let model = map.render(map.model_camera(&cloud.intrinsics, depth), table_from_camera);
                    by_overlap(cloud, segmentation, table_from_camera, &model, self.next, &config)
                }
                _ => self.all_new(segmentation),
            },
            AssociationTest::GravityCentre(config) => {
                let of_model = map.map(objects_of_map).unwrap_or_default();
                let of_view = objects_of_view(cloud, segmentation, table_from_camera);
                by_gravity_centre(&of_view, &of_model, self.next, &config)
            }
        };
        segmentation.instances = found.renumber(&segmentation.instances);
        self.next = found.begun.iter().map(|n| n.saturating_add(1)).max().unwrap_or(self.next).max(self.next);
        found.misidentified
    }

    /// The first view: everything in it is new.
    fn all_new(&self, segmentation: &Segmentation) -> Association {
        let mut instances: Vec<u16> = segmentation.instances.iter().copied().filter(|i| *i != 0).collect();
        instances.sort_unstable();
        instances.dedup();
        let numbers = instances.into_iter().zip(self.next..);
        let model_instance: BTreeMap<u16, u16> = numbers.collect();
        let begun = model_instance.values().copied().collect();
        Association { model_instance, begun, misidentified: Vec::new() }
    }
}

/// Objects of a view in the table frame.
fn objects_of_view(
    cloud: &OrganizedCloud,
    segmentation: &Segmentation,
    table_from_camera: &Isometry3<f64>,
) -> Vec<ObjectCloud> {
    let points = segmentation.instances.iter().enumerate().filter(|(_, instance)| **instance != 0);
    gather(points.filter_map(|(i, &instance)| {
        let p: Point3<f64> = table_from_camera * cloud.point(i)?;
        Some((instance, segmentation.components.best(i), p.coords.cast::<f32>().into()))
    }))
}

/// Objects of the model.
fn objects_of_map(map: &SemanticMap) -> Vec<ObjectCloud> {
    let cloud = map.cloud();
    gather(cloud.iter().filter(|p| p.instance != 0).map(|p| (p.instance, p.label, p.position)))
}

/// Points by instance, each with the class that most of its points have.
fn gather(points: impl Iterator<Item = (u16, u16, [f32; 3])>) -> Vec<ObjectCloud> {
    let mut objects: BTreeMap<u16, ObjectCloud> = BTreeMap::new();
    let labels = points.map(|(instance, class, point)| {
        objects.entry(instance).or_default().points.push(point);
        (instance, class)
    });
    for (instance, class) in most_frequent_of_each(labels) {
        let object = objects.entry(instance).or_default();
        (object.instance, object.class) = (instance, class);
    }
    objects.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuse::{LabelledView, MapConfig};
    use crate::segment::ClassField;
    use crate::view::{DepthImage, Intrinsics};
    use image::RgbImage;

    const K: Intrinsics = Intrinsics { width: 120, height: 80, fx: 150.0, fy: 150.0, cx: 59.5, cy: 39.5 };

    /// A wall with two objects on it, the left one numbered `left`, the right one `right`.
    fn view(left: u16, right: u16) -> (OrganizedCloud, Segmentation) {
        let depth = DepthImage { width: 120, height: 80, metres: vec![0.5; 120 * 80] };
        let number = |i: usize| match i % 120 {
            15..45 => left,
            75..105 => right,
            _ => 0,
        };
        let instances: Vec<u16> = (0..120 * 80).map(number).collect();
        let classes = instances.iter().enumerate().map(|(i, n)| if *n == 0 { 0 } else { 1 + u16::from(i % 120 > 60) });
        let components = ClassField::Hard(classes.collect());
        (
            OrganizedCloud::new(K, &depth, None),
            Segmentation { components, defects: ClassField::Hard(vec![0; 120 * 80]), instances, network: None },
        )
    }

    #[test]
    fn objects_keep_their_numbers_however_views_number_them() {
        for test in
            [AssociationTest::Overlap(Overlap::default()), AssociationTest::GravityCentre(GravityCentre::default())]
        {
            let mut associator = Associator::new(test);
            let mut map = SemanticMap::new(MapConfig::new(4e-3, 3, 1)).expect("a map");
            for (index, (left, right)) in [(7, 3), (1, 2), (2, 1), (40, 41)].into_iter().enumerate() {
                let (cloud, mut segmentation) = view(left, right);
                let pose = Isometry3::identity();
                let before = (index > 0).then_some(&map);
                assert!(associator.associate(before, &cloud, &pose, &mut segmentation).is_empty());
                let rgb = RgbImage::new(120, 80);
                let view =
                    LabelledView { index: index as u32, cloud, rgb: rgb.into(), segmentation, table_from_camera: pose };
                map.integrate(&view).expect("fuses");
            }
            let mut numbers: Vec<u16> = map.cloud().instances;
            numbers.sort_unstable();
            numbers.dedup();
            assert_eq!(numbers, [0, 1, 2], "{test:?}");
        }
    }

    #[test]
    fn an_object_of_another_class_in_the_same_place_is_reported() {
        let mut associator = Associator::new(AssociationTest::Overlap(Overlap::default()));
        let mut map = SemanticMap::new(MapConfig::new(4e-3, 3, 1)).expect("a map");
        let (cloud, mut segmentation) = view(1, 2);
        let pose = Isometry3::identity();
        associator.associate(None, &cloud, &pose, &mut segmentation);
        let rgb = RgbImage::new(120, 80);
        map.integrate(&LabelledView { index: 0, cloud, rgb: rgb.into(), segmentation, table_from_camera: pose })
            .expect("fuses");
        let (cloud, mut wrong) = view(1, 2);
        wrong.components = ClassField::Hard(wrong.instances.iter().map(|n| if *n == 0 { 0 } else { 2 }).collect());
        let found = associator.associate(Some(&map), &cloud, &pose, &mut wrong);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].class, found[0].model_class), (2, 1));
    }
}
