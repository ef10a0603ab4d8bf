//! From what the graphics device saw to what the model knows of it.

use super::{HeldMesh, HeldModel};
use crate::features::inspect::PickedPoint;
use crate::render::seen::Piece;
use crate::render::thinning::point_in_slot;
use glam::{DMat2, DVec2, DVec3, Vec3};
use semascan_model::{PointFlags, SemanticMesh, SemanticPoint};

/// What model and mesh know of a piece of the surface; `None` if they hold no such piece.
///
/// * `place`: where it was seen, metres, table frame. Of a point it is the centre that counts, of the mesh this place.
pub fn picked_point(model: &HeldModel, mesh: &HeldMesh, of: Piece, place: Vec3) -> Option<PickedPoint> {
    let has_sigma = model.share_scales().sigma.is_some();
    match of {
        Piece::Slot { chunk, block, slot } => {
            let cloud = &model.chunk(chunk)?.cloud;
            let point = cloud.get(point_in_slot(&cloud.positions, block, slot)?)?;
            Some(PickedPoint::of(&point, model.voxel(), has_sigma))
        }
        Piece::Vertex(vertex) => {
            let held = mesh.mesh()?;
            let (triangle, weights) = triangle_at(held, vertex, place)?;
            let label = held.triangle_label(triangle);
            // The nearest corner that is of the triangle's component speaks for the place.
            let corner = (0..3)
                .filter(|k| held.vertices.labels.get(triangle[*k] as usize) == Some(&label))
                .max_by(|a, b| weights[*a].total_cmp(&weights[*b]))?;
            let point = held.vertices.get(triangle[corner] as usize)?;
            let of_corners = triangle.map(|v| mesh.deviations().get(v as usize).copied().unwrap_or(f32::NAN));
            let deviation: f64 = (0..3).map(|k| weights[k] * f64::from(of_corners[k])).sum();
            Some(PickedPoint {
                position: place.into(),
                deviation: deviation.is_finite().then_some(deviation as f32),
                on_mesh: true,
                ..PickedPoint::of(&point, model.voxel(), has_sigma)
            })
        }
    }
}

/// The point of the surface that is nearest to a place (metres, table frame); `None` where the model has no surface.
pub fn nearest_point(model: &HeldModel, place: Vec3) -> Option<PickedPoint> {
    let surface =
        model.chunks().flat_map(|(_, chunk)| chunk.cloud.iter()).filter(|p| !p.flags.has(PointFlags::LEFT_OUT));
    let distance = |p: &SemanticPoint| Vec3::from(p.position).distance_squared(place);
    let nearest = surface.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    Some(PickedPoint::of(&nearest, model.voxel(), model.share_scales().sigma.is_some()))
}

/// The triangle with this vertex that holds `place`, or comes nearest to that, and the weights of its corners there.
fn triangle_at(mesh: &SemanticMesh, vertex: u32, place: Vec3) -> Option<([u32; 3], [f64; 3])> {
    let around = mesh.triangles.iter().filter(|t| t.contains(&vertex));
    let weighed = around.filter_map(|t| Some((*t, weights(mesh.corners(*t)?, place)?)));
    let outside = |weights: &[f64; 3]| -weights.iter().copied().fold(f64::INFINITY, f64::min);
    let (triangle, weights) = weighed.min_by(|a, b| outside(&a.1).total_cmp(&outside(&b.1)))?;
    // On the edge of what was drawn: rounding must not weigh a corner less than nothing.
    let inside = weights.map(|w| w.max(0.0));
    let sum: f64 = inside.iter().sum();
    Some((triangle, inside.map(|w| w / sum)))
}

/// Barycentric coordinates of the foot of `place` in the plane of a triangle; `None` for one without area.
fn weights(corners: [[f32; 3]; 3], place: Vec3) -> Option<[f64; 3]> {
    let [a, b, c] = corners.map(|c| Vec3::from(c).as_dvec3());
    let (ab, ac, ap): (DVec3, DVec3, DVec3) = (b - a, c - a, place.as_dvec3() - a);
    // Normal equations of ap = v ab + w ac.
    let gram = DMat2::from_cols(DVec2::new(ab.dot(ab), ab.dot(ac)), DVec2::new(ab.dot(ac), ac.dot(ac)));
    let solved = gram.inverse() * DVec2::new(ap.dot(ab), ap.dot(ac));
    solved.is_finite().then_some([1.0 - solved.x - solved.y, solved.x, solved.y])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{DecodedChunk, LinkEvent};
    use semascan_model::SemanticCloud;
    use semascan_protocol::Inspection;
    use std::sync::Arc;

    fn point(position: [f32; 3], label: u16) -> SemanticPoint {
        SemanticPoint { position, label, confidence: 0.5, views: label * 10, ..SemanticPoint::UNKNOWN }
    }

    /// A strip of two triangles in the plane z = 0: corners 0, 1, 2 and 1, 3, 2.
    fn mesh(labels: [u16; 4]) -> HeldMesh {
        let places = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        let vertices = places.into_iter().zip(labels).map(|(p, label)| point(p, label)).collect();
        let mut held = HeldMesh::default();
        held.set(Arc::new(SemanticMesh { vertices, boundary: vec![false; 4], triangles: vec![[0, 1, 2], [1, 3, 2]] }));
        held
    }

    #[test]
    fn a_place_on_the_mesh_is_found_in_the_triangle_that_holds_it() {
        let mut held = mesh([1, 2, 1, 2]);
        held.set_deviations(vec![0.0, 1e-3, 2e-3, 3e-3]);
        let at = |vertex, x: f32, y: f32| {
            picked_point(&HeldModel::new(), &held, Piece::Vertex(vertex), Vec3::new(x, y, 0.0)).expect("a triangle")
        };
        // Both triangles have vertex 1; the place decides.
        let first = at(1, 0.2, 0.2);
        assert_eq!((first.component, first.views, first.position, first.on_mesh), (1, 10, [0.2, 0.2, 0.0], true));
        let deviation = first.deviation.expect("it was compared");
        assert!((deviation - 0.6e-3).abs() < 1e-7, "0.6 * 0 + 0.2 * 1 + 0.2 * 2 mm: {deviation}");
        let second = at(1, 0.9, 0.8);
        assert_eq!(second.component, 2);
        assert!((second.deviation.expect("compared") - 2.5e-3).abs() < 1e-7);
        // Nearest to corner 1, which is of another component than the triangle.
        assert_eq!((at(0, 0.8, 0.1).component, at(0, 0.8, 0.1).views), (1, 10));
    }

    #[test]
    fn a_place_at_an_edge_stays_on_it_and_what_is_not_there_is_nothing() {
        let mut held = mesh([1; 4]);
        let at = |held: &HeldMesh, vertex, x: f32, y: f32| {
            picked_point(&HeldModel::new(), held, Piece::Vertex(vertex), Vec3::new(x, y, 0.0))
        };
        assert_eq!(at(&held, 0, 0.5, -1e-6).map(|p| (p.component, p.deviation)), Some((1, None)), "not compared");
        assert_eq!(at(&held, 99, 0.5, 0.5), None);
        held.set_deviations(vec![0.0, f32::NAN, 0.0, 0.0]);
        assert_eq!(at(&held, 0, 0.2, 0.2).and_then(|p| p.deviation), None, "not known at a corner");
        assert_eq!(picked_point(&HeldModel::new(), &HeldMesh::default(), Piece::Vertex(0), Vec3::ZERO), None);
    }

    #[test]
    fn a_point_is_found_in_its_slot() {
        let mut model = HeldModel::new();
        model.apply(&LinkEvent::Cleared(Inspection { id: "a".into(), voxel: 2e-3, ..Inspection::default() }));
        let cloud: SemanticCloud = (0..300).map(|i| point([i as f32 * 1e-3, 0.0, 0.0], 1 + i as u16 % 7)).collect();
        let chunk = DecodedChunk { id: [1, 2, 3], revision: 1, epoch: 0, hash: 0, voxel: 2e-3, cloud: cloud.clone() };
        model.apply(&LinkEvent::Chunk(chunk));
        let at = |block, slot| {
            let piece = Piece::Slot { chunk: [1, 2, 3], block, slot };
            picked_point(&model, &HeldMesh::default(), piece, Vec3::ZERO)
        };
        let slots = (0..2).flat_map(|block| (0..256).map(move |slot| (block, slot)));
        let mut found: Vec<_> = slots.filter_map(|(block, slot)| at(block, slot)).collect();
        found.sort_by(|a, b| a.position[0].total_cmp(&b.position[0]));
        assert_eq!(found.iter().map(|p| p.position).collect::<Vec<_>>(), cloud.positions);
        assert!(
            found
                .iter()
                .zip(&cloud.labels)
                .all(|(p, label)| p.component == *label && p.voxel == 2e-3 && p.sigma.is_none())
        );
        let elsewhere = Piece::Slot { chunk: [0; 3], block: 0, slot: 0 };
        assert_eq!(picked_point(&model, &HeldMesh::default(), elsewhere, Vec3::ZERO), None);
    }
}
