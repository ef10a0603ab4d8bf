//! Drive-end carrier and pinion: the cast nose with its mounting flange, and the gear that meshes with the flywheel.

use glam::{Mat3, Vec2, Vec3};

use super::super::datum::DatumSurface;
use super::super::random::Stream;
use super::super::shape::Shape;
use super::super::solid::{Solid, Step};
use super::parameters::Parameters;
use super::{DETAIL, FASTENER};

/// The carrier: a casting of cone, nose, solenoid seat, flange with ears, and ribs.
pub(super) fn carrier(p: &Parameters, seed: u64) -> Solid {
    let mut s = Stream::new(seed, "carrier");
    let (r, base, length, nose) = (p.yoke_radius, p.yoke_length, p.carrier_length, p.nose_radius);
    let end = p.nose_end();
    let waist = base + length * s.range(0.44, 0.54);
    let mut body = Solid::default();
    body.add(Step::new(Shape::turned(&[
        (0.0, base),
        (r + 2.2, base),
        (r + 2.2, base + 7.0),
        (r * 0.93, base + 12.0),
        (nose + 5.0, waist),
        (nose, waist + 6.0),
        (nose, end - 2.0),
        (nose - 2.0, end),
        (0.0, end),
    ])));

    // Seat of the solenoid and the tunnel of the shift lever.
    let seat = Vec3::new(p.solenoid_offset, 0.0, p.solenoid_top);
    let rs = p.solenoid_radius;
    body.add(
        Step::new(Shape::Cylinder { radius: rs + 2.5, half: 5.0, fillet: 1.5 }).at(seat + Vec3::Z * 5.0).blend(6.0),
    );
    let lever = Vec3::new(nose * 0.3, 0.0, waist);
    body.add(
        Step::new(Shape::Tube { path: vec![seat + Vec3::Z * 3.0 - Vec3::X * rs * 0.25, lever], radius: rs * 0.62 })
            .blend(10.0),
    );

    // Mounting flange: a disc with ears, each with a boss and a hole.
    let thickness = s.range(4.5, 6.5);
    let flange_z = waist + s.range(0.0, 6.0);
    let reach = nose + s.range(26.0, 40.0);
    let flange_radius = nose + s.range(7.0, 13.0);
    body.add(
        Step::new(Shape::Cylinder { radius: flange_radius, half: thickness, fillet: 1.2 })
            .at(Vec3::Z * flange_z)
            .blend(4.0),
    );
    let angles: &[f32] = match s.count(0, 2) {
        0 => &[100.0, -80.0],
        1 => &[75.0, -75.0, 180.0],
        _ => &[140.0, -55.0],
    };
    let top = flange_z + thickness;
    body.datum("carrier base", DatumSurface::upright(Vec3::ZERO, r + 2.2, (base + 0.5, base + 6.5), false));
    body.datum("nose", DatumSurface::upright(Vec3::ZERO, nose, (top + 5.0, end - 3.0), false));
    let bore = if p.overhung { p.tip_radius() + 1.6 } else { 7.0 };
    body.datum("nose face", DatumSurface::ring(Vec3::Z * end, Vec3::Z, (bore + 0.5, nose - 2.5)));
    for (number, angle) in (1..).zip(angles) {
        let turn = Mat3::from_rotation_z((angle + s.range(-8.0, 8.0)).to_radians());
        let ear = |shape, out: f32| Step::new(shape).at(Vec3::Z * flange_z).turned(turn).offset(Vec3::X * out);
        let taper = [
            Vec2::new(0.0, -flange_radius * 0.8),
            Vec2::new(reach, -9.5),
            Vec2::new(reach, 9.5),
            Vec2::new(0.0, flange_radius * 0.8),
        ];
        body.add(ear(Shape::Extruded { outline: taper.to_vec(), half: thickness, fillet: 1.0 }, 0.0).blend(3.0));
        body.add(ear(Shape::Cylinder { radius: 11.5, half: thickness, fillet: 1.0 }, reach).blend(2.0));
        body.add(ear(Shape::Cylinder { radius: 9.8, half: thickness + 1.4, fillet: 0.6 }, reach));
        let hole = s.range(4.6, 6.2);
        body.cut(ear(Shape::Cylinder { radius: hole, half: 30.0, fillet: 0.0 }, reach));
        let (low, high) = (flange_z - thickness - 1.4, top + 1.4);
        let centre = turn * (Vec3::X * reach);
        body.datum(format!("hole {number}"), DatumSurface::upright(centre, hole, (low, high), true));
        body.datum(format!("boss {number}"), DatumSurface::ring(centre.with_z(high), Vec3::Z, (hole + 0.5, 9.8 - 0.8)));
        body.datum(
            format!("ear end {number}"),
            DatumSurface::upright(centre, 11.5, (flange_z - thickness + 1.2, top - 1.2), false),
        );
        // The face of the ear between flange and boss, where that is wide enough.
        let (near, far) = (flange_radius - 1.0, reach - 9.8 - 0.5);
        if far - near > 6.0 {
            let middle = turn * (Vec3::X * 0.5 * (near + far)) + Vec3::Z * top;
            body.datum(
                format!("ear face {number}"),
                DatumSurface::ring(middle, Vec3::Z, (0.0, 0.5 * (far - near) - 0.5)),
            );
        }
        // The flanks of the ear between flange and ear end. Its rounding lies outside the outline.
        for (name, side) in [("left", 1.0), ("right", -1.0)] {
            let (root, tip) = (Vec3::new(0.0, side * flange_radius * 0.8, 0.0), Vec3::new(reach, side * 9.5, 0.0));
            let along = (tip - root).normalize();
            let normal = Vec3::new(-along.y, along.x, 0.0) * side;
            let share = 0.5 * (flange_radius + reach - 10.0) / reach;
            let middle = turn * (root.lerp(tip, share) + normal * 1.0) + Vec3::Z * flange_z;
            body.datum(
                format!("ear {number} {name}"),
                DatumSurface::ring(middle, turn * normal, (0.0, thickness - 1.2)),
            );
        }
    }

    // Ribs between base and flange, left out where the lever tunnel stands.
    let ribs = s.count(5, 9);
    let outline = vec![
        Vec2::new(nose * 0.5, base + 2.0),
        Vec2::new(r * 0.98, base + 2.0),
        Vec2::new(nose + 6.0, flange_z),
        Vec2::new(nose * 0.5, flange_z),
    ];
    let upright = Mat3::from_cols(Vec3::X, Vec3::Z, -Vec3::Y);
    body.add(
        Step::new(Shape::Extruded { outline, half: s.range(1.6, 2.6), fillet: 0.8 })
            .turned(Mat3::from_rotation_z(std::f32::consts::PI / ribs as f32))
            .around(ribs)
            .tilted(upright)
            .blend(3.0),
    );
    // Screws that close the carrier onto the yoke.
    body.add(
        Step::new(Shape::prism(6, 4.2, 2.4, 0.5))
            .at(Vec3::Z * (base + 8.5))
            .turned(Mat3::from_rotation_z(1.3))
            .around(2)
            .offset(Vec3::X * (r - 3.0))
            .slot(FASTENER),
    );

    if p.overhung {
        // The recess from which the pinion comes.
        body.cut(
            Step::new(Shape::Cylinder { radius: p.tip_radius() + 1.6, half: 10.0, fillet: 0.0 })
                .at(Vec3::Z * (end + 3.0)),
        );
    } else {
        // The bore and the window through which the pinion meshes, away from the solenoid; the nose bearing stays.
        let (low, high) = (p.pinion_start() - 6.0, end - 9.0);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        body.cut(Step::new(Shape::Cylinder { radius: p.tip_radius() + 1.4, half, fillet: 1.0 }).at(Vec3::Z * middle));
        let opening = Shape::Block { half: Vec3::new(nose, nose * s.range(0.92, 1.1), half), fillet: 3.0 };
        let turn = Mat3::from_rotation_z(std::f32::consts::PI + s.range(-0.5, 0.5));
        body.cut(Step::new(opening).at(Vec3::Z * middle).turned(turn).offset(Vec3::X * (nose * 1.05)));
        body.cut(Step::new(Shape::Cylinder { radius: 7.0, half: 5.0, fillet: 0.0 }).at(Vec3::Z * (end + 2.0)));
    }
    body
}

/// The pinion on its shaft, with the collar of the overrunning clutch behind it.
pub(super) fn gear(p: &Parameters, seed: u64) -> Solid {
    let mut s = Stream::new(seed, "gear");
    let (m, z) = (p.module, p.pinion_start());
    let (pitch, tip) = (0.5 * m * p.teeth as f32, p.tip_radius());
    let root = pitch - 1.2 * m;
    let half = 0.5 * p.face_width;
    let middle = Vec3::Z * (z + half);
    let mut body = Solid::default();
    body.add(Step::new(Shape::Cylinder { radius: root, half, fillet: 0.6 }).at(middle));
    // Nearly an involute flank of 20 degrees, by three points.
    let w = std::f32::consts::FRAC_PI_4 * m;
    let flank =
        [(root - 1.0, 1.50 * w), (pitch - 0.4 * m, 1.28 * w), (pitch, w), (pitch + 0.6 * m, 0.70 * w), (tip, 0.42 * w)];
    let right = flank.iter().map(|&(x, y)| Vec2::new(x, -y));
    let left = flank.iter().rev().map(|&(x, y)| Vec2::new(x, y));
    let outline = right.chain(left).collect();
    body.add(
        Step::new(Shape::Extruded { outline, half: half - 0.4, fillet: 0.3 })
            .at(middle)
            .turned(Mat3::from_rotation_z(s.range(0.0, 1.0)))
            .around(p.teeth)
            .blend(0.6),
    );
    // Clutch collar behind, stop ring and shaft end before.
    let collar = (root + 1.0).min(p.nose_radius - 3.0);
    body.add(
        Step::new(Shape::Cylinder { radius: collar, half: 5.0, fillet: 0.8 }).at(Vec3::Z * (z - 4.0)).slot(FASTENER),
    );
    let shaft = (root * 0.55).clamp(4.0, 7.0);
    let front = z + p.face_width + s.range(5.0, 9.0);
    body.add(
        Step::new(Shape::Cylinder { radius: shaft, half: 0.5 * (front - z) + 8.0, fillet: 1.2 })
            .at(Vec3::Z * (0.5 * (front + z) - 8.0))
            .slot(FASTENER),
    );
    body.add(
        Step::new(Shape::Cylinder { radius: shaft + 2.2, half: 1.6, fillet: 0.6 })
            .at(Vec3::Z * (z + p.face_width + 1.6))
            .slot(DETAIL),
    );
    body
}
