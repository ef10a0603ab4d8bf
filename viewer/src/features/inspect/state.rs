//! The point of the card, what the mouse rests on, and the labels.

use super::{InspectEvent, PickedPoint};
use crate::display::Display;
use crate::features::Feature;

/// Most labels at once: more cannot be read.
const MOST_LABELS: usize = 50;

/// A label that stays at its point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PinnedLabel {
    /// Its number, for people and for [`InspectEvent::Remove`].
    pub number: u32,
    /// The point.
    pub point: PickedPoint,
    /// Whether the model has changed since.
    pub outdated: bool,
}

/// The inspected points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inspect {
    /// The point of the card; `None` without one.
    pub picked: Option<PickedPoint>,
    /// Whether the model has changed since that was picked.
    pub outdated: bool,
    /// Whether the last pick found nothing.
    pub missed: bool,
    /// What the mouse rests on.
    pub hovered: Option<PickedPoint>,
    /// The labels, the oldest first.
    pub labels: Vec<PinnedLabel>,
    /// Labels pinned so far.
    pinned: u32,
}

impl Feature for Inspect {
    type Event = InspectEvent;

    fn reduce(&mut self, event: &InspectEvent, _: &mut Display) {
        match event {
            InspectEvent::Picked(point) => {
                self.picked = *point;
                self.missed = point.is_none();
                self.outdated = false;
                self.hovered = None;
            }
            InspectEvent::Hovered(point) => self.hovered = *point,
            InspectEvent::Pin => {
                if let Some(point) = self.picked.filter(|_| self.can_pin()) {
                    self.pinned = self.pinned.saturating_add(1);
                    self.labels.push(PinnedLabel { number: self.pinned, point, outdated: self.outdated });
                }
            }
            InspectEvent::Close => {
                self.picked = None;
                self.missed = false;
            }
            InspectEvent::Remove(number) => self.labels.retain(|label| label.number != *number),
            InspectEvent::RemoveLast => drop(self.labels.pop()),
            InspectEvent::RemoveAll => self.labels.clear(),
            InspectEvent::Outdated => {
                self.outdated = self.picked.is_some();
                self.hovered = None;
                self.labels.iter_mut().for_each(|label| label.outdated = true);
            }
        }
    }

    fn begin(&mut self, _: &mut Display) {
        *self = Self::default();
    }
}

impl Inspect {
    /// Whether the point of the card can be pinned: it is there, is not pinned yet, and there is room.
    pub fn can_pin(&self) -> bool {
        self.labels.len() < MOST_LABELS
            && self.picked.is_some_and(|point| self.labels.iter().all(|label| label.point.position != point.position))
    }

    /// Whether [`InspectEvent::Outdated`] would change anything.
    pub fn is_current(&self) -> bool {
        self.hovered.is_some() || self.picked.is_some() && !self.outdated || self.labels.iter().any(|l| !l.outdated)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use InspectEvent::{Close, Hovered, Outdated, Picked, Pin, Remove, RemoveAll, RemoveLast};
    use semascan_model::SemanticPoint;

    fn point(x: f32) -> PickedPoint {
        PickedPoint::of(&SemanticPoint { position: [x, 0.0, 0.0], label: 1, ..SemanticPoint::UNKNOWN }, 1e-3, true)
    }

    fn after(events: impl IntoIterator<Item = InspectEvent>) -> Inspect {
        let mut inspect = Inspect::default();
        events.into_iter().for_each(|event| inspect.reduce(&event, &mut Display::default()));
        inspect
    }

    fn numbers(inspect: &Inspect) -> Vec<u32> {
        inspect.labels.iter().map(|label| label.number).collect()
    }

    #[test]
    fn a_point_is_shown_pinned_once_and_closed() {
        let picked = after([Picked(Some(point(0.1)))]);
        assert!(picked.picked == Some(point(0.1)) && picked.can_pin() && !picked.missed);
        let pinned = after([Picked(Some(point(0.1))), Pin, Pin]);
        assert_eq!(numbers(&pinned), [1], "one label at one point");
        let missed = after([Picked(Some(point(0.1))), Pin, Picked(None)]);
        assert!(missed.picked.is_none() && missed.missed && missed.labels.len() == 1, "labels stay");
        assert!(!after([Picked(None), Close]).missed);
        assert_eq!(numbers(&after([Pin])), [] as [u32; 0]);
    }

    #[test]
    fn labels_go_one_by_one_or_all_at_once_and_numbers_are_not_used_again() {
        let three = || (1..=3).flat_map(|i| [Picked(Some(point(i as f32))), Pin]);
        assert_eq!(numbers(&after(three().chain([Remove(2)]))), [1, 3]);
        assert_eq!(numbers(&after(three().chain([RemoveLast]))), [1, 2]);
        assert_eq!(numbers(&after(three().chain([RemoveAll, Picked(Some(point(9.0))), Pin]))), [4]);
        assert_eq!(numbers(&after(three().chain([Remove(7)]))), [1, 2, 3]);
        let many = after((0..200).flat_map(|i| [Picked(Some(point(i as f32))), Pin]));
        assert_eq!(many.labels.len(), MOST_LABELS);
        assert!(!many.can_pin());
    }

    #[test]
    fn what_was_picked_of_an_earlier_model_says_so() {
        let inspect = after([Picked(Some(point(1.0))), Pin, Hovered(Some(point(2.0))), Outdated]);
        assert!(inspect.outdated && inspect.labels[0].outdated && inspect.hovered.is_none());
        assert!(!inspect.is_current());
        let anew = after([Picked(Some(point(1.0))), Pin, Outdated, Picked(Some(point(3.0))), Pin]);
        assert_eq!(anew.labels.iter().map(|l| l.outdated).collect::<Vec<_>>(), [true, false]);
        assert!(anew.is_current() && !Inspect::default().is_current());
        let mut other = anew;
        other.begin(&mut Display::default());
        assert_eq!(other, Inspect::default());
    }
}
