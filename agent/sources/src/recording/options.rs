//! How a recording is read where that is not clear from itself: keys behind a `?`, as in `x.mcap?shift_mm=5&fixed_frame=map`.

use crate::camera_model::DepthEncoding;
use crate::cell_calibration::CellCalibration;
use crate::messages::{Stamp, StampedTransform, frame_name};
use crate::pairing::TOLERANCE;
use nalgebra::{Isometry3, Vector3};
use std::path::Path;

/// How a recording is read.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingOptions {
    /// What was written behind the `?`, so that the recording can be opened again in the same way.
    pub query: String,
    /// Topic of the colour pictures.
    pub color: Option<String>,
    /// Topic of the depth pictures or organized clouds.
    pub depth: Option<String>,
    /// Topic of the colour camera's calibration.
    pub color_calibration: Option<String>,
    /// Topic of the depth camera's calibration.
    pub depth_calibration: Option<String>,
    /// Frame that the part stands still in: the views' poses are given in it. By default the root of the camera's tree.
    pub fixed_frame: Option<String>,
    /// The camera's optical frame, where the pictures name another or none.
    pub camera_frame: Option<String>,
    /// The calibrated camera on the robot's end effector.
    pub hand_eye: Option<HandEye>,
    /// The calibrated turntable that the part stands on.
    pub turntable: Option<Turntable>,
    /// Furthest that colour and depth of a view may be apart in time, nanoseconds.
    pub pairing_tolerance: u64,
    /// How long a transform is held before its first and after its last stamp, nanoseconds.
    pub transform_tolerance: u64,
    /// Least motion between two views, metres: with less and less than `least_turn` a pair is passed over.
    pub least_shift: f64,
    /// Least turn between two views, radians.
    pub least_turn: f64,
    /// The depth camera that took it, where its files do not say what their depth is.
    pub device: Option<&'static DepthEncoding>,
}

impl Default for RecordingOptions {
    fn default() -> Self {
        Self {
            query: String::new(),
            color: None,
            depth: None,
            color_calibration: None,
            depth_calibration: None,
            fixed_frame: None,
            camera_frame: None,
            hand_eye: None,
            turntable: None,
            pairing_tolerance: TOLERANCE,
            transform_tolerance: TOLERANCE,
            least_shift: 0.0,
            least_turn: 0.0,
            device: None,
        }
    }
}

/// A camera whose place on the robot was calibrated.
#[derive(Clone, Debug, PartialEq)]
pub struct HandEye {
    /// The end effector's frame.
    pub ee_frame: String,
    /// The camera in that frame.
    pub ee_from_camera: Isometry3<f64>,
}

/// A turntable whose axis was calibrated and whose angle a joint says.
#[derive(Clone, Debug, PartialEq)]
pub struct Turntable {
    /// Name of the joint; its position is in radians.
    pub joint: String,
    /// The frame that the table was calibrated in.
    pub base_frame: String,
    /// The table at angle 0 in that frame, its z axis the table's.
    pub base_from_tablebase: Isometry3<f64>,
}

/// Name of the frame that turns with the table.
pub(crate) const TABLE_FRAME: &str = "turntable";

impl Turntable {
    /// The transform that a joint's position is.
    pub(crate) fn transform(&self, stamp: Stamp, angle: f64) -> StampedTransform {
        let parent_from_child = self.base_from_tablebase * Isometry3::rotation(Vector3::z() * angle);
        StampedTransform { stamp, parent: self.base_frame.clone(), child: TABLE_FRAME.to_owned(), parent_from_child }
    }
}

/// A key and what it means.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// The key.
    pub name: &'static str,
    /// What its value is, with the default.
    pub meaning: &'static str,
}

/// The key that recordings in folders have, too.
pub(crate) const DEVICE: &str = "device";

/// Every key.
pub const KEYS: &[Key] = &[
    Key { name: "color", meaning: "topic of the colour pictures; by default chosen by type and name" },
    Key { name: "depth", meaning: "topic of the depth pictures or organized clouds; by default aligned depth first" },
    Key { name: "color_info", meaning: "topic of the colour camera's calibration" },
    Key { name: "depth_info", meaning: "topic of the depth camera's calibration" },
    Key {
        name: "fixed_frame",
        meaning: "frame that the part stands still in; by default the root of the camera's tree",
    },
    Key { name: "camera_frame", meaning: "the camera's optical frame, if the pictures name another" },
    Key {
        name: "calibration",
        meaning: "a file of `semascan calibrate --out`: with `ee_frame`, `table_joint` or both",
    },
    Key { name: "ee_frame", meaning: "frame of the end effector that the calibrated camera sits on" },
    Key { name: "table_joint", meaning: "joint whose position is the angle of the calibrated turntable" },
    Key { name: "base_frame", meaning: "frame that the turntable was calibrated in: the robot's base" },
    Key { name: "tolerance_ms", meaning: "furthest that colour and depth may be apart in time (20)" },
    Key { name: "tf_tolerance_ms", meaning: "how long a transform is held beyond its last stamp (20)" },
    Key { name: "shift_mm", meaning: "least motion of the camera between two views (0)" },
    Key { name: "turn_deg", meaning: "least turn of the camera between two views (0)" },
    Key {
        name: DEVICE,
        meaning: "the depth camera, for its unit, range and marks of missing depth: d400, d405, d435, l515, azure-kinect, kinect, \
                  orbbec, zivid, ros-float",
    },
];

impl RecordingOptions {
    /// Whether a camera has moved or turned as far as is asked for between two views; it has where nothing is asked for.
    pub(crate) fn is_step(&self, from: &Isometry3<f64>, to: &Isometry3<f64>) -> bool {
        let way = from.inverse() * to;
        let has_moved = self.least_shift > 0.0 && way.translation.vector.norm() >= self.least_shift;
        let has_turned = self.least_turn > 0.0 && way.rotation.angle() >= self.least_turn;
        has_moved || has_turned || (self.least_shift <= 0.0 && self.least_turn <= 0.0)
    }

    /// Takes over what `query` says, as `shift_mm=5&fixed_frame=map`.
    ///
    /// # Errors
    /// What is wrong with it, naming the key.
    pub fn with_query(mut self, query: &str) -> Result<Self, String> {
        self.query = query.to_owned();
        let mut cell = CellKeys::default();
        for part in query.split('&').filter(|part| !part.is_empty()) {
            let Some((key, value)) = part.split_once('=').filter(|(_, value)| !value.is_empty()) else {
                return Err(format!("{part:?} is no KEY=VALUE"));
            };
            let text = || Some(value.to_owned());
            match key {
                "color" => self.color = text(),
                "depth" => self.depth = text(),
                "color_info" => self.color_calibration = text(),
                "depth_info" => self.depth_calibration = text(),
                "fixed_frame" => self.fixed_frame = text(),
                "camera_frame" => self.camera_frame = text(),
                "calibration" => cell.calibration = text(),
                "ee_frame" => cell.ee_frame = text(),
                "table_joint" => cell.table_joint = text(),
                "base_frame" => cell.base_frame = text(),
                "tolerance_ms" => self.pairing_tolerance = nanoseconds(key, value)?,
                "tf_tolerance_ms" => self.transform_tolerance = nanoseconds(key, value)?,
                "shift_mm" => self.least_shift = number(key, value)? * 1e-3,
                "turn_deg" => self.least_turn = number(key, value)?.to_radians(),
                DEVICE => self.device = Some(DepthEncoding::of_option(value)?),
                _ => {
                    let known: Vec<&str> = KEYS.iter().map(|key| key.name).collect();
                    return Err(format!("a recording has no option {key:?}; there are {}", known.join(", ")));
                }
            }
        }
        (self.hand_eye, self.turntable) = cell.read()?;
        if self.turntable.is_some() {
            self.fixed_frame.get_or_insert_with(|| TABLE_FRAME.to_owned());
        }
        Ok(self)
    }
}

/// The keys of a calibrated cell.
#[derive(Default)]
struct CellKeys {
    calibration: Option<String>,
    ee_frame: Option<String>,
    table_joint: Option<String>,
    base_frame: Option<String>,
}

impl CellKeys {
    /// The camera on the end effector and the table, as far as they are asked for.
    fn read(self) -> Result<(Option<HandEye>, Option<Turntable>), String> {
        let Self { calibration, ee_frame, table_joint, base_frame } = self;
        if base_frame.is_some() != table_joint.is_some() {
            return Err(
                "table_joint and base_frame belong together: a joint's angle, and the base that its table is in".into(),
            );
        }
        let Some(path) = calibration else {
            let key = ee_frame.map(|_| "ee_frame").or(table_joint.map(|_| "table_joint"));
            return key.map_or(Ok((None, None)), |key| {
                Err(format!("{key}: calibration=FILE, or `calibration` in cell.toml, must say where it is"))
            });
        };
        let cell = CellCalibration::read(Path::new(&path)).map_err(|reason| format!("calibration={path}: {reason}"))?;
        if ee_frame.is_none() && table_joint.is_none() {
            return Err("calibration: ee_frame, or table_joint and base_frame, must say what it is of".into());
        }
        let lacks = |what: &str| format!("calibration={path}: says nothing of {what}, which did not move");
        let camera = ee_frame.map(|frame| match cell.ee_from_camera {
            Some(ee_from_camera) => Ok(HandEye { ee_frame: frame_name(&frame), ee_from_camera }),
            None => Err(lacks("a camera on an end effector")),
        });
        let table = table_joint.zip(base_frame).map(|(joint, base)| match cell.base_from_tablebase {
            Some(base_from_tablebase) => Ok(Turntable { joint, base_frame: frame_name(&base), base_from_tablebase }),
            None => Err(lacks("a turntable")),
        });
        Ok((camera.transpose()?, table.transpose()?))
    }
}

pub(crate) fn number(key: &str, value: &str) -> Result<f64, String> {
    let number = value.parse::<f64>().ok().filter(|number| number.is_finite() && *number >= 0.0);
    number.ok_or_else(|| format!("{key}={value}: is no number from 0 on"))
}

fn nanoseconds(key: &str, milliseconds: &str) -> Result<u64, String> {
    Ok((number(key, milliseconds)? * 1e6) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_is_taken_and_no_other() {
        let folder = tempfile::tempdir().expect("a folder");
        let calibration = folder.path().join("calibration.json");
        let calibrated = r#"{ "pose": { "translation": [0.1, 0, 0], "rotation": { "x": 0, "y": 0, "z": 0, "w": 1 } },
            "rotation_uncertainty_deg": 0.01, "place_uncertainty_mm": 0.1 }"#;
        let content = format!(
            r#"{{ "schema": 1, "captures": [], "warnings": [], "ee_from_camera":
               {calibrated}, "base_from_tablebase": {calibrated} }}"#
        );
        std::fs::write(&calibration, content).expect("written");
        let query = format!(
            "color=/c&depth=/d&color_info=/ci&depth_info=/di&fixed_frame=map&camera_frame=cam&tolerance_ms=7.5\
             &tf_tolerance_ms=1&shift_mm=20&turn_deg=180&device=d435&ee_frame=/tool0&table_joint=j&base_frame=base&calibration={}",
            calibration.display()
        );
        let options = RecordingOptions::default().with_query(&query).expect("known keys");
        let ee_from_camera = Isometry3::translation(0.1, 0.0, 0.0);
        assert_eq!(options.hand_eye, Some(HandEye { ee_frame: "tool0".to_owned(), ee_from_camera }));
        assert_eq!((options.color.as_deref(), options.fixed_frame.as_deref()), (Some("/c"), Some("map")));
        assert_eq!(options.pairing_tolerance, 7_500_000);
        assert!((options.least_shift - 0.02).abs() < 1e-12);
        for key in KEYS {
            assert!(query.contains(&format!("{}=", key.name)), "{}", key.name);
        }
        for wrong in [
            "hand_eye=/none.json&ee_frame=a",
            "hand_eye=a.json",
            "ee_frame=a",
            "colour=/c",
            "every=2",
            "shift_mm",
            "tolerance_ms=-1",
            "device=toaster",
            "shift_mm=nan",
            "color=",
        ] {
            assert!(RecordingOptions::default().with_query(wrong).is_err(), "{wrong}");
        }
        assert_eq!(RecordingOptions::default().with_query(""), Ok(RecordingOptions::default()));
    }
}
