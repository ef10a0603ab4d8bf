//! Plane sections of a mesh: the curves in which a plane meets the surface, what they enclose, and how thick that is.
//!
//! | module | what |
//! |---|---|
//! | `plane` | [`Plane`], with two axes of its own |
//! | `cut` | [`PlaneSection::of`]: triangles to segments, segments to [`Outline`]s |
//! | `window` | [`Window`]: a section within a box |
//! | `fill` | [`fill`]: what closed outlines enclose, by the even-odd rule |
//! | `across` | the nearest place of an outline, and the way across from there |
//!
//! A scanned surface has rims, and an outline that runs into one is open. It stays open: it encloses nothing, and its ends say
//! where the surface was not seen.

mod across;
mod cut;
mod fill;
mod plane;
#[cfg(test)]
mod tests;
mod window;

pub use across::{Across, Spot};
pub use fill::{Quad, area, fill};
pub use plane::Plane;
pub use window::Window;

/// A place on a plane: metres along the plane's two axes, see [`Plane::lift`].
pub type Place = [f64; 2];

/// How an open outline ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// At a rim of the surface: what lies beyond was not seen.
    Rim,
    /// At the edge of a [`Window`]: it goes on outside.
    Window,
}

/// A line in which the plane meets the surface. Seen from where the plane's normal points, what the surface encloses lies to
/// its left.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Its places, each once: of a closed line the last is joined with the first.
    pub places: Vec<Place>,
    /// Component class of each segment, from a place to the next.
    pub labels: Vec<u16>,
    /// How it begins and ends; `None` if it is closed.
    pub ends: Option<[End; 2]>,
}

impl Outline {
    /// Its segments with their classes.
    pub fn segments(&self) -> impl Iterator<Item = ([Place; 2], u16)> {
        let next = self.places.iter().cycle().skip(1);
        self.places.iter().zip(next).zip(&self.labels).map(|((from, to), label)| ([*from, *to], *label))
    }

    /// Length in metres.
    pub fn length(&self) -> f64 {
        self.segments().map(|([from, to], _)| distance(from, to)).sum()
    }

    /// Whether it is closed.
    pub fn is_closed(&self) -> bool {
        self.ends.is_none()
    }

    /// Places at which the surface ends.
    pub fn rims(&self) -> impl Iterator<Item = Place> {
        let [first, last] = [self.places.first(), self.places.last()].map(Option::<&Place>::copied);
        let ends = self.ends.into_iter().flat_map(move |ends| ends.into_iter().zip([first, last]));
        ends.filter_map(|(end, place)| place.filter(|_| end == End::Rim))
    }
}

/// A plane section of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneSection {
    /// The plane.
    pub plane: Plane,
    /// The lines in which it meets the surface, in the order of the mesh's triangles.
    pub outlines: Vec<Outline>,
    /// What is enclosed: rings, of which those of holes lie in others. The closed outlines, within the window if there is one.
    pub rings: Vec<Vec<Place>>,
}

impl PlaneSection {
    /// Length of all outlines, metres.
    pub fn length(&self) -> f64 {
        self.outlines.iter().map(Outline::length).sum()
    }

    /// How many outlines run into a rim.
    pub fn open(&self) -> usize {
        self.outlines.iter().filter(|outline| outline.rims().next().is_some()).count()
    }
}

fn distance(a: Place, b: Place) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}
