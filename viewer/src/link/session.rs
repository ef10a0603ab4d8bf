//! What a connection carries on: turns the agent's messages into [`LinkEvent`]s and remembers which chunk revisions have
//! been passed on, so that the next `Hello` asks only for the difference.
//!
//! Passing an event to the page cannot fail, so what this side remembers is what the page holds.

use super::LinkEvent;
use semascan_shared::wire::server_message::Body;
use semascan_shared::wire::{
    ChunkGone, ChunkId, ChunkUpdate, ClientMessage, HeldChunk, Hello, Inspection, Welcome,
    WireError, chunk, client_message, decode_server,
};
use std::collections::BTreeMap;

/// Most chunks that a `Hello` lists: with more it would outgrow what an agent accepts, and starting over is no dearer.
const MAX_HELD: usize = 100_000;

/// What is held, of which inspection.
#[derive(Clone, Debug, Default)]
pub struct Session {
    inspection_id: String,
    epoch: u32,
    held: BTreeMap<[i32; 3], u32>,
    welcomed: bool,
}

impl Session {
    /// Holds nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// The first message of a new connection.
    pub fn hello(&mut self) -> ClientMessage {
        self.welcomed = false;
        let known = self.held.len() <= MAX_HELD;
        let held_chunk = |(id, revision): (&[i32; 3], &u32)| HeldChunk {
            id: Some(ChunkId::from_array(*id)),
            revision: *revision,
        };
        let hello = Hello {
            client: concat!("semascan-viewer ", env!("CARGO_PKG_VERSION")).to_owned(),
            capabilities: Vec::new(),
            inspection_id: if known {
                self.inspection_id.clone()
            } else {
                String::new()
            },
            epoch: self.epoch,
            held: if known {
                self.held.iter().map(held_chunk).collect()
            } else {
                Vec::new()
            },
        };
        ClientMessage {
            body: Some(client_message::Body::Hello(hello)),
        }
    }

    /// Whether the agent has answered the present connection.
    pub fn is_welcomed(&self) -> bool {
        self.welcomed
    }

    /// Takes in one binary message; `None` if it is out of date and tells nothing new.
    pub fn receive(&mut self, bytes: &[u8]) -> Option<LinkEvent> {
        let event = decode_server(bytes).and_then(|message| match message.body {
            Some(body) => self.take(body),
            None => Err(WireError::Empty),
        });
        event.unwrap_or_else(|error| {
            Some(LinkEvent::Malformed {
                reason: error.to_string(),
            })
        })
    }

    fn take(&mut self, body: Body) -> Result<Option<LinkEvent>, WireError> {
        let greeting = matches!(body, Body::Welcome(_) | Body::Refused(_));
        if !self.welcomed && !greeting {
            return Err(WireError::Field {
                field: "body",
                reason: "a message before the welcome".to_owned(),
            });
        }
        Ok(match body {
            Body::Welcome(welcome) => Some(self.welcome(welcome)?),
            Body::Refused(refused) => Some(LinkEvent::Refused {
                reason: refused.reason,
            }),
            Body::Clear(clear) => {
                let inspection = required("clear.inspection", clear.inspection)?;
                self.start_over(&inspection);
                Some(LinkEvent::Cleared(inspection))
            }
            Body::Progress(progress) => Some(LinkEvent::Progress(progress)),
            Body::Stage(stage) => Some(LinkEvent::Stage(stage)),
            Body::View(view) => Some(LinkEvent::View(view)),
            Body::Chunk(update) => self.chunk(&update)?,
            Body::Gone(gone) => self.gone(&gone)?,
        })
    }

    fn welcome(&mut self, welcome: Welcome) -> Result<LinkEvent, WireError> {
        let inspection = required("welcome.inspection", welcome.inspection)?;
        let same = inspection.id == self.inspection_id && inspection.epoch == self.epoch;
        if welcome.resumed && !same {
            let reason = "resumed, but another inspection or epoch than was held".to_owned();
            return Err(WireError::Field {
                field: "welcome.resumed",
                reason,
            });
        }
        if !welcome.resumed {
            self.start_over(&inspection);
        }
        self.welcomed = true;
        Ok(LinkEvent::Connected {
            inspection,
            resumed: welcome.resumed,
            agent: welcome.agent,
        })
    }

    fn start_over(&mut self, inspection: &Inspection) {
        self.inspection_id.clone_from(&inspection.id);
        self.epoch = inspection.epoch;
        self.held.clear();
    }

    fn chunk(&mut self, update: &ChunkUpdate) -> Result<Option<LinkEvent>, WireError> {
        if update.epoch != self.epoch {
            return Ok(None);
        }
        let decoded = chunk::decode(update)?;
        if self
            .held
            .get(&decoded.id)
            .is_some_and(|held| *held >= decoded.revision)
        {
            return Ok(None);
        }
        self.held.insert(decoded.id, decoded.revision);
        Ok(Some(LinkEvent::Chunk(decoded)))
    }

    fn gone(&mut self, gone: &ChunkGone) -> Result<Option<LinkEvent>, WireError> {
        let id = required("gone.id", gone.id)?.to_array();
        if gone.epoch != self.epoch || self.held.get(&id).is_none_or(|held| *held > gone.revision) {
            return Ok(None);
        }
        self.held.remove(&id);
        Ok(Some(LinkEvent::ChunkGone { id }))
    }
}

fn required<T>(field: &'static str, value: Option<T>) -> Result<T, WireError> {
    value.ok_or_else(|| WireError::Field {
        field,
        reason: "missing".to_owned(),
    })
}
