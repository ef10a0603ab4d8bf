//! The model as one camera sees it: what a view is registered against (`fuse` renders it, `register` need not know the
//! map).
//!
//! Every pixel keeps the surface point itself, not a depth at the pixel's centre: on a slanted surface half a pixel
//! beside the ray is an error of the order that registration has to remove.

use crate::view::Intrinsics;
use nalgebra::Isometry3;

/// A model that can be looked at: the map, or a reference.
pub trait ModelSurface {
    /// What a camera at `table_from_camera` sees of it.
    fn view(&self, intrinsics: &Intrinsics, table_from_camera: &Isometry3<f64>) -> ModelView;
    /// Distance between neighbouring points, metres.
    fn spacing(&self) -> f64;
    /// Its points whose component class `wanted` agrees to, whoever can see them.
    fn points(&self, wanted: &dyn Fn(u16) -> bool) -> OrientedPoints;
}

/// Points of a surface with normals to its outside, table frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OrientedPoints {
    /// Metres.
    pub points: Vec<[f32; 3]>,
    /// Unit normals; zero where unknown.
    pub normals: Vec<[f32; 3]>,
}

/// The nearest model surface in each pixel of a pinhole camera, row-major.
#[derive(Clone, Debug)]
pub struct ModelView {
    /// The camera it is rendered for; often a coarser picture than the view's.
    pub intrinsics: Intrinsics,
    /// Where that camera is.
    pub table_from_camera: Isometry3<f64>,
    /// Surface points in the camera frame, metres; `[0.0; 3]` where the model shows nothing.
    pub points: Vec<[f32; 3]>,
    /// Unit normals towards the camera, camera frame; zero where unknown.
    pub normals: Vec<[f32; 3]>,
    /// Component classes.
    pub labels: Vec<u16>,
    /// Instances; 0 = not separated.
    pub instances: Vec<u16>,
}
