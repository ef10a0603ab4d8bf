//! Which pixels take part in the registration (P1's segment ICP takes those of the object).

use super::registration::RegistrationInput;

/// Which pixels take part in the registration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// All: right where everything in the picture stands still.
    Everything,
    /// Those with a component label (segment ICP); all, where a view has hardly any.
    Object,
    /// Those of one component class.
    Class(u16),
}

impl Selection {
    /// Whether points of `class` take part.
    pub(super) fn wants(self, class: u16) -> bool {
        match self {
            Self::Everything => true,
            Self::Object => class != 0,
            Self::Class(wanted) => class == wanted,
        }
    }

    /// Whether pixel `i` (row-major) of a view takes part: it has depth, and a label that is wanted.
    pub(super) fn includes(self, input: &RegistrationInput<'_>, i: usize) -> bool {
        input.cloud.depth[i] > 0.0 && (self == Self::Everything || self.wants(input.segmentation.components.best(i)))
    }
}
