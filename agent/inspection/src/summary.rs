//! From the map to what an inspection is after: the components and defects of a part, with points, area and confidence.

use semascan_geometry::measure::surfel_area;
use semascan_model::record::ClassSummary;
use semascan_model::{ClassDef, PointFlags, SemanticCloud, Taxonomy};

/// Figures of every component class and every defect class but `none`, in order; `voxel` in metres.
pub fn summarize(cloud: &SemanticCloud, taxonomy: &Taxonomy, voxel: f64) -> (Vec<ClassSummary>, Vec<ClassSummary>) {
    let mut components = empty(&taxonomy.components);
    let mut defects = empty(&taxonomy.defects);
    for p in cloud.iter().filter(|p| !p.flags.has(PointFlags::OUTLIER | PointFlags::BACKGROUND)) {
        let area = f64::from(surfel_area(p.normal, voxel as f32));
        for (list, class, share) in
            [(&mut components, p.label, p.confidence), (&mut defects, p.defect, p.defect_confidence)]
        {
            if let Some(summary) = list.get_mut(usize::from(class)) {
                summary.points += 1;
                summary.area += area;
                summary.confidence += f64::from(share);
            }
        }
    }
    for summary in components.iter_mut().chain(&mut defects) {
        summary.confidence /= summary.points.max(1) as f64;
    }
    defects.remove(0);
    (components, defects)
}

fn empty(classes: &[ClassDef]) -> Vec<ClassSummary> {
    let one = |c: &ClassDef| ClassSummary { class: c.id, name: c.name.clone(), points: 0, area: 0.0, confidence: 0.0 };
    classes.iter().map(one).collect()
}
