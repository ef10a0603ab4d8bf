//! The agent's REST interface, from the page: JSON in and out. Commands carry the header by which the agent tells what its own pages
//! ask from what others make a browser send. Where an inspection from a file is shown, the file answers.

use super::ApiError;
use crate::words::t;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{Request, RequestInit, Response};

/// An error as the agent says it (RFC 9457).
#[derive(Deserialize)]
struct Problem {
    detail: String,
}

/// What a file answers, by path.
type Answers = BTreeMap<String, Vec<u8>>;

/// Who answers: the agent that the page came from or, in its place, a file.
#[derive(Clone, Default)]
pub struct Agent {
    /// `None` while the agent answers.
    file: Rc<RefCell<Option<Answers>>>,
}

impl Agent {
    /// From now on a file answers.
    pub(crate) fn answer_from(&self, answers: Answers) {
        self.file.replace(Some(answers));
    }

    /// Asks for what is at `path`. A file has no pages: what a query would cut it answers as a whole.
    ///
    /// # Errors
    /// [`ApiError`].
    pub(crate) async fn get<T: DeserializeOwned>(&self, path: &str) -> Result<T, ApiError> {
        let of_file = self.file.borrow().as_ref().map(|answers| {
            let path = path.split_once('?').map_or(path, |(path, _)| path);
            answers.get(path).cloned()
        });
        match of_file {
            Some(Some(text)) => understood(200, &text),
            Some(None) => Err(ApiError::Refused { status: 404, reason: t!("link.file.silent").into() }),
            None => {
                let options = RequestInit::new();
                options.set_method("GET");
                answer(path, &options).await
            }
        }
    }

    /// Sends `body` (JSON) to `path`.
    ///
    /// # Errors
    /// [`ApiError`]; a file takes nothing.
    pub(crate) async fn post<T: DeserializeOwned>(&self, path: &str, body: &str) -> Result<T, ApiError> {
        if self.file.borrow().is_some() {
            return Err(ApiError::Refused { status: 405, reason: t!("link.file.decision").into() });
        }
        let options = RequestInit::new();
        options.set_method("POST");
        options.set_body(&body.into());
        answer(path, &options).await
    }
}

fn understood<T: DeserializeOwned>(status: u16, text: &[u8]) -> Result<T, ApiError> {
    serde_json::from_slice(text).map_err(|error| {
        let reason = t!("link.not_understood", error);
        ApiError::Refused { status, reason }
    })
}

async fn answer<T: DeserializeOwned>(path: &str, options: &RequestInit) -> Result<T, ApiError> {
    let (status, text) = text(path, options).await.map_err(|_| ApiError::Unreachable)?;
    match status {
        200..=299 => understood(status, text.as_bytes()),
        // It is busy, or starts: later it may not be.
        429 | 502..=504 => Err(ApiError::Unreachable),
        _ => {
            let said = serde_json::from_str::<Problem>(&text).map(|problem| problem.detail);
            let reason = said.unwrap_or_else(|_| t!("link.answered", status));
            Err(ApiError::Refused { status, reason })
        }
    }
}

/// Status and text of an answer.
async fn text(path: &str, options: &RequestInit) -> Result<(u16, String), JsValue> {
    let request = Request::new_with_str_and_init(path, options)?;
    request.headers().set("accept", "application/json")?;
    request.headers().set("content-type", "application/json")?;
    request.headers().set("x-semascan-request", "1")?;
    let window = web_sys::window().ok_or("the page has no window")?;
    let response: Response = JsFuture::from(window.fetch_with_request(&request)).await?.dyn_into()?;
    let text = JsFuture::from(response.text()?).await?;
    Ok((response.status(), text.as_string().unwrap_or_default()))
}
