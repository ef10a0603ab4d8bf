//! The theme that a person chooses, and the light or dark page that comes of it.

use crate::words::t;

/// Light or dark page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Theme {
    /// What the system prefers.
    #[default]
    System,
    /// Light.
    Light,
    /// Dark.
    Dark,
}

impl Theme {
    /// All themes in the order of the panel.
    pub const ALL: [Self; 3] = [Self::System, Self::Light, Self::Dark];

    /// Stable name for the page's attribute, the stored preference and tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::System => "system",
            Self::Light => "light",
            Self::Dark => "dark",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::System => t!("theme.system"),
            Self::Light => t!("theme.light"),
            Self::Dark => t!("theme.dark"),
        }
    }

    /// The theme of that [`key`](Self::key).
    pub fn from_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.key() == key)
    }
}

/// Whether the page is light or dark: what a [`Theme`] comes to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorScheme {
    /// Dark lines on light ground.
    Light,
    /// Light lines on dark ground.
    #[default]
    Dark,
}
