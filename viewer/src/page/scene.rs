//! From the state to what a frame shall show.

use crate::app::AppState;
use crate::render::{CameraFrustum, ClassMask, ColorMode, DrawRequest, HiddenFlags, Palette, Theme, Turntable};
use semascan_protocol::ViewReport;

/// The part of the state that shows in the picture; when it is equal, the picture is.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    color_mode: ColorMode,
    visible: ClassMask,
    hidden: HiddenFlags,
    palette: Palette,
    views_top: u16,
    theme: Theme,
    turntable: Option<Turntable>,
    frusta: Vec<CameraFrustum>,
    mesh: bool,
    tolerance: f32,
}

impl Scene {
    /// What `state` shows.
    pub fn of(state: &AppState) -> Self {
        let mut visible = ClassMask::ALL;
        for row in &state.legend.rows {
            visible.set(row.class.id, row.visible);
        }
        Self {
            color_mode: state.display.color_mode,
            visible,
            hidden: hidden_flags(state),
            palette: Palette::from_taxonomy(&state.inspection.taxonomy()),
            views_top: u16::try_from(state.views_scale()).unwrap_or(u16::MAX),
            theme: if state.display.dark() { Theme::Dark } else { Theme::Light },
            turntable: state.inspection.turntable.as_ref().and_then(Turntable::from_wire),
            frusta: frusta(state),
            mesh: state.surface.draws_mesh(),
            tolerance: state.surface.tolerance as f32,
        }
    }

    /// Puts it into a frame's request.
    pub fn fill(&self, request: &mut DrawRequest) {
        request.color_mode = self.color_mode;
        request.visible_classes = self.visible;
        request.hidden_flags = self.hidden;
        request.palette = self.palette.clone();
        request.views_top = self.views_top;
        request.theme = self.theme;
        request.turntable = self.turntable;
        request.frusta = self.frusta.clone();
        request.mesh = self.mesh;
        request.tolerance = self.tolerance;
    }
}

/// Marked points that are left out: of the picture, of the figures and of exports.
pub fn hidden_flags(state: &AppState) -> HiddenFlags {
    HiddenFlags { outliers: !state.display.outliers, background: !state.display.background }
}

/// The cameras of the accepted views, and strongly the one that is looked at.
fn frusta(state: &AppState) -> Vec<CameraFrustum> {
    let current = state.views.shown_camera().map(|v| v.index);
    let shown = state.views.iter().filter(|v| v.accepted || Some(v.index) == current);
    let camera = |v: &crate::app::views::ViewEntry| {
        let report = ViewReport { table_from_camera: v.pose, intrinsics: v.intrinsics, ..ViewReport::default() };
        CameraFrustum::from_wire(&report, Some(v.index) == current)
    };
    shown.filter_map(camera).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::Event;
    use semascan_model::Taxonomy;
    use semascan_protocol::{Inspection, Intrinsics, Pose};

    fn view(index: u32, accepted: bool) -> Event {
        Event::View(ViewReport {
            index,
            accepted,
            table_from_camera: Some(Pose { qw: 1.0, tz: 0.5, ..Pose::default() }),
            intrinsics: Some(Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 320.0, cy: 240.0 }),
            ..ViewReport::default()
        })
    }

    #[test]
    fn hidden_components_and_marks_are_left_out_of_the_picture() {
        let mut state = AppState::default();
        let mut inspection = Inspection::default();
        inspection.set_taxonomy(&Taxonomy::from_names(&["housing", "pinion"], &[]));
        state.reduce(Event::Cleared(inspection));
        state.reduce(Event::ToggleComponent(2));
        state.reduce(Event::ShowOutliers(true));
        let scene = Scene::of(&state);
        assert!(scene.visible.has(1) && !scene.visible.has(2));
        assert_eq!(scene.hidden, HiddenFlags { outliers: false, background: true });
        assert_eq!(scene.palette.components.len(), 3);
    }

    #[test]
    fn the_looked_at_camera_stands_out_and_rejected_ones_are_not_drawn() {
        let mut state = AppState::default();
        for event in [view(0, true), view(1, false), view(2, true)] {
            state.reduce(event);
        }
        let strong = |state: &AppState| Scene::of(state).frusta.iter().map(|f| f.current).collect::<Vec<_>>();
        assert_eq!(strong(&state), [false, true]);
        state.reduce(Event::SelectView(Some(1)));
        assert_eq!(strong(&state), [false, true, false], "a selected rejected view is drawn");
    }

    #[test]
    fn what_does_not_show_in_the_picture_does_not_change_the_scene() {
        let mut state = AppState::default();
        let before = Scene::of(&state);
        state.reduce(Event::Help(true));
        state.reduce(Event::Malformed { reason: "x".into() });
        assert_eq!(Scene::of(&state), before);
        state.reduce(Event::ColorMode(ColorMode::Views));
        assert_ne!(Scene::of(&state), before);
    }
}
