//! Which photographs colour the mesh, and what keeps them from it.

use super::PhotoEvent;
use crate::display::{ColorMode, Display, Representation};
use crate::features::Feature;
use crate::render::{FrameContent, PhotoLayer};
use crate::state::AppState;

/// A photograph that colours the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownPhotograph {
    /// Number of its view.
    pub view: u32,
    /// Where its pixels lie, and its camera.
    pub layer: PhotoLayer,
}

/// The photographs that colour the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Photo {
    /// The photographs, those that matter most first.
    pub photographs: Vec<ShownPhotograph>,
    /// How many are still on their way; `None` before they were chosen.
    pub missing: Option<usize>,
    /// Whether the mesh is to be shown as soon as there are photographs: another model began while colours meant them.
    pub is_pending: bool,
}

/// How far photographs are from being the colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// No view has a picture and a known pose.
    NoPhotographs,
    /// Points are shown.
    Points,
    /// There is no mesh yet.
    NoMesh,
    /// So many are there, and some still on their way.
    Loading(usize),
    /// So many are there.
    Ready(usize),
}

impl Standing {
    /// What is so in `state`.
    pub fn of(state: &AppState) -> Self {
        let photo = &state.features.photo;
        match state.display.representation {
            _ if !state.has_photographs() => Self::NoPhotographs,
            Representation::Points => Self::Points,
            Representation::Mesh if state.features.mesh.triangles == 0 => Self::NoMesh,
            Representation::Mesh if photo.missing == Some(0) => Self::Ready(photo.photographs.len()),
            Representation::Mesh => Self::Loading(photo.photographs.len()),
        }
    }

    /// Stable name for tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::NoPhotographs => "no-photographs",
            Self::Points => "points",
            Self::NoMesh => "no-mesh",
            Self::Loading(_) => "loading",
            Self::Ready(_) => "ready",
        }
    }
}

impl Feature for Photo {
    type Event = PhotoEvent;

    fn reduce(&mut self, event: &PhotoEvent, display: &mut Display) {
        match event {
            PhotoEvent::Resumed => {
                self.is_pending = false;
                if display.color_mode == ColorMode::Photo {
                    display.set_representation(Representation::Mesh);
                }
            }
            PhotoEvent::Shown { photographs, missing } => {
                self.photographs.clone_from(photographs);
                self.missing = Some(*missing);
            }
        }
    }

    fn begin(&mut self, display: &mut Display) {
        *self = Self { is_pending: display.color_mode == ColorMode::Photo, ..Self::default() };
    }

    fn draw(&self, display: &Display, content: &mut FrameContent) {
        if display.color_mode == ColorMode::Photo {
            content.layers = self.photographs.iter().map(|photograph| photograph.layer).collect();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::LinkEvent;
    use crate::render::photograph_camera::PhotographCamera;
    use crate::state::Event;
    use semascan_protocol::server_message::Body;
    use semascan_protocol::{Intrinsics, Pose, ViewReport};

    fn report() -> ViewReport {
        ViewReport {
            accepted: true,
            table_from_camera: Some(Pose { qw: 1.0, ..Pose::default() }),
            intrinsics: Some(Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 320.0, cy: 240.0 }),
            thumbnail_jpeg: vec![1, 2, 3],
            ..ViewReport::default()
        }
    }

    fn shown(missing: usize) -> Event {
        let report = report();
        let camera = report.table_from_camera.as_ref().zip(report.intrinsics.as_ref());
        let camera = camera.and_then(|(pose, camera)| PhotographCamera::from_wire(pose, camera)).expect("a camera");
        let layer = PhotoLayer { slot: 2, camera, quality: 1.0 };
        let photographs = vec![ShownPhotograph { view: 0, layer }];
        Event::Feature(PhotoEvent::Shown { photographs, missing }.into())
    }

    #[test]
    fn it_is_said_what_keeps_photographs_from_the_surface() {
        use crate::features::mesh::MeshEvent;
        let mut state = AppState::default();
        let mut after = |event: Event| {
            state.reduce(&event);
            Standing::of(&state)
        };
        assert_eq!(after(Event::ColorMode(ColorMode::Photo)), Standing::NoPhotographs);
        let view = Event::from(LinkEvent::Message(Body::View(report())));
        assert_eq!(after(view), Standing::NoMesh);
        assert_eq!(after(Event::Feature(MeshEvent::Made { triangles: 9 }.into())), Standing::Loading(0));
        assert_eq!([after(shown(1)), after(shown(0))], [Standing::Loading(1), Standing::Ready(1)]);
        assert_eq!(after(Event::Feature(MeshEvent::Show(Representation::Points).into())), Standing::Points);
        assert_eq!(after(Event::ColorMode(ColorMode::Photo)), Standing::Ready(1), "it shows the mesh");
    }

    #[test]
    fn only_in_its_mode_the_frame_has_them() {
        let mut state = AppState::default();
        state.reduce(&shown(0));
        let layers = |state: &AppState| crate::scene::frame_content::frame_content(state).layers.len();
        assert_eq!(layers(&state), 0);
        state.reduce(&Event::ColorMode(ColorMode::Photo));
        assert_eq!(layers(&state), 1);
    }

    #[test]
    fn the_mode_outlives_the_model() {
        let (mut photo, mut display) = <(Photo, Display)>::default();
        display.set_color_mode(ColorMode::Photo);
        display.set_representation(Representation::Points);
        photo.begin(&mut display);
        assert!(photo.is_pending && display.color_mode == ColorMode::Photo);
        photo.reduce(&PhotoEvent::Resumed, &mut display);
        assert!(!photo.is_pending && display.representation == Representation::Mesh);
    }
}
