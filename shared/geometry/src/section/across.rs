//! How thick a section is: from the nearest place of an outline, the way straight across to the next line.

use super::{Place, PlaneSection, distance};

/// A place on an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// The place.
    pub place: Place,
    /// Component class of the segment.
    pub label: u16,
}

/// The way across from one line to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Across {
    /// Its two ends, on outlines.
    pub ends: [Spot; 2],
}

impl Across {
    /// Its length, metres.
    pub fn length(&self) -> f64 {
        distance(self.ends[0].place, self.ends[1].place)
    }
}

impl PlaneSection {
    /// The place of the outlines that is nearest to `place`.
    pub fn nearest(&self, place: Place) -> Option<Spot> {
        let segments = self.outlines.iter().flat_map(|outline| outline.segments());
        let spots = segments.map(|([from, to], label)| Spot { place: foot(place, from, to), label });
        spots.min_by(|a, b| distance(a.place, place).total_cmp(&distance(b.place, place)))
    }

    /// How thick the section is at `place`: from the nearest place of an outline through `place`, which there is the way straight
    /// off the line, on to the next line. `None` where `place` lies on a line, or where no other line lies that way.
    pub fn across(&self, place: Place) -> Option<Across> {
        let near = self.nearest(place)?;
        let way = distance(near.place, place);
        let toward = [0, 1].map(|k| (place[k] - near.place[k]) / way);
        if !toward.iter().all(|c| c.is_finite()) {
            return None;
        }
        let segments = self.outlines.iter().flat_map(|outline| outline.segments());
        let hits = segments.filter_map(|([from, to], label)| Some((ray(place, toward, from, to)?, label)));
        let (far, label) = hits.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let far = Spot { place: [0, 1].map(|k| place[k] + far * toward[k]), label };
        Some(Across { ends: [near, far] })
    }
}

/// The place of a segment that is nearest to `place`.
fn foot(place: Place, from: Place, to: Place) -> Place {
    let along = [to[0] - from[0], to[1] - from[1]];
    let way = (place[0] - from[0]) * along[0] + (place[1] - from[1]) * along[1];
    let share = (way / (along[0] * along[0] + along[1] * along[1])).clamp(0.0, 1.0);
    if share.is_finite() { [0, 1].map(|k| from[k] + share * along[k]) } else { from }
}

/// How far a ray goes until it meets a segment; `None` if it does not.
fn ray(start: Place, toward: Place, from: Place, to: Place) -> Option<f64> {
    // Ends of the segment to either side of the ray; one on it counts as left, so that no gap is between two segments.
    let side = |p: Place| toward[0] * (p[1] - start[1]) - toward[1] * (p[0] - start[0]);
    let (a, b) = (side(from), side(to));
    if (a >= 0.0) == (b >= 0.0) {
        return None;
    }
    let share = a / (a - b);
    let meets = [0, 1].map(|k| from[k] + share * (to[k] - from[k]) - start[k]);
    let way = meets[0] * toward[0] + meets[1] * toward[1];
    (way > 0.0).then_some(way)
}
