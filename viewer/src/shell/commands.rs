//! The commands of the palette: everything that can be done now, by name, so that nobody has to know where it stands or which key
//! it has.

use super::action::Action;
use crate::camera::{CameraInput, StandardView};
use crate::display::{ColorMode, Representation};
use crate::export::{MeshFormat, PointFormat};
use crate::features::FeatureEvent;
use crate::features::correct::{CorrectEvent, Tool};
use crate::features::evidence::EvidenceEvent;
use crate::features::inspect::InspectEvent;
use crate::features::measure::{KINDS, Measure, MeasureEvent, Picking};
use crate::features::review::{ReviewEvent, Ruling};
use crate::features::section::SectionEvent;
use crate::features::timeline::TimelineEvent;
use crate::features::tour::TourEvent;
use crate::state::units;
use crate::state::{AppState, Event};
use crate::words::{self, t};

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
    let views = [
        (StandardView::Isometric, t!("command.look.isometric"), "1"),
        (StandardView::Front, t!("command.look.front"), "2"),
        (StandardView::Back, t!("command.look.back"), "3"),
        (StandardView::Left, t!("command.look.left"), "4"),
        (StandardView::Right, t!("command.look.right"), "5"),
        (StandardView::Top, t!("command.look.top"), "6"),
        (StandardView::Bottom, t!("command.look.bottom"), "7"),
    ];
    let display = &state.display;
    let mut list = vec![offer(t!("common.camera"), t!("command.fit"), "F", Action::Camera(CameraInput::Fit))];
    let views = views
        .into_iter()
        .map(|(view, label, key)| offer(t!("common.camera"), label, key, Action::Camera(CameraInput::View(view))));
    list.extend(views);
    let has_deviations = state.features.deviation.figures.is_some();
    let modes = state.color_modes().into_iter().chain(has_deviations.then_some(ColorMode::Deviation));
    list.extend(modes.map(|mode| offer(t!("command.colours"), mode.label(), "C", Event::ColorMode(mode))));
    let outliers = if display.outliers { t!("command.outliers.hide") } else { t!("command.outliers.show") };
    let background = if display.background { t!("command.background.hide") } else { t!("command.background.show") };
    list.extend([
        offer(t!("command.show"), outliers, "O", Event::ShowOutliers(!display.outliers)),
        offer(t!("command.show"), background, "B", Event::ShowBackground(!display.background)),
        offer(t!("command.show"), t!("command.all_components"), "A", Event::AllComponents),
    ]);
    let rows = state.legend.rows.iter().filter(|row| row.class.id != 0 && row.count.held > 0);
    list.extend(rows.map(|row| {
        offer(t!("command.show"), t!("command.only", name = row.class.name), "", Event::OnlyComponent(row.class.id))
    }));
    list
}

/// Tools that need a model.
fn of_the_model(state: &AppState) -> Vec<Offer> {
    let features = &state.features;
    let mut list = vec![
        offer(t!("command.show"), t!("common.points"), "", Action::Show(Representation::Points)),
        offer(t!("command.show"), t!("common.mesh"), "", Action::Show(Representation::Mesh)),
        offer(t!("command.inspect"), t!("command.pick_middle"), "Enter", Action::PickMiddle),
    ];
    if features.inspect.picked.is_some() {
        list.push(tool(t!("command.inspect"), t!("command.pin"), "L", InspectEvent::Pin));
    }
    if !features.evidence.sights.is_empty() {
        let is_open = features.evidence.is_open;
        let label = if is_open { t!("command.photographs.close") } else { t!("evidence.card") };
        list.push(tool(t!("command.inspect"), label, "E", EvidenceEvent::Open(!is_open)));
    }
    list.extend(KINDS.into_iter().map(|kind| {
        let keys = match kind.key() {
            "distance" => "M",
            "angle" => "G",
            _ => "",
        };
        tool(t!("measure.panel"), kind.name(), keys, MeasureEvent::Choose(Some(kind)))
    }));
    if features.measure.kind.is_some() {
        list.push(tool(t!("measure.panel"), t!("command.measure.end"), "Esc", MeasureEvent::Choose(None)));
    }
    let units = Measure::UNITS.into_iter().filter(|unit| *unit != features.measure.unit);
    list.extend(units.map(|unit| {
        tool(t!("measure.panel"), t!("command.lengths", unit = units::unit_name(unit)), "", MeasureEvent::Unit(unit))
    }));
    let section = &features.section;
    let plane = if section.is_on { t!("command.plane.away") } else { t!("command.plane.cut") };
    list.push(tool(t!("section.panel"), plane, "S", SectionEvent::Show(!section.is_on)));
    if section.is_on {
        list.extend([
            tool(t!("section.panel"), t!("command.face_camera"), "", SectionEvent::FaceCamera),
            tool(t!("section.panel"), t!("command.flip"), "V", SectionEvent::Flip),
        ]);
        let reads = if section.is_reading { t!("command.read.end") } else { t!("command.read") };
        list.push(tool(t!("section.panel"), reads, "W", SectionEvent::Read(!section.is_reading)));
    }
    let limits = if section.limits.is_some() { t!("command.box.away") } else { t!("command.box") };
    list.push(tool(t!("section.panel"), limits, "", SectionEvent::ShowLimits(section.limits.is_none())));
    list.extend([
        offer(t!("command.save"), t!("command.save.picture"), "Shift H", Action::SavePicture),
        offer(t!("command.save"), t!("command.save.points_ply"), "", Action::SavePoints(PointFormat::Ply)),
        offer(t!("command.save"), t!("command.save.points_glb"), "", Action::SavePoints(PointFormat::Glb)),
    ]);
    if features.mesh.triangles > 0 {
        list.extend([
            offer(t!("command.save"), t!("command.save.mesh_ply"), "", Action::SaveMesh(MeshFormat::Ply)),
            offer(t!("command.save"), t!("command.save.mesh_glb"), "", Action::SaveMesh(MeshFormat::Glb)),
            offer(t!("command.save"), t!("command.save.mesh_obj"), "", Action::SaveMesh(MeshFormat::Obj)),
            offer(t!("command.save"), t!("command.save.mesh_stl"), "", Action::SaveMesh(MeshFormat::Stl)),
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
    let plays = if timeline.is_playing { t!("timeline.pause") } else { t!("timeline.play") };
    vec![
        tool(t!("timeline.panel"), plays, "", TimelineEvent::Play(!timeline.is_playing)),
        tool(t!("timeline.panel"), t!("timeline.back.title"), "[", TimelineEvent::Step(-1)),
        tool(t!("timeline.panel"), t!("timeline.on.title"), "]", TimelineEvent::Step(1)),
        tool(t!("timeline.panel"), t!("timeline.end"), "", TimelineEvent::To(timeline.last())),
    ]
}

/// Findings, and what people say of them.
fn of_the_review(state: &AppState) -> Vec<Offer> {
    let review = &state.features.review;
    let mut list = Vec::new();
    if !review.case.findings().is_empty() {
        list.extend([
            tool(t!("review.panel"), t!("command.next_finding"), "J", ReviewEvent::Step(1)),
            tool(t!("review.panel"), t!("command.previous_finding"), "K", ReviewEvent::Step(-1)),
        ]);
    }
    if review.is_open() && state.may_review() {
        let about = if review.chosen().is_some() { t!("command.about.finding") } else { t!("command.about.part") };
        list.extend(Ruling::ALL.into_iter().map(|ruling| {
            let does = if ruling == Ruling::Comment { t!("command.remark_on") } else { ruling.label() };
            tool(t!("review.panel"), t!("command.ruling", does, about), ruling.shortcut(), ReviewEvent::Draft(ruling))
        }));
        list.extend([
            tool(t!("correct.panel"), t!("command.brush"), "Q", CorrectEvent::Choose(Some(Tool::Brush))),
            tool(t!("correct.panel"), t!("command.segment"), "", CorrectEvent::Choose(Some(Tool::Segment))),
            tool(t!("correct.panel"), t!("command.lasso"), "", CorrectEvent::Choose(Some(Tool::Lasso))),
            tool(t!("correct.panel"), t!("command.outline"), "Shift Q", CorrectEvent::Choose(Some(Tool::Outline))),
        ]);
    }
    list
}

/// Views, files, the page itself.
fn of_the_page(state: &AppState) -> Vec<Offer> {
    let mut list = Vec::new();
    if state.views.iter().len() > 0 {
        list.extend([
            offer(t!("common.views"), t!("command.next_view"), "N", Event::StepView(1)),
            offer(t!("common.views"), t!("command.previous_view"), "P", Event::StepView(-1)),
        ]);
    }
    let languages = words::languages().iter().filter(|(code, _)| *code != words::language());
    list.extend(languages.map(|(code, name)| offer(t!("language.title"), name.as_str(), "", Action::Language(code))));
    if state.has_devices {
        list.push(offer(t!("common.camera"), t!("command.space_mouse"), "", Action::SpaceMouse));
    }
    list.extend([
        offer(t!("command.page"), t!("command.link"), "H", Action::CopyLink),
        offer(t!("command.page"), t!("command.open"), "", Action::OpenFile),
        offer(t!("command.page"), t!("command.theme"), "T", Event::Theme(state.display.toggled_theme())),
        offer(t!("command.page"), t!("header.help"), "?", Event::Help(true)),
        tool(t!("command.page"), t!("command.tour"), "", TourEvent::Begin),
    ]);
    if state.account.as_ref().is_some_and(|account| account.keeps) {
        list.push(offer(t!("command.page"), t!("command.inspections"), "", Action::Page("inspections.html")));
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
