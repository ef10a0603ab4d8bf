//! What holds the part: a three-jaw chuck on the turntable. Background to every label.

use glam::{Mat3, Vec3};

use super::super::shape::Shape;
use super::super::solid::{Solid, Step};
use super::FASTENER;

/// Height of the chuck's face above the table's surface in millimetres: the part stands on it.
pub(in super::super) const CHUCK_HEIGHT: f32 = 36.0;
/// Radius of the turntable in millimetres.
pub(in super::super) const TABLE_RADIUS: f32 = 200.0;

/// A chuck whose jaws close on a cylinder of radius `grip`; z = 0 is its face.
pub(in super::super) fn chuck(grip: f32) -> Solid {
    let radius = (grip + 16.0).max(52.0);
    let mut body = Solid::default();
    body.add(Step::new(Shape::turned(&[
        (0.0, -CHUCK_HEIGHT - 2.0),
        (radius + 14.0, -CHUCK_HEIGHT - 2.0),
        (radius + 14.0, -CHUCK_HEIGHT + 7.0),
        (radius + 12.5, -CHUCK_HEIGHT + 8.5),
        (radius, -CHUCK_HEIGHT + 9.0),
        (radius, -2.0),
        (radius - 2.0, 0.0),
        (0.0, 0.0),
    ])));
    body.cut(Step::new(Shape::Torus { major: radius, minor: 1.6 }).at(Vec3::Z * -16.0));
    let turn = Mat3::from_rotation_z(std::f32::consts::FRAC_PI_3);
    let jaw = |half: Vec3, fillet, out: f32, z: f32| {
        Step::new(Shape::Block { half, fillet })
            .at(Vec3::Z * z)
            .turned(turn)
            .around(3)
            .offset(Vec3::X * out)
            .slot(FASTENER)
    };
    body.cut(jaw(Vec3::new(40.0, 5.0, 3.0), 0.3, grip + 34.0, 0.0));
    body.add(jaw(Vec3::new(5.0, 8.0, 9.0), 0.8, grip + 5.0, 9.5));
    body.add(jaw(Vec3::new(9.0, 8.0, 5.0), 0.8, grip + 12.0, 5.0));
    let bolt = Shape::Cylinder { radius: 3.0, half: 1.5, fillet: 0.5 };
    body.cut(Step::new(bolt).at(Vec3::Z * 10.0).turned(turn).around(3).offset(Vec3::X * (grip + 15.5)));
    body.add(
        Step::new(Shape::prism(6, 4.4, 3.0, 0.5))
            .at(Vec3::Z * (-CHUCK_HEIGHT + 9.0))
            .around(6)
            .offset(Vec3::X * (radius + 7.0))
            .slot(FASTENER),
    );
    body
}

/// The turntable's disc with radial T-slots; z = 0 is its surface.
pub(in super::super) fn turntable() -> Solid {
    let mut body = Solid::default();
    body.add(Step::new(Shape::Cylinder { radius: TABLE_RADIUS, half: 12.0, fillet: 2.5 }).at(Vec3::Z * -12.0));
    body.cut(
        Step::new(Shape::Block { half: Vec3::new(70.0, 6.0, 7.0), fillet: 2.0 })
            .around(6)
            .offset(Vec3::X * 160.0)
            .blend(4.0),
    );
    body.cut(Step::new(Shape::Torus { major: TABLE_RADIUS - 14.0, minor: 2.4 }).blend(3.0));
    body
}
