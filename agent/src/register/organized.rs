//! A view's depth as points with normals on the pixel grid.
//!
//! A plane is affine in inverse depth over the image (`1/z = a u + b v + c`), so a normal is one small linear
//! least-squares fit over a window. Unlike central differences it does not mind the regular holes of depth that was
//! warped into the colour image.

use crate::acquire::{DepthImage, Intrinsics};
use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

/// Half edge of the fitting window in pixels; the wide one is tried where the narrow one holds too few points.
const WINDOWS: [i32; 2] = [3, 6];

/// Fewest points for a fit.
const MIN_POINTS: u32 = 8;

/// Neighbours farther in depth than this share of the depth belong to another surface.
const SAME_SURFACE: f32 = 0.015;

/// Points and normals in the camera frame, one a pixel, row-major.
#[derive(Clone, Debug)]
pub struct OrganizedCloud {
    /// The camera.
    pub intrinsics: Intrinsics,
    /// Depth in metres, 0 where there is none (or where it was masked out).
    pub depth: Vec<f32>,
    /// Unit normals towards the camera; zero where none could be fitted.
    pub normals: Vec<[f32; 3]>,
}

impl OrganizedCloud {
    /// Points and normals of a depth image; pixels where `ignore` (row-major, same size) is true are left out.
    pub fn new(intrinsics: Intrinsics, depth: &DepthImage, ignore: Option<&[bool]>) -> Self {
        let mut z = depth.metres.clone();
        if let Some(ignore) = ignore {
            for (z, &ignored) in z.iter_mut().zip(ignore) {
                if ignored {
                    *z = 0.0;
                }
            }
        }
        let width = depth.width as usize;
        let mut normals = vec![[0.0; 3]; z.len()];
        normals.par_chunks_mut(width.max(1)).enumerate().for_each(|(v, row)| {
            for (u, normal) in row.iter_mut().enumerate() {
                *normal = fit_normal(&intrinsics, &z, u as i32, v as i32);
            }
        });
        Self { intrinsics, depth: z, normals }
    }

    /// Point of pixel index `i` in the camera frame, `None` where there is no depth.
    pub fn point(&self, i: usize) -> Option<Point3<f64>> {
        let z = *self.depth.get(i)?;
        let width = self.intrinsics.width as usize;
        (z > 0.0).then(|| self.intrinsics.unproject((i % width) as f64, (i / width) as f64, z.into()))
    }

    /// Number of pixels with depth.
    pub fn len(&self) -> usize {
        self.depth.iter().filter(|&&z| z > 0.0).count()
    }

    /// Whether no pixel has depth.
    pub fn is_empty(&self) -> bool {
        self.depth.iter().all(|&z| z <= 0.0)
    }

    /// Median depth in metres, `None` if empty.
    pub fn median_depth(&self) -> Option<f64> {
        let mut z: Vec<f32> = self.depth.iter().copied().filter(|&z| z > 0.0).collect();
        if z.is_empty() {
            return None;
        }
        let middle = z.len() / 2;
        let (_, median, _) = z.select_nth_unstable_by(middle, f32::total_cmp);
        Some(f64::from(*median))
    }
}

/// Unit normal at pixel `(u, v)` towards the camera, or zero.
fn fit_normal(k: &Intrinsics, depth: &[f32], u: i32, v: i32) -> [f32; 3] {
    let (width, height) = (k.width as i32, k.height as i32);
    let centre = depth[(v * width + u) as usize];
    if centre <= 0.0 {
        return [0.0; 3];
    }
    let inverse = 1.0 / centre;
    for half in WINDOWS {
        // Sums over (du, dv, dw) with dw = 1/z - 1/z0, relative to 1/z0 so that f32 keeps its digits.
        let (mut n, mut su, mut sv, mut sw) = (0_u32, 0.0_f32, 0.0_f32, 0.0_f32);
        let (mut suu, mut suv, mut svv, mut suw, mut svw) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
        for y in (v - half).max(0)..=(v + half).min(height - 1) {
            for x in (u - half).max(0)..=(u + half).min(width - 1) {
                let z = depth[(y * width + x) as usize];
                if z <= 0.0 || (z - centre).abs() > SAME_SURFACE * centre {
                    continue;
                }
                let (du, dv) = ((x - u) as f32, (y - v) as f32);
                let dw = centre / z - 1.0;
                n += 1;
                su += du;
                sv += dv;
                sw += dw;
                suu += du * du;
                suv += du * dv;
                svv += dv * dv;
                suw += du * dw;
                svw += dv * dw;
            }
        }
        if n < MIN_POINTS {
            continue;
        }
        let lhs = Matrix3::new(suu, suv, su, suv, svv, sv, su, sv, n as f32).cast::<f64>();
        let rhs = Vector3::new(suw, svw, sw).cast::<f64>();
        // Points on one line leave the plane open.
        if (lhs[(0, 0)] * lhs[(1, 1)] - lhs[(0, 1)] * lhs[(0, 1)]) < 0.05 * lhs[(0, 0)] * lhs[(1, 1)] {
            continue;
        }
        let Some(fit) = lhs.lu().solve(&rhs) else { continue };
        let w = f64::from(inverse);
        let (a, b, c) = (fit.x * w, fit.y * w, (fit.z + 1.0) * w);
        // 1/z = a du + b dv + c  <=>  n.p = 1 with n as below; the camera is on the side of -n.
        let plane = Vector3::new(a * k.fx, b * k.fy, c - a * (f64::from(u) - k.cx) - b * (f64::from(v) - k.cy));
        let norm = plane.norm();
        if norm.is_finite() && norm > 0.0 {
            let normal = -plane / norm;
            return [normal.x as f32, normal.y as f32, normal.z as f32];
        }
    }
    [0.0; 3]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane_view(normal: Vector3<f64>, holes: bool) -> OrganizedCloud {
        let k = Intrinsics { width: 64, height: 48, fx: 80.0, fy: 80.0, cx: 31.5, cy: 23.5 };
        let metres = (0..64 * 48)
            .map(|i| {
                let (u, v) = (i % 64, i / 64);
                if holes && (u % 2 == 1 || v % 3 == 1) {
                    return 0.0;
                }
                let ray = k.unproject(f64::from(u), f64::from(v), 1.0).coords;
                (normal.dot(&Vector3::new(0.0, 0.0, 0.5)) / normal.dot(&ray)) as f32
            })
            .collect();
        OrganizedCloud::new(k, &DepthImage { width: 64, height: 48, metres }, None)
    }

    #[test]
    fn normals_of_a_tilted_plane_are_exact_even_with_holes() {
        let truth = Vector3::new(0.4, -0.2, -0.9).normalize();
        for holes in [false, true] {
            let cloud = plane_view(truth, holes);
            let fitted: Vec<_> = cloud.normals.iter().filter(|n| **n != [0.0; 3]).collect();
            assert!(fitted.len() > cloud.len() / 2, "{} of {}", fitted.len(), cloud.len());
            for n in fitted {
                let n = Vector3::new(f64::from(n[0]), f64::from(n[1]), f64::from(n[2]));
                assert!(n.angle(&truth) < 0.01, "{n:?}");
            }
        }
    }

    #[test]
    fn ignored_pixels_have_no_depth() {
        let k = Intrinsics { width: 2, height: 1, fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.0 };
        let depth = DepthImage { width: 2, height: 1, metres: vec![1.0, 1.0] };
        let cloud = OrganizedCloud::new(k, &depth, Some(&[true, false]));
        assert_eq!(cloud.len(), 1);
        assert!(cloud.point(0).is_none());
    }
}
