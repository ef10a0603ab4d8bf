//! Thicknesses and distances that are read in a section.
//!
//! On an outline the pointer is at a place of it, and two such places make a distance. Elsewhere it is between lines: from the
//! nearest place of an outline straight across, through the pointer, to the next line. That is a wall's thickness inside, and a
//! gap outside.

use super::Shown;
use crate::display::Cut;
use crate::words::t;
use glam::{DVec3, Vec3};
use semascan_geometry::measure::dimensions::{self, Estimate};
use semascan_geometry::section::Spot;

/// How near the pointer must be to an outline to be on it, CSS pixels.
const REACH: f32 = 7.0;

/// A line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the eye is, metres, table frame.
    pub eye: Vec3,
    /// The way from there to what lies one metre ahead along the camera's direction of view.
    pub toward: Vec3,
    /// Size of a CSS pixel there, metres.
    pub pixel: f32,
}

/// What the pointer is at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// An outline.
    Outline(End),
    /// Between two lines.
    Across([End; 2]),
}

/// An end of a reading: a place on an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// Metres, table frame.
    pub place: [f64; 3],
    /// Component class there.
    pub label: u16,
}

/// What was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadingKind {
    /// The way across from a line to the next.
    Thickness,
    /// The distance of two places on outlines.
    Distance,
}

impl ReadingKind {
    /// Stable name for tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::Thickness => "thickness",
            Self::Distance => "distance",
        }
    }

    /// Its name.
    pub fn label(self) -> &'static str {
        match self {
            Self::Thickness => t!("section.thickness"),
            Self::Distance => t!("section.distance"),
        }
    }
}

/// One reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Its number.
    pub number: u32,
    /// What was read.
    pub kind: ReadingKind,
    /// Its ends.
    pub ends: [End; 2],
    /// Voxel edge of the model, metres.
    pub voxel: f64,
}

impl Reading {
    /// The figure, metres, with the uncertainty of two points of the surface.
    pub fn estimate(&self) -> Estimate {
        let [a, b] = self.ends.map(|end| end.place);
        dimensions::distance(a, b, dimensions::grid_uncertainty(self.voxel))
    }

    /// Half way between its ends, metres, table frame.
    pub fn middle(&self) -> [f32; 3] {
        let [a, b] = self.ends.map(|end| end.place);
        [0, 1, 2].map(|k| (0.5 * (a[k] + b[k])) as f32)
    }
}

/// What a ray is at in a section; `None` where it does not meet the plane from its open side or nothing is there.
pub(super) fn aim(shown: &Shown, cut: &Cut, ray: &Ray) -> Option<Aim> {
    if !cut.opens_toward(ray.eye.into()) {
        return None;
    }
    let plane = &shown.section.plane;
    let (eye, toward) = (ray.eye.as_dvec3(), ray.toward.as_dvec3());
    let place = plane.hit(eye.into(), toward.into())?;
    let ahead = (DVec3::from(plane.lift(place)) - eye).length() / toward.length();
    let end = |spot: Spot| End { place: plane.lift(spot.place), label: spot.label };
    let near = shown.section.nearest(place)?;
    let away = (near.place[0] - place[0]).hypot(near.place[1] - place[1]);
    if away <= f64::from(REACH * ray.pixel) * ahead {
        return Some(Aim::Outline(end(near)));
    }
    shown.section.across(place).map(|across| Aim::Across(across.ends.map(end)))
}
