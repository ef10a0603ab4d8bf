//! From the state to what a frame shall show.

use crate::display::{ClassMask, Palette};
use crate::render::{CameraFrustum, FrameContent, Turntable};
use crate::state::AppState;

/// What `state` shows in the picture, the tools' part included.
pub fn frame_content(state: &AppState) -> FrameContent {
    let mut visible_classes = ClassMask::ALL;
    for row in &state.legend.rows {
        visible_classes.set(row.class.id, row.visible);
    }
    let mut content = FrameContent {
        color_mode: state.display.color_mode,
        visible_classes,
        hidden_flags: state.display.hidden_flags(),
        palette: Palette::from_taxonomy(&state.inspection.taxonomy()),
        views_top: u16::try_from(state.views_scale()).unwrap_or(u16::MAX),
        scales: state.scales,
        color_scheme: state.display.color_scheme(),
        turntable: state.inspection.turntable.as_ref().and_then(Turntable::from_wire),
        frusta: frusta(state),
        cut: state.display.cut,
        ..FrameContent::default()
    };
    state.features.draw(&state.display, &mut content);
    content
}

/// The cameras of the accepted views, and strongly the one that is looked at.
fn frusta(state: &AppState) -> Vec<CameraFrustum> {
    let current = state.views.shown_camera().map(|view| view.index);
    let shown = state.views.iter().filter(|view| view.accepted || Some(view.index) == current);
    shown
        .filter_map(|view| {
            CameraFrustum::from_wire(view.pose.as_ref()?, view.intrinsics.as_ref()?, Some(view.index) == current)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::{ColorMode, HiddenFlags};
    use crate::link::LinkEvent;
    use crate::state::Event;
    use semascan_model::Taxonomy;
    use semascan_protocol::server_message::Body;
    use semascan_protocol::{Inspection, Intrinsics, Pose, ViewReport};

    fn view(index: u32, accepted: bool) -> Event {
        Event::from(LinkEvent::Message(Body::View(ViewReport {
            index,
            accepted,
            table_from_camera: Some(Pose { qw: 1.0, tz: 0.5, ..Pose::default() }),
            intrinsics: Some(Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 320.0, cy: 240.0 }),
            ..ViewReport::default()
        })))
    }

    #[test]
    fn hidden_components_and_marks_are_left_out_of_the_picture() {
        let mut state = AppState::default();
        let mut inspection = Inspection::default();
        inspection.set_taxonomy(&Taxonomy::from_names(&["housing", "pinion"], &[]));
        state.reduce(&Event::from(LinkEvent::Cleared(inspection)));
        state.reduce(&Event::ToggleComponent(2));
        state.reduce(&Event::ShowOutliers(true));
        let content = frame_content(&state);
        assert!(content.visible_classes.has(1) && !content.visible_classes.has(2));
        assert_eq!(content.hidden_flags, HiddenFlags { outliers: false, background: true });
        assert_eq!(content.palette.components.len(), 3);
    }

    #[test]
    fn the_looked_at_camera_stands_out_and_rejected_ones_are_not_drawn() {
        let mut state = AppState::default();
        for event in [view(0, true), view(1, false), view(2, true)] {
            state.reduce(&event);
        }
        let strong = |state: &AppState| frame_content(state).frusta.iter().map(|f| f.current).collect::<Vec<_>>();
        assert_eq!(strong(&state), [false, true]);
        state.reduce(&Event::SelectView(Some(1)));
        assert_eq!(strong(&state), [false, true, false], "a selected rejected view is drawn");
    }

    #[test]
    fn what_does_not_show_in_the_picture_does_not_change_it() {
        let mut state = AppState::default();
        let before = frame_content(&state);
        state.reduce(&Event::Help(true));
        state.reduce(&Event::from(LinkEvent::Malformed { reason: "x".into() }));
        assert_eq!(frame_content(&state), before);
        state.reduce(&Event::ColorMode(ColorMode::Views));
        assert_ne!(frame_content(&state), before);
    }
}
