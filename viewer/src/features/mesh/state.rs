//! How the meshing stands.

use super::{MeshEvent, PartCount};
use crate::display::{Display, Representation};
use crate::features::Feature;
use crate::render::FrameContent;
use semascan_model::ModelFigures;

/// Where the meshing stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Meshing {
    /// There is no mesh.
    #[default]
    None,
    /// It is being made; there may be an earlier one.
    Running {
        /// Tiles done.
        done: u32,
        /// Tiles in all.
        total: u32,
    },
    /// There is a mesh.
    Ready,
}

/// The mesh as the panels show it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Where the meshing stands.
    pub meshing: Meshing,
    /// Triangles of the mesh that is there; 0 without one.
    pub triangles: u64,
    /// How much of it belongs to each component, in the order of their classes.
    pub parts: Vec<PartCount>,
    /// Whether the model changed since the mesh was made.
    pub outdated: bool,
    /// The figures of the model, measured on the mesh; `None` without one and where it is out of date.
    pub figures: Option<ModelFigures>,
}

impl Feature for Mesh {
    type Event = MeshEvent;

    fn reduce(&mut self, event: &MeshEvent, display: &mut Display) {
        match *event {
            MeshEvent::Show(representation) => display.set_representation(representation),
            // The controller's business.
            MeshEvent::Requested | MeshEvent::CancelRequested => {}
            MeshEvent::Progress { done, total } => {
                // What changes from here on is not in this mesh.
                self.outdated &= done > 0;
                self.meshing = Meshing::Running { done: done.min(total), total };
            }
            MeshEvent::Counted(ref parts) => self.parts.clone_from(parts),
            MeshEvent::Made { triangles } => {
                self.meshing = Meshing::Ready;
                self.triangles = triangles;
            }
            MeshEvent::Measured(ref figures) => self.figures = (!self.outdated).then(|| figures.as_ref().clone()),
            MeshEvent::Cancelled => {
                let there_is_one = self.triangles > 0;
                self.meshing = if there_is_one { Meshing::Ready } else { Meshing::None };
                self.outdated = there_is_one;
                if !there_is_one {
                    display.representation = Representation::Points;
                }
            }
            MeshEvent::Outdated => {
                self.outdated = self.triangles > 0 || self.is_running();
                self.figures = None;
            }
        }
    }

    fn begin(&mut self, display: &mut Display) {
        *self = Self::default();
        display.set_representation(Representation::Points);
    }

    fn draw(&self, display: &Display, content: &mut FrameContent) {
        content.mesh = self.is_drawn(display);
    }
}

impl Mesh {
    /// Whether a mesh is being made.
    pub fn is_running(&self) -> bool {
        matches!(self.meshing, Meshing::Running { .. })
    }

    /// Whether a mesh is to be made before one can be shown as it should be.
    pub fn is_wanted(&self) -> bool {
        !self.is_running() && (self.triangles == 0 || self.outdated)
    }

    /// Whether the picture shows the mesh: points are shown until there is one.
    pub fn is_drawn(&self, display: &Display) -> bool {
        display.representation == Representation::Mesh && self.triangles > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use MeshEvent::{Cancelled, Made, Measured, Outdated, Progress, Show};

    #[derive(Default)]
    struct Viewer {
        mesh: Mesh,
        display: Display,
    }

    impl Viewer {
        fn after(events: impl IntoIterator<Item = MeshEvent>) -> Self {
            let mut viewer = Self::default();
            events.into_iter().for_each(|event| viewer.reduce(event));
            viewer
        }

        fn reduce(&mut self, event: MeshEvent) {
            self.mesh.reduce(&event, &mut self.display);
        }

        fn draws_mesh(&self) -> bool {
            self.mesh.is_drawn(&self.display)
        }
    }

    #[test]
    fn a_mesh_is_made_shown_and_goes_out_of_date() {
        let mut v = Viewer::after([Show(Representation::Mesh)]);
        assert!(v.mesh.is_wanted() && !v.draws_mesh(), "points until there is a mesh");
        v.reduce(Progress { done: 0, total: 8 });
        assert!(v.mesh.is_running() && !v.mesh.is_wanted());
        v.reduce(Made { triangles: 12 });
        assert!(v.draws_mesh() && !v.mesh.is_wanted() && !v.mesh.outdated);
        assert_eq!(v.mesh.figures, None, "not measured yet");
        v.reduce(Measured(Box::default()));
        assert!(v.mesh.figures.is_some());
        v.reduce(Outdated);
        assert_eq!(v.mesh.figures, None, "they were those of another model");
        assert!(v.draws_mesh() && v.mesh.is_wanted(), "the old mesh stays until the new one is there");
        v.reduce(Progress { done: 0, total: 4 });
        assert!(!v.mesh.outdated);
        v.reduce(Progress { done: 2, total: 4 });
        v.reduce(Outdated);
        v.reduce(Made { triangles: 13 });
        v.reduce(Measured(Box::default()));
        assert_eq!(v.mesh.figures, None, "they are not those of the model as it is");
        assert!(v.mesh.outdated && v.mesh.is_wanted(), "what came during the meshing is not in the mesh");
        v.mesh.begin(&mut v.display);
        assert_eq!((v.mesh, v.display.representation), (Mesh::default(), Representation::Points));
    }

    #[test]
    fn a_cancelled_meshing_leaves_what_was_there() {
        let v = Viewer::after([Show(Representation::Mesh), Progress { done: 3, total: 8 }, Cancelled]);
        assert_eq!((v.mesh.meshing, v.display.representation), (Meshing::None, Representation::Points));
        let v = Viewer::after([
            Show(Representation::Mesh),
            Made { triangles: 5 },
            Progress { done: 3, total: 8 },
            Cancelled,
        ]);
        assert!(v.draws_mesh() && v.mesh.outdated && v.mesh.meshing == Meshing::Ready);
    }
}
