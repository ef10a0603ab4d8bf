//! The elements, and how a small step of its parameters moves each: the parameters are local, so that no direction is special
//! and none has more numbers than degrees of freedom [Forbes 1989].
//!
//! | element | parameters |
//! |---|---|
//! | plane | way along the normal; turns about the two directions across it |
//! | cylinder | ways across the axis, turns about these (as the way of the axis a metre ahead); radius |
//! | sphere | centre; radius |
//! | circle | centre across and along the normal; turns; radius |

use nalgebra::{Vector3, Vector6};

/// Which element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementKind {
    /// A plane.
    Plane,
    /// A cylinder.
    Cylinder,
    /// A sphere.
    Sphere,
    /// A circle.
    Circle,
}

/// A plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The middle of the points that it was fitted to, metres.
    pub point: Vector3<f64>,
    /// Unit normal, to the side that the normals of the points show.
    pub normal: Vector3<f64>,
}

/// A cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// On the axis, in the middle of the points that it was fitted to, metres.
    pub point: Vector3<f64>,
    /// Unit direction of the axis; of the two the one whose largest coordinate is positive.
    pub axis: Vector3<f64>,
    /// Radius, metres.
    pub radius: f64,
}

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre, metres.
    pub centre: Vector3<f64>,
    /// Radius, metres.
    pub radius: f64,
}

/// A circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Centre, metres.
    pub centre: Vector3<f64>,
    /// Unit normal of its plane.
    pub normal: Vector3<f64>,
    /// Radius, metres.
    pub radius: f64,
}

/// An element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Element {
    /// A plane.
    Plane(Plane),
    /// A cylinder.
    Cylinder(Cylinder),
    /// A sphere.
    Sphere(Sphere),
    /// A circle.
    Circle(Circle),
}

impl Element {
    /// The element after a step of its parameters, those of the table of this module, metres and radians.
    #[must_use]
    pub fn moved(&self, step: &Vector6<f64>) -> Self {
        match *self {
            Self::Plane(Plane { point, normal }) => {
                let (u, v) = across(normal);
                Self::Plane(Plane {
                    point: point + normal * step[0],
                    normal: (normal + u * step[1] + v * step[2]).normalize(),
                })
            }
            Self::Cylinder(Cylinder { point, axis, radius }) => {
                let (u, v) = across(axis);
                Self::Cylinder(Cylinder {
                    point: point + u * step[0] + v * step[1],
                    axis: (axis + u * step[2] + v * step[3]).normalize(),
                    radius: radius + step[4],
                })
            }
            Self::Sphere(Sphere { centre, radius }) => {
                Self::Sphere(Sphere { centre: centre + step.fixed_rows::<3>(0), radius: radius + step[3] })
            }
            Self::Circle(Circle { centre, normal, radius }) => {
                let (u, v) = across(normal);
                Self::Circle(Circle {
                    centre: centre + u * step[0] + v * step[1] + normal * step[2],
                    normal: (normal + u * step[3] + v * step[4]).normalize(),
                    radius: radius + step[5],
                })
            }
        }
    }

    /// Normal of a plane or circle, axis of a cylinder; `None` for a sphere.
    pub fn direction(&self) -> Option<Vector3<f64>> {
        match self {
            Self::Plane(plane) => Some(plane.normal),
            Self::Cylinder(cylinder) => Some(cylinder.axis),
            Self::Sphere(_) => None,
            Self::Circle(circle) => Some(circle.normal),
        }
    }

    /// Its middle, metres: a point of the plane, of the axis, or the centre.
    pub fn middle(&self) -> Vector3<f64> {
        match self {
            Self::Plane(plane) => plane.point,
            Self::Cylinder(cylinder) => cylinder.point,
            Self::Sphere(sphere) => sphere.centre,
            Self::Circle(circle) => circle.centre,
        }
    }

    /// Radius, metres; `None` for a plane.
    pub fn radius(&self) -> Option<f64> {
        match self {
            Self::Plane(_) => None,
            Self::Cylinder(cylinder) => Some(cylinder.radius),
            Self::Sphere(sphere) => Some(sphere.radius),
            Self::Circle(circle) => Some(circle.radius),
        }
    }

    /// Signed distance of a point of space from its surface, positive outside (before a plane), metres. Of a circle: the
    /// distance from its line.
    pub fn distance(&self, point: &Vector3<f64>) -> f64 {
        match self {
            Self::Plane(plane) => (point - plane.point).dot(&plane.normal),
            Self::Cylinder(Cylinder { point: on_axis, axis, radius }) => {
                let from = point - on_axis;
                (from - axis * axis.dot(&from)).norm() - radius
            }
            Self::Sphere(sphere) => (point - sphere.centre).norm() - sphere.radius,
            Self::Circle(Circle { centre, normal, radius }) => {
                let from = point - centre;
                let height = normal.dot(&from);
                ((from - normal * height).norm() - radius).hypot(height)
            }
        }
    }

    /// Unit normal of its surface at the foot of a point, away from axis or centre; `None` on these, and for a circle.
    pub fn normal_at(&self, point: &Vector3<f64>) -> Option<Vector3<f64>> {
        match self {
            Self::Plane(plane) => Some(plane.normal),
            Self::Cylinder(Cylinder { point: on_axis, axis, .. }) => {
                let from = point - on_axis;
                (from - axis * axis.dot(&from)).try_normalize(f64::EPSILON)
            }
            Self::Sphere(sphere) => (point - sphere.centre).try_normalize(f64::EPSILON),
            Self::Circle(_) => None,
        }
    }

    /// Number of the radius among the parameters.
    pub(super) fn radius_index(&self) -> Option<usize> {
        match self {
            Self::Plane(_) => None,
            Self::Cylinder(_) => Some(4),
            Self::Sphere(_) => Some(3),
            Self::Circle(_) => Some(5),
        }
    }
}

/// Two unit vectors across a unit `direction` and each other.
pub(super) fn across(direction: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let least = direction.iamin();
    let mut other = Vector3::zeros();
    other[least] = 1.0;
    let u = direction.cross(&other).normalize();
    (u, direction.cross(&u))
}

/// Of a direction and its opposite the one whose largest coordinate is positive.
pub(super) fn oriented(direction: Vector3<f64>) -> Vector3<f64> {
    if direction[direction.iamax()] < 0.0 { -direction } else { direction }
}
