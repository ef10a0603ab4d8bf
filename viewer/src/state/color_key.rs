//! What the colours of the picture mean, as the scale over the 3D view and saved pictures say it.

use super::AppState;
use crate::display::color_ramp::UNKNOWN;
use crate::display::{ColorMode, ScalarScale, color_ramp, deviation_colors};
use crate::words::{decimal, localized, signed, t};
use semascan_model::{ClassDef, Color};

/// A colour that is on no ramp: what is not known, and why.
pub type Unknown = (&'static str, &'static str);

/// What colours mean.
#[derive(Clone, Debug, PartialEq)]
pub enum ColorKey {
    /// Themselves.
    Appearance,
    /// Photographs.
    Photographs,
    /// Classes.
    Classes {
        /// What kind of classes.
        title: &'static str,
        /// The classes.
        classes: Vec<ClassDef>,
    },
    /// A figure, by a ramp.
    Ramp {
        /// The figure, with its unit.
        title: String,
        /// Its values at the ends of the ramp and in the middle; empty where there is no round one.
        ticks: [String; 3],
        /// What has none.
        unknown: Option<Unknown>,
    },
    /// A figure that nobody knows.
    Nothing {
        /// The figure.
        title: &'static str,
        /// Why.
        unknown: Unknown,
    },
}

impl ColorKey {
    /// What the colours of `state` mean.
    pub fn of(state: &AppState) -> Self {
        match state.display.color_mode {
            ColorMode::Appearance => Self::Appearance,
            ColorMode::Photo => Self::Photographs,
            ColorMode::Component => {
                let shown = state.legend.listed().filter(|row| row.visible);
                Self::Classes { title: t!("common.component"), classes: shown.map(|row| row.class.clone()).collect() }
            }
            ColorMode::Defect => Self::Classes {
                title: t!("common.defect"),
                classes: state.legend.defects.iter().skip(1).cloned().collect(),
            },
            ColorMode::Confidence => share(
                t!("common.confidence"),
                state.scales.confidence,
                |share| format!("{:.0} %", share * 100.0),
                (t!("color_key.not_known"), t!("color_key.no_evidence")),
            ),
            ColorMode::Sigma => share(
                t!("common.sigma"),
                state.scales.sigma,
                |share| localized(format!("{share:.3}").trim_end_matches('0').trim_end_matches('.')),
                (t!("color_key.not_known"), t!("color_key.no_sigma")),
            ),
            ColorMode::Views => {
                let top = state.views_scale();
                let middle = if top.is_multiple_of(2) { (top / 2).to_string() } else { String::new() };
                let ticks = ["0".into(), middle, top.to_string()];
                Self::Ramp { title: t!("color_key.views").into(), ticks, unknown: None }
            }
            ColorMode::Deviation => {
                let tolerance = state.features.deviation.tolerance * 1e3;
                let top = f64::from(deviation_colors::TOP) * tolerance;
                let ticks = [signed(-top, 2), "0".into(), signed(top, 2)];
                let title = t!("color_key.deviation", tolerance = decimal(tolerance, 2));
                Self::Ramp { title, ticks, unknown: Some((t!("common.not_known"), t!("color_key.no_reference"))) }
            }
        }
    }

    /// Colour of the ramp at a share of its length, 0..=1.
    ///
    /// * `mode`: whose ramp.
    pub fn ramp(mode: ColorMode, share: f32) -> Color {
        match mode {
            ColorMode::Deviation => deviation_colors::color(deviation_colors::TOP * (2.0 * share - 1.0)),
            _ => color_ramp::ramp(share),
        }
    }

    /// Colours with what they mean, each a word of its own; ramps have none but that of what is not known.
    pub fn entries(&self) -> Vec<(Color, String)> {
        match self {
            Self::Appearance => Vec::new(),
            Self::Photographs => vec![(UNKNOWN, "no photograph (hatched)".to_owned())],
            Self::Classes { classes, .. } => classes.iter().map(|class| (class.color, class.name.clone())).collect(),
            Self::Ramp { unknown, .. } => {
                unknown.iter().map(|(what, why)| (UNKNOWN, format!("{what} {why}"))).collect()
            }
            Self::Nothing { unknown: (what, why), .. } => vec![(UNKNOWN, format!("{what} {why}"))],
        }
    }
}

/// On the scale of the data: what lies beyond its ends has their colours.
fn share(title: &'static str, scale: Option<ScalarScale>, tick: fn(f32) -> String, none: Unknown) -> ColorKey {
    let Some(scale) = scale else { return ColorKey::Nothing { title, unknown: none } };
    let [low, middle, high] = [scale.low, scale.middle(), scale.high].map(tick);
    // Beyond the ends there is no other colour.
    let low = if scale.reaches_below { format!("\u{2264} {low}") } else { low };
    let high = if scale.reaches_above { format!("\u{2265} {high}") } else { high };
    let unknown = Some((t!("common.not_known"), t!("color_key.none_for_component")));
    ColorKey::Ramp { title: title.into(), ticks: [low, middle, high], unknown }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::LinkEvent;
    use crate::state::Event;
    use semascan_model::Taxonomy;
    use semascan_protocol::Inspection;

    fn state(mode: ColorMode) -> AppState {
        let mut state = AppState::default();
        let mut inspection = Inspection { views_expected: 7, ..Inspection::default() };
        inspection.set_taxonomy(&Taxonomy::from_names(&["housing", "gear"], &["crack"]));
        state.reduce(&Event::from(LinkEvent::Cleared(inspection)));
        state.display.color_mode = mode;
        state
    }

    #[test]
    fn classes_are_those_that_are_shown() {
        let mut shown = state(ColorMode::Component);
        shown.reduce(&Event::ToggleComponent(2));
        let names =
            |state: &AppState| ColorKey::of(state).entries().into_iter().map(|(_, name)| name).collect::<Vec<_>>();
        assert!(names(&shown).contains(&"housing".to_owned()) && !names(&shown).contains(&"gear".to_owned()));
        assert_eq!(names(&state(ColorMode::Defect)), ["crack"]);
        assert!(names(&state(ColorMode::Appearance)).is_empty());
        assert_eq!(names(&state(ColorMode::Photo)), ["no photograph (hatched)"]);
    }

    #[test]
    fn a_scale_has_its_ends_and_says_what_is_not_known() {
        let ColorKey::Ramp { ticks, .. } = ColorKey::of(&state(ColorMode::Views)) else { panic!("a ramp") };
        assert_eq!(ticks, ["0", "", "7"]);
        assert!(matches!(ColorKey::of(&state(ColorMode::Sigma)), ColorKey::Nothing { .. }));
        let mut known = state(ColorMode::Confidence);
        known.scales.confidence = Some(ScalarScale { low: 0.5, high: 1.0, reaches_below: true, reaches_above: false });
        let ColorKey::Ramp { ticks, unknown, .. } = ColorKey::of(&known) else { panic!("a ramp") };
        assert_eq!((ticks[0].as_str(), ticks[2].as_str(), unknown.is_some()), ("\u{2264} 50 %", "100 %", true));
        let ends = [0.0, 0.5, 1.0].map(|share| ColorKey::ramp(ColorMode::Deviation, share));
        assert!(ends[0] != ends[1] && ends[1] != ends[2] && ends[1] == deviation_colors::color(0.0));
    }
}
