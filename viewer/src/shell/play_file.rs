//! Inspections in files (`.semascan`): what a person opens, or the agent makes of what it keeps. A worker plays the file as if it
//! were an agent; what the page would ask an agent, the file answers.

use super::open_file::{self, FetchError};
use super::viewport::Viewport;
use crate::features::timeline::TimelineEvent;
use crate::link::Link;
use crate::link::player::stops;
use crate::state::Event;
use crate::state::account::Account;
use crate::state::notices::{Level, Topic};
use crate::ui::object_url::ObjectUrl;
use crate::words::t;
use js_sys::{ArrayBuffer, Promise, Uint8Array};
use semascan_model::Role;
use semascan_protocol::{FILE_ENDING, FileAnswer, FileError, InspectionFile};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use wasm_bindgen::JsValue;
use wasm_bindgen_futures::{JsFuture, spawn_local};

/// HTTP status of an inspection that runs.
const CONFLICT: u16 = 409;
/// How often it is asked for again, and after how long.
const MOST_TRIES: u32 = 10;
const AGAIN_MS: i32 = 500;

/// Where model and messages come from.
pub(super) struct Source {
    pub(super) link: Link,
    /// Photographs that came with a file: their addresses hold as long as these are kept.
    _photographs: Vec<ObjectUrl>,
}

impl Source {
    /// An agent.
    pub(super) fn agent(link: Link) -> Self {
        Self { link, _photographs: Vec::new() }
    }
}

/// What the page follows; nothing while there is nothing to be followed.
pub(super) type Followed = Rc<RefCell<Option<Source>>>;

/// Whether a file of that name is an inspection.
pub(super) fn is_inspection(name: &str) -> bool {
    name.rsplit_once('.').is_some_and(|(_, ending)| ending.eq_ignore_ascii_case(FILE_ENDING))
}

/// Shows the inspection in a file that a person opened.
///
/// # Errors
/// Why it cannot be shown; what was shown stays.
pub(super) fn show_file(
    viewport: &Rc<Viewport>,
    followed: &Followed,
    name: &str,
    buffer: &ArrayBuffer,
) -> Result<(), String> {
    let ui = viewport.ui;
    let file = read(name, buffer)?;
    let link = play(viewport, buffer)?;
    let photographs: BTreeMap<u32, ObjectUrl> = file
        .answers
        .iter()
        .filter_map(|answer| Some((view_of(&answer.path)?, ObjectUrl::new(&answer.body, &answer.media_type)?)))
        .collect();
    let addresses = photographs.iter().map(|(view, url)| (*view, url.address().to_owned())).collect();
    let (answers, stops) = (texts(&file.answers), stops(&file.messages));
    followed.replace(Some(Source { link, _photographs: photographs.into_values().collect() }));
    viewport.agent.answer_from(answers);
    ui.retract(Topic::File);
    ui.send(Event::Opened(name.to_owned()));
    ui.send(Event::Photographs(addresses));
    ui.send(Event::Account(Account { name: String::new(), role: Role::Viewer, login: false, keeps: true }));
    ui.send_feature(TimelineEvent::Loaded(stops));
    Ok(())
}

/// Has the agent make a file of the inspection that is shown, and plays that.
pub(super) fn play_inspection(viewport: &Rc<Viewport>, followed: &Followed) {
    let (viewport, followed) = (viewport.clone(), followed.clone());
    let id = viewport.ui.read(|s| s.inspection.id.clone());
    spawn_local(async move {
        let ui = viewport.ui;
        let path = format!("/api/v1/inspections/{id}/inspection.{FILE_ENDING}");
        let name = format!("{id}.{FILE_ENDING}");
        let mut fetched = open_file::fetched(&path).await;
        for _ in 0..MOST_TRIES {
            if !matches!(fetched, Err(FetchError::Refused(CONFLICT))) {
                break;
            }
            // The agent closes an inspection a moment after its end.
            rest(AGAIN_MS).await;
            fetched = open_file::fetched(&path).await;
        }
        let played = match fetched {
            Ok(buffer) => read(&name, &buffer).and_then(|file| Ok((file, play(&viewport, &buffer)?))),
            Err(error) => Err(error.reason()),
        };
        match played {
            // The person may look at something else by now.
            _ if ui.read(|s| s.inspection.id != id || s.connection.is_file()) => {}
            Ok((file, link)) => {
                followed.replace(Some(Source::agent(link)));
                ui.send(Event::Recorded);
                ui.send_feature(TimelineEvent::Loaded(stops(&file.messages)));
            }
            Err(reason) => {
                ui.send_feature(TimelineEvent::NotLoaded);
                ui.notify(Level::Error, Topic::File, t!("timeline.not_played", reason));
            }
        }
    });
}

/// Lets so many milliseconds go by.
async fn rest(ms: i32) {
    let wait = Promise::new(&mut |done, failed| {
        let window = web_sys::window();
        let timer = window.map(|window| window.set_timeout_with_callback_and_timeout_and_arguments_0(&done, ms));
        // Nobody waits for ever.
        if !matches!(timer, Some(Ok(_))) {
            let _ = failed.call0(&JsValue::NULL);
        }
    });
    let _ = JsFuture::from(wait).await;
}

fn read(name: &str, buffer: &ArrayBuffer) -> Result<InspectionFile, String> {
    let file = InspectionFile::read(Uint8Array::new(buffer).to_vec().into());
    let file = file.map_err(|error| format!("{name}: {}", in_words(&error)))?;
    if file.messages.is_empty() { Err(t!("file.empty", name)) } else { Ok(file) }
}

fn in_words(error: &FileError) -> String {
    match error {
        FileError::Other => t!("file.other").into(),
        FileError::Newer => t!("file.newer").into(),
        FileError::Cut(count) => t!("file.cut", count),
        FileError::Entry { entry, .. } => t!("file.entry", entry),
    }
}

fn play(viewport: &Rc<Viewport>, buffer: &ArrayBuffer) -> Result<Link, String> {
    let follows = viewport.clone();
    Link::play(buffer, move |event| follows.handle_link(event)).map_err(|error| {
        web_sys::console::error_1(&error);
        t!("file.no_player").to_owned()
    })
}

/// What is answered in words, by its path; pictures are had in another way.
fn texts(answers: &[FileAnswer]) -> BTreeMap<String, Vec<u8>> {
    let is_text = |answer: &&FileAnswer| view_of(&answer.path).is_none();
    answers.iter().filter(is_text).map(|answer| (answer.path.clone(), answer.body.to_vec())).collect()
}

/// The view whose photograph in full size has this path.
fn view_of(path: &str) -> Option<u32> {
    path.strip_suffix("/color.png")?.rsplit_once("/views/")?.1.parse().ok()
}
