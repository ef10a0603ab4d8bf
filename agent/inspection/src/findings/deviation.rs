//! Surface that is farther from a reference than is tolerated, and the depth of regions against the reference.
//!
//! The reference is a mesh in the table frame. Signs are those of its outward side: positive outside, so that missing material
//! is negative, and its depth positive. What belongs to no component is not compared: the reference need not hold the fixture.

use super::depth::{QUANTILE, averaged, quantile};
use super::evidence::Evidence;
use super::regions::{Region, connected, defect_regions};
use super::surface::Surface;
use super::{Finding, FindingId, FindingKind, KnownPose, SemanticMesh, Taxonomy};
use super::{centroid, identity, instances, named, region_figures};
use semascan_geometry::measure::{PseudoNormals, SurfaceIndex};
use semascan_geometry::vector::{dot, sub};
use semascan_model::finding::{FindingsRecord, Quantity};
use std::collections::BTreeMap;

/// The shape that a part should have: a mesh in the table frame.
pub struct Reference {
    index: SurfaceIndex,
    normals: PseudoNormals,
}

/// What is tolerated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeviationRule {
    /// Largest distance, metres.
    pub(crate) tolerance: f64,
    /// Edge of the voxels that the mesh was made of, metres.
    pub(crate) voxel: f64,
}

impl Reference {
    /// A mesh in metres, counter-clockwise seen from outside; `None` if it has no usable triangle.
    pub fn new(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Option<Self> {
        let index = SurfaceIndex::new(positions, triangles);
        (!index.is_empty()).then(|| Self { index, normals: PseudoNormals::new(positions, triangles) })
    }

    /// Distance of each point, metres: positive outside.
    fn distances(&self, points: &[[f32; 3]]) -> Vec<f64> {
        let nearest = self.index.closest_of_all(points);
        let signed = |(point, nearest): (&[f32; 3], Option<semascan_geometry::measure::Nearest>)| {
            // A point that is not finite is on no face and so in no region.
            let Some(nearest) = nearest else { return 0.0 };
            let outward = self.normals.at(&nearest).map(f64::from);
            let away = sub(point.map(f64::from), nearest.point.map(f64::from));
            f64::from(nearest.distance).copysign(dot(outward, away))
        };
        points.iter().zip(nearest).map(signed).collect()
    }
}

/// States the depth of the defects of `record` against `reference`, and adds a finding for each region of a component that is
/// farther from it than the rule tolerates. Names of new findings are given later. `mesh` is that of the record's model.
pub(crate) fn compare_with_reference(
    record: &mut FindingsRecord,
    mesh: &SemanticMesh,
    taxonomy: &Taxonomy,
    reference: &Reference,
    rule: DeviationRule,
) -> Vec<(Finding, [f64; 3])> {
    let surface = Surface::new(mesh, rule.voxel);
    let distances = reference.distances(&mesh.vertices.positions);
    let of = |region: &Region| -> Vec<f64> { region.vertices.iter().map(|v| distances[*v as usize]).collect() };
    for region in defect_regions(&surface).iter().filter(|r| r.area(&surface) >= record.least_area) {
        let footprint = identity::footprint(region.vertices.iter().map(|v| surface.position(*v)));
        let own = record.list.iter_mut().filter(|f| {
            f.kind.defect().is_some_and(|d| d.class == region.defect) && f.component.class == region.component
        });
        for figures in own.filter_map(|f| f.region.as_mut()).filter(|r| r.footprint == footprint) {
            let depths: Vec<f64> = of(region).iter().map(|d| -d).collect();
            figures.depth.reference = Some(depth(&surface, region, &depths));
        }
    }
    let beyond = |v: u32| {
        let component = surface.component(v);
        let is_face = !surface.faces(v).is_empty();
        (component != 0 && is_face && distances[v as usize].abs() > rule.tolerance)
            // Both sides apart: a hollow beside a hump is two findings.
            .then(|| (component, u16::from(distances[v as usize] < 0.0)))
    };
    let mut found = Vec::new();
    for region in connected(&surface, beyond).into_iter().filter(|r| r.area(&surface) >= record.least_area) {
        let sizes: Vec<f64> = of(&region).iter().map(|d| d.abs()).collect();
        let Quantity { value, expanded } = depth(&surface, &region, &sizes);
        let sign = if region.defect == 1 { -1.0 } else { 1.0 };
        let mut figures =
            region_figures(&surface, &region, Evidence::none(&region), &BTreeMap::<u32, KnownPose>::new());
        figures.depth.reference = Some(Quantity { value: -sign * value, expanded });
        let finding = Finding {
            id: FindingId::from_bytes([0; 16]),
            kind: FindingKind::Deviation {
                tolerance: rule.tolerance,
                greatest: Quantity { value: sign * value, expanded },
            },
            component: named(&taxonomy.components, region.component),
            instances: instances(&surface, region.vertices.iter().copied()),
            region: Some(figures),
        };
        found.push((finding, centroid(&surface, &region)));
    }
    found.sort_by(|(a, _), (b, _)| {
        let area = |f: &Finding| f.area().map_or(0.0, |a| a.value);
        a.component.class.cmp(&b.component.class).then(area(b).total_cmp(&area(a)))
    });
    found
}

/// The depth of a region of which `depths` are those of its vertices. Its standard uncertainty is how far vertices scatter
/// around their neighbours, and the tenth part of a voxel, below which no grid resolves.
fn depth(surface: &Surface<'_>, region: &Region, depths: &[f64]) -> Quantity {
    let smooth = averaged(surface, region, depths);
    let scatter: f64 = depths.iter().zip(&smooth).map(|(d, s)| (d - s) * (d - s)).sum::<f64>() / depths.len() as f64;
    Quantity::with_standard(quantile(surface, region, &smooth, QUANTILE), scatter.sqrt().hypot(0.1 * surface.voxel))
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{grid, with_defect};
    use super::super::{conventions, regions};
    use super::*;
    use semascan_model::finding::Depth;

    #[test]
    fn hollows_and_humps_beyond_the_tolerance_are_found_and_depths_stated() {
        // A hollow of 0.8 mm that is a defect, a hump of 0.5 mm that is none, and a dent that is tolerated.
        let spot = |x: u32, y: u32, at: (f32, f32)| (x as f32 - at.0).hypot(y as f32 - at.1) < 6.0;
        let mesh = grid(60, 40, |x, y| match () {
            () if spot(x, y, (12.0, 20.0)) => -0.8e-3,
            () if spot(x, y, (30.0, 20.0)) => 0.5e-3,
            () if spot(x, y, (48.0, 20.0)) => -0.1e-3,
            () => 0.0,
        });
        let mesh = with_defect(mesh, |x, y| (x - 12.0).hypot(y - 20.0) < 6.0);
        let reference = Reference::new(
            &[[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
            &[[0, 1, 2], [0, 2, 3]],
        )
        .expect("two triangles");
        let taxonomy = Taxonomy::from_names(&["plate"], &["pit"]);
        let surface = Surface::new(&mesh, 1e-3);
        let region = &regions::defect_regions(&surface)[0];
        let list = vec![Finding {
            id: FindingId::from_bytes([0; 16]),
            kind: FindingKind::Defect { defect: named(&taxonomy.defects, 1) },
            component: named(&taxonomy.components, 1),
            instances: Vec::new(),
            region: Some(region_figures(&surface, region, Evidence::none(region), &BTreeMap::new())),
        }];
        let mut record = FindingsRecord {
            conventions: conventions(),
            looked_for: Vec::new(),
            not_looked: None,
            least_area: 16e-6,
            left_out: Vec::new(),
            components: Vec::new(),
            list,
        };
        let rule = DeviationRule { tolerance: 0.3e-3, voxel: 1e-3 };
        let found = compare_with_reference(&mut record, &mesh, &taxonomy, &reference, rule);
        let Some(Depth { reference: Some(stated), .. }) = record.list[0].region.as_ref().map(|r| &r.depth) else {
            panic!("{:?}", record.list)
        };
        assert!((stated.value - 0.8e-3).abs() < 1e-6, "{stated:?}");
        let greatest: Vec<f64> = found
            .iter()
            .map(|(f, _)| match f.kind {
                FindingKind::Deviation { greatest, .. } => (greatest.value * 1e5).round() / 1e2,
                _ => f64::NAN,
            })
            .collect();
        assert_eq!(greatest, [-0.8, 0.5], "millimetres, the larger region first or as found");
        // The part that is no component is not compared.
        let mut bare = mesh.clone();
        bare.vertices.labels.fill(0);
        assert!(compare_with_reference(&mut record, &bare, &taxonomy, &reference, rule).is_empty());
        assert!(Reference::new(&[[0.0; 3]], &[]).is_none());
    }
}
