//! What the line primitive draws: straight segments of constant width on the screen.

use glam::Vec3;

/// A straight segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// One end, metres, table frame.
    pub from: Vec3,
    /// The other.
    pub to: Vec3,
    /// sRGB and opacity.
    pub color: [u8; 4],
    /// CSS pixels.
    pub width: f32,
}

/// Joins `points` to a line.
pub fn polyline(points: &[Vec3], color: [u8; 4], width: f32) -> impl Iterator<Item = Segment> {
    points.windows(2).map(move |pair| Segment { from: pair[0], to: pair[1], color, width })
}
