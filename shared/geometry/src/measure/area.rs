//! Area of the surface that a mesh of seen points stands for.
//!
//! The sum of its faces is wrong in three ways, which are corrected:
//!
//! - **Too large by roughness.** Noise tilts a face by some angle t against the surface, and its area is that of the
//!   surface over cos(t): 5 % too much for depth in whole millimetres on voxels of half a millimetre. So a face counts by
//!   its projection along the mean of the normals around it. Those come from planes fitted to whole neighbourhoods of pixels,
//!   and where a surface is smooth they are the normals of the faces.
//! - **Too small at creases.** A mesh on a grid cuts corners. Where the normals around a face differ, it is the chord
//!   between surfaces with the normals of its corners, and each third of it counts as the piece of such a surface whose
//!   projection it is. The planes that normals are fitted by reach across a crease, and so does the mean over a voxel: both
//!   blur it. Normals at creases are sharpened as a blurred picture is, by what they differ from the mean around them
//!   (unsharp masking). Noise makes normals differ as well, but from vertex to vertex: it goes away in a mean over means,
//!   where a crease stays. So what is a crease is decided by means that are taken twice.
//! - **Too small at the rim.** The outermost sample of a surface lies on average half a sample spacing inside its edge. The
//!   voxels that hold such samples reach beyond them by half a voxel on average, and vertices of the rim lie half a voxel
//!   inside these, so that half the sample spacing is missing. A map's voxels are twice as wide as a pixel's footprint: it
//!   is a quarter of a voxel along the rim. The rim of a mesh on a grid is a staircase, so its edges count by their
//!   projection along the rim's mean direction.
//!
//! The tests of `agent/evaluation` compare it with what simulated views have seen.

use crate::vector::{cross, dot, length, sub, unit};
use semascan_model::SemanticMesh;
use std::collections::BTreeMap;

/// Width in voxels of the strip that is missing along the rim.
const STRIP: f64 = 0.25;
/// Length of the mean over the mean directions around a face above which the surface is smooth there: they differ from it
/// by 6 degrees (root mean square) at most. Where they differ more there is a crease.
const SMOOTH: f64 = 0.994;
/// Cosine between the normal of a face and that of its corner down to which the corner is taken at its word.
const STEEPEST: f64 = 0.5;
/// This cosine for the chamfer of a right angle: sharpening turns no normal farther.
const CHAMFER: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Such a length around a vertex above which normals are not sharpened: they turn too little (by 9 degrees) to be told from
/// noise.
const ROUGH: f64 = 0.988;
/// How many times a corner's deviation from the mean normal around it is added to it at a crease. Smaller values leave the
/// edges of simulated motors smaller still.
const SHARPENING: f64 = 2.0;

/// The area in square metres that each vertex of `mesh` stands for: a third of its faces, and half of the strip along its
/// edges of the rim. `voxel` is the edge in metres of the voxels that the mesh was made of.
///
/// An edge is on the rim where it has one face and the mesh marks both its ends, so that a cut through the mesh is none.
/// Faces with a corner that is not there or not finite have no area, and those around which there are no normals count as
/// they are.
pub fn seen_vertex_areas(mesh: &SemanticMesh, voxel: f32) -> Vec<f64> {
    let position = |v: u32| mesh.vertices.positions[v as usize].map(f64::from);
    let finite = |corners: [[f32; 3]; 3]| corners.iter().flatten().all(|c| c.is_finite());
    let triangles = || mesh.triangles.iter().copied().filter(|t| mesh.corners(*t).is_some_and(finite));
    let normals: Vec<[f64; 3]> = mesh.vertices.normals.iter().map(|n| n.map(f64::from)).collect();
    let means = means_around(&normals, triangles());
    let directions: Vec<[f64; 3]> = means.iter().map(|m| unit(*m, f64::MIN_POSITIVE).unwrap_or_default()).collect();
    let means_of_means = means_around(&directions, triangles());
    let mut areas = vec![0.0; mesh.len()];
    // Edges between marked vertices, lower end first, and whether their face runs from that to the other.
    let mut edges: Vec<(u32, u32, bool)> = Vec::new();
    let marked = |v: u32| mesh.boundary.get(v as usize).copied().unwrap_or(false);
    for triangle in triangles() {
        let [a, b, c] = triangle;
        let across = cross(sub(position(b), position(a)), sub(position(c), position(a)));
        let mean = sum(triangle.map(|v| means[v as usize]));
        let long = length(mean);
        let turning = sum(triangle.map(|v| means_of_means[v as usize]));
        let double = if long > 0.0 && length(turning) > 3.0 * SMOOTH {
            (dot(across, mean) / long).max(0.0)
        } else {
            let share = |&v: &u32| {
                let turns = length(means_of_means[v as usize]) < ROUGH;
                stretch(across, normals[v as usize], turns.then_some(means[v as usize]))
            };
            length(across) * triangle.iter().map(share).sum::<f64>() / 3.0
        };
        triangle.iter().for_each(|v| areas[*v as usize] += double / 6.0);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if marked(from) && marked(to) {
                edges.push((from.min(to), from.max(to), from < to));
            }
        }
    }
    edges.sort_unstable();
    let rim: Vec<(u32, u32)> = edges
        .chunk_by(|p, q| (p.0, p.1) == (q.0, q.1))
        .filter(|same| same.len() == 1)
        .map(|same| if same[0].2 { (same[0].0, same[0].1) } else { (same[0].1, same[0].0) })
        .collect();
    // The rim's direction at each of its vertices.
    let mut rim_directions: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
    for &(from, to) in &rim {
        let edge = sub(position(to), position(from));
        for end in [from, to] {
            let direction = rim_directions.entry(end).or_default();
            *direction = sum([*direction, edge.map(|c| c / length(edge).max(f64::MIN_POSITIVE)), [0.0; 3]]);
        }
    }
    for &(from, to) in &rim {
        let edge = sub(position(to), position(from));
        let direction = sum([rim_directions[&from], rim_directions[&to], [0.0; 3]]);
        let along = dot(edge, direction).max(0.0) / length(direction).max(f64::MIN_POSITIVE);
        for end in [from, to] {
            areas[end as usize] += 0.5 * along * STRIP * f64::from(voxel);
        }
    }
    areas
}

/// For each vertex the mean of `values` at the corners of the faces around it; zero where there are no faces.
fn means_around(values: &[[f64; 3]], triangles: impl Iterator<Item = [u32; 3]>) -> Vec<[f64; 3]> {
    let mut sums = vec![([0.0; 3], 0_u32); values.len()];
    for triangle in triangles {
        let of_face = sum(triangle.map(|v| values[v as usize]));
        for v in triangle {
            let (around, count) = &mut sums[v as usize];
            (*around, *count) = (sum([*around, of_face, [0.0; 3]]), *count + 3);
        }
    }
    sums.into_iter().map(|(around, count)| around.map(|c| c / f64::from(count.max(1)))).collect()
}

/// How much larger a surface with this `normal` is than its projection on a face that is perpendicular to `across`. At a
/// crease the normal is sharpened by the `mean` of the normals around it.
fn stretch(across: [f64; 3], normal: [f64; 3], mean: Option<[f64; 3]>) -> f64 {
    let cosine = |n: [f64; 3]| dot(across, n) / (length(across) * length(n)).max(f64::MIN_POSITIVE);
    let blurred = cosine(normal);
    // Without a normal, or with one that is not of this side, nothing is known.
    if blurred < STEEPEST {
        return 1.0;
    }
    let Some(mean) = mean else { return 1.0 / blurred.max(CHAMFER) };
    let sharp = [0, 1, 2].map(|k| normal[k] + SHARPENING * (normal[k] - mean[k]));
    1.0 / cosine(sharp).clamp(CHAMFER.min(blurred), blurred)
}

fn sum([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] + b[k] + c[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    const VOXEL: f32 = 1e-3;

    /// A square of 40 cells of a voxel, facing +z, turned by `turn` about z in steps of the grid: vertices inside a square
    /// that is turned. Heights alternate by `rough`.
    fn square(turn: f32, rough: f32) -> SemanticMesh {
        let (sine, cosine) = turn.sin_cos();
        let (cells, half) = (80_i32, 20.0_f32);
        let inside = |x: i32, y: i32| {
            let (x, y) = (x as f32 - 40.0, y as f32 - 40.0);
            (cosine * x + sine * y).abs() < half && (cosine * y - sine * x).abs() < half
        };
        let mut mesh = SemanticMesh::default();
        let mut number = BTreeMap::new();
        for x in 0..cells {
            for y in 0..cells {
                if inside(x, y) {
                    let height = if (x + y) % 2 == 0 { rough } else { 0.0 };
                    let position = [x as f32 * VOXEL, y as f32 * VOXEL, height];
                    let normal = [0.0, 0.0, 1.0];
                    let rim = (0..9).any(|k| !inside(x + k % 3 - 1, y + k / 3 - 1));
                    number.insert((x, y), mesh.push(SemanticPoint { position, normal, ..SemanticPoint::UNKNOWN }, rim));
                }
            }
        }
        for (&(x, y), &a) in &number {
            if let (Some(&b), Some(&c), Some(&d)) =
                (number.get(&(x + 1, y)), number.get(&(x + 1, y + 1)), number.get(&(x, y + 1)))
            {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh
    }

    /// Makes faces between 21 rows of `row` vertices each.
    fn join_rows(mesh: &mut SemanticMesh, row: u32) {
        for (y, k) in (0..20).flat_map(|y| (0..row - 1).map(move |k| (y, k))) {
            let (a, b) = (y * row + k, (y + 1) * row + k);
            mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }

    #[test]
    fn the_strip_along_the_rim_is_a_quarter_of_a_voxel() {
        let mesh = square(0.0, 0.0);
        let side = 38.0 * 1e-3;
        assert!((mesh.area() - side * side).abs() < 1e-9);
        let area: f64 = seen_vertex_areas(&mesh, VOXEL).iter().sum();
        // At the four corners the direction of the rim turns.
        let strip = area - mesh.area();
        assert!((strip / (4.0 * side * 0.25e-3) - 1.0).abs() < 0.03, "{strip}");
    }

    #[test]
    fn a_staircase_is_as_long_as_the_edge_that_it_follows() {
        let mesh = square(std::f32::consts::FRAC_PI_4, 0.0);
        let strip = seen_vertex_areas(&mesh, VOXEL).iter().sum::<f64>() - mesh.area();
        let side = mesh.area().sqrt();
        assert!((strip / (4.0 * side * 0.25e-3) - 1.0).abs() < 0.06, "{strip} for {}", 4.0 * side * 0.25e-3);
    }

    #[test]
    fn roughness_adds_no_area() {
        let (flat, rough) = (square(0.3, 0.0), square(0.3, 0.3e-3));
        assert!(rough.area() > 1.05 * flat.area());
        let [flat, rough]: [f64; 2] = [flat, rough].map(|mesh| seen_vertex_areas(&mesh, VOXEL).iter().sum());
        assert!((rough / flat - 1.0).abs() < 0.003, "{rough} for {flat}");
    }

    #[test]
    fn noise_of_normals_is_no_crease() {
        // Normals differ from vertex to vertex by 12 degrees (root mean square) in no order, faces are as rough.
        let mut mesh = square(0.3, 0.2e-3);
        let flat: f64 = seen_vertex_areas(&square(0.3, 0.0), VOXEL).iter().sum();
        for (k, normal) in mesh.vertices.normals.iter_mut().enumerate() {
            let (sine, cosine) = (2.4 * k as f32).sin_cos();
            *normal = [0.208 * cosine, 0.208 * sine, 0.978];
        }
        let area: f64 = seen_vertex_areas(&mesh, VOXEL).iter().sum();
        assert!(
            mesh.area() > 1.015 * square(0.3, 0.0).area() && (area / flat - 1.0).abs() < 0.003,
            "{area} for {flat}"
        );
    }

    #[test]
    fn a_chamfer_counts_as_the_crease_that_it_cuts() {
        // Across: ten cells along x, a chamfer of 0.7 cells, ten cells down. Along y: 20 cells.
        let across: Vec<([f32; 2], [f32; 3])> = (0..=10)
            .map(|k| ([k as f32, 0.0], [0.0, 0.0, 1.0]))
            .chain((0..=10).map(|k| ([10.7, -0.7 - k as f32], [1.0, 0.0, 0.0])))
            .collect();
        let mut mesh = SemanticMesh::default();
        for y in 0..=20 {
            for ([x, z], normal) in &across {
                let position = [*x, y as f32, *z].map(|c| c * VOXEL);
                mesh.push(SemanticPoint { position, normal: *normal, ..SemanticPoint::UNKNOWN }, false);
            }
        }
        join_rows(&mut mesh, across.len() as u32);
        let area: f64 = seen_vertex_areas(&mesh, VOXEL).iter().sum();
        let truth = 20.0 * (10.7 + 10.7) * 1e-6;
        // The faces beside it are taken for slightly blurred.
        assert!(mesh.area() < 0.985 * truth && (area / truth - 1.0).abs() < 3e-3, "{area} for {truth}");
    }

    #[test]
    fn a_rounded_crease_with_blurred_normals_counts_for_more_than_its_faces() {
        // A right angle, rounded with a radius of 0.7 voxels in three faces; normals follow the rounding.
        let arc = |k: u32| (f64::from(k) * std::f64::consts::FRAC_PI_2 / 3.0).sin_cos();
        let across: Vec<([f64; 2], [f64; 2])> = (0..10)
            .map(|k| ([f64::from(k) - 10.0, 0.0], [0.0, 1.0]))
            .chain((0..=3).map(|k| (arc(k), arc(k))).map(|((s, c), n)| ([0.7 * s, 0.7 * c - 0.7], [n.0, n.1])))
            .chain((1..=10).map(|k| ([0.7, -0.7 - f64::from(k)], [1.0, 0.0])))
            .collect();
        let mut mesh = SemanticMesh::default();
        for y in 0..=20 {
            for ([x, z], [nx, nz]) in &across {
                let position = [*x as f32, y as f32, *z as f32].map(|c| c * VOXEL);
                mesh.push(
                    SemanticPoint { position, normal: [*nx as f32, 0.0, *nz as f32], ..SemanticPoint::UNKNOWN },
                    false,
                );
            }
        }
        join_rows(&mut mesh, across.len() as u32);
        let area: f64 = seen_vertex_areas(&mesh, VOXEL).iter().sum();
        let truth = 20.0 * (10.7 + 10.7) * 1e-6;
        let (missing, left) = (truth - mesh.area(), truth - area);
        assert!(missing > 0.01 * truth && left > 0.0 && left < 0.75 * missing, "{left} of {missing}");
    }

    #[test]
    fn a_cut_is_no_rim() {
        let mesh = square(0.0, 0.0);
        let half = mesh.select(|t| t.iter().all(|v| mesh.vertices.positions[*v as usize][0] < 0.0401));
        let strip = seen_vertex_areas(&half, VOXEL).iter().sum::<f64>() - half.area();
        // Three sides of the half.
        let rim = (38.0 + 2.0 * 19.0) * 1e-3;
        assert!((strip / (rim * 0.25e-3) - 1.0).abs() < 0.06, "{strip}");
    }

    #[test]
    fn a_mesh_without_normals_counts_as_it_is() {
        let mut mesh = square(0.0, 0.0);
        mesh.vertices.normals.fill([0.0; 3]);
        mesh.boundary.fill(false);
        mesh.triangles.push([0, 1, 99_999]);
        let nowhere = mesh.push(SemanticPoint { position: [f32::NAN; 3], ..SemanticPoint::UNKNOWN }, true);
        mesh.triangles.push([0, 1, nowhere]);
        let area: f64 = seen_vertex_areas(&mesh, VOXEL).iter().sum();
        assert!((area - (38e-3_f64).powi(2)).abs() < 1e-9, "{area}");
        assert!(seen_vertex_areas(&SemanticMesh::default(), VOXEL).is_empty());
    }
}
