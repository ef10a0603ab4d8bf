//! A camera on a robot whose stream has faults of every kind, drawn from one seed: each is reported with its topic or field, and the
//! inspection ends with the right views all the same. The robot rests at one place for each fault, so that each place must come out as
//! one view with the place's own colour, depth, pose and intrinsics.
//!
//! `SEMASCAN_TEST_FAULTS` says how many are injected; a few, where it says nothing.

use super::test_server::{Step, camera_info, compressed_channels, image, serve, time, transform, transform_of};
use super::*;
use image::{DynamicImage, GrayImage, ImageBuffer, ImageFormat, Luma, Rgb, RgbImage};
use prost::Message as _;
use semascan_foxglove::schema::CompressedImage;
use semascan_perception::view::PoseEvidence;
use std::collections::BTreeMap;
use std::io::Cursor;

/// Faults that are injected where nobody asks for more.
const FEW: usize = 12;
const SEED: u64 = 17;
/// Milliseconds of a frame.
const FRAME: i64 = 33;
/// Frames at a place before the fault begins, that it lasts, and after it.
const BEFORE: u32 = 4;
const DURING: u32 = 9;
const AFTER: u32 = 22;

/// What is injected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Injected {
    Disconnect,
    Garbage,
    ClockBack,
    ClockForth,
    OneStampAhead,
    MissingTransforms,
    LateCalibration,
    OtherIntrinsics,
    OtherSizeOfCalibration,
    HalfSecondOfSilence,
    ThreeSecondsOfSilence,
    TruncatedJpeg,
    CorruptPng,
    WrongSize,
    WrongEncoding,
    OtherContent,
    NoPicture,
    UnknownChannel,
    OtherNumber,
    NoNumberInPose,
    NoRotation,
    SecondParent,
    Duplicates,
    Reordered,
    LateDepth,
}

const ALL: [Injected; 25] = [
    Injected::Disconnect,
    Injected::Garbage,
    Injected::ClockBack,
    Injected::ClockForth,
    Injected::OneStampAhead,
    Injected::MissingTransforms,
    Injected::LateCalibration,
    Injected::OtherIntrinsics,
    Injected::OtherSizeOfCalibration,
    Injected::HalfSecondOfSilence,
    Injected::ThreeSecondsOfSilence,
    Injected::TruncatedJpeg,
    Injected::CorruptPng,
    Injected::WrongSize,
    Injected::WrongEncoding,
    Injected::OtherContent,
    Injected::NoPicture,
    Injected::UnknownChannel,
    Injected::OtherNumber,
    Injected::NoNumberInPose,
    Injected::NoRotation,
    Injected::SecondParent,
    Injected::Duplicates,
    Injected::Reordered,
    Injected::LateDepth,
];

impl Injected {
    /// What must be reported: the topic, the kind, and a word of the reason. A calibration that is late is waited for, and no fault.
    fn reported(self) -> Option<(&'static str, FaultKind, &'static str)> {
        const COLOR: &str = "/camera/color/image";
        const DEPTH: &str = "/camera/depth/image";
        const INFO: &str = "/camera/color/camera_info";
        Some(match self {
            Self::Disconnect => ("", FaultKind::Connection, "lost"),
            Self::Garbage => ("", FaultKind::Connection, "no message of Foxglove's protocol"),
            Self::ClockBack => (COLOR, FaultKind::Clock, "back"),
            Self::ClockForth => (COLOR, FaultKind::Clock, "forth"),
            Self::OneStampAhead => (COLOR, FaultKind::Clock, "forth"),
            Self::MissingTransforms => ("camera", FaultKind::Pose, "\"table\""),
            Self::LateCalibration => return None,
            Self::OtherIntrinsics => (INFO, FaultKind::Calibration, "K"),
            Self::OtherSizeOfCalibration => (INFO, FaultKind::Calibration, "width and height"),
            Self::HalfSecondOfSilence | Self::ThreeSecondsOfSilence => ("", FaultKind::Silence, "no picture"),
            Self::TruncatedJpeg => (DEPTH, FaultKind::Picture, "/camera/color/image"),
            Self::CorruptPng => (DEPTH, FaultKind::Picture, "field data"),
            Self::WrongSize => (DEPTH, FaultKind::Picture, "/camera/depth/image"),
            Self::WrongEncoding => (DEPTH, FaultKind::Message, "field format"),
            Self::OtherContent => (DEPTH, FaultKind::Picture, "field encoding"),
            Self::NoPicture => (COLOR, FaultKind::Message, "Protocol Buffers"),
            Self::UnknownChannel => ("", FaultKind::Channel, "99"),
            Self::OtherNumber => ("", FaultKind::Channel, "not offered"),
            Self::NoNumberInPose => ("/tf", FaultKind::Message, "field translation"),
            Self::NoRotation => ("/tf", FaultKind::Message, "field rotation"),
            Self::SecondParent => ("camera", FaultKind::Pose, "two parents"),
            Self::Duplicates => (DEPTH, FaultKind::Order, "twice"),
            Self::Reordered => (DEPTH, FaultKind::Order, "after a later one"),
            Self::LateDepth => (DEPTH, FaultKind::Order, "alone"),
        })
    }
}

/// The stream as it is written down.
struct Script {
    steps: Vec<Step>,
    /// The camera's clock, milliseconds.
    clock: i64,
    depth_channel: u32,
    fx: f64,
    /// Focal length by the clock, from which on it holds; pictures of before a jump back are of another life of the clock.
    focal_lengths: Vec<f64>,
}

/// The colour of a place.
fn red(place: usize) -> u8 {
    (place * 37 % 200) as u8 + 20
}

/// Where the camera rests.
fn x(place: usize) -> f64 {
    0.05 * place as f64
}

fn file(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).expect("a picture");
    bytes.into_inner()
}

fn jpeg(place: usize) -> Vec<u8> {
    file(&RgbImage::from_pixel(8, 6, Rgb([red(place), 0, 0])).into(), ImageFormat::Jpeg)
}

fn depth_png(place: usize, (width, height): (u32, u32)) -> Vec<u8> {
    let pixel = Luma([500 + place as u16]);
    file(&DynamicImage::ImageLuma16(ImageBuffer::from_pixel(width, height, pixel)), ImageFormat::Png)
}

fn message(ms: i64, format: &str, data: Vec<u8>) -> Vec<u8> {
    CompressedImage { timestamp: time(ms), frame_id: "camera".into(), data, format: format.into() }.encode_to_vec()
}

impl Script {
    /// A frame at a place as it should be.
    fn frame(&mut self, place: usize) {
        let (color, depth) = (jpeg(place), depth_png(place, (8, 6)));
        self.pictures(place, (color, "jpeg"), (depth, "png"));
        self.advance();
    }

    /// What belongs to a frame at this time, with these pictures.
    fn pictures(
        &mut self,
        place: usize,
        (color, color_format): (Vec<u8>, &str),
        (depth, depth_format): (Vec<u8>, &str),
    ) {
        let ms = self.clock;
        self.steps.push(transform(ms, x(place)));
        self.steps.push(Step::Send(0, ms, message(ms, color_format, color)));
        self.steps.push(Step::Send(self.depth_channel, ms, message(ms, depth_format, depth)));
        self.steps.push(camera_info(ms, (8, 6), self.fx));
    }

    fn advance(&mut self) {
        self.steps.push(Step::Pause(FRAME as u64));
        self.clock += FRAME;
    }

    /// The way to a place, and the rest there with a fault.
    fn place(&mut self, place: usize, fault: Option<Injected>) {
        for part in 1..4 {
            let ms = self.clock;
            let from = x(place) - 0.05;
            self.steps.push(transform(ms, from + 0.05 * f64::from(part) / 4.0));
            self.advance();
        }
        for _ in 0..BEFORE {
            self.frame(place);
        }
        if let Some(fault) = fault {
            self.inject(place, fault);
        }
        for _ in 0..AFTER {
            self.frame(place);
        }
        self.focal_lengths.push(self.fx);
    }

    fn inject(&mut self, place: usize, fault: Injected) {
        let (good_color, good_depth) = ((jpeg(place), "jpeg"), (depth_png(place, (8, 6)), "png"));
        match fault {
            Injected::Disconnect => self.steps.push(Step::Cut),
            Injected::Garbage => self.steps.push(Step::Text("{\"op\":".to_owned())),
            Injected::ClockBack => self.clock -= 3000,
            Injected::ClockForth => self.clock += 60_000,
            Injected::HalfSecondOfSilence => self.silence(550),
            Injected::ThreeSecondsOfSilence => self.silence(3000),
            Injected::OtherIntrinsics => self.fx += 1.0,
            Injected::OtherNumber => {
                let (old, new) = (self.depth_channel, self.depth_channel + 10);
                self.steps.push(Step::Renumber(old, new));
                self.steps.push(Step::Send(old, self.clock, message(self.clock, "png", good_depth.0)));
                self.depth_channel = new;
            }
            Injected::UnknownChannel => self.steps.push(Step::Send(99, self.clock, vec![1, 2, 3])),
            Injected::OneStampAhead => {
                let ms = self.clock + 100_000;
                self.steps.push(Step::Send(0, ms, message(ms, "jpeg", good_color.0)));
                self.steps.push(Step::Pause(5));
            }
            Injected::MissingTransforms => {
                for _ in 0..45 {
                    self.pictures(place, good_color.clone(), good_depth.clone());
                    self.take_back(3);
                    self.advance();
                }
            }
            Injected::LateCalibration => {
                for _ in 0..DURING {
                    self.pictures(place, good_color.clone(), good_depth.clone());
                    self.take_back(2);
                    self.advance();
                }
                (1..=i64::from(DURING)).for_each(|back| {
                    let info = camera_info(self.clock - back * FRAME, (8, 6), self.fx);
                    self.steps.push(info);
                });
            }
            Injected::OtherSizeOfCalibration => {
                for _ in 0..DURING {
                    self.pictures(place, good_color.clone(), good_depth.clone());
                    self.take_back(2);
                    self.steps.push(camera_info(self.clock, (4, 3), self.fx));
                    self.advance();
                }
            }
            Injected::NoNumberInPose | Injected::NoRotation | Injected::SecondParent => {
                for _ in 0..DURING {
                    self.pictures(place, good_color.clone(), good_depth.clone());
                    let (parent, x, w) = match fault {
                        Injected::NoNumberInPose => ("table", f64::NAN, 1.0),
                        Injected::NoRotation => ("table", x(place), 0.0),
                        _ => ("elsewhere", 7.0, 1.0),
                    };
                    self.steps.push(transform_of(self.clock + 1, parent, x, w));
                    self.advance();
                }
            }
            Injected::Reordered => {
                for _ in 0..DURING {
                    self.clock += FRAME;
                    self.pictures(place, good_color.clone(), good_depth.clone());
                    self.clock -= FRAME;
                    self.pictures(place, good_color.clone(), good_depth.clone());
                    self.advance();
                    self.advance();
                }
            }
            Injected::Duplicates => {
                for _ in 0..DURING {
                    self.pictures(place, good_color.clone(), good_depth.clone());
                    self.pictures(place, good_color.clone(), good_depth.clone());
                    self.advance();
                }
            }
            Injected::LateDepth => {
                for _ in 0..DURING {
                    self.pictures(place, good_color.clone(), (good_depth.0.clone(), "png"));
                    self.take_back(1);
                    let late = self.clock - 4 * FRAME;
                    self.steps.push(Step::Send(self.depth_channel, late, message(late, "png", good_depth.0.clone())));
                    self.advance();
                }
            }
            Injected::TruncatedJpeg
            | Injected::CorruptPng
            | Injected::WrongSize
            | Injected::WrongEncoding
            | Injected::OtherContent
            | Injected::NoPicture => {
                for _ in 0..DURING {
                    let (mut color, mut depth) = (good_color.clone(), good_depth.clone());
                    match fault {
                        Injected::TruncatedJpeg => color.0.truncate(color.0.len() / 2),
                        Injected::CorruptPng => {
                            let middle = depth.0.len() / 2;
                            depth.0[middle] ^= 0x55;
                        }
                        Injected::WrongSize => depth.0 = depth_png(place, (4, 3)),
                        Injected::WrongEncoding => depth.1 = "16UC1; compressedDepth rvl",
                        Injected::OtherContent => {
                            depth.0 = file(&GrayImage::from_pixel(8, 6, Luma([9])).into(), ImageFormat::Png);
                        }
                        _ => {}
                    }
                    self.pictures(place, color, depth);
                    if fault == Injected::NoPicture {
                        let at = self.steps.len() - 3;
                        self.steps[at] = Step::Send(0, self.clock, vec![0xff; 40]);
                    }
                    self.advance();
                }
            }
        }
    }

    /// Nothing comes, and the camera's clock goes on.
    fn silence(&mut self, ms: u64) {
        self.steps.push(Step::Pause(ms));
        self.clock += ms as i64;
    }

    /// Takes the `back`-th step from the end out: 1 the calibration, 2 the depth ... as [`pictures`](Self::pictures) sends them.
    fn take_back(&mut self, back: usize) {
        let place = match back {
            3 => 4,
            2 => 1,
            _ => 2,
        };
        self.steps.remove(self.steps.len() - place);
    }
}

/// The faults, every kind as often as the others, in an order that the seed decides.
fn drawn(number: usize) -> Vec<Injected> {
    // Knuth's generator (MMIX): enough to shuffle.
    let mut state = SEED;
    let mut draw = move |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let mut faults = Vec::new();
    while faults.len() < number {
        let mut round = ALL.to_vec();
        (1..round.len()).rev().for_each(|last| round.swap(last, draw(last + 1)));
        faults.extend(round);
    }
    faults.truncate(number);
    faults
}

#[test]
fn every_fault_is_reported_and_recovered_and_the_views_are_right() {
    let number = std::env::var("SEMASCAN_TEST_FAULTS").ok().map_or(FEW, |number| number.parse().expect("a number"));
    let faults = drawn(number);
    let mut script = Script { steps: Vec::new(), clock: 0, depth_channel: 1, fx: 10.0, focal_lengths: Vec::new() };
    // The calibration is late at the beginning, too: pictures come for 2 s without it.
    for _ in 0..60 {
        script.pictures(0, (jpeg(0), "jpeg"), (depth_png(0, (8, 6)), "png"));
        script.steps.pop();
        script.advance();
    }
    script.place(0, None);
    for (place, fault) in faults.iter().enumerate() {
        script.place(place + 1, Some(*fault));
    }
    let focal_lengths = script.focal_lengths;
    let uri = format!("{}?trigger=still&still_ms=200&silence_s=6", serve(compressed_channels(), script.steps));
    let mut source =
        LiveSource::open(LiveAddress::read(&uri).expect("an address"), OpenOptions::default()).expect("a server");
    let told = source.faults();
    let mut places: BTreeMap<i64, Vec<View>> = BTreeMap::new();
    while let Some(view) = source.next_view() {
        let view = view.expect("a broken pair is no view");
        let PoseEvidence::World { table_from_camera, .. } = view.pose else { panic!("a pose") };
        places.entry((table_from_camera.translation.x / 0.05 * 1e6).round() as i64).or_default().push(view);
    }
    let summary = told.summary();
    for place in 0..=number {
        let fault = place.checked_sub(1).map(|fault| faults[fault]);
        let views = places.remove(&(place as i64 * 1_000_000)).unwrap_or_default();
        assert_eq!(views.len(), 1, "place {place}, {fault:?}: one view; {summary}");
        let view = &views[0];
        let millimetres = (view.depth.metres[0] * 1e3).round() as usize;
        assert_eq!(millimetres, 500 + place, "{fault:?}: the depth of its place");
        assert!(view.rgb.get_pixel(0, 0).0[0].abs_diff(red(place)) < 9, "{fault:?}: the colour of its place");
        let [before, after] = [place.saturating_sub(1), place].map(|place| focal_lengths[place]);
        assert!(view.intrinsics.fx == before || view.intrinsics.fx == after, "{fault:?}: {}", view.intrinsics.fx);
        if fault == Some(Injected::OtherIntrinsics) {
            assert_eq!(view.intrinsics.fx, after, "they changed before the camera had rested");
        }
    }
    assert!(places.is_empty(), "no view of a place where the camera did not rest: {:?}", places.keys());
    let recent = told.recent();
    for fault in &faults {
        let Some((topic, kind, word)) = fault.reported() else { continue };
        let is_it = |told: &&Fault| told.topic == topic && told.kind == kind && told.reason.contains(word);
        let reports = recent.iter().filter(is_it).count();
        let injected = faults.iter().filter(|other| other.reported() == fault.reported()).count();
        assert!(reports >= injected, "{fault:?}: {reports} reports of {injected}; {summary}");
    }
    let late = |told: &Fault| told.kind == FaultKind::Calibration && told.reason.contains("yet");
    assert!(recent.iter().any(late), "the late calibration of the beginning: {summary}");
    eprintln!(
        "{number} faults of seed {SEED}: each reported, {} views of {} places; {summary}",
        number + 1,
        number + 1
    );
}

#[test]
fn pictures_in_memory_that_are_shorter_than_their_size_name_the_field() {
    // A row is missing.
    let mut short = image(100, "16UC1", &[1, 2]);
    short.truncate(short.len() - 16);
    let steps = vec![Step::Send(1, 100, short), Step::Pause(100)];
    let uri = format!("{}?silence_s=1", super::test_server::server(steps));
    let mut source =
        LiveSource::open(LiveAddress::read(&uri).expect("an address"), OpenOptions::default()).expect("a server");
    while source.next_view().is_some() {}
    let recent = source.faults().recent();
    assert!(
        recent.iter().any(|fault| fault.topic == "/camera/depth/image" && fault.kind == FaultKind::Message),
        "{recent:?}"
    );
}
