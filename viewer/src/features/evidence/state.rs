//! The photographs of the picked point, which of them is shown, and whether it lies on the mesh.

use super::{EvidenceEvent, Sight};
use crate::display::{Display, Representation};
use crate::features::Feature;
use crate::features::inspect::PickedPoint;
use crate::render::{FrameContent, ProjectedPhotograph};

/// The photographs as evidence for what the model says of a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// The point; `None` if none is picked.
    pub point: Option<PickedPoint>,
    /// The photographs that show it, the best first.
    pub sights: Vec<Sight>,
    /// Whether they are shown.
    pub is_open: bool,
    /// Place in `sights` of the one that is shown.
    pub place: usize,
    /// Whether it is shown at large around the point.
    pub is_magnified: bool,
    /// Whether it lies on the mesh.
    pub is_projected: bool,
    /// How strongly, 0..=1.
    pub strength: f32,
    /// The view whose pixels are loaded, and whether in full size.
    pub loaded: Option<(u32, bool)>,
    /// The view whose pixels cannot be had.
    pub missing: Option<u32>,
}

impl Default for Evidence {
    fn default() -> Self {
        Self {
            point: None,
            sights: Vec::new(),
            is_open: false,
            place: 0,
            is_magnified: true,
            is_projected: false,
            strength: 1.0,
            loaded: None,
            missing: None,
        }
    }
}

impl Evidence {
    /// The photograph that is shown.
    pub fn shown(&self) -> Option<&Sight> {
        self.sights.get(self.place).filter(|_| self.is_open)
    }

    /// The view whose pixels are wanted and not there yet.
    pub fn wanted(&self) -> Option<u32> {
        let view = self.shown()?.view;
        let is_known = self.loaded.is_some_and(|(loaded, _)| loaded == view) || self.missing == Some(view);
        (!is_known).then_some(view)
    }
}

impl Feature for Evidence {
    type Event = EvidenceEvent;

    fn reduce(&mut self, event: &EvidenceEvent, display: &mut Display) {
        match event {
            EvidenceEvent::Found { point, sights } => {
                self.point = Some(*point);
                self.sights.clone_from(sights);
                self.place = 0;
            }
            EvidenceEvent::Lost => {
                self.point = None;
                self.sights.clear();
                self.place = 0;
            }
            EvidenceEvent::Open(is_open) => {
                self.is_open = *is_open;
                self.is_projected &= is_open;
            }
            EvidenceEvent::Step(step) => {
                let count = self.sights.len().max(1);
                let step = step.rem_euclid(i32::try_from(count).unwrap_or(i32::MAX)) as usize;
                self.place = (self.place + step) % count;
            }
            EvidenceEvent::Show(place) => self.place = (*place).min(self.sights.len().saturating_sub(1)),
            EvidenceEvent::Magnify(is_magnified) => self.is_magnified = *is_magnified,
            EvidenceEvent::Project(is_projected) => {
                self.is_projected = *is_projected && self.is_open;
                if self.is_projected {
                    display.set_representation(Representation::Mesh);
                }
            }
            EvidenceEvent::Strength(strength) => {
                if strength.is_finite() {
                    self.strength = strength.clamp(0.0, 1.0);
                }
            }
            EvidenceEvent::Loaded { view, is_full } => {
                self.loaded = Some((*view, *is_full));
                self.missing = None;
            }
            EvidenceEvent::NotLoaded(view) => {
                self.missing = Some(*view);
                self.loaded = None;
            }
        }
    }

    fn begin(&mut self, _: &mut Display) {
        *self = Self { is_magnified: self.is_magnified, strength: self.strength, ..Self::default() };
    }

    fn draw(&self, _: &Display, content: &mut FrameContent) {
        let shown = self.shown().filter(|sight| self.loaded.is_some_and(|(view, _)| view == sight.view));
        content.photograph = shown
            .filter(|_| self.is_projected)
            .map(|sight| ProjectedPhotograph { camera: sight.camera, strength: self.strength });
    }
}

#[cfg(test)]
mod tests {
    use super::super::sight::tests::view;
    use super::super::sights;
    use super::*;
    use EvidenceEvent::{Found, Loaded, Lost, NotLoaded, Open, Project, Show, Step, Strength};
    use glam::Vec3;
    use semascan_model::SemanticPoint;

    fn found() -> EvidenceEvent {
        let views = [view(0, 0.0, 0.5), view(1, 0.0, 0.4), view(2, 0.1, 0.6)];
        let point = PickedPoint::of(&SemanticPoint::UNKNOWN, 1e-3, false);
        Found { point, sights: sights(Vec3::ZERO, Vec3::Z, views.iter(), None) }
    }

    fn after(events: impl IntoIterator<Item = EvidenceEvent>) -> (Evidence, Display) {
        let (mut evidence, mut display) = <(Evidence, Display)>::default();
        events.into_iter().for_each(|event| evidence.reduce(&event, &mut display));
        (evidence, display)
    }

    fn drawn(evidence: &Evidence) -> Option<f32> {
        let mut content = FrameContent::default();
        evidence.draw(&Display::default(), &mut content);
        content.photograph.map(|photograph| photograph.strength)
    }

    #[test]
    fn photographs_are_flipped_through_in_a_ring() {
        let shown = |events: &[i32]| {
            let steps = events.iter().map(|step| Step(*step));
            let (evidence, _) = after([found(), Open(true)].into_iter().chain(steps));
            evidence.shown().map(|sight| sight.view)
        };
        assert_eq!([shown(&[]), shown(&[1]), shown(&[1, 1]), shown(&[1, 1, 1])], [Some(1), Some(0), Some(2), Some(1)]);
        assert_eq!(shown(&[-1]), Some(2));
        let (mut evidence, mut display) = after([found(), Show(9)]);
        assert_eq!((evidence.place, evidence.shown()), (2, None), "not open");
        evidence.reduce(&Lost, &mut display);
        evidence.reduce(&Step(1), &mut display);
        assert!(evidence.sights.is_empty() && evidence.place == 0 && evidence.wanted().is_none());
    }

    #[test]
    fn a_photograph_lies_on_the_mesh_once_its_pixels_are_there() {
        let (mut evidence, mut display) = after([found(), Open(true), Project(true)]);
        assert_eq!((evidence.wanted(), drawn(&evidence)), (Some(1), None));
        assert_eq!(display.representation, Representation::Mesh, "it can lie on nothing else");
        evidence.reduce(&Loaded { view: 1, is_full: true }, &mut display);
        evidence.reduce(&Strength(0.25), &mut display);
        evidence.reduce(&Strength(f32::NAN), &mut display);
        assert_eq!((evidence.wanted(), drawn(&evidence)), (None, Some(0.25)));
        evidence.reduce(&Step(1), &mut display);
        assert_eq!((evidence.wanted(), drawn(&evidence)), (Some(0), None), "the pixels are those of another view");
        evidence.reduce(&NotLoaded(0), &mut display);
        assert_eq!((evidence.wanted(), drawn(&evidence)), (None, None), "it is asked for once");
        evidence.reduce(&Open(false), &mut display);
        assert!(!evidence.is_projected);
    }

    #[test]
    fn another_model_has_other_photographs() {
        let (mut evidence, mut display) = after([found(), Open(true), Strength(0.5)]);
        evidence.begin(&mut display);
        assert_eq!(evidence, Evidence { strength: 0.5, ..Evidence::default() });
    }
}
