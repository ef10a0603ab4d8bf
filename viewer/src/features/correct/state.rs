//! The tool in hand, the marks that are not sent yet, and what people corrected before.

use super::{CorrectEvent, Mark, Naming, NoPatch, Patch, Teaching, TeachingRegion, Tool};
use crate::display::{ColorMode, ColorScheme, Display};
use crate::features::Feature;
use crate::features::inspect::PickedPoint;
use crate::render::FrameContent;
use crate::render::segment::Segment;
use crate::words::t;
use glam::{DVec3, Vec2, Vec3};
use semascan_model::ClassDef;
use semascan_model::review::ReviewAction;
use std::collections::BTreeMap;

/// Radii that the brush may have, metres.
const RADII: [f32; 9] = [0.5e-3, 0.75e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 5e-3, 7.5e-3, 10e-3];
/// Most marks that are not sent.
const MOST: usize = 200;
/// Most corners of a loop.
const MOST_CORNERS: usize = 5000;

/// Corrections that are in the log of an inspection, in its order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Corrections {
    /// The inspection.
    pub inspection: String,
    /// Place in the log up to which it is known.
    pub sequence: u64,
    /// What was done to the surface.
    pub actions: Vec<ReviewAction>,
}

/// The corrections.
#[derive(Clone, Debug, PartialEq)]
pub struct Correct {
    /// The tool in hand; `None` while the pointer is for looking.
    pub tool: Option<Tool>,
    /// What the brush says of the surface.
    pub brush: Naming,
    /// What an outline says of what is within it.
    pub outline: Naming,
    /// Radius of the brush, metres.
    pub radius: f32,
    /// Marks that are not sent, the oldest first.
    pub marks: Vec<Mark>,
    /// Marks that were taken back, the last one last.
    undone: Vec<Mark>,
    /// What people corrected before.
    pub earlier: Corrections,
    /// Whether that is shown.
    pub shows_earlier: bool,
    /// Marks made so far.
    made: u32,
    /// Why the last place or loop took nothing.
    pub missed: Option<NoPatch>,
    /// The loop that is being drawn, as shares of the viewport.
    pub path: Vec<Vec2>,
    /// Whether it is shown where a label would teach most.
    pub shows_teaching: bool,
    /// Where, once the agent has said it.
    pub teaching: Option<Teaching>,
    /// The place that was chosen last.
    pub taught: Option<usize>,
}

impl Default for Correct {
    fn default() -> Self {
        Self {
            tool: None,
            brush: Naming::Defect(0),
            outline: Naming::Defect(1),
            radius: 3e-3,
            marks: Vec::new(),
            undone: Vec::new(),
            earlier: Corrections::default(),
            shows_earlier: true,
            made: 0,
            missed: None,
            path: Vec::new(),
            shows_teaching: false,
            teaching: None,
            taught: None,
        }
    }
}

impl Feature for Correct {
    type Event = CorrectEvent;

    fn reduce(&mut self, event: &CorrectEvent, display: &mut Display) {
        match event {
            CorrectEvent::Choose(tool) => {
                self.tool = *tool;
                self.missed = None;
                self.path.clear();
                self.close();
                self.show_classes(display);
            }
            CorrectEvent::Name(naming) => {
                match self.tool {
                    Some(Tool::Outline) => self.outline = *naming,
                    _ => self.brush = *naming,
                }
                self.show_classes(display);
            }
            CorrectEvent::Radius(radius) => {
                if radius.is_finite() {
                    self.radius = radius.clamp(RADII[0], RADII[RADII.len() - 1]);
                }
            }
            CorrectEvent::Step(step) => {
                let here = RADII.iter().position(|r| *r >= self.radius * 0.999).unwrap_or(RADII.len() - 1);
                self.radius = RADII[here.saturating_add_signed(*step as isize).min(RADII.len() - 1)];
            }
            CorrectEvent::Begun { number } => {
                self.close();
                if let Some(tool) = self.tool.filter(|_| *number > self.made) {
                    self.begin_mark(*number, tool, true);
                }
            }
            CorrectEvent::Drawn { number, point } => {
                let mark = self.marks.iter_mut().find(|mark| mark.number == *number);
                if let (Some(mark), Some(point)) = (mark, point) {
                    self.missed = None;
                    mark.extend(point);
                }
            }
            CorrectEvent::Lifted(number) => {
                self.marks.iter_mut().filter(|mark| mark.number == *number).for_each(|mark| mark.is_open = false);
            }
            CorrectEvent::Dotted(point) => self.dot(point.as_ref()),
            CorrectEvent::Looped(at) => {
                if self.path.len() < MOST_CORNERS && at.is_finite() {
                    self.path.push(*at);
                }
            }
            // The controller looks for what is seen within the loop.
            CorrectEvent::LoopClosed => {}
            CorrectEvent::Taken(taken) => {
                self.path.clear();
                self.take(taken);
            }
            CorrectEvent::Close => self.close(),
            CorrectEvent::Undo => {
                // A stroke beside the model is nothing to take back.
                while self.marks.pop_if(|mark| mark.points.is_empty()).is_some() {}
                self.undone.extend(self.marks.pop().map(|mark| Mark { is_open: false, ..mark }));
            }
            CorrectEvent::Redo => self.marks.extend(self.undone.pop()),
            CorrectEvent::Discard => {
                self.marks.clear();
                self.undone.clear();
            }
            CorrectEvent::Signed => {
                // What is not finished stays, to be finished or taken back.
                self.marks.retain(|mark| !mark.is_whole() && !mark.points.is_empty());
                self.undone.clear();
            }
            CorrectEvent::Known(corrections) => self.earlier = corrections.as_ref().clone(),
            CorrectEvent::ShowEarlier(shows) => self.shows_earlier = *shows,
            // What was said before holds no more.
            CorrectEvent::AskTeaching(shows) => {
                self.shows_teaching = *shows;
                self.teaching = None;
                self.taught = None;
            }
            CorrectEvent::Teaching(teaching) => {
                let known = self.earlier.actions.len();
                self.teaching = self.shows_teaching.then(|| Teaching { known, ..teaching.as_ref().clone() });
            }
            CorrectEvent::Teach(place) => {
                self.taught = self.regions().get(*place).map(|_| *place);
                if let Some(naming) = self.taught_region().map(TeachingRegion::naming) {
                    self.tool = Some(Tool::Brush);
                    self.brush = naming;
                    self.missed = None;
                    self.show_classes(display);
                }
            }
        }
    }

    /// Marks are of the surface, which is the same when the model of the same inspection comes again.
    fn begin(&mut self, _: &mut Display) {
        self.path.clear();
        self.missed = None;
    }

    /// What the tools give stays.
    fn leave(&mut self) {
        let Self { brush, outline, radius, shows_earlier, made, .. } = *self;
        *self = Self { brush, outline, radius, shows_earlier, made, ..Self::default() };
    }

    /// Outlines, and the strokes of the mark that is being drawn.
    fn draw(&self, display: &Display, content: &mut FrameContent) {
        let color = match display.color_scheme() {
            ColorScheme::Dark => [0x6c, 0xf0, 0xff, 0xff],
            ColorScheme::Light => [0x00, 0x50, 0x78, 0xff],
        };
        for mark in &self.marks {
            let is_closed = mark.tool == Tool::Outline && !mark.is_open;
            if mark.tool == Tool::Outline || mark.is_open {
                outline(&mark.points, is_closed, color, content);
            }
        }
        if self.shows_earlier {
            for action in &self.earlier.actions {
                if let ReviewAction::NewFinding { outline: curve, .. } = action {
                    let points: Vec<Vec3> = curve.iter().map(|p| DVec3::from(*p).as_vec3()).collect();
                    outline(&points, true, color, content);
                }
            }
        }
    }
}

impl Correct {
    /// Where a label would teach most, as far as it is known.
    pub fn regions(&self) -> &[TeachingRegion] {
        self.teaching.as_ref().map_or(&[], |teaching| &teaching.regions)
    }

    /// The chosen one of these places.
    pub fn taught_region(&self) -> Option<&TeachingRegion> {
        self.regions().get(self.taught?)
    }

    /// Whether each of these places has been corrected since they were asked for; marks that are not signed count.
    ///
    /// * `components`, `defects`: classes of the model.
    pub fn taught(&self, components: &[ClassDef], defects: &[ClassDef]) -> Vec<bool> {
        let known = self.teaching.as_ref().map_or(0, |teaching| teaching.known);
        let since = self.earlier.actions.iter().skip(known).cloned();
        let marks = self.marks.iter().filter_map(|mark| mark.action(components, defects));
        let since: Vec<ReviewAction> = since.chain(marks).collect();
        self.regions().iter().map(|region| region.is_among(&since)).collect()
    }

    /// Number of the next mark.
    pub fn next_number(&self) -> u32 {
        self.made.saturating_add(1)
    }

    /// The class that the tool in hand gives.
    pub fn naming(&self) -> Naming {
        match self.tool {
            Some(Tool::Outline) => self.outline,
            _ => self.brush,
        }
    }

    /// Radius of what the tool in hand paints, metres; `None` where it paints nothing.
    pub fn brush_radius(&self) -> Option<f32> {
        (self.tool == Some(Tool::Brush)).then_some(self.radius)
    }

    /// Whether marks were taken back that may come again.
    pub fn can_redo(&self) -> bool {
        !self.undone.is_empty()
    }

    /// Marks with anything in them.
    pub fn drawn(&self) -> impl Iterator<Item = &Mark> {
        self.marks.iter().filter(|mark| !mark.points.is_empty())
    }

    /// Whether a mark is being drawn.
    pub fn is_drawing(&self) -> bool {
        self.marks.last().is_some_and(|mark| mark.is_open)
    }

    /// What to do next, for the panel and a screen reader.
    pub fn prompt(&self) -> &'static str {
        let open = self.marks.last().filter(|mark| mark.is_open && mark.tool == Tool::Outline);
        match (self.tool, open) {
            (None, _) => "",
            _ if self.missed == Some(NoPatch::Nothing) => t!("correct.missed"),
            _ if self.missed == Some(NoPatch::Large) => t!("correct.large"),
            _ if self.marks.len() >= MOST => t!("correct.full"),
            (Some(Tool::Brush), _) => t!("correct.prompt.brush"),
            (Some(Tool::Segment), _) => t!("correct.prompt.segment"),
            (Some(Tool::Lasso), _) => t!("correct.prompt.lasso"),
            (Some(Tool::Outline), None) => t!("correct.prompt.outline"),
            (Some(Tool::Outline), Some(mark)) if mark.points.len() < 3 => t!("correct.prompt.corner"),
            (Some(Tool::Outline), Some(_)) => t!("correct.prompt.close"),
        }
    }

    /// The colours are those of the classes that the tool gives.
    fn show_classes(&self, display: &mut Display) {
        match (self.tool, self.naming()) {
            (None, _) => {}
            (_, Naming::Component(_)) => display.set_color_mode(ColorMode::Component),
            (_, Naming::Defect(_)) => display.set_color_mode(ColorMode::Defect),
        }
    }

    /// Begins a mark; `None` where there are too many.
    fn begin_mark(&mut self, number: u32, tool: Tool, is_open: bool) -> Option<&mut Mark> {
        // Of the stroke before this one picks may still come.
        let before = self.made;
        self.marks.retain(|mark| !mark.points.is_empty() || mark.number == before);
        if self.marks.len() >= MOST {
            return None;
        }
        self.undone.clear();
        self.made = number;
        let (naming, radius) = (self.naming(), self.radius);
        let (points, components) = (Vec::new(), BTreeMap::new());
        self.marks.push(Mark { number, tool, naming, radius, points, components, is_open });
        self.marks.last_mut()
    }

    /// Takes a patch at once.
    fn take(&mut self, taken: &Result<Patch, NoPatch>) {
        self.missed = taken.as_ref().err().copied();
        let Some(tool) = self.tool else { return };
        let (number, patch) = (self.next_number(), taken.as_ref().ok());
        if let Some((mark, patch)) = patch.and_then(|patch| Some((self.begin_mark(number, tool, false)?, patch))) {
            mark.points.clone_from(&patch.points);
            mark.radius = patch.radius;
        }
    }

    fn dot(&mut self, point: Option<&PickedPoint>) {
        let Some(tool) = self.tool else { return };
        self.missed = point.is_none().then_some(NoPatch::Nothing);
        let Some(point) = point.filter(|_| matches!(tool, Tool::Brush | Tool::Outline)) else { return };
        let goes_on = tool == Tool::Outline && self.is_drawing();
        let mark = match goes_on {
            true => self.marks.last_mut(),
            false => self.begin_mark(self.next_number(), tool, tool == Tool::Outline),
        };
        if let Some(mark) = mark {
            mark.extend(point);
        }
    }

    /// An outline that is being drawn is closed.
    fn close(&mut self) {
        if let Some(mark) = self.marks.last_mut() {
            let is_clicked = mark.is_open && mark.tool == Tool::Outline;
            mark.is_open = false;
            if is_clicked && mark.points.len() < 3 {
                self.marks.pop();
            }
        }
    }
}

/// A line along `points`.
fn outline(points: &[Vec3], is_closed: bool, color: [u8; 4], content: &mut FrameContent) {
    let last = if is_closed { points.first() } else { None };
    let next = points.iter().skip(1).chain(last);
    content.marks.extend(points.iter().zip(next).map(|(from, to)| Segment { from: *from, to: *to, color, width: 2.5 }));
}

#[cfg(test)]
mod tests {
    use super::super::mark::tests::pick;
    use super::*;
    use CorrectEvent::{
        Begun, Choose, Close, Dotted, Drawn, Known, Lifted, LoopClosed, Looped, Name, Redo, ShowEarlier, Signed, Step,
        Taken, Undo,
    };
    use semascan_model::Taxonomy;
    use semascan_model::review::SurfacePatch;

    fn after(events: impl IntoIterator<Item = CorrectEvent>) -> (Correct, Display) {
        let (mut correct, mut display) = (Correct::default(), Display::default());
        events.into_iter().for_each(|event| correct.reduce(&event, &mut display));
        (correct, display)
    }

    #[test]
    fn a_patch_is_one_mark_that_can_be_taken_back() {
        let patch = Patch { points: vec![Vec3::ZERO, Vec3::X], radius: 1e-3 };
        let taken = || Taken(Ok(patch.clone()));
        let lasso =
            || [Choose(Some(Tool::Lasso)), Looped(Vec2::ZERO), Looped(Vec2::ONE), Looped(Vec2::NAN), LoopClosed];
        let (drawn, _) = after(lasso());
        assert_eq!((drawn.path.len(), drawn.marks.len()), (2, 0));
        let (correct, _) = after(lasso().into_iter().chain([taken(), taken(), Undo]));
        assert_eq!((correct.path.len(), correct.marks.len(), correct.missed), (0, 1, None));
        let mark = &correct.marks[0];
        assert_eq!((mark.points.len(), mark.radius, mark.tool, mark.is_open), (2, 1e-3, Tool::Lasso, false));
        let (none, _) = after(lasso().into_iter().chain([Taken(Err(NoPatch::Large))]));
        assert_eq!((none.marks.len(), none.missed), (0, Some(NoPatch::Large)));
        let (segment, _) = after([Choose(Some(Tool::Segment)), Dotted(Some(pick(0.0, 0.0))), taken()]);
        assert_eq!(segment.marks.len(), 1, "the clicked place alone is no mark");
    }

    fn through(number: u32, x: f32) -> CorrectEvent {
        Drawn { number, point: Some(pick(x, 0.0)) }
    }

    fn at(x: f32, y: f32) -> CorrectEvent {
        Dotted(Some(pick(x, y)))
    }

    #[test]
    fn a_stroke_is_drawn_and_lifted_and_its_last_picks_may_come_late() {
        let begun = |number| Begun { number };
        let stroke =
            || [Choose(Some(Tool::Brush)), begun(1), through(1, 0.0), through(1, 5.0), Lifted(1), through(1, 9.0)];
        let (correct, display) = after(stroke());
        assert_eq!((correct.marks.len(), correct.is_drawing(), display.color_mode), (1, false, ColorMode::Defect));
        let last = correct.marks[0].points.last().expect("it was drawn");
        assert!((last.x - 9e-3).abs() < 1e-6, "{last}");
        let (correct, _) = after(stroke().into_iter().chain([Undo, through(1, 12.0)]));
        assert!(correct.marks.is_empty() && correct.can_redo(), "it does not come again by itself");
        let (correct, _) = after(stroke().into_iter().chain([Undo, Redo]));
        assert_eq!((correct.marks.len(), correct.can_redo()), (1, false));
        let (correct, _) = after(stroke().into_iter().chain([Undo, begun(2), through(2, 0.0), Redo]));
        assert_eq!(correct.marks.iter().map(|m| m.number).collect::<Vec<_>>(), [2], "what was drawn since counts");
        assert!(after([begun(1), through(1, 0.0)]).0.marks.is_empty(), "without a tool nothing is drawn");
    }

    #[test]
    fn strokes_faster_than_their_picks_stay_apart_and_beside_the_model_there_is_none() {
        let begun = |number| Begun { number };
        let two =
            [Choose(Some(Tool::Brush)), begun(1), Lifted(1), begun(2), Lifted(2), through(1, 0.0), through(2, 9.0)];
        let places = |correct: &Correct| correct.drawn().map(|m| (m.number, m.points.len())).collect::<Vec<_>>();
        assert_eq!(places(&after(two.clone()).0), [(1, 1), (2, 1)]);
        let missed = [begun(3), Drawn { number: 3, point: None }, Lifted(3)];
        let (correct, _) = after(two.into_iter().chain(missed).chain([Undo]));
        assert_eq!(places(&correct), [(1, 1)], "what is taken back was drawn");
    }

    #[test]
    fn clicks_make_dots_and_corners() {
        let (dots, _) = after([Choose(Some(Tool::Brush)), at(0.0, 0.0), at(9.0, 0.0), Dotted(None)]);
        assert_eq!((dots.marks.len(), dots.missed, dots.is_drawing()), (2, Some(NoPatch::Nothing), false));
        let corners = || [Choose(Some(Tool::Outline)), at(0.0, 0.0), at(9.0, 0.0), at(9.0, 9.0)];
        let (open, _) = after(corners());
        assert_eq!((open.marks.len(), open.marks[0].points.len(), open.is_drawing()), (1, 3, true));
        assert!(open.prompt().contains("close"));
        let (closed, _) = after(corners().into_iter().chain([Close]));
        assert!(closed.marks[0].is_whole() && !closed.is_drawing());
        let (left, _) = after(corners().into_iter().take(3).chain([Choose(None)]));
        assert!(left.marks.is_empty(), "two corners are no outline");
    }

    #[test]
    fn what_is_signed_goes_and_what_says_nothing_stays() {
        let begun = Begun { number: 9 };
        let events =
            [Choose(Some(Tool::Brush)), at(0.0, 0.0), begun, Choose(Some(Tool::Outline)), at(0.0, 0.0), Signed];
        let (correct, _) = after(events);
        assert_eq!(correct.marks.iter().map(|m| m.tool).collect::<Vec<_>>(), [Tool::Outline]);
    }

    #[test]
    fn the_brush_and_the_outline_have_classes_of_their_own_and_radii_have_bounds() {
        let (correct, display) = after([
            Choose(Some(Tool::Brush)),
            Name(Naming::Component(2)),
            Choose(Some(Tool::Outline)),
            Name(Naming::Defect(3)),
            Choose(Some(Tool::Brush)),
        ]);
        assert_eq!((correct.naming(), correct.outline), (Naming::Component(2), Naming::Defect(3)));
        assert_eq!(display.color_mode, ColorMode::Component);
        let radius = |steps: &[i32]| after(steps.iter().map(|s| Step(*s))).0.radius;
        assert_eq!([radius(&[1]), radius(&[1, -1]), radius(&[-99]), radius(&[99])], [5e-3, 3e-3, 0.5e-3, 10e-3]);
        let (wild, _) = after([CorrectEvent::Radius(f32::NAN), CorrectEvent::Radius(1.0)]);
        assert!((wild.radius - 10e-3).abs() < 1e-9);
    }

    #[test]
    fn outlines_are_drawn_earlier_ones_while_they_are_wanted() {
        let curve = vec![[0.0; 3], [0.01, 0.0, 0.0], [0.01, 0.01, 0.0]];
        let drawn = ReviewAction::NewFinding { outline: curve, component: "housing".into(), defect: None };
        let known = Corrections { inspection: "a".into(), sequence: 3, actions: vec![drawn, ReviewAction::Accept] };
        let segments = |events: Vec<CorrectEvent>| {
            let (correct, display) = after(events);
            let mut content = FrameContent::default();
            correct.draw(&display, &mut content);
            content.marks.len()
        };
        let known = || Known(Box::new(known.clone()));
        assert_eq!((segments(vec![known()]), segments(vec![known(), ShowEarlier(false)])), (3, 0));
        assert_eq!(segments(vec![Choose(Some(Tool::Outline)), at(0.0, 0.0), at(5.0, 0.0)]), 1);
    }

    #[test]
    fn a_place_that_teaches_takes_the_brush_and_is_done_by_a_mark() {
        let region = |component, x: f64| TeachingRegion {
            component,
            name: "gear".into(),
            position: [x, 0.0, 0.0],
            area: 1e-4,
            sigma: 0.3,
            finding: None,
        };
        let teaching = Teaching { regions: vec![region(1, 0.0), region(2, 0.5)], ..Teaching::default() };
        let said = || CorrectEvent::Teaching(Box::new(teaching.clone()));
        assert!(after([said()]).0.teaching.is_none(), "nobody asks any more");
        let asked = || [CorrectEvent::AskTeaching(true), said()];
        let (chosen, display) = after(asked().into_iter().chain([CorrectEvent::Teach(1)]));
        assert_eq!((chosen.tool, chosen.brush), (Some(Tool::Brush), Naming::Component(2)));
        assert_eq!((display.color_mode, chosen.taught), (ColorMode::Component, Some(1)));
        assert_eq!(after(asked().into_iter().chain([CorrectEvent::Teach(7)])).0.tool, None);
        let classes = Taxonomy::from_names(&["gear", "shaft"], &["wear"]);
        let done = |events: Vec<CorrectEvent>| after(events).0.taught(&classes.components, &classes.defects);
        let with = |more: Vec<CorrectEvent>| asked().into_iter().chain(more).collect::<Vec<_>>();
        assert_eq!(done(with(vec![])), [false, false]);
        assert_eq!(done(with(vec![CorrectEvent::Teach(0), at(1.0, 0.0)])), [true, false]);
        // What was in the log before says nothing.
        let stroke = SurfacePatch::Points { points: vec![[0.5, 0.0, 0.0]], radius: 1e-3 };
        let relabel = ReviewAction::Relabel { patch: stroke, component: Some("gear".into()), defect: None };
        let known = Known(Box::new(Corrections { inspection: "a".into(), sequence: 1, actions: vec![relabel] }));
        assert_eq!(done(with(vec![known.clone()])), [false, true]);
        assert_eq!(done([known].into_iter().chain(asked()).collect()), [false, false]);
    }

    #[test]
    fn another_inspection_begins_without_marks() {
        let (mut correct, mut display) = after([Choose(Some(Tool::Brush)), Step(1), at(0.0, 0.0)]);
        correct.begin(&mut display);
        assert_eq!((correct.marks.len(), correct.tool), (1, Some(Tool::Brush)), "it may be the same again");
        correct.leave();
        assert!(correct.marks.is_empty() && correct.tool.is_none());
        assert_eq!((correct.radius, correct.next_number()), (5e-3, 2));
    }
}
