//! What can be measured, and what a person picks for it.

use semascan_geometry::fit::ElementKind;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
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

impl Kind {
    /// Every kind, in the order of the panel.
    pub const ALL: [Self; 9] = [
        Self::Distance,
        Self::Angle,
        Self::Plane,
        Self::Cylinder,
        Self::Sphere,
        Self::Circle,
        Self::Step,
        Self::Along,
        Self::Area,
    ];

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

    /// What it does, with its key where it has one.
    pub fn title(self) -> &'static str {
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

    /// Name of the element that is fitted, within a sentence.
    pub fn element_name(self) -> &'static str {
        match self {
            Self::Step => "plane",
            kind => kind.key(),
        }
    }

    /// The element that is fitted where a person clicks; `None` where the point itself is picked.
    pub fn element(self) -> Option<ElementKind> {
        match self {
            Self::Distance | Self::Angle | Self::Area | Self::Along => None,
            Self::Step | Self::Plane => Some(ElementKind::Plane),
            Self::Cylinder => Some(ElementKind::Cylinder),
            Self::Sphere => Some(ElementKind::Sphere),
            Self::Circle => Some(ElementKind::Circle),
        }
    }

    /// Whether it is measured on the mesh.
    pub fn needs_mesh(self) -> bool {
        self.element().is_some() || matches!(self, Self::Area | Self::Along)
    }

    /// Whether elements of the list can be picked for it in the place of points.
    pub fn takes_elements(self) -> bool {
        matches!(self, Self::Distance | Self::Angle | Self::Step)
    }
}
