//! Plane sections as drawings, in millimetres: [`svg`] for people and documents, [`dxf`] for CAD (both write only).
//!
//! Seen from where the plane's normal points: the plane's first axis to the right, its second one up.

pub mod dxf;
pub mod svg;

use semascan_geometry::section::{Outline, Place, PlaneSection};
use semascan_model::{Color, Taxonomy};

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Drawing<'a> {
    /// The section, metres.
    pub section: &'a PlaneSection,
    /// Names and colours of its classes.
    pub taxonomy: &'a Taxonomy,
    /// What it is a section of.
    pub part: &'a str,
    /// Where the plane lies, and whatever else is to be said of it; a line each.
    pub notes: &'a [String],
}

/// Millimetres in a metre.
const MM: f64 = 1e3;
/// Colour of what has no component.
const UNKNOWN: Color = [140, 147, 156];

/// A stretch of an outline that is of one class.
struct Run {
    label: u16,
    /// Millimetres.
    places: Vec<Place>,
    /// Whether its last place is joined with its first.
    is_closed: bool,
}

impl Drawing<'_> {
    fn runs(&self) -> impl Iterator<Item = Run> {
        self.section.outlines.iter().flat_map(runs)
    }

    /// The classes that are in it, in order.
    fn labels(&self) -> Vec<u16> {
        let mut labels: Vec<u16> = self.section.outlines.iter().flat_map(|outline| &outline.labels).copied().collect();
        labels.sort_unstable();
        labels.dedup();
        labels
    }

    fn name(&self, label: u16) -> &str {
        let known = self.taxonomy.components.get(usize::from(label)).filter(|_| label > 0);
        known.map_or("unlabelled", |class| class.name.as_str())
    }

    fn color(&self, label: u16) -> Color {
        let known = self.taxonomy.components.get(usize::from(label)).filter(|_| label > 0);
        known.map_or(UNKNOWN, |class| class.color)
    }
}

/// An outline cut where its class changes.
fn runs(outline: &Outline) -> Vec<Run> {
    let mm = |place: Place| place.map(|c| c * MM);
    let mut runs: Vec<Run> = Vec::new();
    for ([from, to], label) in outline.segments() {
        match runs.last_mut() {
            Some(run) if run.label == label => run.places.push(mm(to)),
            _ => runs.push(Run { label, places: vec![mm(from), mm(to)], is_closed: false }),
        }
    }
    if outline.is_closed() && runs.len() == 1 {
        runs[0].places.pop();
        runs[0].is_closed = true;
    } else if outline.is_closed() && runs.first().map(|r| r.label) == runs.last().map(|r| r.label) {
        // It goes on where it begins.
        if let Some(mut last) = runs.pop() {
            last.places.pop();
            last.places.append(&mut runs[0].places);
            runs[0] = last;
        }
    }
    runs
}

/// The lowest and highest corner around places; the origin without any.
fn corners<'a>(places: impl Iterator<Item = &'a Place>) -> [Place; 2] {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for place in places {
        low = [0, 1].map(|k| low[k].min(place[k]));
        high = [0, 1].map(|k| high[k].max(place[k]));
    }
    if low[0] <= high[0] { [low, high] } else { [[0.0; 2]; 2] }
}

#[cfg(test)]
mod tests;
