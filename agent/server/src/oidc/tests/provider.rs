//! A provider for tests, over real sockets: metadata, keys, an authorization endpoint at which everybody is logged in already, and a
//! token endpoint that takes a code once, from the client that has the secret and the PKCE verifier. It can be told to fail and to
//! lie.

use super::browser::{Reply, exchange};
use axum::body::{Body, Bytes};
use axum::extract::Request;
use axum::http::request::Parts;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use base64::Engine;
use base64::prelude::{BASE64_STANDARD, BASE64_URL_SAFE_NO_PAD as BASE64};
use hmac::{Hmac, KeyInit, Mac};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::TokioIo;
use rustls::SignatureScheme;
use rustls::pki_types::{PrivateKeyDer, PrivatePkcs8KeyDer};
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, HashMap};
use std::convert::Infallible;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, SystemTime};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio_rustls::TlsAcceptor;

pub(super) const CLIENT: &str = "semascan";
/// With what must be escaped in both ways of showing it.
pub(super) const SECRET: &str = "hunter2:+ä&=";
/// RSA keys of 2048 bits: as PKCS #8, and the modulus.
const KEYS: [(&[u8], &str); 2] = [
    (
        include_bytes!("key_1.der"),
        "v0zMtRpDZ9DFEaoH31F4Z2cohlWnnix5oaQeis1QoB6twfW_Ocqc-rQeMcwZWY9YjVcE2pKPFDsX-57JWBy_4UDyxDHyCsZtRAJmSj4wE9oOofMfNUnG\
         VPW_9CfQGIFPYPt_QdcVsjfyDbGwTdIiSQKEba44_5OjOSD3FO8v2ZbBfwwugEdR_wrxfZzWbNkLMEyxX2jLHiB8ZJ2qi-S3PKsYnY7sOokLWBPzTGo6\
         mIA4FGM_0fcUKEdnma6nVPEremt_Vd8KrHq1jGkl2IuXF91idtSNpToH74e_kLknnVcTr209XJC7EbALEmgS4YIg4o7ggcL-flCooxkZf--UDQ",
    ),
    (
        include_bytes!("key_2.der"),
        "6WMa0q0VqtAiF-URNrR-TYMXjz68ywYqYUpuZycW29y5U22KQPzJclqymXBE_h71c2TYCZzGbZa9gjP8smexsJBSWwf2KlzgPXQETlIL1yF0oK7dbI-U\
         bt-mZ7IZAfzKBXIow3jj2kRUvw3PT9llcY_ib-2dmG8pL2zO6X4BxPBOl_mqrwVwraqF3ctPi7-On7_t7hlhgjRXDslKm6hwlZNElL6x3nhIaLksezJH\
         sJ8MODeZF1-1D-L9baXfvbpDbieC9tYsRzrmWmEMANtdFyk1tHmvj_jsvNfp1cv4oyiMRkh-X9if1mDGQexctar_KMLgI4KC3JM-coioVlyVUw",
    ),
];

/// What an endpoint does in place of answering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    Status(u16),
    Rubbish,
    Endless,
    Mute,
    /// It answers, with endpoints that are spoken to over the network as they are.
    Plain,
    /// It answers for somebody else.
    OtherIssuer,
}

/// How ID tokens are signed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Signature {
    /// With a key, by the number that it has among those that there are.
    Key(usize),
    /// With a key under the name of another one.
    KeyAs(usize, usize),
    /// Not at all, and it says so.
    None,
    /// With the client's secret.
    Secret,
}

/// What the provider does.
pub(super) struct State {
    /// Claims that differ from those of Anna; null: it is left out.
    pub(super) claims: Map<String, Value>,
    pub(super) signature: Signature,
    /// The keys that it shows.
    pub(super) keys: Vec<usize>,
    /// What endpoints do in place of answering.
    pub(super) faults: BTreeMap<&'static str, Fault>,
    /// Whether the client's secret is to come in the body.
    pub(super) secret_in_body: bool,
    /// Paths that were asked for.
    pub(super) asked: Vec<String>,
    codes: HashMap<String, Code>,
}

/// What a code was given out for.
struct Code {
    nonce: String,
    challenge: String,
    redirect: String,
}

pub(super) struct TestProvider {
    pub(super) address: SocketAddr,
    scheme: &'static str,
    state: Arc<Mutex<State>>,
    listening: tokio::task::JoinHandle<()>,
}

impl Drop for TestProvider {
    fn drop(&mut self) {
        self.listening.abort();
    }
}

impl TestProvider {
    pub(super) async fn start(tls: Option<TlsAcceptor>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let address = listener.local_addr().expect("bound");
        let scheme = if tls.is_some() { "https" } else { "http" };
        let state = Arc::new(Mutex::new(State {
            claims: Map::new(),
            signature: Signature::Key(0),
            keys: vec![0],
            faults: BTreeMap::new(),
            secret_in_body: false,
            asked: Vec::new(),
            codes: HashMap::new(),
        }));
        let (shared, issuer) = (Arc::clone(&state), format!("{scheme}://{address}/plant"));
        let listening = tokio::spawn(async move {
            while let Ok((stream, _)) = listener.accept().await {
                let (state, issuer, tls) = (Arc::clone(&shared), issuer.clone(), tls.clone());
                tokio::spawn(async move {
                    let Some(tls) = tls else { return serve(stream, state, issuer).await };
                    // A client that does not believe the certificate goes.
                    if let Ok(stream) = tls.accept(stream).await {
                        serve(stream, state, issuer).await;
                    }
                });
            }
        });
        Self { address, scheme, state, listening }
    }

    pub(super) fn issuer(&self) -> String {
        format!("{}://{}/plant", self.scheme, self.address)
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("whole")
    }

    /// How often `path` was asked for.
    pub(super) fn count(&self, path: &str) -> usize {
        self.state().asked.iter().filter(|asked| *asked == path).count()
    }

    /// Makes `endpoint` fail and nothing else.
    pub(super) fn fail(&self, endpoint: &'static str, fault: Fault) {
        self.state().faults = BTreeMap::from([(endpoint, fault)]);
    }

    /// A browser is sent to `location`; the address that it is sent back to.
    pub(super) async fn log_in(&self, location: &str) -> String {
        let Reply { status, headers, .. } = exchange(self.address, "GET", location, &[], "").await;
        assert_eq!(status, 302, "{location}");
        headers.into_iter().find(|(name, _)| name == "location").expect("an address").1
    }
}

async fn serve(stream: impl AsyncRead + AsyncWrite + Unpin, state: Arc<Mutex<State>>, issuer: String) {
    let service = service_fn(move |request: hyper::Request<Incoming>| {
        let (state, issuer) = (Arc::clone(&state), issuer.clone());
        async move { Ok::<_, Infallible>(answer(request.map(Body::new), &state, &issuer).await) }
    });
    // A client that has enough goes.
    let _ = http1::Builder::new().serve_connection(TokioIo::new(stream), service).await;
}

async fn answer(request: Request, state: &Mutex<State>, issuer: &str) -> Response {
    let (head, body) = request.into_parts();
    let body = axum::body::to_bytes(body, 1 << 20).await.expect("a request");
    let response = state.lock().expect("whole").answer(&head, &body, issuer);
    match response {
        Some(response) => response,
        None => std::future::pending().await,
    }
}

fn metadata(state: &State, issuer: &str) -> Value {
    json!({
        "issuer": issuer,
        "authorization_endpoint": format!("{issuer}/authorize?realm=plant"),
        "token_endpoint": format!("{issuer}/token"),
        "jwks_uri": format!("{issuer}/keys"),
        "response_types_supported": ["code"],
        "subject_types_supported": ["public"],
        "id_token_signing_alg_values_supported": ["RS256", "HS256", "none"],
        "token_endpoint_auth_methods_supported":
            [if state.secret_in_body { "client_secret_post" } else { "client_secret_basic" }],
    })
}

/// The fields of a form or a query.
fn fields(text: &str) -> HashMap<String, String> {
    openidconnect::url::form_urlencoded::parse(text.as_bytes()).into_owned().collect()
}

impl State {
    /// The answer to a request; `None` means that none ever comes.
    fn answer(&mut self, head: &Parts, body: &[u8], issuer: &str) -> Option<Response> {
        let path = head.uri.path();
        self.asked.push(path.to_owned());
        let json = [(header::CONTENT_TYPE, "application/json")];
        let response = match (self.faults.get(path).copied(), path) {
            (Some(Fault::Status(status)), _) => {
                let status = StatusCode::from_u16(status).expect("a status");
                (status, [(header::LOCATION, "/elsewhere")], "not now").into_response()
            }
            (Some(Fault::Rubbish), _) => (json, "{\"keys\": [[[").into_response(),
            (Some(Fault::Endless), _) => {
                let more = futures_util::stream::repeat_with(|| Ok::<_, Infallible>(Bytes::from_static(&[b' '; 4096])));
                (json, Body::from_stream(more)).into_response()
            }
            (Some(Fault::Mute), _) => return None,
            (Some(Fault::Plain), _) => {
                let mut metadata = metadata(self, issuer);
                metadata["token_endpoint"] = "http://id.plant.example/token".into();
                axum::Json(metadata).into_response()
            }
            (Some(Fault::OtherIssuer), _) => axum::Json(metadata(self, "http://127.0.0.1:1/plant")).into_response(),
            (None, "/plant/.well-known/openid-configuration") => axum::Json(metadata(self, issuer)).into_response(),
            (None, "/plant/keys") => axum::Json(json!({ "keys": self.public_keys() })).into_response(),
            (None, "/plant/authorize") => self.authorize(head.uri.query().unwrap_or_default()),
            (None, "/plant/token") => self.token(&head.headers, body, issuer),
            (None, _) => StatusCode::NOT_FOUND.into_response(),
        };
        Some(response)
    }

    /// The keys that it shows, and one of a kind that nobody knows.
    fn public_keys(&self) -> Vec<Value> {
        let key = |number: &usize| {
            let (kid, modulus) = (number.to_string(), KEYS[*number].1);
            json!({ "kty": "RSA", "use": "sig", "alg": "RS256", "kid": kid, "n": modulus, "e": "AQAB" })
        };
        self.keys.iter().map(key).chain([json!({ "kty": "odd", "kid": "x" })]).collect()
    }

    fn authorize(&mut self, query: &str) -> Response {
        let fields = fields(query);
        let field = |name: &str| fields.get(name).cloned().unwrap_or_default();
        assert_eq!(
            ["response_type", "client_id", "code_challenge_method", "realm"].map(field),
            ["code", CLIENT, "S256", "plant"],
            "{query}"
        );
        assert_eq!(field("scope"), "openid profile email");
        let code = format!("code {}+&", self.codes.len());
        let [nonce, challenge, redirect, state] = ["nonce", "code_challenge", "redirect_uri", "state"].map(field);
        let query = openidconnect::url::form_urlencoded::Serializer::new(String::new())
            .append_pair("code", &code)
            .append_pair("state", &state)
            .finish();
        let location = format!("{redirect}?{query}");
        self.codes.insert(code, Code { nonce, challenge, redirect });
        (StatusCode::FOUND, [(header::LOCATION, location)]).into_response()
    }

    fn token(&mut self, headers: &HeaderMap, body: &[u8], issuer: &str) -> Response {
        let fields = fields(std::str::from_utf8(body).expect("text"));
        let field = |name: &str| fields.get(name).map_or("", String::as_str);
        let is_client = if self.secret_in_body {
            (field("client_id"), field("client_secret")) == (CLIENT, SECRET)
        } else {
            let given = headers.get(header::AUTHORIZATION).and_then(|value| value.to_str().ok()).unwrap_or_default();
            let pair: String = openidconnect::url::form_urlencoded::byte_serialize(SECRET.as_bytes()).collect();
            given == format!("Basic {}", BASE64_STANDARD.encode(format!("{CLIENT}:{pair}")))
        };
        let error = |name: &str| (StatusCode::BAD_REQUEST, axum::Json(json!({ "error": name }))).into_response();
        if !is_client {
            return error("invalid_client");
        }
        let Some(Code { nonce, challenge, redirect }) = self.codes.remove(field("code")) else {
            return error("invalid_grant");
        };
        let is_known = BASE64.encode(Sha256::digest(field("code_verifier"))) == challenge;
        if !is_known || field("redirect_uri") != redirect || field("grant_type") != "authorization_code" {
            return error("invalid_grant");
        }
        let token = self.id_token(issuer, &nonce);
        axum::Json(json!({ "access_token": "a", "token_type": "Bearer", "id_token": token })).into_response()
    }

    fn id_token(&self, issuer: &str, nonce: &str) -> String {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or(Duration::ZERO).as_secs();
        let mut claims = json!({
            "iss": issuer,
            "sub": "7f",
            "aud": CLIENT,
            "iat": now,
            "exp": now + 60,
            "nonce": nonce,
            "preferred_username": "Anna",
            "email": "anna@plant.example",
            "groups": ["everybody", "quality"],
        });
        for (name, value) in &self.claims {
            claims[name] = value.clone();
        }
        let claims: Map<String, Value> =
            claims.as_object().expect("an object").clone().into_iter().filter(|(_, value)| !value.is_null()).collect();
        let (algorithm, kid) = match self.signature {
            Signature::Key(number) => ("RS256", Some(number)),
            Signature::KeyAs(_, number) => ("RS256", Some(number)),
            Signature::None => ("none", None),
            Signature::Secret => ("HS256", None),
        };
        let mut head = json!({ "alg": algorithm, "typ": "JWT" });
        if let Some(kid) = kid {
            head["kid"] = kid.to_string().into();
        }
        let signed = format!("{}.{}", BASE64.encode(head.to_string()), BASE64.encode(Value::from(claims).to_string()));
        let signature = match self.signature {
            Signature::Key(number) | Signature::KeyAs(number, _) => rs256(KEYS[number].0, signed.as_bytes()),
            Signature::None => Vec::new(),
            Signature::Secret => {
                let mut mac = <Hmac<Sha256> as KeyInit>::new_from_slice(SECRET.as_bytes()).expect("any length");
                mac.update(signed.as_bytes());
                mac.finalize().into_bytes().to_vec()
            }
        };
        format!("{signed}.{}", BASE64.encode(signature))
    }
}

/// RSASSA-PKCS1-v1_5 with SHA-256 (RFC 7518, section 3.3).
fn rs256(key: &[u8], message: &[u8]) -> Vec<u8> {
    let key = PrivateKeyDer::from(PrivatePkcs8KeyDer::from(key.to_vec()));
    let key = rustls::crypto::ring::sign::any_supported_type(&key).expect("an RSA key");
    let signer = key.choose_scheme(&[SignatureScheme::RSA_PKCS1_SHA256]).expect("it signs so");
    signer.sign(message).expect("signed")
}
