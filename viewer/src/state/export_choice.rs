//! How the model is exported: what of it, how fine, and what its formats do not say; and how far an export is.

use crate::words::t;
use semascan_formats::{FileFrame, UpAxis};
use semascan_model::LengthUnit;

/// What a person chose for the files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExportChoice {
    /// What of the model.
    pub content: Content,
    /// Unit and upward axis of OBJ and STL; PLY and glTF are in metres.
    pub frame: FileFrame,
    /// How many of the triangles.
    pub detail: Detail,
    /// How many STL files.
    pub solids: Solids,
}

/// What of the model a file holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Content {
    /// The components and points that are switched on, what plane and box cut away among them.
    #[default]
    Shown,
    /// The same without what is cut away.
    Kept,
    /// Everything.
    All,
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

impl Content {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Shown, Self::Kept, Self::All];

    /// Stable name for forms and tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::Shown => "shown",
            Self::Kept => "kept",
            Self::All => "all",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Shown => t!("export.content.shown"),
            Self::Kept => t!("export.content.kept"),
            Self::All => t!("export.content.all"),
        }
    }
}

impl Detail {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Full, Self::Half, Self::Tenth];

    /// Stable name for forms and tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Half => "half",
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

/// A step of an export.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Step {
    /// The worker starts and takes the model.
    #[default]
    Prepare,
    /// The mesh gets fewer triangles.
    Simplify,
    /// The files are written.
    Write,
}

impl Step {
    /// All of them, in order.
    pub const ALL: [Self; 3] = [Self::Prepare, Self::Simplify, Self::Write];

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Prepare => t!("export.step.prepare"),
            Self::Simplify => t!("export.step.simplify"),
            Self::Write => t!("export.step.write"),
        }
    }
}

/// How far an export is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exporting {
    /// What is being done.
    pub step: Step,
    /// How much of that is done, 0..=1.
    pub share: f32,
}
