//! The electrical connection: terminal cap, studs with nuts and lugs, control plug, and the cable to the field coils.

use glam::{Mat3, Vec3};

use super::super::datum::DatumSurface;
use super::super::random::Stream;
use super::super::shape::Shape;
use super::super::solid::{Solid, Step};
use super::parameters::Parameters;
use super::{DETAIL, FASTENER};

/// Everything that carries current outside the cans.
pub(super) fn electrical(p: &Parameters, seed: u64) -> Solid {
    let mut s = Stream::new(seed, "electrical");
    let bottom = p.solenoid_bottom;
    let axis = Vec3::X * p.solenoid_offset;
    let (radius, height) = (p.solenoid_radius - s.range(1.0, 2.5), s.range(9.0, 14.0));
    let face = bottom - height;
    let mut body = Solid::default();
    body.add(
        Step::new(Shape::Cylinder { radius, half: 0.5 * height + 1.0, fillet: 2.0 })
            .at(axis + Vec3::Z * (bottom - 0.5 * height + 1.0)),
    );
    body.datum("terminal cap", DatumSurface::upright(axis, radius, (face + 2.5, bottom - 0.5), false));
    // A wall between the studs, as moulded caps have.
    body.add(
        Step::new(Shape::Block { half: Vec3::new(radius * 0.7, 1.3, 3.0), fillet: 0.8 })
            .at(axis + Vec3::Z * (face - 2.0))
            .blend(1.5),
    );

    let spread = radius * s.range(0.46, 0.56);
    let studs = [axis + Vec3::Y * spread, axis - Vec3::Y * spread];
    let length = s.range(17.0, 23.0);
    for (number, stud) in (1..).zip(studs) {
        body.datum(
            format!("stud {number}"),
            DatumSurface::upright(stud, 3.9, (face - length + 1.0, face - 12.0), false),
        );
        let on = |shape, z: f32| Step::new(shape).at(stud + Vec3::Z * z);
        body.add(on(Shape::Cylinder { radius: 6.8, half: 2.0, fillet: 0.6 }, face - 1.0).blend(1.0));
        body.add(
            on(Shape::Cylinder { radius: 3.9, half: 0.5 * length, fillet: 0.8 }, face - 0.5 * length).slot(FASTENER),
        );
        body.add(on(Shape::Cylinder { radius: 7.6, half: 0.9, fillet: 0.3 }, face - 4.0).slot(FASTENER));
        body.add(on(Shape::prism(6, 6.4, 3.1, 0.5), face - 8.6).slot(FASTENER));
    }

    // The cable from one stud's lug to a grommet in the yoke.
    let side = if s.chance(0.5) { 1.0 } else { -1.0 };
    let stud = if side > 0.0 { studs[0] } else { studs[1] };
    let cable = s.range(3.6, 5.2);
    let lug = stud + Vec3::Z * (face - 5.8);
    body.add(Step::new(Shape::Cylinder { radius: 8.2, half: 1.1, fillet: 0.4 }).at(lug).slot(FASTENER));
    let angle = side * s.range(42.0_f32, 62.0).to_radians();
    let outwards = Vec3::new(angle.cos(), angle.sin(), 0.0);
    let entry_z = p.cover_height + s.range(8.0, 14.0);
    let entry = outwards * p.yoke_radius + Vec3::Z * entry_z;
    let bulge = Vec3::Y * side * s.range(10.0, 20.0);
    let path = bezier([
        lug + Vec3::Y * side * 6.0,
        lug + Vec3::Y * side * 18.0 + bulge * 0.4 - Vec3::X * 6.0,
        entry + outwards * 26.0 + bulge * 0.4,
        entry - outwards * 3.0,
    ]);
    body.add(Step::new(Shape::Tube { path, radius: cable }).slot(DETAIL).blend(1.0));
    let sleeve = vec![entry - outwards * 4.0, entry + outwards * 5.0];
    body.add(Step::new(Shape::Tube { path: sleeve, radius: cable + 2.4 }).slot(DETAIL).blend(2.0));

    // Battery cable left on the other stud, cut off, in some cores.
    if s.chance(0.45) {
        let other = if side > 0.0 { studs[1] } else { studs[0] } + Vec3::Z * (face - 5.8);
        body.add(Step::new(Shape::Cylinder { radius: 9.0, half: 1.2, fillet: 0.4 }).at(other).slot(FASTENER));
        let away = (Vec3::X * s.range(0.2, 1.0) - Vec3::Y * side).normalize();
        let path = bezier([
            other + away * 7.0,
            other + away * 18.0,
            other + away * 26.0 + Vec3::Z * s.range(0.0, 8.0),
            other + away * s.range(30.0, 44.0) + Vec3::Z * s.range(4.0, 14.0),
        ]);
        body.add(Step::new(Shape::Tube { path, radius: cable + 1.0 }).slot(DETAIL).blend(1.0));
    }

    // Control plug on the outer side of the cap.
    let turn = Mat3::from_rotation_z(s.range(-0.5, 0.5));
    let plug = |shape, out: f32, z: f32| Step::new(shape).at(axis + Vec3::Z * z).turned(turn).offset(Vec3::X * out);
    let middle = bottom - 0.5 * height - 1.0;
    body.add(
        plug(Shape::Block { half: Vec3::new(8.0, 7.0, 5.0), fillet: 1.2 }, radius + 4.0, middle)
            .blend(1.5)
            .slot(DETAIL),
    );
    body.cut(plug(Shape::Block { half: Vec3::new(6.0, 5.2, 3.2), fillet: 0.6 }, radius + 8.5, middle));
    body.add(plug(Shape::Block { half: Vec3::new(5.5, 2.6, 0.7), fillet: 0.2 }, radius + 5.0, middle).slot(FASTENER));
    body
}

/// Points along a cubic Bezier curve.
fn bezier(c: [Vec3; 4]) -> Vec<Vec3> {
    (0..=12)
        .map(|i| {
            let t = i as f32 / 12.0;
            let u = 1.0 - t;
            c[0] * (u * u * u) + c[1] * (3.0 * u * u * t) + c[2] * (3.0 * u * t * t) + c[3] * (t * t * t)
        })
        .collect()
}
