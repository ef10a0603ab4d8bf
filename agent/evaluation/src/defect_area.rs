//! How much of each component's surface is corroded, worn or cracked, against truth ([Remanufacturing paper], the
//! outlook on corrosion).
//!
//! A model shows only what its views have seen, so its area is compared with the truth of the same points; the area on
//! the whole true mesh, seen or not, stands beside it.

use super::truth::{nearest_of_points, truth_of};
use nalgebra::{Isometry3, Vector3};
use semascan_geometry::measure::surfel_area;
use semascan_inspection::source::TrueMesh;
use semascan_model::SemanticCloud;
use serde::Serialize;
use std::collections::BTreeMap;

/// Area of one defect on one component, square metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct DefectArea {
    /// True component class.
    pub component: u16,
    /// Defect class.
    pub defect: u16,
    /// Of the model's points that are said to have it.
    pub said: f64,
    /// Of the model's points that truly have it.
    pub truth: f64,
    /// Of the model's points for which both hold.
    pub both: f64,
    /// On the whole true mesh.
    pub on_mesh: f64,
}

/// Areas by true component and defect, in order, of a model in the table frame with voxels of `voxel` metres.
pub fn defect_areas(cloud: &SemanticCloud, truth: &TrueMesh, voxel: f64) -> Vec<DefectArea> {
    let mut areas: BTreeMap<(u16, u16), DefectArea> = BTreeMap::new();
    let mut add = |component: u16, defect: u16, area: f64, to: fn(&mut DefectArea) -> &mut f64| {
        if defect != 0 {
            *to(areas.entry((component, defect)).or_default()) += area;
        }
    };
    for (i, nearest) in nearest_of_points(cloud, truth, &Isometry3::identity()) {
        let component = truth_of(&truth.labels, nearest.vertex);
        let true_defect = truth_of(&truth.defects, nearest.vertex);
        let said = if cloud.defect_confidence[i] > 0.0 { cloud.defects[i] } else { 0 };
        let area = f64::from(surfel_area(cloud.normals[i], voxel as f32));
        add(component, said, area, |a| &mut a.said);
        add(component, true_defect, area, |a| &mut a.truth);
        if said == true_defect {
            add(component, said, area, |a| &mut a.both);
        }
    }
    for triangle in &truth.triangles {
        let corner = |k: usize| truth.vertices.get(triangle[k] as usize).map(|v| Vector3::from(v.map(f64::from)));
        let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else { continue };
        // Each corner stands for a third of the triangle.
        let third = (b - a).cross(&(c - a)).norm() / 6.0;
        for &v in triangle {
            add(truth_of(&truth.labels, v), truth_of(&truth.defects, v), third, |a| &mut a.on_mesh);
        }
    }
    areas.into_iter().map(|((component, defect), area)| DefectArea { component, defect, ..area }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::{PointFlags, SemanticPoint};

    #[test]
    fn areas_are_told_by_component_and_defect() {
        // A square metre of component 2 in the plane z = 0: two of its corners are corroded, all of it belongs together.
        let truth = TrueMesh {
            vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            labels: vec![2; 4],
            defects: vec![0, 1, 1, 0],
            taxonomy: None,
        };
        let point = |x: f32, defect: u16, defect_confidence: f32| SemanticPoint {
            position: [x, 0.1, 0.0],
            normal: [0.0, 0.0, 1.0],
            color: [0; 3],
            label: 2,
            confidence: 1.0,
            defect,
            defect_confidence,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 1,
            flags: PointFlags(0),
        };
        let cloud: SemanticCloud =
            [point(0.1, 0, 1.0), point(0.2, 1, 1.0), point(0.8, 1, 1.0), point(0.9, 0, 1.0), point(0.95, 1, 0.0)]
                .into_iter()
                .collect();
        let [area] = defect_areas(&cloud, &truth, 0.01)[..] else { panic!("one component with one defect") };
        assert_eq!((area.component, area.defect), (2, 1));
        let points = [area.said, area.truth, area.both].map(|a| (a / 1e-4).round());
        assert_eq!(points, [2.0, 3.0, 1.0]);
        // Corner 1 is in one triangle, corner 2 in both: three thirds of half a square metre.
        assert!((area.on_mesh - 0.5).abs() < 1e-9, "{area:?}");
    }
}
