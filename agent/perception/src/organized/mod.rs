//! A view's depth as points with normals on the pixel grid.
//!
//! Flying pixels are found first (`edges`), so that they bend no normal; then planes are fitted (`normals`).

mod edges;
mod normals;

use crate::view::{DepthImage, Intrinsics};
use edges::flying_pixels;
use nalgebra::Point3;
use normals::{Fits, Grid, fit_planes};

/// Points and normals in the camera frame, one a pixel, row-major.
#[derive(Clone, Debug)]
pub struct OrganizedCloud {
    /// The camera.
    pub intrinsics: Intrinsics,
    /// Depth in metres, 0 where there is none (or where it was masked out).
    pub depth: Vec<f32>,
    /// Unit normals towards the camera; zero where none could be fitted.
    pub normals: Vec<[f32; 3]>,
    /// Pixels that hang between two surfaces or stray from theirs; they have depth but no normal.
    pub flying: Vec<bool>,
    /// Depth in metres with less noise where the surface is flat as far as noise shows; elsewhere `depth`.
    pub smooth: Vec<f32>,
    /// Standard deviation of `smooth` as the picture itself shows it, metres; infinite where unknown.
    pub sigma: Vec<f32>,
}

impl OrganizedCloud {
    /// Points and normals of a depth image; pixels where `ignore` (row-major, same size) is true are left out.
    ///
    /// ```
    /// use semascan_perception::organized::OrganizedCloud;
    /// use semascan_perception::view::{DepthImage, Intrinsics};
    ///
    /// // A wall half a metre in front of a camera of 64 x 48 pixels: one value in metres a pixel, row-major.
    /// let camera = Intrinsics { width: 64, height: 48, fx: 80.0, fy: 80.0, cx: 31.5, cy: 23.5 };
    /// let depth = DepthImage { width: 64, height: 48, metres: vec![0.5; 64 * 48] };
    /// let cloud = OrganizedCloud::new(camera, &depth, None);
    ///
    /// let middle = 24 * 64 + 32;
    /// let point = cloud.point(middle).expect("measured");
    /// assert!((point.z - 0.5).abs() < 1e-9, "metres, camera frame");
    /// assert!(cloud.normals[middle][2] < -0.999, "towards the camera");
    /// ```
    pub fn new(intrinsics: Intrinsics, depth: &DepthImage, ignore: Option<&[bool]>) -> Self {
        Self::with_normals_of(intrinsics, depth, ignore, None)
    }

    /// As [`Self::new`], but normals are fitted only where `wanted` (row-major, same size) is true.
    pub fn with_normals_of(
        intrinsics: Intrinsics,
        depth: &DepthImage,
        ignore: Option<&[bool]>,
        wanted: Option<&[bool]>,
    ) -> Self {
        let mut z = depth.metres.clone();
        if let Some(ignore) = ignore {
            for (z, &ignored) in z.iter_mut().zip(ignore) {
                if ignored {
                    *z = 0.0;
                }
            }
        }
        let flying = flying_pixels(&intrinsics, &z);
        let mut solid = z.clone();
        for (z, _) in solid.iter_mut().zip(&flying).filter(|(_, flying)| **flying) {
            *z = 0.0;
        }
        let Fits { normals, mut smooth, sigma } = fit_planes(Grid { k: &intrinsics, depth: &solid }, wanted);
        for ((smooth, z), _) in smooth.iter_mut().zip(&z).zip(&flying).filter(|(_, flying)| **flying) {
            *smooth = *z;
        }
        Self { intrinsics, depth: z, normals, flying, smooth, sigma }
    }

    /// Point of pixel index `i` in the camera frame, `None` where there is no depth.
    pub fn point(&self, i: usize) -> Option<Point3<f64>> {
        let z = *self.depth.get(i)?;
        let width = self.intrinsics.width as usize;
        (z > 0.0).then(|| self.intrinsics.unproject((i % width) as f64, (i / width) as f64, z.into()))
    }

    /// Denoised point of pixel index `i` in the camera frame, `None` where there is no depth: what the map is made of, so
    /// that what smoothing does to a curved surface is the same on both sides of a registration.
    pub fn smooth_point(&self, i: usize) -> Option<Point3<f64>> {
        let (z, smooth) = (*self.depth.get(i)?, *self.smooth.get(i)?);
        let width = self.intrinsics.width as usize;
        (z > 0.0).then(|| self.intrinsics.unproject((i % width) as f64, (i / width) as f64, smooth.into()))
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};

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

    /// A cylinder across the picture before a wall, with true normals of the cylinder's pixels.
    fn cylinder(f: f64, noise: f32) -> (OrganizedCloud, Vec<Option<Vector3<f64>>>) {
        let k = Intrinsics { width: 200, height: 160, fx: f, fy: f, cx: 99.5, cy: 79.5 };
        let (radius, away) = (0.04_f64, 0.5_f64);
        let mut truth = Vec::new();
        let mut random = rand_pcg::Pcg32::seed_from_u64(3);
        let metres = (0..200 * 160_u32)
            .map(|i| {
                let ray = k.unproject(f64::from(i % 200), f64::from(i / 200), 1.0).coords;
                // Axis along x at depth `away`: |(y, z) t - (0, away)| = radius.
                let (a, b, c) = (ray.y * ray.y + 1.0, away, away * away - radius * radius);
                let root = b * b - a * c;
                let jitter = f64::from(noise * (2.0 * random.random::<f32>() - 1.0));
                if root < 0.0 {
                    truth.push(None);
                    return (0.7 + jitter) as f32;
                }
                let t = (b - root.sqrt()) / a;
                truth.push(Some(Vector3::new(0.0, ray.y * t, t - away).normalize()));
                (t + jitter) as f32
            })
            .collect();
        (OrganizedCloud::new(k, &DepthImage { width: 200, height: 160, metres }, None), truth)
    }

    #[test]
    fn normals_of_a_cylinder_hold_up_to_its_border_and_under_noise() {
        for (noise, median, worst_share) in [(0.0, 0.01, 0.08), (1e-4, 0.06, 0.2)] {
            let (cloud, truth) = cylinder(240.0, noise);
            let mut angles: Vec<f64> = truth
                .iter()
                .zip(&cloud.normals)
                .filter_map(|(t, n)| {
                    let n = Vector3::from(*n).cast::<f64>();
                    t.filter(|t| t.z < -0.3 && n != Vector3::zeros()).map(|t| t.angle(&n))
                })
                .collect();
            assert!(angles.len() > 5000);
            angles.sort_by(f64::total_cmp);
            let (middle, late) = (angles[angles.len() / 2], angles[angles.len() * 98 / 100]);
            assert!(middle < median && late < worst_share, "noise {noise}: median {middle}, 98 % {late}");
        }
    }

    #[test]
    fn noise_is_measured_and_smoothed_without_bending_the_surface() {
        // Uniform noise of half width h has a deviation of h / sqrt(3).
        let (quiet, _) = cylinder(720.0, 0.0);
        let (noisy, truth) = cylinder(720.0, 2e-4);
        let error = |z: &[f32], i: usize| f64::from(z[i] - quiet.depth[i]);
        let rms = |z: &[f32]| {
            let on: Vec<f64> =
                (0..z.len()).filter(|&i| truth[i].is_some_and(|t| t.z < -0.75)).map(|i| error(z, i).powi(2)).collect();
            (on.iter().sum::<f64>() / on.len() as f64).sqrt()
        };
        let (captured, smoothed) = (rms(&noisy.depth), rms(&noisy.smooth));
        assert!(smoothed < 0.47 * captured, "{captured} to {smoothed}");
        // What is left is noise, which views average away: the surface as a whole stays where it is.
        let errors: Vec<f64> = (0..truth.len())
            .filter(|&i| truth[i].is_some_and(|t| t.z < -0.75))
            .map(|i| error(&noisy.smooth, i))
            .collect();
        let bias = errors.iter().sum::<f64>() / errors.len() as f64;
        assert!(bias.abs() < 0.03 * captured, "biased by {bias}");
        assert!(rms(&quiet.smooth) < 5e-6, "a quiet surface stays: {}", rms(&quiet.smooth));
        // What it says of its own error is about right.
        let claimed: Vec<f64> = (0..noisy.sigma.len())
            .filter(|&i| truth[i].is_some_and(|t| t.z < -0.75))
            .map(|i| f64::from(noisy.sigma[i]).powi(2))
            .filter(|s| s.is_finite())
            .collect();
        let claimed = (claimed.iter().sum::<f64>() / claimed.len() as f64).sqrt();
        assert!((0.5..1.5).contains(&(claimed / smoothed)), "claims {claimed}, has {smoothed}");
    }

    #[test]
    fn normals_are_fitted_where_they_are_wanted() {
        let k = Intrinsics { width: 90, height: 70, fx: 80.0, fy: 80.0, cx: 31.5, cy: 23.5 };
        let depth = DepthImage { width: 90, height: 70, metres: vec![0.5; 90 * 70] };
        let wanted: Vec<bool> = (0..90 * 70).map(|i| i % 90 < 20).collect();
        let cloud = OrganizedCloud::with_normals_of(k, &depth, None, Some(&wanted));
        assert!(cloud.normals.iter().zip(&wanted).all(|(n, w)| (*n != [0.0; 3]) == *w));
        assert_eq!(cloud.len(), 90 * 70);
    }
}
