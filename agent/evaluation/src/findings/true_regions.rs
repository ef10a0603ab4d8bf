//! The true defect regions of a simulated part, and what of them views have seen: what findings are judged by.
//!
//! Where defects lie is a function of the place, which is evaluated on the true mesh, refined fourfold: vertices of the mesh
//! lie too far apart to tell areas of small regions. What was seen is found by ray casting, face by face.

use crate::seen_area::{SeenFrom, sees};
use rayon::prelude::*;
use semascan_inspection::findings::{MeasuredRegion, measure_regions};
use semascan_inspection::source::TrueMesh;
use semascan_model::{SemanticMesh, SemanticPoint, triangle_area};
use semascan_simulation::raycast::RayScene;
use std::collections::HashMap;

/// Parts that an edge of the true mesh is split into.
const SPLIT: usize = 4;
/// Cosine of incidence from which on a surface counts as seen (84 degrees). A single view makes no closed surface there, but
/// the pixels of several do, and a region of a flat face is in the model or not as a whole.
const GRAZING: f64 = 0.1;

/// A true region.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueRegion {
    /// Component class.
    pub component: u16,
    /// Defect class.
    pub defect: u16,
    /// Area that was seen, square metres.
    pub area: f64,
    /// Length of what was seen along the surface, metres.
    pub length: f64,
    /// Its vertices, metres, table frame.
    pub points: Vec<[f32; 3]>,
}

/// The true regions of a part.
#[derive(Clone, Debug, Default)]
pub struct TrueRegions {
    /// What was seen of them: a region of which a strip was not seen is two.
    pub seen: Vec<TrueRegion>,
    /// All of them, seen or not.
    pub all: Vec<TrueRegion>,
}

impl TrueRegions {
    /// The regions of `truth` where `defect_at` gives the defect class at a place (metres, table frame) of a component, and what
    /// the `pictures` have seen of them.
    pub fn of(truth: &TrueMesh, defect_at: &(dyn Fn([f32; 3], u16) -> u16 + Sync), pictures: &[SeenFrom<'_>]) -> Self {
        let refined = refined(truth, defect_at);
        let obstacles = RayScene::new(&truth.vertices, &truth.triangles);
        let seen: Vec<[u32; 3]> = refined
            .triangles
            .par_iter()
            .filter(|t| refined.corners(**t).is_some_and(|corners| is_seen(corners, pictures, &obstacles)))
            .copied()
            .collect();
        Self { seen: regions(&refined.compacted(&seen)), all: regions(&refined) }
    }
}

/// Whether a picture sees the middle of a face.
fn is_seen(corners: [[f32; 3]; 3], pictures: &[SeenFrom<'_>], obstacles: &RayScene) -> bool {
    let [a, b, c] = corners.map(glam::Vec3::from_array);
    let middle = (a + b + c) / 3.0;
    let normal = (b - a).cross(c - a).normalize_or_zero().to_array();
    let place = (middle.to_array().map(f64::from), normal);
    pictures.iter().any(|picture| sees(picture, obstacles, place, GRAZING).is_some())
}

/// Regions of a refined mesh with the areas of its faces: each vertex stands for a third of those around it.
fn regions(mesh: &SemanticMesh) -> Vec<TrueRegion> {
    let mut areas = vec![0.0; mesh.len()];
    let (mut edges, mut count) = (0.0, 0.0);
    for triangle in &mesh.triangles {
        let Some(corners) = mesh.corners(*triangle) else { continue };
        let area = triangle_area(corners);
        triangle.iter().for_each(|v| areas[*v as usize] += area / 3.0);
        let [a, b, c] = corners.map(glam::Vec3::from_array);
        edges += f64::from(a.distance(b) + b.distance(c) + c.distance(a));
        count += 3.0;
    }
    let spacing = edges / f64::max(count, 1.0);
    let region = |MeasuredRegion { component, defect, vertices, length, .. }: MeasuredRegion| TrueRegion {
        component,
        defect,
        area: vertices.iter().map(|v| areas[*v as usize]).sum(),
        length,
        points: vertices.iter().map(|v| mesh.vertices.positions[*v as usize]).collect(),
    };
    measure_regions(mesh, spacing).into_iter().map(region).collect()
}

/// The faces of `truth` that a defect touches, each split into [`SPLIT`]^2.
fn refined(truth: &TrueMesh, defect_at: &(dyn Fn([f32; 3], u16) -> u16 + Sync)) -> SemanticMesh {
    let lattice: Vec<[usize; 3]> =
        (0..=SPLIT).flat_map(|j| (0..=SPLIT - j).map(move |k| [SPLIT - j - k, j, k])).collect();
    let label = |t: &[u32; 3]| truth.labels.get(t[0] as usize).copied().unwrap_or(0);
    let place = |t: &[u32; 3], weights: &[usize; 3]| -> [f32; 3] {
        let corners = t.map(|v| truth.vertices[v as usize]);
        [0, 1, 2].map(|axis| (0..3).map(|k| weights[k] as f32 / SPLIT as f32 * corners[k][axis]).sum())
    };
    let touched: Vec<([u32; 3], Vec<u16>)> = truth
        .triangles
        .par_iter()
        .filter(|t| label(t) != 0 && t.iter().all(|v| (*v as usize) < truth.vertices.len()))
        .filter_map(|t| {
            let defects: Vec<u16> = lattice.iter().map(|w| defect_at(place(t, w), label(t))).collect();
            defects.iter().any(|d| *d != 0).then_some((*t, defects))
        })
        .collect();
    let mut mesh = SemanticMesh::default();
    // Faces share the vertices on their edges: a place on an edge is known by its corners and their weights.
    let mut places: HashMap<[(u32, usize); 3], u32> = HashMap::new();
    for (t, defects) in &touched {
        let [a, b, c] = t.map(|v| glam::Vec3::from_array(truth.vertices[v as usize]));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let numbers: Vec<u32> = lattice
            .iter()
            .zip(defects)
            .map(|(weights, defect)| {
                let mut key = [0, 1, 2].map(|k| if weights[k] == 0 { (u32::MAX, 0) } else { (t[k], weights[k]) });
                key.sort_unstable();
                let number = *places.entry(key).or_insert_with(|| {
                    let vertex = SemanticPoint {
                        position: place(t, weights),
                        label: label(t),
                        confidence: 1.0,
                        defect: *defect,
                        defect_confidence: 1.0,
                        ..SemanticPoint::UNKNOWN
                    };
                    mesh.push(vertex, false)
                });
                let sum = &mut mesh.vertices.normals[number as usize];
                *sum = (glam::Vec3::from_array(*sum) + normal).to_array();
                number
            })
            .collect();
        // Row j of the lattice begins behind the longer ones before it.
        let at = |j: usize, k: usize| numbers[j * (SPLIT + 1) - j * j.saturating_sub(1) / 2 + k];
        for j in 0..SPLIT {
            for k in 0..SPLIT - j {
                mesh.triangles.push([at(j, k), at(j + 1, k), at(j, k + 1)]);
                if k + 1 < SPLIT - j {
                    mesh.triangles.push([at(j + 1, k), at(j + 1, k + 1), at(j, k + 1)]);
                }
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_on_a_coarse_mesh_has_its_area_and_length() {
        // A square of 60 mm in cells of 2 mm, the disc in it of 7.3 mm.
        let n = 31_u32;
        let vertices = (0..n * n).map(|i| [(i % n) as f32 * 2e-3, (i / n) as f32 * 2e-3, 0.0]).collect();
        let cells = (0..n - 1).flat_map(|y| (0..n - 1).map(move |x| y * n + x));
        let triangles = cells.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect();
        let truth = TrueMesh { vertices, triangles, labels: vec![1; 961], defects: vec![0; 961], taxonomy: None };
        let disc = |p: [f32; 3], class: u16| u16::from(class == 1 && (p[0] - 0.031).hypot(p[1] - 0.0287) < 7.3e-3);
        let found = TrueRegions::of(&truth, &disc, &[]);
        assert!(found.seen.is_empty(), "nobody looked");
        let [region] = &found.all[..] else { panic!("one region, {}", found.all.len()) };
        let area = std::f64::consts::PI * 7.3e-3_f64.powi(2);
        assert!((region.area / area - 1.0).abs() < 0.01, "{} for {area}", region.area);
        // It reaches half a sample spacing (0.25 mm) beyond the outermost samples, of which some lie on the rim.
        assert!((region.length - 14.6e-3).abs() < 0.55e-3, "{}", region.length);
    }
}
