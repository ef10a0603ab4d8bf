//! What RealSense's recorder writes as text because ROS has no message for it: the unit of its depth, which differs between
//! cameras, with each picture (`/device_0/sensor_0/Depth_0/image/metadata`).

/// What the topics of these texts end with.
const ENDING: &str = "/image/metadata";

/// Whether texts on `topic` may be such.
pub(crate) fn is_metadata(topic: &str) -> bool {
    topic.ends_with(ENDING)
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
    fn the_unit_of_depth_is_read() {
        let topic = "/device_0/sensor_0/Depth_0/image/metadata";
        let unit = depth_unit(topic, "Frame number=0;timestamp=1000.000000;depth_units=0.000100;");
        assert_eq!(unit, Some(("/device_0/sensor_0/Depth_0", 0.0001)));
        assert_eq!(depth_unit(topic, "Frame number=0;"), None);
        assert_eq!(depth_unit(topic, "depth_units=0;"), None);
        assert_eq!(depth_unit("/device_0/info", "depth_units=0.1"), None);
    }
}
