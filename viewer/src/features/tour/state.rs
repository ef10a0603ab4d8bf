//! The steps of the tour, and which is shown.

use super::TourEvent;
use crate::display::Display;
use crate::features::Feature;
use crate::words::t;

/// A step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// Stable name for tests.
    pub key: &'static str,
    /// The place that is spoken of, as a CSS selector; the first that is there.
    pub place: &'static str,
}

/// The steps in their order.
pub const STEPS: [Step; 5] = [
    Step { key: "look", place: ".viewport" },
    Step { key: "colors", place: ".overlay-top" },
    Step { key: "pick", place: "[data-testid=measure], .viewport" },
    Step { key: "review", place: "[data-testid=review], [data-testid=progress]" },
    Step { key: "more", place: "[data-testid=palette-open]" },
];

impl Step {
    /// What it is about.
    pub fn title(self) -> &'static str {
        match self.key {
            "look" => t!("tour.look"),
            "colors" => t!("tour.colors"),
            "pick" => t!("tour.pick"),
            "review" => t!("tour.review"),
            _ => t!("tour.more"),
        }
    }

    /// What is done there.
    pub fn text(self) -> &'static str {
        match self.key {
            "look" => t!("tour.look.text"),
            "colors" => t!("tour.colors.text"),
            "pick" => t!("tour.pick.text"),
            "review" => t!("tour.review.text"),
            _ => t!("tour.more.text"),
        }
    }
}

/// The tour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tour {
    /// Whether it is offered.
    pub is_offered: bool,
    /// Place of the step that is shown in [`STEPS`]; `None` while none is.
    pub step: Option<usize>,
}

impl Tour {
    /// The step that is shown.
    pub fn shown(&self) -> Option<Step> {
        STEPS.get(self.step?).copied()
    }
}

impl Feature for Tour {
    type Event = TourEvent;

    fn reduce(&mut self, event: &TourEvent, _: &mut Display) {
        match event {
            TourEvent::Offered => self.is_offered = true,
            TourEvent::Begin => *self = Self { is_offered: false, step: Some(0) },
            TourEvent::Step(step) => {
                let step = isize::try_from(*step).unwrap_or_default();
                let next = self.step.map(|at| at.saturating_add_signed(step));
                self.step = next.filter(|next| *next < STEPS.len());
            }
            TourEvent::End => *self = Self::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use TourEvent::{Begin, End, Offered, Step};

    fn after(events: &[TourEvent]) -> Tour {
        let mut tour = Tour::default();
        events.iter().for_each(|event| tour.reduce(event, &mut Display::default()));
        tour
    }

    #[test]
    fn it_goes_through_its_steps_and_ends() {
        assert_eq!(after(&[Offered]), Tour { is_offered: true, step: None });
        assert_eq!(after(&[Offered, Begin]), Tour { is_offered: false, step: Some(0) });
        assert_eq!(after(&[Begin, Step(1), Step(1), Step(-1)]).shown().map(|step| step.key), Some("colors"));
        assert_eq!(after(&[Begin, Step(-1)]).step, Some(0));
        assert_eq!(after(&[Begin, Step(4)]).step, Some(4));
        assert_eq!(after(&[Begin, Step(4), Step(1)]), Tour::default(), "it is over");
        assert_eq!(after(&[Offered, End]), Tour::default());
        assert_eq!(after(&[Step(1)]), Tour::default());
    }

    #[test]
    fn every_step_says_something() {
        let mut said = std::collections::BTreeSet::new();
        assert!(STEPS.iter().all(|step| said.insert(step.title()) && said.insert(step.text())));
    }
}
