//! Points by component, those without a unit normal apart: glTF allows no other normals.

use super::features::Finding;
use semascan_model::SemanticCloud;
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
#[derive(Clone, Debug, serde::Serialize)]
pub(super) struct Figures {
    /// Component class.
    pub(super) class: u16,
    /// Number of points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) points: Option<usize>,
    /// Number of triangles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) triangles: Option<usize>,
    /// Area in square metres.
    pub(super) area: f64,
    /// Mean share of the class over the points or vertices.
    pub(super) confidence: f64,
    /// Its defects.
    pub(super) findings: Vec<Finding>,
}

impl Component {
    /// All its points.
    pub(super) fn points(&self) -> Vec<usize> {
        self.oriented.iter().chain(&self.bare).copied().collect()
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
