//! How much of each component's surface is corroded, worn or cracked, against truth ([Remanufacturing paper], the
//! outlook on corrosion).
//!
//! A model shows only what its views have seen, so its area is compared with the truth of the same surface: each vertex of
//! its mesh stands for an area, as in the figures of the record. The area on the whole true mesh, seen or not, stands beside
//! it.

use super::truth::{nearest_of_points, truth_of};
use nalgebra::{Isometry3, Vector3};
use semascan_geometry::measure::seen_vertex_areas;
use semascan_inspection::source::TrueMesh;
use semascan_model::SemanticMesh;
use serde::Serialize;
use std::collections::BTreeMap;

/// Area of one defect on one component, square metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct DefectArea {
    /// True component class.
    pub component: u16,
    /// Defect class.
    pub defect: u16,
    /// Of the model's surface that is said to have it.
    pub said: f64,
    /// Of the model's surface that truly has it.
    pub truth: f64,
    /// Of the model's surface for which both hold.
    pub both: f64,
    /// On the whole true mesh.
    pub on_mesh: f64,
}

/// Areas by true component and defect, in order, of the mesh of a model in the table frame with voxels of `voxel` metres.
pub fn defect_areas(mesh: &SemanticMesh, truth: &TrueMesh, voxel: f64) -> Vec<DefectArea> {
    let mut areas: BTreeMap<(u16, u16), DefectArea> = BTreeMap::new();
    let mut add = |component: u16, defect: u16, area: f64, to: fn(&mut DefectArea) -> &mut f64| {
        if defect != 0 {
            *to(areas.entry((component, defect)).or_default()) += area;
        }
    };
    let vertices = &mesh.vertices;
    let vertex_areas = seen_vertex_areas(mesh, voxel as f32);
    for (i, nearest) in nearest_of_points(vertices, truth, &Isometry3::identity()) {
        let component = truth_of(&truth.labels, nearest.vertex);
        let true_defect = truth_of(&truth.defects, nearest.vertex);
        let said = if vertices.defect_confidence[i] > 0.0 { vertices.defects[i] } else { 0 };
        let area = vertex_areas[i];
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
        // A fan of four triangles; in its middle is the first vertex, which is not of one defect with the others.
        let corners = [(0.5, 0, 1.0), (0.1, 1, 1.0), (0.9, 1, 1.0), (0.95, 0, 1.0), (0.2, 1, 0.0)];
        let mut mesh = SemanticMesh::default();
        for (k, (x, defect, confidence)) in corners.into_iter().enumerate() {
            let mut vertex = point(x, defect, confidence);
            vertex.position[1] = [0.5, 0.1, 0.1, 0.9, 0.9][k];
            mesh.push(vertex, false);
        }
        mesh.triangles = vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]];
        let [area] = defect_areas(&mesh, &truth, 0.01)[..] else { panic!("one component with one defect") };
        assert_eq!((area.component, area.defect), (2, 1));
        let shares = seen_vertex_areas(&mesh, 0.01);
        // On the right half of the square, x > 0.5, there is truly a defect.
        for (stated, expected) in
            [(area.said, shares[1] + shares[2]), (area.truth, shares[2] + shares[3]), (area.both, shares[2])]
        {
            assert!(expected > 0.1 && (stated - expected).abs() < 1e-9, "{area:?}");
        }
        // Corner 1 is in one triangle, corner 2 in both: three thirds of half a square metre.
        assert!((area.on_mesh - 0.5).abs() < 1e-9, "{area:?}");
    }
}
