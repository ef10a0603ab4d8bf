//! A made room and a handheld camera in it: views of 640x480 as a depth camera of the consumer class takes them, with
//! true poses and true depth.

use glam::Vec3;
use image::RgbImage;
use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use semascan_perception::view::{DepthImage, Intrinsics};
use semascan_simulation::raycast::RayScene;

/// The camera.
pub(crate) const CAMERA: Intrinsics =
    Intrinsics { width: 640, height: 480, fx: 525.0, fy: 525.0, cx: 319.5, cy: 239.5 };
/// Depth is recorded in millimetres.
pub(crate) const STEP: f32 = 1e-3;
/// Standard deviations of the poses that come with the views: metres, radians.
pub(crate) const POSE_SIGMA: (f64, f64) = (2e-3, 2e-3);
/// Turn about the table between two views, radians: 30 views a second, a turn in a minute and a half.
const TURN: f64 = 2.3e-3;

/// Walls, a table and things on it.
pub(crate) struct Room {
    scene: RayScene,
    /// Of each triangle.
    colors: Vec<[f32; 3]>,
    normals: Vec<Vec3>,
    seed: u64,
}

/// One view as it is recorded, and what is true of it.
pub(crate) struct Shot {
    pub(crate) rgb: RgbImage,
    pub(crate) depth: DepthImage,
    /// The pose that comes with the view.
    pub(crate) table_from_camera: Isometry3<f64>,
    pub(crate) true_pose: Isometry3<f64>,
    pub(crate) true_depth: Vec<f32>,
}

impl Room {
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let (mut vertices, mut triangles, mut colors) = (Vec::new(), Vec::new(), Vec::new());
        let mut place = |centre: [f32; 3], half: [f32; 3], turn: f32, color: [f32; 3]| {
            let first = vertices.len() as u32;
            for corner in 0..8 {
                let sign = |axis: u32| if corner >> axis & 1 == 0 { -1.0 } else { 1.0_f32 };
                let (x, y) = (half[0] * sign(0), half[1] * sign(1));
                let (s, c) = turn.sin_cos();
                vertices.push([centre[0] + c * x - s * y, centre[1] + s * x + c * y, centre[2] + half[2] * sign(2)]);
            }
            for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
                for corners in [[0, 1, 2], [0, 2, 3]] {
                    triangles.push(corners.map(|k: usize| first + face[k]));
                    colors.push(color);
                }
            }
        };
        // A room of 4 m with a table in its middle; z is up, the table's top at 0.
        place([0.0, 0.0, -0.8], [2.0, 2.0, 0.02], 0.0, [120.0, 100.0, 80.0]);
        for side in [-1.0, 1.0] {
            place([2.02 * side, 0.0, 0.4], [0.02, 2.0, 1.2], 0.0, [170.0, 175.0, 170.0]);
            place([0.0, 2.02 * side, 0.4], [2.0, 0.02, 1.2], 0.0, [160.0, 165.0, 175.0]);
        }
        place([0.0, 0.0, -0.02], [0.6, 0.45, 0.02], 0.0, [140.0, 110.0, 70.0]);
        for _ in 0..24 {
            let half = [0.02, 0.02, 0.03].map(|least: f32| least + 0.06 * random.random::<f32>());
            let at = [(random.random::<f32>() - 0.5) * 1.0, (random.random::<f32>() - 0.5) * 0.7, half[2]];
            let color = std::array::from_fn(|_| 40.0 + 190.0 * random.random::<f32>());
            place(at, half, random.random::<f32>() * 3.0, color);
        }
        let corner = |i: u32| Vec3::from(vertices[i as usize]);
        let normals = triangles
            .iter()
            .map(|t: &[u32; 3]| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).normalize_or(Vec3::Z))
            .collect();
        Self { scene: RayScene::new(&vertices, &triangles), colors, normals, seed }
    }

    /// Where the camera truly is at view `index`: a walk around the table, held by a hand.
    fn pose(&self, index: u32) -> Isometry3<f64> {
        let t = f64::from(index);
        let angle = TURN * t;
        let radius = 1.1 + 0.15 * (0.011 * t).sin();
        let eye = Point3::new(
            radius * angle.cos() + 0.01 * (0.21 * t).sin(),
            radius * angle.sin() + 0.01 * (0.17 * t).cos(),
            0.55 + 0.2 * (0.013 * t).sin() + 0.006 * (0.33 * t).sin(),
        );
        let target = Point3::new(0.15 * (0.007 * t).sin(), 0.1 * (0.009 * t).cos(), 0.0);
        let forward = (target - eye).normalize();
        let right = forward.cross(&Vector3::z()).normalize();
        let rotation = Rotation3::from_basis_unchecked(&[right, forward.cross(&right), forward]);
        let shake =
            UnitQuaternion::from_euler_angles(0.01 * (0.4 * t).sin(), 0.01 * (0.31 * t).cos(), 0.02 * (0.05 * t).sin());
        Isometry3::from_parts(Translation3::from(eye), UnitQuaternion::from_rotation_matrix(&rotation) * shake)
    }

    /// View `index`.
    pub(crate) fn shot(&self, index: u32) -> Shot {
        let true_pose = self.pose(index);
        let pixels = (CAMERA.width * CAMERA.height) as usize;
        let rows: Vec<Vec<(f32, [u8; 3])>> =
            (0..CAMERA.height).into_par_iter().map(|v| self.row(&true_pose, v)).collect();
        let seen: Vec<(f32, [u8; 3])> = rows.concat();
        let true_depth: Vec<f32> = seen.iter().map(|(z, _)| *z).collect();
        let mut random = Pcg64Mcg::seed_from_u64(self.seed ^ u64::from(index) << 20);
        let mut metres = vec![0.0; pixels];
        for (i, measured) in metres.iter_mut().enumerate() {
            let z = true_depth[i];
            // Triangulation sees the right neighbour where depth breaks off; noise grows with the square of depth
            // [Khoshelham 2012].
            let beside = true_depth[(i + 4).min(pixels - 1)];
            if z <= 0.0 || (beside - z).abs() > 0.05 * z && random.random::<f32>() < 0.7 {
                continue;
            }
            let noisy = z + 1.45e-3 * z * z * normal(&mut random);
            *measured = (noisy / STEP).round() * STEP;
        }
        let (metres_sigma, radians_sigma) = POSE_SIGMA;
        let mut draw = |sigma: f64| Vector3::from_fn(|_, _| sigma * f64::from(normal(&mut random)));
        let error = Isometry3::new(draw(metres_sigma), draw(radians_sigma));
        Shot {
            rgb: RgbImage::from_raw(CAMERA.width, CAMERA.height, seen.iter().flat_map(|(_, c)| *c).collect())
                .expect("one colour a pixel"),
            depth: DepthImage { width: CAMERA.width, height: CAMERA.height, metres },
            table_from_camera: true_pose * error,
            true_pose,
            true_depth,
        }
    }

    /// True depth and colour of the pixels of row `v`.
    fn row(&self, pose: &Isometry3<f64>, v: u32) -> Vec<(f32, [u8; 3])> {
        let eye = Vec3::new(pose.translation.x as f32, pose.translation.y as f32, pose.translation.z as f32);
        let pixel = |u: u32| {
            let ray = pose.rotation * CAMERA.unproject(f64::from(u), f64::from(v), 1.0).coords;
            let ray = Vec3::new(ray.x as f32, ray.y as f32, ray.z as f32);
            let Some(hit) = self.scene.first_hit(eye, ray) else { return (0.0, [0; 3]) };
            let p = eye + ray * hit.t;
            let shade = 0.6 + 0.4 * self.normals[hit.triangle as usize].dot(Vec3::new(0.4, 0.3, 0.866)).abs();
            let print = 1.0 + 0.15 * (p.x * 130.0).sin() * (p.y * 110.0).sin() + 0.1 * ((p.x + p.z) * 47.0).cos();
            let color = self.colors[hit.triangle as usize].map(|c| (c * shade * print).clamp(0.0, 255.0) as u8);
            (hit.t, color)
        };
        (0..CAMERA.width).map(pixel).collect()
    }
}

/// A standard normal number; the sum of twelve uniform ones is normal enough.
fn normal(random: &mut impl Rng) -> f32 {
    (0..12).map(|_| random.random::<f32>()).sum::<f32>() - 6.0
}
