//! Logins at a provider, from the page that begins one to the session that follows, over real sockets: what must work, and every
//! way in which a browser, somebody else or the provider itself can be wrong.

mod browser;
mod provider;

use super::{Oidc, OidcSettings};
use crate::access::{Entry, Provider, PublicAddress, hash_password};
use crate::guard::AccessRule;
use crate::limits::Limits;
use crate::live::LiveModel;
use crate::server::{Server, ServerConfig};
use crate::tls::{Tls, TlsFiles, own_certificate};
use crate::web::WebFiles;
use browser::{Browser, Reply};
use jiff::Timestamp;
use provider::{CLIENT, Fault, SECRET, Signature, TestProvider};
use semascan_inspection::ports::{Accounts, UserRow};
use semascan_model::Role;
use semascan_model::account_log::Actor;
use semascan_store::data::{DataFolder, SqliteAccounts};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

const PASSWORD: &str = "correct horse";
/// Under which browsers know the agent.
const HOST: &str = "localhost:4242";
const METADATA: &str = "/plant/.well-known/openid-configuration";
const KEYS: &str = "/plant/keys";
const TOKEN: &str = "/plant/token";

/// An agent with a user and a provider.
struct Plant {
    provider: TestProvider,
    accounts: Arc<SqliteAccounts>,
    address: SocketAddr,
    serving: tokio::task::JoinHandle<()>,
    _root: tempfile::TempDir,
}

impl Drop for Plant {
    fn drop(&mut self) {
        self.serving.abort();
    }
}

impl Plant {
    async fn start() -> Self {
        Self::start_with(TestProvider::start(None).await, Limits::default(), None).await
    }

    async fn start_with(provider: TestProvider, limits: Limits, authorities: Option<PathBuf>) -> Self {
        let root = tempfile::tempdir().expect("a folder");
        drop(DataFolder::open(root.path()).expect("made"));
        let accounts = Arc::new(SqliteAccounts::open(root.path()).expect("opens"));
        let now = Timestamp::now();
        let anna = UserRow {
            name: "anna".into(),
            role: Role::Admin,
            password: hash_password("anna", PASSWORD).expect("hashed"),
            created: now,
            password_set: now,
            removed: None,
            identity: None,
        };
        assert_eq!(accounts.add_user(&anna, &Actor::Agent), Ok(true));
        let public = PublicAddress::parse(&format!("http://{HOST}")).expect("an address");
        let oidc = Oidc::new(settings(provider.issuer(), &public, authorities)).expect("settings");
        let roles = BTreeMap::from([("quality".into(), Role::Reviewer), ("keepers".into(), Role::Operator)]);
        let named = Provider::new("Plant".into(), public, roles, Arc::new(oidc)).expect("settings");
        let config = ServerConfig {
            address: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
            access: AccessRule::default(),
            entry: Entry::Accounts { accounts: accounts.clone(), provider: Some(Arc::new(named)) },
            tls: None,
            files: WebFiles::Embedded(|_| None),
            limits,
            metrics: None,
        };
        let server = Server::bind(&config, Arc::new(LiveModel::new())).expect("binds");
        let address = server.local_address().expect("bound");
        let serving = tokio::spawn(server.run(std::future::pending()));
        Self { provider, accounts, address, serving, _root: root }
    }

    fn browser(&self) -> Browser {
        Browser::new(self.address, HOST)
    }

    /// Claims of the next tokens that differ from Anna's.
    fn claim(&self, claims: Value) {
        self.provider.state().claims = claims.as_object().expect("an object").clone();
    }

    /// Logs in with `browser` so far that the provider has sent it back: the address that it is to go to.
    async fn sent_back(&self, browser: &mut Browser) -> String {
        let begun = browser.begin("/inspections.html?part=a#top").await;
        assert_eq!(begun.status, 200, "{begun:?}");
        self.provider.log_in(begun.json()["location"].as_str().expect("an address")).await
    }

    /// Logs in: the browser, and the last answer.
    async fn log_in(&self) -> (Browser, Reply) {
        let mut browser = self.browser();
        let back = self.sent_back(&mut browser).await;
        let reply = browser.get(&back).await;
        (browser, reply)
    }

    /// Logs in as `name` with `role`, or fails.
    async fn log_in_as(&self, name: &str, role: &str) -> Browser {
        let (mut browser, reply) = self.log_in().await;
        assert_eq!(reply.status, 303, "{reply:?}");
        assert_eq!(browser.who().await, Some((name.to_owned(), role.to_owned())));
        browser
    }

    /// What the log of accounts says, the earliest first.
    fn logged(&self) -> Vec<String> {
        let entries = self.accounts.log(None, 1000).expect("reads");
        entries.iter().rev().map(|entry| format!("{} by {}", entry.action, entry.by)).collect()
    }
}

fn settings(issuer: String, public: &PublicAddress, authorities: Option<PathBuf>) -> OidcSettings {
    OidcSettings {
        issuer,
        client_id: CLIENT.into(),
        client_secret: Some(SECRET.into()),
        redirect: public.callback(),
        scopes: vec!["openid".into(), "profile".into(), "email".into()],
        groups_claim: "groups".into(),
        authorities,
        patience: Duration::from_secs(1),
    }
}

/// Fails unless `reply` refuses with `status` on a page that says `words`, begins no session and forgets what was begun.
fn assert_refused(reply: &Reply, status: u16, words: &str) {
    assert_eq!(reply.status, status, "{reply:?}");
    assert!(reply.header("content-type").starts_with("text/html") && reply.body.contains(words), "{}", reply.body);
    assert!(reply.cookie("-sign-in").is_some_and(|cookie| cookie.contains("=; ") && cookie.contains("Max-Age=0")));
    assert_eq!(reply.headers.iter().filter(|(name, _)| name == "set-cookie").count(), 1, "{reply:?}");
    for (name, value) in
        [("x-frame-options", "SAMEORIGIN"), ("cache-control", "no-store"), ("referrer-policy", "no-referrer")]
    {
        assert_eq!(reply.header(name), value);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_person_logs_in_with_the_role_of_the_groups_and_is_the_same_one_again() {
    let plant = Plant::start().await;
    let ways = plant.browser().get("/api/v1/login").await;
    assert_eq!(ways.body, r#"{"login":true,"provider":"Plant"}"#);
    let (mut browser, reply) = plant.log_in().await;
    assert_eq!((reply.status, reply.header("location")), (303, "/inspections.html?part=a#top"));
    let port = plant.address.port();
    let session = reply.cookie(&format!("semascan-{port}")).expect("a session");
    for part in ["; HttpOnly", "; SameSite=Strict", "; Max-Age=43200"] {
        assert!(session.contains(part), "{session}");
    }
    assert_eq!(browser.who().await, Some(("anna (Plant)".into(), "reviewer".into())));
    // The best of several roles, from the next login on.
    plant.claim(json!({ "groups": ["keepers", "quality"], "preferred_username": "anna.maria" }));
    let mut again = plant.log_in_as("anna (Plant)", "operator").await;
    plant.claim(json!({ "groups": "quality" }));
    plant.log_in_as("anna (Plant)", "reviewer").await;
    assert_eq!(again.who().await, Some(("anna (Plant)".into(), "reviewer".into())), "in every session");
    let headers = [("x-semascan-request", "1")];
    assert_eq!(again.ask("POST", "/api/v1/logout", &headers, "").await.status, 204);
    assert_eq!((again.who().await, browser.who().await.is_some()), (None, true));
    let issuer = plant.provider.issuer();
    assert_eq!(
        plant.logged()[1..],
        [
            format!("user anna (Plant) added as reviewer, for 7f of {issuer} by the identity provider {issuer}"),
            "anna (Plant) logged in by the identity provider by anna (Plant) from 127.0.0.1".into(),
            format!("role of anna (Plant) set to operator (was reviewer) by the identity provider {issuer}"),
            "anna (Plant) logged in by the identity provider by anna (Plant) from 127.0.0.1".into(),
            format!("role of anna (Plant) set to reviewer (was operator) by the identity provider {issuer}"),
            "anna (Plant) logged in by the identity provider by anna (Plant) from 127.0.0.1".into(),
            "anna (Plant) logged out by anna (Plant) from 127.0.0.1".into(),
        ]
    );
    assert_eq!(plant.accounts.audit(None).expect("reads").fault, None);
    assert_eq!(
        (plant.provider.count(METADATA), plant.provider.count(KEYS)),
        (1, 1),
        "what is known is not asked again"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_answer_that_was_not_asked_for_in_this_browser_is_refused() {
    let plant = Plant::start().await;
    const WORDS: &str = "not begun in this browser";
    let mut browser = plant.browser();
    let back = plant.sent_back(&mut browser).await;
    let ticket = browser.cookies.clone();
    let cookie = browser.cookies.values().next().expect("a ticket").clone();
    assert_eq!(browser.cookies.len(), 1);
    // Somebody else's answer, in the browser of one who began nothing, or something else (login CSRF).
    assert_refused(&plant.browser().get(&back).await, 400, WORDS);
    let mut other = plant.browser();
    let others = plant.sent_back(&mut other).await;
    assert_refused(&browser.clone().get(&others).await, 400, WORDS);
    // Forged, cut, missing.
    let (start, state) = back.split_once("&state=").expect("a state");
    for state in ["", "x", &state[1..], &format!("{state}A"), &state.to_lowercase(), &cookie] {
        assert_refused(&browser.clone().get(&format!("{start}&state={state}")).await, 400, WORDS);
    }
    assert_refused(&browser.clone().get(start).await, 400, WORDS);
    for forged in ["", "A.A", &cookie[1..], &cookie.to_lowercase(), &format!("{cookie}A"), &"A".repeat(4000)] {
        let mut forger = browser.clone();
        forger.cookies.values_mut().for_each(|value| *value = forged.to_owned());
        assert_refused(&forger.get(&back).await, 400, WORDS);
    }
    // Of an agent with another key, as this one has when it starts anew.
    let elsewhere = Plant::start().await;
    let mut stranger = elsewhere.browser();
    elsewhere.sent_back(&mut stranger).await;
    let mut forger = browser.clone();
    let value = stranger.cookies.values().next().expect("a ticket");
    forger.cookies.values_mut().for_each(|own| own.clone_from(value));
    assert_refused(&forger.get(&back).await, 400, WORDS);
    assert_eq!(plant.provider.count(TOKEN), 0, "the provider is not troubled");
    // The real one, once.
    let reply = browser.get(&back).await;
    assert_eq!(reply.status, 303, "{reply:?}");
    assert!(reply.cookie("-sign-in").is_some_and(|cookie| cookie.contains("Max-Age=0")));
    let mut replayed = Browser { cookies: ticket, ..browser };
    assert_refused(&replayed.get(&back).await, 400, WORDS);
    assert_eq!(plant.provider.count(TOKEN), 1);
    let refused =
        "login of an unknown user by the identity provider refused: it was not begun in this browser, or is over";
    assert!(plant.logged().contains(&format!("{refused} by somebody from 127.0.0.1")), "{:?}", plant.logged());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_login_that_takes_too_long_is_over() {
    let limits = Limits { sign_in_s: 1.0, ..Limits::default() };
    let plant = Plant::start_with(TestProvider::start(None).await, limits, None).await;
    let mut browser = plant.browser();
    let back = plant.sent_back(&mut browser).await;
    assert!(plant.log_in().await.1.status == 303, "in time");
    // Times are in whole seconds.
    tokio::time::sleep(Duration::from_millis(2100)).await;
    assert_refused(&browser.get(&back).await, 400, "took too long");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_id_token_is_believed_if_it_is_the_providers_for_this_client_and_this_login() {
    let plant = Plant::start().await;
    let now = Timestamp::now().as_second();
    for claims in [
        json!({ "nonce": "x" }),
        json!({ "nonce": null }),
        json!({ "aud": "another" }),
        json!({ "aud": null }),
        json!({ "aud": [CLIENT, "another"] }),
        json!({ "iss": "https://evil.example" }),
        json!({ "iss": format!("{}/", plant.provider.issuer()) }),
        json!({ "exp": now - 1 }),
        json!({ "exp": 0 }),
    ] {
        plant.claim(claims.clone());
        let (mut browser, reply) = plant.log_in().await;
        // Without an audience it is no token, which is the provider's fault.
        assert!([403, 503].contains(&reply.status), "{claims}: {reply:?}");
        assert_eq!(browser.who().await, None, "{claims}");
    }
    plant.claim(json!({}));
    for signature in [Signature::KeyAs(1, 0), Signature::Key(1), Signature::None, Signature::Secret] {
        plant.provider.state().signature = signature;
        let (mut browser, reply) = plant.log_in().await;
        assert_refused(&reply, 403, "could not be believed");
        assert_eq!(browser.who().await, None, "{signature:?}");
    }
    assert_eq!(plant.accounts.users().expect("reads").len(), 1, "nobody was added");
    plant.provider.state().signature = Signature::Key(0);
    plant.log_in_as("anna (Plant)", "reviewer").await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn keys_that_are_exchanged_are_fetched_again() {
    let plant = Plant::start().await;
    plant.log_in_as("anna (Plant)", "reviewer").await;
    {
        let mut state = plant.provider.state();
        (state.keys, state.signature) = (vec![0, 1], Signature::Key(1));
    }
    plant.log_in_as("anna (Plant)", "reviewer").await;
    plant.log_in_as("anna (Plant)", "reviewer").await;
    assert_eq!(plant.provider.count(KEYS), 2);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_client_shows_who_it_is_as_the_provider_wants_it() {
    let plant = Plant::start().await;
    plant.provider.state().secret_in_body = true;
    plant.log_in_as("anna (Plant)", "reviewer").await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_belongs_to_no_group_that_has_a_role_is_refused() {
    let plant = Plant::start().await;
    for groups in [
        json!(["everybody"]),
        json!(["Quality"]),
        json!([]),
        json!(null),
        json!({ "quality": true }),
        json!([["quality"]]),
    ] {
        plant.claim(json!({ "groups": groups }));
        let (mut browser, reply) = plant.log_in().await;
        assert_refused(&reply, 403, "none of your groups may use this agent");
        assert_eq!(browser.who().await, None);
    }
    assert_eq!(plant.accounts.users().expect("reads").len(), 1, "nobody was added");
    // One who was known is named in the log of accounts.
    plant.claim(json!({}));
    plant.log_in_as("anna (Plant)", "reviewer").await;
    plant.claim(json!({ "groups": [] }));
    assert_refused(&plant.log_in().await.1, 403, "none of your groups");
    let last = plant.logged().pop().expect("an entry");
    assert_eq!(
        last,
        "login of anna (Plant) by the identity provider refused: no group has a role by somebody from 127.0.0.1"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_provider_that_is_down_or_answers_nonsense_is_told_and_users_log_in() {
    let plant = Plant::start().await;
    let any = [Fault::Status(500), Fault::Status(302), Fault::Status(404), Fault::Rubbish, Fault::Endless, Fault::Mute];
    let of_metadata = [Fault::Plain, Fault::OtherIssuer].map(|fault| (METADATA, fault));
    let faults = [METADATA, KEYS].into_iter().flat_map(|endpoint| any.map(|fault| (endpoint, fault)));
    for (endpoint, fault) in faults.chain(of_metadata) {
        plant.provider.fail(endpoint, fault);
        let begun = plant.browser().begin("/").await;
        assert_eq!(begun.status, 503, "{endpoint} {fault:?}: {begun:?}");
        let detail = begun.json()["detail"].as_str().unwrap_or_default().to_owned();
        assert!(detail.starts_with("Plant cannot be asked now") && begun.cookie("-sign-in").is_none(), "{detail}");
    }
    assert_eq!(plant.provider.count("/elsewhere"), 0, "redirections are not followed");
    plant.provider.state().faults.clear();
    for fault in any {
        let mut browser = plant.browser();
        let back = plant.sent_back(&mut browser).await;
        plant.provider.fail(TOKEN, fault);
        assert_refused(&browser.get(&back).await, 503, "Plant cannot be asked now");
        plant.provider.state().faults.clear();
    }
    // Not one of these counts as a wrong attempt, and all of them are counted.
    let mut local = plant.browser();
    let login = local.post("/api/v1/login", json!({ "name": "anna", "password": PASSWORD })).await;
    assert_eq!(login.status, 200, "{login:?}");
    let metrics = local.get("/metrics").await.body;
    let line = r#"semascan_refusals_total{of="logins that the identity provider did not answer"} 20"#;
    assert!(metrics.lines().any(|there| there == line), "{metrics}");
    plant.log_in_as("anna (Plant)", "reviewer").await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_provider_that_is_not_there_is_told() {
    let nobody = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let public = PublicAddress::parse(&format!("http://{HOST}")).expect("an address");
    let issuer = format!("http://{}/plant", nobody.local_addr().expect("bound"));
    let mute = Oidc::new(settings(issuer.clone(), &public, None)).expect("settings");
    let said = |error: Result<_, crate::access::ProviderError>| error.map(drop).expect_err("no metadata").to_string();
    assert!(said(mute.metadata(None).await).contains("does not answer in time"));
    drop(nobody);
    let absent = Oidc::new(settings(issuer, &public, None)).expect("settings");
    assert!(said(absent.metadata(None).await).contains("cannot be reached"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_login_leads_to_this_agent_and_nowhere_else() {
    let plant = Plant::start().await;
    for next in [
        "//evil.example",
        "/\\evil.example",
        "/\t/evil.example",
        "https://evil.example/",
        "javascript:alert(1)",
        "",
        "/\r\nset-cookie: a=b",
    ] {
        let mut browser = plant.browser();
        let begun = browser.begin(next).await;
        let back = plant.provider.log_in(begun.json()["location"].as_str().expect("an address")).await;
        let reply = browser.get(&back).await;
        assert_eq!((reply.status, reply.header("location")), (303, "/"), "{next:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn users_and_people_of_the_provider_are_kept_apart() {
    let plant = Plant::start().await;
    plant.log_in_as("anna (Plant)", "reviewer").await;
    // Whoever is called alike is somebody else, and so is who has the name of a user.
    plant.claim(json!({ "sub": "80", "groups": ["keepers"] }));
    plant.log_in_as("anna 2 (Plant)", "operator").await;
    plant.claim(json!({ "sub": "81", "preferred_username": "anna (plant)", "email": null }));
    plant.log_in_as("person (Plant)", "reviewer").await;
    plant.claim(json!({}));
    plant.log_in_as("anna (Plant)", "reviewer").await;
    let row = plant.accounts.user("anna").expect("reads").expect("there");
    assert_eq!((row.role, row.identity), (Role::Admin, None));
    // No password opens what the provider vouches for.
    let mut browser = plant.browser();
    for (name, expected) in [("anna (Plant)", 401), ("anna", 200)] {
        for password in ["", PASSWORD] {
            let expected = if password.is_empty() { 401 } else { expected };
            let login = browser.post("/api/v1/login", json!({ "name": name, "password": password })).await;
            assert_eq!(login.status, expected, "{name} {password}");
        }
    }
    assert_eq!(browser.who().await, Some(("anna".into(), "admin".into())));
    // Who is removed here stays so, whatever the provider says.
    plant.accounts.remove_user("anna (Plant)", Timestamp::now(), &Actor::Agent).expect("removed");
    plant.claim(json!({ "groups": ["keepers"] }));
    assert_refused(&plant.log_in().await.1, 403, "taken away");
    let row = plant.accounts.user("anna (Plant)").expect("reads").expect("kept");
    assert_eq!(row.role, Role::Reviewer);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_login_is_begun_by_a_page_of_this_agent_at_its_address() {
    let plant = Plant::start().await;
    let mut browser = plant.browser();
    let json = ("content-type", "application/json");
    let header = ("x-semascan-request", "1");
    let body = r#"{"next":"/"}"#;
    for (headers, status) in [
        (&[json][..], 403),
        (&[json, header, ("origin", "http://evil.example")], 403),
        (&[json, header, ("sec-fetch-site", "cross-site")], 403),
        (&[header], 415),
        (&[json, header], 200),
    ] {
        assert_eq!(browser.ask("POST", "/api/v1/oidc", headers, body).await.status, status, "{headers:?}");
    }
    assert_eq!(browser.get("/api/v1/oidc").await.status, 405);
    let mut elsewhere = Browser::new(plant.address, &plant.address.to_string());
    let begun = elsewhere.begin("/").await;
    assert_eq!(begun.status, 421);
    assert!(begun.body.contains("open http://localhost:4242/login.html") && begun.cookie("-sign-in").is_none());
    // What the provider says in place of a code is told, and not repeated.
    let back = plant.sent_back(&mut browser).await;
    let state = back.split_once("&state=").expect("a state").1;
    let declined = format!("/api/v1/oidc/callback?error=access_denied%3Cb%3E&state={state}");
    let reply = browser.get(&declined).await;
    assert_refused(&reply, 403, "Plant did not log you in");
    assert!(!reply.body.contains("access_denied"));
    assert_eq!(plant.provider.count(TOKEN), 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn codes_are_not_guessed() {
    let plant = Plant::start().await;
    let mut statuses = Vec::new();
    for _ in 0..21 {
        let mut browser = plant.browser();
        let back = plant.sent_back(&mut browser).await;
        let state = back.split_once("&state=").expect("a state").1.to_owned();
        statuses.push(browser.get(&format!("/api/v1/oidc/callback?code=guessed&state={state}")).await.status);
    }
    assert_eq!(statuses, [[403; 20].as_slice(), &[429]].concat());
    assert_eq!(plant.provider.count(TOKEN), 20);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_provider_is_asked_over_tls_and_believed_with_its_certificate() {
    let root = tempfile::tempdir().expect("a folder");
    let TlsFiles { certificate, key } = own_certificate(&root.path().join("tls"), &[], &[]).expect("made");
    let tls = Tls::open(TlsFiles { certificate: certificate.clone(), key }).expect("opens");
    let stranger = Plant::start_with(TestProvider::start(Some(tls.acceptor())).await, Limits::default(), None).await;
    assert_eq!(stranger.browser().begin("/").await.status, 503, "a certificate that nobody vouches for");
    assert_eq!(stranger.provider.count(METADATA), 0);
    let public = PublicAddress::parse(&format!("http://{HOST}")).expect("an address");
    let provider = TestProvider::start(Some(tls.acceptor())).await;
    let oidc = Oidc::new(settings(provider.issuer(), &public, Some(certificate.clone()))).expect("settings");
    let metadata = oidc.metadata(None).await.expect("answers");
    assert_eq!(metadata.issuer().as_str(), provider.issuer());
    std::fs::write(&certificate, "no certificate").expect("written");
    assert!(Oidc::new(settings(provider.issuer(), &public, Some(certificate))).is_err());
}

#[test]
fn an_issuer_is_https_or_on_loopback_and_settings_say_no_secret() {
    let public = PublicAddress::parse(&format!("http://{HOST}")).expect("an address");
    let opened =
        |issuer: &str| Oidc::new(settings(issuer.into(), &public, None)).map(drop).map_err(|error| error.to_string());
    for good in [
        "https://id.plant.example",
        "https://id.plant.example:8443/realms/plant",
        "http://127.0.0.1:9/x",
        "http://[::1]:9",
    ] {
        assert_eq!(opened(good), Ok(()), "{good}");
    }
    for wrong in [
        "",
        "id.plant.example",
        "http://id.plant.example",
        "http://10.0.0.7",
        "http://127.0.0.1.evil.example",
        "http://localhost@evil.example",
        "https://user@id.plant.example",
        "https://id.plant.example?x",
        "https://id.plant.example/#x",
        "ftp://127.0.0.1",
    ] {
        assert!(opened(wrong).is_err_and(|said| said.starts_with(&format!("issuer {wrong}: "))), "{wrong}");
    }
    let said = format!("{:?}", settings("https://id.plant.example".into(), &public, None));
    assert!(said.contains(CLIENT) && !said.contains("hunter2"), "{said}");
}
