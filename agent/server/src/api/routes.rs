//! Every route of the server, and the role that it needs. Whoever knows users enforces this table; a test compares it with the
//! routes that there are.

/// What a user may do. Each role may do what those before it may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Looks.
    Viewer,
    /// Decides.
    Reviewer,
    /// Runs the cell.
    Operator,
    /// Gives others their roles.
    Admin,
}

/// A route and who may use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Route {
    /// `GET` stands for `HEAD` too.
    pub method: &'static str,
    /// With `{name}` for a part that is different each time.
    pub path: &'static str,
    /// The least role that may use it.
    pub role: Role,
}

const fn route(method: &'static str, path: &'static str, role: Role) -> Route {
    Route { method, path, role }
}

/// The routes of the API.
pub const ROUTES: [Route; 14] = [
    route("GET", "/api/v1/openapi.json", Role::Viewer),
    route("GET", "/api/v1/inspections", Role::Viewer),
    route("GET", "/api/v1/inspections/{inspection}", Role::Viewer),
    route("GET", "/api/v1/inspections/{inspection}/views", Role::Viewer),
    route("GET", "/api/v1/inspections/{inspection}/views/{view}/color.png", Role::Viewer),
    route("GET", "/api/v1/inspections/{inspection}/views/{view}/depth.png", Role::Viewer),
    route("GET", "/api/v1/inspections/{inspection}/views/{view}/labels.png", Role::Viewer),
    route("GET", "/api/v1/inspections/{inspection}/views/{view}/sigma.png", Role::Viewer),
    route("GET", "/api/v1/inspections/{inspection}/findings", Role::Viewer),
    route("GET", "/api/v1/inspections/{inspection}/criteria", Role::Viewer),
    route("GET", "/api/v1/inspections/{inspection}/verdict", Role::Viewer),
    route("GET", "/api/v1/inspections/{inspection}/reviews", Role::Viewer),
    route("POST", "/api/v1/inspections/{inspection}/reviews", Role::Reviewer),
    route("GET", "/api/v1/inspections/{inspection}/exports/{file}", Role::Viewer),
];

/// The route that a request is of; `None` where there is none.
pub fn route_of(method: &str, path: &str) -> Option<&'static Route> {
    let method = if method == "HEAD" { "GET" } else { method };
    ROUTES.iter().find(|route| {
        let mut asked = path.split('/');
        let fits = route.path.split('/').all(|part| {
            asked.next().is_some_and(|asked| if part.starts_with('{') { !asked.is_empty() } else { asked == part })
        });
        route.method == method && fits && asked.next().is_none()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_of_the_route_that_it_fits_and_of_no_other() {
        let path = |method: &str, path: &str| route_of(method, path).map(|route| (route.path, route.role));
        assert_eq!(path("HEAD", "/api/v1/inspections"), Some(("/api/v1/inspections", Role::Viewer)));
        let reviews = "/api/v1/inspections/{inspection}/reviews";
        assert_eq!(path("POST", "/api/v1/inspections/x/reviews"), Some((reviews, Role::Reviewer)));
        assert_eq!(path("GET", "/api/v1/inspections/x/reviews"), Some((reviews, Role::Viewer)));
        for (method, wrong) in [
            ("POST", "/api/v1/inspections"),
            ("PUT", "/api/v1/inspections/x/reviews"),
            ("POST", "/api/v1/inspections//reviews"),
            ("POST", "/api/v1/inspections/x/reviews/"),
            ("POST", "/api/v1/inspections/x/y/reviews"),
            ("GET", "/api/v1"),
        ] {
            assert_eq!(path(method, wrong), None, "{method} {wrong}");
        }
        assert!(Role::Viewer < Role::Reviewer && Role::Operator < Role::Admin);
    }
}
