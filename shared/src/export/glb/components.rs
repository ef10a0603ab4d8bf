//! Points by component, those without a unit normal apart: glTF allows no other normals.

use crate::measure::surfel_area;
use crate::model::SemanticCloud;
use std::collections::BTreeMap;

/// The points of one component, as indices into the cloud.
#[derive(Debug, Default)]
pub(super) struct Component {
    /// Component class.
    pub(super) label: u16,
    /// Points with a normal.
    pub(super) oriented: Vec<usize>,
    /// Points without.
    pub(super) bare: Vec<usize>,
}

/// Figures of one component, as extras of its nodes.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub(super) struct Figures {
    /// Component class.
    class: u16,
    /// Number of points.
    points: usize,
    /// Area in square metres.
    area: f64,
    /// Mean share of the class.
    confidence: f64,
}

impl Component {
    /// What the component measures, a point standing for a voxel of edge `voxel` (metres).
    pub(super) fn figures(&self, cloud: &SemanticCloud, voxel: f32) -> Figures {
        let all = || self.oriented.iter().chain(&self.bare);
        let points = all().count();
        let area = all().map(|&i| f64::from(surfel_area(cloud.normals[i], voxel))).sum();
        let confidence: f64 = all().map(|&i| f64::from(cloud.confidence[i])).sum();
        Figures { class: self.label, points, area, confidence: confidence / points as f64 }
    }
}

/// Components in order of their class, each with at least one point. Points whose position is not finite are left out.
pub(super) fn components(cloud: &SemanticCloud) -> Vec<Component> {
    let mut by_label: BTreeMap<u16, Component> = BTreeMap::new();
    for (i, position) in cloud.positions.iter().enumerate() {
        if !position.iter().all(|c| c.is_finite()) {
            continue;
        }
        let label = cloud.labels[i];
        let component = by_label.entry(label).or_insert_with(|| Component { label, ..Default::default() });
        if is_direction(cloud.normals[i]) { component.oriented.push(i) } else { component.bare.push(i) }
    }
    by_label.into_values().collect()
}

/// Whether a vector is a direction, if not quite of unit length.
pub(super) fn is_direction(normal: [f32; 3]) -> bool {
    let squared: f32 = normal.iter().map(|c| c * c).sum();
    (0.25..4.0).contains(&squared)
}
