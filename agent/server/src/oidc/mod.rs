//! An identity provider that speaks OpenID Connect (Core 1.0 and Discovery 1.0): the authorization code flow with PKCE (RFC 7636).
//! What it says is believed where its ID token is signed by one of its keys, comes from the issuer that was named, is for this
//! client and the login that was begun, and has not expired (Core 1.0, section 3.1.3.7).
//!
//! Metadata and keys are fetched when the first person logs in, again when they are an hour old, and when a token is signed by a key
//! that is not among them (section 10.1.1). `http.rs` bounds what the provider can take of the agent.

mod claims;
mod http;
#[cfg(test)]
mod tests;

use crate::access::{Challenge, IdentityProvider, Person, ProviderAnswer, ProviderError};
use crate::guard::{host_name, is_authority, is_loopback};
use claims::Claims;
use http::{HttpClient, RequestError};
use openidconnect::core::{
    CoreAuthDisplay, CoreAuthPrompt, CoreClientAuthMethod, CoreErrorResponseType, CoreGenderClaim, CoreIdTokenVerifier,
    CoreJsonWebKey, CoreJweContentEncryptionAlgorithm, CoreJwsSigningAlgorithm, CoreProviderMetadata, CoreResponseType,
    CoreRevocableToken, CoreRevocationErrorResponse, CoreTokenIntrospectionResponse, CoreTokenType,
};
use openidconnect::{
    AuthType, AuthenticationFlow, AuthorizationCode, ClaimsVerificationError, Client, ClientId, ClientSecret,
    CsrfToken, DiscoveryError, EmptyExtraTokenFields, EndpointMaybeSet, EndpointNotSet, EndpointSet, IdTokenFields,
    IdTokenVerifier, IssuerUrl, Nonce, PkceCodeChallenge, PkceCodeVerifier, RedirectUrl, RequestTokenError, Scope,
    SignatureVerificationError, StandardErrorResponse, StandardTokenResponse,
};
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use semascan_model::account_log::ProviderIdentity;
use std::error::Error;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Mutex;
use tokio::time::Instant;

/// Metadata and keys are believed for so long.
const FRESH: Duration = Duration::from_secs(3600);
/// The scope that makes a request one of OpenID Connect; it is asked for in any case.
const OPENID: &str = "openid";
/// Signatures of tokens that are believed: those that need the provider's private key.
const SIGNATURES: [CoreJwsSigningAlgorithm; 9] = [
    CoreJwsSigningAlgorithm::RsaSsaPkcs1V15Sha256,
    CoreJwsSigningAlgorithm::RsaSsaPkcs1V15Sha384,
    CoreJwsSigningAlgorithm::RsaSsaPkcs1V15Sha512,
    CoreJwsSigningAlgorithm::RsaSsaPssSha256,
    CoreJwsSigningAlgorithm::RsaSsaPssSha384,
    CoreJwsSigningAlgorithm::RsaSsaPssSha512,
    CoreJwsSigningAlgorithm::EcdsaP256Sha256,
    CoreJwsSigningAlgorithm::EcdsaP384Sha384,
    CoreJwsSigningAlgorithm::EdDsa,
];

type TokenFields = IdTokenFields<
    Claims,
    EmptyExtraTokenFields,
    CoreGenderClaim,
    CoreJweContentEncryptionAlgorithm,
    CoreJwsSigningAlgorithm,
>;
type Tokens = StandardTokenResponse<TokenFields, CoreTokenType>;
type OidcClient = Client<
    Claims,
    CoreAuthDisplay,
    CoreGenderClaim,
    CoreJweContentEncryptionAlgorithm,
    CoreJsonWebKey,
    CoreAuthPrompt,
    StandardErrorResponse<CoreErrorResponseType>,
    Tokens,
    CoreTokenIntrospectionResponse,
    CoreRevocableToken,
    CoreRevocationErrorResponse,
    EndpointSet,
    EndpointNotSet,
    EndpointNotSet,
    EndpointNotSet,
    EndpointMaybeSet,
    EndpointMaybeSet,
>;

/// What is known of a provider before it is asked.
#[derive(Clone)]
pub struct OidcSettings {
    /// Its issuer identifier: `https://`, on loopback also `http://`, as its metadata have it, to the last slash.
    pub issuer: String,
    /// What the agent is called there.
    pub client_id: String,
    /// With what the agent shows there who it is; without one it is a public client.
    pub client_secret: Option<String>,
    /// Where the provider sends browsers back to, as it is registered there.
    pub redirect: String,
    /// Scopes to ask for besides `openid`.
    pub scopes: Vec<String>,
    /// The claim of ID tokens that has the groups.
    pub groups_claim: String,
    /// A file with certificate authorities to believe besides those of the system, as PEM.
    pub authorities: Option<PathBuf>,
    /// How long to wait for each answer.
    pub patience: Duration,
}

impl fmt::Debug for OidcSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OidcSettings")
            .field("issuer", &self.issuer)
            .field("client_id", &self.client_id)
            .finish_non_exhaustive()
    }
}

/// Settings with which no provider can be asked.
#[derive(Debug, thiserror::Error)]
pub enum OidcError {
    /// The issuer identifier is none.
    #[error("issuer {issuer}: {reason}")]
    Issuer {
        /// What was given.
        issuer: String,
        /// Why it is none.
        reason: String,
    },
    /// The address to come back to is none.
    #[error("the address to come back to, {0}, is none")]
    Redirect(String),
    /// The file of certificate authorities cannot be used.
    #[error("{}: {reason}", path.display())]
    Authorities {
        /// The file.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
    /// There can be no TLS.
    #[error("no TLS: {0}")]
    Tls(#[from] rustls::Error),
}

/// A provider that speaks OpenID Connect.
pub struct Oidc {
    issuer: IssuerUrl,
    client_id: ClientId,
    client_secret: Option<ClientSecret>,
    redirect: RedirectUrl,
    scopes: Vec<String>,
    groups_claim: String,
    http: HttpClient,
    known: Mutex<Known>,
}

/// What was found out about the provider.
#[derive(Default)]
struct Known {
    metadata: Option<(Arc<CoreProviderMetadata>, Instant)>,
    /// The last time that it did not answer, and why.
    failure: Option<(Instant, ProviderError)>,
}

impl Oidc {
    /// The provider of `settings`. It is asked nothing before somebody logs in.
    ///
    /// # Errors
    /// [`OidcError`] naming the setting.
    pub fn new(settings: OidcSettings) -> Result<Self, OidcError> {
        let OidcSettings { issuer, client_id, client_secret, redirect, scopes, groups_claim, authorities, patience } =
            settings;
        check_issuer(&issuer)?;
        let wrong = |error: &dyn fmt::Display| OidcError::Issuer { issuer: issuer.clone(), reason: error.to_string() };
        let further = authorities.map(read_authorities).transpose()?.unwrap_or_default();
        Ok(Self {
            issuer: IssuerUrl::new(issuer.clone()).map_err(|error| wrong(&error))?,
            client_id: ClientId::new(client_id),
            client_secret: client_secret.map(ClientSecret::new),
            redirect: RedirectUrl::new(redirect.clone()).map_err(|_| OidcError::Redirect(redirect))?,
            scopes: scopes.into_iter().filter(|scope| scope != OPENID).collect(),
            groups_claim,
            http: HttpClient::new(further, patience)?,
            known: Mutex::default(),
        })
    }

    /// Metadata and keys of the provider, fetched after `since` at the earliest. Who asks while they are fetched waits for them.
    async fn metadata(&self, since: Option<Instant>) -> Result<Arc<CoreProviderMetadata>, ProviderError> {
        let asked = Instant::now();
        let mut known = self.known.lock().await;
        if let Some((metadata, fetched)) = &known.metadata
            && fetched.elapsed() < FRESH
            && since.is_none_or(|since| *fetched > since)
        {
            return Ok(Arc::clone(metadata));
        }
        if let Some((failed, error)) = &known.failure
            && *failed > asked
        {
            return Err(error.clone());
        }
        let fetched = CoreProviderMetadata::discover_async(self.issuer.clone(), &self.http).await;
        match fetched.map_err(|error| discovery_failed(&error)).and_then(checked) {
            Ok(metadata) => {
                let metadata = Arc::new(metadata);
                known.metadata = Some((Arc::clone(&metadata), Instant::now()));
                Ok(metadata)
            }
            Err(error) => {
                known.failure = Some((Instant::now(), error.clone()));
                Err(error)
            }
        }
    }

    /// What speaks to the provider that `metadata` describe.
    fn client(&self, metadata: &CoreProviderMetadata) -> OidcClient {
        let client =
            OidcClient::from_provider_metadata(metadata.clone(), self.client_id.clone(), self.client_secret.clone());
        let methods = metadata.token_endpoint_auth_methods_supported();
        let takes = |method| methods.is_none_or(|methods| methods.contains(&method));
        let auth_type = match takes(CoreClientAuthMethod::ClientSecretBasic) {
            true => AuthType::BasicAuth,
            false => AuthType::RequestBody,
        };
        client.set_redirect_uri(self.redirect.clone()).set_auth_type(auth_type)
    }

    /// The tokens for which the provider takes `code`.
    async fn tokens(&self, client: &OidcClient, challenge: &Challenge, code: String) -> Result<Tokens, ProviderError> {
        let request = client
            .exchange_code(AuthorizationCode::new(code))
            .map_err(|_| ProviderError::Unavailable("its metadata name no token endpoint".into()))?
            .set_pkce_verifier(PkceCodeVerifier::new(challenge.verifier.clone()));
        request.request_async(&self.http).await.map_err(|error| match error {
            RequestTokenError::ServerResponse(response) => {
                let code: &str = response.error().as_ref();
                ProviderError::Rejected(format!("the token endpoint refuses the code: {code}"))
            }
            RequestTokenError::Request(error) => ProviderError::Unavailable(error.to_string()),
            // What it answers may hold a token: only where it cannot be read is said.
            RequestTokenError::Parse(error, _) => ProviderError::Unavailable(format!(
                "the token endpoint answers what cannot be read, at {}",
                error.path()
            )),
            RequestTokenError::Other(reason) => ProviderError::Unavailable(format!("the token endpoint: {reason}")),
        })
    }

    /// What believes ID tokens of the provider that `metadata` describe.
    fn verifier(&self, metadata: &CoreProviderMetadata) -> CoreIdTokenVerifier<'static> {
        let (client_id, issuer, keys) = (self.client_id.clone(), metadata.issuer().clone(), metadata.jwks().clone());
        // A client's secret signs nothing: it is no verifier's business.
        IdTokenVerifier::new_public_client(client_id, issuer, keys).set_allowed_algs(SIGNATURES)
    }

    async fn person_of(&self, challenge: &Challenge, code: String) -> Result<Person, ProviderError> {
        let mut metadata = self.metadata(None).await?;
        let tokens = self.tokens(&self.client(&metadata), challenge, code).await?;
        let token = tokens.extra_fields().id_token();
        let token = token.ok_or_else(|| ProviderError::Rejected("there is no ID token".into()))?;
        let nonce = Nonce::new(challenge.nonce.clone());
        let asked = Instant::now();
        let first = token.claims(&self.verifier(&metadata), &nonce);
        if matches!(
            first,
            Err(ClaimsVerificationError::SignatureVerification(SignatureVerificationError::NoMatchingKey))
        ) {
            metadata = self.metadata(Some(asked)).await?;
        }
        let claims = token.claims(&self.verifier(&metadata), &nonce);
        let claims = claims.map_err(|error| ProviderError::Rejected(in_words(&error)))?;
        let names = [claims.preferred_username().map(|name| name.as_str()), claims.email().map(|email| email.as_str())];
        let identity =
            ProviderIdentity { issuer: self.issuer.as_str().to_owned(), subject: claims.subject().as_str().to_owned() };
        let groups = claims.additional_claims().groups(&self.groups_claim);
        Ok(Person { identity, names: names.into_iter().flatten().map(str::to_owned).collect(), groups })
    }
}

impl IdentityProvider for Oidc {
    fn authorization<'a>(&'a self, challenge: &'a Challenge) -> ProviderAnswer<'a, String> {
        Box::pin(async move {
            let client = self.client(self.metadata(None).await?.as_ref());
            let (state, nonce) = (challenge.state.clone(), challenge.nonce.clone());
            let verifier = PkceCodeVerifier::new(challenge.verifier.clone());
            let flow = AuthenticationFlow::<CoreResponseType>::AuthorizationCode;
            let (url, ..) = client
                .authorize_url(flow, || CsrfToken::new(state), || Nonce::new(nonce))
                .add_scopes(self.scopes.iter().cloned().map(Scope::new))
                .set_pkce_challenge(PkceCodeChallenge::from_code_verifier_sha256(&verifier))
                .url();
            Ok(url.into())
        })
    }

    fn person<'a>(&'a self, challenge: &'a Challenge, code: String) -> ProviderAnswer<'a, Person> {
        Box::pin(self.person_of(challenge, code))
    }
}

/// Whether what `url` says goes over no network as plain text.
fn is_closed(url: &str) -> bool {
    let host = |rest: &str| host_name(rest.split('/').next().unwrap_or_default()).to_owned();
    url.starts_with("https://") || url.strip_prefix("http://").is_some_and(|rest| is_loopback(&host(rest)))
}

fn check_issuer(issuer: &str) -> Result<(), OidcError> {
    let wrong = |reason: &str| OidcError::Issuer { issuer: issuer.to_owned(), reason: reason.to_owned() };
    let rest = issuer.strip_prefix("https://").or_else(|| issuer.strip_prefix("http://"));
    let authority = rest.and_then(|rest| rest.split('/').next());
    if !is_closed(issuer) {
        return Err(wrong("an issuer begins with https://; only one on loopback may do without TLS"));
    }
    if issuer.contains(['?', '#']) || !authority.is_some_and(is_authority) {
        return Err(wrong("an issuer is https://HOST[:PORT][/PATH], without a query"));
    }
    Ok(())
}

/// `metadata` whose endpoints can be asked without telling the network.
fn checked(metadata: CoreProviderMetadata) -> Result<CoreProviderMetadata, ProviderError> {
    let endpoints = [
        Some(metadata.authorization_endpoint().as_str()),
        metadata.token_endpoint().map(|endpoint| endpoint.as_str()),
        Some(metadata.jwks_uri().as_str()),
    ];
    let open = endpoints.into_iter().flatten().find(|endpoint| !is_closed(endpoint)).map(str::to_owned);
    match open {
        Some(endpoint) => Err(ProviderError::Unavailable(format!("its endpoint {endpoint} is not https"))),
        None => Ok(metadata),
    }
}

fn discovery_failed(error: &DiscoveryError<RequestError>) -> ProviderError {
    ProviderError::Unavailable(format!("no metadata and keys: {}", in_words(error)))
}

/// An error and those that it comes from, each once.
fn in_words(error: &dyn Error) -> String {
    let (mut text, mut next) = (error.to_string(), error.source());
    while let Some(cause) = next {
        let said = cause.to_string();
        if !text.ends_with(&said) {
            text = format!("{text}: {said}");
        }
        next = cause.source();
    }
    text
}

/// The certificates in the file at `path`.
fn read_authorities(path: PathBuf) -> Result<Vec<CertificateDer<'static>>, OidcError> {
    let wrong = |reason: String| OidcError::Authorities { path: path.clone(), reason };
    let certificates = CertificateDer::pem_file_iter(&path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    match certificates {
        Ok(certificates) if certificates.is_empty() => Err(wrong("there is no certificate in it".into())),
        Ok(certificates) => Ok(certificates),
        Err(error) => Err(wrong(error.to_string())),
    }
}
