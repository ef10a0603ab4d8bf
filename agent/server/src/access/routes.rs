//! Which role each route and each message of a client needs. This table is the only place that says so: the guard refuses
//! what is not in it, and a test walks it, and all routes of the server, with every role.

use super::CALLBACK;
use semascan_model::Role;
use semascan_protocol::client_message::Body;

/// Who may use a route.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Least {
    /// Everybody, without a login.
    Public,
    /// Those with this role, or one that may do more.
    Role(Role),
}

/// A route.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Route {
    /// Its method; `GET` stands for `HEAD`, too.
    pub(crate) method: &'static str,
    /// Its path as the router has it.
    pub(crate) path: &'static str,
    /// Who may use it.
    pub(crate) least: Least,
}

const fn route(method: &'static str, path: &'static str, least: Least) -> Route {
    Route { method, path, least }
}

/// The path that stands for everything that is no other route: the viewer's page and its files. They hold nothing of any
/// inspection, and the page must load before somebody can log in.
pub(crate) const FILES: &str = "/{*file}";

/// Routes that an agent with TLS answers on loopback without it, too.
pub(crate) const EXPOSED: [&str; 2] = ["/healthz", "/readyz"];

/// The routes.
const ROUTES: &[Route] = &[
    route("GET", FILES, Least::Public),
    route("GET", "/healthz", Least::Public),
    route("GET", "/readyz", Least::Public),
    route("GET", "/metrics", Least::Role(Role::Operator)),
    route("GET", "/ws", Least::Role(Role::Viewer)),
    route("GET", "/foxglove", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/login", Least::Public),
    route("POST", "/api/v1/login", Least::Public),
    route("POST", "/api/v1/oidc", Least::Public),
    route("GET", CALLBACK, Least::Public),
    route("POST", "/api/v1/logout", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/me", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/openapi.json", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/views", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/views/{view}/color.png", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/views/{view}/depth.png", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/views/{view}/labels.png", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/views/{view}/sigma.png", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/trends", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/findings", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/criteria", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/verdict", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/measurements", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/reviews", Least::Role(Role::Viewer)),
    route("POST", "/api/v1/inspections/{inspection}/reviews", Least::Role(Role::Reviewer)),
    route("GET", "/api/v1/inspections/{inspection}/teaching", Least::Role(Role::Viewer)),
    // Others see where somebody points; nothing is kept.
    route("POST", "/api/v1/inspections/{inspection}/pointers", Least::Role(Role::Viewer)),
    // A view is asked of the camera.
    route("POST", "/api/v1/inspections/{inspection}/captures", Least::Role(Role::Operator)),
    route("GET", "/api/v1/inspections/{inspection}/exports/{file}", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/inspection.semascan", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/inspections/{inspection}/report", Least::Role(Role::Viewer)),
    route("GET", "/api/v1/account-log", Least::Role(Role::Admin)),
    // What is no route of the API says so.
    route("GET", "/api/{*path}", Least::Public),
];

/// Every route of the server.
pub(crate) fn all() -> impl Iterator<Item = &'static Route> {
    ROUTES.iter()
}

/// What the table says of a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Ruling {
    /// Who may make it.
    Least(Least),
    /// The route has other methods: these.
    Methods(Vec<&'static str>),
    /// The route is not in the table.
    Missing,
}

/// Who may make a request with `method` for the route with `path`.
pub(crate) fn ruling(method: &str, path: &str) -> Ruling {
    let method = if method == "HEAD" { "GET" } else { method };
    let of_path = || all().filter(|route| route.path == path);
    match of_path().find(|route| route.method == method) {
        Some(route) => Ruling::Least(route.least),
        None if of_path().next().is_none() => Ruling::Missing,
        None => {
            let methods = of_path()
                .flat_map(|route| if route.method == "GET" { vec!["GET", "HEAD"] } else { vec![route.method] });
            Ruling::Methods(methods.collect())
        }
    }
}

/// The role that a message of the stream needs.
pub(crate) fn role_of_message(body: &Body) -> Role {
    match body {
        Body::Hello(_) | Body::Views(_) => Role::Viewer,
    }
}
