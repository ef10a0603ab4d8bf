//! What is being measured, and what was.

use super::{Kind, MeasureEvent, Measurement};
use crate::display::{ColorScheme, Display};
use crate::features::Feature;
use crate::features::inspect::PickedPoint;
use crate::render::FrameContent;
use crate::render::segment::Segment;
use glam::Vec3;
use semascan_model::LengthUnit;

/// Most measurements at once.
const MOST: usize = 200;

/// The measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// What is being measured; `None` while picks are for looking.
    pub kind: Option<Kind>,
    /// The points picked for it so far.
    pub points: Vec<PickedPoint>,
    /// The measurements, the oldest first.
    pub list: Vec<Measurement>,
    /// Whether the last pick found nothing.
    pub missed: bool,
    /// Unit of lengths: millimetres or inches.
    pub unit: LengthUnit,
    /// Measurements made so far.
    made: u32,
}

impl Default for Measure {
    fn default() -> Self {
        Self { kind: None, points: Vec::new(), list: Vec::new(), missed: false, unit: LengthUnit::Millimetres, made: 0 }
    }
}

impl Feature for Measure {
    type Event = MeasureEvent;

    fn reduce(&mut self, event: &MeasureEvent, _: &mut Display) {
        match event {
            MeasureEvent::Choose(kind) => {
                self.kind = *kind;
                self.points.clear();
                self.missed = false;
            }
            MeasureEvent::Picked(point) => {
                self.missed = point.is_none();
                if let (Some(kind), Some(point)) = (self.kind, point) {
                    self.take(kind, point);
                }
            }
            MeasureEvent::Back => {
                self.missed = false;
                if self.points.pop().is_none() {
                    self.kind = None;
                }
            }
            MeasureEvent::Remove(number) => self.list.retain(|m| m.number != *number),
            MeasureEvent::RemoveLast => drop(self.list.pop()),
            MeasureEvent::RemoveAll => self.list.clear(),
            MeasureEvent::Unit(unit) => self.unit = *unit,
            MeasureEvent::Outdated => {
                // Points of two models make no measurement.
                self.points.clear();
                self.list.iter_mut().for_each(|m| m.outdated = true);
            }
        }
    }

    /// The unit and what is measured stay.
    fn begin(&mut self, _: &mut Display) {
        self.points.clear();
        self.list.clear();
        self.missed = false;
    }

    fn draw(&self, display: &Display, content: &mut FrameContent) {
        let (line, halo) = match display.color_scheme() {
            ColorScheme::Dark => ([0xff, 0xd2, 0x4a, 0xff], [0x10, 0x14, 0x18, 0xc0]),
            ColorScheme::Light => ([0x8a, 0x14, 0x5e, 0xff], [0xff, 0xff, 0xff, 0xd0]),
        };
        let open: Vec<[f32; 3]> = self.points.iter().map(|p| p.position).collect();
        let chains = || self.list.iter().map(|m| &m.points).chain([&open]);
        for (color, width) in [(halo, 5.0), (line, 2.0)] {
            for pair in chains().flat_map(|chain| chain.windows(2)) {
                let [from, to] = [Vec3::from(pair[0]), Vec3::from(pair[1])];
                content.marks.push(Segment { from, to, color, width });
            }
        }
    }
}

impl Measure {
    /// Takes a point, and makes the measurement of those that are there.
    fn take(&mut self, kind: Kind, point: &PickedPoint) {
        // The second click of a double click, or a key that was held: two points in one place measure nothing.
        if self.points.last().is_some_and(|last| last.position == point.position) {
            return;
        }
        self.points.push(*point);
        if self.points.len() < kind.points() || self.list.len() >= MOST {
            self.points.truncate(kind.points() - 1);
            return;
        }
        let points = std::mem::take(&mut self.points);
        self.made = self.made.saturating_add(1);
        self.list.push(Measurement {
            number: self.made,
            kind,
            // The coarser one counts.
            voxel: points.iter().map(|p| p.voxel).fold(0.0, f32::max),
            points: points.iter().map(|p| p.position).collect(),
            outdated: false,
        });
    }

    /// What to do next, for the panel and a screen reader.
    pub fn prompt(&self) -> &'static str {
        let full = self.list.len() >= MOST;
        match (self.kind, self.points.len()) {
            (None, _) => "",
            _ if self.missed => "Nothing lies there. Pick a place on the model.",
            _ if full => "The list is full: remove a measurement first.",
            (Some(Kind::Distance), 0) => "Pick the first point.",
            (Some(Kind::Distance), _) => "Pick the second point.",
            (Some(Kind::Angle), 0) => "Pick a point on the first side.",
            (Some(Kind::Angle), 1) => "Pick the vertex.",
            (Some(Kind::Angle), _) => "Pick a point on the second side.",
        }
    }

    /// Whether [`MeasureEvent::Outdated`] would change anything.
    pub fn is_current(&self) -> bool {
        !self.points.is_empty() || self.list.iter().any(|m| !m.outdated)
    }
}

#[cfg(test)]
mod tests {
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
        assert_eq!((one.list.len(), one.points.len(), one.kind), (1, 0, Some(Kind::Distance)));
        assert_eq!(one.list[0].points, [[0.0; 3], [0.1, 0.0, 0.0]]);
        assert_eq!(after(distance().into_iter().chain([at(0.2), at(0.3)])).list.len(), 2, "one after the other");
        let angle = after([Choose(Some(Kind::Angle)), at(0.0), at(0.1), at(0.2)]);
        assert_eq!((angle.list.len(), angle.list[0].points.len()), (1, 3));
        assert!(after([at(0.0), at(0.1)]).points.is_empty(), "nothing is measured");
    }

    #[test]
    fn a_miss_and_the_same_place_again_measure_nothing() {
        let measure = after([Choose(Some(Kind::Distance)), at(0.0), at(0.0), Picked(None)]);
        assert_eq!((measure.list.len(), measure.points.len(), measure.missed), (0, 1, true));
        assert!(measure.prompt().starts_with("Nothing lies there"));
        assert_eq!(after([Choose(Some(Kind::Distance)), at(0.0)]).prompt(), "Pick the second point.");
        assert_eq!(Measure::default().prompt(), "");
    }

    #[test]
    fn back_takes_points_back_and_then_ends() {
        let measure = after([Choose(Some(Kind::Angle)), at(0.0), at(0.1), Back]);
        assert_eq!((measure.points.len(), measure.kind), (1, Some(Kind::Angle)));
        let measure = after([Choose(Some(Kind::Angle)), at(0.0), Back, Back]);
        assert_eq!((measure.points.len(), measure.kind), (0, None));
        let other = after([Choose(Some(Kind::Angle)), at(0.0), Choose(Some(Kind::Distance))]);
        assert!(other.points.is_empty(), "points of another measurement");
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
        assert_eq!((measure.list.len(), measure.points.len()), (MOST, 1));
        assert!(measure.prompt().contains("full"));
    }

    #[test]
    fn points_of_two_models_make_no_measurement() {
        let measure = after([Choose(Some(Kind::Distance)), at(0.0), at(1.0), at(2.0), Outdated]);
        assert!(measure.list[0].outdated && measure.points.is_empty() && !measure.is_current());
        let mut next = measure;
        next.begin(&mut Display::default());
        assert_eq!((next.list.len(), next.kind), (0, Some(Kind::Distance)));
    }
}
