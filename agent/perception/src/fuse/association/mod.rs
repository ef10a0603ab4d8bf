//! Data association: which objects of the model the objects of a view are ([Eye-in-hand 2020], section 3.3).
//!
//! Two tests. [`by_gravity_centre`] is the paper's: of the model's objects of the same class, the one whose gravity
//! centre is nearest; accepted if more than half of the points lie within zeta = 2 mm of it, else a misidentification.
//! Gravity centres of partial views move, so there is also [`by_overlap`]: seen from the view, the share of surface
//! that both have in common, `min(|A & B| / |A|, |A & B| / |B|)`, over the surface that view and model both show.
//!
//! Both are pure functions. What they refuse is an event of the inspection, with its reason; it is not dropped silently.

use crate::organized::OrganizedCloud;
use crate::register::ModelView;
use crate::segment::Segmentation;
use nalgebra::{Isometry3, Point3};
use semascan_geometry::measure::NearestPoints;
use semascan_geometry::vote::{most_frequent, most_frequent_of_each};
use std::collections::BTreeMap;

/// An object of a view or of the model, with its points in one frame, metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjectCloud {
    /// Instance; 0 = not separated.
    pub instance: u16,
    /// Component class.
    pub class: u16,
    /// Points.
    pub points: Vec<[f32; 3]>,
}

/// An object of a view that is not what its label says, or that cannot be placed.
#[derive(Clone, Debug, PartialEq)]
pub struct Misidentification {
    /// Instance in the view.
    pub instance: u16,
    /// Class the view gives it.
    pub class: u16,
    /// The model's object it was compared with.
    pub against: u16,
    /// Class of that object.
    pub model_class: u16,
    /// What the test measured: the share of close points, or the overlap.
    pub share: f64,
}

/// The objects of a view, associated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Association {
    /// Model instance of each view instance that has one; instances that are refused are missing.
    pub model_instance: BTreeMap<u16, u16>,
    /// Instances of the model that this view begins.
    pub begun: Vec<u16>,
    /// What was found to be wrong.
    pub misidentified: Vec<Misidentification>,
}

impl Association {
    /// The view's `instances` in the model's numbers; what has none becomes 0.
    pub fn renumber(&self, instances: &[u16]) -> Vec<u16> {
        instances.iter().map(|i| self.model_instance.get(i).copied().unwrap_or(0)).collect()
    }

    fn begin(&mut self, instance: u16, next: &mut u16) {
        self.model_instance.insert(instance, *next);
        self.begun.push(*next);
        *next = next.saturating_add(1);
    }
}

/// The test of [`by_gravity_centre`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GravityCentre {
    /// Largest distance of a point from the model's object, metres.
    pub zeta: f32,
    /// Share of the points that must be closer.
    pub share: f64,
}

impl Default for GravityCentre {
    fn default() -> Self {
        Self { zeta: 2e-3, share: 0.5 }
    }
}

/// The test of [`by_overlap`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Least overlap of one and the same object.
    pub share: f64,
    /// Largest distance along the ray between the surfaces of view and model, metres.
    pub reach: f32,
    /// Fewest pixels of the model's picture that both must show for a verdict.
    pub fewest: u32,
}

impl Default for Overlap {
    fn default() -> Self {
        Self { share: 0.3, reach: 4e-3, fewest: 20 }
    }
}

/// The test of [Eye-in-hand 2020]. An object of a class that the model does not have begins a new instance, from `next` on.
pub fn by_gravity_centre(
    view: &[ObjectCloud],
    model: &[ObjectCloud],
    next: u16,
    config: &GravityCentre,
) -> Association {
    let mut association = Association::default();
    let mut next = next.max(1);
    for object in view.iter().filter(|o| !o.points.is_empty()) {
        let Some(centre) = gravity_centre(&object.points) else { continue };
        let apart = |m: &ObjectCloud| gravity_centre(&m.points).map_or(f64::INFINITY, |c| (c - centre).norm());
        let same_class = model.iter().filter(|m| m.class == object.class && !m.points.is_empty());
        let nearest = same_class.min_by(|a, b| apart(a).total_cmp(&apart(b)).then(a.instance.cmp(&b.instance)));
        let Some(nearest) = nearest else {
            association.begin(object.instance, &mut next);
            continue;
        };
        let near = NearestPoints::new(&nearest.points);
        let close = object.points.iter().filter(|&&p| near.nearest_within(p, config.zeta).is_some()).count();
        let share = close as f64 / object.points.len() as f64;
        if share > config.share {
            association.model_instance.insert(object.instance, nearest.instance);
        } else {
            association.misidentified.push(Misidentification {
                instance: object.instance,
                class: object.class,
                against: nearest.instance,
                model_class: nearest.class,
                share,
            });
        }
    }
    association
}

/// The overlap test. `cloud` and `segmentation` are the view's, `table_from_camera` its estimated pose; `model` shows
/// the model from about there. An instance that overlaps none enough begins a new one, from `next` on. One that overlaps
/// an object of another class keeps to that object, and is reported.
pub fn by_overlap(
    cloud: &OrganizedCloud,
    segmentation: &Segmentation,
    table_from_camera: &Isometry3<f64>,
    model: &ModelView,
    next: u16,
    config: &Overlap,
) -> Association {
    let seen = project(cloud, segmentation, table_from_camera, model, config.reach);
    // Pixels of the model's picture by (view instance, model instance); a pixel counts once for each pair.
    let mut shared: BTreeMap<(u16, u16), u32> = BTreeMap::new();
    let (mut of_view, mut of_model): (BTreeMap<u16, u32>, BTreeMap<u16, u32>) = Default::default();
    let mut last_pixel = None;
    for &(pixel, instance) in &seen {
        let there = model.instances.get(pixel as usize).copied().unwrap_or(0);
        *shared.entry((instance, there)).or_default() += 1;
        *of_view.entry(instance).or_default() += 1;
        if last_pixel != Some(pixel) {
            *of_model.entry(there).or_default() += 1;
            last_pixel = Some(pixel);
        }
    }
    let mut association = Association::default();
    let mut next = next.max(1);
    for (instance, class) in classes_of(segmentation) {
        let a = of_view.get(&instance).copied().unwrap_or(0);
        let candidates = shared.range((instance, 1)..=(instance, u16::MAX)).map(|(&(_, there), &both)| {
            let b = of_model.get(&there).copied().unwrap_or(0).max(1);
            (f64::from(both) / f64::from(a.max(1).max(b)), there)
        });
        let best = candidates.max_by(|p, q| p.0.total_cmp(&q.0).then(q.1.cmp(&p.1)));
        match best.filter(|b| a >= config.fewest && b.0 >= config.share) {
            None => association.begin(instance, &mut next),
            Some((share, there)) => {
                association.model_instance.insert(instance, there);
                let model_class = class_in(model, there);
                if model_class != class {
                    let found = Misidentification { instance, class, against: there, model_class, share };
                    association.misidentified.push(found);
                }
            }
        }
    }
    association
}

/// Which pixels of the model's picture each instance of the view falls on, where both show the same surface; in order,
/// each pair once. Pixels of the view without an instance count as instance 0.
fn project(
    cloud: &OrganizedCloud,
    segmentation: &Segmentation,
    table_from_camera: &Isometry3<f64>,
    model: &ModelView,
    reach: f32,
) -> Vec<(u32, u16)> {
    let model_from_view = model.table_from_camera.inverse() * table_from_camera;
    let k = &model.intrinsics;
    let mut seen: Vec<(u32, u16)> = (0..cloud.depth.len())
        .filter_map(|i| {
            let p = model_from_view * cloud.point(i)?;
            let (u, v) = k.project(&p)?;
            let (u, v) = (u.round(), v.round());
            if !(u >= 0.0 && v >= 0.0 && u < f64::from(k.width) && v < f64::from(k.height)) {
                return None;
            }
            let pixel = v as usize * k.width as usize + u as usize;
            let z = model.points.get(pixel)?[2];
            let here = z > 0.0 && (z - p.z as f32).abs() <= reach;
            here.then(|| (pixel as u32, segmentation.instances.get(i).copied().unwrap_or(0)))
        })
        .collect();
    seen.sort_unstable();
    seen.dedup();
    seen
}

/// The instances of a view (0 left out) and the class that most of their pixels have.
fn classes_of(segmentation: &Segmentation) -> BTreeMap<u16, u16> {
    let labels =
        segmentation.instances.iter().enumerate().map(|(i, &instance)| (instance, segmentation.components.best(i)));
    most_frequent_of_each(labels.filter(|(instance, _)| *instance != 0))
}

/// Class that most pixels of the model's object show.
fn class_in(model: &ModelView, instance: u16) -> u16 {
    let shown = model.instances.iter().zip(&model.labels).filter(|(i, _)| **i == instance);
    most_frequent(shown.map(|(_, label)| *label)).unwrap_or(0)
}

fn gravity_centre(points: &[[f32; 3]]) -> Option<Point3<f64>> {
    let sum = points.iter().fold([0.0_f64; 3], |s, p| [0, 1, 2].map(|a| s[a] + f64::from(p[a])));
    (!points.is_empty()).then(|| Point3::from(sum.map(|s| s / points.len() as f64)))
}

#[cfg(test)]
mod tests;
