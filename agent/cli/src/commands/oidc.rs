//! `[serve.oidc]` in `cell.toml`: the identity provider at which people may log in besides the users of the data folder. How it is
//! spoken to is the feature `oidc`; without it the section is refused.

use super::Failure;
use semascan_model::Role;
use semascan_server::Provider;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The section. Nothing in it: there is no provider.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct OidcSection {
    /// The provider's issuer identifier.
    pub(crate) issuer: Option<String>,
    /// What the agent is called there.
    pub(crate) client_id: Option<String>,
    /// A file that holds the client secret.
    pub(crate) client_secret_file: Option<PathBuf>,
    /// An environment variable that holds the client secret.
    pub(crate) client_secret_env: Option<String>,
    /// The address under which browsers reach the agent.
    pub(crate) public_url: Option<String>,
    /// What people call the provider; without it the host of the issuer.
    pub(crate) name: Option<String>,
    /// Scopes to ask for besides `openid`.
    pub(crate) scopes: Vec<String>,
    /// The claim of ID tokens that has the groups.
    pub(crate) groups_claim: String,
    /// What the members of groups may do.
    pub(crate) roles: BTreeMap<String, Role>,
    /// Certificate authorities to believe besides those of the system, as PEM.
    pub(crate) authorities: Option<PathBuf>,
    /// Time for each answer of the provider, in seconds.
    pub(crate) answer_s: f64,
}

impl Default for OidcSection {
    fn default() -> Self {
        Self {
            issuer: None,
            client_id: None,
            client_secret_file: None,
            client_secret_env: None,
            public_url: None,
            name: None,
            scopes: vec!["profile".into(), "email".into()],
            groups_claim: "groups".into(),
            roles: BTreeMap::new(),
            authorities: None,
            answer_s: 10.0,
        }
    }
}

impl OidcSection {
    /// The provider that the section names, if it says anything.
    ///
    /// # Errors
    /// [`Failure`] naming the key that cannot be used, or saying that this program cannot speak to a provider.
    pub(crate) fn provider(&self) -> Result<Option<Provider>, Failure> {
        if *self == Self::default() {
            return Ok(None);
        }
        spoken::provider(self).map(Some)
    }
}

#[cfg(not(feature = "oidc"))]
mod spoken {
    use super::*;
    use anyhow::anyhow;

    pub(super) fn provider(_: &OidcSection) -> Result<Provider, Failure> {
        Err(Failure::Call(anyhow!(
            "[serve.oidc]: this program was built without OpenID Connect: use one that was built with --features oidc, or leave \
             the section out"
        )))
    }
}

#[cfg(feature = "oidc")]
mod spoken {
    use super::*;
    use anyhow::{Context, Result, anyhow, bail, ensure};
    use semascan_server::{Oidc, OidcSettings, PublicAddress};
    use std::sync::Arc;
    use std::time::Duration;

    /// Most bytes of a secret.
    const LONGEST_SECRET: usize = 4096;
    /// Longest time that a provider may take for an answer, in seconds.
    const LONGEST: f64 = 120.0;

    pub(super) fn provider(section: &OidcSection) -> Result<Provider, Failure> {
        read(section).context("[serve.oidc]").map_err(Failure::Call)
    }

    fn read(section: &OidcSection) -> Result<Provider> {
        let issuer = needed("issuer", section.issuer.as_deref())?;
        let address =
            PublicAddress::parse(needed("public_url", section.public_url.as_deref())?).context("public_url")?;
        ensure!(
            (0.1..=LONGEST).contains(&section.answer_s),
            "answer_s: {} is not within 0.1 and {LONGEST}",
            section.answer_s
        );
        let oidc = Oidc::new(OidcSettings {
            issuer: issuer.to_owned(),
            client_id: needed("client_id", section.client_id.as_deref())?.to_owned(),
            client_secret: secret(section)?,
            redirect: address.callback(),
            scopes: section.scopes.clone(),
            groups_claim: section.groups_claim.clone(),
            authorities: section.authorities.clone(),
            patience: Duration::from_secs_f64(section.answer_s),
        })?;
        let name = section.name.clone().unwrap_or_else(|| host(issuer).to_owned());
        Ok(Provider::new(name, address, section.roles.clone(), Arc::new(oidc))?)
    }

    fn needed<'a>(key: &str, value: Option<&'a str>) -> Result<&'a str> {
        value.filter(|value| !value.is_empty()).ok_or_else(|| anyhow!("{key} is missing"))
    }

    /// The host of a URL.
    fn host(url: &str) -> &str {
        let rest = url.split_once("://").map_or(url, |(_, rest)| rest);
        rest.split(['/', ':']).next().unwrap_or_default()
    }

    /// The client secret. No error repeats any of it.
    fn secret(section: &OidcSection) -> Result<Option<String>> {
        let (key, text) = match (&section.client_secret_file, &section.client_secret_env) {
            (None, None) => return Ok(None),
            (Some(_), Some(_)) => bail!("client_secret_file and client_secret_env both name the secret: leave one out"),
            (Some(path), None) => {
                let read = semascan_formats::regular_file::read_to_string(path);
                ("client_secret_file", read.with_context(|| format!("client_secret_file: {}", path.display()))?)
            }
            (None, Some(name)) => {
                let value = std::env::var(name).ok();
                ("client_secret_env", value.ok_or_else(|| anyhow!("client_secret_env: {name} is not set, or no text"))?)
            }
        };
        let secret = text.trim();
        ensure!(!secret.is_empty(), "{key}: there is no secret in it");
        ensure!(secret.len() <= LONGEST_SECRET, "{key}: a secret has {LONGEST_SECRET} bytes at most");
        Ok(Some(secret.to_owned()))
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        fn section() -> OidcSection {
            OidcSection {
                issuer: Some("https://id.plant.example/realms/plant".into()),
                client_id: Some("semascan".into()),
                public_url: Some("https://cell.plant.example:8787".into()),
                roles: BTreeMap::from([("quality".into(), Role::Reviewer)]),
                ..OidcSection::default()
            }
        }

        fn refusal(section: &OidcSection) -> String {
            match section.provider() {
                Err(Failure::Call(error)) => format!("{error:#}"),
                other => panic!("taken: {:?}", other.is_ok()),
            }
        }

        #[test]
        fn a_section_that_is_whole_names_a_provider_and_an_empty_one_none() {
            let provider = section().provider().map_err(|failure| failure.reason()).expect("whole").expect("named");
            assert_eq!(provider.name(), "id.plant.example");
            assert_eq!(provider.callback(), "https://cell.plant.example:8787/api/v1/oidc/callback");
            assert!(OidcSection::default().provider().is_ok_and(|provider| provider.is_none()));
        }

        #[test]
        fn what_is_missing_or_open_is_named() {
            for (wrong, words) in [
                (OidcSection { issuer: None, ..section() }, "issuer is missing"),
                (OidcSection { client_id: Some(String::new()), ..section() }, "client_id is missing"),
                (OidcSection { public_url: None, ..section() }, "public_url is missing"),
                (OidcSection { issuer: Some("http://id.plant.example".into()), ..section() }, "begins with https://"),
                (OidcSection { issuer: Some("https://id.plant.example?x".into()), ..section() }, "without a query"),
                (OidcSection { public_url: Some("http://cell.plant.example".into()), ..section() }, "only loopback"),
                (OidcSection { roles: BTreeMap::new(), ..section() }, "no group has a role"),
                (OidcSection { name: Some("<b>".into()), ..section() }, "is no name"),
                (OidcSection { answer_s: f64::NAN, ..section() }, "answer_s"),
                (OidcSection { authorities: Some("/nowhere.pem".into()), ..section() }, "/nowhere.pem"),
                (OidcSection { client_secret_file: Some("/nowhere".into()), ..section() }, "/nowhere"),
                (
                    OidcSection { client_secret_env: Some("SEMASCAN_NOT_SET".into()), ..section() },
                    "SEMASCAN_NOT_SET is not set",
                ),
            ] {
                let said = refusal(&wrong);
                assert!(said.starts_with("[serve.oidc]: ") && said.contains(words), "{said}");
            }
        }

        #[test]
        fn the_secret_is_read_from_a_file_and_never_said() {
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("secret");
            let given = OidcSection { client_secret_file: Some(path.clone()), ..section() };
            std::fs::write(&path, "hunter2\n").expect("written");
            assert_eq!(secret(&given).expect("reads").as_deref(), Some("hunter2"));
            let both = OidcSection { client_secret_env: Some("X".into()), ..given.clone() };
            assert!(refusal(&both).contains("leave one out"));
            std::fs::write(&path, " \n").expect("written");
            assert!(refusal(&given).contains("there is no secret"));
            std::fs::write(&path, "hunter2".repeat(1000)).expect("written");
            let said = refusal(&given);
            assert!(said.contains("4096 bytes") && !said.contains("hunter2"), "{said}");
        }
    }
}
