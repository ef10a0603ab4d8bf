//! What the colours of the model mean.

/// What the colours of points and mesh mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorMode {
    /// The part as the camera saw it.
    #[default]
    Appearance,
    /// The photographs themselves, on the mesh.
    Photo,
    /// Component classes in their palette.
    Component,
    /// Share of the best component class by [`super::color_ramp`], on the scale of the data.
    Confidence,
    /// Number of views, 0..=`views_top`, by [`super::color_ramp`].
    Views,
    /// Defect classes in their palette; sound surface is grey.
    Defect,
    /// Uncertainty of the component label (sigma) by [`super::color_ramp`], on the scale of the data.
    Sigma,
    /// Signed distance of the mesh from a reference, by [`super::deviation_colors`].
    Deviation,
}

impl ColorMode {
    /// The modes that every model has, in the order of the panel. Photographs need views with pictures, deviations a reference.
    pub const ALL: [Self; 6] =
        [Self::Appearance, Self::Component, Self::Confidence, Self::Views, Self::Defect, Self::Sigma];

    /// Stable name for addresses, styles and tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::Appearance => "appearance",
            Self::Photo => "photo",
            Self::Component => "component",
            Self::Confidence => "confidence",
            Self::Views => "views",
            Self::Defect => "defect",
            Self::Sigma => "sigma",
            Self::Deviation => "deviation",
        }
    }

    /// The mode of that name.
    pub fn from_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().chain([Self::Photo, Self::Deviation]).find(|mode| mode.key() == key)
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Appearance => "Appearance",
            Self::Photo => "Photographs",
            Self::Component => "Component",
            Self::Confidence => "Confidence",
            Self::Views => "Views",
            Self::Defect => "Defect",
            Self::Sigma => "Uncertainty",
            Self::Deviation => "Deviation",
        }
    }

    /// The mode `step` places further among those on offer, round in a circle.
    pub fn stepped(self, step: i32, offered: &[Self]) -> Self {
        let count = i32::try_from(offered.len()).unwrap_or(1).max(1);
        let here = offered.iter().position(|m| *m == self).unwrap_or(0) as i32;
        offered.get((here + step % count).rem_euclid(count) as usize).copied().unwrap_or(self)
    }

    /// What the colours say, in a sentence.
    pub fn explanation(self) -> &'static str {
        match self {
            Self::Appearance => "The surface as the camera saw it.",
            Self::Photo => "The cell's own photographs on the mesh, each where it shows the surface best.",
            Self::Component => "Each point in the colour of its component.",
            Self::Confidence => "Share of the evidence that speaks for the point's component.",
            Self::Views => "Number of views that saw the point.",
            Self::Defect => "Each point in the colour of its defect.",
            Self::Sigma => "How far the networks disagree about the point's component (sigma).",
            Self::Deviation => "Distance of the mesh from the reference: positive outside, negative inside.",
        }
    }
}
