//! Which picks are asked for and in which order: one is under way at a time, and of those that wait the newest counts.
//!
//! Clicks come before strokes, these before what the mouse rests on, and that before probes, which find out whether something is
//! seen. While points are collected every click counts; else a newer one takes the place of those before. Of a stroke that is
//! drawn faster than it can be picked every other place is left out.

use glam::Vec2;
use std::collections::VecDeque;

/// Most clicks that wait.
const MOST_CLICKS: usize = 8;
/// Most places of strokes that wait.
const MOST_PLACES: usize = 48;

/// What a pick is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The person clicked, or pressed Enter at the crosshair.
    Click,
    /// The stroke of this number goes through it.
    Stroke(u32),
    /// The mouse rests there.
    Hover,
    /// Whether the anchored element of this name is seen.
    Probe(String),
}

/// A pick that is asked for, at CSS pixels from the viewport's top left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// What for.
    pub purpose: Purpose,
    /// Where.
    pub at: Vec2,
}

/// The picks that wait, and the one under way.
#[derive(Clone, Debug, Default)]
pub struct PickQueue {
    clicks: VecDeque<Vec2>,
    strokes: VecDeque<(u32, Vec2)>,
    hover: Option<Vec2>,
    probes: VecDeque<(String, Vec2)>,
    under_way: Option<Wanted>,
    /// What is under way is wanted no more.
    superseded: bool,
}

impl PickQueue {
    /// A click.
    ///
    /// * `counts_each`: whether earlier clicks that wait are still wanted.
    pub fn click(&mut self, at: Vec2, counts_each: bool) {
        let is_click = |wanted: &Wanted| wanted.purpose == Purpose::Click;
        if !counts_each {
            self.clicks.clear();
            self.superseded |= self.under_way.as_ref().is_some_and(is_click);
        }
        if self.clicks.len() < MOST_CLICKS {
            self.clicks.push_back(at);
        }
        self.leave();
    }

    /// The stroke of this number goes through `at`.
    pub fn draw(&mut self, stroke: u32, at: Vec2) {
        if self.strokes.len() >= MOST_PLACES {
            let places = std::mem::take(&mut self.strokes).into_iter();
            self.strokes = places.enumerate().filter(|(i, _)| i % 2 == 0).map(|(_, place)| place).collect();
        }
        self.strokes.push_back((stroke, at));
        self.leave();
    }

    /// The mouse rests there.
    pub fn rest(&mut self, at: Vec2) {
        self.leave();
        self.hover = Some(at);
    }

    /// The mouse rests nowhere.
    pub fn leave(&mut self) {
        self.hover = None;
        self.superseded |= self.under_way.as_ref().is_some_and(|wanted| wanted.purpose == Purpose::Hover);
    }

    /// These are to be probed, and what was to be before is not.
    pub fn probe(&mut self, probes: impl IntoIterator<Item = (String, Vec2)>) {
        self.probes = probes.into_iter().collect();
        self.superseded |= self.under_way.as_ref().is_some_and(|w| matches!(w.purpose, Purpose::Probe(_)));
    }

    /// The next one to ask for, which is under way from then on; `None` while another is, or where none waits.
    ///
    /// * `is_still`: whether the picture is at rest; before that nothing is probed.
    pub fn next(&mut self, is_still: bool) -> Option<Vec2> {
        if self.under_way.is_some() {
            return None;
        }
        let wanted = if let Some(at) = self.clicks.pop_front() {
            Wanted { purpose: Purpose::Click, at }
        } else if let Some((stroke, at)) = self.strokes.pop_front() {
            Wanted { purpose: Purpose::Stroke(stroke), at }
        } else if let Some(at) = self.hover.take() {
            Wanted { purpose: Purpose::Hover, at }
        } else if is_still && let Some((name, at)) = self.probes.pop_front() {
            Wanted { purpose: Purpose::Probe(name), at }
        } else {
            return None;
        };
        let at = wanted.at;
        self.under_way = Some(wanted);
        self.superseded = false;
        Some(at)
    }

    /// The one under way was answered; `None` if its answer is wanted no more.
    pub fn answered(&mut self) -> Option<Wanted> {
        self.under_way.take().filter(|_| !std::mem::take(&mut self.superseded))
    }

    /// It has to be asked for once more, before all others of its kind.
    pub fn again(&mut self, wanted: Wanted) {
        match wanted.purpose {
            Purpose::Click => self.clicks.push_front(wanted.at),
            Purpose::Stroke(stroke) => self.strokes.push_front((stroke, wanted.at)),
            Purpose::Hover => self.hover = self.hover.or(Some(wanted.at)),
            Purpose::Probe(name) => self.probes.push_front((name, wanted.at)),
        }
    }

    /// The device is gone, and with it what was under way.
    pub fn lost(&mut self) {
        self.under_way = None;
        self.superseded = false;
    }

    /// Whether a stroke is being picked.
    pub fn is_drawing(&self) -> bool {
        let is_under_way = self.under_way.as_ref().is_some_and(|wanted| matches!(wanted.purpose, Purpose::Stroke(_)));
        is_under_way || !self.strokes.is_empty()
    }

    /// Whether something is under way or waits.
    pub fn is_busy(&self) -> bool {
        let waits =
            !self.clicks.is_empty() || !self.strokes.is_empty() || self.hover.is_some() || !self.probes.is_empty();
        self.under_way.is_some() || waits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Vec2 = Vec2::new(1.0, 1.0);
    const B: Vec2 = Vec2::new(2.0, 2.0);

    fn purpose(queue: &mut PickQueue) -> Option<Purpose> {
        queue.next(true)?;
        queue.answered().map(|wanted| wanted.purpose)
    }

    #[test]
    fn of_clicks_the_newest_counts_unless_each_does() {
        let mut queue = PickQueue::default();
        queue.click(A, false);
        assert_eq!(queue.next(true), Some(A));
        queue.click(B, false);
        assert_eq!(queue.next(true), None, "one at a time");
        assert_eq!(queue.answered(), None, "a newer click counts");
        assert_eq!(queue.next(true), Some(B));
        queue.click(A, true);
        queue.click(A, true);
        assert_eq!(queue.answered().map(|w| w.at), Some(B));
        assert_eq!((queue.next(true), queue.answered().map(|w| w.at)), (Some(A), Some(A)));
        assert_eq!(queue.next(true), Some(A));
        queue.answered();
        assert!(!queue.is_busy());
    }

    #[test]
    fn clicks_come_before_the_mouse_and_that_before_probes() {
        let mut queue = PickQueue::default();
        queue.probe([("a".into(), A), ("b".into(), B)]);
        queue.click(A, false);
        queue.rest(B);
        assert_eq!(purpose(&mut queue), Some(Purpose::Click));
        assert_eq!(purpose(&mut queue), Some(Purpose::Hover));
        assert_eq!(queue.next(false), None, "not while the camera moves");
        assert_eq!(purpose(&mut queue), Some(Purpose::Probe("a".into())));
        queue.next(true);
        queue.probe([("c".into(), A)]);
        assert_eq!(queue.answered(), None, "of another picture");
        assert_eq!(purpose(&mut queue), Some(Purpose::Probe("c".into())));
    }

    #[test]
    fn a_mouse_that_moved_on_is_not_answered() {
        let mut queue = PickQueue::default();
        queue.rest(A);
        queue.next(true);
        queue.leave();
        assert_eq!((queue.answered(), queue.is_busy()), (None, false));
        queue.rest(A);
        queue.click(B, false);
        assert_eq!(purpose(&mut queue), Some(Purpose::Click), "and after a click it rests no more");
        assert!(!queue.is_busy());
    }

    #[test]
    fn what_has_to_be_asked_again_is_and_a_lost_device_answers_nothing() {
        let mut queue = PickQueue::default();
        queue.click(A, true);
        queue.click(B, true);
        queue.next(true);
        let wanted = queue.answered().expect("it counts");
        queue.again(wanted);
        assert_eq!(queue.next(true), Some(A));
        queue.lost();
        assert_eq!(queue.answered(), None);
        assert_eq!(queue.next(true), Some(B));
    }

    #[test]
    fn a_stroke_keeps_its_ends_and_its_order_however_fast_it_is_drawn() {
        let mut queue = PickQueue::default();
        let at = |i: usize| Vec2::new(i as f32, 0.0);
        (0..1000).for_each(|i| queue.draw(7, at(i)));
        queue.rest(A);
        let places: Vec<Vec2> = std::iter::from_fn(|| {
            let place = queue.next(true)?;
            (queue.answered()?.purpose == Purpose::Stroke(7)).then_some(place)
        })
        .collect();
        assert!((MOST_PLACES / 2..=MOST_PLACES).contains(&places.len()), "{}", places.len());
        assert_eq!((places[0], places[places.len() - 1]), (at(0), at(999)));
        assert!(places.is_sorted_by(|a, b| a.x < b.x));
    }

    #[test]
    fn clicks_without_end_are_not_kept() {
        let mut queue = PickQueue::default();
        (0..1000).for_each(|_| queue.click(A, true));
        assert_eq!(std::iter::from_fn(|| purpose(&mut queue)).count(), MOST_CLICKS);
    }
}
