//! What can be measured, and what a person picks for it.

use crate::words::t;
use semascan_geometry::fit::ElementKind;
pub use semascan_model::measurement::MeasurementKind as Kind;

/// How a measurement of a kind is taken.
pub trait Picking {
    /// What it does, with its key where it has one.
    fn title(self) -> &'static str;
    /// Its name.
    fn name(self) -> &'static str;
    /// Its name within a sentence.
    fn name_within(self) -> &'static str;
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
            Self::Distance => t!("measure.title.distance"),
            Self::Angle => t!("measure.title.angle"),
            Self::Step => t!("measure.title.step"),
            Self::Plane => t!("measure.title.plane"),
            Self::Cylinder => t!("measure.title.cylinder"),
            Self::Sphere => t!("measure.title.sphere"),
            Self::Circle => t!("measure.title.circle"),
            Self::Area => t!("measure.title.area"),
            Self::Along => t!("measure.title.along"),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Distance => t!("measure.kind.distance"),
            Self::Angle => t!("measure.kind.angle"),
            Self::Step => t!("measure.kind.step"),
            Self::Plane => t!("measure.kind.plane"),
            Self::Cylinder => t!("measure.kind.cylinder"),
            Self::Sphere => t!("measure.kind.sphere"),
            Self::Circle => t!("measure.kind.circle"),
            Self::Area => t!("measure.kind.area"),
            Self::Along => t!("measure.kind.along"),
        }
    }

    fn name_within(self) -> &'static str {
        match self {
            Self::Distance => t!("measure.within.distance"),
            Self::Angle => t!("measure.within.angle"),
            Self::Step => t!("measure.within.step"),
            Self::Plane => t!("measure.within.plane"),
            Self::Cylinder => t!("measure.within.cylinder"),
            Self::Sphere => t!("measure.within.sphere"),
            Self::Circle => t!("measure.within.circle"),
            Self::Area => t!("measure.within.area"),
            Self::Along => t!("measure.within.along"),
        }
    }

    fn element_name(self) -> &'static str {
        match self {
            Self::Step => Self::Plane.name_within(),
            kind => kind.name_within(),
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
