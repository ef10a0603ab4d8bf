//! `/account-log`: what was done with users, tokens and logins, the latest first.

use super::super::server::Shared;
use super::answer;
use super::openapi::{long_limits, numbers};
use super::problem::Problem;
use super::request::{limit, parsed, reading_accounts};
use axum::extract::Query;
use axum::extract::State;
use axum::extract::rejection::QueryRejection;
use axum::http::HeaderMap;
use axum::response::Response;
use schemars::JsonSchema;
use semascan_model::account_log::AccountEntry;
use serde::{Deserialize, Serialize};
use utoipa::IntoParams;

/// Entries of a page where the client does not say it, and most.
const PAGE: (u32, u32) = (100, 500);

/// A page of the log.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct LogQuery {
    /// `next` of the page before: those before this place of the log.
    #[param(schema_with = numbers)]
    before: Option<String>,
    /// Most of a page, 1 to 500.
    #[param(schema_with = long_limits)]
    limit: Option<String>,
}

/// Entries of the log of accounts, the latest first.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct AccountLog {
    /// The entries.
    items: Vec<AccountEntry>,
    /// `before` of the next page; absent on the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<u64>,
}

/// What was done with users, tokens and logins: for administrators.
#[utoipa::path(
    get,
    path = "/api/v1/account-log",
    tag = "access",
    params(LogQuery),
    responses((status = 200, description = "A page", body = ref("#/components/schemas/AccountLog")))
)]
pub(super) async fn list(
    State(shared): State<Shared>,
    headers: HeaderMap,
    query: Result<Query<LogQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|rejection| Problem::of_query(&rejection))?;
    let before: Option<u64> = parsed("before", query.before.as_deref())?;
    let page = limit(query.limit.as_deref(), PAGE.0, PAGE.1)?;
    reading_accounts(&shared, move |accounts| {
        // One more says whether there is a next page.
        let mut items = accounts.log(before, page + 1)?;
        let is_more = items.len() > page as usize;
        items.truncate(page as usize);
        let next = items.last().map(|entry| entry.sequence).filter(|_| is_more);
        answer::json(&headers, &AccountLog { items, next })
    })
    .await
}
