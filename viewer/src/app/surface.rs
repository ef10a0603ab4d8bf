//! The surface: whether the model is shown as points or as a mesh, how far the meshing is, what it is compared with.

use crate::surface::Deviation;

/// Tolerance until the person sets another, metres.
const TOLERANCE: f64 = 0.5e-3;
/// Tolerances that make sense, metres.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-6..=0.1;

/// How the meshing stands.
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

/// A reference that the surface is compared with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reference {
    /// Name of its file.
    pub name: String,
    /// Triangles; 0 for a cloud.
    pub triangles: u32,
    /// Vertices or points.
    pub points: u32,
    /// Whether its numbers were taken for millimetres.
    pub millimetres: bool,
}

/// What happens to the surface.
#[derive(Clone, Debug, PartialEq)]
pub enum SurfaceEvent {
    /// Show the model as a mesh, or as points.
    Show(bool),
    /// So much of the mesh is made.
    Progress {
        /// Tiles done.
        done: u32,
        /// Tiles in all.
        total: u32,
    },
    /// A mesh of so many triangles is there.
    Made {
        /// Their number.
        triangles: u64,
    },
    /// The meshing was ended before it was done.
    Cancelled,
    /// The model changed: a mesh that is there is out of date.
    Outdated,
    /// A reference is being read.
    Reading(String),
    /// A reference is there.
    Reference(Reference),
    /// The file that was read is no reference; one that was there before stays.
    NoReference,
    /// The reference is taken away.
    Forgotten,
    /// The mesh was compared with the reference.
    Compared(Deviation),
    /// Deviations up to so many metres are within tolerance.
    Tolerance(f64),
}

/// The surface as the panels show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Whether the model is shown as a mesh.
    pub shown: bool,
    /// How the meshing stands.
    pub meshing: Meshing,
    /// Triangles of the mesh that is there; 0 without one.
    pub triangles: u64,
    /// Whether the model changed since the mesh was made.
    pub outdated: bool,
    /// Name of a reference that is being read.
    pub reading: Option<String>,
    /// The reference.
    pub reference: Option<Reference>,
    /// How far the mesh deviates from it.
    pub deviation: Option<Deviation>,
    /// Largest deviation within tolerance, metres.
    pub tolerance: f64,
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            shown: false,
            meshing: Meshing::None,
            triangles: 0,
            outdated: false,
            reading: None,
            reference: None,
            deviation: None,
            tolerance: TOLERANCE,
        }
    }
}

impl Surface {
    /// Follows an event.
    pub(super) fn reduce(&mut self, event: SurfaceEvent) {
        match event {
            SurfaceEvent::Show(mesh) => self.shown = mesh,
            SurfaceEvent::Progress { done, total } => {
                // What changes from here on is not in this mesh.
                self.outdated &= done > 0;
                self.meshing = Meshing::Running { done: done.min(total), total };
            }
            SurfaceEvent::Made { triangles } => {
                self.meshing = Meshing::Ready;
                self.triangles = triangles;
                self.deviation = None;
            }
            SurfaceEvent::Cancelled => {
                self.meshing = if self.triangles > 0 { Meshing::Ready } else { Meshing::None };
                self.outdated = self.triangles > 0;
                self.shown &= self.triangles > 0;
            }
            SurfaceEvent::Outdated => self.outdated = self.triangles > 0 || self.is_running(),
            SurfaceEvent::Reading(name) => self.reading = Some(name),
            SurfaceEvent::Reference(reference) => {
                self.reading = None;
                self.reference = Some(reference);
                self.deviation = None;
            }
            SurfaceEvent::NoReference => self.reading = None,
            SurfaceEvent::Forgotten => {
                self.reference = None;
                self.deviation = None;
            }
            SurfaceEvent::Compared(deviation) => {
                if self.reference.is_some() {
                    self.deviation = Some(deviation);
                }
            }
            SurfaceEvent::Tolerance(metres) => {
                if TOLERANCES.contains(&metres) {
                    self.tolerance = metres;
                }
            }
        }
    }

    /// Another model: its mesh is gone, the reference and how things are shown stay.
    pub(super) fn clear(&mut self) {
        self.meshing = Meshing::None;
        self.triangles = 0;
        self.outdated = false;
        self.deviation = None;
        self.shown = false;
    }

    /// Whether a mesh is being made.
    pub fn is_running(&self) -> bool {
        matches!(self.meshing, Meshing::Running { .. })
    }

    /// Whether a mesh is to be made before one can be shown as it should be.
    pub fn wants_mesh(&self) -> bool {
        !self.is_running() && (self.triangles == 0 || self.outdated)
    }

    /// Whether the picture shows the mesh.
    pub fn draws_mesh(&self) -> bool {
        self.shown && self.triangles > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(events: impl IntoIterator<Item = SurfaceEvent>) -> Surface {
        let mut surface = Surface::default();
        events.into_iter().for_each(|e| surface.reduce(e));
        surface
    }

    fn reference() -> SurfaceEvent {
        let name = "motor.stl".into();
        SurfaceEvent::Reference(Reference { name, triangles: 9, points: 5, millimetres: true })
    }

    #[test]
    fn a_mesh_is_made_shown_and_goes_out_of_date() {
        use SurfaceEvent::{Made, Outdated, Progress, Show};
        let mut s = after([Show(true)]);
        assert!(s.wants_mesh() && !s.draws_mesh(), "points until there is a mesh");
        s.reduce(Progress { done: 0, total: 8 });
        assert!(s.is_running() && !s.wants_mesh());
        s.reduce(Made { triangles: 12 });
        assert!(s.draws_mesh() && !s.wants_mesh() && !s.outdated);
        s.reduce(Outdated);
        assert!(s.draws_mesh() && s.wants_mesh(), "the old mesh stays until the new one is there");
        s.reduce(Progress { done: 0, total: 4 });
        assert!(!s.outdated);
        s.reduce(Progress { done: 2, total: 4 });
        s.reduce(Outdated);
        s.reduce(Made { triangles: 13 });
        assert!(s.outdated && s.wants_mesh(), "what came during the meshing is not in the mesh");
    }

    #[test]
    fn a_cancelled_meshing_leaves_what_was_there() {
        use SurfaceEvent::{Cancelled, Made, Progress, Show};
        let s = after([Show(true), Progress { done: 3, total: 8 }, Cancelled]);
        assert_eq!((s.meshing, s.shown), (Meshing::None, false));
        let s = after([Show(true), Made { triangles: 5 }, Progress { done: 3, total: 8 }, Cancelled]);
        assert_eq!((s.meshing, s.shown, s.outdated), (Meshing::Ready, true, true));
    }

    #[test]
    fn deviations_belong_to_a_reference_and_a_mesh() {
        use SurfaceEvent::{Compared, Forgotten, Made, NoReference, Reading, Tolerance};
        let d = Deviation { mean: 1e-4, ..Deviation::default() };
        assert_eq!(after([Compared(d)]).deviation, None);
        let mut s = after([Made { triangles: 5 }, Reading("motor.stl".into()), reference(), Compared(d)]);
        assert_eq!((s.reading.clone(), s.deviation), (None, Some(d)));
        s.reduce(Made { triangles: 6 });
        assert_eq!(s.deviation, None, "of the mesh before");
        s.reduce(Reading("letter.stl".into()));
        s.reduce(NoReference);
        assert!(s.reading.is_none() && s.reference.is_some());
        for (metres, kept) in [(1e-3, 1e-3), (0.0, 1e-3), (f64::NAN, 1e-3), (-1.0, 1e-3), (9.0, 1e-3)] {
            s.reduce(Tolerance(metres));
            assert_eq!(s.tolerance, kept);
        }
        s.clear();
        assert!(s.reference.is_some() && s.triangles == 0);
        s.reduce(Forgotten);
        assert_eq!(s.reference, None);
    }
}
