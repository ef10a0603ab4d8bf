//! How the model is shown: what the colours mean, the theme, which marked points are drawn.

pub use crate::render::ColorMode;

impl ColorMode {
    /// The modes that every model has, in the order of the panel. Deviation needs a reference.
    pub const ALL: [Self; 6] =
        [Self::Appearance, Self::Component, Self::Confidence, Self::Views, Self::Defect, Self::Sigma];

    /// Stable name for addresses, styles and tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::Appearance => "appearance",
            Self::Component => "component",
            Self::Confidence => "confidence",
            Self::Views => "views",
            Self::Defect => "defect",
            Self::Sigma => "sigma",
            Self::Deviation => "deviation",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Appearance => "Appearance",
            Self::Component => "Component",
            Self::Confidence => "Confidence",
            Self::Views => "Views",
            Self::Defect => "Defect",
            Self::Sigma => "Uncertainty",
            Self::Deviation => "Deviation",
        }
    }

    /// The mode `step` places further, round in a circle.
    pub fn stepped(self, step: i32) -> Self {
        let here = Self::ALL.iter().position(|m| *m == self).unwrap_or(0) as i32;
        let there = (here + step % Self::ALL.len() as i32).rem_euclid(Self::ALL.len() as i32);
        Self::ALL[there as usize]
    }

    /// What the colours say, in a sentence.
    pub fn explanation(self) -> &'static str {
        match self {
            Self::Appearance => "The surface as the camera saw it.",
            Self::Component => "Each point in the colour of its component.",
            Self::Confidence => "Share of the evidence that speaks for the point's component.",
            Self::Views => "Number of views that saw the point.",
            Self::Defect => "Each point in the colour of its defect.",
            Self::Sigma => "How far the networks disagree about the point's component (sigma).",
            Self::Deviation => "Distance of the mesh from the reference: positive outside, negative inside.",
        }
    }
}

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
            Self::System => "System",
            Self::Light => "Light",
            Self::Dark => "Dark",
        }
    }

    /// The theme of that [`key`](Self::key).
    pub fn from_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.key() == key)
    }
}

/// How the model is shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Display {
    /// What the colours mean.
    pub color_mode: ColorMode,
    /// The chosen theme.
    pub theme: Theme,
    /// Whether the system prefers dark pages.
    pub system_dark: bool,
    /// Whether points marked as outliers are drawn, counted and exported.
    pub outliers: bool,
    /// Whether points outside the measuring volume are drawn, counted and exported.
    pub background: bool,
}

impl Default for Display {
    fn default() -> Self {
        Self {
            color_mode: ColorMode::Component,
            theme: Theme::default(),
            system_dark: false,
            outliers: false,
            background: false,
        }
    }
}

impl Display {
    /// Whether the page is dark.
    pub fn dark(&self) -> bool {
        match self.theme {
            Theme::System => self.system_dark,
            Theme::Light => false,
            Theme::Dark => true,
        }
    }

    /// The other theme than the one on screen.
    pub fn toggled_theme(&self) -> Theme {
        if self.dark() { Theme::Light } else { Theme::Dark }
    }
}
