//! Points by component, those without a unit normal apart: glTF allows no other normals.

use super::{GlbOptions, class_of};
use semascan_model::finding::{Finding, FindingId, Quantity, RegionFigures};
use semascan_model::{FeatureFigures, SemanticCloud, Taxonomy};
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

/// Figures of one component, as extras of its nodes: those of the model, see [`FeatureFigures`].
#[derive(Clone, Debug, serde::Serialize)]
pub(super) struct Extras {
    /// Component class.
    class: u16,
    /// Number of triangles of the node.
    #[serde(skip_serializing_if = "Option::is_none")]
    triangles: Option<usize>,
    #[serde(flatten)]
    figures: Option<Known>,
    /// Its defects.
    findings: Vec<DefectOn>,
}

/// A defect on a component, all its regions together.
#[derive(Clone, Debug, serde::Serialize)]
struct DefectOn {
    /// Defect class.
    defect: u16,
    name: String,
    #[serde(flatten)]
    figures: Known,
    /// Its regions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    regions: Vec<RegionOf>,
}

/// A finding's region. Metres, square metres, table frame.
#[derive(Clone, Debug, serde::Serialize)]
struct RegionOf {
    /// The finding's name in the record.
    id: FindingId,
    area: Quantity,
    length: Quantity,
    width: Quantity,
    position: [f64; 3],
    normal: [f64; 3],
}

/// What is known of a component or defect.
#[derive(Clone, Debug, serde::Serialize)]
struct Known {
    /// Number of points of the model.
    points: u64,
    /// Square metres; absent where it is unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    area: Option<f64>,
    /// Mean share of the class.
    confidence: f64,
    /// Mean standard uncertainty of the label.
    sigma: f64,
}

impl Extras {
    /// Extras of the node of component `class`, which has `triangles` if it is a mesh.
    pub(super) fn of(class: u16, triangles: Option<usize>, options: &GlbOptions, taxonomy: &Taxonomy) -> Self {
        let figures = &options.figures;
        let on = |f: FeatureFigures| DefectOn {
            defect: f.id,
            name: class_of(&taxonomy.defects, f.id).0,
            figures: f.into(),
            regions: options.findings.iter().filter_map(|finding| RegionOf::new(finding, class, f.id)).collect(),
        };
        let findings = figures.findings_on(class).map(on).collect();
        Self { class, triangles, figures: figures.component(class).or(figures.absent()).map(Known::from), findings }
    }
}

impl RegionOf {
    /// The region of a finding of `defect` on component `class`.
    fn new(finding: &Finding, class: u16, defect: u16) -> Option<Self> {
        let of_both = finding.component.class == class && finding.kind.defect().is_some_and(|d| d.class == defect);
        let &RegionFigures { area, length, width, position, normal, .. } =
            finding.region.as_ref().filter(|_| of_both)?;
        Some(Self { id: finding.id, area, length, width, position, normal })
    }
}

impl From<FeatureFigures> for Known {
    fn from(FeatureFigures { points, area, confidence, sigma, .. }: FeatureFigures) -> Self {
        Self { points, area, confidence, sigma }
    }
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
