//! Any order of events leaves a state that the panels can show.

use super::connection::{Connection, GraphicsStatus};
use super::legend::ClassCount;
use super::notices::{Level, Notices, Topic};
use super::progress::Standing;
use super::timings::STAGES;
use super::views::Views;
use super::{AppState, Event};
use crate::display::{ColorMode, Display, HiddenFlags, Representation, ShareScales, Theme};
use crate::features::deviation::DeviationEvent;
use crate::features::mesh::MeshEvent;
use crate::features::review::{Case, ReviewEvent, Ruling};
use crate::link::LinkEvent;
use crate::mesh_worker::{DeviationFigures, ReferenceInfo};
use proptest::prelude::*;
use semascan_model::LengthUnit;
use semascan_model::{FeatureFigures, ModelFigures, Taxonomy};
use semascan_protocol::server_message::Body;
use semascan_protocol::{
    Domain, Inspection, Phase, Pose, Progress, ReviewChange, ReviewSubject, Stage, StageEvent, StageState, StageTiming,
    ViewPage, ViewReport, review_subject,
};

fn inspection(id: &str, epoch: u32, components: &[&str]) -> Inspection {
    let mut inspection = Inspection { id: id.into(), epoch, ..Inspection::default() };
    inspection.set_taxonomy(&Taxonomy::from_names(components, &["corrosion", "wear"]));
    inspection
}

fn connected(inspection: Inspection, resumed: bool) -> Event {
    Event::from(LinkEvent::Connected { inspection, resumed, agent: "semascan 0.1.0".into() })
}

fn cleared(inspection: Inspection) -> Event {
    Event::from(LinkEvent::Cleared(inspection))
}

fn disconnected(reason: &str, retry_ms: u32) -> Event {
    Event::from(LinkEvent::Disconnected { reason: reason.into(), retry_ms })
}

fn malformed(reason: String) -> Event {
    Event::from(LinkEvent::Malformed { reason })
}

fn progress(progress: Progress) -> Event {
    Event::from(LinkEvent::Message(Body::Progress(progress)))
}

fn stage_event(stage: StageEvent) -> Event {
    Event::from(LinkEvent::Message(Body::Stage(stage)))
}

fn view_report(report: ViewReport) -> Event {
    Event::from(LinkEvent::Message(Body::View(report)))
}

fn any_reference(name: &str) -> ReferenceInfo {
    let (unit, warnings) = (LengthUnit::Metres, Vec::new());
    ReferenceInfo { name: name.into(), triangles: 9, points: 5, unit, is_guess: true, warnings }
}

fn state_after(events: impl IntoIterator<Item = Event>) -> AppState {
    let mut state = AppState::default();
    for event in events {
        state.reduce(&event);
    }
    state
}

fn view(index: u32) -> ViewReport {
    ViewReport { index, accepted: true, table_from_camera: Some(Pose::default()), ..ViewReport::default() }
}

#[test]
fn a_review_of_the_shown_inspection_is_announced_and_a_contradiction_is_said() {
    let mut state = state_after([connected(inspection("a", 0, &["gear"]), false)]);
    let kind = Some(review_subject::Kind::Component("gear".into()));
    let change = ReviewChange {
        inspection: "a".into(),
        subject: Some(ReviewSubject { kind }),
        action: "rework".into(),
        person: "A. Reviewer".into(),
        reason: "can be ground".into(),
        ..ReviewChange::default()
    };
    let review = |change: ReviewChange| Event::from(LinkEvent::Message(Body::Review(change)));
    state.reduce(&review(ReviewChange { inspection: "b".into(), ..change.clone() }));
    assert_eq!(state.notices.iter().len(), 0, "another inspection is shown");
    state.reduce(&review(change.clone()));
    state.reduce(&review(ReviewChange { conflicts_with: vec!["r".into()], ..change }));
    let said: Vec<_> = state.notices.iter().map(|n| (n.level, n.text.clone())).collect();
    assert_eq!(said[0], (Level::Info, "A. Reviewer: rework, component gear (can be ground)".to_owned()));
    assert!(said[1].0 == Level::Warning && said[1].1.contains("contradicts"), "{said:?}");
}

#[test]
fn a_resumed_connection_keeps_the_views_and_a_new_inspection_drops_them() {
    let motor = || inspection("a", 0, &["housing", "pinion"]);
    let mut state = state_after([connected(motor(), false), view_report(view(0)), view_report(view(1))]);
    state.reduce(&disconnected("closed", 500));
    assert_eq!(state.views.iter().len(), 2, "a lost link loses nothing");
    state.reduce(&connected(motor(), true));
    assert_eq!((state.views.iter().len(), state.resumptions), (2, 1));
    state.reduce(&connected(inspection("b", 0, &["housing", "pinion"]), true));
    assert_eq!(state.views.iter().len(), 0, "another inspection cannot be a resumed one");
}

#[test]
fn visibility_outlives_an_epoch_but_not_another_taxonomy() {
    let mut state = state_after([
        connected(inspection("a", 0, &["housing", "pinion"]), false),
        Event::ToggleComponent(2),
        Event::Figures {
            classes: vec![ClassCount { points: 4, confidence: 0.9, shown: 5, held: 6, background: 1 }; 3],
            voxel: 0.001,
            scales: ShareScales::default(),
            hash: 0,
        },
    ]);
    assert_eq!(state.inspection.voxel, 0.001, "learned from the points");
    assert_eq!(state.legend.visibility(), [true, true, false]);
    assert_eq!(state.legend.visible_points(), 10);
    assert_eq!((state.legend.held_points(), state.legend.surface_points()), (18, 8));
    let hidden = state.legend.hidden_points(HiddenFlags { outliers: true, background: true });
    assert_eq!((hidden.components, hidden.stray, hidden.background), (6, 0, 2));
    let hidden = state.legend.hidden_points(HiddenFlags { outliers: true, background: false });
    assert_eq!((hidden.components, hidden.stray, hidden.background), (6, 2, 0));
    state.reduce(&cleared(inspection("a", 1, &["housing", "pinion"])));
    assert_eq!(state.legend.visibility(), [true, true, false]);
    assert_eq!(state.legend.visible_points(), 10, "the old model is seen until the new one is there");
    state.reduce(&cleared(inspection("b", 0, &["drill", "hammer"])));
    assert!(state.legend.all_visible());
}

#[test]
fn areas_are_the_agents_or_those_of_the_mesh_or_unknown() {
    let figures = |area: f64| ModelFigures {
        components: vec![FeatureFigures {
            id: 1,
            component: 1,
            points: 7,
            area: Some(area),
            confidence: 0.5,
            sigma: 0.0,
        }],
        ..ModelFigures::default()
    };
    let mut state = state_after([
        connected(inspection("a", 0, &["housing", "pinion"]), false),
        Event::Figures {
            classes: vec![ClassCount { points: 4, confidence: 0.9, shown: 5, held: 6, background: 1 }; 3],
            voxel: 0.001,
            scales: ShareScales::default(),
            hash: 0,
        },
    ]);
    let said = |state: &AppState, class| {
        let f = state.class_figures(class);
        (f.points, f.area, f.confidence)
    };
    assert_eq!(said(&state, 1), (4, None, 0.9), "no mesh, no area");
    state.reduce(&Event::Feature(MeshEvent::Measured(Box::new(figures(2.0))).into()));
    assert_eq!((said(&state, 1), said(&state, 2)), ((4, Some(2.0), 0.9), (4, Some(0.0), 0.9)));
    state.reduce(&Event::Feature(MeshEvent::Outdated.into()));
    assert_eq!(said(&state, 1), (4, None, 0.9));
    state.reduce(&progress(Progress { figures: Some((&figures(3.0)).into()), ..Progress::default() }));
    assert_eq!((said(&state, 1), said(&state, 2)), ((7, Some(3.0), 0.5), (0, Some(0.0), 0.0)));
    state.reduce(&Event::Feature(MeshEvent::Measured(Box::new(figures(2.0))).into()));
    assert_eq!(said(&state, 1).1, Some(3.0), "one number for one thing: that of the record");
    state.reduce(&cleared(inspection("b", 0, &["housing", "pinion"])));
    assert_eq!(said(&state, 1), (0, None, 0.0));
}

#[test]
fn only_this_component_and_back() {
    let mut state = state_after([connected(inspection("a", 0, &["housing", "pinion"]), false)]);
    state.reduce(&Event::OnlyComponent(1));
    assert_eq!(state.legend.visibility(), [false, true, false]);
    state.reduce(&Event::OnlyComponent(99));
    assert_eq!(state.legend.visibility(), [false, true, false], "an unknown class hides nothing");
    state.reduce(&Event::AllComponents);
    assert!(state.legend.all_visible());
}

#[test]
fn the_countdown_of_a_reconnection_ends_in_a_try() {
    let mut state = state_after([connected(inspection("a", 0, &[]), false), disconnected("closed", 2_000)]);
    assert_eq!(state.connection.label(), "Reconnecting in 2 s");
    assert!(state.wants_clock());
    state.reduce(&Event::Elapsed { ms: 1_500 });
    assert_eq!(state.connection.label(), "Reconnecting in 1 s");
    state.reduce(&Event::from(LinkEvent::Connecting { attempt: 1 }));
    assert_eq!(state.connection.key(), "reconnecting");
    assert!(!state.wants_clock());
    state.reduce(&disconnected("refused", 4_000));
    assert!(matches!(state.connection, Connection::Reconnecting { attempt: 1, retry_ms: 4_000, .. }));
}

#[test]
fn a_duration_that_arrives_twice_counts_once() {
    let ended = |view, ms: u64| {
        stage_event(StageEvent {
            view,
            stage: Stage::Fuse.into(),
            state: StageState::Finished.into(),
            duration_us: ms * 1000,
            message: String::new(),
        })
    };
    let timings = vec![StageTiming { stage: Stage::Fuse.into(), duration_us: 40_000 }];
    let state = state_after([ended(0, 40), view_report(ViewReport { timings, ..view(0) }), ended(1, 20)]);
    let fuse = state.timings.of(Stage::Fuse);
    assert_eq!((fuse.last_us, fuse.mean_us), (Some(20_000), Some(30_000)));
    assert_eq!(state.timings.scale_us(), 30_000);
    assert_eq!(state.timings.of(Stage::Acquire).mean_us, None);
}

#[test]
fn a_stage_is_active_from_its_start_to_its_end() {
    let stage = |state: StageState| {
        stage_event(StageEvent { view: 3, stage: Stage::Register.into(), state: state.into(), ..StageEvent::default() })
    };
    let mut state = state_after([stage(StageState::Started)]);
    assert_eq!(state.timings.of(Stage::Register).active, Some(3));
    state.reduce(&stage(StageState::Failed));
    assert_eq!(state.timings.of(Stage::Register).active, None);
    assert_eq!(state.timings.of(Stage::Register).failed, 1);
    state.reduce(&progress(Progress { phase: Phase::Finished.into(), ..Progress::default() }));
    state.reduce(&stage(StageState::Started));
    assert_eq!(state.timings.of(Stage::Register).active, None, "repeated of a run that is over");
}

#[test]
fn the_camera_shown_is_the_selected_one_else_the_latest() {
    let mut state = state_after([view_report(view(0)), view_report(view(4)), view_report(view(2))]);
    let order: Vec<u32> = state.views.iter().map(|v| v.index).collect();
    assert_eq!(order, [0, 2, 4]);
    assert_eq!(state.views.shown_camera().map(|v| v.index), Some(2));
    state.reduce(&Event::SelectView(Some(0)));
    state.reduce(&Event::StepView(1));
    assert_eq!(state.views.selected().map(|v| v.index), Some(2));
    state.reduce(&Event::StepView(9));
    assert_eq!(state.views.shown_camera().map(|v| v.index), Some(4));
}

#[test]
fn earlier_views_are_asked_for_until_there_are_none_or_no_room() {
    let page = |first: u32, count: u32, earlier: bool| {
        Event::from(LinkEvent::Message(Body::Page(ViewPage { first, count, earlier, kept: 5000, forgotten: 0 })))
    };
    let numbers = |state: &AppState| state.views.iter().map(|v| v.index).collect::<Vec<_>>();
    let mut state = state_after([
        connected(inspection("a", 0, &["housing"]), false),
        page(100, 2, true),
        view_report(view(100)),
        view_report(view(101)),
    ]);
    assert_eq!((state.views.earlier(), state.views.is_cut()), (Some(100), true));
    for event in [page(98, 2, true), view_report(view(98)), view_report(view(99))] {
        state.reduce(&event);
    }
    assert_eq!((numbers(&state), state.views.earlier()), ((98..102).collect(), Some(98)));
    // After a reconnection the agent sends its latest page again: what lies before it stays.
    for event in [page(101, 2, true), view_report(view(101)), view_report(view(102))] {
        state.reduce(&event);
    }
    assert_eq!((numbers(&state), state.views.earlier()), ((98..103).collect(), Some(98)));
    // Where some are missing between, it begins anew.
    for event in [page(200, 1, true), view_report(view(200))] {
        state.reduce(&event);
    }
    assert_eq!((numbers(&state), state.views.earlier()), (vec![200], Some(200)));
    state.reduce(&page(0, 0, false));
    assert_eq!((state.views.earlier(), state.views.is_cut()), (None, false));
    // Past the room that there is the oldest go, and that is said.
    (0..Views::MAX as u32 + 1).for_each(|index| state.reduce(&view_report(view(1000 + index))));
    assert_eq!((state.views.iter().len(), state.views.earlier(), state.views.is_cut()), (Views::MAX, None, true));
}

#[test]
fn a_repeated_notice_is_counted_and_a_failure_stays() {
    let mut state = AppState::default();
    for _ in 0..3 {
        state.reduce(&malformed("no body".into()));
    }
    state.reduce(&progress(Progress {
        phase: Phase::Failed.into(),
        message: "no depth".into(),
        ..Progress::default()
    }));
    let counts: Vec<u32> = state.notices.iter().map(|n| n.count).collect();
    assert_eq!(counts, [3, 1]);
    state.reduce(&Event::Elapsed { ms: 60_000 });
    let left: Vec<Level> = state.notices.iter().map(|n| n.level).collect();
    assert_eq!(left, [Level::Error]);
    assert!(!state.wants_clock());
}

#[test]
fn what_no_longer_holds_is_no_longer_said() {
    let failed = Progress { phase: Phase::Failed.into(), message: "no depth".into(), ..Progress::default() };
    let notify = |topic| Event::Notify { level: Level::Error, topic, text: format!("{topic:?}") };
    let mut state = state_after([
        connected(inspection("a", 0, &["housing"]), false),
        progress(failed),
        notify(Topic::Reference),
        notify(Topic::Export),
    ]);
    let said = |state: &AppState| state.notices.iter().map(|n| n.text.clone()).collect::<Vec<_>>();
    assert_eq!(said(&state), ["The inspection failed: no depth", "Reference", "Export"]);
    state.reduce(&Event::Retract(Topic::Reference));
    assert_eq!(said(&state), ["The inspection failed: no depth", "Export"]);
    state.reduce(&cleared(inspection("b", 0, &["housing"])));
    assert_eq!(said(&state), ["Export"], "the next inspection has not failed");
}

#[test]
fn without_a_connection_nothing_is_said_to_run() {
    let running = || progress(Progress { phase: Phase::Running.into(), views_done: 1, ..Progress::default() });
    let started =
        StageEvent { view: 1, stage: Stage::Fuse.into(), state: StageState::Started.into(), ..StageEvent::default() };
    let begun = [connected(inspection("a", 0, &[]), false), running(), stage_event(started)];
    for end in [
        disconnected("closed", 500),
        Event::from(LinkEvent::Refused { reason: "full".into() }),
        Event::from(LinkEvent::Broken { reason: "memory".into() }),
    ] {
        let mut state = state_after(begun.clone());
        assert_eq!(state.standing(), Standing::Known(Phase::Running));
        assert!(state.timings.of(Stage::Fuse).active.is_some());
        state.reduce(&end);
        assert_eq!((state.standing(), state.timings.of(Stage::Fuse).active), (Standing::Unknown, None));
        state.reduce(&connected(inspection("a", 0, &[]), true));
        assert_eq!(state.standing(), Standing::Known(Phase::Running));
        state.reduce(&progress(Progress { phase: Phase::Finished.into(), ..Progress::default() }));
        state.reduce(&disconnected("closed", 500));
        assert_eq!(state.standing(), Standing::Known(Phase::Finished), "what is over stays over");
    }
}

#[test]
fn a_model_that_is_cut_says_so_until_another_begins() {
    let left_out = || Event::from(LinkEvent::LeftOut { id: [0; 3] });
    let mut state = state_after([connected(inspection("a", 0, &[]), false), left_out()]);
    assert!(state.is_cut);
    state.reduce(&cleared(inspection("a", 1, &[])));
    assert!(!state.is_cut);
    state.reduce(&left_out());
    state.reduce(&cleared(inspection("b", 0, &[])));
    assert!(!state.is_cut);
}

#[test]
fn what_somebody_writes_stays_while_the_inspection_may_be_the_same() {
    let known = |id: &str| {
        let case = Case { inspection: id.into(), findings: Some(Vec::new()), ..Case::default() };
        Event::Feature(ReviewEvent::Known(Box::new(case)).into())
    };
    let drafted = || {
        let draft = Event::Feature(ReviewEvent::Draft(Ruling::Accept).into());
        state_after([connected(inspection("a", 0, &[]), false), known("a"), draft])
    };
    let writes = |events: Vec<Event>| {
        let mut state = drafted();
        events.iter().for_each(|event| state.reduce(event));
        state.features.review.draft.is_some()
    };
    let nothing_yet = || connected(Inspection::default(), false);
    assert!(writes(vec![disconnected("gone", 500), nothing_yet(), cleared(inspection("a", 0, &[]))]));
    let mut waiting = state_after([connected(inspection("a", 0, &["gear"]), false), known("a"), nothing_yet()]);
    assert_eq!(waiting.legend.rows.len(), 2, "marks have their classes");
    waiting.reduce(&cleared(inspection("b", 0, &[])));
    assert_eq!(waiting.legend.rows.len(), 1);
    assert!(!writes(vec![nothing_yet(), cleared(inspection("b", 0, &[]))]));
    let mut other = drafted();
    other.reduce(&cleared(inspection("b", 0, &[])));
    assert!(other.notices.iter().any(|notice| notice.text.contains("not signed")), "it is said");
    assert!(!writes(vec![Event::Opened("part.ply".into()), nothing_yet()]), "a file is no inspection of an agent");
}

#[test]
fn views_out_of_domain_are_marked_and_said_once() {
    let outside = |index| view_report(ViewReport { domain: Domain::Outside.into(), ..view(index) });
    let state =
        state_after([connected(inspection("a", 0, &["housing"]), false), view_report(view(0)), outside(1), outside(2)]);
    let marks: Vec<Domain> = state.views.iter().map(|v| v.domain).collect();
    assert_eq!(marks, [Domain::Unknown, Domain::Outside, Domain::Outside]);
    let said: Vec<_> = state.notices.iter().filter(|n| n.text.contains("labels do not count")).collect();
    assert_eq!(said.iter().map(|n| (n.level, n.count)).collect::<Vec<_>>(), [(Level::Warning, 2)]);
}

#[test]
fn a_domain_that_is_not_stated_is_not_known() {
    let number = |domain: i32| view_report(ViewReport { domain, ..view(domain as u32) });
    let reports = (0..5).map(number);
    let state = state_after([connected(inspection("a", 0, &["housing"]), false)].into_iter().chain(reports));
    let domains: Vec<Domain> = state.views.iter().map(|v| v.domain).collect();
    let (known, beyond) = ([Domain::Outside, Domain::Inside, Domain::NoNetwork], Domain::Unknown);
    assert_eq!(domains, [&[Domain::Unknown][..], &known, &[beyond]].concat());
}

#[test]
fn a_flood_of_malformed_messages_is_one_notice() {
    let mut state = AppState::default();
    for n in 0..50 {
        state.reduce(&malformed(format!("field columns: {n} voxels")));
    }
    let shown: Vec<_> = state.notices.iter().map(|n| (n.count, n.text.contains("49 voxels"))).collect();
    assert_eq!(shown, [(50, true)]);
}

#[test]
fn a_finished_model_that_is_not_the_agents_is_not_passed_off_as_its() {
    let finished = Progress { phase: Phase::Finished.into(), model_hash: 5, points: 1, ..Progress::default() };
    let counted = |hash| Event::Figures { classes: Vec::new(), voxel: 0.001, scales: ShareScales::default(), hash };
    let mut state = state_after([connected(inspection("a", 0, &[]), false), counted(4), progress(finished)]);
    assert!(state.model_differs());
    state.reduce(&counted(5));
    assert!(!state.model_differs());
}

#[test]
fn another_inspection_voids_mesh_and_deviations_and_keeps_the_reference() {
    let reference = any_reference("motor.stl");
    let mut state = state_after([
        connected(inspection("a", 0, &["housing"]), false),
        Event::Feature(MeshEvent::Made { triangles: 5 }.into()),
        Event::Feature(DeviationEvent::Reference(reference).into()),
        Event::Feature(DeviationEvent::Compared(DeviationFigures::default()).into()),
    ]);
    assert!(state.features.mesh.is_drawn(&state.display) && state.features.deviation.figures.is_some());
    state.reduce(&cleared(inspection("a", 1, &["housing"])));
    assert!(state.features.mesh.is_drawn(&state.display), "the old mesh is seen until the new model is there");
    state.reduce(&cleared(inspection("b", 0, &["housing"])));
    assert_eq!(state.features.mesh.triangles, 0);
    assert_eq!(state.display, Display { has_reference: true, ..Display::default() });
    assert!(state.features.deviation.reference.is_some() && state.features.deviation.figures.is_none());
}

#[test]
fn the_live_region_does_not_tick() {
    let mut state = state_after([disconnected("closed", 9_000)]);
    let said = state.status();
    state.reduce(&Event::Elapsed { ms: 1_000 });
    assert_eq!(state.status(), said);
}

fn any_inspection() -> impl Strategy<Value = Inspection> {
    (0..3u8, 0..3u32, prop::collection::vec("[a-c]{0,2}", 0..5), any::<u32>()).prop_map(
        |(id, epoch, names, views_expected)| {
            let mut i = Inspection { id: id.to_string(), epoch, views_expected, ..Inspection::default() };
            // Class lists come as the wire has them: maybe empty, ids maybe wrong.
            i.components =
                names.into_iter().map(|name| semascan_protocol::ClassDef { id: 7, name, color: u32::MAX }).collect();
            i
        },
    )
}

fn any_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        any::<u32>().prop_map(|attempt| Event::from(LinkEvent::Connecting { attempt })),
        (any_inspection(), any::<bool>()).prop_map(|(i, resumed)| connected(i, resumed)),
        (".{0,9}", any::<u32>()).prop_map(|(reason, retry_ms)| disconnected(&reason, retry_ms)),
        ".{0,9}".prop_map(|reason| Event::from(LinkEvent::Refused { reason })),
        any_inspection().prop_map(cleared),
        (-1..7i32, any::<[u32; 3]>(), any::<u64>()).prop_map(|(phase, [d, r, e], points)| {
            progress(Progress {
                phase,
                views_done: d,
                views_rejected: r,
                views_expected: e,
                points,
                ..Progress::default()
            })
        }),
        (0..9u32, -1..8i32, -1..6i32, any::<u64>()).prop_map(|(view, stage, state, duration_us)| {
            stage_event(StageEvent { view, stage, state, duration_us, message: String::new() })
        }),
        (any::<u32>(), any::<bool>(), -1..8i32, any::<u64>()).prop_map(|(index, accepted, stage, duration_us)| {
            let timings = vec![StageTiming { stage, duration_us }];
            view_report(ViewReport { index: index % 700, accepted, timings, ..ViewReport::default() })
        }),
        ".{0,900}".prop_map(malformed),
        prop::collection::vec((any::<u64>(), any::<u64>(), any::<f64>()), 0..7).prop_map(|list| {
            let count =
                |(points, shown, confidence)| ClassCount { points, confidence, shown, held: shown, background: 0 };
            Event::Figures {
                classes: list.into_iter().map(count).collect(),
                voxel: f64::NAN,
                scales: ShareScales::default(),
                hash: 7,
            }
        }),
        Just(Event::Graphics(GraphicsStatus::Unavailable { reason: "lost".into() })),
        prop::sample::select(ColorMode::ALL.to_vec()).prop_map(Event::ColorMode),
        prop::sample::select(Theme::ALL.to_vec()).prop_map(Event::Theme),
        prop::sample::select(vec![ColorMode::Photo, ColorMode::Deviation]).prop_map(Event::ColorMode),
        prop::sample::select(vec![Representation::Points, Representation::Mesh])
            .prop_map(|shown| Event::Feature(MeshEvent::Show(shown).into())),
        any::<u8>().prop_map(|n| Event::Feature(MeshEvent::Made { triangles: n.into() }.into())),
        Just(Event::Feature(DeviationEvent::Removed.into())),
        Just(Event::Feature(DeviationEvent::Reference(any_reference("a.ply")).into(),)),
        any::<u16>().prop_map(|c| Event::ToggleComponent(c % 8)),
        any::<u16>().prop_map(|c| Event::OnlyComponent(c % 8)),
        Just(Event::AllComponents),
        prop::option::of(0..700u32).prop_map(Event::SelectView),
        any::<i32>().prop_map(Event::StepView),
        any::<bool>().prop_map(Event::Help),
        (0..9u64).prop_map(Event::Dismiss),
        any::<u32>().prop_map(|ms| Event::Elapsed { ms }),
    ]
}

proptest! {
    #[test]
    fn any_sequence_of_events_leaves_a_state_that_can_be_shown(events in prop::collection::vec(any_event(), 0..120)) {
        let mut state = AppState::default();
        for event in events {
            state.reduce(&event);
            prop_assert!(state.notices.iter().len() <= Notices::MAX);
            prop_assert_eq!(state.legend.rows.len(), state.inspection.components.len());
            prop_assert!(state.progress.fraction().is_none_or(|f| (0.0..=1.0).contains(&f)));
            prop_assert!(state.progress.views_rejected <= state.progress.views_done);
            prop_assert!((2..=65_535).contains(&state.views_scale()));
            let order: Vec<u32> = state.views.iter().map(|v| v.index).collect();
            prop_assert!(order.is_sorted_by(|a, b| a < b) && order.len() <= Views::MAX);
            for stage in STAGES {
                let time = state.timings.of(stage);
                prop_assert!(time.mean_us.max(time.last_us).unwrap_or(0) <= state.timings.scale_us());
            }
            let (display, reference) = (&state.display, &state.features.deviation.reference);
            prop_assert_eq!(display.has_reference, reference.is_some());
            prop_assert!(display.has_reference || display.color_mode != ColorMode::Deviation);
            prop_assert!(!state.status().is_empty() && !state.connection.label().is_empty());
        }
    }
}
