//! Which topics of a recording are colour, depth and their calibrations, by type and name; options name others.
//!
//! Depth that was aligned to the colour picture comes first, for the product needs both in one camera. Of several cameras the
//! colour is taken whose topic has most of its name in common with that of the depth.

use super::index::{CalibrationStream, Index, PictureStream};
use super::options::RecordingOptions;
use crate::messages::{Content, Kind};

/// Words in the name of depth that lies in the colour picture.
const ALIGNED: &[&str] = &["aligned", "registered", "depth_to_color", "depth_to_rgb"];
/// Words in the name of pictures that are no view of a camera.
const DERIVED: &[&str] = &["mask", "label", "segment", "overlay", "annotat", "debug", "confidence", "disparity", "vis"];
/// Words in the name of infrared pictures.
const INFRARED: &[&str] = &["infra", "/ir/", "/ir_", "_ir/", "/ir"];
/// What transports put behind the name of a topic.
const TRANSPORTS: &[&str] = &["/compressed", "/compressedDepth"];

/// The topics that views are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chosen<'a> {
    /// `None` where the depth is a cloud that has its own colours, or none.
    pub(crate) color: Option<&'a PictureStream>,
    pub(crate) depth: &'a PictureStream,
    /// `None` where the depth is a cloud.
    pub(crate) color_calibration: Option<&'a CalibrationStream>,
    pub(crate) depth_calibration: Option<&'a CalibrationStream>,
}

impl<'a> Chosen<'a> {
    /// Chooses; the error says what is missing and what there is instead.
    pub(crate) fn of(index: &'a Index, options: &RecordingOptions) -> Result<Self, String> {
        let depth = match &options.depth {
            Some(topic) => named(index, topic, &[Content::Depth, Content::Cloud], "depth")?,
            None => best(index, Content::Depth, depth_rank)
                .or_else(|| best(index, Content::Cloud, depth_rank))
                .ok_or_else(|| format!("no topic has depth pictures or point clouds{}", list(index)))?,
        };
        let color_rank = |stream: &PictureStream| color_rank(stream, &depth.topic);
        let color = match &options.color {
            Some(topic) => Some(named(index, topic, &[Content::Color], "color")?),
            None => best(index, Content::Color, color_rank),
        };
        if depth.content == Content::Cloud {
            return Ok(Self { color, depth, color_calibration: None, depth_calibration: None });
        }
        let color = color.ok_or_else(|| format!("no topic has colour pictures{}", list(index)))?;
        let color_calibration = calibration(index, color, options.color_calibration.as_deref(), "color_info")?;
        let depth_calibration = calibration(index, depth, options.depth_calibration.as_deref(), "depth_info")?;
        Ok(Self {
            color: Some(color),
            depth,
            color_calibration: Some(color_calibration),
            depth_calibration: Some(depth_calibration),
        })
    }
}

/// Whether the pictures of a topic are rectified, so that its calibration's P is theirs.
pub(crate) fn is_rectified(topic: &str) -> bool {
    without_transport(topic).rsplit('/').take(2).any(|name| name.contains("rect"))
}

/// Whether the name of a topic says that its depth lies in the colour picture.
pub(crate) fn is_aligned(topic: &str) -> bool {
    has(topic, ALIGNED)
}

/// The stream that an option names.
fn named<'a>(index: &'a Index, topic: &str, contents: &[Content], key: &str) -> Result<&'a PictureStream, String> {
    let mut of_topic = index.pictures.iter().filter(|stream| stream.topic == topic);
    of_topic
        .find(|stream| contents.contains(&stream.content))
        .ok_or_else(|| format!("{key}={topic}: no such topic with such pictures{}", list(index)))
}

/// The stream of most rank; of equal ones the first by name.
fn best<R: Ord>(index: &Index, content: Content, rank: impl Fn(&PictureStream) -> R) -> Option<&PictureStream> {
    let streams = index.pictures.iter().filter(|stream| stream.content == content);
    streams.max_by(|a, b| rank(a).cmp(&rank(b)).then_with(|| b.topic.cmp(&a.topic)))
}

fn depth_rank(stream: &PictureStream) -> (bool, bool, bool, bool) {
    let topic = &stream.topic;
    let is_raw = stream.kind == Kind::Image;
    (!has(topic, DERIVED) && !has(topic, INFRARED), is_aligned(topic), has(topic, &["depth"]), is_raw)
}

fn color_rank(stream: &PictureStream, depth: &str) -> (bool, bool, usize, bool, bool) {
    let topic = &stream.topic;
    let is_plain = !has(topic, DERIVED) && !has(topic, INFRARED);
    let is_raw = stream.kind == Kind::Image;
    (is_plain, has(topic, &["color", "colour", "rgb"]), in_common(topic, depth), is_rectified(topic), is_raw)
}

fn has(topic: &str, words: &[&str]) -> bool {
    let topic = topic.to_ascii_lowercase();
    words.iter().any(|word| topic.contains(word))
}

/// How many names two topics have in common from the first on.
fn in_common(a: &str, b: &str) -> usize {
    a.split('/').zip(b.split('/')).take_while(|(a, b)| a == b).count()
}

fn without_transport(topic: &str) -> &str {
    TRANSPORTS.iter().find_map(|transport| topic.strip_suffix(transport)).unwrap_or(topic)
}

/// The calibration of a stream's camera: beside its pictures, of the same frame, or the only one there is.
fn calibration<'a>(
    index: &'a Index,
    stream: &PictureStream,
    wanted: Option<&str>,
    key: &str,
) -> Result<&'a CalibrationStream, String> {
    let all = &index.calibrations;
    let topics = || all.iter().map(|calibration| calibration.topic.as_str()).collect::<Vec<_>>().join(", ");
    if let Some(topic) = wanted {
        let found = all.iter().find(|calibration| calibration.topic == topic);
        return found.ok_or_else(|| format!("{key}={topic}: no such topic with calibrations; there are {}", topics()));
    }
    let base = without_transport(&stream.topic);
    let beside = base.rsplit_once('/').map_or("camera_info".to_owned(), |(parent, _)| format!("{parent}/camera_info"));
    let rank = |calibration: &CalibrationStream| {
        let is_frames = !stream.frame.is_empty() && calibration.frame() == stream.frame;
        (calibration.topic == beside, is_frames, in_common(&calibration.topic, &stream.topic))
    };
    let best = all.iter().max_by(|a, b| rank(a).cmp(&rank(b)).then_with(|| b.topic.cmp(&a.topic)));
    match best {
        Some(calibration) if rank(calibration).0 || rank(calibration).1 || all.len() == 1 => Ok(calibration),
        Some(_) => Err(format!("which calibration is that of {}? Name it with {key}: {}", stream.topic, topics())),
        None => Err("no topic has calibrations of cameras, so the pictures cannot be measured in".to_owned()),
    }
}

/// The topics that have pictures, as the end of a sentence.
fn list(index: &Index) -> String {
    let topics = index.pictures.iter().map(|stream| {
        let content = match stream.content {
            Content::Color => "colour",
            Content::Depth => "depth",
            Content::Cloud => "points",
        };
        format!("{} ({content})", stream.topic)
    });
    let topics: Vec<String> = topics.collect();
    if topics.is_empty() { "; it has no pictures at all".to_owned() } else { format!("; it has {}", topics.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Calibration, Encoding, Header, Stamp};
    use crate::transforms::TransformTree;

    fn index(topics: &[(&str, Content, Kind, &str)], calibrations: &[(&str, &str)]) -> Index {
        let pictures = topics.iter().map(|(topic, content, kind, frame)| PictureStream {
            topic: (*topic).to_owned(),
            kind: *kind,
            encoding: Encoding::Cdr,
            content: *content,
            frame: (*frame).to_owned(),
            pictures: Vec::new(),
        });
        let calibrations = calibrations.iter().map(|(topic, frame)| {
            let calibration = Calibration {
                header: Header { stamp: Stamp::default(), frame: (*frame).to_owned() },
                width: 4,
                height: 3,
                distortion_model: String::new(),
                distortion: Vec::new(),
                k: [0.0; 9],
                p: [0.0; 12],
            };
            CalibrationStream::new(topic, Stamp::default(), calibration)
        });
        Index {
            pictures: pictures.collect(),
            calibrations: calibrations.collect(),
            transforms: TransformTree::new(0),
            products: Vec::new(),
            depth_units: Vec::new(),
            faults: Vec::new(),
        }
    }

    #[test]
    fn aligned_depth_and_its_colour_are_chosen() {
        use Content::{Color, Depth};
        use Kind::{CompressedImage, Image};
        let index = index(
            &[
                ("/a/infra1/image_rect_raw", Color, Image, "i"),
                ("/a/color/image_raw/compressed", Color, CompressedImage, "c"),
                ("/a/color/image_raw", Color, Image, "c"),
                ("/b/color/image_raw", Color, Image, "x"),
                ("/b/depth/image_rect_raw", Depth, Image, "d"),
                ("/a/depth/image_rect_raw", Depth, Image, "d"),
                ("/a/aligned_depth_to_color/image_raw/compressedDepth", Depth, CompressedImage, "c"),
                ("/mask/aligned", Depth, Image, "c"),
            ],
            &[
                ("/b/color/camera_info", "x"),
                ("/a/color/camera_info", "c"),
                ("/a/aligned_depth_to_color/camera_info", "c"),
                ("/a/depth/camera_info", "d"),
            ],
        );
        let chosen = Chosen::of(&index, &RecordingOptions::default()).expect("all is there");
        assert_eq!(chosen.depth.topic, "/a/aligned_depth_to_color/image_raw/compressedDepth");
        assert_eq!(chosen.color.expect("colour").topic, "/a/color/image_raw");
        assert_eq!(chosen.color_calibration.expect("colour").topic, "/a/color/camera_info");
        assert_eq!(chosen.depth_calibration.expect("depth").topic, "/a/aligned_depth_to_color/camera_info");
        let query = "depth=/b/depth/image_rect_raw";
        let other = RecordingOptions::default().with_query(query).expect("a topic");
        let chosen = Chosen::of(&index, &other).expect("all is there");
        assert_eq!(chosen.color.expect("colour").topic, "/b/color/image_raw");
        assert_eq!(chosen.depth_calibration.expect("depth").topic, "/a/depth/camera_info", "by its frame");
        let wrong = RecordingOptions { depth: Some("/a/color/image_raw".into()), ..RecordingOptions::default() };
        let said = Chosen::of(&index, &wrong).expect_err("colour");
        assert!(said.contains("/a/depth/image_rect_raw (depth)"), "{said}");
    }

    #[test]
    fn what_is_missing_is_said() {
        let said = |index: &Index| Chosen::of(index, &RecordingOptions::default()).expect_err("missing");
        assert!(said(&index(&[], &[])).contains("no pictures at all"));
        let color = ("/c", Content::Color, Kind::Image, "");
        assert!(said(&index(&[color], &[])).contains("/c (colour)"));
        let depth = ("/d", Content::Depth, Kind::Image, "");
        assert!(said(&index(&[depth], &[])).contains("no topic has colour"));
        assert!(said(&index(&[color, depth], &[])).contains("calibrations"));
        assert!(said(&index(&[color, depth], &[("/x", "a"), ("/y", "b")])).contains("color_info"));
        assert!(Chosen::of(&index(&[color, depth], &[("/x", "a")]), &RecordingOptions::default()).is_ok());
        assert!(is_rectified("/camera/depth/image_rect_raw") && is_rectified("/camera/image_rect/compressed"));
        assert!(!is_rectified("/rectangle/x/color/image_raw"));
    }
}
