//! What an ID token says of a person beyond what the standard names: the groups, in whatever claim the provider puts them.

use openidconnect::AdditionalClaims;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Most groups that are looked at.
const GROUPS: usize = 10_000;

/// The claims that are not of the standard.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(transparent)]
pub(super) struct Claims(Map<String, Value>);

impl AdditionalClaims for Claims {}

impl Claims {
    /// The groups in the claim `name`, one or a list of them. Where no claim has that name, its dots lead into objects
    /// (`realm_access.roles`).
    pub(super) fn groups(&self, name: &str) -> Vec<String> {
        let claim = self.0.get(name).or_else(|| {
            let mut parts = name.split('.');
            let first = self.0.get(parts.next()?);
            parts.fold(first, |value, part| value?.get(part))
        });
        match claim {
            Some(Value::String(group)) => vec![group.clone()],
            Some(Value::Array(groups)) => {
                groups.iter().filter_map(Value::as_str).map(str::to_owned).take(GROUPS).collect()
            }
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_found_where_providers_put_them() {
        let text =
            r#"{"groups":["a","b",7],"one":"c","realm_access":{"roles":["d"]},"https://x.example/g":["e"],"n":null}"#;
        let claims: Claims = serde_json::from_str(text).expect("an object");
        for (name, groups) in [
            ("groups", &["a", "b"][..]),
            ("one", &["c"]),
            ("realm_access.roles", &["d"]),
            ("https://x.example/g", &["e"]),
            ("realm_access", &[]),
            ("realm_access.roles.x", &[]),
            ("n", &[]),
            ("absent.too", &[]),
            ("", &[]),
        ] {
            assert_eq!(claims.groups(name), groups, "{name}");
        }
    }
}
