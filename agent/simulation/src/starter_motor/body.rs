//! Housing and solenoid: the two steel cans of a starter motor, with seams, screws, bolts, vents and rating plate.

use glam::{Mat3, Vec3};

use super::super::datum::DatumSurface;
use super::super::random::Stream;
use super::super::shape::Shape;
use super::super::solid::{Solid, Step};
use super::parameters::Parameters;
use super::{DETAIL, FASTENER};

/// The yoke with its rear cover.
pub(super) fn housing(p: &Parameters, seed: u64) -> Solid {
    let mut s = Stream::new(seed, "housing");
    let (r, top, cover) = (p.yoke_radius, p.yoke_length, p.cover_height);
    let chamfer = s.range(1.5, 4.0);
    let mut body = Solid::default();
    body.add(Step::new(Shape::turned(&[
        (0.0, cover),
        (r - 1.0, cover),
        (r, cover + 1.0),
        (r, top - 6.0),
        (r + 1.2, top - 5.0),
        (r + 1.2, top),
        (0.0, top),
    ])));
    body.add(Step::new(Shape::turned(&[
        (0.0, 0.0),
        (p.cover_radius - chamfer, 0.0),
        (p.cover_radius, chamfer),
        (p.cover_radius, cover - 1.5),
        (p.cover_radius - 1.2, cover + 0.5),
        (0.0, cover + 0.5),
    ])));
    body.datum("yoke", DatumSurface::upright(Vec3::ZERO, r, (cover + 3.0, top - 8.0), false));
    body.datum("rear cover", DatumSurface::upright(Vec3::ZERO, p.cover_radius, (chamfer + 1.0, cover - 3.0), false));
    body.cut(Step::new(Shape::Torus { major: r.min(p.cover_radius) + 0.6, minor: 1.5 }).at(Vec3::Z * cover));

    // Pole-shoe screws, clear of the solenoid.
    let height = cover + (top - cover) * s.range(0.42, 0.58);
    let rows: &[f32] = if top - cover > 85.0 && s.chance(0.5) { &[-16.0, 16.0] } else { &[0.0] };
    for dz in rows {
        let ring = |shape| {
            let outwards = Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X);
            Step::new(shape)
                .at(Vec3::Z * (height + dz))
                .turned(Mat3::from_rotation_z(std::f32::consts::FRAC_PI_4))
                .around(4)
                .offset(Vec3::X * r)
                .tilted(outwards)
                .slot(FASTENER)
        };
        body.cut(ring(Shape::Cylinder { radius: 8.2, half: 0.9, fillet: 0.3 }));
        body.add(ring(Shape::Cylinder { radius: 6.6, half: 1.6, fillet: 0.8 }).blend(0.4));
        body.cut(
            Step::new(Shape::Block { half: Vec3::new(1.6, 7.0, 1.0), fillet: 0.2 })
                .at(Vec3::Z * (height + dz))
                .turned(Mat3::from_rotation_z(std::f32::consts::FRAC_PI_4))
                .around(4)
                .offset(Vec3::X * (r + 1.8)),
        );
    }

    // Through bolts: along the outside, or only their bosses on the rear cover.
    let outside = s.chance(0.55);
    let bolt_turn = Mat3::from_rotation_z(s.range(1.2, 1.9));
    let bolt = |shape, z: f32, out: f32| {
        Step::new(shape).at(Vec3::Z * z).turned(bolt_turn).around(2).offset(Vec3::X * (r + out))
    };
    let boss_top = cover + 4.0;
    body.add(
        bolt(Shape::Cylinder { radius: 6.2, half: 0.5 * (boss_top - 26.0).max(4.0), fillet: 1.5 }, boss_top - 5.0, 1.0)
            .blend(4.0),
    );
    if outside {
        let half = 0.5 * (top - boss_top);
        body.add(bolt(Shape::Cylinder { radius: 3.0, half, fillet: 0.3 }, boss_top + half, 2.2).slot(FASTENER));
        body.add(bolt(Shape::Cylinder { radius: 5.6, half: 6.0, fillet: 1.0 }, top - 5.0, 1.2).blend(3.0));
    }
    body.add(bolt(Shape::prism(6, 4.6, 3.0, 0.5), boss_top + 1.5, 2.2).slot(FASTENER));

    // Vents around the rear cover.
    if s.chance(0.6) {
        let slots = s.count(6, 10);
        let turn = Mat3::from_rotation_z(s.range(0.0, 1.0));
        let window = Shape::Block { half: Vec3::new(5.0, 2.2, 0.22 * cover), fillet: 1.6 };
        body.cut(
            Step::new(window).at(Vec3::Z * cover * 0.62).turned(turn).around(slots).offset(Vec3::X * p.cover_radius),
        );
    }
    // Stiffening beads or cooling ribs in some makes.
    if s.chance(0.35) {
        for z in [cover + 9.0, top - 13.0] {
            body.add(Step::new(Shape::Torus { major: r - 0.6, minor: 2.2 }).at(Vec3::Z * z).blend(1.5));
        }
    }
    // Rating plate, on the side away from the solenoid.
    let angle = std::f32::consts::PI + s.range(-0.5, 0.5);
    let plate = Shape::Plate {
        radius: r + 0.3,
        half_thickness: 0.7,
        half_angle: s.range(0.30, 0.42),
        half: s.range(8.0, 13.0),
        fillet: 0.4,
    };
    let z = cover + (top - cover) * s.range(0.3, 0.7);
    body.add(Step::new(plate).at(Vec3::Z * z).turned(Mat3::from_rotation_z(angle)).slot(DETAIL));
    body
}

/// The solenoid switch beside the housing; its terminal cap belongs to the electrical connection.
pub(super) fn solenoid(p: &Parameters, seed: u64) -> Solid {
    let mut s = Stream::new(seed, "solenoid");
    let (r, top, bottom) = (p.solenoid_radius, p.solenoid_top, p.solenoid_bottom);
    let axis = Vec3::X * p.solenoid_offset;
    let crimp = s.range(4.0, 7.0);
    let rim = s.range(0.8, 2.0);
    let mut body = Solid::default();
    body.add(
        Step::new(Shape::turned(&[
            (0.0, bottom),
            (r - 1.5, bottom),
            (r + rim - 0.6, bottom + 1.2),
            (r + rim, bottom + 2.0),
            (r + rim, bottom + crimp),
            (r, bottom + crimp + 1.6),
            (r, top - 8.0),
            (r + 1.6, top - 6.5),
            (r + 1.6, top),
            (0.0, top),
        ]))
        .at(axis),
    );
    body.datum("solenoid", DatumSurface::upright(axis, r, (bottom + crimp + 2.6, top - 9.0), false));
    body.datum("solenoid rim", DatumSurface::upright(axis, r + rim, (bottom + 2.5, bottom + crimp - 0.5), false));
    if s.chance(0.5) {
        let groove = bottom + (top - bottom) * s.range(0.35, 0.6);
        body.cut(Step::new(Shape::Torus { major: r + 0.7, minor: 1.7 }).at(axis + Vec3::Z * groove));
    }
    // Lobes and bolts that hold it to the carrier.
    let lobes = s.count(2, 3);
    let turn = Mat3::from_rotation_z(if lobes == 2 { std::f32::consts::FRAC_PI_2 } else { 0.0 });
    let lobe =
        |shape, z: f32| Step::new(shape).at(axis + Vec3::Z * z).turned(turn).around(lobes).offset(Vec3::X * (r + 3.0));
    body.add(lobe(Shape::Cylinder { radius: 6.5, half: 3.5, fillet: 1.0 }, top - 3.5).blend(4.0));
    body.add(lobe(Shape::Cylinder { radius: 5.2, half: 1.0, fillet: 0.3 }, top - 7.6).slot(FASTENER));
    body.add(lobe(Shape::prism(6, 4.1, 2.6, 0.5), top - 10.0).slot(FASTENER));
    // A sticker or stamped field on the outside.
    if s.chance(0.6) {
        let plate = Shape::Plate { radius: r + 0.2, half_thickness: 0.6, half_angle: 0.5, half: 9.0, fillet: 0.3 };
        let turn = Mat3::from_rotation_z(s.range(-0.8, 0.8));
        body.add(Step::new(plate).at(axis + Vec3::Z * (0.5 * (top + bottom))).turned(turn).slot(DETAIL));
    }
    body
}
