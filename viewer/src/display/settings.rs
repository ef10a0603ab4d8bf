//! How the person has set up the display.

use super::{ColorMode, ColorScheme, Cut, HiddenFlags, Theme};

/// What the model is drawn as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Representation {
    /// Its points.
    #[default]
    Points,
    /// The mesh of its surface, once there is one.
    Mesh,
}

/// How the model is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Display {
    /// What the colours mean.
    pub color_mode: ColorMode,
    /// What the model is drawn as.
    pub representation: Representation,
    /// Whether there is a reference to measure deviations from: only then is [`ColorMode::Deviation`] on offer.
    pub has_reference: bool,
    /// The chosen theme.
    pub theme: Theme,
    /// Whether the system prefers dark pages.
    pub system_dark: bool,
    /// Whether points marked as outliers are drawn, counted and exported.
    pub outliers: bool,
    /// Whether points outside the measuring volume are drawn, counted and exported.
    pub background: bool,
    /// What is cut away from the picture.
    pub cut: Cut,
}

impl Default for Display {
    fn default() -> Self {
        Self {
            color_mode: ColorMode::Component,
            representation: Representation::default(),
            has_reference: false,
            theme: Theme::default(),
            system_dark: false,
            outliers: false,
            background: false,
            cut: Cut::default(),
        }
    }
}

impl Display {
    /// Gives the colours another meaning; deviations without a reference are refused. Deviations and photographs show the mesh, as
    /// they lie on it.
    pub fn set_color_mode(&mut self, mode: ColorMode) {
        if mode == ColorMode::Photo {
            self.representation = Representation::Mesh;
        }
        if mode == ColorMode::Deviation {
            if !self.has_reference {
                return;
            }
            self.representation = Representation::Mesh;
        }
        self.color_mode = mode;
    }

    /// Draws the model as its points or as its mesh; deviations are not shown without the mesh.
    pub fn set_representation(&mut self, representation: Representation) {
        self.representation = representation;
        if representation == Representation::Points {
            self.leave_deviations();
        }
    }

    /// Colours by component if the colours meant deviations, which are no more.
    pub fn leave_deviations(&mut self) {
        if self.color_mode == ColorMode::Deviation {
            self.color_mode = ColorMode::Component;
        }
    }

    /// Whether the page is light or dark.
    pub fn color_scheme(&self) -> ColorScheme {
        match self.theme {
            Theme::System if self.system_dark => ColorScheme::Dark,
            Theme::System | Theme::Light => ColorScheme::Light,
            Theme::Dark => ColorScheme::Dark,
        }
    }

    /// The other theme than the one on screen.
    pub fn toggled_theme(&self) -> Theme {
        match self.color_scheme() {
            ColorScheme::Dark => Theme::Light,
            ColorScheme::Light => Theme::Dark,
        }
    }

    /// Marked points that are left out: of the picture, of the figures and of exports.
    pub fn hidden_flags(&self) -> HiddenFlags {
        HiddenFlags { outliers: !self.outliers, background: !self.background }
    }
}
