//! Datum features of a part: the planes and cylinders that it was built of, as its drawing would name them. They are exact, so
//! they are what measurements on a model of the part are judged by.

use glam::{Affine3A, Vec3};

/// A plane or cylinder that a part was built of.
#[derive(Clone, Debug, PartialEq)]
pub struct Datum {
    /// Its name on the part, such as `yoke`; several of a kind are numbered.
    pub name: String,
    /// Component class.
    pub component: u16,
    /// The surface, table frame, metres.
    pub surface: DatumSurface,
}

/// What a datum feature is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DatumSurface {
    /// A ring of a plane, or a disc.
    Plane {
        /// Middle of the ring.
        middle: [f64; 3],
        /// Unit normal, outwards.
        normal: [f64; 3],
        /// Radius from which on it is free of other surfaces.
        inner: f64,
        /// Radius up to which it is.
        outer: f64,
    },
    /// A cylinder.
    Cylinder {
        /// On the axis, in the middle of the piece that is free of other surfaces.
        middle: [f64; 3],
        /// Unit direction of the axis.
        axis: [f64; 3],
        /// Radius.
        radius: f64,
        /// Half the length of the free piece.
        half: f64,
        /// Whether it is a hole: the material is outside.
        is_hole: bool,
    },
}

impl DatumSurface {
    /// A ring of a plane across z of the part's frame, millimetres.
    pub(super) fn ring(middle: Vec3, normal: Vec3, (inner, outer): (f32, f32)) -> Self {
        Self::Plane { middle: double(middle), normal: double(normal), inner: inner.into(), outer: outer.into() }
    }

    /// A cylinder along z of the part's frame, free from `low` to `high`, millimetres.
    pub(super) fn upright(centre: Vec3, radius: f32, (low, high): (f32, f32), is_hole: bool) -> Self {
        Self::Cylinder {
            middle: double(centre.with_z(0.5 * (low + high))),
            axis: [0.0, 0.0, 1.0],
            radius: radius.into(),
            half: f64::from(0.5 * (high - low)),
            is_hole,
        }
    }

    /// The same in the table frame; `table_from_part` takes millimetres to metres without stretching one axis more than others.
    pub(super) fn placed(&self, table_from_part: &Affine3A) -> Self {
        let scale = f64::from(table_from_part.matrix3.x_axis.length());
        let place = |p: [f64; 3]| double(table_from_part.transform_point3(single(p)));
        let turn = |d: [f64; 3]| double(table_from_part.transform_vector3(single(d)).normalize_or_zero());
        match *self {
            Self::Plane { middle, normal, inner, outer } => {
                Self::Plane { middle: place(middle), normal: turn(normal), inner: inner * scale, outer: outer * scale }
            }
            Self::Cylinder { middle, axis, radius, half, is_hole } => Self::Cylinder {
                middle: place(middle),
                axis: turn(axis),
                radius: radius * scale,
                half: half * scale,
                is_hole,
            },
        }
    }
}

fn double(v: Vec3) -> [f64; 3] {
    v.to_array().map(f64::from)
}

fn single(v: [f64; 3]) -> Vec3 {
    Vec3::from_array(v.map(|c| c as f32))
}
