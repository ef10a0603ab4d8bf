//! What an inspection found: connected defect regions on the surface and what else a person or a rule has to judge, each
//! with its place, its size and how sure that is. Plain data.
//!
//! Lengths in metres, areas in square metres, positions in the table frame. A figure that is not known is absent, never 0.
//! How the figures are measured is said where it is done, in `semascan_inspection::findings`, and shortly in
//! [`FindingsRecord::conventions`].

use crate::record::Convention;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::fmt;
use uuid::Uuid;

/// Names a finding: a UUID of version 8 (RFC 9562) made of what was found and where, so that the same recording gives the
/// same name; a finding that an earlier result has under another name keeps that.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FindingId(#[cfg_attr(feature = "schema", schemars(with = "String"))] Uuid);

impl FindingId {
    /// The name that `bytes` stand for; six bits of them become the UUID's version and variant.
    pub fn from_bytes(bytes: [u8; 16]) -> Self {
        Self(uuid::Builder::from_custom_bytes(bytes).into_uuid())
    }

    /// The UUID.
    pub fn uuid(self) -> Uuid {
        self.0
    }
}

impl fmt::Display for FindingId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A class and its name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct NamedClass {
    /// Class.
    pub class: u16,
    /// Its name.
    pub name: String,
}

/// A measured figure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Quantity {
    /// Its value.
    pub value: f64,
    /// Its expanded uncertainty, coverage factor k = 2: the interval `value` +- `expanded` holds the truth with about 95 %.
    /// Absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expanded: Option<f64>,
}

impl Quantity {
    /// Coverage factor of [`Self::expanded`].
    pub const COVERAGE_FACTOR: f64 = 2.0;

    /// A value with its standard uncertainty.
    pub fn with_standard(value: f64, standard: f64) -> Self {
        Self { value, expanded: Some(Self::COVERAGE_FACTOR * standard) }
    }

    /// A value whose uncertainty is not known.
    pub fn without_uncertainty(value: f64) -> Self {
        Self { value, expanded: None }
    }

    /// Lower and upper end of the interval; `None` where the uncertainty is not known.
    pub fn interval(self) -> Option<(f64, f64)> {
        self.expanded.map(|u| (self.value - u, self.value + u))
    }
}

/// Mean, least and greatest value over the surface of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Spread {
    /// Mean, weighted by area.
    pub mean: f64,
    /// Least value.
    pub least: f64,
    /// Greatest value.
    pub greatest: f64,
}

impl Spread {
    /// Of values with the areas that they stand for; `None` if there are none.
    pub fn of(values: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let (mut sum, mut weight) = (0.0, 0.0);
        let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        for (value, area) in values {
            let area = area.max(f64::MIN_POSITIVE);
            (sum, weight) = (sum + area * value, weight + area);
            (least, greatest) = (least.min(value), greatest.max(value));
        }
        (weight > 0.0).then(|| Self { mean: sum / weight, least, greatest })
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum FindingKind {
    /// A connected region of one component with one defect.
    Defect {
        /// The defect.
        defect: NamedClass,
    },
    /// Less of a component was seen than is expected of it.
    Completeness {
        /// Seen area as a share of the expected one; absent where no area is expected.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        share: Option<Quantity>,
        /// The least share that is expected.
        least: f64,
        /// Whether nothing of the component was seen.
        missing: bool,
    },
    /// A connected region that is farther from the reference than is tolerated.
    Deviation {
        /// Greatest tolerated distance.
        tolerance: f64,
        /// The distance that is largest in size; positive where the surface lies outside of the reference.
        greatest: Quantity,
    },
    /// Outlined by a person.
    Drawn {
        /// The defect that the person sees there; absent for a remark.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        defect: Option<NamedClass>,
        /// Who.
        person: String,
        /// When (RFC 3339, UTC).
        #[cfg_attr(feature = "schema", schemars(with = "String"))]
        at: Timestamp,
        /// In words.
        comment: String,
    },
}

impl FindingKind {
    /// For people and for the finding's name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Defect { .. } => "defect",
            Self::Completeness { .. } => "completeness",
            Self::Deviation { .. } => "deviation",
            Self::Drawn { .. } => "drawn",
        }
    }

    /// The defect class, where the finding is of one.
    pub fn defect(&self) -> Option<&NamedClass> {
        match self {
            Self::Defect { defect } => Some(defect),
            Self::Drawn { defect, .. } => defect.as_ref(),
            Self::Completeness { .. } | Self::Deviation { .. } => None,
        }
    }
}

/// Something about the part that a person or a rule has to judge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Finding {
    /// Its name, which stays.
    pub id: FindingId,
    /// What was found.
    #[serde(flatten)]
    pub kind: FindingKind,
    /// The component that it is on.
    pub component: NamedClass,
    /// Instances of the component that it touches, in order; empty where they are not told apart.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instances: Vec<u16>,
    /// The piece of surface; absent for what was not seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<RegionFigures>,
}

impl Finding {
    /// Its area, where it has one.
    pub fn area(&self) -> Option<Quantity> {
        self.region.as_ref().map(|region| region.area)
    }
}

/// Where a finding is, and how large.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RegionFigures {
    /// Area of its mesh faces, square metres.
    pub area: Quantity,
    /// What the uncertainty of the area is made of.
    pub area_budget: AreaBudget,
    /// Longest way between two of its points on its surface.
    pub length: Quantity,
    /// Largest extent across that way.
    pub width: Quantity,
    /// Length of its outlines.
    pub perimeter: f64,
    /// How deep it is.
    pub depth: Depth,
    /// Share of the evidence that the class has.
    pub confidence: Spread,
    /// Standard uncertainty of the label, 0 to 1.
    pub sigma: LabelUncertainty,
    /// The point of the surface nearest to its centroid.
    pub position: [f64; 3],
    /// Mean unit normal, outward; zero where there is none.
    pub normal: [f64; 3],
    /// Closed curves around it, table frame, simplified; the first is the outer one, the others are holes. The last point
    /// is joined with the first, and the region lies to the left, seen from outside.
    pub outlines: Vec<Vec<[f64; 3]>>,
    /// The views that saw it, the best first.
    pub views: Vec<FindingView>,
    /// The cells of a grid in the table frame that it touches, by which it is found again in another result.
    pub footprint: Footprint,
}

/// Standard uncertainty of an area by source, square metres: the root of the sum of their squares is that of the area, which
/// is not known without that of the poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AreaBudget {
    /// Where between two voxels the rim lies.
    pub grid: f64,
    /// Rim to other components.
    pub other_components: f64,
    /// Rim to what was not seen.
    pub unseen: f64,
    /// How areas are measured on a mesh.
    pub convention: f64,
    /// The labels' own uncertainty.
    pub labels: f64,
    /// The poses of the views; absent where no covariance is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<f64>,
}

impl AreaBudget {
    /// The combined standard uncertainty; `None` where a part is not known.
    pub fn combined(&self) -> Option<f64> {
        let Self { grid, other_components, unseen, convention, labels, poses } = *self;
        let squares = [grid, other_components, unseen, convention, labels, poses?].map(|part| part * part);
        Some(squares.iter().sum::<f64>().sqrt())
    }
}

/// Depth of a region, positive where material is missing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Depth {
    /// Against a surface fitted to its surroundings: the 95 % quantile over the region.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fitted: Option<Quantity>,
    /// Why that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unknown: Option<String>,
    /// Against a reference, the same quantile; absent without a reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<Quantity>,
}

/// Uncertainty of the labels of a region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LabelUncertainty {
    /// As a whole.
    #[serde(flatten)]
    pub all: Spread,
    /// The part that is in the data; absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub data: Option<Spread>,
    /// The part that is in the networks; absent where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<Spread>,
}

/// A view that saw a finding.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FindingView {
    /// Position of the view in the capture order.
    pub view: u32,
    /// The smallest box of pixels around what the view saw of it.
    pub pixels: PixelBox,
    /// Share of its area that the view saw, 0 to 1.
    pub share: f64,
    /// Mean cosine of incidence on that.
    pub cosine: f64,
}

/// A box of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PixelBox {
    /// First column.
    pub left: u32,
    /// First row.
    pub top: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Cells of a grid that a region touches.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Footprint {
    /// Edge of a cell.
    pub cell: f64,
    /// Lowest corners of the cells divided by the edge, in order.
    pub cells: Vec<[i32; 3]>,
}

/// Figures of a component, its instances together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ComponentFigures {
    /// The component.
    pub component: NamedClass,
    /// Its instances that were seen, in order; empty where they are not told apart.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instances: Vec<u16>,
    /// Area that was seen, square metres.
    pub area: Quantity,
    /// Part of this area whose defect labels have no evidence: nobody knows whether there is a defect.
    pub unjudged: f64,
    /// Share of the evidence that the component's class has, over its surface; absent where nothing was seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confidence: Option<Spread>,
    /// Standard uncertainty of its label, 0 to 1; absent where nothing was seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<Spread>,
}

/// Regions of one defect on one component that are too small to be findings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LeftOut {
    /// The component.
    pub component: NamedClass,
    /// The defect.
    pub defect: NamedClass,
    /// Their number.
    pub regions: u64,
    /// Their area, square metres.
    pub area: f64,
}

/// All that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FindingsRecord {
    /// How the figures are to be read.
    pub conventions: Vec<Convention>,
    /// Defect classes that were looked for.
    pub looked_for: Vec<NamedClass>,
    /// Why nothing is known of defects; absent where they were looked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_looked: Option<String>,
    /// Regions with less area than this, square metres, are no findings.
    pub least_area: f64,
    /// These regions.
    pub left_out: Vec<LeftOut>,
    /// Every component class but none.
    pub components: Vec<ComponentFigures>,
    /// The findings by component, kind, defect and area, the largest first.
    pub list: Vec<Finding>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_is_written_flat_and_read_back() {
        let id = FindingId::from_bytes([0xff; 16]);
        assert_eq!(id.uuid().get_version_num(), 8);
        let named = |class: u16, name: &str| NamedClass { class, name: name.into() };
        let finding = Finding {
            id,
            kind: FindingKind::Completeness {
                share: Some(Quantity::with_standard(0.4, 0.01)),
                least: 0.8,
                missing: false,
            },
            component: named(2, "gear"),
            instances: vec![1, 4],
            region: None,
        };
        let text = serde_json::to_string(&finding).expect("plain data");
        assert!(text.contains(r#""kind":"completeness""#) && text.contains(r#""expanded":0.02"#), "{text}");
        assert_eq!(serde_json::from_str::<Finding>(&text).expect("its own"), finding);
        let drawn = FindingKind::Drawn {
            defect: Some(named(1, "corrosion")),
            person: "A. Reviewer".into(),
            at: Timestamp::UNIX_EPOCH,
            comment: String::new(),
        };
        let text = serde_json::to_string(&drawn).expect("plain data");
        assert_eq!(serde_json::from_str::<FindingKind>(&text).expect("its own"), drawn);
        assert_eq!(drawn.defect().map(|d| d.class), Some(1));
    }

    #[test]
    fn an_interval_is_known_where_the_uncertainty_is() {
        assert_eq!(Quantity::with_standard(3.0, 0.5).interval(), Some((2.0, 4.0)));
        assert_eq!(Quantity::without_uncertainty(3.0).interval(), None);
    }
}
