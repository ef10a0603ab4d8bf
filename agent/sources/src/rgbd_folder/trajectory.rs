//! Trajectories: the camera's pose by stamp (TUM), by frame in text (`.log` of Redwood and Open3D), and in Open3D's JSON.
//!
//! A pose that holds a number that is not finite is a gap of the tracking and none; a matrix that is no rotation is an
//! error, because then the file is another.

use super::association::{TOLERANCE, nearest};
use super::text::{Rows, numbers};
use nalgebra::{Isometry3, Matrix3, Matrix4, Quaternion, Rotation3, Translation3, UnitQuaternion};
use serde_json::{Map, Value};

/// Farthest from a rotation that a recorded matrix or quaternion may be before it is refused instead of rounded.
const ROTATION_TOLERANCE: f64 = 1e-2;

/// Poses by frame: the frame's number as the file has it, and `table_from_camera` if it is known.
pub(crate) type FramePoses = Vec<(u64, Option<Isometry3<f64>>)>;

/// Poses by stamp.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trajectory {
    /// Seconds, ascending.
    stamps: Vec<f64>,
    table_from_camera: Vec<Option<Isometry3<f64>>>,
}

impl Trajectory {
    /// Reads lines of `stamp x y z qx qy qz qw` [Sturm 2012].
    ///
    /// # Errors
    /// What is wrong, with the line.
    pub(crate) fn from_stamped(text: &str) -> Result<Self, String> {
        let mut rows = Vec::new();
        for (line, row) in Rows::of(text) {
            let named = |reason: String| format!("line {line}: {reason}");
            let [stamp, x, y, z, qx, qy, qz, qw] = numbers(row).map_err(named)?;
            if !stamp.is_finite() {
                return Err(named("the stamp is not finite".into()));
            }
            let pose = if [x, y, z, qx, qy, qz, qw].iter().all(|c| c.is_finite()) {
                let rotation = Quaternion::new(qw, qx, qy, qz);
                if (rotation.norm() - 1.0).abs() > ROTATION_TOLERANCE {
                    return Err(named(format!("the quaternion has length {:.3}, no rotation", rotation.norm())));
                }
                let rotation = UnitQuaternion::from_quaternion(rotation);
                Some(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
            } else {
                None
            };
            rows.push((stamp, pose));
        }
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (stamps, table_from_camera) = rows.into_iter().unzip();
        Ok(Self { stamps, table_from_camera })
    }

    /// The pose at `stamp`: between the two neighbours where both are near, else that of a near one; `None` in a gap.
    pub(crate) fn at(&self, stamp: f64) -> Option<Isometry3<f64>> {
        let known = |place: usize| {
            let at = *self.stamps.get(place)?;
            let pose = (*self.table_from_camera.get(place)?)?;
            ((at - stamp).abs() <= TOLERANCE).then_some((at, pose))
        };
        let after = self.stamps.partition_point(|other| *other < stamp);
        let before = after.checked_sub(1).and_then(known);
        match (before, known(after)) {
            (Some((from, a)), Some((to, b))) if to > from => {
                a.try_lerp_slerp(&b, (stamp - from) / (to - from), 1e-9).or(Some(a))
            }
            (Some((_, pose)), None) | (None, Some((_, pose))) => Some(pose),
            _ => known(nearest(&self.stamps, stamp)?).map(|(_, pose)| pose),
        }
    }
}

/// Reads blocks of a line of three whole numbers, whose first is the frame, and four of a matrix `table_from_camera`: the
/// format of Redwood [Choi 2015].
///
/// # Errors
/// What is wrong, with the line.
pub(crate) fn from_log(text: &str) -> Result<FramePoses, String> {
    let mut poses = Vec::new();
    let mut rows = Rows::of(text);
    while let Some((line, head)) = rows.next() {
        let first = head.split_whitespace().next().unwrap_or_default();
        let is_head = head.split_whitespace().count() == 3;
        let frame = first.parse::<u64>().ok().filter(|_| is_head);
        let frame = frame.ok_or_else(|| format!("line {line}: not three whole numbers before a matrix"))?;
        let mut matrix = Matrix4::zeros();
        for row in 0..4 {
            let (line, text) =
                rows.next().ok_or_else(|| format!("the matrix of frame {frame} ends after {row} rows"))?;
            let values = numbers::<4>(text).map_err(|reason| format!("line {line}: {reason}"))?;
            matrix.set_row(row, &nalgebra::RowVector4::from(values));
        }
        poses.push((frame, pose_of_matrix(&matrix).map_err(|reason| format!("the pose of frame {frame}: {reason}"))?));
    }
    Ok(poses)
}

/// Reads Open3D's `PinholeCameraTrajectory`: of each frame the matrix `camera_from_table`, column by column.
///
/// # Errors
/// What is wrong, with the field.
pub(crate) fn from_json(object: &Map<String, Value>) -> Result<FramePoses, String> {
    let parameters = object.get("parameters").and_then(Value::as_array).ok_or("field parameters: not a list")?;
    let mut poses = Vec::new();
    for (frame, camera) in (0_u64..).zip(parameters) {
        let field = format!("field parameters[{frame}].extrinsic");
        let list = camera.get("extrinsic").and_then(Value::as_array).filter(|list| list.len() == 16);
        let list = list.ok_or_else(|| format!("{field}: not 16 numbers"))?;
        // null stands where Python wrote NaN.
        let values: Option<Vec<f64>> =
            list.iter().map(|v| if v.is_null() { Some(f64::NAN) } else { v.as_f64() }).collect();
        let values = values.ok_or_else(|| format!("{field}: not 16 numbers"))?;
        let pose =
            pose_of_matrix(&Matrix4::from_column_slice(&values)).map_err(|reason| format!("{field}: {reason}"))?;
        poses.push((frame, pose.map(|camera_from_table| camera_from_table.inverse())));
    }
    Ok(poses)
}

/// A rigid motion as a matrix; `None` if a number of it is not finite.
///
/// # Errors
/// How far it is from a rotation.
pub(crate) fn pose_of_matrix(matrix: &Matrix4<f64>) -> Result<Option<Isometry3<f64>>, String> {
    if !matrix.iter().all(|value| value.is_finite()) {
        return Ok(None);
    }
    let rotation: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let deviation = (rotation * rotation.transpose() - Matrix3::identity()).norm();
    if deviation > ROTATION_TOLERANCE || rotation.determinant() < 0.0 {
        return Err(format!("not a rotation (off by {deviation:.3})"));
    }
    if (matrix.row(3) - nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0)).norm() > ROTATION_TOLERANCE {
        return Err("the last row of the matrix is not 0 0 0 1".into());
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&rotation));
    let translation = Translation3::new(matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)]);
    Ok(Some(Isometry3::from_parts(translation, rotation)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use serde_json::json;

    #[test]
    fn poses_between_stamps_are_between_poses_and_gaps_have_none() {
        let text = "# stamp\n1.00 0 0 0 0 0 0 1\n1.01 0.1 0 0 0 0 0.0998334 0.9950042\n1.02 nan nan nan nan nan nan nan\n\
                    1.50 0.5 0 0 0 0 0 1\n";
        let trajectory = Trajectory::from_stamped(text).expect("a trajectory");
        let middle = trajectory.at(1.005).expect("a pose");
        assert!((middle.translation.x - 0.05).abs() < 1e-9 && (middle.rotation.angle() - 0.1).abs() < 1e-6);
        assert_eq!(trajectory.at(1.0).expect("a pose").translation.x, 0.0);
        let before_the_gap = trajectory.at(1.014).expect("the near one");
        assert!((before_the_gap.translation.x - 0.1).abs() < 1e-12);
        assert_eq!([1.2, 1.03, 2.0, 0.5].map(|stamp| trajectory.at(stamp)), [None; 4]);
        assert!((trajectory.at(1.49).expect("the near one").translation.x - 0.5).abs() < 1e-12);
        assert_eq!(Trajectory::default().at(1.0), None);
    }

    #[test]
    fn a_log_and_its_json_are_the_same() {
        let pose = Isometry3::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.2, 0.4, -0.3));
        let matrix = pose.to_homogeneous();
        let rows: Vec<String> = (0..4)
            .map(|row| (0..4).map(|column| matrix[(row, column)].to_string()).collect::<Vec<_>>().join(" "))
            .collect();
        let log = format!("7 7 8\n{}\n8 8 9\n{}\n", rows.join("\n"), "nan nan nan nan\n".repeat(4));
        let read = from_log(&log).expect("poses");
        assert_eq!((read[0].0, read[1]), (7, (8, None)));
        let near = |found: Option<Isometry3<f64>>| {
            let off = found.expect("a pose").inverse() * pose;
            off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-9
        };
        assert!(near(read[0].1));
        let inverse = pose.inverse().to_homogeneous();
        let json =
            json!({ "parameters": [{ "extrinsic": inverse.as_slice() }, { "extrinsic": vec![Value::Null; 16] }] });
        let read = from_json(json.as_object().expect("an object")).expect("poses");
        assert!(near(read[0].1) && read[1] == (1, None));
    }

    #[test]
    fn what_is_no_pose_is_named_by_its_line_or_frame() {
        for (text, named) in [
            ("0 0 1\n1 0 0 0\n0 1 0 0\n", "frame 0"),
            ("0 0 1\n1 0 0 0\n0 1 0 x\n0 0 1 0\n0 0 0 1\n", "line 3"),
            ("0 0 1\n2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n", "not a rotation"),
            ("0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 9\n", "last row"),
            ("1 0 0 0\n", "line 1"),
        ] {
            let error = from_log(text).expect_err("no pose");
            assert!(error.contains(named), "{text}: {error}");
        }
        for (text, named) in
            [("1 0 0 0 0 0 0 2", "length 2"), ("\n1 0 0 0", "line 2: 4 numbers"), ("nan 0 0 0 0 0 0 1", "stamp")]
        {
            let error = Trajectory::from_stamped(text).expect_err("no pose");
            assert!(error.contains(named), "{text}: {error}");
        }
        let json = json!({ "parameters": [{ "extrinsic": [1.0, 2.0] }] });
        let error = from_json(json.as_object().expect("an object")).expect_err("no pose");
        assert!(error.contains("parameters[0].extrinsic"), "{error}");
    }

    proptest! {
        #[test]
        fn any_text_is_a_trajectory_or_refused(text in "([-0-9.eEna# ]{0,30}\n){0,8}") {
            let _ = from_log(&text);
            if let Ok(trajectory) = Trajectory::from_stamped(&text) {
                let _ = trajectory.at(1.0);
            }
        }
    }
}
