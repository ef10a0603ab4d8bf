//! What RealSense's recorder writes as text because ROS has no message for it: the unit of its depth, which differs between
//! cameras, with each picture (`/device_0/sensor_0/Depth_0/image/metadata`), and once what camera it is (`/device_0/info`).

/// What the topics of these texts end with.
const ENDING: &str = "/image/metadata";

/// Whether texts on `topic` may be such.
pub(crate) fn is_metadata(topic: &str) -> bool {
    topic.ends_with(ENDING) || device_of(topic).is_some()
}

/// What the topics of a camera begin with, of the topic that says which camera it is.
fn device_of(topic: &str) -> Option<&str> {
    topic.strip_suffix("/info").filter(|device| device.starts_with("/device_") && device.matches('/').count() == 1)
}

/// What the topics of a camera begin with, and its name, where a text on `topic` says it.
pub(crate) fn product<'a>(topic: &'a str, text: &'a str) -> Option<(&'a str, &'a str)> {
    let device = device_of(topic)?;
    let (_, name) = text.split(';').filter_map(|entry| entry.split_once('=')).find(|(key, _)| *key == "Name")?;
    Some((device, name))
}

/// Metres of a depth of 1, where a text on `topic` says it, and what the topics of its pictures begin with.
pub(crate) fn depth_unit<'a>(topic: &'a str, text: &str) -> Option<(&'a str, f64)> {
    let stream = topic.strip_suffix(ENDING)?;
    let entries = text.split(';').filter_map(|entry| entry.split_once('='));
    let (_, value) = entries.into_iter().find(|(key, _)| *key == "depth_units")?;
    let unit: f64 = value.parse().ok()?;
    (unit.is_finite() && unit > 0.0).then_some((stream, unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_the_camera_is_read() {
        let text = "Name=Intel RealSense D435I;Serial Number=12;";
        assert_eq!(product("/device_0/info", text), Some(("/device_0", "Intel RealSense D435I")));
        assert_eq!(product("/device_0/sensor_0/info", "Name=Depth"), None);
        assert!(is_metadata("/device_0/info") && !is_metadata("/device_0/sensor_0/info"));
    }

    #[test]
    fn the_unit_of_depth_is_read() {
        let topic = "/device_0/sensor_0/Depth_0/image/metadata";
        let unit = depth_unit(topic, "Frame number=0;timestamp=1000.000000;depth_units=0.000100;");
        assert_eq!(unit, Some(("/device_0/sensor_0/Depth_0", 0.0001)));
        assert_eq!(depth_unit(topic, "Frame number=0;"), None);
        assert_eq!(depth_unit(topic, "depth_units=0;"), None);
        assert_eq!(depth_unit("/device_0/info", "depth_units=0.1"), None);
    }
}
