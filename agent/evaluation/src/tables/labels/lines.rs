//! Lines that the simulated person draws where a brush is too wide: along cracks, and along the borders of defects.
//!
//! The person sees the defect in the photographs and on the model, and draws along it with a pen of 1.5 or 0.8 mm, point by point,
//! each about [`HAND`] off. A point is set where the label is wrong and most of the surface under the pen has one class, so what is
//! thinner than the pen stays undrawn.

use super::part_truth::PartTruth;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use semascan_geometry::measure::{NearestPoints, SurfaceIndex};
use semascan_model::SemanticMesh;
use std::collections::BTreeMap;

/// Half the widths of the pens, metres.
pub(super) const PENS: [f64; 2] = [0.75e-3, 0.4e-3];
/// Half the width of the narrowest brush, metres.
const BRUSH: f32 = 1.5e-3;
/// Share of the surface under each pen that must have the class: what the wide one leaves is for the narrow one.
const UNDER_PEN: [f64; 2] = [0.95, 0.75];
/// Standard deviation of a point along each axis, metres.
const HAND: f64 = 0.2e-3;
/// Farthest that a vertex of the model may be from surface that it labels, metres.
const FARTHEST: f32 = 3e-3;
/// Parts that an edge of the true mesh, a millimetre long, is divided into.
const PARTS: u32 = 4;

/// Points of lines by class and pen (place in [`PENS`]).
pub(super) type Lines = BTreeMap<(u16, usize), Vec<[f64; 3]>>;

/// Places on the true surface with their defects.
pub(super) struct Sampled {
    positions: Vec<[f32; 3]>,
    defects: Vec<u16>,
    nearest: NearestPoints,
}

impl Sampled {
    /// The lines that mend what `labels` of the vertices of `mesh` say of the surface.
    pub(super) fn lines(&self, mesh: &SemanticMesh, labels: &[u16], seed: u64) -> Lines {
        let vertices = NearestPoints::new(&mesh.vertices.positions);
        let surface = SurfaceIndex::new(&mesh.vertices.positions, &mesh.triangles);
        let label = |p: &[f32; 3]| vertices.nearest_within(*p, FARTHEST).map(|n| labels[n.index as usize]);
        // To rub out beside a crack would rub it out, too.
        let wrong: Vec<usize> = (0..self.positions.len())
            .into_par_iter()
            .filter(|i| self.defects[*i] != 0)
            .filter(|i| label(&self.positions[*i]).is_some_and(|label| label != self.defects[*i]))
            .collect();
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut drawn = vec![false; self.positions.len()];
        let mut lines = Lines::new();
        for (pen, radius) in PENS.iter().enumerate() {
            let shares: Vec<f64> = wrong.par_iter().map(|i| self.share(*i, *radius as f32)).collect();
            for (&i, share) in wrong.iter().zip(shares) {
                if drawn[i] || share < UNDER_PEN[pen] {
                    continue;
                }
                let point = self.positions[i].map(|c| (f64::from(c) + HAND * normal(&mut rng)) as f32);
                // What is drawn lies on the model, which is not just where the true surface is.
                let Some(on_model) = surface.closest_of_all(&[point]).into_iter().flatten().next() else { continue };
                lines.entry((self.defects[i], pen)).or_default().push(on_model.point.map(f64::from));
                // The next point of the line lies where this one does not reach.
                let reach = 0.7 * *radius as f32;
                self.nearest.within(self.positions[i], reach, |n| {
                    let n = n.index as usize;
                    drawn[n] |= self.defects[n] == self.defects[i];
                });
            }
        }
        lines
    }
}

/// A normal deviate: the sum of twelve uniform ones is one, nearly.
fn normal(rng: &mut Pcg64) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}

impl Sampled {
    /// All of the surface within two brushes of a defect.
    pub(super) fn around_defects(part: &PartTruth<'_>) -> Self {
        let truth = &part.mesh;
        let component = |t: &[u32; 3]| truth.labels.get(t[0] as usize).copied().unwrap_or(0);
        let places = |t: &[u32; 3], parts: u32| -> Vec<[f32; 3]> {
            let corners = t.map(|v| truth.vertices[v as usize]);
            let weights = (0..parts).flat_map(|a| (0..parts - a).map(move |b| [a, b, parts - 1 - a - b]));
            weights
                .map(|w| {
                    let w = w.map(|w| (w as f32 + 1.0 / 3.0) / parts as f32);
                    std::array::from_fn(|axis| (0..3).map(|k| w[k] * corners[k][axis]).sum())
                })
                .collect()
        };
        let is_whole = |t: &&[u32; 3]| t.iter().all(|v| (*v as usize) < truth.vertices.len()) && component(t) != 0;
        let triangles: Vec<&[u32; 3]> = truth.triangles.iter().filter(is_whole).collect();
        let coarse: Vec<[f32; 3]> = triangles
            .par_iter()
            .flat_map_iter(|t| places(t, 2).into_iter().filter(|p| part.defect_at(*p, component(t)) != 0))
            .collect();
        let near = NearestPoints::new(&coarse);
        let found: Vec<([f32; 3], u16)> = triangles
            .par_iter()
            .filter(|t| near.nearest_within(truth.vertices[t[0] as usize], 2.0 * BRUSH).is_some())
            .flat_map_iter(|t| places(t, PARTS).into_iter().map(|p| (p, part.defect_at(p, component(t)))))
            .collect();
        let (positions, defects): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let nearest = NearestPoints::new(&positions);
        Self { positions, defects, nearest }
    }

    /// Share of the surface nearer than `radius` to a place that has the same defect.
    fn share(&self, place: usize, radius: f32) -> f64 {
        let (mut all, mut of_class) = (0_u32, 0_u32);
        let class = self.defects[place];
        self.nearest.within(self.positions[place], radius, |n| {
            all += 1;
            of_class += u32::from(self.defects[n.index as usize] == class);
        });
        f64::from(of_class) / f64::from(all.max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;
    use semascan_inspection::record::TruePoses;
    use semascan_inspection::source::Source;
    use semascan_model::SemanticPoint;
    use semascan_simulation::{VirtualCell, VirtualCellSpec};

    #[test]
    fn lines_mend_what_a_brush_left() {
        let spec = VirtualCellSpec::parse("virtual:starter-motor?seed=1001&views=1&size=64x48").expect("valid");
        let cell = VirtualCell::open(&spec).expect("opens");
        let truth = cell.truth().expect("simulated");
        let there = TruePoses { view: 0, estimate: Isometry3::identity(), prior: None, truth: Isometry3::identity() };
        let sampled = Sampled::around_defects(&PartTruth::at_model(truth, &cell, &[there]).expect("a pose"));
        let crack = cell.info().taxonomy.defects.iter().find(|c| c.name == "crack").expect("known").id;
        // The true surface is the model, and its labels lack the cracks.
        let mut mesh = SemanticMesh { triangles: truth.triangles.clone(), ..SemanticMesh::default() };
        for position in &truth.vertices {
            mesh.vertices.push(SemanticPoint { position: *position, ..SemanticPoint::UNKNOWN });
        }
        let labels: Vec<u16> = truth.defects.iter().map(|d| if *d == crack { 0 } else { *d }).collect();
        let lines = sampled.lines(&mesh, &labels, 1);
        let drawn: Vec<&[f64; 3]> = lines.iter().filter(|((c, _), _)| *c == crack).flat_map(|(_, p)| p).collect();
        assert!(drawn.len() > 20, "{}", drawn.len());
        // A point is off by the hand, not by more.
        let beside = |p: &[f64; 3]| {
            let mut on_crack = false;
            sampled
                .nearest
                .within(p.map(|c| c as f32), 1e-3, |n| on_crack |= sampled.defects[n.index as usize] == crack);
            on_crack
        };
        assert!(drawn.iter().filter(|p| beside(p)).count() * 50 >= drawn.len() * 49);
        // They cover most of the cracks.
        let points: Vec<[f32; 3]> = drawn.iter().map(|p| p.map(|c| c as f32)).collect();
        let nearest = NearestPoints::new(&points);
        let cracked: Vec<&[f32; 3]> =
            sampled.positions.iter().zip(&sampled.defects).filter(|(_, d)| **d == crack).map(|(p, _)| p).collect();
        let covered = cracked.iter().filter(|p| nearest.nearest_within(***p, PENS[0] as f32).is_some()).count();
        assert!(covered * 10 > cracked.len() * 8, "{covered} of {}", cracked.len());
    }
}
