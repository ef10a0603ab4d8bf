//! What can be measured, and what a person picks for it.

use semascan_geometry::fit::ElementKind;
pub use semascan_model::measurement::MeasurementKind as Kind;

/// How a measurement of a kind is taken.
pub trait Picking {
    /// What it does, with its key where it has one.
    fn title(self) -> &'static str;
    /// Name of the element that is fitted, within a sentence.
    fn element_name(self) -> &'static str;
    /// The element that is fitted where a person clicks; `None` where the point itself is picked.
    fn element(self) -> Option<ElementKind>;
    /// Whether it is measured on the mesh.
    fn needs_mesh(self) -> bool;
    /// Whether elements of the list can be picked for it in the place of points.
    fn takes_elements(self) -> bool;
}

/// Every kind, in the order of the panel.
pub const KINDS: [Kind; 9] = [
    Kind::Distance,
    Kind::Angle,
    Kind::Plane,
    Kind::Cylinder,
    Kind::Sphere,
    Kind::Circle,
    Kind::Step,
    Kind::Along,
    Kind::Area,
];

impl Picking for Kind {
    fn title(self) -> &'static str {
        match self {
            Self::Distance => "Distance of two points or elements (M)",
            Self::Angle => "Angle of three points or two elements (G)",
            Self::Step => "Height of one plane above another",
            Self::Plane => "Fit a plane to the surface around a point",
            Self::Cylinder => "Fit a cylinder to the surface around a point",
            Self::Sphere => "Fit a sphere to the surface around a point",
            Self::Circle => "Fit a circle to the nearest rim of a plane",
            Self::Area => "Area of the surface up to its edges",
            Self::Along => "Shortest way between two points along the surface",
        }
    }

    fn element_name(self) -> &'static str {
        match self {
            Self::Step => "plane",
            kind => kind.key(),
        }
    }

    fn element(self) -> Option<ElementKind> {
        match self {
            Self::Distance | Self::Angle | Self::Area | Self::Along => None,
            Self::Step | Self::Plane => Some(ElementKind::Plane),
            Self::Cylinder => Some(ElementKind::Cylinder),
            Self::Sphere => Some(ElementKind::Sphere),
            Self::Circle => Some(ElementKind::Circle),
        }
    }

    fn needs_mesh(self) -> bool {
        self.element().is_some() || matches!(self, Self::Area | Self::Along)
    }

    fn takes_elements(self) -> bool {
        matches!(self, Self::Distance | Self::Angle | Self::Step)
    }
}
