//! `/foxglove`: the inspection as Foxglove, and whatever else speaks its WebSocket protocol, can follow it. Each client follows the
//! live stream as a viewer does; what that says is put into Foxglove's schemas, and findings and mesh are read from what is kept.
//!
//! A point cloud is sent as a whole whenever it has changed, so that it is sent once a second at most, and few clients are served at
//! once: each holds all points in memory.

use super::access::Identity;
use super::client::{Farewell, login_ends};
use super::client_log::Kind;
use super::connections::Connection;
use super::limits::{Limits, seconds};
use super::past::Past;
use super::server::Shared;
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket};
use futures_util::StreamExt;
use prost::Message as _;
use prost_types::Timestamp;
use semascan_foxglove::protocol::{
    MOST_SUBSCRIPTIONS, Request, advertisement, message_frame, read_request, server_info, warning,
};
use semascan_foxglove::{Scene, Topic, findings, mesh};
use semascan_inspection::ports::InspectionState;
use semascan_model::InspectionId;
use semascan_protocol::{Hello, TAKES_REVIEWS};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::time::{Instant, timeout};

/// Clients that are served at once.
pub(super) const MOST_CLIENTS: usize = 4;
/// Least time between two messages of a topic.
const PERIOD: Duration = Duration::from_secs(1);
/// Largest scene that is sent as a mesh.
const LARGEST_MESH: u64 = 256 << 20;
/// The inspection's scene among its files.
const SCENE_FILE: &str = "scene.glb";
/// What it is called who follows the stream.
const NAME: &str = "Foxglove";

/// How a connection ends: from this side, or by itself.
type End = Option<Farewell>;

/// Serves one client until it leaves or misbehaves, its login ends, or the server ends.
pub(super) async fn serve(mut socket: WebSocket, shared: Shared, connection: Arc<Connection>, identity: Identity) {
    let end = match Arc::clone(&shared.foxglove).try_acquire_owned() {
        Err(_) => Some(Farewell::again(format!("{MOST_CLIENTS} clients of Foxglove's protocol follow already"))),
        Ok(_place) => {
            connection.views();
            shared.log.info(Kind::Connected, || "a client of Foxglove's protocol connected".to_owned());
            let end = tokio::select! {
                end = follow(&mut socket, &shared) => end,
                farewell = login_ends(&shared, &identity) => Some(farewell),
                () = shared.connections.ending() => Some(Farewell::away()),
            };
            shared.log.info(Kind::Left, || "a client of Foxglove's protocol left".to_owned());
            end
        }
    };
    if let Some(farewell) = end {
        // Whoever does not take it is cut off.
        let _ = timeout(PERIOD, socket.send(Message::Close(Some(farewell.frame())))).await;
    }
}

/// What a client has asked for.
#[derive(Debug, Default)]
struct Subscriptions(BTreeMap<u32, Topic>);

impl Subscriptions {
    /// Follows a text of the client: the topics that it wants to know all of now, and what is to be told to it.
    fn follow(&mut self, text: &str) -> Result<(BTreeSet<Topic>, Option<String>), String> {
        match read_request(text).map_err(|error| error.to_string())? {
            Request::Subscribe(wanted) => {
                if self.0.len() + wanted.len() > MOST_SUBSCRIPTIONS {
                    return Err(format!("more than {MOST_SUBSCRIPTIONS} subscriptions"));
                }
                let topics = wanted.iter().map(|(_, topic)| *topic).collect();
                self.0.extend(wanted);
                Ok((topics, None))
            }
            Request::Unsubscribe(ids) => {
                self.0.retain(|id, _| !ids.contains(id));
                Ok((BTreeSet::new(), None))
            }
            Request::Other(op) => {
                let op: String = op.chars().take(40).collect();
                Ok((BTreeSet::new(), Some(warning(&format!("this agent is only listened to: it does not take {op}")))))
            }
        }
    }

    fn topics(&self) -> BTreeSet<Topic> {
        self.0.values().copied().collect()
    }
}

/// Follows the stream for one client; how the connection ends.
async fn follow(socket: &mut WebSocket, shared: &Shared) -> End {
    let Shared { live, limits, .. } = shared;
    let agent = concat!("semascan ", env!("CARGO_PKG_VERSION"));
    let mut changes = live.changes();
    let hello = Hello { client: NAME.into(), capabilities: vec![TAKES_REVIEWS.into()], ..Hello::default() };
    let (mut cursor, welcome) = live.welcome(&hello);
    let mut messages = vec![welcome];
    let mut scene = Box::<Scene>::default();
    let mut subscriptions = Subscriptions::default();
    let session = nanoseconds().to_string();
    for text in [server_info(agent, &session), advertisement()] {
        if let Err(end) = send(socket, Message::Text(text.into()), limits).await {
            return end;
        }
    }
    let mut publish = Instant::now();
    let (mut heard, mut ping) = (Instant::now(), Instant::now() + seconds(limits.ping_s));
    loop {
        changes.mark_unchanged();
        messages.extend(std::iter::from_fn(|| live.next(&mut cursor)));
        if !messages.is_empty() {
            // Chunks are decoded beside the server's other work.
            let told = std::mem::take(&mut messages);
            match tokio::task::spawn_blocking(move || followed(scene, &told)).await {
                Ok(followed) => scene = followed,
                Err(error) => return Some(Farewell::again(error.to_string())),
            }
        }
        let is_due = scene.has_news(subscriptions.0.values().copied());
        tokio::select! {
            changed = changes.changed() => {
                if changed.is_err() {
                    return Some(Farewell::away());
                }
            }
            message = socket.next() => {
                heard = Instant::now();
                match message {
                    None | Some(Ok(Message::Close(_))) => return None,
                    Some(Err(error)) => return Some(Farewell::policy(error.to_string())),
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                    Some(Ok(Message::Binary(_))) => return Some(Farewell::policy("nothing may be published")),
                    Some(Ok(Message::Text(text))) => match subscriptions.follow(&text) {
                        Err(reason) => return Some(Farewell::policy(reason)),
                        Ok((wanted, said)) => {
                            wanted.into_iter().for_each(|topic| scene.renew(topic));
                            if let Some(said) = said
                                && let Err(end) = send(socket, Message::Text(said.into()), limits).await
                            {
                                return end;
                            }
                        }
                    },
                }
            }
            () = tokio::time::sleep_until(publish), if is_due => {
                let topics = subscriptions.topics();
                let past = shared.clone();
                let (returned, told) = match tokio::task::spawn_blocking(move || news(scene, &topics, &past)).await {
                    Ok(done) => done,
                    Err(error) => return Some(Farewell::again(error.to_string())),
                };
                scene = returned;
                for (topic, message) in told {
                    for (id, _) in subscriptions.0.iter().filter(|(_, wanted)| **wanted == topic) {
                        let frame = Message::Binary(message_frame(*id, nanoseconds(), &message).into());
                        if let Err(end) = send(socket, frame, limits).await {
                            return end;
                        }
                    }
                }
                publish = Instant::now() + PERIOD;
            }
            () = tokio::time::sleep_until(ping) => {
                if heard.elapsed() > seconds(limits.ping_s) + seconds(limits.pong_s) {
                    return Some(Farewell::again("no answer to a ping"));
                }
                if let Err(end) = send(socket, Message::Ping(Bytes::new()), limits).await {
                    return end;
                }
                ping = Instant::now() + seconds(limits.ping_s);
            }
        }
    }
}

/// The scene after messages of the stream.
fn followed(mut scene: Box<Scene>, messages: &[Bytes]) -> Box<Scene> {
    for message in messages {
        // They are the agent's own.
        if let Err(error) = scene.follow(message) {
            tracing::error!(%error, "a message of the stream is not shown in Foxglove");
        }
    }
    scene
}

/// What is new of `topics`, as messages. Findings and mesh of an inspection that has just ended may not be on the disk yet: they
/// stay new.
fn news(mut scene: Box<Scene>, topics: &BTreeSet<Topic>, shared: &Shared) -> (Box<Scene>, Vec<(Topic, Vec<u8>)>) {
    let now = Timestamp::from(SystemTime::now());
    let mut told = Vec::new();
    // Whoever subscribes later to another topic is told all of it then.
    for topic in scene.take_news().intersection(topics).copied() {
        let messages = match topic {
            Topic::Findings => kept(&scene, shared, |past, id| {
                let (_, state) = past.reviewed(id).ok()?;
                Some(findings(now, &state.findings.unwrap_or_default()).encode_to_vec())
            }),
            Topic::Mesh => kept(&scene, shared, |past, id| Some(mesh(now, scene_file(past, id)?).encode_to_vec())),
            _ => Kept::Known(scene.messages(topic, now)),
        };
        match messages {
            Kept::Known(messages) => told.extend(messages.into_iter().map(|message| (topic, message))),
            Kept::Nothing if topic == Topic::Findings => told.push((topic, findings(now, &[]).encode_to_vec())),
            Kept::Nothing => told.push((topic, mesh(now, None).encode_to_vec())),
            Kept::NotYet => scene.renew(topic),
        }
    }
    (scene, told)
}

/// What is kept of an inspection.
enum Kept {
    Known(Vec<Vec<u8>>),
    /// It has not ended, or is not kept.
    Nothing,
    /// It has ended, and is being written.
    NotYet,
}

/// What `read` makes of the inspection that is shown, once it has ended and if it is kept.
fn kept(scene: &Scene, shared: &Shared, read: impl FnOnce(&Past, InspectionId) -> Option<Vec<u8>>) -> Kept {
    let id = scene.inspection().parse().ok().filter(|_| scene.is_finished());
    let Some((id, past)) = id.zip(shared.past.as_ref()) else { return Kept::Nothing };
    match past.catalogue.inspection(id) {
        // Viewers are told the end before all of it is written.
        Ok(Some(row)) if row.state == InspectionState::Running => Kept::NotYet,
        Ok(Some(_)) => read(past, id).map_or(Kept::NotYet, |message| Kept::Known(vec![message])),
        Ok(None) => Kept::Nothing,
        Err(_) => Kept::NotYet,
    }
}

/// The scene of the final mesh: nothing where it cannot be read now, that there is none which can be sent, or its bytes.
fn scene_file(past: &Past, id: InspectionId) -> Option<Option<Vec<u8>>> {
    let Some(file) = past.archive.file(id, SCENE_FILE).ok()? else { return Some(None) };
    let mut bytes = Vec::new();
    file.content.take(LARGEST_MESH + 1).read_to_end(&mut bytes).ok()?;
    Some((bytes.len() as u64 <= LARGEST_MESH).then_some(bytes))
}

/// Waits until the socket has taken `message`; how the connection ends if it does not.
async fn send(socket: &mut WebSocket, message: Message, limits: &Limits) -> Result<(), End> {
    match timeout(seconds(limits.slow_s), socket.send(message)).await {
        Ok(Ok(())) => Ok(()),
        Ok(Err(_)) => Err(None),
        Err(_) => Err(Some(Farewell::again(format!("too slow: a message was not taken within {} s", limits.slow_s)))),
    }
}

/// Nanoseconds after 1970.
fn nanoseconds() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(now.as_nanos()).unwrap_or(u64::MAX)
}
