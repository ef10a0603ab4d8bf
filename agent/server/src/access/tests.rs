//! Every route with every role, against the routes of the server itself, and sessions and tokens that are forged, old or used
//! again.

use super::routes::{self, FILES, Least, Ruling};
use super::*;
use crate::connections::{Connections, Place};
use crate::live::LiveModel;
use crate::request_rate::RequestRate;
use crate::server::{Shared, router};
use axum::body::{Body, to_bytes};
use axum::http::{Method, Request, StatusCode};
use axum::response::Response;
use jiff::SignedDuration;
use semascan_protocol::client_message::Body as FromClient;
use semascan_protocol::server_message::Body as FromAgent;
use semascan_protocol::{Hello, Inspection, TAKES_POINTERS, ViewRequest, decode_server};
use semascan_store::data::{DataFolder, SqliteAccounts};
use std::collections::BTreeSet;
use tower_service::Service;

const PASSWORD: &str = "correct horse";

/// The routes of a server, users with each role in a data folder, and a connection to ask over.
struct Agent {
    shared: Shared,
    accounts: Arc<SqliteAccounts>,
    place: Place,
    _root: tempfile::TempDir,
}

impl Agent {
    fn new(entry: impl FnOnce(Arc<SqliteAccounts>) -> Entry, secure: bool) -> Self {
        let root = tempfile::tempdir().expect("a folder");
        drop(DataFolder::open(root.path()).expect("made"));
        let accounts = Arc::new(SqliteAccounts::open(root.path()).expect("opens"));
        let hash = hash_password("", PASSWORD).expect("hashed");
        for role in Role::ALL {
            let now = Timestamp::now();
            let row = UserRow {
                name: role.to_string(),
                role,
                password: hash.clone(),
                created: now,
                password_set: now,
                removed: None,
                identity: None,
            };
            assert_eq!(accounts.add_user(&row, &Actor::Agent), Ok(true));
        }
        let limits = Limits::default();
        let connections = Arc::new(Connections::new(&limits, usize::MAX));
        let place = connections.admit([127, 0, 0, 1].into()).expect("a place");
        let entry = Access::new(entry(Arc::clone(&accounts)), &limits, secure, 8787).expect("a key");
        let shared = Shared::for_tests(LiveModel::new(), limits, connections, entry, secure);
        Self { shared, accounts, place, _root: root }
    }

    fn with_limits(limits: Limits) -> Self {
        let mut agent = Self::with_users();
        agent.shared.rate = Arc::new(RequestRate::new(&limits));
        agent
    }

    fn with_users() -> Self {
        Self::new(|accounts| Entry::Accounts { accounts, provider: None }, false)
    }

    /// A token with `role`.
    fn token(&self, role: Role) -> String {
        let secret = Secret::draw().expect("random numbers");
        let name = format!("{role} {}", secret.token());
        let row =
            TokenRow { name, role, digest: secret.digest(), created: Timestamp::now(), expires: None, revoked: None };
        assert_eq!(self.accounts.add_token(&row, &Actor::Agent), Ok(true));
        secret.token()
    }

    /// The answer to a request with these headers and this body.
    async fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> Response {
        let mut request = Request::builder()
            .method(Method::from_bytes(method.as_bytes()).expect("a method"))
            .uri(path)
            .header("host", "127.0.0.1:8787");
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let mut request = request.body(Body::from(body.to_owned())).expect("a request");
        request.extensions_mut().insert(Arc::clone(&self.place.connection));
        let mut router = router(&self.shared);
        router.call(request).await.expect("answers")
    }

    async fn status(&self, method: &str, path: &str, headers: &[(&str, &str)]) -> u16 {
        self.ask(method, path, headers, "").await.status().as_u16()
    }

    /// Logs in; the answer.
    async fn log_in(&self, name: &str, password: &str) -> Response {
        let body = serde_json::json!({ "name": name, "password": password }).to_string();
        let headers = [("content-type", "application/json"), ("x-semascan-request", "1")];
        self.ask("POST", "/api/v1/login", &headers, &body).await
    }

    /// Logs in; the cookie to send.
    async fn cookie(&self, name: &str) -> String {
        let answer = self.log_in(name, PASSWORD).await;
        assert_eq!(answer.status(), StatusCode::OK);
        let cookie = answer.headers()["set-cookie"].to_str().expect("text");
        cookie.split(';').next().expect("a value").to_owned()
    }
}

async fn text(answer: Response) -> String {
    let bytes = to_bytes(answer.into_body(), 1 << 20).await.expect("a body");
    String::from_utf8(bytes.to_vec()).expect("text")
}

/// A path that the pattern of a route stands for.
fn example(pattern: &str) -> String {
    let segment = |segment: &str| if segment.starts_with('{') { "x".to_owned() } else { segment.to_owned() };
    pattern.split('/').map(segment).collect::<Vec<_>>().join("/")
}

/// Every path of the server's router: its debug text names them. Those of the files, which take what no other does, are left out.
fn paths_of_the_router(agent: &Agent) -> BTreeSet<String> {
    let text = format!("{:?}", router(&agent.shared));
    let quoted = text.split('"').skip(1).step_by(2);
    let paths = quoted.filter(|text| text.starts_with('/') && *text != "/" && !text.contains("axum_fallback"));
    paths.map(str::to_owned).collect()
}

#[tokio::test]
async fn every_route_answers_those_with_its_role_and_nobody_else() {
    let agent = Agent::with_users();
    let tokens: Vec<(Role, String)> = Role::ALL.into_iter().map(|role| (role, agent.token(role))).collect();
    for route in routes::all() {
        let path = example(route.path);
        let without = agent.status(route.method, &path, &[("x-semascan-request", "1")]).await;
        match route.least {
            Least::Public => assert!(![401, 403].contains(&without), "{route:?}: {without}"),
            Least::Role(_) => assert_eq!(without, 401, "{route:?}"),
        }
        for (role, token) in &tokens {
            let bearer = format!("Bearer {token}");
            let headers = [("authorization", bearer.as_str()), ("x-semascan-request", "1")];
            let status = agent.status(route.method, &path, &headers).await;
            match route.least {
                Least::Role(least) if *role < least => assert_eq!(status, 403, "{route:?} as {role}"),
                // A login without its content is refused for that.
                _ => assert!(![401, 403, 405].contains(&status), "{route:?} as {role}: {status}"),
            }
        }
    }
}

#[tokio::test]
async fn no_route_is_without_a_row_and_no_row_without_a_route() {
    let agent = Agent::with_users();
    let of_router = paths_of_the_router(&agent);
    let of_table: BTreeSet<String> = routes::all().map(|r| r.path.to_owned()).filter(|path| path != FILES).collect();
    assert!(
        of_router.contains("/ws") && of_router.contains("/api/v1/me"),
        "the router does not say its paths any more"
    );
    assert_eq!(of_router, of_table);
    // What has no row is refused, whoever asks, and other methods of a route are named.
    assert_eq!(routes::ruling("GET", "/api/v1/new"), Ruling::Missing);
    assert_eq!(routes::ruling("POST", "/ws"), Ruling::Methods(vec!["GET", "HEAD"]));
    assert_eq!(routes::ruling("HEAD", "/ws"), Ruling::Least(Least::Role(Role::Viewer)));
    let bearer = format!("Bearer {}", agent.token(Role::Admin));
    for path in of_router {
        for method in ["POST", "PUT", "PATCH", "DELETE", "OPTIONS", "TRACE", "GET"] {
            let has_row = routes::all().any(|route| route.path == path && route.method == method);
            let status = agent.status(method, &path, &[("authorization", &bearer)]).await;
            assert_eq!(status == 405, !has_row, "{method} {path}: {status}");
        }
    }
}

#[test]
fn every_message_needs_a_role() {
    let messages = [FromClient::Hello(Hello::default()), FromClient::Views(ViewRequest::default())];
    assert!(messages.iter().all(|message| routes::role_of_message(message) == Role::Viewer));
}

#[tokio::test]
async fn a_session_is_begun_used_and_ended() {
    let agent = Agent::with_users();
    let answer = agent.log_in("Reviewer", PASSWORD).await;
    let cookie = answer.headers()["set-cookie"].to_str().expect("text").to_owned();
    for part in ["semascan-8787=", "; Path=/", "; HttpOnly", "; SameSite=Strict", "; Max-Age=43200"] {
        assert!(cookie.contains(part), "{cookie}");
    }
    assert!(!cookie.contains("Secure"), "not over plain HTTP, where browsers would drop it");
    assert_eq!(answer.headers()["cache-control"], "no-store");
    assert!(text(answer).await.contains(r#""role":"reviewer""#));
    let cookie = cookie.split(';').next().expect("a value");
    let me = agent.ask("GET", "/api/v1/me", &[("cookie", &format!("a=b; {cookie}"))], "").await;
    assert_eq!(
        text(me).await,
        r#"{"name":"reviewer","role":"reviewer","credential":"session","login":true,"keeps":false}"#
    );
    // A cookie alone changes nothing, and not from elsewhere.
    let out = |more: &[(&'static str, &'static str)]| {
        let headers: Vec<_> = [("cookie", cookie)].into_iter().chain(more.iter().copied()).collect();
        let agent = &agent;
        async move { agent.status("POST", "/api/v1/logout", &headers).await }
    };
    assert_eq!(out(&[]).await, 403);
    let header = ("x-semascan-request", "1");
    assert_eq!(out(&[header, ("sec-fetch-site", "cross-site")]).await, 403);
    assert_eq!(out(&[header, ("origin", "http://evil.example")]).await, 403);
    assert_eq!(out(&[header, ("origin", "http://127.0.0.1:8787"), ("sec-fetch-site", "same-origin")]).await, 204);
    // Sent again, it is nobody's.
    assert_eq!(agent.status("GET", "/api/v1/me", &[("cookie", cookie)]).await, 401);
}

#[tokio::test]
async fn over_tls_the_cookie_and_the_host_stay_with_tls() {
    let agent = Agent::new(|accounts| Entry::Accounts { accounts, provider: None }, true);
    let answer = agent.log_in("viewer", PASSWORD).await;
    let cookie = answer.headers()["set-cookie"].to_str().expect("text");
    assert!(cookie.starts_with("__Host-semascan-8787=") && cookie.ends_with("; Secure"), "{cookie}");
    assert!(!answer.headers().contains_key("strict-transport-security"), "not for an address");
    for (name, value) in [("x-frame-options", "SAMEORIGIN"), ("referrer-policy", "no-referrer")] {
        assert_eq!(answer.headers()[name], value);
    }
    assert!(answer.headers()["permissions-policy"].to_str().expect("text").contains("camera=()"));
}

#[tokio::test]
async fn forged_expired_and_revoked_credentials_are_nobodys() {
    let agent = Agent::with_users();
    let me = |name: &'static str, value: String| {
        let agent = &agent;
        async move { agent.status("GET", "/api/v1/me", &[(name, &value)]).await }
    };
    let cookie = agent.cookie("admin").await;
    assert_eq!(me("cookie", cookie.clone()).await, 200);
    let (name, value) = cookie.split_once('=').expect("a pair");
    let (secret, signature) = value.split_once('.').expect("signed");
    let stranger = Signer::new([0; 32]).signed(&Secret::draw().expect("random numbers"));
    for forged in [
        format!("{name}={secret}"),
        format!("{name}={signature}.{secret}"),
        format!("{name}={stranger}"),
        format!("__Host-{cookie}"),
        format!("{name}={}", "A".repeat(8000)),
    ] {
        assert_eq!(me("cookie", forged.clone()).await, 401, "{forged}");
    }
    // Well signed, but never begun.
    let signer = Signer::new(agent.accounts.signing_key([0; 32]).expect("reads"));
    let never = Secret::draw().expect("random numbers");
    assert_eq!(me("cookie", format!("{name}={}", signer.signed(&never))).await, 401);
    // Idle for too long, and begun too long ago.
    let now = Timestamp::now();
    for (began, used, expected) in [(0, 0, 200), (0, 3700, 401), (44_000, 0, 401), (43_000, 10, 200)] {
        let secret = Secret::draw().expect("random numbers");
        let ago = |seconds| now - SignedDuration::from_secs(seconds);
        let row = SessionRow { digest: secret.digest(), user: "viewer".into(), began: ago(began), used: ago(used) };
        agent.accounts.begin_session(&row, 99, None).expect("begun");
        let status = me("cookie", format!("{name}={}", signer.signed(&secret))).await;
        assert_eq!(status, expected, "{began} {used}");
    }
    // A role that was taken away is gone at once, and so is a user.
    assert_eq!(agent.status("GET", "/metrics", &[("cookie", &cookie)]).await, 200);
    agent.accounts.set_role("admin", Role::Viewer, Timestamp::now(), &Actor::Agent).expect("set");
    assert_eq!(agent.status("GET", "/metrics", &[("cookie", &cookie)]).await, 403);
    agent.accounts.remove_user("admin", now, &Actor::Agent).expect("removed");
    assert_eq!(me("cookie", cookie).await, 401);
    // Tokens.
    let token = agent.token(Role::Viewer);
    assert_eq!(me("authorization", format!("Bearer {token}")).await, 200);
    for wrong in [format!("Basic {token}"), token.clone(), format!("Bearer {}", &token[..50]), "Bearer".into()] {
        assert_eq!(me("authorization", wrong.clone()).await, 401, "{wrong}");
    }
    let secret = Secret::draw().expect("random numbers");
    let expires = Some(now - SignedDuration::from_secs(2));
    let row = TokenRow {
        name: "old".into(),
        role: Role::Admin,
        digest: secret.digest(),
        created: now,
        expires,
        revoked: None,
    };
    agent.accounts.add_token(&row, &Actor::Agent).expect("added");
    assert_eq!(me("authorization", format!("Bearer {}", secret.token())).await, 401);
    let row = TokenRow { name: "gone".into(), digest: [1; 32], expires: None, revoked: Some(now), ..row };
    agent.accounts.add_token(&row, &Actor::Agent).expect("added");
    let identity = Identity { name: "gone".into(), role: Role::Admin, credential: Credential::Token([1; 32]) };
    assert!(agent.shared.entry.still(&identity).await.is_err());
}

#[tokio::test]
async fn wrong_logins_are_all_alike_and_bounded() {
    let agent = Agent::with_users();
    agent.accounts.remove_user("operator", Timestamp::now(), &Actor::Agent).expect("removed");
    let mut answers = BTreeSet::new();
    for (name, password) in [("admin", "wrong horse"), ("nobody", PASSWORD), ("operator", PASSWORD), ("", "")] {
        let answer = agent.log_in(name, password).await;
        assert_eq!(answer.status(), 401, "{name}");
        assert!(!answer.headers().contains_key("set-cookie"));
        answers.insert(text(answer).await);
    }
    assert_eq!(answers.len(), 1, "an answer does not say what was wrong: {answers:?}");
    // What is no login is said without repeating any of it.
    let json = [("content-type", "application/json"), ("x-semascan-request", "1")];
    for (headers, body, expected) in [
        (&json[..], r#"{"name":"admin","password":7123}"#, 400),
        (&json[..], r#"{"name":"admin","password":"x","role":"7123"}"#, 400),
        (&json[1..], r#"{"name":"admin","password":"7123"}"#, 415),
        (&json[..1], r#"{"name":"admin","password":"7123"}"#, 403),
        (&json[..], &format!(r#"{{"name":"admin","password":"7123{}"}}"#, "x".repeat(5000)), 413),
    ] {
        let answer = agent.ask("POST", "/api/v1/login", headers, body).await;
        assert_eq!(answer.status().as_u16(), expected, "{body:.60}");
        assert!(!text(answer).await.contains("7123"));
    }
    // Guessing ends, for the right password too, and says when it may go on.
    let mut tried = 0;
    let refused = loop {
        let answer = agent.log_in("admin", "wrong horse").await;
        tried += 1;
        if answer.status() != 401 || tried > 30 {
            break answer;
        }
    };
    assert_eq!((refused.status().as_u16(), tried), (429, 10), "one was tried above");
    assert!(refused.headers()["retry-after"].to_str().expect("text").parse::<u64>().expect("seconds") > 200);
    assert_eq!(agent.log_in("admin", PASSWORD).await.status(), 429);
    assert_eq!(agent.log_in("viewer", PASSWORD).await.status(), 200, "others are not concerned");
}

#[tokio::test]
async fn without_users_who_reaches_the_agent_is_local_or_may_watch() {
    let local = Agent::new(|_| Entry::Local, false);
    let me = local.ask("GET", "/api/v1/me", &[], "").await;
    assert_eq!(text(me).await, r#"{"name":"local","role":"admin","credential":"none","login":false,"keeps":false}"#);
    assert_eq!(local.status("GET", "/metrics", &[]).await, 200);
    assert_eq!(local.log_in("admin", PASSWORD).await.status(), 404);
    // A page from elsewhere needs no cookie here.
    assert_eq!(local.status("POST", "/api/v1/logout", &[("sec-fetch-site", "cross-site")]).await, 403);
    // A proxy on this machine asks for others.
    for header in ["forwarded", "x-forwarded-for", "via"] {
        assert_eq!(local.status("GET", "/api/v1/me", &[(header, "for=10.0.0.9")]).await, 403, "{header}");
    }
    let watched = Agent::new(|_| Entry::Watch, false);
    assert_eq!(watched.status("GET", "/api/v1/me", &[]).await, 200);
    assert_eq!(watched.status("GET", "/metrics", &[]).await, 403);
}

#[test]
fn what_others_reach_has_users_and_tls_or_does_not_start() {
    let agent = Agent::with_users();
    let [loopback, network] = ["127.0.0.1:8787", "0.0.0.0:8787"].map(|text| text.parse().expect("an address"));
    let users = Entry::Accounts { accounts: agent.accounts.clone(), provider: None };
    let said = |entry: &Entry, address, secure: bool| match entry.check(address, secure) {
        Ok(()) => String::new(),
        Err(error) => error.to_string(),
    };
    assert_eq!(said(&Entry::Local, loopback, false), "");
    assert_eq!(said(&users, network, true), "");
    assert_eq!(said(&Entry::Watch, network, false), "");
    let local = said(&Entry::Local, network, true);
    assert!(
        local.contains("0.0.0.0:8787") && local.contains("semascan user add NAME --role admin --data DIR"),
        "{local}"
    );
    assert!(said(&users, network, false).contains("--tls-cert"));
    for role in Role::ALL {
        agent.accounts.remove_user(role.name(), Timestamp::now(), &Actor::Agent).expect("removed");
    }
    assert!(said(&users, network, true).contains("semascan user add"));
    for address in ["[::1]:1", "[::ffff:127.0.0.1]:1", "127.8.9.1:1"] {
        assert_eq!(said(&Entry::Local, address.parse().expect("an address"), false), "", "{address}");
    }
    for address in ["[::]:1", "10.0.0.7:1", "[::ffff:10.0.0.7]:1"] {
        assert_ne!(said(&Entry::Local, address.parse().expect("an address"), false), "", "{address}");
    }
}

#[tokio::test]
async fn too_many_requests_are_refused_until_there_are_fewer() {
    let agent = Agent::with_limits(Limits { request_burst: 3, requests_per_s: 0.1, ..Limits::default() });
    for _ in 0..3 {
        assert_eq!(agent.status("GET", "/healthz", &[]).await, 200);
    }
    let refused = agent.ask("GET", "/healthz", &[], "").await;
    assert_eq!(refused.status(), 429);
    let wait: u64 = refused.headers()["retry-after"].to_str().expect("text").parse().expect("seconds");
    assert!((9..=11).contains(&wait), "{wait}");
}

#[tokio::test]
async fn what_happens_is_counted() {
    use semascan_inspection::event::{EventKind, StageStatus};
    use semascan_model::record::{Outcome, Stage};
    let agent = Agent::new(|_| Entry::Local, false);
    let metrics = agent.shared.live.metrics();
    let status = StageStatus::Finished { seconds: 0.3 };
    metrics.happened(&EventKind::Stage { view: 0, stage: Stage::Fuse, status });
    metrics.happened(&EventKind::Stage { view: 1, stage: Stage::Fuse, status: StageStatus::Started });
    for outcome in [Outcome::Finished, Outcome::Failed { reason: "no view".into() }, Outcome::Finished] {
        metrics.happened(&EventKind::Ended { outcome });
    }
    agent.status("GET", "/nothing", &[]).await;
    agent.shared.live.set_unready("it starts");
    let text = text(agent.ask("GET", "/metrics", &[], "").await).await;
    for line in [
        r#"semascan_inspections_total{outcome="finished"} 2"#,
        r#"semascan_inspections_total{outcome="failed"} 1"#,
        r#"semascan_inspections_total{outcome="stopped"} 0"#,
        r#"semascan_views_total{result="accepted"} 0"#,
        r#"semascan_stage_seconds_count{stage="fuse"} 1"#,
        r#"semascan_stage_seconds_sum{stage="fuse"} 0.3"#,
        r#"semascan_stage_seconds_bucket{le="0.25",stage="fuse"} 0"#,
        r#"semascan_requests_total{status="404"} 1"#,
        r#"semascan_connections{doing="waiting"} 1"#,
        "semascan_ready 0",
        "semascan_running 0",
    ] {
        assert!(text.lines().any(|there| there == line), "{line} is not in\n{text}");
    }
    assert!(text.ends_with("# EOF\n"));
}

#[tokio::test]
async fn who_has_no_login_is_told_the_state_and_no_more() {
    let agent = Agent::with_users();
    agent.shared.live.say("secret: camera 7");
    let everybody = text(agent.ask("GET", "/healthz", &[], "").await).await;
    assert_eq!(everybody, r#"{"healthy":true,"state":"waiting"}"#);
    let bearer = format!("Bearer {}", agent.token(Role::Viewer));
    let known = text(agent.ask("GET", "/healthz", &[("authorization", &bearer)], "").await).await;
    assert!(known.contains("camera 7") && known.contains(r#""viewers":0"#), "{known}");
    assert_eq!(agent.status("GET", "/readyz", &[]).await, 200);
    agent.shared.live.set_unready("the disk is full");
    let answer = agent.ask("GET", "/readyz", &[], "").await;
    assert_eq!(answer.status(), 503);
    assert_eq!(text(answer).await, r#"{"ready":false}"#);
    let known = text(agent.ask("GET", "/readyz", &[("authorization", &bearer)], "").await).await;
    assert_eq!(known, r#"{"ready":false,"reason":"the disk is full"}"#);
}

#[tokio::test]
async fn every_login_is_noted_and_a_flood_of_refused_ones_is_counted() {
    let agent = Agent::with_users();
    let logged = || -> Vec<String> {
        let entries = agent.accounts.log(None, 1000).expect("reads");
        let whole = entries.iter().rev().map(|entry| format!("{} by {}", entry.action, entry.by));
        // The users themselves, and the tokens, were made before.
        whole.filter(|text| text.contains("log")).collect()
    };
    let cookie = agent.cookie("reviewer").await;
    let headers = [("cookie", cookie.as_str()), ("x-semascan-request", "1")];
    assert_eq!(agent.status("POST", "/api/v1/logout", &headers).await, 204);
    assert_eq!(agent.log_in("hunter2", PASSWORD).await.status(), 401);
    assert_eq!(agent.log_in("viewer", "hunter2").await.status(), 401);
    assert_eq!(
        logged(),
        [
            "reviewer logged in by reviewer from 127.0.0.1",
            "reviewer logged out by reviewer from 127.0.0.1",
            "login of an unknown user refused: name or password is wrong by somebody from 127.0.0.1",
            "login of viewer refused: name or password is wrong by somebody from 127.0.0.1",
        ]
    );
    // Of 300 wrong ones the first are tried, and all but 100 are counted.
    for _ in 0..300 {
        assert!([401, 429].contains(&agent.log_in("admin", "wrong horse").await.status().as_u16()));
    }
    assert_eq!(logged().len(), 4 + 98 + 1);
    assert!(logged()[15].starts_with("login of admin refused: too many attempts"), "{}", logged()[15]);
    assert_eq!(logged()[102], "too many refused logins to list: the next are counted by the agent");
    agent.shared.entry.note_counts(false).await;
    assert_eq!(logged().len(), 103, "the window is not over");
    agent.shared.entry.note_counts(true).await;
    assert_eq!(logged()[103], "202 refused logins not listed by the agent");
    assert_eq!(agent.accounts.audit(None).expect("reads").fault, None);
}

#[tokio::test]
async fn who_points_is_told_to_others_under_their_own_name_and_nothing_else_is_taken() {
    let agent = Agent::with_users();
    let id = semascan_model::InspectionId::new(1, &[7; 10]).to_string();
    agent.shared.live.begin(Inspection { id: id.clone(), ..Inspection::default() });
    let (mut cursor, _) =
        agent.shared.live.welcome(&Hello { capabilities: vec![TAKES_POINTERS.into()], ..Hello::default() });
    let _two = [agent.shared.live.attend(&cursor), agent.shared.live.attend(&cursor)];
    let bearer = format!("Bearer {}", agent.token(Role::Viewer));
    let path = format!("/api/v1/inspections/{id}/pointers");
    let json = [("authorization", bearer.as_str()), ("content-type", "application/json")];
    let told = agent.ask("POST", &path, &json, r#"{"viewer":"v","person":"x","position":[1,2,3]}"#).await;
    assert_eq!((told.status(), text(told).await.as_str()), (StatusCode::OK, r#"{"others":1}"#));
    let mut seen = Vec::new();
    while let Some(bytes) = agent.shared.live.next(&mut cursor) {
        if let Some(FromAgent::Pointer(pointer)) = decode_server(&bytes).expect("valid").body {
            seen.push((pointer.viewer, pointer.person.starts_with("token viewer "), [pointer.x, pointer.y, pointer.z]));
        }
    }
    assert_eq!(seen, [("v".to_owned(), true, [1.0, 2.0, 3.0])]);
    let long = format!(r#"{{"viewer":"v","person":"{}","position":[1,2,3]}}"#, "x".repeat(101));
    let huge = format!(r#"{{"viewer":"v","person":"{}","position":[1,2,3]}}"#, "x".repeat(2000));
    for (body, status) in [
        (r#"{"viewer":"","position":[1,2,3]}"#, 422),
        (long.as_str(), 422),
        (r#"{"viewer":"v","position":[1e99,2,3]}"#, 422),
        (huge.as_str(), 413),
        (r#"{"viewer":"v","position":[1,2]}"#, 400),
        (r#"{"viewer":"v","position":[1,2,3],"more":1}"#, 400),
    ] {
        let answer = agent.ask("POST", &path, &json, body).await;
        assert_eq!(answer.status().as_u16(), status, "{body:.80}: {}", text(answer).await);
    }
    assert_eq!(agent.ask("POST", &path, &json[..1], "{}").await.status().as_u16(), 415);
}
