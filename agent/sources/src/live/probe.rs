//! What a live source is like, found by listening for a few seconds: which topics come how often, whether the clocks agree, whether
//! transforms lead to the camera, and one pair of pictures. `semascan doctor` judges it.

use super::LiveAddress;
use super::faults::{Fault, FaultKind, Faults};
use super::follower::fixed_frame;
use super::link::{Arrival, Happening, Opened, Wanted};
use super::pairs::Held;
use crate::OpenOptions;
use crate::messages::Stamp;
use crate::recording::{Chosen, Found, Index, NoteKind, Place, PlannedView, Scan, ViewMaker, camera_frame};
use semascan_inspection::source::SourceError;
use semascan_perception::view::View;
use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Pictures of each stream that are kept to find a pair among them.
const KEPT: usize = 4;

/// What was found.
#[derive(Debug)]
pub struct Probe {
    /// Time until the server had taken the connection.
    pub connected_in: Duration,
    /// How long was listened.
    pub listened: Duration,
    /// Bytes that came.
    pub bytes: u64,
    /// The topics that were offered, by name.
    pub topics: BTreeMap<String, Topic>,
    /// Topics of colour (where it has one of its own) and depth that are inspected; why none.
    pub chosen: Result<(Option<String>, String), String>,
    /// The frames that are connected, the fixed one and that of the camera or its end effector; why none.
    pub pose: Result<(String, String), String>,
    /// The latest pair as a view; why none.
    pub view: Result<Box<View>, String>,
    /// What went wrong meanwhile.
    pub faults: Vec<Fault>,
}

/// What came on a topic.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Topic {
    /// Its type.
    pub type_name: String,
    /// Messages.
    pub messages: u64,
    /// Messages a second, between the first and the last one.
    pub rate: Option<f64>,
    /// How far the stamps of its pictures are behind this machine's clock, seconds: the median. Negative where they are ahead.
    pub behind: Option<f64>,
}

/// What is noted of a topic.
#[derive(Debug)]
struct Noted {
    type_name: String,
    messages: u64,
    span: Option<(Instant, Instant)>,
    behind: Vec<f64>,
}

/// Listens to a live source for so long.
///
/// # Errors
/// [`SourceError`] if nobody answers at the address.
pub fn probe(address: &LiveAddress, options: &OpenOptions, listened: Duration) -> Result<Probe, SourceError> {
    let refuse = |reason: String| SourceError::Uri { uri: address.uri.clone(), reason };
    let options = OpenOptions { recording: address.recording.clone(), ..options.clone() };
    let faults = Faults::new(&address.uri);
    let began = Instant::now();
    let opened = Opened::new(&address.server).map_err(refuse)?;
    let connected_in = began.elapsed();
    let wanted = Wanted { topic: None, follows_all: true, recorder: None };
    let link = opened.follow(wanted, faults.clone()).map_err(refuse)?;
    let mut scan = Scan::new(&options.recording);
    let mut noted: BTreeMap<String, Noted> = BTreeMap::new();
    let mut kept: Vec<VecDeque<Held>> = Vec::new();
    let mut bytes = 0;
    let began = Instant::now();
    while began.elapsed() < listened {
        match link.next(Duration::from_millis(50)) {
            Some(Happening::Message(arrival)) => {
                bytes += arrival.bytes.len() as u64;
                note(&mut noted, &mut scan, &mut kept, &faults, arrival);
            }
            Some(Happening::Lost { reason }) => faults.report("", FaultKind::Connection, reason),
            Some(Happening::Remark { text }) => faults.report("", FaultKind::Connection, text),
            Some(Happening::Stray { .. } | Happening::Connected { .. }) | None => {}
        }
    }
    drop(link);
    let index = scan.index();
    let chosen = Chosen::of(index, &options.recording);
    let pose = chosen.clone().and_then(|chosen| pose(index, &chosen, &options, &kept));
    let view = chosen.clone().and_then(|chosen| view(index, &chosen, &options, &kept));
    let chosen = chosen.map(|chosen| (chosen.color.map(|color| color.topic.clone()), chosen.depth.topic.clone()));
    let topics = noted.into_iter().map(|(name, noted)| (name, noted.topic())).collect();
    let faults = faults.recent();
    Ok(Probe { connected_in, listened, bytes, topics, chosen, pose, view: view.map(Box::new), faults })
}

fn note(
    noted: &mut BTreeMap<String, Noted>,
    scan: &mut Scan,
    kept: &mut Vec<VecDeque<Held>>,
    faults: &Faults,
    arrival: Arrival,
) {
    let offered = &arrival.channel.offered;
    let topic = noted.entry(offered.topic.clone()).or_insert_with(|| Noted {
        type_name: offered.schema_name.clone(),
        messages: 0,
        span: None,
        behind: Vec::new(),
    });
    topic.messages += 1;
    topic.span = Some((topic.span.map_or(arrival.at, |(first, _)| first), arrival.at));
    let place = Place { block: 0, offset: 0, length: arrival.bytes.len() };
    let found = Found { logged: arrival.logged, place, message: &arrival.bytes };
    let stream = scan.take(0, &arrival.channel.decoded, found);
    for note in scan.take_notes() {
        let kind = match note.kind {
            NoteKind::Unread => FaultKind::Message,
            NoteKind::Misfit => FaultKind::Pose,
            NoteKind::Calibration => FaultKind::Calibration,
        };
        faults.report(&note.topic, kind, note.reason);
    }
    let Some((stream, picture)) = stream.and_then(|stream| Some((stream, scan.take_last_picture(stream)?))) else {
        return;
    };
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    topic.behind.push(now.as_secs_f64() - picture.stamp.seconds());
    if kept.len() <= stream {
        kept.resize_with(stream + 1, VecDeque::new);
    }
    if let Some(kept) = kept.get_mut(stream) {
        if kept.len() == KEPT {
            kept.pop_front();
        }
        kept.push_back(Held { picture, arrived: arrival.at, bytes: arrival.bytes });
    }
}

impl Noted {
    fn topic(mut self) -> Topic {
        let seconds = self.span.map(|(first, last)| last.duration_since(first).as_secs_f64());
        let rate = seconds.filter(|seconds| self.messages > 1 && *seconds > 0.0);
        let rate = rate.map(|seconds| (self.messages - 1) as f64 / seconds);
        self.behind.sort_by(f64::total_cmp);
        let behind = self.behind.get(self.behind.len() / 2).copied();
        Topic { type_name: self.type_name, messages: self.messages, rate, behind }
    }
}

/// The place of a stream in the index.
fn place_of(index: &Index, topic: &crate::recording::PictureStream) -> Option<usize> {
    index.pictures.iter().position(|stream| std::ptr::eq(stream, topic))
}

/// Whether the transforms lead to the camera at the time of a picture that is not the last: those of the last may still come.
fn pose(
    index: &Index,
    chosen: &Chosen<'_>,
    options: &OpenOptions,
    kept: &[VecDeque<Held>],
) -> Result<(String, String), String> {
    let camera = camera_frame(chosen, &options.recording);
    let fixed = fixed_frame(index, &camera.name, options.recording.fixed_frame.as_deref());
    let fixed = fixed.ok_or_else(|| match index.transforms.is_empty() {
        true => "no transforms come".to_owned(),
        false if index.transforms.knows(&camera.name) => {
            format!("the transforms to {:?} are fixed and say nothing of where the camera is", camera.name)
        }
        false => format!("no transform names the camera's frame {:?}", camera.name),
    })?;
    let stamps: Vec<Stamp> = place_of(index, chosen.depth)
        .and_then(|place| kept.get(place))
        .map(|kept| kept.iter().map(|held| held.picture.stamp).collect())
        .unwrap_or_default();
    let mut error = "no picture came".to_owned();
    for stamp in stamps {
        match camera.pose(&index.transforms, &fixed, stamp) {
            Ok(_) => return Ok((fixed, camera.name)),
            Err(reason) => error = reason.to_string(),
        }
    }
    Err(error)
}

/// The latest pair as a view.
fn view(index: &Index, chosen: &Chosen<'_>, options: &OpenOptions, kept: &[VecDeque<Held>]) -> Result<View, String> {
    let of = |stream| place_of(index, stream).and_then(|place| kept.get(place));
    let depths = of(chosen.depth).ok_or("no depth picture came")?;
    let pairs = depths.iter().flat_map(|depth| match chosen.color.and_then(of) {
        None => vec![(0, None, depth)],
        Some(colors) => {
            let offset = |color: &Held| color.picture.stamp.distance(depth.picture.stamp);
            colors.iter().map(|color| (offset(color), Some(color), depth)).collect()
        }
    });
    let (offset, color, depth) =
        pairs.min_by_key(|(offset, ..)| *offset).ok_or("no colour picture came beside the depth")?;
    if offset > options.recording.pairing_tolerance {
        let (ms, tolerance) = (offset as f64 * 1e-6, options.recording.pairing_tolerance as f64 * 1e-6);
        return Err(format!(
            "colour and depth are at least {ms:.1} ms apart, and {tolerance} ms may be: have both the same clock?"
        ));
    }
    let (mut maker, _) = ViewMaker::new(index, chosen, options).map_err(|error| error.to_string())?;
    let planned =
        PlannedView { color: color.map(|color| color.picture), depth: depth.picture, table_from_camera: None };
    maker.view(index, 0, &planned, color.map(|color| color.bytes.as_ref()), &depth.bytes)
}
