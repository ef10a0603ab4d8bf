//! The figures of a model, from its points and their mesh: the one place where they are computed.

use super::batch::both;
use super::seen_vertex_areas;
use semascan_model::{FeatureFigures, ModelFigures, PointFlags, SemanticCloud, SemanticMesh};
use std::collections::BTreeMap;

/// What a figure is summed up by: component and id, as in [`FeatureFigures`].
type Key = (u16, u16);

/// Sums of one feature.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    points: u64,
    area: f64,
    confidence: f64,
    sigma: f64,
}

/// Sums of all features of a kind.
type Table = BTreeMap<Key, Sums>;

/// Figures of the model whose points are `cloud` and whose mesh, as it was made of voxels of edge `voxel` (metres) and not
/// smoothed, filled or simplified, is `mesh`. Numbers, confidences and uncertainties are those of the points, areas those
/// of the mesh ([`seen_vertex_areas`]); without triangles areas are unknown.
pub fn model_figures(cloud: &SemanticCloud, mesh: &SemanticMesh, voxel: f32) -> ModelFigures {
    let (tables, areas) = both(|| sums_of_points(cloud), || seen_vertex_areas(mesh, voxel));
    let [mut components, mut defects, mut findings, mut instances] = tables;
    let vertices = &mesh.vertices;
    for (v, area) in areas.into_iter().enumerate() {
        let (label, defect, instance) = (vertices.labels[v], vertices.defects[v], vertices.instances[v]);
        components.entry((label, label)).or_default().area += area;
        defects.entry((0, defect)).or_default().area += area;
        if defect != 0 {
            findings.entry((label, defect)).or_default().area += area;
        }
        if instance != 0 {
            instances.entry((label, instance)).or_default().area += area;
        }
    }
    let measured = !mesh.triangles.is_empty();
    let list = |table: Table| -> Vec<_> { table.into_iter().map(|(key, sums)| sums.figures(key, measured)).collect() };
    ModelFigures {
        components: list(components),
        defects: list(defects),
        findings: list(findings),
        instances: of_instances(instances).into_iter().map(|(key, sums)| sums.figures(key, measured)).collect(),
    }
}

/// Sums over the points of components, defects, findings and instances, without areas.
fn sums_of_points(cloud: &SemanticCloud) -> [Table; 4] {
    let [mut components, mut defects, mut findings, mut instances] = [(); 4].map(|()| Table::new());
    for p in cloud.iter().filter(|p| !p.flags.has(PointFlags::LEFT_OUT)) {
        let count = |table: &mut Table, key: Key, confidence: f32, sigma: f32| {
            let sums = table.entry(key).or_default();
            sums.points += 1;
            sums.confidence += f64::from(confidence);
            sums.sigma += f64::from(sigma);
        };
        count(&mut components, (p.label, p.label), p.confidence, p.sigma);
        count(&mut defects, (0, p.defect), p.defect_confidence, p.defect_sigma);
        if p.defect != 0 {
            count(&mut findings, (p.label, p.defect), p.defect_confidence, p.defect_sigma);
        }
        if p.instance != 0 {
            count(&mut instances, (p.label, p.instance), p.confidence, p.sigma);
        }
    }
    [components, defects, findings, instances]
}

/// The sums of each instance, by number, under the component that most of its points belong to; of equals the lowest.
fn of_instances(by_component: Table) -> Vec<(Key, Sums)> {
    let mut instances: BTreeMap<u16, (u16, u64, Sums)> = BTreeMap::new();
    for ((component, instance), sums) in by_component {
        let (most, points, all) = instances.entry(instance).or_insert((component, sums.points, Sums::default()));
        if sums.points > *points {
            (*most, *points) = (component, sums.points);
        }
        all.points += sums.points;
        all.area += sums.area;
        all.confidence += sums.confidence;
        all.sigma += sums.sigma;
    }
    instances.into_iter().map(|(instance, (component, _, sums))| ((component, instance), sums)).collect()
}

impl Sums {
    fn figures(self, (component, id): Key, measured: bool) -> FeatureFigures {
        let share = 1.0 / self.points.max(1) as f64;
        FeatureFigures {
            id,
            component,
            points: self.points,
            area: measured.then_some(self.area),
            confidence: self.confidence * share,
            sigma: self.sigma * share,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    #[test]
    fn points_count_once_and_areas_come_from_the_mesh() {
        let point = |x: f32, y: f32, label: u16, defect: u16, instance: u16, confidence: f32| SemanticPoint {
            position: [x, y, 0.0],
            normal: [0.0, 0.0, 1.0],
            label,
            defect,
            instance,
            confidence,
            defect_confidence: 0.5,
            sigma: 0.1,
            ..SemanticPoint::UNKNOWN
        };
        let mut cloud: SemanticCloud = [
            point(0.0, 0.0, 1, 0, 4, 1.0),
            point(1.0, 0.0, 1, 2, 4, 0.5),
            point(1.0, 1.0, 2, 2, 4, 0.8),
            point(0.0, 1.0, 2, 0, 3, 0.6),
            point(9.0, 9.0, 2, 0, 3, 0.0),
        ]
        .into_iter()
        .collect();
        cloud.flags[4] = PointFlags(PointFlags::BACKGROUND);
        let vertices: SemanticCloud = cloud.iter().take(4).collect();
        let mesh = SemanticMesh { vertices, boundary: vec![false; 4], triangles: vec![[0, 1, 2], [0, 2, 3]] };
        let figures = model_figures(&cloud, &mesh, 1e-3);
        let said = |f: Option<FeatureFigures>| {
            let f = f.expect("it occurs");
            let area = (f.area.expect("a mesh") * 6.0).round();
            (f.component, f.points, area, (f.confidence * 100.0).round(), (f.sigma * 100.0).round())
        };
        // Vertices 0 and 2 have two thirds of half the square, the others one.
        assert_eq!(said(figures.component(1)), (1, 2, 3.0, 75.0, 10.0));
        assert_eq!(said(figures.component(2)), (2, 2, 3.0, 70.0, 10.0));
        assert_eq!(said(figures.defect(2)), (0, 2, 3.0, 50.0, 0.0));
        assert_eq!(said(figures.instance(4)), (1, 3, 5.0, 77.0, 10.0));
        assert_eq!(said(figures.instance(3)), (2, 1, 1.0, 60.0, 10.0));
        let findings: Vec<_> = [1, 2].into_iter().flat_map(|c| figures.findings_on(c)).map(|f| said(Some(f))).collect();
        assert_eq!(findings, [(1, 1, 1.0, 50.0, 0.0), (2, 1, 2.0, 50.0, 0.0)]);
        let order: Vec<u16> = figures.instances.iter().map(|f| f.id).collect();
        assert_eq!((order, figures.component(3)), (vec![3, 4], None));
    }

    #[test]
    fn without_a_mesh_areas_are_unknown() {
        let cloud: SemanticCloud =
            [SemanticPoint { label: 1, confidence: 0.5, ..SemanticPoint::UNKNOWN }].into_iter().collect();
        let one = model_figures(&cloud, &SemanticMesh::default(), 1e-3).component(1).expect("it occurs");
        assert_eq!((one.points, one.area, one.confidence), (1, None, 0.5));
        assert_eq!(model_figures(&SemanticCloud::default(), &SemanticMesh::default(), 1e-3), ModelFigures::default());
    }
}
