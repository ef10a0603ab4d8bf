//! The cells in which a view has measured surface, with its normal and the incidence.

use super::Coverage;
use nalgebra::{Point3, Vector3};
use semascan_perception::fuse::KeptDepth;
use std::collections::BTreeMap;

/// Least cosine of incidence of a point that counts: beyond, depth and normal are those of an edge.
const LEAST_COSINE: f64 = 0.1;
/// Points with normals that a cell needs: single ones are flying pixels.
const LEAST_POINTS: u32 = 2;
/// Largest difference of depth between the pixels of one normal, in cells.
const STEP: f64 = 2.0;

/// What a view has seen of a cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    /// Sum of unit normals, table frame.
    pub(super) normal: [f32; 3],
    /// Mean cosine of incidence.
    pub(super) cosine: f32,
    points: u32,
}

/// The cells in which `view` has measured surface, in order.
pub(super) fn measured(coverage: &Coverage, view: &KeptDepth<'_>) -> BTreeMap<u32, Seen> {
    let k = &view.intrinsics;
    let (width, height) = (k.width as usize, k.height as usize);
    let turn = view.table_from_camera.rotation;
    let mut cells: BTreeMap<u32, Seen> = BTreeMap::new();
    let at = |u: usize, v: usize| {
        let z = f64::from(view.metres[v * width + u]);
        (z > 0.0).then(|| k.unproject(u as f64, v as f64, z))
    };
    for v in 0..height {
        for u in 0..width {
            let Some(p) = at(u, v) else { continue };
            let Some(index) = coverage.index(&(view.table_from_camera * p)) else { continue };
            // Normals over half a cell: of single pixels they are noise.
            let reach = ((0.5 * coverage.edge / k.footprint(p.z)) as usize).max(1);
            if u < reach || v < reach || u + reach >= width || v + reach >= height {
                continue;
            }
            let ends = (at(u - reach, v), at(u + reach, v), at(u, v - reach), at(u, v + reach));
            let (Some(left), Some(right), Some(top), Some(bottom)) = ends else { continue };
            let far = |q: &Point3<f64>| (q.z - p.z).abs() > STEP * coverage.edge;
            if [left, right, top, bottom].iter().any(far) {
                continue;
            }
            // x right, y down, z forward: this normal points towards the camera.
            let Some(normal) = (bottom - top).cross(&(right - left)).try_normalize(1e-12) else { continue };
            let cosine = -normal.dot(&p.coords) / p.coords.norm();
            if cosine < LEAST_COSINE {
                continue;
            }
            let normal: Vector3<f32> = (turn * normal).cast();
            let seen = cells.entry(index as u32).or_default();
            (0..3).for_each(|i| seen.normal[i] += normal[i]);
            seen.cosine += cosine as f32;
            seen.points += 1;
        }
    }
    cells.retain(|_, seen| seen.points >= LEAST_POINTS);
    for seen in cells.values_mut() {
        let points = seen.points as f32;
        seen.cosine /= points;
        seen.normal = seen.normal.map(|n| n / points);
    }
    cells
}
