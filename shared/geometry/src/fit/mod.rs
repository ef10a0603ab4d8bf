//! Geometric elements fitted to points of a surface, as coordinate metrology associates them: plane, cylinder, sphere, circle.
//!
//! Each is the least-squares element: the sum of the squared geometric distances is smallest [Forbes 1989, Shakarji 1998].
//! Points of other surfaces are told apart by random samples at the start [Fischler 1981] and by Tukey's biweight afterwards
//! [Beaton 1974]. A fit says how far its points lie from it, how many were used, and the covariance of its parameters: what the
//! residuals say, and what they cannot say ([`SurfaceErrors`]). What the points do not determine is refused with a reason
//! ([`FitError`]), not answered.
//!
//! | module | what |
//! |---|---|
//! | `plane`, `cylinder`, `sphere`, `circle` | one element each: start, distance and its derivatives |
//! | `element` | [`Element`]: any of them, and how a small step of its parameters moves it |
//! | `robust` | the search for the least sum that all share |
//! | `covariance` | how well the parameters are known |
//! | `region` | the points: a region of the mesh that grows from one of its vertices |
//! | `feature` | [`Feature`]: a point or a fitted element, as distances and angles are taken from it |
//! | `relation` | distances, angles and steps between features |
//!
//! Metres and radians; elements are in the frame of the points.

mod circle;
mod covariance;
mod cylinder;
mod draws;
mod element;
mod feature;
mod plane;
mod region;
mod relation;
mod robust;
mod sphere;
#[cfg(test)]
mod tests;

pub use covariance::SurfaceErrors;
pub use element::{Circle, Cylinder, Element, ElementKind, Plane, Sphere};
pub use feature::Feature;
pub use region::{MeshRegions, Region};
pub use relation::{Relation, angle, distance, step_height};

use nalgebra::{Matrix6, Vector3};
use semascan_model::SemanticMesh;

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Where, metres.
    pub position: Vector3<f64>,
    /// Unit normal, outwards; zero where it is not known.
    pub normal: Vector3<f64>,
    /// How much it counts, such as the area that it stands for; its unit does not matter.
    pub weight: f64,
}

impl SurfacePoint {
    /// Vertices of `mesh`, which count alike; those that are not there or not finite are left out.
    pub fn of_vertices(mesh: &SemanticMesh, vertices: &[u32]) -> Vec<Self> {
        let vector = |v: [f32; 3]| Vector3::from(v.map(f64::from));
        let at = |v: &u32| {
            let (position, normal) =
                (mesh.vertices.positions.get(*v as usize)?, mesh.vertices.normals.get(*v as usize)?);
            let position = vector(*position);
            let normal = vector(*normal).try_normalize(0.1).unwrap_or_else(Vector3::zeros);
            position.iter().all(|c| c.is_finite()).then_some(Self { position, normal, weight: 1.0 })
        };
        vertices.iter().filter_map(at).collect()
    }
}

/// A fitted element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// The element.
    pub element: Element,
    /// Root mean square of the distances of the points that were used, metres.
    pub rms: f64,
    /// Largest of these distances, metres.
    pub largest: f64,
    /// Points that were used.
    pub used: usize,
    /// Points that were left out: they do not lie on the element.
    pub left_out: usize,
    /// Covariance of the parameters, in the order and units of [`Element::moved`]; zero behind the last.
    pub covariance: Matrix6<f64>,
}

impl Fit {
    /// Fits an element of this kind.
    ///
    /// * `errors`: what is known beforehand of the errors of the points.
    ///
    /// # Errors
    /// [`FitError`] where the points do not determine it.
    pub fn new(kind: ElementKind, points: &[SurfacePoint], errors: &SurfaceErrors) -> Result<Self, FitError> {
        match kind {
            ElementKind::Plane => plane::fit(points, errors),
            ElementKind::Cylinder => cylinder::fit(points, errors),
            ElementKind::Sphere => sphere::fit(points, errors),
            ElementKind::Circle => circle::fit(points, errors),
        }
    }

    /// Radius with its standard uncertainty, metres; `None` for a plane.
    pub fn radius(&self) -> Option<crate::measure::dimensions::Estimate> {
        let index = self.element.radius_index()?;
        let value = self.element.radius()?;
        Some(crate::measure::dimensions::Estimate {
            value,
            standard_uncertainty: self.covariance[(index, index)].max(0.0).sqrt(),
        })
    }
}

/// Why there is no element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FitError {
    /// There are too few points, or they lie too near to each other for so many parameters.
    #[error("too few points for this element")]
    TooFewPoints,
    /// The points lie on a line, or all at one place.
    #[error("the points lie on a line")]
    Collinear,
    /// The points are a piece so small that its curvature is not known.
    #[error("the arc is too short for a radius")]
    ArcTooShort,
    /// Most points do not lie on any such element.
    #[error("the surface does not have this form")]
    NotThisForm,
}
