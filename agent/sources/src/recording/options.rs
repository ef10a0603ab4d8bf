//! How a recording is read where that is not clear from itself: keys behind a `?`, as in `x.mcap?shift_mm=5&fixed_frame=map`.

use crate::pairing::TOLERANCE;
use nalgebra::Isometry3;

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
    /// Furthest that colour and depth of a view may be apart in time, nanoseconds.
    pub pairing_tolerance: u64,
    /// How long a transform is held before its first and after its last stamp, nanoseconds.
    pub transform_tolerance: u64,
    /// Least motion between two views, metres: with less and less than `least_turn` a pair is passed over.
    pub least_shift: f64,
    /// Least turn between two views, radians.
    pub least_turn: f64,
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
            pairing_tolerance: TOLERANCE,
            transform_tolerance: TOLERANCE,
            least_shift: 0.0,
            least_turn: 0.0,
        }
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
    Key { name: "tolerance_ms", meaning: "furthest that colour and depth may be apart in time (20)" },
    Key { name: "tf_tolerance_ms", meaning: "how long a transform is held beyond its last stamp (20)" },
    Key { name: "shift_mm", meaning: "least motion of the camera between two views (0)" },
    Key { name: "turn_deg", meaning: "least turn of the camera between two views (0)" },
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
                "tolerance_ms" => self.pairing_tolerance = nanoseconds(key, value)?,
                "tf_tolerance_ms" => self.transform_tolerance = nanoseconds(key, value)?,
                "shift_mm" => self.least_shift = number(key, value)? * 1e-3,
                "turn_deg" => self.least_turn = number(key, value)?.to_radians(),
                _ => {
                    let known: Vec<&str> = KEYS.iter().map(|key| key.name).collect();
                    return Err(format!("a recording has no option {key:?}; there are {}", known.join(", ")));
                }
            }
        }
        Ok(self)
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
        let query = "color=/c&depth=/d&color_info=/ci&depth_info=/di&fixed_frame=map&camera_frame=cam&tolerance_ms=7.5\
                     &tf_tolerance_ms=1&shift_mm=20&turn_deg=180";
        let options = RecordingOptions::default().with_query(query).expect("known keys");
        assert_eq!((options.color.as_deref(), options.fixed_frame.as_deref()), (Some("/c"), Some("map")));
        assert_eq!(options.pairing_tolerance, 7_500_000);
        assert!((options.least_shift - 0.02).abs() < 1e-12);
        for key in KEYS {
            assert!(query.contains(&format!("{}=", key.name)), "{}", key.name);
        }
        for wrong in ["colour=/c", "every=2", "shift_mm", "tolerance_ms=-1", "shift_mm=nan", "color="] {
            assert!(RecordingOptions::default().with_query(wrong).is_err(), "{wrong}");
        }
        assert_eq!(RecordingOptions::default().with_query(""), Ok(RecordingOptions::default()));
    }
}
