//! What a recording holds: its pictures by topic with their stamps and places, and the calibrations and transforms, which
//! are small and kept. Pixels are not decoded here.

use super::container::{Channel, Container, End, Found, Place};
use super::options::{RecordingOptions, Turntable};
use super::realsense;
use crate::messages::{
    Calibration, Content, Encoding, Header, Kind, MessageError, Parsed, Stamp, StampedTransform, parse,
};
use crate::transforms::{TransformTree, Validity};
use semascan_inspection::source::SourceError;
use std::collections::BTreeMap;

/// Most topics with pictures, and with calibrations.
const MOST_TOPICS: usize = 1000;
/// Most faults that are said one by one.
const MOST_FAULTS: usize = 20;
/// Most changes of a camera's calibration that are remembered.
const MOST_CHANGES: usize = 1000;
/// Most notes that wait to be taken.
const MOST_NOTES: usize = 100;
/// A calibration that comes within so many nanoseconds of the one before comes with the pictures.
const REGULAR: u64 = 200_000_000;

/// A picture of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Picture {
    pub(crate) stamp: Stamp,
    /// Which of the recording's files it is in.
    pub(crate) file: usize,
    pub(crate) place: Place,
}

/// The pictures of a topic.
#[derive(Clone, Debug)]
pub(crate) struct PictureStream {
    pub(crate) topic: String,
    pub(crate) kind: Kind,
    pub(crate) encoding: Encoding,
    pub(crate) content: Content,
    /// Name of the camera's frame; empty where the pictures name none.
    pub(crate) frame: String,
    /// In the order of their stamps.
    pub(crate) pictures: Vec<Picture>,
}

/// The calibrations of a topic.
#[derive(Clone, Debug)]
pub(crate) struct CalibrationStream {
    pub(crate) topic: String,
    /// Those that differ from the one in front of them, from their time on.
    pub(crate) changes: Vec<(Stamp, Calibration)>,
    /// Time of the latest one.
    latest: Stamp,
    /// Whether they come with the pictures.
    is_regular: bool,
}

impl CalibrationStream {
    /// A stream whose first calibration this is.
    pub(crate) fn new(topic: &str, stamp: Stamp, calibration: Calibration) -> Self {
        Self { topic: topic.to_owned(), changes: vec![(stamp, calibration)], latest: stamp, is_regular: false }
    }

    /// The one that is valid at `stamp`; the first, before it was published. A stream has at least one.
    pub(crate) fn at(&self, stamp: Stamp) -> Option<&Calibration> {
        let after = self.changes.partition_point(|(from, _)| *from <= stamp);
        self.changes.get(after.saturating_sub(1)).map(|(_, calibration)| calibration)
    }

    /// Whether the one of a picture of `stamp` is still to come.
    pub(crate) fn is_awaited(&self, stamp: Stamp) -> bool {
        self.is_regular && self.latest < stamp
    }

    /// Name of the camera's frame.
    pub(crate) fn frame(&self) -> &str {
        self.changes.first().map_or("", |(_, calibration)| &calibration.header.frame)
    }
}

/// What a recording holds.
#[derive(Clone, Debug)]
pub(crate) struct Index {
    pub(crate) pictures: Vec<PictureStream>,
    pub(crate) calibrations: Vec<CalibrationStream>,
    pub(crate) transforms: TransformTree,
    /// Metres of a depth of 1 that the camera states, by the beginning of its topics.
    pub(crate) depth_units: Vec<(String, f64)>,
    /// Names of the cameras that state them, by the beginning of their topics.
    pub(crate) products: Vec<(String, String)>,
    /// What is wrong with the recording: its end, messages that cannot be read, transforms that do not fit.
    pub(crate) faults: Vec<String>,
}

/// What a message told that is worth a word when it comes, as on a stream.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Note {
    /// The topic, or the frame of a transform.
    pub(crate) topic: String,
    pub(crate) kind: NoteKind,
    /// Naming the field where there is one.
    pub(crate) reason: String,
}

/// What a note is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoteKind {
    /// A message that cannot be read.
    Unread,
    /// A transform that does not fit.
    Misfit,
    /// Another calibration of the same camera.
    Calibration,
}

/// The index while files are scanned, or a stream is listened to.
#[derive(Debug)]
pub(crate) struct Scan {
    index: Index,
    /// The table whose angle is taken from the joints.
    turntable: Option<Turntable>,
    /// By topic: how many messages cannot be read, and why the first.
    unread: BTreeMap<String, (u32, MessageError)>,
    /// Each transform that does not fit, once.
    misfits: BTreeMap<String, u32>,
    notes: Vec<Note>,
}

impl Index {
    /// Scans the files of a recording.
    pub(crate) fn of(files: &mut [Box<dyn Container>], options: &RecordingOptions) -> Result<Self, SourceError> {
        let mut scan = Scan::new(options);
        for (place, file) in files.iter_mut().enumerate() {
            let end = file.scan(&mut |channel, found| {
                scan.take(place, channel, found);
            })?;
            if let End::Cut(reason) = end {
                let path = file.path().display();
                scan.index.faults.push(format!("{path} is read to where it is cut or damaged: {reason}"));
            }
        }
        Ok(scan.finish())
    }
}

impl Scan {
    /// Nothing was found yet.
    pub(crate) fn new(options: &RecordingOptions) -> Self {
        let index = Index {
            pictures: Vec::new(),
            calibrations: Vec::new(),
            transforms: TransformTree::new(options.transform_tolerance),
            depth_units: Vec::new(),
            products: Vec::new(),
            faults: Vec::new(),
        };
        Self {
            index,
            turntable: options.turntable.clone(),
            unread: BTreeMap::new(),
            misfits: BTreeMap::new(),
            notes: Vec::new(),
        }
    }

    /// What was found by now.
    pub(crate) fn index(&self) -> &Index {
        &self.index
    }

    /// Takes the last picture of a stream out of the index, of a stream whose pictures are held elsewhere.
    pub(crate) fn take_last_picture(&mut self, stream: usize) -> Option<Picture> {
        let pictures = &mut self.index.pictures.get_mut(stream)?.pictures;
        let last = pictures.pop();
        pictures.clear();
        last
    }

    /// Forgets transforms of before `stamp`.
    pub(crate) fn forget_before(&mut self, stamp: Stamp) {
        self.index.transforms.forget_before(stamp);
    }

    /// Forgets what was at which time: the clock is another one by now. What is fixed stays, and the last calibrations.
    pub(crate) fn forget_time(&mut self) {
        self.index.transforms.forget_moving();
        for stream in &mut self.index.calibrations {
            let last = stream.changes.pop();
            stream.changes = last.into_iter().collect();
            stream.is_regular = false;
        }
    }

    /// What was noted since this was asked last.
    pub(crate) fn take_notes(&mut self) -> Vec<Note> {
        std::mem::take(&mut self.notes)
    }

    fn note(&mut self, topic: &str, kind: NoteKind, reason: String) {
        if self.notes.len() < MOST_NOTES {
            self.notes.push(Note { topic: topic.to_owned(), kind, reason });
        }
    }

    /// Takes a message; the place of its stream if it is a picture.
    pub(crate) fn take(&mut self, file: usize, channel: &Channel, found: Found<'_>) -> Option<usize> {
        let (kind, encoding) = channel.decoded?;
        // Of joints and texts only some are needed.
        let is_needed = match kind {
            Kind::JointStates => self.turntable.is_some(),
            Kind::Text => realsense::is_metadata(&channel.topic),
            _ => true,
        };
        if !is_needed {
            return None;
        }
        let taken = parse(kind, encoding, found.message).and_then(|parsed| {
            if let Some(picture) = parsed.picture() {
                let (header, content) = picture?;
                return Ok(self.picture(file, channel, (kind, encoding, content), header, found));
            }
            match parsed {
                Parsed::Calibration(calibration) => self.calibration(channel, calibration, found.logged),
                Parsed::Transforms(transforms) => {
                    let is_foxglove = matches!(encoding, Encoding::Protobuf | Encoding::Json);
                    let validity = match (channel.topic.ends_with("tf_static"), is_foxglove) {
                        (true, _) => Validity::Always,
                        (false, true) => Validity::AtStampOrAlone,
                        (false, false) => Validity::AtStamp,
                    };
                    for mut transform in transforms {
                        if transform.stamp.is_missing() {
                            transform.stamp = found.logged;
                        }
                        self.transform(transform, validity);
                    }
                }
                Parsed::Joints(joints) => {
                    let stamp = if joints.stamp.is_missing() { found.logged } else { joints.stamp };
                    let table = self.turntable.as_ref();
                    let angle = |table: &&Turntable| joints.positions.iter().find(|(name, _)| *name == table.joint);
                    let transform = table.and_then(|table| Some(table.transform(stamp, angle(&table)?.1)));
                    if let Some(transform) = transform {
                        self.transform(transform, Validity::AtStamp);
                    }
                }
                Parsed::Text(text) => {
                    if let Some((stream, unit)) = realsense::depth_unit(&channel.topic, &text)
                        && !self.index.depth_units.iter().any(|(known, _)| known == stream)
                    {
                        self.index.depth_units.push((stream.to_owned(), unit));
                    }
                    if let Some((device, name)) = realsense::product(&channel.topic, &text)
                        && self.index.products.len() < MOST_TOPICS
                        && !self.index.products.iter().any(|(known, _)| known == device)
                    {
                        self.index.products.push((device.to_owned(), name.to_owned()));
                    }
                }
                Parsed::Raw(_) | Parsed::Compressed(_) | Parsed::Cloud(_) => {}
            }
            Ok(None)
        });
        taken.unwrap_or_else(|error| {
            self.note(&channel.topic, NoteKind::Unread, error.to_string());
            self.unread.entry(channel.topic.clone()).or_insert((0, error)).0 += 1;
            None
        })
    }

    fn transform(&mut self, transform: StampedTransform, validity: Validity) {
        let frame = transform.child.clone();
        if let Err(error) = self.index.transforms.add(transform, validity) {
            self.note(&frame, NoteKind::Misfit, error.to_string());
            *self.misfits.entry(error.to_string()).or_default() += 1;
        }
    }

    fn picture(
        &mut self,
        file: usize,
        channel: &Channel,
        (kind, encoding, content): (Kind, Encoding, Content),
        header: &Header,
        found: Found<'_>,
    ) -> Option<usize> {
        let stamp = if header.stamp.is_missing() { found.logged } else { header.stamp };
        let picture = Picture { stamp, file, place: found.place };
        let streams = &mut self.index.pictures;
        let is_it = |stream: &PictureStream| {
            stream.topic == channel.topic && (stream.kind, stream.encoding, stream.content) == (kind, encoding, content)
        };
        let place = streams.iter().position(is_it);
        let is_full = streams.len() == MOST_TOPICS;
        match place.and_then(|place| streams.get_mut(place)) {
            Some(stream) => stream.pictures.push(picture),
            None if is_full => return None,
            None => streams.push(PictureStream {
                topic: channel.topic.clone(),
                kind,
                encoding,
                content,
                frame: header.frame.clone(),
                pictures: vec![picture],
            }),
        }
        place.or(streams.len().checked_sub(1))
    }

    fn calibration(&mut self, channel: &Channel, mut calibration: Calibration, logged: Stamp) {
        let stamp = if calibration.header.stamp.is_missing() { logged } else { calibration.header.stamp };
        // Only the time differs from message to message.
        calibration.header.stamp = Stamp::default();
        let is_full = self.index.calibrations.len() == MOST_TOPICS;
        let Some(stream) = self.index.calibrations.iter_mut().find(|stream| stream.topic == channel.topic) else {
            if !is_full {
                self.index.calibrations.push(CalibrationStream::new(&channel.topic, stamp, calibration));
            }
            return;
        };
        stream.is_regular |= stream.latest < stamp && stamp.distance(stream.latest) < REGULAR;
        stream.latest = stream.latest.max(stamp);
        let Some((_, last)) = stream.changes.last() else { return };
        if *last == calibration {
            return;
        }
        let said = changed(last, &calibration);
        stream.changes.push((stamp, calibration));
        if stream.changes.len() > MOST_CHANGES {
            stream.changes.remove(0);
        }
        self.note(&channel.topic, NoteKind::Calibration, said);
    }

    fn finish(self) -> Index {
        let Self { mut index, unread, misfits, .. } = self;
        for stream in &mut index.pictures {
            stream.pictures.sort_by_key(|picture| picture.stamp);
        }
        for stream in &mut index.calibrations {
            stream.changes.sort_by_key(|(stamp, _)| *stamp);
        }
        for (topic, (count, error)) in unread {
            index.faults.push(format!("{count} messages of {topic} cannot be read; the first: {error}"));
        }
        for (reason, count) in misfits {
            index.faults.push(format!("{count} transforms are left out: {reason}"));
        }
        if index.faults.len() > MOST_FAULTS {
            let more = index.faults.len() - MOST_FAULTS;
            index.faults.truncate(MOST_FAULTS);
            index.faults.push(format!("and {more} faults more"));
        }
        index
    }
}

/// What has changed of a camera.
fn changed(from: &Calibration, to: &Calibration) -> String {
    let fields = [
        ("width and height", (from.width, from.height) != (to.width, to.height)),
        ("K", from.k != to.k),
        ("D", from.distortion != to.distortion || from.distortion_model != to.distortion_model),
        ("P", from.p != to.p),
        ("frame_id", from.header.frame != to.header.frame),
    ];
    let names: Vec<&str> = fields.iter().filter(|(_, differs)| *differs).map(|(name, _)| *name).collect();
    let said = |c: &Calibration| format!("{} x {}, fx {:.2}, fy {:.2}", c.width, c.height, c.k[0], c.k[4]);
    format!("{} changed: from {} to {}", names.join(", "), said(from), said(to))
}
