//! Patches of the surface that are taken at once: the segment around a point, and what is seen within a loop.

use super::Naming;
use crate::camera::OrbitCamera;
use crate::features::inspect::PickedPoint;
use crate::scene::HeldModel;
use crate::scene::model::neighbours;
use glam::{Vec2, Vec3};
use semascan_geometry::occupancy::Occupancy;
use semascan_geometry::sight::LEAST_COSINE;
use semascan_model::{PointFlags, SemanticPoint};
use std::collections::HashMap;

/// Most points of a patch: what the agent takes at once.
const MOST_POINTS: usize = 20_000;
/// How far a patch reaches around its points, voxels: to all surface between them, and not far beyond their border.
const REACH: f32 = 0.75;

/// A patch: all surface near its points.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// Points of the model, metres, table frame.
    pub points: Vec<Vec3>,
    /// How far it reaches around them, metres.
    pub radius: f32,
}

/// Why there is no patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPatch {
    /// There is no surface.
    Nothing,
    /// It is more than the agent takes at once.
    Large,
}

/// The connected surface around a picked point that has the component and the defect that the point has; where a component is named,
/// whatever its defects.
///
/// # Errors
/// [`NoPatch`].
pub fn segment(model: &HeldModel, at: &PickedPoint, naming: Naming) -> Result<Patch, NoPatch> {
    let voxel = model.voxel();
    let class = |point: &SemanticPoint| match naming {
        Naming::Component(_) => (point.label, 0),
        Naming::Defect(_) => (point.label, point.defect),
    };
    let wanted = match naming {
        Naming::Component(_) => (at.component, 0),
        Naming::Defect(_) => (at.component, at.defect),
    };
    let alike = surface(model).filter(|point| class(point) == wanted);
    let mut left: HashMap<[i32; 3], Vec3> =
        alike.map(|point| (cell(point.position.into(), voxel), point.position.into())).collect();
    // On a mesh the picked place may lie between the voxels of the points.
    let mut reached: Vec<[i32; 3]> = neighbours(cell(at.position.into(), voxel)).collect();
    reached.retain(|cell| left.contains_key(cell));
    let mut points: Vec<Vec3> = reached.iter().filter_map(|cell| left.remove(cell)).collect();
    while let Some(cell) = reached.pop() {
        for next in neighbours(cell) {
            if let Some(point) = left.remove(&next) {
                points.push(point);
                reached.push(next);
            }
        }
        if points.len() > MOST_POINTS {
            return Err(NoPatch::Large);
        }
    }
    patch(points, voxel)
}

/// The surface that `camera` sees within a loop.
///
/// * `path`: corners of the loop as shares of the camera's viewport; the last is joined with the first.
///
/// # Errors
/// [`NoPatch`].
pub fn within(model: &HeldModel, camera: &OrbitCamera, path: &[Vec2]) -> Result<Patch, NoPatch> {
    let all: Vec<SemanticPoint> = surface(model).collect();
    let positions: Vec<[f32; 3]> = all.iter().map(|point| point.position).collect();
    let Some(grid) = Occupancy::of(&positions, model.voxel().into()) else { return Err(NoPatch::Nothing) };
    let eye = camera.eye();
    let is_seen = |point: &SemanticPoint| {
        let place = Vec3::from(point.position);
        let normal = Vec3::from(point.normal);
        let Some((at, _)) = camera.project(place) else { return false };
        if !is_inside(path, at / camera.viewport()) {
            return false;
        }
        let (way, toward) = ((eye - place).length(), (eye - place).normalize_or_zero());
        let double = |v: Vec3| v.as_dvec3().to_array();
        f64::from(toward.dot(normal)) >= LEAST_COSINE
            && !grid.is_hidden(double(place), double(normal), double(toward), way.into())
    };
    patch(all.iter().filter(|point| is_seen(point)).map(|point| point.position.into()).collect(), model.voxel())
}

fn surface(model: &HeldModel) -> impl Iterator<Item = SemanticPoint> {
    model.chunks().flat_map(|(_, chunk)| chunk.cloud.iter()).filter(|point| !point.flags.has(PointFlags::LEFT_OUT))
}

fn patch(points: Vec<Vec3>, voxel: f32) -> Result<Patch, NoPatch> {
    match points.len() {
        0 => Err(NoPatch::Nothing),
        count if count > MOST_POINTS => Err(NoPatch::Large),
        _ => Ok(Patch { points, radius: REACH * voxel }),
    }
}

/// The voxel that holds a place.
fn cell(place: Vec3, voxel: f32) -> [i32; 3] {
    (place / voxel).floor().as_ivec3().to_array()
}

/// Whether a place lies within a loop, by the number of edges beside it.
fn is_inside(path: &[Vec2], at: Vec2) -> bool {
    let before = path.iter().cycle().skip(path.len().saturating_sub(1));
    let crossings = path
        .iter()
        .zip(before)
        .filter(|(a, b)| (a.y > at.y) != (b.y > at.y) && at.x < (b.x - a.x) * (at.y - a.y) / (b.y - a.y) + a.x);
    crossings.count() % 2 == 1
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;
    use crate::camera::{CameraInput, StandardView};
    use crate::link::{DecodedChunk, LinkEvent};
    use semascan_protocol::Inspection;

    const VOXEL: f32 = 1e-3;

    /// A plate of 20 by 20 points, its right half of another component, with a gap in the left one, over a second plate.
    fn model() -> HeldModel {
        let mut points = Vec::new();
        for z in [0, -10] {
            for (x, y) in (0..20).flat_map(|x| (0..20).map(move |y| (x, y))) {
                let place = |i: i32| (i as f32 + 0.5) * VOXEL;
                let is_gap = (4..6).contains(&x) && z == 0;
                if !is_gap {
                    points.push(SemanticPoint {
                        position: [place(x), place(y), place(z)],
                        normal: [0.0, 0.0, 1.0],
                        label: if x < 10 { 1 } else { 2 },
                        defect: u16::from((7..9).contains(&x)),
                        ..SemanticPoint::UNKNOWN
                    });
                }
            }
        }
        let mut model = HeldModel::new();
        model.apply(&LinkEvent::Cleared(Inspection { epoch: 1, ..Inspection::default() }));
        let chunk = DecodedChunk {
            id: [0; 3],
            revision: 1,
            epoch: 1,
            voxel: VOXEL,
            hash: 0,
            cloud: points.into_iter().collect(),
        };
        model.apply(&LinkEvent::Chunk(chunk));
        model
    }

    fn picked(model: &HeldModel, x: f32, y: f32) -> PickedPoint {
        crate::scene::pick::nearest_point(model, Vec3::new(x, y, 0.5) * 1e-3).expect("a point")
    }

    #[test]
    fn a_segment_ends_where_its_class_ends_and_where_the_surface_does() {
        let model = model();
        let of = |x, naming| segment(&model, &picked(&model, x, 5.0), naming).map(|patch| patch.points.len());
        assert_eq!(of(8.0, Naming::Component(2)), Ok(4 * 20), "up to the gap, and to the other component");
        assert_eq!(of(1.0, Naming::Component(2)), Ok(4 * 20), "on the other side of the gap");
        assert_eq!(of(15.0, Naming::Component(1)), Ok(10 * 20));
        assert_eq!(of(8.0, Naming::Defect(0)), Ok(2 * 20), "the defect alone");
        assert_eq!(of(9.5, Naming::Defect(1)), Ok(20), "what is sound beside it");
        let beside = PickedPoint { position: [1.0; 3], ..picked(&model, 8.0, 5.0) };
        assert_eq!(segment(&model, &beside, Naming::Component(2)), Err(NoPatch::Nothing));
    }

    #[test]
    fn a_loop_takes_what_is_seen_within_it() {
        let model = model();
        let mut camera = OrbitCamera::default();
        camera.apply(CameraInput::View(StandardView::Top), model.bounds());
        // Around the points with x from 12 to 16 and y from 3 to 9 voxels.
        let corner = |x: f32, y: f32| {
            let (at, _) = camera.project(Vec3::new(x, y, 0.5) * VOXEL).expect("in front of the camera");
            at / camera.viewport()
        };
        let path = [corner(12.0, 3.0), corner(16.0, 3.0), corner(16.0, 9.0), corner(12.0, 9.0)];
        let patch = within(&model, &camera, &path).expect("a patch");
        assert_eq!(patch.points.len(), 4 * 6);
        assert!(patch.points.iter().all(|p| p.z > 0.0), "what lies below is hidden");
        assert!((patch.radius - 0.75 * VOXEL).abs() < 1e-9);
        assert_eq!(within(&model, &camera, &path[..2]), Err(NoPatch::Nothing), "no loop");
        assert_eq!(within(&model, &camera, &[]), Err(NoPatch::Nothing));
        assert_eq!(within(&HeldModel::new(), &camera, &path), Err(NoPatch::Nothing));
    }

    #[test]
    fn a_loop_may_be_hollow_and_cross_itself() {
        let at = |x: f32, y: f32| Vec2::new(x, y);
        let hollow = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.5, 0.2), at(0.0, 1.0)];
        assert!(is_inside(&hollow, at(0.1, 0.5)) && is_inside(&hollow, at(0.9, 0.5)));
        assert!(!is_inside(&hollow, at(0.5, 0.8)) && !is_inside(&hollow, at(2.0, 0.5)));
        let crossed = [at(0.0, 0.0), at(1.0, 1.0), at(1.0, 0.0), at(0.0, 1.0)];
        assert!(is_inside(&crossed, at(0.1, 0.5)) && !is_inside(&crossed, at(0.5, 0.1)));
    }
}
