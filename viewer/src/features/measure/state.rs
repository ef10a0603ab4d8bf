//! What is being measured, and what was.

use super::{Kind, Line, MeasureEvent, Measurement, Picking, Taken};
use crate::display::{ColorScheme, Display};
use crate::features::Feature;
use crate::features::inspect::PickedPoint;
use crate::render::FrameContent;
use crate::render::segment::Segment;
use crate::words::t;
use glam::Vec3;
use semascan_model::LengthUnit;
use semascan_model::measurement::KeptMeasurement;
use semascan_model::review::ReviewId;

/// Most measurements at once.
const MOST: usize = 200;

/// The measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// What is being measured; `None` while picks are for looking.
    pub kind: Option<Kind>,
    /// What was picked for it so far.
    pub taken: Vec<Taken>,
    /// The measurements, the oldest first.
    pub list: Vec<Measurement>,
    /// Why the last pick gave nothing, in words; empty where it did.
    pub missed: String,
    /// A pick is being looked up on the mesh.
    pub surveying: bool,
    /// Unit of lengths: millimetres or inches.
    pub unit: LengthUnit,
    /// What people keep with the inspection, as the agent says it.
    pub kept: Vec<KeptMeasurement>,
    /// Whether that is shown.
    pub shows_kept: bool,
    /// What of it the person is about to withdraw.
    pub withdrawing: Option<ReviewId>,
    /// Measurements made so far.
    made: u32,
}

impl Default for Measure {
    fn default() -> Self {
        Self {
            kind: None,
            taken: Vec::new(),
            list: Vec::new(),
            missed: String::new(),
            surveying: false,
            unit: LengthUnit::Millimetres,
            kept: Vec::new(),
            shows_kept: true,
            withdrawing: None,
            made: 0,
        }
    }
}

impl Feature for Measure {
    type Event = MeasureEvent;

    fn reduce(&mut self, event: &MeasureEvent, _: &mut Display) {
        match event {
            MeasureEvent::Choose(kind) => {
                self.kind = *kind;
                self.drop_taken();
            }
            MeasureEvent::Picked(point) => self.pick(point.as_ref()),
            MeasureEvent::Surveyed(found) => {
                // The person may have done something else meanwhile.
                if std::mem::take(&mut self.surveying) {
                    match found {
                        Ok(taken) => self.take(taken.as_ref().clone()),
                        Err(why) => self.missed.clone_from(why),
                    }
                }
            }
            MeasureEvent::Use(number) => self.take_element(*number),
            MeasureEvent::Back => {
                self.missed.clear();
                self.surveying = false;
                if self.taken.pop().is_none() {
                    self.kind = None;
                }
            }
            MeasureEvent::Remove(number) => self.list.retain(|m| m.number != *number),
            MeasureEvent::RemoveLast => drop(self.list.pop()),
            MeasureEvent::RemoveAll => self.list.clear(),
            MeasureEvent::Unit(unit) => self.unit = *unit,
            MeasureEvent::Outdated => {
                // Points of two models make no measurement.
                self.taken.clear();
                self.surveying = false;
                self.list.iter_mut().for_each(|m| m.outdated = true);
            }
            MeasureEvent::Kept(reviews) => {
                for (number, review) in reviews {
                    self.list.iter_mut().filter(|m| m.number == *number).for_each(|m| m.kept = Some(*review));
                }
            }
            MeasureEvent::Known(kept) => {
                self.kept.clone_from(kept);
                self.withdrawing = self.withdrawing.filter(|review| kept.iter().any(|one| one.review == *review));
            }
            MeasureEvent::ShowKept(shows) => self.shows_kept = *shows,
            MeasureEvent::Withdraw(review) => self.withdrawing = *review,
        }
    }

    /// The unit and what is measured stay.
    fn begin(&mut self, _: &mut Display) {
        self.list.clear();
        self.kept.clear();
        self.withdrawing = None;
        self.drop_taken();
    }

    fn draw(&self, display: &Display, content: &mut FrameContent) {
        let (line, halo) = match display.color_scheme() {
            ColorScheme::Dark => ([0xff, 0xd2, 0x4a, 0xff], [0x10, 0x14, 0x18, 0xc0]),
            ColorScheme::Light => ([0x8a, 0x14, 0x5e, 0xff], [0xff, 0xff, 0xff, 0xd0]),
        };
        let others = self.of_others().flat_map(|kept| &kept.measurement.lines);
        let others = others.map(|line| line.map(|place| place.map(|c| c as f32)));
        let own = self.list.iter().flat_map(Measurement::lines).chain(self.open_lines());
        let lines: Vec<Line> = own.chain(others).collect();
        for (color, width) in [(halo, 5.0), (line, 2.0)] {
            for [from, to] in &lines {
                content.marks.push(Segment { from: Vec3::from(*from), to: Vec3::from(*to), color, width });
            }
        }
    }
}

impl Measure {
    /// The units that lengths are shown in.
    pub const UNITS: [LengthUnit; 2] = [LengthUnit::Millimetres, LengthUnit::Inches];

    fn drop_taken(&mut self) {
        self.taken.clear();
        self.missed.clear();
        self.surveying = false;
    }

    /// Measurements of the list that could be kept: those of the model as it is that are not.
    pub fn loose(&self) -> impl Iterator<Item = &Measurement> {
        self.list.iter().filter(|m| m.kept.is_none() && !m.outdated && m.place().is_some())
    }

    /// What is kept and shown, without what stands in the list besides.
    pub fn of_others(&self) -> impl Iterator<Item = &KeptMeasurement> {
        let is_own = |kept: &KeptMeasurement| self.list.iter().any(|m| m.kept == Some(kept.review));
        self.kept.iter().filter(move |kept| self.shows_kept && !is_own(kept))
    }

    /// Follows a click at a point, or beside the model.
    fn pick(&mut self, point: Option<&PickedPoint>) {
        self.missed.clear();
        match (self.kind, point) {
            (Some(_), None) => self.missed = t!("measure.missed").into(),
            (Some(kind), Some(_)) if kind.needs_mesh() => self.surveying = self.list.len() < MOST,
            (Some(_), Some(point)) => self.take(Taken::point(point)),
            (None, _) => {}
        }
    }

    /// Takes the element of a measurement in the list.
    fn take_element(&mut self, number: u32) {
        self.missed.clear();
        let element = self.list.iter().find(|m| m.number == number && !m.outdated && m.fit().is_some());
        let (Some(kind), Some(element)) = (self.kind, element) else { return };
        if !kind.takes_elements() {
            return;
        }
        if kind == Kind::Step && element.kind != Kind::Plane {
            self.missed = t!("measure.step_needs_planes").into();
            return;
        }
        if let [one] = element.taken.as_slice() {
            self.take(Taken { of: Some(number), ..one.clone() });
        }
    }

    /// Takes what was picked, and makes the measurement of what is there.
    fn take(&mut self, taken: Taken) {
        let Some(kind) = self.kind else { return };
        // The second click of a double click, or a key that was held: the same twice measures nothing.
        if self.taken.last().is_some_and(|last| last.place == taken.place && last.of == taken.of) {
            return;
        }
        self.taken.push(taken);
        let wanted = self.wanted(kind);
        if self.taken.len() < wanted || self.list.len() >= MOST {
            self.taken.truncate(wanted - 1);
            return;
        }
        let measurement = Measurement {
            number: self.made.saturating_add(1),
            kind,
            taken: std::mem::take(&mut self.taken),
            outdated: false,
            kept: None,
        };
        // A plane has no figure; two elements that meet have no distance.
        if measurement.fit().is_none()
            && measurement.estimate().is_none()
            && measurement.taken.iter().any(|t| !t.is_point())
        {
            self.missed = match kind {
                Kind::Angle => t!("measure.no_angle").into(),
                _ => t!("measure.no_distance").into(),
            };
            return;
        }
        self.made = measurement.number;
        self.list.push(measurement);
    }

    /// How many picks make a measurement of this kind.
    fn wanted(&self, kind: Kind) -> usize {
        match kind {
            Kind::Angle if self.taken.first().is_none_or(Taken::is_point) => 3,
            Kind::Distance | Kind::Angle | Kind::Step | Kind::Along => 2,
            Kind::Plane | Kind::Cylinder | Kind::Sphere | Kind::Circle | Kind::Area => 1,
        }
    }

    /// What shows the picks of a measurement that is not finished: points joined by lines, elements as they are.
    fn open_lines(&self) -> Vec<Line> {
        let joined =
            self.taken.windows(2).filter(|_| self.kind != Some(Kind::Along)).map(|pair| [pair[0].place, pair[1].place]);
        joined.chain(self.taken.iter().flat_map(|t| t.lines.iter().copied())).collect()
    }

    /// What to do next, for the panel and a screen reader.
    ///
    /// * `has_mesh`: whether there is a mesh of the model as it is.
    pub fn prompt(&self, has_mesh: bool) -> String {
        let full = self.list.len() >= MOST;
        let text = match (self.kind, self.taken.len()) {
            (None, _) => "",
            _ if !self.missed.is_empty() => &self.missed,
            _ if full => t!("measure.full"),
            (Some(kind), _) if kind.needs_mesh() && !has_mesh => t!("mesh.being_made"),
            _ if self.surveying => t!("measure.fitting"),
            (Some(Kind::Distance), 0) => t!("measure.prompt.distance_first"),
            (Some(Kind::Distance), _) => t!("measure.prompt.distance_second"),
            (Some(Kind::Angle), 0) => t!("measure.prompt.angle_first"),
            (Some(Kind::Angle), _) if !self.taken[0].is_point() => t!("measure.prompt.angle_element"),
            (Some(Kind::Angle), 1) => t!("measure.prompt.vertex"),
            (Some(Kind::Angle), _) => t!("measure.prompt.angle_second"),
            (Some(Kind::Step), 0) => t!("measure.prompt.step_first"),
            (Some(Kind::Step), _) => t!("measure.prompt.step_second"),
            (Some(Kind::Plane), _) => t!("measure.prompt.plane"),
            (Some(Kind::Cylinder), _) => t!("measure.prompt.cylinder"),
            (Some(Kind::Sphere), _) => t!("measure.prompt.sphere"),
            (Some(Kind::Circle), _) => t!("measure.prompt.circle"),
            (Some(Kind::Area), _) => t!("measure.prompt.area"),
            (Some(Kind::Along), 0) => t!("measure.prompt.along_first"),
            (Some(Kind::Along), _) => t!("measure.prompt.along_second"),
        };
        text.into()
    }

    /// Whether [`MeasureEvent::Outdated`] would change anything.
    pub fn is_current(&self) -> bool {
        !self.taken.is_empty() || self.list.iter().any(|m| !m.outdated)
    }
}

#[cfg(test)]
mod tests {
    use super::super::measurement::tests::cylinder;
    use super::*;
    use MeasureEvent::{Back, Choose, Outdated, Picked, Remove, RemoveAll, RemoveLast};
    use semascan_model::SemanticPoint;

    fn at(x: f32) -> MeasureEvent {
        let point = SemanticPoint { position: [x, 0.0, 0.0], ..SemanticPoint::UNKNOWN };
        Picked(Some(PickedPoint::of(&point, 1e-3, false)))
    }

    fn after(events: impl IntoIterator<Item = MeasureEvent>) -> Measure {
        let mut measure = Measure::default();
        events.into_iter().for_each(|event| measure.reduce(&event, &mut Display::default()));
        measure
    }

    #[test]
    fn two_points_make_a_distance_and_three_an_angle() {
        let distance = || [Choose(Some(Kind::Distance)), at(0.0), at(0.1)];
        let one = after(distance());
        assert_eq!((one.list.len(), one.taken.len(), one.kind), (1, 0, Some(Kind::Distance)));
        assert_eq!(one.list[0].taken.iter().map(|t| t.place).collect::<Vec<_>>(), [[0.0; 3], [0.1, 0.0, 0.0]]);
        assert_eq!(after(distance().into_iter().chain([at(0.2), at(0.3)])).list.len(), 2, "one after the other");
        let angle = after([Choose(Some(Kind::Angle)), at(0.0), at(0.1), at(0.2)]);
        assert_eq!((angle.list.len(), angle.list[0].taken.len()), (1, 3));
        assert!(after([at(0.0), at(0.1)]).taken.is_empty(), "nothing is measured");
    }

    #[test]
    fn a_miss_and_the_same_place_again_measure_nothing() {
        let measure = after([Choose(Some(Kind::Distance)), at(0.0), at(0.0), Picked(None)]);
        assert_eq!((measure.list.len(), measure.taken.len(), measure.missed.is_empty()), (0, 1, false));
        assert!(measure.prompt(true).starts_with("Nothing lies there"));
        assert_eq!(
            after([Choose(Some(Kind::Distance)), at(0.0)]).prompt(true),
            "Pick the second point, or an element of the list."
        );
        assert_eq!(Measure::default().prompt(true), "");
    }

    #[test]
    fn back_takes_points_back_and_then_ends() {
        let measure = after([Choose(Some(Kind::Angle)), at(0.0), at(0.1), Back]);
        assert_eq!((measure.taken.len(), measure.kind), (1, Some(Kind::Angle)));
        let measure = after([Choose(Some(Kind::Angle)), at(0.0), Back, Back]);
        assert_eq!((measure.taken.len(), measure.kind), (0, None));
        let other = after([Choose(Some(Kind::Angle)), at(0.0), Choose(Some(Kind::Distance))]);
        assert!(other.taken.is_empty(), "points of another measurement");
    }

    #[test]
    fn measurements_go_one_by_one_or_all_and_are_drawn_while_they_are_there() {
        let three = || [Choose(Some(Kind::Distance))].into_iter().chain((0..6).map(|i| at(i as f32)));
        let numbers = |m: &Measure| m.list.iter().map(|m| m.number).collect::<Vec<_>>();
        assert_eq!(numbers(&after(three().chain([Remove(2)]))), [1, 3]);
        assert_eq!(numbers(&after(three().chain([RemoveLast]))), [1, 2]);
        assert!(after(three().chain([RemoveAll])).list.is_empty());
        let segments = |measure: &Measure| {
            let mut content = FrameContent::default();
            measure.draw(&Display::default(), &mut content);
            content.marks.len()
        };
        assert_eq!(segments(&after(three())), 6, "a line and what sets it off, three times");
        assert_eq!(segments(&after([Choose(Some(Kind::Angle)), at(0.0), at(1.0)])), 2, "what is there so far");
    }

    #[test]
    fn the_list_has_an_end() {
        let measure = after([Choose(Some(Kind::Distance))].into_iter().chain((0..1000).map(|i| at(i as f32))));
        assert_eq!((measure.list.len(), measure.taken.len()), (MOST, 1));
        assert!(measure.prompt(true).contains("full"));
    }

    fn surveyed(taken: Taken) -> MeasureEvent {
        MeasureEvent::Surveyed(Ok(Box::new(taken)))
    }

    #[test]
    fn a_click_is_surveyed_and_becomes_an_element() {
        let measure = after([Choose(Some(Kind::Cylinder)), at(0.0)]);
        assert!(measure.surveying && measure.list.is_empty() && measure.prompt(true).starts_with("Fitting"));
        assert_eq!(after([Choose(Some(Kind::Cylinder))]).prompt(false), "The mesh is being made.");
        let two = || [Choose(Some(Kind::Cylinder)), at(0.0), surveyed(cylinder(0.0, None)), at(0.1)];
        let measure = after(two());
        assert_eq!((measure.list.len(), measure.surveying), (1, true));
        assert_eq!(
            after(two().into_iter().chain([Back, surveyed(cylinder(0.1, None))])).list.len(),
            1,
            "not wanted any more"
        );
        let refused = MeasureEvent::Surveyed(Err("No cylinder there: too flat.".into()));
        let measure = after(two().into_iter().chain([refused]));
        assert_eq!((measure.list.len(), measure.prompt(true).as_str()), (1, "No cylinder there: too flat."));
    }

    #[test]
    fn elements_of_the_list_are_used_for_distances_and_angles() {
        let elements = || {
            let mut apart = cylinder(0.05, None);
            apart.place = [0.05, 0.0, 0.0];
            [Choose(Some(Kind::Cylinder)), at(0.0), surveyed(cylinder(0.0, None)), at(0.1), surveyed(apart)]
        };
        let then = |events: Vec<MeasureEvent>| after(elements().into_iter().chain(events));
        let distance = then(vec![Choose(Some(Kind::Distance)), MeasureEvent::Use(1), MeasureEvent::Use(2)]);
        let made = &distance.list[2];
        assert_eq!(
            (made.number, made.taken.len(), made.value(LengthUnit::Millimetres).as_str()),
            (3, 2, "50.000\u{a0}mm")
        );
        let angle = then(vec![Choose(Some(Kind::Angle)), MeasureEvent::Use(2), MeasureEvent::Use(1)]);
        assert_eq!(angle.list.len(), 3);
        let mixed = then(vec![Choose(Some(Kind::Angle)), MeasureEvent::Use(2), at(0.3)]);
        assert!(
            mixed.list.len() == 2 && mixed.prompt(true).starts_with("These have no angle"),
            "{}",
            mixed.prompt(true)
        );
        let point = then(vec![Choose(Some(Kind::Distance)), at(0.02), MeasureEvent::Use(1)]);
        assert_eq!(point.list.len(), 3, "a point and an axis");
        assert!(then(vec![Choose(Some(Kind::Step)), MeasureEvent::Use(1)]).prompt(true).contains("two planes"));
        assert!(then(vec![Choose(Some(Kind::Plane)), MeasureEvent::Use(1)]).taken.is_empty());
        let outdated = then(vec![Outdated, Choose(Some(Kind::Distance)), MeasureEvent::Use(1)]);
        assert!(outdated.taken.is_empty(), "of an earlier model");
    }

    #[test]
    fn what_is_kept_is_drawn_once_and_what_changed_is_not_kept() {
        let review = |n: u128| ReviewId(uuid::Uuid::from_u128(n));
        let mut measure = after([Choose(Some(Kind::Distance)), at(0.0), at(0.1), at(0.2), at(0.3)]);
        assert_eq!(measure.loose().map(|m| m.number).collect::<Vec<_>>(), [1, 2]);
        let kept = |n: u128| KeptMeasurement {
            review: review(n),
            person: "A".into(),
            at: jiff::Timestamp::UNIX_EPOCH,
            note: String::new(),
            is_of_earlier_model: false,
            measurement: super::super::kept::record(&measure.list[0]).expect("a place"),
        };
        let known = MeasureEvent::Known(vec![kept(1), kept(2)]);
        let drawn = |measure: &Measure| {
            let mut content = FrameContent::default();
            measure.draw(&Display::default(), &mut content);
            content.marks.len() / 2
        };
        for event in [MeasureEvent::Kept(vec![(1, review(1))]), known, MeasureEvent::Withdraw(Some(review(2)))] {
            measure.reduce(&event, &mut Display::default());
        }
        assert_eq!((measure.loose().count(), measure.of_others().count(), drawn(&measure)), (1, 1, 3));
        assert_eq!(measure.withdrawing, Some(review(2)));
        measure.reduce(&MeasureEvent::ShowKept(false), &mut Display::default());
        measure.reduce(&MeasureEvent::Known(Vec::new()), &mut Display::default());
        assert_eq!((drawn(&measure), measure.withdrawing), (2, None));
        measure.reduce(&Outdated, &mut Display::default());
        assert_eq!(measure.loose().count(), 0);
    }

    #[test]
    fn points_of_two_models_make_no_measurement() {
        let measure = after([Choose(Some(Kind::Distance)), at(0.0), at(1.0), at(2.0), Outdated]);
        assert!(measure.list[0].outdated && measure.taken.is_empty() && !measure.is_current());
        let mut next = measure;
        next.begin(&mut Display::default());
        assert_eq!((next.list.len(), next.kind), (0, Some(Kind::Distance)));
    }
}
