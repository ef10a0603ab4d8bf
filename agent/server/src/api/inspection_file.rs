//! `/inspections/{inspection}/inspection.semascan`: a whole inspection as one file, which the viewer opens without an agent. It holds
//! the messages of the stream with their times, and what this API answers about the inspection.

use super::super::server::Shared;
use super::problem::Problem;
use super::request::{blocking, inspection_id, past};
use super::{answer, findings, inspections, measurements, reviews, views};
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::rejection::QueryRejection;
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::Response;
use futures_util::{StreamExt, stream};
use semascan_inspection::ports::InspectionState;
use semascan_protocol::file_entry::Content;
use semascan_protocol::{FileAnswer, InspectionFile};
use serde::Deserialize;
use std::io::Error;
use utoipa::IntoParams;

/// What goes into the file.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct FileQuery {
    /// `true`: the photographs of all views in full size, too. They are by far the most of the file.
    #[param(value_type = bool)]
    photographs: Option<String>,
}

/// A piece of the file.
enum Piece {
    Entry(Bytes),
    /// The photograph of a view, read when it is its turn.
    Photograph(u32),
}

/// A whole inspection as one file. An inspection that runs has none yet.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/inspection.semascan",
    tag = "exports",
    params(("inspection" = String, Path, description = "The inspection"), FileQuery),
    responses((status = 200, description = "The file", content_type = "application/octet-stream", body = [u8]))
)]
pub(super) async fn whole(
    State(shared): State<Shared>,
    Path(text): Path<String>,
    query: Result<Query<FileQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let id = inspection_id(&text)?;
    let Query(query) = query.map_err(|rejection| Problem::of_query(&rejection))?;
    let with_photographs = super::request::parsed("photographs", query.photographs.as_deref())?.unwrap_or(false);
    let (row, log) = blocking(&shared, move |past| Ok((past.row(id)?, reviews::all(past, id)))).await?;
    if row.state == InspectionState::Running {
        return Err(Problem::new(StatusCode::CONFLICT, "the inspection runs: it is a file when it has ended"));
    }
    let messages = shared.replays.messages(&past(&shared)?, id).await?;

    let mut pieces: Vec<Piece> = messages.into_iter().map(|message| entry(Content::Message(message))).collect();
    let own = format!("/api/v1/inspections/{text}");
    let (state, path) = (|| State(shared.clone()), || Path(text.clone()));
    let none = HeaderMap::new;
    // What there is not, is not in the file either.
    let answers = [
        ("", inspections::one(state(), path(), none()).await),
        ("/findings", findings::findings(state(), path(), none()).await),
        ("/verdict", findings::verdict(state(), path(), none()).await),
        ("/criteria", findings::criteria(state(), path(), none()).await),
        ("/measurements", measurements::list(state(), path(), none()).await),
        ("/reviews", log.and_then(|log| answer::json(&none(), &log))),
    ];
    for (rest, answer) in answers {
        match answer {
            Ok(answer) => pieces.push(entry(Content::Answer(answered(format!("{own}{rest}"), answer).await?))),
            Err(problem) if problem.is_missing() => {}
            Err(problem) => return Err(problem),
        }
    }
    if with_photographs {
        pieces.extend((0..row.views).map(Piece::Photograph));
    }
    Ok(file(shared, text, pieces))
}

fn entry(content: Content) -> Piece {
    Piece::Entry(InspectionFile::entry(content))
}

/// An answer of the API as the file keeps it.
async fn answered(path: String, answer: Response) -> Result<FileAnswer, Problem> {
    let media_type = answer.headers().get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok());
    let media_type = media_type.unwrap_or_default().to_owned();
    let body = to_bytes(answer.into_body(), usize::MAX).await;
    let body = body.map_err(|error| Problem::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string()))?;
    Ok(FileAnswer { path, media_type, body })
}

/// The file, piece by piece as the client takes it. The number of entries is said at the end: a view that has no photograph has no
/// entry.
fn file(shared: Shared, id: String, pieces: Vec<Piece>) -> Response {
    let name = format!("attachment; filename=\"{id}.semascan\"");
    let body = stream::once(async { Ok(InspectionFile::beginning()) }).chain(stream::unfold(
        (pieces.into_iter(), 0_u64, false),
        move |(mut pieces, mut count, is_over)| {
            let (shared, id) = (shared.clone(), id.clone());
            async move {
                loop {
                    let bytes = match pieces.next() {
                        None if is_over => return None,
                        None => return Some((Ok(InspectionFile::end(count)), (pieces, count, true))),
                        Some(Piece::Entry(bytes)) => bytes,
                        Some(Piece::Photograph(view)) => match photograph(&shared, &id, view).await {
                            Ok(answer) => InspectionFile::entry(Content::Answer(answer)),
                            Err(problem) if problem.is_missing() => continue,
                            // The file breaks off, and whoever reads it notices.
                            Err(problem) => {
                                let error = Error::other(format!("view {view} of inspection {id}: {problem:?}"));
                                return Some((Err(error), (Vec::new().into_iter(), count, true)));
                            }
                        },
                    };
                    count += 1;
                    return Some((Ok(bytes), (pieces, count, false)));
                }
            }
        },
    ));
    let mut response = Response::new(Body::from_stream(body));
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/octet-stream"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("private, no-cache"));
    if let Ok(disposition) = HeaderValue::from_str(&name) {
        headers.insert(header::CONTENT_DISPOSITION, disposition);
    }
    response
}

/// The photograph of a view.
async fn photograph(shared: &Shared, id: &str, view: u32) -> Result<FileAnswer, Problem> {
    let place = (id.to_owned(), view.to_string());
    let picture = views::color(State(shared.clone()), Path(place), HeaderMap::new()).await?;
    answered(format!("/api/v1/inspections/{id}/views/{view}/color.png"), picture).await
}
