//! A section within a box: lines end where they leave it, and what is enclosed ends there, too.

use super::{End, Outline, Place, Plane, PlaneSection};

/// The places x of a plane with `a . x <= most`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HalfPlane {
    a: Place,
    most: f64,
}

impl HalfPlane {
    /// How far a place lies inside; less than 0 outside.
    fn room(&self, [x, y]: Place) -> f64 {
        self.most - self.a[0] * x - self.a[1] * y
    }
}

/// The part of a plane that lies in a box.
#[derive(Clone, Debug, PartialEq)]
pub struct Window([HalfPlane; 6]);

impl Window {
    /// The part of `plane` between two corners of a box along the frame's axes (metres).
    pub fn of_box(plane: &Plane, [low, high]: [[f64; 3]; 2]) -> Self {
        let ([first, second], foot) = (plane.axes(), plane.lift([0.0; 2]));
        let half = |k: usize| HalfPlane { a: [first[k], second[k]], most: high[k] - foot[k] };
        let other = |k: usize| HalfPlane { a: [-first[k], -second[k]], most: foot[k] - low[k] };
        Self([half(0), half(1), half(2), other(0), other(1), other(2)])
    }

    /// The shares of the way from `from` to `to` between which it is inside; `None` if it never is.
    fn inside(&self, from: Place, to: Place) -> Option<[f64; 2]> {
        let mut way = [0.0_f64, 1.0];
        for half in &self.0 {
            let (begin, end) = (half.room(from), half.room(to));
            match (begin >= 0.0, end >= 0.0) {
                (true, true) => {}
                (false, false) => return None,
                (true, false) => way[1] = way[1].min(begin / (begin - end)),
                (false, true) => way[0] = way[0].max(begin / (begin - end)),
            }
        }
        (way[0] < way[1]).then_some(way)
    }

    /// A ring within the window; it runs along the window's edges where it would be outside, and may come back along them. By the
    /// even-odd rule it encloses what the whole ring encloses inside. [Sutherland 1974].
    fn ring(&self, ring: &[Place]) -> Vec<Place> {
        let mut clipped = ring.to_vec();
        for half in &self.0 {
            let whole = std::mem::take(&mut clipped);
            let before = whole.iter().cycle().skip(whole.len().saturating_sub(1));
            for (from, to) in before.zip(&whole) {
                let (begin, end) = (half.room(*from), half.room(*to));
                if (begin >= 0.0) != (end >= 0.0) {
                    clipped.push(between(*from, *to, begin / (begin - end)));
                }
                if end >= 0.0 {
                    clipped.push(*to);
                }
            }
        }
        clipped
    }

    /// The pieces of an outline within the window.
    fn outlines(&self, outline: &Outline) -> Vec<Outline> {
        let mut pieces: Vec<Outline> = Vec::new();
        let first_end = outline.ends.map_or(End::Window, |[first, _]| first);
        let mut goes_on = false;
        for (index, ([from, to], label)) in outline.segments().enumerate() {
            let Some([begin, end]) = self.inside(from, to) else {
                goes_on = false;
                continue;
            };
            if !(goes_on && begin == 0.0) {
                let start = if index == 0 && begin == 0.0 { first_end } else { End::Window };
                let place = between(from, to, begin);
                pieces.push(Outline { places: vec![place], labels: Vec::new(), ends: Some([start, End::Window]) });
            }
            if let Some(piece) = pieces.last_mut() {
                piece.places.push(between(from, to, end));
                piece.labels.push(label);
            }
            goes_on = end == 1.0;
        }
        match (outline.ends, goes_on) {
            // It ends where the whole one does.
            (Some([_, last]), true) => {
                if let Some(ends) = pieces.last_mut().and_then(|piece| piece.ends.as_mut()) {
                    ends[1] = last;
                }
            }
            (None, true) => close(&mut pieces, outline.places[0]),
            _ => {}
        }
        pieces
    }
}

/// Joins the last piece of a closed outline, which ends where that begins, with the first, if that begins there.
fn close(pieces: &mut Vec<Outline>, start: Place) {
    if pieces.first().and_then(|piece| piece.places.first()) != Some(&start) {
        return;
    }
    if let [whole] = pieces.as_mut_slice() {
        whole.places.pop();
        whole.ends = None;
        return;
    }
    if let Some(mut last) = pieces.pop() {
        let first = &mut pieces[0];
        last.places.pop();
        last.places.append(&mut first.places);
        last.labels.append(&mut first.labels);
        *first = last;
    }
}

impl PlaneSection {
    /// The part of the section within `window`.
    #[must_use]
    pub fn within(&self, window: &Window) -> Self {
        Self {
            plane: self.plane,
            outlines: self.outlines.iter().flat_map(|outline| window.outlines(outline)).collect(),
            rings: self.rings.iter().map(|ring| window.ring(ring)).filter(|ring| ring.len() > 2).collect(),
        }
    }
}

fn between(from: Place, to: Place, share: f64) -> Place {
    match share {
        0.0 => from,
        1.0 => to,
        _ => [0, 1].map(|k| from[k] + share * (to[k] - from[k])),
    }
}
