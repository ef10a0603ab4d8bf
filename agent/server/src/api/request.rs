//! What requests say: identifiers and parameters, checked; and work that blocks, kept off the threads that answer.

use super::super::server::Shared;
use super::problem::Problem;
use crate::past::Past;
use axum::http::StatusCode;
use semascan_inspection::ports::{Accounts, InspectionRow};
use semascan_model::InspectionId;
use semascan_model::record::InspectionRecord;
use std::fmt::Display;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Semaphore;
use tokio::time::timeout;

/// Requests that read from the disk at once; more would take the processor from the inspection.
pub(crate) const READERS: usize = 4;
/// Commands at once. They are taken in one after the other; this bounds the threads that wait.
pub(crate) const COMMANDS: usize = 16;
/// How long a request waits for its turn.
const TURN: Duration = Duration::from_secs(10);

/// What is kept; a problem where the agent keeps nothing.
pub(super) fn past(shared: &Shared) -> Result<Arc<Past>, Problem> {
    shared
        .past
        .clone()
        .ok_or_else(|| Problem::not_found("this agent keeps no inspections: `semascan serve --data DIR` does"))
}

/// Does `work` on a thread that may wait, in its turn.
pub(super) async fn blocking<T: Send + 'static>(
    shared: &Shared,
    work: impl FnOnce(&Past) -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    let past = past(shared)?;
    in_turn(&shared.readers, move || work(&past)).await
}

/// As [`blocking`], for a command: it does not wait for those who read pictures and models.
pub(super) async fn command<T: Send + 'static>(
    shared: &Shared,
    work: impl FnOnce(&Past) -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    let past = past(shared)?;
    in_turn(&shared.commands, move || work(&past)).await
}

/// As [`blocking`], with the users of the agent; a problem where nobody logs in here.
pub(super) async fn reading_accounts<T: Send + 'static>(
    shared: &Shared,
    work: impl FnOnce(&dyn Accounts) -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    let accounts = shared.entry.accounts().ok_or_else(|| {
        Problem::not_found("this agent asks nobody to log in: `semascan audit accounts` shows the log of a data folder")
    })?;
    in_turn(&shared.readers, move || work(accounts.as_ref())).await
}

async fn in_turn<T: Send + 'static>(
    turns: &Arc<Semaphore>,
    work: impl FnOnce() -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    let busy = || Problem::new(StatusCode::SERVICE_UNAVAILABLE, "too many requests at once: try again");
    let turn = timeout(TURN, Arc::clone(turns).acquire_owned()).await;
    let turn = turn.map_err(|_| busy())?.map_err(|_| busy())?;
    let done = tokio::task::spawn_blocking(move || {
        let result = work();
        drop(turn);
        result
    });
    done.await.unwrap_or_else(|error| {
        tracing::error!("a request could not be answered: {error}");
        Err(Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "this is a fault of the program"))
    })
}

/// The identifier of an inspection in a path.
pub(super) fn inspection_id(text: &str) -> Result<InspectionId, Problem> {
    // Only as it is written everywhere: one inspection has one address.
    match text.parse::<InspectionId>() {
        Ok(id) if id.to_string() == text => Ok(id),
        _ => Err(Problem::parameter("inspection", text, "is no identifier of an inspection: a UUID in lower case")),
    }
}

/// The number of a view in a path.
pub(super) fn view_number(text: &str) -> Result<u32, Problem> {
    let plain = text.bytes().all(|b| b.is_ascii_digit()) && (text == "0" || !text.starts_with('0'));
    match text.parse() {
        Ok(number) if plain => Ok(number),
        _ => Err(Problem::parameter("view", text, "is no number of a view: 0, 1, 2 ...")),
    }
}

/// A parameter that stands for something else; `None` where it is not given.
pub(super) fn parsed<T: FromStr>(name: &str, given: Option<&str>) -> Result<Option<T>, Problem>
where
    T::Err: Display,
{
    let parse =
        |text: &str| text.parse().map_err(|error| Problem::parameter(name, text, format!("cannot be read: {error}")));
    given.map(parse).transpose()
}

/// How many a page has at most.
pub(super) fn limit(given: Option<&str>, default: u32, most: u32) -> Result<u32, Problem> {
    match given.map(|text| (text, text.parse::<u32>())) {
        None => Ok(default),
        Some((_, Ok(limit))) if (1..=most).contains(&limit) => Ok(limit),
        Some((text, _)) => Err(Problem::parameter("limit", text, format!("is no number from 1 to {most}"))),
    }
}

impl Past {
    /// The row of an inspection.
    pub(super) fn row(&self, id: InspectionId) -> Result<InspectionRow, Problem> {
        let row = self.catalogue.inspection(id)?;
        row.ok_or_else(|| Problem::not_found(format!("there is no inspection {id}")))
    }

    /// The record of an inspection that has one.
    pub(super) fn record(&self, id: InspectionId) -> Result<InspectionRecord, Problem> {
        self.row(id)?;
        let record = self.archive.record(id)?;
        record.ok_or_else(|| {
            Problem::not_found(format!("inspection {id} has no record: it was cut off at its beginning"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_and_numbers_have_one_way_to_be_written() {
        let id = InspectionId::new(1, &[0xab; 10]).to_string();
        assert!(inspection_id(&id).is_ok());
        for wrong in [id.to_uppercase(), id.replace('-', ""), format!("{{{id}}}"), "..".into(), String::new()] {
            assert!(inspection_id(&wrong).is_err(), "{wrong}");
        }
        assert_eq!(view_number("17").ok(), Some(17));
        for wrong in ["", "-1", "+1", "01", "1.0", "4294967296", "١"] {
            assert!(view_number(wrong).is_err(), "{wrong}");
        }
        assert_eq!(limit(Some("200"), 50, 200).ok(), Some(200));
        for wrong in ["0", "201", "-1", "x", ""] {
            assert!(limit(Some(wrong), 50, 200).is_err(), "{wrong}");
        }
    }
}
