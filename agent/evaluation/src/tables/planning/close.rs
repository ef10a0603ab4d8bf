//! The second stage against truth: whether the close looks that are planned on the model show every finding of the true part under
//! the wanted incidence and as finely as wanted.
//!
//! A finding is judged by the points of the true surface on it: those with its component and defect that lie near it. Of these, what no
//! pose of the cell sees so closely cannot be asked of a planner; what some pose sees and the planned ones do not is missed.

use super::reachable::Looked;
use crate::sampling::Sample;
use nalgebra::Isometry3;
use semascan_geometry::measure::NearestPoints;
use semascan_inspection::Inspected;
use semascan_inspection::source::TrueMesh;
use semascan_inspection::spec::{PlanSpec, TargetSpec};
use semascan_perception::view::Intrinsics;
use semascan_planning::{Camera, Reach, RegionOfInterest, close_poses, defect_regions, look_closely};
use serde::Serialize;

/// Metres from a region of the model within which true points are on it.
const NEAR: f32 = 2e-3;
/// Share of what any pose sees closely that reaches a finding.
const REACHED: f64 = 0.9;
/// Columns of a picture, with the lens as it is, that is fine enough at the nearest working distance.
const FINE: u32 = 4096;

/// The close looks at the findings of a part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CloseLooks {
    /// Columns and rows of the pictures.
    pub size: (u32, u32),
    /// Focal length in pixels.
    pub focal: f64,
    /// Views that were planned.
    pub views: usize,
    /// The findings of 5 mm and more.
    pub findings: Vec<FindingReached>,
}

/// A finding of the model, on the true surface.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FindingReached {
    /// For people.
    pub name: String,
    /// Its points on the true surface.
    pub points: usize,
    /// Share of them that any pose of the cell sees under the wanted incidence.
    pub within_incidence: f64,
    /// The same, as finely as wanted, too.
    pub possible: f64,
    /// Share that the planned views see so.
    pub seen: f64,
    /// Finest millimetres a pixel, median over the points that can be seen under the wanted incidence; absent without one.
    pub finest_mm: Option<f64>,
}

impl FindingReached {
    /// Whether any pose of the cell can look at it as closely as wanted.
    pub fn is_possible(&self) -> bool {
        self.possible > 0.0
    }

    /// Whether the planned views do.
    pub fn is_reached(&self) -> bool {
        self.is_possible() && self.seen >= REACHED * self.possible
    }
}

/// The close looks at the findings of `inspected`, with its own camera and with one whose pictures are [`FINE`] columns wide.
pub(super) fn close_looks(
    inspected: &Inspected,
    looked: &Looked<'_>,
    truth: &TrueMesh,
    reach: &Reach,
) -> Vec<CloseLooks> {
    let target = TargetSpec::default();
    let taxonomy = &inspected.source.info().taxonomy;
    let regions = defect_regions(&inspected.mesh, taxonomy, 1e-3 * target.least_mm);
    let own = *looked.camera();
    let fine = own.scaled(f64::from(FINE) / f64::from(own.width));
    [own, fine].into_iter().map(|camera| looks(&regions, inspected, looked, truth, reach, camera)).collect()
}

fn looks(
    regions: &[RegionOfInterest],
    inspected: &Inspected,
    looked: &Looked<'_>,
    truth: &TrueMesh,
    reach: &Reach,
    k: Intrinsics,
) -> CloseLooks {
    let camera = Camera::new(k, &TargetSpec::default());
    let surface = (inspected.mesh.vertices.positions.as_slice(), inspected.record.voxel.unwrap_or(1e-3));
    let plan = look_closely(regions, surface, &camera, reach, 10 * PlanSpec::default().refine_views);
    let planned: Vec<Isometry3<f64>> = plan.views.iter().map(|view| view.viewpoint.table_from_camera()).collect();
    let reached = |region: &RegionOfInterest| {
        let near = NearestPoints::new(&region.points);
        let is_on = |s: &&Sample| {
            let vertex = s.vertex as usize;
            truth.labels.get(vertex) == Some(&region.component)
                && truth.defects.get(vertex) == Some(&region.defect)
                && near.nearest_within(s.position.map(|x| x as f32), NEAR).is_some()
        };
        let points: Vec<&Sample> = looked.samples.iter().filter(is_on).collect();
        let poses: Vec<Isometry3<f64>> =
            close_poses(std::slice::from_ref(region), reach).iter().map(|pose| pose.table_from_camera()).collect();
        let (mut within, mut possible, mut seen, mut finest) = (0, 0, 0, Vec::new());
        for point in &points {
            let pixel = finest_of(looked, &camera, &poses, point);
            within += usize::from(pixel.is_some());
            let is_seen = finest_of(looked, &camera, &planned, point).is_some_and(|p| p <= camera.pixel);
            seen += usize::from(is_seen);
            possible += usize::from(is_seen || pixel.is_some_and(|p| p <= camera.pixel));
            finest.extend(pixel.map(|p| 1e3 * p));
        }
        finest.sort_by(f64::total_cmp);
        let share = |count: usize| count as f64 / points.len().max(1) as f64;
        FindingReached {
            name: region.name.clone(),
            points: points.len(),
            within_incidence: share(within),
            possible: share(possible),
            seen: share(seen),
            finest_mm: finest.get(finest.len() / 2).copied(),
        }
    };
    CloseLooks {
        size: (k.width, k.height),
        focal: (k.fx * k.fy).sqrt(),
        views: planned.len(),
        // Small ones may have no point of their own on the true surface.
        findings: regions.iter().map(reached).filter(|finding| finding.points > 0).collect(),
    }
}

/// Finest metres a pixel at which some of `poses` sees the point under the wanted incidence; `None` where none does.
fn finest_of(looked: &Looked<'_>, camera: &Camera, poses: &[Isometry3<f64>], point: &Sample) -> Option<f64> {
    let least = camera.incidence.cos();
    let focal = (camera.intrinsics.fx * camera.intrinsics.fy).sqrt();
    let looks = poses.iter().filter_map(|pose| looked.look(pose, &camera.intrinsics, point));
    looks
        .filter(|look| look.cosine >= least)
        .map(|look| look.depth / (focal * look.cosine.sqrt()))
        .min_by(f64::total_cmp)
}
