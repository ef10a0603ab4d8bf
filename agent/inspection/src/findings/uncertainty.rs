//! Uncertainty of area and extent of a region, after the GUM ([JCGM 100]): each source of error has a standard uncertainty, by
//! statistics (type A) or by what is known of it (type B); they are summed in squares, and the sum times k = 2 is stated.
//!
//! Pixels at the rim of a region are no independent witnesses: what moves the rim at one place moves it beside, too. An error
//! that is common to a whole rim of length P and moves it by d changes the area by P d; one that is alike over a length L
//! only, and differs from there on, changes it by d sqrt(P L). Both kinds are kept apart:
//!
//! | source | of the area | type |
//! |---|---|---|
//! | grid: where between two voxels the rim lies | d sqrt(P L), d in voxels | B |
//! | rim to another component: the crease there is blurred by voxels and pixels | P d, alike all along | B |
//! | rim to what was not seen: how far the surface reaches beyond its last voxel | P d, alike all along | B |
//! | the convention of areas: roughness, creases | a share of the area | B |
//! | labels: their standard uncertainty u moves the rim to where the probability is 0.5 + u or 0.5 - u; networks err alike along a rim | half the difference of these two areas | A |
//! | poses: a shift of all labels leaves the area as it is; but where views that saw opposite rims are shifted against each other, the region becomes longer or shorter | width x shift | A |
//!
//! Of a region that a person drew labels say nothing: what is measured is the surface within the curve as it was drawn.
//!
//! The figures of type B are those of simulated motors (2001 to 2005) other than those that the coverage is tested on:
//! `semascan tables findings` (1001 to 1010), `agent/evaluation/tests/findings` (3001 to 3003).

use super::extent::Extent;
use super::outline::Outline;
use super::regions::Region;
use super::surface::Surface;
use nalgebra::{Isometry3, Matrix3, Matrix3x6, Matrix6, Point3, Vector3};
use semascan_model::finding::{AreaBudget, FindingView, Quantity};
use std::collections::{BTreeMap, BTreeSet};

/// Standard uncertainty of the place of a rim within a component, voxels.
const GRID: f64 = 0.45;
/// Length over which that is alike, voxels.
const ALIKE: f64 = 5.0;
/// Of the place of a rim to another component, voxels, alike all along.
const CREASE: f64 = 0.38;
/// Of the place of a rim to what was not seen, voxels, alike all along.
const UNSEEN: f64 = 0.55;
/// Of the convention of areas, a share of the area.
const CONVENTION: f64 = 0.015;
/// Of each end of a length, voxels: thin ends are lost between voxels.
const END: f64 = 1.5;
/// Of lengths on a mesh, a share of the length.
const METRIC: f64 = 0.02;
/// How far from a region vertices are looked at that may belong to it, in vertices.
const REACH: u32 = 8;

/// Where a view was and how well that is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnownPose {
    /// The pose.
    pub(crate) table_from_camera: Isometry3<f64>,
    /// Its covariance over (rotation, translation), camera frame: `true = estimate * exp(xi)`.
    pub(crate) covariance: Matrix6<f64>,
}

/// Area, length and width of a region with their uncertainties, and what that of the area is made of. `labels` is the part of its
/// labels ([`label_part`]); `seen` are the views that saw it; `poses` are those of views whose covariance is known.
pub(crate) fn figures(
    surface: &Surface<'_>,
    region: &Region,
    (outline, extent): (&Outline, Extent),
    labels: f64,
    seen: &[FindingView],
    poses: &BTreeMap<u32, KnownPose>,
) -> ([Quantity; 3], AreaBudget) {
    let voxel = surface.voxel;
    let area = region.area(surface);
    let shift = relative_shift(surface, region, seen, poses);
    let budget = AreaBudget {
        grid: GRID * voxel * (outline.along_component * ALIKE * voxel).sqrt(),
        other_components: CREASE * voxel * outline.along_others,
        unseen: UNSEEN * voxel * outline.along_unseen,
        convention: CONVENTION * area,
        labels,
        poses: shift.map(|shift| shift * extent.width),
    };
    // How far labels move the whole rim, both ends of a length with it.
    let rim = labels / outline.length().max(voxel);
    // Without a covariance of any pose nobody can say how far off a figure is.
    let of_extent = |length: f64| {
        let ends = std::f64::consts::SQRT_2 * END * voxel;
        shift.map(|shift| root_of_squares(&[ends, 2.0 * rim, shift, METRIC * length]))
    };
    let quantity = |value: f64, standard: Option<f64>| match standard {
        Some(standard) => Quantity::with_standard(value, standard),
        None => Quantity::without_uncertainty(value),
    };
    let Extent { length, width } = extent;
    let quantities =
        [quantity(area, budget.combined()), quantity(length, of_extent(length)), quantity(width, of_extent(width))];
    (quantities, budget)
}

/// Area of a whole component: the convention's share is all that is known of it.
pub(crate) fn of_component(area: f64) -> Quantity {
    Quantity::with_standard(area, CONVENTION * area)
}

fn root_of_squares(parts: &[f64]) -> f64 {
    parts.iter().map(|p| p * p).sum::<f64>().sqrt()
}

/// Standard uncertainty of the area by that of the labels, square metres: half the difference of the areas where the
/// probability of the class, moved by its standard uncertainty up or down everywhere at once, is above one half.
pub(crate) fn label_part(surface: &Surface<'_>, region: &Region) -> f64 {
    let vertices = &surface.mesh.vertices;
    // Sigma is the root of the squares of all classes' uncertainties; of two classes that share a place each has this part.
    let own = |v: u32| f64::from(vertices.defect_sigma[v as usize]) * std::f64::consts::FRAC_1_SQRT_2;
    let best = |v: u32| f64::from(vertices.defect_confidence[v as usize]);
    let area = |v: u32| surface.areas[v as usize];
    let lost: f64 =
        region.vertices.iter().filter(|v| best(**v) - own(**v) < 0.5 && own(**v) > 0.0).map(|v| area(*v)).sum();
    let mut seen: BTreeSet<u32> = BTreeSet::new();
    let (mut edge, mut won) = (region.vertices.clone(), 0.0);
    for _ in 0..REACH {
        let mut next = Vec::new();
        for &w in edge.iter().flat_map(|v| surface.neighbours(*v)) {
            // What its best class leaves is at most the probability of this one.
            let may_be = surface.component(w) == region.component && 1.0 - best(w) + own(w) > 0.5 && own(w) > 0.0;
            if may_be && !region.holds(w) && seen.insert(w) {
                won += area(w);
                next.push(w);
            }
        }
        edge = next;
    }
    0.5 * (lost + won)
}

/// Standard uncertainty in metres of the shift along the surface of what one view saw of the region against what the others
/// saw; `None` where no view's covariance is known.
fn relative_shift(
    surface: &Surface<'_>,
    region: &Region,
    seen: &[FindingView],
    poses: &BTreeMap<u32, KnownPose>,
) -> Option<f64> {
    let middle = Point3::from([0, 1, 2].map(|k| region.mean(surface, |v| surface.position(v)[k])));
    let normal = Vector3::from([0, 1, 2].map(|k| region.mean(surface, |v| surface.normal(v).map_or(0.0, |n| n[k]))));
    let (mut sum, mut weight, mut views) = (0.0, 0.0, 0.0);
    for view in seen {
        let Some(pose) = poses.get(&view.view) else { continue };
        let variance = variance_along_surface(pose, &middle, &normal);
        sum += view.share * variance;
        weight += view.share;
        views += 1.0;
    }
    // The mean of n views scatters by the nth part.
    (weight > 0.0).then(|| (sum / weight / views).sqrt())
}

/// Variance in square metres of the place of `point` along one direction of the surface.
fn variance_along_surface(pose: &KnownPose, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
    let p = pose.table_from_camera.inverse_transform_point(point);
    let mut jacobian = Matrix3x6::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-p.coords.cross_matrix()));
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
    let covariance = jacobian * pose.covariance * jacobian.transpose();
    let n = pose.table_from_camera.inverse_transform_vector(normal).try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
    (0.5 * (covariance.trace() - n.dot(&(covariance * n)))).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{grid, with_defect};
    use super::super::regions::defect_regions;
    use super::*;
    use semascan_model::SemanticMesh;
    use semascan_model::finding::PixelBox;

    fn disc(radius: f32) -> SemanticMesh {
        with_defect(grid(61, 61, |_, _| 0.0), |x, y| (x - 30.2).hypot(y - 29.7) < radius)
    }

    fn area(mesh: &SemanticMesh, covariance: Option<f64>) -> Quantity {
        let surface = Surface::new(mesh, 1e-3);
        let region = &defect_regions(&surface)[0];
        let table_from_camera = Isometry3::face_towards(
            &Point3::new(0.03, 0.03, 0.4),
            &Point3::new(0.03, 0.03, 0.0),
            &Vector3::new(0.0, -1.0, 0.0),
        );
        let poses =
            covariance.map(|variance| (3, KnownPose { table_from_camera, covariance: Matrix6::identity() * variance }));
        let seen =
            FindingView { view: 3, pixels: PixelBox { left: 0, top: 0, width: 1, height: 1 }, share: 1.0, cosine: 1.0 };
        let measured = (&Outline::of(&surface, region), Extent::of(&surface, region));
        figures(&surface, region, measured, label_part(&surface, region), &[seen], &poses.into_iter().collect()).0[0]
    }

    #[test]
    fn the_uncertainty_of_a_small_region_is_a_larger_share_of_it() {
        let share = |radius: f32| {
            let q = area(&disc(radius), Some(1e-12));
            q.expanded.expect("known") / q.value
        };
        assert!(share(4.0) > 2.0 * share(16.0), "{} {}", share(4.0), share(16.0));
    }

    #[test]
    fn uncertain_poses_and_labels_enlarge_it_and_unknown_poses_leave_it_unknown() {
        let certain = area(&disc(10.0), Some(1e-12));
        assert!(area(&disc(10.0), Some(1e-6)).expanded > certain.expanded);
        assert_eq!(area(&disc(10.0), None), Quantity::without_uncertainty(certain.value));
        // Labels that fade over two millimetres, each uncertain by 0.2 around its own probability.
        let mut faded = disc(10.0);
        for v in 0..faded.len() {
            let [x, y, _] = faded.vertices.positions[v].map(|c| c * 1e3);
            let inside = (0.5 + (10.0 - (x - 30.2).hypot(y - 29.7)) / 4.0).clamp(0.0, 1.0);
            faded.vertices.defect_confidence[v] = inside.max(1.0 - inside);
            faded.vertices.defect_sigma[v] = 0.2 * std::f32::consts::SQRT_2;
        }
        let uncertain = area(&faded, Some(1e-12));
        // The rim is where the probability is 0.3 to 0.7: 0.8 mm to either side.
        let expected = 2.0 * std::f64::consts::TAU * 10.0 * 0.8 * 1e-6;
        let added = (uncertain.expanded.expect("known").powi(2) - certain.expanded.expect("known").powi(2)).sqrt();
        assert!((added / expected - 1.0).abs() < 0.25, "{added} for {expected}");
    }

    #[test]
    fn a_rotation_of_the_camera_moves_what_is_far_from_it_farther() {
        let mut covariance = Matrix6::zeros();
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * 1e-6));
        let pose = KnownPose { table_from_camera: Isometry3::identity(), covariance };
        let at = |z: f64| variance_along_surface(&pose, &Point3::new(0.0, 0.0, z), &Vector3::z()).sqrt();
        assert!((at(0.5) - 0.5e-3).abs() < 1e-9 && (at(1.0) - 1e-3).abs() < 1e-9);
    }
}
