//! A camera that streams: a server of Foxglove's WebSocket protocol, as ROS has in `foxglove_bridge` and robots' programs by
//! Foxglove's SDK. Colour and depth become views as they come, in the same way as those of a recording.
//!
//! What streams at camera rate is not inspected whole. By default every pair is offered and the inspection takes what it can; with
//! `trigger=still` a view is taken where the camera has moved to another place and rests there. What is not taken is counted.
//!
//! | file | what |
//! |---|---|
//! | `address.rs` | what a `ws://` address says: where, and the keys behind the `?` |
//! | `link.rs` | the connection, which is made again when it is lost |
//! | `pairs.rs` | colour and depth that belong together, as they come |
//! | `stillness.rs` | when a view is taken |
//! | `recorder.rs` | what comes, in an MCAP file |

mod address;
mod link;
mod pairs;
mod recorder;
mod stillness;
#[cfg(test)]
mod tests;

pub use address::{LIVE_KEYS, LiveAddress};
pub use recorder::{Recorded, record};

use crate::OpenOptions;
use crate::messages::Stamp;
use crate::recording::{CameraFrame, Chosen, Found, Index, Place, PlannedView, Scan, ViewMaker, camera_frame};
use link::{Happening, Link};
use nalgebra::Isometry3;
use pairs::{Held, Pairing};
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_model::Taxonomy;
use semascan_perception::view::View;
use std::collections::VecDeque;
use std::time::{Duration, Instant};
use stillness::Stillness;

/// How long streams are watched before it is chosen which of them are colour and depth: the better one may come later.
const LOOK_AROUND: Duration = Duration::from_millis(1500);
/// Bytes of pictures that are held until then.
const MOST_EARLY: usize = 256 << 20;
/// How long a pair waits for the transforms of its time.
const POSE_WAIT: u64 = 1_000_000_000;
/// Poses of before this are forgotten.
const POSES_KEPT: i64 = 10_000_000_000;
/// A clock that goes back by more than this was set: what waits is of another time.
const CLOCK_BACK: i64 = 1_000_000_000;

/// A camera that streams.
pub struct LiveSource {
    address: LiveAddress,
    options: OpenOptions,
    info: SourceInfo,
    link: Link,
    scan: Scan,
    /// Until it is chosen what is inspected, the latest pictures.
    early: VecDeque<(usize, Held)>,
    chosen: Option<Streams>,
    /// Pairs that wait for their pose.
    waiting: VecDeque<(Option<Held>, Held)>,
    stillness: Stillness,
    counts: Counts,
    next: u32,
    began: Option<Instant>,
    /// When the last picture came.
    heard: Instant,
    /// The latest time of a picture.
    clock: Option<Stamp>,
    is_over: bool,
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
    connections: u32,
    clock_set: u32,
}

impl LiveSource {
    /// Connects to the server; it is an error if there is none.
    ///
    /// # Errors
    /// [`SourceError::Uri`] if nobody answers there, or a key cannot be used.
    pub fn open(address: LiveAddress, options: OpenOptions) -> Result<Self, SourceError> {
        let uri = address.uri.clone();
        let options = OpenOptions { recording: address.recording.clone(), ..options };
        let refuse = |reason: String| SourceError::Uri { uri: uri.clone(), reason };
        if options.intrinsics.is_some() {
            return Err(refuse("its messages say what camera it is of: no other can be given".to_owned()));
        }
        let link = Link::connect(&address.server).map_err(refuse)?;
        let info = SourceInfo {
            uri: uri.clone(),
            part: "part before a live camera".into(),
            taxonomy: Taxonomy::from_names::<&str>(&[], &[]),
            view_count: address.views,
            turntable: None,
            volume: None,
            no_labels: Some("live cameras have no labels".into()),
            settings: Vec::new(),
        };
        let scan = Scan::new(&options.recording);
        let stillness = Stillness::new(&address);
        Ok(Self {
            address,
            options,
            info,
            link,
            scan,
            early: VecDeque::new(),
            chosen: None,
            waiting: VecDeque::new(),
            stillness,
            counts: Counts::default(),
            next: 0,
            began: None,
            heard: Instant::now(),
            clock: None,
            is_over: false,
        })
    }

    /// Follows what happened on the link.
    fn follow(&mut self, happening: Happening) {
        match happening {
            Happening::Connected { server } => {
                self.counts.connections += 1;
                tracing::info!("{}: connected to {server}", self.info.uri);
            }
            Happening::Lost { reason } => {
                tracing::warn!("{}: the connection is lost ({reason}); it is made again", self.info.uri);
                // What was half of a pair has no other half any more.
                if let Some(streams) = &mut self.chosen {
                    streams.pairing.clear();
                }
            }
            Happening::Remark { text } => tracing::warn!("{}: the server says: {text}", self.info.uri),
            Happening::Message(message) => {
                let place = Place { block: 0, offset: 0, length: message.bytes.len() };
                let found = Found { logged: message.logged, place, message: &message.bytes };
                let Some(stream) = self.scan.take(0, &message.channel, found) else { return };
                let Some(picture) = self.scan.take_last_picture(stream) else { return };
                self.heard = Instant::now();
                self.began.get_or_insert(self.heard);
                self.set_clock(picture.stamp);
                self.picture(stream, Held { picture, bytes: message.bytes });
            }
        }
    }

    /// Notes the time of a picture; one that lies far back says that the clock was set.
    fn set_clock(&mut self, stamp: Stamp) {
        if self.clock.is_some_and(|clock| clock.nanoseconds - stamp.nanoseconds > CLOCK_BACK) {
            self.counts.clock_set += 1;
            tracing::warn!("{}: its clock went back: what was waiting for its pair is dropped", self.info.uri);
            self.clock = None;
            self.waiting.clear();
            self.early.clear();
            if let Some(streams) = &mut self.chosen {
                streams.pairing.clear();
            }
            self.scan.forget_moving();
        }
        self.clock = self.clock.max(Some(stamp));
        let oldest = Stamp { nanoseconds: stamp.nanoseconds.saturating_sub(POSES_KEPT) };
        self.scan.forget_before(oldest);
    }

    fn picture(&mut self, stream: usize, held: Held) {
        let Some(streams) = &mut self.chosen else {
            self.early.push_back((stream, held));
            // What is chosen may never come.
            while self.early.iter().map(|(_, held)| held.bytes.len()).sum::<usize>() > MOST_EARLY {
                self.early.pop_front();
            }
            return;
        };
        let pairs = streams.pairing.take(streams.maker.topics(), stream, held);
        self.counts.pairs += pairs.len() as u64;
        self.waiting.extend(pairs);
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
        let pairing = Pairing::new(self.options.recording.pairing_tolerance);
        self.info.settings.extend(settings);
        self.chosen = Some(Streams { maker, pairing, camera });
        for (stream, held) in std::mem::take(&mut self.early) {
            self.picture(stream, held);
        }
        Ok(())
    }

    /// The next pair that is to be a view, if there is one by now.
    fn next_pair(&mut self) -> Option<(Option<Held>, Held, Option<Isometry3<f64>>)> {
        let camera = self.chosen.as_ref()?.camera.clone();
        while let Some((_, depth)) = self.waiting.front() {
            let stamp = depth.picture.stamp;
            let index = self.scan.index();
            let fixed = fixed_frame(index, &camera.name, self.options.recording.fixed_frame.as_deref());
            let pose = fixed.as_deref().map(|fixed| camera.pose(&index.transforms, fixed, stamp));
            let late = self.clock.is_some_and(|clock| clock.nanoseconds - stamp.nanoseconds > POSE_WAIT as i64);
            let pose = match pose {
                None if self.address.waits_for_rest => {
                    self.leave_out("trigger=still needs transforms that move, or fixed_frame=FRAME");
                    continue;
                }
                None => None,
                Some(Ok(pose)) => Some(pose),
                // The transforms of this time may still come.
                Some(Err(_)) if !late => return None,
                Some(Err(error)) => {
                    self.leave_out(&error.to_string());
                    continue;
                }
            };
            let (color, depth) = self.waiting.pop_front()?;
            let is_taken = self.stillness.takes(pose.as_ref(), || {
                let earlier = Stamp { nanoseconds: stamp.nanoseconds - self.address.still.as_nanos() as i64 };
                fixed.as_deref().and_then(|fixed| camera.pose(&index.transforms, fixed, earlier).ok())
            });
            if is_taken {
                return Some((color, depth, pose));
            }
            self.counts.passed_over += 1;
        }
        None
    }

    /// Leaves the oldest pair out, which has no pose for a reason.
    fn leave_out(&mut self, reason: &str) {
        self.waiting.pop_front();
        self.counts.without_pose += 1;
        if self.counts.without_pose == 1 {
            tracing::warn!("{}: a view is left out, and so are all others without a pose: {reason}", self.info.uri);
        }
    }

    /// The end: says what became of what came.
    fn end(&mut self) {
        self.is_over = true;
        let Counts { pairs, passed_over, without_pose, connections, clock_set } = self.counts;
        let dropped = self.link.dropped();
        let said = format!(
            "{pairs} pairs came, {passed_over} were passed over, {without_pose} had no pose; {dropped} messages were dropped \
             because they came faster than they were taken; {connections} connections, the clock was set {clock_set} times"
        );
        tracing::info!("{}: {said}", self.info.uri);
        self.info.settings.push(("stream".to_owned(), said));
    }
}

/// The frame that poses are given in: the one that was asked for, or the root of the camera's tree if the camera moves in it.
fn fixed_frame(index: &Index, camera: &str, wanted: Option<&str>) -> Option<String> {
    if let Some(wanted) = wanted {
        return Some(crate::messages::frame_name(wanted));
    }
    let root = index.transforms.root_of(camera);
    (root != camera && !index.transforms.is_fixed(root, camera)).then(|| root.to_owned())
}

impl Source for LiveSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        if self.address.views.is_some_and(|views| self.next >= views) && !self.is_over {
            self.end();
        }
        while !self.is_over {
            if let Some((color, depth, table_from_camera)) = self.next_pair() {
                let number = self.next;
                self.next += 1;
                let planned = PlannedView {
                    color: color.as_ref().map(|color| color.picture),
                    depth: depth.picture,
                    table_from_camera,
                };
                let bytes = color.as_ref().map(|color| color.bytes.as_slice());
                let index = self.scan.index();
                let Some(streams) = &mut self.chosen else { continue };
                let view = streams.maker.view(index, number, &planned, bytes, &depth.bytes);
                return Some(view.map_err(|reason| SourceError::Uri {
                    uri: self.info.uri.clone(),
                    reason: format!("view {number}: {reason}"),
                }));
            }
            let happening = self.link.next(Duration::from_millis(200));
            let is_silent = happening.is_none() && self.heard.elapsed() > self.address.silence;
            if let Some(happening) = happening {
                self.follow(happening);
            }
            let has_looked = self.began.is_some_and(|began| began.elapsed() > LOOK_AROUND);
            // Pictures of which none can be measured in are no more than silence.
            let is_in_vain = is_silent || self.began.is_some_and(|began| began.elapsed() > self.address.silence);
            if self.chosen.is_none() && (has_looked || is_in_vain) {
                match self.choose() {
                    Ok(()) => continue,
                    // More may come.
                    Err(_) if !is_in_vain => {}
                    Err(reason) => {
                        self.is_over = true;
                        let seconds = self.address.silence.as_secs_f64();
                        let reason = format!("{reason}, for {seconds} s");
                        return Some(Err(SourceError::Uri { uri: self.info.uri.clone(), reason }));
                    }
                }
            } else if is_silent {
                self.end();
            }
        }
        None
    }
}
