//! Which object of one view is which of another. A scene lists the objects of each view in an order of its own, so a place
//! in the list identifies nothing: an object is known by its `obj_id`, and among several of one kind by where it stands in
//! the scene (`cam_t_m2c` under the camera's pose). Where no poses are recorded several of a kind are told apart by their
//! order alone, which the source then says.

use super::metadata::ListedObject;
use nalgebra::{Isometry3, Point3};
use std::collections::{BTreeMap, HashMap};

/// An object is another one if it stands farther from where that was last than this share of its distance from the camera.
const NEAR: f64 = 0.1;
/// Objects whose recorded distance is less than this, in millimetres, are recorded in metres.
const NO_DISTANCE: f64 = 20.0;

/// The objects of one view.
#[derive(Clone, Debug)]
pub(super) struct ViewObjects {
    pub(super) view: u32,
    pub(super) table_from_camera: Option<Isometry3<f64>>,
    pub(super) objects: Vec<ListedObject>,
}

/// The instance of each object of each view, by (view, place in its list); from 1.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Instances {
    numbers: HashMap<(u32, u32), u16>,
    /// Whether several objects of a kind are told apart by their order in the lists.
    pub(super) by_order: bool,
}

/// An object that was seen before.
struct Known {
    class: u16,
    /// Among those of its class in the order of the lists.
    occurrence: usize,
    /// Table frame, metres.
    position: Option<Point3<f64>>,
}

impl Instances {
    /// Follows the objects through the views.
    pub(super) fn track(views: &[ViewObjects]) -> Self {
        let unit = object_unit(views);
        let mut most: BTreeMap<u16, usize> = BTreeMap::new();
        for view in views {
            for object in &view.objects {
                let same = view.objects.iter().filter(|o| o.class == object.class).count();
                let entry = most.entry(object.class).or_default();
                *entry = same.max(*entry);
            }
        }
        let mut known: Vec<Known> = Vec::new();
        let mut instances = Self::default();
        for ViewObjects { view, table_from_camera, objects } in views {
            for (class, count) in &most {
                let here: Vec<&ListedObject> = objects.iter().filter(|o| o.class == *class).collect();
                let place = |o: &ListedObject| {
                    let p = Point3::from(o.in_camera? * unit);
                    Some(((*table_from_camera)? * p, NEAR * p.coords.norm()))
                };
                let places: Vec<Option<(Point3<f64>, f64)>> = here.iter().map(|o| place(o)).collect();
                // One of its kind needs no place; of several, each needs one.
                let alone = *count == 1;
                let placed = !alone && places.iter().all(Option::is_some);
                instances.by_order |= !alone && !here.is_empty() && !placed;
                let mut found: Vec<Option<usize>> = vec![None; here.len()];
                if placed {
                    assign_nearest(&known, *class, &places, &mut found);
                }
                for (occurrence, (object, found)) in here.iter().zip(&mut found).enumerate() {
                    let by_order = || known.iter().position(|k| k.class == *class && k.occurrence == occurrence);
                    let at = found.or_else(|| if placed { None } else { by_order() });
                    let position = places[occurrence].map(|(p, _)| p);
                    let at = at.unwrap_or_else(|| {
                        let occurrence = known.iter().filter(|k| k.class == *class).count();
                        known.push(Known { class: *class, occurrence, position });
                        known.len() - 1
                    });
                    // Where it was last: small errors of the poses do not add up.
                    known[at].position = position.or(known[at].position);
                    let number = u16::try_from(at + 1).unwrap_or(u16::MAX);
                    instances.numbers.insert((*view, object.place), number);
                }
            }
        }
        instances
    }

    /// The instance of the object at `place` of a view's list; 0 if it is not known.
    pub(super) fn of(&self, view: u32, place: u32) -> u16 {
        self.numbers.get(&(view, place)).copied().unwrap_or(0)
    }
}

/// Gives the objects at `places` to the known ones of their class, the nearest pair first, one to one.
fn assign_nearest(known: &[Known], class: u16, places: &[Option<(Point3<f64>, f64)>], found: &mut [Option<usize>]) {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, (p, reach)) in places.iter().enumerate().filter_map(|(i, place)| Some((i, (*place)?))) {
        for (k, position) in
            known.iter().enumerate().filter_map(|(k, o)| Some((k, (o.class == class).then_some(o.position?)?)))
        {
            let distance = (p - position).norm();
            if distance <= reach {
                pairs.push((distance, i, k));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (_, i, k) in pairs {
        if found[i].is_none() && !found.contains(&Some(k)) {
            found[i] = Some(k);
        }
    }
}

/// Metres of a 1 in `cam_t_m2c`: millimetres, as BOP has it, unless all objects would stand at the lens.
fn object_unit(views: &[ViewObjects]) -> f64 {
    let distances = views.iter().flat_map(|v| &v.objects).filter_map(|o| Some(o.in_camera?.norm()));
    let mut distances: Vec<f64> = distances.filter(|d| *d > 0.0).collect();
    distances.sort_by(f64::total_cmp);
    let is_metres = distances.get(distances.len() / 2).is_some_and(|d| *d < NO_DISTANCE);
    if is_metres { 1.0 } else { 1e-3 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// Objects (class, place in the scene in metres) seen from a camera at `x`, in the order given.
    fn view(view: u32, x: Option<f64>, objects: &[(u16, [f64; 3])]) -> ViewObjects {
        let pose = Isometry3::translation(x.unwrap_or(0.0), 0.0, 0.0);
        let objects = (0..).zip(objects).map(|(place, (class, at))| ListedObject {
            place,
            class: *class,
            in_camera: Some((pose.inverse() * Point3::from(*at)).coords * 1e3),
        });
        ViewObjects { view, table_from_camera: x.map(|_| pose), objects: objects.collect() }
    }

    const LEFT: (u16, [f64; 3]) = (1, [-0.1, 0.0, 0.6]);
    const RIGHT: (u16, [f64; 3]) = (1, [0.1, 0.0, 0.6]);
    const OTHER: (u16, [f64; 3]) = (2, [0.0, 0.1, 0.6]);

    #[test]
    fn an_object_keeps_its_number_whatever_the_order() {
        let views = [
            view(0, Some(0.0), &[LEFT, RIGHT, OTHER]),
            view(1, Some(0.05), &[OTHER, RIGHT, LEFT]),
            view(2, Some(0.1), &[RIGHT]),
        ];
        let instances = Instances::track(&views);
        assert_eq!([0, 1, 2].map(|p| instances.of(0, p)), [1, 2, 3]);
        assert_eq!([0, 1, 2].map(|p| instances.of(1, p)), [3, 2, 1]);
        assert_eq!(instances.of(2, 0), 2);
        assert!(!instances.by_order);
        let mut metres = views.clone();
        for object in metres.iter_mut().flat_map(|v| &mut v.objects) {
            object.in_camera = object.in_camera.map(|t: Vector3<f64>| t * 1e-3);
        }
        assert_eq!(Instances::track(&metres), instances);
    }

    #[test]
    fn without_poses_kinds_still_identify_and_order_is_said() {
        let views = [view(0, None, &[LEFT, OTHER]), view(1, None, &[OTHER, LEFT])];
        let instances = Instances::track(&views);
        assert_eq!((instances.of(0, 0), instances.of(1, 1)), (1, 1));
        assert!(!instances.by_order, "one of each kind");
        let views = [view(0, None, &[LEFT, RIGHT]), view(1, None, &[RIGHT, LEFT])];
        assert!(Instances::track(&views).by_order);
    }
}
