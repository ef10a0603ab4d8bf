//! A camera that streams: a server of Foxglove's WebSocket protocol, as ROS has in `foxglove_bridge` and robots' programs by
//! Foxglove's SDK. Colour and depth become views as they come, in the same way as those of a recording.
//!
//! What streams at camera rate is not inspected whole. A rule says which pairs become views ([`Trigger`]), anybody may ask for one
//! ([`CaptureTrigger`]), and what is not taken is counted. With `record=FILE` everything is written, too. Three threads share the
//! work, so that none holds another up: the connection, the one that follows the stream, and the recorder.
//!
//! | file | what |
//! |---|---|
//! | `address.rs` | what a `ws://` address says: where, and the keys behind the `?` |
//! | `link.rs` | the connection, which is made again when it is lost |
//! | `follower.rs` | what is made of the messages |
//! | `pairs.rs` | colour and depth that belong together, as they come |
//! | `trigger.rs` | when a view is taken |
//! | `outlet.rs` | views that wait to be inspected |
//! | `recorder.rs` | what comes, in an MCAP file |
//! | `probe.rs` | what a stream is like, for `semascan doctor` |
//! | `faults.rs`, `rate.rs` | what goes wrong, and whether pictures still come |

mod address;
mod faults;
#[cfg(test)]
mod faults_injected;
mod follower;
mod link;
mod outlet;
mod pairs;
mod probe;
mod rate;
mod recorder;
#[cfg(test)]
mod test_server;
#[cfg(test)]
mod tests;
mod trigger;

pub use address::{LIVE_KEYS, LiveAddress};
pub use faults::{Fault, FaultKind, Faults};
pub use probe::{Probe, Topic, probe};
pub use recorder::{Recorded, record};
pub use trigger::Trigger;

use crate::OpenOptions;
use follower::Follower;
use link::{Opened, Wanted};
use outlet::{Next, Outlet};
use recorder::Recorder;
use semascan_inspection::StopSwitch;
use semascan_inspection::source::{CaptureTrigger, Source, SourceError, SourceInfo};
use semascan_model::Taxonomy;
use semascan_perception::view::View;
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// How often it is looked whether views are still wanted.
const LOOK: Duration = Duration::from_millis(100);

/// A camera that streams.
pub struct LiveSource {
    info: SourceInfo,
    /// Views until the end.
    views: Option<u32>,
    outlet: Arc<Outlet>,
    follower: Option<JoinHandle<()>>,
    asked: CaptureTrigger,
    faults: Faults,
    stop: StopSwitch,
    /// Views that were given.
    given: u32,
}

impl LiveSource {
    /// Connects to the server; it is an error if there is none.
    ///
    /// # Errors
    /// [`SourceError`] if nobody answers there, a key cannot be used, or the file to record into cannot be made.
    pub fn open(address: LiveAddress, options: OpenOptions) -> Result<Self, SourceError> {
        let uri = address.uri.clone();
        let options = OpenOptions { recording: address.recording.clone(), ..options };
        let refuse = |reason: String| SourceError::Uri { uri: uri.clone(), reason };
        if options.intrinsics.is_some() {
            return Err(refuse("its messages say what camera it is of: no other can be given".to_owned()));
        }
        let opened = Opened::new(&address.server).map_err(refuse)?;
        let faults = Faults::new(&uri);
        let recorder = address.record.as_deref().map(|path| Recorder::begin(path, faults.clone())).transpose()?;
        let topic = match &address.trigger {
            Trigger::Topic(topic) => Some(topic.clone()),
            _ => None,
        };
        let link = opened.follow(Wanted { topic, follows_all: false, recorder }, faults.clone()).map_err(refuse)?;
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
        let (views, outlet, asked) = (address.views, Arc::<Outlet>::default(), CaptureTrigger::default());
        let follower = Follower::new(address, options, link, Arc::clone(&outlet), faults.clone(), asked.clone());
        let follower = thread::Builder::new()
            .name("stream".into())
            .spawn(move || follower.run())
            .map_err(|error| refuse(error.to_string()))?;
        Ok(Self { info, views, outlet, follower: Some(follower), asked, faults, stop: StopSwitch::default(), given: 0 })
    }

    /// What goes wrong, as it happens.
    pub fn faults(&self) -> Faults {
        self.faults.clone()
    }

    /// Ends the stream; what it says of itself in the end is then known.
    fn end(&mut self) {
        self.outlet.close();
        if let Some(follower) = self.follower.take()
            && follower.join().is_err()
        {
            tracing::error!("{}: the thread that followed it ended unexpectedly", self.info.uri);
        }
        self.info.settings.extend(self.outlet.told());
    }
}

impl Source for LiveSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        while self.follower.is_some() {
            if self.stop.is_set() || self.views.is_some_and(|views| self.given >= views) {
                self.end();
                return None;
            }
            let next = self.outlet.next(LOOK);
            self.info.settings.extend(self.outlet.told());
            match next {
                Next::View(view) => {
                    let number = self.given;
                    self.given += u32::from(view.is_ok());
                    return Some(view.map(|view| View { index: number, ..view }));
                }
                Next::Nothing if self.follower.as_ref().is_some_and(JoinHandle::is_finished) => self.end(),
                Next::Nothing => {}
                Next::End => self.end(),
            }
        }
        None
    }

    fn end_with(&mut self, stop: &StopSwitch) {
        self.stop = stop.clone();
    }

    fn capture_trigger(&self) -> Option<CaptureTrigger> {
        Some(self.asked.clone())
    }
}

impl Drop for LiveSource {
    fn drop(&mut self) {
        // What was recorded is brought to its end.
        self.end();
    }
}
