//! The section plane, the box, what they cut, and what was read in it.

use super::reading::{self, Aim, End, Ray, Reading, ReadingKind};
use super::{Direction, SectionEvent, Shown};
use crate::display::{ColorScheme, Cut, Display};
use crate::features::Feature;
use crate::render::FrameContent;
use crate::render::segment::Segment;
use glam::{DVec3, Vec3};
use semascan_geometry::section::Plane;
use std::sync::Arc;

/// Most readings at once.
const MOST: usize = 50;
/// Least cosine between the normal of a plane and an axis that it lies across.
const ALONG_AXIS: f64 = 0.999_999;
/// The farthest from the origin that plane and box may lie, metres.
const FARTHEST: f64 = 100.0;

/// Plane and box.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// Whether there is a plane.
    pub is_on: bool,
    /// What it lies across.
    pub direction: Direction,
    /// How far from where its direction counts from, metres.
    pub offset: f64,
    /// Whether what is before the plane is cut away, not what is beyond it.
    pub is_flipped: bool,
    /// The box: its lowest and highest corner, metres, table frame; `None` without one.
    pub limits: Option<[[f64; 3]; 2]>,
    /// The box around the model, metres, table frame.
    pub extent: Option<[[f64; 3]; 2]>,
    /// What the plane cuts.
    pub shown: Option<Arc<Shown>>,
    /// Whether thicknesses are being read.
    pub is_reading: bool,
    /// What the pointer is at meanwhile.
    pub aim: Option<Aim>,
    /// The first end of a distance.
    pub first: Option<End>,
    /// Whether the last click was at nothing.
    pub missed: bool,
    /// What was read, the oldest first.
    pub readings: Vec<Reading>,
    /// Readings made so far.
    made: u32,
    /// Whether the plane was ever put anywhere.
    is_placed: bool,
}

impl Feature for Section {
    type Event = SectionEvent;

    fn reduce(&mut self, event: &SectionEvent, display: &mut Display) {
        match event {
            SectionEvent::Show(is_on) => {
                self.is_on = *is_on;
                self.is_reading &= is_on;
                if *is_on && !self.is_placed {
                    self.center();
                }
            }
            SectionEvent::Turn(direction) => {
                self.is_on = true;
                self.direction = *direction;
                self.is_flipped = false;
                self.center();
            }
            // The controller's business.
            SectionEvent::FaceCamera => {}
            SectionEvent::Toward(eye) => {
                let plane = Plane::through(self.place(), self.direction.normal());
                self.is_flipped = plane.is_some_and(|plane| plane.height(*eye) < 0.0);
            }
            SectionEvent::Offset(offset) => self.move_to(*offset),
            SectionEvent::Deepen(way) => {
                self.move_to(if self.is_flipped { self.offset + way } else { self.offset - way });
            }
            SectionEvent::Flip => self.is_flipped = !self.is_flipped,
            SectionEvent::ShowLimits(true) => self.limits = self.limits.or(self.extent),
            SectionEvent::ShowLimits(false) => self.limits = None,
            SectionEvent::Limit { axis, end, at } => self.limit(*axis, *end, *at),
            SectionEvent::Follow { plane, limits } => self.follow(*plane, *limits),
            SectionEvent::Reset => *self = Self { extent: self.extent, ..Self::default() },
            SectionEvent::Extent(extent) => self.extent = *extent,
            SectionEvent::Cut(shown) => self.take(shown.clone()),
            SectionEvent::Read(is_reading) => {
                self.is_reading = *is_reading && self.is_on;
                self.forget_aim();
            }
            SectionEvent::Aimed(ray) => {
                let ray = ray.as_ref().filter(|_| self.reads());
                self.aim = ray.and_then(|ray| reading::aim(self.shown.as_ref()?, &display.cut, ray));
            }
            SectionEvent::Clicked(ray) => self.click(ray, &display.cut),
            SectionEvent::Back => {
                self.missed = false;
                if self.first.take().is_none() {
                    self.is_reading = false;
                    self.aim = None;
                }
            }
            SectionEvent::Remove(number) => self.readings.retain(|reading| reading.number != *number),
            SectionEvent::RemoveAll => self.readings.clear(),
        }
        display.cut = self.cut();
    }

    fn begin(&mut self, display: &mut Display) {
        *self = Self::default();
        display.cut = Cut::default();
    }

    fn draw(&self, display: &Display, content: &mut FrameContent) {
        content.section = self.shown.as_ref().map(|shown| shown.picture.clone());
        let (frame, line, halo) = match display.color_scheme() {
            ColorScheme::Dark => ([0x6e, 0xa0, 0xff, 0xa0], [0xff, 0xff, 0xff, 0xff], [0x10, 0x14, 0x18, 0xd0]),
            ColorScheme::Light => ([0x1d, 0x5f, 0xd1, 0xa0], [0x16, 0x1b, 0x21, 0xff], [0xff, 0xff, 0xff, 0xd8]),
        };
        let segment = |[from, to]: [Vec3; 2], color, width| Segment { from, to, color, width };
        let edges = self.frame().into_iter().chain(self.edges());
        content.marks.extend(edges.map(|ends| segment(ends, frame, 1.5)));
        for (color, width) in [(halo, 5.0), (line, 2.0)] {
            content.marks.extend(self.read_lines().map(|ends| segment(ends, color, width)));
        }
    }
}

impl Section {
    /// The plane; what is cut away lies beyond it. `None` without one.
    pub fn plane(&self) -> Option<Plane> {
        let normal = self.direction.normal().map(|c| if self.is_flipped { -c } else { c });
        Plane::through(self.place(), normal).filter(|_| self.is_on)
    }

    /// The offsets that the plane meets the model between, metres; none without a model.
    pub fn range(&self) -> Option<[f64; 2]> {
        Some(self.direction.range(self.extent?))
    }

    /// Whether clicks read thicknesses.
    pub fn reads(&self) -> bool {
        self.is_reading && self.is_on && self.shown.is_some()
    }

    /// Whether anything is cut, or can be brought back.
    pub fn is_active(&self) -> bool {
        self.is_on || self.limits.is_some()
    }

    fn cut(&self) -> Cut {
        let plane = self.plane().map(|plane| (plane.normal().map(|c| c as f32), plane.offset() as f32));
        Cut { plane, limits: self.limits.map(|corners| corners.map(|corner| corner.map(|c| c as f32))) }
    }

    /// A place on the plane.
    fn place(&self) -> [f64; 3] {
        let (origin, normal) = (self.direction.origin(), self.direction.normal());
        [0, 1, 2].map(|k| origin[k] + self.offset * normal[k])
    }

    /// Along an axis of the frame the plane begins in the middle of the model, else at the place that it was asked for.
    fn center(&mut self) {
        self.is_placed = true;
        let is_axis = Direction::AXES.contains(&self.direction);
        self.offset = self.range().filter(|_| is_axis).map_or(0.0, |[low, high]| 0.5 * (low + high));
    }

    fn move_to(&mut self, offset: f64) {
        if offset.is_finite() {
            self.offset = offset.clamp(-FARTHEST, FARTHEST);
        }
    }

    /// Moves an end of the box; the other end gives way.
    fn limit(&mut self, axis: usize, end: usize, at: f64) {
        let Some([low, high]) = self.limits.as_mut().filter(|_| axis < 3 && at.is_finite()) else { return };
        let at = at.clamp(-FARTHEST, FARTHEST);
        if end == 0 {
            low[axis] = at;
            high[axis] = high[axis].max(at);
        } else {
            high[axis] = at;
            low[axis] = low[axis].min(at);
        }
    }

    /// Takes plane and box as they are; along an axis of the frame the plane is one that can be moved along it.
    fn follow(&mut self, plane: Option<Plane>, limits: Option<[[f64; 3]; 2]>) {
        self.limits = limits.map(|corners| corners.map(|corner| corner.map(|c| c.clamp(-FARTHEST, FARTHEST))));
        self.is_on = plane.is_some();
        self.is_reading &= self.is_on;
        let Some(plane) = plane else { return };
        self.is_placed = true;
        let along = |axis: &Direction| (0..3).map(|k| axis.normal()[k] * plane.normal()[k]).sum::<f64>();
        let axis = Direction::AXES.into_iter().find(|axis| along(axis).abs() > ALONG_AXIS);
        match axis {
            Some(axis) => {
                self.is_flipped = along(&axis) < 0.0;
                self.direction = axis;
                self.move_to(plane.offset() * along(&axis).signum());
            }
            None => {
                let through = plane.normal().map(|c| c * plane.offset());
                self.is_flipped = false;
                self.direction = Direction::Surface { normal: plane.normal(), through };
                self.offset = 0.0;
            }
        }
    }

    /// Takes what the plane cuts; what was read in another section is void.
    fn take(&mut self, shown: Option<Arc<Shown>>) {
        if self.shown.as_ref().map(|before| &before.section) != shown.as_ref().map(|now| &now.section) {
            self.readings.clear();
            self.forget_aim();
        }
        self.shown = shown;
    }

    fn forget_aim(&mut self) {
        self.aim = None;
        self.first = None;
        self.missed = false;
    }

    fn click(&mut self, ray: &Ray, cut: &Cut) {
        let Some(shown) = self.shown.clone().filter(|_| self.reads() && self.readings.len() < MOST) else { return };
        self.missed = false;
        self.aim = reading::aim(&shown, cut, ray);
        let (kind, ends) = match (self.aim, self.first) {
            (None, _) => {
                self.missed = true;
                return;
            }
            (Some(Aim::Outline(end)), None) => {
                self.first = Some(end);
                return;
            }
            (Some(Aim::Outline(end)), Some(first)) => {
                // The second click of a double click.
                if first.place == end.place {
                    return;
                }
                (ReadingKind::Distance, [first, end])
            }
            (Some(Aim::Across(ends)), _) => (ReadingKind::Thickness, ends),
        };
        self.first = None;
        self.made = self.made.saturating_add(1);
        self.readings.push(Reading { number: self.made, kind, ends, voxel: shown.voxel });
    }

    /// What the pointer would read.
    pub fn aimed(&self) -> Option<Reading> {
        let shown = self.shown.as_ref()?;
        let (kind, ends) = match (self.aim?, self.first) {
            (Aim::Outline(end), Some(first)) => (ReadingKind::Distance, [first, end]),
            (Aim::Outline(_), None) => return None,
            (Aim::Across(ends), _) => (ReadingKind::Thickness, ends),
        };
        Some(Reading { number: 0, kind, ends, voxel: shown.voxel })
    }

    fn read_lines(&self) -> impl Iterator<Item = [Vec3; 2]> {
        let readings = self.readings.iter().copied().chain(self.aimed());
        readings.map(|reading| reading.ends.map(|end| DVec3::from(end.place).as_vec3()))
    }

    /// The edge of the plane: a rectangle as large as the model.
    fn frame(&self) -> Vec<[Vec3; 2]> {
        let (Some(plane), Some([low, high])) = (self.plane(), self.extent) else { return Vec::new() };
        let corners = (0..8).map(|i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 0 { low[k] } else { high[k] }));
        let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for place in corners.map(|corner| plane.drop(corner)) {
            least = [0, 1].map(|k| least[k].min(place[k]));
            most = [0, 1].map(|k| most[k].max(place[k]));
        }
        let at = |x: f64, y: f64| DVec3::from(plane.lift([x, y])).as_vec3();
        let round = [at(least[0], least[1]), at(most[0], least[1]), at(most[0], most[1]), at(least[0], most[1])];
        (0..4).map(|i| [round[i], round[(i + 1) % 4]]).collect()
    }

    /// The edges of the box.
    fn edges(&self) -> Vec<[Vec3; 2]> {
        let Some(corners) = self.limits else { return Vec::new() };
        let corner = |i: usize| Vec3::from([0, 1, 2].map(|k| corners[i >> k & 1][k] as f32));
        let of_axis = |axis: usize| (0..8).filter(move |i| i >> axis & 1 == 0).map(move |i| [i, i | 1 << axis]);
        (0..3).flat_map(of_axis).map(|ends| ends.map(corner)).collect()
    }
}

#[cfg(test)]
mod tests;
