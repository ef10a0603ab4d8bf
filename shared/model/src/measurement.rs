//! A measurement that a person took on the model and keeps with the inspection: what was picked, its figures with their
//! uncertainties, and the lines that show it. Plain data.
//!
//! Metres, square metres and radians, table frame. How figures and uncertainties are computed is said in
//! `semascan_geometry::fit` and `semascan_geometry::measure`.

use crate::LengthUnit;
use crate::finding::Quantity;
use crate::review::ReviewId;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum MeasurementKind {
    /// The distance of two points or elements; of two points along each axis, too.
    Distance,
    /// The angle of three points, of which the second is the vertex, or of two elements.
    Angle,
    /// The height of the second of two planes above the first.
    Step,
    /// A plane fitted to the surface.
    Plane,
    /// A cylinder, and its radius.
    Cylinder,
    /// A sphere, and its radius.
    Sphere,
    /// The rim of a hole or boss as a circle, and its radius.
    Circle,
    /// The area of the surface up to creases.
    Area,
    /// The shortest way between two points along the surface.
    Along,
}

impl MeasurementKind {
    /// Stable name for tests and files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Distance => "distance",
            Self::Angle => "angle",
            Self::Step => "step",
            Self::Plane => "plane",
            Self::Cylinder => "cylinder",
            Self::Sphere => "sphere",
            Self::Circle => "circle",
            Self::Area => "area",
            Self::Along => "along",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Distance => "Distance",
            Self::Angle => "Angle",
            Self::Step => "Step height",
            Self::Plane => "Plane",
            Self::Cylinder => "Cylinder",
            Self::Sphere => "Sphere",
            Self::Circle => "Circle",
            Self::Area => "Area",
            Self::Along => "Along surface",
        }
    }

    /// What its figure is counted in.
    pub fn dimension(self) -> Dimension {
        match self {
            Self::Angle => Dimension::Angle,
            Self::Area => Dimension::Area,
            Self::Distance | Self::Step | Self::Plane | Self::Cylinder | Self::Sphere | Self::Circle | Self::Along => {
                Dimension::Length
            }
        }
    }

    /// Whether its figure is the radius of an element.
    pub fn is_radius(self) -> bool {
        matches!(self, Self::Cylinder | Self::Sphere | Self::Circle)
    }
}

/// What a figure is counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Metres.
    Length,
    /// Square metres.
    Area,
    /// Radians.
    Angle,
}

impl Dimension {
    /// One of the unit that people read, in metres, square metres or radians.
    pub fn one(self, unit: LengthUnit) -> f64 {
        match self {
            Self::Length => unit.in_metres(),
            Self::Area => unit.in_metres().powi(2),
            Self::Angle => 1_f64.to_radians(),
        }
    }

    /// Its name in files.
    pub fn name(self, unit: LengthUnit) -> String {
        match self {
            Self::Length => unit.name().into(),
            Self::Area => format!("{}2", unit.name()),
            Self::Angle => "deg".into(),
        }
    }
}

/// What a figure was taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum FeatureKind {
    /// A point of the surface.
    Point,
    /// A fitted plane.
    Plane,
    /// A fitted cylinder.
    Cylinder,
    /// A fitted sphere.
    Sphere,
    /// A fitted circle.
    Circle,
}

impl FeatureKind {
    /// Its name, within a sentence.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Plane => "plane",
            Self::Cylinder => "cylinder",
            Self::Sphere => "sphere",
            Self::Circle => "circle",
        }
    }
}

/// How well an element fits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct FitRecord {
    /// Root mean square of the distances of the points that were used, metres.
    pub rms: f64,
    /// Largest of these distances, metres.
    pub largest: f64,
    /// Points that were used.
    pub used: u64,
    /// Points that were left out: they do not lie on the element.
    pub left_out: u64,
}

/// A point or element that a figure was taken from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MeasuredFeature {
    /// What it is.
    pub kind: FeatureKind,
    /// Where it was picked, metres.
    pub picked: [f64; 3],
    /// Its middle, metres: the point itself, a point of the plane or of the axis, or the centre.
    pub position: [f64; 3],
    /// Unit normal or axis; absent where it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// Radius, metres; absent where it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// How well it fits; absent for a point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<FitRecord>,
}

/// A measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MeasurementRecord {
    /// What was measured.
    pub kind: MeasurementKind,
    /// The figure, in metres, square metres or radians as the kind has it; absent for a plane, which has none but its form.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub figure: Option<Quantity>,
    /// Of the distance of two points the way along each axis, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along_axes: Option<[Quantity; 3]>,
    /// What it was taken from, in the order in which it was picked.
    #[cfg_attr(feature = "schema", schemars(length(min = 1, max = 3)))]
    pub features: Vec<MeasuredFeature>,
    /// Voxel edge of the model, metres.
    pub voxel: f64,
    /// Where its figure is written, metres.
    pub place: [f64; 3],
    /// The lines that show it, metres.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(feature = "schema", schemars(length(max = 20_000)))]
    pub lines: Vec<[[f64; 3]; 2]>,
}

/// A measurement that is kept with an inspection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct KeptMeasurement {
    /// The review that it came with, which names it.
    pub review: ReviewId,
    /// Who measured.
    pub person: String,
    /// When it was taken in (RFC 3339, UTC).
    #[cfg_attr(feature = "schema", schemars(with = "String", extend("format" = "date-time")))]
    pub at: Timestamp,
    /// What the person says of it; may be empty.
    #[serde(default)]
    pub note: String,
    /// Whether the inspection has another model by now than the one that was measured.
    #[serde(default)]
    pub is_of_earlier_model: bool,
    /// The measurement.
    pub measurement: MeasurementRecord,
}
