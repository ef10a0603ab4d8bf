//! From a source's URI or path to the source: what this binary was built with.

use semascan_inspection::source::{Source, SourceError};
#[cfg(feature = "demo")]
use semascan_inspection::spec::CameraMask;
use semascan_inspection::spec::InspectionSpec;
#[cfg(feature = "demo")]
use semascan_simulation::{KEYS, PARTS, VirtualCell, VirtualCellSpec};
use semascan_sources::camera::TIMING_KEYS;
use semascan_sources::live::LIVE_KEYS;
use semascan_sources::recording::{KEYS as RECORDING_KEYS, Key};

/// Opens what `uri` names for an inspection as `spec` says: `virtual:...`, a camera at this machine, or what [`semascan_sources::open`] knows.
///
/// # Errors
/// [`SourceError`] if the source is unknown or cannot be opened.
pub(crate) fn open(uri: &str, spec: &InspectionSpec) -> Result<Box<dyn Source>, SourceError> {
    #[cfg(feature = "demo")]
    if uri.starts_with("virtual:") {
        if let CameraMask::File(mask) = &spec.source.camera_mask {
            tracing::warn!("{}: not used, a simulated camera sees nothing of its robot", mask.display());
        }
        // A mesh that is put on the turntable names no unit: the cell's key does.
        let unit =
            spec.source.unit.map(|unit| format!("{}unit={}", if uri.contains('?') { '&' } else { '?' }, unit.name()));
        let uri = format!("{uri}{}", unit.unwrap_or_default());
        return Ok(Box::new(VirtualCell::open(&VirtualCellSpec::parse(&uri)?)?));
    }
    if semascan_realsense::is_address(uri) {
        return semascan_realsense::open(uri, spec);
    }
    if semascan_genicam::is_address(uri) {
        return semascan_genicam::open(uri, spec);
    }
    semascan_sources::open(uri, spec)
}

/// What can be inspected, for the help of every command that inspects.
pub(crate) fn help() -> String {
    let listed =
        |keys: &[Key]| keys.iter().map(|key| format!("    {:<17} {}\n", key.name, key.meaning)).collect::<String>();
    let (live, keys, timing) = (listed(LIVE_KEYS), listed(RECORDING_KEYS), listed(TIMING_KEYS));
    let (realsense, genicam) = (listed(semascan_realsense::KEYS), listed(semascan_genicam::KEYS));
    let recorded = format!(
        "Sources:\n  DIR  a BOP scene folder (rgb/, depth/, scene_camera.json), a recording of an RGB-D camera (TUM RGB-D,\n       \
         7-Scenes, Open3D, Redwood), both with ?device=CAMERA where nothing says what their depth is, or a folder of organized PCD, PLY or ZDF files\n  \
         x.mcap  a capture that `semascan serve|inspect --data` recorded\n  \
         x.mcap, x.db3, x.bag, DIR  a robot's recording (MCAP, ROS 2 bag, ROS 1 bag); behind it ?KEY=VALUE&KEY=VALUE, with \
         the keys\n{keys}  ws://HOST:PORT  a live camera or robot that speaks Foxglove's WebSocket protocol (foxglove_bridge of ROS, \
         Foxglove's SDK); behind it the same keys and\n{live}  realsense:SERIAL  a RealSense camera at this machine, where librealsense2 is \
         installed; without SERIAL the only one. Behind it ?KEY=VALUE&KEY=VALUE, with the keys\n{realsense}{timing}  \
         genicam:NAME  a GigE Vision or USB3 Vision camera that measures depth (builds with the feature genicam), with the \
         keys\n{genicam}{timing}"
    );
    #[cfg(not(feature = "demo"))]
    let simulated = String::new();
    #[cfg(feature = "demo")]
    let simulated = {
        let keys = KEYS.iter().map(|key| {
            let part = key.part.map_or_else(String::new, |part| format!("{part} only: "));
            format!("    {:<10} {part}{}\n", key.name, key.meaning)
        });
        format!(
            "  virtual:PART?KEY=VALUE&KEY=VALUE  a simulated cell; PART is {}, and the keys with their defaults are\n{}",
            PARTS.join(" or "),
            keys.collect::<String>()
        )
    };
    format!("{recorded}{}", simulated.trim_end())
}

#[cfg(all(test, feature = "demo"))]
mod tests {
    use super::*;

    #[test]
    fn the_help_names_every_key_with_its_meaning() {
        let help = help();
        for key in KEYS {
            let is_its = |line: &&str| line.trim_start().starts_with(&format!("{} ", key.name));
            assert!(help.lines().filter(is_its).any(|line| line.contains(key.meaning)), "{}", key.name);
        }
    }
}
