//! The commands of the palette: everything that can be done now, by name, so that nobody has to know where it stands or which key
//! it has.

use super::action::Action;
use crate::camera::{CameraInput, StandardView};
use crate::display::{ColorMode, Representation};
use crate::features::FeatureEvent;
use crate::features::correct::{CorrectEvent, Tool};
use crate::features::evidence::EvidenceEvent;
use crate::features::inspect::InspectEvent;
use crate::features::measure::{KINDS, Measure, MeasureEvent};
use crate::features::review::{ReviewEvent, Ruling};
use crate::features::section::SectionEvent;
use crate::features::timeline::TimelineEvent;
use crate::scene::export::{MeshFormat, PointFormat};
use crate::state::{AppState, Event};

/// A command as the palette shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Offer {
    /// What it belongs to.
    pub group: &'static str,
    /// What it does.
    pub label: String,
    /// Its keys; empty without any.
    pub keys: &'static str,
    /// What it asks for.
    pub action: Action,
}

fn offer(group: &'static str, label: impl Into<String>, keys: &'static str, action: impl Into<Action>) -> Offer {
    Offer { group, label: label.into(), keys, action: action.into() }
}

fn tool(group: &'static str, label: impl Into<String>, keys: &'static str, event: impl Into<FeatureEvent>) -> Offer {
    offer(group, label, keys, Event::Feature(event.into()))
}

/// What can be done in this state, in the order of the page.
pub fn offers(state: &AppState) -> Vec<Offer> {
    let mut list = Vec::new();
    list.extend(of_the_view(state));
    if state.has_model() {
        list.extend(of_the_model(state));
    }
    list.extend(of_the_timeline(state));
    list.extend(of_the_review(state));
    list.extend(of_the_page(state));
    list
}

/// Camera, colours, what is shown.
fn of_the_view(state: &AppState) -> Vec<Offer> {
    const VIEWS: [(StandardView, &str, &str); 7] = [
        (StandardView::Isometric, "Look from above at an angle", "1"),
        (StandardView::Front, "Look from the front", "2"),
        (StandardView::Back, "Look from the back", "3"),
        (StandardView::Left, "Look from the left", "4"),
        (StandardView::Right, "Look from the right", "5"),
        (StandardView::Top, "Look from the top", "6"),
        (StandardView::Bottom, "Look from the bottom", "7"),
    ];
    let display = &state.display;
    let mut list = vec![offer("Camera", "Fit the model into view", "F", Action::Camera(CameraInput::Fit))];
    let views = VIEWS
        .into_iter()
        .map(|(view, label, key)| offer("Camera", label, key, Action::Camera(CameraInput::View(view))));
    list.extend(views);
    let has_deviations = state.features.deviation.figures.is_some();
    let modes = state.color_modes().into_iter().chain(has_deviations.then_some(ColorMode::Deviation));
    list.extend(modes.map(|mode| offer("Colours", mode.label(), "C", Event::ColorMode(mode))));
    let outliers = if display.outliers { "Hide outliers" } else { "Show outliers" };
    let background = if display.background { "Hide the background" } else { "Show the background" };
    list.extend([
        offer("Show", outliers, "O", Event::ShowOutliers(!display.outliers)),
        offer("Show", background, "B", Event::ShowBackground(!display.background)),
        offer("Show", "All components", "A", Event::AllComponents),
    ]);
    let rows = state.legend.rows.iter().filter(|row| row.class.id != 0 && row.count.held > 0);
    list.extend(
        rows.map(|row| offer("Show", format!("Only {}", row.class.name), "", Event::OnlyComponent(row.class.id))),
    );
    list
}

/// Tools that need a model.
fn of_the_model(state: &AppState) -> Vec<Offer> {
    let features = &state.features;
    let mut list = vec![
        offer("Show", "Points", "", Action::Show(Representation::Points)),
        offer("Show", "Mesh", "", Action::Show(Representation::Mesh)),
        offer("Inspect", "Pick in the middle of the view", "Enter", Action::PickMiddle),
    ];
    if features.inspect.picked.is_some() {
        list.push(tool("Inspect", "Pin a label at the picked point", "L", InspectEvent::Pin));
    }
    if !features.evidence.sights.is_empty() {
        let is_open = features.evidence.is_open;
        let label = if is_open { "Close the photographs" } else { "Photographs of the picked point" };
        list.push(tool("Inspect", label, "E", EvidenceEvent::Open(!is_open)));
    }
    list.extend(KINDS.into_iter().map(|kind| {
        let keys = match kind.key() {
            "distance" => "M",
            "angle" => "G",
            _ => "",
        };
        tool("Measure", kind.label(), keys, MeasureEvent::Choose(Some(kind)))
    }));
    if features.measure.kind.is_some() {
        list.push(tool("Measure", "End measuring", "Esc", MeasureEvent::Choose(None)));
    }
    let units = Measure::UNITS.into_iter().filter(|unit| *unit != features.measure.unit);
    list.extend(units.map(|unit| tool("Measure", format!("Lengths in {}", unit.name()), "", MeasureEvent::Unit(unit))));
    let section = &features.section;
    let plane = if section.is_on { "Take the plane away" } else { "Cut the model open by a plane" };
    list.push(tool("Section", plane, "S", SectionEvent::Show(!section.is_on)));
    if section.is_on {
        list.extend([
            tool("Section", "Across the camera's direction", "", SectionEvent::FaceCamera),
            tool("Section", "Cut the other side away", "V", SectionEvent::Flip),
        ]);
        let reads = if section.is_reading { "End reading thicknesses" } else { "Read thicknesses" };
        list.push(tool("Section", reads, "W", SectionEvent::Read(!section.is_reading)));
    }
    let limits = if section.limits.is_some() { "Take the box away" } else { "Hide what lies outside a box" };
    list.push(tool("Section", limits, "", SectionEvent::ShowLimits(section.limits.is_none())));
    list.extend([
        offer("Save", "The picture with what its colours mean", "Shift H", Action::SavePicture),
        offer("Save", "Points as PLY", "", Action::SavePoints(PointFormat::Ply)),
        offer("Save", "Points as GLB", "", Action::SavePoints(PointFormat::Glb)),
    ]);
    if features.mesh.triangles > 0 {
        list.extend([
            offer("Save", "Mesh as PLY", "", Action::SaveMesh(MeshFormat::Ply)),
            offer("Save", "Mesh as GLB", "", Action::SaveMesh(MeshFormat::Glb)),
            offer("Save", "Mesh as OBJ", "", Action::SaveMesh(MeshFormat::Obj)),
            offer("Save", "Mesh as STL", "", Action::SaveMesh(MeshFormat::Stl)),
        ]);
    }
    list
}

/// What is played.
fn of_the_timeline(state: &AppState) -> Vec<Offer> {
    let timeline = &state.features.timeline;
    if !timeline.is_open() {
        return Vec::new();
    }
    let plays = if timeline.is_playing { "Pause" } else { "Play" };
    vec![
        tool("Timeline", plays, "", TimelineEvent::Play(!timeline.is_playing)),
        tool("Timeline", "One view back", "[", TimelineEvent::Step(-1)),
        tool("Timeline", "One view on", "]", TimelineEvent::Step(1)),
        tool("Timeline", "The end", "", TimelineEvent::To(timeline.last())),
    ]
}

/// Findings, and what people say of them.
fn of_the_review(state: &AppState) -> Vec<Offer> {
    let review = &state.features.review;
    let mut list = Vec::new();
    if !review.case.findings().is_empty() {
        list.extend([
            tool("Findings", "Next finding", "J", ReviewEvent::Step(1)),
            tool("Findings", "Previous finding", "K", ReviewEvent::Step(-1)),
        ]);
    }
    if review.is_open() && state.may_review() {
        let about = if review.chosen().is_some() { "the chosen finding" } else { "the part" };
        list.extend(Ruling::ALL.into_iter().map(|ruling| {
            let does = if ruling == Ruling::Comment { "Remark on" } else { ruling.label() };
            tool("Findings", format!("{does} {about}"), ruling.shortcut(), ReviewEvent::Draft(ruling))
        }));
        list.extend([
            tool("Correct", "Brush: give the surface another class", "Q", CorrectEvent::Choose(Some(Tool::Brush))),
            tool("Correct", "Segment: give all of it another class", "", CorrectEvent::Choose(Some(Tool::Segment))),
            tool(
                "Correct",
                "Lasso: give what is seen in it another class",
                "",
                CorrectEvent::Choose(Some(Tool::Lasso)),
            ),
            tool("Correct", "Outline: draw a new finding", "Shift Q", CorrectEvent::Choose(Some(Tool::Outline))),
        ]);
    }
    list
}

/// Views, files, the page itself.
fn of_the_page(state: &AppState) -> Vec<Offer> {
    let mut list = Vec::new();
    if state.views.iter().len() > 0 {
        list.extend([
            offer("Views", "Next view", "N", Event::StepView(1)),
            offer("Views", "Previous view", "P", Event::StepView(-1)),
        ]);
    }
    list.extend([
        offer("Page", "Copy a link to this view", "H", Action::CopyLink),
        offer("Page", "Open an inspection or a model from a file", "", Action::OpenFile),
        offer("Page", "Light or dark theme", "T", Event::Theme(state.display.toggled_theme())),
        offer("Page", "Keyboard shortcuts", "?", Event::Help(true)),
    ]);
    if state.account.as_ref().is_some_and(|account| account.keeps) {
        list.push(offer("Page", "All inspections", "", Action::Page("inspections.html")));
    }
    list
}

/// Those that hold every word of `query`, the best first: whose words begin with those that were written.
pub fn found(offers: Vec<Offer>, query: &str) -> Vec<Offer> {
    let words: Vec<String> = query.split_whitespace().map(str::to_lowercase).collect();
    let mut ranked: Vec<(u8, Offer)> = offers
        .into_iter()
        .filter_map(|offer| {
            let text = format!("{} {}", offer.group, offer.label).to_lowercase();
            let begins = |word: &String| text.split(|c: char| !c.is_alphanumeric()).any(|own| own.starts_with(word));
            if !words.iter().all(|word| text.contains(word.as_str())) {
                return None;
            }
            let is_begun = offer.label.to_lowercase().starts_with(&words.join(" "));
            Some((if is_begun { 0 } else { 2 - u8::from(words.iter().all(begins)) }, offer))
        })
        .collect();
    // Stable: of those that are as good the order stays.
    ranked.sort_by_key(|(rank, _)| *rank);
    ranked.into_iter().map(|(_, offer)| offer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::legend::ClassCount;
    use semascan_model::Taxonomy;
    use semascan_protocol::Inspection;

    fn with_model() -> AppState {
        let mut state = AppState::default();
        let mut inspection = Inspection::default();
        inspection.set_taxonomy(&Taxonomy::from_names(&["gear"], &[]));
        state.reduce(&Event::from(crate::link::LinkEvent::Cleared(inspection)));
        let held = ClassCount { held: 5, ..ClassCount::default() };
        let (classes, scales) = (vec![held, held], crate::display::ShareScales::default());
        state.reduce(&Event::Figures { classes, voxel: 1e-3, scales, hash: 1 });
        state
    }

    fn labels(offers: &[Offer]) -> Vec<&str> {
        offers.iter().map(|offer| offer.label.as_str()).collect()
    }

    #[test]
    fn only_what_can_be_done_is_offered() {
        let empty = offers(&AppState::default());
        assert!(
            !labels(&empty).contains(&"Mesh") && labels(&empty).contains(&"Open an inspection or a model from a file")
        );
        let model = offers(&with_model());
        assert!(labels(&model).contains(&"Mesh") && labels(&model).contains(&"Only gear"));
        assert!(!labels(&model).contains(&"Mesh as PLY") && !labels(&model).contains(&"Next finding"));
        let mut seen = std::collections::BTreeSet::new();
        assert!(model.iter().all(|offer| seen.insert((offer.group, offer.label.clone()))), "each once");
    }

    #[test]
    fn the_keys_that_are_said_do_what_is_said() {
        use crate::camera::Modifiers;
        use crate::shell::shortcuts::{Focus, action};
        let state = with_model();
        for offer in offers(&state) {
            // Of the colours there is one key for all.
            if offer.keys.is_empty() || offer.group == "Colours" {
                continue;
            }
            let (shift, key) = offer.keys.strip_prefix("Shift ").map_or((false, offer.keys), |key| (true, key));
            let key = if key.len() == 1 && !shift { key.to_lowercase() } else { key.to_owned() };
            let done = action(&key, Modifiers { shift, command: false }, Focus::Model, &state);
            assert_eq!(done, Some(offer.action), "{}: {}", offer.label, offer.keys);
        }
    }

    #[test]
    fn words_find_commands_and_beginnings_come_first() {
        let all = || offers(&with_model());
        assert_eq!(labels(&found(all(), "cyl")), ["Cylinder"]);
        assert_eq!(found(all(), "measure angle").first().map(|offer| offer.label.as_str()), Some("Angle"));
        assert_eq!(found(all(), "  FIT ").first().map(|offer| offer.label.as_str()), Some("Fit the model into view"));
        assert_eq!(found(all(), "mesh").first().map(|offer| offer.label.as_str()), Some("Mesh"));
        assert_eq!(found(all(), "").len(), all().len());
        assert!(found(all(), "nothing like it").is_empty());
    }
}
