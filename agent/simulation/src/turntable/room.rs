//! What stands still about a simulated turntable: the table that it stands on, a wall and things on the table.

use glam::{Mat3, Vec3};

use super::parts::Solids;
use crate::appearance::Finish;
use crate::part::Tag;
use crate::random::Stream;

/// How far below the disc's upper side the table is, millimetres.
pub(super) const TABLE: f32 = -25.0;

/// The room in the static turntable frame, with the camera on the side of -x; the tags' finishes are those that are
/// returned.
pub(super) fn build(s: &mut Stream, disc_radius: f32) -> (Solids, Vec<Finish>) {
    let mut out = Solids::default();
    let mut finishes = Vec::new();
    let mut finish = |s: &mut Stream, mottling: f32| {
        let colour = Vec3::new(s.range(0.08, 0.5), s.range(0.08, 0.45), s.range(0.06, 0.4));
        finishes.push(Finish::mottled(colour, mottling, s.word()));
        Tag { finish: finishes.len() as u16 - 1, ..Tag::default() }
    };
    let still = (Mat3::IDENTITY, Vec3::ZERO);
    let table = finish(s, 0.5);
    out.add_box(Vec3::new(-700.0, -700.0, TABLE - 20.0), Vec3::new(620.0, 700.0, TABLE), still.0, still.1, table);
    let wall = finish(s, 0.35);
    let back = s.range(380.0, 600.0);
    out.add_box(Vec3::new(back, -1500.0, -400.0), Vec3::new(back + 20.0, 1500.0, 1300.0), still.0, still.1, wall);
    for side in [-1.0_f32, 1.0, 1.0] {
        let tag = finish(s, 0.45);
        let (x, y) = (s.range(40.0, 260.0), side * (disc_radius + s.range(70.0, 160.0)));
        let size = Vec3::new(s.range(25.0, 60.0), s.range(25.0, 55.0), s.range(40.0, 140.0));
        let turn = Mat3::from_rotation_z(s.range(0.0, 3.0));
        let shift = Vec3::new(x, y, TABLE);
        out.add_box(-size * Vec3::new(1.0, 1.0, 0.0), size, turn, shift, tag);
    }
    (out, finishes)
}
