//! What stands behind the `?` of a RealSense camera's address.

use semascan_sources::camera::{TIMING_KEYS, Timing};
use semascan_sources::recording::Key;

/// Options of RealSense cameras, beside those of all cameras.
pub const KEYS: &[Key] = &[
    Key {
        name: "color_size",
        meaning: "pixels of the colour picture, as 1280x720; by default the camera's own choice",
    },
    Key { name: "depth_size", meaning: "pixels of the depth picture, as 848x480; by default the camera's own choice" },
    Key { name: "fps", meaning: "pictures a second; by default the camera's own choice" },
    Key { name: "exposure_us", meaning: "exposure of the colours, microseconds; by default automatic" },
    Key { name: "gain", meaning: "gain of the colours; by default automatic" },
    Key { name: "depth_exposure_us", meaning: "exposure of the depth, microseconds; by default automatic" },
    Key { name: "depth_gain", meaning: "gain of the depth; by default automatic" },
    Key { name: "laser_power", meaning: "power of the projector, in the camera's own unit" },
    Key { name: "trigger", meaning: "`free`, or another camera or signal triggers it: `slave` (free)" },
    Key { name: "tolerance_ms", meaning: "furthest that colour and depth may be apart in time (20)" },
];

/// Which camera, and how it is set.
#[derive(Clone, Debug, PartialEq)]
pub struct RealsenseOptions {
    /// Its serial number; `None` for the only one.
    pub serial: Option<String>,
    /// When views are taken.
    pub timing: Timing,
    /// Columns and rows of the colour picture.
    pub color_size: Option<(u32, u32)>,
    /// Columns and rows of the depth picture.
    pub depth_size: Option<(u32, u32)>,
    /// Pictures a second.
    pub rate: Option<u32>,
    /// Settings of the colour and of the depth sensor.
    pub settings: [SensorSettings; 2],
    /// Whether another camera or a signal triggers it.
    pub is_triggered: bool,
    /// Furthest that colour and depth may be apart in time, seconds.
    pub tolerance: f64,
}

/// Settings of a sensor, in librealsense2's units; what is `None` is left as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorSettings {
    /// Exposure, microseconds.
    pub exposure_us: Option<f64>,
    /// Gain, in the sensor's unit.
    pub gain: Option<f64>,
    /// Power of the projector, in the sensor's unit.
    pub laser_power: Option<f64>,
}

/// Places in [`RealsenseOptions::settings`].
pub(crate) const COLOR: usize = 0;
pub(crate) const DEPTH: usize = 1;

impl Default for RealsenseOptions {
    fn default() -> Self {
        Self {
            serial: None,
            timing: Timing::default(),
            color_size: None,
            depth_size: None,
            rate: None,
            settings: [SensorSettings::default(); 2],
            is_triggered: false,
            tolerance: 0.02,
        }
    }
}

impl RealsenseOptions {
    /// Reads `SERIAL?key=value&...`, or `//SERIAL?...`.
    ///
    /// # Errors
    /// What is wrong, naming the key.
    pub fn read(address: &str) -> Result<Self, String> {
        let (serial, query) = address.split_once('?').unwrap_or((address, ""));
        let serial = serial.trim_matches('/');
        let mut options = Self { serial: (!serial.is_empty()).then(|| serial.to_owned()), ..Self::default() };
        for part in query.split('&').filter(|part| !part.is_empty()) {
            let (key, value) = part.split_once('=').ok_or_else(|| format!("{part:?} is no KEY=VALUE"))?;
            if options.timing.take(key, value)? {
                continue;
            }
            let number = || {
                let number = value.parse::<f64>().ok().filter(|number| number.is_finite() && *number >= 0.0);
                number.ok_or_else(|| format!("{key}={value}: is no number from 0 on"))
            };
            match key {
                "color_size" => options.color_size = Some(size(key, value)?),
                "depth_size" => options.depth_size = Some(size(key, value)?),
                "fps" => options.rate = Some(number()?.round() as u32),
                "exposure_us" => options.settings[COLOR].exposure_us = Some(number()?),
                "gain" => options.settings[COLOR].gain = Some(number()?),
                "depth_exposure_us" => options.settings[DEPTH].exposure_us = Some(number()?),
                "depth_gain" => options.settings[DEPTH].gain = Some(number()?),
                "laser_power" => options.settings[DEPTH].laser_power = Some(number()?),
                "tolerance_ms" => options.tolerance = 1e-3 * number()?,
                "trigger" => {
                    options.is_triggered = match value {
                        "free" => false,
                        "slave" => true,
                        _ => return Err(format!("trigger={value}: is neither `free` nor `slave`")),
                    }
                }
                _ => {
                    let known: Vec<&str> = KEYS.iter().chain(TIMING_KEYS).map(|key| key.name).collect();
                    return Err(format!("a RealSense camera has no option {key:?}; there are {}", known.join(", ")));
                }
            }
        }
        Ok(options)
    }
}

/// Columns and rows, as `1280x720`.
fn size(key: &str, value: &str) -> Result<(u32, u32), String> {
    let parsed = value.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    parsed.filter(|(w, h)| *w > 0 && *h > 0).ok_or_else(|| format!("{key}={value}: is no size as 1280x720"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_is_taken_and_no_other() {
        let query = "color_size=1280x720&depth_size=848x480&fps=15&exposure_us=8000&gain=64&depth_exposure_us=5000\
                     &depth_gain=16&laser_power=150&trigger=slave&tolerance_ms=5&views=3";
        for key in KEYS {
            assert!(query.contains(&format!("{}=", key.name)), "{}", key.name);
        }
        for serial in ["//0123", "0123"] {
            let options = RealsenseOptions::read(&format!("{serial}?{query}")).expect("known keys");
            assert_eq!(options.serial.as_deref(), Some("0123"));
            assert_eq!((options.color_size, options.rate), (Some((1280, 720)), Some(15)));
            assert_eq!(options.settings[COLOR].exposure_us, Some(8000.0));
            assert_eq!(options.settings[DEPTH].laser_power, Some(150.0));
            assert!(options.is_triggered && options.timing.views == Some(3) && options.tolerance == 0.005);
        }
        assert_eq!(RealsenseOptions::read(""), Ok(RealsenseOptions::default()));
        for wrong in ["color_size=12", "fps=x", "gain=-1", "trigger=never", "colour=1", "views=0", "fps"] {
            let said = RealsenseOptions::read(&format!("?{wrong}")).expect_err(wrong);
            assert!(said.contains(wrong.split('=').next().expect("a key")), "{said}");
        }
    }
}
