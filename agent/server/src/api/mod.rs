//! The REST API under `/api/v1`: past inspections and the one that runs, their views, findings, verdicts, reviews and files.
//! The role that each route needs stands in `access/routes.rs`.
//!
//! | file | what |
//! |---|---|
//! | `account_log.rs`, `inspections.rs`, `views.rs`, `findings.rs`, `measurements.rs`, `reviews.rs`, `pointers.rs`, `captures.rs`, `teaching.rs`, `trends.rs`, `exports.rs`, `inspection_file.rs`, `report.rs` | one resource each |
//! | `request.rs` | what requests say, checked; work that blocks |
//! | `content.rs` | what is sent with a request |
//! | `answer.rs`, `problem.rs` | answers with entity tags; errors |
//! | `openapi.rs` | the document that describes all this |

mod account_log;
mod answer;
mod captures;
mod content;
mod exports;
mod findings;
mod inspection_file;
mod inspections;
mod measurements;
mod openapi;
mod pointers;
mod problem;
mod report;
mod request;
mod reviews;
mod teaching;
mod trends;
mod views;

pub(crate) use problem::Problem;
pub(super) use request::{COMMANDS, READERS};

use super::server::Shared;
use axum::Router;
use axum::extract::Path;
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use axum::routing::{any, get};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

/// The routes of the API.
pub(super) fn router() -> Router<Shared> {
    let (router, paths) = described().split_for_parts();
    let document = serde_json::to_vec(&openapi::document(paths)).unwrap_or_default();
    let described = move |headers: HeaderMap| {
        let document = document.clone();
        async move { answer::bytes(&headers, "application/json", document) }
    };
    router.route("/api/v1/openapi.json", get(described)).route("/api/{*path}", any(nothing))
}

fn described() -> OpenApiRouter<Shared> {
    OpenApiRouter::new()
        .routes(routes!(inspections::list))
        .routes(routes!(inspections::one))
        .routes(routes!(trends::trends))
        .routes(routes!(views::list))
        .routes(routes!(views::color))
        .routes(routes!(views::depth))
        .routes(routes!(views::labels))
        .routes(routes!(views::sigma))
        .routes(routes!(findings::findings))
        .routes(routes!(findings::criteria))
        .routes(routes!(findings::verdict))
        .routes(routes!(measurements::list))
        .routes(routes!(reviews::list, reviews::take))
        .routes(routes!(teaching::teaching))
        .routes(routes!(pointers::point))
        .routes(routes!(captures::capture))
        .routes(routes!(exports::file))
        .routes(routes!(inspection_file::whole))
        .routes(routes!(report::report))
        .routes(routes!(account_log::list))
}

async fn nothing(Path(path): Path<String>) -> Result<Response, Problem> {
    let path = super::client_log::Excerpt(&path).to_string();
    Err(Problem::new(StatusCode::NOT_FOUND, format!("/api/{path} is nothing that this agent has")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::routes::{self, Least};
    use semascan_model::Role;
    use std::collections::BTreeSet;

    #[test]
    fn every_route_has_its_role_and_is_described() {
        let document = openapi::document(described().to_openapi());
        assert!(
            document["openapi"].as_str().is_some_and(|version| version.starts_with("3.1")),
            "{}",
            document["openapi"]
        );
        let mut there = BTreeSet::from([("GET".to_owned(), "/api/v1/openapi.json".to_owned())]);
        for (path, operations) in document["paths"].as_object().expect("paths") {
            for method in operations.as_object().expect("operations").keys() {
                there.insert((method.to_uppercase(), path.clone()));
            }
        }
        // Those of logging in.
        let own = ["/api/v1/login", "/api/v1/logout", "/api/v1/me", "/api/v1/oidc", "/api/v1/oidc/callback"];
        let listed = || routes::all().filter(|route| route.path.starts_with("/api/v1/") && !own.contains(&route.path));
        assert_eq!(there, listed().map(|r| (r.method.to_owned(), r.path.to_owned())).collect());
        // A pointer changes nothing.
        let changes = |path: &str| !path.ends_with("/pointers");
        assert!(
            listed().all(|r| {
                let is_more_than_viewer = matches!(r.least, Least::Role(role) if role >= Role::Reviewer);
                r.method == "GET" || !changes(r.path) || is_more_than_viewer
            }),
            "who changes is no viewer"
        );
    }

    #[test]
    fn every_reference_of_the_document_leads_somewhere() {
        let document = openapi::document(described().to_openapi());
        fn references(value: &serde_json::Value, found: &mut BTreeSet<String>) {
            match value {
                serde_json::Value::Object(map) => {
                    if let Some(reference) = map.get("$ref").and_then(|r| r.as_str()) {
                        found.insert(reference.to_owned());
                    }
                    map.values().for_each(|value| references(value, found));
                }
                serde_json::Value::Array(list) => list.iter().for_each(|value| references(value, found)),
                _ => {}
            }
        }
        let mut found = BTreeSet::new();
        references(&document, &mut found);
        assert!(found.contains("#/components/schemas/Review") && found.len() > 20, "{found:?}");
        for reference in found {
            let pointer = reference.strip_prefix('#').expect("in the document");
            assert!(document.pointer(pointer).is_some(), "{reference}");
        }
    }
}
