//! Labels that people gave to patches of the surface, as the picture shows them: the model as held stays as it was measured.

use crate::camera::Bounds;
use glam::{DVec3, Vec3};
use semascan_model::review::{ReviewAction, SurfacePatch};
use semascan_model::{PointFlags, SemanticCloud, SemanticMesh};
use std::collections::HashSet;

/// What of the surface is painted.
#[derive(Clone, Debug, PartialEq)]
pub enum PaintedPatch {
    /// All surface nearer to one of these points (table frame) than the radius, metres.
    Points {
        /// The points.
        points: Vec<Vec3>,
        /// The radius.
        radius: f32,
    },
    /// All surface in these cells: lowest corners in units of the edge, metres.
    Voxels {
        /// The edge.
        edge: f64,
        /// The cells.
        cells: HashSet<[i32; 3]>,
    },
}

/// A patch of the surface, and what it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Paint {
    /// The patch.
    pub patch: PaintedPatch,
    /// Its component; `None` where that stays.
    pub component: Option<u16>,
    /// Its defect; `None` where that stays.
    pub defect: Option<u16>,
}

impl Paint {
    /// What a review paints; `None` where it paints nothing, or nothing that is known. The surface within an outline is not
    /// painted: the outline itself is drawn.
    ///
    /// * `component`, `defect`: the class of a name.
    pub fn of(
        action: &ReviewAction,
        component: impl Fn(&str) -> Option<u16>,
        defect: impl Fn(&str) -> Option<u16>,
    ) -> Option<Self> {
        let ReviewAction::Relabel { patch, component: named, defect: named_defect } = action else { return None };
        let patch = match patch {
            SurfacePatch::Points { points, radius } => PaintedPatch::Points {
                points: points.iter().map(|p| DVec3::from(*p).as_vec3()).collect(),
                radius: *radius as f32,
            },
            SurfacePatch::Voxels { edge, cells } if *edge > 0.0 => {
                PaintedPatch::Voxels { edge: *edge, cells: cells.iter().copied().collect() }
            }
            SurfacePatch::Voxels { .. } | SurfacePatch::Outline { .. } => return None,
        };
        let component = named.as_deref().and_then(component);
        let defect = named_defect.as_deref().and_then(defect);
        (component.is_some() || defect.is_some()).then_some(Self { patch, component, defect })
    }

    /// What of it may lie on surface within `bounds`.
    fn near(&self, bounds: Bounds) -> Option<Self> {
        if bounds.is_empty() {
            return None;
        }
        let patch = match &self.patch {
            PaintedPatch::Points { points, radius } => {
                let reach = Vec3::splat(*radius);
                let (min, max) = (bounds.min - reach, bounds.max + reach);
                let is_near = |p: &Vec3| p.cmpge(min).all() && p.cmple(max).all();
                let points: Vec<Vec3> = points.iter().copied().filter(is_near).collect();
                if points.is_empty() {
                    return None;
                }
                PaintedPatch::Points { points, radius: *radius }
            }
            PaintedPatch::Voxels { edge, cells } => {
                let touches = |cell: &[i32; 3]| {
                    let corner = DVec3::from(cell.map(f64::from)) * *edge;
                    corner.cmple(bounds.max.as_dvec3()).all() && (corner + *edge).cmpge(bounds.min.as_dvec3()).all()
                };
                let cells: HashSet<[i32; 3]> = cells.iter().copied().filter(touches).collect();
                if cells.is_empty() {
                    return None;
                }
                PaintedPatch::Voxels { edge: *edge, cells }
            }
        };
        Some(Self { patch, ..*self })
    }

    fn covers(&self, place: [f32; 3]) -> bool {
        match &self.patch {
            PaintedPatch::Points { points, radius } => {
                let place = Vec3::from(place);
                points.iter().any(|p| p.distance_squared(place) <= radius * radius)
            }
            PaintedPatch::Voxels { edge, cells } => {
                cells.contains(&place.map(|c| (f64::from(c) / edge).floor() as i32))
            }
        }
    }
}

/// The patches that the picture shows, the later over the earlier.
#[derive(Clone, Debug, Default)]
pub struct HeldPaint {
    paint: Vec<Paint>,
    is_open: bool,
    revision: u64,
}

impl HeldPaint {
    /// Takes the patches.
    ///
    /// * `is_open`: the last one is being drawn.
    pub fn set(&mut self, paint: Vec<Paint>, is_open: bool) {
        if self.paint != paint || self.is_open != is_open {
            (self.paint, self.is_open) = (paint, is_open);
            self.revision += 1;
        }
    }

    /// Whether the last patch is being drawn: a mesh, which is repainted as a whole, may wait.
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Changes with every change.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// What may lie on surface within `bounds`.
    pub fn near(&self, bounds: Bounds) -> Vec<Paint> {
        self.paint.iter().filter_map(|paint| paint.near(bounds)).collect()
    }

    /// `mesh` with what is painted; `None` where that is nothing.
    pub fn on_mesh(&self, mesh: &SemanticMesh) -> Option<SemanticMesh> {
        if self.paint.is_empty() {
            return None;
        }
        let vertices = painted(&mesh.vertices, &self.paint);
        Some(SemanticMesh { vertices, boundary: mesh.boundary.clone(), triangles: mesh.triangles.clone() })
    }
}

/// `cloud` with `paint` on it. What a person says is certain.
pub fn painted(cloud: &SemanticCloud, paint: &[Paint]) -> SemanticCloud {
    let mut cloud = cloud.clone();
    for i in 0..cloud.len() {
        let place = cloud.positions[i];
        for paint in paint.iter().filter(|paint| paint.covers(place)) {
            let Some(mut point) = cloud.get(i) else { continue };
            if let Some(component) = paint.component {
                (point.label, point.confidence, point.sigma) = (component, 1.0, 0.0);
                point.flags = PointFlags(point.flags.0 & !PointFlags::UNLABELLED);
            }
            if let Some(defect) = paint.defect {
                (point.defect, point.defect_confidence, point.defect_sigma) = (defect, 1.0, 0.0);
            }
            cloud.set(i, point);
        }
    }
    cloud
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    fn row(points: u32) -> SemanticCloud {
        let at = |i: u32| SemanticPoint { position: [i as f32 * 1e-3, 0.0, 0.0], label: 1, ..SemanticPoint::UNKNOWN };
        (0..points).map(at).collect()
    }

    fn stroke(x: f64, radius: f64, component: Option<&str>, defect: Option<&str>) -> ReviewAction {
        let patch = SurfacePatch::Points { points: vec![[x, 0.0, 0.0]], radius };
        ReviewAction::Relabel { patch, component: component.map(Into::into), defect: defect.map(Into::into) }
    }

    fn of(action: &ReviewAction) -> Option<Paint> {
        let class = |name: &str| ["none", "housing", "gear"].iter().position(|known| *known == name).map(|i| i as u16);
        Paint::of(action, class, class)
    }

    #[test]
    fn surface_within_the_radius_is_what_was_said_last() {
        let paint: Vec<Paint> = [stroke(5e-3, 2.1e-3, Some("gear"), None), stroke(6e-3, 1.1e-3, Some("none"), None)]
            .iter()
            .filter_map(of)
            .collect();
        let cloud = painted(&row(11), &paint);
        assert_eq!(cloud.labels, [1, 1, 1, 2, 2, 0, 0, 0, 1, 1, 1]);
        assert_eq!((cloud.confidence[4], cloud.defects[4]), (1.0, 0));
        let cells = SurfacePatch::Voxels { edge: 2e-3, cells: vec![[1, 0, 0]] };
        let relabel = ReviewAction::Relabel { patch: cells, component: None, defect: Some("housing".into()) };
        let cloud = painted(&row(6), &[of(&relabel).expect("it is known")]);
        assert_eq!((cloud.defects, cloud.labels), (vec![0, 0, 1, 1, 0, 0], vec![1; 6]));
    }

    #[test]
    fn what_is_not_known_or_no_patch_paints_nothing() {
        assert_eq!(of(&stroke(0.0, 1e-3, Some("anchor"), None)), None);
        assert_eq!(of(&ReviewAction::Accept), None);
        assert!(of(&stroke(0.0, 1e-3, Some("anchor"), Some("gear"))).is_some_and(|p| p.component.is_none()));
    }

    #[test]
    fn only_what_is_near_counts_and_each_change_is_told() {
        let bounds = Bounds::from_corners(Vec3::ZERO, Vec3::splat(0.01));
        let mut held = HeldPaint::default();
        let paint: Vec<Paint> = [0.0, 0.05].iter().filter_map(|x| of(&stroke(*x, 2e-3, Some("gear"), None))).collect();
        held.set(paint.clone(), false);
        assert_eq!((held.near(bounds).len(), held.near(Bounds::EMPTY).len(), held.revision()), (1, 0, 1));
        held.set(paint.clone(), false);
        assert_eq!(held.revision(), 1, "it is the same");
        held.set(paint, true);
        assert_eq!((held.revision(), held.is_open()), (2, true));
        let mesh = SemanticMesh { vertices: row(3), boundary: vec![false; 3], triangles: vec![[0, 1, 2]] };
        assert_eq!(held.on_mesh(&mesh).map(|m| m.vertices.labels), Some(vec![2, 2, 2]));
        assert!(HeldPaint::default().on_mesh(&mesh).is_none());
    }
}
