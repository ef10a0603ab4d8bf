//! What the colours of the model mean.

use crate::words::t;

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
            Self::Appearance => t!("color_mode.appearance"),
            Self::Photo => t!("color_mode.photo"),
            Self::Component => t!("common.component"),
            Self::Confidence => t!("common.confidence"),
            Self::Views => t!("common.views"),
            Self::Defect => t!("common.defect"),
            Self::Sigma => t!("color_mode.sigma"),
            Self::Deviation => t!("common.deviation"),
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
            Self::Appearance => t!("color_mode.appearance.what"),
            Self::Photo => t!("color_mode.photo.what"),
            Self::Component => t!("color_mode.component.what"),
            Self::Confidence => t!("color_mode.confidence.what"),
            Self::Views => t!("color_mode.views.what"),
            Self::Defect => t!("color_mode.defect.what"),
            Self::Sigma => t!("color_mode.sigma.what"),
            Self::Deviation => t!("color_mode.deviation.what"),
        }
    }
}
