//! How far estimated camera poses are from the true ones, as they are and after one rigid alignment.
//!
//! Registration against a model can only make the poses agree with each other: where the model as a whole stands is
//! the kinematics' word. So poses are also judged after the one rigid motion that brings all of them closest to the
//! truth ([Sturm 2012], with the rotations as well as the centres, so that cameras in one line are aligned too).

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use semascan_perception::register::rigid::nearest_rotation;

/// Difference of two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// Angle of the relative rotation in radians.
    pub rotation: f64,
    /// Distance of the camera centres in metres.
    pub translation: f64,
}

/// Error of `estimate` against `truth`, both `table_from_camera`.
pub fn pose_error(estimate: &Isometry3<f64>, truth: &Isometry3<f64>) -> PoseError {
    PoseError {
        rotation: estimate.rotation.angle_to(&truth.rotation),
        translation: (estimate.translation.vector - truth.translation.vector).norm(),
    }
}

/// One estimated pose and the true one, both `table_from_camera`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosePair {
    /// What was estimated.
    pub estimate: Isometry3<f64>,
    /// What is true.
    pub truth: Isometry3<f64>,
}

/// The rigid motion `truth_from_estimate` that brings the estimated poses closest to the true ones.
///
/// It minimises `sum |c - X c'|^2 + s^2 a^2` over the poses, with centres `c`, angles `a` between the rotations (as
/// chords) and `s` the RMS distance of the true centres from their mean, or 1 m where they all coincide: a radian
/// weighs as much as it moves the cameras. `None` without poses, or where one is not finite.
pub fn align_poses(pairs: &[PosePair]) -> Option<Isometry3<f64>> {
    let finite = |p: &Isometry3<f64>| p.to_homogeneous().iter().all(|v| v.is_finite());
    if pairs.is_empty() || !pairs.iter().all(|p| finite(&p.estimate) && finite(&p.truth)) {
        return None;
    }
    let n = pairs.len() as f64;
    let mean = |of: fn(&PosePair) -> Vector3<f64>| pairs.iter().map(of).sum::<Vector3<f64>>() / n;
    let (from, to) = (mean(|p| p.estimate.translation.vector), mean(|p| p.truth.translation.vector));
    let spread = pairs.iter().map(|p| (p.truth.translation.vector - to).norm_squared()).sum::<f64>() / n;
    // |R - R'|^2 = 4 (1 - cos a), close to 2 a^2: half of it is the square of the chord.
    let weight = 0.5 * if spread > 1e-12 { spread } else { 1.0 };
    let mut correlation = Matrix3::zeros();
    for p in pairs {
        let (a, b) = (p.estimate.translation.vector - from, p.truth.translation.vector - to);
        let rotations = p.truth.rotation.to_rotation_matrix() * p.estimate.rotation.inverse().to_rotation_matrix();
        correlation += b * a.transpose() + weight * rotations.matrix();
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&nearest_rotation(&correlation)?);
    Some(Isometry3::from_parts(Translation3::from(to - rotation * from), rotation))
}

/// Errors of the poses after [`align_poses`], in order; empty where they cannot be aligned.
pub fn aligned_pose_errors(pairs: &[PosePair]) -> Vec<PoseError> {
    let Some(truth_from_estimate) = align_poses(pairs) else { return Vec::new() };
    pairs.iter().map(|p| pose_error(&(truth_from_estimate * p.estimate), &p.truth)).collect()
}

/// A point of the model brought into the truth's frame.
pub(crate) fn moved(by: &Isometry3<f64>, p: [f32; 3]) -> [f32; 3] {
    let q = by * Point3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
    [q.x as f32, q.y as f32, q.z as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(i: u32) -> Isometry3<f64> {
        let a = f64::from(i);
        Isometry3::new(Vector3::new(0.5 * a.cos(), 0.4 * a.sin(), 0.3 + 0.05 * a), Vector3::new(0.3 * a, -0.2 * a, 1.0))
    }

    fn pairs(n: u32, of: impl Fn(u32) -> Isometry3<f64>, x: Isometry3<f64>) -> Vec<PosePair> {
        (0..n).map(|i| PosePair { estimate: x.inverse() * of(i), truth: of(i) }).collect()
    }

    #[test]
    fn a_rigid_motion_of_all_cameras_is_found_exactly() {
        let x = Isometry3::new(Vector3::new(0.01, -0.02, 0.3), Vector3::new(0.4, 2.0, -0.7));
        let still = |i: u32| Isometry3::from_parts(Translation3::identity(), pose(i).rotation);
        let in_line = |i: u32| Isometry3::new(Vector3::x() * f64::from(i), Vector3::new(0.0, 0.3, 0.1));
        for pairs in [pairs(12, pose, x), pairs(1, pose, x), pairs(5, still, x), pairs(4, in_line, x)] {
            let found = align_poses(&pairs).expect("finite");
            let error = pose_error(&found, &x);
            assert!(error.rotation < 1e-7 && error.translation < 1e-7, "{error:?}");
            assert!(aligned_pose_errors(&pairs).iter().all(|e| e.rotation < 1e-7 && e.translation < 1e-7));
        }
    }

    #[test]
    fn no_small_motion_on_top_does_better() {
        let noise = |i: u32, k: f64| (f64::from(i) * 7.3 + k).sin() * 1e-2;
        let pairs: Vec<_> = (0..8)
            .map(|i| {
                let off = Isometry3::new(
                    Vector3::new(noise(i, 0.0), noise(i, 1.0), noise(i, 2.0)),
                    Vector3::new(noise(i, 3.0), noise(i, 4.0), noise(i, 5.0)),
                );
                PosePair { estimate: pose(i) * off, truth: pose(i) }
            })
            .collect();
        let centre = pairs.iter().map(|p| p.truth.translation.vector).sum::<Vector3<f64>>() / 8.0;
        let spread = pairs.iter().map(|p| (p.truth.translation.vector - centre).norm_squared()).sum::<f64>() / 8.0;
        let cost = |x: &Isometry3<f64>| -> f64 {
            let one = |p: &PosePair| {
                let e = pose_error(&(x * p.estimate), &p.truth);
                e.translation.powi(2) + spread * 4.0 * (e.rotation / 2.0).sin().powi(2)
            };
            pairs.iter().map(one).sum()
        };
        let best = align_poses(&pairs).expect("finite");
        for axis in 0..6 {
            for step in [-1e-4, 1e-4] {
                let mut twist = [0.0; 6];
                twist[axis] = step;
                let t = Vector3::new(twist[0], twist[1], twist[2]);
                let nudged = Isometry3::new(t, Vector3::new(twist[3], twist[4], twist[5])) * best;
                assert!(cost(&nudged) > cost(&best), "axis {axis}");
            }
        }
    }

    #[test]
    fn nothing_and_nonsense_cannot_be_aligned() {
        assert!(align_poses(&[]).is_none());
        let bad = Isometry3::translation(f64::NAN, 0.0, 0.0);
        assert!(align_poses(&[PosePair { estimate: bad, truth: pose(1) }]).is_none());
    }
}
