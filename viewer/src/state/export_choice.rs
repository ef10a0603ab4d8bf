//! How meshes are exported: what their formats do not say, and how fine they are.

use crate::words::t;
use semascan_formats::{FileFrame, UpAxis};
use semascan_model::LengthUnit;

/// What a person chose for the files of meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExportChoice {
    /// Unit and upward axis of OBJ and STL; PLY and glTF are in metres.
    pub frame: FileFrame,
    /// How many of the triangles.
    pub detail: Detail,
    /// How many STL files.
    pub solids: Solids,
}

/// How many of the triangles a file has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detail {
    /// All.
    #[default]
    Full,
    /// Half of them.
    Half,
    /// A tenth.
    Tenth,
}

/// How many STL files there are: the format has no components.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Solids {
    /// One for each component.
    #[default]
    ByComponent,
    /// One for all.
    One,
}

impl Detail {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Full, Self::Half, Self::Tenth];

    /// Stable name for forms and tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Half => t!("export.detail.half"),
            Self::Tenth => "tenth",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Full => t!("export.detail.full"),
            Self::Half => t!("export.detail.half"),
            Self::Tenth => t!("export.detail.tenth"),
        }
    }

    /// How many of so many triangles; `None` for all.
    pub fn most(self, triangles: usize) -> Option<usize> {
        match self {
            Self::Full => None,
            Self::Half => Some(triangles.div_ceil(2)),
            Self::Tenth => Some(triangles.div_ceil(10)),
        }
    }
}

impl Solids {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::ByComponent, Self::One];

    /// Stable name for forms and tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::ByComponent => "components",
            Self::One => "one",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::ByComponent => t!("export.solids.components"),
            Self::One => t!("export.solids.one"),
        }
    }
}

/// The upward axes with their names in forms.
pub const UP_AXES: [(UpAxis, &str); 2] = [(UpAxis::Z, "z"), (UpAxis::Y, "y")];

/// The units, those of parts first.
pub const UNITS: [LengthUnit; 4] =
    [LengthUnit::Millimetres, LengthUnit::Inches, LengthUnit::Centimetres, LengthUnit::Metres];
