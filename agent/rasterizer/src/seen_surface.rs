//! The place on the surface that a camera sees at the centre of each pixel: what labels of the surface are projected with.

use crate::camera::Camera;
use crate::scene::Scene;
use crate::visibility::{Hit, Samples};
use rayon::prelude::*;

/// A place on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePlace {
    /// Depth along the optical axis, metres.
    pub depth: f32,
    /// Vertices of the triangle.
    pub corners: [u32; 3],
    /// Their weights at the place, which sum up to 1.
    pub weights: [f32; 3],
    /// Whether the camera looks at the surface from outside.
    pub is_outside: bool,
}

/// What a camera sees of a surface, pixel by pixel.
#[derive(Clone, Debug)]
pub struct SeenSurface {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row-major; `None` where there is no surface.
    pub places: Vec<Option<SurfacePlace>>,
}

impl SeenSurface {
    /// What `camera` sees of `scene`. Triangles that reach behind the camera are left out.
    pub fn of(scene: &Scene<'_>, camera: &Camera) -> Self {
        let samples = Samples::of(scene, camera);
        let (width, height) = (samples.depth.width, samples.depth.height);
        let place = |at: usize| {
            let Hit { triangle, weights, is_outside, .. } = samples.hit(scene, at % width, at / width)?;
            Some(SurfacePlace { depth: samples.depth.depths[at], corners: triangle, weights, is_outside })
        };
        let places = (0..width * height).into_par_iter().map(place).collect();
        Self { width, height, places }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Direction;
    use crate::fixtures::quad;
    use semascan_model::SemanticMesh;

    #[test]
    fn a_pixel_sees_the_nearest_surface_at_its_place() {
        let mut mesh = SemanticMesh::default();
        quad(&mut mesh, [-0.1, -0.1], [0.1, 0.1], 0.0, 1, |_| 0);
        quad(&mut mesh, [-0.05, -0.05], [0.05, 0.05], 0.05, 2, |_| 0);
        let scene = Scene::of_shape(&mesh);
        let camera = Camera::of_all(scene.positions(), Direction::Top.axes(), (90, 70)).expect("points");
        let seen = SeenSurface::of(&scene, &camera);
        let mut places = 0;
        for (at, place) in seen.places.iter().enumerate() {
            let Some(place) = place else { continue };
            places += 1;
            assert!(place.is_outside && (place.weights.iter().sum::<f32>() - 1.0).abs() < 1e-4);
            let point = [0, 1, 2].map(|axis| {
                let of = |k: usize| f64::from(mesh.vertices.positions[place.corners[k] as usize][axis]);
                (0..3).map(|k| f64::from(place.weights[k]) * of(k)).sum::<f64>()
            });
            let (u, v, z) = camera.project(&point).expect("ahead");
            let (x, y) = ((at % seen.width) as f64, (at / seen.width) as f64);
            assert!((u - x).abs() < 0.02 && (v - y).abs() < 0.02, "{u} {v} at {x} {y}");
            assert!((z - f64::from(place.depth)).abs() < 1e-5);
            let label = mesh.vertices.labels[place.corners[0] as usize];
            assert_eq!(label == 2, point[0].abs() < 0.0501 && point[1].abs() < 0.0501, "{point:?}");
        }
        assert!(places > 1000 && places < seen.places.len());
        let below = Camera::of_all(scene.positions(), Direction::Bottom.axes(), (90, 70)).expect("points");
        assert!(SeenSurface::of(&scene, &below).places.iter().flatten().all(|place| !place.is_outside));
    }
}
