//! Follows a stream on a thread of its own, so that it is looked at as it comes however long an inspection takes for a view: pictures
//! are paired, pairs get the poses of their time, it is decided which of them become views, and these are decoded. What was decided
//! waits in the [`Outlet`].
//!
//! Whatever goes wrong is a [`fault`](super::Faults) and not the end: the next pair is taken in the stead of one that is broken, a
//! connection is made again, and after a clock was set nothing of the time before is mixed with what comes.

use super::LiveAddress;
use super::faults::{FaultKind, Faults};
use super::link::{Arrival, Happening, Link};
use super::outlet::Outlet;
use super::pairs::{Held, Pair, Pairing};
use super::rate::Rate;
use super::trigger::{Candidate, Selection, Trigger};
use crate::OpenOptions;
use crate::messages::Stamp;
use crate::recording::{
    CameraFrame, Chosen, Found, Index, NoteKind, Place, PlannedView, Scan, Topics, ViewMaker, camera_frame,
};
use nalgebra::Isometry3;
use semascan_inspection::source::{CaptureTrigger, SourceError};
use semascan_perception::view::View;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long streams are watched before it is chosen which of them are colour and depth: the better one may come later.
const LOOK_AROUND: Duration = Duration::from_millis(1500);
/// Bytes of pictures that are held until then, and of pairs that wait to be decoded.
const MOST_HELD: usize = 256 << 20;
/// How long a pair waits for the transforms and calibrations of its time.
const POSE_WAIT: Duration = Duration::from_secs(1);
/// Poses of before this are forgotten, nanoseconds.
const POSES_KEPT: i64 = 10_000_000_000;
/// A stream whose stamps go back by more than this, or run ahead of the time that passes here by more than that, has a clock that was
/// set: what waits is of another time. Nanoseconds; messages that were out of order are nearer to each other.
const CLOCK_BACK: i64 = 250_000_000;
const CLOCK_FORTH: i64 = 5_000_000_000;

/// Follows a stream.
pub(super) struct Follower {
    address: LiveAddress,
    options: OpenOptions,
    link: Link,
    outlet: Arc<Outlet>,
    faults: Faults,
    asked: CaptureTrigger,
    scan: Scan,
    /// Until it is chosen what is inspected, the latest pictures.
    early: VecDeque<(usize, Held)>,
    chosen: Option<Streams>,
    /// Pairs that wait for the pose of their time.
    waiting: VecDeque<Pair>,
    selection: Selection,
    /// Pairs that are views and wait to be decoded.
    taken: VecDeque<(PlannedView, Pair)>,
    counts: Counts,
    began: Option<Instant>,
    /// When the last picture came.
    heard: Instant,
    /// The last picture of each stream: its stamp and when it came.
    last: Vec<Option<(Stamp, Instant)>>,
    rate: Rate,
}

/// What is inspected of what streams.
struct Streams {
    maker: ViewMaker,
    pairing: Pairing,
    camera: CameraFrame,
}

/// What became of what came.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    pairs: u64,
    passed_over: u64,
    without_pose: u64,
    broken: u64,
    connections: u32,
    clock_set: u32,
}

impl Follower {
    pub(super) fn new(
        address: LiveAddress,
        options: OpenOptions,
        link: Link,
        outlet: Arc<Outlet>,
        faults: Faults,
        asked: CaptureTrigger,
    ) -> Self {
        let scan = Scan::new(&options.recording);
        let selection = Selection::new(&address, asked.clone());
        Self {
            address,
            options,
            link,
            outlet,
            faults,
            asked,
            scan,
            early: VecDeque::new(),
            chosen: None,
            waiting: VecDeque::new(),
            selection,
            taken: VecDeque::new(),
            counts: Counts::default(),
            began: None,
            heard: Instant::now(),
            last: Vec::new(),
            rate: Rate::default(),
        }
    }

    /// Follows the stream to its end, or until nobody wants views any more.
    pub(super) fn run(mut self) {
        let failure = loop {
            if self.outlet.is_over() {
                break None;
            }
            // Whoever waits for a view gets it before the next message is looked at.
            let patience = if self.taken.is_empty() { 50 } else { 5 };
            let happening = self.link.next(Duration::from_millis(patience));
            let is_silent = happening.is_none() && self.heard.elapsed() > self.address.silence;
            if let Some(happening) = happening {
                self.follow(happening);
            } else if let Some(said) = self.rate.silence() {
                self.faults.report("", FaultKind::Silence, said);
            }
            if self.chosen.is_some() {
                self.decide(is_silent);
                self.decode();
                if is_silent && self.taken.is_empty() {
                    break None;
                }
                continue;
            }
            let has_looked = self.began.is_some_and(|began| began.elapsed() > LOOK_AROUND);
            // Pictures of which none can be measured in are no more than silence.
            let is_in_vain = is_silent || self.began.is_some_and(|began| began.elapsed() > self.address.silence);
            if !has_looked && !is_in_vain {
                continue;
            }
            match self.choose() {
                Ok(()) => {}
                // More may come.
                Err(reason) if !is_in_vain => self.faults.report("", FaultKind::Calibration, format!("{reason}, yet")),
                Err(reason) => break Some(format!("{reason}, for {} s", self.address.silence.as_secs_f64())),
            }
        };
        self.end(failure);
    }

    /// Follows what happened on the link.
    fn follow(&mut self, happening: Happening) {
        match happening {
            Happening::Connected { server } => {
                self.counts.connections += 1;
                tracing::info!("{}: connected to {server}", self.address.uri);
            }
            Happening::Lost { reason } => {
                let said = format!("it is lost ({reason}), and is made again");
                self.faults.report("", FaultKind::Connection, said);
                // What was half of a pair has no other half any more.
                if let Some(streams) = &mut self.chosen {
                    streams.pairing.clear();
                }
            }
            Happening::Remark { text } => {
                self.faults.report("", FaultKind::Connection, format!("the server says: {text}"));
            }
            Happening::Stray { number } => {
                self.faults.report(
                    "",
                    FaultKind::Channel,
                    format!("a message of channel {number}, which was not offered"),
                );
            }
            Happening::Message(arrival) => self.message(arrival),
        }
    }

    fn message(&mut self, arrival: Arrival) {
        if let Trigger::Topic(topic) = &self.address.trigger
            && arrival.channel.offered.topic == *topic
            && !self.asked.ask_from(arrival.at)
        {
            self.faults.report(topic, FaultKind::Overflow, "it asks for views faster than the camera sees");
        }
        let place = Place { block: 0, offset: 0, length: arrival.bytes.len() };
        let found = Found { logged: arrival.logged, place, message: &arrival.bytes };
        let stream = self.scan.take(0, &arrival.channel.decoded, found);
        for note in self.scan.take_notes() {
            let kind = match note.kind {
                NoteKind::Unread => FaultKind::Message,
                NoteKind::Misfit => FaultKind::Pose,
                NoteKind::Calibration => FaultKind::Calibration,
            };
            self.faults.report(&note.topic, kind, note.reason);
        }
        let Some(stream) = stream else { return };
        let Some(picture) = self.scan.take_last_picture(stream) else { return };
        self.heard = arrival.at;
        self.began.get_or_insert(self.heard);
        if self.follow_clock(stream, &arrival.channel.offered.topic, (picture.stamp, arrival.at)) {
            self.picture(stream, Held { picture, arrived: arrival.at, bytes: arrival.bytes });
        }
    }

    /// Takes note of the time of a picture; `false` for one that came before.
    fn follow_clock(&mut self, stream: usize, topic: &str, (stamp, arrived): (Stamp, Instant)) -> bool {
        if self.last.len() <= stream {
            self.last.resize(stream + 1, None);
        }
        if let Some((last, last_arrived)) = self.last.get(stream).copied().flatten() {
            let ahead = stamp.nanoseconds.saturating_sub(last.nanoseconds);
            let passed = i64::try_from(arrived.duration_since(last_arrived).as_nanos()).unwrap_or(i64::MAX);
            let seconds = ahead as f64 * 1e-9;
            if ahead < -CLOCK_BACK {
                self.set_clock(topic, &format!("its stamps went back by {:.3} s", -seconds));
            } else if ahead.saturating_sub(passed) > CLOCK_FORTH {
                self.set_clock(topic, &format!("its stamps went forth by {seconds:.3} s at once"));
            } else if ahead == 0 {
                self.faults.report(
                    topic,
                    FaultKind::Order,
                    format!("the picture of {:.3} s came twice", stamp.seconds()),
                );
                return false;
            } else if ahead < 0 {
                let said = format!("the picture of {:.3} s came after a later one", stamp.seconds());
                self.faults.report(topic, FaultKind::Order, said);
            }
        }
        let is_latest = self.last.get(stream).copied().flatten().is_none_or(|(last, _)| last < stamp);
        if let Some(last) = self.last.get_mut(stream).filter(|_| is_latest) {
            *last = Some((stamp, arrived));
        }
        let oldest = Stamp { nanoseconds: stamp.nanoseconds.saturating_sub(POSES_KEPT) };
        self.scan.forget_before(oldest);
        true
    }

    /// The clock was set: what waits is of another time.
    fn set_clock(&mut self, topic: &str, said: &str) {
        self.counts.clock_set += 1;
        self.faults.report(topic, FaultKind::Clock, format!("{said}: what was waiting for its pair is dropped"));
        self.last.fill(None);
        self.waiting.clear();
        self.early.clear();
        self.counts.passed_over += self.taken.drain(..).count() as u64;
        if let Some(streams) = &mut self.chosen {
            streams.pairing.clear();
        }
        self.scan.forget_time();
    }

    fn picture(&mut self, stream: usize, held: Held) {
        let Some(streams) = &mut self.chosen else {
            self.early.push_back((stream, held));
            // What is chosen may never come.
            while self.early.iter().map(|(_, held)| held.bytes.len()).sum::<usize>() > MOST_HELD {
                self.early.pop_front();
            }
            return;
        };
        let topics = streams.maker.topics();
        if stream == topics.depth
            && let Some(said) = self.rate.note(held.arrived)
        {
            self.faults.report("", FaultKind::Silence, said);
        }
        if let Some(said) = another_content(self.scan.index(), topics, stream) {
            self.faults.report(&self.scan.index().pictures[stream].topic.clone(), FaultKind::Picture, said);
        }
        let alone = streams.pairing.alone();
        let pairs = streams.pairing.take(topics, stream, held);
        let alone = streams.pairing.alone() - alone;
        self.counts.pairs += pairs.len() as u64;
        self.waiting.extend(pairs);
        if alone > 0 {
            let tolerance = self.options.recording.pairing_tolerance as f64 * 1e-6;
            let said = format!("{alone} pictures stayed alone: none of the other stream is within {tolerance} ms");
            self.faults.report(&self.depth_topic(), FaultKind::Order, said);
        }
    }

    /// Chooses what is inspected, once there was time to look around; why not yet, where that is not possible.
    fn choose(&mut self) -> Result<(), String> {
        let index = self.scan.index();
        let chosen = Chosen::of(index, &self.options.recording)?;
        let camera = camera_frame(&chosen, &self.options.recording);
        let said = |stream: &str, topic: &str| (format!("{stream}_topic"), topic.to_owned());
        let mut settings = vec![said("depth", &chosen.depth.topic)];
        settings.extend(chosen.color.map(|color| said("color", &color.topic)));
        let (maker, unit) = ViewMaker::new(index, &chosen, &self.options).map_err(|error| error.to_string())?;
        settings.push(("depth_unit".to_owned(), unit));
        settings.extend(maker.depth_camera().map(|said| ("depth_camera".to_owned(), said)));
        self.outlet.tell(settings);
        let pairing = Pairing::new(self.options.recording.pairing_tolerance);
        self.chosen = Some(Streams { maker, pairing, camera });
        for (stream, held) in std::mem::take(&mut self.early) {
            self.picture(stream, held);
        }
        Ok(())
    }

    /// Decides about the pairs whose pose is known by now, or not to be known: at the end, of all.
    fn decide(&mut self, is_end: bool) {
        while let Some((color, depth)) = self.waiting.front() {
            let Some(streams) = &self.chosen else { return };
            let (stamp, index, camera) = (depth.picture.stamp, self.scan.index(), &streams.camera);
            let arrived = color.as_ref().map_or(depth.arrived, |color| color.arrived.max(depth.arrived));
            let is_late = is_end || arrived.elapsed() > POSE_WAIT || {
                let clock = self.last.get(streams.maker.topics().depth).copied().flatten();
                clock.is_some_and(|(clock, _)| u128::from(clock.distance(stamp)) > POSE_WAIT.as_nanos())
            };
            let topics = streams.maker.topics();
            let calibrations = [topics.color_calibration, topics.depth_calibration];
            let mut calibrations = calibrations.iter().flatten().filter_map(|place| index.calibrations.get(*place));
            if !is_late && calibrations.any(|calibration| calibration.is_awaited(stamp)) {
                return;
            }
            let fixed = fixed_frame(index, &camera.name, self.options.recording.fixed_frame.as_deref());
            let pose = match fixed.as_deref().map(|fixed| camera.pose(&index.transforms, fixed, stamp)) {
                None if self.address.trigger.needs_poses() => {
                    let frame = camera.name.clone();
                    self.leave_out(&frame, "trigger=still needs transforms that move, or fixed_frame=FRAME");
                    continue;
                }
                None => None,
                Some(Ok(pose)) => Some(pose),
                // The transforms of this time may still come.
                Some(Err(_)) if !is_late => return,
                Some(Err(error)) => {
                    let frame = camera.name.clone();
                    self.leave_out(&frame, &error.to_string());
                    continue;
                }
            };
            let candidate = Candidate { stamp, arrived, table_from_camera: pose.as_ref() };
            let is_taken = self.selection.takes(candidate, || {
                let earlier = Stamp { nanoseconds: stamp.nanoseconds - self.address.still.as_nanos() as i64 };
                fixed.as_deref().and_then(|fixed| camera.pose(&index.transforms, fixed, earlier).ok())
            });
            let Some(pair) = self.waiting.pop_front() else { return };
            if is_taken {
                self.take(pair, pose);
            } else {
                self.counts.passed_over += 1;
            }
        }
    }

    /// Leaves the oldest pair out, which has no pose for a reason.
    fn leave_out(&mut self, frame: &str, reason: &str) {
        self.waiting.pop_front();
        self.counts.without_pose += 1;
        self.faults.report(frame, FaultKind::Pose, format!("a pair without a pose is left out: {reason}"));
    }

    /// A pair is a view.
    fn take(&mut self, pair: Pair, table_from_camera: Option<Isometry3<f64>>) {
        let (color, depth) = &pair;
        let planned =
            PlannedView { color: color.as_ref().map(|color| color.picture), depth: depth.picture, table_from_camera };
        if self.address.trigger == Trigger::Every {
            self.taken.push_back((planned, pair));
            let bytes = |(_, (color, depth)): &(PlannedView, Pair)| {
                color.as_ref().map_or(0, |color| color.bytes.len()) + depth.bytes.len()
            };
            while self.taken.iter().map(bytes).sum::<usize>() > MOST_HELD {
                self.taken.pop_front();
                self.counts.passed_over += 1;
            }
            return;
        }
        // What was waited for is decoded at once: where it is broken, the next one is taken.
        match self.view(&planned, &pair) {
            Ok(view) => {
                if !self.outlet.push(Ok(view)) {
                    self.counts.passed_over += 1;
                    let said = "a view is left out: they are taken faster than they are inspected";
                    self.faults.report("", FaultKind::Overflow, said);
                }
            }
            Err(reason) => {
                self.counts.broken += 1;
                self.faults.report(&self.depth_topic(), FaultKind::Picture, format!("{reason}; the next is taken"));
                self.selection.take_again();
            }
        }
    }

    /// Decodes pairs that are views while somebody waits for one.
    fn decode(&mut self) {
        while self.outlet.is_empty()
            && let Some((planned, pair)) = self.taken.pop_front()
        {
            let view = self.view(&planned, &pair);
            if let Err(reason) = &view {
                self.counts.broken += 1;
                self.faults.report(&self.depth_topic(), FaultKind::Picture, reason.as_str());
            }
            let uri = &self.address.uri;
            self.outlet.push(view.map_err(|reason| SourceError::Uri { uri: uri.clone(), reason }));
        }
    }

    fn view(&mut self, planned: &PlannedView, (color, depth): &Pair) -> Result<View, String> {
        let streams = self.chosen.as_mut().ok_or("its topics are not chosen yet")?;
        let color = color.as_ref().map(|color| color.bytes.as_ref());
        // The number is that of those who take it.
        streams.maker.view(self.scan.index(), 0, planned, color, &depth.bytes)
    }

    fn depth_topic(&self) -> String {
        let place = self.chosen.as_ref().map(|streams| streams.maker.topics().depth);
        let stream = place.and_then(|place| self.scan.index().pictures.get(place));
        stream.map_or_else(String::new, |stream| stream.topic.clone())
    }

    /// The end: says what became of what came.
    fn end(self, mut failure: Option<String>) {
        let Counts { pairs, passed_over, without_pose, broken, connections, clock_set } = self.counts;
        let counted = self.link.counted();
        let alone = self.chosen.as_ref().map_or(0, |streams| streams.pairing.alone());
        let passed_over = passed_over + self.taken.len() as u64;
        let mut said = format!(
            "{pairs} pairs came, {passed_over} were passed over, {without_pose} had no pose, {broken} were broken; {} messages were \
             dropped because they came faster than they were taken; {alone} pictures stayed alone; {connections} connections, the \
             clock was set {clock_set} times",
            counted.dropped
        );
        let recorded = self.link.end().map(|recorder| recorder.finish());
        match recorded {
            None => {}
            Some(Ok(written)) => {
                let messages: u64 = written.messages.values().sum();
                said += &format!("; {messages} messages were recorded and {} lost", written.lost);
            }
            Some(Err(error)) => said += &format!("; the recording is not whole: {error}"),
        }
        tracing::info!("{}: {said}", self.address.uri);
        let mut settings = vec![("stream".to_owned(), said)];
        let faults = self.faults.summary();
        if !faults.is_empty() {
            // Where there was no view at all, this is why.
            if failure.is_none() && self.outlet.pushed() == 0 {
                failure = Some(format!("no view could be taken: {faults}"));
            }
            settings.push(("stream_faults".to_owned(), faults));
        }
        self.outlet.tell(settings);
        if let Some(reason) = failure {
            self.outlet.push(Err(SourceError::Uri { uri: self.address.uri.clone(), reason }));
        }
        self.outlet.end();
    }
}

/// What is said of pictures of a chosen topic that are something else by now.
fn another_content(index: &Index, topics: Topics, stream: usize) -> Option<String> {
    let of = |place: usize| index.pictures.get(place);
    let (now, chosen) = (of(stream)?, [topics.color, Some(topics.depth)]);
    if chosen.contains(&Some(stream)) {
        return None;
    }
    let was = chosen.into_iter().flatten().filter_map(of).find(|chosen| chosen.topic == now.topic)?;
    Some(format!(
        "field encoding: its pictures were {:?} as {:?} and are {:?} as {:?}: they are not used",
        was.content, was.kind, now.content, now.kind
    ))
}

/// The frame that poses are given in: the one that was asked for, or the root of the camera's tree if the camera moves in it.
pub(super) fn fixed_frame(index: &Index, camera: &str, wanted: Option<&str>) -> Option<String> {
    if let Some(wanted) = wanted {
        return Some(crate::messages::frame_name(wanted));
    }
    let root = index.transforms.root_of(camera);
    (root != camera && !index.transforms.is_fixed(root, camera)).then(|| root.to_owned())
}
