//! `[cell]` of `cell.toml`: what the cell is, whatever is inspected in it: its camera's topics, its frames, its calibration. Live
//! sources and robots' recordings are opened with it as if it stood behind their `?`; what stands there wins.

use semascan_inspection::spec::InspectionSpec;
use semascan_sources::live::LiveAddress;
use semascan_sources::recording::RecordingSource;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The section.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct CellSection {
    /// What `semascan calibrate` found: the camera on the robot, the axis of the table.
    pub(crate) calibration: Option<PathBuf>,
    /// The folder that inspections and users are kept in.
    pub(crate) data: Option<PathBuf>,
    /// Least and most metres between the camera and the part.
    pub(crate) working_distance: Option<[f64; 2]>,
    /// The camera.
    pub(crate) camera: CameraSection,
    /// Names of the frames.
    pub(crate) frames: FramesSection,
}

/// `[cell.camera]`: topics, and when a view is taken.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct CameraSection {
    /// Topic of the colour pictures.
    pub(crate) color: Option<String>,
    /// Topic of the depth pictures.
    pub(crate) depth: Option<String>,
    /// Topic of the colour camera's calibration.
    pub(crate) color_info: Option<String>,
    /// Topic of the depth camera's calibration.
    pub(crate) depth_info: Option<String>,
    /// Pictures a second that are expected.
    pub(crate) rate_hz: Option<f64>,
    /// When a pair becomes a view.
    pub(crate) trigger: Option<String>,
    /// How long the camera rests before that, with `trigger = "still"`.
    pub(crate) still_ms: Option<f64>,
    /// Furthest that colour and depth may be apart in time.
    pub(crate) tolerance_ms: Option<f64>,
    /// The stream is over after so many seconds without a picture.
    pub(crate) silence_s: Option<f64>,
    /// A new file into which everything is recorded.
    pub(crate) record: Option<PathBuf>,
}

/// `[cell.frames]`: names in the robot's transforms.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct FramesSection {
    /// The robot's base.
    pub(crate) base: Option<String>,
    /// The end effector.
    pub(crate) ee: Option<String>,
    /// The camera's optical frame.
    pub(crate) camera: Option<String>,
    /// What the part stands still in.
    pub(crate) table: Option<String>,
    /// Joint whose position is the table's angle.
    pub(crate) table_joint: Option<String>,
}

impl CellSection {
    /// What is wrong with a value, naming its key.
    pub(crate) fn check(&self) -> Result<(), String> {
        if let Some([least, most]) = self.working_distance
            && !(least > 0.0 && least < most && most.is_finite())
        {
            return Err(format!(
                "working_distance: [{least}, {most}] are not two distances in metres, the smaller first"
            ));
        }
        if let Some(rate) = self.camera.rate_hz
            && !(rate > 0.0 && rate.is_finite())
        {
            return Err(format!("camera.rate_hz: {rate} is no number of pictures a second"));
        }
        if let Some((key, value)) = self.keys(true).into_iter().find(|(_, value)| value.contains(['&', '?'])) {
            return Err(format!("{key}: {value:?} must have neither & nor ?"));
        }
        // What is wrong with a value of the source is said now, and not when it is opened.
        let query = query(&self.keys(true).into_iter().filter(|(key, _)| !OF_FILES.contains(key)).collect::<Vec<_>>());
        LiveAddress::read(&format!("ws://cell?{query}")).map(drop)
    }

    /// Completes the address of the source that `spec` names, where it is one that takes keys.
    pub(crate) fn complete(&self, spec: &mut InspectionSpec) {
        let Some(uri) = &spec.source.uri else { return };
        let path = uri.split_once('?').map_or(uri.as_str(), |(path, _)| path);
        let is_live = LiveAddress::is_one(uri);
        if !is_live && !RecordingSource::is_recording(Path::new(path)) {
            return;
        }
        let said: Vec<&str> = uri.split_once('?').map_or(Vec::new(), |(_, query)| query.split('&').collect());
        let is_said = |key: &str| said.iter().any(|part| part.split_once('=').is_some_and(|(name, _)| name == key));
        let keys: Vec<_> = self.keys(is_live).into_iter().filter(|(key, _)| !is_said(key)).collect();
        if !keys.is_empty() {
            let separator = if said.is_empty() && !uri.contains('?') { "?" } else { "&" };
            spec.source.uri = Some(format!("{uri}{separator}{}", query(&keys)));
        }
    }

    /// The keys of the source, and their values: those of live sources too where it is one.
    fn keys(&self, is_live: bool) -> Vec<(&'static str, String)> {
        let Self { calibration, camera, frames, .. } = self;
        let path = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
        let number = |number: Option<f64>| number.map(|number| number.to_string());
        let joint = frames.table_joint.as_ref();
        let of_recordings = [
            ("color", camera.color.clone()),
            ("depth", camera.depth.clone()),
            ("color_info", camera.color_info.clone()),
            ("depth_info", camera.depth_info.clone()),
            ("tolerance_ms", number(camera.tolerance_ms)),
            ("camera_frame", frames.camera.clone()),
            ("fixed_frame", frames.table.clone()),
            ("calibration", path(calibration)),
            ("ee_frame", frames.ee.clone().filter(|_| calibration.is_some())),
            ("table_joint", joint.cloned().filter(|_| calibration.is_some())),
            ("base_frame", frames.base.clone().filter(|_| joint.is_some() && calibration.is_some())),
        ];
        let of_live = [
            ("trigger", camera.trigger.clone()),
            ("still_ms", number(camera.still_ms)),
            ("silence_s", number(camera.silence_s)),
            ("record", path(&camera.record)),
        ];
        let keys = of_recordings.into_iter().chain(of_live.into_iter().filter(|_| is_live));
        keys.filter_map(|(key, value)| Some((key, value?))).collect()
    }
}

/// Keys that need files, which may not be there yet.
const OF_FILES: [&str; 5] = ["calibration", "ee_frame", "table_joint", "base_frame", "record"];

fn query(keys: &[(&str, String)]) -> String {
    keys.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join("&")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn completed(section: &str, uri: &str) -> String {
        let cell: CellSection = toml::from_str(section).expect("a section");
        cell.check().expect("right");
        let mut spec = InspectionSpec::default();
        spec.source.uri = Some(uri.to_owned());
        cell.complete(&mut spec);
        spec.source.uri.expect("a source")
    }

    #[test]
    fn a_live_source_gets_the_keys_of_the_cell_and_its_own_win() {
        let section = "calibration = \"/cell/calibration.json\"\n[camera]\ncolor = \"/c\"\ntrigger = \"still\"\nstill_ms = 250\n\
                       [frames]\nee = \"tool0\"\nbase = \"base_link\"\ntable_joint = \"axis_7\"";
        let expected = "color=/c&calibration=/cell/calibration.json&ee_frame=tool0&table_joint=axis_7&base_frame=base_link&\
                        trigger=still&still_ms=250";
        assert_eq!(completed(section, "ws://cell"), format!("ws://cell?{expected}"));
        let own = completed(section, "ws://cell?trigger=asked&views=3");
        assert!(own.starts_with("ws://cell?trigger=asked&views=3&color=/c") && !own.contains("still&"), "{own}");
        assert_eq!(completed(section, "virtual:starter-motor"), "virtual:starter-motor");
        assert_eq!(completed("", "ws://cell"), "ws://cell");
        // Frames without a calibration are for the doctor alone.
        assert_eq!(completed("[frames]\nee = \"tool0\"\nbase = \"b\"\ntable_joint = \"j\"", "ws://cell"), "ws://cell");
    }

    #[test]
    fn values_that_cannot_be_used_are_named() {
        for (wrong, word) in [
            ("working_distance = [0.5, 0.2]", "working_distance"),
            ("working_distance = [0.0, 0.2]", "working_distance"),
            ("[camera]\nrate_hz = 0.0", "rate_hz"),
            ("[camera]\ntrigger = \"noise\"", "trigger"),
            ("[camera]\nstill_ms = -3.0", "still_ms"),
            ("[camera]\ncolor = \"/a&views=1\"", "color"),
        ] {
            let cell: CellSection = toml::from_str(wrong).expect(wrong);
            let said = cell.check().expect_err(wrong);
            assert!(said.contains(word), "{said}");
        }
    }
}
