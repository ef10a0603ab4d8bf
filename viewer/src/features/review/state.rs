//! The case, the chosen finding, the decision that is being made, and those that have not arrived yet.

use super::{Case, Draft, ReviewEvent, Unsent};
use crate::display::{ColorScheme, Display};
use crate::features::Feature;
use crate::render::FrameContent;
use crate::render::segment::Segment;
use glam::DVec3;
use semascan_model::finding::{Finding, FindingId};

/// Where the knowledge of the case stands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Standing {
    /// There is nothing to ask for: the inspection is under way, or not kept.
    #[default]
    Nothing,
    /// The agent is asked.
    Asked,
    /// It is as the agent said.
    Known,
    /// The agent did not say.
    Unknown(String),
}

/// The findings and what is decided about them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Review {
    /// Where the knowledge of the case stands.
    pub standing: Standing,
    /// The case; empty until it is known.
    pub case: Case,
    /// The chosen finding.
    pub selected: Option<FindingId>,
    /// The finding that a link leads to, until it is known.
    pub wanted: Option<FindingId>,
    /// The decision that is being made.
    pub draft: Option<Draft>,
    /// Who decides, where the agent does not know it.
    pub person: String,
    /// Decisions that have not arrived yet, of any inspection, the oldest first.
    pub unsent: Vec<Unsent>,
}

impl Review {
    /// The chosen finding and its place in the list.
    pub fn chosen(&self) -> Option<(usize, &Finding)> {
        self.case.finding(self.selected?)
    }

    /// Whether there is anything to decide about.
    pub fn is_open(&self) -> bool {
        self.standing == Standing::Known || !self.case.inspection.is_empty()
    }
}

impl Feature for Review {
    type Event = ReviewEvent;

    fn reduce(&mut self, event: &ReviewEvent, _: &mut Display) {
        match event {
            ReviewEvent::Asked => self.standing = Standing::Asked,
            ReviewEvent::Known(case) => {
                self.standing = Standing::Known;
                self.case = (**case).clone();
                let wanted = self.wanted.take();
                self.selected = wanted.or(self.selected).filter(|id| self.case.finding(*id).is_some());
            }
            ReviewEvent::Unknown(reason) => self.standing = Standing::Unknown(reason.clone()),
            ReviewEvent::Select(finding) => {
                self.selected = finding.filter(|id| self.case.finding(*id).is_some());
                self.draft = None;
            }
            ReviewEvent::Wanted(finding) => match self.case.finding(*finding) {
                Some(_) => self.selected = Some(*finding),
                None => self.wanted = Some(*finding),
            },
            ReviewEvent::Step(step) => {
                let count = self.case.findings().len();
                let here = self.chosen().map(|(place, _)| place);
                let Some(last) = count.checked_sub(1) else { return };
                let there = match here {
                    Some(place) => place.saturating_add_signed(*step as isize).min(last),
                    None if *step < 0 => last,
                    None => 0,
                };
                self.selected = self.case.findings().get(there).map(|finding| finding.id);
                self.draft = None;
            }
            ReviewEvent::Draft(ruling) => {
                if self.is_open() {
                    self.draft = Some(Draft::about(self.selected, *ruling));
                }
            }
            ReviewEvent::Reclassify(defect) => {
                self.draft = self.selected.map(|finding| Draft::reclassify(finding, defect.clone()));
            }
            ReviewEvent::Discard => self.draft = None,
            ReviewEvent::Person(name) => self.person.clone_from(name),
            // It may be of another tab: what is being written here stays.
            ReviewEvent::Decided(unsent) => {
                if self.unsent.iter().all(|other| other.review.id != unsent.review.id) {
                    self.unsent.push((**unsent).clone());
                }
            }
            ReviewEvent::Sent(id) | ReviewEvent::Refused { id, .. } => {
                self.unsent.retain(|unsent| unsent.review.id != *id);
            }
        }
    }

    /// What is known of the case holds while it is asked for again, and nobody loses what they write.
    fn begin(&mut self, _: &mut Display) {
        self.standing = Standing::Nothing;
    }

    /// What has not arrived yet stays, and so do who decides and what a link leads to.
    fn leave(&mut self) {
        let (person, unsent) = (std::mem::take(&mut self.person), std::mem::take(&mut self.unsent));
        *self = Self { person, unsent, wanted: self.wanted, ..Self::default() };
    }

    /// The outline of the chosen finding.
    fn draw(&self, display: &Display, content: &mut FrameContent) {
        let Some(region) = self.chosen().and_then(|(_, finding)| finding.region.as_ref()) else { return };
        let color = match display.color_scheme() {
            ColorScheme::Light => [0x14, 0x18, 0x20, 0xff],
            ColorScheme::Dark => [0xff, 0xe1, 0x4a, 0xff],
        };
        for outline in &region.outlines {
            let points = outline.iter().zip(outline.iter().cycle().skip(1));
            content.marks.extend(points.map(|(from, to)| Segment {
                from: DVec3::from(*from).as_vec3(),
                to: DVec3::from(*to).as_vec3(),
                color,
                width: 2.5,
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::review::Ruling;
    use ReviewEvent::{Asked, Decided, Discard, Known, Person, Select, Sent, Step, Unknown};
    use semascan_model::finding::{FindingKind, NamedClass};
    use semascan_model::review::{ReviewId, Subject};
    use uuid::Uuid;

    fn finding(n: u8) -> Finding {
        let class = |name: &str| NamedClass { class: 1, name: name.into() };
        Finding {
            id: FindingId::from_bytes([n; 16]),
            kind: FindingKind::Defect { defect: class("wear") },
            component: class("gear"),
            instances: Vec::new(),
            region: None,
        }
    }

    fn case(numbers: &[u8]) -> ReviewEvent {
        let findings = Some(numbers.iter().map(|n| finding(*n)).collect());
        Known(Box::new(Case { inspection: "a".into(), findings, ..Case::default() }))
    }

    fn after(events: impl IntoIterator<Item = ReviewEvent>) -> Review {
        let mut review = Review::default();
        events.into_iter().for_each(|event| review.reduce(&event, &mut Display::default()));
        review
    }

    fn place(review: &Review) -> Option<usize> {
        review.chosen().map(|(place, _)| place)
    }

    #[test]
    fn findings_are_gone_through_one_after_the_other() {
        let through =
            |steps: &[i32]| place(&after([case(&[1, 2, 3])].into_iter().chain(steps.iter().map(|s| Step(*s)))));
        assert_eq!(
            [through(&[]), through(&[1]), through(&[1, 1]), through(&[1, 1, 1, 1])],
            [None, Some(0), Some(1), Some(2)]
        );
        assert_eq!([through(&[-1]), through(&[1, 1, -1])], [Some(2), Some(0)]);
        assert_eq!(place(&after([case(&[]), Step(1)])), None);
        assert_eq!(place(&after([Step(1)])), None);
        let unknown = after([case(&[1]), Select(Some(finding(9).id))]);
        assert_eq!(unknown.selected, None);
    }

    #[test]
    fn the_chosen_finding_stays_while_it_is_there() {
        let kept = after([case(&[1, 2]), Select(Some(finding(2).id)), Asked, case(&[0, 2])]);
        assert_eq!((place(&kept), kept.standing), (Some(1), Standing::Known));
        assert_eq!(place(&after([case(&[1, 2]), Select(Some(finding(2).id)), case(&[1])])), None);
        let failed = after([case(&[1]), Asked, Unknown("no".into())]);
        assert!(failed.is_open(), "what was known is still shown");
        assert_eq!(failed.standing, Standing::Unknown("no".into()));
    }

    #[test]
    fn a_link_chooses_its_finding_once_that_is_known() {
        let followed = after([ReviewEvent::Wanted(finding(2).id), Asked, case(&[1, 2])]);
        assert_eq!((place(&followed), followed.wanted), (Some(1), None));
        assert_eq!(place(&after([ReviewEvent::Wanted(finding(9).id), case(&[1])])), None);
    }

    #[test]
    fn a_decision_is_about_what_is_chosen_and_kept_until_it_has_arrived() {
        let draft = ReviewEvent::Draft(Ruling::Reject);
        assert_eq!(after([draft.clone()]).draft, None, "nothing is known yet");
        assert_eq!(after([case(&[1]), draft.clone()]).draft.map(|d| d.subject), Some(Subject::Part));
        let mut review = after([case(&[1]), Step(1), draft.clone(), Person("A".into())]);
        assert_eq!(review.draft.as_ref().map(|d| d.subject.clone()), Some(Subject::Finding { finding: finding(1).id }));
        assert_eq!(after([case(&[1]), Step(1), draft, Discard]).draft, None);
        let id = ReviewId(Uuid::from_u128(3));
        let sent = review.draft.clone().expect("a draft").review(id, &review.case, "A", "broken");
        let unsent = Box::new(Unsent { inspection: "a".into(), review: sent });
        let mut display = Display::default();
        review.reduce(&Decided(unsent.clone()), &mut display);
        review.reduce(&Decided(unsent), &mut display);
        assert_eq!(review.unsent.len(), 1);
        assert!(review.draft.is_some(), "a decision of another tab leaves what is written here");
        review.begin(&mut display);
        assert!(review.draft.is_some() && review.is_open(), "the same inspection may come again");
        review.leave();
        assert!(review.draft.is_none() && !review.is_open());
        assert_eq!((review.unsent.len(), review.person.as_str(), review.case.inspection.as_str()), (1, "A", ""));
        review.reduce(&Sent(id), &mut display);
        assert!(review.unsent.is_empty());
    }
}
