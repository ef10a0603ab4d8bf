//! What distances and angles are taken from: a point, or a fitted element.

use super::Fit;
use super::element::Element;
use nalgebra::{Matrix6, Vector3, Vector6};

/// A point of the surface or a fitted element, with the covariance of its parameters.
#[expect(clippy::large_enum_variant, reason = "there are two at a time")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feature {
    /// A point.
    Point {
        /// Where, metres.
        position: Vector3<f64>,
        /// Standard uncertainty of each of its coordinates, metres.
        uncertainty: f64,
    },
    /// A fitted element.
    Fitted(Fit),
}

impl Feature {
    /// A point in metres; `uncertainty` is the standard one of each of its coordinates.
    pub fn point(position: [f64; 3], uncertainty: f64) -> Self {
        Self::Point { position: position.into(), uncertainty }
    }

    /// Covariance of the parameters of [`Self::moved`]; zero behind the last.
    pub fn covariance(&self) -> Matrix6<f64> {
        match self {
            Self::Point { uncertainty, .. } => {
                let variance = uncertainty * uncertainty;
                Matrix6::from_diagonal(&Vector6::new(variance, variance, variance, 0.0, 0.0, 0.0))
            }
            Self::Fitted(fit) => fit.covariance,
        }
    }

    /// After a step of its parameters: the coordinates of a point, those of the element.
    #[must_use]
    pub fn moved(&self, step: &Vector6<f64>) -> Self {
        match *self {
            Self::Point { position, uncertainty } => {
                Self::Point { position: position + step.fixed_rows::<3>(0), uncertainty }
            }
            Self::Fitted(fit) => Self::Fitted(Fit { element: fit.element.moved(step), ..fit }),
        }
    }

    /// Its middle, metres.
    pub fn middle(&self) -> Vector3<f64> {
        match self {
            Self::Point { position, .. } => *position,
            Self::Fitted(fit) => fit.element.middle(),
        }
    }

    /// Normal or axis; `None` where it has none.
    pub fn direction(&self) -> Option<Vector3<f64>> {
        match self {
            Self::Point { .. } => None,
            Self::Fitted(fit) => fit.element.direction(),
        }
    }

    /// As what it counts for a distance.
    pub(super) fn locus(&self) -> Locus {
        match self {
            Self::Fitted(Fit { element: Element::Plane(plane), .. }) => Locus::Plane(plane.point, plane.normal),
            Self::Fitted(Fit { element: Element::Cylinder(cylinder), .. }) => {
                Locus::Line(cylinder.point, cylinder.axis)
            }
            feature => Locus::Point(feature.middle()),
        }
    }
}

/// A point, a line with its direction, or a plane with its normal.
#[derive(Clone, Copy, Debug)]
pub(super) enum Locus {
    Point(Vector3<f64>),
    Line(Vector3<f64>, Vector3<f64>),
    Plane(Vector3<f64>, Vector3<f64>),
}
