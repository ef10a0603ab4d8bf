//! What stands behind the `?` of a GenICam camera's address.

use semascan_sources::camera::{TIMING_KEYS, Timing};
use semascan_sources::recording::Key;
use std::path::PathBuf;

/// Options of GenICam cameras, beside those of all cameras.
pub const KEYS: &[Key] = &[
    Key {
        name: "depth",
        meaning: "name of a second camera that measures depth; by default the first one's range component",
    },
    Key {
        name: "cameras",
        meaning: "folder that describes the lenses: camera_intrinsic.json and, of a depth camera of its own, depth_intrinsic.json",
    },
    Key {
        name: "size",
        meaning: "columns and rows of the pictures, from the sensor's corner, as 640x480; by default as they are set",
    },
    Key { name: "exposure_us", meaning: "exposure, microseconds; by default as the camera is set" },
    Key { name: "gain", meaning: "gain, in the camera's unit; by default as it is set" },
    Key {
        name: "trigger",
        meaning: "`free`, `software` for each view, or the line that triggers it, as `Line1` (free)",
    },
    Key { name: "pixel_format", meaning: "format of the colours, as RGB8; by default as the camera is set" },
    Key { name: "depth_format", meaning: "format of a second camera's depth, as Coord3D_C16; by default as it is set" },
    Key { name: "depth_unit_mm", meaning: "millimetres of a depth of 1; by default as the camera says" },
];

/// Which camera, and how it is set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GenicamOptions {
    /// Name of the camera; empty for the only one.
    pub name: String,
    /// When views are taken.
    pub timing: Timing,
    /// Name of a second camera that measures depth.
    pub depth: Option<String>,
    /// Folder that describes the lenses.
    pub cameras: Option<PathBuf>,
    /// Columns and rows of the pictures of all cameras.
    pub size: Option<(u32, u32)>,
    /// Exposure, microseconds.
    pub exposure_us: Option<f64>,
    /// Gain, in the camera's unit.
    pub gain: Option<f64>,
    /// What triggers it.
    pub trigger: Trigger,
    /// Format of the colours.
    pub pixel_format: Option<String>,
    /// Format of a second camera's depth.
    pub depth_format: Option<String>,
    /// Millimetres of a depth of 1.
    pub depth_unit_mm: Option<f64>,
}

/// What triggers a camera.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Trigger {
    /// Nothing: it takes pictures at its own rate.
    #[default]
    Free,
    /// Each view.
    Software,
    /// A signal on this line.
    Line(String),
}

impl GenicamOptions {
    /// Reads `NAME?key=value&...`.
    ///
    /// # Errors
    /// What is wrong, naming the key.
    pub fn read(address: &str) -> Result<Self, String> {
        let (name, query) = address.split_once('?').unwrap_or((address, ""));
        let mut options = Self { name: name.trim_matches('/').to_owned(), ..Self::default() };
        for part in query.split('&').filter(|part| !part.is_empty()) {
            let (key, value) = part.split_once('=').ok_or_else(|| format!("{part:?} is no KEY=VALUE"))?;
            if options.timing.take(key, value)? {
                continue;
            }
            let number = || {
                let number = value.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
                number.ok_or_else(|| format!("{key}={value}: is no number above 0"))
            };
            match key {
                "depth" => options.depth = Some(value.to_owned()),
                "cameras" => options.cameras = Some(PathBuf::from(value)),
                "size" => {
                    let edges = value.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
                    let edges = edges.filter(|(w, h)| (1..=65_535).contains(w) && (1..=65_535).contains(h));
                    options.size = Some(edges.ok_or_else(|| format!("size={value}: is no size as 640x480"))?);
                }
                "exposure_us" => options.exposure_us = Some(number()?),
                "gain" => options.gain = Some(number()?),
                "trigger" => {
                    options.trigger = match value {
                        "free" => Trigger::Free,
                        "software" => Trigger::Software,
                        line if line.starts_with("Line") => Trigger::Line(line.to_owned()),
                        _ => {
                            return Err(format!(
                                "trigger={value}: is neither `free` nor `software` nor a line, as Line1"
                            ));
                        }
                    }
                }
                "pixel_format" => options.pixel_format = Some(value.to_owned()),
                "depth_format" => options.depth_format = Some(value.to_owned()),
                "depth_unit_mm" => options.depth_unit_mm = Some(number()?),
                _ => {
                    let known: Vec<&str> = KEYS.iter().chain(TIMING_KEYS).map(|key| key.name).collect();
                    return Err(format!("a GenICam camera has no option {key:?}; there are {}", known.join(", ")));
                }
            }
        }
        Ok(options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_is_taken_and_no_other() {
        let query = "depth=B&cameras=/cell&size=640x480&exposure_us=8000&gain=2.5&trigger=Line1&pixel_format=RGB8\
                     &depth_format=Coord3D_C16&depth_unit_mm=0.25&interval_ms=100";
        for key in KEYS {
            assert!(query.contains(&format!("{}=", key.name)), "{}", key.name);
        }
        let options = GenicamOptions::read(&format!("Acme-17?{query}")).expect("known keys");
        assert_eq!((options.name.as_str(), options.depth.as_deref()), ("Acme-17", Some("B")));
        assert_eq!((options.trigger, options.depth_unit_mm), (Trigger::Line("Line1".to_owned()), Some(0.25)));
        assert_eq!(GenicamOptions::read(""), Ok(GenicamOptions::default()));
        for wrong in ["gain=0", "gain=x", "size=640", "size=0x1", "trigger=always", "colour=1", "views=0", "depth"] {
            let said = GenicamOptions::read(&format!("A?{wrong}")).expect_err(wrong);
            assert!(said.contains(wrong.split('=').next().expect("a key")), "{said}");
        }
    }
}
