//! Views of known surfaces, moved by known amounts, and what leaves a direction open.

use super::*;
use crate::organized::OrganizedCloud;
use crate::register::OrientedPoints;
use crate::register::se3::exp;
use crate::view::DepthImage;
use nalgebra::{Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A surface given by the distance to it: rays find it by sphere tracing, so views are exact.
struct Solid(fn(&Point3<f64>) -> f64);

/// Around the z axis, radius 30 mm, longer than the picture is high.
fn cylinder(p: &Point3<f64>) -> f64 {
    (p.x * p.x + p.y * p.y).sqrt() - 0.03
}

/// The cylinder with a block on its side and a step: nothing is left open.
fn housing(p: &Point3<f64>) -> f64 {
    let block = |c: [f64; 3], h: [f64; 3]| {
        let d: [f64; 3] = std::array::from_fn(|i| (p[i] - c[i]).abs() - h[i]);
        let outside = d.iter().map(|x| x.max(0.0).powi(2)).sum::<f64>().sqrt();
        outside + d[0].max(d[1]).max(d[2]).min(0.0)
    };
    let rod = cylinder(p).max(p.z.abs() - 0.05);
    rod.min(block([0.0, -0.03, 0.01], [0.012, 0.02, 0.02])).min(block([0.02, 0.0, 0.05], [0.03, 0.03, 0.008]))
}

const CAMERA: Intrinsics = Intrinsics { width: 400, height: 300, fx: 750.0, fy: 750.0, cx: 199.5, cy: 149.5 };

/// Looks at the origin from 0.4 m away and 0.2 m up at `azimuth`.
fn pose(azimuth: f64) -> Isometry3<f64> {
    let eye = Point3::new(0.35 * azimuth.sin(), -0.35 * azimuth.cos(), 0.2);
    let forward = (Point3::origin() - eye).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let down = forward.cross(&right);
    let axes = nalgebra::Matrix3::from_columns(&[right, down, forward]);
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(axes);
    Isometry3::from_parts(eye.coords.into(), nalgebra::UnitQuaternion::from_rotation_matrix(&rotation))
}

impl Solid {
    fn depth(&self, table_from_camera: &Isometry3<f64>, noise: f64, seed: u64) -> DepthImage {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut metres = Vec::new();
        for i in 0..CAMERA.width * CAMERA.height {
            let ray = CAMERA.unproject(f64::from(i % CAMERA.width), f64::from(i / CAMERA.width), 1.0).coords;
            let mut t = 0.2;
            for _ in 0..80 {
                t += (self.0)(&(table_from_camera * Point3::from(ray * t))) / ray.norm();
            }
            let hit = (self.0)(&(table_from_camera * Point3::from(ray * t))).abs() < 1e-6 && t < 0.6;
            let gauss: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            metres.push(if hit { (t + noise * gauss) as f32 } else { 0.0 });
        }
        DepthImage { width: CAMERA.width, height: CAMERA.height, metres }
    }

    fn cloud(&self, table_from_camera: &Isometry3<f64>, noise: f64, seed: u64) -> OrganizedCloud {
        OrganizedCloud::new(CAMERA, &self.depth(table_from_camera, noise, seed), None)
    }
}

/// One view as the model.
struct OneView(ModelView);

impl ModelSurface for OneView {
    fn view(&self, _: &Intrinsics, _: &Isometry3<f64>) -> ModelView {
        self.0.clone()
    }

    fn spacing(&self) -> f64 {
        0.55e-3
    }

    fn points(&self, wanted: &dyn Fn(u16) -> bool) -> OrientedPoints {
        let pose = &self.0.table_from_camera;
        let mut out = OrientedPoints::default();
        for ((p, n), label) in self.0.points.iter().zip(&self.0.normals).zip(&self.0.labels) {
            if *n != [0.0; 3] && wanted(*label) {
                out.points.push((pose * Point3::from(*p).cast::<f64>()).cast().into());
                out.normals.push((pose.rotation * Vector3::from(*n).cast::<f64>()).cast().into());
            }
        }
        out
    }
}

fn covariance(rotation: f64, translation: f64) -> Matrix6<f64> {
    crate::view::covariance_of_prior(rotation, translation)
}

/// Registers a view at 20 degrees against one at 0, from a prior off by `twist`.
fn register(solid: &Solid, twist: &Vector6<f64>, noise: f64) -> (Result<Aligned, NotAligned>, Isometry3<f64>) {
    let (first, second) = (pose(0.0), pose(20_f64.to_radians()));
    let model = OneView(ModelView::of(&solid.cloud(&first, noise, 1), first, 1, |_| 0, |_| true));
    let source = SourcePoints::select(&solid.cloud(&second, noise, 2), 1, |_| 0, |_| true);
    let prior = second * exp(twist);
    let spread = covariance(0.01, 0.002);
    (align(&source, &CAMERA, &model, &prior, &spread, &IcpConfig::default()), second)
}

/// Angle (radians) and distance of the object's centre (metres) between two poses.
fn error(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let centre = Point3::new(0.0, 0.0, 0.4);
    (a.rotation.angle_to(&b.rotation), (a * centre - b * centre).norm())
}

#[test]
fn a_prior_off_by_a_degree_and_millimetres_is_brought_home() {
    let twist = Vector6::new(0.012, -0.01, 0.008, 2e-3, -1.5e-3, 2e-3);
    let (aligned, truth) = register(&Solid(housing), &twist, 5e-5);
    let aligned = aligned.expect("aligned");
    let (angle, distance) = error(&aligned.table_from_camera, &truth);
    assert!(angle < 5e-4 && distance < 3e-5, "{angle} rad, {distance} m");
    assert!(aligned.report.degeneracy.frozen.is_empty());
    assert!(aligned.report.fit_after < aligned.report.fit_before);
    // The covariance is of the error's order, and far smaller than the prior's.
    let expected = (0..3).map(|i| aligned.covariance[(i, i)]).sum::<f64>().sqrt();
    assert!(angle < 6.0 * expected && expected < 2e-3, "{angle} rad against {expected} rad");
}

#[test]
fn a_cylinder_keeps_its_prior_along_and_about_its_axis() {
    for seed in 0..6 {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut draw = |size: f64| (random.random::<f64>() * 2.0 - 1.0) * size;
        let twist = Vector6::new(draw(0.01), draw(0.01), draw(0.01), draw(2e-3), draw(2e-3), draw(2e-3));
        let solid = Solid(cylinder);
        let (result, truth) = register(&solid, &twist, 5e-5);
        let prior = truth * exp(&twist);
        let Ok(aligned) = result else { continue };
        assert_eq!(aligned.report.degeneracy.frozen.len(), 2, "{:?}", aligned.report.degeneracy);
        // What the data hold gets better; along and about the axis only the prior speaks (a tilt that the data show
        // tells where a camera half a metre away has slid to, so that direction may gain as well).
        let off = |pose: &Isometry3<f64>| {
            let (a, d) = error(pose, &truth);
            d + a * 0.05
        };
        assert!(
            off(&aligned.table_from_camera) <= off(&prior),
            "seed {seed}: {} {}",
            off(&aligned.table_from_camera),
            off(&prior)
        );
    }
}

#[test]
fn a_view_of_something_else_keeps_its_prior() {
    let first = pose(0.0);
    let model = OneView(ModelView::of(&Solid(housing).cloud(&first, 0.0, 1), first, 1, |_| 0, |_| true));
    let elsewhere = Solid(|p| (p.x - 0.1).hypot(p.y - 0.1).hypot(p.z) - 0.02);
    let source = SourcePoints::select(&elsewhere.cloud(&pose(0.3), 0.0, 2), 1, |_| 0, |_| true);
    let result = align(&source, &CAMERA, &model, &pose(0.3), &covariance(0.01, 0.002), &IcpConfig::default());
    assert!(matches!(result, Err(NotAligned::LittleOverlap { .. })), "{result:?}");
}

#[test]
fn nothing_to_align_and_nonsense_are_refused() {
    let first = pose(0.0);
    let model = OneView(ModelView::of(&Solid(housing).cloud(&first, 0.0, 1), first, 1, |_| 0, |_| true));
    let config = IcpConfig::default();
    let spread = covariance(0.01, 0.002);
    let on = |source: &SourcePoints, spread: &Matrix6<f64>| align(source, &CAMERA, &model, &first, spread, &config);
    assert_eq!(on(&SourcePoints::default(), &spread).err(), Some(NotAligned::NoPoints));
    let some = SourcePoints::select(&Solid(housing).cloud(&first, 0.0, 1), 4, |_| 0, |_| true);
    assert_eq!(on(&some, &Matrix6::zeros()).err(), Some(NotAligned::BadCovariance));
    let broken = SourcePoints {
        points: vec![[f32::NAN; 3]; 200],
        normals: vec![[f32::NAN; 3]; 200],
        labels: vec![0; 200],
        ..SourcePoints::default()
    };
    assert!(on(&broken, &spread).is_err());
    let one = SourcePoints {
        points: vec![[0.0, 0.0, 0.4]; 1],
        normals: vec![[0.0, 0.0, -1.0]; 1],
        labels: vec![0],
        ..SourcePoints::default()
    };
    assert!(on(&one, &spread).is_err());
    let line = SourcePoints {
        points: (0..500).map(|i| [0.0, i as f32 * 1e-4 - 0.025, 0.37]).collect(),
        normals: vec![[0.0, 0.0, -1.0]; 500],
        labels: vec![0; 500],
        ..SourcePoints::default()
    };
    let _ = on(&line, &spread);
}
