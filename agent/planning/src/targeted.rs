//! Close looks at regions of interest ([Remanufacturing paper], step 4): a few poses of the cell from which their surface is
//! seen under the wanted incidence and at the wanted resolution.
//!
//! A pose sees a point where it lies in the picture and in the working distance, its incidence is small enough, a pixel covers
//! little enough of it ([`pixels_per_metre`]) and no surface stands before it ([`Occupancy`]). Of all poses the one is taken that
//! adds most, until nothing is added: the greedy cover, which needs at most `ln n` times as many sets as the best one
//! [Johnson 1974].

use crate::candidates::{Orbit, aimed, places};
use crate::reach::Reach;
use crate::regions::RegionOfInterest;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use semascan_geometry::occupancy::Occupancy;
use semascan_geometry::sight::pixels_per_metre;
use semascan_inspection::planning::Viewpoint;
use semascan_inspection::spec::TargetSpec;
use semascan_perception::view::Intrinsics;
use serde::Serialize;

/// Points of a region that poses are compared by.
const POINTS: usize = 80;
/// Share of a region's area that a further view must add.
const LEAST_SHARE: f64 = 0.02;

/// How the camera looks closely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Its pictures.
    pub intrinsics: Intrinsics,
    /// Largest angle of incidence, radians.
    pub incidence: f64,
    /// Metres of the surface that a pixel covers at most.
    pub pixel: f64,
}

impl Camera {
    /// `intrinsics` as closely as `target` says.
    pub fn new(intrinsics: Intrinsics, target: &TargetSpec) -> Self {
        Self { intrinsics, incidence: target.incidence_deg.to_radians(), pixel: target.pixel_mm * 1e-3 }
    }
}

/// The poses, and what they show.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetedPlan {
    /// In the order in which they add most.
    pub views: Vec<TargetedView>,
    /// One for each region, in their order.
    pub regions: Vec<RegionOutcome>,
}

/// A pose for a close look.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetedView {
    /// The pose.
    pub viewpoint: Viewpoint,
    /// The regions that it shows, by their place.
    pub regions: Vec<usize>,
    /// Surface that it shows and none before it did, square metres.
    pub area: f64,
}

/// How closely a region is seen. Shares are of its area.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RegionOutcome {
    /// The region.
    pub name: String,
    /// Square metres.
    pub area: f64,
    /// Seen as closely as wanted by the planned views.
    pub seen: f64,
    /// What any pose of the cell sees as closely as wanted.
    pub reachable: f64,
    /// What any pose sees under the wanted incidence, however coarse.
    pub within_incidence: f64,
    /// What any pose sees at all.
    pub visible: f64,
    /// Finest resolution, metres of the surface a pixel, at which half of what is seen under the wanted incidence can be seen;
    /// absent where nothing is.
    pub finest_pixel: Option<f64>,
    /// Focal length in pixels with which it would be as fine as wanted.
    pub needed_focal: Option<f64>,
}

/// What a pose shows of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sight {
    visible: bool,
    within_incidence: bool,
    /// Metres a pixel.
    pixel: f32,
}

/// Plans at most `views` close looks at `regions` of the surface with these vertices (metres, table frame), which lie about
/// `spacing` metres apart.
pub fn look_closely(
    regions: &[RegionOfInterest],
    (vertices, spacing): (&[[f32; 3]], f64),
    camera: &Camera,
    reach: &Reach,
    views: u32,
) -> TargetedPlan {
    let Some(occupancy) = Occupancy::of(vertices, spacing) else {
        return TargetedPlan { views: Vec::new(), regions: Vec::new() };
    };
    let points: Vec<Point> = regions.iter().enumerate().flat_map(|(i, region)| thinned(i, region)).collect();
    let poses = close_poses(regions, reach);
    let sights: Vec<Vec<Sight>> = poses
        .par_iter()
        .map(|pose| points.iter().map(|point| sight(pose, point, camera, reach, &occupancy)).collect())
        .collect();
    let suits = |sight: &Sight| sight.within_incidence && f64::from(sight.pixel) <= camera.pixel;

    // The greedy cover.
    let all: Vec<f64> = (0..regions.len()).map(|i| of_region(&points, i).map(|(_, p)| p.area).sum()).collect();
    let mut covered = vec![false; points.len()];
    let mut chosen = Vec::new();
    while chosen.len() < views as usize {
        // Small regions count as much as large ones: shares are added.
        let gain = |sights: &Vec<Sight>| -> f64 {
            let new = sights.iter().zip(&points).zip(&covered).filter(|((s, _), covered)| suits(s) && !**covered);
            new.map(|((_, point), _)| point.area / all[point.region].max(f64::MIN_POSITIVE)).sum()
        };
        let gains: Vec<f64> = sights.par_iter().map(gain).collect();
        let best = (0..poses.len()).reduce(|best, i| if gains[i] > gains[best] { i } else { best });
        let Some(best) = best.filter(|i| gains[*i] >= LEAST_SHARE) else { break };
        let mut shown = Vec::new();
        let mut area = 0.0;
        for (i, _) in sights[best].iter().enumerate().filter(|(_, s)| suits(s)) {
            shown.push(points[i].region);
            area += if covered[i] { 0.0 } else { points[i].area };
            covered[i] = true;
        }
        shown.dedup();
        chosen.push(TargetedView { viewpoint: poses[best].clone(), regions: shown, area });
    }

    let outcome = |(i, region): (usize, &RegionOfInterest)| {
        let share = |of: &dyn Fn(usize) -> bool| {
            let sum: f64 = of_region(&points, i).filter(|(k, _)| of(*k)).map(|(_, p)| p.area).sum();
            sum / all[i].max(f64::MIN_POSITIVE)
        };
        let any = |k: usize, of: &dyn Fn(&Sight) -> bool| sights.iter().any(|sights| of(&sights[k]));
        let finest = |k: usize| {
            let fine = sights.iter().filter(|s| s[k].within_incidence).map(|s| f64::from(s[k].pixel));
            fine.min_by(f64::total_cmp)
        };
        let mut finest: Vec<f64> = of_region(&points, i).filter_map(|(k, _)| finest(k)).collect();
        finest.sort_by(f64::total_cmp);
        let finest_pixel = finest.get(finest.len() / 2).copied();
        let focal = (camera.intrinsics.fx * camera.intrinsics.fy).sqrt();
        RegionOutcome {
            name: region.name.clone(),
            area: region.area(),
            seen: share(&|k| covered[k]),
            reachable: share(&|k| any(k, &suits)),
            within_incidence: share(&|k| any(k, &|s| s.within_incidence)),
            visible: share(&|k| any(k, &|s| s.visible)),
            finest_pixel,
            needed_focal: finest_pixel.map(|pixel| focal * pixel / camera.pixel),
        }
    };
    TargetedPlan { views: chosen, regions: regions.iter().enumerate().map(outcome).collect() }
}

/// A point of a region.
struct Point {
    region: usize,
    position: Point3<f64>,
    normal: Vector3<f64>,
    area: f64,
}

fn of_region(points: &[Point], region: usize) -> impl Iterator<Item = (usize, &Point)> {
    points.iter().enumerate().filter(move |(_, point)| point.region == region)
}

/// At most [`POINTS`] points of a region, evenly chosen, which together stand for its area.
fn thinned(i: usize, region: &RegionOfInterest) -> Vec<Point> {
    let step = region.points.len().div_ceil(POINTS).max(1);
    let point = |k: usize| Point {
        region: i,
        position: Point3::from(region.points[k].map(f64::from)),
        normal: Vector3::from(region.normals[k].map(f64::from)),
        area: region.areas[k..(k + step).min(region.areas.len())].iter().sum(),
    };
    (0..region.points.len()).step_by(step).map(point).collect()
}

/// The poses of the cell, each aimed at each region as far as it may: what close looks are chosen from.
pub fn close_poses(regions: &[RegionOfInterest], reach: &Reach) -> Vec<Viewpoint> {
    let places = places(reach, &Orbit::CLOSE);
    let of_region = |region: &RegionOfInterest| {
        let centre = Point3::from(region.centre());
        let mean = region.normals.iter().zip(&region.areas).map(|(n, a)| Vector3::from(n.map(f64::from)) * *a);
        let mean: Vector3<f64> = mean.sum();
        let aimed = places.iter().filter_map(move |(eye, table_angle)| {
            let tablebase_from_table = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), *table_angle);
            let target = tablebase_from_table * centre;
            // From behind nothing of a region is seen; of one that goes around the part its mean says nothing.
            let behind = (tablebase_from_table * mean).dot(&(eye - target)) < 0.0;
            let flat = mean.norm() > 0.5 * region.area();
            let viewpoint = Viewpoint { tablebase_from_camera: aimed(reach, *eye, target), table_angle: *table_angle };
            (!(behind && flat) && reach.check(&viewpoint).is_ok()).then_some(viewpoint)
        });
        aimed.collect::<Vec<_>>()
    };
    regions.iter().flat_map(of_region).collect()
}

fn sight(pose: &Viewpoint, point: &Point, camera: &Camera, reach: &Reach, occupancy: &Occupancy) -> Sight {
    let table_from_camera = pose.table_from_camera();
    let p = table_from_camera.inverse_transform_point(&point.position);
    let k = &camera.intrinsics;
    let inside = k.project(&p).is_some_and(|(u, v)| k.pixel(u, v).is_some());
    if !inside || p.z < reach.working.0 || p.z > reach.working.1 {
        return Sight::default();
    }
    let way = Point3::from(table_from_camera.translation.vector) - point.position;
    let (distance, normal) = (way.norm(), point.normal);
    let cosine = way.dot(&normal) / distance;
    let Some(density) = pixels_per_metre([k.fx, k.fy], cosine, p.z) else { return Sight::default() };
    if occupancy.is_hidden(point.position.into(), normal.into(), (way / distance).into(), distance) {
        return Sight::default();
    }
    Sight { visible: true, within_incidence: cosine >= camera.incidence.cos(), pixel: (1.0 / density) as f32 }
}
