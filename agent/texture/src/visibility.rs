//! What of the surface a photograph shows: what lies in the picture, before the rest of the surface, and before everything
//! that was measured in its place (a hand, the chuck).
//!
//! Poses, depths and the mesh are a little off. So what lies beside something nearer in the picture is taken for hidden, too:
//! else the rim of what stands before it would be painted onto it.

use crate::photograph::{Photograph, project};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use semascan_geometry::sight::{LEAST_COSINE, pixels_per_metre};
use semascan_perception::view::Intrinsics;
use semascan_rasterizer::{Camera, Scene, depths};

/// Pixels beside a place that nothing nearer may lie in: of the rendered surface, and of what was measured, whose rims are ragged.
const RIM: usize = 2;
const MEASURED_RIM: usize = 1;
/// Pixels along the surface by which depths may differ: of the surface itself, of something else beside it, and of what was
/// measured.
const OWN: f64 = 2.0;
const OTHER: f64 = 5.0;
const MEASURED: f64 = 8.0;
/// Pixels along the edge of the picture that are not used.
const MARGIN: f64 = 2.0;
/// Pixels between the places of a face that are looked at.
const STEP: f64 = 6.0;
/// Most steps along a side.
const MOST_STEPS: usize = 24;
/// Corners are looked at this far within the face.
const INWARDS: f64 = 0.1;

/// A photograph, ready to say what it shows.
pub(crate) struct Visibility {
    intrinsics: Intrinsics,
    camera_from_table: Isometry3<f64>,
    eye: Point3<f64>,
    /// Depth of the rendered surface at each pixel; infinite where there is none.
    depths: Vec<f32>,
    /// The nearest and the farthest within [`RIM`].
    nearest: Vec<f32>,
    farthest: Vec<f32>,
    /// The nearest that was measured within [`MEASURED_RIM`]; infinite where nothing was.
    measured: Vec<f32>,
}

/// How a photograph shows a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// Column and row.
    pub(crate) pixel: [f64; 2],
    /// Pixels on a square metre of the surface.
    pub(crate) resolution: f64,
    /// Whether something much farther lies beside it in the picture, which may shine through.
    pub(crate) is_at_rim: bool,
}

impl Visibility {
    pub(crate) fn of(scene: &Scene<'_>, photograph: &Photograph<'_>) -> Self {
        let Photograph { intrinsics, table_from_camera, .. } = *photograph;
        let size = (intrinsics.width as usize, intrinsics.height as usize);
        let depths = depths(scene, &Camera { intrinsics, table_from_camera }).depths;
        let measured: Vec<f32> = photograph.depth.iter().map(|d| if *d > 0.0 { *d } else { f32::INFINITY }).collect();
        Self {
            intrinsics,
            camera_from_table: table_from_camera.inverse(),
            eye: Point3::from(table_from_camera.translation.vector),
            nearest: around(&depths, size, RIM, f32::min),
            farthest: around(&depths, size, RIM, f32::max),
            measured: around(&measured, size, MEASURED_RIM, f32::min),
            depths,
        }
    }

    /// Depth of the rendered surface at each pixel; infinite where there is none.
    pub(crate) fn depths(&self) -> &[f32] {
        &self.depths
    }

    /// How the photograph shows a face with these corners and this normal, if it shows all of it.
    pub(crate) fn face(&self, corners: [Point3<f64>; 3], normal: &Vector3<f64>) -> Option<Seen> {
        let [a, b, c] = corners;
        let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        let mut seen = self.place(&middle, normal)?;
        let pixels = [self.project(&a)?, self.project(&b)?, self.project(&c)?];
        let longest = (0..3).map(|k| {
            let (p, q) = (pixels[k], pixels[(k + 1) % 3]);
            (p.0 - q.0).hypot(p.1 - q.1)
        });
        let steps = ((longest.fold(0.0, f64::max) / STEP).ceil() as usize).clamp(1, MOST_STEPS);
        for i in 0..=steps {
            for j in 0..=steps - i {
                let share = |k: usize| (1.0 - INWARDS) * k as f64 / steps as f64 + INWARDS / 3.0;
                let (u, v) = (share(i), share(j));
                let place = Point3::from(a.coords * (1.0 - u - v) + b.coords * u + c.coords * v);
                seen.is_at_rim |= self.place(&place, normal)?.is_at_rim;
            }
        }
        Some(seen)
    }

    /// Column, row and depth of a point; `None` behind the camera.
    pub(crate) fn project(&self, point: &Point3<f64>) -> Option<(f64, f64, f64)> {
        project(&self.intrinsics, &self.camera_from_table, point)
    }

    /// How the photograph shows a place of the surface.
    fn place(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> Option<Seen> {
        let Intrinsics { width, height, fx, fy, .. } = self.intrinsics;
        let cosine = (self.eye - point).try_normalize(0.0)?.dot(normal);
        let (u, v, z) = self.project(point)?;
        let pixels = pixels_per_metre([fx, fy], cosine, z)?;
        let inside = |c: f64, size: u32| c >= MARGIN && c <= f64::from(size) - 1.0 - MARGIN;
        if !inside(u, width) || !inside(v, height) {
            return None;
        }
        let at = self.intrinsics.pixel(u, v)?;
        // A pixel beside it on the same surface lies deeper by the tangent of the incidence.
        let cosine = cosine.max(LEAST_COSINE);
        let tangent = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
        let footprint = self.intrinsics.footprint(z);
        let lies_before = |depth: f32, pixels: f64, beside: usize| {
            f64::from(depth) < z - footprint * (pixels + tangent * (beside as f64 + 0.5) * std::f64::consts::SQRT_2)
        };
        if lies_before(self.depths[at], OWN, 0)
            || lies_before(self.nearest[at], OTHER, RIM)
            || lies_before(self.measured[at], MEASURED, MEASURED_RIM)
        {
            return None;
        }
        let beyond = z + footprint * (OTHER + tangent * (RIM as f64 + 0.5) * std::f64::consts::SQRT_2);
        let is_at_rim = f64::from(self.farthest[at]) > beyond;
        Some(Seen { pixel: [u, v], resolution: pixels * pixels, is_at_rim })
    }
}

/// The least or greatest value within `reach` pixels along rows and columns.
fn around(values: &[f32], (width, height): (usize, usize), reach: usize, better: fn(f32, f32) -> f32) -> Vec<f32> {
    let window = |at: usize, size: usize| at.saturating_sub(reach)..(at + reach + 1).min(size);
    let mut along_rows = vec![0.0_f32; values.len()];
    along_rows.par_chunks_mut(width.max(1)).zip(values.par_chunks(width.max(1))).for_each(|(out, row)| {
        for (x, value) in out.iter_mut().enumerate() {
            *value = row[window(x, width)].iter().copied().fold(row[x], better);
        }
    });
    let mut all = vec![0.0_f32; values.len()];
    all.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, out)| {
        for (x, value) in out.iter_mut().enumerate() {
            let column = window(y, height).map(|row| along_rows[row * width + x]);
            *value = column.fold(along_rows[y * width + x], better);
        }
    });
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{camera_above, quad};
    use semascan_model::SemanticMesh;

    #[test]
    fn what_something_nearer_hides_is_not_seen_nor_what_lies_close_beside_it() {
        let mut mesh = SemanticMesh::default();
        quad(&mut mesh, [-0.1, -0.1], [0.1, 0.1], 0.0);
        quad(&mut mesh, [0.0, -0.1], [0.1, 0.1], 0.05);
        let scene = Scene::of_shape(&mesh);
        let mut photograph = camera_above([0.0, 0.0], 0.5, |_, _| [90; 3]);
        let up = Vector3::z();
        let seen = |v: &Visibility, x: f64, z: f64| v.place(&Point3::new(x, 0.01, z), &up);
        let visibility = Visibility::of(&scene, &photograph);
        assert!(seen(&visibility, 0.05, 0.0).is_none(), "below the roof");
        assert!(seen(&visibility, 0.05, 0.05).is_some_and(|seen| !seen.is_at_rim));
        let footprint = photograph.intrinsics.footprint(0.5);
        // From above its middle the camera sees the roof's edge where it is.
        assert!(seen(&visibility, -footprint, 0.0).is_none(), "a pixel beside the roof's rim");
        assert!(seen(&visibility, -5.0 * footprint, 0.0).is_some_and(|seen| !seen.is_at_rim));
        assert!(seen(&visibility, footprint, 0.05).is_some_and(|seen| seen.is_at_rim), "the floor may shine through");
        assert!(visibility.place(&Point3::new(-0.05, 0.01, 0.0), &-up).is_none(), "from behind");
        assert!(seen(&visibility, -5.0, 0.0).is_none(), "beyond the picture");
        let resolution = seen(&visibility, -0.05, 0.0).map(|seen| seen.resolution.sqrt() * footprint);
        assert!(resolution.is_some_and(|r| (0.95..1.0).contains(&r)), "{resolution:?}: nearly straight");

        // A hand that only the depth camera knows of.
        let (u, v, _) = visibility.project(&Point3::new(-0.05, 0.01, 0.0)).expect("ahead");
        let at = photograph.intrinsics.pixel(u, v).expect("inside");
        photograph.depth.to_mut()[at] = 0.3;
        let visibility = Visibility::of(&scene, &photograph);
        assert!(seen(&visibility, -0.05, 0.0).is_none() && seen(&visibility, -0.06, 0.0).is_some());
    }

    #[test]
    fn a_face_is_shown_whole_or_not() {
        let mut mesh = SemanticMesh::default();
        quad(&mut mesh, [-0.1, -0.1], [0.1, 0.1], 0.0);
        quad(&mut mesh, [-0.01, -0.01], [0.01, 0.01], 0.05);
        let scene = Scene::of_shape(&mesh);
        let visibility = Visibility::of(&scene, &camera_above([0.0, 0.0], 0.5, |_, _| [90; 3]));
        let face = |low: f64, high: f64| {
            let corners = [Point3::new(low, low, 0.0), Point3::new(high, low, 0.0), Point3::new(low, high, 0.0)];
            visibility.face(corners, &Vector3::z())
        };
        assert!(face(-0.09, -0.03).is_some());
        // Its corners and its middle are seen; what is between is not.
        assert!(face(-0.08, 0.09).is_none());
    }
}
